//! What the files of a recording say: the rig, and the rolls.

use dough_mbrl::band::Band;
use dough_mbrl::roll::Roll;

use super::rolls::{CHANNELS, RunOfRolls, Step};
use crate::reading::{check_runs, number};
use crate::recording::{Column, Header, ReadError, Table};

pub(super) const COLUMNS: [Column; 11] = [
    Column { name: "run", what: "label of the run", label: true },
    number("step", "number of the roll in its run"),
    number("length_m", "length in metres"),
    number("width_m", "width in metres"),
    number("height_m", "height in metres"),
    number("throw_m", "throw of the band in metres"),
    number("depth_m", "depth of the roll in metres"),
    number("next_length_m", "length after the roll in metres"),
    number("next_width_m", "width after the roll in metres"),
    number("next_height_m", "height after the roll in metres"),
    number("t_s", "time in seconds"),
];

/// What a recording says.
#[derive(Debug)]
pub(super) struct Read {
    pub(super) band: Band,
    /// The doughs from which the dynamics are learned.
    pub(super) training: Vec<Vec<Roll>>,
    pub(super) runs: Vec<RunOfRolls>,
    pub(super) timed: bool,
    /// The file of the training rolls.
    pub(super) training_file: String,
}

impl Read {
    /// Whether states before a roll are those after the roll before it, to the last digit: one measurement where the format has two.
    pub(super) fn one_picture(&self) -> bool {
        let runs = self.runs.iter().flat_map(|(_, steps)| steps.windows(2));
        let (mut same, mut all) = (0, 0);
        for pair in runs {
            same += usize::from(pair[0].roll.next == pair[1].roll.state);
            all += 1;
        }
        2 * same > all
    }
}

/// Reads a recording.
///
/// # Errors
/// [`ReadError`].
pub(super) fn read(header: &Header) -> Result<Read, ReadError> {
    let rig = header.section("rig")?;
    rig.number("mass_kg", 1e-6, 1e4)?;
    rig.number("density_kg_m3", 1.0, 1e5)?;
    let band = band(header)?;
    let noise = header.section("noise")?;
    // Learned dynamics bring the noise of both states with them; a calibration is read, and has nothing to add.
    for name in CHANNELS {
        noise.number(name, f64::MIN_POSITIVE, 1e3)?;
    }
    let table = header.table("data", &COLUMNS)?;
    let (mut runs, timed) = rolls(&table)?;
    let (training, training_file) = match rig.optional_text("training", "the name of a CSV file")? {
        Some(name) => {
            let table = header.named_table("rig.training", name, &COLUMNS, false)?;
            (rolls(&table)?.0, table.file)
        }
        None => {
            let later = runs.split_off(runs.len().div_ceil(2));
            (std::mem::replace(&mut runs, later), table.file)
        }
    };
    let training = training.into_iter().map(|(_, steps)| steps.iter().map(|s| s.roll).collect()).collect();
    if runs.is_empty() {
        return Err(ReadError::TooFewRows {
            file: training_file,
            what: "the file".into(),
            got: 1,
            expected: "at least 2 runs, or rig.training: the first half of the runs is learned from".into(),
        });
    }
    Ok(Read { band, training, runs, timed, training_file })
}

fn band(header: &Header) -> Result<Band, ReadError> {
    let rig = header.section("rig")?;
    let section = rig.section("band")?;
    let mut band = Band::default();
    for (key, value, lower, upper) in [
        ("k0_n_m", &mut band.k0_n_m, 1e-6, 1e9),
        ("k1_n_m2", &mut band.k1_n_m2, 0.0, 1e12),
        ("throw0_m", &mut band.throw0_m, 0.0, 1e3),
        ("k2_per_m", &mut band.k2_per_m, 0.0, 1e6),
    ] {
        if let Some(given) = section.number(key, lower, upper)? {
            *value = given;
        }
    }
    Ok(band)
}

/// The rolls of a table, and whether their times are known.
fn rolls(table: &Table) -> Result<(Vec<RunOfRolls>, bool), ReadError> {
    let labels = table.labels("run", "the label of each row's run")?;
    let column = |name: &'static str| {
        let what = COLUMNS.iter().find(|c| c.name == name).map_or("", |c| c.what);
        table.numbers(name).ok_or_else(|| table.missing(name, what))
    };
    let step = column("step")?;
    let (length, width, height) = (column("length_m")?, column("width_m")?, column("height_m")?);
    let (throw, depth) = (column("throw_m")?, column("depth_m")?);
    let next = [column("next_length_m")?, column("next_width_m")?, column("next_height_m")?];
    for (name, values) in [
        ("length_m", length),
        ("width_m", width),
        ("height_m", height),
        ("next_length_m", next[0]),
        ("next_width_m", next[1]),
        ("next_height_m", next[2]),
    ] {
        if let Some(row) = values.iter().position(|v| *v <= 0.0) {
            return Err(table.cell(row, name, values[row], "above 0"));
        }
    }
    let times = table.numbers("t_s");
    let rising = if times.is_some() { "t_s" } else { "step" };
    let mut runs = Vec::new();
    for (label, rows) in check_runs(table, labels, 1, Some(rising))? {
        if let Some(pair) = rows.windows(2).find(|w| step[w[1]] <= step[w[0]]) {
            let expected = format!("more than {}, the one before it", step[pair[0]]);
            return Err(table.cell(pair[1], "step", step[pair[1]], expected));
        }
        let steps = rows
            .iter()
            .map(|&r| Step {
                roll: Roll {
                    state: [length[r], width[r], height[r]],
                    action: [throw[r], depth[r]],
                    next: next.map(|n| n[r]),
                },
                step: step[r],
                t_s: times.map_or(0.0, |t| t[r]),
            })
            .collect();
        runs.push((label, steps));
    }
    Ok((runs, times.is_some()))
}
