//! The full model of an indentation curve: contact laws from `hertz-contact`, the load cell, and all parameters.

use hertz_contact::Number;
use hertz_contact::indenter::Indenter;
use hertz_contact::law::{Acting, Base, Indentation, Law, Layer};
use hertz_contact::viscoelastic::{Contact, LinearSolid, Scratch};
use missing_physics::data::Run;
use missing_physics::model::{Extensions, Model, MultimodalModel, ParameterRef, PredictError, Spec};

use super::setup::{Condition, Setup};
use super::spec::{self, Layout};
use crate::dual::{DualModel, JacobianRequest, Moving};

/// The model of the domain `indentation`.
#[derive(Debug)]
pub struct IndentationModel {
    setup: Setup,
    spec: Spec,
    layout: Layout,
    layer: Option<Layer>,
    deepest_m: f64,
    longest_s: f64,
}

/// The code of the segment `unload` among the inputs.
const UNLOAD: f64 = 2.0;

impl IndentationModel {
    /// The model of a set-up with its conditions (by [`Run::kind`]), the deepest indentation (m), the largest force (N) and the
    /// longest curve (s) of the recording.
    ///
    /// # Errors
    /// A sentence where the indenter or Poisson's ratio makes no law.
    pub fn new(
        setup: Setup,
        conditions: &[Condition],
        deepest_m: f64,
        strongest_n: f64,
        longest_s: f64,
    ) -> Result<Self, String> {
        let layer = if setup.radius_known || matches!(setup.indenter, Indenter::Cone { .. }) {
            Layer::new(&setup.indenter, setup.poisson_ratio, Base::Bonded).ok()
        } else {
            None
        };
        Indentation::elastic(setup.indenter, 1.0, setup.poisson_ratio).check().map_err(|e| e.to_string())?;
        let (spec, layout) =
            spec::build(&setup, conditions, layer.is_some(), deepest_m, strongest_n, longest_s);
        Ok(Self { setup, spec, layout, layer, deepest_m, longest_s })
    }

    /// The deepest indentation of the recording, m.
    pub fn deepest_m(&self) -> f64 {
        self.deepest_m
    }

    /// What is known of the set-up.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Where a run's contact begins, m, and what its sensor reads without one, N.
    pub(super) fn offsets(&self, nuisance: &[f64]) -> [f64; 2] {
        [nuisance[self.layout.offset.slot], nuisance[self.layout.lift.slot]]
    }

    /// The modulus of a run's condition.
    fn modulus(&self, run: &Run) -> Option<ParameterRef> {
        let moduli = &self.layout.moduli;
        moduli.get(run.kind as usize).or_else(|| moduli.first()).copied()
    }

    /// Forces of a law over the depths of a run.
    fn forces<T: Number>(
        &self,
        run: &Run,
        law: &impl Law<T>,
        relaxation: Option<LinearSolid<T>>,
        depths: &[T],
        out: &mut [T],
    ) -> Result<(), String> {
        let Some(solid) = relaxation else {
            let segments = run.inputs.get(2);
            for (i, (force, depth)) in out.iter_mut().zip(depths).enumerate() {
                // On the way in nothing is felt before contact; on the way out adhesion holds on.
                let out_of_reach = depth.re() < 0.0 && segments.is_none_or(|s| s[i] != UNLOAD);
                *force = if out_of_reach { T::from(0.0) } else { law.force(*depth) };
            }
            return Ok(());
        };
        let times = run.inputs.get(1).ok_or("t_s is missing")?;
        let contact = match self.setup.indenter {
            Indenter::Cylinder { .. } => Contact::Fixed,
            _ => Contact::Shrinks,
        };
        solid.forces(law, contact, times, depths, &mut Scratch::new(), out).map_err(|e| e.to_string())
    }

    /// The square of its root; where there is none, a derivative that keeps its direction, as a small root has it.
    fn work_of_adhesion<T: Number>(&self, root: T) -> T {
        let scale = self.layout.adhesion.map_or(0.0, |at| self.spec.parameters[at.index].scale);
        if root.re() > 0.0 { root * root } else { root * (1e-5 * scale) }
    }
}

impl DualModel for IndentationModel {
    /// A modulus acts on the runs of its own condition.
    fn acts_on(&self, run: &Run, shared_slot: usize) -> bool {
        let nuisance = self.modulus(run).map(|at| at.slot);
        nuisance == Some(shared_slot) || self.layout.moduli.iter().all(|at| at.slot != shared_slot)
    }

    /// The forces of a run; an effect whose derivative is asked for is there at its off value too.
    fn predict_dual<T: Number>(
        &self,
        run: &Run,
        shared: &[T],
        nuisance: &[T],
        moving: Moving<'_>,
        out: &mut [T],
    ) -> Result<(), String> {
        let p = &self.layout;
        let depths = run.inputs.first().ok_or("delta_m is missing")?;
        let value = |at: Option<ParameterRef>| at.map_or(T::from(0.0), |at| shared[at.slot]);
        let on = |at: Option<ParameterRef>| {
            at.is_some_and(|at| shared[at.slot].re() > 0.0 || moving.shared.contains(&at.slot))
        };
        let modulus = self.modulus(run).ok_or("no condition")?;
        let modulus = shared[modulus.slot] * (nuisance[p.stiffer.slot] + 1.0);
        let known = self.setup.thickness_m.map_or(0.0, f64::recip);
        let law = Indentation {
            layer: self.layer.filter(|_| known > 0.0 || on(p.thickness)),
            inverse_thickness_per_m: value(p.thickness) + known,
            work_of_adhesion_j_m2: self.work_of_adhesion(value(p.adhesion)),
            stiffening: value(p.stiffening),
            tension_n_m: shared[p.tension.slot],
            stretching_n_m3: shared[p.stretching.slot],
            rim_depth_m: shared[p.rim_depth.slot],
            rim_stiffness_n_m: shared[p.rim_stiffness.slot],
            compliance_m_n: shared[p.compliance.slot],
            ..Indentation::elastic(self.setup.indenter, modulus, self.setup.poisson_ratio)
        };
        law.check().map_err(|e| e.to_string())?;
        let relaxation =
            on(p.relaxed).then(|| LinearSolid { relaxed_fraction: value(p.relaxed), tau_s: value(p.tau) });
        let offset = nuisance[p.offset.slot];
        let true_depths: Vec<T> = depths.iter().map(|d| -offset + *d).collect();
        let acting = Acting {
            adhesion: on(p.adhesion),
            stiffening: on(p.stiffening),
            membrane: on(Some(p.tension)) || on(Some(p.stretching)),
            rim: on(Some(p.rim_stiffness)),
            compliance: on(Some(p.compliance)),
        };
        self.forces(run, &law.contact(acting), relaxation, &true_depths, out)?;
        out.iter_mut().for_each(|force| *force += nuisance[p.lift.slot]);
        Ok(())
    }
}

impl Model for IndentationModel {
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
        Extensions { modes: Some(self), local_causes: Some(self), ..Extensions::default() }
    }
}

impl MultimodalModel for IndentationModel {
    fn starts(&self, mechanism: usize, _: &[Run], _: &[Vec<Vec<f64>>]) -> Vec<Vec<(usize, f64)>> {
        let p = &self.layout;
        match self.spec.mechanisms[mechanism].id.as_str() {
            "rim-contact" => [0.2, 0.35, 0.5, 0.65, 0.8, 0.9]
                .iter()
                .map(|share| vec![(p.rim_depth.index, share * self.deepest_m)])
                .collect(),
            "viscoelasticity" => {
                let (Some(tau), Some(relaxed)) = (p.tau, p.relaxed) else { return Vec::new() };
                [0.003, 0.01, 0.03, 0.1, 0.3, 1.0]
                    .iter()
                    .map(|share| vec![(tau.index, share * self.longest_s), (relaxed.index, 0.05)])
                    .collect()
            }
            _ => Vec::new(),
        }
    }
}
