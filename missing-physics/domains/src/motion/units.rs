//! Units, as names end in them.

use super::expression::derivative;
use crate::recording::{ReadError, Section};

/// Suffixes and their units; the longest that fits counts.
const SUFFIXES: [(&str, &str); 25] = [
    ("_m_s2", "m/s^2"),
    ("_rad_s2", "rad/s^2"),
    ("_m_s", "m/s"),
    ("_rad_s", "rad/s"),
    ("_m3_s", "m^3/s"),
    ("_kg_s", "kg/s"),
    ("_n_m", "N m"),
    ("_m2", "m^2"),
    ("_m3", "m^3"),
    ("_per_s2", "1/s^2"),
    ("_per_s", "1/s"),
    ("_per_m", "1/m"),
    ("_rad", "rad"),
    ("_deg", "deg"),
    ("_kg", "kg"),
    ("_pa", "Pa"),
    ("_hz", "Hz"),
    ("_ohm", "ohm"),
    ("_mm", "mm"),
    ("_m", "m"),
    ("_s", "s"),
    ("_n", "N"),
    ("_v", "V"),
    ("_a", "A"),
    ("_k", "K"),
];

/// The unit that a name ends in, where it is a known one that is not spelt out by the name itself (`gain_per_rad`).
pub(super) fn of(name: &str) -> Option<&'static str> {
    SUFFIXES
        .iter()
        .filter(|(suffix, _)| name.len() > suffix.len() && name.ends_with(suffix))
        .filter(|(suffix, _)| {
            suffix.starts_with("_per") || !name[..name.len() - suffix.len()].ends_with("_per")
        })
        .max_by_key(|(suffix, _)| suffix.len())
        .map(|(_, unit)| *unit)
}

/// The unit that a name ends in, or nothing.
pub(super) fn text(name: &str) -> String {
    of(name).unwrap_or_default().to_owned()
}

/// Checks that a name and the quantity that it is have the same unit.
pub(super) fn check_same(section: &Section<'_>, key: &str, other: &str) -> Result<(), ReadError> {
    match (of(key), of(other)) {
        (Some(a), Some(b)) if a != b => Err(section.unfit(
            key,
            format!("\"{other}\" (in {b})"),
            format!("a quantity in {a}, as the name ends in"),
        )),
        _ => Ok(()),
    }
}

/// The unit of a derivative in time, of those that names end in.
pub(super) fn of_rate(unit: &str) -> Option<&'static str> {
    let rates = [
        ("m", "m/s"),
        ("rad", "rad/s"),
        ("m/s", "m/s^2"),
        ("rad/s", "rad/s^2"),
        ("m^3", "m^3/s"),
        ("kg", "kg/s"),
    ];
    rates.iter().find(|(of, _)| *of == unit).map(|(_, rate)| *rate)
}

/// The unit of the derivative in time of what a name names.
pub(super) fn text_of_rate(name: &str) -> String {
    match of(name) {
        None => "1/s".into(),
        Some(unit) => of_rate(unit).map_or_else(|| quotient(unit, &[("s", 1)]), str::to_owned),
    }
}

/// A unit over the product of others, each to a power: of "rad/s^2" over "rad" squared, "1/(rad s^2)".
pub(super) fn quotient(unit: &str, of: &[(&str, i32)]) -> String {
    let mut powers: Vec<(String, i32)> = Vec::new();
    for (unit, times) in std::iter::once((unit, 1)).chain(of.iter().map(|(unit, power)| (*unit, -power))) {
        for (part, side) in unit.split('/').zip([1, -1]) {
            for factor in part.split_whitespace().filter(|factor| *factor != "1") {
                let (base, power) = factor.split_once('^').unwrap_or((factor, "1"));
                let power = times * side * power.parse::<i32>().unwrap_or(1);
                match powers.iter_mut().find(|(known, _)| known == base) {
                    Some((_, sum)) => *sum += power,
                    None => powers.push((base.to_owned(), power)),
                }
            }
        }
    }
    let product = |side: i32| {
        let factors =
            powers.iter().filter(|(_, power)| side * power > 0).map(|(base, power)| match power.abs() {
                1 => base.clone(),
                power => format!("{base}^{power}"),
            });
        factors.collect::<Vec<_>>()
    };
    let (above, below) = (product(1), product(-1));
    let top = if above.is_empty() && !below.is_empty() { "1".to_owned() } else { above.join(" ") };
    match &below[..] {
        [] => top,
        [one] => format!("{top}/{one}"),
        _ => format!("{top}/({})", below.join(" ")),
    }
}

/// Checks that a quantity can be the derivative of another.
pub(super) fn check_rate(section: &Section<'_>, key: &str, other: &str) -> Result<(), ReadError> {
    let (Some(a), Some(b)) = (of(key), of(other)) else { return Ok(()) };
    match of_rate(a) {
        Some(expected) if b != expected => Err(section.unfit(
            key,
            format!("\"{other}\" (in {b})"),
            format!("a derivative in {expected}, as {key} is in {a}"),
        )),
        _ => Ok(()),
    }
}

/// Checks that a name and the derivative that it is have the same unit.
pub(super) fn check_derivative(section: &Section<'_>, key: &str, state: &str) -> Result<(), ReadError> {
    match (of(key), of(state).and_then(of_rate)) {
        (Some(a), Some(b)) if a != b => Err(section.unfit(
            key,
            format!("\"{}\" (in {b})", derivative(state)),
            format!("a quantity in {a}, as the name ends in"),
        )),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_divided() {
        assert_eq!(quotient("rad/s^2", &[("rad", 2), ("rad/s", 1)]), "1/(rad^2 s)");
        assert_eq!(quotient("m/s^2", &[("m", 1)]), "1/s^2");
        assert_eq!(quotient("m/s^2", &[("s", 1), ("V", 0)]), "m/s^3");
        assert_eq!(quotient("rad", &[]), "rad");
        assert_eq!(quotient("1/s", &[("", 3)]), "1/s");
    }

    #[test]
    fn names_end_in_their_units() {
        for (name, unit) in [
            ("angle_rad", Some("rad")),
            ("rate_rad_s", Some("rad/s")),
            ("supply_v", Some("V")),
            ("gain_per_rad", None),
            ("stiffness_per_s2", Some("1/s^2")),
            ("inflow_m3_s", Some("m^3/s")),
            ("ratio", None),
            ("speed_per_volt", None),
        ] {
            assert_eq!(of(name), unit, "{name}");
        }
    }
}
