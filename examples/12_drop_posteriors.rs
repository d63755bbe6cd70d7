//! What three impacts of a dropped ball tell about its restitution and the chance in its directions: figure 4.5, beside the exact posterior.
//!
//! ```text
//! cargo run --release -p examples --example 12_drop_posteriors -- --small            800 simulations: seconds
//! cargo run --release -p examples --example 12_drop_posteriors -- --picture FILE.svg   6,000 simulations, 1,000 tests
//! ```
#![allow(clippy::print_stdout, reason = "an example prints what it measures")]

use bayes_sim::campaign::{Campaign, Shard, Simulator};
use bayes_sim::mdn::{Mdn, MdnSettings, MixtureDensity};
use bayes_sim::mdrff::{Mdrff, MdrffSettings};
use bayes_sim::posterior::Posterior;
use bayes_sim::simulations::Simulations;
use bounce_audio::drop::{DropError, each};
use bounce_audio::exact::{ExactModel, ExactPosterior, exact_posterior};
use bounce_audio::features::{Features, Observed, Scale};
use bounce_audio::posterior::{BOUNDS, DropSimulator, marginal_peak, prior, projected_product};
use std::error::Error;
use std::time::Instant;

type Failure = Box<dyn Error>;

/// A drop with the ball that made it.
type Drop = ([f64; 2], Features);

fn drops(simulator: &DropSimulator, count: usize, seed: u64) -> Result<Vec<Drop>, Failure> {
    let prior = prior()?;
    let drawn = each(count, seed, |_, rng| {
        let theta = prior.sample(rng);
        simulator.features(&theta, rng).map(|f| ([theta[0], theta[1]], f))
    });
    Ok(drawn.into_iter().collect::<Result<_, _>>()?)
}

fn simulations(simulator: &DropSimulator, count: usize) -> Result<Simulations, Failure> {
    let campaign = Campaign { prior: prior()?, x_dim: simulator.x_dim(), count, seed: 1 };
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("drops.csv");
    let results = campaign.run(simulator, Shard::WHOLE, &file, &|_, _| {}, &Default::default())?;
    Ok(results.simulations()?)
}

/// What a density comes to on the tests.
struct Score {
    off: [f64; 2],
    ln_density: f64,
    posterior_us: f64,
}

fn score(density: &dyn MixtureDensity, simulator: &DropSimulator, tests: &[Drop]) -> Result<Score, Failure> {
    let mut score = Score { off: [0.0; 2], ln_density: 0.0, posterior_us: 0.0 };
    let n = tests.len() as f64;
    for (theta, features) in tests {
        let x = features.numbers(simulator.observed, simulator.scale);
        let begin = Instant::now();
        let posterior = density.posterior(&x)?;
        score.posterior_us += 1e6 * begin.elapsed().as_secs_f64() / n;
        for (k, (off, truth)) in score.off.iter_mut().zip(theta).enumerate() {
            *off += (marginal_peak(&posterior, k)? - truth).abs() / n;
        }
        score.ln_density += posterior.ln_density(theta)? / n;
    }
    Ok(score)
}

fn main() -> Result<(), Failure> {
    let small = examples::small();
    let (train, tests) = if small { (800, 50) } else { (6_000, 1_000) };
    let simulator = DropSimulator::new();
    let tested = drops(&simulator, tests, 2)?;
    let model = exact_model(&simulator)?;

    println!(
        "figure 4.5: {train} simulations, {tests} tests; mean error of the marginals' peaks, and the mean log density at the truth (nats; what"
    );
    println!(
        "is missing to the exact posterior's is the mean Kullback-Leibler divergence). The numbers of [Matl 2021] are in a picture; its text says:"
    );
    println!("times tell more of e, positions more of kappa, both together most.\n");
    println!(
        "{:34} {:>8} {:>12} {:>10} {:>9} {:>9}",
        "features, density", "e", "log10 kappa", "ln q", "train s", "us each"
    );
    println!("{:34} {:>8.4} {:>12.3} {:>10.2}", "none: the prior's middle", 0.1, 1.0, (1.0f64 / 1.6).ln());
    let mut full: Option<Box<dyn MixtureDensity>> = None;
    for (name, observed, scale) in [
        ("times", Observed::Time, Scale::Metres),
        ("positions", Observed::Position, Scale::Metres),
        ("both (X of [Matl 2021])", Observed::Both, Scale::Metres),
        ("positions, logarithms", Observed::Position, Scale::Logarithms),
        ("both, logarithms", Observed::Both, Scale::Logarithms),
    ] {
        let simulator = DropSimulator { observed, scale, ..simulator };
        let data = simulations(&simulator, train)?;
        for kind in ["MDRFF", "MDN"] {
            if small && (kind == "MDRFF") != (name == "times") {
                continue;
            }
            let begin = Instant::now();
            let density = learn(kind, &data, small)?;
            let seconds = begin.elapsed().as_secs_f64();
            let Score { off, ln_density, posterior_us } = score(density.as_ref(), &simulator, &tested)?;
            println!(
                "{:34} {:>8.4} {:>12.3} {ln_density:>10.2} {seconds:>9.1} {posterior_us:>9.1}",
                format!("{name}, {kind}"),
                off[0],
                off[1]
            );
            full = Some(density);
        }
    }
    exact_line(&model, &tested)?;
    let density = full.ok_or("nothing was learned")?;
    let logarithms = DropSimulator { scale: Scale::Logarithms, ..simulator };
    let balls = joint(density.as_ref(), &logarithms, &model)?;
    if let Some(file) = examples::argument("--picture") {
        std::fs::write(&file, picture(&balls)?)?;
        println!("\ndrawn: {file}");
    }
    Ok(())
}

fn exact_model(simulator: &DropSimulator) -> Result<ExactModel, DropError> {
    let release = &simulator.release;
    ExactModel::new(release.position_m[2], release.velocity_sigma_m_s, simulator.gravity_m_s2)
}

fn learn(kind: &str, data: &Simulations, small: bool) -> Result<Box<dyn MixtureDensity>, Failure> {
    let prior = prior()?;
    Ok(if kind == "MDN" {
        let mut settings = MdnSettings::default();
        if small {
            (settings.members, settings.training.max_epochs) = (1, 60);
        }
        Box::new(Mdn::train(&prior, data, &settings, 1)?)
    } else {
        let mut settings = MdrffSettings::default();
        if small {
            settings.training.max_epochs = 30;
        }
        Box::new(Mdrff::train(&prior, data, &settings, 1)?)
    })
}

fn exact_line(model: &ExactModel, tested: &[Drop]) -> Result<(), Failure> {
    let begin = Instant::now();
    let scores = each(tested.len(), 0, |i, _| {
        let (theta, x) = &tested[i];
        let posterior = exact_posterior(model, &[*x], BOUNDS)?;
        let off = [0, 1].map(|k| (posterior.peak(k) - theta[k]).abs());
        Some((off, posterior.ln_density(model, &[*x], *theta)))
    });
    let scores: Vec<_> = scores.into_iter().flatten().collect();
    let n = scores.len() as f64;
    let off = |k: usize| scores.iter().map(|s| s.0[k]).sum::<f64>() / n;
    let each_us = 1e6 * begin.elapsed().as_secs_f64() / n;
    println!(
        "{:34} {:>8.5} {:>12.3} {:>10.2} {:>9} {each_us:>9.0}",
        "both, exact",
        off(0),
        off(1),
        scores.iter().map(|s| s.1).sum::<f64>() / n,
        "-"
    );
    if scores.len() < tested.len() {
        return Err(format!("{} drops have no exact posterior", tested.len() - scores.len()).into());
    }
    Ok(())
}

/// A ball that was dropped a hundred times.
struct Ball {
    name: &'static str,
    theta: [f64; 2],
    one: Posterior,
    learned: Posterior,
    exact: ExactPosterior,
}

/// The joint posteriors of 100 drops.
fn joint(
    density: &dyn MixtureDensity,
    simulator: &DropSimulator,
    model: &ExactModel,
) -> Result<Vec<Ball>, Failure> {
    println!("\n100 drops of one ball: mean +- sigma");
    println!(
        "{:26} {:>22} {:>22} {:>26} {:>22}",
        "ball", "e, Gaussian product", "log10 kappa", "e, exact", "log10 kappa, exact"
    );
    let mut balls = Vec::new();
    let named = [
        ("tennis-like", [0.75, 3.3]),
        ("ping-pong-like", [0.87, 3.8]),
        ("moon-like", [0.85, 2.2]),
        ("ping-pong on asphalt", [0.72, 1.8]),
    ];
    for (seed, (name, theta)) in (50..).zip(named) {
        let drops: Result<Vec<Features>, _> =
            each(100, seed, |_, rng| simulator.features(&theta, rng)).into_iter().collect();
        let drops = drops?;
        let posteriors: Result<Vec<Posterior>, _> = drops
            .iter()
            .map(|f| density.posterior(&f.numbers(simulator.observed, simulator.scale)))
            .collect();
        let posteriors = posteriors?;
        let learned = projected_product(&posteriors)?;
        let exact = exact_posterior(model, &drops, BOUNDS).ok_or("no ball of the prior drops so")?;
        let (mean, c) = (learned.mixture().mean(), learned.mixture().covariance());
        let (m, s) = (exact.mean(), exact.sigma());
        println!(
            "{:26} {:>22} {:>22} {:>26} {:>22}",
            format!("{name} ({}, {})", theta[0], theta[1]),
            format!("{:.5} +- {:.5}", mean[0], c[0].sqrt()),
            format!("{:.3} +- {:.3}", mean[1], c[3].sqrt()),
            format!("{:.6} +- {:.6}", m[0], s[0]),
            format!("{:.3} +- {:.3}", m[1], s[1])
        );
        let one = posteriors.into_iter().next().ok_or("no drop")?;
        balls.push(Ball { name, theta, one, learned, exact });
    }
    Ok(balls)
}

/// Posteriors of one drop and of a hundred, the truth marked.
fn picture(balls: &[Ball]) -> Result<String, Failure> {
    use std::fmt::Write;
    const COLOURS: [&str; 4] = ["#1b7837", "#d95f02", "#2166ac", "#762a83"];
    let (width, height) = (420.0, 360.0);
    let across = |e: f64, left: f64| left + width * (e - BOUNDS[0][0]) / (BOUNDS[0][1] - BOUNDS[0][0]);
    let up = |k: f64| 60.0 + height * (BOUNDS[1][1] - k) / (BOUNDS[1][1] - BOUNDS[1][0]);
    let mut svg = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' width='1000' height='480' font-family='sans-serif' font-size='13'><rect width='1000' height='480' fill='white'/>",
    );
    for (panel, title) in [(0, "one drop"), (1, "a hundred drops (exact: +)")] {
        let left = 60.0 + 490.0 * f64::from(panel);
        write!(
            svg,
            "<text x='{left}' y='40'>{title}</text><rect x='{left}' y='60' width='{width}' height='{height}' fill='none' stroke='black'/>"
        )?;
        for i in 0..5 {
            let (e, k) = (0.55 + 0.1 * f64::from(i), 1.0 + f64::from(i));
            write!(
                svg,
                "<text x='{:.0}' y='438' text-anchor='middle'>{e:.2}</text><text x='{:.0}' y='{:.0}' text-anchor='end'>{k}</text>",
                across(e, left),
                left - 6.0,
                up(k) + 4.0
            )?;
        }
        write!(
            svg,
            "<text x='{:.0}' y='460' text-anchor='middle'>restitution e</text><text x='{:.0}' y='54' text-anchor='end'>log10 kappa</text>",
            left + 0.5 * width,
            left + 20.0
        )?;
        for (ball, colour) in balls.iter().zip(COLOURS) {
            let posterior = if panel == 0 { &ball.one } else { &ball.learned };
            let (mean, c) = (posterior.mixture().mean(), posterior.mixture().covariance());
            // The ellipse of two standard deviations.
            let (a, b, d) = (c[0], c[1], c[3]);
            let points: Vec<String> = (0..48)
                .map(|i| {
                    let (sin, cos) = (f64::from(i) / 48.0 * std::f64::consts::TAU).sin_cos();
                    let e = mean[0] + 2.0 * a.sqrt() * cos;
                    let k = mean[1] + 2.0 * (b / a.sqrt() * cos + (d - b * b / a).max(0.0).sqrt() * sin);
                    let [e, k] = [e.clamp(BOUNDS[0][0], BOUNDS[0][1]), k.clamp(BOUNDS[1][0], BOUNDS[1][1])];
                    format!("{:.1},{:.1}", across(e, left), up(k))
                })
                .collect();
            write!(
                svg,
                "<polygon points='{}' fill='{colour}' fill-opacity='0.25' stroke='{colour}'/><circle cx='{:.1}' cy='{:.1}' r='3' fill='black'/>",
                points.join(" "),
                across(ball.theta[0], left),
                up(ball.theta[1])
            )?;
            if panel == 1 {
                let m = ball.exact.mean();
                write!(
                    svg,
                    "<text x='{:.1}' y='{:.1}' text-anchor='middle'>+</text><text x='{:.1}' y='{:.1}' fill='{colour}'>{}</text>",
                    across(m[0], left),
                    up(m[1]) + 4.0,
                    across(m[0], left) + 12.0,
                    up(m[1]) - 8.0,
                    ball.name
                )?;
            }
        }
    }
    svg.push_str("</svg>\n");
    Ok(svg)
}
