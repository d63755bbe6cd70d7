//! The second place that three microphones may leave, and the speed of sound.

use super::array::Array;

/// Points of the lattice along each edge.
const LATTICE: usize = 33;
/// Two places this part of the microphones' diagonal apart are two.
const APART: f64 = 0.01;

/// The speed of sound in dry air at a temperature (K): `331.3 sqrt(T / 273.15)` m/s; damp air is faster by up to 0.6 %.
pub fn speed_of_sound_m_s(temperature_k: f64) -> f64 {
    331.3 * (temperature_k / 273.15).sqrt()
}

impl Array {
    /// Another place on the table that fits arrivals (s, one a microphone, any common offset) as well as the one that a
    /// [`Localiser`](super::Localiser) takes: within a diagonal of the microphones' rectangle, its arrivals off by no more than
    /// `arrival_sigma_s` times 3. With three microphones two hyperbolas may meet twice; `None` where they do not.
    pub fn second_place(&self, arrivals_s: &[f64], arrival_sigma_s: f64) -> Option<[f64; 2]> {
        if arrivals_s.len() != self.microphones_m().len() || !arrivals_s.iter().all(|t| t.is_finite()) {
            return None;
        }
        let first = self.solve(arrivals_s);
        let diagonal = self.diagonal_m();
        let dof = (arrivals_s.len() as f64 - 3.0).max(1.0);
        let good = first.sum_squares + 9.0 * dof * arrival_sigma_s * arrival_sigma_s;
        let place = |i: usize, j: usize| {
            let part = |k: usize| k as f64 / (LATTICE - 1) as f64;
            self.widened_m(diagonal, [part(i), part(j)])
        };
        let costs: Vec<f64> =
            (0..LATTICE * LATTICE).map(|n| self.cost(arrivals_s, place(n / LATTICE, n % LATTICE))).collect();
        let mut best: Option<(f64, [f64; 2])> = None;
        for i in 0..LATTICE {
            for j in 0..LATTICE {
                let here = costs[i * LATTICE + j];
                let around = (i.saturating_sub(1)..=(i + 1).min(LATTICE - 1))
                    .flat_map(|a| (j.saturating_sub(1)..=(j + 1).min(LATTICE - 1)).map(move |b| (a, b)));
                if around.into_iter().any(|(a, b)| costs[a * LATTICE + b] < here) {
                    continue;
                }
                let fit = self.descend(arrivals_s, place(i, j));
                let at = [fit.x_m, fit.y_m];
                let apart = (at[0] - first.x_m).hypot(at[1] - first.y_m) > APART * diagonal;
                let near = self.outside_m(at[0], at[1]) <= diagonal;
                if apart && near && fit.sum_squares <= good && best.is_none_or(|b| fit.sum_squares < b.0) {
                    best = Some((fit.sum_squares, at));
                }
            }
        }
        best.map(|b| b.1)
    }
}
