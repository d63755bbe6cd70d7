//! The full model of a tilt sweep: physics from `liquid-haptics`, and all parameters.

use std::sync::Arc;

use liquid_haptics::container::mesh::{MeshContainer, PlannedMesh};
use liquid_haptics::container::{Container, Cylinder};
use liquid_haptics::wrench::{Departures, Grasp};
use missing_physics::data::Run;
use missing_physics::model::{ErrorModel, Extensions, Model, MultimodalModel, PredictError, Scope, Spec};

use crate::builder::{At, Builder};
use crate::kept::Kept;

/// The container, by its outer surface.
#[derive(Debug, Clone, PartialEq)]
pub enum Vessel {
    /// A circular cylinder.
    Cylinder {
        /// Outer radius, m.
        radius_m: f64,
        /// Outer length, m.
        length_m: f64,
    },
    /// Any shape: z along the axis, the bottom at z = 0.
    Mesh(Arc<MeshContainer>),
}

/// What a liquid may be in, shared between threads.
type Cavity = Arc<dyn Container + Send + Sync>;

/// How many walls of a mesh are remembered; then it begins anew.
const MOST_WALLS: usize = 64;

impl Vessel {
    /// Outer length along the axis, m.
    pub fn length_m(&self) -> f64 {
        match self {
            Self::Cylinder { length_m, .. } => *length_m,
            Self::Mesh(mesh) => mesh.bounds().1.z,
        }
    }

    /// Volume inside the outer surface, m^3.
    pub fn capacity_m3(&self) -> f64 {
        match self {
            Self::Cylinder { radius_m, length_m } => std::f64::consts::PI * radius_m * radius_m * length_m,
            Self::Mesh(mesh) => mesh.capacity_m3(),
        }
    }

    /// The thickest wall that leaves a cavity worth the name, m.
    fn thickest_m(&self) -> f64 {
        match self {
            Self::Cylinder { radius_m, length_m } => 0.5 * radius_m.min(0.5 * length_m),
            Self::Mesh(mesh) => {
                let (low, high) = mesh.bounds();
                let sound = |wall: &f64| mesh.with_wall(*wall).is_ok();
                (1..8).map(|k| 0.25 * (high - low).min() * 0.5f64.powi(k)).find(sound).unwrap_or(0.0)
            }
        }
    }

    fn cavity(&self, wall_m: f64) -> Result<Cavity, String> {
        Ok(match self {
            Self::Cylinder { radius_m, length_m } => {
                Arc::new(Cylinder::new(*radius_m, *length_m, wall_m).map_err(|e| e.to_string())?)
            }
            Self::Mesh(mesh) => {
                Arc::new(PlannedMesh::new(mesh.with_wall(wall_m).map_err(|e| e.to_string())?))
            }
        })
    }
}

/// What is known of the set-up.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// The container.
    pub vessel: Vessel,
    /// How it is held.
    pub grasp: Grasp,
    /// Density of the liquid, where it is known, kg/m^3.
    pub density_kg_m3: Option<f64>,
    /// Whether the volume of each run was measured (input 2).
    pub volumes_known: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Places {
    thickness: At,
    gain: At,
    torque: At,
    angle: At,
    grasp: At,
    shift: At,
    slip: At,
    slip_row: At,
    drift: At,
    lag: At,
    mass: Option<At>,
    volume: Option<At>,
}

/// The model of the domain `liquid-tilt`.
pub struct LiquidTiltModel {
    setup: Setup,
    /// Cavities by the thickness of their wall (its bits), where making one takes long.
    cavities: Kept<u64, Cavity>,
    spec: Spec,
    places: Places,
    slip: usize,
}

impl std::fmt::Debug for LiquidTiltModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LiquidTiltModel").field("setup", &self.setup).finish_non_exhaustive()
    }
}

impl LiquidTiltModel {
    /// The model of a set-up whose recording has the given number of rows.
    pub fn new(setup: Setup, rows: usize) -> Self {
        let (spec, places) = build(&setup, rows);
        let slip = spec.mechanisms.iter().position(|m| m.id == "grasp-slip").unwrap_or(usize::MAX);
        Self { setup, cavities: Kept::new(MOST_WALLS), spec, places, slip }
    }

    fn cavity(&self, wall_m: f64) -> Result<Cavity, String> {
        if matches!(self.setup.vessel, Vessel::Cylinder { .. }) {
            return self.setup.vessel.cavity(wall_m);
        }
        self.cavities.get_or(wall_m.to_bits(), || self.setup.vessel.cavity(wall_m))
    }

    /// What is known of the set-up.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Nuisance parameters of a run with a mass (kg) of liquid of a volume (m^3), as far as the run has them.
    pub fn nuisance(&self, mass_kg: f64, volume_m3: f64) -> Vec<f64> {
        let mut nuisance = vec![0.0; self.spec.count(Scope::PerRun)];
        for (at, value) in [(self.places.mass, mass_kg), (self.places.volume, volume_m3)] {
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
        let mass = self.places.mass.map(|at| nuisance[at.slot]);
        let volume = known
            .or_else(|| self.places.volume.map(|at| nuisance[at.slot]))
            .or_else(|| Some(mass? / self.setup.density_kg_m3?))
            .unwrap_or(0.0);
        (mass.unwrap_or_else(|| volume * self.setup.density_kg_m3.unwrap_or(0.0)), volume)
    }

    fn feel(&self, run: &Run, shared: &[f64], nuisance: &[f64], out: &mut [f64]) -> Result<(), String> {
        let p = &self.places;
        let [theta, row, ..] = run.inputs.as_slice() else {
            return Err("theta_rad and row are missing".into());
        };
        let cavity = self.cavity(shared[p.thickness.slot])?;
        let (mass, volume) = self.load(run, nuisance);
        let volume = volume.clamp(0.0, cavity.capacity_m3());
        let mut departures = Departures {
            force_gain: shared[p.gain.slot],
            torque_offset_nm: 0.0,
            angle_offset_rad: shared[p.angle.slot],
            grasp_offset_m: 0.0,
            shell_shift_m: shared[p.shift.slot],
            surface_lag_rad: shared[p.lag.slot],
        };
        let slip_row = shared[p.slip_row.slot];
        let slips = row.contains(&slip_row);
        let n = theta.len();
        for (i, (theta, row)) in theta.iter().zip(row).enumerate() {
            let slipped = if slips && *row >= slip_row { shared[p.slip.slot] } else { 0.0 };
            departures.grasp_offset_m = shared[p.grasp.slot] + slipped;
            departures.torque_offset_nm = shared[p.torque.slot] + shared[p.drift.slot] * row;
            let felt = self
                .setup
                .grasp
                .wrench(&*cavity, *theta, mass, volume, &departures)
                .map_err(|e| e.to_string())?;
            out[i] = felt.fx_n;
            out[n + i] = felt.fy_n;
            out[2 * n + i] = felt.tau_z_nm;
        }
        Ok(())
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
        self.feel(run, shared, nuisance, out)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        let grasp = &self.setup.grasp;
        let Some(forces) = run.outputs.get(1) else { return };
        let finite = forces.iter().filter(|f| f.is_finite());
        let (sum, n) = finite.fold((0.0, 0.0), |(s, n), f| (s + f, n + 1.0));
        let weight = -sum / f64::max(n, 1.0) / grasp.gravity_m_s2;
        let mass = (weight - grasp.container_mass_kg - grasp.gripper_mass_kg).max(0.0);
        if let Some(at) = self.places.mass {
            nuisance[at.slot] = mass;
        }
        let Some(at) = self.places.volume else { return };
        // The volume whose torque is nearest, on a grid: the surface has more than one valley.
        let mut shared: Vec<f64> =
            self.spec.parameters.iter().filter(|p| p.scope == Scope::Shared).map(|p| p.start).collect();
        shared[self.places.slip_row.slot] = -1.0;
        let capacity = self.setup.vessel.capacity_m3();
        let mut out = vec![0.0; 3 * run.len()];
        let mut best = (f64::INFINITY, 0.5 * capacity);
        for k in 1..40 {
            let volume = capacity * f64::from(k) / 40.0;
            nuisance[at.slot] = volume;
            if self.feel(run, &shared, nuisance, &mut out).is_err() {
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
        Extensions { errors: Some(self), modes: Some(self), ..Extensions::default() }
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
        gains.into_iter().take(8).map(|(_, row)| vec![(self.places.slip_row.index, row)]).collect()
    }
}

fn build(setup: &Setup, rows: usize) -> (Spec, Places) {
    let mut b = Builder::default();
    let mut p = Places::default();
    let grasp = &setup.grasp;
    let capacity = setup.vessel.capacity_m3();
    b.baseline("the weight of gripper, container and liquid (eq. 2.1): walls of no thickness, a level surface, the shell's centre of mass in its middle");
    if !(setup.volumes_known && setup.density_kg_m3.is_some()) {
        let most = setup.density_kg_m3.map_or(30.0 * (capacity * 1e3), |d| d * capacity);
        p.mass = Some(b.nuisance("liquid_mass_kg", "kg", [0.0, most], capacity * 100.0));
    }
    if !setup.volumes_known && setup.density_kg_m3.is_none() {
        p.volume = Some(b.nuisance("volume_m3", "m^3", [0.0, capacity], 0.1 * capacity));
    }
    let length = setup.vessel.length_m();
    let moment = grasp.gravity_m_s2 * (grasp.container_mass_kg + capacity * 500.0) * length;
    p.thickness = b.shared("thickness_m", "m", 0.0, [0.0, setup.vessel.thickest_m()], 1e-3);
    b.mechanism(
        "wall-thickness",
        &[p.thickness],
        [
            "thickness of the wall",
            "The container was measured outside; its cavity is smaller by the thickness of wall, base and lid.",
            "cavity radius R - t, length L - 2 t",
            "thesis, section 2.6 (the outer radius used for the inner one)",
        ],
        &["force-gain", "grasp-offset"],
    );
    p.gain = b.shared("gain", "", 0.0, [-0.3, 0.3], 0.01);
    b.mechanism(
        "force-gain",
        &[p.gain],
        [
            "gain of the force sensor",
            "Forces read too high or too low in proportion; the torque does not.",
            "fx, fy times 1 + gain",
            "thesis, section 2.6 (recalibrated by linear regression)",
        ],
        &["wall-thickness", "grasp-offset"],
    );
    p.torque = b.shared("offset_nm", "N m", 0.0, [-moment, moment], 1e-3 * moment);
    b.mechanism(
        "torque-offset",
        &[p.torque],
        [
            "offset of the torque",
            "The torque reads a constant too much.",
            "tau_z + offset",
            "thesis, section 2.5 (offset removal)",
        ],
        &["angle-offset", "sensor-drift"],
    );
    p.angle = b.shared("angle_rad", "rad", 0.0, [-0.3, 0.3], 0.01);
    b.mechanism(
        "angle-offset",
        &[p.angle],
        [
            "offset of the angle",
            "The container is tilted by a constant more than stated.",
            "container's tilt = theta + angle; the sensor's axes keep to theta",
            "Siciliano et al. 2009, Robotics, doi:10.1007/978-1-84628-642-1, ch. 2",
        ],
        &["torque-offset", "surface-lag"],
    );
    p.grasp = b.shared("offset_m", "m", 0.0, [-0.25 * length, 0.25 * length], 1e-3);
    b.mechanism(
        "grasp-offset",
        &[p.grasp],
        [
            "offset of the grasp",
            "The container is held higher than stated.",
            "L_g + offset",
            "thesis, eq. 2.1",
        ],
        &["cap-mass", "wall-thickness", "force-gain"],
    );
    p.shift = b.shared("shift_m", "m", 0.0, [-0.5 * length, 0.5 * length], 5e-3);
    b.mechanism(
        "cap-mass",
        &[p.shift],
        [
            "mass of the cap",
            "The empty container's centre of mass is off its middle.",
            "shell's centre of mass at L/2 + shift",
            "thesis, section 2.6",
        ],
        &["grasp-offset"],
    );
    p.slip = b.shared("slip_m", "m", 0.0, [-0.25 * length, 0.25 * length], 1e-3);
    p.slip_row = b.shared("row", "", -1.0, [-1.0, rows as f64], 1.0);
    let slip = b.mechanism(
        "grasp-slip",
        &[p.slip, p.slip_row],
        [
            "slip of the grasp",
            "At one pose the container slides in the gripper, and stays there to the end of the run.",
            "L_g + slip from that row on (rows of the file counted from 0)",
            "thesis, section 2.6",
        ],
        &["grasp-offset", "sensor-drift"],
    );
    slip.integer_parameters = vec![p.slip_row.index];
    p.drift =
        b.shared("rate_nm_per_row", "N m", 0.0, [-moment, moment], 0.3 * moment / rows.max(1) as f64 * 1e-2);
    b.mechanism(
        "sensor-drift",
        &[p.drift],
        [
            "drift of the sensor",
            "The torque's offset grows from row to row over the whole file.",
            "tau_z + rate row",
            "ATI Industrial Automation, F/T sensor manual (drift with temperature)",
        ],
        &["torque-offset"],
    );
    p.lag = b.shared("angle_rad", "rad", 0.0, [-0.5, 0.5], 0.01);
    b.mechanism(
        "surface-lag",
        &[p.lag],
        [
            "lag of the surface",
            "The surface has not settled: it rests at an angle to level.",
            "the surface stands as at theta - angle",
            "thesis, section 2.4 (a thick liquid takes its time)",
        ],
        &["angle-offset"],
    );
    (b.build_unchecked(), p)
}
