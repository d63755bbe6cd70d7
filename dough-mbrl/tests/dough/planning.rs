//! Dynamics against slow references, planners against their bounds and against known optima.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use argmin::core::{CostFunction, Error, Executor, State as _};
use dough_mbrl::gaussian_process::GaussianProcess;
use dough_mbrl::goal::Goal;
use dough_mbrl::matching::{Known, MatchError, Matched};
use dough_mbrl::mpc::{Mpc, MpcSettings};
use dough_mbrl::network::Ensemble;
use dough_mbrl::planner::cem::{Cem, CemSettings};
use dough_mbrl::planner::powell::PowellPlanner;
use dough_mbrl::planner::{Objective, Planner, Task};
use dough_mbrl::policy::{Explore, Heuristic, Policy};
use dough_mbrl::powell::Powell;
use dough_mbrl::predictor::{LearnError, PlanError, Prediction, Predictor, Refit};
use dough_mbrl::ridge::Ridge;
use dough_mbrl::roll::{Action, Limits, Roll, State};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A law that is no polynomial of the state; volume kept.
fn law(s: &State, a: &Action) -> State {
    let grown = 1.0 + 0.5 * a[0] * (a[1] / s[2]).powf(1.5) / (1.0 + 4.0 * s[0]);
    [s[0] * grown, s[1] / grown.sqrt(), s[2] / grown.sqrt()]
}

fn drawn(n: usize, sigma: f64, seed: u64) -> Vec<Roll> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n)
        .map(|_| {
            let l: f64 = rng.random_range(0.042..0.25);
            let w = (4.0 * 4e-5 / (std::f64::consts::PI * l)).sqrt();
            let state = [l, w * rng.random_range(0.95..1.1), w * rng.random_range(0.95..1.1)];
            let action = Limits::default().at(&state).place([rng.random(), rng.random()]);
            let next = law(&state, &action).map(|v| {
                let z: f64 = StandardNormal.sample(&mut rng);
                v + sigma * z
            });
            Roll { state, action, next }
        })
        .collect()
}

/// All monomials of five standardised inputs to degree 2, written out; weighted least squares by QR of the stacked system.
fn batch(rolls: &[(Roll, f64)], standard: &[Roll], ridge: f64, at: (&State, &Action)) -> State {
    let row = |r: &Roll| [r.state[0], r.state[1], r.state[2], r.action[0], r.action[1]];
    let n = standard.len() as f64;
    let mean: Vec<f64> = (0..5).map(|k| standard.iter().map(|r| row(r)[k]).sum::<f64>() / n).collect();
    let sd: Vec<f64> = (0..5)
        .map(|k| (standard.iter().map(|r| (row(r)[k] - mean[k]).powi(2)).sum::<f64>() / n).sqrt())
        .collect();
    let features = |x: [f64; 5]| {
        let z: Vec<f64> = (0..5).map(|k| (x[k] - mean[k]) / sd[k]).collect();
        let mut f = vec![1.0];
        f.extend(&z);
        (0..5).for_each(|i| (i..5).for_each(|j| f.push(z[i] * z[j])));
        f
    };
    let p = 21;
    let (m, mut a, mut b) =
        (rolls.len(), DMatrix::zeros(rolls.len() + p, p), DMatrix::zeros(rolls.len() + p, 3));
    for (i, (roll, weight)) in rolls.iter().enumerate() {
        for (k, f) in features(row(roll)).into_iter().enumerate() {
            a[(i, k)] = weight.sqrt() * f;
        }
        (0..3).for_each(|d| b[(i, d)] = weight.sqrt() * (roll.next[d] - roll.state[d]));
    }
    (1..p).for_each(|k| a[(m + k, k)] = ridge.sqrt());
    let qr = a.qr();
    let solution = qr.r().solve_upper_triangular(&(qr.q().transpose() * b)).unwrap();
    let f = DVector::from_vec(features([at.0[0], at.0[1], at.0[2], at.1[0], at.1[1]]));
    std::array::from_fn(|d| at.0[d] + solution.column(d).dot(&f))
}

#[test]
fn refits_equal_the_batch_fit() {
    let (old, new) = (drawn(120, 3e-4, 1), drawn(37, 3e-4, 2));
    let mut ridge = Ridge::learn(&old, 2, 0.1).unwrap();
    let mut all: Vec<(Roll, f64)> = old.iter().map(|r| (*r, 1.0)).collect();
    for (i, roll) in new.iter().enumerate() {
        ridge.add(roll, 10.0).unwrap();
        all.push((*roll, 10.0));
        if i % 5 == 1 {
            ridge.refit().unwrap();
        }
    }
    ridge.refit().unwrap();
    for roll in drawn(30, 0.0, 3) {
        let (fast, slow) =
            (ridge.next(&roll.state, &roll.action), batch(&all, &old, 0.1, (&roll.state, &roll.action)));
        for k in 0..3 {
            approx::assert_abs_diff_eq!(fast[k], slow[k], epsilon = 1e-10);
            approx::assert_abs_diff_eq!(
                ridge.predict(&roll.state, &roll.action)[k].mean,
                fast[k],
                epsilon = 1e-14
            );
        }
    }
}

#[test]
fn ten_copies_and_a_weight_of_ten_predict_alike_but_copies_claim_more() {
    let (old, new) = (drawn(60, 5e-4, 4), drawn(60, 5e-4, 5));
    let (mut weighted, mut copied) =
        (Ridge::learn(&old, 2, 0.0).unwrap(), Ridge::learn(&old, 2, 0.0).unwrap());
    for roll in &new {
        weighted.add(roll, 10.0).unwrap();
        (0..10).for_each(|_| copied.add(roll, 1.0).unwrap());
    }
    weighted.refit().unwrap();
    copied.refit().unwrap();
    let (state, action) = (new[0].state, new[0].action);
    let (w, c) = (weighted.predict(&state, &action), copied.predict(&state, &action));
    approx::assert_abs_diff_eq!(w[0].mean, c[0].mean, epsilon = 1e-10);
    assert!(w[0].sigma > 1.02 * c[0].sigma, "{} and {}", w[0].sigma, c[0].sigma);
}

#[test]
fn every_peer_learns_the_law_and_holds_its_intervals() {
    let (rolls, unseen) = (drawn(400, 4e-4, 6), drawn(400, 4e-4, 7));
    let peers: [(&str, Box<dyn Predictor>, f64); 4] = [
        ("degree 2", Box::new(Ridge::learn(&rolls, 2, 1e-3).unwrap()), 1.6),
        ("degree 4", Box::new(Ridge::learn(&rolls, 4, 1.0).unwrap()), 1.4),
        ("process", Box::new(GaussianProcess::learn(&rolls).unwrap()), 1.3),
        ("networks", Box::new(Ensemble::learn(&rolls, 1).unwrap()), 1.6),
    ];
    for (name, peer, most) in peers {
        let (mut square, mut held) = (0.0, 0);
        for roll in &unseen {
            for (k, p) in peer.predict(&roll.state, &roll.action).iter().enumerate() {
                square += (p.mean - roll.next[k]).powi(2) / 1200.0;
                held += usize::from((p.mean - roll.next[k]).abs() < 1.96 * p.sigma);
            }
        }
        let (off, held) = (square.sqrt() / 4e-4, held as f64 / 1200.0);
        println!("{name}: {off:.2} sigma off, {held:.3} held");
        assert!(off < most, "{name}: off by {off} sigma");
        assert!((0.92..0.985).contains(&held), "{name}: {held} of the 95 % intervals hold");
    }
}

#[test]
fn nothing_is_learned_from_too_little_or_from_no_numbers() {
    let rolls = drawn(60, 1e-4, 8);
    let few = LearnError::TooFew { rolls: 20, coefficients: 21, least: 21 };
    assert_eq!(Ridge::learn(&rolls[..20], 2, 0.0).unwrap_err(), few);
    assert!(matches!(GaussianProcess::learn(&rolls[..3]), Err(LearnError::TooFew { .. })));
    assert!(matches!(Ensemble::learn(&[], 1), Err(LearnError::TooFew { .. })));
    let mut bad = rolls.clone();
    bad[7].next[1] = f64::NAN;
    assert!(
        Ridge::learn(&bad, 2, 0.0).is_err()
            && GaussianProcess::learn(&bad).is_err()
            && Ensemble::learn(&bad, 1).is_err()
    );
    assert!(Ridge::learn(&vec![rolls[0]; 60], 2, 0.0).is_err(), "one roll, sixty times");
    assert!(Ridge::learn(&rolls, 200, 0.0).is_err());
    let mut ridge = Ridge::learn(&rolls, 2, 0.0).unwrap();
    let before = ridge.next(&rolls[0].state, &rolls[0].action);
    assert!(ridge.add(&bad[7], 1.0).is_err() && ridge.add(&rolls[0], f64::INFINITY).is_err());
    ridge.refit().unwrap();
    assert_eq!(before, ridge.next(&rolls[0].state, &rolls[0].action));
}

/// A predictor with a given law.
#[derive(Clone)]
struct Given(fn(&State, &Action) -> State);

impl Predictor for Given {
    fn next(&self, state: &State, action: &Action) -> State {
        self.0(state, action)
    }

    fn predict(&self, state: &State, action: &Action) -> [Prediction; 3] {
        self.0(state, action).map(|mean| Prediction { mean, sigma: 0.1 * action[1] })
    }
}

fn task(dynamics: &dyn Predictor, caution: f64) -> Task<'_> {
    let goal = Goal::cylinder(0.15, 4e-5).unwrap();
    let objective = Objective { caution, ..Objective::default() };
    Task { dynamics, state: [0.05, 0.034, 0.032], goal, limits: Limits::default(), objective }
}

#[test]
fn matching_interpolates_between_the_neighbours() {
    let known = [
        Known { stiffness_n_m: 500.0, dynamics: Given(|s, _| s.map(|v| v + 0.001)) },
        Known { stiffness_n_m: 1500.0, dynamics: Given(|s, _| s.map(|v| v + 0.003)) },
        Known { stiffness_n_m: 1000.0, dynamics: Given(|s, _| s.map(|v| v + 0.010)) },
    ];
    let at = |k: f64| Matched::new(&known, k).unwrap().next(&[0.1; 3], &[0.1; 2])[0] - 0.1;
    for (stiffness, change) in
        [(500.0, 0.001), (750.0, 0.0055), (1000.0, 0.010), (1250.0, 0.0065), (9000.0, 0.003), (1.0, 0.001)]
    {
        approx::assert_abs_diff_eq!(at(stiffness), change, epsilon = 1e-12);
    }
    assert!(matches!(Matched::new(&known[..1], 700.0), Err(MatchError::TooFew { known: 1 })));
    assert!(matches!(Matched::new(&known, f64::NAN), Err(MatchError::Stiffness { .. })));
    assert!(matches!(
        Matched::new(&[known[0].clone(), known[0].clone()], 5.0),
        Err(MatchError::Stiffness { .. })
    ));
}

/// Rosenbrock's valley, and a bowl whose middle lies outside.
struct Valley;
struct Bowl;

impl CostFunction for Valley {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        assert!(x.iter().all(|v| (-2.0..=2.0).contains(v)), "asked outside the box: {x:?}");
        Ok((1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2))
    }
}

impl CostFunction for Bowl {
    type Param = Vec<f64>;
    type Output = f64;
    fn cost(&self, x: &Vec<f64>) -> Result<f64, Error> {
        assert!(x.iter().all(|v| (0.0..=1.0).contains(v)), "asked outside the box: {x:?}");
        Ok((x[0] - 2.0).powi(2) + (x[0] - 2.0) * (x[1] - 0.3) + (x[1] - 0.3).powi(2) + (x[2] - 0.25).powi(2))
    }
}

#[test]
fn powell_finds_known_minima_and_stays_in_its_box() {
    let powell = Powell::new(vec![-2.0; 2], vec![2.0; 2], 1e-12).unwrap().with_lines(60, 1e-8);
    let run = Executor::new(Valley, powell)
        .configure(|s| s.param(vec![-1.2, 1.0]).max_iters(400))
        .ctrlc(false)
        .run();
    let best = run.unwrap().state().get_best_param().unwrap().clone();
    assert!((best[0] - 1.0).abs() < 1e-4 && (best[1] - 1.0).abs() < 1e-4, "{best:?}");
    // On the face x0 = 1 the bowl's least x1 is 0.3 + 1/2.
    let powell = Powell::new(vec![0.0; 3], vec![1.0; 3], 1e-12).unwrap();
    let run =
        Executor::new(Bowl, powell).configure(|s| s.param(vec![0.1; 3]).max_iters(50)).ctrlc(false).run();
    let best = run.unwrap().state().get_best_param().unwrap().clone();
    assert!(
        (best[0] - 1.0).abs() < 1e-9 && (best[1] - 0.8).abs() < 0.01 && (best[2] - 0.25).abs() < 0.01,
        "{best:?}"
    );
    assert!(
        Powell::new(vec![0.0], vec![0.0], 1e-3).is_err() && Powell::new(vec![0.0], vec![], 1e-3).is_err()
    );
}

#[test]
fn plans_are_better_than_chance_and_repeat_with_the_seed() {
    let dynamics = Given(law);
    let task = task(&dynamics, 0.0);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut chance: Vec<f64> =
        (0..2000).map(|_| task.cost(&(0..20).map(|_| rng.random()).collect::<Vec<f64>>())).collect();
    chance.sort_by(f64::total_cmp);
    let planned = |planner: &mut dyn Planner, seed| {
        let mut plan = Vec::new();
        let cost = planner.plan(&task, &mut plan, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
        approx::assert_relative_eq!(cost, task.cost(&plan), max_relative = 1e-12);
        (cost, plan)
    };
    let cem = planned(&mut Cem::default(), 5);
    let powell = planned(&mut PowellPlanner::default(), 5);
    assert!(cem.0 < chance[100], "CEM {} of {}", cem.0, chance[100]);
    // Growth rises with throw and depth alike: the best plan is the upper corner throughout.
    let corner = task.cost(&[1.0; 20]);
    assert!(powell.0 <= 1.001 * corner && powell.0 < chance[0], "Powell {} of {corner}", powell.0);
    assert_eq!(cem, planned(&mut Cem::default(), 5));
}

#[test]
fn caution_keeps_away_from_what_is_unsure() {
    let dynamics = Given(law);
    let depth = |caution| {
        let task = task(&dynamics, caution);
        let mut plan = Vec::new();
        PowellPlanner::default().plan(&task, &mut plan, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        task.first(&plan)[1]
    };
    assert!(depth(20.0) < 0.5 * depth(0.0), "{} of {}", depth(20.0), depth(0.0));
}

/// A dough 20 mm short of its goal, and dynamics that may do more than they say: no roll shortens what became too long.
#[test]
fn plans_leave_room_for_what_a_roll_may_do_beyond_its_prediction() {
    let eager = Given(|s, a| {
        let grown = 1.0 + 10.0 * a[1];
        [s[0] * grown, s[1] / grown.sqrt(), s[2] / grown.sqrt()]
    });
    // There in one roll, or in two gentle ones.
    let cost = |too_long: f64, rolls: [f64; 2]| {
        let mut task = task(&eager, 0.0);
        task.state = [0.13, 0.02, 0.02];
        task.objective.too_long = too_long;
        let mut plan = vec![0.5; 20];
        (plan[1], plan[3]) = (rolls[0], rolls[1]);
        task.cost(&plan)
    };
    let (bold, gentle) = ([0.69, 0.5], [0.2, 0.0]);
    assert!(cost(0.0, bold) < cost(0.0, gentle));
    assert!(cost(5.0, gentle) < 0.5 * cost(5.0, bold), "{} of {}", cost(5.0, gentle), cost(5.0, bold));
    // What is predicted to shorten stays as long as it is.
    let shrinks = Given(|s, _| [0.9 * s[0], s[1], s[2]]);
    let still = Given(|s, _| *s);
    let cost = |dynamics: &Given| task(dynamics, 0.0).cost(&[0.5; 20]);
    assert_eq!(cost(&shrinks), cost(&still));
}

#[test]
fn what_cannot_be_planned_is_said() {
    let (good, bad) = (Given(law), Given(|_, _| [f64::NAN; 3]));
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut plan = vec![0.3; 4];
    let refused = Cem::default().plan(&task(&bad, 0.0), &mut plan, &mut rng);
    assert!(matches!(refused, Err(PlanError::Prediction { .. })));
    let mut strange = task(&good, 0.0);
    strange.state[2] = f64::NAN;
    assert!(matches!(
        PowellPlanner::default().plan(&strange, &mut plan, &mut rng),
        Err(PlanError::State { .. })
    ));
    let mut blind = task(&good, 0.0);
    blind.objective.horizon = 0;
    assert!(matches!(
        Cem::default().plan(&blind, &mut plan, &mut rng),
        Err(PlanError::Setting { name: "horizon", .. })
    ));
    assert_eq!(plan, [0.3; 4], "a plan that failed is as it was");
    assert!(Cem::new(CemSettings { elite: 101, ..CemSettings::default() }).is_err());
    let goal = Goal::cylinder(0.15, 4e-5).unwrap();
    assert!(Explore.act(&[0.1, -0.1, 0.1], &goal, &Limits::default(), &mut rng).is_err());
    let ridge = Ridge::learn(&drawn(100, 1e-4, 1), 2, 1e-3).unwrap();
    let settings = MpcSettings { reach_m: 0.02, ..MpcSettings::default() };
    let mut mpc = Mpc::new(ridge, PowellPlanner::default(), settings).unwrap();
    let far = mpc.act(&[0.4, 0.011, 0.011], &goal, &Limits::default(), &mut rng);
    let Err(PlanError::Outside { distance_m, .. }) = far else { panic!("{far:?}") };
    assert!((0.14..0.17).contains(&distance_m), "{distance_m}");
    assert!(
        mpc.act(&[0.1, 0.023, 0.023], &goal, &Limits::default(), &mut rng).is_ok() && mpc.distance_m() < 0.02
    );
}

#[test]
fn refits_turn_a_wrong_model_right() {
    let wrong: Vec<Roll> = drawn(200, 1e-4, 1)
        .iter()
        .map(|r| Roll { next: std::array::from_fn(|k| r.state[k] + 0.3 * (r.next[k] - r.state[k])), ..*r })
        .collect();
    let mut ridge = Ridge::learn(&wrong, 2, 1e-3).unwrap();
    let off = |ridge: &Ridge| {
        let unseen = drawn(50, 0.0, 3);
        let off = unseen.iter().map(|r| (ridge.next(&r.state, &r.action)[0] - r.next[0]).powi(2));
        off.sum::<f64>().sqrt()
    };
    let before = off(&ridge);
    drawn(100, 1e-4, 2).iter().for_each(|r| ridge.add(r, 10.0).unwrap());
    assert_eq!(before, off(&ridge), "nothing changes before the refit");
    ridge.refit().unwrap();
    assert!(off(&ridge) < 0.35 * before, "{} of {before}", off(&ridge));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn no_policy_leaves_the_bounds(
        l in 0.01..0.5_f64, w in 0.001..0.2_f64, h in 0.001..0.2_f64, seed in 0_u64..1000, bend in -3.0..3.0_f64,
    ) {
        let (state, limits) = ([l, w, h], Limits::default());
        let bounds = limits.at(&state);
        let goal = Goal::cylinder(0.2, 4e-5).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut rolls = drawn(60, 1e-4, seed);
        // Dynamics that are bent out of all proportion.
        rolls.iter_mut().for_each(|r| r.next[0] += bend * r.action[0] * r.action[1]);
        let ridge = Ridge::learn(&rolls, 2, 1e-3).unwrap();
        let mut policies: Vec<Box<dyn Policy>> = vec![
            Box::new(Explore),
            Box::new(Heuristic::default()),
            Box::new(Mpc::new(ridge.clone(), Cem::default(), MpcSettings::default()).unwrap()),
            Box::new(Mpc::new(ridge, PowellPlanner::default(), MpcSettings::default()).unwrap()),
        ];
        for policy in &mut policies {
            let action = policy.act(&state, &goal, &limits, &mut rng).unwrap();
            prop_assert!(bounds.contain(&action), "{action:?} outside {bounds:?}");
        }
    }
}
