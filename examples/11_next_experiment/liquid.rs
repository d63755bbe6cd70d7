//! A bottle with something hidden about it, tilted on the simulated wrist.

use std::f64::consts::PI;
use std::fmt::Write as _;

use hw_traits::clock::{Clock, Stamped};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::programme::{TiltProgramme, run};
use hw_traits::rotary::Rotary;
use hw_traits::{ErrorKind, ErrorType};
use liquid_haptics::wrench::{PlanarWrench, world_from_body};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use worlds::GRAVITY_M_S2;
use worlds::tilt::{Cavity, Effects, Sweep, TiltWorld};

use super::{Outcome, Rig, on_log_scale};

const WATER: f64 = 997.0;
const OUTSIDE: Cavity = Cavity { radius_m: 0.035, length_m: 0.172 };
const BOTTLE_KG: f64 = 0.085;
const GRIPPER_KG: f64 = 0.9;
const GRASP_M: f64 = 0.75 * OUTSIDE.length_m;
const POSES: usize = 13;
/// One sigma of a reading of a force (N) and of a torque (N m): an ATI Axia80's resolution.
const SIGMA_N: f64 = 0.1;
const SIGMA_NM: f64 = 0.005;

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
pub(super) struct Liquid;

impl Rig for Liquid {
    type Hidden = Hidden;
    type Action = Tilt;
    const NAME: &'static str = "liquid";
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
        let mut wrist = Wrist::new(tilt, hidden.effects, seed);
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

/// A simulated wrist that holds the bottle and is where it was told to be as soon as somebody has waited.
struct Wrist {
    world: TiltWorld,
    now_s: f64,
    angle_rad: f64,
    /// Force and torque where it stands, if they were asked.
    felt: Option<[f64; 2]>,
    rng: ChaCha8Rng,
}

impl Wrist {
    fn new(tilt: Tilt, effects: Effects, seed: u64) -> Self {
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
        Self { world, now_s: 0.0, angle_rad: 0.0, felt: None, rng: ChaCha8Rng::seed_from_u64(seed) }
    }
}

impl ErrorType for Wrist {
    type Error = ErrorKind;
}

impl Clock for Wrist {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        Ok(self.now_s)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        self.now_s += duration_s.max(0.0);
        Ok(())
    }
}

impl Rotary for Wrist {
    fn limits_rad(&self) -> (f64, f64) {
        (0.0, PI)
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        if !((0.0..=PI).contains(&angle_rad) && rate_rad_s > 0.0) {
            return Err(ErrorKind::OutOfRange);
        }
        (self.angle_rad, self.felt) = (angle_rad, None);
        Ok(())
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        Ok(Stamped { t_s: self.now_s, value: self.angle_rad })
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        Ok(true)
    }
}

impl ForceTorque for Wrist {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        let [up_n, torque_nm] = if let Some(felt) = self.felt {
            felt
        } else {
            self.world.sweeps[0].tilts_rad[0] = self.angle_rad;
            self.world.readings().first().copied().ok_or(ErrorKind::Other)?
        };
        self.felt = Some([up_n, torque_nm]);
        let mut noise = || -> f64 { StandardNormal.sample(&mut self.rng) };
        // The sensor's axes turn with the wrist.
        let (sin, cos) = self.angle_rad.sin_cos();
        let value = Wrench {
            force_n: [-up_n * sin + SIGMA_N * noise(), up_n * cos + SIGMA_N * noise(), SIGMA_N * noise()],
            torque_nm: [SIGMA_NM * noise(), SIGMA_NM * noise(), torque_nm + SIGMA_NM * noise()],
        };
        Ok(Stamped { t_s: self.now_s, value })
    }

    fn tare(&mut self, _readings: usize) -> Result<(), ErrorKind> {
        Err(ErrorKind::Other)
    }
}
