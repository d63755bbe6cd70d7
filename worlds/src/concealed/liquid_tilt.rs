//! The domain `liquid-tilt`: tilted containers with concealed effects.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;

use rand_chacha::ChaCha8Rng;

use super::draw::{self, between, choose, log_between, sign, stated, whole};
use super::key::{Hidden, Key, Place};
use super::nuisances::{Nuisances, difference};
use super::rig::{Choice, Rig};
use crate::noise::Noise;
use crate::physics::tilt::{Cable, Cavity, Effects, Sweep, TiltWorld};

const LISTED: usize = 9;
const UNLISTED: usize = 4;
/// Unlisted effects that act at a place.
const LOCAL: [usize; 3] = [0, 3, 4];

/// A container in a gripper with its sensor.
pub(crate) struct Container {
    world: TiltWorld,
    density_kg_m3: f64,
    density_known: bool,
    volumes_known: bool,
    /// Noise of forces and torque.
    noise: [Noise; 2],
    /// One sigma of each.
    sigma: [f64; 2],
    /// Sign of each listed effect.
    signs: [f64; LISTED],
    slip_run: usize,
    slip_pose: usize,
    taut_from_rad: f64,
}

impl Rig for Container {
    const DOMAIN: &'static str = "liquid-tilt";
    type Effects = Effects;

    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice) {
        let container = Self::drawn(rng);
        let listed = choose(rng, LISTED, hidden.listed());
        let unlisted = match hidden {
            Hidden::Local => LOCAL[whole(rng, 0, LOCAL.len() - 1)],
            _ if hidden.unlisted() => whole(rng, 0, UNLISTED - 1),
            _ => 0,
        };
        (container, Choice { listed, unlisted })
    }

    fn candidates(&self) -> Vec<usize> {
        (0..LISTED).collect()
    }

    /// The changes of the readings that mass and volume of each run can make, as far as they are not stated.
    fn nuisances(&self) -> Nuisances {
        let baseline = self.whitened(&self.world);
        let mut nuisances = Nuisances::default();
        for run in 0..self.world.sweeps.len() {
            for part in [0, 1] {
                let mut moved = self.world.clone();
                let sweep = &mut moved.sweeps[run];
                match (part, self.density_known, self.volumes_known) {
                    (0, false, _) => sweep.mass_kg *= 1.001,
                    (1, false, false) => sweep.volume_m3 *= 1.001,
                    (1, true, false) => {
                        sweep.mass_kg *= 1.001;
                        sweep.volume_m3 *= 1.001;
                    }
                    _ => continue,
                }
                nuisances.add(&difference(&baseline, &self.whitened(&moved)));
            }
        }
        nuisances
    }

    fn response(&self, effects: Effects) -> Vec<f64> {
        let at_work = TiltWorld { effects, ..self.world.clone() };
        difference(&self.whitened(&self.world), &self.whitened(&at_work))
    }

    fn size_bounds(&self, listed: usize) -> [f64; 2] {
        match listed {
            0 => [1e-4, 4e-3],
            1 => [2e-4, 0.1],
            2 => [1e-5, 0.03],
            3 | 8 => [1e-4, 0.12],
            4 | 6 => [2e-5, 0.015],
            5 => [1e-4, 0.2 * self.world.outside.length_m],
            _ => [1e-5 / self.rows(), 0.03 / self.rows()],
        }
    }

    fn apply(&self, e: &mut Effects, listed: usize, size: f64) {
        let signed = self.signs[listed] * size;
        match listed {
            0 => e.wall_m = size,
            1 => e.force_gain = signed,
            2 => e.torque_offset_nm = signed,
            3 => e.angle_offset_rad = signed,
            4 => e.grasp_offset_m = signed,
            5 => e.cap_shift_m = signed,
            6 => (e.slip_m, e.slip_run, e.slip_pose) = (signed, self.slip_run, self.slip_pose),
            7 => e.drift_nm_per_row = signed,
            _ => e.surface_lag_rad = signed,
        }
    }

    fn describe(&self, e: &Effects, listed: usize, key: &mut Key) {
        match listed {
            0 => key.add("wall-thickness", &[("thickness_m", e.wall_m)]),
            1 => key.add("force-gain", &[("gain", e.force_gain)]),
            2 => key.add("torque-offset", &[("offset_nm", e.torque_offset_nm)]),
            3 => key.add("angle-offset", &[("angle_rad", e.angle_offset_rad)]),
            4 => key.add("grasp-offset", &[("offset_m", e.grasp_offset_m)]),
            5 => key.add("cap-mass", &[("shift_m", e.cap_shift_m)]),
            6 => {
                key.add("grasp-slip", &[("slip_m", e.slip_m)]);
                key.place = Some(self.after_slip());
            }
            7 => key.add("sensor-drift", &[("rate_nm_per_row", e.drift_nm_per_row)]),
            _ => key.add("surface-lag", &[("angle_rad", e.surface_lag_rad)]),
        }
    }

    fn unlisted_size_bounds(&self, which: usize) -> [f64; 2] {
        match which {
            0 => [1e-4, 0.05],
            1 => [2e-5, 0.01],
            2 => [1e-3, 5.0],
            4 => [2e-5, 0.015],
            _ => [2e-4, 0.2 * self.world.sweeps[self.slip_run].mass_kg],
        }
    }

    fn unlisted(&self, beside: Effects, which: usize, sign: f64, size: f64) -> Effects {
        match which {
            0 => Effects {
                cable: Cable { taut_from_rad: self.taut_from_rad, stiffness_nm_rad: sign * size },
                ..beside
            },
            1 => Effects { play_nm: size, ..beside },
            2 => Effects { flex: sign * size, ..beside },
            4 => Effects { regrasped_m: sign * size, slip_run: self.regrasped_run(), ..beside },
            _ => Effects { spilt_kg: size, slip_run: self.slip_run, slip_pose: self.slip_pose, ..beside },
        }
    }

    fn describe_unlisted(&self, which: usize, key: &mut Key) {
        let (what, place) = match which {
            0 => {
                let to = self.world.sweeps[0].tilts_rad.iter().copied().fold(0.0, f64::max);
                let place = Place::new("theta_rad", self.taut_from_rad, to);
                ("a cable that is taut beyond an angle", Some(place))
            }
            1 => ("hysteresis of the torque sensor", None),
            2 => ("a gripper that gives way with the torque squared", None),
            4 => {
                let later = (self.regrasped_run()..self.world.sweeps.len()).map(|run| (run + 1).to_string());
                let place = Place::new("run", f64::NEG_INFINITY, f64::INFINITY).in_runs(later);
                ("another grip from one run on", Some(place))
            }
            _ => ("liquid that is spilt once", Some(self.after_slip())),
        };
        key.unlisted = Some(what.into());
        key.place = place;
    }

    fn files(self, effects: Effects, rng: &mut ChaCha8Rng) -> [String; 2] {
        let w = TiltWorld { effects, ..self.world };
        let mut header = String::from("format = 1\ndomain = \"liquid-tilt\"\ndata = \"data.csv\"\n");
        if whole(rng, 0, 2) > 0 {
            let [force, torque] = [stated(rng, &self.noise[0]), stated(rng, &self.noise[1])];
            let _ = write!(
                header,
                "\n[noise]\nfx_n = {force:.3e}\nfy_n = {force:.3e}\ntau_z_nm = {torque:.3e}\n"
            );
        }
        let _ = write!(
            header,
            "\n[rig]\ncontainer = {{ shape = \"cylinder\", radius_m = {}, length_m = {} }}\ncontainer_mass_kg = {}\ngripper_mass_kg = {}\ngrasp_height_m = {}\n",
            w.outside.radius_m, w.outside.length_m, w.container_kg, w.gripper_kg, w.grasp_m
        );
        if self.density_known {
            let _ = writeln!(header, "density_kg_m3 = {}", self.density_kg_m3);
        }
        let volume = if self.volumes_known { ",volume_m3" } else { "" };
        let mut data = format!("run,theta_rad,fx_n,fy_n,tau_z_nm{volume}\n");
        let readings = w.readings();
        let mut sideways = vec![0.0; readings.len()];
        let [mut down, mut torque]: [Vec<f64>; 2] =
            [0, 1].map(|channel| readings.iter().map(|r| r[channel]).collect());
        self.noise[0].apply(&mut sideways, rng);
        self.noise[0].apply(&mut down, rng);
        self.noise[1].apply(&mut torque, rng);
        let mut row = 0;
        for (run, sweep) in w.sweeps.iter().enumerate() {
            for tilt in &sweep.tilts_rad {
                let _ = write!(
                    data,
                    "{},{tilt},{:.5},{:.5},{:.7}",
                    run + 1,
                    sideways[row],
                    down[row],
                    torque[row]
                );
                if self.volumes_known {
                    let _ = write!(data, ",{:.6}", sweep.volume_m3);
                }
                data.push('\n');
                row += 1;
            }
        }
        [header, data]
    }
}

impl Container {
    fn drawn(rng: &mut ChaCha8Rng) -> Self {
        let outside = Cavity { radius_m: between(rng, 0.03, 0.05), length_m: between(rng, 0.15, 0.23) };
        let density_kg_m3 = between(rng, 780.0, 1350.0);
        let tilts_rad = poses(rng);
        // Some sweep up and down by turns, so that an effect of the order shows.
        let both_ways = whole(rng, 0, 2) == 0;
        let runs = whole(rng, 3, 6);
        let sweeps: Vec<Sweep> = (0..runs)
            .map(|run| {
                // Fills that are spread over the container, none of them empty or brim full.
                let fill = 0.12 + 0.68 * (run as f64 + between(rng, 0.1, 0.9)) / runs as f64;
                // Measured in to a millilitre; the file states it so.
                let volume_m3 = (fill * outside.volume_m3() * 1e6).round() * 1e-6;
                let mut tilts_rad = tilts_rad.clone();
                if both_ways && run % 2 == 1 {
                    tilts_rad.reverse();
                }
                Sweep { mass_kg: density_kg_m3 * volume_m3, volume_m3, tilts_rad }
            })
            .collect();
        let [force, torque] = [log_between(rng, 8e-3, 3e-2), log_between(rng, 1.2e-4, 5e-4)];
        let noise = [draw::noise(rng, force), draw::noise(rng, torque)];
        let slip_run = whole(rng, 0, runs - 1);
        Self {
            density_kg_m3,
            density_known: whole(rng, 0, 9) < 6,
            volumes_known: whole(rng, 0, 1) == 0,
            sigma: [draw::sigma(&noise[0]), draw::sigma(&noise[1])],
            noise,
            signs: std::array::from_fn(|_| sign(rng)),
            slip_run,
            slip_pose: whole(rng, tilts_rad.len() / 4, 3 * tilts_rad.len() / 4),
            taut_from_rad: between(rng, 0.3, 0.65) * tilts_rad.iter().copied().fold(0.0, f64::max),
            world: TiltWorld {
                outside,
                container_kg: between(rng, 0.05, 0.13),
                gripper_kg: between(rng, 0.25, 0.6),
                grasp_m: outside.length_m * between(rng, 0.25, 0.8),
                sweeps,
                effects: Effects::default(),
            },
        }
    }

    /// Readings in sigmas.
    fn whitened(&self, world: &TiltWorld) -> Vec<f64> {
        let [force, torque] = self.sigma;
        world.readings().iter().flat_map(|[f, t]| [f / force, t / torque]).collect()
    }

    fn rows(&self) -> f64 {
        self.world.sweeps.iter().map(|s| s.tilts_rad.len() as f64).sum()
    }

    /// The first run with another grip, before which there is one without: in all runs it would be an error of the grasp's height.
    fn regrasped_run(&self) -> usize {
        self.slip_run.max(1)
    }

    /// Where the poses of a run from its slip on are.
    fn after_slip(&self) -> Place {
        let late = &self.world.sweeps[self.slip_run].tilts_rad[self.slip_pose..];
        let from = late.iter().copied().fold(f64::INFINITY, f64::min);
        let to = late.iter().copied().fold(0.0, f64::max);
        Place::new("theta_rad", from, to).in_runs([(self.slip_run + 1).to_string()])
    }
}

/// Stated tilts of a sweep, from upright on, in steps of whole half degrees.
fn poses(rng: &mut ChaCha8Rng) -> Vec<f64> {
    let count = whole(rng, 12, 25);
    let last = FRAC_PI_2 * between(rng, 0.75, 1.9);
    let half_degree = std::f64::consts::PI / 360.0;
    let step = (last / (count - 1) as f64 / half_degree).round() * half_degree;
    (0..count).map(|pose| ((pose as f64 * step) * 1e6).round() * 1e-6).collect()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;
    use crate::concealed::rig::tests::every_effect_shows;

    #[test]
    fn another_grip_comes_after_the_first_run() {
        for seed in 0..20 {
            let container = Container::drawn(&mut ChaCha8Rng::seed_from_u64(seed));
            let moved = container.response(container.unlisted(Effects::default(), 4, 1.0, 0.01));
            let first = 2 * container.world.sweeps[0].tilts_rad.len();
            assert!(moved[..first].iter().all(|change| *change == 0.0), "{seed}");
            assert!(moved[first..].iter().any(|change| *change != 0.0), "{seed}");
        }
    }

    #[test]
    fn every_effect_changes_the_readings_by_more_than_a_baseline_takes() {
        for seed in 0..3 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut container = Container::drawn(&mut rng);
            container.density_known = true;
            every_effect_shows(&container, UNLISTED, 5.0, [10.0; 2]);
        }
    }

    /// With neither density nor volumes a gain of the forces is as good as another mass, until the torque is looked at; a run's
    /// mass is known where both are.
    #[test]
    fn what_is_stated_is_not_free() {
        let mut container = Container::drawn(&mut ChaCha8Rng::seed_from_u64(8));
        let gain = Effects { force_gain: 0.002, ..Effects::default() };
        let mut left = |density, volumes| {
            (container.density_known, container.volumes_known) = (density, volumes);
            container.nuisances().residual_norm(&container.response(gain))
        };
        let [nothing, density, both] = [left(false, false), left(true, false), left(true, true)];
        assert!(both > density && density > nothing, "{both} {density} {nothing}");
    }
}
