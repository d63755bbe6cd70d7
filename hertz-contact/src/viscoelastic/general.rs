//! Any relaxation along a history, by sums over all of it.

use super::{Contact, HistoryError, Relaxation, check_history};
use crate::law::Law;

/// A straight piece of the history.
#[derive(Debug, Clone, Copy)]
struct Piece {
    from_s: f64,
    to_s: f64,
    from_m: f64,
    to_m: f64,
}

/// Forces in N along a history of times (s, not falling; equal ones are a jump) and indentations (m), for any relaxation, in
/// O(n^2); [`super::LinearSolid::forces`] is the fast way for a linear solid.
///
/// # Errors
/// [`HistoryError`].
pub fn forces_by_quadrature<R: Relaxation<f64>, L: Law<f64>>(
    relaxation: &R,
    law: &L,
    contact: Contact,
    times_s: &[f64],
    indentations_m: &[f64],
    forces_n: &mut [f64],
) -> Result<(), HistoryError> {
    relaxation.check()?;
    check_history(times_s, indentations_m, forces_n.len())?;
    let mut pieces: Vec<Piece> = Vec::with_capacity(times_s.len() + 1);
    // Pieces along which the contact grew, by index; the rest only counts in what moved since.
    let mut grew = Vec::with_capacity(times_s.len() + 1);
    let mut before: Option<(f64, f64)> = None;
    for ((&to_s, &to_m), out) in times_s.iter().zip(indentations_m).zip(forces_n.iter_mut()) {
        let (from_s, from_m) = match (pieces.last(), before) {
            (Some(piece), _) => (piece.to_s, piece.to_m),
            (None, _) if to_m <= 0.0 => {
                before = Some((to_s, to_m));
                *out = 0.0;
                continue;
            }
            (None, Some((t, d))) => (t + d / (d - to_m) * (to_s - t), 0.0),
            (None, None) => (to_s, 0.0),
        };
        pieces.push(Piece { from_s, to_s, from_m, to_m });
        let last = pieces.len() - 1;
        if contact == Contact::Fixed {
            let sum: f64 = pieces.iter().map(|p| p.force(relaxation, law, to_s, 1.0)).sum();
            *out = sum.max(0.0);
            continue;
        }
        // What moved since the end of each piece, from the latest back.
        let mut since = 0.0;
        let mut latest = grew.len();
        let mut index = last;
        let mut part = 1.0;
        let end = grew.last().map_or(0, |i| i + 1);
        for i in (end..=last).rev() {
            since += pieces[i].moved(relaxation, to_s, 1.0);
        }
        if since >= 0.0 {
            grew.push(last);
        } else {
            loop {
                if latest == 0 {
                    break;
                }
                latest -= 1;
                // Back over this piece, and over those after the one before, along which nothing grew.
                index = grew[latest];
                let more = pieces[index].moved(relaxation, to_s, 1.0);
                if since + more >= 0.0 {
                    let piece = pieces[index];
                    // since + (whole - part) = 0.
                    let f = |p: f64| {
                        let slope = relaxation.remaining(to_s - piece.time(p)) * (piece.to_m - piece.from_m);
                        (piece.moved(relaxation, to_s, p) - more - since, slope)
                    };
                    part = crate::root::rising(f, 0.0, 1.0, 0.5);
                    break;
                }
                since += more;
                part = 0.0;
                let stop = if latest == 0 { 0 } else { grew[latest - 1] + 1 };
                for piece in &pieces[stop..index] {
                    since += piece.moved(relaxation, to_s, 1.0);
                }
            }
        }
        if since < 0.0 && latest == 0 && part == 0.0 {
            *out = 0.0;
            continue;
        }
        *out = pieces[..index].iter().map(|p| p.force(relaxation, law, to_s, 1.0)).sum::<f64>()
            + pieces[index].force(relaxation, law, to_s, part);
    }
    Ok(())
}

impl Piece {
    fn time(&self, part: f64) -> f64 {
        self.from_s + part * (self.to_s - self.from_s)
    }

    /// `int psi(t - s) d delta` over the first part of the piece.
    fn moved<R: Relaxation<f64>>(&self, relaxation: &R, now_s: f64, part: f64) -> f64 {
        let (way, step) = (self.to_m - self.from_m, self.to_s - self.from_s);
        if step > 0.0 {
            let (a, b) = (now_s - self.from_s, now_s - self.time(part));
            way / step * (relaxation.integral(a) - relaxation.integral(b))
        } else {
            way * part * relaxation.remaining(now_s - self.from_s)
        }
    }

    /// `int psi(t - s) d f(delta(s))` over the first part of the piece, f as a parabola in time.
    fn force<R: Relaxation<f64>, L: Law<f64>>(&self, relaxation: &R, law: &L, now_s: f64, part: f64) -> f64 {
        let to_m = self.from_m + part * (self.to_m - self.from_m);
        let step = self.time(part) - self.from_s;
        let (f0, f1) = (law.force(self.from_m), law.force(to_m));
        if !(step > 0.0) {
            return (f1 - f0) * relaxation.remaining(now_s - self.from_s);
        }
        let middle = law.force(0.5 * (self.from_m + to_m));
        // df/ds at the ends, times the step.
        let (slope_0, slope_1) = (4.0 * middle - 3.0 * f0 - f1, f0 - 4.0 * middle + 3.0 * f1);
        let (a, b) = (now_s - self.from_s, now_s - self.time(part));
        if step <= 1e-3 * b {
            // Long ago: the differences below would cancel, while what is left is smooth over the step.
            let at = |x: f64| relaxation.remaining(a - x * step) * (slope_0 + x * (slope_1 - slope_0));
            let off = 0.15_f64.sqrt();
            return (5.0 * (at(0.5 - off) + at(0.5 + off)) + 8.0 * at(0.5)) / 18.0;
        }
        // By parts.
        let (slope_0, slope_1) = (slope_0 / step, slope_1 / step);
        let bend = (slope_1 - slope_0) / step;
        slope_0 * relaxation.integral(a) - slope_1 * relaxation.integral(b)
            + bend * (relaxation.double_integral(a) - relaxation.double_integral(b))
    }
}
