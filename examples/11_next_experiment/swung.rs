//! A bottle with something hidden about its wave, brought upright by the simulated wrist and felt until it rests.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::fmt::Write as _;

use hw_traits::clock::Clock;
use hw_traits::force_torque::ForceTorque;
use hw_traits::rotary::Rotary;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use worlds::GRAVITY_M_S2;
use worlds::physics::slosh::{Effects, Oscillation, SloshWorld, Start};

use super::wrist::{Load, Turn, Wrist};
use super::{Outcome, Rig, on_log_scale};

const RADIUS_M: f64 = 0.04;
const VOLUME_M3: f64 = 4e-4;
const MASS_KG: f64 = 0.4;
const VISCOSITY_M2_S: f64 = 1e-6;
/// Torque of the wave that is left when a turn from level to upright ends, N m.
const HIGHEST_NM: f64 = 0.1;
/// What the rig can do: the wave that it starts, as a share of the highest, and how long it feels it, in s.
const SHARE: [f64; 2] = [0.02, 1.0];
const LASTS_S: [f64; 2] = [1.0, 20.0];
const RATE_HZ: f64 = 40.0;
const REPEATS: usize = 1;

/// What may be hidden; the world's effects with that alone, at the highest wave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Hidden {
    id: &'static str,
    effects: Effects,
}

/// A turn to upright that leaves a wave, felt for some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Swing {
    wave_nm: f64,
    lasts_s: f64,
}

/// The rig.
pub(super) struct Swung;

impl Rig for Swung {
    type Hidden = Hidden;
    type Action = Swing;
    const NAME: &'static str = "a bottle swung";
    const COLUMNS: &'static str = "run,t_s,tau_z_nm";

    fn header() -> String {
        format!(
            "format = 1\ndomain = \"slosh\"\ndata = \"data.csv\"\n\n[rig]\ncontainer = {{ shape = \"cylinder\", \
             radius_m = {RADIUS_M} }}\nliquid_mass_kg = {MASS_KG}\nvolume_m3 = {VOLUME_M3}\n"
        )
    }

    fn draw(rng: &mut ChaCha8Rng) -> Hidden {
        let size = on_log_scale(rng, [0.3, 3.0]);
        let signed = if rng.random::<bool>() { size } else { -size };
        let none = Effects::default();
        let ring = |omega_rad_s, share: f64| Oscillation {
            omega_rad_s,
            damping_ratio: 0.01,
            amplitude: share * size * HIGHEST_NM,
        };
        let (id, effects) = match rng.random_range(0..7) {
            0 => ("surface-tension", Effects { surface_tension_n_m: 0.025 * size, ..none }),
            1 => ("nonlinear-frequency", Effects { nonlinear_frequency: 0.01 * signed, ..none }),
            2 => ("contact-line-friction", Effects { friction: 3e-3 * size * HIGHEST_NM, ..none }),
            3 => ("quadratic-damping", Effects { quadratic: 0.02 * size / HIGHEST_NM, ..none }),
            // The world knows the second mode's frequency itself.
            4 => ("second-mode", Effects { second_mode: ring(0.0, 0.05), ..none }),
            5 => ("arm-compliance", Effects { arm: ring(rng.random_range(30.0..90.0), 0.05), ..none }),
            _ => ("sensor-lag", Effects { lag_s: 0.1, lag_start: 0.2 * size * HIGHEST_NM, ..none }),
        };
        Hidden { id, effects }
    }

    fn id(hidden: Hidden) -> &'static str {
        hidden.id
    }

    fn first() -> Swing {
        Swing { wave_nm: 0.2 * HIGHEST_NM, lasts_s: 4.0 }
    }

    fn random(rng: &mut ChaCha8Rng) -> Swing {
        Swing { wave_nm: HIGHEST_NM * on_log_scale(rng, SHARE), lasts_s: on_log_scale(rng, LASTS_S) }
    }

    fn grid() -> Vec<Swing> {
        let swing = |share: f64, lasts_s| Swing { wave_nm: share * HIGHEST_NM, lasts_s };
        [0.25, 0.5, 0.75, 1.0].iter().flat_map(|share| [2.0, 6.0, 18.0].map(|s| swing(*share, s))).collect()
    }

    fn proposed(value: &dyn Fn(&str) -> Option<f64>) -> Option<Swing> {
        let swing = Swing { wave_nm: value("amplitude_nm")?, lasts_s: value("duration_s")? };
        let within = |v: f64, [least, most]: [f64; 2]| v >= 0.98 * least && v <= 1.02 * most;
        (within(swing.wave_nm / HIGHEST_NM, SHARE) && within(swing.lasts_s, LASTS_S)).then_some(swing)
    }

    fn act(swing: Swing, hidden: Hidden, label: usize, seed: u64) -> Outcome<String> {
        let mut rows = String::new();
        for repeat in 0..REPEATS {
            let seed = seed.wrapping_add(repeat as u64) ^ 0x5a1;
            let mut wrist = Wrist::new(Wave::new(swing, hidden.effects, seed), seed);
            for (t_s, torque_nm) in ring_down(&mut wrist, swing)? {
                writeln!(rows, "{label}-{repeat},{t_s:.4},{torque_nm:.6}")?;
            }
        }
        Ok(rows)
    }
}

/// Turns upright from where that leaves the wanted wave, and reads, on any wrist that feels.
fn ring_down<R>(rig: &mut R, swing: Swing) -> Outcome<Vec<(f64, f64)>>
where
    R: Rotary + ForceTorque + Clock,
{
    let as_text = |e: R::Error| format!("{e:?}");
    rig.turn_to(FRAC_PI_2 * (swing.wave_nm / HIGHEST_NM).min(1.0), 0.3).map_err(as_text)?;
    rig.sleep_s(20.0).map_err(as_text)?;
    rig.turn_to(0.0, 3.0).map_err(as_text)?;
    let zero = rig.now_s().map_err(as_text)?;
    let mut readings = Vec::new();
    for _ in 0..rows(swing) {
        let wrench = rig.read().map_err(as_text)?;
        readings.push((wrench.t_s - zero, wrench.value.torque_nm[2]));
        rig.sleep_s(1.0 / RATE_HZ).map_err(as_text)?;
    }
    Ok(readings)
}

fn rows(swing: Swing) -> usize {
    (swing.lasts_s * RATE_HZ) as usize
}

/// The liquid in the bottle: a turn to upright leaves a wave that goes with the angle.
struct Wave {
    effects: Effects,
    rows: usize,
    rng: ChaCha8Rng,
    /// What is felt after the turn for which it was worked out.
    felt: Option<(Turn, Vec<f64>)>,
}

impl Wave {
    fn new(swing: Swing, effects: Effects, seed: u64) -> Self {
        Self { effects, rows: rows(swing), rng: ChaCha8Rng::seed_from_u64(seed ^ 0x5a17), felt: None }
    }

    /// What is felt in the time after a turn; everything that a turn excites goes with the wave.
    fn after(&mut self, turn: &Turn) -> Vec<f64> {
        let share = (turn.from_rad - turn.to_rad) / FRAC_PI_2;
        let e = self.effects;
        let mut phase = || self.rng.random_range(0.0..TAU);
        let start = Start {
            amplitude: share * HIGHEST_NM,
            phases_rad: [phase(), phase(), phase(), 0.0],
            lag_error: 1.0,
        };
        let ring = |r: Oscillation| Oscillation { amplitude: share * r.amplitude, ..r };
        let effects = Effects {
            nonlinear_frequency: share * share * e.nonlinear_frequency,
            second_mode: ring(e.second_mode),
            arm: ring(e.arm),
            lag_start: share * e.lag_start,
            ..e
        };
        let world = SloshWorld {
            radius_m: RADIUS_M,
            mass_kg: MASS_KG,
            volume_m3: VOLUME_M3,
            viscosity_m2_s: VISCOSITY_M2_S,
            starts: vec![start],
            rows: self.rows,
            rate_hz: RATE_HZ,
            effects,
        };
        world.readings()
    }
}

impl Load for Wave {
    fn felt(&mut self, turn: &Turn, since_s: f64) -> Option<[f64; 2]> {
        if self.felt.as_ref().is_none_or(|(felt, _)| felt != turn) {
            self.felt = Some((*turn, self.after(turn)));
        }
        let row = (since_s * RATE_HZ).round() as usize;
        let torque_nm = *self.felt.as_ref()?.1.get(row)?;
        Some([-MASS_KG * GRAVITY_M_S2, torque_nm])
    }
}
