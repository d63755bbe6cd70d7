//! A place in space: four or more microphones, in closed form (Bancroft 1985, doi:10.1109/TAES.1985.310538) and then by least squares.

use super::array::ArrayError;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Vector3, Vector4};

/// Steps of Gauss-Newton at most.
const ROUNDS: usize = 25;
/// A direction along which arrivals change by less than this part of the best one's is not determined.
const LEAST: f64 = 1e-9;

/// A place in space, with its covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceLocation {
    /// Place, m.
    pub position_m: [f64; 3],
    /// Covariance over the variance of an arrival, m^2/s^2: times the square of an arrival's sigma it is the place's.
    pub cofactor_m2_s2: [[f64; 3]; 3],
    /// Root of the sum of squares of what is left of the arrivals over the degrees of freedom (microphones less 4), s; `None` with
    /// four microphones, which leave nothing.
    pub residual_s: Option<f64>,
    /// Another place that fits about as well: the mirror image behind microphones in a plane, or the second meeting of four.
    pub second_m: Option<[f64; 3]>,
}

/// The place in space that fits arrivals (s, one a microphone, any common offset), for microphones at known places (m, four or more, not on
/// one line) and a speed of sound (m/s). Of two places that fit alike the one with the greater z comes first: above the table.
///
/// # Errors
/// [`ArrayError`]: too few microphones, no number, or microphones that leave a direction open ([`ArrayError::OnALine`]).
pub fn locate_in_space(
    microphones_m: &[[f64; 3]],
    speed_of_sound_m_s: f64,
    arrivals_s: &[f64],
) -> Result<SpaceLocation, ArrayError> {
    let n = microphones_m.len();
    let finite = |what, got: f64| {
        if got.is_finite() {
            Ok(())
        } else {
            Err(ArrayError::Value { what, expected: "a finite number", got })
        }
    };
    if n < 4 || arrivals_s.len() != n {
        return Err(ArrayError::TooFew { expected: 4.max(n), got: n.min(arrivals_s.len()) });
    }
    microphones_m.iter().flatten().try_for_each(|v| finite("a microphone's position", *v))?;
    arrivals_s.iter().try_for_each(|v| finite("an arrival", *v))?;
    if !(speed_of_sound_m_s > 0.0 && speed_of_sound_m_s.is_finite()) {
        let expected = "a finite number above 0";
        return Err(ArrayError::Value { what: "the speed of sound", expected, got: speed_of_sound_m_s });
    }
    let problem = Problem::new(microphones_m, speed_of_sound_m_s, arrivals_s)?;
    let mut found: Vec<Fitted> = problem.starts().into_iter().filter_map(|s| problem.descend(s)).collect();
    found.sort_by(|a, b| a.squares.total_cmp(&b.squares));
    let Some(best) = found.first().cloned() else { return Err(problem.open()) };
    let scale = problem.size.powi(2);
    let rival = found[1..].iter().find(|f| {
        (f.state.xyz() - best.state.xyz()).norm() > 1e-3 * problem.size
            && f.squares <= 9.0 * best.squares + 1e-12 * scale
    });
    let place = |f: &Fitted| -> [f64; 3] { (f.state.xyz() + problem.centre).into() };
    let (first, second) = match rival {
        Some(r) if r.state.z > best.state.z => (r, Some(&best)),
        other => (&best, other),
    };
    let c2 = speed_of_sound_m_s.powi(2);
    let dof = n - 4;
    Ok(SpaceLocation {
        position_m: place(first),
        cofactor_m2_s2: std::array::from_fn(|i| std::array::from_fn(|j| c2 * first.cofactor[(i, j)])),
        residual_s: (dof > 0).then(|| (first.squares / dof as f64).sqrt() / speed_of_sound_m_s),
        second_m: second.map(place),
    })
}

/// Microphones about their middle, and ranges but for a common one, m.
struct Problem {
    microphones: Vec<Vector3<f64>>,
    ranges: Vec<f64>,
    centre: Vector3<f64>,
    size: f64,
    /// Unit vector along which the microphones spread least, and how far they do along the two longest.
    thin: Vector3<f64>,
    spread: [f64; 2],
}

#[derive(Clone)]
struct Fitted {
    /// Place, and the common range.
    state: Vector4<f64>,
    squares: f64,
    cofactor: Matrix3<f64>,
}

impl Problem {
    fn new(microphones_m: &[[f64; 3]], speed: f64, arrivals_s: &[f64]) -> Result<Self, ArrayError> {
        let n = microphones_m.len() as f64;
        let centre = microphones_m.iter().map(|m| Vector3::from(*m)).sum::<Vector3<f64>>() / n;
        let microphones: Vec<_> = microphones_m.iter().map(|m| Vector3::from(*m) - centre).collect();
        let moment = microphones.iter().map(|m| m * m.transpose()).sum::<Matrix3<f64>>() / n;
        let eigen = moment.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let [long, wide] = [order[0], order[1]].map(|k| eigen.eigenvalues[k].max(0.0).sqrt());
        let mean = arrivals_s.iter().sum::<f64>() / n;
        let problem = Self {
            microphones,
            ranges: arrivals_s.iter().map(|t| speed * (t - mean)).collect(),
            centre,
            size: long,
            thin: eigen.eigenvectors.column(order[2]).into(),
            spread: [long, wide],
        };
        if wide > 0.02 * long { Ok(problem) } else { Err(problem.open()) }
    }

    fn open(&self) -> ArrayError {
        ArrayError::OnALine { expected_m: 0.02 * self.spread[0], got_m: self.spread[1] }
    }

    /// Bancroft's two roots, seen from beside the microphones' plane, so that a plane of them is no special case.
    fn starts(&self) -> Vec<Vector4<f64>> {
        let shift = 2.0 * self.size * self.thin;
        let n = self.microphones.len();
        let rows =
            DMatrix::from_fn(
                n,
                4,
                |i, k| {
                    if k < 3 { self.microphones[i][k] + shift[k] } else { -self.ranges[i] }
                },
            );
        let half = |i: usize| 0.5 * ((self.microphones[i] + shift).norm_squared() - self.ranges[i].powi(2));
        let svd = rows.svd(true, true);
        let solve =
            |right: DVector<f64>| svd.solve(&right, 1e-12).ok().map(|y| Vector4::new(y[0], y[1], y[2], y[3]));
        let (Some(u), Some(v)) =
            (solve(DVector::from_element(n, 1.0)), solve(DVector::from_fn(n, |i, _| half(i))))
        else {
            return Vec::new();
        };
        let product = |a: &Vector4<f64>, b: &Vector4<f64>| a.xyz().dot(&b.xyz()) - a.w * b.w;
        let (a, b, c) = (product(&u, &u), product(&u, &v) - 1.0, product(&v, &v));
        let root = (b * b - a * c).max(0.0).sqrt();
        let lambdas =
            if a.abs() > 1e-12 { vec![(-b + root) / a, (-b - root) / a] } else { vec![-0.5 * c / b] };
        let mut starts: Vec<Vector4<f64>> = Vec::new();
        for lambda in lambdas {
            let y = lambda * u + v;
            let place = y.xyz() - shift;
            starts.push(Vector4::new(place.x, place.y, place.z, y.w));
        }
        // On both sides of the microphones, where noise has taken the roots away.
        let count = starts.len();
        for k in 0..count {
            let (s, off) = (starts[k], starts[k].xyz().dot(&self.thin));
            let mirrored = s.xyz() - (2.0 * off + 0.1 * self.size * off.signum()) * self.thin;
            starts.push(Vector4::new(mirrored.x, mirrored.y, mirrored.z, s.w));
        }
        starts.retain(|s| s.iter().all(|v| v.is_finite()));
        starts
    }

    fn squares(&self, state: &Vector4<f64>) -> f64 {
        let off = |(m, r): (&Vector3<f64>, &f64)| (r - state.w - (state.xyz() - m).norm()).powi(2);
        self.microphones.iter().zip(&self.ranges).map(off).sum()
    }

    fn descend(&self, start: Vector4<f64>) -> Option<Fitted> {
        let (mut state, mut damping) = (start, 1e-9);
        let mut squares = self.squares(&state);
        let normal = |state: &Vector4<f64>| {
            let (mut a, mut b) = (Matrix4::zeros(), Vector4::zeros());
            for (m, r) in self.microphones.iter().zip(&self.ranges) {
                let to = state.xyz() - m;
                let range = to.norm().max(1e-9);
                let j = Vector4::new(to.x / range, to.y / range, to.z / range, 1.0);
                a += j * j.transpose();
                b += j * (r - state.w - range);
            }
            (a, b)
        };
        for _ in 0..ROUNDS {
            let (mut a, b) = normal(&state);
            for k in 0..4 {
                a[(k, k)] *= 1.0 + damping;
            }
            let step = a.lu().solve(&b)?;
            let next = state + step;
            let then = self.squares(&next);
            if then <= squares {
                (state, squares, damping) = (next, then, 0.1 * damping);
                if step.norm() < 1e-12 * self.size {
                    break;
                }
            } else {
                damping = (10.0 * damping).max(1e-6);
            }
        }
        let (a, _) = normal(&state);
        let eigen = a.symmetric_eigenvalues();
        let inverse = a.try_inverse()?;
        let determined = eigen.min() > LEAST * eigen.max();
        determined.then(|| Fitted { state, squares, cofactor: inverse.fixed_view::<3, 3>(0, 0).into() })
    }
}
