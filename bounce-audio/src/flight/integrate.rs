//! Dormand and Prince's pair of orders 5 and 4 (1980, doi:10.1016/0771-050X(80)90013-3), stepping from time to time.

use num_dual::DualNum;

use super::error::FlightError;
use super::forces::{Flight, State};

/// Error allowed in a step, in metres and metres per second, relative to the state's size.
const TOLERANCE: f64 = 1e-11;
/// Error allowed in a step of what quadratic drag would do, for dual numbers, relative to that drag's size.
const DRAG_TOLERANCE: f64 = 1e-9;
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

/// Largest growth from one step to the next.
const MOST_GROWTH: f64 = 5.0;

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
            let mut error =
                worst((0..6).map(|i| (0..7).map(|j| E[j] * k[j][i].re()).sum())) * h / (TOLERANCE * size);
            if T::NDERIV > 0 {
                error = worst([error, drag_error(flight, &k) * h / DRAG_TOLERANCE].into_iter());
            }
            steps += 1;
            // The tolerance bounds the error of a step whatever its length: short steps add up to less than it says.
            let accepted = error <= 1.0 && next.iter().all(|v| v.re().is_finite());
            if accepted {
                y = next;
                k[0] = k[6];
                t = if whole { end } else { t + h };
            }
            // An overlong step may overflow: that is a rejection like any other.
            let grown = if error.is_finite() { 0.9 * error.powf(-0.2) } else { 0.1 };
            // A step that was cut short by the next time shows that longer ones may do, not that shorter ones must.
            if !accepted {
                proposed = h * grown.clamp(0.1, 0.9);
            } else if !whole || grown < MOST_GROWTH {
                proposed = h * grown.clamp(0.2, MOST_GROWTH);
            }
            if steps > MOST_STEPS || !(proposed > 1e-12 * (1.0 + t)) {
                return Err(FlightError::TooStiff { reached_s: t });
            }
        }
        *state = State { position: [y[0], y[1], y[2]], velocity: [y[3], y[4], y[5]] };
    }
    Ok(())
}

/// The largest modulus; NaN where one is NaN (which `f64::max` would pass over).
fn worst(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |m, v| if v.is_nan() || m.is_nan() { f64::NAN } else { m.max(v.abs()) })
}

/// The step's relative error per second in the integral of `|u| u`, from the velocities at its stages.
///
/// Where drag is off, the flight is a parabola and its own error says nothing, but the derivative with respect to the
/// drag is just this integral; it has a kink where the ball turns over.
fn drag_error<T: DualNum<Primitive = f64, Real = f64> + Copy>(flight: &Flight<T>, k: &[Six<T>; 7]) -> f64 {
    let (mut sums, mut size) = ([0.0; 3], 1.0);
    for (weight, rates) in E.iter().zip(k) {
        let u = [0, 1, 2].map(|i| rates[i].re() - flight.wind_m_s[i].re());
        let square: f64 = u.iter().map(|u| u * u).sum();
        let speed = square.sqrt();
        size = square.max(size);
        for (sum, u) in sums.iter_mut().zip(u) {
            *sum += weight * speed * u;
        }
    }
    worst(sums.into_iter()) / size
}
