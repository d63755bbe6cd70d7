//! `predict`: a repaired model and a recording in, simulated channels out.

use std::fmt::Write as _;
use std::path::Path;

use super::error::CommandError;
use super::output::{Said, places};
use missing_physics_domains::repair::Repair;

/// Half the width of a 95 % interval of a normal law, in sigmas.
const SIGMAS: f64 = 1.959_963_984_540_054;

/// Predicts a recording and returns a table, or has it written to a file and says so; a model of a diagnosis that left something open comes
/// with a note.
///
/// Columns: `run`, the inputs, and for each channel its simulated value, one sigma of that, and the bounds between which a
/// reading lies with 95 %.
///
/// # Errors
/// [`CommandError`]; an output that cannot be written is refused before the work begins.
pub fn predict(model: &Path, folder: &Path, csv: Option<&Path>) -> Result<Said, CommandError> {
    let mut inputs = missing_physics_domains::recording::files_of(folder);
    inputs.push(model.into());
    let places = places(&csv.into_iter().collect::<Vec<_>>(), &inputs)?;
    let repair = Repair::read(model)?;
    let predicted = repair.predict(folder)?;
    let recording = &predicted.recording;
    let mut text = String::from("run");
    // Writing to a string cannot fail.
    for variable in &recording.variables {
        let _ = write!(text, ",{}", variable.name);
    }
    for channel in &recording.channels {
        let n = &channel.name;
        let _ = write!(text, ",{n},{n}_sigma,{n}_low95,{n}_high95");
    }
    text.push('\n');
    for (run, said) in recording.runs.iter().zip(&predicted.runs) {
        for row in 0..run.len() {
            text.push_str(&cell(&run.label));
            for input in &run.inputs {
                let _ = write!(text, ",{}", input[row]);
            }
            for ((value, sigma), noise) in said.channels.iter().zip(&said.sigma).zip(&repair.model.noise) {
                let (value, sigma) = (value[row], sigma[row]);
                let half = SIGMAS * sigma.hypot(noise.sigma);
                let _ = write!(text, ",{value:.9e},{sigma:.3e},{:.9e},{:.9e}", value - half, value + half);
            }
            text.push('\n');
        }
    }
    let mut said = match (csv, places.first()) {
        (Some(path), Some(place)) => {
            let mut said =
                Said::from(format!("{}: {} runs predicted\n", path.display(), predicted.runs.len()));
            said.write(place, text);
            said
        }
        _ => text.into(),
    };
    said.note = repair.caveat().map(|why| format!("{}: {why}", model.display()));
    Ok(said)
}

/// A label as a cell of a CSV.
fn cell(label: &str) -> String {
    if label.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", label.replace('"', "\"\""))
    } else {
        label.to_owned()
    }
}
