//! How much of a Gaussian lies in a box, and draws from what does.
//!
//! One dimension is exact; two by quadrature to about 1e-12; more by separation of variables (Genz 1992,
//! doi:10.1080/10618600.1992.10477010): three by Gauss and Legendre's rule where that has converged, else, and more than three, on a
//! shifted lattice (Genz and Bretz 2009), with a stated error.

use nalgebra::DMatrix;
use rand::{Rng, RngExt};

use crate::component::Component;
use crate::normal::{cdf, mass, pdf, richtmyer, truncated_quantile};

/// A probability, and how far it may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxMass {
    /// The probability, 0 to 1.
    pub value: f64,
    /// Three standard errors of the lattice rule, or a bound where the rule is not one of chance.
    pub error: f64,
}

/// Relative error at which an integral is taken to have converged.
pub(crate) const CLOSE: f64 = 1e-4;

/// A Gaussian in a box, its variables ordered so that the tightest comes first.
#[derive(Debug, Clone)]
pub(crate) struct Boxed {
    /// Dimensions with a bound, tightest first.
    order: Vec<usize>,
    /// Lower triangular root of their covariance.
    root: DMatrix<f64>,
    /// The variables' bounds, from the mean.
    bounds: Vec<[f64; 2]>,
    /// Share of each dimension alone that is outside, added up.
    tails: f64,
    /// Share of the dimension of which least is inside.
    most: f64,
}

impl Boxed {
    pub(crate) fn new(component: &Component, bounds: &[[f64; 2]]) -> Self {
        let covariance = component.covariance();
        let away = |i: usize| bounds[i].map(|b| b - component.mean[i]);
        let alone = |i: usize| {
            let sd = covariance[(i, i)].sqrt();
            let [low, high] = away(i).map(|b| b / sd);
            (mass(low, high), cdf(low) + cdf(-high))
        };
        let mut order: Vec<usize> =
            (0..component.dim()).filter(|&i| bounds[i].iter().any(|b| b.is_finite())).collect();
        order.sort_by(|&i, &j| alone(i).0.total_cmp(&alone(j).0));
        let tails = order.iter().map(|&i| alone(i).1).sum();
        let most = order.first().map_or(1.0, |&i| alone(i).0);
        let part = covariance.select_rows(&order).select_columns(&order);
        let n = order.len();
        let root = part.cholesky().map_or_else(|| DMatrix::zeros(n, n), |c| c.unpack());
        let bounds = order.iter().map(|&i| away(i)).collect();
        Self { order, root, bounds, tails, most }
    }

    /// No more than this lies within the box: the least mass that one dimension alone has there.
    pub(crate) fn most(&self) -> f64 {
        self.most
    }

    /// Mass within the box, to [`CLOSE`] of it or to an absolute error, whichever is larger.
    pub(crate) fn mass(&self, absolute: f64) -> BoxMass {
        if self.most < absolute {
            return BoxMass { value: 0.5 * self.most, error: 0.5 * self.most };
        }
        if self.tails < 1e-12 {
            return BoxMass { value: 1.0 - 0.5 * self.tails, error: 0.5 * self.tails };
        }
        match self.order.len() {
            0 => BoxMass { value: 1.0, error: 0.0 },
            1 => {
                let [low, high] = self.bounds[0].map(|b| b / self.root[(0, 0)]);
                BoxMass { value: mass(low, high), error: 1e-15 }
            }
            2 => BoxMass { value: self.two(), error: 1e-12 },
            3 => self.three(absolute).unwrap_or_else(|| self.lattice(3, absolute)),
            n => self.lattice(n, absolute),
        }
    }

    /// The first variable integrated by Gauss and Legendre's rule on pieces that end where the second's mass bends.
    fn two(&self) -> f64 {
        let [low, high] = self.bounds[0].map(|b| b / self.root[(0, 0)]);
        let (slope, sd) = (self.root[(1, 0)], self.root[(1, 1)]);
        let (low, high) = (low.max(-38.0), high.min(38.0));
        let mut cuts: Vec<f64> = (-38..=38).map(f64::from).chain([low, high]).collect();
        if slope != 0.0 {
            for bend in self.bounds[1].map(|b| b / slope) {
                let width = sd / slope.abs();
                cuts.extend((-8..=8).map(|k| bend + f64::from(k) * width));
            }
        }
        cuts.retain(|c| *c >= low && *c <= high);
        cuts.sort_by(f64::total_cmp);
        cuts.windows(2)
            .map(|w| {
                let (middle, half) = (0.5 * (w[0] + w[1]), 0.5 * (w[1] - w[0]));
                let value = |y: f64| {
                    let [a, b] = self.bounds[1].map(|b| (b - slope * y) / sd);
                    pdf(y) * mass(a, b)
                };
                let sum: f64 = GAUSS
                    .iter()
                    .map(|(x, g)| g * (value(middle - half * x) + value(middle + half * x)))
                    .sum();
                half * sum
            })
            .sum::<f64>()
            .clamp(0.0, 1.0)
    }

    /// The two variables that are left after the separation, integrated by Gauss and Legendre's rule on more and more pieces; none where it does
    /// not converge.
    fn three(&self, absolute: f64) -> Option<BoxMass> {
        let mut coarse = self.by_pieces(1);
        for pieces in [2, 4, 8] {
            let value = self.by_pieces(pieces);
            let error = (value - coarse).abs();
            if error < (CLOSE * value).max(absolute) {
                return Some(BoxMass { value, error });
            }
            coarse = value;
        }
        None
    }

    /// The mass of three variables, with the unit interval of each uniform number cut into so many pieces.
    fn by_pieces(&self, pieces: usize) -> f64 {
        let width = 1.0 / pieces as f64;
        let nodes: Vec<(f64, f64)> = (0..pieces)
            .flat_map(|piece| {
                let middle = (piece as f64 + 0.5) * width;
                GAUSS.iter().flat_map(move |(x, weight)| {
                    [-x, *x].map(|x| (middle + 0.5 * width * x, 0.5 * width * weight))
                })
            })
            .collect();
        let mut y = [0.0; 3];
        let mut sum = 0.0;
        for (first, outer) in &nodes {
            for (second, inner) in &nodes {
                sum += outer * inner * self.separate(&mut y, |j| if j == 0 { *first } else { *second });
            }
        }
        sum
    }

    fn lattice(&self, n: usize, absolute: f64) -> BoxMass {
        const SHIFTS: usize = 12;
        const MOST: usize = 1 << 13;
        let generators = richtmyer(n + 1);
        let mut y = vec![0.0; n];
        let mut points = 64;
        loop {
            let mut sums = [0.0; SHIFTS];
            for (s, sum) in sums.iter_mut().enumerate() {
                for i in 0..points {
                    // The shift moves along the last generator; folding makes the integrand periodic.
                    let u = |j: usize| {
                        let shift = ((s + 1) as f64 * generators[n] * (j + 1) as f64).fract();
                        let v = ((i + 1) as f64 * generators[j] + shift).fract();
                        (2.0 * v - 1.0).abs()
                    };
                    *sum += self.separate(&mut y, u);
                }
                *sum /= points as f64;
            }
            let value = sums.iter().sum::<f64>() / SHIFTS as f64;
            let variance = sums.iter().map(|s| (s - value).powi(2)).sum::<f64>() / (SHIFTS - 1) as f64;
            let error = 3.0 * (variance / SHIFTS as f64).sqrt();
            if error < (CLOSE * value).max(absolute) || points >= MOST {
                return BoxMass { value, error };
            }
            points *= 4;
        }
    }

    /// Bounds of a standard normal, given those before it.
    fn interval(&self, i: usize, y: &[f64]) -> [f64; 2] {
        let mean: f64 = (0..i).map(|j| self.root[(i, j)] * y[j]).sum();
        self.bounds[i].map(|b| (b - mean) / self.root[(i, i)])
    }

    /// One path through the conditional intervals: writes all standard normals but the last, returns the product of the intervals' masses.
    fn separate(&self, y: &mut [f64], mut uniform: impl FnMut(usize) -> f64) -> f64 {
        let mut weight = 1.0;
        for i in 0..y.len() {
            let [a, b] = self.interval(i, y);
            weight *= mass(a, b);
            if i + 1 < y.len() {
                y[i] = truncated_quantile(a, b, uniform(i));
            }
        }
        weight
    }

    /// A draw within the box by the same path; `exp` of the returned number is its importance weight.
    pub(crate) fn propose<R: Rng + ?Sized>(
        &self,
        component: &Component,
        rng: &mut R,
        out: &mut [f64],
    ) -> f64 {
        let n = self.order.len();
        let mut y = vec![0.0; n];
        let weight = self.separate(&mut y, |_| rng.random::<f64>());
        if let Some(last) = n.checked_sub(1) {
            let [a, b] = self.interval(last, &y);
            y[last] = truncated_quantile(a, b, rng.random());
        }
        let known: Vec<f64> = (0..n).map(|i| (0..=i).map(|j| self.root[(i, j)] * y[j]).sum()).collect();
        let mut free = vec![0.0; component.dim()];
        for (&i, k) in self.order.iter().zip(&known) {
            free[i] = component.mean[i] + k;
        }
        self.fill_unbounded(component, &mut free, rng);
        out.copy_from_slice(&free);
        weight.ln()
    }

    /// Dimensions without bounds, given the others.
    fn fill_unbounded<R: Rng + ?Sized>(&self, component: &Component, x: &mut [f64], rng: &mut R) {
        if self.order.len() == x.len() {
            return;
        }
        let rest: Vec<usize> = (0..x.len()).filter(|i| !self.order.contains(i)).collect();
        let whole = crate::mixture::Mixture { components: vec![component.clone()] };
        let known: Vec<f64> = self.order.iter().map(|&i| x[i]).collect();
        let given = if known.is_empty() { Ok(whole) } else { whole.conditional(&self.order, &known) };
        if let Ok(given) = given {
            let drawn = given.sample(1, rng);
            rest.iter().zip(drawn.row(0)).for_each(|(&i, v)| x[i] = *v);
        }
    }
}

/// Positive nodes and weights of Gauss and Legendre's rule of 16 points (Abramowitz and Stegun, table 25.4).
const GAUSS: [(f64, f64); 8] = [
    (0.095_012_509_837_637_44, 0.189_450_610_455_068_5),
    (0.281_603_550_779_258_9, 0.182_603_415_044_923_6),
    (0.458_016_777_657_227_4, 0.169_156_519_395_002_5),
    (0.617_876_244_402_643_7, 0.149_595_988_816_576_7),
    (0.755_404_408_355_003, 0.124_628_971_255_533_9),
    (0.865_631_202_387_831_7, 0.095_158_511_682_492_78),
    (0.944_575_023_073_232_6, 0.062_253_523_938_647_9),
    (0.989_400_934_991_649_9, 0.027_152_459_411_754_1),
];
