//! Outputs that are read late: when each row reads the machine, and what is read of the time before a run.

use joint_laws::Number;
use joint_laws::integrate::Reading;
use joint_laws::sensor::{Sensor, moved_on};

/// What a column that is read late says of the time before the run, by the part of that time in which the machine moved on along its
/// tangent (before that it stood still) that is nearest to its first rows. `still` are the rows with the values at the run's beginning, the
/// column has those along the tangent; both of which are apart in proportion to the time.
pub(super) fn before_run<T: Number>(
    still: &[(usize, T)],
    (times, delay_s): (&[f64], f64),
    measured: &[f64],
    sensor: &Sensor<T>,
    column: &mut [T],
) {
    let Some(begin) = times.first() else { return };
    // A row reads the machine as it was so long before the run.
    let before = |row: usize| delay_s - (times[row] - begin);
    let longest = still.iter().map(|(row, _)| before(*row)).fold(0.0, f64::max);
    let value = |column: &[T], (row, still): (usize, T), part: f64| {
        still + (column[row] - still) * (part * longest / before(row)).min(1.0)
    };
    let misses = |part: f64| -> f64 {
        let known = still.iter().filter(|(row, _)| measured[*row].is_finite());
        let miss = |at: &(usize, T)| sensor.value(value(column, *at, part), 0.0).re() - measured[at.0];
        known.map(|at| miss(at).powi(2)).sum()
    };
    let moved = moved_on(misses);
    for at in still {
        column[at.0] = value(column, *at, moved);
    }
}

/// When each row is read, in order, and by which infinitesimals: together where outputs have no delay, else each output by itself.
pub(super) fn readings<T: Number>(times: &[f64], delays: &[Option<T>]) -> (Vec<Reading>, Vec<T>) {
    let mut reads = Vec::with_capacity(times.len());
    let mut shifts = vec![T::from(0.0)];
    if delays.iter().any(Option::is_none) {
        reads.extend(times.iter().enumerate().map(|(row, &t_s)| Reading { t_s, row, shift: 0 }));
    }
    for (c, delay) in delays.iter().enumerate() {
        let delay = delay.unwrap_or(T::from(0.0));
        shifts.push(-delay.infinitesimal());
        if delays[c].is_some() {
            let late = |(row, t): (usize, &f64)| Reading { t_s: t - delay.re(), row, shift: c + 1 };
            reads.extend(times.iter().enumerate().map(late));
        }
    }
    reads.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    (reads, shifts)
}
