//! The reactive grasp on the fake, and the box at slip.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use hw_traits::camera::Camera;
use hw_traits::clock::Stamped;
use hw_traits::picture::Picture;
use hw_traits::pneumatics::{Pressure, Valve};
use hw_traits::{ErrorKind, ErrorType};
use softcell::fake::{Bench, FakeError};
use softcell::grasp::{Grasp, GraspError, GraspSettings};

fn grasp(settings: GraspSettings) -> Grasp {
    Grasp::new::<FakeError>(settings).unwrap()
}

#[test]
fn the_pressure_goes_where_it_is_wanted_and_stays() {
    let mut bench = Bench::matl_2021(3);
    let mut grasp = grasp(GraspSettings { start_pa: 2000.0, ..GraspSettings::default() });
    let turns: Vec<_> = (0..150).map(|_| grasp.turn(&mut bench).unwrap()).collect();
    for t in &turns[90..] {
        assert!((t.pressure_pa - 2000.0).abs() < 100.0, "{t:?}");
    }
    assert!(turns.iter().all(|t| !t.shear), "no shear where nothing is poured in");
}

/// Figure 5.8's demonstration: beads are poured in, the tip answers each shear, the box stays.
#[test]
fn a_box_that_grows_heavier_is_held() {
    let run = |step_pa: f64| {
        let mut bench = Bench::matl_2021(4);
        bench.pour_kg_s = 12e-3;
        let mut grasp = grasp(GraspSettings { step_pa, ..GraspSettings::default() });
        let mut shears = 0;
        while bench.mass_kg < 0.2102 && bench.touch.shear_m[1] < 0.02 {
            let turn = grasp.turn(&mut bench).unwrap();
            shears += u32::from(turn.shear);
            assert!(turn.wanted_pa <= 4000.0);
        }
        (bench.touch.shear_m[1], shears, grasp.wanted_pa())
    };
    let (slid, shears, wanted) = run(500.0);
    let (slid_without, _, _) = run(1e-6);
    println!(
        "slid {:.1} mm in {shears} shears to {wanted} Pa; without pressure {:.1} mm",
        1e3 * slid,
        1e3 * slid_without
    );
    assert!(shears >= 3 && (1500.0..=4000.0).contains(&wanted), "{shears} {wanted}");
    assert!(slid < 0.5 * slid_without, "{slid} {slid_without}");
}

/// A rig whose parts fail when told to.
struct Faulty {
    bench: Bench,
    camera: bool,
    pressure_pa: Option<f64>,
    last: f64,
}

#[derive(Debug, PartialEq)]
struct Broken;

impl hw_traits::Error for Broken {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Link
    }
}

impl ErrorType for Faulty {
    type Error = Broken;
}

impl Camera for Faulty {
    fn picture(&mut self) -> Result<Stamped<Picture<u8>>, Broken> {
        if self.camera { self.bench.picture().map_err(|_| Broken) } else { Err(Broken) }
    }
}

impl Pressure for Faulty {
    fn pressure_pa(&mut self) -> Result<Stamped<f64>, Broken> {
        let real = self.bench.pressure_pa().map_err(|_| Broken)?;
        Ok(Stamped { value: self.pressure_pa.unwrap_or(real.value), ..real })
    }
}

impl Valve for Faulty {
    fn open(&mut self, fraction: f64) -> Result<(), Broken> {
        self.last = fraction;
        self.bench.open(fraction).map_err(|_| Broken)
    }
}

#[test]
fn a_failure_closes_the_valve_and_too_much_pressure_lets_air_out() {
    let mut rig = Faulty { bench: Bench::matl_2021(5), camera: true, pressure_pa: None, last: 9.0 };
    let settings = GraspSettings { start_pa: 3000.0, ..GraspSettings::default() };
    let mut grasp = Grasp::new::<Broken>(settings).unwrap();
    grasp.turn(&mut rig).unwrap();
    assert!(rig.last > 0.5);
    rig.camera = false;
    assert!(matches!(grasp.turn(&mut rig), Err(GraspError::Device(Broken, ErrorKind::Link))));
    assert_eq!(rig.last, 0.0);
    rig.camera = true;
    for pressure in [4500.0, f64::NAN] {
        rig.pressure_pa = Some(pressure);
        assert!(matches!(grasp.turn(&mut rig), Err(GraspError::OverPressure { .. })));
        assert_eq!(rig.last, -1.0);
    }
    rig.pressure_pa = None;
    grasp.turn(&mut rig).unwrap();
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let default = GraspSettings::default();
    for settings in [
        GraspSettings { step_pa: 0.0, ..default },
        GraspSettings { sigma_px: f64::NAN, ..default },
        GraspSettings { start_pa: 5000.0, ..default },
        GraspSettings { limit_pa: -1.0, ..default },
    ] {
        assert!(matches!(Grasp::new::<Broken>(settings), Err(GraspError::Setting { .. })), "{settings:?}");
    }
}
