//! A paddle meets a ball that it only hears: figures 4.7, B.6 and B.7, a paddle that stays, both algorithms and a particle filter, three
//! balls that are known from the sound of their drops.
//!
//! ```text
//! cargo run --release -p examples --example 14_tracking -- --small              6 throws a ball
//! cargo run --release -p examples --example 14_tracking -- --picture FILE.svg   100 throws a ball, by peak times and by phase correlation
//! cargo run --release -p examples --example 14_tracking -- --bare               the same without furniture
//! cargo run --release -p examples --example 14_tracking -- --throws 40 --seed 1 other throws, by peak times
//! ```
#![allow(clippy::print_stdout, reason = "an example prints what it measures")]

mod balls;
mod picture;
mod place;
mod throws;

use balls::{BALLS, Inferred};
use bounce_audio::drop::each;
use bounce_audio::fake::Verdict;
use bounce_audio::listen::Delays;
use bounce_audio::track::Workspace;
use place::{BARE, FURNISHED, OUTLIER_M, Place, mean, taps};
use std::error::Error;
use throws::{Outcome, TRACKERS, throw};

pub(crate) type Failure = Box<dyn Error + Send + Sync>;

pub(crate) const SPACE: Workspace =
    Workspace { plane_x_m: 0.55, y_m: [-0.05, 0.6], z_m: [0.02, 0.5], rest_z_m: 0.1, gravity_m_s2: 9.80665 };

/// What a ball's throws came to with one tracker, out of those that came within reach.
pub(crate) struct Bar {
    pub(crate) ball: &'static str,
    pub(crate) tracker: usize,
    /// Shares of the throws, in per cent.
    pub(crate) touched: f64,
    pub(crate) outliers: f64,
    pub(crate) missed: f64,
    /// Of the missed by outliers: the share whose first misheard impact was the first, the second, a later one.
    pub(crate) by_bounce: [f64; 3],
    pub(crate) out: usize,
    /// Mean energy, cm^2/s, of all throws and of those that were touched.
    pub(crate) energy: f64,
    energy_touched: f64,
    slowest_ms: f64,
}

impl Bar {
    fn of(ball: &'static str, tracker: usize, outcomes: &[[Outcome; 6]]) -> Self {
        let all = || outcomes.iter().map(|o| &o[tracker]);
        let within: Vec<&Outcome> = all().filter(|o| o.verdict != Verdict::Out).collect();
        let share = |f: &dyn Fn(&Outcome) -> bool| {
            100.0 * within.iter().filter(|o| f(o)).count() as f64 / within.len().max(1) as f64
        };
        let touched = |o: &Outcome| o.verdict == Verdict::Touched;
        let at = |k: usize| share(&|o| !touched(o) && o.misheard.map(|n| n.min(2)) == Some(k));
        Self {
            ball,
            tracker,
            touched: share(&touched),
            outliers: share(&|o| !touched(o) && o.misheard.is_some()),
            missed: share(&|o| !touched(o) && o.misheard.is_none()),
            by_bounce: [at(0), at(1), at(2)],
            out: outcomes.len() - within.len(),
            energy: 1e4 * mean(within.iter().map(|o| o.energy)),
            energy_touched: 1e4 * mean(within.iter().filter(|o| touched(o)).map(|o| o.energy)),
            slowest_ms: 1e3 * all().map(|o| o.slowest_s).fold(0.0, f64::max),
        }
    }
}

/// The number after an option.
fn number(option: &str) -> Option<u64> {
    examples::argument(option)?.parse().ok()
}

fn main() -> Result<(), Failure> {
    let small = examples::small();
    let throws = number("--throws").map_or(if small { 6 } else { 100 }, |n| n as usize);
    let place = if std::env::args().any(|a| a == "--bare") { &BARE } else { &FURNISHED };
    let known = known(place, small)?;
    let listeners = [("peak times, as in [Matl 2021]", Delays::Peaks), ("phase correlation", Delays::Phase)];
    let mut bars = Vec::new();
    for &listener in &listeners[..if small || number("--throws").is_some() { 1 } else { 2 }] {
        bars.push(compare(place, listener, &known, throws)?);
    }
    if let Some(file) = examples::argument("--picture") {
        std::fs::write(&file, picture::picture(&bars[0])?)?;
        println!("\ndrawn: {file}");
    }
    Ok(())
}

/// What the sound of drops says of the balls.
fn known(place: &Place, small: bool) -> Result<Vec<Inferred>, Failure> {
    let (train, drops) = if small { (1_500, 20) } else { (6_000, 100) };
    let simulator = examples::drops::simulator();
    let density = examples::drops::learn(&simulator, train)?;
    println!("{:10} {:>20} {:>16} {:>14}", "ball", "e", "log10 kappa", "drops heard");
    (11..)
        .zip(&BALLS)
        .map(|(seed, ball)| {
            let known = ball.infer(density.as_ref(), &simulator, place, drops, seed)?;
            let (m, c) = (known.posterior.mixture().mean(), known.posterior.mixture().covariance());
            println!(
                "{:10} {:>20} {:>16} {:>7} of {drops}",
                ball.name,
                format!("{:.4} +- {:.4}", m[0], c[0].sqrt()),
                format!("{:.2} +- {:.2}", m[1], c[3].sqrt()),
                known.drops,
            );
            Ok(known)
        })
        .collect()
}

fn compare(
    place: &Place,
    (name, delays): (&str, Delays),
    known: &[Inferred],
    throws: usize,
) -> Result<Vec<Bar>, Failure> {
    let taps = taps(place, delays, (2 * throws).max(30))?;
    println!(
        "\n{name}, {}: {} taps, {} not heard, {} beyond {:.0} cm, the others {:.1} mm off on average ([Matl 2021]: 7.9 mm)",
        place.name,
        taps.count,
        taps.count - taps.errors_m.len(),
        taps.outliers(),
        100.0 * OUTLIER_M,
        1e3 * taps.mean_m(),
    );
    let hearing = taps.hearing();
    let seed = number("--seed").unwrap_or(15);
    let (mut bars, mut alone) = (Vec::new(), [[0; 2]; TRACKERS.len()]);
    let (mut errors, mut unheard) = (Vec::new(), 0);
    println!(
        "{:10} {:26} {:>8} {:>17} {:>22} {:>7} {:>4} {:>22} {:>11}",
        "ball",
        "tracker",
        "touched",
        "missed: outliers",
        "at 1st, 2nd, later",
        "others",
        "out",
        "cm^2/s, all, touched",
        "slowest, ms"
    );
    for (ball, known) in BALLS.iter().zip(known) {
        let outcomes: Result<Vec<[Outcome; 6]>, Failure> =
            each(throws, 15, |i, _| throw(place, (ball, known), (delays, &hearing), 1000 * seed + i as u64))
                .into_iter()
                .collect();
        let outcomes = outcomes?;
        for (tracker, alone) in alone.iter_mut().enumerate() {
            let bar = Bar::of(ball.name, tracker, &outcomes);
            print_bar(&bar);
            bars.push(bar);
            for o in &outcomes {
                let [one, other] = [tracker, 1].map(|k| o[k].verdict == Verdict::Touched);
                alone[0] += usize::from(one && !other);
                alone[1] += usize::from(other && !one);
            }
        }
        for o in outcomes.iter().map(|o| &o[0]).filter(|o| o.verdict != Verdict::Out) {
            errors.extend_from_slice(&o.errors_m);
            unheard += o.unheard;
        }
    }
    summary(&bars, &alone);
    let far = errors.iter().filter(|e| **e > OUTLIER_M).count();
    println!(
        "heard while the paddle stayed: {} impacts, {unheard} more not, {far} beyond {:.0} cm, the others {:.1} mm off on average",
        errors.len(),
        100.0 * OUTLIER_M,
        1e3 * mean(errors.iter().copied().filter(|e| *e <= OUTLIER_M)),
    );
    Ok(bars)
}

fn print_bar(bar: &Bar) {
    let [a, b, c] = bar.by_bounce;
    println!(
        "{:10} {:26} {:>6.0} % {:>15.0} % {:>22} {:>5.0} % {:>4} {:>22} {:>11.2}",
        bar.ball,
        TRACKERS[bar.tracker],
        bar.touched,
        bar.outliers,
        format!("{a:.0}, {b:.0}, {c:.0} %"),
        bar.missed,
        bar.out,
        format!("{:.0}, {:.0}", bar.energy, bar.energy_touched),
        bar.slowest_ms
    );
}

/// Means over the balls, each tracker beside algorithm 1, and the throws that only one of the two touched.
fn summary(bars: &[Bar], alone: &[[usize; 2]]) {
    let mean =
        |tracker: usize, f: &dyn Fn(&Bar) -> f64| mean(bars.iter().filter(|b| b.tracker == tracker).map(f));
    for (tracker, title) in TRACKERS.iter().enumerate() {
        let more = |f: &dyn Fn(&Bar) -> f64| mean(tracker, f) - mean(1, f);
        println!(
            "all, {title}: touched {:.0} %; over algorithm 1: touched {:+.0} points (it alone {}, 1 alone {} throws), missed by outliers {:+.0} points, energy {:+.0} %, of the touched {:+.0} %",
            mean(tracker, &|b| b.touched),
            more(&|b| b.touched),
            alone[tracker][0],
            alone[tracker][1],
            more(&|b| b.outliers),
            100.0 * more(&|b| b.energy) / mean(1, &|b| b.energy),
            100.0 * more(&|b| b.energy_touched) / mean(1, &|b| b.energy_touched),
        );
    }
    println!(
        "[Matl 2021], 2 over 1: touched +24 points, missed by outliers -29 points, energy -46 %, of the touched -51 %"
    );
}
