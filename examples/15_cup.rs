//! Where to drop a ball so that it bounces off a tilted table into a cup: figure 4.6, for two balls whose parameters are inferred from the
//! sound's times and places of a hundred drops, and then tried on the balls themselves.
//!
//! ```text
//! cargo run --release -p examples --example 15_cup -- --small              a coarse map, few drops
//! cargo run --release -p examples --example 15_cup -- --picture FILE.svg
//! ```
#![allow(clippy::print_stdout, reason = "an example prints what it measures")]

use bayes_sim::mdn::MixtureDensity;
use bayes_sim::posterior::Posterior;
use bounce_audio::cup::{Cup, Scene};
use bounce_audio::drop::{Ball, Bounce, Release, each};
use bounce_audio::fake::FakeBall;
use bounce_audio::features::Features;
use bounce_audio::posterior::{DROP_HEIGHT_M, DropSimulator};
use examples::drops::{joint, learn, simulator};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::error::Error;

type Failure = Box<dyn Error + Send + Sync>;

struct Real {
    name: &'static str,
    ball: FakeBall,
    /// Successes of 100 in [Matl 2021], on its robot.
    published: &'static str,
}

/// How much of it is done.
struct Size {
    train: usize,
    along: usize,
    across: usize,
    drops: usize,
    trials: usize,
}

/// A ball's map, and where it was dropped.
struct Mapped {
    name: &'static str,
    shares: Vec<f64>,
    best: usize,
}

fn main() -> Result<(), Failure> {
    let size = if examples::small() {
        Size { train: 1_500, along: 24, across: 7, drops: 50, trials: 10 }
    } else {
        Size { train: 6_000, along: 72, across: 37, drops: 100, trials: 30 }
    };
    // Asperities are in none of the models; nor is drag, or restitution that falls with speed, which the first ball is spared.
    let plain = FakeBall { slope_s_m: 0.0, drag_per_m: 0.0, ..FakeBall::new(0.87, 6e3) };
    let reals = [
        Real { name: "without drag", ball: plain, published: "-" },
        Real {
            name: "ping-pong",
            ball: FakeBall { drag_per_m: 0.1, ..FakeBall::new(0.88, 6e3) },
            published: "75",
        },
        Real {
            name: "moon",
            ball: FakeBall { drag_per_m: 0.02, ..FakeBall::new(0.85, 200.0) },
            published: "35",
        },
    ];
    let simulator = simulator();
    let density = learn(&simulator, size.train)?;
    println!(
        "{:12} {:>20} {:>20} {:>16} {:>24} {:>22} {:>12}",
        "ball", "e", "log10 kappa", "drop at x, m", "foretold, of 100", "fell in, of 1000", "Matl 2021"
    );
    let releases = releases(&size);
    let mut maps = Vec::new();
    for (seed, real) in (1..).zip(&reals) {
        let posterior = infer(density.as_ref(), &simulator, &real.ball, seed)?;
        let (mean, c) = (posterior.mixture().mean(), posterior.mixture().covariance());
        let scene = Scene::thesis(Ball::new(mean[0], 10f64.powf(mean[1]))?, real.ball.radius_m)?;
        let shares = scene.map(&releases, size.drops, seed);
        let best = (0..shares.len()).fold(0, |b, i| if shares[i] > shares[b] { i } else { b });
        let (foretold, spread) =
            foretell(&posterior, real.ball.radius_m, &releases[best], size.trials, seed)?;
        let fell = try_out(&real.ball, &scene, &releases[best], 1_000, seed);
        println!(
            "{:10} {:>20} {:>20} {:>16.3} {:>24} {:>22} {:>12}",
            real.name,
            format!("{:.4} +- {:.4}", mean[0], c[0].sqrt()),
            format!("{:.2} +- {:.2}", mean[1], c[3].sqrt()),
            releases[best].position_m[0],
            format!("{foretold:.1} +- {spread:.1}"),
            format!("{fell} ({:.1} %)", 0.1 * fell as f64),
            real.published
        );
        maps.push(Mapped { name: real.name, shares, best });
    }
    println!(
        "\n[Matl 2021] dropped where its gripper was; here the ball is dropped where the map is highest, so the shares are not the same numbers."
    );
    if let Some(file) = examples::argument("--picture") {
        let scene = Scene::thesis(Ball::new(0.8, 1e3)?, 0.02)?;
        std::fs::write(&file, picture(&maps, &releases, scene.cup(), &size)?)?;
        println!("drawn: {file}");
    }
    Ok(())
}

/// Places over the table, 26 cm above its middle's height.
fn releases(size: &Size) -> Vec<Release> {
    let part = |i: usize, n: usize| (i as f64 + 0.5) / n as f64 - 0.5;
    let place = |n: usize| {
        let (x, y) = (part(n % size.along, size.along), part(n / size.along, size.across));
        Release { position_m: [0.54 * x, 0.27 * y, DROP_HEIGHT_M], ..Release::at(DROP_HEIGHT_M) }
    };
    (0..size.along * size.across).map(place).collect()
}

/// The joint posterior of 100 drops of the real ball on a level table.
fn infer(
    density: &dyn MixtureDensity,
    simulator: &DropSimulator,
    real: &FakeBall,
    seed: u64,
) -> Result<Posterior, Failure> {
    let drops = each(100, seed, |_, rng| {
        let start = simulator.release.draw(rng);
        let centre = [start.position_m[0], start.position_m[1], start.position_m[2] + real.radius_m];
        let flown = real.fly(centre, start.velocity_m_s, [0.0, 0.0, 1.0], 3.0, |_, _| false, rng);
        let mut impacts: Vec<Bounce> =
            flown.touchdowns.iter().map(|t| Bounce { t_s: t.t_s, position_m: t.place_m }).collect();
        simulator.hearing.blur(&mut impacts, rng);
        Features::of(&impacts)
    });
    let drops: Result<Vec<Features>, _> = drops.into_iter().collect();
    joint(density, simulator, &drops?)
}

/// Successes of 100 for balls drawn from the posterior: mean and standard deviation, as in [Matl 2021].
fn foretell(
    posterior: &Posterior,
    radius_m: f64,
    release: &Release,
    trials: usize,
    seed: u64,
) -> Result<(f64, f64), Failure> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut counts = Vec::with_capacity(trials);
    for (i, theta) in (0..).zip(posterior.sample(trials, &mut rng).theta.rows()) {
        let scene = Scene::thesis(Ball::new(theta[0], 10f64.powf(theta[1]))?, radius_m)?;
        counts.push(scene.successes(release, 100, seed + 1000 * i) as f64);
    }
    let n = counts.len() as f64;
    let mean = counts.iter().sum::<f64>() / n;
    Ok((mean, (counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0)).sqrt()))
}

/// Drops the real ball.
fn try_out(real: &FakeBall, scene: &Scene, release: &Release, count: usize, seed: u64) -> usize {
    let (normal, cup) = (*scene.model().table().normal(), *scene.cup());
    let fell = each(count, 77 + seed, |_, rng| {
        let start = release.draw(rng);
        let centre = std::array::from_fn(|k| start.position_m[k] + real.radius_m * normal[k]);
        let (mut last, mut inside) = (centre, false);
        let over = |_: f64, p: [f64; 3]| {
            let beside = p[0] > 0.275 && last[2] >= cup.rim_z_m && p[2] < cup.rim_z_m;
            if beside {
                let off = (p[0] - cup.centre_m[0]).hypot(p[1] - cup.centre_m[1]);
                inside = off <= cup.radius_m - real.radius_m;
            }
            last = p;
            beside || p[0] > 1.0
        };
        real.fly(centre, start.velocity_m_s, normal, 3.0, over, rng);
        usize::from(inside)
    });
    fell.into_iter().sum()
}

/// The maps, table from above, dark where more balls fall in; the place that was tried is marked.
fn picture(maps: &[Mapped], releases: &[Release], cup: &Cup, size: &Size) -> Result<String, Failure> {
    use std::fmt::Write;
    let scale = 800.0;
    let (width, height) = (760.0, 60.0 + 300.0 * maps.len() as f64);
    let mut svg = format!(
        "<svg xmlns='http://www.w3.org/2000/svg' width='{width}' height='{height}' font-family='sans-serif' font-size='13'><rect width='{width}' height='{height}' fill='white'/>"
    );
    let (dx, dy) = (0.54 / size.along as f64 * scale, 0.27 / size.across as f64 * scale);
    for (row, map) in maps.iter().enumerate() {
        let (left, middle) = (260.0, 190.0 + 300.0 * row as f64);
        let at = |p: [f64; 2]| (left + scale * p[0], middle - scale * p[1]);
        write!(
            svg,
            "<text x='30' y='{:.0}'>{}: share of the balls that fall in, by where they are let go; most {:.0} % at the red point; the circle is the cup</text>",
            middle - 130.0,
            map.name,
            100.0 * map.shares[map.best]
        )?;
        for (release, share) in releases.iter().zip(&map.shares) {
            let (x, y) = at([release.position_m[0], release.position_m[1]]);
            let grey = (255.0 * (1.0 - share)).round();
            write!(
                svg,
                "<rect x='{:.1}' y='{:.1}' width='{dx:.2}' height='{dy:.2}' fill='rgb({grey},{grey},{:.0})'/>",
                x - 0.5 * dx,
                y - 0.5 * dy,
                255.0 - 0.6 * (255.0 - grey)
            )?;
        }
        let (x, y) = at([releases[map.best].position_m[0], releases[map.best].position_m[1]]);
        let (u, v) = at(cup.centre_m);
        let (a, b) = at([-0.27, 0.135]);
        write!(
            svg,
            "<rect x='{a:.1}' y='{b:.1}' width='{:.1}' height='{:.1}' fill='none' stroke='#888'/><circle cx='{x:.1}' cy='{y:.1}' r='4' fill='#d62728'/><circle cx='{u:.1}' cy='{v:.1}' r='{:.1}' fill='none' stroke='black'/>",
            0.54 * scale,
            0.27 * scale,
            cup.radius_m * scale
        )?;
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}
