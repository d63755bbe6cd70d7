//! The full model of a rolled dough: learned dynamics, and what may have become of the response since.

use dough_mbrl::band::Band;
use dough_mbrl::dynamics::{Action, Dynamics, Likely, State};
use missing_physics::data::Run;
use missing_physics::model::{Model, PredictError, Spec};
use nalgebra::{DMatrix, DVector};

use super::read::{RunOfRolls, Step};
use super::spec::{Effects, Places, build};

/// A roll whose place in the recording is known, with what was learned of it.
#[derive(Debug, Clone, Copy)]
struct Known {
    step: Step,
    /// The likely state before it, and the learned one after it.
    likely: State,
    learned: State,
    force_n: f64,
    /// Index of the roll before it, in the same run.
    before: Option<usize>,
}

/// Rolls whose errors are taken apart together.
#[derive(Debug)]
struct Block {
    rolls: Vec<Known>,
    /// Inverse factors of the covariance of the errors of each output, in units of its noise.
    apart: [DMatrix<f64>; 3],
}

/// Where the rows of a run are: its block, and the first of its rows there.
#[derive(Debug, Clone, Copy)]
struct Place {
    block: usize,
    first: usize,
}

/// The model of the domain `dough-roll`.
#[derive(Debug)]
pub(super) struct DoughModel {
    band: Band,
    dynamics: Dynamics,
    /// `None` where no state was measured twice.
    likely: Option<Likely>,
    spec: Spec,
    places: Places,
    blocks: Vec<Block>,
    runs: std::collections::HashMap<String, Place>,
}

/// Channels: the three dimensions after a roll, and how far each had moved when the next one began.
pub(super) const CHANNELS: [&str; 6] =
    ["next_length_m", "next_width_m", "next_height_m", "length_m", "width_m", "height_m"];

impl DoughModel {
    pub(super) fn new(
        band: Band,
        dynamics: Dynamics,
        likely: Option<Likely>,
        timed: bool,
        steps: &[Step],
    ) -> Self {
        let strongest =
            steps.iter().map(|s| band.force_n(s.roll.action[0], s.roll.action[1])).fold(0.0, f64::max);
        let longest = steps.iter().map(|s| s.t_s).fold(0.0, f64::max);
        let last = steps.iter().map(|s| s.step).fold(1.0, f64::max);
        let (spec, places) = build(timed.then_some(longest.max(1.0)), strongest.max(1e-9), last);
        Self {
            band,
            dynamics,
            likely,
            spec,
            places,
            blocks: Vec::new(),
            runs: std::collections::HashMap::new(),
        }
    }

    /// Adds runs whose errors are tied by what was not learned, and says what the engine is to see of them.
    pub(super) fn add(&mut self, runs: &[RunOfRolls]) -> Vec<Run> {
        let mut rolls = Vec::new();
        for (label, steps) in runs {
            self.runs.insert(label.clone(), Place { block: self.blocks.len(), first: rolls.len() });
            let mut before = None;
            for step in steps {
                let learned = self.dynamics.predict(&step.roll.state, &step.roll.action).map(|p| p.mean);
                let force_n = self.band.force_n(step.roll.action[0], step.roll.action[1]);
                let likely = self.likely.as_ref().map_or(step.roll.state, |l| l.state(&step.roll.state));
                rolls.push(Known { step: *step, likely, learned, force_n, before });
                before = Some(rolls.len() - 1);
            }
        }
        let tried: Vec<(State, Action)> =
            rolls.iter().map(|k| (k.step.roll.state, k.step.roll.action)).collect();
        let apart = std::array::from_fn(|k| inverse_factor(self.dynamics.covariance(k, &tried)));
        self.blocks.push(Block { rolls, apart });
        runs.iter().map(|(label, steps)| self.run(label, steps.len())).collect()
    }

    fn run(&self, label: &str, len: usize) -> Run {
        let place = self.runs[label];
        let rolls = &self.blocks[place.block].rolls[place.first..place.first + len];
        let of = |f: &dyn Fn(&Known) -> f64| rolls.iter().map(f).collect::<Vec<f64>>();
        let inputs = vec![
            of(&|k| k.step.step),
            of(&|k| k.step.t_s),
            of(&|k| k.step.roll.state[0]),
            of(&|k| k.step.roll.state[1]),
            of(&|k| k.step.roll.state[2]),
            of(&|k| k.step.roll.action[0]),
            of(&|k| k.step.roll.action[1]),
            of(&|k| k.force_n),
        ];
        let mut run = Run { label: label.into(), inputs, outputs: Vec::new(), kind: 0 };
        let mut white = vec![0.0; CHANNELS.len() * len];
        self.errors(&run, &Effects::OFF, &mut white);
        run.outputs = white.chunks(len).map(<[f64]>::to_vec).collect();
        for (row, known) in rolls.iter().enumerate() {
            if known.before.is_none() {
                run.outputs[3..].iter_mut().for_each(|channel| channel[row] = f64::NAN);
            }
        }
        run
    }

    /// What is measured less what is expected under some effects, taken apart, channel by channel.
    fn errors(&self, run: &Run, effects: &Effects, out: &mut [f64]) -> Option<()> {
        let place = self.runs.get(&run.label)?;
        let block = &self.blocks[place.block];
        let n = run.len();
        let until = place.first + n;
        let noise = self.dynamics.noise();
        for k in 0..3 {
            let off = DVector::from_iterator(
                until,
                block.rolls[..until]
                    .iter()
                    .map(|known| known.step.roll.next[k] - self.after(known, effects)[k]),
            );
            let white = block.apart[k].view((place.first, 0), (n, until)) * off;
            out[k * n..(k + 1) * n].copy_from_slice(white.as_slice());
            debug_assert!(noise[k] > 0.0);
            for (row, known) in block.rolls[place.first..until].iter().enumerate() {
                out[(3 + k) * n + row] = match known.before {
                    Some(before) => {
                        // By the expected change: the measured one shares its noise with what is explained.
                        let before = &block.rolls[before];
                        let change = self.after(before, effects)[k] - before.likely[k];
                        known.step.roll.state[k] - before.step.roll.next[k] + effects.springback * change
                    }
                    None => 0.0,
                };
            }
        }
        Some(())
    }

    /// The state after a roll under some effects.
    fn after(&self, known: &Known, effects: &Effects) -> State {
        let response = effects.response(known.step.step, known.step.t_s, known.force_n)
            * (1.0
                + effects.parity * if (known.step.step.round() as i64) % 2 == 0 { 1.0 } else { -1.0 }
                + effects.throw * (known.step.roll.action[0] - 0.08)
                + effects.length * (known.step.roll.state[0] - 0.06));
        let left = (1.0 - effects.volume_loss).max(0.0).cbrt();
        std::array::from_fn(|k| {
            let state = known.likely[k];
            left * (state + response * (known.learned[k] - state))
        })
    }
}

/// The inverse of the lower factor of a covariance.
fn inverse_factor(covariance: DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let mut inverse = DMatrix::identity(n, n);
    if let Some(factor) = covariance.cholesky() {
        factor.l_dirty().solve_lower_triangular_mut(&mut inverse);
    }
    inverse
}

impl Model for DoughModel {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(&self, run: &Run, shared: &[f64], _own: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        let wrong = || PredictError { run: run.label.clone(), reason: "no such rolls".into() };
        let mut shown = vec![0.0; out.len()];
        self.errors(run, &Effects::OFF, &mut shown).ok_or_else(wrong)?;
        self.errors(run, &self.places.effects(shared), out).ok_or_else(wrong)?;
        out.iter_mut().zip(&shown).for_each(|(o, s)| *o = s - *o);
        Ok(())
    }

    /// Errors come apart by their own covariance.
    fn longest_noise(&self) -> f64 {
        0.0
    }
}
