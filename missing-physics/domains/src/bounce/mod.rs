//! The domain `bounce`: a ball on a table, as its impacts were heard.
//!
//! An impact is judged by the flights before and after it. These share measured times and places with the neighbouring
//! impacts', so the errors of a drop are tied; they are taken apart by their own covariance before the engine sees them.

mod array;
mod assemble;
mod chance;
mod drop;
mod effects;
mod expected;
mod experiments;
mod figure;
mod local;
mod model;
mod read;
mod rows;
mod setup;
mod sound;
mod spec;
mod spread;
mod times;
mod weights;

use missing_physics::model::Spec;

use self::array::Microphones;
use self::assemble::Drops;
use self::read::{Rig, heard};
use self::setup::Setup;
use self::spread::Calibration;
use crate::domain::{CheckedRecording, Domain, Template};
use crate::plausible;
use crate::reading::{GRAVITY_M_S2, number};
use crate::recording::{Column, Header, ReadError};

const COLUMNS: [Column; 5] = [
    Column { name: "run", what: "label of the run", label: true },
    number("bounce", "number of the impact"),
    number("t_s", "time in seconds"),
    number("x_m", "place in metres"),
    number("y_m", "place in metres"),
];
const THREE_MICROPHONES: &str = "with three microphones a wrong place of one, or a wrong speed of sound, leaves no trace: a fourth would show it";

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct Bounce;

impl Domain for Bounce {
    fn id(&self) -> &'static str {
        "bounce"
    }

    fn summary(&self) -> &'static str {
        "a ball that bounces on a table: when, and where, each impact was heard"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, bounce, t_s", "when each impact was heard; bounce counts from the first that was"),
            ("x_m, y_m", "optional: where, on the table"),
            ("[audio] files", "in place of data: one WAV a run"),
            (
                "[audio] microphones_m",
                "optional: [[x, y, z], ...] in the table's frame, one a channel; times only if absent",
            ),
            ("[audio] speed_of_sound_m_s", "or temperature_k; 343 m/s if absent"),
            ("[rig] drop_height_m", "optional: it fell from rest to the first impact; taken as exact"),
            ("[rig] mass_kg, diameter_m", "optional: of the ball; both give the drag coefficient"),
            ("[rig] gravity_m_s2", "optional: 9.80665 m/s^2 if absent"),
            ("[noise] t_s, x_m, y_m", "optional: one sigma from a calibration"),
        ]
    }

    fn columns(&self) -> &'static [Column<'static>] {
        &COLUMNS
    }

    fn spec(&self) -> Spec {
        let setup = Setup {
            gravity_m_s2: GRAVITY_M_S2,
            drag_unit: Some(0.1),
            placed: true,
            dropped: true,
            released: false,
            listened: false,
            unheard: [1, 10],
            microphones: 4,
        };
        spec::build(&setup, 0.8).0.build_unchecked()
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn predicts(&self) -> bool {
        false
    }

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        let rig = Rig::read(header)?;
        let noise = header.section("noise")?;
        let sigma = |name: &str| noise.number(name, f64::MIN_POSITIVE, 1e3);
        let calibration =
            Calibration { time_s: sigma("t_s")?, place_m: [sigma("x_m")?, sigma("y_m")?], estimated: None };
        let file = header.file.clone();
        if let Some(listened) = sound::listen(header, &rig)? {
            let calibration = Calibration { estimated: listened.estimated, ..calibration };
            let impacts = sound::impacts(&listened.heard);
            let ambiguous_array = listened.microphones.places_m.len() == 3;
            let drops =
                Drops::new(listened.heard, rig, calibration, listened.microphones).sounding(listened.waves);
            return Ok(CheckedRecording::new(drops.contents(), move || {
                let mut loaded = drops.assemble().map_err(|(_, expected)| ReadError::Value {
                    file,
                    key: "audio".into(),
                    got: "sound".into(),
                    expected,
                })?;
                loaded.additions.insert("impacts".into(), impacts);
                loaded.undetermined.extend(listened.strays);
                if ambiguous_array {
                    loaded.undetermined.push(THREE_MICROPHONES.into());
                }
                Ok(loaded)
            }));
        }
        header.root().text("data", "the name of a CSV file (or [audio] files)")?;
        let table = header.table("data", &COLUMNS)?;
        let heard = heard(&table, &rig)?;
        let times: Vec<Vec<f64>> = heard.iter().map(|h| h.drop.times_s.clone()).collect();
        let hint = plausible::beat(&times, rig.gravity_m_s2);
        let drops = Drops::new(heard, rig, calibration, Microphones::default());
        let checked = CheckedRecording::new(drops.contents(), move || {
            drops.assemble().map_err(|(row, what)| {
                let time = table.numbers("t_s").map_or(f64::NAN, |t| t[row]);
                table.cell(row, "t_s", time, what)
            })
        });
        Ok(checked.with_hints(hint))
    }
}
