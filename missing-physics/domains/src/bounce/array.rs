//! What a wrong array does to the places and times that are heard with it, and what four microphones and more know beyond them:
//! whether their arrivals fit together.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};

/// Microphones as they are stated.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Microphones {
    pub(super) places_m: Vec<[f64; 3]>,
    pub(super) speed_of_sound_m_s: f64,
}

/// A microphone that stands elsewhere than stated (its index, true less stated along x and y), and by how much the stated speed of
/// sound is too large, relative to 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Wrong {
    pub(super) microphone: Option<usize>,
    pub(super) offset_m: [f64; 2],
    pub(super) scale: f64,
}

impl Microphones {
    /// Arrivals that place and time of an impact leave free.
    pub(super) fn spare(&self) -> usize {
        self.places_m.len().saturating_sub(3)
    }

    /// Where a microphone truly stands, along x and y.
    fn stands(&self, k: usize, wrong: &Wrong) -> [f64; 2] {
        let [x, y, _] = self.places_m[k];
        let [by_x, by_y] = if wrong.microphone == Some(k) { wrong.offset_m } else { [0.0; 2] };
        [x + by_x, y + by_y]
    }

    fn distances(&self, place: [f64; 2], wrong: &Wrong) -> DVector<f64> {
        DVector::from_fn(self.places_m.len(), |k, _| {
            let [x, y] = self.stands(k, wrong);
            (place[0] - x).hypot(place[1] - y).hypot(self.places_m[k][2])
        })
    }

    /// Combinations of arrivals, one a column, that do not change with place and time of an impact near a place.
    fn free(&self, place: [f64; 2]) -> DMatrix<f64> {
        let distances = self.distances(place, &Wrong::default());
        let design = DMatrix::from_fn(self.places_m.len(), 3, |k, j| match j {
            0 => 1.0,
            _ => (place[j - 1] - self.places_m[k][j - 1]) / distances[k],
        });
        let eigen = SymmetricEigen::new(&design * design.transpose());
        let mut order: Vec<usize> = (0..self.places_m.len()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
        let columns: Vec<DVector<f64>> = order[..self.spare()]
            .iter()
            .map(|&k| {
                let column = eigen.eigenvectors.column(k).into_owned();
                // One sign, that neighbouring places agree.
                let sign = if column[0] < 0.0 { -1.0 } else { 1.0 };
                column * sign
            })
            .collect();
        DMatrix::from_columns(&columns)
    }

    /// By how much time (s) and place (x and y, m) of an impact change if the array is wrong: heard again with the right one, less heard
    /// again with the stated one.
    pub(super) fn moved(&self, place: [f64; 2], arrivals_s: &[f64], wrong: &Wrong) -> Option<[f64; 3]> {
        let [right, stated] = [wrong, &Wrong::default()].map(|array| self.located(place, arrivals_s, array));
        let moved = right? - stated?;
        Some([moved[0] / self.speed_of_sound_m_s, moved[1], moved[2]])
    }

    /// Range (time times the stated speed of sound, since the first arrival, m) and place of an impact by least squares over its
    /// arrivals, by Newton's steps from a place near it; `None` where they do not lead anywhere.
    fn located(&self, near: [f64; 2], arrivals_s: &[f64], wrong: &Wrong) -> Option<Vector3<f64>> {
        const STEPS: usize = 6;
        let first = *arrivals_s.first()?;
        let slower = 1.0 + wrong.scale;
        let mut at = Vector3::new(0.0, near[0], near[1]);
        for _ in 0..STEPS {
            let distances = self.distances([at[1], at[2]], wrong);
            let (mut normal, mut pull) = (Matrix3::zeros(), Vector3::zeros());
            for (k, (arrival, d)) in arrivals_s.iter().zip(distances.iter()).enumerate() {
                let [x, y] = self.stands(k, wrong);
                let row = Vector3::new(1.0, slower * (at[1] - x) / d, slower * (at[2] - y) / d);
                let off = (arrival - first) * self.speed_of_sound_m_s - at[0] - slower * d;
                normal += row * row.transpose();
                pull += row * off;
            }
            at += normal.cholesky()?.solve(&pull);
        }
        at.iter().all(|v| v.is_finite()).then_some(at)
    }

    /// What arrivals (s) keep of their own after place and time, less what a wrong array would make of them.
    pub(super) fn misfit(&self, place: [f64; 2], arrivals_s: &[f64], wrong: &Wrong) -> Vec<f64> {
        let first = arrivals_s.first().copied().unwrap_or_default();
        let arrivals = DVector::from_iterator(arrivals_s.len(), arrivals_s.iter().map(|t| t - first));
        let travel = self.distances(place, wrong) * ((1.0 + wrong.scale) / self.speed_of_sound_m_s);
        self.free(place).tr_mul(&(arrivals - travel)).as_slice().to_vec()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    #[test]
    fn place_and_time_leave_no_trace_and_a_wrong_microphone_does() {
        let microphones = Microphones {
            places_m: vec![[0.0, 0.0, 0.07], [0.55, 0.0, 0.07], [0.55, 0.55, 0.07], [0.0, 0.55, 0.07]],
            speed_of_sound_m_s: 340.0,
        };
        let wrong = Wrong { microphone: Some(2), offset_m: [0.01, -0.005], scale: 0.0 };
        let heard = |place: [f64; 2], wrong: &Wrong| -> Vec<f64> {
            microphones.distances(place, wrong).iter().map(|d| 0.3 + d / 340.0).collect()
        };
        let place = [0.2, 0.3];
        let none = Wrong::default();
        let right = heard(place, &none);
        assert!(microphones.misfit(place, &right, &none)[0].abs() < 1e-15);
        // A place that is a little off changes nothing to first order.
        assert!(microphones.misfit([0.201, 0.3], &right, &none)[0].abs() < 2e-8);
        let moved = heard(place, &wrong);
        assert!(microphones.misfit(place, &moved, &none)[0].abs() > 3e-6);
        assert!(microphones.misfit(place, &moved, &wrong)[0].abs() < 1e-15);
    }

    /// A wrong speed of sound, and a microphone that stands three centimetres aside.
    #[test]
    fn heard_again_with_the_right_array_an_impact_is_where_and_when_it_was() {
        let microphones = Microphones {
            places_m: vec![[0.0, 0.0, 0.07], [0.55, 0.0, 0.07], [0.55, 0.55, 0.07], [0.0, 0.55, 0.07]],
            speed_of_sound_m_s: 340.0,
        };
        let slow = Wrong { scale: -0.07, ..Wrong::default() };
        let aside = Wrong { microphone: Some(2), offset_m: [-0.02, 0.022], scale: 0.0 };
        let both = [(slow, 1e-5), (aside, 1e-6)];
        for ((wrong, late), place) in both.into_iter().flat_map(|w| [(w, [0.2, 0.3]), (w, [0.4, 0.12])]) {
            let distances = microphones.distances(place, &wrong);
            let arrivals: Vec<f64> =
                distances.iter().map(|d| 0.3 + d * (1.0 + wrong.scale) / 340.0).collect();
            let heard = microphones.located([0.27, 0.2], &arrivals, &Wrong::default()).unwrap();
            let t_s = arrivals[0] + heard[0] / 340.0;
            let [dt, dx, dy] = microphones.moved([heard[1], heard[2]], &arrivals, &wrong).unwrap();
            assert!(dx.hypot(dy) > 1e-3 && dt.abs() > late);
            assert!((heard[1] + dx - place[0]).abs() < 1e-9 && (heard[2] + dy - place[1]).abs() < 1e-9);
            assert!((t_s + dt - 0.3).abs() < 1e-12, "{}", t_s + dt);
            assert!(microphones.misfit(place, &arrivals, &wrong)[0].abs() < 1e-14);
        }
    }
}
