//! The full model of a rolled dough: learned dynamics, and what may have become of the response since.

use std::collections::HashMap;
use std::convert::Infallible;
use std::sync::{Arc, OnceLock};

use dough_mbrl::band::Band;
use dough_mbrl::dynamics::Dynamics;
use dough_mbrl::filter::{InitialState, Relaxation, Step as Followed, follow};
use dough_mbrl::repair::answered;
use dough_mbrl::roll::Roll;
use dough_mbrl::sensitivity::{PER_ROLL, negative_log_likelihood, whitened};
use dough_mbrl::whitener::CommonModeWhitener;
use missing_physics::data::Run;
use missing_physics::model::{
    ErrorModel, Extensions, LocalCauses, LocalUnknown, Model, MultimodalModel, PredictError, Quantity, Spec,
};
use nalgebra::{DVector, Vector3};

use super::forces::Forces;
use super::least::least;
use super::rolls::{RunOfRolls, Step};
use super::spec::{Effects, Layout, for_rolls, force_n};
use crate::memo::{Memo, bits};

/// Doughs whose errors are tied by what was not learned.
#[derive(Debug)]
struct Block {
    doughs: Vec<Dough>,
    initial: InitialState,
    whitener: CommonModeWhitener,
    /// Errors where every effect is off.
    off: DVector<f64>,
}

/// A dough with its rolls; its first error among those of its block.
#[derive(Debug)]
struct Dough {
    steps: Vec<Step>,
    rolls: Vec<Roll>,
    first: usize,
}

/// The errors of a block, by its number and the bits of the shared parameters.
type Errors = Memo<(usize, Vec<u64>), Arc<DVector<f64>>>;
/// How many blocks' errors are remembered.
const MOST_ERRORS: usize = 256;
/// Forces below which a band may slip that are looked at, and those from which a fit begins.
const MOST_SLIPS: usize = 200;
const STARTS: usize = 5;

/// The model of the domain `dough-roll`.
#[derive(Debug)]
pub(super) struct DoughModel {
    band: Band,
    dynamics: Dynamics,
    /// Forces of the recording's rolls.
    forces: Forces,
    spec: Spec,
    layout: Layout,
    blocks: Vec<Block>,
    /// Effects estimated from the recording, all rolls alike: errors are linearised about them, and whitened.
    first_estimate: Option<Effects>,
    /// Block and dough of each run.
    runs: HashMap<String, (usize, usize)>,
    memo: Errors,
    slips: OnceLock<Vec<(f64, DVector<f64>)>>,
    /// Typical sigma of each channel: errors are shown in metres.
    scale: [f64; 6],
}

impl DoughModel {
    pub(super) fn new(band: Band, dynamics: Dynamics, timed: bool, steps: &[Step]) -> Self {
        let forces = Forces::of(steps.iter().map(|s| force_n(&band, s)));
        let (spec, layout) = for_rolls(&band, timed, steps);
        let noise = dynamics.noise();
        let scale = std::array::from_fn(|c| {
            (noise.measured[usize::from(c < 3)][c % 3] + noise.process[c % 3]).sqrt()
        });
        let (blocks, runs, memo, slips) =
            (Vec::new(), HashMap::new(), Memo::new(MOST_ERRORS), OnceLock::new());
        Self { band, dynamics, forces, spec, layout, blocks, first_estimate: None, runs, memo, slips, scale }
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
        let first_states: Vec<_> = doughs.iter().filter_map(|d| Some(d.rolls.first()?.state)).collect();
        let initial = InitialState::of(&first_states, self.dynamics.noise());
        let shown = self.first_estimate.unwrap_or_else(|| self.estimate_at_first(&doughs, &initial));
        self.first_estimate = Some(shown);
        let whitener = self.whitener(&doughs, &initial, &shown);
        let mut block = Block { doughs, initial, whitener, off: DVector::zeros(first) };
        block.off = self.errors(&block, &Effects::OFF);
        self.blocks.push(block);
        runs.iter().enumerate().map(|(k, (label, _))| self.run(label, k)).collect()
    }

    /// The common response, springback and loss that are most likely, one after the other.
    fn estimate_at_first(&self, doughs: &[Dough], initial: &InitialState) -> Effects {
        let cost = |effects: &Effects| -> f64 {
            let off = |d| negative_log_likelihood(&self.follow(d, initial, effects, &|_| 0.0));
            doughs.iter().map(off).map(|likelihood| likelihood.twice()).sum()
        };
        let mut shown = Effects::OFF;
        for _ in 0..2 {
            let factor = |log: f64| Effects { factor: log.exp(), ..shown };
            shown = factor(least([f64::ln(0.1), f64::ln(10.0)], |log| cost(&factor(log))));
            let springback = |part: f64| Effects { springback: part, ..shown };
            shown = springback(least([0.0, 0.9], |part| cost(&springback(part))));
            let volume_loss = |part: f64| Effects { volume_loss: part, ..shown };
            shown = volume_loss(least([0.0, 0.2], |part| cost(&volume_loss(part))));
        }
        shown
    }

    /// A whitener of what was not learned of the dynamics: a mode that all doughs have in common.
    fn whitener(&self, doughs: &[Dough], initial: &InitialState, shown: &Effects) -> CommonModeWhitener {
        let answers = |dough: &Dough| {
            let steps = self.follow(dough, initial, shown, &|_| 0.0);
            self.dynamics
                .unlearned(&steps, &dough.rolls, |i| self.response(dough, i, shown, steps[i].state[0]))
        };
        CommonModeWhitener::new(&doughs.iter().map(answers).collect::<Vec<_>>())
    }

    /// Follows a dough under some effects, the response of each roll larger by a part of itself.
    fn follow(
        &self,
        dough: &Dough,
        initial: &InitialState,
        effects: &Effects,
        larger: &dyn Fn(usize) -> f64,
    ) -> Vec<Followed> {
        let loss_factor = (1.0 - effects.volume_loss).max(0.0).cbrt();
        let relaxation = Relaxation { springback: effects.springback, loss_factor };
        follow(&dough.rolls, initial, self.dynamics.noise(), relaxation, |i, x| {
            let response = (1.0 + larger(i)) * self.response(dough, i, effects, x[0]);
            let learned = x + self.dynamics.change(x, &dough.steps[i].roll.action);
            Vector3::from(answered(&(*x).into(), &learned.into(), response))
        })
    }

    /// The part of the learned response of a roll that takes place.
    fn response(&self, dough: &Dough, roll: usize, effects: &Effects, length_m: f64) -> f64 {
        let step = &dough.steps[roll];
        let grip = self.forces.grip(self.force_n(step), effects.slip_n);
        grip * effects.response(step.step, step.t_s, step.roll.action[0], length_m)
    }

    fn force_n(&self, step: &Step) -> f64 {
        force_n(&self.band, step)
    }

    /// The errors of a block under some effects: independent, of variance one.
    fn errors(&self, block: &Block, effects: &Effects) -> DVector<f64> {
        self.errors_of(block, effects, &|_, _| 0.0)
    }

    /// The errors of a block where the response of each roll is larger by a part of itself, by dough and roll.
    fn errors_of(
        &self,
        block: &Block,
        effects: &Effects,
        larger: &dyn Fn(usize, usize) -> f64,
    ) -> DVector<f64> {
        let mut errors = DVector::zeros(block.off.len());
        for (at, dough) in block.doughs.iter().enumerate() {
            let of_dough = whitened(&self.follow(dough, &block.initial, effects, &|roll| larger(at, roll)));
            errors.rows_mut(dough.first, of_dough.len()).copy_from(&of_dough);
        }
        block.whitener.whiten(&errors)
    }

    /// What slips change, by the force below which the band slips: halfway between the forces of two rolls.
    fn slips(&self) -> &[(f64, DVector<f64>)] {
        self.slips.get_or_init(|| {
            let (Some(block), forces) = (self.blocks.first(), self.forces.rising()) else {
                return Vec::new();
            };
            let every = forces.len().div_ceil(MOST_SLIPS).max(1);
            let halfway = forces.windows(2).step_by(every).map(|w| 0.5 * (w[0] + w[1]));
            let change = |slip_n| {
                let slips = Effects { slip_n, ..Effects::OFF };
                (slip_n, &block.off - self.errors(block, &slips))
            };
            halfway.map(change).collect()
        })
    }

    /// What a change of the recording's errors leaves of a residual, as a sum of squares.
    fn squared_misfit(&self, runs: &[Run], residual: &[Vec<Vec<f64>>], change: &DVector<f64>) -> f64 {
        let mut sum = 0.0;
        for (run, residual) in runs.iter().zip(residual) {
            let Ok((0, dough)) = self.place(run) else { continue };
            let first = self.blocks[0].doughs[dough].first;
            for (channel, rows) in residual.iter().enumerate() {
                for (roll, left) in rows.iter().enumerate().filter(|(_, left)| left.is_finite()) {
                    let changed = change[first + PER_ROLL * roll + channel];
                    sum += (left / self.scale[channel] - changed).powi(2);
                }
            }
        }
        sum
    }

    /// Block and dough of a run.
    fn place(&self, run: &Run) -> Result<(usize, usize), PredictError> {
        let unknown = || PredictError { run: run.label.clone(), reason: "no such rolls".into() };
        self.runs.get(&run.label).copied().ok_or_else(unknown)
    }

    /// The errors of a block at shared parameters, remembered for its other runs.
    fn errors_at(&self, block: usize, shared: &[f64]) -> Arc<DVector<f64>> {
        let make = || Arc::new(self.errors(&self.blocks[block], &self.layout.effects(shared)));
        let Ok(errors) = self.memo.get_or((block, bits(shared)), 1, || Ok::<_, Infallible>(make()));
        errors
    }

    /// What the engine is to see of a dough.
    fn run(&self, label: &str, dough: usize) -> Run {
        let block = &self.blocks[self.blocks.len() - 1];
        let dough = &block.doughs[dough];
        let of = |f: &dyn Fn(&Step) -> f64| dough.steps.iter().map(f).collect::<Vec<f64>>();
        // The state that was expected: a measured one shares its noise with the error that is to be a function of it.
        let followed = self.follow(dough, &block.initial, &Effects::OFF, &|_| 0.0);
        let expected = |k: usize| -> Vec<f64> {
            dough.steps.iter().zip(&followed).map(|(s, f)| s.roll.state[k] - f.before.residual[k]).collect()
        };
        let inputs = vec![
            expected(0),
            expected(1),
            expected(2),
            of(&|s| s.roll.action[0]),
            of(&|s| s.roll.action[1]),
            of(&|s| self.force_n(s)),
            of(&|s| s.step),
            of(&|s| s.t_s),
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

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        _nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        let (block, dough) = self.place(run)?;
        let errors = self.errors_at(block, shared);
        let block = &self.blocks[block];
        let (n, first) = (run.len(), block.doughs[dough].first);
        for (at, value) in out.iter_mut().enumerate() {
            let (channel, roll) = (at / n, at % n);
            let row = first + PER_ROLL * roll + channel;
            *value = self.scale[channel] * (block.off[row] - errors[row]);
        }
        Ok(())
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

impl MultimodalModel for DoughModel {
    /// Forces below which the band may slip: between two of those of the rolls there is no slope to follow, so that all are looked at.
    fn starts(&self, mechanism: usize, runs: &[Run], residual: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        let slip = self.layout.slip.index;
        if self.spec.mechanisms[mechanism].parameters != [slip] {
            return Vec::new();
        }
        let misfits: Vec<(f64, f64)> = self
            .slips()
            .iter()
            .map(|(force_n, off)| (*force_n, self.squared_misfit(runs, residual, off)))
            .collect();
        let least = |&at: &usize| {
            let near = &misfits[at.saturating_sub(1)..(at + 2).min(misfits.len())];
            near.iter().all(|other| misfits[at].1 <= other.1)
        };
        let mut tops: Vec<usize> = (0..misfits.len()).filter(least).collect();
        tops.sort_by(|&a, &b| misfits[a].1.total_cmp(&misfits[b].1));
        tops.iter().take(STARTS).map(|&at| vec![(slip, misfits[at].0)]).collect()
    }

    fn jumps(&self, shared_slot: usize) -> &[f64] {
        if shared_slot == self.layout.slip.slot { self.forces.rising() } else { &[] }
    }
}

impl LocalCauses for DoughModel {
    fn unknowns(&self) -> Vec<LocalUnknown> {
        let part = Quantity::new("relative_response", "");
        vec![LocalUnknown::new("another response", vec![part])]
    }

    /// What was learned ties rolls of all doughs together.
    fn runs_are_alone(&self) -> bool {
        false
    }

    /// The response of each roll: what follows from that is measured in all rolls that what was learned ties to it.
    fn response(
        &self,
        _: (usize, usize),
        runs: &[Run],
        shared: &[f64],
        _: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        const PART: f64 = 1e-4;
        let effects = self.layout.effects(shared);
        let places = runs.iter().map(|run| self.place(run)).collect::<Result<Vec<_>, _>>()?;
        let mut changes = vec![Vec::new(); runs.len()];
        for (number, block) in self.blocks.iter().enumerate() {
            let run_of = |dough| places.iter().position(|place| *place == (number, dough));
            let of_dough: Vec<Option<usize>> = (0..block.doughs.len()).map(run_of).collect();
            if of_dough.iter().all(Option::is_none) {
                continue;
            }
            let moved = |by: f64| {
                let larger =
                    |dough: usize, roll: usize| of_dough[dough].map_or(0.0, |run| by * amounts[run][roll]);
                self.errors_of(block, &effects, &larger)
            };
            let change = (moved(-PART) - moved(PART)) / (2.0 * PART);
            for (run, dough) in
                of_dough.iter().zip(&block.doughs).filter_map(|(run, dough)| Some(((*run)?, dough)))
            {
                let n = dough.steps.len();
                let at = |place: usize| {
                    let (channel, roll) = (place / n, place % n);
                    self.scale[channel] * change[dough.first + PER_ROLL * roll + channel]
                };
                changes[run] = (0..PER_ROLL * n).map(at).collect();
            }
        }
        Ok(changes)
    }
}

impl ErrorModel for DoughModel {
    fn prediction_is_clean(&self) -> bool {
        false
    }

    /// Errors come apart by their own covariance.
    fn longest_correlation(&self) -> f64 {
        0.0
    }
}
