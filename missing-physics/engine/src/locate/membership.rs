//! Which rows a cause acts at where the variable along which it acts was measured with an error: a place that was misheard by a centimetre is
//! on either side of the edge of a stripe.
//!
//! A row acts with the probability that its true value lies within the interval. The most probable rows and edges together are sought from
//! an interval that fits as it was measured: rows near an edge change sides as long as that makes the whole more probable, then the edges
//! move to where they make the rows most probable.

use statrs::function::erf::erfc;

use crate::locate::projection::{Projection, dot};

/// Rows change sides within so many standard errors of an edge.
const REACH: f64 = 4.0;
/// Edges move in steps of this part of a standard error.
const STEP: f64 = 0.25;
/// Rows and edges are sought in turn so many times at most.
const TURNS: usize = 12;

/// A row: its value, and what a unit of the cause at it does to its run.
struct Row {
    run: usize,
    number: usize,
    value: f64,
    product: f64,
    along_shared: Vec<f64>,
    /// Products with the rows of its run, all of them.
    beside: Vec<f64>,
}

/// All rows at which a component of an unknown may act.
pub(crate) struct Rows {
    rows: Vec<Row>,
    /// By run: the number of its first row among all.
    first: Vec<usize>,
    sigma: f64,
}

/// Rows that act, and the interval in which their true values lie.
#[derive(Debug, Clone)]
pub(crate) struct Members {
    /// `[run][row]`.
    pub(crate) acts: Vec<Vec<bool>>,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// Sums over the rows that act.
#[derive(Clone)]
struct Sums {
    product: f64,
    square: f64,
    along_shared: Vec<f64>,
}

impl Sums {
    fn gain(&self) -> f64 {
        let square = self.square - dot(&self.along_shared, &self.along_shared);
        if square > 1e-6 * self.square { self.product * self.product / square } else { 0.0 }
    }
}

impl Rows {
    /// Of what a unit at each single row does, `columns[run][row]`, and each row's value along the variable, known to a standard error
    /// `sigma`.
    pub(crate) fn new(
        projection: &Projection,
        columns: &[Vec<Vec<f64>>],
        values: &[Vec<f64>],
        sigma: f64,
    ) -> Self {
        let mut rows = Vec::new();
        let mut first = Vec::new();
        for (run, (columns, values)) in columns.iter().zip(values).enumerate() {
            first.push(rows.len());
            let beside = |column: &Vec<f64>| {
                let mut column = column.clone();
                projection.beside_nuisance(run, &mut column);
                column
            };
            let columns: Vec<Vec<f64>> = columns.iter().map(beside).collect();
            rows.extend(columns.iter().zip(values).enumerate().map(|(number, (column, value))| Row {
                run,
                number,
                value: *value,
                product: dot(column, &projection.residual[run]),
                along_shared: projection.along_shared(run, column),
                beside: columns.iter().map(|other| dot(column, other)).collect(),
            }));
        }
        Self { rows, first, sigma }
    }

    /// The most probable rows and edges near an interval, and twice the logarithm of by how much they are more probable than that
    /// nothing acts, before anything is paid; `None` where no row is left.
    pub(crate) fn near(&self, from: f64, to: f64) -> Option<(f64, Members)> {
        let mut edges = [from, to];
        let mut acts: Vec<bool> = self.rows.iter().map(|row| row.value >= from && row.value <= to).collect();
        for _ in 0..TURNS {
            let changed = self.change_sides(&mut acts, edges);
            let moved = self.moved(&acts, edges);
            if !changed && moved == edges {
                break;
            }
            edges = moved;
        }
        let gain = self.sums(&acts).gain();
        let worth = gain + 2.0 * self.log_probability(&acts, edges);
        let ends = self.first.iter().skip(1).copied().chain([acts.len()]);
        let by_run = self.first.iter().zip(ends).map(|(&first, end)| acts[first..end].to_vec()).collect();
        let [from, to] = edges;
        (gain > 0.0 && worth.is_finite()).then_some((worth, Members { acts: by_run, from, to }))
    }

    /// The logarithm of the probability that a row acts, or does not.
    fn log_side(&self, value: f64, [from, to]: [f64; 2], acts: bool) -> f64 {
        // The nearer edge says nearly all; a value that is far on the wrong side of it is next to impossible.
        let inside = (value - from).min(to - value) / self.sigma;
        let towards = if acts { inside } else { -inside };
        (0.5 * erfc(-towards / std::f64::consts::SQRT_2)).max(1e-300).ln()
    }

    fn log_probability(&self, acts: &[bool], edges: [f64; 2]) -> f64 {
        self.rows.iter().zip(acts).map(|(row, acts)| self.log_side(row.value, edges, *acts)).sum()
    }

    fn sums(&self, acts: &[bool]) -> Sums {
        let shared = self.rows.first().map_or(0, |row| row.along_shared.len());
        let mut sums = Sums { product: 0.0, square: 0.0, along_shared: vec![0.0; shared] };
        let mut none = vec![false; acts.len()];
        for at in (0..acts.len()).filter(|&at| acts[at]) {
            sums = self.changed(&sums, &none, at);
            none[at] = true;
        }
        sums
    }

    /// The sums where a row changes sides.
    fn changed(&self, sums: &Sums, acts: &[bool], at: usize) -> Sums {
        let row = &self.rows[at];
        let sign = if acts[at] { -1.0 } else { 1.0 };
        let first = self.first[row.run];
        let of_others = row.beside.iter().enumerate().filter(|(k, _)| *k != row.number && acts[first + k]);
        let cross: f64 = of_others.map(|(_, product)| product).sum();
        let along = sums.along_shared.iter().zip(&row.along_shared).map(|(sum, along)| sum + sign * along);
        Sums {
            product: sums.product + sign * row.product,
            square: sums.square + sign * (2.0 * cross + row.beside[row.number]),
            along_shared: along.collect(),
        }
    }

    /// Lets rows near an edge change sides, one after the other, as long as that makes the whole more probable; whether any did.
    fn change_sides(&self, acts: &mut [bool], edges: [f64; 2]) -> bool {
        let near = |row: &Row| edges.iter().any(|edge| (row.value - edge).abs() <= REACH * self.sigma);
        let candidates: Vec<usize> = (0..self.rows.len()).filter(|&at| near(&self.rows[at])).collect();
        let mut sums = self.sums(acts);
        let mut any = false;
        for _ in 0..2 * candidates.len() {
            let worth = |at: &usize| {
                let changed = self.changed(&sums, acts, *at);
                let side = |acts| self.log_side(self.rows[*at].value, edges, acts);
                let gain = changed.gain() - sums.gain() + 2.0 * (side(!acts[*at]) - side(acts[*at]));
                (gain, *at, changed)
            };
            let best = candidates.iter().map(worth).max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, at, changed)) = best.filter(|(gain, ..)| *gain > 1e-9) else { break };
            acts[at] = !acts[at];
            sums = changed;
            any = true;
        }
        any
    }

    /// The edges near some others that make the rows most probable.
    fn moved(&self, acts: &[bool], mut edges: [f64; 2]) -> [f64; 2] {
        let steps = (REACH / STEP) as i32;
        for edge in 0..2 {
            let tried = (-steps..=steps).map(|step| {
                let mut moved = edges;
                moved[edge] += f64::from(step) * STEP * self.sigma;
                moved
            });
            let sensible = tried.filter(|[from, to]| from < to);
            let probable = sensible.map(|moved| (self.log_probability(acts, moved), moved));
            // Of edges that are as probable the one that is there.
            let now = self.log_probability(acts, edges);
            let best = probable.max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((most, moved)) = best
                && most > now + 1e-9
            {
                edges = moved;
            }
        }
        edges
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution as _, StandardNormal};

    use super::*;

    /// Runs of four rows; where the true value is between 0.3 and 0.6 a cause of five sigmas acts on its row and, by half, on the next.
    #[test]
    fn rows_are_found_whose_values_were_measured_on_the_wrong_side() {
        const SIGMA: f64 = 0.05;
        const SIZE: f64 = 5.0;
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let response = |row: usize| -> Vec<f64> {
            let at = |k: usize| k.checked_sub(row).and_then(|after| [1.0, 0.5].get(after)).copied();
            (0..4).map(|k| at(k).unwrap_or(0.0)).collect()
        };
        let (mut residuals, mut values, mut truth) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..50 {
            let x: Vec<f64> = (0..4).map(|_| rng.random_range(0.0..1.0)).collect();
            let acts: Vec<bool> = x.iter().map(|x| (0.3..0.6).contains(x)).collect();
            let mut residual: Vec<f64> = (0..4).map(|_| StandardNormal.sample(&mut rng)).collect();
            for row in (0..4).filter(|&row| acts[row]) {
                residual.iter_mut().zip(response(row)).for_each(|(r, by)| *r += SIZE * by);
            }
            let error = |rng: &mut ChaCha8Rng| -> f64 { StandardNormal.sample(rng) };
            values.push(x.iter().map(|x| x + SIGMA * error(&mut rng)).collect::<Vec<f64>>());
            residuals.push(vec![residual]);
            truth.push(acts);
        }
        let projection = Projection::new(&residuals, (0, 0));
        let columns: Vec<Vec<Vec<f64>>> = (0..50).map(|_| (0..4).map(response).collect()).collect();
        let rows = Rows::new(&projection, &columns, &values, SIGMA);
        let (_, members) = rows.near(0.25, 0.7).unwrap();
        let count = |found: &dyn Fn(usize, usize) -> bool| {
            let rows = (0..50).flat_map(|run| (0..4).map(move |row| (run, row)));
            rows.filter(|&(run, row)| found(run, row) != truth[run][row]).count()
        };
        let as_measured = count(&|run, row| (0.3..0.6).contains(&values[run][row]));
        let wrong = count(&|run, row| members.acts[run][row]);
        assert!(as_measured > 12 && wrong <= 2, "{wrong} rows are wrong, {as_measured} as measured");
        assert!((members.from - 0.3).abs() < 0.03 && (members.to - 0.6).abs() < 0.03, "{members:?}");
        // The size is that of the rows at which it truly acts, to less than two rows make of fifty.
        let [size, of_truth] = [&members.acts, &truth].map(|acts| {
            let sums = rows.sums(&acts.concat());
            sums.product / sums.square
        });
        assert!(
            (size / of_truth - 1.0).abs() < 0.04 && (of_truth / SIZE - 1.0).abs() < 0.1,
            "{size} {of_truth}"
        );
    }
}
