//! What could be rolled next.

use missing_physics::model::Experiment;

use super::model::DoughModel;
use super::rolls::{RunOfRolls, Step};

/// Runs of a proposed experiment.
const REPEATS: usize = 4;

/// The recording's first runs again: at once, after a wait, deeper, and shallower.
pub(super) fn experiments(model: &mut DoughModel, runs: &[RunOfRolls]) -> Vec<Experiment> {
    let latest = runs.iter().flat_map(|(_, s)| s).map(|s| s.t_s).fold(0.0, f64::max);
    let mut list = Vec::new();
    let mut add = |name: &str, value: f64, words: String, change: &dyn Fn(&mut Step)| {
        let again: Vec<RunOfRolls> = runs
            .iter()
            .cycle()
            .take(REPEATS)
            .enumerate()
            .map(|(k, (_, steps))| {
                let mut steps = steps.clone();
                let first = steps.first().map_or(0.0, |s| s.t_s);
                for step in &mut steps {
                    step.t_s += latest - first;
                    change(step);
                }
                (format!("next {name} {value} {k}"), steps)
            })
            .collect();
        let runs = model.add(&again);
        list.push(Experiment {
            action: vec![(name.to_owned(), value)],
            words: format!("{words}, {REPEATS} doughs"),
            nuisance: vec![Vec::new(); runs.len()],
            runs,
        });
    };
    if latest > 0.0 {
        for wait in [0.5 * latest, 2.0 * latest] {
            let words = format!("let the dough stand for {wait:.0} s, then roll it as before");
            add("wait_s", wait, words, &|s| s.t_s += wait);
        }
    }
    for factor in [0.5, 1.5] {
        let words = format!("roll it {factor} times as deep");
        add("depth_factor", factor, words, &|s| s.roll.action[1] *= factor);
    }
    let words = "roll a fresh dough twice as many times".to_owned();
    add("steps_factor", 2.0, words, &|s| s.step = 2.0 * s.step - 1.0);
    list
}
