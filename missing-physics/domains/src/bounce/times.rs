//! The full model where only times were measured: when each impact is heard.
//!
//! Where the ball heads is not seen. A direction that scatters shortens its flights a little, a restitution that scatters from impact to
//! impact shortens or lengthens all later ones, which adds up along a drop: errors of times accumulate, and the engine finds by how much.

use std::collections::HashMap;

use missing_physics::data::Run;
use missing_physics::model::{
    ErrorModel, Extensions, Model, ParameterRef, PredictError, Scope, Spec, UNBOUNDED,
};

use bounce_audio::impact::{rebound, speed_after_drop};
use bounce_audio::missed::parts;

use super::drop::Drop;
use super::effects::Effects;
use super::setup::Setup;
use super::spec::{Layout, build};

/// The model of times alone.
#[derive(Debug)]
pub(super) struct TimesModel {
    setup: Setup,
    spec: Spec,
    layout: Layout,
    begins: ParameterRef,
    leaves: Option<ParameterRef>,
    height_m: Option<f64>,
    longest_noise: f64,
    largest_scatter: f64,
    /// What a scatter of the restitution adds to each time of a run, by its label ([`ErrorModel::accumulated`]).
    scattered: HashMap<String, Vec<Vec<f64>>>,
}

/// Impacts over which errors may hang together: heard ones, by their fading loudness, and any whose size is stated ...
const LONGEST_HEARD: f64 = 3.0;
/// ... and those that were marked one by one, of a size that is not known: neighbours alike by a third (exp(-1)).
const LONGEST_MARKED: f64 = 1.0;

/// The largest scatter of the restitution's logarithm that a single drop is thought to show: one that is larger adds up to what drag
/// looks like, and is taken for physics.
const SCATTER_IN_ONE: f64 = 2e-3;

/// Inputs of a row: the impact's number, and how many impacts went unheard before it in its run: known ones, all.
const KNOWN: usize = 1;
const FOUND: usize = 2;

impl TimesModel {
    /// `stated`: whether the clock's sigma is.
    pub(super) fn new(setup: Setup, restitution: f64, height_m: Option<f64>, stated: bool) -> Self {
        let (spec, layout, begins, leaves) = build_times(&setup, restitution);
        let longest_noise = if setup.listened || stated { LONGEST_HEARD } else { LONGEST_MARKED };
        let largest_scatter = if setup.unheard[1] > 1 { f64::INFINITY } else { SCATTER_IN_ONE };
        let scattered = HashMap::new();
        Self { setup, spec, layout, begins, leaves, height_m, longest_noise, largest_scatter, scattered }
    }

    /// Takes note of a measured drop: how late an impact is by the restitution of those before it.
    pub(super) fn heard(&mut self, label: &str, drop: &Drop, restitution: f64) {
        let mut impacts_s = vec![drop.times_s[0]];
        for (flight, pair) in drop.times_s.windows(2).enumerate() {
            let hidden = drop.unheard.get(flight + 1).copied().unwrap_or(0);
            let (first, _) = parts(pair[1] - pair[0], hidden, restitution);
            let mut t_s = pair[0];
            for k in 0..hidden {
                t_s += first * restitution.powi(k as i32);
                impacts_s.push(t_s);
            }
            impacts_s.push(pair[1]);
        }
        // How fast a ball leaves the first impact is an unknown of its own, unless its fall is known.
        impacts_s.drain(..usize::from(self.leaves.is_some()));
        let late = |t_s: &f64| impacts_s.iter().map(|before| (t_s - before).max(0.0)).collect();
        self.scattered.insert(label.to_owned(), drop.times_s.iter().map(late).collect());
    }

    /// The run of a drop.
    pub(super) fn run(label: &str, drop: &Drop, numbers: &[f64]) -> Run {
        let sum = |hidden: &[usize]| {
            let before = hidden.iter().scan(0, |all, h| {
                *all += h;
                Some(*all as f64)
            });
            before.take(drop.times_s.len()).collect::<Vec<f64>>()
        };
        let inputs = vec![numbers.to_vec(), sum(&drop.known), sum(&drop.unheard)];
        Run { label: label.into(), inputs, outputs: vec![drop.times_s.clone()], kind: 0 }
    }

    /// Nuisance parameters of a drop that begins at t = 0 and leaves the table at a speed.
    pub(super) fn nuisance(&self, leaves_m_s: f64) -> Vec<f64> {
        let mut nuisance = vec![0.0; self.spec.count(Scope::PerRun)];
        if let Some(at) = self.leaves {
            nuisance[at.slot] = leaves_m_s;
        }
        nuisance
    }

    /// What changes a bounce, at some values of the shared parameters.
    pub(super) fn effects(&self, shared: &[f64]) -> Effects {
        let p = &self.layout;
        let none = Effects::none(self.setup.gravity_m_s2, shared[p.restitution.slot]);
        let at = |at: Option<ParameterRef>| at.map_or(0.0, |at| shared[at.slot]);
        Effects {
            slope_s_m: shared[p.slope.slot],
            drag_per_m: shared[p.drag.slot] * self.setup.drag_unit.unwrap_or(1.0),
            clock_rate: at(p.clock),
            unheard: at(p.unheard),
            terms: [0.0, 0.0, shared[p.squared.slot]],
            ..none
        }
    }

    /// Times of the impacts that are heard, of all that there are: so many went unheard before each, `gaps`.
    fn times(
        &self,
        shared: &[f64],
        nuisance: &[f64],
        (gaps, springier): (&[f64], &[f64]),
        out: &mut [f64],
    ) -> Result<(), String> {
        let p = &self.layout;
        let drag = shared[p.drag.slot] * self.setup.drag_unit.unwrap_or(1.0);
        let squared = shared[p.squared.slot];
        let restitution = |speed: f64| {
            let e = shared[p.restitution.slot] * (1.0 + nuisance[p.of_run.slot])
                - shared[p.slope.slot] * (speed - 1.0);
            e.max(1e-3) * (squared * speed * speed).exp()
        };
        let rate = p.clock.map_or(0.0, |at| shared[at.slot]);
        let gravity = self.setup.gravity_m_s2;
        let mut leaves = match (self.leaves, self.height_m) {
            (Some(at), _) => nuisance[at.slot],
            (None, Some(height)) => {
                let fell = speed_after_drop(height, gravity, drag);
                restitution(fell) * fell * springier.first().map_or(1.0, |by| by.exp())
            }
            (None, None) => return Err("neither a height nor a speed is known".into()),
        };
        let mut elapsed = 0.0;
        let mut impact = 0.0;
        for (i, time) in out.iter_mut().enumerate() {
            let wanted = i as f64 + gaps[i];
            while impact < wanted {
                let (duration, lands) = rebound(leaves, gravity, drag);
                elapsed += duration;
                leaves = restitution(lands) * lands;
                impact += 1.0;
                if impact == wanted {
                    leaves *= springier.get(i).map_or(1.0, |by| by.exp());
                }
            }
            *time = nuisance[self.begins.slot] + (1.0 + rate) * elapsed;
        }
        Ok(())
    }

    /// Whether some flights seem to hide impacts that went unheard.
    pub(super) fn hides_impacts(&self) -> bool {
        self.layout.unheard.is_some()
    }

    /// How much later each impact is by those that a flight seems to hide, taken for what they are to the amount at the row before it.
    pub(super) fn later_by_unheard(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        amounts: &[f64],
    ) -> Result<Vec<f64>, String> {
        let [known, found] = [KNOWN, FOUND].map(|k| run.inputs.get(k).ok_or("its impacts are not numbered"));
        let (known, found) = (known?, found?);
        let mut none = vec![0.0; run.len()];
        self.times(shared, nuisance, (known, &[]), &mut none)?;
        let mut later = vec![0.0; run.len()];
        let hides = |row: usize| (found[row + 1] - found[row]) - (known[row + 1] - known[row]);
        for row in (0..run.len().saturating_sub(1)).filter(|&row| amounts[row] != 0.0 && hides(row) > 0.0) {
            let more = |(k, gaps): (usize, &f64)| if k > row { gaps + hides(row) } else { *gaps };
            let gaps: Vec<f64> = known.iter().enumerate().map(more).collect();
            let mut times = vec![0.0; run.len()];
            self.times(shared, nuisance, (&gaps, &[]), &mut times)?;
            later
                .iter_mut()
                .zip(times.iter().zip(&none))
                .for_each(|(l, (t, n))| *l += amounts[row] * (t - n));
        }
        Ok(later)
    }

    /// The times where the logarithm of the restitution of each row's impact is larger by some amounts (none: empty).
    pub(super) fn fill(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        springier: &[f64],
        out: &mut [f64],
    ) -> Result<(), String> {
        if run.inputs.len() <= FOUND {
            return Err("its impacts are not numbered".into());
        }
        self.times(shared, nuisance, (&run.inputs[KNOWN], springier), out)?;
        let split = self.layout.unheard.map_or(0.0, |at| shared[at.slot]);
        if split != 0.0 {
            let mut apart = vec![0.0; out.len()];
            self.times(shared, nuisance, (&run.inputs[FOUND], springier), &mut apart)?;
            out.iter_mut().zip(&apart).for_each(|(o, a)| *o += split * (a - *o));
        }
        Ok(())
    }
}

/// The specification of a set-up in which only times were measured: where a drop begins, and how fast it leaves the table there, are each
/// run's own.
pub(super) fn build_times(
    setup: &Setup,
    restitution: f64,
) -> (Spec, Layout, ParameterRef, Option<ParameterRef>) {
    let (mut b, layout) = build(setup, restitution);
    let begins = b.nuisance("first_impact_s", "s", UNBOUNDED, 0.1);
    let leaves = (!setup.dropped).then(|| b.nuisance("leaves_m_s", "m/s", [0.0, 1e3], 0.5));
    (b.build_unchecked(), layout, begins, leaves)
}

impl Model for TimesModel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        self.fill(run, shared, nuisance, &[], out)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        let heard: Vec<(usize, f64)> =
            run.outputs[0].iter().copied().enumerate().filter(|(_, t)| t.is_finite()).collect();
        let [(first, t0), (second, t1), ..] = heard.as_slice() else { return };
        nuisance[self.begins.slot] = *t0;
        if let Some(at) = self.leaves {
            let flights = (run.inputs[FOUND][*second] - run.inputs[FOUND][*first]) + (second - first) as f64;
            nuisance[at.slot] = 0.5 * self.setup.gravity_m_s2 * (t1 - t0) / flights;
        }
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { errors: Some(self), local_causes: Some(self), ..Extensions::default() }
    }
}

impl ErrorModel for TimesModel {
    /// An error that wanders along a drop would hide all physics; what adds up along it is a scatter of the restitution.
    fn longest_correlation(&self) -> f64 {
        self.longest_noise
    }

    fn accumulated(&self, run: &Run, _channel: usize) -> Option<Vec<Vec<f64>>> {
        self.scattered.get(&run.label).cloned()
    }

    fn step(&self) -> &str {
        "the logarithm of the restitution"
    }

    fn largest_step(&self) -> f64 {
        self.largest_scatter
    }
}
