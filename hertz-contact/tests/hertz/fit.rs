//! Fits of simulated curves: what was hidden is found, and as often as the intervals say.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use approx::assert_relative_eq;
use hertz_contact::fit::{Baseline, Curve, Fit, FitError, LayerBelow, Loss, Noise, Range, Report, Workspace};
use hertz_contact::indenter::Indenter;
use hertz_contact::law::{Base, Elastic, Law, Layer, Layered, SneddonSphere};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

const SPHERE: Indenter = Indenter::Sphere { radius_m: 0.01 };
const CYLINDER: Indenter = Indenter::Cylinder { radius_m: 2e-3 };
const CONE: Indenter = Indenter::Cone { angle_rad: 0.3 };

/// How a curve is made.
#[derive(Clone, Copy)]
struct World {
    indenter: Indenter,
    modulus_pa: f64,
    contact_m: f64,
    first_m: f64,
    last_m: f64,
    n: usize,
    offset_n: f64,
    tilt_n_m: f64,
    sigma_n: f64,
    proportional: f64,
    outliers: f64,
}

const WORLD: World = World {
    indenter: SPHERE,
    modulus_pa: 1e4,
    contact_m: 3.3e-4,
    first_m: -5e-4,
    last_m: 1.2e-3,
    n: 300,
    offset_n: 2e-3,
    tilt_n_m: 0.0,
    sigma_n: 4e-4,
    proportional: 0.0,
    outliers: 0.0,
};

impl World {
    fn with(&self, force: impl Fn(f64) -> f64, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
        (0..self.n)
            .map(|i| {
                let d = self.first_m + (self.last_m - self.first_m) * i as f64 / (self.n - 1) as f64;
                let f = force(d - self.contact_m);
                let sigma = self.sigma_n.hypot(self.proportional * f);
                let noise: f64 = rng.sample(StandardNormal);
                let wild = if rng.random::<f64>() < self.outliers { 0.1 * rng.random::<f64>() } else { 0.0 };
                (d, f + self.offset_n + self.tilt_n_m * d + sigma * noise + wild)
            })
            .unzip()
    }

    fn curve(&self, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
        let law = Elastic { indenter: self.indenter, modulus_pa: self.modulus_pa, poisson_ratio: 0.5 };
        self.with(|d| law.force(d), rng)
    }

    fn run(&self, fit: &Fit, seed: u64) -> Result<Report, FitError> {
        let (d, f) = self.curve(&mut ChaCha8Rng::seed_from_u64(seed));
        run(fit, &d, &f)
    }
}

fn run(fit: &Fit, d: &[f64], f: &[f64]) -> Result<Report, FitError> {
    fit.run(&[Curve { indentation_m: d, force_n: f, sigma_n: None }], &mut Workspace::new())
}

/// How often modulus and contact are inside their intervals, of `n` curves, and the median relative error of the modulus.
fn coverage(world: &World, fit: &Fit, n: u64) -> (f64, f64, f64) {
    let (mut modulus, mut contact, mut errors) = (0, 0, Vec::new());
    for seed in 0..n {
        let Ok(report) = world.run(fit, seed) else {
            errors.push(f64::INFINITY);
            continue;
        };
        let inside = |x: f64, (low, high): (f64, f64)| u32::from(low <= x && x <= high);
        modulus += inside(world.modulus_pa, report.modulus_interval_pa);
        contact += inside(world.contact_m, report.curves[0].contact_interval_m);
        errors.push((report.modulus_pa / world.modulus_pa - 1.0).abs());
    }
    errors.sort_by(f64::total_cmp);
    let n = n as f64;
    (f64::from(modulus) / n, f64::from(contact) / n, errors[errors.len() / 2])
}

#[test]
fn without_noise_all_is_found() {
    for indenter in [SPHERE, CYLINDER, CONE] {
        for baseline in [Baseline::Zero, Baseline::Offset, Baseline::Tilt] {
            for loss in [Loss::Square, Loss::Huber, Loss::Tukey] {
                let world = World {
                    indenter,
                    sigma_n: 0.0,
                    offset_n: if baseline == Baseline::Zero { 0.0 } else { -3e-3 },
                    tilt_n_m: if baseline == Baseline::Tilt { 4.0 } else { 0.0 },
                    ..WORLD
                };
                let report = world.run(&Fit { baseline, loss, ..Fit::new(indenter, 0.5) }, 0).unwrap();
                let curve = report.curves[0];
                assert_relative_eq!(report.modulus_pa, 1e4, max_relative = 1e-5);
                assert_relative_eq!(curve.contact_m, 3.3e-4, epsilon = 1e-8);
                assert_relative_eq!(curve.offset_n, world.offset_n, epsilon = 1e-7);
                assert_relative_eq!(curve.tilt_n_m, world.tilt_n_m, epsilon = 1e-3);
                assert!(!curve.flags.contact_unseen && !curve.flags.contact_undetermined);
                assert_eq!(curve.samples.used, 300);
            }
        }
    }
}

/// 400 curves: 95 % within three standard errors of a count.
#[test]
fn intervals_cover() {
    let tilted = World { tilt_n_m: 3.0, ..WORLD };
    let noisy = World { sigma_n: 2e-3, n: 120, ..WORLD };
    let tilt = Fit { baseline: Baseline::Tilt, ..Fit::new(SPHERE, 0.5) };
    let square = Fit { loss: Loss::Square, ..Fit::new(SPHERE, 0.5) };
    for (name, world, fit) in [
        ("square", WORLD, square),
        ("Tukey", WORLD, Fit::new(SPHERE, 0.5)),
        ("Huber", WORLD, Fit { loss: Loss::Huber, ..square }),
        ("tilt", tilted, tilt),
        ("noisy", noisy, square),
        ("cone", World { indenter: CONE, ..WORLD }, Fit::new(CONE, 0.5)),
        ("punch", World { indenter: CYLINDER, ..WORLD }, Fit::new(CYLINDER, 0.5)),
    ] {
        let (modulus, contact, error) = coverage(&world, &fit, 400);
        println!("{name}: modulus {modulus}, contact {contact}, median error {error:.4}");
        assert!((modulus - 0.95).abs() < 0.033, "{name}: {modulus}");
        assert!((contact - 0.95).abs() < 0.033, "{name}: {contact}");
    }
    let half = Fit { level: 0.5, ..square };
    let (modulus, contact, _) = coverage(&WORLD, &half, 400);
    assert!((modulus - 0.5).abs() < 0.075 && (contact - 0.5).abs() < 0.075, "{modulus} {contact}");
}

/// One sample in ten is wild and to one side, by up to 250 sigma: Tukey does not care, least squares does.
#[test]
fn outliers() {
    let world = World { outliers: 0.1, ..WORLD };
    let (modulus, contact, error) = coverage(&world, &Fit::new(SPHERE, 0.5), 300);
    println!("Tukey: modulus {modulus}, contact {contact}, median error {error:.4}");
    assert!(modulus > 0.90 && contact > 0.90, "{modulus} {contact}");
    let (_, _, clean) = coverage(&WORLD, &Fit::new(SPHERE, 0.5), 300);
    assert!(error < 1.4 * clean, "{error} {clean}");
    let (_, _, square) = coverage(&world, &Fit { loss: Loss::Square, ..Fit::new(SPHERE, 0.5) }, 100);
    assert!(square > 5.0 * error, "{square} {error}");
    let report = world.run(&Fit::new(SPHERE, 0.5), 3).unwrap();
    assert!((15..50).contains(&report.curves[0].samples.outliers), "{:?}", report.curves[0].samples);
}

/// Noise that grows with the force: known, estimated, and taken for white.
#[test]
fn noise_that_grows() {
    let world = World { sigma_n: 1e-4, proportional: 0.05, ..WORLD };
    let white = Fit { loss: Loss::Square, ..Fit::new(SPHERE, 0.5) };
    let grows = Fit { noise: Noise::Proportional, ..white };
    let (modulus, contact, error) = coverage(&world, &grows, 300);
    let (_, _, unweighted) = coverage(&world, &white, 300);
    println!("modulus {modulus}, contact {contact}, median error {error:.4}, white {unweighted:.4}");
    assert!((modulus - 0.95).abs() < 0.045 && (contact - 0.95).abs() < 0.045, "{modulus} {contact}");
    assert!(error < 0.8 * unweighted, "{error} {unweighted}");
    let report = world.run(&grows, 1).unwrap();
    assert!((report.curves[0].proportional - 0.05).abs() < 0.015);
    assert!((report.curves[0].sigma_n - 1e-4).abs() < 4e-5);

    let law = Elastic { indenter: SPHERE, modulus_pa: 1e4, poisson_ratio: 0.5 };
    let mut inside = 0;
    for seed in 0..200 {
        let (d, f) = world.curve(&mut ChaCha8Rng::seed_from_u64(seed));
        // Ten times too large: the scale is estimated, only the ratio counts.
        let sigma: Vec<f64> =
            d.iter().map(|d| 10.0 * 1e-4_f64.hypot(0.05 * law.force(d - world.contact_m))).collect();
        let curve = Curve { indentation_m: &d, force_n: &f, sigma_n: Some(&sigma) };
        let report = white.run(&[curve], &mut Workspace::new()).unwrap();
        inside += u32::from(report.modulus_interval_pa.0 <= 1e4 && 1e4 <= report.modulus_interval_pa.1);
    }
    assert!((f64::from(inside) / 200.0 - 0.95).abs() < 0.047, "{inside}");
}

/// Five short noisy curves with a modulus in common, contact points and offsets of their own, one with ten times the noise.
#[test]
fn several_curves() {
    let fit = Fit { loss: Loss::Square, ..Fit::new(SPHERE, 0.5) };
    let mut workspace = Workspace::new();
    let (mut inside, mut contacts, mut narrower) = (0, 0, 0);
    for seed in 0..200 {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let worlds: Vec<World> = (0..5_u8)
            .map(|i| World {
                contact_m: 2e-4 + 5e-5 * f64::from(i),
                offset_n: 1e-3 * f64::from(i),
                sigma_n: if i == 2 { 5e-3 } else { 5e-4 },
                n: 60 + 20 * usize::from(i),
                ..WORLD
            })
            .collect();
        let data: Vec<_> = worlds.iter().map(|w| w.curve(rng)).collect();
        let curves: Vec<_> =
            data.iter().map(|(d, f)| Curve { indentation_m: d, force_n: f, sigma_n: None }).collect();
        let report = fit.run(&curves, &mut workspace).unwrap();
        assert!(report.converged);
        let (low, high) = report.modulus_interval_pa;
        inside += u32::from(low <= 1e4 && 1e4 <= high);
        for (world, curve) in worlds.iter().zip(&report.curves) {
            let (low, high) = curve.contact_interval_m;
            contacts += u32::from(low <= world.contact_m && world.contact_m <= high);
        }
        let alone = fit.run(&curves[4..], &mut workspace).unwrap().modulus_interval_pa;
        narrower += u32::from(high - low < alone.1 - alone.0);
    }
    println!("modulus {inside} of 200, contacts {contacts} of 1000, narrower {narrower}");
    assert!((f64::from(inside) / 200.0 - 0.95).abs() < 0.047, "{inside}");
    assert!((f64::from(contacts) / 1000.0 - 0.95).abs() < 0.025, "{contacts}");
    assert!(narrower >= 195, "{narrower}");
}

/// A layer that is there: with it the modulus is found, without it the gel is far too stiff.
#[test]
fn a_layer() {
    let layer = Layer::new(&SPHERE, 0.5, Base::Bonded).unwrap();
    let law = Layered {
        elastic: Elastic { indenter: SPHERE, modulus_pa: 1e4, poisson_ratio: 0.5 },
        layer,
        inverse_thickness_per_m: 1.0 / 0.006,
    };
    let (d, f) = WORLD.with(|d| law.force(d), &mut ChaCha8Rng::seed_from_u64(5));
    let without = Fit::new(SPHERE, 0.5);
    let with = Fit { layer: Some(LayerBelow { layer, inverse_thickness_per_m: 1.0 / 0.006 }), ..without };
    let (low, high) = run(&with, &d, &f).unwrap().modulus_interval_pa;
    assert!(low < 1e4 && 1e4 < high && high - low < 0.1e4, "{low} {high}");
    assert!(run(&without, &d, &f).unwrap().modulus_pa > 1.5e4);
}

/// A deep curve of something that stiffens: the automatic range stops short, and there the modulus is right.
#[test]
fn the_range_is_chosen() {
    let law = Elastic { indenter: SPHERE, modulus_pa: 1e4, poisson_ratio: 0.5 };
    let world = World { last_m: 6e-3, n: 1500, ..WORLD };
    let stiffening = |d: f64| law.force(d) * (1.0 + 2.0 * (d.max(0.0) / 3e-3).powi(3));
    let (d, f) = world.with(stiffening, &mut ChaCha8Rng::seed_from_u64(9));
    let all = run(&Fit::new(SPHERE, 0.5), &d, &f).unwrap();
    assert!(all.curves[0].flags.misfit && all.curves[0].flags.beyond_law);
    assert!((all.modulus_pa / 1e4 - 1.0).abs() > 0.3, "{}", all.modulus_pa);
    let chosen = run(&Fit { range: Range::Automatic, ..Fit::new(SPHERE, 0.5) }, &d, &f).unwrap();
    let curve = chosen.curves[0];
    println!("{chosen:?}");
    assert!((chosen.modulus_pa / 1e4 - 1.0).abs() < 0.06, "{}", chosen.modulus_pa);
    assert!(curve.depth_m <= 1.0e-3 && curve.depth_m > 2e-4, "{}", curve.depth_m);
    assert!(!curve.flags.misfit && !curve.flags.beyond_law);
    assert!(curve.samples.used < 1000);
    let shallow = run(&Fit { range: Range::UpTo(7e-4), ..Fit::new(SPHERE, 0.5) }, &d, &f).unwrap();
    assert!((shallow.curves[0].depth_m - 7e-4).abs() < 1e-5, "{}", shallow.curves[0].depth_m);
    // What the law describes is not cut for its noise.
    let fine = World { last_m: 1.3e-3, n: 600, ..WORLD };
    let mut whole = 0;
    for seed in 0..100 {
        let report = fine.run(&Fit { range: Range::Automatic, ..Fit::new(SPHERE, 0.5) }, seed).unwrap();
        whole += u32::from(report.curves[0].depth_m > 9e-4);
    }
    assert!(whole >= 97, "{whole}");
}

/// The ball itself lies up to 1 % below its parabola at 0.1 R, and so does the modulus.
#[test]
fn a_true_ball() {
    let law = SneddonSphere { radius_m: 0.01, modulus_pa: 1e4, poisson_ratio: 0.5 };
    let mean: f64 = (0..50)
        .map(|seed| {
            let (d, f) = WORLD.with(|d| law.force(d), &mut ChaCha8Rng::seed_from_u64(seed));
            run(&Fit::new(SPHERE, 0.5), &d, &f).unwrap().modulus_pa / 1e4 - 1.0
        })
        .sum::<f64>()
        / 50.0;
    assert!(mean < -0.004 && mean > -0.02, "{mean}");
}

/// Nothing ahead of the contact: the fit says that it extrapolates, and its interval still covers.
#[test]
fn the_contact_was_missed() {
    let world = World { first_m: 5e-4, last_m: 1.5e-3, ..WORLD };
    let fit = Fit { baseline: Baseline::Zero, loss: Loss::Square, ..Fit::new(SPHERE, 0.5) };
    let world = World { offset_n: 0.0, ..world };
    let (modulus, contact, _) = coverage(&world, &fit, 300);
    assert!((modulus - 0.95).abs() < 0.045 && (contact - 0.95).abs() < 0.045, "{modulus} {contact}");
    let report = world.run(&fit, 0).unwrap();
    assert!(report.curves[0].flags.contact_unseen);
    // An unknown offset as well costs digits; in more noise the contact can be almost anywhere.
    let offset = Fit { baseline: Baseline::Offset, ..fit };
    let (modulus, contact, _) = coverage(&world, &offset, 300);
    assert!((modulus - 0.95).abs() < 0.045 && (contact - 0.95).abs() < 0.045, "{modulus} {contact}");
    let noisy = World { sigma_n: 1.5e-2, n: 100, ..world };
    let mut said = 0;
    for seed in 0..100 {
        said += u32::from(match noisy.run(&offset, seed) {
            Ok(report) => report.curves[0].flags.contact_undetermined,
            Err(error) => matches!(error, FitError::NoContact { .. }),
        });
    }
    assert!(said >= 95, "{said}");
}

/// A reading in steps far above the noise: flat samples are all rounded the same way, and the intervals allow for it.
#[test]
fn a_coarse_reading() {
    for loss in [Loss::Square, Loss::Tukey] {
        for step in [1e-3, 5e-4, 1e-4] {
            let (mut inside, mut contacts) = (0, 0);
            for k in 0..50 {
                let world = World { sigma_n: 0.0, offset_n: 2e-3 + step * f64::from(k) / 50.0, ..WORLD };
                let (d, mut f) = world.curve(&mut ChaCha8Rng::seed_from_u64(0));
                f.iter_mut().for_each(|f| *f = (*f / step).round() * step);
                let report = run(&Fit { loss, ..Fit::new(SPHERE, 0.5) }, &d, &f).unwrap();
                let curve = report.curves[0];
                assert!(curve.flags.coarse_reading);
                let (low, high) = report.modulus_interval_pa;
                inside += u32::from(low <= 1e4 && 1e4 <= high);
                assert!(high - low < 2e6 * step, "{low} {high}");
                let (low, high) = curve.contact_interval_m;
                contacts += u32::from(low <= world.contact_m && world.contact_m <= high);
            }
            println!("{loss:?} {step}: {inside} {contacts} of 50");
            assert!(inside >= 46 && contacts >= 46, "{loss:?} {step}: {inside} {contacts}");
        }
    }
    // Noise of half a step makes the rounding harmless.
    let (d, mut f) = WORLD.curve(&mut ChaCha8Rng::seed_from_u64(0));
    f.iter_mut().for_each(|f| *f = (*f / 8e-4).round() * 8e-4);
    assert!(!run(&Fit::new(SPHERE, 0.5), &d, &f).unwrap().curves[0].flags.coarse_reading);
}

/// Neighbouring residuals that resemble each other widen the intervals, and are flagged.
#[test]
fn noise_with_a_memory() {
    let (mut inside, mut flagged) = (0, 0);
    for seed in 0..200 {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let (d, mut f) = World { sigma_n: 0.0, ..WORLD }.curve(rng);
        let mut state = 0.0;
        for f in &mut f {
            let noise: f64 = rng.sample(StandardNormal);
            state = 0.8 * state + 0.6 * noise;
            *f += 4e-4 * state;
        }
        let report = run(&Fit { loss: Loss::Square, ..Fit::new(SPHERE, 0.5) }, &d, &f).unwrap();
        let (low, high) = report.modulus_interval_pa;
        inside += u32::from(low <= 1e4 && 1e4 <= high);
        flagged += u32::from(report.curves[0].flags.misfit);
        assert!(report.widened > 1.5);
    }
    println!("{inside} of 200");
    assert!(inside >= 176 && flagged > 190, "{inside} {flagged}");
}

#[test]
fn curves_without_contact_are_refused() {
    let flat = World { modulus_pa: 1e-9, tilt_n_m: 0.0, ..WORLD };
    let drift = World { modulus_pa: 1e-9, tilt_n_m: 5.0, ..WORLD };
    for (name, world) in [("flat", flat), ("drift", drift)] {
        for loss in [Loss::Square, Loss::Tukey] {
            let mut refused = 0;
            for seed in 0..100 {
                refused += u32::from(matches!(
                    world.run(&Fit { loss, ..Fit::new(SPHERE, 0.5) }, seed),
                    Err(FitError::NoContact { curve: 0, .. })
                ));
            }
            assert!(refused >= 99, "{name} {loss:?}: {refused}");
        }
    }
    let d: Vec<f64> = (0..100).map(f64::from).collect();
    for fit in [Fit::new(SPHERE, 0.5), Fit { baseline: Baseline::Zero, ..Fit::new(CYLINDER, 0.5) }] {
        let zero = run(&fit, &d, &[0.0; 100]);
        assert!(matches!(zero, Err(FitError::NoContact { .. })), "{zero:?}");
        let constant = run(&Fit { baseline: Baseline::Offset, ..fit }, &d, &[7.0; 100]);
        assert!(matches!(constant, Err(FitError::NoContact { .. })), "{constant:?}");
    }
    // Pulled instead of pressed.
    let pulled: Vec<f64> = d.iter().map(|d| -(d - 50.0).max(0.0).powf(1.5)).collect();
    assert!(matches!(run(&Fit::new(SPHERE, 0.5), &d, &pulled), Err(FitError::NoContact { .. })));
}

#[test]
fn what_is_no_curve_is_refused() {
    let fit = Fit::new(SPHERE, 0.5);
    assert_eq!(fit.run(&[], &mut Workspace::new()), Err(FitError::Empty));
    assert_eq!(run(&fit, &[0.0, 1.0], &[0.0, 1.0]), Err(FitError::TooFew { curve: 0, expected: 6, got: 2 }));
    assert_eq!(run(&fit, &[], &[]), Err(FitError::TooFew { curve: 0, expected: 6, got: 0 }));
    assert_eq!(run(&fit, &[1.0; 9], &[1.0; 9]), Err(FitError::NotMoved { curve: 0 }));
    assert_eq!(run(&fit, &[1.0; 9], &[1.0; 8]), Err(FitError::Length { curve: 0, expected: 9, got: 8 }));
    let d: Vec<f64> = (0..9).map(f64::from).collect();
    let mut bad = d.clone();
    bad[4] = f64::NAN;
    assert!(matches!(run(&fit, &d, &bad), Err(FitError::Value { sample: 4, column: "force_n", .. })));
    let sigma = [1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0];
    let curve = Curve { indentation_m: &d, force_n: &d, sigma_n: Some(&sigma) };
    assert!(matches!(
        fit.run(&[curve], &mut Workspace::new()),
        Err(FitError::Value { sample: 2, column: "sigma_n", .. })
    ));
    for bad in [
        Fit { level: 1.0, ..fit },
        Fit { level: f64::NAN, ..fit },
        Fit { poisson_ratio: 2.0, ..fit },
        Fit { range: Range::UpTo(-1.0), ..fit },
        Fit { indenter: Indenter::Sphere { radius_m: 0.0 }, ..fit },
    ] {
        assert!(matches!(run(&bad, &d, &d), Err(FitError::Setting(_))), "{bad:?}");
    }
    // Only the last sample rises: less than a contact needs.
    let mut late = vec![0.0; 50];
    late[49] = 1.0;
    let d: Vec<f64> = (0..50).map(f64::from).collect();
    assert!(run(&fit, &d, &late).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Any numbers: a report with numbers in it, or an error.
    #[test]
    fn any_curve(
        points in prop::collection::vec((-1.0_f64..1.0, -1.0_f64..1.0), 0..40),
        scale in -100.0_f64..100.0,
        baseline in 0usize..3,
        loss in 0usize..3,
        range in 0usize..3,
    ) {
        let (d, f): (Vec<f64>, Vec<f64>) =
            points.iter().map(|(d, f)| (*d, f * 10_f64.powf(scale))).unzip();
        let fit = Fit {
            baseline: [Baseline::Zero, Baseline::Offset, Baseline::Tilt][baseline],
            loss: [Loss::Square, Loss::Huber, Loss::Tukey][loss],
            range: [Range::All, Range::UpTo(0.3), Range::Automatic][range],
            noise: if loss == 1 { Noise::Proportional } else { Noise::White },
            ..Fit::new(Indenter::Sphere { radius_m: 1.0 }, 0.5)
        };
        if let Ok(report) = run(&fit, &d, &f) {
            let curve = report.curves[0];
            prop_assert!(report.modulus_pa > 0.0 && report.modulus_pa.is_finite());
            let (low, high) = report.modulus_interval_pa;
            prop_assert!(low <= report.modulus_pa && report.modulus_pa <= high, "{report:?}");
            prop_assert!(curve.contact_interval_m.0 <= curve.contact_m, "{report:?}");
            prop_assert!(curve.contact_m <= curve.contact_interval_m.1, "{report:?}");
            prop_assert!(curve.offset_n.is_finite() && curve.sigma_n >= 0.0);
        }
    }

    /// Other units, another zero, another order: the same answer.
    #[test]
    fn units_do_not_matter(seed in 0_u64..1000, force in -6.0_f64..6.0, shift in -1.0_f64..1.0) {
        let (d, f) = WORLD.curve(&mut ChaCha8Rng::seed_from_u64(seed));
        let fit = Fit::new(SPHERE, 0.5);
        let a = run(&fit, &d, &f).unwrap();
        let unit = 10_f64.powf(force);
        let moved: Vec<f64> = d.iter().map(|d| d + shift).collect();
        let scaled: Vec<f64> = f.iter().map(|f| f * unit - 3.0 * unit).collect();
        let b = run(&fit, &moved, &scaled).unwrap();
        prop_assert!((b.modulus_pa / unit / a.modulus_pa - 1.0).abs() < 1e-4);
        prop_assert!((b.curves[0].contact_m - shift - a.curves[0].contact_m).abs() < 1e-8);
    }
}
