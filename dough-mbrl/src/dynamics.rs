//! Dynamics of a dough, learned from rolls, with the uncertainty of what was learned.
//!
//! Least squares on the terms of degree 2 and less; ridge regression on those of degrees 3 and 4, its prior's size found by
//! the marginal likelihood (MacKay 1992, doi:10.1162/neco.1992.4.3.415).

use argmin::core::{CostFunction, Error, Executor, State as _};
use argmin::solver::brent::BrentOpt;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen, Vector3};

use crate::features::Polynomial;
use crate::filter::{Fresh, Noise, Step, follow};

/// Length, width and height of a dough, m.
pub type State = [f64; 3];
/// Throw and depth of the band, m.
pub type Action = [f64; 2];

/// Degree of the polynomial, and of its remainder.
const DEGREE: u8 = 2;
const REMAINDER: u8 = 4;

/// One roll as it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roll {
    /// Before it.
    pub state: State,
    /// What was done.
    pub action: Action,
    /// After it.
    pub next: State,
}

/// Why nothing could be learned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LearnError {
    /// There are too few rolls for the coefficients.
    #[error("{rolls} rolls are too few for {coefficients} coefficients: at least {least} are needed")]
    TooFew {
        /// Rolls there are.
        rolls: usize,
        /// Coefficients of the polynomial.
        coefficients: usize,
        /// Rolls needed.
        least: usize,
    },
    /// A value is not finite, or all rolls are too much alike for their polynomial.
    #[error("the rolls do not determine a polynomial of degree {degree} of state and action")]
    Undetermined {
        /// The degree.
        degree: u8,
    },
}

/// A prediction of one output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// The mean.
    pub mean: f64,
    /// One sigma of what will be measured: noise and all that was not learned.
    pub sigma: f64,
}

/// One output's coefficients.
#[derive(Debug, Clone)]
struct Output {
    coefficients: DVector<f64>,
    sigma: f64,
    /// Factor of the precision of the coefficients, in units of the noise.
    precision: Cholesky<f64, Dyn>,
    /// Variance of what each dough does for itself, beyond the dynamics that all share.
    own: f64,
}

/// Three outputs of some inputs, learned.
#[derive(Debug, Clone)]
struct Surface {
    features: Polynomial,
    /// Scale of each term of the remainder.
    weights: DVector<f64>,
    outputs: [Output; 3],
}

impl Surface {
    /// Learns the changes of the rows of inputs: a polynomial of one degree, and a remainder up to another. Rows come in groups
    /// of the given lengths.
    fn learn(
        rows: &[Vec<f64>],
        changes: &[State],
        groups: &[usize],
        [degree, remainder]: [u8; 2],
    ) -> Result<Self, LearnError> {
        let features = Polynomial::standardised(rows, remainder);
        let free = features.up_to(degree);
        let least = 2 * free;
        if rows.len() < least {
            return Err(LearnError::TooFew { rolls: rows.len(), coefficients: free, least });
        }
        let undetermined = LearnError::Undetermined { degree };
        let mut design = DMatrix::from_row_iterator(
            rows.len(),
            features.len(),
            rows.iter().flat_map(|r| features.terms(r)),
        );
        let n = rows.len() as f64;
        let weights = DVector::from_fn(features.len(), |k, _| {
            let rms = (design.column(k).norm_squared() / n).sqrt();
            if k < free || rms <= 0.0 { 1.0 } else { 1.0 / rms }
        });
        design.column_iter_mut().zip(weights.iter()).for_each(|(mut c, w)| c *= *w);
        if design.iter().any(|v| !v.is_finite()) {
            return Err(undetermined);
        }
        let output = |k: usize| {
            let change = DVector::from_iterator(rows.len(), changes.iter().map(|c| c[k]));
            learn_output(&design, free, &change, groups)
        };
        let [Some(length), Some(width), Some(height)] = [output(0), output(1), output(2)] else {
            return Err(undetermined);
        };
        Ok(Self { features, weights, outputs: [length, width, height] })
    }

    fn change(&self, state: &Vector3<f64>, action: &Action) -> Vector3<f64> {
        let terms = self.terms(&inputs(state, action));
        Vector3::from_fn(|k, _| terms.dot(&self.outputs[k].coefficients))
    }

    fn terms(&self, inputs: &[f64]) -> DVector<f64> {
        DVector::from_vec(self.features.terms(inputs)).component_mul(&self.weights)
    }
}

/// Learned dynamics.
#[derive(Debug, Clone)]
pub struct Dynamics {
    surface: Surface,
    noise: Noise,
}

/// Rounds of following the doughs with the dynamics, and learning these again from where the doughs then were.
const ROUNDS: usize = 4;
/// Smallest variance of what a roll does beyond its dynamics, by that of the measurements: what a polynomial cannot follow comes
/// again roll by roll, and a filter that trusted it would add it up.
const LEAST_PROCESS: f64 = 0.5;

impl Dynamics {
    /// Learns from the rolls of several doughs, each in its order.
    ///
    /// Measured states are noisy, and a regression on noisy states learns something else than the dynamics (Fuller 1987,
    /// doi:10.1002/9780470316665). Each dough is therefore followed through its rolls, and what a roll changed is learned from
    /// where the dough most likely was.
    ///
    /// # Errors
    /// [`LearnError`].
    pub fn learn(doughs: &[Vec<Roll>]) -> Result<Self, LearnError> {
        let rolls: Vec<&Roll> = doughs.iter().flatten().collect();
        let measured: Vec<Vector3<f64>> = rolls.iter().map(|r| Vector3::from(r.state)).collect();
        let mut surface = changes(doughs, &measured)?;
        let mut noise = Noise { measured: twice_measured(doughs, &surface), process: Vector3::zeros() };
        for _ in 0..ROUNDS {
            let first: Vec<State> = doughs.iter().filter_map(|d| Some(d.first()?.state)).collect();
            let fresh = Fresh::of(&first, &noise);
            let steps: Vec<Step> = doughs
                .iter()
                .flat_map(|dough| {
                    follow(dough, &fresh, &noise, 0.0, |i, x| x + surface.change(x, &dough[i].action))
                })
                .collect();
            let states: Vec<Vector3<f64>> = steps.iter().map(|s| s.state).collect();
            surface = changes(doughs, &states)?;
            // What a roll does beyond the dynamics: what its measurement scatters beyond noise and estimate.
            let mut beyond = Vector3::zeros();
            for (roll, step) in rolls.iter().zip(&steps) {
                let expected = step.state + surface.change(&step.state, &roll.action);
                let off = Vector3::from(roll.next) - expected;
                let told = (step.gradient * step.covariance * step.gradient.transpose()).diagonal();
                beyond += off.component_mul(&off) - told - noise.measured[1];
            }
            noise.process =
                (beyond / rolls.len() as f64).zip_map(&noise.measured[1], |v, m| v.max(LEAST_PROCESS * m));
        }
        Ok(Self { surface, noise })
    }

    /// The change of a state by a roll.
    pub fn change(&self, state: &Vector3<f64>, action: &Action) -> Vector3<f64> {
        self.surface.change(state, action)
    }

    /// What scatters the measured states.
    pub fn noise(&self) -> &Noise {
        &self.noise
    }

    /// Sigma of what each dough does for itself, an output each: a level and a slope ([`courses`]) along its rolls, m a roll.
    pub fn own(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.surface.outputs[k].own.sqrt())
    }

    /// Number of coefficients of an output.
    pub fn coefficients(&self) -> usize {
        self.surface.weights.len()
    }

    /// By how much each output's change answers its coefficients, these in directions that are independent and of variance one.
    ///
    /// One vector an output, each of [`Self::coefficients`] entries.
    pub fn told(&self, state: &Vector3<f64>, action: &Action) -> [DVector<f64>; 3] {
        let terms = self.surface.terms(&inputs(state, action));
        std::array::from_fn(|k| {
            let output = &self.surface.outputs[k];
            let mut told = terms.clone();
            output.precision.l_dirty().solve_lower_triangular_mut(&mut told);
            told * output.sigma
        })
    }

    /// The next state, from a state that is known.
    pub fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        let state = Vector3::from(*state);
        let (change, told) = (self.change(&state, action), self.told(&state, action));
        std::array::from_fn(|k| {
            let variance = told[k].norm_squared() + self.noise.process[k] + self.noise.measured[1][k];
            Prediction { mean: state[k] + change[k], sigma: variance.sqrt() }
        })
    }
}

fn inputs(state: &Vector3<f64>, action: &Action) -> Vec<f64> {
    state.iter().chain(action).copied().collect()
}

/// What rolls change, learned from where the doughs were before them; two measurements of the same state count as their mean.
fn changes(doughs: &[Vec<Roll>], states: &[Vector3<f64>]) -> Result<Surface, LearnError> {
    let mut states = states.iter();
    let (mut rows, mut all) = (Vec::new(), Vec::new());
    for dough in doughs {
        for (i, (roll, state)) in dough.iter().zip(states.by_ref()).enumerate() {
            let again = dough.get(i + 1).map_or(roll.next, |next| next.state);
            rows.push(inputs(state, &roll.action));
            all.push(std::array::from_fn(|k| 0.5 * (roll.next[k] + again[k]) - state[k]));
        }
    }
    let groups: Vec<usize> = doughs.iter().map(Vec::len).collect();
    Surface::learn(&rows, &all, &groups, [DEGREE, REMAINDER])
}

/// Variances of measurements, from states that were measured twice; from what the dynamics leave where none was.
fn twice_measured(doughs: &[Vec<Roll>], surface: &Surface) -> [Vector3<f64>; 2] {
    let pairs: Vec<Vector3<f64>> = doughs
        .iter()
        .flat_map(|d| d.windows(2))
        .map(|w| Vector3::from(w[1].state) - Vector3::from(w[0].next))
        .collect();
    let variance = if pairs.len() < 8 {
        Vector3::from_fn(|k, _| surface.outputs[k].sigma.powi(2))
    } else {
        pairs.iter().map(|d| d.component_mul(d)).sum::<Vector3<f64>>() / pairs.len() as f64
    };
    // Half each; never nothing, lest a filter believe a number to its last digit.
    [variance.map(|v| (0.5 * v).max(1e-14)); 2]
}

/// The coefficients of one output; the first `free` columns have no prior.
fn learn_output(
    design: &DMatrix<f64>,
    free: usize,
    change: &DVector<f64>,
    groups: &[usize],
) -> Option<Output> {
    let rows = design.nrows();
    let polynomial = design.columns(0, free).into_owned();
    let qr = polynomial.qr();
    let basis = qr.q();
    let r = qr.r();
    let largest = r.diagonal().amax();
    if r.diagonal().iter().any(|d| d.abs() < 1e-10 * largest) {
        return None;
    }
    // What the polynomial leaves of the change and of the remainder's terms.
    let rest = design.columns(free, design.ncols() - free).into_owned();
    let rest = &rest - &basis * basis.tr_mul(&rest);
    let left = change - &basis * basis.tr_mul(change);
    let eigen = SymmetricEigen::new(rest.tr_mul(&rest));
    let pulled = eigen.eigenvectors.tr_mul(&rest.tr_mul(&left));
    let floor = 1e-10 * eigen.eigenvalues.amax();
    let parts: Vec<(f64, f64)> = eigen
        .eigenvalues
        .iter()
        .zip(pulled.iter())
        .filter(|(value, _)| **value > floor)
        .map(|(&value, pull)| (value, pull * pull / value))
        .collect();
    let evidence = Evidence { parts, total: left.norm_squared(), freedom: (rows - free) as f64 };
    let log_ratio = evidence.best();
    let sigma = evidence.variance(log_ratio).sqrt();
    let mut precision = design.tr_mul(design);
    // Terms that rounding makes alike are told apart by nothing; a prior far below every other does no harm.
    let least = 1e-11 * precision.diagonal().amax();
    for k in 0..design.ncols() {
        precision[(k, k)] += if k < free { least } else { least + (-log_ratio).exp() };
    }
    let precision = precision.cholesky()?;
    let coefficients = precision.solve(&design.tr_mul(change));
    (sigma.is_finite() && coefficients.iter().all(|c| c.is_finite())).then(|| Output {
        own: own_variance(design, &coefficients, &precision, sigma * sigma, change, groups),
        sigma: sigma.max(f64::MIN_POSITIVE),
        coefficients,
        precision,
    })
}

/// How each group's course differs from what the others teach of it, a level and a slope along it: the variance of these
/// beyond what noise and coefficients make of them.
fn own_variance(
    design: &DMatrix<f64>,
    coefficients: &DVector<f64>,
    precision: &Cholesky<f64, Dyn>,
    noise: f64,
    change: &DVector<f64>,
    groups: &[usize],
) -> f64 {
    let left = change - design * coefficients;
    let (mut first, mut sum, mut count) = (0, 0.0, 0.0);
    for &n in groups {
        let rows = design.rows(first, n).into_owned();
        let mut told = rows.transpose();
        precision.l_dirty().solve_lower_triangular_mut(&mut told);
        // What the group's own rows contribute to its fit; without them it would be off by this much more.
        let apart = DMatrix::identity(n, n) - told.tr_mul(&told);
        if let Some(apart) = apart.cholesky() {
            let off = apart.solve(&left.rows(first, n).into_owned());
            for course in courses(n) {
                let size = n as f64;
                sum += (course.dot(&off) / size).powi(2)
                    - noise * course.dot(&apart.solve(&course)) / (size * size);
                count += 1.0;
            }
        }
        first += n;
    }
    if groups.len() > 2 && count > 0.0 { f64::max(sum / count, 0.0) } else { 0.0 }
}

/// A level and a slope over the rolls of a dough, each of unit mean square.
pub fn courses(rolls: usize) -> Vec<DVector<f64>> {
    let level = DVector::repeat(rolls, 1.0);
    if rolls < 3 {
        return vec![level];
    }
    let middle = 0.5 * (rolls as f64 - 1.0);
    let slope = DVector::from_fn(rolls, |i, _| i as f64 - middle);
    let size = (slope.norm_squared() / rolls as f64).sqrt();
    vec![level, slope / size]
}

/// Marginal likelihood of what the polynomial leaves.
#[derive(Clone)]
struct Evidence {
    /// Eigenvalue of the remainder's terms, and the square that lies along its direction.
    parts: Vec<(f64, f64)>,
    total: f64,
    freedom: f64,
}

/// Logarithm of the variance of a coefficient of the remainder over that of the noise.
const LOG_RATIO: [f64; 2] = [-25.0, 5.0];

impl Evidence {
    /// The noise's variance at a ratio, profiled.
    fn variance(&self, log_ratio: f64) -> f64 {
        let ratio = log_ratio.exp();
        let along: f64 = self.parts.iter().map(|(value, square)| square / (1.0 + ratio * value)).sum();
        let beside = self.total - self.parts.iter().map(|(_, square)| square).sum::<f64>();
        (along + beside.max(0.0)) / self.freedom
    }

    fn best(&self) -> f64 {
        let [low, high] = LOG_RATIO;
        let found =
            Executor::new(self.clone(), BrentOpt::new(low, high)).configure(|s| s.max_iters(200)).run();
        found.ok().and_then(|r| r.state().get_best_param().copied()).unwrap_or(low)
    }
}

impl CostFunction for Evidence {
    type Param = f64;
    type Output = f64;

    /// Minus twice the logarithm, up to a constant.
    fn cost(&self, log_ratio: &f64) -> Result<f64, Error> {
        let ratio = log_ratio.exp();
        let spread: f64 = self.parts.iter().map(|(value, _)| (ratio * value).ln_1p()).sum();
        Ok(self.freedom * self.variance(*log_ratio).max(f64::MIN_POSITIVE).ln() + spread)
    }
}
