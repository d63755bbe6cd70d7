//! Figures 7.5 and 7.6: wrong, refined and matched models.

use dough_mbrl::fake::DoughKind;
use dough_mbrl::matching::{Known, Matched};
use dough_mbrl::planner::Objective;
use examples::dough::{Make, Tally, mean_and_half, rollouts};

use crate::picture::Lines;
use crate::{Failure, INCH_M, Learned, NONE, Size, direct};

/// What plans with a model minimise, five rolls ahead.
#[derive(Clone, Copy)]
enum Plans {
    Equation71,
    Chance,
}

impl Plans {
    fn with(self, learned: &Learned) -> Objective {
        let objective = match self {
            Self::Equation71 => Objective::equation_7_1(),
            Self::Chance => Objective::constrained(learned.chance),
        };
        Objective { horizon: 5, ..objective }
    }
}

/// Both objectives; the lines are those of eq. 7.1.
pub(crate) fn figure_7_5(
    size: &Size,
    a: &Learned,
    c: &Learned,
    stiffness: &[f64; 3],
) -> Result<Vec<Lines>, Failure> {
    println!("\nfigure 7.5: rolls until the goal is reached or the dough is lost; H = 5");
    let mut lines = Vec::new();
    for (name, plans) in [("eq. 7.1", Plans::Equation71), ("chance constraint", Plans::Chance)] {
        let mut drawn = refined(name, plans, size, [a, c])?;
        drawn.push(matched(name, plans, size, [a, c], stiffness)?);
        if lines.is_empty() {
            lines = drawn;
        }
    }
    println!(
        "figure 7.6, eq. 7.1: actions over the progress of dough A (throw / depth, mm, by fifths of a rollout)"
    );
    for line in &lines {
        print!("  {:20}", line.name);
        line.values.iter().for_each(|[t, d]| print!("{:>14}", format!("{t:.0} / {d:.1}")));
        println!();
    }
    Ok(lines)
}

/// Runs, prints and draws one row; its mean number of rolls.
fn row(
    name: &str,
    kind: DoughKind,
    inches: f64,
    (seeds, most): (std::ops::Range<u64>, usize),
    make: Make<'_>,
) -> Result<(f64, Lines), Failure> {
    let done = rollouts(kind, NONE, inches * INCH_M, seeds, most, make)?;
    let tally = Tally::of(&done);
    let (mean, half) = mean_and_half(&tally.rolls);
    print!("  {name:44} {:>14}", format!("{mean:.1} +- {half:.1}"));
    println!("  {} lost, {} of {} otherwise missed", tally.lost, tally.other, tally.rolls.len());
    Ok((mean, Lines::of(name, &done)))
}

fn gain(before: f64, after: f64) -> f64 {
    100.0 * (1.0 - after / before)
}

/// Wrong models, fixed or refined every five rolls.
fn refined(name: &str, plans: Plans, size: &Size, [a, c]: [&Learned; 2]) -> Result<Vec<Lines>, Failure> {
    println!("a, {name}: wrong model, fixed or refined every 5 rolls; {} rollouts", size.fifteen);
    let seeds = || (size.seed + 200..size.seed + 200 + size.fifteen, size.most);
    let (mut gains, mut lines) = (Vec::new(), Vec::new());
    for (kind, inches, wrong, what) in [
        (DoughKind::A, 6.0, c, "dough A to 6 in, model C"),
        (DoughKind::C, 4.0, a, "dough C to 4 in, model A"),
    ] {
        let objective = plans.with(wrong);
        let (fixed, mut first) = row(&format!("{what}, fixed"), kind, inches, seeds(), &|_| {
            direct(&wrong.model, objective, None)
        })?;
        let (refined, mut second) = row(&format!("{what}, refined"), kind, inches, seeds(), &|_| {
            direct(&wrong.model, objective, Some(5))
        })?;
        gains.push(gain(fixed, refined));
        if lines.is_empty() {
            (first.name, second.name) = ("wrong, fixed".into(), "wrong, refined".into());
            lines.extend([first, second]);
        }
    }
    println!("  refined: {:.1} % fewer rolls on average ([Matl 2021]: 45.8 %)", mean_and_half(&gains).0);
    Ok(lines)
}

/// Wrong models or matched ones, both refined; the line of dough A, matched.
fn matched(
    name: &str,
    plans: Plans,
    size: &Size,
    [a, c]: [&Learned; 2],
    stiffness: &[f64; 3],
) -> Result<Lines, Failure> {
    let known = [(stiffness[0], a), (stiffness[2], c)]
        .map(|(stiffness_n_m, l)| Known { stiffness_n_m, dynamics: l.model.clone() });
    println!("b, {name}: wrong model or matched by stiffness, both refined, {} rollouts", size.ten);
    let wrong_b: Make<'_> = &|seed| {
        let wrong = if seed % 2 == 0 { a } else { c };
        direct(&wrong.model, plans.with(wrong), Some(5))
    };
    let wrong_a: Make<'_> = &|_| direct(&c.model, plans.with(c), Some(5));
    let wrong_c: Make<'_> = &|_| direct(&a.model, plans.with(a), Some(5));
    let (mut gains, mut line) = (Vec::new(), None);
    let doughs = [
        ("A", DoughKind::A, 6.0, wrong_a, a),
        ("B", DoughKind::B, 5.0, wrong_b, c),
        ("C", DoughKind::C, 4.0, wrong_c, c),
    ];
    for ((name, kind, inches, wrong, nearer), stiffness) in doughs.into_iter().zip(stiffness) {
        let model = Matched::new(&known, *stiffness)?;
        // A mixture is taken for as unsure as the known dough whose rolls scatter more.
        let objective = plans.with(nearer);
        let seeds = || (size.seed + 300..size.seed + 300 + size.ten, size.most);
        let what = format!("dough {name} to {inches} in");
        let (before, _) = row(&format!("{what}, wrong model"), kind, inches, seeds(), wrong)?;
        let (after, drawn) =
            row(&format!("{what}, matched"), kind, inches, seeds(), &|_| direct(&model, objective, Some(5)))?;
        gains.push(gain(before, after));
        line.get_or_insert(drawn);
    }
    println!("  matched: {:.1} % fewer rolls on average ([Matl 2021]: 39.6 %)", mean_and_half(&gains).0);
    let mut line = line.ok_or("no dough was rolled")?;
    line.name = "stiffness-matched".into();
    Ok(line)
}
