//! Where the microphones are, refined from taps at known places.

use super::array::ArrayError;
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// Steps of Gauss-Newton at most.
const ROUNDS: usize = 40;

/// A tap at a known place.
#[derive(Debug, Clone, PartialEq)]
pub struct Tap {
    /// Where it was, m.
    pub place_m: [f64; 3],
    /// When each microphone heard it, s, any common offset.
    pub arrivals_s: Vec<f64>,
}

/// What was known before, as standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurveyPrior {
    /// Standard deviation of each coordinate of a microphone, as it was measured with a tape, m.
    pub position_sigma_m: f64,
    /// Standard deviation of the speed of sound, m/s.
    pub speed_sigma_m_s: f64,
    /// Standard deviation of an arrival, s.
    pub arrival_sigma_s: f64,
}

/// Microphones as the taps have them.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Positions, m.
    pub microphones_m: Vec<[f64; 3]>,
    /// Standard deviation of each coordinate, m; near the prior's where the taps say nothing.
    pub sigmas_m: Vec<[f64; 3]>,
    /// Speed of sound, m/s, and its standard deviation.
    pub speed_of_sound_m_s: (f64, f64),
    /// Root mean square of what is left of the arrivals, s.
    pub residual_s: f64,
    /// Chi-square of arrivals and prior over its degrees of freedom: near 1 where what was stated holds, far above where a tap or a channel
    /// is wrong.
    pub chi_square: f64,
}

/// Why microphones cannot be surveyed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SurveyError {
    /// Positions, the speed of sound or a sigma are out of range.
    #[error(transparent)]
    Value(#[from] ArrayError),
    /// Not one arrival a microphone.
    #[error("tap {tap} has {got} arrivals, expected {expected}")]
    Arrivals {
        /// The tap, from 0.
        tap: usize,
        /// Number of microphones.
        expected: usize,
        /// Arrivals of the tap.
        got: usize,
    },
    /// No tap, or fewer than two microphones.
    #[error("{taps} taps and {microphones} microphones, expected at least one and two")]
    TooFew {
        /// Taps.
        taps: usize,
        /// Microphones.
        microphones: usize,
    },
}

/// Refines microphones (m, as measured) and the speed of sound (m/s) from taps, by least squares with what was known before as a prior.
///
/// Taps that are all on the table leave the microphones' side of it open: the prior decides.
///
/// # Errors
/// [`SurveyError`].
pub fn survey(
    microphones_m: &[[f64; 3]],
    speed_of_sound_m_s: f64,
    taps: &[Tap],
    prior: &SurveyPrior,
) -> Result<Survey, SurveyError> {
    let microphones = microphones_m.len();
    if taps.is_empty() || microphones < 2 {
        return Err(SurveyError::TooFew { taps: taps.len(), microphones });
    }
    check(microphones_m, speed_of_sound_m_s, taps, prior)?;
    let unknowns = 3 * microphones + 1;
    let before =
        DVector::from_iterator(unknowns, microphones_m.iter().flatten().copied().chain([speed_of_sound_m_s]));
    let sigma = |k: usize| if k + 1 < unknowns { prior.position_sigma_m } else { prior.speed_sigma_m_s };
    let mut at = before.clone();
    let mut inverse = DMatrix::zeros(unknowns, unknowns);
    for _ in 0..ROUNDS {
        let (mut a, mut b) = (DMatrix::zeros(unknowns, unknowns), DVector::zeros(unknowns));
        for tap in taps {
            add(tap, &at, prior.arrival_sigma_s, &mut a, &mut b);
        }
        for k in 0..unknowns {
            let weight = sigma(k).powi(-2);
            a[(k, k)] += weight;
            b[k] += weight * (before[k] - at[k]);
        }
        let Some(cholesky) = a.cholesky() else { break };
        let step = cholesky.solve(&b);
        at += &step;
        inverse = cholesky.inverse();
        if step.amax() < 1e-10 {
            break;
        }
    }
    let mut squares = 0.0;
    for tap in taps {
        squares += rows(tap, &at).0.iter().map(|r| r * r).sum::<f64>();
    }
    let stray = (0..unknowns).map(|k| ((at[k] - before[k]) / sigma(k)).powi(2)).sum::<f64>();
    let dof = taps.len() * (microphones - 1);
    let three = |from: &dyn Fn(usize) -> f64, i: usize| std::array::from_fn(|k| from(3 * i + k));
    let deviation = |k: usize| inverse[(k, k)].max(0.0).sqrt();
    Ok(Survey {
        microphones_m: (0..microphones).map(|i| three(&|k| at[k], i)).collect(),
        sigmas_m: (0..microphones).map(|i| three(&deviation, i)).collect(),
        speed_of_sound_m_s: (at[unknowns - 1], deviation(unknowns - 1)),
        residual_s: (squares / (taps.len() * microphones) as f64).sqrt(),
        // Each unknown has a prior: as many more numbers as there are unknowns.
        chi_square: (squares / prior.arrival_sigma_s.powi(2) + stray) / dof as f64,
    })
}

fn check(
    microphones_m: &[[f64; 3]],
    speed: f64,
    taps: &[Tap],
    prior: &SurveyPrior,
) -> Result<(), SurveyError> {
    let value = |what, expected, got, ok: bool| {
        if ok { Ok(()) } else { Err(SurveyError::Value(ArrayError::Value { what, expected, got })) }
    };
    for &v in microphones_m.iter().flatten() {
        value("a microphone's position", "a finite number", v, v.is_finite())?;
    }
    for (what, v) in [
        ("the speed of sound", speed),
        ("the positions' sigma", prior.position_sigma_m),
        ("the speed's sigma", prior.speed_sigma_m_s),
        ("the arrivals' sigma", prior.arrival_sigma_s),
    ] {
        value(what, "a finite number above 0", v, v > 0.0 && v.is_finite())?;
    }
    for (tap, one) in taps.iter().enumerate() {
        let (expected, got) = (microphones_m.len(), one.arrivals_s.len());
        if expected != got {
            return Err(SurveyError::Arrivals { tap, expected, got });
        }
        for &v in one.place_m.iter().chain(&one.arrivals_s) {
            value("a tap's place or arrival", "a finite number", v, v.is_finite())?;
        }
    }
    Ok(())
}

/// What is left of a tap's arrivals, and how each changes with its microphone's place and the speed; the mean over the microphones is off,
/// since nobody knows when the tap was.
fn rows(tap: &Tap, at: &DVector<f64>) -> (Vec<f64>, Vec<[f64; 4]>) {
    let speed = at[at.len() - 1];
    let (mut left, mut slopes) = (Vec::new(), Vec::new());
    for (i, t) in tap.arrivals_s.iter().enumerate() {
        let to: [f64; 3] = std::array::from_fn(|k| at[3 * i + k] - tap.place_m[k]);
        let range = to.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-9);
        left.push(t - range / speed);
        let [x, y, z] = to.map(|v| v / (range * speed));
        slopes.push([x, y, z, -range / (speed * speed)]);
    }
    let mean = left.iter().sum::<f64>() / left.len() as f64;
    left.iter_mut().for_each(|v| *v -= mean);
    (left, slopes)
}

fn add(tap: &Tap, at: &DVector<f64>, sigma_s: f64, a: &mut DMatrix<f64>, b: &mut DVector<f64>) {
    let (left, slopes) = rows(tap, at);
    let (n, last) = (left.len(), at.len() - 1);
    // A row for each microphone, their mean taken off.
    let full = DMatrix::from_fn(n, at.len(), |i, k| {
        if k == last {
            slopes[i][3]
        } else if k / 3 == i {
            slopes[i][k % 3]
        } else {
            0.0
        }
    });
    let mean = full.row_mean();
    let centred = DMatrix::from_fn(n, at.len(), |i, k| (full[(i, k)] - mean[k]) / sigma_s);
    *a += centred.transpose() * &centred;
    *b += centred.transpose() * DVector::from_iterator(n, left.iter().map(|v| v / sigma_s));
}
