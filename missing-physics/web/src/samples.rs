//! Recordings that come with the page.

use serde::Serialize;

/// Files that come with the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Sample {
    /// The recording's folder in the repository, or of a table its name.
    pub name: &'static str,
    /// What it is, in a few words.
    pub words: &'static str,
    /// The domain, where no header says it.
    pub domain: &'static str,
    /// Names and contents.
    pub files: &'static [(&'static str, &'static str)],
}

/// The header and the table of a recording in the repository.
macro_rules! recording {
    ($name:literal, $domain:literal, $words:literal) => {
        Sample {
            name: concat!("recordings/", $name),
            words: $words,
            domain: $domain,
            files: &[
                ("recording.toml", include_str!(concat!("../../../recordings/", $name, "/recording.toml"))),
                ("data.csv", include_str!(concat!("../../../recordings/", $name, "/data.csv"))),
            ],
        }
    };
}

/// The recordings that come with the page, and a table as a laboratory wrote it.
pub fn samples() -> &'static [Sample] {
    &[
        recording!("dropped-ball", "trajectory", "a tennis ball, dropped four times and filmed"),
        recording!(
            "measured/slosh/antisloshing-torque",
            "slosh",
            "measured: a wave of water, felt at a robot's wrist"
        ),
        recording!(
            "measured/motion/pendulum-small-swing",
            "motion",
            "measured: a pendulum that comes to rest"
        ),
        Sample {
            name: "throws.csv",
            words: "a tracker's table in German: its columns are to be named",
            domain: "trajectory",
            files: &[("throws.csv", include_str!("../../../recordings/throws.csv"))],
        },
    ]
}
