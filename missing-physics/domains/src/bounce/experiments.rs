//! What could be dropped next.

use missing_physics::data::Run;
use missing_physics::model::Experiment;

use super::drop::Drop;
use super::model::BounceModel;
use super::times::TimesModel;

/// Drops of a proposed experiment, and impacts of each.
const REPEATS: usize = 10;
const IMPACTS: usize = 7;
/// Heights to drop from, m.
const HEIGHTS_M: [f64; 4] = [0.1, 0.3, 1.0, 2.0];

/// Drops from other heights, and drops that are thrown sideways.
pub(super) fn experiments(model: &mut BounceModel) -> Vec<Experiment> {
    let effects = *model.nominal();
    let (e, g, dropped) = (effects.restitution, effects.gravity_m_s2, model.setup().dropped);
    let mut list = Vec::new();
    let mut add = |name: &str, value: f64, words: String, height: f64, along: f64| {
        let runs: Option<Vec<Run>> = (0..REPEATS)
            .map(|k| {
                let turn = std::f64::consts::TAU * k as f64 / REPEATS as f64;
                let mut drop = nominal(e, g, height, [along * turn.cos(), along * turn.sin()]);
                // A ball that moves along the table did not fall from rest.
                drop.height_m = (dropped && along == 0.0).then_some(height);
                model.imagined(&format!("next {name} {value} {k}"), &drop, &numbers())
            })
            .collect();
        list.extend(runs.map(|runs| experiment(name, value, words, vec![vec![0.0]; runs.len()], runs)));
    };
    for height in HEIGHTS_M {
        add("drop_height_m", height, format!("drop it from {height} m"), height, 0.0);
    }
    for along in [0.3, 1.0] {
        let words = format!("let it bounce on with {along} m/s along the table, in all directions");
        add("speed_along_m_s", along, words, 0.5, along);
    }
    list
}

/// Drops from other heights.
pub(super) fn of_times(model: &TimesModel, restitution: f64, gravity_m_s2: f64) -> Vec<Experiment> {
    let of = |height: &f64| {
        let drop = nominal(restitution, gravity_m_s2, *height, [0.0; 2]);
        let runs: Vec<Run> =
            (0..REPEATS).map(|k| TimesModel::run(&format!("next {height} {k}"), &drop, &numbers())).collect();
        let leaves = 0.5 * gravity_m_s2 * drop.times_s[1];
        let nuisance = vec![model.nuisance(leaves); runs.len()];
        experiment("drop_height_m", *height, format!("drop it from {height} m"), nuisance, runs)
    };
    HEIGHTS_M.iter().map(of).collect()
}

fn numbers() -> Vec<f64> {
    (1..=IMPACTS).map(|i| i as f64).collect()
}

fn experiment(name: &str, value: f64, words: String, nuisance: Vec<Vec<f64>>, runs: Vec<Run>) -> Experiment {
    let words = format!("{words}, {REPEATS} times");
    Experiment { action: vec![(name.to_owned(), value)], words, runs, nuisance }
}

/// A drop as the baseline has it.
fn nominal(restitution: f64, gravity_m_s2: f64, height: f64, along: [f64; 2]) -> Drop {
    let e = restitution.clamp(0.05, 0.98);
    let mut up = e * (2.0 * gravity_m_s2 * height).sqrt();
    let (mut t, mut place) = (0.0, [0.0; 2]);
    let mut drop = Drop { unheard: vec![0; IMPACTS], known: vec![0; IMPACTS], ..Drop::default() };
    for _ in 0..IMPACTS {
        drop.times_s.push(t);
        drop.places_m.push(place);
        let duration = 2.0 * up / gravity_m_s2;
        t += duration;
        for (x, v) in place.iter_mut().zip(along) {
            *x += v * duration;
        }
        up *= e;
    }
    drop
}
