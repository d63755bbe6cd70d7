//! Rolling dough to a length: the experiments of [Matl 2021], chapter 7, on a dough that is physics, our numbers beside its.
//!
//! `cargo run --release -p examples --example 07_dough` (`--small`: two goals, two rollouts each; `--seed N`: other rollouts;
//! `--picture FILE.svg` draws)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use dough_mbrl::dough::DoughError;
use dough_mbrl::dynamics::Dynamics;
use dough_mbrl::fake::{DoughKind, Effects, FakeRig};
use dough_mbrl::gaussian_process::GaussianProcess;
use dough_mbrl::goal::Goal;
use dough_mbrl::handling::RigError;
use dough_mbrl::matching::{Known, Matched};
use dough_mbrl::mpc::{Mpc, MpcSettings};
use dough_mbrl::network::Ensemble;
use dough_mbrl::planner::Objective;
use dough_mbrl::planner::cem::Cem;
use dough_mbrl::planner::powell::PowellPlanner;
use dough_mbrl::policy::{Explore, Heuristic, Policy};
use dough_mbrl::predictor::{PlanError, Predictor, Refit};
use dough_mbrl::ridge::Ridge;
use dough_mbrl::roll::{Action, Limits, Roll, State};
use dough_mbrl::rollout::{Rollout, RolloutError, Setup};
use dough_mbrl::stiffness::{BandForce, Palpation, Press};
use examples::bars::Bars;
use examples::dough::{Make, counts, explore, mean_and_half, rollouts, rolls};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Failure = Box<dyn std::error::Error>;

const INCH_M: f64 = 0.0254;
const NONE: Effects =
    Effects { drying_per_s: 0.0, slip_n: 0.0, springback: 0.0, sticking: 0.0, softening: 0.0 };

/// Random rolls on each dough C: the model of it in [Matl 2021] was learned from data that were "very sparse" where it is long. Those on
/// dough A go on until it is 26 cm long.
const EACH_C: usize = 25;

/// How much of it is done.
struct Size {
    explored: usize,
    /// Of the first rollout.
    seed: u64,
    goals: Vec<f64>,
    six: u64,
    ten: u64,
    fifteen: u64,
}

fn main() -> Result<(), Failure> {
    let told = |what: &str| std::env::args().skip_while(|a| a != what).nth(1);
    let seed = 1000 * told("--seed").map_or(Ok(0), |s| s.parse::<u64>())?;
    let size = if examples::small() {
        Size { explored: 150, seed, goals: vec![4.0, 8.0], six: 2, ten: 2, fifteen: 2 }
    } else {
        Size { explored: 600, seed, goals: vec![2.0, 4.0, 6.0, 8.0, 10.0], six: 6, ten: 10, fifteen: 15 }
    };
    let of = |kind, each, seed| Ok::<_, Failure>(rolls(&explore(kind, NONE, size.explored, each, seed)?));
    let (a, unseen) = (of(DoughKind::A, usize::MAX, 1)?, of(DoughKind::A, usize::MAX, 3)?);
    let [c, long_c] = [of(DoughKind::C, EACH_C, 2)?, of(DoughKind::C, usize::MAX, 2)?];
    held_out(&a, &unseen)?;
    let learn = |rolls: &[Roll]| Ridge::learn(rolls, 2, 1e-3);
    let (model_a, model_c, long_c) = (learn(&a)?, learn(&c)?, learn(&long_c)?);
    let bars = figure_7_4(&size, &a, &model_a)?;
    let stiffness = table_7_1()?;
    let lines = figure_7_5(&size, &model_a, [&model_c, &long_c], &stiffness)?;
    if let Some(file) = told("--picture") {
        let goals: Vec<String> = size.goals.iter().map(|g| format!("{g} in")).collect();
        std::fs::write(&file, picture::draw(&bars, &goals, &lines))?;
        println!("\ndrawn: {file}");
    }
    Ok(())
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

fn controller<M: Refit + Clone + 'static>(
    dynamics: &M,
    horizon: usize,
    refit_every: Option<usize>,
    caution: f64,
) -> Result<Box<dyn Policy>, RolloutError> {
    let objective = Objective { horizon, caution, ..Objective::default() };
    let settings = MpcSettings { objective, refit_every, ..MpcSettings::default() };
    Ok(Box::new(Mpc::new(dynamics.clone(), PowellPlanner::default(), settings)?))
}

/// Rolls to the goal: policies by goals.
fn figure_7_4(size: &Size, a: &[Roll], model: &Ridge) -> Result<Vec<Bars>, Failure> {
    let process = GaussianProcess::learn(a)?;
    let policies: [(&str, Make<'_>); 6] = [
        ("random", &|_| Ok(Box::new(Explore))),
        ("heuristic", &|_| Ok(Box::new(Heuristic::default()))),
        ("CEM", &|_| Ok(Box::new(Mpc::new(model.clone(), Cem::default(), MpcSettings::default())?))),
        ("direct (Powell)", &|_| controller(model, 10, Some(10), 0.0)),
        ("direct, cautious", &|_| controller(model, 10, Some(10), 1.0)),
        ("direct, Gaussian process", &|_| controller(&process, 4, Some(10), 0.0)),
    ];
    println!(
        "\nfigure 7.4: rolls to the goal, dough A, {} rollouts each, mean +- half the 95 % interval",
        size.six
    );
    print!("{:26}", "policy");
    size.goals.iter().for_each(|g| print!("{:>16}", format!("{g} in")));
    println!("{:>10}", "missed");
    let mut all = Vec::new();
    for (name, make) in policies {
        let (mut bars, mut missed) = (Bars { name: name.into(), values: Vec::new() }, 0);
        print!("{name:26}");
        for goal in &size.goals {
            let done = rollouts(
                DoughKind::A,
                NONE,
                goal * INCH_M,
                size.seed + 100..size.seed + 100 + size.six,
                make,
            )?;
            let (rolls, off) = counts(&done);
            let (mean, half) = mean_and_half(&rolls);
            print!("{:>16}", format!("{mean:.1} +- {half:.1}"));
            bars.values.push((mean, half));
            missed += off;
        }
        println!("{missed:>10}");
        all.push(bars);
    }
    let least =
        size.goals.iter().map(|goal| least_rolls(goal * INCH_M, size)).collect::<Result<Vec<_>, _>>()?;
    print!("{:26}", "strongest, goal or not");
    least.iter().for_each(|n| print!("{:>16}", format!("{n:.1}")));
    println!();
    let fewer = |than: usize, what: &[(f64, f64)]| {
        let pairs = all[than].values.iter().zip(what);
        let parts: Vec<f64> = pairs.map(|(a, b)| 100.0 * (1.0 - b.0 / a.0)).collect();
        let (mean, _) = mean_and_half(&parts);
        let spread =
            parts.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (parts.len() as f64 - 1.0).max(1.0);
        format!("{mean:.1} +- {:.1} %", spread.sqrt())
    };
    println!("fewer rolls (mean over the goals +- their standard deviation)        here      [Matl 2021]");
    println!("  heuristic than random              {:>38}  27.6 +- 6.1 %", fewer(0, &all[1].values));
    println!("  CEM than heuristic                 {:>38}    33.4 +- 18 %", fewer(1, &all[2].values));
    println!("  direct optimisation than heuristic {:>38}  63.1 +- 18.3 %", fewer(1, &all[3].values));
    println!("  direct, cautious, than heuristic   {:>38}", fewer(1, &all[4].values));
    println!("  direct, Gaussian process, than heur. {:>36}", fewer(1, &all[5].values));
    let least: Vec<(f64, f64)> = least.into_iter().map(|n| (n, 0.0)).collect();
    println!("  strongest rolls, goal passed or not {:>37}", fewer(1, &least));
    Ok(all)
}

/// Rolls as strong as is allowed.
struct Strongest;

impl Policy for Strongest {
    fn act(
        &mut self,
        state: &State,
        _: &Goal,
        limits: &Limits,
        _: &mut dyn Rng,
    ) -> Result<Action, PlanError> {
        Ok(limits.at(state).high)
    }
}

/// Mean number of strongest rolls after which a dough is no shorter than a goal's tolerance allows.
fn least_rolls(length_m: f64, size: &Size) -> Result<f64, Failure> {
    let goal = Goal::cylinder(length_m, DoughKind::A.volume_m3)?;
    let mut made = 0;
    for seed in size.seed + 100..size.seed + 100 + size.six {
        let mut rig = FakeRig::new(DoughKind::A, NONE, seed);
        let setup = Setup::of(rig.camera_in_world());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut short = true;
        while short {
            short = match setup.step(&mut rig, &mut Strongest, &goal, &mut rng) {
                Ok((_, after)) => after.length_m < length_m - goal.within_m,
                Err(RolloutError::Rig(RigError::Dough(DoughError::CutOff { .. }))) => false,
                Err(error) => return Err(error.into()),
            };
            made += 1;
        }
    }
    Ok(f64::from(made) / size.six as f64)
}

/// The band's force from a rigid probe of 30 mm, then palpation of three doughs.
fn table_7_1() -> Result<[f64; 3], Failure> {
    let mut rig = FakeRig::new(DoughKind::A, NONE, 1).with_rigid_probe(0.03);
    let setup = Setup::of(rig.camera_in_world());
    let mut presses = Vec::new();
    for throw_mm in (40..=120).step_by(10) {
        for depth_mm in (2..=30).step_by(4) {
            let (throw_m, depth_m) = (1e-3 * f64::from(throw_mm), 1e-3 * f64::from(depth_mm));
            setup.handling.stretch(&mut rig, throw_m)?;
            setup.handling.go(&mut rig, [0.4, 0.0, 0.03 - depth_m], 0.1)?;
            presses.push(Press { throw_m, depth_m, force_n: rig.probe_force_n() });
            setup.handling.go(&mut rig, [0.4, 0.0, 0.1], 0.3)?;
        }
    }
    let band = BandForce::fit(&presses)?;
    println!(
        "\ntable 7.1: stiffness by palpation, N/mm (band's force fitted to {:.0} mN)",
        1e3 * band.sigma_n
    );
    let mut found = [0.0; 3];
    for (k, (name, kind, table)) in
        [("A", DoughKind::A, 0.49), ("B", DoughKind::B, 0.85), ("C", DoughKind::C, 1.23)]
            .into_iter()
            .enumerate()
    {
        let felt: Result<Vec<f64>, _> = (10..16)
            .map(|seed| {
                let mut rig = FakeRig::new(kind, NONE, seed);
                Palpation::default().run(&mut rig, &setup, &band).map(|p| p.stiffness_n_m)
            })
            .collect();
        let (mean, half) = mean_and_half(&felt?);
        println!("  dough {name}: {:.2} +- {:.2} ([Matl 2021] {table})", 1e-3 * mean, 1e-3 * half);
        found[k] = mean;
    }
    Ok(found)
}

/// Wrong, refined and matched models.
fn figure_7_5(
    size: &Size,
    a: &Ridge,
    [c, long_c]: [&Ridge; 2],
    stiffness: &[f64; 3],
) -> Result<Vec<picture::Lines>, Failure> {
    let known = [(stiffness[0], a), (stiffness[2], c)]
        .map(|(stiffness_n_m, dynamics)| Known { stiffness_n_m, dynamics: dynamics.clone() });
    let matched = [0, 1, 2].map(|k| Matched::new(&known, stiffness[k]));
    let [matched_a, matched_b, matched_c] = matched;
    let (matched_a, matched_b, matched_c) = (matched_a?, matched_b?, matched_c?);
    let show = |name: &str, done: &[Rollout]| {
        let (rolls, off) = counts(done);
        let (mean, half) = mean_and_half(&rolls);
        let rolls = if rolls.is_empty() { "-".into() } else { format!("{mean:.1} +- {half:.1}") };
        let missed = if off > 0 { format!("  ({off} missed)") } else { String::new() };
        println!("  {name:44} {rolls:>14}{missed}");
        mean
    };
    let run = |kind, inches: f64, seeds, make: Make<'_>| rollouts(kind, NONE, inches * INCH_M, seeds, make);
    let n = size.seed + 200..size.seed + 200 + size.fifteen;
    println!("\nfigure 7.5 a: wrong model, fixed or refined every 5 rolls; H = 5, {} rollouts", size.fifteen);
    let fixed_a = run(DoughKind::A, 6.0, n.clone(), &|_| controller(c, 5, None, 0.0))?;
    let refined_a = run(DoughKind::A, 6.0, n.clone(), &|_| controller(c, 5, Some(5), 0.0))?;
    let fixed_c = run(DoughKind::C, 4.0, n.clone(), &|_| controller(a, 5, None, 0.0))?;
    let refined_c = run(DoughKind::C, 4.0, n.clone(), &|_| controller(a, 5, Some(5), 0.0))?;
    let gain = |before: f64, after: f64| 100.0 * (1.0 - after / before);
    let at_a = gain(
        show("dough A to 6 in, model C, fixed", &fixed_a),
        show("dough A to 6 in, model C, refined", &refined_a),
    );
    let at_c = gain(
        show("dough C to 4 in, model A, fixed", &fixed_c),
        show("dough C to 4 in, model A, refined", &refined_c),
    );
    println!("  refined: {} fewer rolls on average ([Matl 2021]: 45.8 %)", average(&[at_a, at_c]));
    println!("  were model C learned from doughs of up to 26 cm too:");
    show(
        "dough A to 6 in, model C, fixed",
        &run(DoughKind::A, 6.0, n.clone(), &|_| controller(long_c, 5, None, 0.0))?,
    );
    show(
        "dough A to 6 in, model C, refined",
        &run(DoughKind::A, 6.0, n, &|_| controller(long_c, 5, Some(5), 0.0))?,
    );
    println!("figure 7.5 b: wrong model or matched by stiffness, both refined, {} rollouts", size.ten);
    let n = size.seed + 300..size.seed + 300 + size.ten;
    let mut gains = Vec::new();
    let wrong_b: Make<'_> = &|seed| controller(if seed % 2 == 0 { a } else { c }, 5, Some(5), 0.0);
    let wrong_a: Make<'_> = &|_| controller(c, 5, Some(5), 0.0);
    let wrong_c: Make<'_> = &|_| controller(a, 5, Some(5), 0.0);
    let mut lines = Vec::new();
    for (name, kind, inches, wrong, right) in [
        ("A", DoughKind::A, 6.0, wrong_a, &matched_a),
        ("B", DoughKind::B, 5.0, wrong_b, &matched_b),
        ("C", DoughKind::C, 4.0, wrong_c, &matched_c),
    ] {
        let right: Make<'_> = &|_| controller(right, 5, Some(5), 0.0);
        let (with_wrong, with_right) =
            (run(kind, inches, n.clone(), wrong)?, run(kind, inches, n.clone(), right)?);
        let before = show(&format!("dough {name} to {inches} in, wrong model"), &with_wrong);
        gains.push(gain(before, show(&format!("dough {name} to {inches} in, matched"), &with_right)));
        if kind == DoughKind::A {
            lines.push(picture::Lines::of("stiffness-matched", &with_right));
        }
    }
    println!("  matched: {} fewer rolls on average ([Matl 2021]: 39.6 %)", average(&gains));
    lines.insert(0, picture::Lines::of("wrong, refined", &refined_a));
    lines.insert(0, picture::Lines::of("wrong, fixed", &fixed_a));
    println!("figure 7.6: actions over the progress of dough A (throw / depth, mm, by fifths of a rollout)");
    for line in &lines {
        print!("  {:20}", line.name);
        line.values.iter().for_each(|[t, d]| print!("{:>14}", format!("{t:.0} / {d:.1}")));
        println!();
    }
    Ok(lines)
}

/// The mean of the gains that are known: where all rollouts missed the goal there is none.
fn average(gains: &[f64]) -> String {
    let known: Vec<f64> = gains.iter().copied().filter(|g| g.is_finite()).collect();
    let of = if known.len() < gains.len() {
        format!(" ({} of {} doughs)", known.len(), gains.len())
    } else {
        String::new()
    };
    format!("{:.1} %{of}", mean_and_half(&known).0)
}

/// Bars and lines as SVG.
mod picture {
    use std::fmt::Write as _;

    use dough_mbrl::rollout::Rollout;
    use examples::bars::{self, Bars, COLOURS, Stand};

    /// Mean throw and depth (mm) by fifths of the progress.
    pub(super) struct Lines {
        pub(super) name: String,
        pub(super) values: Vec<[f64; 2]>,
    }

    impl Lines {
        pub(super) fn of(name: &str, rollouts: &[Rollout]) -> Self {
            let mut sums = [[0.0; 3]; 5];
            for rollout in rollouts {
                for (i, rolled) in rollout.rolls.iter().enumerate() {
                    let sum = &mut sums[5 * i / rollout.rolls.len()];
                    sum[0] += 1e3 * rolled.roll.action[0];
                    sum[1] += 1e3 * rolled.roll.action[1];
                    sum[2] += 1.0;
                }
            }
            Self { name: name.into(), values: sums.iter().map(|s| [s[0] / s[2], s[1] / s[2]]).collect() }
        }
    }

    pub(super) fn draw(rows: &[Bars], goals: &[String], lines: &[Lines]) -> String {
        let mut svg = String::from(
            "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 760 640' font-family='sans-serif' font-size='12'><rect width='760' height='640' fill='white'/><text x='50' y='20'>rolls to the goal (figure 7.4), goals from left to right</text>",
        );
        let stand = Stand { left: 50.0, bottom: 280.0, height: 230.0, step: [135.0, 18.0], legend: 40.0 };
        bars::draw(&mut svg, rows, goals, &stand);
        for (k, title, most) in [(0, "throw, mm (figure 7.6)", 120.0), (1, "depth, mm", 45.0)] {
            let left = 50.0 + 350.0 * f64::from(k);
            let _ = write!(
                svg,
                "<text x='{left}' y='320'>{title}</text><path d='M{left} 330V560H{:.0}' fill='none' stroke='black'/><text x='{left}' y='576'>progress</text>",
                left + 300.0
            );
            for (n, line) in lines.iter().enumerate() {
                let points: Vec<String> = line
                    .values
                    .iter()
                    .enumerate()
                    .filter(|(_, v)| v[k as usize].is_finite())
                    .map(|(i, v)| {
                        format!(
                            "{:.1},{:.1}",
                            left + 60.0 * i as f64 + 30.0,
                            560.0 - 220.0 * v[k as usize] / most
                        )
                    })
                    .collect();
                let colour = COLOURS[n + 1];
                let _ = write!(
                    svg,
                    "<polyline points='{}' fill='none' stroke='{colour}' stroke-width='2'/><text x='{:.0}' y='{:.0}' fill='{colour}'>{}</text>",
                    points.join(" "),
                    left + 120.0,
                    592.0 + 14.0 * n as f64,
                    line.name
                );
            }
        }
        svg.push_str("</svg>\n");
        svg
    }
}
