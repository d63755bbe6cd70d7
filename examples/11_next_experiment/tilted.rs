//! A bottle with something hidden about it, tilted on the simulated wrist.

use std::f64::consts::PI;
use std::fmt::Write as _;

use hw_traits::programme::{TiltProgramme, run};
use liquid_haptics::wrench::{PlanarWrench, world_from_body};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use worlds::GRAVITY_M_S2;
use worlds::physics::tilt::{Cavity, Effects, Sweep, TiltWorld};

use super::wrist::{Load, Turn, Wrist};
use super::{Outcome, Rig, on_log_scale};

const WATER: f64 = 997.0;
const OUTSIDE: Cavity = Cavity { radius_m: 0.035, length_m: 0.172 };
const BOTTLE_KG: f64 = 0.085;
const GRIPPER_KG: f64 = 0.9;
const GRASP_M: f64 = 0.75 * OUTSIDE.length_m;
const POSES: usize = 13;

/// What may be hidden; the world's effects with that alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hidden {
    id: &'static str,
    effects: Effects,
}

/// A tilt through a range of angles with an amount of water.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tilt {
    from_rad: f64,
    to_rad: f64,
    volume_m3: f64,
}

/// The rig.
pub(super) struct Tilted;

impl Rig for Tilted {
    type Hidden = Hidden;
    type Action = Tilt;
    const NAME: &'static str = "a bottle tilted";
    const COLUMNS: &'static str = "run,theta_rad,fx_n,fy_n,tau_z_nm,volume_m3";

    fn header() -> String {
        format!(
            "format = 1\ndomain = \"liquid-tilt\"\ndata = \"data.csv\"\n\n[rig]\ncontainer = {{ shape = \"cylinder\", \
             radius_m = {}, length_m = {} }}\ncontainer_mass_kg = {BOTTLE_KG}\ngripper_mass_kg = {GRIPPER_KG}\n\
             grasp_height_m = {GRASP_M}\ngravity_m_s2 = {GRAVITY_M_S2}\n",
            OUTSIDE.radius_m, OUTSIDE.length_m,
        )
    }

    fn draw(rng: &mut ChaCha8Rng) -> Hidden {
        let size = on_log_scale(rng, [0.3, 3.0]);
        let signed = if rng.random::<bool>() { size } else { -size };
        let none = Effects::default();
        let (id, effects) = match rng.random_range(0..7) {
            0 => ("wall-thickness", Effects { wall_m: 4e-4 * size, ..none }),
            1 => ("force-gain", Effects { force_gain: 0.01 * signed, ..none }),
            2 => ("torque-offset", Effects { torque_offset_nm: 2e-3 * signed, ..none }),
            3 => ("angle-offset", Effects { angle_offset_rad: 0.01 * signed, ..none }),
            4 => ("grasp-offset", Effects { grasp_offset_m: 1e-3 * signed, ..none }),
            5 => ("cap-mass", Effects { cap_shift_m: 5e-3 * size, ..none }),
            _ => ("surface-lag", Effects { surface_lag_rad: 0.02 * signed, ..none }),
        };
        Hidden { id, effects }
    }

    fn id(hidden: Hidden) -> &'static str {
        hidden.id
    }

    fn first() -> Tilt {
        Tilt { from_rad: 0.0, to_rad: 0.25 * PI, volume_m3: 0.25 * OUTSIDE.volume_m3() }
    }

    fn random(rng: &mut ChaCha8Rng) -> Tilt {
        let [one, other] = [0, 1].map(|_| rng.random_range(0.0..PI));
        Tilt {
            from_rad: f64::min(one, other),
            to_rad: f64::max(one, other),
            volume_m3: rng.random_range(0.0..0.95) * OUTSIDE.volume_m3(),
        }
    }

    fn grid() -> Vec<Tilt> {
        let quarter = |k: u8| (0.25 * PI * f64::from(k), 0.25 * PI * f64::from(k + 1));
        let tilt = |share: f64, (from_rad, to_rad)| Tilt {
            from_rad,
            to_rad,
            volume_m3: share * OUTSIDE.volume_m3(),
        };
        [0.1, 0.5, 0.9].iter().flat_map(|share| (0..4).map(move |k| tilt(*share, quarter(k)))).collect()
    }

    fn proposed(value: &dyn Fn(&str) -> Option<f64>) -> Option<Tilt> {
        Some(Tilt {
            from_rad: value("from_rad")?,
            to_rad: value("theta_rad")?,
            volume_m3: value("volume_m3")?,
        })
    }

    fn act(tilt: Tilt, hidden: Hidden, label: usize, seed: u64) -> Outcome<String> {
        let mut wrist = Wrist::new(Held::new(tilt, hidden.effects), seed);
        let angle = |k: usize| tilt.from_rad + (tilt.to_rad - tilt.from_rad) * k as f64 / (POSES - 1) as f64;
        let programme = TiltProgramme {
            angles_rad: (0..POSES).map(angle).collect(),
            rate_rad_s: 0.3,
            settle_s: 20.0,
            patience_s: 20.0,
            readings: 100,
        };
        let mut rows = String::new();
        for pose in run(&mut wrist, &programme)? {
            let wrench = PlanarWrench::from(&world_from_body(&pose.wrench, pose.angle_rad));
            let PlanarWrench { fx_n, fy_n, tau_z_nm } = wrench;
            let theta = pose.angle_rad.clamp(0.0, PI);
            writeln!(rows, "{label},{theta:.6},{fx_n:.5},{fy_n:.5},{tau_z_nm:.6},{:.7}", tilt.volume_m3)?;
        }
        Ok(rows)
    }
}

/// The bottle as the wrist holds it.
struct Held {
    world: TiltWorld,
    /// Force and torque at the last angle asked.
    felt: Option<(f64, [f64; 2])>,
}

impl Held {
    fn new(tilt: Tilt, effects: Effects) -> Self {
        // A drop stays in an empty bottle.
        let volume_m3 = tilt.volume_m3.max(1e-9);
        let world = TiltWorld {
            outside: OUTSIDE,
            container_kg: BOTTLE_KG,
            gripper_kg: GRIPPER_KG,
            grasp_m: GRASP_M,
            sweeps: vec![Sweep { mass_kg: WATER * volume_m3, volume_m3, tilts_rad: vec![0.0] }],
            effects,
        };
        Self { world, felt: None }
    }
}

impl Load for Held {
    fn felt(&mut self, turn: &Turn, _since_s: f64) -> Option<[f64; 2]> {
        if let Some((_, felt)) = self.felt.filter(|(angle_rad, _)| *angle_rad == turn.to_rad) {
            return Some(felt);
        }
        self.world.sweeps[0].tilts_rad[0] = turn.to_rad;
        let felt = *self.world.readings().first()?;
        self.felt = Some((turn.to_rad, felt));
        Some(felt)
    }
}
