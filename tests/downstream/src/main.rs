//! A fingertip is pressed into a pad of gel: a load cell behind `hw-traits`, the gel's modulus from `hertz-contact`, and what the model of
//! a bottomless pad leaves out from `missing-physics`.

mod cell;
mod pad;

use std::process::ExitCode;

use cell::LoadCell;
use hertz_contact::fit::{Curve, Fit, FitError, Loss, Workspace};
use hertz_contact::indenter::Indenter;
use hertz_contact::law::LawError;
use hw_traits::force_torque::ForceTorque;
use hw_traits::{Error as _, ErrorKind};
use missing_physics::data::{Recording, Run};
use missing_physics::engine::{DiagnoseError, Options, diagnose};
use missing_physics::model::{Quantity, SpecError};
use missing_physics::observer::Silent;

const FINGERTIP: Indenter = Indenter::Sphere { radius_m: 0.01 };
const POISSON_RATIO: f64 = 0.5;

/// Why a press could not be judged.
#[derive(Debug, PartialEq)]
enum Failure {
    /// The cell is lost or the press was too hard: somebody has to look at the rig.
    Rig(ErrorKind),
    /// The fingertip met nothing.
    Air,
    /// The fit or the diagnosis says what is wrong with the data.
    Data(String),
}

impl From<FitError> for Failure {
    fn from(error: FitError) -> Self {
        match error {
            FitError::NoContact { .. } => Self::Air,
            other => Self::Data(other.to_string()),
        }
    }
}

impl From<DiagnoseError> for Failure {
    fn from(error: DiagnoseError) -> Self {
        match error {
            DiagnoseError::TooFewRows { rows, .. } => Self::Data(format!("press longer: {rows} readings")),
            other => Self::Data(other.to_string()),
        }
    }
}

impl From<LawError> for Failure {
    fn from(error: LawError) -> Self {
        Self::Data(error.to_string())
    }
}

impl From<SpecError> for Failure {
    fn from(error: SpecError) -> Self {
        Self::Data(error.to_string())
    }
}

/// Reads the force at each depth; a reading that the link lost is asked for again.
fn press(cell: &mut impl ForceTorque, depths_m: &[f64]) -> Result<Vec<f64>, Failure> {
    let mut read = || {
        let mut lost = 0;
        loop {
            match cell.read() {
                Ok(reading) => return Ok(reading.value.force_n[2]),
                Err(error) => match error.kind() {
                    ErrorKind::Link | ErrorKind::Timeout if lost < 3 => lost += 1,
                    kind => return Err(Failure::Rig(kind)),
                },
            }
        }
    };
    depths_m.iter().map(|_| read()).collect()
}

/// The modulus in Pa and its interval.
fn modulus(depths_m: &[f64], forces_n: &[f64]) -> Result<(f64, (f64, f64)), Failure> {
    let fit = Fit { loss: Loss::Square, ..Fit::new(FINGERTIP, POISSON_RATIO) };
    let curve = Curve { indentation_m: depths_m, force_n: forces_n, sigma_n: None };
    let report = fit.run(&[curve], &mut Workspace::new())?;
    Ok((report.modulus_pa, report.modulus_interval_pa))
}

/// The verdict on several presses, and the mechanisms that explain them.
fn missing(depths_m: &[f64], presses: Vec<Vec<f64>>) -> Result<(String, Vec<String>), Failure> {
    let run = |(i, forces_n): (usize, Vec<f64>)| Run {
        label: i.to_string(),
        inputs: vec![depths_m.to_vec()],
        outputs: vec![forces_n],
        kind: 0,
    };
    let recording = Recording {
        channels: vec![Quantity::new("force_n", "N")],
        variables: vec![Quantity::new("depth_m", "m")],
        runs: presses.into_iter().enumerate().map(run).collect(),
        noise_along: Some(0),
        calibration: vec![None],
        resolution: vec![0.0],
    };
    let options = Options { replicates: 99, ..Options::default() };
    let answer = diagnose(&pad::Pad::new(pad::glued()?)?, &recording, &[], &options, &Silent)?;
    Ok((answer.verdict.word().to_owned(), answer.chosen))
}

fn run() -> Result<(), Failure> {
    let depths_m: Vec<f64> = (0..60).map(|i| 2e-5 * f64::from(i)).collect();

    let layer = pad::glued()?;
    let gel = LoadCell::over(pad::pad(&layer, 20e3, 0.0));
    let forces_n = press(&mut gel.clone(), &depths_m)?;
    let (pascal, (low, high)) = modulus(&depths_m, &forces_n)?;
    println!("modulus {:.1} kPa (95 %: {:.1} to {:.1} kPa)", pascal / 1e3, low / 1e3, high / 1e3);
    assert!(low < 20e3 && 20e3 < high);

    // What can go wrong, by variant.
    assert_eq!(press(&mut gel.clone().unplugged(), &depths_m), Err(Failure::Rig(ErrorKind::Link)));
    assert_eq!(
        press(&mut LoadCell::over(pad::pad(&layer, 2e6, 0.0)), &depths_m),
        Err(Failure::Rig(ErrorKind::Saturated))
    );
    let air = press(&mut LoadCell::over(pad::pad(&layer, 0.0, 0.0)), &depths_m)?;
    assert_eq!(modulus(&depths_m, &air), Err(Failure::Air));
    assert!(matches!(missing(&depths_m[..1], vec![vec![0.0]]), Err(Failure::Data(_))));

    // A thick pad is as the model says; of a thin one the table shows.
    for (inverse_thickness_per_m, expected) in [(0.0, "adequate"), (50.0, "explained")] {
        let mut cell = LoadCell::over(pad::pad(&layer, 20e3, inverse_thickness_per_m));
        let presses = (0..3).map(|_| press(&mut cell, &depths_m)).collect::<Result<_, _>>()?;
        let (verdict, mechanisms) = missing(&depths_m, presses)?;
        println!("1/thickness {inverse_thickness_per_m} 1/m: {verdict} {mechanisms:?}");
        assert_eq!(verdict, expected);
        assert_eq!(mechanisms, if expected == "explained" { vec!["thin-pad"] } else { vec![] });
    }
    Ok(())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("{failure:?}");
            ExitCode::FAILURE
        }
    }
}
