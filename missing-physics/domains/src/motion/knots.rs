//! Inputs of long recordings by fewer knots: straight lines between rows that count, whose moments are those of the input itself.
//!
//! A command at 1 kHz changes in every row, far faster than the machine it drives follows. What that machine feels is its integral: a
//! polygon that is the input's projection in the mean square onto polygons with fewer knots keeps every integral against such a polygon
//! (de Boor 1978, A Practical Guide to Splines, chapter III). Where an input jumps, two knots stand next to each other.

use missing_physics::data::Run;

/// An input that changes by more than this part of its range from one row to the next jumps there.
const JUMP: f64 = 0.02;
/// The knot before a jump stands so many rows before it.
const BEFORE: f64 = 1e-6;

/// Rows at which an input, held from row to row, jumps.
pub(super) fn jumps(column: &[f64], range: f64) -> Vec<usize> {
    (1..column.len()).filter(|&i| (column[i] - column[i - 1]).abs() > JUMP * range).collect()
}

/// A run at the rows `kept` (rising, the first row among them) and just before each of the rows `jumps` among them, with inputs that are
/// to be joined by straight lines: `held` says of each whether it holds in `run` from row to row.
pub(super) fn fewer(run: &Run, kept: &[usize], jumps: &[usize], held: &[bool]) -> Run {
    let times = &run.inputs[0];
    // Each piece between jumps by itself: the rows of its knots, and when it ends.
    let mut pieces: Vec<(Vec<usize>, Option<usize>)> = vec![(Vec::new(), None)];
    for &row in kept {
        if jumps.binary_search(&row).is_ok()
            && let Some(last) = pieces.last_mut()
        {
            last.1 = Some(row);
            pieces.push((Vec::new(), None));
        }
        if let Some(last) = pieces.last_mut() {
            last.0.push(row);
        }
    }
    let mut fewer = Run {
        label: run.label.clone(),
        inputs: vec![Vec::new(); run.inputs.len()],
        outputs: vec![Vec::new(); run.outputs.len()],
        kind: run.kind,
    };
    for (rows, end) in pieces {
        let mut knots: Vec<f64> = rows.iter().map(|&row| times[row]).collect();
        if let Some(end) = end {
            knots.push(times[end] - BEFORE * (times[end] - times[end - 1]));
        }
        for (k, held) in held.iter().enumerate() {
            fewer.inputs[1 + k].extend(projected(times, &run.inputs[1 + k], *held, &knots));
        }
        fewer.inputs[0].extend(&knots);
        for (column, to) in run.outputs.iter().zip(&mut fewer.outputs) {
            to.extend(rows.iter().map(|&row| column[row]).chain(end.map(|_| f64::NAN)));
        }
    }
    fewer
}

/// Values at knots of the polygon nearest to a column in the mean square.
fn projected(times: &[f64], column: &[f64], held: bool, knots: &[f64]) -> Vec<f64> {
    let n = knots.len();
    if n < 2 {
        let at = times.partition_point(|t| *t <= knots[0]).max(1) - 1;
        return vec![column[at]];
    }
    let (mut diagonal, mut beside, mut right) = (vec![0.0; n], vec![0.0; n - 1], vec![0.0; n]);
    for (k, pair) in knots.windows(2).enumerate() {
        let h = pair[1] - pair[0];
        diagonal[k] += h / 3.0;
        diagonal[k + 1] += h / 3.0;
        beside[k] = h / 6.0;
        let [first, second] = moments(times, column, held, [pair[0], pair[1]]);
        right[k] += first;
        right[k + 1] += second;
    }
    for k in 1..n {
        let factor = beside[k - 1] / diagonal[k - 1];
        diagonal[k] -= factor * beside[k - 1];
        right[k] -= factor * right[k - 1];
    }
    for k in (0..n).rev() {
        let after = if k + 1 < n { beside[k] * right[k + 1] } else { 0.0 };
        right[k] = (right[k] - after) / diagonal[k];
    }
    right
}

/// Integrals of a column over an interval, against the lines that fall from one to zero and rise from zero to one there.
fn moments(times: &[f64], column: &[f64], held: bool, [from, to]: [f64; 2]) -> [f64; 2] {
    let h = to - from;
    let mut sums = [0.0; 2];
    let mut row = times.partition_point(|t| *t <= from).max(1) - 1;
    let mut begin = from;
    while begin < to {
        let next = times.get(row + 1).copied().unwrap_or(f64::INFINITY);
        let end = next.min(to);
        let value = |t: f64| {
            if held || next.is_infinite() {
                column[row]
            } else {
                column[row] + (column[row + 1] - column[row]) * (t - times[row]) / (next - times[row])
            }
        };
        // Simpson's rule: the product of two lines.
        let middle = 0.5 * (begin + end);
        for (t, weight) in [(begin, 1.0), (middle, 4.0), (end, 1.0)] {
            let rises = (t - from) / h;
            let part = weight * (end - begin) / 6.0 * value(t);
            sums[0] += part * (1.0 - rises);
            sums[1] += part * rises;
        }
        (begin, row) = (end, row + 1);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A held sine with a jump, by every eighth row: integrals are those of the input, and between jumps it is near the sine.
    #[test]
    fn fewer_knots_keep_an_inputs_integral_and_its_jumps() {
        let times: Vec<f64> = (0..=400).map(|k| 1e-3 * f64::from(k)).collect();
        let sine = |t: f64| (10.0 * t).sin() + if t < 0.2 { 0.0 } else { 1.0 };
        let column: Vec<f64> = times.iter().map(|t| sine(*t)).collect();
        let run = Run {
            label: String::new(),
            inputs: vec![times.clone(), column.clone()],
            outputs: vec![times.clone()],
            kind: 0,
        };
        let jumps = jumps(&column, 2.0);
        assert_eq!(jumps, [200]);
        let kept: Vec<usize> = (0..=400).step_by(8).collect();
        let fewer = fewer(&run, &kept, &jumps, &[true]);
        assert_eq!(fewer.len(), kept.len() + 1);
        let held: f64 = column[..400].iter().map(|u| u * 1e-3).sum();
        let area = |w: usize| {
            0.5 * (fewer.inputs[1][w] + fewer.inputs[1][w + 1])
                * (fewer.inputs[0][w + 1] - fewer.inputs[0][w])
        };
        let lines: f64 = (0..fewer.len() - 1).map(area).sum();
        assert!((lines - held).abs() < 1e-9, "{lines} {held}");
        for (t, u) in fewer.inputs[0].iter().zip(&fewer.inputs[1]) {
            // A held value is half a row old on the average.
            let expected = sine(*t - 0.5e-3);
            if (*t - 0.2).abs() > 1e-3 {
                assert!((u - expected).abs() < 2e-3, "{t}: {u} {expected}");
            }
        }
        assert!(fewer.outputs[0].iter().filter(|v| v.is_nan()).count() == 1);
    }
}
