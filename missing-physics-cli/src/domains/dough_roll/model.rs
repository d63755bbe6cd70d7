//! The full model of a rolled dough: learned dynamics, and what may have become of the response since.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use dough_mbrl::band::Band;
use dough_mbrl::dynamics::{Dynamics, Roll, courses};
use dough_mbrl::filter::{Fresh, Step as Followed, follow};
use missing_physics::data::Run;
use missing_physics::model::{Model, PredictError, Spec};
use nalgebra::{Const, DMatrix, DVector, Dyn, OMatrix, SymmetricEigen};

use super::read::{RunOfRolls, Step};
use super::spec::{Effects, Places, build};

/// Doughs whose errors are tied by what was not learned.
#[derive(Debug)]
struct Block {
    doughs: Vec<Dough>,
    fresh: Fresh,
    /// Directions in which errors are tied, one a column, and by how much each is to be shortened.
    tied: DMatrix<f64>,
    shorter: DVector<f64>,
    /// Errors where nothing has happened.
    off: DVector<f64>,
}

/// A dough with its rolls; its first error among those of its block.
#[derive(Debug)]
struct Dough {
    steps: Vec<Step>,
    rolls: Vec<Roll>,
    first: usize,
}

/// The errors of a block, by the bits of the shared parameters.
type Errors = Mutex<HashMap<(usize, Vec<u64>), Arc<DVector<f64>>>>;
/// Errors that are kept.
const MOST_KEPT: usize = 256;

/// The model of the domain `dough-roll`.
#[derive(Debug)]
pub(super) struct DoughModel {
    band: Band,
    dynamics: Dynamics,
    spec: Spec,
    places: Places,
    blocks: Vec<Block>,
    /// Block and dough of each run.
    runs: HashMap<String, (usize, usize)>,
    kept: Errors,
    /// Typical sigma of each channel: errors are shown in metres.
    scale: [f64; 6],
}

/// Channels: the three dimensions after a roll, and before it.
pub(super) const CHANNELS: [&str; 6] =
    ["next_length_m", "next_width_m", "next_height_m", "length_m", "width_m", "height_m"];
/// Errors of a roll: of the measurement after it, and before it.
const PER_ROLL: usize = CHANNELS.len();

impl DoughModel {
    pub(super) fn new(band: Band, dynamics: Dynamics, timed: bool, steps: &[Step]) -> Self {
        let strongest =
            steps.iter().map(|s| band.force_n(s.roll.action[0], s.roll.action[1])).fold(0.0, f64::max);
        let longest = steps.iter().map(|s| s.t_s).fold(0.0, f64::max);
        let last = steps.iter().map(|s| s.step).fold(1.0, f64::max);
        let (spec, places) = build(timed.then_some(longest.max(1.0)), strongest.max(1e-9), last);
        let noise = dynamics.noise();
        let scale = std::array::from_fn(|c| {
            (noise.measured[usize::from(c < 3)][c % 3] + noise.process[c % 3]).sqrt()
        });
        let (blocks, runs, kept) = (Vec::new(), HashMap::new(), Mutex::default());
        Self { band, dynamics, spec, places, blocks, runs, kept, scale }
    }

    /// Adds runs whose errors are tied, and says what the engine is to see of them.
    pub(super) fn add(&mut self, runs: &[RunOfRolls]) -> Vec<Run> {
        let mut doughs = Vec::new();
        let mut first = 0;
        for (k, (label, steps)) in runs.iter().enumerate() {
            self.runs.insert(label.clone(), (self.blocks.len(), k));
            doughs.push(Dough { steps: steps.clone(), rolls: steps.iter().map(|s| s.roll).collect(), first });
            first += PER_ROLL * steps.len();
        }
        let fresh: Vec<_> = doughs.iter().filter_map(|d| Some(d.rolls.first()?.state)).collect();
        let fresh = Fresh::of(&fresh, self.dynamics.noise());
        let (tied, shorter) = self.tie(&doughs, &fresh, first);
        let mut block = Block { doughs, fresh, tied, shorter, off: DVector::zeros(first) };
        block.off = self.errors(&block, &Effects::OFF);
        self.blocks.push(block);
        runs.iter().enumerate().map(|(k, (label, _))| self.shown(label, k)).collect()
    }

    /// How the uncertainty of what was learned ties the errors of doughs: directions, and by how much each is to be shortened.
    fn tie(&self, doughs: &[Dough], fresh: &Fresh, rows: usize) -> (DMatrix<f64>, DVector<f64>) {
        /// Below this part of its own variance nothing is said to be tied.
        const LEAST: f64 = 1e-3;
        let p = self.dynamics.coefficients();
        // Coefficients of all doughs, then each one's own level and slope.
        let columns = 3 * p + 6 * doughs.len();
        let own = self.dynamics.own();
        let mut all = DMatrix::zeros(rows, columns);
        for (at, dough) in doughs.iter().enumerate() {
            let courses = courses(dough.rolls.len());
            let mut sensitivity = OMatrix::<f64, Const<3>, Dyn>::zeros(columns);
            for (i, step) in self.follow(dough, fresh, &Effects::OFF).iter().enumerate() {
                let row = dough.first + PER_ROLL * i;
                let mut write = |offset: usize,
                                 factor: &nalgebra::Matrix3<f64>,
                                 sensitivity: &OMatrix<f64, Const<3>, Dyn>| {
                    let mut white = -sensitivity.clone();
                    factor.solve_lower_triangular_mut(&mut white);
                    all.view_mut((row + offset, 0), (3, columns)).copy_from(&white);
                };
                write(3, &step.before.factor, &sensitivity);
                sensitivity -= step.before.gain * &sensitivity;
                sensitivity = step.gradient * &sensitivity;
                for (k, told) in self.dynamics.told(&step.state, &dough.rolls[i].action).iter().enumerate() {
                    let mut coefficients = sensitivity.view_mut((k, k * p), (1, p));
                    coefficients += told.transpose();
                }
                for (c, course) in courses.iter().enumerate() {
                    for (k, own) in own.iter().enumerate() {
                        sensitivity[(k, 3 * p + 6 * at + 3 * c + k)] += own * course[i];
                    }
                }
                write(0, &step.after.factor, &sensitivity);
                sensitivity -= step.after.gain * &sensitivity;
            }
        }
        let eigen = SymmetricEigen::new(all.tr_mul(&all));
        let strong: Vec<usize> = (0..columns).filter(|&k| eigen.eigenvalues[k] > LEAST).collect();
        let mut tied = DMatrix::zeros(rows, strong.len());
        let shorter = DVector::from_iterator(
            strong.len(),
            strong.iter().map(|&k| 1.0 - 1.0 / (1.0 + eigen.eigenvalues[k]).sqrt()),
        );
        for (column, &k) in strong.iter().enumerate() {
            let direction = &all * eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt();
            tied.set_column(column, &direction);
        }
        (tied, shorter)
    }

    fn follow(&self, dough: &Dough, fresh: &Fresh, effects: &Effects) -> Vec<Followed> {
        let left = (1.0 - effects.volume_loss).max(0.0).cbrt();
        follow(&dough.rolls, fresh, self.dynamics.noise(), effects.springback, |i, x| {
            let step = &dough.steps[i];
            let [throw, depth] = step.roll.action;
            let response =
                effects.response(step.step, step.t_s, self.band.force_n(throw, depth), throw, x[0]);
            left * (x + response * self.dynamics.change(x, &step.roll.action))
        })
    }

    /// The errors of a block under some effects: independent, of variance one.
    fn errors(&self, block: &Block, effects: &Effects) -> DVector<f64> {
        let mut errors = DVector::zeros(block.tied.nrows());
        for dough in &block.doughs {
            for (i, step) in self.follow(dough, &block.fresh, effects).iter().enumerate() {
                let row = dough.first + PER_ROLL * i;
                errors.fixed_rows_mut::<3>(row).copy_from(&step.after.white());
                errors.fixed_rows_mut::<3>(row + 3).copy_from(&step.before.white());
            }
        }
        let along = block.tied.tr_mul(&errors).component_mul(&block.shorter);
        errors - &block.tied * along
    }

    /// The same, kept for the other runs of the block.
    fn kept_errors(&self, block: usize, shared: &[f64]) -> Arc<DVector<f64>> {
        let key = (block, shared.iter().map(|v| v.to_bits()).collect::<Vec<u64>>());
        let lock = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(errors) = lock().get(&key) {
            return Arc::clone(errors);
        }
        let errors = Arc::new(self.errors(&self.blocks[block], &self.places.effects(shared)));
        let mut kept = lock();
        if kept.len() >= MOST_KEPT {
            kept.clear();
        }
        kept.insert(key, Arc::clone(&errors));
        errors
    }

    /// What the engine is to see of a dough.
    fn shown(&self, label: &str, dough: usize) -> Run {
        let block = &self.blocks[self.blocks.len() - 1];
        let dough = &block.doughs[dough];
        let of = |f: &dyn Fn(&Step) -> f64| dough.steps.iter().map(f).collect::<Vec<f64>>();
        let inputs = vec![
            of(&|s| s.step),
            of(&|s| s.t_s),
            of(&|s| s.roll.state[0]),
            of(&|s| s.roll.state[1]),
            of(&|s| s.roll.state[2]),
            of(&|s| s.roll.action[0]),
            of(&|s| s.roll.action[1]),
            of(&|s| self.band.force_n(s.roll.action[0], s.roll.action[1])),
        ];
        let channel = |c: usize| {
            let of = |i| self.scale[c] * block.off[dough.first + PER_ROLL * i + c];
            (0..dough.steps.len()).map(of).collect::<Vec<f64>>()
        };
        let mut outputs: Vec<Vec<f64>> = (0..PER_ROLL).map(channel).collect();
        // A fresh dough is what it is.
        outputs[3..].iter_mut().for_each(|c| c[0] = f64::NAN);
        Run { label: label.into(), inputs, outputs, kind: 0 }
    }
}

impl Model for DoughModel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(&self, run: &Run, shared: &[f64], _own: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        let Some(&(block, dough)) = self.runs.get(&run.label) else {
            return Err(PredictError { run: run.label.clone(), reason: "no such rolls".into() });
        };
        let errors = self.kept_errors(block, shared);
        let block = &self.blocks[block];
        let (n, first) = (run.len(), block.doughs[dough].first);
        for (at, value) in out.iter_mut().enumerate() {
            let (channel, roll) = (at / n, at % n);
            let row = first + PER_ROLL * roll + channel;
            *value = self.scale[channel] * (block.off[row] - errors[row]);
        }
        Ok(())
    }

    fn prediction_is_clean(&self) -> bool {
        false
    }

    /// Errors come apart by their own covariance.
    fn longest_noise(&self) -> f64 {
        0.0
    }
}
