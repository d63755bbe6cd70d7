//! An impact that is not like the others: what another restitution, another direction, an impact that went unheard or a time that was
//! misread does to a drop.

use missing_physics::data::Run;
use missing_physics::model::{LocalCauses, LocalUnknown, PredictError, Quantity};
use nalgebra::DVector;

use super::effects::Effects;
use super::model::{BounceModel, ShownDrop};
use super::times::TimesModel;

/// The unknowns of an impact, by number.
const RESTITUTION: usize = 0;
const FLIGHT: usize = 1;
const MISREAD: usize = 2;
const DIRECTION: usize = 3;
const UNHEARD: usize = 4;
/// What keeps a flight from ending: longer contact, a gust. By more than this another restitution, or an unheard impact, makes it longer.
const LONGEST_DELAY_S: f64 = 0.02;
/// The number of that unknown where there are times alone.
const UNHEARD_IN_TIMES: usize = 2;

/// An unknown of one component.
fn one(name: &str, component: &str, unit: &str) -> LocalUnknown {
    LocalUnknown::new(name, vec![Quantity::new(component, unit)])
}

/// That the impacts which a flight seems to hide are there (1) or not (0).
fn unheard() -> LocalUnknown {
    one("impacts that were not heard", "unheard", "").at_single_rows()
}

/// Those that times alone show.
fn of_times() -> Vec<LocalUnknown> {
    vec![
        one("another restitution", "log_restitution", ""),
        one("a longer flight", "duration_s", "s").at_most(LONGEST_DELAY_S),
        one("a misread time", "late_s", "s").at_most(LONGEST_DELAY_S),
    ]
}

impl ShownDrop {
    /// By how much each prediction of an error changes.
    fn change(
        &self,
        (unknown, component): (usize, usize),
        effects: &Effects,
        amounts: &[f64],
    ) -> DVector<f64> {
        let linear = &self.weights.linear;
        let drop = &linear.drop;
        let mut change = DVector::zeros(drop.errors_len());
        for (row, amount) in amounts.iter().enumerate().filter(|(_, amount)| **amount != 0.0) {
            let impact = self.rows.heard.start + row;
            match (unknown, self.rows.known(row)) {
                (UNHEARD, _) => {
                    // What is before the first row shows there.
                    let places = if row == 0 { 0..impact + 2 } else { impact + 1..impact + 2 };
                    let there = places.filter_map(|place| drop.unheard_at(place, effects));
                    there.for_each(|less| change.axpy(*amount, &less, 1.0));
                }
                // A measured time that is late makes the errors what they are; the others are what is expected.
                (MISREAD, _) => change.axpy(*amount, &linear.by_time(impact), 1.0),
                (FLIGHT, _) => {
                    let later = impact + 1..drop.times_s.len();
                    later.for_each(|k| change.axpy(*amount, &linear.by_time(k), 1.0));
                }
                (RESTITUTION, Some(known)) => change[drop.row(known, 0)] += amount,
                (DIRECTION, Some(known)) => change[drop.row(known, 1 + component)] += amount,
                _ => {}
            }
        }
        change
    }
}

impl LocalCauses for BounceModel {
    fn unknowns(&self) -> Vec<LocalUnknown> {
        let components = ["heading_x_rad", "heading_y_rad"].map(|name| Quantity::new(name, "rad")).into();
        let mut all = of_times();
        all.push(LocalUnknown::new("another direction", components));
        all.extend(self.hides_impacts().then(unheard));
        all
    }

    fn variable_errors(&self) -> Vec<f64> {
        let [x, y] = self.place_errors_m();
        vec![0.0, 0.0, x, y]
    }

    fn response(
        &self,
        of: (usize, usize),
        runs: &[Run],
        shared: &[f64],
        _: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let effects = self.effects(shared);
        let of_run = |(run, amounts): (&Run, &Vec<f64>)| {
            let n = run.len();
            let mut out = vec![0.0; run.outputs.len() * n];
            let wrong = |reason: &str| PredictError { run: run.label.clone(), reason: reason.into() };
            let shown = self.shown(&run.label).ok_or_else(|| wrong("no such drop"))?;
            let white = shown.weights.white_change(shown.change(of, &effects, amounts));
            let white = white.ok_or_else(|| wrong("the covariance of its errors has no root"))?;
            let drop = &shown.weights.linear.drop;
            for row in 0..n {
                if let Some(known) = shown.rows.known(row) {
                    (0..super::drop::PER_IMPACT).for_each(|c| out[c * n + row] = white[drop.row(known, c)]);
                }
            }
            Ok(out)
        };
        runs.iter().zip(amounts).map(of_run).collect()
    }
}

impl LocalCauses for TimesModel {
    fn unknowns(&self) -> Vec<LocalUnknown> {
        // A misread time is an offset of what was measured.
        let mut all: Vec<LocalUnknown> = of_times().into_iter().take(MISREAD).collect();
        all.extend(self.hides_impacts().then(unheard));
        all
    }

    fn response(
        &self,
        (unknown, _): (usize, usize),
        runs: &[Run],
        shared: &[f64],
        nuisance: &[Vec<f64>],
        amounts: &[Vec<f64>],
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        const STEP: f64 = 1e-5;
        let of_run = |((run, nuisance), amounts): ((&Run, &Vec<f64>), &Vec<f64>)| {
            if unknown == FLIGHT {
                let late = amounts.iter().scan(0.0, |late, amount| {
                    let now = *late;
                    *late += amount;
                    Some(now)
                });
                return Ok(late.collect());
            }
            let failed = |reason| PredictError { run: run.label.clone(), reason };
            if unknown == UNHEARD_IN_TIMES {
                return self.later_by_unheard(run, shared, nuisance, amounts).map_err(failed);
            }
            let moved = |step: f64| {
                let springier: Vec<f64> = amounts.iter().map(|a| step * a).collect();
                let mut out = vec![0.0; run.len()];
                self.fill(run, shared, nuisance, &springier, &mut out).map_err(failed)?;
                Ok(out)
            };
            let (high, low) = (moved(STEP)?, moved(-STEP)?);
            Ok(high.iter().zip(&low).map(|(h, l)| (h - l) / (2.0 * STEP)).collect())
        };
        runs.iter().zip(nuisance).zip(amounts).map(of_run).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use missing_physics::model::{Model as _, Scope};

    use super::super::chance::tests::drop;
    use super::super::drop::Drop;
    use super::super::setup::Setup;
    use super::*;

    /// At its row an impact that went unheard does what the mechanism does to the whole drop, which hides no other; elsewhere nothing.
    #[test]
    fn an_impact_that_went_unheard_acts_at_its_row() {
        let setup = Setup {
            gravity_m_s2: 9.81,
            drag_unit: None,
            placed: false,
            dropped: false,
            released: false,
            listened: false,
            unheard: [1, 1],
            microphones: 0,
        };
        let model = TimesModel::new(setup, 0.8, None, true);
        // In the flight after the third impact that was heard.
        let hides = Drop { unheard: vec![0, 0, 0, 1, 0, 0], ..drop() };
        let run = TimesModel::run("1", &hides, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let shared = |unheard: f64| -> Vec<f64> {
            let shared = model.spec().parameters.iter().filter(|p| p.scope == Scope::Shared);
            shared.map(|p| if p.name == "unheard" { unheard } else { p.start }).collect()
        };
        let nuisance = vec![model.nuisance(2.2)];
        let times = |unheard: f64| {
            let mut out = vec![0.0; run.len()];
            model.predict(&run, &shared(unheard), &nuisance[0], &mut out).unwrap();
            out
        };
        let whole: Vec<f64> = times(1.0).iter().zip(times(0.0)).map(|(apart, one)| apart - one).collect();
        assert!(whole[..3].iter().all(|late| *late == 0.0) && whole[3..].iter().all(|late| *late > 0.1));
        let unknown =
            LocalCauses::unknowns(&model).iter().position(|unknown| unknown.at_single_rows).unwrap();
        for row in 0..run.len() {
            let mut amounts = vec![0.0; run.len()];
            amounts[row] = 1.0;
            let runs = std::slice::from_ref(&run);
            let late = model.response((unknown, 0), runs, &shared(0.0), &nuisance, &[amounts]).unwrap();
            let expected = if row == 2 { whole.clone() } else { vec![0.0; run.len()] };
            approx::assert_relative_eq!(late[0][..], expected[..], epsilon = 1e-12);
        }
    }
}
