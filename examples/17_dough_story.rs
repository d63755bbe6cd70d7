//! A robot's dough is not the one that it learned: this batch is drier. The controller goes on planning gentle rolls that fall short; the
//! tool says from a recording what has changed; the model is repaired with it, and the controller needs fewer rolls. The rolls are
//! those of the fake, which is no polynomial; the tool sees the files alone.
//!
//! `cargo run --release -p examples --example 17_dough_story` (`--small`: one day, one goal; `--seed N`: other days;
//! `--picture FILE.svg` draws)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::error::Error;
use std::fmt::Write as _;

use dough_mbrl::band::Band;
use dough_mbrl::fake::{DoughKind, Effects, FakeRig};
use dough_mbrl::goal::Goal;
use dough_mbrl::mpc::{Mpc, MpcSettings};
use dough_mbrl::planner::Objective;
use dough_mbrl::planner::powell::PowellPlanner;
use dough_mbrl::policy::{Explore, Policy};
use dough_mbrl::predictor::{Predictor, Refit};
use dough_mbrl::repair::{Repaired, Response};
use dough_mbrl::ridge::Ridge;
use dough_mbrl::rollout::{End, Rolled, RolloutError, Setup};
use examples::argument;
use examples::bars::Bars;
use examples::dough::{mean_and_half, rollouts, rolls};
use missing_physics::diagnosis::{Diagnosis, Verdict};
use missing_physics::engine::{Options, diagnose};
use missing_physics::observer::Silent;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

const NONE: Effects =
    Effects { drying_per_s: 0.0, slip_n: 0.0, springback: 0.0, sticking: 0.0, softening: 0.0 };
const INCH_M: f64 = 0.0254;
/// The dough that was learned from, and what is concealed: 3 g of its 5 g of water are gone. It flows along its axis as easily as can be, so that
/// twelve rolls of five doughs show what has changed.
const USUAL: DoughKind = DoughKind { axial_flow: 1.0, ..DoughKind::A };
const DRY: DoughKind = DoughKind { water_g: 2.0, ..USUAL };
/// Rolls at most of a rollout.
const MOST_ROLLS: usize = 150;
/// A dough is put aside once it is this long.
const LONGEST_M: f64 = 0.2;

/// How much of it is done.
struct Size {
    /// Doughs and random rolls on each: to learn from, and of each day.
    trained: [u64; 2],
    recorded: [u64; 2],
    days: u64,
    /// Number of the first day.
    first: u64,
    goals: Vec<f64>,
    rollouts: u64,
    replicates: usize,
}

impl Size {
    fn from_arguments() -> Outcome<Self> {
        let first = 100 * argument("--seed").map_or(Ok(0), |s| s.parse::<u64>())?;
        Ok(if examples::small() {
            let (trained, recorded) = ([8, 16], [4, 12]);
            Self { trained, recorded, days: 1, first, goals: vec![4.0], rollouts: 2, replicates: 19 }
        } else {
            let (trained, recorded) = ([20, 24], [5, 12]);
            Self {
                trained,
                recorded,
                days: 4,
                first,
                goals: vec![4.0, 5.0, 6.0],
                rollouts: 3,
                replicates: 199,
            }
        })
    }
}

/// A robot's first day with a dough that it does not know.
struct Day {
    recorded: Vec<Vec<Rolled>>,
    model: Ridge,
    response: Response,
    /// Rolls by model and goal.
    bars: Vec<Done>,
}

fn main() -> Outcome<()> {
    let size = Size::from_arguments()?;
    let band = band()?;
    let [trained, recorded] = [size.trained, size.recorded];
    println!(
        "learned from {} doughs of up to {} random rolls, each day anew; recorded: {} doughs of up to {}",
        trained[0], trained[1], recorded[0], recorded[1]
    );
    let days: Vec<Day> =
        (0..size.days).map(|day| live(size.first + day, &size, band)).collect::<Outcome<_>>()?;
    println!(
        "\nall days, {} rollouts to each goal: rolls, and doughs that missed it",
        size.days * size.rollouts
    );
    print!("{:34}", "model");
    size.goals.iter().for_each(|g| print!("{:>14}", format!("{g} in")));
    println!("{:>9}{:>8}", "all", "missed");
    let all: Vec<Done> = (0..MODELS.len()).map(|m| Done::sum(days.iter().map(|d| &d.bars[m]))).collect();
    all.iter().for_each(Done::print);
    let fewer = |bars: &[Done]| 100.0 * (1.0 - bars[2].mean() / bars[0].mean());
    let each: Vec<String> = days.iter().map(|d| format!("{:.0} %", fewer(&d.bars))).collect();
    println!("repaired: {:.0} % fewer rolls than as learned (day by day: {})", fewer(&all), each.join(", "));
    if let Some(file) = argument("--picture") {
        let day = &days[0];
        let parts = answered(&day.recorded, &day.model, &band);
        let rows: Vec<Bars> = all.iter().map(Done::bars).collect();
        let goals: Vec<String> = size.goals.iter().map(|g| format!("{g} in")).collect();
        std::fs::write(&file, picture::draw(&rows, &goals, &parts, &day.response))?;
        println!("\ndrawn: {file}");
    }
    Ok(())
}

/// Learns, is asked about doughs of which nothing (but on a small run) and of which something is hidden, and rolls.
fn live(day: u64, size: &Size, band: Band) -> Outcome<Day> {
    let seed = 10 * day;
    let training = doughs(USUAL, size.trained, seed + 1)?;
    let model = Ridge::learn(&rolls(&training), 2, 1e-3)?;
    println!("day {}", day - size.first + 1);
    if !examples::small() {
        let usual = doughs(USUAL, size.recorded, seed + 2)?;
        println!("  the usual dough: {}", said(&ask(&band, &training, &usual, day, size.replicates)?));
    }
    let recorded = doughs(DRY, size.recorded, seed + 3)?;
    let answer = ask(&band, &training, &recorded, day, size.replicates)?;
    println!("  a drier one:     {}", said(&answer));
    let response = response(&answer, band);
    let repaired = Repaired::new(model.clone(), response)?;
    // What a robot could have learned instead, had it rolled as many dry doughs.
    let anew = Ridge::learn(&rolls(&doughs(DRY, size.trained, seed + 4)?), 2, 1e-3)?;
    let bars = vec![
        Done::roll(0, size, DRY, day, &model, None)?,
        Done::roll(1, size, DRY, day, &model, Some(5))?,
        Done::roll(2, size, DRY, day, &repaired, None)?,
        Done::roll(3, size, DRY, day, &anew, None)?,
        Done::roll(4, size, USUAL, day, &model, None)?,
    ];
    Ok(Day { recorded, model, response, bars })
}

/// Doughs rolled at random, each on a rig of its own.
fn doughs(kind: DoughKind, [count, each]: [u64; 2], seed: u64) -> Outcome<Vec<Vec<Rolled>>> {
    let one = |k| -> Result<Vec<Rolled>, RolloutError> {
        let seed = 1000 * seed + k;
        let mut rig = FakeRig::new(kind, NONE, seed);
        let setup = Setup::of(rig.camera_in_world());
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // Random rolls look at no goal.
        let goal = Goal::cylinder(LONGEST_M, kind.volume_m3)?;
        let mut dough = Vec::new();
        for _ in 0..each {
            let (rolled, after) = setup.step(&mut rig, &mut Explore, &goal, &mut rng)?;
            dough.push(rolled);
            if after.length_m > LONGEST_M {
                break;
            }
        }
        Ok(dough)
    };
    Ok((0..count).into_par_iter().map(one).collect::<Result<_, _>>()?)
}

/// The band's force on a rigid probe of 30 mm, as the format writes it: by least squares on force over depth.
fn band() -> Outcome<Band> {
    let mut rig = FakeRig::new(USUAL, NONE, 1).with_rigid_probe(0.03);
    let handling = Setup::of(rig.camera_in_world()).handling;
    let (mut rows, mut stiffness) = (Vec::new(), Vec::new());
    let throw0_m = Band::default().throw0_m;
    for throw_mm in (40..=120).step_by(10) {
        handling.stretch(&mut rig, 1e-3 * f64::from(throw_mm))?;
        for depth_mm in (5..=29).step_by(4) {
            let depth_m = 1e-3 * f64::from(depth_mm);
            handling.go(&mut rig, [0.4, 0.0, 0.03 - depth_m], 0.1)?;
            rows.extend([1.0, 1e-3 * f64::from(throw_mm) - throw0_m, depth_m]);
            stiffness.push(rig.probe_force_n() / depth_m);
            handling.go(&mut rig, [0.4, 0.0, 0.1], 0.3)?;
        }
    }
    let design = DMatrix::from_row_slice(stiffness.len(), 3, &rows);
    let found = design.svd(true, true).solve(&DVector::from_vec(stiffness), 1e-12)?;
    Ok(Band { k0_n_m: found[0], k1_n_m2: found[1], throw0_m, k2_per_m: (found[2] / found[0]).max(0.0) })
}

/// Doughs as a table of the format; times are since each was made.
fn table(doughs: &[Vec<Rolled>]) -> Outcome<String> {
    let mut text = String::from(
        "run,step,length_m,width_m,height_m,throw_m,depth_m,next_length_m,next_width_m,next_height_m,t_s\n",
    );
    for (run, dough) in doughs.iter().enumerate() {
        let made_s = dough.first().map_or(0.0, |r| r.t_s);
        for (step, rolled) in dough.iter().enumerate() {
            write!(text, "{},{}", run + 1, step + 1)?;
            let roll = rolled.roll;
            for value in roll.state.iter().chain(&roll.action).chain(&roll.next) {
                write!(text, ",{value:.5}")?;
            }
            writeln!(text, ",{:.2}", rolled.t_s - made_s)?;
        }
    }
    Ok(text)
}

/// What the tool says of a recording.
fn ask(
    band: &Band,
    training: &[Vec<Rolled>],
    doughs: &[Vec<Rolled>],
    seed: u64,
    replicates: usize,
) -> Outcome<Diagnosis> {
    let folder = tempfile::tempdir()?;
    let Band { k0_n_m, k1_n_m2, throw0_m, k2_per_m } = *band;
    let header = format!(
        "format = 1\ndomain = \"dough-roll\"\ndata = \"data.csv\"\n\n[rig]\ntraining = \"training.csv\"\n\
         band = {{ k0_n_m = {k0_n_m:?}, k1_n_m2 = {k1_n_m2:?}, throw0_m = {throw0_m:?}, k2_per_m = {k2_per_m:?} }}\n"
    );
    std::fs::write(folder.path().join("recording.toml"), header)?;
    std::fs::write(folder.path().join("training.csv"), table(training)?)?;
    std::fs::write(folder.path().join("data.csv"), table(doughs)?)?;
    let (_, loaded) = missing_physics_domains::load(folder.path()).map_err(|e| e.to_string())?;
    let options = Options { seed, replicates, ..Options::default() };
    Ok(diagnose(&*loaded.model, &loaded.recording, &loaded.experiments, &options, &Silent)?)
}

fn said(answer: &Diagnosis) -> String {
    // Writing to a string cannot fail.
    let mut text = format!("{} (p {:.3})", answer.verdict.word(), answer.p_value);
    if let (Verdict::Unexplained, Some(test)) = (answer.verdict, answer.tests.first()) {
        let _ = write!(text, "; most by: {}", test.name);
    }
    if !answer.chosen.is_empty() {
        let _ = write!(text, ": {}", answer.chosen.join(" + "));
    }
    for set in &answer.confused_with {
        let _ = write!(text, " or {}", set.join(" + "));
    }
    for mechanism in answer.mechanisms.iter().filter(|m| answer.chosen.contains(&m.id)) {
        for p in &mechanism.parameters {
            let _ = write!(text, "; {} {:.3} [{:.3}, {:.3}]", p.name, p.value, p.ci95[0], p.ci95[1]);
        }
    }
    text
}

/// What the controller can use of an answer.
fn response(answer: &Diagnosis, band: Band) -> Response {
    let value = |id: &str| {
        let chosen = answer.mechanisms.iter().find(|m| m.id == id && answer.chosen.contains(&m.id));
        chosen.and_then(|m| m.parameters.first()).map(|p| p.value)
    };
    let factor = value("stiffness-change").unwrap_or(1.0);
    Response { factor, slip_n: value("slip").unwrap_or(0.0), band }
}

const MODELS: [&str; 5] = [
    "as learned",
    "as learned, refined as it goes",
    "repaired",
    "learned from as many dry doughs",
    "as learned, the usual dough",
];

/// A model's rolls to each goal, and how many doughs missed it.
struct Done {
    name: &'static str,
    values: Vec<Vec<f64>>,
    missed: usize,
}

impl Done {
    /// Rolls dough to each goal.
    fn roll<M: Refit + Clone + Sync + 'static>(
        which: usize,
        size: &Size,
        kind: DoughKind,
        day: u64,
        model: &M,
        refit_every: Option<usize>,
    ) -> Outcome<Self> {
        let controller = |_| -> Result<Box<dyn Policy>, RolloutError> {
            let objective = Objective { horizon: 5, ..Objective::default() };
            let settings = MpcSettings { objective, refit_every, ..MpcSettings::default() };
            Ok(Box::new(Mpc::new(model.clone(), PowellPlanner::default(), settings)?))
        };
        let (mut values, mut missed) = (Vec::new(), 0);
        for inches in &size.goals {
            let seeds = 100 * day + 7..100 * day + 7 + size.rollouts;
            let done = rollouts(kind, NONE, inches * INCH_M, seeds, MOST_ROLLS, &controller)?;
            missed += done.iter().filter(|r| r.end != End::Reached).count();
            values.push(done.iter().map(|r| r.rolls.len() as f64).collect());
        }
        Ok(Self { name: MODELS[which], values, missed })
    }

    /// Several days as one.
    fn sum<'a>(days: impl Iterator<Item = &'a Self>) -> Self {
        let mut all = Self { name: "", values: Vec::new(), missed: 0 };
        for day in days {
            all.name = day.name;
            all.missed += day.missed;
            all.values.resize(day.values.len(), Vec::new());
            all.values.iter_mut().zip(&day.values).for_each(|(to, from)| to.extend(from));
        }
        all
    }

    fn mean(&self) -> f64 {
        mean_and_half(&self.values.concat()).0
    }

    fn bars(&self) -> Bars {
        Bars { name: self.name.into(), values: self.values.iter().map(|v| mean_and_half(v)).collect() }
    }

    fn print(&self) {
        print!("{:34}", self.name);
        for values in &self.values {
            let (mean, half) = mean_and_half(values);
            print!("{:>14}", format!("{mean:.1} +- {half:.1}"));
        }
        println!("{:>9.1}{:>8}", self.mean(), self.missed);
    }
}

/// Force of each roll (N) and what of the predicted lengthening took place, where a camera can tell.
fn answered(doughs: &[Vec<Rolled>], model: &Ridge, band: &Band) -> Vec<[f64; 2]> {
    let part = |r: &Rolled| {
        let roll = r.roll;
        let expected = model.next(&roll.state, &roll.action)[0] - roll.state[0];
        let [throw, depth] = roll.action;
        (expected > 2e-3).then(|| [band.force_n(throw, depth), (roll.next[0] - roll.state[0]) / expected])
    };
    doughs.iter().flatten().filter_map(part).collect()
}

/// What was found and what it was good for, as SVG.
mod picture {
    use std::fmt::Write as _;

    use dough_mbrl::repair::Response;

    use examples::bars::{self, Bars, Stand};

    pub(super) fn draw(rows: &[Bars], goals: &[String], parts: &[[f64; 2]], response: &Response) -> String {
        let mut svg = String::from(
            "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 800 340' font-family='sans-serif' font-size='12'><rect width='800' height='340' fill='white'/>",
        );
        found(&mut svg, parts, response);
        svg.push_str("<text x='430' y='24'>rolls to the goal, a drier dough</text>");
        let stand = Stand { left: 430.0, bottom: 290.0, height: 140.0, step: [120.0, 21.0], legend: 44.0 };
        bars::draw(&mut svg, rows, goals, &stand);
        svg.push_str("</svg>\n");
        svg
    }

    /// Each roll's lengthening over the predicted, by its force, and the response that was found.
    fn found(svg: &mut String, parts: &[[f64; 2]], response: &Response) {
        let most = parts.iter().map(|p| p[0]).fold(1.0, f64::max);
        let x = |force: f64| 50.0 + 320.0 * force / most;
        let y = |part: f64| 250.0 - 130.0 * part.clamp(-0.3, 1.5);
        // Writing to a string cannot fail.
        let _ = write!(
            svg,
            "<text x='50' y='24'>rolls of the drier dough: lengthening over the predicted one</text><path d='M50 50V290H370' fill='none' stroke='black'/><text x='300' y='308'>force, N</text>",
        );
        for tick in [0.0, 0.5, 1.0] {
            let _ = write!(svg, "<text x='22' y='{:.0}'>{tick}</text>", y(tick) + 4.0);
        }
        for tick in 0..=(most as u32) {
            let _ = write!(svg, "<text x='{:.0}' y='304'>{tick}</text>", x(f64::from(tick)) - 3.0);
        }
        for [force, part] in parts {
            let _ = write!(svg, "<circle cx='{:.1}' cy='{:.1}' r='2.5' fill='#888'/>", x(*force), y(*part));
        }
        let _ = write!(
            svg,
            "<path d='M50 {:.1}H370' fill='none' stroke='#0072b2' stroke-width='2'/><text x='190' y='66' fill='#0072b2'>found: {:.2} of the response</text>",
            y(response.factor),
            response.factor
        );
    }
}
