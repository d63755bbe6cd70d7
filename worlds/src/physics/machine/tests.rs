use super::*;

fn machine(plant: Plant, start: [f64; 4], rows: usize, command: Vec<f64>) -> MachineWorld {
    let runs = vec![Run { start, lead_s: 0.0, rows, command }];
    MachineWorld { plant, row_s: 0.01, linear: false, runs }
}

fn joint(own: JointEffects) -> Effects {
    Effects { joints: [own, JointEffects::default()], ..Effects::default() }
}

/// On a linear spring dry friction takes `2 f / k` off every half swing, and the machine stands where the spring pulls less.
#[test]
fn dry_friction_on_a_spring_stops_where_it_should() {
    let hull = machine(Plant::Hull([25.0, 0.0]), [1.0, 0.0, 0.0, 0.0], 2000, Vec::new());
    let e = joint(JointEffects { coulomb: 2.0, ..JointEffects::default() });
    let x = &hull.readings(0, &e)[0];
    // Half swings of pi / 5 s about +-0.08: from 1 to -0.84, 0.68, ...
    for k in 0..6 {
        let t = std::f64::consts::PI / 5.0 * f64::from(k);
        let at = (t / 0.01).round() as usize;
        let expected = (1.0 - 0.16 * f64::from(k)) * if k % 2 == 0 { 1.0 } else { -1.0 };
        assert!((x[at] - expected).abs() < 3e-3, "{k}: {} {expected}", x[at]);
    }
    // 1 - 6 * 0.16 = 0.04 lies within 0.08.
    approx::assert_abs_diff_eq!(x[1999], 0.04, epsilon = 1e-9);
}

/// From v0 a joint without a spring stops after v0^2 / 2f and stays.
#[test]
fn a_cart_slides_to_its_exact_stop() {
    let cart = machine(Plant::Cart([1.0, 0.0]), [0.0, 1.0, 0.0, 0.0], 200, vec![0.0; 200]);
    let e = joint(JointEffects { coulomb: 0.7, ..JointEffects::default() });
    let x = cart.readings(0, &e);
    approx::assert_abs_diff_eq!(x[0][199], 0.5 / 0.7, epsilon = 1e-10);
    assert_eq!(x[1][199], 0.0);
}

/// A force below the friction moves nothing, one above it by the difference.
#[test]
fn a_joint_at_rest_is_held() {
    let mut command = vec![0.5; 100];
    command.extend(vec![1.5; 100]);
    let cart = machine(Plant::Cart([1.0, 0.0]), [0.0; 4], 200, command);
    let e = joint(JointEffects { coulomb: 1.0, ..JointEffects::default() });
    let x = cart.readings(0, &e);
    assert_eq!(x[0][100], 0.0);
    approx::assert_relative_eq!(x[1][199], 0.5 * 0.99, epsilon = 1e-9);
}

/// A step through a delay and a lag: 1 - exp(-(t - delay) / tau) as the acceleration.
#[test]
fn a_drive_is_late_and_lags() {
    let mut command = vec![0.0; 20];
    command.extend(vec![1.0; 180]);
    let cart = machine(Plant::Cart([2.0, 0.0]), [0.0; 4], 200, command);
    let input = InputEffects { delay_s: 0.0137, lag_s: 0.08, ..InputEffects::default() };
    let v = &cart.readings(0, &Effects { input, ..Effects::default() })[1];
    for (row, v) in v.iter().enumerate() {
        let t = (row as f64 * 0.01 - 0.2 - 0.0137).max(0.0);
        approx::assert_abs_diff_eq!(*v, 2.0 * (t - 0.08 * (1.0 - (-t / 0.08).exp())), epsilon = 1e-7);
    }
}

/// Sensors read y(t - delay), and lag behind a ramp by tau.
#[test]
fn sensors_are_late() {
    let cart = machine(Plant::Cart([1.0, 0.0]), [0.0, 1.0, 0.0, 0.0], 200, vec![0.0; 200]);
    let late = SensorEffects { delay_s: 0.033, gain: 0.1, drift_per_s: 0.5, ..SensorEffects::default() };
    let slow = Effects { outputs: [late, SensorEffects::default()], ..Effects::default() };
    let x = &cart.readings(0, &slow)[0];
    for (row, x) in x.iter().enumerate().skip(5) {
        let t = row as f64 * 0.01;
        approx::assert_relative_eq!(*x, 1.1 * (t - 0.033) + 0.5 * t, epsilon = 1e-9);
    }
    let lags = SensorEffects { lag_s: 0.05, ..SensorEffects::default() };
    let x = &cart.readings(0, &Effects { outputs: [lags, lags], ..Effects::default() })[0];
    approx::assert_relative_eq!(x[199], 1.99 - 0.05, epsilon = 1e-6);
}

/// Without a load on the rope the trolley is a cart, and the load swings with the pendulum's period.
#[test]
fn a_crane_is_a_cart_and_a_pendulum() {
    let length: f64 = 0.6;
    let omega = (crate::GRAVITY_M_S2 / length).sqrt();
    let plant = Plant::Crane([1.0, 0.0, crate::GRAVITY_M_S2 / length, length]);
    let x = machine(plant, [0.0, 0.0, 1e-3, 0.0], 300, vec![0.0; 300]).readings(0, &Effects::default());
    for (row, angle) in x[1].iter().enumerate() {
        approx::assert_abs_diff_eq!(*angle, 1e-3 * (omega * 0.01 * row as f64).cos(), epsilon = 1e-8);
    }
    // At a steady pull a small load hangs at -a / g.
    let x = machine(plant, [0.0; 4], 300, vec![0.01; 300]).readings(0, &Effects::default());
    let mean = x[1].iter().sum::<f64>() / 300.0;
    let steady: f64 = (0..300).map(|row| (omega * 0.01 * f64::from(row)).cos() - 1.0).sum::<f64>() / 300.0;
    approx::assert_relative_eq!(mean, 0.01 / crate::GRAVITY_M_S2 * steady, max_relative = 1e-3);
}

/// A shaft without damping keeps its energy, motor and link swing against each other with the sum of both stiffnesses.
#[test]
fn a_shaft_rings_with_both_ends() {
    let plant = Plant::Shaft([1.0, 0.0, 100.0, 300.0, 0.0]);
    let x = machine(plant, [0.3, 0.0, 0.0, 0.0], 300, vec![0.0; 300]).readings(0, &Effects::default());
    for (row, (motor, link)) in x[0].iter().zip(&x[1]).enumerate() {
        approx::assert_abs_diff_eq!(motor - link, 0.3 * (20.0 * 0.01 * row as f64).cos(), epsilon = 2e-6);
        approx::assert_abs_diff_eq!(300.0 * motor + 100.0 * link, 90.0, epsilon = 1e-9);
    }
}

/// Torricelli without an inflow; with one above the overflow the level stays there.
#[test]
fn a_tank_drains_and_spills() {
    let tank = machine(Plant::Tank([100.0, 0.05]), [0.25, 0.0, 0.0, 0.0], 300, vec![0.0; 300]);
    for (row, h) in tank.readings(0, &Effects::default())[0].iter().enumerate() {
        approx::assert_relative_eq!(h.sqrt(), 0.5 - 0.00025 * row as f64, epsilon = 1e-9);
    }
    let level = LevelEffects { overflow: Some(0.3), leak_per_s: 0.0 };
    let filled = machine(Plant::Tank([100.0, 0.05]), [0.25, 0.0, 0.0, 0.0], 300, vec![1e-3; 300]);
    let h = &filled.readings(0, &Effects { level, ..Effects::default() })[0];
    assert!(h[299] == 0.3 && h[10] < 0.3);
}

/// A servo that has settled stands half a gap short of where the command went last.
#[test]
fn play_is_half_a_gap_on_either_side() {
    let mut command = vec![0.0; 10];
    command.extend(vec![1.0; 500]);
    command.extend(vec![0.2; 500]);
    let servo = machine(Plant::Servo([400.0, 30.0]), [0.0; 4], 1010, command);
    let input = InputEffects { gap: 0.1, ..InputEffects::default() };
    let x = &servo.readings(0, &Effects { input, ..Effects::default() })[0];
    approx::assert_abs_diff_eq!(x[509], 0.95, epsilon = 1e-9);
    approx::assert_abs_diff_eq!(x[1009], 0.25, epsilon = 1e-9);
}

/// A yielding spring that is drawn far pulls with its stiffness times its yield.
#[test]
fn a_spring_that_yields_pulls_no_harder() {
    let hull = machine(Plant::Cart([1.0, 0.0]), [0.0, 1.0, 0.0, 0.0], 200, vec![0.0; 200]);
    let e = joint(JointEffects { hysteresis: [20.0, 0.02], ..JointEffects::default() });
    let v = &hull.readings(0, &e)[1];
    // After 0.3 m the spring has yielded by all but exp(-15).
    let deceleration = (v[40] - v[80]) / 0.4;
    approx::assert_relative_eq!(deceleration, 20.0 * 0.02, max_relative = 1e-3);
}

/// The clock's rate stretches a swing, and commands with it.
#[test]
fn a_fast_clock_says_later() {
    let hull = machine(Plant::Hull([25.0, 0.0]), [1.0, 0.0, 0.0, 0.0], 300, Vec::new());
    let x = &hull.readings(0, &Effects { clock_rate: 0.02, ..Effects::default() })[0];
    for (row, x) in x.iter().enumerate() {
        approx::assert_abs_diff_eq!(*x, (5.0 * 0.01 * row as f64 / 1.02).cos(), epsilon = 1e-7);
    }
}
