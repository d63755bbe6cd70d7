//! The domain `indentation`: curves of force over depth with concealed effects.

use std::fmt::Write as _;

use rand_chacha::ChaCha8Rng;

use super::draw::{self, between, choose, log_between, sign, stated, whole};
use super::key::{Hidden, Key, Place};
use super::nuisances::{Nuisances, difference};
use super::rig::{Choice, Rig};
use crate::noise::Noise;
use crate::physics::indentation::{
    Effects, IndentationWorld, Indenter, Later, Rim, Ripple, Slip, Step, Stratum,
};

/// Listed effects; the last three act on spheres only, and viscoelasticity needs times.
const LISTED: usize = 10;
const FOR_ALL: usize = 7;
const RELAXES: usize = 6;
const UNLISTED: usize = 3;
/// Unlisted effects that act at a place.
const LOCAL: [usize; 3] = [2, 3, 4];
/// Runs of one condition in which one may be off from a run on.
const REPEATS: usize = 5;

/// Conditions: name of the column, and their labels.
type Conditions = (&'static str, Vec<String>);

/// An indenter with its load cell.
pub(crate) struct Press {
    world: IndentationWorld,
    conditions: Option<Conditions>,
    timed: bool,
    noise: Noise,
    /// One sigma of a reading.
    sigma: f64,
    deepest_m: f64,
    /// Force at the largest depth without effects, in the softest condition.
    force_n: f64,
    /// Force at the largest depth without effects, in the stiffest condition.
    stiffest_n: f64,
    signs: [f64; 2],
    tau_s: f64,
    /// Depth at which a rim is met, or a membrane slips.
    depth_m: f64,
    pitch_m: f64,
    /// Depths of a layer that is softer.
    stratum_m: [f64; 2],
    /// The first run that is stiffer, counted from 0.
    from_run: usize,
}

impl Rig for Press {
    const DOMAIN: &'static str = "indentation";
    type Effects = Effects;

    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice) {
        let sphere = whole(rng, 0, 4) > 0;
        let listed = choose(rng, if sphere { LISTED } else { FOR_ALL }, hidden.listed());
        let unlisted = match hidden {
            Hidden::Local => LOCAL[whole(rng, 0, LOCAL.len() - 1)],
            _ => whole(rng, 0, UNLISTED - 1),
        };
        let returns = hidden.unlisted() && unlisted == 0;
        let mut press = Self::drawn(sphere, returns, listed.contains(&RELAXES), rng);
        if hidden == Hidden::Local {
            press.repeat(whole(rng, 2, REPEATS - 1), rng);
        }
        (press, Choice { listed, unlisted })
    }

    fn candidates(&self) -> Vec<usize> {
        let count = if matches!(self.world.indenter, Indenter::Sphere(_)) { LISTED } else { FOR_ALL };
        (0..count).filter(|listed| self.timed || *listed != RELAXES).collect()
    }

    /// Each unlisted effect has one sign.
    fn unlisted_sign(_: &mut ChaCha8Rng) -> f64 {
        1.0
    }

    /// The changes of the readings that the moduli can make.
    fn nuisances(&self) -> Nuisances {
        let baseline = self.whitened(Effects::default(), &self.world.moduli_pa);
        let mut nuisances = Nuisances::default();
        for condition in 0..self.world.moduli_pa.len() {
            let mut moduli_pa = self.world.moduli_pa.clone();
            moduli_pa[condition] *= 1.01;
            nuisances.add(&difference(&baseline, &self.whitened(Effects::default(), &moduli_pa)));
        }
        nuisances
    }

    fn response(&self, effects: Effects) -> Vec<f64> {
        let moduli = &self.world.moduli_pa;
        difference(&self.whitened(Effects::default(), moduli), &self.whitened(effects, moduli))
    }

    /// A relaxation may take any time.
    fn directions(&self) -> Vec<Vec<f64>> {
        let middle = |[low, high]: [f64; 2]| (low * high).sqrt();
        let of = |listed: usize| {
            let one = self.alone(listed, middle(self.size_bounds(listed)));
            let times: &[f64] =
                if listed == RELAXES { &[0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0] } else { &[1.0] };
            times.iter().map(move |factor| Effects { tau_s: factor * one.tau_s, ..one })
        };
        self.candidates().into_iter().flat_map(of).map(|effects| self.response(effects)).collect()
    }

    fn size_bounds(&self, listed: usize) -> [f64; 2] {
        let (d, f) = (self.deepest_m, self.force_n);
        match listed {
            0 => [1e-3 * d, 0.15 * d],
            1 => [1e-3 * f / d, 0.7 * f / d],
            2 => [1e-3 * f / d.powi(3), 0.7 * f / d.powi(3)],
            3 => [1e-3 * f / d, f / d],
            4 => [1e-4 * d / self.stiffest_n, 0.2 * d / self.stiffest_n],
            5 => [2e-2 * self.sigma, 0.2 * f],
            RELAXES => [2e-3, 0.5],
            7 => [1e-4, 0.5],
            8 => [0.01, 0.45],
            _ => [1e-3, 0.6],
        }
    }

    fn apply(&self, e: &mut Effects, listed: usize, size: f64) {
        match listed {
            0 => e.contact_offset_m = self.signs[0] * size,
            1 => e.tension_n_m = size,
            2 => e.stretching_n_m3 = size,
            3 => e.rim = Rim { depth_m: self.depth_m, stiffness_n_m: size },
            4 => e.compliance_m_n = size,
            5 => e.force_offset_n = self.signs[1] * size,
            RELAXES => (e.relaxed_fraction, e.tau_s) = (size, self.tau_s),
            7 => e.adhesion_j_m2 = size,
            8 => {
                if let Indenter::Sphere(radius) = self.world.indenter {
                    e.thickness_m = (radius * self.deepest_m).sqrt() / size;
                }
            }
            _ => e.stiffening = size,
        }
    }

    fn describe(&self, e: &Effects, listed: usize, key: &mut Key) {
        match listed {
            0 => key.add("contact-offset", &[("offset_m", e.contact_offset_m)]),
            1 => key.add("membrane-tension", &[("stiffness_n_m", e.tension_n_m)]),
            2 => key.add("membrane-stretching", &[("coefficient_n_m3", e.stretching_n_m3)]),
            3 => {
                key.add("rim-contact", &[("depth_m", e.rim.depth_m), ("stiffness_n_m", e.rim.stiffness_n_m)]);
                key.place = Some(self.beyond_depth());
            }
            4 => key.add("load-cell-compliance", &[("compliance_m_n", e.compliance_m_n)]),
            5 => key.add("force-offset", &[("offset_n", e.force_offset_n)]),
            RELAXES => {
                key.add("viscoelasticity", &[("relaxed_fraction", e.relaxed_fraction), ("tau_s", e.tau_s)]);
            }
            7 => key.add("adhesion", &[("work_of_adhesion_j_m2", e.adhesion_j_m2)]),
            8 => key.add("finite-thickness", &[("thickness_m", e.thickness_m)]),
            _ => key.add("strain-stiffening", &[("coefficient", e.stiffening)]),
        }
    }

    fn unlisted_size_bounds(&self, which: usize) -> [f64; 2] {
        match which {
            0 => [2e-3, 0.6],
            1 => [0.05 * self.sigma, 0.2 * self.force_n],
            3 => [1e-3 * self.force_n / self.deepest_m, 3.0 * self.force_n / self.deepest_m],
            4 => [1e-3, 0.5],
            _ => [0.05 * self.sigma, 0.3 * self.force_n],
        }
    }

    fn unlisted(&self, beside: Effects, which: usize, _sign: f64, size: f64) -> Effects {
        match which {
            0 => Effects { dent: size, ..beside },
            1 => Effects { ripple: Ripple { amplitude_n: size, pitch_m: self.pitch_m }, ..beside },
            3 => {
                let layer = Stratum { stiffness_n_m: -size, between_m: self.stratum_m };
                Effects { layer, ..beside }
            }
            4 => Effects { later: Later { stiffer: size, from_run: self.from_run }, ..beside },
            _ => Effects { slip: Slip { depth_m: self.depth_m, force_n: size }, ..beside },
        }
    }

    fn describe_unlisted(&self, which: usize, key: &mut Key) {
        let (what, place) = match which {
            0 => ("a dent that stays: the way back is another", None),
            1 => ("a ripple of the drive, periodic in depth", None),
            3 => {
                let [top, bottom] = self.stratum_m;
                ("a softer layer", Some(Place::new("delta_m", top, bottom)))
            }
            4 => {
                let later = (self.from_run..self.world.runs.len()).map(|run| (run + 1).to_string());
                let place = Place::new("run", f64::NEG_INFINITY, f64::INFINITY).in_runs(later);
                ("a stiffer body from one run on", Some(place))
            }
            _ => ("a membrane that slips at a depth", Some(self.after_slip())),
        };
        key.unlisted = Some(what.into());
        key.place = place;
    }

    fn files(self, effects: Effects, rng: &mut ChaCha8Rng) -> [String; 2] {
        let w = IndentationWorld { effects, ..self.world };
        let mut header = String::from("format = 1\ndomain = \"indentation\"\ndata = \"data.csv\"\n");
        if whole(rng, 0, 2) > 0 {
            let _ = write!(header, "\n[noise]\nforce_n = {:.3e}\n", stated(rng, &self.noise));
        }
        let indenter = match w.indenter {
            Indenter::Sphere(radius) => format!("shape = \"sphere\", radius_m = {radius}"),
            Indenter::Cylinder(radius) => format!("shape = \"cylinder\", radius_m = {radius}"),
            Indenter::Cone(angle) => format!("shape = \"cone\", angle_rad = {angle}"),
        };
        let _ = write!(header, "\n[rig]\nindenter = {{ {indenter} }}\npoisson_ratio = {}\n", w.poisson_ratio);
        let mut data = String::from("run,delta_m,force_n");
        data.push_str(if self.timed { ",t_s,segment" } else { "" });
        if let Some((column, _)) = &self.conditions {
            let _ = write!(data, ",{column}");
        }
        data.push('\n');
        let readings = w.readings();
        let mut rest = readings.as_slice();
        for (run, (condition, steps)) in w.runs.iter().enumerate() {
            let (own, others) = rest.split_at(steps.len());
            rest = others;
            let mut forces = own.to_vec();
            self.noise.apply(&mut forces, rng);
            for (i, (step, force)) in steps.iter().zip(&forces).enumerate() {
                let _ = write!(data, "{},{:.6},{force:.6}", run + 1, step.delta_m);
                if self.timed {
                    let rests = i > 0 && step.down && steps[i - 1].delta_m >= step.delta_m;
                    let segment = if rests {
                        "hold"
                    } else if step.down {
                        "load"
                    } else {
                        "unload"
                    };
                    let _ = write!(data, ",{:.4},{segment}", step.t_s);
                }
                if let Some((_, labels)) = &self.conditions {
                    let _ = write!(data, ",{}", labels[*condition]);
                }
                data.push('\n');
            }
        }
        [header, data]
    }
}

impl Press {
    fn drawn(sphere: bool, returns: bool, relaxes: bool, rng: &mut ChaCha8Rng) -> Self {
        let radius_m = [0.005, 0.0075, 0.01, 0.0125][whole(rng, 0, 3)];
        let indenter =
            if sphere { Indenter::Sphere(radius_m) } else { Indenter::Cone(between(rng, 0.3, 0.9)) };
        let deepest_m = 1e-4 * (1e4 * radius_m * between(rng, 0.25, 0.7)).round();
        let conditions = conditions(rng);
        let kinds = conditions.as_ref().map_or(1, |(_, labels)| labels.len());
        let softest = log_between(rng, 8e3, 5e4);
        let stiffer = between(rng, 0.3, 1.2);
        let moduli_pa: Vec<f64> = (0..kinds).map(|k| softest * (1.0 + stiffer * k as f64)).collect();
        let timed = whole(rng, 0, 4) < 3 || relaxes;
        let rests = timed && (whole(rng, 0, 2) > 0 || relaxes);
        let up = returns || (timed && whole(rng, 0, 1) == 0);
        let speed_m_s = log_between(rng, 3e-4, 3e-3);
        let path = path(deepest_m, whole(rng, 25, 60), speed_m_s, rests.then(|| between(rng, 4.0, 15.0)), up);
        let repeats = whole(rng, if kinds == 1 { 2 } else { 1 }, 3);
        let runs = (0..kinds * repeats).map(|run| (run / repeats, path.clone())).collect();
        let poisson_ratio = if whole(rng, 0, 3) == 0 { 0.45 } else { 0.5 };
        let plane = softest / (1.0 - poisson_ratio * poisson_ratio);
        let force_n = indenter.force_n(plane, deepest_m);
        // A load cell that suits the forces.
        let force = (force_n * log_between(rng, 3e-3, 2e-2)).clamp(5e-4, 1.5e-2);
        let noise = draw::noise(rng, force);
        Self {
            force_n,
            stiffest_n: force_n * moduli_pa[kinds - 1] / softest,
            world: IndentationWorld { indenter, poisson_ratio, moduli_pa, runs, effects: Effects::default() },
            conditions,
            timed: timed || returns,
            sigma: draw::sigma(&noise),
            noise,
            deepest_m,
            signs: [sign(rng), sign(rng)],
            tau_s: log_between(rng, 0.3, 8.0),
            depth_m: deepest_m * between(rng, 0.4, 0.75),
            pitch_m: deepest_m * between(rng, 0.12, 0.3),
            stratum_m: [0.0; 2],
            from_run: 0,
        }
    }

    /// Runs of one condition, and where something local acts in them.
    fn repeat(&mut self, from_run: usize, rng: &mut ChaCha8Rng) {
        let path = self.world.runs[0].1.clone();
        self.conditions = None;
        self.world.moduli_pa.truncate(1);
        self.world.runs = vec![(0, path); REPEATS];
        self.from_run = from_run;
        let top = self.deepest_m * between(rng, 0.35, 0.6);
        self.stratum_m = [top, top + self.deepest_m * between(rng, 0.12, 0.25)];
    }

    /// Readings in sigmas.
    fn whitened(&self, effects: Effects, moduli_pa: &[f64]) -> Vec<f64> {
        let world = IndentationWorld { effects, moduli_pa: moduli_pa.to_vec(), ..self.world.clone() };
        world.readings().iter().map(|force| force / self.sigma).collect()
    }

    fn beyond_depth(&self) -> Place {
        Place::new("delta_m", self.depth_m, self.deepest_m)
    }

    /// Where a slip shows: from a time on where there is a way back, on which the membrane stays slipped; else from a depth on.
    fn after_slip(&self) -> Place {
        let path = &self.world.runs[0].1;
        let slips =
            path.iter().find(|step| step.delta_m >= self.depth_m).filter(|_| path.iter().any(|s| !s.down));
        slips.map_or_else(|| self.beyond_depth(), |slips| Place::new("t_s", slips.t_s, f64::INFINITY))
    }
}

/// The condition that varies from run to run, if one does.
fn conditions(rng: &mut ChaCha8Rng) -> Option<Conditions> {
    let count = whole(rng, 2, 4);
    let numbers = |step: f64| (0..count).map(|k| format!("{}", step * k as f64)).collect();
    match whole(rng, 0, 3) {
        0 => None,
        1 => Some(("pressure_pa", numbers([500.0, 1000.0, 2000.0][whole(rng, 0, 2)]))),
        2 => Some(("stretch_m", numbers([0.01, 0.02][whole(rng, 0, 1)]))),
        _ => Some(("site", (0..count).map(|k| format!("s{k}")).collect())),
    }
}

/// Down in even steps, a rest of some seconds, and up again.
fn path(deepest_m: f64, rows: usize, speed_m_s: f64, rest_s: Option<f64>, up: bool) -> Vec<Step> {
    // Readings are written to a micrometre.
    let depth = |k: usize| (deepest_m * k as f64 / rows as f64 * 1e6).round() * 1e-6;
    let step_s = deepest_m / rows as f64 / speed_m_s;
    let mut path: Vec<Step> =
        (0..=rows).map(|k| Step { delta_m: depth(k), t_s: depth(k) / speed_m_s, down: true }).collect();
    let mut t_s = rows as f64 * step_s;
    if let Some(rest_s) = rest_s {
        path.extend((1..=rows).map(|k| Step {
            delta_m: depth(rows),
            t_s: t_s + rest_s * k as f64 / rows as f64,
            down: true,
        }));
        t_s += rest_s;
    }
    if up {
        path.extend((1..=rows).map(|k| Step {
            delta_m: depth(rows - k),
            t_s: t_s + k as f64 * step_s,
            down: false,
        }));
    }
    path
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;
    use crate::concealed::rig::tests::every_effect_shows;

    /// An effect at a place moves the readings there and nowhere else.
    #[test]
    fn the_key_says_where_an_effect_acts() {
        let mut ways_back = 0;
        for seed in 0..20 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let press = Press::drawn(seed % 2 == 0, false, false, &mut rng);
            let rim = press.alone(3, press.size_bounds(3)[1]);
            let slip = press.unlisted(Effects::default(), 2, 1.0, press.unlisted_size_bounds(2)[1]);
            for (effects, place) in [(rim, press.beyond_depth()), (slip, press.after_slip())] {
                let in_time = place.variable == "t_s";
                ways_back += u32::from(in_time);
                let steps = press.world.runs.iter().flat_map(|(_, path)| path);
                for (step, moved) in steps.zip(press.response(effects)) {
                    let at = if in_time { step.t_s } else { step.delta_m };
                    assert_eq!(moved != 0.0, at >= place.from && at <= place.to, "seed {seed}, {step:?}");
                }
            }
        }
        assert!(ways_back > 0);
    }

    #[test]
    fn every_effect_changes_the_readings_by_more_than_a_baseline_takes() {
        for seed in 0..3 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let press = Press::drawn(true, true, true, &mut rng);
            every_effect_shows(&press, UNLISTED, 5.0, [10.0; 2]);
        }
    }
}
