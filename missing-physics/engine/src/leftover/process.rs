//! How large and how smooth the leftover of a fit is, and what noise is beside it.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::adequacy::linearised::curves::Curves;
use crate::fit::bordered::Eliminated;
use crate::fit::columns::whitened_columns;
use crate::fit::optimum::Fit;
use crate::linalg::{SemiCholesky, determined, dot, gram, rank};
use crate::model::PredictError;
use crate::noise::rule::{NoiseRule, NoiseState};
use crate::problem::{Problem, Selection};

/// Degrees of the polynomials that a leftover may be.
const DEGREES: [usize; 4] = [2, 4, 8, 12];
/// Variances of a leftover that are tried, in units of the noise's, as powers of ten: from, step, count.
const VARIANCES: (f64, f64, usize) = (-2.0, 0.25, 41);
/// Log prior weight of a leftover that runs share against none.
const LOG_PRIOR: f64 = -2.0;

/// A smooth function of a variable that a channel misses in all runs alike.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Smooth {
    /// Number of the variable among [`Curves`].
    pub(crate) variable: usize,
    /// Degree of the polynomial.
    pub(crate) degree: usize,
    /// Prior variance of each coefficient of the normalised Legendre polynomials, in the channel's unit squared.
    pub(crate) variance: f64,
}

/// What a model leaves: a smooth part by channel, and noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Process {
    pub(crate) noise: NoiseState,
    pub(crate) smooth: Vec<Option<Smooth>>,
}

impl Process {
    /// The likeliest process for what a fit leaves, the prediction around it taken as linear.
    pub(crate) fn estimate(
        problem: &Problem<'_>,
        rule: &NoiseRule,
        selection: &Selection,
        curves: &Curves,
        fit: &Fit,
    ) -> Result<Self, PredictError> {
        let channels = problem.channels();
        let white = NoiseState { shape: vec![0; channels], sigma: vec![1.0; channels] };
        let raw: Vec<Vec<Vec<f64>>> = fit
            .nuisance
            .iter()
            .enumerate()
            .map(|(run, nuisance)| whitened_columns(problem, selection, &white, run, &fit.shared, nuisance))
            .collect::<Result<_, _>>()?;
        let mut process = Self { noise: white, smooth: vec![None; channels] };
        for channel in 0..channels {
            let best = Channel { problem, rule, selection, curves, raw: &raw, channel }.likeliest();
            process.noise.shape[channel] = best.shape;
            process.noise.sigma[channel] = best.sigma;
            process.smooth[channel] = best.smooth;
        }
        Ok(process)
    }

    /// Log prior weight of the process.
    pub(crate) fn log_prior(&self, problem: &Problem<'_>) -> f64 {
        let shapes = self.noise.shape.iter().map(|&shape| problem.family.shape(shape).log_prior());
        shapes.sum::<f64>() + LOG_PRIOR * self.smooth.iter().flatten().count() as f64
    }

    /// Columns of the smooth parts of a run, whitened like the model's, channels one after the other, and the prior variance of the
    /// coefficient of each.
    pub(crate) fn columns(
        &self,
        problem: &Problem<'_>,
        curves: &Curves,
        run: usize,
    ) -> (Vec<Vec<f64>>, Vec<f64>) {
        let rows: Vec<usize> = problem.rows[run].valid.iter().map(Vec::len).collect();
        let (mut columns, mut variances) = (Vec::new(), Vec::new());
        for (channel, smooth) in self.smooth.iter().enumerate() {
            let Some(smooth) = smooth else { continue };
            let start: usize = rows[..channel].iter().sum();
            let whitener = problem.whitener(run, channel, self.noise.shape[channel]);
            let mut parts = normalised(problem, curves, run, channel, smooth.variable, smooth.degree);
            whitener.whiten_all(&mut parts);
            for part in parts {
                let mut column = vec![0.0; rows.iter().sum()];
                for (to, from) in column[start..].iter_mut().zip(part) {
                    *to = from / self.noise.sigma[channel];
                }
                columns.push(column);
                variances.push(smooth.variance);
            }
        }
        (columns, variances)
    }
}

/// Legendre polynomials of mean square one over an even spread.
fn normalised(
    problem: &Problem<'_>,
    curves: &Curves,
    run: usize,
    channel: usize,
    variable: usize,
    degree: usize,
) -> Vec<Vec<f64>> {
    let mut columns = curves.polynomials(problem, run, channel, variable, degree);
    for (d, column) in columns.iter_mut().enumerate() {
        let norm = (2.0 * d as f64 + 1.0).sqrt();
        column.iter_mut().for_each(|v| *v *= norm);
    }
    columns
}

/// One channel of what a fit leaves.
struct Channel<'a> {
    problem: &'a Problem<'a>,
    rule: &'a NoiseRule,
    selection: &'a Selection,
    curves: &'a Curves,
    /// By run: columns of nuisance and shared parameters and the residual, channels one after the other.
    raw: &'a [Vec<Vec<f64>>],
    channel: usize,
}

/// A process of one channel, and how likely it is.
struct Judged {
    score: f64,
    shape: usize,
    sigma: f64,
    smooth: Option<Smooth>,
}

/// Normal equations of the smooth columns and of the residual that all fitted columns leave, under one shape of noise.
struct Reduced {
    normal: DMatrix<f64>,
    score: f64,
    freedom: f64,
}

impl Channel<'_> {
    /// Shape and smooth part in turn, from white noise and from the likeliest noise alone.
    fn likeliest(&self) -> Judged {
        let alone = self.best_shape(None);
        let mut best = self.best_smooth(0);
        for start in [best.smooth.clone(), None] {
            let shape = self.best_shape(start.as_ref().map(|s| (s.variable, s.degree)));
            for judged in [self.best_smooth(shape.shape), shape] {
                if judged.score > best.score {
                    best = judged;
                }
            }
        }
        if alone.score >= best.score { alone } else { best }
    }

    /// The likeliest shape of noise beside a smooth function of a variable of some degree.
    fn best_shape(&self, smooth: Option<(usize, usize)>) -> Judged {
        let wanted: Vec<(usize, usize)> = smooth.into_iter().collect();
        let of = |&shape: &usize| {
            let reduced = self.reduced(shape, &wanted);
            match smooth {
                Some((variable, degree)) => self.sized(&reduced, shape, 0, variable, degree),
                None => self.without(&reduced, shape),
            }
        };
        self.rule.allowed.iter().map(of).max_by(|a, b| a.score.total_cmp(&b.score)).unwrap_or_else(|| of(&0))
    }

    /// The likeliest smooth function, or none, beside noise of a shape.
    fn best_smooth(&self, shape: usize) -> Judged {
        let most = DEGREES[DEGREES.len() - 1];
        let variables: Vec<(usize, usize)> =
            self.curves.of(self.channel).into_iter().map(|v| (v, most)).collect();
        let reduced = self.reduced(shape, &variables);
        let mut best = self.without(&reduced, shape);
        for (k, &(variable, _)) in variables.iter().enumerate() {
            for degree in DEGREES {
                let judged = self.sized(&reduced, shape, k * (most + 1), variable, degree);
                if judged.score > best.score {
                    best = judged;
                }
            }
        }
        best
    }

    fn without(&self, reduced: &Reduced, shape: usize) -> Judged {
        let last = reduced.normal.nrows() - 1;
        let (score, sigma) = self.level(reduced, reduced.normal[(last, last)], 0.0);
        Judged { score, shape, sigma, smooth: None }
    }

    /// Log likelihood, noise's sigma and the smooth part's variance, of the polynomials that begin at column `first`.
    fn sized(&self, reduced: &Reduced, shape: usize, first: usize, variable: usize, degree: usize) -> Judged {
        let (n, last) = (degree + 1, reduced.normal.nrows() - 1);
        let eigen = SymmetricEigen::new(reduced.normal.view((first, first), (n, n)).into_owned());
        let along = eigen.eigenvectors.transpose() * reduced.normal.view((first, last), (n, 1));
        let (from, step, count) = VARIANCES;
        let mut best = self.without(reduced, shape);
        for k in 0..count {
            let variance = 10f64.powf(from + step * k as f64);
            let (mut left, mut log_determinant) = (reduced.normal[(last, last)], 0.0);
            for (value, q) in eigen.eigenvalues.iter().zip(along.iter()) {
                let value = value.max(0.0);
                left -= q * q * variance / (1.0 + variance * value);
                log_determinant += (1.0 + variance * value).ln();
            }
            let (score, sigma) = self.level(reduced, left.max(0.0), log_determinant);
            let score = score + LOG_PRIOR;
            if score > best.score {
                let smooth = Some(Smooth { variable, degree, variance: variance * sigma * sigma });
                best = Judged { score, shape, sigma, smooth };
            }
        }
        best
    }

    fn level(&self, reduced: &Reduced, squares: f64, log_determinant: f64) -> (f64, f64) {
        let freedom = reduced.freedom;
        let sigma = (squares / freedom).sqrt().max(self.rule.floor[self.channel]);
        let fit = freedom * sigma.ln() + 0.5 * squares / (sigma * sigma) + 0.5 * log_determinant;
        (reduced.score - fit, sigma)
    }

    /// The fitted parameters eliminated under a shape of noise.
    fn reduced(&self, shape: usize, smooth: &[(usize, usize)]) -> Reduced {
        let Self { problem, channel, .. } = *self;
        let (n_nuisance, n_shared) = (self.selection.nuisance.len(), self.selection.shared.len());
        let n_smooth: usize = smooth.iter().map(|(_, degree)| degree + 1).sum();
        let width = n_shared + n_smooth + 1;
        let mut normal = DMatrix::zeros(width, width);
        let mut squares = vec![0.0; n_shared];
        let (mut log_determinant, mut used, mut rows) = (0.0, 0, 0);
        for (run, columns) in self.raw.iter().enumerate() {
            let counts: Vec<usize> = problem.rows[run].valid.iter().map(Vec::len).collect();
            let start: usize = counts[..channel].iter().sum();
            let part = start..start + counts[channel];
            let here: Vec<f64> =
                columns[..n_nuisance].iter().map(|c| dot(&c[part.clone()], &c[part.clone()])).collect();
            let whole: Vec<f64> = columns[..n_nuisance].iter().map(|c| dot(c, c)).collect();
            let mine = determined(&here, &whole);
            let whitener = problem.whitener(run, channel, shape);
            let fitted = mine.iter().copied().chain(n_nuisance..n_nuisance + n_shared);
            let mut all: Vec<Vec<f64>> = fitted.map(|k| columns[k][part.clone()].to_vec()).collect();
            for &(variable, degree) in smooth {
                all.extend(normalised(problem, self.curves, run, channel, variable, degree));
            }
            all.extend(columns.last().map(|residual| residual[part.clone()].to_vec()));
            whitener.whiten_all(&mut all);
            let of_run = gram(&all);
            let n = mine.len();
            let block = of_run.view((0, 0), (n, n)).into_owned();
            let beside = (n..n + width).map(|j| (0..n).map(|i| of_run[(j, i)]).collect());
            let eliminated = Eliminated::new(block, rank::CHANNEL, beside);
            for i in 0..width {
                for j in 0..=i {
                    let value = of_run[(n + i, n + j)] - dot(&eliminated.borders[i], &eliminated.borders[j]);
                    normal[(i, j)] += value;
                    if i != j {
                        normal[(j, i)] += value;
                    }
                }
            }
            squares.iter_mut().enumerate().for_each(|(i, s)| *s += of_run[(n + i, n + i)]);
            log_determinant += whitener.log_determinant + eliminated.log_determinant();
            used += eliminated.rank();
            rows += part.len();
        }
        let factor = SemiCholesky::against(normal.view((0, 0), (n_shared, n_shared)).into_owned(), &squares);
        let borders: Vec<Vec<f64>> = (n_shared..width)
            .map(|j| {
                let mut column: Vec<f64> = (0..n_shared).map(|i| normal[(j, i)]).collect();
                factor.forward(&mut column);
                column
            })
            .collect();
        let left = DMatrix::from_fn(width - n_shared, width - n_shared, |i, j| {
            normal[(n_shared + i, n_shared + j)] - dot(&borders[i], &borders[j])
        });
        Reduced {
            normal: left,
            score: self.problem.family.shape(shape).log_prior() - 0.5 * log_determinant,
            freedom: (rows as f64 - used as f64 - factor.rank() as f64).max(1.0),
        }
    }
}
