//! What a model predicts with an empirical term added, and its derivatives.

use crate::data::Run;
use crate::law::extended::{Added, Extended};
use crate::model::{Model, PredictError, Spec};

/// Columns of a Jacobian of an extended model.
struct Columns {
    /// Of the simulation's parameters.
    simulated: Vec<usize>,
    /// Of the term's shared and nuisance parameters, with the place of each among those.
    shared: Vec<(usize, usize)>,
    nuisance: Vec<(usize, usize)>,
}

impl Extended<'_> {
    /// What is simulated and its derivatives; those with respect to the term's parameters are zero.
    fn simulate(
        &self,
        run: &Run,
        (shared, nuisance): (&[f64], &[f64]),
        (shared_free, nuisance_free): (&[usize], &[usize]),
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<Columns, PredictError> {
        let (mut columns, mut inner_free) =
            (Columns { simulated: Vec::new(), shared: Vec::new(), nuisance: Vec::new() }, [vec![], vec![]]);
        let lists =
            [(shared_free, self.inner_shared, 0), (nuisance_free, self.inner_nuisance, shared_free.len())];
        for (list, (free, inner, first)) in lists.into_iter().enumerate() {
            for (k, &slot) in free.iter().enumerate() {
                if slot < inner {
                    columns.simulated.push(first + k);
                    inner_free[list].push(slot);
                } else {
                    let of_term = if list == 0 { &mut columns.shared } else { &mut columns.nuisance };
                    of_term.push((first + k, slot - inner));
                }
            }
        }
        let mut simulated = vec![0.0; out.len() * columns.simulated.len()];
        let (shared, nuisance) = (&shared[..self.inner_shared], &nuisance[..self.inner_nuisance]);
        let [of_shared, of_nuisance] = &inner_free;
        self.inner.jacobian(run, shared, nuisance, of_shared, of_nuisance, out, &mut simulated)?;
        jacobian.fill(0.0);
        for (column, values) in columns.simulated.iter().zip(simulated.chunks(out.len().max(1))) {
            jacobian[column * out.len()..][..out.len()].copy_from_slice(values);
        }
        Ok(columns)
    }

    /// Where along the run each row lies: by the variable that noise is correlated along, or by its number.
    fn positions(&self, run: &Run) -> Vec<f64> {
        match self.noise_along.and_then(|v| run.inputs.get(v)) {
            Some(column) => column.clone(),
            None => (0..run.len()).map(|i| i as f64).collect(),
        }
    }
}

impl Model for Extended<'_> {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn predict(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), PredictError> {
        self.jacobian(run, shared, nuisance, &[], &[], out, &mut [])
    }

    /// The simulation with the term added, the derivatives of the simulation, and by the chain rule those of the term.
    fn jacobian(
        &self,
        run: &Run,
        shared: &[f64],
        nuisance: &[f64],
        shared_free: &[usize],
        nuisance_free: &[usize],
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), PredictError> {
        let columns = self.simulate(run, (shared, nuisance), (shared_free, nuisance_free), out, jacobian)?;
        let (rows, n) = (out.len(), run.len());
        let stretch = |jacobian: &mut [f64], row: usize, factor: f64| {
            columns.simulated.iter().for_each(|column| jacobian[column * rows + row] *= factor);
        };
        let powers_of = |x: f64, jacobian: &mut [f64], row: usize| {
            for (column, coefficient) in &columns.shared {
                jacobian[column * rows + row] = x.powi(*coefficient as i32 + 1);
            }
        };
        match &self.term {
            Added::Periodic => {
                let omega = shared[self.inner_shared];
                for (i, position) in self.positions(run).iter().enumerate() {
                    let (sin, cos) = (omega * position).sin_cos();
                    for c in 0..self.channels {
                        let [a, b] = [0, 1].map(|part| nuisance[self.inner_nuisance + 2 * c + part]);
                        let row = c * n + i;
                        out[row] += a * cos + b * sin;
                        for (column, _) in &columns.shared {
                            jacobian[column * rows + row] = position * (b * cos - a * sin);
                        }
                    }
                    for (column, part) in &columns.nuisance {
                        jacobian[column * rows + part / 2 * n + i] = if part % 2 == 0 { cos } else { sin };
                    }
                }
            }
            Added::Power { channel, variable, largest } => {
                let exponent = shared[self.inner_shared];
                for (i, v) in run.inputs[*variable].iter().enumerate().filter(|(_, v)| **v > 0.0) {
                    let (row, factor) = (channel * n + i, (v / largest).powf(exponent));
                    out[row] *= factor;
                    stretch(jacobian, row, factor);
                    for (column, _) in &columns.shared {
                        jacobian[column * rows + row] = out[row] * (v / largest).ln();
                    }
                }
            }
            Added::Reading { channel, largest } => {
                let coefficients = &shared[self.inner_shared..];
                for (row, value) in out.iter_mut().enumerate().skip(channel * n).take(n) {
                    let x = *value / largest;
                    *value += polynomial(coefficients, x);
                    stretch(jacobian, row, 1.0 + slope(coefficients, x) / largest);
                    powers_of(x, jacobian, row);
                }
            }
            Added::Smooth { channel, variable, centre, half_width } => {
                for (i, v) in run.inputs[*variable].iter().enumerate() {
                    let (row, x) = (channel * n + i, (v - centre) / half_width);
                    out[row] += polynomial(&shared[self.inner_shared..], x);
                    powers_of(x, jacobian, row);
                }
            }
        }
        Ok(())
    }

    fn relative_step(&self) -> f64 {
        self.inner.relative_step()
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        self.inner.nuisance_start(run, &mut nuisance[..self.inner_nuisance]);
    }
}

/// The derivative of [`polynomial`]: `c1 + 2 c2 x + ...`.
fn slope(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().enumerate().rev().fold(0.0, |sum, (k, c)| sum * x + (k + 1) as f64 * c)
}

/// `c1 x + c2 x^2 + ...`.
fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| (sum + c) * x)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;
    use crate::data::Recording;
    use crate::law::added::AddedLaw;
    use crate::model::{Quantity, Scope, SpecBuilder, finite_differences};

    /// Two channels that bend with their parameters.
    struct Bent(Spec);

    impl Model for Bent {
        fn spec(&self) -> &Spec {
            &self.0
        }

        fn predict(&self, run: &Run, s: &[f64], n: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
            let rows = run.len();
            for (i, x) in run.inputs[0].iter().enumerate() {
                out[i] = s[0] * x.sin() + n[0];
                out[rows + i] = (s[0] * s[1] * x).exp() - n[0] * x;
            }
            Ok(())
        }
    }
    /// Derivatives by the chain rule are those that differences give, whichever parameters are free.
    #[test]
    fn derivatives_are_those_of_the_prediction() {
        let mut builder = SpecBuilder::new("bent");
        builder.shared("a", "", 0.7, [-9.0, 9.0], 1.0);
        builder.shared("b", "", -0.4, [-9.0, 9.0], 1.0);
        builder.nuisance("offset", "", [-9.0, 9.0], 1.0);
        let model = Bent(builder.build().unwrap());
        let x: Vec<f64> = (1..30).map(|i| 0.1 * f64::from(i)).collect();
        let (inputs, outputs) = (vec![x.clone()], vec![x.clone(), x]);
        let recording = Recording {
            channels: vec![Quantity::new("y", ""), Quantity::new("z", "")],
            variables: vec![Quantity::new("x", "")],
            runs: vec![Run { label: "one".into(), inputs, outputs, kind: 0 }],
            noise_along: Some(0),
            calibration: vec![None; 2],
            resolution: vec![0.0; 2],
        };
        let laws = [
            AddedLaw::Periodic,
            AddedLaw::Power { channel: "z".into(), variable: "x".into(), largest: 2.9 },
            AddedLaw::Reading { channel: "z".into(), largest: 1.3 },
            AddedLaw::Smooth { channel: "y".into(), variable: "x".into(), centre: 1.5, half_width: 1.4 },
        ];
        for law in laws {
            let wide = Extended::again(&model, &recording, &law, &[0.1, 0.1]).unwrap();
            let run = &recording.runs[0];
            let values =
                |n: usize, from: f64| -> Vec<f64> { (0..n).map(|k| from + 0.3 * k as f64).collect() };
            let (shared, nuisance) =
                (values(wide.spec.count(Scope::Shared), 0.5), values(wide.spec.count(Scope::PerRun), 0.2));
            let mut of_nuisance: Vec<usize> = (0..nuisance.len()).collect();
            // The simulation's parameters need not come first.
            let of_shared: Vec<usize> = (1..shared.len()).rev().collect();
            of_nuisance.reverse();
            let columns = of_shared.len() + of_nuisance.len();
            let room = || (vec![0.0; 2 * run.len()], vec![0.0; 2 * run.len() * columns]);
            let ((mut out, mut exact), (mut expected, mut differences)) = (room(), room());
            let free = (&of_shared[..], &of_nuisance[..]);
            wide.jacobian(run, &shared, &nuisance, free.0, free.1, &mut out, &mut exact).unwrap();
            finite_differences(
                &wide,
                run,
                &shared,
                &nuisance,
                free.0,
                free.1,
                &mut expected,
                &mut differences,
            )
            .unwrap();
            assert_eq!(out, expected, "{law:?}");
            for (k, (exact, difference)) in exact.iter().zip(&differences).enumerate() {
                let error = (exact - difference).abs();
                assert!(error < 1e-6 * (1.0 + exact.abs()), "{law:?}, value {k}: {exact} and {difference}");
            }
        }
    }
}
