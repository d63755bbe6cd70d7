//! Parameters, mechanisms and candidate terms of a flight.

use std::sync::Arc;

use missing_physics::model::{Derived, ParameterRef, Quantity, Spec, SpecBuilder, UNBOUNDED};

use super::setup::{Axes, Setup};

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
    /// Along all axes alike, and along one.
    Stiff,
    StiffX,
    StiffY,
    StiffZ,
}

impl Role {
    /// Whether a flight with it on still has a closed form.
    pub(super) fn keeps_closed_form(self) -> bool {
        use Role::{Cubic, LiftCoefficient, LiftX, LiftY, LiftZ, Quadratic, Stiff, StiffX, StiffY, StiffZ};
        !matches!(
            self,
            Quadratic | Cubic | LiftX | LiftY | LiftZ | LiftCoefficient | Stiff | StiffX | StiffY | StiffZ
        )
    }
}

/// A specification in the making, with the meaning of each shared parameter, in order.
struct Flying {
    b: SpecBuilder,
    roles: Vec<Role>,
}

impl Flying {
    fn shared(&mut self, role: Role, name: &str, unit: &str, bounds: [f64; 2], scale: f64) -> ParameterRef {
        self.roles.push(role);
        self.b.shared(name, unit, 0.0, bounds, scale)
    }

    fn term(
        &mut self,
        role: Role,
        (name, unit): (&str, &str),
        lower: f64,
        scale: f64,
        formula: &str,
        variables: &[&str],
    ) {
        let coefficient = self.shared(role, name, unit, [lower, f64::INFINITY], scale);
        self.b.term(
            coefficient,
            formula,
            Quantity::new("acceleration", "m/s^2"),
            variables.iter().map(|s| (*s).to_owned()).collect(),
        );
    }
}

/// The specification of a set-up.
pub(super) struct Built {
    pub(super) spec: Spec,
    /// The meaning of each shared parameter, in order.
    pub(super) roles: Vec<Role>,
    /// The slot of a run's change of each component of the lift, where it may have any.
    pub(super) lifts: [Option<usize>; 3],
}

/// The specification of a set-up.
pub(super) fn build(setup: &Setup, drag_unit: f64) -> Built {
    let mut flying = Flying { b: SpecBuilder::default(), roles: Vec::new() };
    let b = &mut flying;
    let felt = setup.axes == Axes::Accelerometer;
    b.b.baseline(if felt {
        "free fall: an accelerometer on board reads its offset and nothing else"
    } else {
        "ballistic flight under gravity alone, seen by a true camera; every run has its own start"
    });
    let drag = drags(b, setup, drag_unit);
    if !felt {
        camera_and_gravity(b);
    }
    if setup.axes.along_ground() {
        along_ground(b, setup, drag);
    }
    terms(b, setup.axes);
    start(b, setup.axes);
    let lifts = if setup.axes.along_ground() && !setup.spin { spins(b, setup.axes) } else { [None; 3] };
    Built { spec: flying.b.build_unchecked(), roles: flying.roles, lifts }
}

/// Drags of the air; the parameter of the quadratic one, whose unit is that of a drag coefficient where the ball's size is known.
fn drags(b: &mut Flying, setup: &Setup, drag_unit: f64) -> ParameterRef {
    let sized = setup.mass_kg.is_some() && setup.diameter_m.is_some();
    let drag = if sized {
        b.shared(Role::Quadratic, "drag_coefficient", "", [0.0, 10.0], 0.5)
    } else {
        b.shared(Role::Quadratic, "k_per_m", "1/m", [0.0, 200.0], 0.02)
    };
    let text = [
        "air drag, quadratic",
        "The air slows the ball in proportion to the square of its speed.",
        "a = -k |v - w| (v - w), k = rho Cd A / (2 m)",
        "Clift, Grace and Weber 1978, Bubbles, Drops, and Particles; de Silva et al. 2020, doi:10.3389/frai.2020.00025",
    ];
    let mechanism =
        b.b.mechanism("quadratic-drag", &[drag], text, &["linear-drag", "buoyancy", "camera-scale"]);
    if sized {
        mechanism.derived.push(Derived {
            name: "k_per_m".into(),
            unit: "1/m".into(),
            value: Arc::new(move |shared| drag_unit * shared[drag.slot]),
        });
    }
    let rate = b.shared(Role::Linear, "rate_per_s", "1/s", [0.0, 200.0], 0.1);
    let text = [
        "air drag, linear",
        "The air slows the ball in proportion to its speed.",
        "a = -r (v - w)",
        "Stokes 1851; de Silva et al. 2020, doi:10.3389/frai.2020.00025",
    ];
    b.b.mechanism("linear-drag", &[rate], text, &["quadratic-drag", "buoyancy", "camera-scale"]);
    drag
}

/// Candidate terms of an unknown law.
fn terms(b: &mut Flying, axes: Axes) {
    b.term(Role::Cubic, ("cubic_drag_s_per_m2", "s/m^2"), 0.0, 1e-3, "-|v|^2 v", &["v"]);
    if axes != Axes::Accelerometer {
        b.term(
            Role::StiffZ,
            ("stiffness_z_per_s2", "1/s^2"),
            f64::NEG_INFINITY,
            0.1,
            "-(z - z(0))",
            &["z_m"],
        );
    }
    if axes.along_ground() {
        let free = f64::NEG_INFINITY;
        b.term(Role::Stiff, ("stiffness_per_s2", "1/s^2"), free, 0.1, "-(r - r(0))", axes.channels());
        b.term(Role::PushX, ("push_x_m_s2", "m/s^2"), free, 0.1, "e_x", &[]);
        if axes == Axes::Space {
            b.term(Role::PushY, ("push_y_m_s2", "m/s^2"), free, 0.1, "e_y", &[]);
        }
        b.term(Role::StiffX, ("stiffness_x_per_s2", "1/s^2"), free, 0.1, "-(x - x(0))", &["x_m"]);
        if axes == Axes::Space {
            b.term(Role::StiffY, ("stiffness_y_per_s2", "1/s^2"), free, 0.1, "-(y - y(0))", &["y_m"]);
        }
    }
}

/// Where and how fast each run begins.
fn start(b: &mut Flying, axes: Axes) {
    if axes == Axes::Accelerometer {
        b.b.nuisance("offset_m_s2", "m/s^2", UNBOUNDED, 1.0);
        b.b.nuisance("vz0_m_s", "m/s", [-100.0, 100.0], 0.01);
    }
    for axis in axes.seen() {
        b.b.nuisance(["x0_m", "y0_m", "z0_m"][*axis], "m", UNBOUNDED, 1.0);
    }
    for axis in axes.seen() {
        b.b.nuisance(["vx0_m_s", "vy0_m_s", "vz0_m_s"][*axis], "m/s", UNBOUNDED, 1.0);
    }
}

/// A spin that differs from run to run: the slot of each component of the lift.
fn spins(b: &mut Flying, axes: Axes) -> [Option<usize>; 3] {
    let names = ["lift_change_x_per_s", "lift_change_y_per_s", "lift_change_z_per_s"];
    let changes: Vec<ParameterRef> =
        names[axes.spins()].iter().map(|name| b.b.nuisance(name, "1/s", [-20.0, 20.0], 0.1)).collect();
    let text = [
        "a spin that differs from run to run",
        "Each run's ball spins in its own way.",
        "a = (lift + change of the run) x v",
        "Laird and Ware 1982, doi:10.2307/2529876 (random effects)",
    ];
    b.b.between_runs("spin-by-run", &changes, text, &["magnus-lift"]);
    let mut lifts = [None; 3];
    axes.spins().zip(&changes).for_each(|(axis, change)| lifts[axis] = Some(change.slot));
    lifts
}

/// Effects that a height alone shows.
fn camera_and_gravity(b: &mut Flying) {
    // Beyond 0.5 m/s^2 it is not physics: nowhere on Earth is g that different, and air is not that dense.
    let lift = b.shared(Role::Buoyancy, "acceleration_m_s2", "m/s^2", [-0.5, 0.5], 0.2);
    let text = [
        "buoyancy or another g",
        "A constant force along gravity: a dense gas, a light ball, a frame that accelerates, another g.",
        "a = b e_z, |b| <= 0.5 m/s^2",
        "Archimedes' principle: b = g rho V / m; Moritz 1980, Geodetic Reference System, for the range of g",
    ];
    b.b.mechanism("buoyancy", &[lift], text, &["camera-scale", "clock-rate", "linear-drag"]);
    // Without a calibration the scale is that of something else in the picture, which may be a quarter nearer or farther than the ball.
    let scale = b.shared(Role::CameraScale, "scale", "", [-0.25, 0.25], 0.01);
    let text = [
        "camera scale",
        "Positions are read too large or too small.",
        "measured = (1 + s) true, |s| <= 0.25",
        "Hartley and Zisserman 2004, doi:10.1017/CBO9780511811685, ch. 7 (calibration)",
    ];
    b.b.mechanism("camera-scale", &[scale], text, &["clock-rate", "buoyancy"]);
    let clock = b.shared(Role::ClockRate, "rate", "", [-0.05, 0.05], 0.005);
    let text = [
        "clock rate",
        "The camera's clock runs fast or slow.",
        "stated time = (1 + rate) true time, |rate| <= 0.05",
        "Olson 2010, doi:10.1109/IROS.2010.5650579 (clocks of sensors)",
    ];
    b.b.mechanism("clock-rate", &[clock], text, &["camera-scale", "buoyancy"]);
}

/// Effects that a height alone does not show: what acts within the plane of the picture, or in space.
fn along_ground(b: &mut Flying, setup: &Setup, drag: ParameterRef) {
    let space = setup.axes == Axes::Space;
    let (parameters, equation) = if setup.spin {
        let c = b.shared(Role::LiftCoefficient, "lift_coefficient", "", [-20.0, 20.0], 0.01);
        (vec![c], "a = c spin x v")
    } else {
        let lifts =
            [(Role::LiftX, "lift_x_per_s"), (Role::LiftY, "lift_y_per_s"), (Role::LiftZ, "lift_z_per_s")];
        let lift = lifts[setup.axes.spins()]
            .iter()
            .map(|(r, n)| b.shared(*r, n, "1/s", [-20.0, 20.0], 0.1))
            .collect();
        (lift, "a = lift x v")
    };
    let text = [
        "Magnus lift",
        "A spinning ball is pushed across its path.",
        equation,
        "Mehta 1985, doi:10.1146/annurev.fl.17.010185.001055",
    ];
    b.b.mechanism("magnus-lift", &parameters, text, &["wind", "camera-tilt"]);
    let mut winds = vec![b.shared(Role::WindX, "wind_x_m_s", "m/s", [-40.0, 40.0], 2.0)];
    winds.extend(space.then(|| b.shared(Role::WindY, "wind_y_m_s", "m/s", [-40.0, 40.0], 2.0)));
    let text = [
        "wind",
        "The air moves; it acts through drag.",
        "u = v - w in every drag",
        "Clift, Grace and Weber 1978, Bubbles, Drops, and Particles",
    ];
    let wind = b.b.mechanism("wind", &winds, text, &["quadratic-drag", "magnus-lift", "camera-tilt"]);
    wind.companions = vec![drag.index];
    wind.companions_unless = vec!["quadratic-drag".into(), "linear-drag".into()];
    let tx = space.then(|| b.shared(Role::TiltX, "about_x_rad", "rad", [-0.5, 0.5], 0.01));
    let ty = b.shared(Role::TiltY, "about_y_rad", "rad", [-0.5, 0.5], 0.01);
    let tilts: Vec<ParameterRef> = tx.into_iter().chain([ty]).collect();
    let text = [
        "camera tilt",
        "The camera's vertical is not gravity's.",
        "measured = R_y(about_y) R_x(about_x) true",
        "Hartley and Zisserman 2004, doi:10.1017/CBO9780511811685, ch. 2",
    ];
    let tilt = b.b.mechanism("camera-tilt", &tilts, text, &["wind", "magnus-lift"]);
    tilt.derived.push(Derived {
        name: "angle_rad".into(),
        unit: "rad".into(),
        value: Arc::new(move |shared| tilts.iter().map(|t| shared[t.slot].powi(2)).sum::<f64>().sqrt()),
    });
}
