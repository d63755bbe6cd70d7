//! Arms under laws that no mechanism is: what law is found, and where it acts, in the equations or in the encoder's reading.
//!
//! `cargo run --release -p examples --example 27_laws` (`--small`: one of them)
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::fmt::Write as _;

use examples::small;
use missing_physics::diagnosis::Verdict;
use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};

const ARM: &str = r#"format = 1
domain = "motion"
data = "data.csv"
[model]
states = { angle_rad = "rate_rad_s", rate_rad_s = "-stiffness_per_s2*angle_rad - damping_per_s*rate_rad_s + gain*command_v" }
outputs = { encoder_rad = "angle_rad" }
inputs = { command_v = "linear" }
[[parameter]]
name = "stiffness_per_s2"
unit = "1/s^2"
start = 28.0
[[parameter]]
name = "damping_per_s"
unit = "1/s"
start = 0.2
[[parameter]]
name = "gain"
unit = "rad/(s^2 V)"
start = 9.0
[[joint]]
name = "arm"
position = "angle_rad"
velocity = "rate_rad_s"
drive = "command_v"
turns = true
"#;

/// What an arm's acceleration or its reading has more, of angle, rate, time and command.
type More = fn(f64, f64, f64, f64) -> f64;

/// A law that is hidden.
struct Hidden {
    words: &'static str,
    acceleration: More,
    reading: More,
    /// Its terms, as the tool writes them, and their coefficients.
    terms: &'static [(&'static str, f64)],
}

const NOTHING: More = |_, _, _, _| 0.0;

fn hidden() -> Vec<Hidden> {
    let force = |words, acceleration, terms| Hidden { words, acceleration, reading: NOTHING, terms };
    let reading = |words, reading, terms| Hidden { words, acceleration: NOTHING, reading, terms };
    vec![
        force(
            "damping by the deflection",
            |x, v, _, _| -0.8 * x * x * v,
            &[("angle_rad^2*rate_rad_s", -0.8)],
        ),
        reading(
            "an eccentric encoder",
            |x, _, _, _| 0.02 * (x + 0.5).sin(),
            &[("sin(angle_rad)", 0.017_551_65), ("cos(angle_rad)", 0.009_588_51)],
        ),
        force("a spring of fifth power", |x, _, _, _| -6.0 * x.powi(5), &[("angle_rad^5", -6.0)]),
        force("damping to one side", |x, v, _, _| -0.3 * x * v, &[("angle_rad*rate_rad_s", -0.3)]),
        force("damping that grows with time", |_, v, t, _| -0.1 * t * v, &[("t_s*rate_rad_s", -0.1)]),
        force("a spring that grows soft", |x, _, t, _| 0.6 * t * x, &[("t_s*angle_rad", 0.6)]),
        force("a motor that fades", |_, _, t, u| -0.5 * t * u, &[("command_v*t_s", -0.5)]),
        force("a motor that bends", |_, _, _, u| 6.0 * u * u.abs(), &[("abs(command_v)*command_v", 6.0)]),
        force("a motor that brakes", |_, v, _, u| -u * v, &[("command_v*rate_rad_s", -1.0)]),
        force("a drive by the angle", |x, _, _, u| 5.0 * u * x, &[("command_v*angle_rad", 5.0)]),
        reading("a command in the cable", |_, _, _, u| 0.01 * u, &[("command_v", 0.01)]),
        force(
            "a spring that pulls by |x| x",
            |x, _, _, _| -4.0 * x * x.abs(),
            &[("abs(angle_rad)*angle_rad", -4.0)],
        ),
    ]
}

/// The command in a run, V.
fn command(run: usize, t: f64) -> f64 {
    match run {
        0 => (2.5 * t).sin(),
        1 => 0.7 * (5.6 * t).sin() + 0.4 * (1.4 * t).sin(),
        2 => (1.2 * t + 0.6 * t * t).sin(),
        _ => 0.8 * (1.9 * t).sin().signum(),
    }
}

/// Four runs of an arm, in steps of Runge and Kutta's that are short beside the rows, as a table.
fn rows(hidden: &Hidden, rng: &mut ChaCha8Rng) -> Result<String, Box<dyn std::error::Error>> {
    const ROW_S: f64 = 0.02;
    const STEPS: usize = 20;
    let noise = Normal::new(0.0, 2e-3)?;
    let mut data = String::from("run,t_s,command_v,encoder_rad\n");
    for (run, begins) in [[1.0, 0.0], [0.5, 0.0], [1.5, 0.0], [0.8, 2.0]].into_iter().enumerate() {
        let [mut x, mut v] = begins;
        for row in 0..400 {
            let t = ROW_S * row as f64;
            let [now, then] = [t, t + ROW_S].map(|t| command(run, t));
            let reading = x + (hidden.reading)(x, v, t, now) + noise.sample(rng);
            writeln!(data, "{},{t:.2},{now:.12},{reading:.6}", run + 1)?;
            let rate = |x: f64, v: f64, part: f64| {
                let u = now + (then - now) * part;
                [v, -30.0 * x - 0.3 * v + 10.0 * u + (hidden.acceleration)(x, v, t + ROW_S * part, u)]
            };
            let h = ROW_S / STEPS as f64;
            for step in 0..STEPS {
                let at = |parts: f64| (step as f64 + parts) / STEPS as f64;
                let a = rate(x, v, at(0.0));
                let b = rate(x + 0.5 * h * a[0], v + 0.5 * h * a[1], at(0.5));
                let c = rate(x + 0.5 * h * b[0], v + 0.5 * h * b[1], at(0.5));
                let d = rate(x + h * c[0], v + h * c[1], at(1.0));
                x += h / 6.0 * (a[0] + 2.0 * b[0] + 2.0 * c[0] + d[0]);
                v += h / 6.0 * (a[1] + 2.0 * b[1] + 2.0 * c[1] + d[1]);
            }
        }
    }
    Ok(data)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut rng = ChaCha8Rng::seed_from_u64(27);
    let all = hidden();
    let tried = if small() { 1 } else { all.len() };
    let (mut found, mut within) = (0, 0);
    for hidden in all.iter().take(tried) {
        let folder = tempfile::tempdir()?;
        std::fs::write(folder.path().join("recording.toml"), ARM)?;
        std::fs::write(folder.path().join("data.csv"), rows(hidden, &mut rng)?)?;
        let (_, loaded) = missing_physics_domains::load(folder.path())?;
        let answer = loaded.diagnose(&Options::default(), &Silent)?;
        println!("{}", hidden.words);
        let Some(law) = answer.law.as_ref().filter(|_| answer.verdict == Verdict::Unexplained) else {
            println!("    {:?}: {}", answer.verdict, answer.chosen.join(", "));
            continue;
        };
        println!("    {}", law.formula);
        let of = |term: &str| {
            law.coefficients.iter().find(|c| c.name.starts_with(&format!("coefficient of {term} in ")))
        };
        let same = law.coefficients.len() == hidden.terms.len()
            && hidden.terms.iter().all(|(term, _)| of(term).is_some());
        found += usize::from(same);
        let holds = |(term, truth): &(&str, f64)| {
            of(term).is_some_and(|c| c.ci95[0] <= *truth && *truth <= c.ci95[1])
        };
        within += usize::from(same && hidden.terms.iter().all(holds));
    }
    println!(
        "\n{found} of {tried} laws have the hidden terms and no other; of these {within} have intervals that hold all coefficients"
    );
    Ok(())
}
