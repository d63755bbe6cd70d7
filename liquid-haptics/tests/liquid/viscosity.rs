//! Viscosities from signals that are simulated here: an oscillator by Runge-Kutta, a film by finite volumes, a sensor's noise.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::f64::consts::PI;

use liquid_haptics::container::{Container, Cylinder};
use liquid_haptics::viscosity::{
    Bottle, Refusal, Regime, Verdict, ViscosityError, ViscosityEstimate, ViscosityFit,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const GRAVITY: f64 = 9.80665;
/// The sensor's rate (Hz, [Matl 2021], section 2.5), how many of its readings are averaged into one, and the resolution of its torque
/// (N m), taken as the noise of a raw reading.
const RATE: f64 = 7812.0;
const AVERAGED: usize = 78;
const RESOLUTION_NM: f64 = 0.005;

/// Times (s) and averaged, quantised, noisy readings of a torque (N m).
fn sensed(torque: impl Fn(f64) -> f64, seconds: f64, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
    let count = (seconds * RATE) as usize / AVERAGED;
    let mut times = Vec::new();
    let mut readings = Vec::new();
    for k in 0..count {
        let (mut t, mut y) = (0.0, 0.0);
        for i in 0..AVERAGED {
            let now = (k * AVERAGED + i) as f64 / RATE;
            let noise: f64 = StandardNormal.sample(rng);
            t += now / AVERAGED as f64;
            y += ((torque(now) + RESOLUTION_NM * noise) / RESOLUTION_NM).round() * RESOLUTION_NM
                / AVERAGED as f64;
        }
        times.push(t);
        readings.push(y);
    }
    (times, readings)
}

/// A decaying mode by Runge-Kutta of fourth order, tabulated every 0.1 ms.
fn slosh(bottle: &Bottle, viscosity: f64, amplitude: f64, seconds: f64) -> impl Fn(f64) -> f64 {
    let (r, h) = (bottle.radius_m, bottle.volume_m3 / (PI * bottle.radius_m.powi(2)));
    let omega = (1.841 * GRAVITY / r * (1.841 * h / r).tanh()).sqrt();
    let x = 1.84 * h / r;
    #[allow(clippy::approx_constant, reason = "the law's coefficient, not 1/pi")]
    let shallow = 0.318;
    let gamma = 0.79
        * (viscosity / (r.powf(1.5) * GRAVITY.sqrt())).sqrt()
        * (1.0 + shallow / x.sinh() * (1.0 + (1.0 - h / r) / x.cosh()));
    let step = 1e-4;
    let (mut x, mut v) = (amplitude, 0.0);
    let force = |x: f64, v: f64| -omega * omega * x - 2.0 * gamma * omega * v;
    let mut table = vec![x];
    for _ in 0..(seconds / step) as usize + 2 {
        let (k1, l1) = (v, force(x, v));
        let (k2, l2) = (v + 0.5 * step * l1, force(x + 0.5 * step * k1, v + 0.5 * step * l1));
        let (k3, l3) = (v + 0.5 * step * l2, force(x + 0.5 * step * k2, v + 0.5 * step * l2));
        let (k4, l4) = (v + step * l3, force(x + step * k3, v + step * l3));
        x += step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        v += step / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
        table.push(x);
    }
    move |t| 0.03 + table[((t / step) as usize).min(table.len() - 1)]
}

/// A film's strips along the wall: depth of every cell, and where the strips are (the wall's distance from the axis' plane, width).
struct Film {
    walls: Vec<[f64; 2]>,
    depths: Vec<Vec<f64>>,
    edges: Vec<f64>,
    /// Depth of each cell's lower edge less its middle, limited.
    halves: Vec<Vec<f64>>,
}

impl Film {
    /// The prism in which the liquid lies on its side.
    fn new(bottle: &Bottle) -> Self {
        const STRIPS: usize = 48;
        const CELLS: usize = 120;
        let (r, length) = (bottle.radius_m, bottle.length_m);
        let step = PI / STRIPS as f64;
        let wall = |k: usize| r * ((k as f64 + 0.5) * step).sin();
        let walls: Vec<[f64; 2]> = (0..STRIPS).map(|k| [wall(k), wall(k) * step]).collect();
        let depth = |wall: f64, chord: f64| (wall - chord.max(-wall)).max(0.0);
        let (mut low, mut high) = (-r, r);
        for _ in 0..60 {
            let chord = 0.5 * (low + high);
            let area: f64 = walls.iter().map(|[wall, width]| depth(*wall, chord) * width).sum();
            if area * length > bottle.volume_m3 { low = chord } else { high = chord }
        }
        let depths = walls.iter().map(|[wall, _]| vec![depth(*wall, low); CELLS]).collect();
        // Finer towards the top, where the fan is steep.
        let edges = (0..=CELLS).map(|i| length * (i as f64 / CELLS as f64).powi(2)).collect();
        let halves = vec![vec![0.0; CELLS]; STRIPS];
        Self { walls, depths, edges, halves }
    }

    fn size(&self, i: usize) -> f64 {
        self.edges[i + 1] - self.edges[i]
    }

    /// Slopes by the minmod limiter; nothing is on the wall above the first cell.
    fn limit(&mut self, wet: usize) {
        let middle = |i: usize| 0.5 * (self.edges[i] + self.edges[i + 1]);
        for (strip, halves) in self.depths.iter().zip(&mut self.halves) {
            let mut before = strip[0] / middle(0);
            for i in 0..wet {
                let after = if i + 1 < strip.len() {
                    (strip[i + 1] - strip[i]) / (middle(i + 1) - middle(i))
                } else {
                    before
                };
                let slope =
                    if before * after <= 0.0 { 0.0 } else { before.signum() * before.abs().min(after.abs()) };
                halves[i] = 0.5 * slope * (self.edges[i + 1] - self.edges[i]);
                before = after;
            }
        }
    }

    /// One explicit step of second order in space, a share of which is mixed with what was before (Heun's method in two).
    fn step(&mut self, h: f64, flux: f64, wet: usize, before: Option<&[Vec<f64>]>) {
        self.limit(wet);
        let sizes: Vec<f64> = (0..wet).map(|i| self.size(i)).collect();
        for (k, (strip, halves)) in self.depths.iter_mut().zip(&self.halves).enumerate() {
            let mut inflow = 0.0;
            for i in 0..wet {
                let outflow = flux * (strip[i] + halves[i]).max(0.0).powi(3);
                strip[i] += h / sizes[i] * (inflow - outflow);
                inflow = outflow;
                if let Some(before) = before {
                    strip[i] = 0.5 * (strip[i] + before[k][i]);
                }
            }
        }
    }

    /// How many cells the film reaches down to the pool, the last in part, and its moment about the axis.
    fn above_pool(&mut self, bottle: &Bottle) -> (usize, f64) {
        let cells = self.edges.len() - 1;
        self.limit(cells);
        let disc = PI * bottle.radius_m.powi(2);
        let (mut above, mut moment) = (0.0, 0.0);
        for i in 0..cells {
            let (mut area, mut lever) = (0.0, 0.0);
            for ((strip, halves), [wall, width]) in self.depths.iter().zip(&self.halves).zip(&self.walls) {
                area += width * strip[i];
                lever += width * (wall * strip[i] - 0.5 * (strip[i].powi(2) + halves[i].powi(2) / 3.0));
            }
            let (ds, level) = (self.size(i), bottle.length_m - self.edges[i + 1]);
            if disc * level + above + area * ds < bottle.volume_m3 {
                let spare = disc * (level + ds) + above - bottle.volume_m3;
                let part = (spare / ((disc - area) * ds)).clamp(0.0, 1.0);
                return (i + 1, moment + part * lever * ds);
            }
            above += area * ds;
            moment += lever * ds;
        }
        (cells, moment)
    }
}

/// The torque (N m) of a film that drains while and after the bottle turns upright at a constant rate: finite volumes of second order
/// in every strip, gravity's share along the wall growing with the turn. Table of time after the turn and torque.
fn drain(bottle: &Bottle, viscosity: f64, turn_s: f64, seconds: f64) -> Vec<(f64, f64)> {
    let mut film = Film::new(bottle);
    let cells = film.edges.len() - 1;
    let mut now = -turn_s;
    let mut out = Vec::new();
    while now < seconds {
        let (wet, moment) = film.above_pool(bottle);
        out.push((now, -bottle.mass_kg / bottle.volume_m3 * GRAVITY * moment));
        let angle = if turn_s > 0.0 { 0.5 * PI * (-now / turn_s).clamp(0.0, 1.0) } else { 0.0 };
        let pull = GRAVITY * angle.cos();
        let wet = (wet + 2).min(cells);
        let pace = (0..wet)
            .flat_map(|i| film.depths.iter().map(move |d| (d[i], i)))
            .fold(0.0f64, |most, (depth, i)| most.max(depth * depth / film.size(i)));
        let step = (0.5 * viscosity / (pull.max(1e-3 * GRAVITY) * pace)).min(0.02);
        let step = if now < 0.0 { step.min(turn_s / 200.0) } else { step };
        let (before, flux) = (film.depths.clone(), pull / (3.0 * viscosity));
        film.step(step, flux, wet, None);
        film.step(step, flux, wet, Some(&before));
        now += step;
    }
    out
}

fn table(points: Vec<(f64, f64)>) -> impl Fn(f64) -> f64 {
    move |t| {
        let k = points.partition_point(|p| p.0 <= t).clamp(1, points.len() - 1);
        let ((a, x), (b, y)) = (points[k - 1], points[k]);
        0.02 + x + (y - x) * (t - a) / (b - a)
    }
}

fn bottle(radius: f64, length: f64, share: f64, density: f64) -> Bottle {
    let cylinder = Cylinder::new(radius, length, 0.001).unwrap();
    let volume = share * cylinder.capacity_m3();
    Bottle::new(&cylinder, volume, density * volume, GRAVITY).unwrap()
}

fn fit(bottle: Bottle, turn_s: f64) -> ViscosityFit {
    ViscosityFit { bottle, mass_error_share: 0.0, head_start_s: 2.0 / PI * turn_s, widest_factor: 4.0 }
}

fn viscosity_of(verdict: Verdict) -> ViscosityEstimate {
    match verdict {
        Verdict::Viscosity(estimate) => estimate,
        Verdict::Refused(why) => panic!("{why:?}"),
    }
}

/// Waves of seven liquids at three fills, each read so often.
fn sloshed(readings: usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let (mut inside, mut all) = (0, 0);
    println!("{:>8} {:>6} {:>11} {:>24}", "m2/s", "share", "error", "interval");
    for share in [0.3, 0.5, 0.7] {
        let bottle = bottle(0.040, 0.16, share, 1000.0);
        for viscosity in [1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3] {
            // 30 s: water's wave takes ten to fade.
            let signal = slosh(&bottle, viscosity, 0.015, 30.0);
            for _ in 0..readings {
                let (t, y) = sensed(&signal, 30.0, &mut rng);
                let estimate = viscosity_of(fit(bottle, 0.0).estimate(&t, &y).unwrap());
                assert!(matches!(estimate.regime, Regime::Oscillating(_)), "{viscosity} {estimate:?}");
                let error = estimate.kinematic_m2_s / viscosity - 1.0;
                let [low, high] = estimate.interval_m2_s;
                println!("{viscosity:>8.0e} {share:>6} {error:>+11.4} {:>11.3e} {:>11.3e}", low, high);
                assert!(error.abs() < 0.2, "{viscosity} {share}: {error}");
                inside += usize::from(low <= viscosity && viscosity <= high);
                all += 1;
            }
        }
    }
    println!("{inside} of {all} inside their 95 % intervals");
    assert!(inside * 100 >= all * 88, "{inside} of {all}");
}

#[test]
fn a_slosh_gives_the_viscosity_back() {
    sloshed(1);
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_many_readings_of_a_slosh_give_the_viscosity_back() {
    sloshed(4);
}

fn drained(readings: usize) -> [usize; 3] {
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let (mut inside, mut all, mut refused) = (0, 0, 0);
    println!("{:>6} {:>6} {:>9} {:>20}", "Pa s", "share", "error", "interval");
    for (share, turn) in [(0.1, 0.2), (0.2, 0.3), (0.4, 0.0), (0.5, 0.5), (0.7, 0.3), (0.9, 0.0)] {
        let bottle = bottle(0.035, 0.172, share, 1400.0);
        for dynamic in [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0] {
            let viscosity = dynamic / 1400.0;
            let signal = table(drain(&bottle, viscosity, turn, 30.0));
            for _ in 0..readings {
                let (t, y) = sensed(&signal, 30.0, &mut rng);
                // Ends that are 1.5 times apart: some 20 % to either side.
                let fit = ViscosityFit { widest_factor: 1.5, ..fit(bottle, turn) };
                let estimate = match fit.estimate(&t, &y).unwrap() {
                    Verdict::Viscosity(estimate) => estimate,
                    Verdict::Refused(why) => {
                        println!("{dynamic:>6} {share:>6}   refused: {why:?}");
                        assert!(
                            matches!(why, Refusal::TooNoisy { .. } | Refusal::NothingMoves { .. }),
                            "{why:?}"
                        );
                        assert!(share > 0.5, "{dynamic} {share}: {why:?}");
                        refused += 1;
                        continue;
                    }
                };
                assert!(matches!(estimate.regime, Regime::Draining { .. }), "{dynamic} {estimate:?}");
                let error = estimate.dynamic_pa_s / dynamic - 1.0;
                let [low, high] = estimate.interval_m2_s.map(|nu| nu * 1400.0);
                println!("{dynamic:>6} {share:>6} {error:>+9.4} {low:>10.3} {high:>10.3}");
                assert!(error.abs() < 0.2, "{dynamic} {share}: {error}");
                inside += usize::from(low <= dynamic && dynamic <= high);
                all += 1;
            }
        }
    }
    println!("{inside} of {all} inside their 95 % intervals, {refused} refused");
    [inside, all, refused]
}

#[test]
fn a_drain_gives_the_viscosity_back() {
    let [_, all, refused] = drained(1);
    assert!(refused <= 14 && all >= 28, "{refused} refused, {all} known");
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_a_drain_s_intervals_hold_the_viscosity() {
    let [inside, all, refused] = drained(3);
    assert!(refused <= 42, "{refused}");
    assert!(inside * 100 >= all * 91, "{inside} of {all}");
}

/// What the readings do not tell is refused, and why.
#[test]
fn what_is_not_felt_is_refused() {
    let mut rng = ChaCha8Rng::seed_from_u64(13);
    let half = bottle(0.040, 0.16, 0.5, 1000.0);
    let refused = |bottle: Bottle, t: &[f64], y: &[f64]| match fit(bottle, 0.3).estimate(t, y).unwrap() {
        Verdict::Refused(why) => why,
        Verdict::Viscosity(estimate) => panic!("{estimate:?}"),
    };
    for _ in 0..20 {
        let (t, y) = sensed(|_| 0.03, 10.0, &mut rng);
        assert!(matches!(refused(half, &t, &y), Refusal::NothingMoves { .. } | Refusal::TooNoisy { .. }));
    }
    let signal = slosh(&half, 1e-5, 0.015, 10.0);
    let (t, y) = sensed(&signal, 10.0, &mut rng);
    assert!(matches!(refused(half, &t[..40], &y[..40]), Refusal::TooShort { .. }));
    let empty = Bottle { volume_m3: 0.0, mass_kg: 0.0, ..half };
    assert!(matches!(refused(empty, &t, &y), Refusal::Empty { .. }));
    // A wave as high as the noise of the averaged readings, that is gone after a swing.
    let faint = slosh(&half, 1e-3, 0.0015, 10.0);
    let (t, y) = sensed(&faint, 10.0, &mut rng);
    assert!(matches!(refused(half, &t, &y), Refusal::NothingMoves { .. } | Refusal::TooNoisy { .. }));
    // A sawtooth is neither.
    let (t, y) = sensed(|t| 0.5 * (t / 3.0).fract(), 10.0, &mut rng);
    assert!(matches!(refused(half, &t, &y), Refusal::NeitherLaw { .. } | Refusal::TooNoisy { .. }));
}

#[test]
fn what_is_no_reading_is_an_error() {
    let rig = fit(bottle(0.040, 0.16, 0.5, 1000.0), 0.0);
    let t: Vec<f64> = (0..100).map(|i| 0.02 * f64::from(i)).collect();
    let y = vec![0.0; 100];
    let with = |i: usize, v: f64| {
        let mut bad = y.clone();
        bad[i] = v;
        bad
    };
    assert!(matches!(rig.estimate(&t, &with(7, f64::NAN)), Err(ViscosityError::Reading { index: 7, .. })));
    assert!(matches!(rig.estimate(&t, &y[..50]), Err(ViscosityError::Lengths { .. })));
    assert!(matches!(rig.estimate(&t[..5], &y[..5]), Err(ViscosityError::TooFew { .. })));
    assert!(matches!(rig.estimate(&y, &t), Err(ViscosityError::Reading { index: 1, .. })));
    assert!(ViscosityFit { widest_factor: 1.0, ..rig }.estimate(&t, &y).is_err());
    assert!(ViscosityFit { head_start_s: f64::NAN, ..rig }.estimate(&t, &y).is_err());
    // All alike: nothing moves, and nothing breaks.
    assert!(matches!(rig.estimate(&t, &y), Ok(Verdict::Refused(_))));
}
