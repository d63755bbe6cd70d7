//! Parameters and mechanisms of a bouncing ball.

use std::sync::Arc;

use missing_physics::model::{Derived, ParameterRef, Quantity, SpecBuilder};

use super::effects::Effects;
use super::setup::Setup;
use super::spread::{HEADS, OUTWARDS};

/// Where each parameter stands; `None` where the data cannot show it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Layout {
    pub(super) restitution: ParameterRef,
    /// By how much that of a run differs, relative to 1.
    pub(super) of_run: ParameterRef,
    pub(super) slope: ParameterRef,
    pub(super) drag: ParameterRef,
    pub(super) table: Option<[ParameterRef; 2]>,
    pub(super) friction: Option<ParameterRef>,
    /// Where balls head on average when they first come to the table, and how much farther out for each metre that they land
    /// farther out.
    pub(super) hand: Option<[ParameterRef; 3]>,
    pub(super) clock: Option<ParameterRef>,
    pub(super) position: Option<ParameterRef>,
    pub(super) unheard: Option<ParameterRef>,
    /// By how much later a louder sound is heard.
    pub(super) walk: Option<ParameterRef>,
    /// Offsets along x and y of a microphone, and which it is.
    pub(super) microphone: Option<[ParameterRef; 3]>,
    /// Candidate terms of an unknown law: linear in x and y, and in the speed squared.
    pub(super) terms: Option<[ParameterRef; 2]>,
    pub(super) squared: ParameterRef,
    /// That the table's slope changes with the place, and along x and y where balls land on average.
    pub(super) curved: Option<[ParameterRef; 3]>,
}

/// The specification of a set-up, the restitution starting at a value.
pub(super) fn build(setup: &Setup, restitution: f64) -> (SpecBuilder, Layout) {
    let mut b = SpecBuilder::default();
    b.baseline("ballistic flight from impact to impact, a constant restitution, a level table");
    let mut p = Layout {
        restitution: b.shared("restitution", "", restitution, [1e-2, 2.0], 0.02),
        ..Layout::default()
    };
    air_and_speed(&mut b, &mut p, setup);
    if setup.placed {
        table(&mut b, &mut p);
    }
    if setup.placed || setup.dropped {
        let rate = b.shared("rate", "", 0.0, [-0.2, 0.2], 0.005);
        b.mechanism(
            "clock-rate",
            &[rate],
            [
                "clock rate",
                "The clock runs fast or slow.",
                "t_recorded = (1 + rate) t",
                "Olson 2010, doi:10.1109/IROS.2010.5650579 (clocks of sensors)",
            ],
            &["position-scale", "air-drag"],
        );
        p.clock = Some(rate);
    }
    if setup.placed {
        let scale = b.shared("scale", "", 0.0, [-0.3, 0.3], 0.01);
        b.mechanism(
            "position-scale",
            &[scale],
            [
                "scale of the places",
                "All distances on the table are too long or too short, as by a wrong speed of sound.",
                "x_recorded = (1 + scale) x",
                "[Matl 2021], section 4.3; Cramer 1993, doi:10.1121/1.405827 (speed of sound)",
            ],
            &["clock-rate", "table-tilt"],
        );
        p.position = Some(scale);
    }
    if setup.placed && setup.microphones > 3 {
        microphone(&mut b, &mut p, setup.microphones);
    }
    let [missed, runs] = setup.unheard;
    if missed > 0 {
        let unheard = b.shared("unheard", "", 0.0, [0.0, 2.0], 0.1);
        let mechanism = b.mechanism(
            "missed-impact",
            &[],
            [
                "impacts that were not heard",
                "In some runs two flights were taken for one, because the impact between them went unheard.",
                "a flight of (1 + e) T is one of T and one of e T",
                "[Matl 2021], section 4.3",
            ],
            &["velocity-dependent-restitution"],
        );
        mechanism.companions = vec![unheard.index];
        let fraction = missed as f64 / runs.max(1) as f64;
        mechanism.derived.push(Derived {
            name: "fraction".into(),
            unit: String::new(),
            value: Arc::new(move |_| fraction),
        });
        p.unheard = Some(unheard);
    }
    p.of_run = b.nuisance("restitution_change", "", [-0.5, 1.0], 0.01);
    b.between_runs(
        "restitution-by-run",
        &[p.of_run],
        [
            "a restitution that differs from run to run",
            "Each run is of another ball, or falls on another place of the table.",
            "e -> e (1 + change of the run)",
            "Laird and Ware 1982, doi:10.2307/2529876 (random effects)",
        ],
        &["velocity-dependent-restitution"],
    );
    terms(&mut b, &mut p, setup.placed);
    (b, p)
}

/// How a hand lets go of balls whose height is known: nobody states that it gives them no velocity of its own.
pub(super) fn hand(b: &mut SpecBuilder, nominal: &Effects) -> [ParameterRef; 3] {
    let [x, y] = nominal.heads;
    [
        b.shared("heads_x_rad", "rad", x, HEADS, 0.005),
        b.shared("heads_y_rad", "rad", y, HEADS, 0.005),
        b.shared("outwards_rad_m", "rad/m", nominal.outwards_per_m, OUTWARDS, 0.1),
    ]
}

fn air_and_speed(b: &mut SpecBuilder, p: &mut Layout, setup: &Setup) {
    p.drag = match setup.drag_unit {
        Some(_) => b.shared("drag_coefficient", "", 0.0, [0.0, 10.0], 0.1),
        None => b.shared("k_per_m", "1/m", 0.0, [0.0, 2.0], 0.02),
    };
    let mechanism = b.mechanism(
        "air-drag",
        &[p.drag],
        [
            "air drag",
            "The air slows the ball between its impacts.",
            "a = -k |v| v, k = rho Cd A / (2 m)",
            "Hoerner 1965, Fluid-Dynamic Drag, ch. 3",
        ],
        &["velocity-dependent-restitution"],
    );
    if let Some(unit) = setup.drag_unit {
        let drag = p.drag;
        mechanism.derived.push(Derived {
            name: "k_per_m".into(),
            unit: "1/m".into(),
            value: Arc::new(move |shared| unit * shared[drag.slot]),
        });
    }
    p.slope = b.shared("slope_s_m", "s/m", 0.0, [-0.5, 0.5], 5e-3);
    let restitution = p.restitution;
    let mechanism = b.mechanism(
        "velocity-dependent-restitution",
        &[p.slope],
        [
            "restitution that depends on the speed",
            "A faster impact gives back a smaller (or larger) part of the speed.",
            "e = e1 - slope (v - 1 m/s)",
            "Johnson 1985, Contact Mechanics, section 11.5, doi:10.1017/CBO9781139171731",
        ],
        &["air-drag"],
    );
    mechanism.derived.push(Derived {
        name: "e_at_1_m_s".into(),
        unit: String::new(),
        value: Arc::new(move |shared| shared[restitution.slot]),
    });
}

fn table(b: &mut SpecBuilder, p: &mut Layout) {
    let slopes = ["slope_x", "slope_y"].map(|name| b.shared(name, "", 0.0, [-0.6, 0.6], 0.01));
    let mechanism = b.mechanism(
        "table-tilt",
        &slopes,
        [
            "tilt of the table",
            "The table is not level.",
            "z = slope_x x + slope_y y; the velocity is mirrored at the tilted plane",
            "[Matl 2021], section 4.4",
        ],
        &["tangential-friction"],
    );
    mechanism.derived.push(Derived {
        name: "angle_rad".into(),
        unit: "rad".into(),
        value: Arc::new(move |shared| shared[slopes[0].slot].hypot(shared[slopes[1].slot]).atan()),
    });
    p.table = Some(slopes);
    let friction = b.shared("fraction", "", 0.0, [0.0, 1.0], 0.05);
    b.mechanism(
        "tangential-friction",
        &[friction],
        [
            "friction along the table",
            "Each impact takes a part of the speed along the table, beyond the restitution.",
            "v_along -> (1 - fraction) v_along before the restitution",
            "Cross 2002, doi:10.1119/1.1450571",
        ],
        &["table-tilt"],
    );
    p.friction = Some(friction);
}

fn microphone(b: &mut SpecBuilder, p: &mut Layout, count: usize) {
    let [x, y] = ["offset_x_m", "offset_y_m"].map(|name| b.shared(name, "m", 0.0, [-0.3, 0.3], 0.005));
    let which = b.shared("microphone", "", -1.0, [-1.0, count as f64 - 1.0], 1.0);
    let mechanism = b.mechanism(
        "microphone-offset",
        &[x, y, which],
        [
            "a microphone that stands elsewhere",
            "One microphone is not where it is stated to be.",
            "true place = stated place + offset (microphones counted from 0)",
            "Plinge et al. 2016, doi:10.1109/MSP.2016.2555198",
        ],
        &["position-scale"],
    );
    mechanism.integer_parameters = vec![which.index];
    mechanism.derived.push(Derived {
        name: "offset_m".into(),
        unit: "m".into(),
        value: Arc::new(move |shared| shared[x.slot].hypot(shared[y.slot])),
    });
    p.microphone = Some([x, y, which]);
}

/// What the logarithm of the restitution, and the table's slope, could depend on, should no mechanism hold.
fn terms(b: &mut SpecBuilder, p: &mut Layout, placed: bool) {
    let mut term = |name: &str, unit: &str, scale: f64, of: &str, formula: &str, variables: &[&str]| {
        let at = b.shared(name, unit, 0.0, [-1e3 * scale, 1e3 * scale], scale);
        b.term(at, formula, Quantity::new(of, ""), variables.iter().map(|v| (*v).into()).collect());
        at
    };
    let restitution = "ln(restitution)";
    p.squared = term("per_v2_s2_m2", "s^2/m^2", 1e-3, restitution, "v^2", &["v"]);
    if placed {
        let x = term("per_x_m", "1/m", 0.02, restitution, "x", &["x_m"]);
        let y = term("per_y_m", "1/m", 0.02, restitution, "y", &["y_m"]);
        p.terms = Some([x, y]);
        let slope = "slope of the table";
        let curved = term("curved_per_m", "1/m", 0.05, slope, "(r - mean r)", &["x_m", "y_m"]);
        p.curved = Some([
            curved,
            term("slope_at_middle_x", "", 0.01, slope, "e_x", &[]),
            term("slope_at_middle_y", "", 0.01, slope, "e_y", &[]),
        ]);
    }
}
