//! What takes mechanisms down that a recording need not declare.

use missing_physics::model::{Mechanism, ParameterRef, SpecBuilder};

use crate::mechanics::Declares;

/// A parameter of a mechanism.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part<R> {
    /// What it is.
    pub(super) role: R,
    pub(super) slot: usize,
    pub(super) index: usize,
    /// Where it is off.
    pub(super) off: f64,
}

/// A joint, an input or a sensor of a specification in the making, whose parameters have a `role` each.
pub(super) struct Carrier<'c, R, F> {
    pub(super) b: &'c mut SpecBuilder,
    pub(super) parts: &'c mut Vec<Part<R>>,
    /// Its name, where there are several of its kind.
    pub(super) of: Option<&'c str>,
    pub(super) role: F,
    /// What is not tried: what the recording declares itself, or does without.
    pub(super) but: Vec<&'c str>,
    /// Whether nobody asked for its mechanisms.
    pub(super) unasked: bool,
}

impl<R, F> Carrier<'_, R, F> {
    fn id(&self, kind: &str) -> String {
        self.of.map_or_else(|| kind.to_owned(), |of| format!("{kind}@{of}"))
    }
}

impl<E, R, F: Fn(E) -> R> Declares<E> for Carrier<'_, R, F> {
    fn wants(&self, kind: &str) -> bool {
        let id = self.id(kind);
        !self.but.iter().any(|but| *but == kind || *but == id)
    }

    fn parameter(
        &mut self,
        effect: E,
        name: &str,
        unit: &str,
        off: f64,
        bounds: [f64; 2],
        scale: f64,
    ) -> ParameterRef {
        let scale = if scale.is_normal() { scale } else { 1.0 };
        let at = self.b.shared(name, unit, off, bounds, scale);
        let role = (self.role)(effect);
        self.parts.push(Part { role, slot: at.slot, index: at.index, off });
        at
    }

    fn mechanism(
        &mut self,
        kind: &str,
        parameters: &[ParameterRef],
        text: [&str; 4],
        confused: &[&str],
    ) -> &mut Mechanism {
        let name = self.of.map_or_else(|| text[0].to_owned(), |of| format!("{} of {of}", text[0]));
        let id = self.id(kind);
        let mechanism = self.b.mechanism(&id, parameters, [&name, text[1], text[2], text[3]], confused);
        mechanism.unasked = self.unasked;
        mechanism
    }
}
