//! The full model of a tilt sweep: physics from `liquid-haptics`, and all parameters.

use liquid_haptics::wrench::Departures;
use missing_physics::data::Run;
use missing_physics::model::{ErrorModel, Extensions, Model, MultimodalModel, PredictError, Scope, Spec};

use super::setup::{Cavity, Off, Setup, Vessel};
use super::spec::{Layout, build};
use crate::memo::Memo;

/// How many walls of a mesh are remembered; then it begins anew.
const MOST_WALLS: usize = 64;

/// The model of the domain `liquid-tilt`.
pub struct LiquidTiltModel {
    setup: Setup,
    /// Cavities by the thickness of their wall (its bits), where making one takes long.
    cavities: Memo<u64, Cavity>,
    spec: Spec,
    layout: Layout,
    slip: usize,
}

/// A run's load, and all that is not as stated in each of its poses.
pub(super) struct Loaded {
    pub(super) mass_kg: f64,
    pub(super) volume_m3: f64,
    pub(super) wall_m: f64,
    pub(super) cavity: Cavity,
    pub(super) departures: Vec<Departures>,
}

/// Where a function of a number from 0 to `most` is least: the best of a grid, then by the golden section.
fn least(of: &mut dyn FnMut(f64) -> f64, most: f64) -> f64 {
    const GRID: u32 = 60;
    const ROUNDS: u32 = 40;
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let step = most / f64::from(GRID);
    let at = |k: u32| step * f64::from(k);
    let mut best = (f64::INFINITY, 0);
    for k in 0..=GRID {
        let value = of(at(k));
        if value < best.0 {
            best = (value, k);
        }
    }
    let (mut low, mut high) = (at(best.1.saturating_sub(1)), at((best.1 + 1).min(GRID)));
    for _ in 0..ROUNDS {
        let [a, b] = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
        if of(a) < of(b) {
            high = b;
        } else {
            low = a;
        }
    }
    0.5 * (low + high)
}

impl std::fmt::Debug for LiquidTiltModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LiquidTiltModel").field("setup", &self.setup).finish_non_exhaustive()
    }
}

impl LiquidTiltModel {
    /// The model of a set-up whose recording has the given number of rows.
    pub fn new(setup: Setup, rows: usize) -> Self {
        let (spec, layout) = build(&setup, rows);
        let slip = spec.mechanisms.iter().position(|m| m.id == "grasp-slip").unwrap_or(usize::MAX);
        Self { setup, cavities: Memo::new(MOST_WALLS), spec, layout, slip }
    }

    fn cavity(&self, wall_m: f64) -> Result<Cavity, String> {
        if matches!(self.setup.vessel, Vessel::Cylinder { .. }) {
            return self.setup.vessel.cavity(wall_m);
        }
        self.cavities.get_or(wall_m.to_bits(), 1, || self.setup.vessel.cavity(wall_m))
    }

    /// What is known of the set-up.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Nuisance parameters of a run with a mass (kg) of liquid of a volume (m^3), as far as the run has them.
    pub fn nuisance(&self, mass_kg: f64, volume_m3: f64) -> Vec<f64> {
        let mut nuisance = vec![0.0; self.spec.count(Scope::PerRun)];
        for (at, value) in [(self.layout.mass, mass_kg), (self.layout.volume, volume_m3)] {
            if let Some(at) = at {
                nuisance[at.slot] = value;
            }
        }
        nuisance
    }

    /// Mass (kg) and volume (m^3) of a run's liquid; no volume weighs nothing.
    fn load(&self, run: &Run, nuisance: &[f64]) -> (f64, f64) {
        let known = run.inputs.get(2).filter(|_| self.setup.volumes_known).and_then(|c| c.first()).copied();
        if known == Some(0.0) {
            return (0.0, 0.0);
        }
        let mass = self.layout.mass.map(|at| nuisance[at.slot]);
        let volume = known
            .or_else(|| self.layout.volume.map(|at| nuisance[at.slot]))
            .or_else(|| Some(mass? / self.setup.density_kg_m3?))
            .unwrap_or(0.0);
        (mass.unwrap_or_else(|| volume * self.setup.density_kg_m3.unwrap_or(0.0)), volume)
    }

    /// What else is as it is not stated, in a pose of a run.
    fn departures(&self, row: &[f64], shared: &[f64], at: usize) -> Departures {
        let p = &self.layout;
        let slip_row = shared[p.slip_row.slot];
        let slipped = if row[at] >= slip_row && row.contains(&slip_row) { shared[p.slip.slot] } else { 0.0 };
        Departures {
            force_gain: shared[p.gain.slot],
            torque_offset_nm: shared[p.torque.slot] + shared[p.drift.slot] * row[at],
            angle_offset_rad: shared[p.angle.slot],
            grasp_offset_m: shared[p.grasp.slot] + slipped,
            shell_shift_m: shared[p.shift.slot],
            surface_lag_rad: shared[p.lag.slot],
        }
    }

    /// The load with which the model's channels in a run are those of a fit: its mass by the weight, and its volume, where that is not
    /// known, by the torque.
    pub(super) fn loaded(&self, run: &Run, shared: &[f64], channels: &[Vec<f64>]) -> Option<Loaded> {
        let [_, row, ..] = run.inputs.as_slice() else { return None };
        let grasp = &self.setup.grasp;
        let felt = -channels.get(1)?.iter().sum::<f64>() / run.len() as f64;
        let weight = felt / grasp.gravity_m_s2 / (1.0 + shared[self.layout.gain.slot]);
        let mass_kg = (weight - grasp.container_mass_kg - grasp.gripper_mass_kg).max(0.0);
        let torque = channels.get(2)?;
        let mut out = vec![0.0; 3 * run.len()];
        let mut misfit = |volume: f64| {
            if self.wrenches(run, shared, &self.nuisance(mass_kg, volume), &mut out).is_err() {
                return f64::INFINITY;
            }
            out[2 * run.len()..].iter().zip(torque).map(|(p, m)| (p - m).powi(2)).sum::<f64>()
        };
        let wall_m = shared[self.layout.thickness.slot];
        let cavity = self.cavity(wall_m).ok()?;
        let capacity = cavity.capacity_m3();
        let unknown = if self.layout.volume.is_some() { least(&mut misfit, capacity) } else { 0.0 };
        let (mass_kg, volume) = self.load(run, &self.nuisance(mass_kg, unknown));
        let volume_m3 = volume.clamp(0.0, capacity);
        let departures = (0..run.len()).map(|at| self.departures(row, shared, at)).collect();
        Some(Loaded { mass_kg, volume_m3, wall_m, cavity, departures })
    }

    /// What the wrist feels in each pose of a run.
    fn wrenches(&self, run: &Run, shared: &[f64], nuisance: &[f64], out: &mut [f64]) -> Result<(), String> {
        let n = run.len();
        for row in 0..n {
            let felt = self.wrench(run, shared, nuisance, row, Off::default())?;
            felt.iter().enumerate().for_each(|(channel, v)| out[channel * n + row] = *v);
        }
        Ok(())
    }

    /// What it feels in one of them, which may be off: forces (N) and torque (N m).
    pub(super) fn wrench(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        at: usize,
        off: Off,
    ) -> Result<[f64; 3], String> {
        let p = &self.layout;
        let [theta, row, ..] = run.inputs.as_slice() else {
            return Err("theta_rad and row are missing".into());
        };
        let cavity = self.cavity(shared[p.thickness.slot])?;
        let (mass, volume) = self.load(run, nuisance);
        let more = 1.0 + off.liquid + p.fill.map_or(0.0, |at| nuisance[at.slot]);
        let (mass, volume) = (mass * more, volume * more);
        let volume = volume.clamp(0.0, cavity.capacity_m3());
        let mut departures = self.departures(row, shared, at);
        departures.grasp_offset_m += off.grasp_m + nuisance[p.held.slot];
        let angle = theta[at] + off.angle_rad;
        let felt =
            self.setup.grasp.wrench(&*cavity, angle, mass, volume, &departures).map_err(|e| e.to_string())?;
        Ok([felt.fx_n, felt.fy_n, felt.tau_z_nm])
    }
}

impl Model for LiquidTiltModel {
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
        self.wrenches(run, shared, nuisance, out)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        let grasp = &self.setup.grasp;
        let Some(forces) = run.outputs.get(1) else { return };
        let finite = forces.iter().filter(|f| f.is_finite());
        let (sum, n) = finite.fold((0.0, 0.0), |(s, n), f| (s + f, n + 1.0));
        let weight = -sum / f64::max(n, 1.0) / grasp.gravity_m_s2;
        let mass = (weight - grasp.container_mass_kg - grasp.gripper_mass_kg).max(0.0);
        if let Some(at) = self.layout.mass {
            nuisance[at.slot] = mass;
        }
        let Some(at) = self.layout.volume else { return };
        // The volume whose torque is nearest, on a grid: the surface has more than one valley.
        let mut shared = self.spec.starts(Scope::Shared);
        shared[self.layout.slip_row.slot] = -1.0;
        let capacity = self.setup.vessel.capacity_m3();
        let mut out = vec![0.0; 3 * run.len()];
        let mut best = (f64::INFINITY, 0.5 * capacity);
        for k in 1..40 {
            let volume = capacity * f64::from(k) / 40.0;
            nuisance[at.slot] = volume;
            if self.wrenches(run, &shared, nuisance, &mut out).is_err() {
                continue;
            }
            let torque = &out[2 * run.len()..];
            let misfit: f64 = torque
                .iter()
                .zip(&run.outputs[2])
                .map(|(p, m)| (p - m).powi(2))
                .filter(|v| v.is_finite())
                .sum();
            if misfit < best.0 {
                best = (misfit, volume);
            }
        }
        nuisance[at.slot] = best.1;
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions {
            errors: Some(self),
            modes: Some(self),
            local_causes: Some(self),
            ..Extensions::default()
        }
    }
}

impl ErrorModel for LiquidTiltModel {
    /// Poses are settled ones, seconds apart: a sensor that wanders forgets within a few of them. What lasts longer is physics, such
    /// as a grip that slips and stays.
    fn longest_correlation(&self) -> f64 {
        2.9
    }
}

impl MultimodalModel for LiquidTiltModel {
    fn starts(&self, mechanism: usize, runs: &[Run], residual: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        if mechanism != self.slip {
            return Vec::new();
        }
        let mut gains: Vec<(f64, f64)> = Vec::new();
        for (run, left) in runs.iter().zip(residual) {
            let (lever, torque): (Vec<f64>, Vec<f64>) = run.inputs[0]
                .iter()
                .zip(&left[2])
                .map(|(theta, r)| if r.is_finite() { (theta.sin(), *r) } else { (0.0, 0.0) })
                .unzip();
            // A slip from pose k on pulls with a longer lever there; what the whole sweep shares, mass and volume take.
            let whole: f64 = lever.iter().map(|s| s * s).sum();
            let with_whole: f64 = lever.iter().zip(&torque).map(|(s, r)| s * r).sum();
            for k in 1..lever.len() {
                let part: f64 = lever[k..].iter().map(|s| s * s).sum();
                let with: f64 = lever[k..].iter().zip(&torque[k..]).map(|(s, r)| s * r).sum();
                let left = part - part * part / whole;
                if left > 1e-6 * whole {
                    gains.push(((with - part / whole * with_whole).powi(2) / left, run.inputs[1][k]));
                }
            }
        }
        gains.sort_by(|a, b| b.0.total_cmp(&a.0));
        gains.into_iter().take(8).map(|(_, row)| vec![(self.layout.slip_row.index, row)]).collect()
    }
}
