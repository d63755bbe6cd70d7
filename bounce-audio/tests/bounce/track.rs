//! Meeting the ball: algorithm 1 against a parabola, the learned next impact against simulated ones, outliers, and whole throws.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use bounce_audio::drop::{Ball, DropModel, Moving, Table, each};
use bounce_audio::fake::{Court, CourtSettings, FakeBall, Toss, Verdict};
use bounce_audio::hear::HearSettings;
use bounce_audio::listen::{Delays, Listener};
use bounce_audio::track::{
    Deterministic, NextBounce, NextSettings, Player, Seen, Stochastic, StochasticSettings, Tracker,
    Workspace, play,
};
use hw_traits::arm::{Arm, Pose};
use hw_traits::microphones::Microphones;
use hw_traits::{Error, ErrorKind};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const G: f64 = 9.80665;
pub(crate) const SPACE: Workspace =
    Workspace { plane_x_m: 0.55, y_m: [0.0, 0.55], z_m: [0.02, 0.5], rest_z_m: 0.1, gravity_m_s2: G };

pub(crate) fn dice(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn learned(e: f64, log10_kappa: f64) -> NextBounce {
    let mut settings = NextSettings { simulations: 3_000, ..NextSettings::default() };
    settings.network.training.max_epochs = 60;
    NextBounce::learn(&[[e, log10_kappa]], G, &settings, 1).unwrap()
}

/// Impacts of a ball that goes straight on: x at 0.05, then flights of e^2; with the crossing of the plane (s, y, z).
pub(crate) fn straight(e: f64, dy: f64) -> (Vec<Seen>, [f64; 3]) {
    let (mut x, mut y, mut t) = (0.05, 0.2, 1.0);
    let (mut dx, mut dy, mut dt) = (0.2, dy, 0.36);
    let mut seen = vec![Seen { t_s: t, place_m: [x, y] }];
    loop {
        if x + dx > 0.55 {
            let s = (0.55 - x) / dx * dt;
            return (seen, [t + s, y + dy * s / dt, 0.5 * G * s * (dt - s)]);
        }
        (x, y, t) = (x + dx, y + dy, t + dt);
        seen.push(Seen { t_s: t, place_m: [x, y] });
        (dx, dy, dt) = (e * e * dx, e * e * dy, e * dt);
    }
}

#[test]
fn algorithm_1_is_right_where_there_is_no_chance() {
    let (seen, [t, y, z]) = straight(0.85, 0.03);
    let mut tracker = Deterministic::new(0.85, SPACE);
    let goals: Vec<_> = seen.iter().map(|s| tracker.heard(s, [0.275, 0.1], &mut dice(1)).unwrap()).collect();
    assert!(seen.len() > 3);
    assert_eq!((goals[0].y_m, goals[0].z_m), (0.2, 0.1));
    for goal in &goals[1..] {
        approx::assert_relative_eq!(goal.y_m, y, epsilon = 1e-12);
    }
    let last = goals[goals.len() - 1];
    approx::assert_relative_eq!(last.z_m, z, epsilon = 1e-12);
    approx::assert_relative_eq!(last.at_s, t, epsilon = 1e-12);
    // Before the last flight it waits at its height for the next impact.
    approx::assert_relative_eq!(goals[1].at_s, seen[2].t_s, epsilon = 1e-12);
    assert_eq!(goals[1].z_m, 0.1);
    // A ball that goes away has no goal, nor has one that is through.
    tracker.begin();
    tracker.heard(&seen[1], [0.0; 2], &mut dice(1));
    let back = Seen { t_s: 9.0, place_m: [0.0, 0.2] };
    assert_eq!(tracker.heard(&back, [0.0; 2], &mut dice(1)), None);
}

/// The learned density against impacts simulated at the same slope, at any scale.
#[test]
fn the_next_impact_is_learned() {
    for (e, log10_kappa) in [(0.85, 3.0), (0.8, 2.0)] {
        let next = learned(e, log10_kappa);
        let model = DropModel::new(Ball::new(e, 10f64.powf(log10_kappa)).unwrap(), Table::LEVEL, G).unwrap();
        for (duration, length) in [(0.4, 0.2), (0.25, 0.05), (0.3, 0.3)] {
            let before = Moving {
                t_s: 0.0,
                position_m: [0.0; 3],
                velocity_m_s: [length / duration, 0.0, -0.5 * G * duration],
                spin_rad_s: [0.0; 3],
            };
            let simulated = each(20_000, 5, |_, rng| {
                let v = model.bounce(&before, rng).velocity_m_s;
                let t = 2.0 * v[2] / G;
                [t, v[0] * t, v[1] * t]
            });
            let mut rng = dice(6);
            let drawn: Vec<[f64; 3]> = (0..20_000)
                .map(|_| {
                    let s = next.draw(duration, length, &mut rng);
                    [s.duration_s, s.forward_m, s.left_m]
                })
                .collect();
            let moments = |v: &[[f64; 3]], k: usize| {
                let n = v.len() as f64;
                let mean = v.iter().map(|s| s[k]).sum::<f64>() / n;
                (mean, (v.iter().map(|s| (s[k] - mean).powi(2)).sum::<f64>() / n).sqrt())
            };
            let (mean, spread) = next.moments(duration, length);
            println!("e {e}, kappa 1e{log10_kappa}, {duration} s, {length} m");
            for k in 0..3 {
                let (a, b) = (moments(&simulated, k), moments(&drawn, k));
                println!("  {:.5} +- {:.5}, learned {:.5} +- {:.5}", a.0, a.1, b.0, b.1);
                assert!((a.0 - b.0).abs() < 0.15 * a.1.max(0.002), "mean {} and {}", a.0, b.0);
                assert!(
                    (a.1 / b.1).ln().abs() < if k == 0 { 0.5 } else { 0.15 },
                    "spread {} and {}",
                    a.1,
                    b.1
                );
                assert!(((mean_of(&mean)[k]) - b.0).abs() < 0.5 * a.1.max(0.002));
            }
            assert!((spread[1][1].sqrt() / moments(&simulated, 2).1).ln().abs() < 0.5);
        }
    }
}

fn mean_of(step: &bounce_audio::track::Step) -> [f64; 3] {
    [step.duration_s, step.forward_m, step.left_m]
}

#[test]
fn algorithm_2_does_not_believe_what_cannot_be() {
    let (seen, [_, y, z]) = straight(0.85, 0.03);
    let mut tracker = Stochastic::new(learned(0.85, 3.5), SPACE, StochasticSettings::default());
    let run = |tracker: &mut Stochastic, impacts: &[Seen]| {
        tracker.begin();
        let mut paddle = [0.275, 0.1];
        for s in impacts {
            if let Some(goal) = tracker.heard(s, paddle, &mut dice(2)) {
                paddle = [goal.y_m, goal.z_m];
            }
        }
        (paddle, tracker.outliers())
    };
    let near = |p: [f64; 2]| (p[0] - y).hypot(p[1] - z);
    let (paddle, outliers) = run(&mut tracker, &seen);
    assert!(near(paddle) < 0.03 && outliers == 0, "{} m off, {outliers} outliers", near(paddle));

    // A place that is wrong by 20 cm: not believed, and the paddle stays near. Algorithm 1 follows it.
    let mut wrong = seen.clone();
    let at = wrong.len() - 1;
    wrong[at].place_m[1] += 0.2;
    let (paddle, outliers) = run(&mut tracker, &wrong);
    assert!(near(paddle) < 0.05 && outliers == 1, "{} m off, {outliers} outliers", near(paddle));
    let mut simple = Deterministic::new(0.85, SPACE);
    let goal = wrong.iter().filter_map(|s| simple.heard(s, [0.0; 2], &mut dice(1))).last().unwrap();
    assert!((goal.y_m - y).abs() > 0.1);

    // An echo 60 ms after an impact is none; an impact that was not heard leaves no gap.
    let mut more = seen.clone();
    more.insert(3, Seen { t_s: seen[2].t_s + 0.06, place_m: [0.1, 0.5] });
    assert!(near(run(&mut tracker, &more).0) < 0.03);
    let mut fewer = seen.clone();
    fewer.remove(2);
    let (paddle, _) = run(&mut tracker, &fewer);
    assert!(near(paddle) < 0.06, "{} m off", near(paddle));
}

/// The less is known, the shorter the paddle's step.
#[test]
fn a_ball_of_much_chance_moves_the_paddle_less() {
    let (seen, _) = straight(0.85, 0.05);
    let known = learned(0.85, 4.0);
    let step = |next: NextBounce| {
        let mut tracker = Stochastic::new(next, SPACE, StochasticSettings::default());
        tracker.heard(&seen[0], [0.5, 0.1], &mut dice(1));
        let goal = tracker.heard(&seen[1], [0.5, 0.1], &mut dice(1)).unwrap();
        (0.5 - goal.y_m).abs()
    };
    let (sure, unsure) = (step(known.clone()), step(learned(0.85, 2.0)));
    // With a paddle that is wide enough it stays where it is.
    let wide = StochasticSettings { touch_m: 0.5, ..StochasticSettings::default() };
    let mut tracker = Stochastic::new(known, SPACE, wide);
    tracker.heard(&seen[0], [0.4, 0.1], &mut dice(1));
    assert_eq!(tracker.heard(&seen[1], [0.4, 0.1], &mut dice(1)).unwrap().y_m, 0.4);
    println!("{sure:.3} m where the ball is sure, {unsure:.3} m where it is not");
    assert!(unsure < 0.6 * sure, "{sure} and {unsure}");
}

/// Ten throws that are heard in a living room: most are met, and no decision takes 5 ms.
#[test]
fn throws_are_met() {
    let room = Court::living_room(0.2).unwrap();
    let microphones = room.microphones_m().to_vec();
    let mut court = Court::new(room, FakeBall::new(0.85, 4e3), CourtSettings::default(), 3);
    let settings = HearSettings::default();
    let mut listener = Listener::new(&microphones, 44_100.0, 343.0, &settings, Delays::Phase).unwrap();
    let mut tracker = Stochastic::new(learned(0.84, 3.5), SPACE, StochasticSettings::default());
    let mean = Toss { place_m: [0.03, 0.275, 0.27], velocity_m_s: [0.5, 0.0, 0.0] };
    let (mut rng, mut met, mut thrown, mut slowest) = (dice(4), 0, 0, 0.0f64);
    for _ in 0..10 {
        court.rest();
        court.toss(&Toss::draw(&mean, 0.01, 0.05, &mut rng));
        let mut player =
            Player { listener: &mut listener, tracker: &mut tracker, plane_x_m: 0.55, buffer: 485 };
        if court.verdict() == Verdict::Out {
            continue;
        }
        let played = play(&mut court, &mut player, Court::is_over, &mut rng).unwrap();
        thrown += 1;
        met += usize::from(court.verdict() == Verdict::Touched);
        slowest = slowest.max(played.slowest_s);
        // From poses every 11 ms, a little less than the court's own sum.
        let share = played.energy_m2_s / court.energy_m2_s();
        assert!((0.8..1.05).contains(&share), "energy {share} of the truth");
    }
    println!("{met} of {thrown} met, slowest decision {:.2} ms", 1e3 * slowest);
    assert!(thrown >= 7 && met * 3 >= thrown * 2, "{met} of {thrown}");
}

/// The fake arm does what the trait promises.
#[test]
fn the_fake_arm_keeps_its_contract() {
    let room = Court::living_room(0.0).unwrap();
    let mut court = Court::new(room, FakeBall::new(0.8, 1e3), CourtSettings::default(), 1);
    let to = |y: f64, z: f64| Pose { position_m: [0.55, y, z], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] };
    let kind = |r: Result<(), bounce_audio::fake::FakeError>| r.unwrap_err().kind();
    assert_eq!(kind(court.move_to(to(2.0, 0.1), 1.0)), ErrorKind::OutOfRange);
    assert_eq!(kind(court.move_to(to(f64::NAN, 0.1), 1.0)), ErrorKind::OutOfRange);
    assert_eq!(kind(court.move_to(to(0.3, 0.1), 0.0)), ErrorKind::OutOfRange);
    let unturned = Pose { rotation_xyzw: [0.0; 4], ..to(0.3, 0.1) };
    assert_eq!(kind(court.move_to(unturned, 1.0)), ErrorKind::OutOfRange);
    assert_eq!(kind(court.move_to(to(0.5, 0.1), 0.1)), ErrorKind::Timeout);
    assert!(court.settled().unwrap(), "nothing moved");
    court.move_to(to(0.35, 0.2), 0.5).unwrap();
    assert!(!court.settled().unwrap());
    let (mut buffer, mut last, mut fastest) = (vec![0.0f32; 3 * 441], 0.275, 0.0f64);
    for k in 0..60 {
        let t = court.read(&mut buffer).unwrap();
        approx::assert_relative_eq!(t, f64::from(k) * 0.01, epsilon = 1e-9);
        // Half-way it thinks again; the motion goes on without a jump.
        if k == 25 {
            court.move_to(to(0.33, 0.15), 0.33).unwrap();
        }
        let y = court.pose().unwrap().value.position_m[1];
        fastest = fastest.max((y - last).abs() / 0.01);
        last = y;
    }
    assert!(court.settled().unwrap() && (last - 0.33).abs() < 1e-12);
    assert!(fastest < 1.0 && fastest > 0.15, "{fastest} m/s");
    assert!(court.read(&mut [0.0f32; 2]).is_err(), "no room for one instant");
}
