//! Friction, springs, stops and play of a joint.

use std::f64::consts::PI;

use super::{ARMSTRONG, Declares, JointEffect, JointHas, JointSizes, POSITIVE, TEXTBOOK};
use missing_physics::model::UNBOUNDED;

const WEN: &str = "Wen 1976, doi:10.1061/JMCEA3.0002106";
const NORDIN: &str = "Nordin and Gutman 2002, doi:10.1016/S0005-1098(02)00047-X";

/// Declares the mechanisms of a joint that make sense for it.
pub(crate) fn joints<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes, has: JointHas) {
    dry(d, s);
    damping(d, s);
    if has.drive {
        load(d);
    }
    if !s.unheld() {
        springs(d, s);
    }
    constant(d, s);
    if let Some(most) = s.periods() {
        cogging(d, s, most);
    }
    if has.follows {
        play(d, s);
    }
    stop(d, s);
    if has.inertia {
        inertia(d);
    }
    if let Some(yields) = has.yields {
        yielding(d, s, yields);
    }
}

fn dry<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes) {
    let unit = s.units.force.as_str();
    let force = 0.1 * s.force;
    if d.wants("coulomb-friction") {
        let level = d.parameter(JointEffect::Coulomb, "level", unit, 0.0, POSITIVE, force);
        d.mechanism(
            "coulomb-friction",
            &[level],
            [
                "dry friction",
                "A force of one size opposes the motion, and holds at rest what is below it.",
                "-level sign(v)",
                ARMSTRONG,
            ],
            &["viscous-friction", "hysteresis", "backlash"],
        );
    }
    if d.wants("asymmetric-friction") {
        let more = d.parameter(JointEffect::Asymmetry, "forward_less_backward", unit, 0.0, UNBOUNDED, force);
        d.mechanism(
            "asymmetric-friction",
            &[more],
            [
                "friction that differs with the direction",
                "Dry friction is larger in one direction than in the other.",
                "-(level +- forward_less_backward / 2) sign(v)",
                ARMSTRONG,
            ],
            &["constant-force", "input-offset"],
        );
    }
    if d.wants("stribeck-friction") {
        let level = d.parameter(JointEffect::StribeckLevel, "level", unit, 0.0, POSITIVE, force);
        let speed = d.parameter(
            JointEffect::StribeckSpeed,
            "speed",
            &s.units.speed,
            0.1 * s.speed,
            [1e-3 * s.speed, s.speed],
            0.1 * s.speed,
        );
        d.mechanism(
            "stribeck-friction",
            &[level, speed],
            [
                "Stribeck friction",
                "Dry friction that fades as the joint moves faster.",
                "-level exp(-(v/speed)^2) sign(v)",
                ARMSTRONG,
            ],
            &["coulomb-friction"],
        )
        .shape_parameters = vec![speed.index];
    }
}

fn damping<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes) {
    for (power, (kind, name, what, equation)) in [
        ("viscous-friction", "rate_per_s", "viscous friction", "-rate v"),
        ("quadratic-damping", "coefficient", "quadratic damping", "-c |v| v"),
        ("cubic-damping", "coefficient", "cubic damping", "-c v^3"),
    ]
    .into_iter()
    .enumerate()
    {
        if !d.wants(kind) {
            continue;
        }
        let scale = 0.1 * s.force / s.speed.powi(power as i32 + 1);
        let at =
            d.parameter(JointEffect::Damping(power), name, &s.units.damping[power], 0.0, POSITIVE, scale);
        d.mechanism(
            kind,
            &[at],
            [what, "A force that opposes the motion and grows with the speed.", equation, TEXTBOOK],
            &["coulomb-friction", "quadratic-damping", "cubic-damping", "viscous-friction"],
        );
    }
}

fn load<D: Declares<JointEffect>>(d: &mut D) {
    if !d.wants("load-dependent-friction") {
        return;
    }
    let fraction = d.parameter(JointEffect::LoadFraction, "fraction", "", 0.0, [0.0, 1.0], 0.1);
    d.mechanism(
        "load-dependent-friction",
        &[fraction],
        [
            "friction that grows with the load",
            "Dry friction in proportion to the driving force.",
            "-fraction |driving force| sign(v)",
            ARMSTRONG,
        ],
        &["coulomb-friction", "input-gain"],
    );
}

fn springs<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes) {
    let force = 0.1 * s.force;
    for (power, (kind, what, equation)) in [
        ("stiffness", "a spring", "-k x"),
        ("quadratic-stiffness", "a spring that pushes to one side", "-k x^2"),
        ("cubic-stiffness", "a spring that hardens or softens", "-k x^3"),
    ]
    .into_iter()
    .enumerate()
    {
        if !d.wants(kind) {
            continue;
        }
        let scale = force / s.reach.powi(power as i32 + 1);
        let at = d.parameter(
            JointEffect::Stiffness(power),
            "coefficient",
            &s.units.stiffness[power],
            0.0,
            UNBOUNDED,
            scale,
        );
        d.mechanism(
            kind,
            &[at],
            [what, "A force that depends on where the joint is.", equation, TEXTBOOK],
            &["stiffness", "cubic-stiffness", "quadratic-stiffness"],
        );
    }
}

fn constant<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes) {
    if !d.wants("constant-force") {
        return;
    }
    let level = d.parameter(JointEffect::Constant, "level", &s.units.force, 0.0, UNBOUNDED, 0.1 * s.force);
    d.mechanism(
        "constant-force",
        &[level],
        [
            "a constant force",
            "A force that is always the same: a weight, a slope, a bias.",
            "+level",
            TEXTBOOK,
        ],
        &["input-offset", "asymmetric-friction"],
    );
}

fn cogging<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes, most: f64) {
    if !d.wants("cogging") {
        return;
    }
    let force = 0.1 * s.force;
    let amplitude = d.parameter(JointEffect::CogAmplitude, "amplitude", &s.units.force, 0.0, POSITIVE, force);
    let phase = d.parameter(JointEffect::CogPhase, "phase_rad", "rad", 0.0, [-PI, PI], 1.0);
    let periods = d.parameter(JointEffect::CogPeriods, "periods", "", 1.0, [1.0, most], 1.0);
    let m = d.mechanism(
        "cogging",
        &[amplitude, phase, periods],
        [
            "cogging",
            "A force that repeats with the angle, some times a turn: magnets, teeth.",
            "amplitude sin(periods angle + phase)",
            TEXTBOOK,
        ],
        &["cubic-stiffness"],
    );
    m.shape_parameters = vec![phase.index];
    m.integer_parameters = vec![periods.index];
}

/// Play between what drives the joint and the joint.
fn play<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes) {
    if !d.wants("backlash") {
        return;
    }
    let [low, high] = s.range;
    let gap = d.parameter(JointEffect::Gap, "gap", &s.units.position, 0.0, [0.0, high - low], 0.02 * s.reach);
    d.mechanism(
        "backlash",
        &[gap],
        [
            "backlash",
            "Play between what drives the joint and the joint, from end to end.",
            "the joint follows the command at half the gap",
            NORDIN,
        ],
        &["coulomb-friction", "hysteresis", "input-dead-zone"],
    );
}

fn stop<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes) {
    if !d.wants("end-stop") {
        return;
    }
    let [low, high] = s.range;
    let span = high - low;
    let position = d.parameter(
        JointEffect::StopPosition,
        "position",
        &s.units.position,
        high - 0.05 * span,
        [low, high],
        0.1 * span,
    );
    let scale = 10.0 * s.force / s.reach;
    let unit = &s.units.stiffness[0];
    let stiffness = d.parameter(JointEffect::StopStiffness, "stiffness", unit, 0.0, POSITIVE, scale);
    d.mechanism(
        "end-stop",
        &[position, stiffness],
        [
            "an end stop",
            "Beyond a position something pushes back.",
            "-stiffness (x - position) beyond it",
            TEXTBOOK,
        ],
        &["cubic-stiffness", "sensor-saturation"],
    )
    .shape_parameters = vec![position.index];
}

fn inertia<D: Declares<JointEffect>>(d: &mut D) {
    if !d.wants("inertia") {
        return;
    }
    let fraction = d.parameter(JointEffect::Inertia, "fraction", "", 0.0, [-0.9, 10.0], 0.1);
    d.mechanism(
        "inertia",
        &[fraction],
        [
            "more inertia",
            "All accelerations of the joint are smaller by one factor.",
            "dv/dt / (1 + fraction)",
            TEXTBOOK,
        ],
        &["clock-rate", "input-gain"],
    );
}

/// A spring that yields, between two displacements.
fn yielding<D: Declares<JointEffect>>(d: &mut D, s: &JointSizes, [least, most]: [f64; 2]) {
    if !d.wants("hysteresis") {
        return;
    }
    let unit = &s.units.stiffness[0];
    let stiffness =
        d.parameter(JointEffect::YieldStiffness, "stiffness", unit, 0.0, POSITIVE, s.force / s.reach);
    let yields = d.parameter(
        JointEffect::Yield,
        "yield",
        &s.units.position,
        (0.03 * s.reach).min(0.3 * most),
        [least, most],
        (0.03 * s.reach).min(0.3 * most),
    );
    d.mechanism(
        "hysteresis",
        &[stiffness, yields],
        [
            "hysteresis",
            "A spring that yields: dry friction that gives before it slides.",
            "-stiffness z, dz/dt = v - (|v| z + v |z|) / (2 yield)",
            WEN,
        ],
        &["coulomb-friction", "backlash"],
    )
    .shape_parameters = vec![yields.index];
}
