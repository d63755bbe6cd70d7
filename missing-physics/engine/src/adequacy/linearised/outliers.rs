//! Rows that all the others contradict, whatever mechanism is at work.
//!
//! The model with every mechanism switched on is fitted to all rows; each row in turn is then allowed a shift of its own
//! (the mean-shift test, Cook and Weisberg 1982, Residuals and Influence in Regression, section 2.2). Unlike a look at a row's neighbours, this sees a wild reading at
//! the end of a run, and one among few rows.

use std::ops::Range;

use super::plane::Linearised;
use super::solve::normal;
use crate::fit::bordered::BorderedNormal;
use crate::linalg::{SemiCholesky, dot};
use crate::statistics::median;

/// Rows after which the whitened image of a single row's shift has died away.
const REACH: usize = 256;
/// Below this share of its information left by the fit, a row cannot be judged: it determines a parameter by itself.
const FREEDOM: f64 = 0.05;
/// A row that is off by no more than so many steps in which its readings come is no accident, however still all others are.
const STEPS: f64 = 2.0;
/// A shift that is larger by this factor than what rows usually lie beyond their neighbours' line would show in the data.
const SHOWN: f64 = 5.0;
/// A channel with fewer measured rows has no scale of its own to judge a row by.
const FEWEST_ROWS: usize = 24;

/// A lapse of a sensor (a camera that followed something else, a contact that was lost) is at most one row in so many of its run,
const LAPSE: usize = 100;
/// or two in a run of so many rows.
const TWO_ROWS: usize = 40;
/// It begins and ends with jumps of so many robust sigmas of the steps from row to row,
pub(crate) const JUMP: f64 = 25.0;
/// and stays away by at least this part of the first jump; where it is over, the readings are back to within the rest.
const AWAY: f64 = 0.5;

/// Rows of the longest lapse in a run of so many.
pub(crate) const fn longest_lapse(rows: usize) -> usize {
    if rows >= TWO_ROWS && rows < 2 * LAPSE { 2 } else { rows / LAPSE }
}

/// How far a row lies from what all others say of it, in sigmas, and whether it stands alone.
type RowScore = (f64, bool);

/// The model with every mechanism switched on, fitted to a data vector.
struct Fitted<'a> {
    linearised: &'a Linearised<'a>,
    /// The columns: of nuisance parameters, then of shared ones.
    ids: Vec<usize>,
    n_nuisance: usize,
    noise: Vec<(usize, f64)>,
    coefficients: Vec<Vec<f64>>,
    bordered: BorderedNormal,
    /// Factor of the shared parameters' information.
    factor: SemiCholesky,
}

impl Linearised<'_> {
    /// How far each row lies from what all the other rows say of it, in robust sigmas; `[run][channel]`, measured rows.
    pub(crate) fn row_scores(&self, data: &[Vec<Vec<f64>>]) -> Vec<Vec<Vec<f64>>> {
        let fitted = Fitted::new(self, data);
        let of_run = |(run, row): (usize, &Vec<Vec<f64>>)| -> Vec<Vec<RowScore>> {
            row.iter().enumerate().map(|(channel, column)| fitted.scores(run, channel, column)).collect()
        };
        let scores: Vec<Vec<Vec<RowScore>>> = data.iter().enumerate().map(of_run).collect();
        let scales: Vec<f64> = (0..fitted.noise.len())
            .map(|channel| robust_scale(scores.iter().flat_map(|row| &row[channel])))
            .collect();
        let judged = |(column, scale): (Vec<RowScore>, &f64)| -> Vec<f64> {
            column.into_iter().map(|(z, alone)| if alone { z / scale } else { 0.0 }).collect()
        };
        let mut scores: Vec<Vec<Vec<f64>>> =
            scores.into_iter().map(|row| row.into_iter().zip(&scales).map(judged).collect()).collect();
        for (run, of_run) in scores.iter_mut().enumerate() {
            for (channel, of_rows) in of_run.iter_mut().enumerate() {
                let left = fitted.left(run, channel, &data[run][channel]);
                for (rows, z) in lapses(&left, self.resolution(channel)) {
                    of_rows[rows].fill(z);
                }
            }
        }
        scores
    }

    fn resolution(&self, channel: usize) -> f64 {
        self.problem.recording.resolution.get(channel).copied().unwrap_or(0.0)
    }
}

impl<'a> Fitted<'a> {
    fn new(linearised: &'a Linearised<'a>, data: &[Vec<Vec<f64>>]) -> Self {
        let (nuisance, shared) = linearised.columns_with(linearised.mechanisms);
        let products = linearised.products(data);
        let start = linearised.white_start(&products);
        let (_, noise, coefficients) = linearised.alternate(&products, &nuisance, &shared, &start, 8);
        let coefficients = linearised.solve_by_run(&products, &coefficients.noise, &nuisance, &shared);
        let ids: Vec<usize> = nuisance.iter().chain(&shared).copied().collect();
        let mut bordered = BorderedNormal::new(shared.len());
        for row in &linearised.blocks {
            // The residual is looked at row by row: here it is zero.
            bordered.add(&normal(row, &noise, &ids));
        }
        let factor = bordered.factor_of_independent();
        Self { linearised, ids, n_nuisance: nuisance.len(), noise, coefficients, bordered, factor }
    }

    /// What the model leaves of a channel's rows.
    fn left(&self, run: usize, channel: usize, column: &[f64]) -> Vec<f64> {
        let block = &self.linearised.blocks[run][channel];
        let mut left = column.to_vec();
        for (&id, x) in self.ids.iter().zip(&self.coefficients[run]) {
            left.iter_mut().zip(&block.raw[id]).for_each(|(r, c)| *r -= x * c);
        }
        left
    }

    /// The scores of a channel's rows.
    fn scores(&self, run: usize, channel: usize, column: &[f64]) -> Vec<RowScore> {
        let Self { linearised, ids, .. } = self;
        let (shape, sigma) = self.noise[channel];
        let whitener = linearised.problem.whitener(run, channel, linearised.in_play[shape]);
        let block = &linearised.blocks[run][channel];
        let step = linearised.resolution(channel);
        let left = self.left(run, channel, column);
        let bends = bends(column);
        let usual = median(&mut bends.iter().map(|b| b.abs()).collect::<Vec<f64>>()).unwrap_or(0.0);
        let mut residual = left.clone();
        whitener.whiten(&mut residual);
        (0..residual.len())
            .map(|i| {
                let image = whitener.impulse(i, residual.len(), REACH);
                let rows = i..i + image.len();
                let columns = &block.shapes[shape].columns;
                let along = ids.iter().map(|&id| dot(&image, &columns[id][rows.clone()]) / sigma).collect();
                let whole = dot(&image, &image);
                let informed = self.informed(run, whole, along);
                let shift = dot(&image, &residual[rows]) / informed;
                let z = if informed > FREEDOM * whole { shift * informed.sqrt() / sigma } else { 0.0 };
                // Far from the data, the fitted mechanisms' tangents may leave what the data do not show.
                let shown = shift.abs() < SHOWN * usual || bends[i] * shift > 0.5 * shift * shift;
                (z, shown && shift.abs() > STEPS * step && stands_alone(&left, i, shift))
            })
            .collect()
    }

    /// What the fit leaves of a row's information of its own shift: the whole without what goes `along` with the columns.
    fn informed(&self, run: usize, whole: f64, mut along: Vec<f64>) -> f64 {
        let mut shared = along.split_off(self.n_nuisance);
        self.bordered.runs()[run].eliminate(&mut along, &mut shared);
        self.factor.forward(&mut shared);
        whole - dot(&along, &along) - dot(&shared, &shared)
    }
}

/// By how much each value lies beyond the line through its neighbours, or at an end through the next two.
fn bends(column: &[f64]) -> Vec<f64> {
    let n = column.len();
    let beyond = |i: usize| match (i, n) {
        (_, ..3) => 0.0,
        (0, _) => column[0] - 2.0 * column[1] + column[2],
        (i, n) if i + 1 == n => column[i] - 2.0 * column[i - 1] + column[i - 2],
        (i, _) => column[i] - 0.5 * (column[i - 1] + column[i + 1]),
    };
    (0..n).map(beyond).collect()
}

/// Whether a row that is shifted by so much stands alone. Where the level changes, the first row after it agrees with the next.
fn stands_alone(left: &[f64], row: usize, shift: f64) -> bool {
    let around = [row.checked_sub(1), Some(row + 1)].into_iter().flatten();
    around.filter_map(|k| left.get(k)).all(|other| (left[row] - other) * shift > 0.5 * shift * shift)
}

/// Series of rows that leave at once by far and come back at once, and by how many sigmas of the steps from row to row.
fn lapses(left: &[f64], resolution: f64) -> Vec<(Range<usize>, f64)> {
    let jumps: Vec<f64> = left.windows(2).map(|w| w[1] - w[0]).collect();
    let Some(usual) = median(&mut jumps.iter().map(|j| j.abs()).collect::<Vec<f64>>()) else {
        return Vec::new();
    };
    let sigma = (usual / 0.6745).max(STEPS * resolution);
    let (limit, longest) = (JUMP * sigma, longest_lapse(left.len()));
    let mut found = Vec::new();
    let mut first = 1;
    while first < left.len() {
        let (before, jump) = (left[first - 1], jumps[first - 1]);
        let is_back = |k: &usize| (left[*k] - before).abs() < AWAY * jump.abs();
        let over = (first + 1..left.len()).take(longest).find(is_back);
        match over.filter(|&k| sigma > 0.0 && jump.abs() > limit && -jumps[k - 1] * jump.signum() > limit) {
            Some(over) => {
                found.push((first..over, jump.abs() / sigma));
                first = over;
            }
            None => first += 1,
        }
    }
    found
}

/// The sigma of a channel's scores, whatever is wild among them.
fn robust_scale<'a>(scores: impl Iterator<Item = &'a RowScore>) -> f64 {
    let mut moduli: Vec<f64> = scores.map(|(z, _)| z.abs()).filter(|z| *z > 0.0).collect();
    // Wild rows swell sigma, so the scale is the median's; but readings that mostly repeat leave none.
    if moduli.len() < FEWEST_ROWS {
        f64::INFINITY
    } else {
        median(&mut moduli).map_or(1.0, |m| (m / 0.6745).max(0.2))
    }
}
