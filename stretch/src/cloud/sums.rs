//! Running sums over the rows and columns of a grid.

/// Sums over `half` entries to each side along rows; beyond the end there is nothing.
pub(super) fn along_rows(from: &[f32], to: &mut [f32], columns: usize, half: usize) {
    for (from, to) in from.chunks_exact(columns).zip(to.chunks_exact_mut(columns)) {
        let mut sum: f32 = from[..half.min(columns)].iter().sum();
        for k in 0..columns {
            if k + half < columns {
                sum += from[k + half];
            }
            to[k] = sum;
            if k >= half {
                sum -= from[k - half];
            }
        }
    }
}

/// Sums over `half` entries to each side along columns, a row at a time.
pub(super) fn along_columns(from: &[f32], to: &mut [f32], columns: usize, half: usize) {
    let rows = from.len() / columns;
    let line = |r: usize| &from[r * columns..][..columns];
    let (first, rest) = to.split_at_mut(columns);
    first.fill(0.0);
    for r in 0..=half.min(rows - 1) {
        first.iter_mut().zip(line(r)).for_each(|(s, x)| *s += x);
    }
    let mut before: &mut [f32] = first;
    for (r, out) in rest.chunks_exact_mut(columns).enumerate() {
        let r = r + 1;
        match (r + half < rows, r > half) {
            (true, true) => {
                let (add, drop) = (line(r + half), line(r - half - 1));
                for k in 0..columns {
                    out[k] = before[k] + add[k] - drop[k];
                }
            }
            (true, false) => {
                out.iter_mut().zip(before.iter().zip(line(r + half))).for_each(|(o, (b, a))| *o = b + a)
            }
            (false, true) => {
                out.iter_mut().zip(before.iter().zip(line(r - half - 1))).for_each(|(o, (b, d))| *o = b - d)
            }
            (false, false) => out.copy_from_slice(before),
        }
        before = out;
    }
}
