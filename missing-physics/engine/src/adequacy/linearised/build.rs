//! Linearises a model around a fit: the columns of its plane, and of the directions in which it might be wrong.

use super::block::Block;
use super::curves::{Curves, DEGREE};
use super::plane::{Alternative, Linearised};
use super::pooled::separate;
use crate::fit::columns::whitened_columns;
use crate::fit::optimum::Fit;
use crate::linalg::{determined, dot};
use crate::model::{Mechanism, PredictError, Scope};
use crate::noise::rule::{NoiseRule, NoiseState};
use crate::problem::{Problem, Selection};

/// Degree of the polynomial in the number of the run that the adequacy test looks for: what warms up or wears from run to run.
const ORDER: usize = 2;
/// Fewer runs show no such course.
const FEWEST_RUNS: usize = 5;

/// Everything that the model or any rival frees, and where its columns stand in a block: nuisance of the model, shared of the model, nuisance
/// of rivals, shared of rivals, polynomials in variables, polynomials in the number of the run.
struct Layout {
    wide: Selection,
    n_nuisance: usize,
    n_shared: usize,
}

impl Layout {
    fn nuisance(&self, i: usize) -> usize {
        if i < self.n_nuisance { i } else { self.n_shared + i }
    }

    fn shared(&self, i: usize) -> usize {
        if i < self.n_shared { self.n_nuisance + i } else { self.wide.nuisance.len() + i }
    }

    /// Where the polynomials begin.
    fn base(&self) -> usize {
        self.wide.nuisance.len() + self.wide.shared.len()
    }

    /// Where those in the number of the run begin.
    fn ordered(&self, curves: &Curves) -> usize {
        self.base() + curves.total() * DEGREE
    }
}

/// What a mechanism frees beyond the model: places among the nuisance and the shared parameters of all, and the sign of its strength.
struct Freed {
    nuisance: Vec<usize>,
    shared: Vec<usize>,
    sign: f64,
}

/// Adds what a mechanism frees to `wide`.
fn freed(problem: &Problem<'_>, selection: &Selection, wide: &mut Selection, mechanism: &Mechanism) -> Freed {
    let spec = problem.spec();
    let mut freed = Freed { nuisance: Vec::new(), shared: Vec::new(), sign: 0.0 };
    for &p in mechanism.parameters.iter().chain(&mechanism.companions) {
        let (slot, info) = (problem.slots[p], &spec.parameters[p]);
        let (list, target, of_model) = if info.scope == Scope::Shared {
            (&mut wide.shared, &mut freed.shared, &selection.shared)
        } else {
            (&mut wide.nuisance, &mut freed.nuisance, &selection.nuisance)
        };
        let at = list.iter().position(|&s| s == slot).unwrap_or_else(|| {
            list.push(slot);
            list.len() - 1
        });
        if !of_model.contains(&slot) {
            target.push(at);
        }
        freed.sign = if info.lower >= info.start {
            1.0
        } else if info.upper <= info.start {
            -1.0
        } else {
            0.0
        };
    }
    if freed.shared.len() != 1 || !freed.nuisance.is_empty() {
        freed.sign = 0.0;
    }
    freed
}

/// The layout, and the rivals as alternatives in it.
fn mechanisms(problem: &Problem<'_>, selection: &Selection, rivals: &[usize]) -> (Layout, Vec<Alternative>) {
    let mut wide = selection.clone();
    let all: Vec<(String, Freed)> = rivals
        .iter()
        .map(|&m| {
            let mechanism = &problem.spec().mechanisms[m];
            (mechanism.id.clone(), freed(problem, selection, &mut wide, mechanism))
        })
        .filter(|(_, freed)| !(freed.nuisance.is_empty() && freed.shared.is_empty()))
        .collect();
    let layout = Layout { wide, n_nuisance: selection.nuisance.len(), n_shared: selection.shared.len() };
    let placed = |(name, freed): (String, Freed)| Alternative {
        name,
        nuisance: freed.nuisance.into_iter().map(|i| layout.nuisance(i)).collect(),
        shared: freed.shared.into_iter().map(|i| layout.shared(i)).collect(),
        sign: freed.sign,
    };
    let alternatives = all.into_iter().map(placed).collect();
    (layout, alternatives)
}

/// Smooth functions of every variable as alternatives.
fn smooth<'a>(
    problem: &'a Problem<'_>,
    curves: &'a Curves,
    base: usize,
) -> impl Iterator<Item = Alternative> + 'a {
    problem.recording.channels.iter().enumerate().flat_map(move |(channel, quantity)| {
        curves.names(channel).into_iter().enumerate().map(move |(k, name)| {
            let first = base + (curves.offset(channel) + k) * DEGREE;
            Alternative {
                name: format!("{} depends on {name}", quantity.name),
                nuisance: Vec::new(),
                shared: (first..first + DEGREE).collect(),
                sign: 0.0,
            }
        })
    })
}

/// The channels of which smooth functions of the order of the runs are looked for: all, or none where there are too few runs.
fn along_runs(problem: &Problem<'_>) -> usize {
    if problem.rows.len() >= FEWEST_RUNS { problem.channels() } else { 0 }
}

/// Smooth functions of the order of the runs as alternatives; `base` is where their columns begin.
fn ordered<'a>(problem: &'a Problem<'_>, base: usize) -> impl Iterator<Item = Alternative> + 'a {
    let channels = problem.recording.channels.iter().enumerate().take(along_runs(problem));
    channels.map(move |(channel, quantity)| Alternative {
        name: format!("{} depends on the order of the runs", quantity.name),
        nuisance: Vec::new(),
        shared: (base + channel * ORDER..base + (channel + 1) * ORDER).collect(),
        sign: 0.0,
    })
}

/// Legendre polynomials of degrees 1 and 2 of the number of a run, from -1 to 1.
fn of_order(problem: &Problem<'_>, run: usize) -> [f64; ORDER] {
    let x = 2.0 * run as f64 / (problem.rows.len().max(2) - 1) as f64 - 1.0;
    [x, 1.5 * x * x - 0.5]
}

/// What each free parameter does to the rows of a run.
fn columns(
    problem: &Problem<'_>,
    wide: &Selection,
    fit: &Fit,
    run: usize,
) -> Result<Vec<Vec<f64>>, PredictError> {
    let unit = NoiseState { shape: vec![0; problem.channels()], sigma: vec![1.0; problem.channels()] };
    whitened_columns(problem, wide, &unit, run, &fit.shared, &fit.nuisance[run])
}

/// The blocks of one run, one for each channel.
fn blocks(
    problem: &Problem<'_>,
    fit: &Fit,
    layout: &Layout,
    curves: &Curves,
    run: usize,
) -> Result<Vec<Block>, PredictError> {
    let Layout { wide, n_nuisance, .. } = layout;
    let columns = columns(problem, wide, fit, run)?;
    let mut start = 0;
    let mut row = Vec::with_capacity(problem.channels());
    for channel in 0..problem.channels() {
        let n = problem.rows[run].valid[channel].len();
        let ordered = layout.ordered(curves);
        let mut raw = vec![vec![0.0; n]; ordered + along_runs(problem) * ORDER];
        for i in 0..wide.nuisance.len() {
            raw[layout.nuisance(i)].copy_from_slice(&columns[i][start..start + n]);
        }
        for i in 0..wide.shared.len() {
            raw[layout.shared(i)].copy_from_slice(&columns[wide.nuisance.len() + i][start..start + n]);
        }
        curves.fill(problem, run, channel, &mut raw[layout.base()..ordered]);
        if channel < along_runs(problem) {
            for (k, value) in of_order(problem, run).into_iter().enumerate() {
                raw[ordered + channel * ORDER + k].fill(value);
            }
        }
        start += n;
        row.push(Block { raw, mine: Vec::new(), shapes: Vec::new() });
    }
    let squares: Vec<Vec<f64>> =
        row.iter().map(|b| b.raw[..*n_nuisance].iter().map(|c| dot(c, c)).collect()).collect();
    let largest: Vec<f64> =
        (0..*n_nuisance).map(|k| squares.iter().map(|s| s[k]).fold(0.0, f64::max)).collect();
    for (block, here) in row.iter_mut().zip(&squares) {
        block.mine = determined(here, &largest);
    }
    Ok(row)
}

impl<'a> Linearised<'a> {
    /// Linearises around `fit`; the mechanisms in `rivals` become alternatives beside smooth functions of each variable, but for those whose
    /// effect cannot be computed there.
    pub(crate) fn new(
        problem: &'a Problem<'a>,
        selection: &Selection,
        fit: &Fit,
        rivals: &[usize],
        rule: &NoiseRule,
    ) -> Result<Self, PredictError> {
        Self::beside(problem, selection, fit, rivals, rule).or_else(|why| {
            let computed: Vec<usize> = (rivals.iter().copied())
                .filter(|&rival| {
                    let (Layout { wide, .. }, _) = mechanisms(problem, selection, &[rival]);
                    problem.by_run(|run| columns(problem, &wide, fit, run)).is_ok()
                })
                .collect();
            if computed.len() == rivals.len() {
                Err(why)
            } else {
                Self::beside(problem, selection, fit, &computed, rule)
            }
        })
    }

    /// The same beside all rivals.
    fn beside(
        problem: &'a Problem<'a>,
        selection: &Selection,
        fit: &Fit,
        rivals: &[usize],
        rule: &NoiseRule,
    ) -> Result<Self, PredictError> {
        let (layout, mut alternatives) = mechanisms(problem, selection, rivals);
        let mechanisms = alternatives.len();
        let curves = Curves::new(problem, fit)?;
        alternatives.extend(smooth(problem, &curves, layout.base()));
        alternatives.extend(ordered(problem, layout.ordered(&curves)));
        let blocks = problem.by_run(|run| blocks(problem, fit, &layout, &curves, run))?;
        let Layout { n_nuisance, n_shared, .. } = layout;
        let counted: usize = (0..problem.channels()).map(|c| problem.count(c)).sum();
        let freedom = (0..problem.channels())
            .map(|c| {
                let used: usize = blocks.iter().map(|row| row[c].mine.len()).sum();
                let rows = problem.count(c) as f64;
                (rows - used as f64 - n_shared as f64 * rows / counted.max(1) as f64).max(1.0)
            })
            .collect();
        let rule = rule.clone();
        let (in_play, pooled) = (Vec::new(), Vec::new());
        let separate = separate(&blocks, n_nuisance);
        let mut linearised = Self {
            problem,
            in_play,
            blocks,
            pooled,
            separate,
            n_nuisance,
            n_shared,
            alternatives,
            measurable: Vec::new(),
            mechanisms,
            rule,
            freedom,
        };
        linearised.play(&linearised.rule.allowed.clone());
        let leave_noise = linearised.alternatives.iter().map(|a| linearised.leaves_noise(a));
        linearised.measurable = leave_noise.collect();
        Ok(linearised)
    }
}
