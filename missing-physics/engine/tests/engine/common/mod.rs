//! A small model of a thrown ball (height only), and worlds made without it.

#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "a test stops where it fails, and not every test uses all of this"
)]

use missing_physics::data::{Recording, Run};
use missing_physics::model::{
    Extensions, Mechanism, Model, MultimodalModel, Parameter, PredictError, Quantity, Scope, Spec,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};

/// A parameter that all runs share, of a scale of one.
pub(crate) fn parameter(name: &str, start: f64, [lower, upper]: [f64; 2]) -> Parameter {
    Parameter {
        name: name.into(),
        unit: String::new(),
        scope: Scope::Shared,
        start,
        lower,
        upper,
        scale: 1.0,
    }
}

/// A mechanism with its parameters.
pub(crate) fn mechanism(id: &str, parameters: Vec<usize>) -> Mechanism {
    Mechanism { id: id.into(), name: id.replace('-', " "), parameters, ..Mechanism::default() }
}

/// Runs of one channel over one variable.
pub(crate) fn recording(variable: &str, runs: Vec<Run>, sigma: Option<f64>) -> Recording {
    Recording {
        channels: vec![Quantity::new("y", "")],
        variables: vec![Quantity::new(variable, "")],
        runs,
        noise_along: Some(0),
        calibration: vec![sigma],
        resolution: vec![0.0],
    }
}

/// Where further fits begin.
pub(crate) type Starts = fn(&[Run]) -> Vec<Vec<(usize, f64)>>;

/// A curve over one variable.
pub(crate) struct Curve {
    spec: Spec,
    law: fn(shared: &[f64], nuisance: &[f64], x: f64) -> f64,
    starts: Starts,
}

impl Curve {
    /// A law with its parameters and mechanisms, and no start but the parameters' own.
    pub(crate) fn new(
        parameters: Vec<Parameter>,
        mechanisms: Vec<Mechanism>,
        law: fn(&[f64], &[f64], f64) -> f64,
    ) -> Self {
        let spec = Spec { parameters, mechanisms, ..Spec::default() };
        Self { spec, law, starts: |_| Vec::new() }
    }

    /// With further starts.
    pub(crate) fn from(self, starts: Starts) -> Self {
        Self { starts, ..self }
    }
}

impl Model for Curve {
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
        out.iter_mut().zip(&run.inputs[0]).for_each(|(y, x)| *y = (self.law)(shared, nuisance, *x));
        Ok(())
    }

    fn extensions(&self) -> Extensions<'_> {
        Extensions { modes: Some(self), ..Extensions::default() }
    }
}

impl MultimodalModel for Curve {
    fn starts(&self, _: usize, runs: &[Run], _: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        (self.starts)(runs)
    }
}

/// Height of a ball with linear drag (closed form), another gravity and a camera of another scale.
///
/// `unit` is the length of one unit of height, in m: 0.001 where heights are in mm.
pub(crate) struct Ball {
    spec: Spec,
    unit_m: f64,
}

const G: f64 = 9.80665;

impl Default for Ball {
    fn default() -> Self {
        Self::in_unit(1.0)
    }
}

impl Ball {
    /// Thrown over a floor: no run begins below it.
    pub(crate) fn over_floor() -> Self {
        let mut ball = Self::default();
        ball.spec.parameters[3].lower = 0.0;
        ball
    }

    pub(crate) fn in_unit(unit_m: f64) -> Self {
        let nuisance = |name: &str| {
            let free = parameter(name, 0.0, [f64::NEG_INFINITY, f64::INFINITY]);
            Parameter { scope: Scope::PerRun, scale: 1.0 / unit_m, ..free }
        };
        let shared = |name: &str, limits, scale| Parameter { scale, ..parameter(name, 0.0, limits) };
        let spec = Spec {
            baseline: "ballistic flight".into(),
            parameters: vec![
                shared("rate_per_s", [0.0, 20.0], 0.1),
                shared("acceleration", [-0.5 / unit_m, 0.5 / unit_m], 0.2 / unit_m),
                shared("scale", [-0.5, 0.5], 0.01),
                nuisance("z0"),
                nuisance("vz0"),
            ],
            mechanisms: vec![
                mechanism("linear-drag", vec![0]),
                mechanism("buoyancy", vec![1]),
                mechanism("camera-scale", vec![2]),
            ],
            terms: vec![],
        };
        Self { spec, unit_m }
    }
}

impl Model for Ball {
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
        let (r, g) = (shared[0], G / self.unit_m - shared[1]);
        for (z, t) in out.iter_mut().zip(&run.inputs[0]) {
            // (1 - exp(-x)) / x and its next term, by series where x is small.
            let x = r * t;
            let first = if x < 1e-4 { 1.0 - x / 2.0 + x * x / 6.0 } else { -(-x).exp_m1() / x };
            let second = if x < 1e-3 { 0.5 - x / 6.0 + x * x / 24.0 } else { (1.0 - first) / x };
            *z = (1.0 + shared[2]) * (nuisance[0] + nuisance[1] * t * first - g * t * t * second);
        }
        Ok(())
    }
}

/// How a world is made.
#[derive(Clone, Copy)]
pub(crate) struct World {
    pub(crate) runs: usize,
    pub(crate) rows: usize,
    pub(crate) sigma: f64,
    /// Correlation of neighbouring rows' noise.
    pub(crate) phi: f64,
    /// Share of the readings that are off by 10 to 40 sigma.
    pub(crate) wild: f64,
    /// Smallest step of a reading.
    pub(crate) digit: f64,
    pub(crate) linear_drag: f64,
    /// A part of the weight that the ball loses.
    pub(crate) lift_m_s2: f64,
}

impl World {
    pub(crate) const NULL: Self = Self {
        runs: 4,
        rows: 40,
        sigma: 0.005,
        phi: 0.0,
        wild: 0.0,
        digit: 0.0,
        linear_drag: 0.0,
        lift_m_s2: 0.0,
    };

    /// Integrates Newton's law in small steps and reads it with noise.
    pub(crate) fn draw(&self, seed: u64) -> Recording {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let speed = Uniform::new(2.0, 6.0).unwrap();
        let height = Uniform::new(0.5, 1.5).unwrap();
        let dt = 1.0 / 30.0;
        let runs = (0..self.runs)
            .map(|r| {
                let (mut z, mut v) = (height.sample(&mut rng), speed.sample(&mut rng));
                let (mut times, mut heights) = (Vec::new(), Vec::new());
                let mut noise: f64 = StandardNormal.sample(&mut rng);
                for i in 0..self.rows {
                    let mut reading = z + self.sigma * noise;
                    if self.wild > 0.0 && rng.random_bool(self.wild) {
                        let size: f64 = rng.random_range(10.0..40.0);
                        reading += self.sigma * if rng.random_bool(0.5) { size } else { -size };
                    }
                    heights.push(if self.digit > 0.0 {
                        (reading / self.digit).round() * self.digit
                    } else {
                        reading
                    });
                    times.push(i as f64 * dt);
                    let white: f64 = StandardNormal.sample(&mut rng);
                    noise = self.phi * noise + (1.0 - self.phi * self.phi).sqrt() * white;
                    const STEPS: usize = 200;
                    let h = dt / STEPS as f64;
                    for _ in 0..STEPS {
                        let a = |v: f64| -G + self.lift_m_s2 - self.linear_drag * v;
                        let middle = v + 0.5 * h * a(v);
                        z += h * middle;
                        v += h * a(middle);
                    }
                }
                Run { label: format!("{}", r + 1), inputs: vec![times], outputs: vec![heights], kind: 0 }
            })
            .collect();
        Recording {
            channels: vec![Quantity::new("z_m", "m")],
            variables: vec![Quantity::new("t_s", "s")],
            runs,
            noise_along: Some(0),
            calibration: vec![None],
            resolution: vec![self.digit],
        }
    }
}
