//! What a density is learned from, made ready for the networks.

use crate::ensemble::split;
use crate::error::Error;
use crate::points::Points;
use crate::prior::Prior;
use crate::scaling::{InputScaling, OutputScaling};
use crate::training::Pairs;

/// Fewest simulations anything is learned from.
const LEAST: usize = 50;

/// Parameters and what was simulated with them, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulations {
    theta: Points,
    x: Points,
}

impl Simulations {
    /// Pairs a table of parameters with a table of features.
    ///
    /// # Errors
    /// [`Error::Length`] for tables of different length, [`Error::NotFinite`], [`Error::TooFew`] below 50 rows.
    pub fn new(theta: Points, x: Points) -> Result<Self, Error> {
        if theta.len() != x.len() {
            return Err(Error::Length { what: "rows of features", expected: theta.len(), got: x.len() });
        }
        theta.check_finite("parameters")?;
        x.check_finite("features")?;
        if theta.len() < LEAST {
            return Err(Error::TooFew { least: LEAST, got: theta.len() });
        }
        Ok(Self { theta, x })
    }

    /// Parameters.
    pub fn theta(&self) -> &Points {
        &self.theta
    }

    /// Features.
    pub fn x(&self) -> &Points {
        &self.x
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.theta.len()
    }

    /// Whether there are none; never, from the constructor.
    pub fn is_empty(&self) -> bool {
        self.theta.is_empty()
    }
}

/// Scaled and split.
pub(crate) struct Prepared {
    pub(crate) input: InputScaling,
    pub(crate) output: OutputScaling,
    pub(crate) x: Vec<Vec<f64>>,
    pub(crate) z: Vec<Vec<f64>>,
    train: Vec<usize>,
    held_out: Vec<usize>,
}

impl Prepared {
    pub(crate) fn new(
        prior: &Prior,
        simulations: &Simulations,
        share: f64,
        seed: u64,
    ) -> Result<Self, Error> {
        if prior.dim() != simulations.theta.dim() {
            return Err(Error::Length {
                what: "parameters",
                expected: prior.dim(),
                got: simulations.theta.dim(),
            });
        }
        let u = prior.coordinates_of(&simulations.theta)?;
        let (input, output) = (InputScaling::fit(&simulations.x), OutputScaling::fit(&u));
        let scaled = |x: &[f64]| {
            let mut out = Vec::with_capacity(x.len());
            input.apply(x, &mut out);
            out
        };
        let x = simulations.x.rows().map(scaled).collect();
        let z = u.rows().map(|u| output.apply(u)).collect();
        let (train, held_out) = split(simulations.len(), share, seed);
        Ok(Self { input, output, x, z, train, held_out })
    }

    /// The prior's bounds as the networks see them.
    pub(crate) fn bounds(&self, prior: &Prior) -> Vec<[f64; 2]> {
        let OutputScaling { centre, scale } = &self.output;
        let scaled = |(i, b): (usize, [f64; 2])| b.map(|b| (b - centre[i]) / scale[i]);
        prior.bounds().into_iter().enumerate().map(scaled).collect()
    }

    /// Inputs `x` and the first `known` targets; targets those of `targets`. For learning and held out.
    pub(crate) fn pairs(&self, known: usize, targets: std::ops::Range<usize>) -> (Pairs, Pairs) {
        let gather = |rows: &[usize]| {
            let input_dim = self.input.dim() + known;
            let mut pairs =
                Pairs { input_dim, inputs: Vec::new(), target_dim: targets.len(), targets: Vec::new() };
            for &i in rows {
                pairs.inputs.extend_from_slice(&self.x[i]);
                pairs.inputs.extend_from_slice(&self.z[i][..known]);
                pairs.targets.extend_from_slice(&self.z[i][targets.clone()]);
            }
            pairs
        };
        (gather(&self.train), gather(&self.held_out))
    }
}
