//! Parameters and mechanisms of a pour.

use std::sync::Arc;

use granular_infer::campaign::Ranges;
use missing_physics::model::{Derived, ParameterRef, Quantity, Spec, SpecBuilder};

/// Where each parameter stands among the shared ones.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Layout {
    pub(super) friction: ParameterRef,
    pub(super) rolling: ParameterRef,
    pub(super) restitution: ParameterRef,
    pub(super) rolling_damping: ParameterRef,
    pub(super) adhesion: ParameterRef,
    pub(super) ground_ratio: ParameterRef,
    pub(super) size_variance: ParameterRef,
    pub(super) tilt: [ParameterRef; 2],
    pub(super) funnel_offset: ParameterRef,
    pub(super) blur_px2: ParameterRef,
    pub(super) depth_offset: ParameterRef,
    pub(super) drag: ParameterRef,
    pub(super) aspect: ParameterRef,
    /// Candidate terms of an unknown law: the heap stands aside, is oval, is rougher, is larger.
    pub(super) aside: [ParameterRef; 2],
    pub(super) oval: [ParameterRef; 2],
    pub(super) rougher: ParameterRef,
    pub(super) larger: ParameterRef,
}

/// The specification; where baseline fits begin, and by how much the funnel may be off, m.
pub(super) fn build(ranges: &Ranges, start: [f64; 4], lowest_m: f64, highest_m: f64) -> (Spec, Layout) {
    let mut b = SpecBuilder::default();
    let mut p = Layout::default();
    b.baseline("equal rigid spheres with sliding friction, (damped) rolling friction and restitution, poured onto level ground");
    let within = |[low, high]: [f64; 2], v: f64| v.clamp(low, high);
    p.friction =
        b.shared("mu_s", "", within(ranges.sliding_friction, start[0]), ranges.sliding_friction, 0.1);
    p.rolling =
        b.shared("mu_r", "", within(ranges.rolling_friction, start[1]), ranges.rolling_friction, 0.03);
    p.restitution = b.shared("e", "", within(ranges.restitution, start[2]), ranges.restitution, 0.1);
    let damping = [0.0, ranges.rolling_damping];
    p.rolling_damping = b.shared("eta_r", "", within(damping, start[3]), damping, 0.1);
    grains(&mut b, &mut p, ranges);
    scene(&mut b, &mut p, ranges, lowest_m, highest_m);
    camera(&mut b, &mut p);
    terms(&mut b, &mut p);
    (b.build_unchecked(), p)
}

/// What the grains may be.
fn grains(b: &mut SpecBuilder, p: &mut Layout, ranges: &Ranges) {
    let most = ranges.work_of_adhesion_j_m2;
    p.adhesion = b.shared("work_of_adhesion_j_m2", "J/m2", 0.0, [0.0, most], 0.08 * most);
    b.mechanism(
        "cohesion",
        &[p.adhesion],
        [
            "cohesion",
            "Grains stick to each other and to the ground: steeper heaps, fewer strays.",
            "touching grains are pulled together by 2 pi w R*, 1/R* = 1/R1 + 1/R2",
            "Derjaguin, Muller and Toporov 1975, doi:10.1016/0021-9797(75)90018-1",
        ],
        &["ground-friction", "size-spread"],
    );
    p.aspect = b.shared("aspect_ratio", "", 1.0, [1.0, ranges.aspect_ratio], 0.1);
    b.mechanism(
        "non-spherical-grains",
        &[p.aspect],
        [
            "grains that are not spheres",
            "Long grains interlock and do not roll: a narrower, steeper heap.",
            "rods with round ends, aspect_ratio = length / width (1: spheres), of a sphere's volume",
            "Borzsonyi and Stannarius 2013, doi:10.1039/C3SM50298H",
        ],
        &["cohesion", "ground-friction"],
    );
    let most = ranges.size_variation.powi(2);
    p.size_variance = b.shared("relative_variance", "", 0.0, [0.0, most], 0.02);
    let slot = p.size_variance.slot;
    let spread = b.mechanism(
        "size-spread",
        &[p.size_variance],
        [
            "grains of several sizes",
            "Diameters differ from grain to grain: a rougher heap, strays of several heights.",
            "log-normal diameters of mean d, standard deviation = coefficient_of_variation d",
            "Limpert et al. 2001, doi:10.1641/0006-3568(2001)051[0341:LNDATS]2.0.CO;2",
        ],
        &["cohesion", "depth-blur"],
    );
    spread.derived.push(Derived {
        name: "coefficient_of_variation".into(),
        unit: String::new(),
        value: Arc::new(move |shared| shared[slot].max(0.0).sqrt()),
    });
}

/// What ground, air and funnel may be.
fn scene(b: &mut SpecBuilder, p: &mut Layout, ranges: &Ranges, lowest_m: f64, highest_m: f64) {
    let most = ranges.ground_ratio;
    p.ground_ratio = b.shared("ratio", "", 1.0, [1.0 / most, most], 0.2);
    let (ratio, grain) = (p.ground_ratio.slot, p.friction.slot);
    let ground = b.mechanism(
        "ground-friction",
        &[p.ground_ratio],
        [
            "another friction against the ground",
            "Grains slide on the ground at another friction than on each other: the foot of the heap is wider or narrower.",
            "mu_ground = ratio x mu_s (1: no effect)",
            "Coulomb; Cundall and Strack 1979, doi:10.1680/geot.1979.29.1.47",
        ],
        &["cohesion"],
    );
    ground.derived.push(Derived {
        name: "mu_ground".into(),
        unit: String::new(),
        value: Arc::new(move |shared| shared[ratio] * shared[grain]),
    });
    let most = ranges.tilt_rad;
    p.tilt = ["downhill_x_rad", "downhill_y_rad"].map(|n| b.shared(n, "rad", 0.0, [-most, most], 0.02));
    let slots = p.tilt.map(|t| t.slot);
    let tilted = b.mechanism(
        "tilted-ground",
        &p.tilt.clone(),
        [
            "tilted ground",
            "Ground, funnel and camera lean together: grains fall and roll downhill, the ground looks level.",
            "gravity has the parts g sin(downhill_x), g sin(downhill_y) along the ground",
            "Newton; [Matl 2021], section 3.4 (camera and ground)",
        ],
        &[],
    );
    tilted.derived.push(Derived {
        name: "angle_rad".into(),
        unit: "rad".into(),
        value: Arc::new(move |shared| shared[slots[0]].hypot(shared[slots[1]])),
    });
    let room = [ranges.height_m[0] - lowest_m, ranges.height_m[1] - highest_m];
    p.funnel_offset =
        b.shared("offset_m", "m", 0.0, [room[0].min(0.0), room[1].max(0.0)], ranges.height_m[1] / 28.0);
    b.mechanism(
        "funnel-offset",
        &[p.funnel_offset],
        [
            "another height of the funnel",
            "The funnel stands higher or lower than stated, by the same in every pour.",
            "height = funnel_height_m + offset_m",
            "[Matl 2021], section 3.7 (funnel height and ring)",
        ],
        &["air-drag"],
    );
    let most = ranges.drag_per_m;
    p.drag = b.shared("k_per_m", "1/m", 0.0, [0.0, most], 0.05 * most);
    b.mechanism(
        "air-drag",
        &[p.drag],
        [
            "air drag",
            "Air slows the falling grains; over a hand's height this shows only for very light ones.",
            "acceleration -k |v| v",
            "Clift, Grace and Weber 1978, Bubbles, Drops and Particles",
        ],
        &["funnel-offset"],
    );
}

/// What the camera may do.
fn camera(b: &mut SpecBuilder, p: &mut Layout) {
    p.blur_px2 = b.shared("variance_px2", "px2", 0.0, [0.0, 9.0], 0.5);
    let slot = p.blur_px2.slot;
    let blur = b.mechanism(
        "depth-blur",
        &[p.blur_px2],
        [
            "a blurred depth",
            "The depth of a pixel is a mean over its neighbours: single grains flatten, edges soften.",
            "depth convolved with a Gaussian of variance sigma_px^2, before the pixels' noise",
            "[Matl 2021], section 3.5 (figure 3.3)",
        ],
        &["size-spread"],
    );
    blur.derived.push(Derived {
        name: "sigma_px".into(),
        unit: "px".into(),
        value: Arc::new(move |shared| shared[slot].max(0.0).sqrt()),
    });
    p.depth_offset = b.shared("offset_m", "m", 0.0, [-0.1, 0.1], 5e-4);
    b.mechanism(
        "depth-offset",
        &[p.depth_offset],
        [
            "an offset of every depth",
            "The camera adds the same to every depth: the ground does not lie where the camera's height says.",
            "depth = true depth + offset_m",
            "Khoshelham and Elberink 2012, doi:10.3390/s120201437 (depth calibration)",
        ],
        &[],
    );
}

/// How a picture may differ, should no mechanism hold.
fn terms(b: &mut SpecBuilder, p: &mut Layout) {
    let mut term = |name: &str, scale: f64, formula: &str, adds_to: &str| {
        let at = b.shared(name, "", 0.0, [-100.0 * scale, 100.0 * scale], scale);
        b.term(at, formula, Quantity::new(adds_to, ""), vec!["funnel_height_m".into()]);
        at
    };
    p.aside = [
        term("aside_x", 0.02, "1 (the same in all pours)", "centroid_x over L"),
        term("aside_y", 0.02, "1 (the same in all pours)", "centroid_y over L"),
    ];
    p.oval = [
        term("oval_xx_yy", 0.02, "1 (the same in all pours)", "second moment xx - yy over L^2"),
        term("oval_xy", 0.02, "1 (the same in all pours)", "second moment 2 xy over L^2"),
    ];
    p.rougher = term("rougher", 0.05, "1 (the same in all pours)", "log roughness");
    p.larger = term("larger", 0.02, "the mean height itself", "heights");
}
