//! The noise of a set of drops, and a likely course of each of them.

use argmin::core::{CostFunction, Error, Executor, State};
use argmin::solver::neldermead::NelderMead;
use missing_physics::model::FEWEST_RUNS_THAT_DIFFER;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::drop::Drop;
use super::effects::Effects;
use super::weights::{Linear, Spread};

/// Sigmas that were calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Calibration {
    pub(super) time_s: Option<f64>,
    pub(super) place_m: [Option<f64>; 2],
    /// Hearing's own estimate of its sigmas, of times (s) and of places (m): right to a factor.
    pub(super) estimated: Option<[f64; 2]>,
}

impl Calibration {
    /// Minus twice the logarithm of the prior of a spread: what is typical of people's drops, or hearing's own estimate.
    ///
    /// Two or three flights a run do not split what they show among clock, places and directions: without a prior all of it falls to
    /// one of them, as chance has it.
    fn prior(&self, spread: &Spread) -> f64 {
        /// One sigma of the factor's logarithm, on sounds with echoes and without.
        const HEARD: f64 = 0.5;
        let ([time_s, place_m], [times, places]) = match self.estimated {
            Some(estimated) => (estimated, [HEARD; 2]),
            None => ([TYPICAL.time_s, TYPICAL.place_m[0]], [2.0, 1.0]),
        };
        [
            (spread.time_s / time_s, times, self.time_s.is_none()),
            (spread.place_m[0] / place_m, places, self.place_m == [None; 2]),
            (spread.restitution / TYPICAL.restitution, 1.5, self.time_s.is_none()),
            (spread.between_drops / TYPICAL.between_drops, 1.5, spread.between_drops > 0.0),
            (spread.kappa / TYPICAL.kappa, 1.5, true),
            (spread.approach_rad / TYPICAL.approach_rad, 1.0, true),
        ]
        .into_iter()
        .filter(|(.., unknown)| *unknown)
        .map(|(factor, sigma, _)| (factor.ln() / sigma).powi(2))
        .sum()
    }
}

/// What is typical: times marked in a sound to a tenth of a millisecond, places to half a centimetre, directions to a degree, a hand that
/// lets go to two, a restitution to a thousandth, or to half a hundredth where drops are not alike.
const TYPICAL: Spread = Spread {
    time_s: 1e-4,
    place_m: [5e-3; 2],
    kappa: 3e3,
    approach_rad: 0.03,
    restitution: 1e-3,
    between_drops: 5e-3,
};

#[derive(Debug, Clone, Copy)]
enum Unknown {
    Time,
    Restitution,
    BetweenDrops,
    Place,
    Kappa,
    Approach,
}

/// One of the effects.
type Effect = fn(&mut Effects) -> &mut f64;

/// An effect that is fitted beside the noise, and how far from its start it is beforehand: drops from one height hardly tell restitution, its
/// slope, drag and the clock apart, and a few that come apart would have a hand throw balls along the table.
#[derive(Clone, Copy)]
struct Nuisance {
    effect: Effect,
    width: f64,
    /// Whether it is never below zero.
    positive: bool,
}

impl Nuisance {
    const fn new(effect: Effect, width: f64) -> Self {
        Self { effect, width, positive: false }
    }

    const fn positive(effect: Effect, width: f64) -> Self {
        Self { effect, width, positive: true }
    }
}

/// What is known of a nuisance beforehand.
struct Beforehand {
    precision: f64,
    /// How far it is from the likeliest.
    departure: f64,
    /// By how much it may fall.
    least: f64,
}

/// What a fit may change about the effects before noise is judged by what is left; not friction, which is told from chance
/// only about the likely drop.
const NUISANCES: [Nuisance; 6] = [
    Nuisance::new(|e| &mut e.restitution, 0.3),
    Nuisance::new(|e| &mut e.slope_s_m, 0.1),
    Nuisance::positive(|e| &mut e.drag_per_m, 0.5),
    Nuisance::new(|e| &mut e.table[0], 0.3),
    Nuisance::new(|e| &mut e.table[1], 0.3),
    Nuisance::new(|e| &mut e.walk_s, 1e-4),
];
const CLOCK: Nuisance = Nuisance::new(|e| &mut e.clock_rate, 0.1);
/// A table that is a bowl: directions then hang on places, and seem to scatter by far more than they do.
const BOWL: [Nuisance; 1] = [Nuisance::new(|e| &mut e.curved_per_m, 1.0)];
/// A table that is softer on one side: restitutions then seem to scatter.
const SOFTER_SIDE: [Nuisance; 2] =
    [Nuisance::new(|e| &mut e.terms[0], 1.0), Nuisance::new(|e| &mut e.terms[1], 1.0)];
/// Log Bayes factor by which drops speak for a bowl, a softer side, or a restitution that is not the same in all of them: beside what is not
/// there the rest is known less well.
const NEEDED: f64 = 5.0;
/// A hand gives balls a velocity of its own, and one that was let go above one point heads the further out the further out it
/// lands: fitted with the rest, because the first place is measured with an error that a regression of headings on places would
/// take for a smaller slope.
const HAND: [Nuisance; 3] = [
    Nuisance::new(|e| &mut e.heads[0], 0.3),
    Nuisance::new(|e| &mut e.heads[1], 0.3),
    Nuisance::new(|e| &mut e.outwards_per_m, 10.0),
];

/// Where a heading (rad), and how it changes outwards (rad/m), may lie.
pub(super) const HEADS: [f64; 2] = [-1.0, 1.0];
pub(super) const OUTWARDS: [f64; 2] = [-50.0, 50.0];

/// Whether there are drops enough to say how a hand lets go of balls.
pub(super) const fn released(drops: usize) -> bool {
    drops >= 5
}

fn nuisances(drops: &[Drop]) -> Vec<Nuisance> {
    let mut all = NUISANCES.to_vec();
    // Where the height says how fast a ball comes, times that are all too long would be taken for balls that come aslant.
    if drops.iter().any(|d| d.height_m.is_some()) {
        all.push(CLOCK);
    }
    if released(drops.len()) {
        all.extend(HAND);
    }
    all
}

/// Restricted likelihood (Patterson and Thompson 1971, doi:10.1093/biomet/58.3.545) of the sigmas that are not known.
#[derive(Clone, Copy)]
struct Likelihood<'a> {
    drops: &'a [(Linear, DVector<f64>, DMatrix<f64>)],
    beforehand: &'a [Beforehand],
    calibration: Calibration,
    start: Spread,
}

impl Likelihood<'_> {
    /// The spread at logarithms of the factors by which each unknown sigma differs from its start.
    fn spread(&self, logs: &[f64]) -> Spread {
        let mut spread = self.start;
        for (free, log) in self.unknowns().into_iter().zip(logs) {
            let factor = log.clamp(-12.0, 12.0).exp();
            match free {
                Unknown::Time => spread.time_s *= factor,
                Unknown::Restitution => spread.restitution *= factor,
                Unknown::BetweenDrops => spread.between_drops *= factor,
                Unknown::Place => spread.place_m = spread.place_m.map(|p| p * factor),
                Unknown::Kappa => spread.kappa *= factor,
                Unknown::Approach => spread.approach_rad *= factor,
            }
        }
        spread
    }

    fn unknowns(&self) -> Vec<Unknown> {
        let mut list = Vec::new();
        if self.calibration.time_s.is_none() {
            list.extend([Unknown::Time, Unknown::Restitution]);
        }
        if self.start.between_drops > 0.0 {
            list.push(Unknown::BetweenDrops);
        }
        list.extend([Unknown::Kappa, Unknown::Approach]);
        if self.calibration.place_m == [None; 2] {
            list.push(Unknown::Place);
        }
        list
    }

    /// Spreads about the start, which is the best one, drawn from the normal law that the curvature of likelihood and prior gives.
    fn plausible(&self) -> Vec<Spread> {
        const STEP: f64 = 0.3;
        /// A factor that is open by more than this is left open by so many e-folds.
        const OPEN: f64 = 3.0;
        let n = self.unknowns().len();
        let at = |moves: &[(usize, f64)]| {
            let mut logs = vec![0.0; n];
            moves.iter().for_each(|&(k, by)| logs[k] += by);
            self.value(&self.spread(&logs)).map_or(f64::INFINITY, |v| v.0)
        };
        let centre = at(&[]);
        let mut information = DMatrix::identity(n, n) / (OPEN * OPEN);
        for i in 0..n {
            for j in 0..n {
                let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
                let bend: f64 = if i == j {
                    0.5 * (at(&[(i, STEP)]) + at(&[(i, -STEP)]) - 2.0 * centre)
                } else {
                    corners.iter().map(|(a, b)| 0.125 * a * b * at(&[(i, a * STEP), (j, b * STEP)])).sum()
                };
                information[(i, j)] += if bend.is_finite() { bend / (STEP * STEP) } else { 0.0 };
            }
        }
        let mut rng = ChaCha8Rng::seed_from_u64(0x5eed);
        let root = information.cholesky().map(|factor| factor.l().transpose());
        (0..PLAUSIBLE)
            .map(|_| {
                let mut logs = DVector::from_fn(n, |_, _| StandardNormal.sample(&mut rng));
                match &root {
                    Some(root) => drop(root.solve_upper_triangular_mut(&mut logs)),
                    None => logs.fill(0.0),
                }
                self.spread(logs.as_slice())
            })
            .collect()
    }

    /// Minus twice the logarithm, up to a constant, and the nuisances' best values.
    fn value(&self, spread: &Spread) -> Option<(f64, DVector<f64>)> {
        let columns = self.beforehand.len();
        let precision = DVector::from_iterator(columns, self.beforehand.iter().map(|b| b.precision));
        let departure = DVector::from_iterator(columns, self.beforehand.iter().map(|b| b.departure));
        let mut normal = DMatrix::from_diagonal(&precision);
        let mut pull = precision.component_mul(&departure);
        let (mut total, mut squares) = (0.0, pull.dot(&departure));
        for (linear, errors, design) in self.drops {
            let factor = linear.factor(spread, 0.0)?;
            let lower = factor.l_dirty();
            total += 2.0 * (0..lower.nrows()).map(|i| lower[(i, i)].ln()).sum::<f64>();
            let (mut white, mut design) = (errors.clone(), design.clone());
            lower.solve_lower_triangular_mut(&mut white).then_some(())?;
            lower.solve_lower_triangular_mut(&mut design).then_some(())?;
            squares += white.norm_squared();
            pull += design.tr_mul(&white);
            normal += design.tr_mul(&design);
        }
        let factor = normal.cholesky()?;
        let lower = factor.l_dirty();
        let determinant: f64 = (0..columns).map(|i| lower[(i, i)].ln()).sum();
        let mut moved = -factor.solve(&pull);
        let mut fitted = total + squares + pull.dot(&moved) + 2.0 * determinant;
        // What would fall below zero stays there, and the others are what they are then.
        for (at, Beforehand { least, .. }) in self.beforehand.iter().enumerate() {
            let short = least - moved[at];
            if short > 0.0 {
                let mut one = DVector::zeros(columns);
                one[at] = 1.0;
                let column = factor.solve(&one);
                fitted += short * short / column[at];
                moved += column.scale(short / column[at]);
            }
        }
        Some((fitted + self.calibration.prior(spread), moved))
    }
}

impl CostFunction for Likelihood<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, logs: &Vec<f64>) -> Result<f64, Error> {
        Ok(self.value(&self.spread(logs)).map_or(f64::INFINITY, |v| v.0))
    }
}

/// How often a drop is linearised anew about a likelier course.
pub(super) const ROUNDS: usize = 3;

/// What is judged of a set of drops.
pub(super) struct Judged {
    /// The likeliest spread of all drops.
    pub(super) spread: Spread,
    /// Spreads that are as likely as not, drawn by their probability.
    pub(super) plausible: Vec<Spread>,
    /// Each drop about its likely course.
    pub(super) drops: Vec<Linear>,
    /// How a hand lets go of them ([`Effects::heads`], [`Effects::outwards_per_m`]).
    pub(super) heads: [f64; 2],
    pub(super) outwards_per_m: f64,
}

/// How many plausible spreads are drawn.
const PLAUSIBLE: usize = 16;

/// The spread of all drops and each drop about its likely course.
///
/// # Errors
/// The number of the drop that makes no sense; of the first, where all together make none.
pub(super) fn judge(drops: &[Drop], effects: &Effects, calibration: Calibration) -> Result<Judged, usize> {
    let placed = drops.iter().any(|d| !d.places_m.is_empty());
    let mut left: Vec<(&[Nuisance], bool)> = Vec::new();
    if placed {
        left.extend([(&BOWL[..], false), (&SOFTER_SIDE[..], false)]);
    }
    if drops.len() >= FEWEST_RUNS_THAT_DIFFER {
        left.push((&[], true));
    }
    let (mut beside, mut differ) = (nuisances(drops), false);
    let mut best = judge_beside(&beside, differ, drops, effects, calibration)?;
    loop {
        let with = |(at, (more, differs)): (usize, &(&[Nuisance], bool))| {
            let all = [&beside[..], more].concat();
            let judged = judge_beside(&all, differ || *differs, drops, effects, calibration).ok()?;
            Some((at, judged))
        };
        let likeliest = left.iter().enumerate().filter_map(with).max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let Some((at, judged)) = likeliest.filter(|(_, judged)| judged.1 > best.1 + NEEDED) else {
            return Ok(best.0);
        };
        let (more, differs) = left.remove(at);
        beside.extend(more);
        differ |= differs;
        best = judged;
    }
}

/// The same beside given nuisances, and a restitution that differs from drop to drop or not; and the log evidence of what the drops say, up to
/// a constant.
fn judge_beside(
    nuisances: &[Nuisance],
    differ: bool,
    drops: &[Drop],
    effects: &Effects,
    calibration: Calibration,
) -> Result<(Judged, f64), usize> {
    let [x, y] = calibration.place_m;
    let [time_s, place_m] = calibration.estimated.unwrap_or([TYPICAL.time_s, TYPICAL.place_m[0]]);
    let mut spread = Spread {
        time_s: calibration.time_s.unwrap_or(time_s),
        place_m: [x.or(y).unwrap_or(place_m), y.or(x).unwrap_or(place_m)],
        restitution: if calibration.time_s.is_some() { 0.0 } else { TYPICAL.restitution },
        between_drops: if differ { TYPICAL.between_drops } else { 0.0 },
        ..TYPICAL
    };
    let mut plausible = vec![spread; PLAUSIBLE];
    let mut begin = *effects;
    let mut linear: Vec<Linear> = drops.iter().map(|d| Linear::about_straight(d, effects)).collect();
    let mut evidence = f64::NEG_INFINITY;
    for _ in 0..ROUNDS {
        let parts: Vec<_> = linear.iter().map(|l| with_design(l, &begin, nuisances)).collect();
        // A hand sends balls nowhere, beforehand; the other effects are those that the drops begin with.
        let expected = Effects { heads: [0.0; 2], outwards_per_m: 0.0, ..*effects };
        let beforehand: Vec<Beforehand> = (nuisances.iter())
            .map(|Nuisance { effect, width, positive }| {
                let [now, likeliest] = [&begin, &expected].map(|effects| *effect(&mut effects.clone()));
                let least = if *positive { -now } else { f64::NEG_INFINITY };
                Beforehand { precision: width.powi(-2), departure: now - likeliest, least }
            })
            .collect();
        let likelihood = Likelihood { drops: &parts, beforehand: &beforehand, calibration, start: spread };
        spread = likelihood.spread(&best(&likelihood).ok_or(0_usize)?);
        let (minus_twice, moved) = likelihood.value(&spread).ok_or(0_usize)?;
        // What is left of each nuisance's prior is the logarithm of its width.
        evidence = -0.5 * minus_twice - nuisances.iter().map(|n| n.width.ln()).sum::<f64>();
        plausible = Likelihood { start: spread, ..likelihood }.plausible();
        let mut likely = begin;
        nuisances.iter().zip(moved.iter()).for_each(|(nuisance, by)| *(nuisance.effect)(&mut likely) += by);
        likely.friction = 0.0;
        likely.drag_per_m = likely.drag_per_m.max(0.0);
        begin.heads = likely.heads.map(|v| v.clamp(HEADS[0], HEADS[1]));
        begin.outwards_per_m = likely.outwards_per_m.clamp(OUTWARDS[0], OUTWARDS[1]);
        let about = |(number, drop): (usize, &Linear)| drop.likely(&likely, &spread).ok_or(number);
        linear = linear.iter().enumerate().map(about).collect::<Result<_, _>>()?;
    }
    let Effects { heads, outwards_per_m, .. } = begin;
    spread.between_drops = 0.0;
    plausible.iter_mut().for_each(|spread| spread.between_drops = 0.0);
    Ok((Judged { spread, plausible, drops: linear, heads, outwards_per_m }, evidence))
}

/// A drop with its errors and what the nuisances make of them.
fn with_design(
    linear: &Linear,
    effects: &Effects,
    nuisances: &[Nuisance],
) -> (Linear, DVector<f64>, DMatrix<f64>) {
    const STEP: f64 = 1e-4;
    let errors = linear.errors(effects);
    let columns: Vec<DVector<f64>> = nuisances
        .iter()
        .map(|nuisance| {
            let mut moved = *effects;
            *(nuisance.effect)(&mut moved) += STEP;
            (linear.errors(&moved) - &errors) / STEP
        })
        .collect();
    (linear.clone(), errors, DMatrix::from_columns(&columns))
}

/// Logarithms of the factors by which the unknown sigmas differ from their start.
fn best(likelihood: &Likelihood<'_>) -> Option<Vec<f64>> {
    let n = likelihood.unknowns().len();
    let corner = |i: usize| (0..n).map(|k| if k + 1 == i { 1.5 } else { 0.0 }).collect::<Vec<f64>>();
    let solver = NelderMead::new((0..=n).map(corner).collect()).with_sd_tolerance(1e-4).ok()?;
    let run = Executor::new(*likelihood, solver).configure(|s| s.max_iters(100 * n as u64)).run().ok()?;
    run.state().get_best_param().cloned()
}
