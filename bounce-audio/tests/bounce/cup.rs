//! Bouncing into a cup: against another integrator, and what chance does to the map.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use bounce_audio::cup::{Cup, Scene};
use bounce_audio::drop::{Ball, DropModel, Release, Table};
use bounce_audio::fake::FakeBall;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const R: f64 = 0.02;

fn at(x: f64, y: f64) -> Release {
    Release { position_m: [x, y, 0.26], velocity_sigma_m_s: 0.0, spin_sigma_rad_s: 0.0, ..Release::at(0.26) }
}

/// Without chance the cup is reached from a band of places, and a ball that is followed in small steps agrees.
#[test]
fn without_chance_it_is_in_or_out() {
    let scene = Scene::thesis(Ball::new(0.87, f64::INFINITY).unwrap(), R).unwrap();
    let normal = *scene.model().table().normal();
    let real = FakeBall { slope_s_m: 0.0, drag_per_m: 0.0, asperity: 0.0, ..FakeBall::new(0.87, 1e3) };
    let (mut inside, mut compared) = (0, 0);
    for i in 0..56 {
        for y in [0.0, 0.015, 0.05] {
            let release = at(-0.27 + 0.01 * f64::from(i), y);
            let mut rng = ChaCha8Rng::seed_from_u64(1);
            let falls = scene.falls_in(&release.draw(&mut rng), &mut rng);
            inside += usize::from(falls);
            let centre = std::array::from_fn(|k| release.position_m[k] + R * normal[k]);
            let cup = *scene.cup();
            let mut closest = f64::INFINITY;
            let mut last = centre;
            let over = |_: f64, p: [f64; 3]| {
                let through = last[2] >= cup.rim_z_m && p[2] < cup.rim_z_m && p[0] > 0.275;
                if through {
                    closest = (p[0] - cup.centre_m[0]).hypot(p[1] - cup.centre_m[1]);
                }
                last = p;
                through || p[0] > 0.9
            };
            real.fly(centre, [0.0; 3], normal, 3.0, over, &mut rng);
            let margin = closest - (cup.radius_m - R);
            // Its places are half a millisecond apart.
            if margin.abs() > 2e-3 {
                compared += 1;
                assert_eq!(falls, margin < 0.0, "from {:?}: {closest} m off the middle", release.position_m);
            }
        }
    }
    assert!(inside >= 4 && compared > 140, "{inside} of {compared}");
}

#[test]
fn chance_spreads_the_map_and_threads_change_nothing() {
    let scene = |kappa| Scene::thesis(Ball::new(0.87, kappa).unwrap(), R).unwrap();
    let places: Vec<Release> = (0..40).map(|i| at(-0.2 + 0.011 * f64::from(i), 0.0)).collect();
    let sure = scene(1e5).map(&places, 100, 1);
    let unsure = scene(1e2).map(&places, 100, 1);
    let most = |m: &[f64]| m.iter().copied().fold(0.0, f64::max);
    assert!(
        most(&sure) > 0.9 && most(&unsure) < 0.6 && most(&unsure) > 0.02,
        "{} {}",
        most(&sure),
        most(&unsure)
    );
    let reached = |m: &[f64]| m.iter().filter(|s| **s > 0.0).count();
    assert!(reached(&unsure) > reached(&sure));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(unsure, pool.install(|| scene(1e2).map(&places, 100, 1)));
    // One place of the map is the count there, up to its own chance.
    let best = sure.iter().position(|s| *s == most(&sure)).unwrap();
    assert!(scene(1e5).successes(&places[best], 100, 7) > 80);
    assert!(scene(1e5).map(&[], 100, 1).is_empty() && scene(1e5).map(&places, 0, 1).is_empty());
}

#[test]
fn nonsense_is_an_error() {
    let model = DropModel::new(Ball::new(0.8, 1e3).unwrap(), Table::LEVEL, 9.8).unwrap();
    let cup = Cup { centre_m: [0.4, 0.0], rim_z_m: 0.1, radius_m: 0.04 };
    assert!(Scene::new(model, 0.275, cup, 0.02).is_ok());
    for (half, radius, cup) in [
        (0.0, 0.02, cup),
        (f64::NAN, 0.02, cup),
        (0.275, -0.02, cup),
        (0.275, 0.05, cup),
        (0.275, 0.02, Cup { rim_z_m: f64::NAN, ..cup }),
        (0.275, 0.02, Cup { radius_m: f64::INFINITY, ..cup }),
    ] {
        assert!(Scene::new(model, half, cup, radius).is_err(), "{half} {radius} {cup:?}");
    }
}
