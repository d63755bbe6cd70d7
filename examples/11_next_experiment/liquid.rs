//! A bottle with something hidden about it, tilted on the simulated wrist.

use std::f64::consts::PI;
use std::fmt::Write as _;

use hw_traits::programme::{TiltProgramme, run};
use liquid_haptics::fake::{AXIA80, FakeWrist, Load, Round};
use liquid_haptics::wrench::{PlanarWrench, world_from_body};
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;

use super::{Outcome, Rig};

const GRAVITY: f64 = 9.80665;
const WATER: f64 = 997.0;
const RADIUS_M: f64 = 0.035;
const LENGTH_M: f64 = 0.172;
const BOTTLE_KG: f64 = 0.085;
const GRIPPER_KG: f64 = 0.9;
const GRASP_M: f64 = 0.75 * LENGTH_M;
const POSES: usize = 13;

/// What may be hidden, and what the bottle is then like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Hidden {
    Wall(f64),
    Gain(f64),
    Grasp(f64),
    Cap(f64),
}

/// A tilt through a range of angles with an amount of water.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tilt {
    from_rad: f64,
    to_rad: f64,
    volume_m3: f64,
}

/// The rig.
pub(super) struct Liquid;

impl Rig for Liquid {
    type Hidden = Hidden;
    type Action = Tilt;
    const NAME: &'static str = "liquid";
    const COLUMNS: &'static str = "run,theta_rad,fx_n,fy_n,tau_z_nm,volume_m3";

    fn header() -> String {
        format!(
            "format = 1\ndomain = \"liquid-tilt\"\ndata = \"data.csv\"\n\n[rig]\ncontainer = {{ shape = \"cylinder\", \
             radius_m = {RADIUS_M}, length_m = {LENGTH_M} }}\ncontainer_mass_kg = {BOTTLE_KG}\ngripper_mass_kg = {GRIPPER_KG}\n\
             grasp_height_m = {GRASP_M}\ngravity_m_s2 = {GRAVITY}\n"
        )
    }

    fn draw(rng: &mut ChaCha8Rng) -> Hidden {
        let size = rng.random_range(0.6..1.6);
        let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
        match rng.random_range(0..4) {
            0 => Hidden::Wall(0.0004 * size),
            1 => Hidden::Gain(0.01 * sign * size),
            2 => Hidden::Grasp(0.001 * sign * size),
            _ => Hidden::Cap(0.005 * size),
        }
    }

    fn id(hidden: Hidden) -> &'static str {
        match hidden {
            Hidden::Wall(_) => "wall-thickness",
            Hidden::Gain(_) => "force-gain",
            Hidden::Grasp(_) => "grasp-offset",
            Hidden::Cap(_) => "cap-mass",
        }
    }

    fn first() -> Tilt {
        Tilt { from_rad: 0.0, to_rad: 0.25 * PI, volume_m3: 0.25 * capacity_m3() }
    }

    fn random(rng: &mut ChaCha8Rng) -> Tilt {
        let [one, other] = [0, 1].map(|_| rng.random_range(0.0..PI));
        Tilt {
            from_rad: f64::min(one, other),
            to_rad: f64::max(one, other),
            volume_m3: rng.random_range(0.0..0.95) * capacity_m3(),
        }
    }

    fn grid() -> Vec<Tilt> {
        let quarter = |k: u8| (0.25 * PI * f64::from(k), 0.25 * PI * f64::from(k + 1));
        let tilt =
            |share: f64, (from_rad, to_rad)| Tilt { from_rad, to_rad, volume_m3: share * capacity_m3() };
        [0.1, 0.5, 0.9].iter().flat_map(|share| (0..4).map(move |k| tilt(*share, quarter(k)))).collect()
    }

    fn proposed(value: &dyn Fn(&str) -> Option<f64>) -> Option<Tilt> {
        Some(Tilt {
            from_rad: value("from_rad").unwrap_or(0.0),
            to_rad: value("theta_rad").unwrap_or(PI),
            volume_m3: value("volume_m3")?,
        })
    }

    fn act(tilt: Tilt, hidden: Hidden, label: usize, seed: u64) -> Outcome<String> {
        let mut wrist = FakeWrist::new(load(tilt, hidden), AXIA80, seed).map_err(|e| e.to_string())?;
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

fn capacity_m3() -> f64 {
    PI * RADIUS_M * RADIUS_M * LENGTH_M
}

/// The bottle as it is.
fn load(tilt: Tilt, hidden: Hidden) -> Load {
    let wall = if let Hidden::Wall(wall) = hidden { wall } else { 0.0 };
    let (radius_m, length_m) = (RADIUS_M - wall, LENGTH_M - 2.0 * wall);
    Load {
        cavity: Box::new(Round::new(radius_m, length_m, wall, 300)),
        radius_m,
        length_m,
        liquid_mass_kg: WATER * tilt.volume_m3,
        volume_m3: tilt.volume_m3,
        viscosity_m2_s: 1e-6,
        container_mass_kg: BOTTLE_KG,
        gripper_mass_kg: GRIPPER_KG,
        grasp_height_m: GRASP_M + if let Hidden::Grasp(offset) = hidden { offset } else { 0.0 },
        shell_center_m: 0.5 * LENGTH_M + if let Hidden::Cap(shift) = hidden { shift } else { 0.0 },
        force_gain: if let Hidden::Gain(gain) = hidden { gain } else { 0.0 },
        gravity_m_s2: GRAVITY,
    }
}
