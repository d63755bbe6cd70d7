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
    channels: Channels,
    error: Option<String>,
    batch: Option<Vec<Part>>,
}

/// The same for one of several sets of parameters.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Part {
    #[serde(default)]
    channels: Channels,
    error: Option<String>,
}

/// Predicted channels by name.
type Channels = BTreeMap<String, Vec<Option<f64>>>;

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
    let reply = reply(line, id)?;
    match reply.error {
        Some(why) => Err(says(&why)),
        None => fill_all(&reply.channels, channels, out),
    }
}

/// Reads a simulator's line that answers question `id` for `count` sets of parameters: for each the channels one after the other, `rows`
/// numbers altogether, or why there are none.
///
/// # Errors
/// [`Failure::Fatal`] where the line is no such answer, with what came.
pub fn read_batch(
    line: &str,
    id: u64,
    channels: &[String],
    rows: usize,
    count: usize,
) -> Result<Vec<Result<Vec<f64>, Failure>>, Failure> {
    let reply = reply(line, id)?;
    let parts = match (reply.batch, reply.error) {
        (Some(parts), None) if parts.len() == count => parts,
        (Some(parts), None) => {
            return Err(Failure::Fatal(format!(
                "the simulator answered a batch of {}, expected {count}, one for each set of parameters",
                parts.len()
            )));
        }
        (_, Some(why)) => return Ok(vec![Err(says(&why)); count]),
        (None, None) => {
            return Err(Failure::Fatal(format!(
                "the simulator answered {} without a batch, expected {{\"id\": {id}, \"batch\": [{{\"channels\": {{…}}}}, …]}}",
                quoted(line)
            )));
        }
    };
    let read = |part: Part| match part.error {
        Some(why) => Ok(Err(says(&why))),
        None => {
            let mut out = vec![0.0; rows];
            match fill_all(&part.channels, channels, &mut out) {
                Err(fatal @ Failure::Fatal(_)) => Err(fatal),
                filled => Ok(filled.map(|()| out)),
            }
        }
    };
    parts.into_iter().map(read).collect()
}

fn says(why: &str) -> Failure {
    Failure::NoPrediction(format!("the simulator says {}", quoted(why)))
}

fn reply(line: &str, id: u64) -> Result<Reply, Failure> {
    // Python and others write NaN and Infinity, which are no JSON.
    let reply: Result<Reply, _> = serde_json::from_str(line).or_else(|e| {
        let plain = line.replace("-Infinity", "null").replace("Infinity", "null").replace("NaN", "null");
        serde_json::from_str(&plain).map_err(|_| e)
    });
    match reply {
        Ok(reply) if reply.id == id => Ok(reply),
        Ok(reply) => Err(Failure::Fatal(format!(
            "the simulator answered question {}, expected question {id}",
            reply.id
        ))),
        Err(e) => Err(Failure::Fatal(format!(
            "the simulator answered {}, expected {{\"id\": {id}, \"channels\": {{…}}}} on one line ({})",
            quoted(line),
            brief(&e.to_string())
        ))),
    }
}

/// Puts the channels one after the other into `out`.
fn fill_all(found: &Channels, channels: &[String], out: &mut [f64]) -> Result<(), Failure> {
    let fatal = |why: String| Err(Failure::Fatal(why));
    let rows = out.len() / channels.len().max(1);
    for (name, out) in channels.iter().zip(out.chunks_exact_mut(rows.max(1))) {
        let Some(values) = found.get(name) else {
            let names: Vec<&str> = found.keys().map(String::as_str).collect();
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
