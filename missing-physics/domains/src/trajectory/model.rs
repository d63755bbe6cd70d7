//! The full model of a filmed or felt flight: physics from `bounce-audio`, the camera's errors, and all parameters.

use bounce_audio::flight::{Flight, State};
use missing_physics::data::Run;
use missing_physics::model::{Model, PredictError, Scope, Spec};
use num_dual::DualNum;

use super::spec;
use crate::dual::{Asked, InDuals};

/// What was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// Height alone.
    Height,
    /// All three coordinates.
    Space,
    /// The specific force along z, by an accelerometer on board.
    Accelerometer,
}

/// What is known of the set-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// What was measured.
    pub axes: Axes,
    /// Mass in kg.
    pub mass_kg: Option<f64>,
    /// Diameter in m.
    pub diameter_m: Option<f64>,
    /// Gravity in m/s^2.
    pub gravity_m_s2: f64,
    /// Density of the air in kg/m^3.
    pub air_density_kg_m3: f64,
    /// Whether the spin is known (inputs 1 to 3).
    pub spin: bool,
}

/// A run of this kind films a rod of known length: the z channel reads its ends.
pub const ROD: u32 = 1;

/// The flight's parameters by meaning; each knows where it stands among the shared parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Quadratic,
    Linear,
    Buoyancy,
    LiftX,
    LiftY,
    LiftZ,
    LiftCoefficient,
    WindX,
    WindY,
    CameraScale,
    TiltX,
    TiltY,
    ClockRate,
    Cubic,
    PushX,
    PushY,
    StiffX,
    StiffY,
    StiffZ,
}

impl Role {
    /// Whether a flight with it on still has a closed form.
    fn keeps_closed_form(self) -> bool {
        use Role::{Cubic, LiftCoefficient, LiftX, LiftY, LiftZ, Quadratic, StiffX, StiffY, StiffZ};
        !matches!(
            self,
            Quadratic | Cubic | LiftX | LiftY | LiftZ | LiftCoefficient | StiffX | StiffY | StiffZ
        )
    }
}

/// The model of the domain `trajectory`.
#[derive(Debug)]
pub struct TrajectoryModel {
    setup: Setup,
    spec: Spec,
    roles: Vec<Role>,
    /// Quadratic drag in 1/m for one unit of the drag's parameter.
    drag_unit: f64,
}

impl TrajectoryModel {
    /// The model of a set-up.
    pub fn new(setup: Setup) -> Self {
        let drag_unit = match (setup.mass_kg, setup.diameter_m) {
            (Some(m), Some(d)) => bounce_audio::flight::drag_per_m(1.0, d, m, setup.air_density_kg_m3),
            _ => 1.0,
        };
        let (spec, roles) = spec::build(&setup, drag_unit);
        Self { setup, spec, roles, drag_unit }
    }

    /// What was measured.
    pub fn axes(&self) -> Axes {
        self.setup.axes
    }

    /// Number of nuisance parameters of a run.
    pub fn nuisance_count(&self) -> usize {
        self.spec.count(Scope::PerRun)
    }
}

impl InDuals for TrajectoryModel {
    fn predict_in<T: DualNum<Primitive = f64, Real = f64> + Copy>(
        &self,
        run: &Run,
        shared: &[T],
        nuisance: &[T],
        moving: &[usize],
        out: &mut [T],
    ) -> Result<(), String> {
        let zero = T::from(0.0);
        let mut flight = Flight::ballistic(self.setup.gravity_m_s2);
        let (mut scale, mut rate, mut tilt) = (zero, zero, [zero; 2]);
        // The closed form will do where nothing else is on, nor asked for its derivative.
        let mut closed = true;
        for (slot, (role, value)) in self.roles.iter().zip(shared).enumerate() {
            closed &= role.keeps_closed_form() || (value.re() == 0.0 && !moving.contains(&slot));
            match role {
                Role::Quadratic => flight.quadratic_per_m = *value * self.drag_unit,
                Role::Linear => flight.linear_per_s = *value,
                Role::Cubic => flight.cubic_s_per_m2 = *value,
                Role::Buoyancy => flight.constant_m_s2[2] = *value,
                Role::PushX => flight.constant_m_s2[0] = *value,
                Role::PushY => flight.constant_m_s2[1] = *value,
                Role::LiftX => flight.lift_per_s[0] = *value,
                Role::LiftY => flight.lift_per_s[1] = *value,
                Role::LiftZ => flight.lift_per_s[2] = *value,
                Role::LiftCoefficient => {
                    for (i, lift) in flight.lift_per_s.iter_mut().enumerate() {
                        let spin = run.inputs.get(1 + i).and_then(|c| c.first()).copied().unwrap_or(0.0);
                        *lift = *value * spin;
                    }
                }
                Role::WindX => flight.wind_m_s[0] = *value,
                Role::WindY => flight.wind_m_s[1] = *value,
                Role::StiffX => flight.stiffness_per_s2[0] = *value,
                Role::StiffY => flight.stiffness_per_s2[1] = *value,
                Role::StiffZ => flight.stiffness_per_s2[2] = *value,
                Role::CameraScale => scale = *value,
                Role::TiltX => tilt[0] = *value,
                Role::TiltY => tilt[1] = *value,
                Role::ClockRate => rate = *value,
            }
        }
        let times = &run.inputs[0];
        let n = times.len();
        let scale = scale + 1.0;
        if run.kind == ROD {
            // The ends of a rod of one metre, plumb: no flight, no clock, but the same camera.
            for i in 0..n {
                let mut p = [zero, zero, T::from(i as f64)];
                if self.setup.axes == Axes::Space {
                    p = tilted(p, tilt);
                }
                let first = 3 - out.len() / n.max(1);
                for (c, p) in p.iter().enumerate().skip(first) {
                    out[(c - first) * n + i] = nuisance[c - first] + scale * *p;
                }
            }
            return Ok(());
        }
        let start = match self.setup.axes {
            Axes::Height => {
                State { position: [zero, zero, nuisance[0]], velocity: [zero, zero, nuisance[1]] }
            }
            Axes::Space => State {
                position: [nuisance[0], nuisance[1], nuisance[2]],
                velocity: [nuisance[3], nuisance[4], nuisance[5]],
            },
            Axes::Accelerometer => State { position: [zero; 3], velocity: [zero, zero, nuisance[1]] },
        };
        let begin = times.first().copied().unwrap_or(0.0);
        let elapsed: Vec<f64> = times.iter().map(|t| t - begin).collect();
        // A stated time is (1 + rate) times the true one. Rather than integrate to times that are dual numbers, go to the
        // true times and move along the tangent: exact in value and first derivative.
        let slow = (rate + 1.0).recip();
        let true_times: Vec<f64> = elapsed.iter().map(|t| t * slow.re()).collect();
        let mut states = vec![start; n];
        if closed {
            flight.states_in_linear_drag(&start, &true_times, &mut states)
        } else {
            flight.states(&start, &true_times, &mut states)
        }
        .map_err(|e| e.to_string())?;
        let infinitesimal = slow - slow.re();
        for (i, state) in states.iter().enumerate() {
            let a = flight.acceleration(state, &start.position);
            let shift = infinitesimal * elapsed[i];
            let mut p = state.position;
            for (p, v) in p.iter_mut().zip(&state.velocity) {
                *p += *v * shift;
            }
            match self.setup.axes {
                Axes::Height => out[i] = scale * p[2],
                // Specific force: what is left of the acceleration once gravity is taken away, plus the sensor's offset.
                Axes::Accelerometer => out[i] = a[2] + self.setup.gravity_m_s2 + nuisance[0],
                Axes::Space => {
                    let p = tilted(p, tilt);
                    for c in 0..3 {
                        out[c * n + i] = scale * p[c];
                    }
                }
            }
        }
        Ok(())
    }
}

/// Turns positions by the camera's tilt: about x, then about y, both right-handed.
fn tilted<T: DualNum<Primitive = f64, Real = f64> + Copy>(p: [T; 3], [about_x, about_y]: [T; 2]) -> [T; 3] {
    let (sx, cx, sy, cy) = (about_x.sin(), about_x.cos(), about_y.sin(), about_y.cos());
    let (x, y, z) = (p[0], cx * p[1] - sx * p[2], sx * p[1] + cx * p[2]);
    [cy * x + sy * z, y, cy * z - sy * x]
}

impl Model for TrajectoryModel {
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
        self.predict_in(run, shared, nuisance, &[], out)
            .map_err(|reason| PredictError { run: run.label.clone(), reason })
    }

    fn nuisance_start(&self, run: &Run, nuisance: &mut [f64]) {
        let Some(times) = run.inputs.first() else { return };
        let begin = times.first().copied().unwrap_or(0.0);
        if self.setup.axes == Axes::Accelerometer {
            let finite = run.outputs[0].iter().filter(|v| v.is_finite());
            let (sum, n) = finite.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
            nuisance[0] = if n > 0.0 { sum / n } else { 0.0 };
            return;
        }
        let channels = run.outputs.len();
        for (c, column) in run.outputs.iter().enumerate() {
            let down = if c + 1 == channels { 0.5 * self.setup.gravity_m_s2 } else { 0.0 };
            let rows = times.iter().zip(column).filter(|(_, z)| z.is_finite());
            let points: Vec<(f64, f64)> =
                rows.map(|(t, z)| (t - begin, z + down * (t - begin).powi(2))).collect();
            let n = points.len() as f64;
            if n < 2.0 {
                continue;
            }
            let (tm, zm) = points.iter().fold((0.0, 0.0), |(a, b), (t, z)| (a + t / n, b + z / n));
            let spread: f64 = points.iter().map(|(t, _)| (t - tm).powi(2)).sum();
            let speed = if spread > 0.0 {
                points.iter().map(|(t, z)| (t - tm) * (z - zm)).sum::<f64>() / spread
            } else {
                0.0
            };
            nuisance[c] = zm - speed * tm;
            nuisance[channels + c] = speed;
        }
    }

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
        Asked { run, shared, nuisance, shared_free, nuisance_free }.answer(self, out, jacobian)
    }
}

#[cfg(test)]
mod keys;

#[cfg(test)]
mod tests {
    use super::*;
    use missing_physics::fit::finite_differences;

    fn run(channels: usize, spin: bool) -> Run {
        let t: Vec<f64> = (0..12).map(|i| 0.3 + 0.07 * f64::from(i)).collect();
        let mut inputs = vec![t.clone()];
        if spin {
            inputs.extend([10.0, -20.0, 5.0].map(|s| vec![s; t.len()]));
        }
        Run { label: "1".into(), inputs, outputs: vec![vec![0.0; t.len()]; channels], kind: 0 }
    }

    /// Derivatives against central differences, everything off and everything on, for all that can be measured.
    #[test]
    fn derivatives_agree_with_differences() {
        for (axes, spin) in
            [(Axes::Height, false), (Axes::Space, false), (Axes::Space, true), (Axes::Accelerometer, false)]
        {
            let model = TrajectoryModel::new(Setup {
                axes,
                mass_kg: Some(0.05),
                diameter_m: Some(0.06),
                gravity_m_s2: 9.8,
                air_density_kg_m3: 1.2,
                spin,
            });
            let channels = if axes == Axes::Space { 3 } else { 1 };
            let run = run(channels, spin);
            let n_shared = model.spec().count(Scope::Shared);
            let nuisance: Vec<f64> = (0..model.nuisance_count()).map(|i| 1.0 + 0.7 * i as f64).collect();
            for on in [0.0, 1.0] {
                let shared: Vec<f64> = model.spec().parameters[..n_shared]
                    .iter()
                    .map(|p| (on * 0.3 * p.scale).min(p.upper))
                    .collect();
                let (sf, of): (Vec<usize>, Vec<usize>) =
                    ((0..n_shared).collect(), (0..nuisance.len()).collect());
                let rows = channels * run.len();
                let mut out = vec![0.0; rows];
                let (mut exact, mut rough) =
                    (vec![0.0; rows * (sf.len() + of.len())], vec![0.0; rows * (sf.len() + of.len())]);
                model.jacobian(&run, &shared, &nuisance, &sf, &of, &mut out, &mut exact).unwrap();
                // Steps away from the bound at zero: drags are differenced on one side there.
                let inner: Vec<f64> = shared.clone();
                finite_differences(&model, &run, &inner, &nuisance, &sf, &of, &mut out, &mut rough).unwrap();
                for k in 0..sf.len() + of.len() {
                    let (a, b) = (&exact[k * rows..(k + 1) * rows], &rough[k * rows..(k + 1) * rows]);
                    let size = a.iter().fold(1e-3, |m: f64, v| m.max(v.abs()));
                    for (a, b) in a.iter().zip(b) {
                        assert!((a - b).abs() < 2e-4 * size, "{axes:?} column {k} (on: {on}): {a} and {b}");
                    }
                }
            }
        }
    }

    /// A plumb rod of a metre is seen by the same camera as a flight, in every coordinate, whatever `out` held before.
    #[test]
    fn a_rod_shows_the_camera_and_nothing_else() {
        let setup = Setup {
            axes: Axes::Space,
            mass_kg: None,
            diameter_m: None,
            gravity_m_s2: 9.8,
            air_density_kg_m3: 1.2,
            spin: false,
        };
        let model = TrajectoryModel::new(setup);
        let mut shared = vec![0.0; model.spec().count(Scope::Shared)];
        for (role, value) in model.roles.iter().zip(&mut shared) {
            *value = match role {
                Role::CameraScale => 0.02,
                Role::TiltX => -0.03,
                Role::TiltY => 0.01,
                Role::ClockRate | Role::Quadratic => 0.04,
                _ => 0.0,
            };
        }
        let rod = Run {
            label: "rod".into(),
            inputs: vec![vec![0.0, 1.0]],
            outputs: vec![vec![0.0; 2]; 3],
            kind: ROD,
        };
        let nuisance = [0.3, -0.4, 0.5, 7.0, 7.0, 7.0];
        let mut out = [f64::NAN; 6];
        model.predict(&rod, &shared, &nuisance, &mut out).unwrap();
        // e_z turned by -0.03 about x, then by 0.01 about y.
        let (sx, cx) = (-0.03_f64).sin_cos();
        let (sy, cy) = 0.01_f64.sin_cos();
        let top = [sy * cx, -sx, cy * cx];
        for c in 0..3 {
            assert!((out[2 * c] - nuisance[c]).abs() < 1e-15, "{out:?}");
            assert!((out[2 * c + 1] - nuisance[c] - 1.02 * top[c]).abs() < 1e-15, "{out:?}");
        }
    }

    #[test]
    fn the_start_of_a_parabola_is_found() {
        let setup = Setup {
            axes: Axes::Space,
            mass_kg: None,
            diameter_m: None,
            gravity_m_s2: 9.8,
            air_density_kg_m3: 1.2,
            spin: false,
        };
        let model = TrajectoryModel::new(setup);
        let mut run = run(3, false);
        let truth = [0.1, -0.2, 1.5, 3.0, 0.4, 5.0];
        let shared = vec![0.0; model.spec().count(Scope::Shared)];
        let mut out = vec![0.0; 36];
        model.predict(&run, &shared, &truth, &mut out).unwrap();
        for c in 0..3 {
            run.outputs[c].copy_from_slice(&out[12 * c..12 * (c + 1)]);
        }
        run.outputs[1][4] = f64::NAN;
        let mut nuisance = [0.0; 6];
        model.nuisance_start(&run, &mut nuisance);
        for (a, b) in nuisance.iter().zip(truth) {
            assert!((a - b).abs() < 1e-9, "{nuisance:?}");
        }
    }
}
