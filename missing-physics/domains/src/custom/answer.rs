//! What a simulator answers: one line of JSON.

use std::collections::BTreeMap;

use serde::Deserialize;

use missing_physics::model::LARGEST_PREDICTION;

use crate::recording::{brief, quoted};

/// What is answered: predicted channels, or why there are none.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Reply {
    id: u64,
    #[serde(default)]
    channels: BTreeMap<String, Vec<Option<f64>>>,
    error: Option<String>,
}

/// Why a simulator gives no prediction.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Failure {
    /// There is no prediction at these parameters; others may do.
    #[error("{0}")]
    NoPrediction(String),
    /// There will be no prediction any more.
    #[error("{0}")]
    Fatal(String),
}

/// Reads a simulator's line that answers question `id` into `out`: the channels one after the other, as many rows of each.
///
/// # Errors
/// [`Failure::NoPrediction`] where the simulator says that it cannot, or a number is not finite or above [`LARGEST_PREDICTION`]; [`Failure::Fatal`] where the line is no
/// such answer, with what came.
pub fn read_answer(line: &str, id: u64, channels: &[String], out: &mut [f64]) -> Result<(), Failure> {
    let fatal = |why: String| Err(Failure::Fatal(why));
    // Python and others write NaN and Infinity, which are no JSON.
    let reply: Result<Reply, _> = serde_json::from_str(line).or_else(|e| {
        let plain = line.replace("-Infinity", "null").replace("Infinity", "null").replace("NaN", "null");
        serde_json::from_str(&plain).map_err(|_| e)
    });
    let reply = match reply {
        Ok(reply) => reply,
        Err(e) => {
            return fatal(format!(
                "the simulator answered {}, expected {{\"id\": {id}, \"channels\": {{…}}}} on one line ({})",
                quoted(line),
                brief(&e.to_string())
            ));
        }
    };
    if reply.id != id {
        return fatal(format!("the simulator answered question {}, expected question {id}", reply.id));
    }
    if let Some(why) = reply.error {
        return Err(Failure::NoPrediction(format!("the simulator says {}", quoted(&why))));
    }
    let rows = out.len() / channels.len().max(1);
    for (name, out) in channels.iter().zip(out.chunks_exact_mut(rows.max(1))) {
        let Some(values) = reply.channels.get(name) else {
            let names: Vec<&str> = reply.channels.keys().map(String::as_str).collect();
            let got = if names.is_empty() { "none".into() } else { names.join(", ") };
            return fatal(format!("the simulator answered the channels {}, expected {name}", brief(&got)));
        };
        fill(name, values.iter().copied(), out)?;
    }
    Ok(())
}

/// Takes over what a simulator answered for a channel; `None` is no number.
///
/// # Errors
/// [`Failure::NoPrediction`] where a number is not finite or above [`LARGEST_PREDICTION`]; [`Failure::Fatal`] where they are not as many
/// as there are rows.
pub fn fill(
    name: &str,
    values: impl ExactSizeIterator<Item = Option<f64>>,
    out: &mut [f64],
) -> Result<(), Failure> {
    if values.len() != out.len() {
        return Err(Failure::Fatal(format!(
            "the simulator answered {} values of {name}, expected {}, one for each row",
            values.len(),
            out.len()
        )));
    }
    for (row, (out, value)) in out.iter_mut().zip(values).enumerate() {
        *out = match value {
            Some(value) if value.abs() <= LARGEST_PREDICTION => value,
            Some(value) if value.is_finite() => {
                return Err(Failure::NoPrediction(format!(
                    "the simulator answered {value:e} for {name} at row {row}, expected at most {LARGEST_PREDICTION:e}"
                )));
            }
            _ => {
                return Err(Failure::NoPrediction(format!(
                    "the simulator answered no finite number for {name} at row {row}"
                )));
            }
        };
    }
    Ok(())
}
