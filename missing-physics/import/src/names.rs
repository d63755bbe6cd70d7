//! Names of columns taken apart: what is measured, and in which unit.

use crate::units::{Unit, readings, suffix};

/// A name taken apart.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Name {
    /// The name without its unit.
    pub(crate) stem: String,
    /// Its words in lower case without accents.
    pub(crate) words: Vec<String>,
    /// The unit as it is written.
    pub(crate) unit: Option<String>,
    /// All that the unit can mean.
    pub(crate) units: Vec<Unit>,
}

impl Name {
    /// Takes `Höhe (mm)`, `t [ms]`, `Kraft / N`, `force_mN`, `Zeit in s` or `time, ms` apart.
    pub(crate) fn parse(title: &str) -> Self {
        let title = title.trim();
        for (stem, unit) in endings(title) {
            let units = match (readings(unit), suffix(unit.trim())) {
                (none, Some(unit)) if none.is_empty() => vec![unit],
                (found, _) => found,
            };
            // A number in brackets is the place in an array.
            if !units.is_empty() && !stem.trim().is_empty() && unit.trim().parse::<f64>().is_err() {
                let stem = stem.trim().trim_end_matches([',', ':', '_', '/']).trim().to_owned();
                return Self { words: words(&stem), stem, unit: Some(unit.trim().to_owned()), units };
            }
        }
        Self { stem: title.to_owned(), words: words(title), unit: None, units: Vec::new() }
    }
}

/// Where a unit may stand in a name, the surest place first.
fn endings(title: &str) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
        if let Some(inner) = title.strip_suffix(close)
            && let Some((stem, unit)) = inner.rsplit_once(open)
        {
            found.push((stem, unit));
        }
    }
    for between in [" / ", " in ", ", ", "; "] {
        found.extend(title.rsplit_once(between));
    }
    // `m_s2` before `s2`: the longest ending first.
    let cuts: Vec<usize> = title.match_indices('_').map(|(at, _)| at).collect();
    for &at in &cuts[cuts.len().saturating_sub(2)..] {
        // The smallest of something, not a minute.
        found.extend((&title[at + 1..] != "min").then_some((&title[..at], &title[at + 1..])));
    }
    // `Time ms`, of two letters at least: a single one names an axis.
    found.extend(title.rsplit_once(' ').filter(|(_, unit)| unit.chars().count() > 1));
    found
}

/// Words in lower case, without accents, digits apart from letters.
pub(crate) fn words(text: &str) -> Vec<String> {
    let mut out: Vec<String> = Vec::new();
    let mut word = String::new();
    let mut before = ' ';
    for c in text.chars() {
        // `ForceZ` is two words, and so is `z1`.
        let begins =
            (c.is_uppercase() && before.is_lowercase()) || (c.is_numeric() && before.is_alphabetic());
        if !c.is_alphanumeric() || begins {
            out.extend((!word.is_empty()).then(|| std::mem::take(&mut word)));
        }
        if c.is_alphanumeric() {
            word.push_str(&c.to_lowercase().flat_map(bare).collect::<String>());
        }
        before = c;
    }
    out.extend((!word.is_empty()).then_some(word));
    out
}

/// A letter without its accent.
fn bare(c: char) -> Vec<char> {
    match c {
        'ä' => vec!['a', 'e'],
        'ö' => vec!['o', 'e'],
        'ü' => vec!['u', 'e'],
        'ß' => vec!['s', 's'],
        'à' | 'á' | 'â' | 'ã' | 'å' => vec!['a'],
        'è' | 'é' | 'ê' | 'ë' => vec!['e'],
        'ì' | 'í' | 'î' | 'ï' => vec!['i'],
        'ò' | 'ó' | 'ô' | 'õ' | 'ø' => vec!['o'],
        'ù' | 'ú' | 'û' => vec!['u'],
        'ç' => vec!['c'],
        'ñ' => vec!['n'],
        'δ' | 'Δ' => "delta".chars().collect(),
        'θ' | 'Θ' => "theta".chars().collect(),
        'τ' => "tau".chars().collect(),
        c => vec![c],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_taken_apart() {
        for (title, stem, unit) in [
            ("t [ms]", "t", Some("ms")),
            ("Höhe (mm)", "Höhe", Some("mm")),
            ("Kraft / N", "Kraft", Some("N")),
            ("Zeit in s", "Zeit", Some("s")),
            ("force_mN", "force", Some("mN")),
            ("accel_z_m_s2", "accel_z", Some("m_s2")),
            ("time_ms", "time", Some("ms")),
            ("Time ms", "Time", Some("ms")),
            ("F[N]", "F", Some("N")),
            ("Beschleunigung (m/s²)", "Beschleunigung", Some("m/s²")),
            ("Force (filtered)", "Force (filtered)", None),
            ("Sensor A", "Sensor A", None),
            ("z", "z", None),
            ("flight[1]", "flight[1]", None),
            ("(mm)", "(mm)", None),
            ("", "", None),
        ] {
            let name = Name::parse(title);
            assert_eq!((name.stem.as_str(), name.unit.as_deref()), (stem, unit), "{title}");
        }
    }

    #[test]
    fn words_are_plain() {
        assert_eq!(words("Höhe"), ["hoehe"]);
        assert_eq!(words("/ball/pose.position.z"), ["ball", "pose", "position", "z"]);
        assert_eq!(words("ForceZ"), ["force", "z"]);
        assert_eq!(words("Versuch Nr."), ["versuch", "nr"]);
        assert_eq!(words("Fz1"), ["fz", "1"]);
    }
}
