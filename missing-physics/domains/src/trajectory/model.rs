//! The full model of a filmed or felt flight: physics from `bounce-audio`, the camera's errors, and all parameters.

use bounce_audio::flight::{Flight, State};
use missing_physics::data::Run;
use missing_physics::model::{Extensions, Model, PredictError, Scope, Spec};
use num_dual::DualNum;

use super::setup::{Axes, ROD, Setup};
use super::spec::{self, Built, Role};
use crate::dual::{DualModel, JacobianRequest, Moving};

/// The model of the domain `trajectory`.
#[derive(Debug)]
pub struct TrajectoryModel {
    setup: Setup,
    spec: Spec,
    roles: Vec<Role>,
    /// The slot of a run's change of each component of the lift, where it may have any.
    lifts: [Option<usize>; 3],
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
        let Built { spec, roles, lifts } = spec::build(&setup, drag_unit);
        Self { setup, spec, roles, lifts, drag_unit }
    }

    /// What was measured.
    pub fn axes(&self) -> Axes {
        self.setup.axes
    }

    pub(super) fn gravity_m_s2(&self) -> f64 {
        self.setup.gravity_m_s2
    }

    /// Number of nuisance parameters of a run: where it begins ([`Axes::starts`]), and what may differ from run to run.
    pub fn nuisance_count(&self) -> usize {
        self.spec.count(Scope::PerRun)
    }
}

impl DualModel for TrajectoryModel {
    fn predict_dual<T: DualNum<Primitive = f64, Real = f64> + Copy>(
        &self,
        run: &Run,
        shared: &[T],
        nuisance: &[T],
        moving: Moving<'_>,
        out: &mut [T],
    ) -> Result<(), String> {
        let (flight, camera, closed) = self.effects(run, (shared, nuisance), moving);
        if run.kind == ROD {
            self.rod(&camera, nuisance, run.len(), out);
            return Ok(());
        }
        let times = &run.inputs[0];
        let n = times.len();
        let start = self.start(nuisance);
        let begin = times.first().copied().unwrap_or(0.0);
        let elapsed: Vec<f64> = times.iter().map(|t| t - begin).collect();
        // A stated time is (1 + rate) times the true one. Rather than integrate to times that are dual numbers, go to the
        // true times and move along the tangent: exact in value and first derivative.
        let slow = (camera.clock_rate + 1.0).recip();
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
                // Specific force: what is left of the acceleration once gravity is taken away, plus the sensor's offset.
                Axes::Accelerometer => out[i] = a[2] + self.setup.gravity_m_s2 + nuisance[0],
                axes => {
                    let p = if axes.along_ground() { tilted(p, camera.tilt) } else { p };
                    for (c, axis) in axes.seen().iter().enumerate() {
                        out[c * n + i] = camera.scale * p[*axis];
                    }
                }
            }
        }
        Ok(())
    }
}

/// What the camera does to places, and its clock to times.
pub(super) struct Camera<T> {
    /// Measured over true lengths.
    pub(super) scale: T,
    /// Its tilt about x and y, rad.
    pub(super) tilt: [T; 2],
    /// By how much its clock runs fast, relative to 1.
    pub(super) clock_rate: T,
}

impl TrajectoryModel {
    /// Where a run begins, by its nuisance parameters.
    pub(super) fn start<T: DualNum<Primitive = f64, Real = f64> + Copy>(&self, nuisance: &[T]) -> State<T> {
        let zero = T::from(0.0);
        let mut start = State { position: [zero; 3], velocity: [zero; 3] };
        let seen = self.setup.axes.seen();
        if seen.is_empty() {
            start.velocity[2] = nuisance[1];
        }
        for (c, axis) in seen.iter().enumerate() {
            start.position[*axis] = nuisance[c];
            start.velocity[*axis] = nuisance[seen.len() + c];
        }
        start
    }

    /// The flight of a run and the camera at some parameters, and whether the flight's closed form will do: where nothing else is on,
    /// nor asked for its derivative.
    pub(super) fn effects<T: DualNum<Primitive = f64, Real = f64> + Copy>(
        &self,
        run: &Run,
        (shared, nuisance): (&[T], &[T]),
        moving: Moving<'_>,
    ) -> (Flight<T>, Camera<T>, bool) {
        let zero = T::from(0.0);
        let mut flight = Flight::ballistic(self.setup.gravity_m_s2);
        let mut camera = Camera { scale: zero, tilt: [zero; 2], clock_rate: zero };
        let mut closed = true;
        for (slot, (role, value)) in self.roles.iter().zip(shared).enumerate() {
            closed &= role.keeps_closed_form() || (value.re() == 0.0 && !moving.shared.contains(&slot));
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
                Role::Stiff => flight.stiffness_per_s2.iter_mut().for_each(|along| *along += *value),
                Role::StiffX => flight.stiffness_per_s2[0] += *value,
                Role::StiffY => flight.stiffness_per_s2[1] += *value,
                Role::StiffZ => flight.stiffness_per_s2[2] += *value,
                Role::CameraScale => camera.scale = *value,
                Role::TiltX => camera.tilt[0] = *value,
                Role::TiltY => camera.tilt[1] = *value,
                Role::ClockRate => camera.clock_rate = *value,
            }
        }
        for (lift, slot) in flight.lift_per_s.iter_mut().zip(self.lifts) {
            let Some(slot) = slot else { continue };
            closed &= nuisance[slot].re() == 0.0 && !moving.nuisance.contains(&slot);
            *lift += nuisance[slot];
        }
        camera.scale += 1.0;
        (flight, camera, closed)
    }

    /// The ends of a rod of one metre, plumb: no flight, no clock, but the same camera.
    fn rod<T: DualNum<Primitive = f64, Real = f64> + Copy>(
        &self,
        camera: &Camera<T>,
        nuisance: &[T],
        rows: usize,
        out: &mut [T],
    ) {
        let zero = T::from(0.0);
        for i in 0..rows {
            let mut p = [zero, zero, T::from(i as f64)];
            if self.setup.axes.along_ground() {
                p = tilted(p, camera.tilt);
            }
            for (c, axis) in self.setup.axes.seen().iter().enumerate() {
                out[c * rows + i] = nuisance[c] + camera.scale * p[*axis];
            }
        }
    }
}

/// Turns positions by the camera's tilt: about x, then about y, both right-handed.
pub(super) fn tilted<T: DualNum<Primitive = f64, Real = f64> + Copy>(
    p: [T; 3],
    [about_x, about_y]: [T; 2],
) -> [T; 3] {
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
        self.predict_dual(run, shared, nuisance, Moving::default(), out)
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
        JacobianRequest { run, shared, nuisance, shared_free, nuisance_free }.fill(self, out, jacobian)
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { local_causes: Some(self), ..Extensions::default() }
    }
}

#[cfg(test)]
mod keys;
#[cfg(test)]
mod tests;
