//! Foreign text in words of our own: on one line, and not too long.

/// Endings of names and the units that they are, the longest first.
const UNITS: [(&str, &str); 27] = [
    ("_n_per_m3", "N/m^3"),
    ("_rad_s2", "rad/s^2"),
    ("_per_s2", "1/s^2"),
    ("_kg_m3", "kg/m^3"),
    ("_rad_s", "rad/s"),
    ("_per_s", "1/s"),
    ("_per_m", "1/m"),
    ("_m3_s", "m^3/s"),
    ("_j_m2", "J/m^2"),
    ("_m_s2", "m/s^2"),
    ("_m_s", "m/s"),
    ("_n_m", "N/m"),
    ("_m2", "m^2"),
    ("_m3", "m^3"),
    ("_nm", "N m"),
    ("_rad", "rad"),
    ("_deg", "deg"),
    ("_kg", "kg"),
    ("_pa", "Pa"),
    ("_px", "px"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_s", "s"),
    ("_n", "N"),
    ("_k", "K"),
    ("_v", "V"),
    ("_a", "A"),
];

/// The unit that a name ends in, as a person writes it; nothing for a pure number.
pub fn unit_of(name: &str) -> &'static str {
    UNITS
        .iter()
        .find(|(ending, _)| name.len() > ending.len() && name.ends_with(ending))
        .map_or("", |(_, unit)| unit)
}

/// A text in quotes, on one line and not too long.
pub fn quoted(text: &str) -> String {
    let short: String = text.chars().take(40).collect();
    let dots = if text.chars().count() > 40 { "…" } else { "" };
    format!("\"{}{dots}\"", one_line(&short))
}

/// What another reader says, on one line, without its middle where it quotes much.
#[cfg(feature = "custom")]
pub(crate) fn brief(text: &str) -> String {
    const END: usize = 100;
    let line: Vec<char> = one_line(text).chars().collect();
    if line.len() <= 2 * END {
        return line.into_iter().collect();
    }
    let part = |chars: &[char]| chars.iter().collect::<String>();
    format!("{}…{}", part(&line[..END]), part(&line[line.len() - END..]))
}

/// A text with everything that would break a line escaped.
pub(crate) fn one_line(text: &str) -> String {
    text.chars()
        .flat_map(|c| if c.is_control() { c.escape_default().collect::<Vec<_>>() } else { vec![c] })
        .collect()
}
