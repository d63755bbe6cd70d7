//! Tails of null distributions.

use super::omnibus::Law;
use statrs::distribution::{ContinuousCDF, Gamma, Gumbel, Normal};

/// A statistic's null distribution: what it is in worlds in which the model is right, and the law of its upper tail.
pub(crate) struct Null {
    law: Law,
    draws: Vec<f64>,
    moments: Option<Moments>,
    tail: Tail,
}

impl Null {
    pub(crate) fn new(law: Law, draws: Vec<f64>) -> Self {
        let moments = Moments::of(draws.iter().copied());
        let tail = match law {
            Law::Sum if sees_nothing(&draws) => Tail::Constant,
            Law::Sum => Tail::sum(moments),
            Law::Largest => Tail::largest(moments),
            Law::Rare => Tail::counted(draws.iter().copied()),
        };
        Self { law, draws, moments, tail }
    }

    /// Share of the null distribution at or above a value.
    pub(crate) fn p(&self, value: f64) -> f64 {
        self.tail.p(value)
    }

    /// The same of a draw among the others, as the data are one among the draws: a draw that stands out would hide in a tail that it makes
    /// wide itself, which data do not.
    pub(crate) fn p_of_draw(&self, draw: usize) -> f64 {
        let value = self.draws[draw];
        if matches!(self.tail, Tail::Constant) {
            return 1.0;
        }
        let others = || {
            let others = self.moments?.without(value);
            others.or_else(|| {
                let others = self.draws.iter().enumerate().filter(|(k, _)| *k != draw);
                Moments::of(others.map(|(_, v)| *v))
            })
        };
        match (self.law, &self.tail) {
            (Law::Sum, _) => Tail::sum(others()).p(value),
            (Law::Largest, _) => Tail::largest(others()).p(value),
            // It is one of those at or above it itself.
            (Law::Rare, Tail::Counted(draws)) if value > 0.0 && value.is_finite() => {
                at_or_above(draws, value) / draws.len() as f64
            }
            (Law::Rare, _) => 1.0,
        }
    }
}

/// Whether a sum of squares, in units of the noise, is less than one in nearly all worlds: what it looks for has been fitted, as the mean of a run
/// whose zero is free, and what is left of it is how fits end.
fn sees_nothing(draws: &[f64]) -> bool {
    /// Of the worlds.
    const NEARLY_ALL: f64 = 0.99;
    let small = draws.iter().filter(|draw| **draw < 1.0).count();
    !draws.is_empty() && small as f64 >= NEARLY_ALL * draws.len() as f64
}

/// The upper tail of a statistic's null distribution: a gamma law with its mean and variance, or the normal law that it becomes; of the
/// largest of many squares, whose tail is an exponential one, Gumbel's law.
///
/// The law only puts the tests on one scale; the p-value of all tests together is counted, not read from it.
enum Tail {
    /// The statistic does not vary.
    Constant,
    Gamma(Gamma),
    Normal(Normal),
    Gumbel(Gumbel),
    /// Counted, of a statistic that is the same in most draws: the draws, rising.
    Counted(Vec<f64>),
}

/// How many of the rising draws are at or above a value.
fn at_or_above(draws: &[f64], value: f64) -> f64 {
    (draws.len() - draws.partition_point(|draw| *draw < value)) as f64
}

/// From this shape on a gamma law is a normal one: its skewness is 0.02, and its tail, a series, takes time with the root of the shape.
/// Rounding alone varies by so little that the series would not end.
const NORMAL_SHAPE: f64 = 1e4;

impl Tail {
    /// Of a statistic with these moments.
    fn sum(moments: Option<Moments>) -> Self {
        let Some((mean, variance)) = moments.and_then(|m| m.vary()) else { return Self::Constant };
        let shape = mean * mean / variance;
        if shape < NORMAL_SHAPE {
            Gamma::new(shape, mean / variance).map_or(Self::Constant, Self::Gamma)
        } else {
            Normal::new(mean, variance.sqrt()).map_or(Self::Constant, Self::Normal)
        }
    }

    /// Of the largest of many numbers that each fall off exponentially, with these moments (Gumbel 1958, Statistics of Extremes, ch. 5): its mean
    /// is Euler's constant times its scale above its mode.
    fn largest(moments: Option<Moments>) -> Self {
        const EULER: f64 = 0.577_215_664_901_532_9;
        let Some((mean, variance)) = moments.and_then(|m| m.vary()) else { return Self::Constant };
        let scale = variance.sqrt() * 6f64.sqrt() / std::f64::consts::PI;
        Gumbel::new(mean - EULER * scale, scale).map_or(Self::Constant, Self::Gumbel)
    }

    /// From draws of a statistic that is the same in most of them.
    fn counted(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        values.sort_by(f64::total_cmp);
        Self::Counted(values)
    }

    /// Share of the null distribution at or above a value.
    fn p(&self, value: f64) -> f64 {
        if !(value > 0.0 && value.is_finite()) {
            return 1.0;
        }
        match self {
            Self::Constant => 1.0,
            Self::Gamma(law) => law.sf(value).clamp(1e-300, 1.0),
            Self::Normal(law) => law.sf(value).clamp(1e-300, 1.0),
            // `1 - exp(-exp(-z))`, which the law's own survival function rounds to nothing.
            Self::Gumbel(law) => {
                let above = (-(value - law.location()) / law.scale()).exp();
                (-(-above).exp_m1()).clamp(1e-300, 1.0)
            }
            Self::Counted(draws) => ((at_or_above(draws, value) + 1.0) / (draws.len() as f64 + 1.0)).min(1.0),
        }
    }
}

/// How many draws are finite, their mean, and the sum of their squared deviations from it.
#[derive(Debug, Clone, Copy)]
struct Moments {
    count: f64,
    mean: f64,
    squares: f64,
}

impl Moments {
    /// None of no draws.
    fn of(values: impl Iterator<Item = f64>) -> Option<Self> {
        let values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|v| (v - mean).powi(2)).sum();
        (!values.is_empty()).then_some(Self { count, mean, squares })
    }

    /// Without one of the draws; none where rounding would decide, since that one makes up most of the squares.
    fn without(self, value: f64) -> Option<Self> {
        /// Of the squares.
        const MOST: f64 = 0.9;
        if !value.is_finite() {
            return Some(self);
        }
        let Self { count, mean, squares } = self;
        let part = (value - mean).powi(2) * count / (count - 1.0);
        let others = Self {
            count: count - 1.0,
            mean: (count * mean - value) / (count - 1.0),
            squares: squares - part,
        };
        (part <= MOST * squares).then_some(others)
    }

    /// Mean and variance; none where the draws do not vary about a positive number.
    fn vary(self) -> Option<(f64, f64)> {
        let variance = self.squares / self.count;
        (self.mean > 1e-9 && variance > 1e-18).then_some((self.mean, variance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest of 500 squares of normal numbers: far beyond the draws the tail is what it is by counting single ones.
    #[test]
    fn the_tail_of_a_largest_square_is_an_exponential_one() {
        use rand::SeedableRng as _;
        use rand_distr::{Distribution as _, StandardNormal};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut square = || {
            let z: f64 = StandardNormal.sample(&mut rng);
            z * z
        };
        let largest: Vec<f64> = (0..999).map(|_| (0..500).map(|_| square()).fold(0.0, f64::max)).collect();
        let [largest, sum] = [Law::Largest, Law::Sum].map(|law| Null::new(law, largest.clone()));
        for value in [20.0, 30.0, 40.0, 60.0] {
            let normal = Normal::new(0.0, 1.0).unwrap();
            let true_p = 1000.0 * normal.sf(f64::sqrt(value));
            let ratio = largest.p(value) / true_p;
            assert!((0.3..4.0).contains(&ratio), "{value}: {ratio}");
        }
        // A gamma law would be too sure by far.
        assert!(sum.p(40.0) < 0.1 * largest.p(40.0));
    }

    /// What is less than the noise in nearly all worlds sees nothing, however far beyond them the data are; squares of normal numbers see.
    #[test]
    fn a_sum_that_is_fitted_away_sees_nothing() {
        let squares = |scale: f64| (1..1000).map(|k| scale * f64::from(k % 37) / 37.0).collect::<Vec<f64>>();
        let [fitted, seen] = [0.02, 4.0].map(|scale| Null::new(Law::Sum, squares(scale)));
        assert_eq!([fitted.p(0.3), fitted.p_of_draw(5)], [1.0; 2]);
        assert!(seen.p(60.0) < 1e-3 && seen.p_of_draw(5) < 1.0);
    }

    /// A statistic that varies by rounding alone (three rows, one of them a thousand times too deep) once took minutes.
    #[test]
    fn a_tail_takes_no_time_however_little_a_statistic_varies() {
        let begin = std::time::Instant::now();
        for spread in [1e-3, 1e-6, 1e-9, 1e-12] {
            let draws = (0..999).map(|k| 1e3 * (1.0 + spread * f64::from(k % 7 - 3)));
            let tail = Null::new(Law::Sum, draws.collect());
            for value in [1.0, 999.0, 1e3, 1e3 * (1.0 + 4.0 * spread), 1e9] {
                assert!((0.0..=1.0).contains(&tail.p(value)));
            }
            assert!(tail.p(999.0) > 0.3 && tail.p(1e9) < 1e-9, "{spread}");
        }
        assert!(begin.elapsed().as_secs() < 20, "{:?}", begin.elapsed());
    }

    /// On both sides of the shape where the laws meet, the tail is the same to a skewness of 0.02.
    #[test]
    fn the_two_laws_meet() {
        let of = |spread: f64| {
            Null::new(
                Law::Sum,
                (0..1000).map(|k| 1.0 + spread * if k % 2 == 0 { 1.0 } else { -1.0 }).collect(),
            )
        };
        let [gamma, normal] = [of(0.01002), of(0.00998)];
        assert!(matches!(gamma.tail, Tail::Gamma(_)) && matches!(normal.tail, Tail::Normal(_)));
        for value in [0.98, 0.99, 1.0, 1.01, 1.02] {
            approx::assert_abs_diff_eq!(gamma.p(value), normal.p(value), epsilon = 0.006);
        }
    }

    /// A draw is judged by the others, with or without rounding's help.
    #[test]
    fn a_draw_is_judged_by_the_others() {
        for outlier in [1.5, 30.0, 1e12] {
            let draws: Vec<f64> = (0..99).map(|k| 1.0 + f64::from(k % 10)).chain([outlier]).collect();
            for law in [Law::Sum, Law::Largest, Law::Rare] {
                let null = Null::new(law, draws.clone());
                for k in [0, 55, 99] {
                    let others = draws.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, v)| *v);
                    let others = Null::new(law, others.collect());
                    approx::assert_relative_eq!(null.p_of_draw(k), others.p(draws[k]), max_relative = 1e-6);
                }
            }
        }
        // It does not hide in a tail that it makes wide.
        let null = Null::new(Law::Sum, (0..99).map(|k| 1.0 + f64::from(k % 10)).chain([300.0]).collect());
        assert!(null.p_of_draw(99) < 1e-6 * null.p(300.0));
    }
}
