//! A perceptron as a regression: weighted least squares by Adam on all rows at once.

use rand::Rng;

use crate::error::Error;
use crate::learner::Learner;
use crate::network::{Activation, Network, Scratch, Shape};
use crate::points::Points;

/// How a perceptron is trained.
#[derive(Debug, Clone, PartialEq)]
pub struct DescentSettings {
    /// Passes over the rows, each one step of Adam (Kingma and Ba 2014, arXiv:1412.6980).
    pub epochs: usize,
    /// First step size, between 0 and 1.
    pub learning_rate: f64,
    /// Last step size over the first, above 0 and at most 1; it falls evenly.
    pub last_rate: f64,
    /// Penalty of each weight's half square, at least 0; biases have none.
    pub penalty: f64,
}

impl Default for DescentSettings {
    fn default() -> Self {
        Self { epochs: 600, learning_rate: 0.01, last_rate: 0.1, penalty: 1e-4 }
    }
}

impl DescentSettings {
    fn check(&self) -> Result<(), Error> {
        let bad = |name, value, rule| Err(Error::Setting { name, value, rule });
        if self.epochs == 0 {
            return bad("epochs", 0.0, "at least 1");
        }
        if !(self.learning_rate > 0.0 && self.learning_rate < 1.0) {
            return bad("learning_rate", self.learning_rate, "between 0 and 1");
        }
        if !(self.last_rate > 0.0 && self.last_rate <= 1.0) {
            return bad("last_rate", self.last_rate, "above 0, at most 1");
        }
        if !(self.penalty >= 0.0 && self.penalty.is_finite()) {
            return bad("penalty", self.penalty, "at least 0, finite");
        }
        Ok(())
    }
}

/// A perceptron with one hidden layer of smooth rectifiers, and a linear path past it; inputs and targets are to be of the size of one.
#[derive(Debug, Clone, PartialEq)]
pub struct Perceptron {
    network: Network,
}

/// Buffers of predictions, used again.
#[derive(Debug, Default)]
pub struct PredictionScratch(Scratch);

impl Perceptron {
    /// Random first weights, of layers of so many units, each at least 1.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn new<R: Rng + ?Sized>(
        inputs: usize,
        hidden: usize,
        outputs: usize,
        rng: &mut R,
    ) -> Result<Self, Error> {
        for (name, units) in [("inputs", inputs), ("hidden", hidden), ("outputs", outputs)] {
            if units == 0 {
                return Err(Error::Setting { name, value: 0.0, rule: "at least 1" });
            }
        }
        let shape = Shape {
            inputs,
            hidden: vec![hidden],
            outputs,
            body: true,
            linear: (0..outputs).collect(),
            activation: Activation::Isrlu,
        };
        Ok(Self { network: Network::new(shape, 1.0, 1.0, rng) })
    }

    /// Goes on from the present weights towards the least weighted mean of half the squared errors.
    ///
    /// # Errors
    /// [`Error::Length`] for rows or weights that do not fit; [`Error::NotFinite`]; [`Error::TooFew`] where no row has a weight above 0;
    /// [`Error::Setting`]; [`Error::Diverged`]. After an error the weights are as they were.
    pub fn train(
        &mut self,
        inputs: &Points,
        targets: &Points,
        weights: &[f64],
        settings: &DescentSettings,
    ) -> Result<(), Error> {
        settings.check()?;
        self.check(inputs, targets, weights)?;
        let single = |values: &Points| -> Vec<f32> {
            values.rows().flat_map(|row| row.iter().map(|v| *v as f32)).collect()
        };
        let (n, outputs) = (inputs.len(), targets.dim());
        let total: f64 = weights.iter().sum();
        let shares: Vec<f32> = weights.iter().map(|w| (w / total) as f32).collect();
        let (x, y) = (single(inputs), single(targets));
        let mut learner = Learner::<f32>::new(&self.network);
        for epoch in 0..settings.epochs {
            learner.forward(&x, n);
            learner.output_gradient.clear();
            // Outputs lie one after another, each for all rows.
            for (k, column) in learner.outputs.chunks_exact(n).enumerate() {
                let errors = column.iter().zip(y.iter().skip(k).step_by(outputs)).zip(&shares);
                learner.output_gradient.extend(errors.map(|((out, y), share)| share * (out - y)));
            }
            learner.backward(&x, n);
            learner.penalise(settings.penalty);
            let fallen = (1.0 - settings.last_rate) * epoch as f64 / settings.epochs as f64;
            learner.step(settings.learning_rate * (1.0 - fallen), 0.0);
        }
        if learner.params.iter().any(|p| !p.is_finite()) {
            return Err(Error::Diverged);
        }
        learner.write(&mut self.network);
        Ok(())
    }

    fn check(&self, inputs: &Points, targets: &Points, weights: &[f64]) -> Result<(), Error> {
        let Shape { inputs: columns, outputs, .. } = self.network.shape;
        for (what, expected, got) in [
            ("input", columns, inputs.dim()),
            ("target", outputs, targets.dim()),
            ("targets", inputs.len(), targets.len()),
            ("weights", inputs.len(), weights.len()),
        ] {
            if got != expected {
                return Err(Error::Length { what, expected, got });
            }
        }
        inputs.check_finite("inputs")?;
        targets.check_finite("targets")?;
        if let Some(row) = weights.iter().position(|w| !(*w >= 0.0 && w.is_finite())) {
            return Err(Error::NotFinite { what: "weights", row, column: 0, value: weights[row] });
        }
        if weights.iter().all(|w| *w == 0.0) {
            return Err(Error::TooFew { least: 1, got: 0 });
        }
        Ok(())
    }

    /// The outputs at an input; numbers that are missing of it count as 0, and more than there should be are left out.
    pub fn predict<'s>(&self, input: &[f64], scratch: &'s mut PredictionScratch) -> &'s [f64] {
        let PredictionScratch(scratch) = scratch;
        let columns = self.network.shape.inputs;
        if input.len() >= columns {
            self.network.forward(&input[..columns], 1, scratch);
        } else {
            let mut padded = input.to_vec();
            padded.resize(columns, 0.0);
            self.network.forward(&padded, 1, scratch);
        }
        &scratch.outputs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn law(x: &[f64]) -> [f64; 2] {
        [x[0] * x[1] + 0.5 * x[0], (1.5 * x[1]).sin()]
    }

    fn drawn(n: usize, seed: u64) -> (Points, Points) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut inputs, mut targets) = (Points::new(2), Points::new(2));
        for _ in 0..n {
            let x: Vec<f64> = (0..2).map(|_| rng.random_range(-1.0..1.0)).collect();
            inputs.push(&x).unwrap();
            targets.push(&law(&x)).unwrap();
        }
        (inputs, targets)
    }

    fn error(perceptron: &Perceptron) -> f64 {
        let (inputs, targets) = drawn(200, 9);
        let mut scratch = PredictionScratch::default();
        let squares = inputs.rows().zip(targets.rows()).map(|(x, y)| {
            let out = perceptron.predict(x, &mut scratch);
            out.iter().zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
        });
        (squares.sum::<f64>() / 400.0).sqrt()
    }

    #[test]
    fn a_smooth_law_is_learned_and_training_goes_on() {
        let (inputs, targets) = drawn(300, 1);
        let mut perceptron = Perceptron::new(2, 24, 2, &mut ChaCha8Rng::seed_from_u64(2)).unwrap();
        let weights = vec![2.0; 300];
        let settings = DescentSettings { epochs: 2000, penalty: 0.0, ..DescentSettings::default() };
        let at_first = error(&perceptron);
        perceptron.train(&inputs, &targets, &weights, &settings).unwrap();
        let once = error(&perceptron);
        perceptron.train(&inputs, &targets, &weights, &settings).unwrap();
        let twice = error(&perceptron);
        assert!(once < 0.03 && once < 0.1 * at_first && twice < once, "{at_first} {once} {twice}");
    }

    /// A row without a weight teaches nothing: what it says does not matter.
    #[test]
    fn rows_count_by_their_weights() {
        let (inputs, targets) = drawn(60, 3);
        let mut weights = vec![1.0; 60];
        weights[7] = 0.0;
        let mut wrong = Points::new(2);
        for (i, row) in targets.rows().enumerate() {
            wrong.push(&if i == 7 { [50.0, -50.0] } else { [row[0], row[1]] }).unwrap();
        }
        let trained = |targets: &Points| {
            let mut perceptron = Perceptron::new(2, 8, 2, &mut ChaCha8Rng::seed_from_u64(4)).unwrap();
            perceptron.train(&inputs, targets, &weights, &DescentSettings::default()).unwrap();
            perceptron
        };
        assert_eq!(trained(&targets), trained(&wrong));
    }

    #[test]
    fn rows_that_do_not_fit_are_refused() {
        let (inputs, targets) = drawn(20, 5);
        let mut perceptron = Perceptron::new(2, 8, 2, &mut ChaCha8Rng::seed_from_u64(6)).unwrap();
        let before = perceptron.clone();
        let settings = DescentSettings::default();
        let mut train = |inputs: &Points, weights: &[f64], settings: &DescentSettings| {
            perceptron.train(inputs, &targets, weights, settings)
        };
        assert!(matches!(train(&inputs, &[1.0; 19], &settings), Err(Error::Length { .. })));
        assert!(matches!(train(&Points::new(3), &[], &settings), Err(Error::Length { .. })));
        assert!(matches!(train(&inputs, &[0.0; 20], &settings), Err(Error::TooFew { .. })));
        assert!(matches!(train(&inputs, &[f64::NAN; 20], &settings), Err(Error::NotFinite { .. })));
        let never = DescentSettings { epochs: 0, ..settings.clone() };
        assert!(matches!(train(&inputs, &[1.0; 20], &never), Err(Error::Setting { .. })));
        assert_eq!(perceptron, before);
        assert!(matches!(
            Perceptron::new(2, 8, 0, &mut ChaCha8Rng::seed_from_u64(7)),
            Err(Error::Setting { .. })
        ));
    }
}
