//! Parameters and mechanisms of a rolled dough.

use dough_mbrl::band::Band;
use missing_physics::model::{ParameterRef, Quantity, Spec, SpecBuilder};

use super::rolls::Step;

/// What may have become of the response since it was learned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Effects {
    pub(super) factor: f64,
    pub(super) drying_per_s: f64,
    pub(super) slip_n: f64,
    pub(super) springback: f64,
    pub(super) volume_loss: f64,
    pub(super) softening_per_roll: f64,
    /// Candidate terms of an unknown law: on even and odd rolls, by the throw (1/m), by the length (1/m).
    pub(super) parity: f64,
    pub(super) throw: f64,
    pub(super) length: f64,
}

impl Effects {
    /// Everything as it was learned.
    pub(super) const OFF: Self = Self {
        factor: 1.0,
        drying_per_s: 0.0,
        slip_n: 0.0,
        springback: 0.0,
        volume_loss: 0.0,
        softening_per_roll: 0.0,
        parity: 0.0,
        throw: 0.0,
        length: 0.0,
    };

    /// By how much the response of a roll that grips is larger than the learned one.
    pub(super) fn response(&self, step: f64, t_s: f64, throw_m: f64, length_m: f64) -> f64 {
        let faded = (-self.drying_per_s * t_s - self.softening_per_roll * (step - 1.0)).exp();
        let even = if (step.round() as i64) % 2 == 0 { 1.0 } else { -1.0 };
        let law = 1.0 + self.parity * even + self.throw * (throw_m - 0.08) + self.length * (length_m - 0.06);
        self.factor * faded * law
    }
}

/// Where each parameter stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Layout {
    factor: ParameterRef,
    drying: Option<ParameterRef>,
    /// The force below which the band slips.
    pub(super) slip: ParameterRef,
    springback: ParameterRef,
    loss: ParameterRef,
    softening: ParameterRef,
    parity: ParameterRef,
    throw: ParameterRef,
    length: ParameterRef,
}

impl Layout {
    pub(super) fn effects(&self, shared: &[f64]) -> Effects {
        Effects {
            factor: shared[self.factor.slot],
            drying_per_s: self.drying.map_or(0.0, |at| shared[at.slot]),
            slip_n: shared[self.slip.slot],
            springback: shared[self.springback.slot],
            volume_loss: shared[self.loss.slot],
            softening_per_roll: shared[self.softening.slot],
            parity: shared[self.parity.slot],
            throw: shared[self.throw.slot],
            length: shared[self.length.slot],
        }
    }
}

/// The force with which a band rolls, N.
pub(super) fn force_n(band: &Band, step: &Step) -> f64 {
    band.force_n(step.roll.action[0], step.roll.action[1])
}

/// The specification of a recording's rolls, `timed` where their times were recorded.
pub(super) fn for_rolls(band: &Band, timed: bool, steps: &[Step]) -> (Spec, Layout) {
    let most = |of: &dyn Fn(&Step) -> f64, least: f64| steps.iter().map(of).fold(least, f64::max);
    let (longest, strongest) = (most(&|s| s.t_s, 1.0), most(&|s| force_n(band, s), 1e-9));
    build(timed.then_some(longest), strongest, most(&|s| s.step, 1.0))
}

/// The specification; `longest_s` where times were recorded, the strongest roll's force, the last step of a run.
pub(super) fn build(longest_s: Option<f64>, strongest_n: f64, last: f64) -> (Spec, Layout) {
    let mut b = SpecBuilder::default();
    let mut p = Layout::default();
    b.baseline("the dynamics learned from the training rolls, as uncertain as they leave them");
    p.factor = b.shared("factor", "", 1.0, [0.0, 20.0], 0.05);
    b.mechanism(
        "stiffness-change",
        &[p.factor],
        [
            "another stiffness",
            "The dough answers every roll by a common factor more (or less) than the one it was learned from.",
            "logarithmic strain = factor x learned strain (1: no effect)",
            "[Matl 2021], section 7.5",
        ],
        &["drying", "band-softening"],
    );
    if let Some(longest) = longest_s {
        let rate = b.shared("rate_per_s", "1/s", 0.0, [0.0, 20.0 / longest], 0.1 / longest);
        b.mechanism(
            "drying",
            &[rate],
            [
                "drying",
                "The dough dries, and answers less and less with time.",
                "logarithmic strain = exp(-rate t) x learned strain",
                "Bloksma 1990 (dough rheology and water), Cereal Foods World 35",
            ],
            &["stiffness-change", "band-softening"],
        );
        p.drying = Some(rate);
    }
    p.slip = b.shared("force_n", "N", 0.0, [0.0, strongest_n], 0.05 * strongest_n);
    b.mechanism(
        "slip",
        &[p.slip],
        [
            "slip",
            "Below a force the band slips over the dough and does nothing.",
            "change = 0 for F < force, F = (k0 + k1 (throw - throw0)) depth (1 + k2 depth)",
            "[Matl 2021], section 7.3",
        ],
        &["stiffness-change"],
    );
    p.springback = b.shared("fraction", "", 0.0, [0.0, 1.0], 0.02);
    b.mechanism(
        "springback",
        &[p.springback],
        [
            "springback",
            "The dough undoes a part of each change before the next roll; dough that was lost does not come back.",
            "length at the next roll = next_length - fraction (next_length - length)",
            "Charalambides et al. 2002, doi:10.1007/s00397-002-0242-2 (elastic recovery of dough)",
        ],
        &["volume-loss"],
    );
    p.loss = b.shared("fraction_per_roll", "", 0.0, [0.0, 0.5], 5e-3);
    b.mechanism(
        "volume-loss",
        &[p.loss],
        [
            "dough left on the tool",
            "Each roll leaves a part of the dough on the tool.",
            "each dimension after a roll is (1 - fraction)^(1/3) of what was learned",
            "[Matl 2021], section 7.6",
        ],
        &["springback"],
    );
    p.softening = b.shared("rate_per_roll", "", 0.0, [0.0, 5.0], 0.2 / last.max(2.0));
    b.mechanism(
        "band-softening",
        &[p.softening],
        [
            "a band that tires",
            "The band softens roll by roll, and recovers before a new run.",
            "logarithmic strain = exp(-rate (step - 1)) x learned strain",
            "Mullins 1969, doi:10.5254/1.3539210",
        ],
        &["drying", "stiffness-change"],
    );
    terms(&mut b, &mut p);
    (b.build_unchecked(), p)
}

/// What the response could depend on, should no mechanism hold.
fn terms(b: &mut SpecBuilder, p: &mut Layout) {
    let mut term = |name: &str, unit: &str, scale: f64, formula: &str, variable: &str| {
        let at = b.shared(name, unit, 0.0, [-1e3 * scale, 1e3 * scale], scale);
        b.term(at, formula, Quantity::new("relative response", ""), vec![variable.into()]);
        at
    };
    p.parity = term("alternation", "", 0.05, "(-1)^step", "step");
    p.throw = term("per_throw_m", "1/m", 1.0, "(throw - 0.08 m)", "throw_m");
    p.length = term("per_length_m", "1/m", 1.0, "(length - 0.06 m)", "length_m");
}
