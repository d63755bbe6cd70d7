//! A band that slips below a force, and grips above it.

/// How far from the force below which a band slips a roll is half gripped, in places of the rolls ordered by their force: next to
/// nothing halfway between two rolls, and still a slope to follow.
const ONSET: f64 = 0.1;

/// The forces of some rolls, each once, rising.
#[derive(Debug, Clone)]
pub(super) struct Forces(Vec<f64>);

impl Forces {
    pub(super) fn of(forces: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = forces.collect();
        sorted.sort_by(f64::total_cmp);
        sorted.dedup();
        Self(sorted)
    }

    pub(super) fn rising(&self) -> &[f64] {
        &self.0
    }

    /// The part of a roll of a force that takes place where the band slips below another; all of it where it never slips.
    pub(super) fn grip(&self, force_n: f64, slip_n: f64) -> f64 {
        if slip_n > 0.0 {
            1.0 / (1.0 + ((self.place(slip_n) - self.place(force_n)) / ONSET).exp())
        } else {
            1.0
        }
    }

    /// Where a force stands among these, counted from 0; between two of them in proportion, beyond them at their mean distance.
    fn place(&self, force_n: f64) -> f64 {
        let last = self.0.len().saturating_sub(1);
        let (Some(low), Some(high)) = (self.0.first(), self.0.get(last)) else { return force_n };
        let apart = if high > low { (high - low) / last as f64 } else { high.abs().max(f64::MIN_POSITIVE) };
        let above = self.0.partition_point(|f| *f <= force_n);
        match above {
            0 => (force_n - low) / apart,
            _ if above > last => last as f64 + (force_n - high) / apart,
            _ => {
                let (below, next) = (self.0[above - 1], self.0[above]);
                (above - 1) as f64 + (force_n - below) / (next - below)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_slips_or_grips_with_next_to_nothing_between() {
        let forces = Forces::of([3.0, 1.0, 1.5, 1.0].into_iter());
        assert_eq!(forces.rising(), [1.0, 1.5, 3.0]);
        for (slip_n, grips) in
            [(0.0, [1.0; 3]), (1.25, [0.0, 1.0, 1.0]), (2.0, [0.0, 0.0, 1.0]), (4.0, [0.0; 3])]
        {
            for (force, grip) in [1.0, 1.5, 3.0].into_iter().zip(grips) {
                approx::assert_abs_diff_eq!(forces.grip(force, slip_n), grip, epsilon = 0.05);
            }
        }
        approx::assert_abs_diff_eq!(forces.grip(1.5, 1.5), 0.5, epsilon = 1e-12);
        // One roll, or none, is no reason to fail.
        assert!(Forces::of([2.0].into_iter()).grip(2.0, 1.0) > 0.99);
        assert!(Forces::of([].into_iter()).grip(2.0, 1.0) > 0.99);
    }
}
