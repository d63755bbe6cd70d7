//! Outputs that measure an acceleration.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::equations::{Equations, Output, State};
use super::expression::Expression;
use super::units;

/// Draws of the parameters, and of all else under each.
const DRAWS: [usize; 2] = [3, 4];
/// Parts by which factors that are one differ by rounding.
const ROUNDING: f64 = 1e-9;

impl Equations {
    /// An output that is a joint's acceleration by its expression measures the acceleration, whatever the equations lack.
    pub(super) fn sense_accelerations(&mut self) {
        for output in 0..self.outputs.len() {
            let sensed = self.joints.iter().find_map(|joint| {
                Some((joint.velocity, self.accelerometer(&self.outputs[output], joint.velocity)?))
            });
            if let Some((velocity, factor)) = sensed {
                let rate = Expression::of_name(self.rate_name(velocity));
                let output = &mut self.outputs[output].expression;
                *output = output.beside(factor, &rate, &self.states[velocity].rate);
            }
        }
    }

    /// How many times the derivative of a velocity an output is, but for a constant (gravity, say), if it is in the unit of one: asked at
    /// points drawn at random.
    fn accelerometer(&self, output: &Output, velocity: usize) -> Option<f64> {
        let State { name, rate, .. } = &self.states[velocity];
        if (0..self.states.len()).any(|state| output.expression.has(self.rate_name(state))) {
            return None;
        }
        units::of(name).and_then(units::of_rate).filter(|unit| units::of(&output.name) == Some(*unit))?;
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let (mut factors, mut stack) = (Vec::new(), Vec::new());
        for _ in 0..DRAWS[0] {
            let parameters: Vec<f64> = self
                .parameters
                .iter()
                .map(|p| if p.known { p.value } else { p.value + p.scale * rng.random_range(-1.0..1.0) })
                .collect();
            let points: Vec<[f64; 2]> = (0..DRAWS[1])
                .map(|_| {
                    let mut values: Vec<f64> =
                        (0..self.names()).map(|_| rng.random_range(0.1..1.1)).collect();
                    values[self.parameter_name(0)..][..parameters.len()].copy_from_slice(&parameters);
                    [&output.expression, rate].map(|e| e.value(&values, &mut stack))
                })
                .collect();
            factors.extend(points.windows(2).map(|p| (p[1][0] - p[0][0]) / (p[1][1] - p[0][1])));
        }
        let first = *factors.first()?;
        let same = |factor: &f64| (factor - first).abs() <= ROUNDING * first.abs();
        (first != 0.0 && factors.iter().all(same)).then_some(first)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;
    use crate::recording::{Header, Memory, Source};

    /// Whether an output with this name and expression depends on the derivative of the velocity.
    fn senses(name: &str, expression: &str) -> bool {
        let text = format!(
            r#"
format = 1
domain = "motion"
data = "data.csv"
[model]
states = {{ height_m = "speed_m_s", speed_m_s = "force_n/mass_kg - drag_per_s*speed_m_s - 9.81" }}
outputs = {{ {name} = "{expression}" }}
inputs = {{ force_n = "hold" }}
[[parameter]]
name = "mass_kg"
unit = "kg"
start = 2.0
[[parameter]]
name = "drag_per_s"
unit = "1/s"
start = 0.3
[[joint]]
name = "lift"
position = "height_m"
velocity = "speed_m_s"
"#
        );
        let header = Header::parse(Source::Memory(Memory::new("a lift")), &text, false).unwrap();
        let equations = Equations::read(&header).unwrap();
        assert!(equations.outputs[0].expression.has(equations.rate_name(1)) == equations.reads_rates);
        equations.reads_rates
    }

    /// With or without gravity, and turned round; not what is of another unit, nor what is another quantity.
    #[test]
    fn what_equals_an_acceleration_measures_it() {
        assert!(senses("inertial_m_s2", "force_n/mass_kg - drag_per_s*speed_m_s - 9.81"));
        assert!(senses("inertial_m_s2", "drag_per_s*speed_m_s - force_n/mass_kg"));
        assert!(senses("inertial_m_s2", "der(speed_m_s) + 9.81"));
        assert!(!senses("commanded_m_s2", "force_n/mass_kg"));
        assert!(!senses("load_cell_n", "force_n - mass_kg*(drag_per_s*speed_m_s + 9.81)"));
        assert!(!senses("camera_m", "height_m"));
    }
}
