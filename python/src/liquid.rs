//! Liquids in a cylinder: what poses say of the volume, and what to tilt for a pour.

use liquid_haptics::container::Cylinder;
use liquid_haptics::pour::{Bead, Mouth, Pour};
use liquid_haptics::volume::{
    Candidate, Cause, ErrorCorrelation, ForceGain, Liquid, MassFit, SettledPose, Verdict, VolumeFit, fit_mass,
};
use liquid_haptics::wrench::{Departures, Grasp, PlanarWrench};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::{array, column};
use crate::errors::refused;

/// Outer radius, outer length and wall, m.
type Sizes = (f64, f64, f64);
/// Masses of container and gripper (kg), heights of the grasp and of the shell's centre (m), gravity (m/s^2).
type Held = (f64, f64, f64, f64, f64);

fn cylinder((radius_m, length_m, wall_m): Sizes) -> PyResult<Cylinder> {
    Cylinder::new(radius_m, length_m, wall_m).map_err(refused)
}

fn grasp((container_mass_kg, gripper_mass_kg, grasp_height_m, shell_center_m, gravity_m_s2): Held) -> Grasp {
    Grasp { container_mass_kg, gripper_mass_kg, grasp_height_m, shell_center_m, gravity_m_s2 }
}

/// What a wrist reads at tilts (rad) of a mass (kg) and a volume (m^3) of liquid: forces (N) and torque (N m), one column each.
#[pyfunction]
pub(crate) fn liquid_wrench<'py>(
    py: Python<'py>,
    sizes: Sizes,
    held: Held,
    tilt_rad: &Bound<'py, PyAny>,
    mass_kg: f64,
    volume_m3: f64,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let (cylinder, grasp) = (cylinder(sizes)?, grasp(held));
    let tilts = column(tilt_rad, "tilt_rad")?;
    let read = tilts
        .iter()
        .map(|&tilt| {
            grasp.wrench(&cylinder, tilt, mass_kg, volume_m3, &Departures::default()).map_err(refused)
        })
        .collect::<PyResult<Vec<PlanarWrench>>>()?;
    let of =
        |part: fn(&PlanarWrench) -> f64| array(py, &read.iter().map(part).collect::<Vec<f64>>()).into_any();
    Ok(vec![of(|w| w.fx_n), of(|w| w.fy_n), of(|w| w.tau_z_nm)])
}

/// The volume behind settled poses, columns of tilt (rad), forces (N) and torque (N m); the mass (kg) with its error is taken from the
/// forces where neither it nor the density (kg/m^3) is given. `steps` above 0: also the tilt to go to next, of so many.
#[pyfunction]
#[pyo3(signature = (sizes, held, poses, mass_kg, density_kg_m3, sigma_nm, steps))]
#[expect(clippy::too_many_arguments, reason = "names are given by the package")]
pub(crate) fn liquid_volume<'py>(
    py: Python<'py>,
    sizes: Sizes,
    held: Held,
    poses: Vec<(String, Bound<'py, PyAny>)>,
    mass_kg: Option<(f64, f64)>,
    density_kg_m3: Option<f64>,
    sigma_nm: Option<f64>,
    steps: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let (container, grasp) = (cylinder(sizes)?, grasp(held));
    let columns = poses.iter().map(|(name, values)| column(values, name)).collect::<PyResult<Vec<_>>>()?;
    let [tilts, across, along, torques] = columns.as_slice() else {
        return Err(refused(format!("{} columns, expected 4", columns.len())));
    };
    if columns.iter().any(|column| column.len() != tilts.len()) {
        return Err(refused("the columns of the poses have not one length"));
    }
    let poses: Vec<SettledPose> = (0..tilts.len())
        .map(|k| SettledPose {
            tilt_rad: tilts[k],
            wrench: PlanarWrench { fx_n: across[k], fy_n: along[k], tau_z_nm: torques[k] },
        })
        .collect();
    let said = PyDict::new(py);
    let liquid = match (mass_kg, density_kg_m3) {
        (None, Some(density)) => Liquid::Density(density),
        (Some((mass_kg, error_kg)), None) => Liquid::Mass { mass_kg, error_kg },
        (Some((mass_kg, error_kg)), Some(density_kg_m3)) => {
            Liquid::MassAndDensity { mass_kg, error_kg, density_kg_m3 }
        }
        (None, None) => {
            let forces = MassFit { gain: ForceGain::Known(0.0), offsets: false, sigma_n: None };
            Liquid::from(&fit_mass(&grasp, &poses, &forces).map_err(refused)?)
        }
    };
    let (estimate, next) = py
        .detach(|| {
            let fit = VolumeFit {
                container: &container,
                grasp,
                departures: Departures::default(),
                liquid,
                sigma_nm,
                error_correlation: ErrorCorrelation::NONE,
                widest_share: 0.5,
            };
            let estimate = fit.estimate(&poses)?;
            let next = (steps > 0).then(|| fit.next_tilt(&poses, &estimate, steps)).transpose()?;
            Ok::<_, liquid_haptics::volume::VolumeError>((estimate, next))
        })
        .map_err(refused)?;
    said.set_item("volume_m3", estimate.volume_m3)?;
    said.set_item("ci95_m3", (estimate.interval_m3[0], estimate.interval_m3[1]))?;
    said.set_item("mass_kg", estimate.mass_kg)?;
    said.set_item("sigma_nm", estimate.sigma_nm)?;
    said.set_item("misfit_p", estimate.misfit_p)?;
    let (verdict, candidates) = words(&estimate.verdict);
    said.set_item("verdict", verdict)?;
    let stretches = candidates.iter().map(|c| (c.volume_m3, (c.interval_m3[0], c.interval_m3[1])));
    said.set_item("candidates", stretches.collect::<Vec<_>>())?;
    said.set_item("next_tilt_rad", next.map(|next| next.tilt_rad))?;
    Ok(said)
}

/// A verdict in a word, and the volumes that it leaves open.
fn words(verdict: &Verdict) -> (&'static str, &[Candidate]) {
    match verdict {
        Verdict::Determined => ("determined", &[]),
        Verdict::Empty => ("empty", &[]),
        Verdict::Full => ("full", &[]),
        Verdict::Misfit => ("misfit", &[]),
        Verdict::Undetermined { cause, candidates } => {
            let cause = match cause {
                Cause::Flat => "flat",
                Cause::AlikePoses => "alike-poses",
                Cause::SeveralVolumes => "several-volumes",
            };
            (cause, candidates)
        }
    }
}

/// How to pour a volume (m^3) of what is inside over the rim: the tilt at which it has left, the tilt at which the bead breaks, the least and
/// the most that leave, and the rate of tilting at the end for a flow (m^3/s).
#[pyfunction]
#[pyo3(signature = (sizes, inside_m3, wanted_m3, bead_m, steepest_rad, flow_m3_s))]
pub(crate) fn liquid_pour(
    sizes: Sizes,
    inside_m3: f64,
    wanted_m3: f64,
    bead_m: (f64, f64),
    steepest_rad: f64,
    flow_m3_s: Option<f64>,
) -> PyResult<(f64, f64, f64, f64, Option<f64>)> {
    let cylinder = cylinder(sizes)?;
    let bead = Bead::measured(bead_m.0, bead_m.1).map_err(refused)?;
    let pour = Pour::new(&cylinder, Mouth::of_cylinder(&cylinder), bead, steepest_rad).map_err(refused)?;
    let tilt_rad = pour.tilt_rad(inside_m3, wanted_m3).map_err(refused)?;
    let pourable = pour.pourable(inside_m3).map_err(refused)?;
    let rate = flow_m3_s.map(|flow| pour.tilt_rate_rad_s(tilt_rad, flow)).transpose().map_err(refused)?;
    Ok((tilt_rad, pourable.start_tilt_rad, pourable.least_m3, pourable.most_m3, rate))
}
