//! Parameters and mechanisms of a tilt sweep.

use missing_physics::model::{ParameterRef, Spec, SpecBuilder};

use super::setup::Setup;

/// Where each parameter stands; `None` where it is known.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Layout {
    pub(super) thickness: ParameterRef,
    pub(super) gain: ParameterRef,
    pub(super) torque: ParameterRef,
    pub(super) angle: ParameterRef,
    pub(super) grasp: ParameterRef,
    pub(super) shift: ParameterRef,
    pub(super) slip: ParameterRef,
    pub(super) slip_row: ParameterRef,
    pub(super) drift: ParameterRef,
    pub(super) lag: ParameterRef,
    pub(super) mass: Option<ParameterRef>,
    pub(super) volume: Option<ParameterRef>,
    /// How much higher a run is held than the others.
    pub(super) held: ParameterRef,
    /// How much more liquid a run has than was measured, where that was, as a part of it.
    pub(super) fill: Option<ParameterRef>,
}

/// The specification of a set-up whose recording has the given number of rows.
pub(super) fn build(setup: &Setup, rows: usize) -> (Spec, Layout) {
    let mut b = SpecBuilder::default();
    let mut p = Layout::default();
    let (grasp, length) = (&setup.grasp, setup.vessel.length_m());
    let moment = grasp.gravity_m_s2 * (grasp.container_mass_kg + setup.vessel.capacity_m3() * 500.0) * length;
    b.baseline("the weight of gripper, container and liquid (eq. 2.1): walls of no thickness, a level surface, the shell's centre of mass in its middle");
    liquid(&mut b, &mut p, setup);
    wall(&mut b, &mut p, setup.vessel.thickest_m());
    sensor(&mut b, &mut p, moment);
    grip(&mut b, &mut p, length, rows);
    drift(&mut b, &mut p, moment, rows);
    surface(&mut b, &mut p);
    by_run(&mut b, &mut p, setup, length);
    (b.build_unchecked(), p)
}

/// Mass and volume of each run's liquid, as far as they are not known.
fn liquid(b: &mut SpecBuilder, p: &mut Layout, setup: &Setup) {
    let capacity = setup.vessel.capacity_m3();
    if !(setup.volumes_known && setup.density_kg_m3.is_some()) {
        let most = setup.density_kg_m3.map_or(30.0 * (capacity * 1e3), |d| d * capacity);
        p.mass = Some(b.nuisance("liquid_mass_kg", "kg", [0.0, most], capacity * 100.0));
    }
    if !setup.volumes_known && setup.density_kg_m3.is_none() {
        p.volume = Some(b.nuisance("volume_m3", "m^3", [0.0, capacity], 0.1 * capacity));
    }
}

/// What may differ from run to run: where the container is held, and how much is in it where that was measured.
fn by_run(b: &mut SpecBuilder, p: &mut Layout, setup: &Setup, length: f64) {
    p.held = b.nuisance("held_higher_m", "m", [-0.25 * length, 0.25 * length], 1e-3);
    b.between_runs(
        "grasp-by-run",
        &[p.held],
        [
            "a grip that differs from run to run",
            "The container is grasped anew, or slides between runs.",
            "L_g + change of the run",
            "[Matl 2021], section 2.6",
        ],
        &["grasp-offset", "grasp-slip"],
    );
    if !setup.volumes_known {
        return;
    }
    let fill = b.nuisance("fill_change", "", [-0.9, 1.0], 0.01);
    b.between_runs(
        "fill-by-run",
        &[fill],
        [
            "a fill that differs from run to run",
            "Liquid is spilt, evaporates or was measured roughly.",
            "V -> V (1 + change of the run)",
            "[Matl 2021], section 2.6",
        ],
        &["force-gain"],
    );
    p.fill = Some(fill);
}

/// A wall that is up to so thick, m.
fn wall(b: &mut SpecBuilder, p: &mut Layout, thickest_m: f64) {
    p.thickness = b.shared("thickness_m", "m", 0.0, [0.0, thickest_m], 1e-3);
    b.mechanism(
        "wall-thickness",
        &[p.thickness],
        [
            "thickness of the wall",
            "The container was measured outside; its cavity is smaller by the thickness of wall, base and lid.",
            "cavity radius R - t, length L - 2 t",
            "[Matl 2021], section 2.6 (the outer radius used for the inner one)",
        ],
        &["force-gain", "grasp-offset"],
    );
}

/// What the sensor may read wrong, and the angle at which the container stands; `moment` is that of the loaded container, N m.
fn sensor(b: &mut SpecBuilder, p: &mut Layout, moment: f64) {
    p.gain = b.shared("gain", "", 0.0, [-0.3, 0.3], 0.01);
    b.mechanism(
        "force-gain",
        &[p.gain],
        [
            "gain of the force sensor",
            "Forces read too high or too low in proportion; the torque does not.",
            "fx, fy times 1 + gain",
            "[Matl 2021], section 2.6 (recalibrated by linear regression)",
        ],
        &["wall-thickness", "grasp-offset"],
    );
    p.torque = b.shared("offset_nm", "N m", 0.0, [-moment, moment], 1e-3 * moment);
    b.mechanism(
        "torque-offset",
        &[p.torque],
        [
            "offset of the torque",
            "The torque reads a constant too much.",
            "tau_z + offset",
            "[Matl 2021], section 2.5 (offset removal)",
        ],
        &["angle-offset", "sensor-drift"],
    );
    p.angle = b.shared("angle_rad", "rad", 0.0, [-0.3, 0.3], 0.01);
    b.mechanism(
        "angle-offset",
        &[p.angle],
        [
            "offset of the angle",
            "The container is tilted by a constant more than stated.",
            "container's tilt = theta + angle; the sensor's axes keep to theta",
            "Siciliano et al. 2009, Robotics, doi:10.1007/978-1-84628-642-1, ch. 2",
        ],
        &["torque-offset", "surface-lag"],
    );
}

/// Where the container is held, and where its mass is; `length` is the container's, m.
fn grip(b: &mut SpecBuilder, p: &mut Layout, length: f64, rows: usize) {
    p.grasp = b.shared("offset_m", "m", 0.0, [-0.25 * length, 0.25 * length], 1e-3);
    b.mechanism(
        "grasp-offset",
        &[p.grasp],
        [
            "offset of the grasp",
            "The container is held higher than stated.",
            "L_g + offset",
            "[Matl 2021], eq. 2.1",
        ],
        &["cap-mass", "wall-thickness", "force-gain"],
    );
    p.shift = b.shared("shift_m", "m", 0.0, [-0.5 * length, 0.5 * length], 5e-3);
    b.mechanism(
        "cap-mass",
        &[p.shift],
        [
            "mass of the cap",
            "The empty container's centre of mass is off its middle.",
            "shell's centre of mass at L/2 + shift",
            "[Matl 2021], section 2.6",
        ],
        &["grasp-offset"],
    );
    p.slip = b.shared("slip_m", "m", 0.0, [-0.25 * length, 0.25 * length], 1e-3);
    p.slip_row = b.shared("row", "", -1.0, [-1.0, rows as f64], 1.0);
    let slip = b.mechanism(
        "grasp-slip",
        &[p.slip, p.slip_row],
        [
            "slip of the grasp",
            "At one pose the container slides in the gripper, and stays there to the end of the run.",
            "L_g + slip from that row on (rows of the file counted from 0)",
            "[Matl 2021], section 2.6",
        ],
        &["grasp-offset", "sensor-drift"],
    );
    slip.integer_parameters = vec![p.slip_row.index];
}

/// A torque that drifts over the rows of the file.
fn drift(b: &mut SpecBuilder, p: &mut Layout, moment: f64, rows: usize) {
    p.drift =
        b.shared("rate_nm_per_row", "N m", 0.0, [-moment, moment], 0.3 * moment / rows.max(1) as f64 * 1e-2);
    b.mechanism(
        "sensor-drift",
        &[p.drift],
        [
            "drift of the sensor",
            "The torque's offset grows from row to row over the whole file.",
            "tau_z + rate row",
            "ATI Industrial Automation, F/T sensor manual (drift with temperature)",
        ],
        &["torque-offset"],
    );
}

/// A surface that has not settled.
fn surface(b: &mut SpecBuilder, p: &mut Layout) {
    p.lag = b.shared("angle_rad", "rad", 0.0, [-0.5, 0.5], 0.01);
    b.mechanism(
        "surface-lag",
        &[p.lag],
        [
            "lag of the surface",
            "The surface has not settled: it rests at an angle to level.",
            "the surface stands as at theta - angle",
            "[Matl 2021], section 2.4 (a thick liquid takes its time)",
        ],
        &["angle-offset"],
    );
}
