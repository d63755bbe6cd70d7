//! Bounces: drops a second, an onset per buffer, delays and place of an event, a posterior and its training, a decision; quality printed
//! beside.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::error::Error;
use std::hint::black_box;

use bayes_sim::campaign::Simulator;
use bayes_sim::mdn::{Mdn, MdnSettings, MixtureDensity};
use bayes_sim::points::Points;
use bayes_sim::simulations::Simulations;
use bounce_audio::drop::{Ball, DropModel, Release, Table, drops};
use bounce_audio::exact::{ExactModel, exact_posterior};
use bounce_audio::fake::{Burst, Court};
use bounce_audio::features::Scale;
use bounce_audio::hear::HearSettings;
use bounce_audio::listen::{Delays, Listener, Sounded};
use bounce_audio::localise::Localiser;
use bounce_audio::onset::{OnsetSettings, OnsetStream};
use bounce_audio::posterior::{BOUNDS, DropSimulator, prior};
use bounce_audio::track::{
    FilterSettings, NextBounce, NextSettings, ParticleFilter, Seen, Stochastic, StochasticSettings, Tracker,
    Workspace,
};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const RATE_HZ: f64 = 44_100.0;
/// 11 ms.
const BUFFER: usize = 485;
const DROPS: usize = 20_000;

fn bounce(c: &mut Criterion) {
    if let Err(error) = simulation(c).and_then(|()| hearing(c)).and_then(|()| inference(c)) {
        println!("not measured: {error}");
    }
}

fn simulation(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let model = DropModel::new(Ball::new(0.8, 1e3)?, Table::LEVEL, 9.80665)?;
    let release = Release::at(0.26);
    let begin = std::time::Instant::now();
    let (rounds, mut impacts) = (20, 0);
    for seed in 0..rounds {
        impacts +=
            drops::<4>(&model, &release, DROPS, seed)?.iter().map(|t| t.bounces().len()).sum::<usize>();
    }
    let a_second = f64::from(rounds as u32) * DROPS as f64 / begin.elapsed().as_secs_f64();
    println!("bounce: {a_second:.0} four-bounce drops a second ({impacts} impacts)");
    let mut group = c.benchmark_group("bounce");
    group.throughput(Throughput::Elements(DROPS as u64));
    group.bench_function("drops/20000x4", |b| b.iter(|| drops::<4>(&model, black_box(&release), DROPS, 1)));
    group.finish();
    Ok(())
}

fn hearing(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let room = Court::living_room(0.3)?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut channels = vec![vec![0.0; 22_050]; 3];
    let (place, at_s) = ([0.2, 0.3, 0.0], 0.25);
    room.strike(place, at_s, &Burst::new(0.03, &mut rng), &mut channels);
    for v in channels.iter_mut().flatten() {
        *v += 1e-3 * Distribution::<f64>::sample(&StandardNormal, &mut rng);
    }
    let start = (at_s * RATE_HZ) as usize - 40;
    let cut: Vec<&[f64]> = channels.iter().map(|x| &x[start..start + BUFFER]).collect();
    let microphones = room.microphones_m();
    let mut localiser = Localiser::new(microphones, RATE_HZ, 343.0, BUFFER)?;
    let found = localiser.locate(&cut)?;
    let off = (found.x_m - place[0]).hypot(found.y_m - place[1]);
    println!("bounce/localise: {:.2} mm off", 1e3 * off);
    let delays = localiser.delays_s(&cut)?;
    let straight =
        microphones.iter().map(|m| (0..3).map(|k| (m[k] - place[k]).powi(2)).sum::<f64>().sqrt() / 343.0);
    let true_s: Vec<f64> = straight.collect();
    let mean = true_s.iter().sum::<f64>() / true_s.len() as f64;
    let worst = delays.iter().zip(&true_s).map(|(d, t)| (d - t + mean).abs()).fold(0.0, f64::max);
    println!("bounce/gcc_phat: delays {:.1} us off at most", 1e6 * worst);
    c.bench_function("bounce/gcc_phat/3x485", |b| {
        b.iter(|| localiser.delays_s(black_box(&cut)).map(<[f64]>::len))
    });
    c.bench_function("bounce/localise/3x485", |b| b.iter(|| localiser.locate(black_box(&cut))));
    let mut pair = Localiser::new(&microphones[..3], RATE_HZ, 343.0, 2 * BUFFER)?;
    let long: Vec<&[f64]> = channels.iter().map(|x| &x[start..start + 2 * BUFFER]).collect();
    c.bench_function("bounce/localise/3x970", |b| b.iter(|| pair.locate(black_box(&long))));

    let interleaved: Vec<f32> = (0..22_050).flat_map(|i| channels.iter().map(move |x| x[i] as f32)).collect();
    let mut stream = OnsetStream::new(3, RATE_HZ, OnsetSettings::default(), 5e-3)?;
    let buffers: Vec<&[f32]> = interleaved.chunks_exact(3 * BUFFER).collect();
    let (mut k, mut onsets) = (0, 0);
    c.bench_function("bounce/onset/buffer_of_3x485", |b| {
        b.iter(|| {
            let t = k as f64 * BUFFER as f64 / RATE_HZ;
            k += 1;
            stream.push(t, black_box(buffers[k % buffers.len()]), |_, _| onsets += 1)
        });
    });
    println!("bounce/onset: {onsets} onsets in {k} buffers, one in {} true", buffers.len());
    let mut listener = Listener::new(microphones, RATE_HZ, 343.0, &HearSettings::default(), Delays::Phase)?;
    let (mut k, mut placed) = (0, 0);
    c.bench_function("bounce/listen/buffer_of_3x485", |b| {
        b.iter(|| {
            let t = k as f64 * BUFFER as f64 / RATE_HZ;
            k += 1;
            listener.push(t, black_box(buffers[k % buffers.len()]), |s| {
                placed += usize::from(matches!(s, Sounded::Impact(_)));
            })
        });
    });
    println!("bounce/listen: {placed} impacts in {k} buffers");
    Ok(())
}

fn inference(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let simulator = DropSimulator { scale: Scale::Logarithms, ..DropSimulator::new() };
    let prior = prior()?;
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let (mut theta, mut x) = (Points::new(2), Points::new(simulator.x_dim()));
    for _ in 0..6_000 {
        let t = prior.sample(&mut rng);
        x.push(&simulator.simulate(&t, &mut rng)?)?;
        theta.push(&t)?;
    }
    let data = Simulations::new(theta, x)?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let settings = MdnSettings::default();
    let mut group = c.benchmark_group("bounce/train");
    group.sample_size(10);
    group.bench_function("mdn/6000", |b| {
        b.iter(|| one.install(|| Mdn::train(&prior, black_box(&data), &settings, 1)));
    });
    group.finish();
    let density = Mdn::train(&prior, &data, &settings, 1)?;
    let features = simulator.features(&[0.8, 3.0], &mut rng)?;
    let numbers = features.numbers(simulator.observed, simulator.scale);
    c.bench_function("bounce/posterior/mdn", |b| b.iter(|| density.posterior(black_box(&numbers))));
    let release = &simulator.release;
    let exact = ExactModel::new(release.position_m[2], release.velocity_sigma_m_s, simulator.gravity_m_s2)?;
    c.bench_function("bounce/posterior/exact", |b| {
        b.iter(|| exact_posterior(&exact, &[black_box(features)], BOUNDS));
    });

    let next = NextBounce::learn(&[[0.85, 3.0]], 9.80665, &NextSettings::default(), 1)?;
    let space = Workspace {
        plane_x_m: 0.55,
        y_m: [0.0, 0.55],
        z_m: [0.02, 0.5],
        rest_z_m: 0.1,
        gravity_m_s2: 9.80665,
    };
    let [a, b] = [(0.0, [0.05, 0.2]), (0.36, [0.17, 0.22])].map(|(t_s, place_m)| Seen { t_s, place_m });
    for ahead in [2, 4] {
        let settings = StochasticSettings { ahead, ..StochasticSettings::default() };
        let mut tracker = Stochastic::new(next.clone(), space, settings);
        c.bench_function(&format!("bounce/decision/10^{ahead}"), |bench| {
            bench.iter(|| {
                tracker.begin();
                tracker.heard(&a, [0.275, 0.1], &mut rng);
                tracker.heard(black_box(&b), [0.275, 0.1], &mut rng)
            });
        });
    }
    let mut filter = ParticleFilter::new(&[[0.85, 3.0]; 300], space, FilterSettings::default())?;
    let goal = |filter: &mut ParticleFilter, rng: &mut ChaCha8Rng| {
        filter.begin();
        filter.heard(&a, [0.275, 0.1], rng);
        filter.heard(black_box(&b), [0.275, 0.1], rng)
    };
    println!("bounce/decisions/filter: {:?}", goal(&mut filter, &mut rng));
    c.bench_function("bounce/decisions/filter_of_600_twice", |bench| {
        bench.iter(|| goal(&mut filter, &mut rng));
    });
    Ok(())
}

criterion_group!(benches, bounce);
criterion_main!(benches);
