//! Where fits of a parameter that has a value in each run begin: at a fit to that run alone. From one start for all runs, a run whose value is
//! another by a half loses the phase and settles in a wrong place.

use missing_physics::data::Recording;
use missing_physics::fit::least_squares;
use missing_physics::model::{Model as _, Scope};

use super::equations::Equations;
use super::follow::{Windowed, first_pace, resolve, windows};
use super::model::MotionModel;
use super::windows::cut;

/// What a start is multiplied by, one parameter at a time, until a run is followed.
const FACTORS: [f64; 5] = [1.0, 0.5, 2.0, 0.25, 4.0];
/// Mean square in sigmas of the rough noise at which a run is followed well enough.
const FOLLOWED: f64 = 4.0;

/// Finds the starts of each run; where a run cannot be followed, that of all runs stays.
pub(super) fn find(equations: &mut Equations, recording: &Recording) {
    let of_run = |k: &usize| equations.parameters[*k].per_run && !equations.parameters[*k].known;
    let places: Vec<usize> = (0..equations.parameters.len()).filter(of_run).collect();
    if places.is_empty() {
        return;
    }
    let mut alone = recording.clone();
    for run in &recording.runs {
        alone.runs = vec![run.clone()];
        let Some(values) = of_one(equations, &alone, &places) else { continue };
        for (&place, value) in places.iter().zip(values) {
            equations.parameters[place].of_runs.push((run.label.clone(), value));
        }
    }
}

/// Values of the parameters at these places, fitted with all others to a run that is alone.
fn of_one(equations: &Equations, alone: &Recording, places: &[usize]) -> Option<Vec<f64>> {
    let values = alone.runs.iter().flat_map(|run| run.outputs.iter().flatten());
    let measured = values.filter(|v| v.is_finite()).count().max(1);
    let mut best: Option<(f64, Vec<f64>)> = None;
    let others = places.iter().flat_map(|place| FACTORS[1..].iter().map(|factor| (*place, *factor)));
    for (place, factor) in std::iter::once((places[0], FACTORS[0])).chain(others) {
        let mut shared = equations.clone();
        for parameter in &mut shared.parameters {
            parameter.per_run = false;
        }
        let parameter = &mut shared.parameters[place];
        parameter.value = (factor * parameter.value).clamp(parameter.bounds[0], parameter.bounds[1]);
        let Some((chi2, values)) = fitted(shared, alone, places) else { continue };
        if best.as_ref().is_none_or(|(least, _)| chi2 < *least) {
            best = Some((chi2, values));
        }
        if best.as_ref().is_some_and(|(least, _)| *least < FOLLOWED * measured as f64) {
            break;
        }
    }
    best.map(|(_, values)| values)
}

/// A run fitted alone: the sum of squares, and the values of the parameters at these places.
fn fitted(equations: Equations, alone: &Recording, places: &[usize]) -> Option<(f64, Vec<f64>)> {
    let slot = |place: usize| equations.parameters[..place].iter().filter(|p| !p.known).count();
    let slots: Vec<usize> = places.iter().map(|place| slot(*place)).collect();
    let mut model = MotionModel::baseline(equations, first_pace(alone));
    let starts = model.spec().starts(Scope::Shared);
    resolve(&mut model, alone, &starts).ok()?;
    let Windowed { fitted, followed, .. } = windows(&model, alone, starts).ok()?;
    let fit = match followed {
        None => least_squares(&model, alone, &fitted),
        Some(longest) => {
            let free = model.freed();
            least_squares(&free, &cut(alone, longest.rows), &fitted)
        }
    };
    let fit = fit.ok()?;
    Some((fit.chi2, slots.iter().map(|slot| fit.shared[*slot]).collect()))
}
