//! Parameters and mechanisms of an indentation curve.

use std::sync::Arc;

use hertz_contact::indenter::Indenter;
use missing_physics::model::{Derived, ParameterRef, Spec, SpecBuilder, UNBOUNDED};

use super::setup::{Condition, Setup};

/// Where each parameter stands; `None` where the set-up has no law for it.
#[derive(Debug, Clone, Default)]
pub(super) struct Layout {
    pub(super) moduli: Vec<ParameterRef>,
    pub(super) offset: ParameterRef,
    pub(super) lift: ParameterRef,
    /// How much stiffer the body of a curve is, as a part of its modulus.
    pub(super) stiffer: ParameterRef,
    pub(super) tension: ParameterRef,
    pub(super) stretching: ParameterRef,
    /// The root of the work of adhesion: the force changes with it in proportion, near zero too.
    pub(super) adhesion: Option<ParameterRef>,
    /// One over the thickness.
    pub(super) thickness: Option<ParameterRef>,
    pub(super) relaxed: Option<ParameterRef>,
    pub(super) tau: Option<ParameterRef>,
    pub(super) rim_depth: ParameterRef,
    pub(super) rim_stiffness: ParameterRef,
    pub(super) compliance: ParameterRef,
    pub(super) stiffening: Option<ParameterRef>,
}

/// The specification of a set-up.
pub(super) fn build(
    setup: &Setup,
    conditions: &[Condition],
    layered: bool,
    deepest: f64,
    strongest: f64,
    longest: f64,
) -> (Spec, Layout) {
    let mut b = SpecBuilder::default();
    let mut p = Layout::default();
    let thickness = if setup.thickness_m.is_some() { " on a layer of the stated thickness" } else { "" };
    b.baseline(format!(
        "an elastic contact{thickness}: one modulus for each condition, contact at delta = 0, no adhesion"
    ));
    for condition in conditions {
        let start = condition.start_pa;
        p.moduli.push(b.shared(&condition.name, "Pa", start, [1e-6 * start, 1e6 * start], 0.2 * start));
    }
    p.offset = b.nuisance("offset_m", "m", [-deepest, deepest], 0.05 * deepest);
    b.mechanism(
        "contact-offset",
        &[p.offset],
        [
            "offset of the contact",
            "Contact is not at delta = 0; each curve has its own.",
            "F(delta - offset)",
            "Crick and Yin 2007, doi:10.1007/s10237-006-0046-x",
        ],
        &["force-offset", "membrane-tension"],
    );
    p.lift = b.nuisance("offset_n", "N", UNBOUNDED, 0.02 * strongest);
    let stiffness = strongest / deepest;
    extra_stiffness(&mut b, &mut p, stiffness, deepest);
    if let (Indenter::Sphere { radius_m }, true) = (setup.indenter, setup.radius_known) {
        adhesion(&mut b, &mut p, radius_m, strongest);
    }
    if layered && setup.thickness_m.is_none() {
        finite_thickness(&mut b, &mut p, deepest);
    }
    if setup.timed {
        viscoelasticity(&mut b, &mut p, longest);
    }
    if setup.radius_known && !matches!(setup.indenter, Indenter::Cone { .. }) {
        strain_stiffening(&mut b, &mut p);
    }
    p.stiffer = b.nuisance("stiffness_change", "", [-0.9, 9.0], 0.05);
    b.between_runs(
        "stiffness-by-run",
        &[p.stiffer],
        [
            "a body that differs from curve to curve",
            "Each curve is of another body, or of another place on it.",
            "E -> E (1 + change of the curve)",
            "Laird and Ware 1982, doi:10.2307/2529876 (random effects)",
        ],
        &["contact-offset"],
    );
    (b.build_unchecked(), p)
}

/// Surfaces that stick; `strongest` is the largest force, N.
fn adhesion(b: &mut SpecBuilder, p: &mut Layout, radius_m: f64, strongest: f64) {
    // A pull-off force of a hundredth of the largest force.
    let typical = 0.01 * strongest / (1.5 * std::f64::consts::PI * radius_m);
    let root =
        b.shared("root_work_of_adhesion", "J^0.5/m", 0.0, [0.0, (1e4 * typical).sqrt()], typical.sqrt());
    let mechanism = b.mechanism(
        "adhesion",
        &[],
        [
            "adhesion",
            "The surfaces stick together.",
            "JKR: F = 4 E* a^3 / (3 R) - sqrt(8 pi w E* a^3)",
            "Johnson, Kendall and Roberts 1971, doi:10.1098/rspa.1971.0141",
        ],
        &["force-offset", "contact-offset"],
    );
    mechanism.companions = vec![root.index];
    mechanism.derived.push(Derived {
        name: "work_of_adhesion_j_m2".into(),
        unit: "J/m^2".into(),
        value: Arc::new(move |shared| shared[root.slot].powi(2)),
    });
    p.adhesion = Some(root);
}

/// A body on something rigid; `deepest` is the deepest indentation, m.
fn finite_thickness(b: &mut SpecBuilder, p: &mut Layout, deepest: f64) {
    let inverse = b.shared("inverse_thickness_per_m", "1/m", 0.0, [0.0, 2.0 / deepest], 0.1 / deepest);
    let mechanism = b.mechanism(
        "finite-thickness",
        &[],
        [
            "finite thickness",
            "The body is thin and glued to something rigid, which shows through.",
            "F C(reach / H): the contact on a bonded layer, solved for this Poisson's ratio",
            "Dimitriadis et al. 2002, doi:10.1016/S0006-3495(02)75620-8 (the problem; solved here without its expansion)",
        ],
        &["strain-stiffening", "membrane-stretching"],
    );
    mechanism.companions = vec![inverse.index];
    mechanism.derived.push(Derived {
        name: "thickness_m".into(),
        unit: "m".into(),
        value: Arc::new(move |shared| 1.0 / shared[inverse.slot]),
    });
    p.thickness = Some(inverse);
}

/// A body that relaxes; `longest` is the longest curve, s.
fn viscoelasticity(b: &mut SpecBuilder, p: &mut Layout, longest: f64) {
    let relaxed = b.shared("relaxed_fraction", "", 0.0, [0.0, 0.999], 0.05);
    let tau =
        b.shared("tau_s", "s", 0.1 * longest, [1e-4 * longest, 30.0 * longest.max(1e-6)], 0.1 * longest);
    let mechanism = b.mechanism(
        "viscoelasticity",
        &[relaxed, tau],
        [
            "relaxation (standard linear solid)",
            "The force relaxes while the indenter stands still, and lags while it moves.",
            "F = int psi(t - s) dF, psi = 1 - g (1 - exp(-t / tau)); unloading after Ting",
            "Ting 1966, doi:10.1115/1.3625192; Lee and Radok 1960, doi:10.1115/1.3644020",
        ],
        &["contact-offset", "load-cell-compliance"],
    );
    mechanism.shape_parameters = vec![tau.index];
    (p.relaxed, p.tau) = (Some(relaxed), Some(tau));
}

/// A body that grows stiffer as it is strained.
fn strain_stiffening(b: &mut SpecBuilder, p: &mut Layout) {
    let stiffening = b.shared("coefficient", "", 0.0, [0.0, 10.0], 0.05);
    b.mechanism(
        "strain-stiffening",
        &[stiffening],
        [
            "strain stiffening",
            "The material grows stiffer as it is strained.",
            "F (1 + c delta / R)",
            "Storm et al. 2005, doi:10.1038/nature03521 (the effect); first order in the strain",
        ],
        &["finite-thickness", "membrane-stretching"],
    );
    p.stiffening = Some(stiffening);
}

/// What adds to or takes from the force beside the contact: offset, membrane, rim, load cell.
fn extra_stiffness(b: &mut SpecBuilder, p: &mut Layout, stiffness: f64, deepest: f64) {
    b.mechanism(
        "force-offset",
        &[p.lift],
        [
            "offset of the force",
            "The load cell's zero is off; each curve has its own.",
            "F + offset",
            "ISO 376:2011",
        ],
        &["contact-offset", "adhesion"],
    );
    p.tension = b.shared("stiffness_n_m", "N/m", 0.0, [0.0, 10.0 * stiffness], 0.05 * stiffness);
    b.mechanism(
        "membrane-tension",
        &[p.tension],
        [
            "tension of a membrane",
            "A skin under tension adds a force in proportion to the depth.",
            "F + T delta, one T over all conditions",
            "Vella and Davidovitch 2017, doi:10.1039/C6SM02451C",
        ],
        &["contact-offset", "load-cell-compliance"],
    );
    let cubic = stiffness / (deepest * deepest);
    p.stretching = b.shared("coefficient_n_m3", "N/m^3", 0.0, [0.0, 10.0 * cubic], 0.05 * cubic);
    b.mechanism(
        "membrane-stretching",
        &[p.stretching],
        [
            "stretching of a membrane",
            "A skin that is stretched adds a force with the third power of the depth.",
            "F + K delta^3, one K over all conditions",
            "Komaragiri, Begley and Simmonds 2005, doi:10.1115/1.1827246",
        ],
        &["strain-stiffening", "finite-thickness", "rim-contact"],
    );
    p.rim_depth = b.shared("depth_m", "m", 0.6 * deepest, [0.02 * deepest, 0.99 * deepest], 0.1 * deepest);
    p.rim_stiffness = b.shared("stiffness_n_m", "N/m", 0.0, [0.0, 100.0 * stiffness], 0.1 * stiffness);
    let rim = b.mechanism(
        "rim-contact",
        &[p.rim_depth, p.rim_stiffness],
        [
            "contact of a rim",
            "From some depth on the indenter's edge or holder touches as well.",
            "F + k (delta - depth) beyond the depth",
            "[Matl 2021], section 6.4",
        ],
        &["membrane-stretching", "strain-stiffening"],
    );
    rim.shape_parameters = vec![p.rim_depth.index];
    p.compliance = b.shared("compliance_m_n", "m/N", 0.0, [0.0, 0.9 / stiffness], 0.02 / stiffness);
    b.mechanism(
        "load-cell-compliance",
        &[p.compliance],
        [
            "compliance of the load cell",
            "The load cell gives way: the body is pressed less deep than was measured.",
            "delta = delta_measured - C F",
            "Oliver and Pharr 1992, doi:10.1557/JMR.1992.1564",
        ],
        &["membrane-tension", "viscoelasticity"],
    );
}
