//! Dormand and Prince's pair of orders 5 and 4 (1980, doi:10.1016/0771-050X(80)90013-3), stepping from time to time.

use num_dual::DualNum;

use super::{Flight, FlightError, State};

/// Error allowed in a step, in metres and metres per second, relative to the state's size.
const TOLERANCE: f64 = 1e-11;
/// Steps allowed in a flight.
const MOST_STEPS: usize = 100_000;

const A: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Fifth-order weights less fourth-order ones.
const E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Position and velocity, or their rates.
type Six<T> = [T; 6];

pub(super) fn states<T: DualNum<Primitive = f64, Real = f64> + Copy>(
    flight: &Flight<T>,
    start: &State<T>,
    times_s: &[f64],
    out: &mut [State<T>],
) -> Result<(), FlightError> {
    let origin = start.position;
    let rate = |y: &Six<T>| -> Six<T> {
        let state = State { position: [y[0], y[1], y[2]], velocity: [y[3], y[4], y[5]] };
        let a = flight.acceleration(&state, &origin);
        [y[3], y[4], y[5], a[0], a[1], a[2]]
    };
    let (p, v) = (start.position, start.velocity);
    let mut y: Six<T> = [p[0], p[1], p[2], v[0], v[1], v[2]];
    let mut k = [rate(&y); 7];
    let (mut t, mut proposed) = (0.0, f64::INFINITY);
    let mut steps = 0;
    for (state, &end) in out.iter_mut().zip(times_s) {
        while t < end {
            let left = end - t;
            let whole = proposed >= left;
            let h = if whole { left } else { proposed.min(0.5 * left).max(0.0) };
            let mut next = y;
            for stage in 0..6 {
                next = y;
                for (j, weight) in A[stage][..=stage].iter().enumerate() {
                    if *weight != 0.0 {
                        for (n, k) in next.iter_mut().zip(&k[j]) {
                            *n += *k * (weight * h);
                        }
                    }
                }
                k[stage + 1] = rate(&next);
            }
            let size = 1.0 + y.iter().fold(0.0, |m: f64, v| m.max(v.re().abs()));
            let error = (0..6)
                .map(|i| (0..7).map(|j| E[j] * k[j][i].re()).sum::<f64>().abs() * h)
                .fold(0.0, f64::max)
                / (TOLERANCE * size);
            steps += 1;
            // The tolerance bounds the error of a step whatever its length: short steps add up to less than it says.
            if error <= 1.0 {
                y = next;
                k[0] = k[6];
                t = if whole { end } else { t + h };
            }
            let grown = if error > 0.0 { (0.9 * error.powf(-0.2)).clamp(0.2, 5.0) } else { 5.0 };
            if error > 1.0 || !whole || h * grown < proposed {
                proposed = h * grown.min(if error > 1.0 { 0.9 } else { 5.0 });
            }
            if steps > MOST_STEPS || !error.is_finite() || !(proposed > 1e-12 * (1.0 + t)) {
                return Err(FlightError::TooStiff { reached_s: t });
            }
        }
        *state = State { position: [y[0], y[1], y[2]], velocity: [y[3], y[4], y[5]] };
    }
    Ok(())
}
