//! How the errors of a drop's impacts hang together: neighbours share measured times and places.
//!
//! Times and places are measured with errors of their own, and a direction is scattered at each impact: a functional
//! relation with errors in all variables (Fuller 1987, doi:10.1002/9780470316665). The errors of a drop are therefore
//! linearised not at what was measured but at what the whole drop makes most likely, and whitened by their covariance there.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use super::drop::{Drop, Measured, PER_IMPACT};
use super::effects::Effects;

/// Sigmas of what is measured, and the spread of directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    pub(super) time_s: f64,
    pub(super) place_m: [f64; 2],
    /// Concentration of the directions after an impact (von Mises and Fisher).
    pub(super) kappa: f64,
    /// How far from straight down a ball first comes to the table, along each axis, rad.
    pub(super) approach_rad: f64,
    /// Scatter of the restitution's logarithm from impact to impact (Montaine et al. 2011, doi:10.1103/PhysRevE.84.041306); zero where the
    /// clock's sigma is known.
    pub(super) restitution: f64,
    /// Scatter of the restitution's logarithm from drop to drop: what the rest is judged beside, and zero in what is judged.
    pub(super) between_drops: f64,
}

impl Spread {
    /// Impacts heard to 10 mm of sound in the air, places to `place_m`, of a ball and a table that scatter by a hundredth.
    #[cfg(test)]
    pub(super) fn heard(place_m: f64) -> Self {
        Self {
            time_s: 3e-5,
            place_m: [place_m; 2],
            kappa: 1e4,
            approach_rad: 0.01,
            restitution: 0.0,
            between_drops: 0.0,
        }
    }

    /// One sigma of a whitened error in each channel: its unit is that of what was measured.
    pub(super) fn of_channels(&self) -> [f64; PER_IMPACT] {
        [self.time_s, self.place_m[0], self.place_m[1]]
    }
}

/// A drop whose errors are linear in what is measured, about a likely drop near the measured one.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    measured: Drop,
    /// The likely drop.
    pub(super) drop: Drop,
    /// Derivatives of the errors with respect to the measured values, and how friction changes them.
    sensitivity: [DMatrix<f64>; 2],
    /// What the measured drop's errors have beyond those of the likely drop, and how friction changes that.
    shift: [DVector<f64>; 2],
    /// Where the ball heads after each impact: a direction scatters across it.
    headings: Vec<[f64; 2]>,
    /// What the errors have beyond the straight line, being curved: on average, and its covariance.
    curvature: DVector<f64>,
    curvature_covariance: DMatrix<f64>,
}

impl Linear {
    /// About the measured drop itself.
    pub(super) fn new(measured: &Drop, effects: &Effects) -> Self {
        Self::about(measured, measured.clone(), effects)
    }

    /// About a drop that keeps its first heading, as near to the measured places as such a one comes.
    ///
    /// Late flights are so short that errors of heard places exceed them: headings read from them point anywhere, and a linearisation
    /// that begins there stays there.
    pub(super) fn about_straight(measured: &Drop, effects: &Effects) -> Self {
        Self::about(measured, measured.straight(), effects)
    }

    fn about(measured: &Drop, drop: Drop, effects: &Effects) -> Self {
        const FRICTION: f64 = 0.1;
        let free = sensitivity(&drop, &Effects { friction: 0.0, ..*effects });
        let rubbed = sensitivity(&drop, &Effects { friction: FRICTION, ..*effects });
        let change = (rubbed - &free) / FRICTION;
        let off = measured.values() - drop.values();
        let shift = [&free * &off, &change * &off];
        let curvature = DVector::zeros(free.nrows());
        let curvature_covariance = DMatrix::zeros(free.nrows(), free.nrows());
        let headings = drop.headings(effects);
        Self {
            measured: measured.clone(),
            drop,
            sensitivity: [free, change],
            shift,
            headings,
            curvature,
            curvature_covariance,
        }
    }

    /// By how much the errors change where a measured time does by a second.
    pub(super) fn by_time(&self, impact: usize) -> DVector<f64> {
        self.sensitivity[0].column(impact).into_owned()
    }

    /// The errors under some effects.
    pub(super) fn errors(&self, effects: &Effects) -> DVector<f64> {
        self.errors_of(&self.drop, effects)
    }

    /// The errors under some effects if its impacts were elsewhere and at other times than heard, by `[t, x, y]` (s, m).
    fn errors_moved(&self, effects: &Effects, moved: &[[f64; 3]]) -> DVector<f64> {
        if moved.is_empty() {
            return self.errors(effects);
        }
        let mut drop = self.drop.clone();
        for ((t, place), [by, x, y]) in drop.times_s.iter_mut().zip(&mut drop.places_m).zip(moved) {
            *t += by;
            *place = [place[0] + x, place[1] + y];
        }
        self.errors_of(&drop, effects)
    }

    fn errors_of(&self, drop: &Drop, effects: &Effects) -> DVector<f64> {
        let mut out = DVector::zeros(self.curvature.len());
        drop.errors(effects, out.as_mut_slice());
        out += &self.shift[0];
        out += &self.shift[1] * effects.friction;
        out + &self.curvature
    }

    /// Takes independent standard normal values to errors of the measured values.
    fn root(&self, spread: &Spread) -> DMatrix<f64> {
        let n = self.drop.measured();
        let mut root = DMatrix::zeros(n, n);
        for i in 0..n {
            match self.drop.quantity(i) {
                Measured::Time(k) => root[(i, i)] = spread.time_s * self.drop.relative(k).time,
                Measured::Place(k, axis) => (0..=axis).for_each(|j| {
                    root[(i, i - axis + j)] = spread.place_m[axis] * self.drop.relative(k).place[axis][j];
                }),
                Measured::Approach(_) => root[(i, i)] = spread.approach_rad,
            }
        }
        root
    }

    /// Derivatives of the errors with respect to those independent values.
    fn scaled(&self, spread: &Spread, friction: f64) -> DMatrix<f64> {
        let [free, change] = &self.sensitivity;
        let root = self.root(spread);
        if friction == 0.0 { free * root } else { (free + change * friction) * root }
    }

    /// Covariance of the errors, factored.
    pub(super) fn factor(&self, spread: &Spread, friction: f64) -> Option<Cholesky<f64, Dyn>> {
        self.covariance(spread, friction).cholesky()
    }

    fn covariance(&self, spread: &Spread, friction: f64) -> DMatrix<f64> {
        let scaled = self.scaled(spread, friction);
        let mut covariance = &scaled * scaled.transpose() + &self.curvature_covariance;
        self.scatter(&mut covariance, spread);
        // At least what rounding does, far below any clock.
        let scatter = spread.restitution.powi(2).max(1e-18);
        let speeds = self.drop.directions()..covariance.nrows();
        speeds.clone().for_each(|row| covariance[(row, row)] += scatter);
        if spread.between_drops > 0.0 {
            let n = speeds.len();
            let mut of_speeds = covariance.view_mut((speeds.start, speeds.start), (n, n));
            of_speeds.add_scalar_mut(spread.between_drops.powi(2));
        }
        covariance
    }

    /// Adds the scatter of directions, seen from above, to their covariance.
    fn scatter(&self, covariance: &mut DMatrix<f64>, spread: &Spread) {
        for (impact, [x, y]) in self.headings.iter().enumerate() {
            let scatter = 1.0 / spread.kappa;
            let at = self.drop.row(impact, 1);
            covariance[(at, at)] += scatter * (1.0 - x * x);
            covariance[(at + 1, at + 1)] += scatter * (1.0 - y * y);
            covariance[(at, at + 1)] -= scatter * x * y;
            covariance[(at + 1, at)] -= scatter * x * y;
        }
    }

    /// Scaled derivatives of the directions, which say which drop is likely, and the factor of their covariance.
    ///
    /// Speeds have no say: they hang on places by the squares of small angles, which no straight line follows.
    fn of_directions(&self, spread: &Spread) -> Option<(DMatrix<f64>, Cholesky<f64, Dyn>)> {
        let rows = self.drop.directions();
        let derivatives = self.scaled(spread, 0.0).rows(0, rows).into_owned();
        let covariance = self.covariance(spread, 0.0).view((0, 0), (rows, rows)).into_owned();
        Some((derivatives, covariance.cholesky()?))
    }

    /// The linearisation about the likely drop: the one whose errors are as small as they should be. `None` where that makes no sense.
    pub(super) fn likely(&self, effects: &Effects, spread: &Spread) -> Option<Self> {
        let effects = Effects { friction: 0.0, ..*effects };
        let (derivatives, factor) = self.of_directions(spread)?;
        let errors = self.errors(&effects).rows(0, derivatives.nrows()).into_owned();
        let pulled = self.root(spread) * derivatives.tr_mul(&factor.solve(&errors));
        let mut drop = self.measured.clone();
        pulled.iter().enumerate().for_each(|(i, pull)| drop.nudge(i, -pull));
        if drop.times_s.windows(2).any(|w| w[1] <= w[0]) {
            return None;
        }
        let mut next = Self::about(&self.measured, drop, &effects);
        next.curve(&effects, spread)?;
        Some(next)
    }

    /// What curvature adds to the errors over all that the true drop may be: its mean, and its covariance.
    fn curve(&mut self, effects: &Effects, spread: &Spread) -> Option<()> {
        // Air bends nothing here that gravity does not.
        let effects = Effects { drag_per_m: 0.0, ..*effects };
        let (mut derivatives, factor) = self.of_directions(spread)?;
        factor.l_dirty().solve_lower_triangular_mut(&mut derivatives).then_some(())?;
        let n = derivatives.ncols();
        let eigen = SymmetricEigen::new(DMatrix::identity(n, n) - derivatives.tr_mul(&derivatives));
        let root = self.root(spread);
        // Steps of half a sigma keep times in their order.
        const STEP: f64 = 0.5;
        let axes: Vec<DVector<f64>> = (0..n)
            .map(|k| &root * eigen.eigenvectors.column(k) * eigen.eigenvalues[k].max(0.0).sqrt())
            .collect();
        let rows = self.curvature.len();
        let at = |step: &DVector<f64>| {
            let mut drop = self.drop.clone();
            step.iter().enumerate().for_each(|(i, v)| drop.nudge(i, STEP * v));
            let mut out = DVector::zeros(rows);
            drop.errors(&effects, out.as_mut_slice());
            out
        };
        let centre = at(&DVector::zeros(n));
        let single: Vec<[DVector<f64>; 2]> = axes.iter().map(|a| [at(a), at(&-a)]).collect();
        let (mut curvature, mut curvature_covariance) = (DVector::zeros(rows), DMatrix::zeros(rows, rows));
        for j in 0..n {
            for k in 0..=j {
                let second = if j == k {
                    &single[j][0] + &single[j][1] - &centre * 2.0
                } else {
                    at(&(&axes[j] + &axes[k])) - &single[j][0] - &single[k][0] + &centre
                } / (STEP * STEP);
                if j == k {
                    curvature += &second * 0.5;
                }
                curvature_covariance.ger(if j == k { 0.5 } else { 1.0 }, &second, &second, 1.0);
            }
        }
        (self.curvature, self.curvature_covariance) = (curvature, curvature_covariance);
        Some(())
    }
}

/// Derivatives of a drop's errors with respect to its measured values, one column each.
fn sensitivity(drop: &Drop, effects: &Effects) -> DMatrix<f64> {
    const STEP: f64 = 1e-6;
    let rows = drop.errors_len();
    let mut matrix = DMatrix::zeros(rows, drop.measured());
    let (mut up, mut down) = (vec![0.0; rows], vec![0.0; rows]);
    for column in 0..drop.measured() {
        let mut moved = drop.clone();
        moved.nudge(column, STEP);
        moved.errors(effects, &mut up);
        moved.nudge(column, -2.0 * STEP);
        moved.errors(effects, &mut down);
        for row in 0..rows {
            matrix[(row, column)] = (up[row] - down[row]) / (2.0 * STEP);
        }
    }
    matrix
}

/// Takes a drop's errors to independent ones of one size, each in the unit of its channel.
#[derive(Debug, Clone)]
pub(super) struct Weights {
    pub(super) linear: Linear,
    spread: Spread,
    factor: Cholesky<f64, Dyn>,
}

impl Weights {
    pub(super) fn new(linear: Linear, spread: Spread) -> Option<Self> {
        let factor = linear.factor(&spread, 0.0)?;
        factor.l_dirty().iter().all(|v| v.is_finite()).then_some(Self { linear, spread, factor })
    }

    /// What a change of the errors does to the white ones; `None` where that cannot be had.
    pub(super) fn white_change(&self, mut change: DVector<f64>) -> Option<DVector<f64>> {
        let drop = &self.linear.drop;
        self.factor.l_dirty().solve_lower_triangular_mut(&mut change).then_some(())?;
        for (channel, scale) in self.spread.of_channels().into_iter().enumerate() {
            (0..drop.impacts()).for_each(|impact| change[drop.row(impact, channel)] *= scale);
        }
        Some(change)
    }

    /// The white errors under some effects, its impacts moved by `[t, x, y]` (s, m; empty: as heard); `None` where they cannot be had.
    ///
    /// Where an effect changes the covariance too, the errors of each channel are scaled by the geometric mean of its
    /// conditional sigmas: their sum of squares then is the likelihood with the channel's size profiled out.
    pub(super) fn errors(&self, effects: &Effects, moved: &[[f64; 3]]) -> Option<DVector<f64>> {
        let drop = &self.linear.drop;
        let rows = |channel: usize| (0..drop.impacts()).map(move |impact| drop.row(impact, channel));
        let mut white = self.linear.errors_moved(effects, moved);
        let mut scale = self.spread.of_channels();
        if effects.friction == 0.0 {
            self.factor.l_dirty().solve_lower_triangular_mut(&mut white).then_some(())?;
        } else {
            let factor = self.linear.factor(&self.spread, effects.friction)?;
            let (now, before) = (factor.l_dirty(), self.factor.l_dirty());
            for (channel, scale) in scale.iter_mut().enumerate() {
                let grown: f64 = rows(channel).map(|i| (now[(i, i)] / before[(i, i)]).ln()).sum();
                *scale *= (grown / drop.impacts() as f64).exp();
            }
            now.solve_lower_triangular_mut(&mut white).then_some(())?;
        }
        for (channel, scale) in scale.into_iter().enumerate() {
            rows(channel).for_each(|i| white[i] *= scale);
        }
        Some(white)
    }
}
