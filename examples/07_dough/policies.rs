//! Figure 7.4: rolls to the goal, policies by goals.

use dough_mbrl::fake::DoughKind;
use dough_mbrl::goal::Goal;
use dough_mbrl::mpc::{Mpc, MpcSettings};
use dough_mbrl::planner::Objective;
use dough_mbrl::planner::cem::Cem;
use dough_mbrl::policy::{Explore, Heuristic, Policy};
use dough_mbrl::predictor::PlanError;
use dough_mbrl::roll::{Action, Limits, State};
use examples::bars::Bars;
use examples::dough::{Make, Tally, mean_and_half, rollouts};
use rand::Rng;

use crate::{Failure, INCH_M, Learned, NONE, Size, direct};

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

/// Rolls until each goal is reached or the dough is lost.
pub(crate) fn figure_7_4(size: &Size, a: &Learned) -> Result<Vec<Bars>, Failure> {
    let plain = Objective::equation_7_1();
    let cem = MpcSettings { objective: plain, ..MpcSettings::default() };
    let policies: [(&str, u64, Make<'_>); 7] = [
        ("random", size.six, &|_| Ok(Box::new(Explore))),
        ("heuristic", size.six, &|_| Ok(Box::new(Heuristic::default()))),
        ("CEM, eq. 7.1", size.six, &|_| Ok(Box::new(Mpc::new(a.model.clone(), Cem::default(), cem)?))),
        ("direct, eq. 7.1", size.twenty, &|_| direct(&a.model, plain, Some(10))),
        ("direct, overshoot and aim", size.twenty, &|_| direct(&a.model, Objective::default(), Some(10))),
        ("direct, chance constraint", size.twenty, &|_| {
            direct(&a.model, Objective::constrained(a.chance), Some(10))
        }),
        ("strongest", size.twenty, &|_| Ok(Box::new(Strongest))),
    ];
    println!(
        "\nfigure 7.4: rolls until the goal is reached or the dough is lost (too long), dough A, {} or (direct, strongest) {} rollouts to each goal, mean +- half the 95 % interval",
        size.six, size.twenty
    );
    print!("{:26}", "policy");
    size.goals.iter().for_each(|g| print!("{:>16}", format!("{g} in")));
    println!("{:>12}{:>9}", "lost", "other");
    let mut all = Vec::new();
    for (name, count, make) in policies {
        let (mut bars, mut total) = (Bars { name: name.into(), values: Vec::new() }, Tally::default());
        print!("{name:26}");
        for goal in &size.goals {
            let seeds = size.seed + 100..size.seed + 100 + count;
            let tally = Tally::of(&rollouts(DoughKind::A, NONE, goal * INCH_M, seeds, size.most, make)?);
            let (mean, half) = mean_and_half(&tally.rolls);
            print!("{:>16}", format!("{mean:.1} +- {half:.1}"));
            bars.values.push((mean, half));
            total.add(&tally);
        }
        println!("{:>12}{:>9}", format!("{} of {}", total.lost, total.rolls.len()), total.other);
        all.push(bars);
    }
    fewer(&all);
    Ok(all)
}

fn fewer(all: &[Bars]) {
    let than = |name: usize, what: usize| {
        let pairs = all[name].values.iter().zip(&all[what].values);
        let parts: Vec<f64> = pairs.map(|(a, b)| 100.0 * (1.0 - b.0 / a.0)).collect();
        let (mean, _) = mean_and_half(&parts);
        let spread =
            parts.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (parts.len() as f64 - 1.0).max(1.0);
        format!("{mean:.1} +- {:.1} %", spread.sqrt())
    };
    println!("fewer rolls (mean over the goals +- their standard deviation)        here      [Matl 2021]");
    println!("  heuristic than random              {:>38}  27.6 +- 6.1 %", than(0, 1));
    println!("  CEM than heuristic                 {:>38}    33.4 +- 18 %", than(1, 2));
    println!("  direct, eq. 7.1, than heuristic    {:>38}  63.1 +- 18.3 %", than(1, 3));
    println!("  direct, overshoot and aim, than heuristic {:>31}", than(1, 4));
    println!("  direct, chance constraint, than heuristic {:>31}", than(1, 5));
    println!("  strongest rolls, goal passed or not {:>37}", than(1, 6));
}
