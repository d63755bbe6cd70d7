//! Recordings that come with the page.

use serde::Serialize;

/// Files that come with the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Sample {
    /// The recording's folder in the repository, or of a table its name.
    pub name: &'static str,
    /// What it is called.
    pub title: &'static str,
    /// What it is, in a few words.
    pub words: &'static str,
    /// The domain, where no header says it.
    pub domain: &'static str,
    /// Names and contents.
    pub files: &'static [(&'static str, &'static str)],
}

/// The header and the table of a recording in the repository.
macro_rules! recording {
    ($name:literal, $domain:literal, $title:literal, $words:literal) => {
        Sample {
            name: concat!("recordings/", $name),
            title: $title,
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
        recording!(
            "dropped-ball",
            "trajectory",
            "a dropped ball",
            "simulated: a tennis ball, filmed four times"
        ),
        recording!(
            "practice/liquid-tilt/c02",
            "liquid-tilt",
            "a tilted bottle",
            "simulated: felt at a robot's wrist, two effects hidden"
        ),
        recording!(
            "measured/indentation/sand-plate-60mm",
            "indentation",
            "pressed sand",
            "measured: a plate in dry sand, three times"
        ),
        recording!(
            "measured/motion/pendulum-small-swing",
            "motion",
            "a pendulum",
            "measured until it came to rest; takes half a minute"
        ),
        Sample {
            name: "throws",
            title: "a tracker's table",
            words: "in German: what its columns are is proposed",
            domain: "trajectory",
            files: &[("throws.csv", include_str!("../../../recordings/throws.csv"))],
        },
    ]
}
