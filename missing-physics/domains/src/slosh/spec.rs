//! The parameters and mechanisms of a decaying wave.

use std::sync::Arc;

use liquid_haptics::slosh::{Decay, Effects, UprightCylinder};
use missing_physics::model::{Derived, DerivedPerRun, Over, ParameterRef, Spec, SpecBuilder, UNBOUNDED};

use super::setup::Setup;

/// Where each parameter stands.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Layout {
    pub(super) viscosity: ParameterRef,
    pub(super) tension: ParameterRef,
    pub(super) frequency: ParameterRef,
    pub(super) friction: ParameterRef,
    pub(super) quadratic: ParameterRef,
    pub(super) second_omega: ParameterRef,
    pub(super) second_damping: ParameterRef,
    pub(super) arm_omega: ParameterRef,
    pub(super) arm_damping: ParameterRef,
    pub(super) lag: ParameterRef,
    pub(super) cos: ParameterRef,
    pub(super) sin: ParameterRef,
    /// What the sensor reads at rest.
    pub(super) zero: ParameterRef,
    pub(super) second_cos: ParameterRef,
    pub(super) second_sin: ParameterRef,
    pub(super) arm_cos: ParameterRef,
    pub(super) arm_sin: ParameterRef,
    /// How much more liquid is in the container than recorded, as a part of that.
    pub(super) fill: ParameterRef,
    pub(super) transient: ParameterRef,
}

/// Where the second mode's frequency may lie, rad/s: surface tension raises it above that of gravity alone.
pub(super) fn second_band(cylinder: &UprightCylinder) -> [f64; 2] {
    let omega = cylinder.angular_frequency_rad_s(1, 0.0);
    [0.97 * omega, 1.06 * omega]
}

/// The smallest viscosity that is looked for, m^2/s.
const THINNEST_M2_S: f64 = 1e-12;

/// A typical amplitude of what is added to the first mode, as a share of the largest of that mode.
const SMALL: f64 = 0.1;

/// Bounds of the arm's frequency, rad/s.
pub(super) const ARM_RAD_S: [f64; 2] = [1.0, 1000.0];

/// What all parameters are scaled by.
struct Wave<'a> {
    cylinder: &'a UprightCylinder,
    /// Frequency of the first mode, rad/s.
    omega: f64,
    /// The largest amplitude with which a run begins, in the reading's unit.
    largest: f64,
    /// The reading's unit, and that as a suffix of names.
    unit: &'static str,
    suffix: &'static str,
}

/// All parameters, and where each stands: amplitudes and viscosity start from what the runs show.
pub(super) fn build(
    setup: &Setup,
    cylinder: &UprightCylinder,
    largest: f64,
    viscosity: f64,
) -> (Spec, Layout) {
    let mut b = SpecBuilder::default();
    let mut p = Layout::default();
    let (unit, suffix) = (setup.channel.unit(), setup.channel.suffix());
    let wave = Wave { cylinder, omega: cylinder.angular_frequency_rad_s(0, 0.0), largest, unit, suffix };
    b.baseline("the first antisymmetric mode of an upright cylinder with linear viscous damping; every run has its own amplitude and phase, and its sensor a zero of its own");
    let thickest = cylinder.kinematic_viscosity_m2_s(0.9);
    p.viscosity = b.shared(
        "kinematic_viscosity_m2_s",
        "m^2/s",
        viscosity.min(thickest).max(THINNEST_M2_S),
        [THINNEST_M2_S, thickest],
        viscosity,
    );
    p.cos = b.nuisance(&format!("cos_{suffix}"), unit, UNBOUNDED, largest);
    p.sin = b.nuisance(&format!("sin_{suffix}"), unit, UNBOUNDED, largest);
    p.zero = b.nuisance(&format!("zero_{suffix}"), unit, UNBOUNDED, SMALL * largest);
    surface_tension(&mut b, &mut p, setup.density_kg_m3);
    nonlinear_frequency(&mut b, &mut p, &wave);
    damping(&mut b, &mut p, &wave);
    // The sensor's parameters stand before those of the modes, its mechanism behind theirs.
    sensor_parameters(&mut b, &mut p, &wave);
    modes(&mut b, &mut p, &wave);
    sensor_lag(&mut b, &p);
    unlagged(&mut b, &p, &wave);
    fill(&mut b, &mut p);
    (b.build_unchecked(), p)
}

/// A fill that is not what was recorded, in each run by another part.
fn fill(b: &mut SpecBuilder, p: &mut Layout) {
    p.fill = b.nuisance("fill_change", "", [-0.5, 0.5], 0.02);
    b.between_runs(
        "fill-by-run",
        &[p.fill],
        [
            "a fill that differs from run to run",
            "Liquid leaks, evaporates, is spilt or was measured roughly.",
            "h -> h (1 + change of the run)",
            "Ibrahim 2005, Liquid Sloshing Dynamics, doi:10.1017/CBO9780511536656, ch. 1",
        ],
        &["nonlinear-frequency", "surface-tension"],
    );
}

/// The surface's tension.
fn surface_tension(b: &mut SpecBuilder, p: &mut Layout, density_kg_m3: f64) {
    // Liquids near room temperature have 0.015 to 0.073 N/m, liquid metals up to 0.6.
    let strongest = if density_kg_m3 > 5000.0 { 0.7 } else { 0.09 };
    p.tension = b.shared("surface_tension_n_m", "N/m", 0.0, [0.0, strongest], 0.03);
    b.mechanism(
        "surface-tension",
        &[p.tension],
        [
            "surface tension",
            "The surface's tension stiffens the wave, more so in narrow containers.",
            "omega^2 = (g k + sigma k^3 / rho) tanh(k h), k = 1.841 / R",
            "Ibrahim 2005, Liquid Sloshing Dynamics, doi:10.1017/CBO9780511536656, ch. 1",
        ],
        &["nonlinear-frequency"],
    );
}

/// A frequency that depends on the amplitude.
fn nonlinear_frequency(b: &mut SpecBuilder, p: &mut Layout, wave: &Wave<'_>) {
    let &Wave { omega, largest, unit, suffix, .. } = wave;
    let square = largest * largest;
    p.frequency = b.shared(
        &format!("coefficient_per_{suffix}2"),
        &format!("1/({unit})^2"),
        0.0,
        [-0.3 / square, 0.3 / square],
        0.01 / square,
    );
    let mechanism = b.mechanism(
        "nonlinear-frequency",
        &[p.frequency],
        [
            "frequency that depends on the amplitude",
            "High waves are slower or faster than low ones.",
            "omega (1 + c A^2 / A_max^2), A_max the largest amplitude of a run",
            "Miles 1984, doi:10.1017/S0022112084002834",
        ],
        &["surface-tension"],
    );
    // The start says how high the wave is only together with the spring: the change is that of its motion.
    let (cos, sin, frequency) = (p.cos.slot, p.sin.slot, p.frequency.slot);
    let shift = move |shared: &[f64], nuisance: &[f64]| {
        let effects =
            Effects { frequency_change: shared[frequency], largest_amplitude: 1.0, ..Effects::default() };
        Decay { omega_rad_s: omega, damping_ratio: 0.0, effects }
            .frequency_shift([nuisance[cos], nuisance[sin]])
    };
    mechanism.derived_per_run = vec![DerivedPerRun {
        name: "coefficient".into(),
        unit: String::new(),
        over: Over::Largest,
        value: Arc::new(shift),
    }];
}

/// What takes from the wave beside viscosity: friction of the contact line, and eddies.
fn damping(b: &mut SpecBuilder, p: &mut Layout, wave: &Wave<'_>) {
    /// A typical friction, as a share of the largest amplitude.
    const TYPICAL: f64 = 0.02;
    let &Wave { largest, unit, suffix, .. } = wave;
    p.friction = b.shared(&format!("friction_{suffix}"), unit, 0.0, [0.0, largest], TYPICAL * largest);
    b.mechanism(
        "contact-line-friction",
        &[p.friction],
        [
            "friction of the contact line",
            "The edge of the surface sticks to the wall: the amplitude falls in a straight line and stops.",
            "x'' + 2 gamma omega x' + omega^2 (x + f sign x') = 0; a cycle loses 4 f",
            "Hocking 1987, doi:10.1017/S0022112087001514; Cocciaro, Faetti and Festa 1993, doi:10.1017/S0022112093000035",
        ],
        &["quadratic-damping"],
    );
    p.quadratic = b.shared(
        &format!("coefficient_per_{suffix}"),
        &format!("1/({unit})"),
        0.0,
        [0.0, 10.0 / largest],
        0.02 / largest,
    );
    b.mechanism(
        "quadratic-damping",
        &[p.quadratic],
        [
            "quadratic damping",
            "Eddies and breaking take more from high waves than from low ones.",
            "x'' + 2 gamma omega x' + c |x'| x' + omega^2 x = 0",
            "Faltinsen and Timokha 2009, Sloshing, ISBN 978-0-521-88111-1, ch. 6",
        ],
        &["contact-line-friction"],
    );
}

/// The sensor's time constant, and what is left of its reading at the start of each run.
fn sensor_parameters(b: &mut SpecBuilder, p: &mut Layout, wave: &Wave<'_>) {
    let &Wave { omega, largest, unit, suffix, .. } = wave;
    // A sensor that follows more slowly than the wave swings shows next to nothing of it.
    let period = std::f64::consts::TAU / omega;
    p.lag = b.shared("tau_s", "s", 1.0 / omega, [1e-3 * period, period], 1.0 / omega);
    p.transient = b.nuisance(&format!("transient_{suffix}"), unit, UNBOUNDED, SMALL * largest);
}

/// The sensor that follows with a delay.
fn sensor_lag(b: &mut SpecBuilder, p: &Layout) {
    let mechanism = b.mechanism(
        "sensor-lag",
        &[p.lag],
        [
            "lag of the sensor",
            "The sensor follows the load with a delay; what is left of its reading at t = 0 dies away.",
            "tau y' + y = x: the same mode at another amplitude and phase, plus c exp(-t / tau)",
            "Doebelin 2003, Measurement Systems, ISBN 978-0-07-243886-3, ch. 3",
        ],
        &["arm-compliance"],
    );
    mechanism.companions = vec![p.transient.index];
    mechanism.shape_parameters = vec![p.lag.index];
}

/// What a reading is of the wave itself: a sensor that lags, where it does, shows less of it.
fn unlagged(b: &mut SpecBuilder, p: &Layout, wave: &Wave<'_>) {
    let &Wave { omega, unit, suffix, .. } = wave;
    let off = b.so_far().parameters[p.lag.index].start;
    for (id, name, unit, at, power) in [
        ("contact-line-friction", format!("friction_{suffix}"), unit.to_owned(), p.friction, 1),
        ("quadratic-damping", format!("coefficient_per_{suffix}"), format!("1/({unit})"), p.quadratic, -1),
    ] {
        let (at, lag) = (at.slot, p.lag.slot);
        let value = move |shared: &[f64]| {
            let lags = if shared[lag] == off { 0.0 } else { omega * shared[lag] };
            shared[at] * lags.hypot(1.0).powi(power)
        };
        if let Some(mechanism) = b.mechanism_mut(id) {
            mechanism.derived.push(Derived { name, unit, value: Arc::new(value) });
        }
    }
}

/// Other oscillations than the first mode: the second one, and the arm's.
fn modes(b: &mut SpecBuilder, p: &mut Layout, wave: &Wave<'_>) {
    let &Wave { cylinder, largest, unit, suffix, .. } = wave;
    let amplitude = SMALL * largest;
    let [low, high] = second_band(cylinder);
    p.second_omega =
        b.shared("omega_rad_s", "rad/s", cylinder.angular_frequency_rad_s(1, 0.0), [low, high], 0.3);
    p.second_damping = b.shared("damping_ratio", "", 0.01, [1e-4, 0.5], 0.01);
    p.second_cos = b.nuisance(&format!("second_cos_{suffix}"), unit, UNBOUNDED, amplitude);
    p.second_sin = b.nuisance(&format!("second_sin_{suffix}"), unit, UNBOUNDED, amplitude);
    let second = b.mechanism(
        "second-mode",
        &[p.second_omega, p.second_damping],
        [
            "second slosh mode",
            "A second antisymmetric wave is on the surface, at the frequency that theory gives it.",
            "+ A2 exp(-gamma2 omega2 t) cos(omega2 t + phi2), omega2^2 = g k2 tanh(k2 h), k2 = 5.331 / R",
            "Ibrahim 2005, Liquid Sloshing Dynamics, doi:10.1017/CBO9780511536656, ch. 1",
        ],
        &["arm-compliance", "sensor-lag"],
    );
    second.companions = vec![p.second_cos.index, p.second_sin.index];
    second.derived_per_run =
        vec![amplitude_of(p, [p.second_omega, p.second_cos, p.second_sin], suffix, unit)];
    second.shape_parameters = vec![p.second_omega.index, p.second_damping.index];
    p.arm_omega = b.shared("omega_rad_s", "rad/s", 40.0, ARM_RAD_S, 1.0);
    p.arm_damping = b.shared("damping_ratio", "", 0.01, [1e-4, 0.9], 0.01);
    p.arm_cos = b.nuisance(&format!("arm_cos_{suffix}"), unit, UNBOUNDED, amplitude);
    p.arm_sin = b.nuisance(&format!("arm_sin_{suffix}"), unit, UNBOUNDED, amplitude);
    let arm = b.mechanism(
        "arm-compliance",
        &[p.arm_omega, p.arm_damping],
        [
            "compliance of the arm",
            "Arm and gripper ring at a frequency of their own.",
            "+ A exp(-gamma omega t) cos(omega t + phi)",
            "Siciliano et al. 2009, Robotics, doi:10.1007/978-1-84628-642-1, ch. 7",
        ],
        &["second-mode"],
    );
    arm.companions = vec![p.arm_cos.index, p.arm_sin.index];
    arm.derived_per_run = vec![amplitude_of(p, [p.arm_omega, p.arm_cos, p.arm_sin], suffix, unit)];
    arm.shape_parameters = vec![p.arm_omega.index, p.arm_damping.index];
}

/// The amplitude at t = 0 of a wave that each run has in two parts. A sensor that lags (its reading has a transient) shows less of it.
fn amplitude_of(p: &Layout, [omega, cos, sin]: [ParameterRef; 3], suffix: &str, unit: &str) -> DerivedPerRun {
    let (omega, cos, sin, lag, transient) = (omega.slot, cos.slot, sin.slot, p.lag.slot, p.transient.slot);
    DerivedPerRun {
        name: format!("amplitude_{suffix}"),
        unit: unit.into(),
        over: Over::Mean,
        value: Arc::new(move |shared, nuisance| {
            let lags = if nuisance[transient] == 0.0 { 0.0 } else { shared[omega] * shared[lag] };
            nuisance[cos].hypot(nuisance[sin]) * lags.hypot(1.0)
        }),
    }
}

#[cfg(test)]
mod tests;
