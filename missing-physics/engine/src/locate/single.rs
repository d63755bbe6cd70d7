//! Where an unknown acts at a few single rows (the impacts that went unheard), each by an amount of its own.

use crate::fit::optimum::Fit;
use crate::locate::cause::{SIMPLER, gains};
use crate::locate::projection::{Projection, dot};
use crate::locate::unknowns::{Unknown, are_events};
use crate::model::PredictError;
use crate::problem::Problem;

/// No more than this many events are single ones.
const MOST: usize = 12;

/// A row at which an unknown acts.
pub(crate) struct Event {
    pub(crate) run: usize,
    pub(crate) row: usize,
    pub(crate) component: usize,
    pub(crate) size: [f64; 2],
    /// By how much the sum of squares of each channel falls.
    pub(crate) gains: Vec<f64>,
}

/// Single rows at which an unknown acts.
pub(crate) struct Events {
    pub(crate) unknown: usize,
    pub(crate) rows: Vec<Event>,
    /// By how much the sum of squares falls, less what was paid.
    pub(crate) worth: f64,
}

/// The best unknown with the rows at which it acts; `None` where rows are no events, or none is worth its price.
pub(crate) fn events(
    problem: &Problem<'_>,
    fit: &Fit,
    sigma: &[f64],
    projection: &Projection,
    unknowns: &[Unknown<'_>],
) -> Result<Option<Events>, PredictError> {
    if !are_events(problem) {
        return Ok(None);
    }
    // What acts at single rows only says more than an amount by which rows differ.
    let weight = |events: &Events| {
        let only = unknowns[events.unknown].described.at_single_rows;
        if only { SIMPLER * events.worth } else { events.worth }
    };
    let mut best: Option<Events> = None;
    for (number, unknown) in unknowns.iter().enumerate().filter(|(_, u)| u.is_model_s() && u.runs_are_alone())
    {
        for component in 0..unknown.described.components.len() {
            let columns = unknown.at_each_row(problem, fit, sigma, component)?;
            let found = greedy(problem, projection.clone(), &columns, number, component);
            if !found.rows.is_empty() && best.as_ref().is_none_or(|b| weight(&found) > weight(b)) {
                best = Some(found);
            }
        }
    }
    Ok(best)
}

/// Takes the row that is worth most, and the next one beside it, as long as one is worth its price.
fn greedy(
    problem: &Problem<'_>,
    mut projection: Projection,
    columns: &[Vec<Vec<f64>>],
    unknown: usize,
    component: usize,
) -> Events {
    let count: usize = columns.iter().map(Vec::len).sum();
    let price = projection.rows.ln() + 2.0 * (count.max(1) as f64).ln();
    let mut found = Events { unknown, rows: Vec::new(), worth: 0.0 };
    // One more than there may be: what goes on and on is no few single rows.
    for _ in 0..=MOST {
        let judged = columns.iter().enumerate().flat_map(|(run, rows)| {
            let projection = &projection;
            rows.iter().enumerate().map(move |(row, column)| {
                let mut beside = column.clone();
                projection.beside_nuisance(run, &mut beside);
                let shared = projection.along_shared(run, &beside);
                let whole = dot(column, column);
                let square = dot(&beside, &beside) - dot(&shared, &shared);
                let product = dot(&beside, &projection.residual[run]);
                let determined = square > 1e-6 * whole && square > 0.0;
                let gain = if determined { product * product / square } else { 0.0 };
                (gain, run, row, [product / square, square.sqrt().recip()])
            })
        });
        let Some((gain, run, row, size)) = judged.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if gain <= price {
            return found;
        }
        let before = projection.residual.clone();
        let fell = projection.add_to_run(run, &columns[run][row]);
        let gains = gains(problem, &before, &projection.residual);
        found.worth += fell - price;
        found.rows.push(Event { run, row, component, size, gains });
    }
    Events { rows: Vec::new(), ..found }
}
