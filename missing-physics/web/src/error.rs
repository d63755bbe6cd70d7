//! Why the page has no answer.

use missing_physics::engine::DiagnoseError;
use missing_physics_domains::recording::ReadError;
use missing_physics_import::ImportError;

/// Why the page has no answer; its text says on a line what to do there.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WebError {
    /// The recording cannot be read.
    #[error("{0}{hint}", hint = other_domain(.0))]
    Read(#[from] ReadError),
    /// The recording cannot be diagnosed.
    #[error(transparent)]
    Diagnose(#[from] DiagnoseError),
    /// The files cannot be made a recording.
    #[error("{text}", text = on_the_page(.0))]
    Import(#[from] ImportError),
    /// What the page asked is not what is known here: the page and the program are not of one build.
    #[error("the page asked what is not known here ({0}): build it again by .ci/web")]
    Asked(String),
}

/// What a recording of another domain needs.
fn other_domain(error: &ReadError) -> &'static str {
    match error {
        ReadError::Value { key, .. } if key == "domain" => "; other domains are diagnosed by the command",
        _ => "",
    }
}

/// An import's error without the command's options.
fn on_the_page(error: &ImportError) -> String {
    match error {
        ImportError::Missing { missing, there } => {
            format!("no column found for {}: choose it among {}", missing.join(", "), there.join(", "))
        }
        ImportError::LeftOut { file, .. } => {
            let file = file.display();
            format!(
                "{file}: not read in the browser; the command makes a recording of it: missing-physics import {file}"
            )
        }
        ImportError::Option { option, why } => {
            let why = without_options(&why.replace("--rate HZ", "\"rows a second\""));
            format!("{}: {why}", option.trim_start_matches("--"))
        }
        other => without_options(&other.to_string()),
    }
}

/// A sentence without its last clause, where that names an option of the command.
pub(crate) fn without_options(sentence: &str) -> String {
    let Some(at) = sentence.find("--") else { return sentence.to_owned() };
    let before = &sentence[..at];
    let clause = [" (", ": ", ", "].iter().filter_map(|mark| before.rfind(mark)).max();
    clause.map_or(sentence, |end| &sentence[..end]).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_option_of_the_command_is_named() {
        for (said, here) in [
            ("\"z\" has no unit: taken as m (else --map z_m=\"z [UNIT]\")", "\"z\" has no unit: taken as m"),
            (
                "one run: no column, file or pause tells runs apart (--run, --gap, --every)",
                "one run: no column, file or pause tells runs apart",
            ),
            (
                "3 runs, cut where the time pauses: --run or --every says it better",
                "3 runs, cut where the time pauses",
            ),
            ("nothing of the kind", "nothing of the kind"),
        ] {
            assert_eq!(without_options(said), here);
        }
    }
}
