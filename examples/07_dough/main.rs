//! Rolling dough to a length: the experiments of [Matl 2021], chapter 7, on a dough that is physics, our numbers beside its.
//!
//! `cargo run --release -p examples --example 07_dough` (`--small`: two goals, a rollout or two each; `--seed N`: other rollouts;
//! `--picture FILE.svg` draws)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod matching;
mod picture;
mod policies;
mod stiffness;

use dough_mbrl::dynamics::Dynamics;
use dough_mbrl::fake::{DoughKind, Effects};
use dough_mbrl::gaussian_process::GaussianProcess;
use dough_mbrl::mpc::{Mpc, MpcSettings};
use dough_mbrl::network::Ensemble;
use dough_mbrl::planner::powell::PowellPlanner;
use dough_mbrl::planner::{Chance, Objective, VarianceGrowth, changes_m};
use dough_mbrl::policy::Policy;
use dough_mbrl::predictor::{Predictor, Refit};
use dough_mbrl::ridge::Ridge;
use dough_mbrl::roll::Roll;
use dough_mbrl::rollout::{Rolled, RolloutError};
use examples::argument;
use examples::dough::{explore, rolls};

type Failure = Box<dyn std::error::Error>;

const INCH_M: f64 = 0.0254;
const NONE: Effects =
    Effects { drying_per_s: 0.0, slip_n: 0.0, springback: 0.0, sticking: 0.0, softening: 0.0 };
/// Chance that a roll of a plan may take of passing the goal.
const RISK: f64 = 0.01;

/// How much of it is done.
struct Size {
    explored: usize,
    /// Random rolls on each dough A and C: 150 and 100 in [Matl 2021].
    each: [usize; 2],
    /// Of the first rollout.
    seed: u64,
    /// Rolls at most of a rollout.
    most: usize,
    goals: Vec<f64>,
    six: u64,
    /// Rollouts of direct optimisation to each goal.
    twenty: u64,
    ten: u64,
    fifteen: u64,
}

/// A dough's dynamics as they were learned, and a chance constraint for plans with them.
struct Learned {
    model: Ridge,
    chance: Chance,
}

fn main() -> Result<(), Failure> {
    let seed = 1000 * argument("--seed").map_or(Ok(0), |s| s.parse::<u64>())?;
    let size = if examples::small() {
        let goals = vec![2.0, 4.0];
        Size { explored: 60, each: [30, 20], seed, most: 100, goals, six: 2, twenty: 2, ten: 1, fifteen: 1 }
    } else {
        let goals = vec![2.0, 4.0, 6.0, 8.0, 10.0];
        Size {
            explored: 600,
            each: [150, 100],
            seed,
            most: 400,
            goals,
            six: 6,
            twenty: 20,
            ten: 10,
            fifteen: 15,
        }
    };
    let of = |kind, each, seed| explore(kind, NONE, size.explored, each, seed);
    let a = of(DoughKind::A, size.each[0], 1)?;
    held_out(&rolls(&a), &rolls(&of(DoughKind::A, size.each[0], 3)?))?;
    let (a, c) = (learn("A", &a)?, learn("C", &of(DoughKind::C, size.each[1], 2)?)?);
    let bars = policies::figure_7_4(&size, &a)?;
    let stiffness = stiffness::table_7_1()?;
    let lines = matching::figure_7_5(&size, &a, &c, &stiffness)?;
    if let Some(file) = argument("--picture") {
        let goals: Vec<String> = size.goals.iter().map(|g| format!("{g} in")).collect();
        std::fs::write(&file, picture::draw(&bars, &goals, &lines))?;
        println!("\ndrawn: {file}");
    }
    Ok(())
}

/// Learns from all doughs; each dough's residuals are those of a model that was learned from the others.
fn learn(name: &str, doughs: &[Vec<Rolled>]) -> Result<Learned, Failure> {
    let model = |rolls: &[Roll]| Ridge::learn(rolls, 2, 1e-3);
    let mut changes = Vec::new();
    for (k, dough) in doughs.iter().enumerate() {
        let others = doughs.iter().enumerate().filter(|(i, _)| *i != k).flat_map(|(_, d)| d);
        let without = model(&others.map(|r| r.roll).collect::<Vec<_>>())?;
        changes.extend(dough.iter().map(|r| changes_m(&without, &r.roll)));
    }
    let growth = VarianceGrowth::fit(&changes)?;
    let ends = doughs.iter().filter_map(|d| d.last()).map(|r| format!("{:.0}", 1e3 * r.roll.next[0]));
    println!(
        "learned dough {name} from {} rolls of {} doughs (rolled to {} mm); sigma of a lengthening: {:.2} mm and {:.2} of what is predicted",
        changes.len(),
        doughs.len(),
        ends.collect::<Vec<_>>().join(", "),
        1e3 * growth.base_m,
        growth.growth
    );
    Ok(Learned { model: model(&rolls(doughs))?, chance: Chance::new(growth, RISK)? })
}

/// Direct optimisation (Powell).
fn direct<M: Refit + Clone + 'static>(
    dynamics: &M,
    objective: Objective,
    refit_every: Option<usize>,
) -> Result<Box<dyn Policy>, RolloutError> {
    let settings = MpcSettings { objective, refit_every, ..MpcSettings::default() };
    Ok(Box::new(Mpc::new(dynamics.clone(), PowellPlanner::default(), settings)?))
}

/// Dynamics compared on rolls that none of them has seen.
fn held_out(a: &[Roll], unseen: &[Roll]) -> Result<(), Failure> {
    println!(
        "one roll ahead on {} unseen rolls of dough A (root mean square error; 95 % intervals hold)",
        unseen.len()
    );
    println!("{:44} {:>9} {:>9} {:>9} {:>8}", "dynamics", "length mm", "width mm", "height mm", "held");
    let show = |name: &str, model: &dyn Predictor| {
        let (mut squares, mut held) = ([0.0; 3], 0);
        for roll in unseen {
            for (k, p) in model.predict(&roll.state, &roll.action).iter().enumerate() {
                squares[k] += (p.mean - roll.next[k]).powi(2);
                held += usize::from((p.mean - roll.next[k]).abs() < 1.96 * p.sigma);
            }
        }
        let n = unseen.len() as f64;
        let [l, w, h] = squares.map(|s| 1e3 * (s / n).sqrt());
        println!("{name:44} {l:>9.2} {w:>9.2} {h:>9.2} {:>6.1} %", 100.0 * held as f64 / (3.0 * n));
    };
    show("polynomial of degree 1", &Ridge::learn(a, 1, 1e-3)?);
    show("polynomial of degree 2, as [Matl 2021]", &Ridge::learn(a, 2, 1e-3)?);
    show("polynomial of degree 3, ridge 1", &Ridge::learn(a, 3, 1.0)?);
    show(
        "polynomial with remainder, doughs followed",
        &Dynamics::learn(&a.iter().map(|r| vec![*r]).collect::<Vec<_>>())?,
    );
    show("Gaussian process", &GaussianProcess::learn(a)?);
    show("five small networks", &Ensemble::learn(a, 4)?);
    Ok(())
}
