//! A paddle meets a ball that it only hears: figure 4.7, the straight-line baseline against predictions with chance, three balls.
//!
//! ```text
//! cargo run --release -p examples --example 14_tracking -- --small              4 throws a ball
//! cargo run --release -p examples --example 14_tracking -- --picture FILE.svg   30 throws a ball, and the same with phase correlation
//! cargo run --release -p examples --example 14_tracking -- --harsh              30 throws a ball in a worse room, by peak times
//! ```
#![allow(clippy::print_stdout, reason = "an example prints what it measures")]

use bounce_audio::drop::each;
use bounce_audio::fake::{Court, CourtSettings, FakeBall, Room, Toss, Verdict};
use bounce_audio::hear::HearSettings;
use bounce_audio::listen::{Delays, Listener};
use bounce_audio::track::{
    Deterministic, NextBounce, NextSettings, Played, Player, Stochastic, StochasticSettings, Tracker,
    Workspace, play,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::error::Error;

type Failure = Box<dyn Error + Send + Sync>;

const SPACE: Workspace =
    Workspace { plane_x_m: 0.55, y_m: [-0.05, 0.6], z_m: [0.02, 0.5], rest_z_m: 0.1, gravity_m_s2: 9.80665 };
/// A place heard this far from the truth is an outlier, m.
const OUTLIER_M: f64 = 0.03;

struct Ball {
    name: &'static str,
    restitution: f64,
    log10_kappa: f64,
    speed_m_s: f64,
    /// Impacts to look ahead.
    ahead: usize,
}

const BALLS: [Ball; 3] = [
    Ball { name: "tennis", restitution: 0.76, log10_kappa: 3.3, speed_m_s: 0.75, ahead: 3 },
    Ball { name: "ping-pong", restitution: 0.87, log10_kappa: 3.8, speed_m_s: 0.55, ahead: 4 },
    Ball { name: "moon", restitution: 0.85, log10_kappa: 2.2, speed_m_s: 0.6, ahead: 2 },
];

/// Where the table stands.
struct Place {
    name: &'static str,
    size_m: [f64; 3],
    /// The table's origin in the room, m.
    table_m: [f64; 3],
    rt60_s: f64,
}

const LIVING_ROOM: Place = Place {
    name: "a living room, echo of 0.3 s",
    size_m: [4.0, 5.0, 2.7],
    table_m: [1.7, 2.2, 0.75],
    rt60_s: 0.3,
};

/// A worse one: two walls 30 cm from the table, which echo for longer.
const CORNER: Place =
    Place { name: "in a corner, echo of 0.5 s", table_m: [0.3, 0.3, 0.75], rt60_s: 0.5, ..LIVING_ROOM };

impl Place {
    fn room(&self) -> Result<Room, Failure> {
        let home = Court::living_room(0.3)?;
        let (c, rate_hz) = (home.speed_m_s(), home.rate_hz());
        Ok(Room::new(self.size_m, self.table_m, self.rt60_s, c, home.microphones_m(), rate_hz)?)
    }
}

/// One throw with one algorithm.
struct Outcome {
    verdict: Verdict,
    /// Whether one of its impacts was heard far from the truth, or not at all.
    outlier: bool,
    energy: f64,
    slowest_s: f64,
    decided: usize,
}

/// What a ball's throws came to with one algorithm.
struct Bar {
    ball: &'static str,
    algorithm: usize,
    touched: f64,
    outliers: f64,
    missed: f64,
    energy: f64,
}

impl Bar {
    /// Shares in per cent and the mean energy of the throws that came within reach.
    fn of(ball: &'static str, algorithm: usize, outcomes: &[&Outcome]) -> Self {
        let within: Vec<&&Outcome> = outcomes.iter().filter(|o| o.verdict != Verdict::Out).collect();
        let n = within.len().max(1) as f64;
        let share = |f: &dyn Fn(&Outcome) -> bool| 100.0 * within.iter().filter(|o| f(o)).count() as f64 / n;
        let missed = |o: &Outcome| o.verdict != Verdict::Touched;
        Self {
            ball,
            algorithm,
            touched: share(&|o| !missed(o)),
            outliers: share(&|o| missed(o) && o.outlier),
            missed: share(&|o| missed(o) && !o.outlier),
            energy: 1e4 * within.iter().map(|o| o.energy).sum::<f64>() / n,
        }
    }
}

fn main() -> Result<(), Failure> {
    let small = examples::small();
    let throws = if small { 4 } else { 30 };
    let harsh = std::env::args().any(|a| a == "--harsh");
    let place = if harsh { &CORNER } else { &LIVING_ROOM };
    let listeners: &[(&str, Delays)] = if small || harsh {
        &[("peak times, as in [Matl 2021]", Delays::Peaks)]
    } else {
        &[("peak times, as in [Matl 2021]", Delays::Peaks), ("phase correlation", Delays::Phase)]
    };
    let mut bars = Vec::new();
    for &listener in listeners {
        bars.push(compare(place, listener, throws, small)?);
    }
    if let Some(file) = std::env::args().skip_while(|a| a != "--picture").nth(1) {
        std::fs::write(&file, picture(&bars[0])?)?;
        println!("\ndrawn: {file}");
    }
    Ok(())
}

fn compare(
    place: &Place,
    (name, delays): (&str, Delays),
    throws: usize,
    small: bool,
) -> Result<Vec<Bar>, Failure> {
    println!(
        "\nfigure 4.7, {name}: {throws} throws a ball, {}, the same throws for both algorithms",
        place.name
    );
    println!(
        "{:10} {:28} {:>8} {:>18} {:>8} {:>5} {:>16} {:>12}",
        "ball",
        "algorithm",
        "touched",
        "missed by outliers",
        "missed",
        "out",
        "energy, cm^2/s",
        "slowest, ms"
    );
    let mut bars = Vec::new();
    for ball in &BALLS {
        let next = learned(ball, small)?;
        let outcomes: Result<Vec<[Outcome; 3]>, Failure> = each(throws, 15, |i, _| {
            let with = |touch_m| throw(place, ball, Some((&next, touch_m)), delays, i as u64);
            // A ball is touched within the paddle's radius and its own.
            Ok([throw(place, ball, None, delays, i as u64)?, with(0.0)?, with(0.07)?])
        })
        .into_iter()
        .collect();
        let outcomes = outcomes?;
        for (algorithm, title) in
            ["1, straight on", "2, with chance", "2, no farther than needed"].into_iter().enumerate()
        {
            let all: Vec<&Outcome> = outcomes.iter().map(|o| &o[algorithm]).collect();
            let bar = Bar::of(ball.name, algorithm, &all);
            let slowest = 1e3 * all.iter().map(|o| o.slowest_s).fold(0.0, f64::max);
            println!(
                "{:10} {title:28} {:>6.0} % {:>16.0} % {:>6.0} % {:>5} {:>16.1} {slowest:>12.2}",
                bar.ball,
                bar.touched,
                bar.outliers,
                bar.missed,
                all.iter().filter(|o| o.verdict == Verdict::Out).count(),
                bar.energy
            );
            bars.push(bar);
        }
        let decided: usize = outcomes.iter().flatten().map(|o| o.decided).sum();
        if decided == 0 {
            println!("{:10} no impact was heard", ball.name);
        }
    }
    let mean = |algorithm: usize, f: &dyn Fn(&Bar) -> f64| {
        bars.iter().filter(|b| b.algorithm == algorithm).map(f).sum::<f64>() / BALLS.len() as f64
    };
    for (algorithm, title) in [(1, "2 over 1"), (2, "2, no farther than needed, over 1")] {
        let more = |f: &dyn Fn(&Bar) -> f64| mean(algorithm, f) - mean(0, f);
        println!(
            "{title}: touched {:+.0} points, missed by outliers {:+.0} points, energy {:+.0} %",
            more(&|b| b.touched),
            more(&|b| b.outliers),
            100.0 * more(&|b| b.energy) / mean(0, &|b| b.energy)
        );
    }
    println!("[Matl 2021], 2 over 1: touched +24 points, missed by outliers -29 points, energy -46 %");
    Ok(bars)
}

/// The density of the next impact, from a posterior as 100 drops leave it.
fn learned(ball: &Ball, small: bool) -> Result<NextBounce, Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut settings = NextSettings::default();
    if small {
        settings.simulations = 2_000;
        settings.network.training.max_epochs = 40;
    }
    let balls: Vec<[f64; 2]> = (0..200)
        .map(|_| {
            let [a, b]: [f64; 2] = std::array::from_fn(|_| rng.sample(StandardNormal));
            [ball.restitution + 3e-3 * a, ball.log10_kappa + 0.05 * b]
        })
        .collect();
    Ok(NextBounce::learn(&balls, SPACE.gravity_m_s2, &settings, 2)?)
}

fn throw(
    place: &Place,
    ball: &Ball,
    next: Option<(&NextBounce, f64)>,
    delays: Delays,
    seed: u64,
) -> Result<Outcome, Failure> {
    let room = place.room()?;
    let microphones = room.microphones_m().to_vec();
    let (rate_hz, speed) = (room.rate_hz(), room.speed_m_s());
    let real = FakeBall::new(ball.restitution + 0.01, 10f64.powf(ball.log10_kappa));
    let mut court = Court::new(room, real, CourtSettings::default(), 1000 + seed);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mean = Toss { place_m: [0.03, 0.275, 0.27], velocity_m_s: [ball.speed_m_s, 0.0, 0.0] };
    court.toss(&Toss::draw(&mean, 0.015, 0.05, &mut rng));
    let mut listener = Listener::new(&microphones, rate_hz, speed, &HearSettings::default(), delays)?;
    let played = match next {
        None => run(&mut court, &mut listener, &mut Deterministic::new(ball.restitution, SPACE), &mut rng)?,
        Some((next, touch_m)) => {
            let settings = StochasticSettings { ahead: ball.ahead, touch_m, ..StochasticSettings::default() };
            run(&mut court, &mut listener, &mut Stochastic::new(next.clone(), SPACE, settings), &mut rng)?
        }
    };
    let truth: Vec<(f64, [f64; 3])> =
        court.impact_times_s().zip(&court.truth().touchdowns).map(|(t, d)| (t, d.place_m)).collect();
    let near = |t_s: f64| truth.iter().min_by(|a, b| (a.0 - t_s).abs().total_cmp(&(b.0 - t_s).abs()));
    let far = played.impacts.iter().any(|heard| {
        near(heard.t_s).is_none_or(|(t, place)| {
            let off = (heard.place_m[0] - place[0]).hypot(heard.place_m[1] - place[1]);
            off > OUTLIER_M || (heard.t_s - t).abs() > 0.02
        })
    });
    Ok(Outcome {
        verdict: court.verdict(),
        outlier: far || played.impacts.len() < truth.len(),
        energy: played.energy_m2_s,
        slowest_s: played.slowest_s,
        decided: played.goals.len(),
    })
}

fn run<T: Tracker>(
    court: &mut Court,
    listener: &mut Listener,
    tracker: &mut T,
    rng: &mut ChaCha8Rng,
) -> Result<Played, Failure> {
    let mut player = Player { listener, tracker, plane_x_m: SPACE.plane_x_m, buffer: 485 };
    Ok(play(court, &mut player, Court::is_over, rng)?)
}

/// Success and failures, and energy, as in figure 4.7.
fn picture(bars: &[Bar]) -> Result<String, Failure> {
    use std::fmt::Write;
    let mut svg = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' width='900' height='360' font-family='sans-serif' font-size='13'><rect width='900' height='360' fill='white'/><text x='50' y='30'>share of the throws: touched (green), missed by outliers (orange), missed (grey)</text><text x='560' y='30'>energy of the paddle, cm^2/s</text>",
    );
    let most = bars.iter().map(|b| b.energy).fold(1e-9, f64::max);
    for (i, bar) in bars.iter().enumerate() {
        let x = 40.0 + 56.0 * i as f64;
        let mut y = 300.0;
        for (share, colour) in [(bar.touched, "#2ca02c"), (bar.outliers, "#ff7f0e"), (bar.missed, "#999")] {
            let h = 2.4 * share;
            y -= h;
            write!(svg, "<rect x='{x}' y='{y:.1}' width='44' height='{h:.1}' fill='{colour}'/>")?;
        }
        let h = 240.0 * bar.energy / most;
        let right = 570.0 + 36.0 * i as f64;
        let colour = ["#d62728", "#1f77b4", "#17becf"][bar.algorithm];
        write!(
            svg,
            "<text x='{x}' y='318'>{}</text><text x='{x}' y='334'>{}</text><rect x='{right}' y='{:.1}' width='28' height='{h:.1}' fill='{colour}'/><text x='{right}' y='318'>{}</text><text x='{right}' y='334'>{}</text>",
            bar.ball.get(..4).unwrap_or(bar.ball),
            ["1", "2", "2 needed"][bar.algorithm],
            300.0 - h,
            bar.ball.get(..4).unwrap_or(bar.ball),
            ["1", "2", "n"][bar.algorithm]
        )?;
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}
