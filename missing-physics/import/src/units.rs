//! Units as people write them: `ms`, `mm`, `m/s²`, `N·m`, `°`, `rpm`.

/// Exponents of m, kg, s, K, rad and A.
pub type Dimension = [i32; 6];

/// A unit: what it measures, how much of the SI unit it is, and where its zero lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// What it measures.
    pub dimension: Dimension,
    /// SI units in one of it.
    pub factor: f64,
    /// SI value of its zero (degrees Celsius).
    pub zero: f64,
}

const NUMBER: Dimension = [0; 6];
const LENGTH: Dimension = [1, 0, 0, 0, 0, 0];
const MASS: Dimension = [0, 1, 0, 0, 0, 0];
const TIME: Dimension = [0, 0, 1, 0, 0, 0];
const KELVIN: Dimension = [0, 0, 0, 1, 0, 0];
const ANGLE: Dimension = [0, 0, 0, 0, 1, 0];
const CURRENT: Dimension = [0, 0, 0, 0, 0, 1];
const FORCE: Dimension = [1, 1, -2, 0, 0, 0];
/// Of a torque, and of energy.
pub(crate) const TORQUE: Dimension = [2, 1, -2, 0, 0, 0];
const PRESSURE: Dimension = [-1, 1, -2, 0, 0, 0];
const VOLUME: Dimension = [3, 0, 0, 0, 0, 0];
const ACCELERATION: Dimension = [1, 0, -2, 0, 0, 0];
const VOLTAGE: Dimension = [2, 1, -3, 0, 0, -1];
const RATE: Dimension = [0, 0, -1, 0, 0, 0];
const SPIN: Dimension = [0, 0, -1, 0, 1, 0];
/// What a second's unit measures.
pub(crate) const SECONDS: Dimension = TIME;

/// Units that take the prefixes n, u, m, c, d, k, M, G.
const PREFIXED: [(&str, Dimension, f64); 15] = [
    ("m", LENGTH, 1.0),
    ("g", MASS, 1e-3),
    ("s", TIME, 1.0),
    ("K", KELVIN, 1.0),
    ("rad", ANGLE, 1.0),
    ("A", CURRENT, 1.0),
    ("N", FORCE, 1.0),
    ("Nm", TORQUE, 1.0),
    ("J", TORQUE, 1.0),
    ("Pa", PRESSURE, 1.0),
    ("bar", PRESSURE, 1e5),
    ("V", VOLTAGE, 1.0),
    ("Hz", RATE, 1.0),
    ("L", VOLUME, 1e-3),
    ("l", VOLUME, 1e-3),
];
const PREFIXES: [(&str, f64); 9] = [
    ("", 1.0),
    ("n", 1e-9),
    ("u", 1e-6),
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
];

/// Units that take none.
const WHOLE: [(&[&str], Dimension, f64); 24] = [
    (&["%", "percent"], NUMBER, 1e-2),
    (&["1", "-"], NUMBER, 1.0),
    (&["min", "minute", "minutes"], TIME, 60.0),
    (&["h", "hour", "hours"], TIME, 3600.0),
    (&["sec", "secs", "second", "seconds", "sek", "sekunden", "sekunde"], TIME, 1.0),
    (&["msec", "msecs", "millis", "millisecond", "milliseconds", "millisekunden"], TIME, 1e-3),
    (&["usec", "micros", "microsecond", "microseconds"], TIME, 1e-6),
    (&["nsec", "nanos", "nanosecond", "nanoseconds"], TIME, 1e-9),
    (&["deg", "degs", "degree", "degrees", "°", "grad", "º"], ANGLE, std::f64::consts::PI / 180.0),
    (&["rev", "revs", "turn", "turns", "revolution", "revolutions"], ANGLE, std::f64::consts::TAU),
    (&["rpm"], SPIN, std::f64::consts::TAU / 60.0),
    (&["radian", "radians"], ANGLE, 1.0),
    (&["metre", "metres", "meter", "meters"], LENGTH, 1.0),
    (&["millimetre", "millimetres", "millimeter", "millimeters"], LENGTH, 1e-3),
    (&["centimetre", "centimetres", "centimeter", "centimeters"], LENGTH, 1e-2),
    (&["inch", "inches", "in"], LENGTH, 0.0254),
    (&["ft", "foot", "feet"], LENGTH, 0.3048),
    (&["newton", "newtons"], FORCE, 1.0),
    (&["lbf"], FORCE, 4.448_221_615_260_5),
    (&["kgf", "kp"], FORCE, 9.80665),
    (&["lb", "lbs"], MASS, 0.453_592_37),
    (&["psi"], PRESSURE, 6_894.757_293_168),
    (&["mmHg", "mmhg", "torr"], PRESSURE, 133.322_387_415),
    (&["litre", "liter", "litres", "liters"], VOLUME, 1e-3),
];

impl Unit {
    const fn plain(dimension: Dimension, factor: f64) -> Self {
        Self { dimension, factor, zero: 0.0 }
    }

    /// A value in SI units.
    pub fn si(self, value: f64) -> f64 {
        value * self.factor + self.zero
    }

    fn power(self, exponent: i32) -> Self {
        Self::plain(self.dimension.map(|d| d * exponent), self.factor.powi(exponent))
    }

    fn times(self, other: Self) -> Self {
        let mut dimension = self.dimension;
        dimension.iter_mut().zip(other.dimension).for_each(|(a, b)| *a += b);
        Self::plain(dimension, self.factor * other.factor)
    }
}

/// All that a text can mean as a unit (`g`: gram, or standard gravity; `nm`: nanometre, or newton metre).
pub fn readings(text: &str) -> Vec<Unit> {
    let text = plain(text);
    let mut found: Vec<Unit> = Vec::new();
    match text.as_str() {
        "" => return found,
        "°C" | "degC" | "Celsius" | "celsius" => {
            found.push(Unit { dimension: KELVIN, factor: 1.0, zero: 273.15 });
        }
        _ => {}
    }
    found.extend(product(&text));
    // Written without regard to case (MM, KG, SEC).
    if found.is_empty() && text.chars().all(|c| !c.is_lowercase()) {
        found.extend(product(&text.to_lowercase()));
    }
    let also = match text.as_str() {
        "g" | "G" | "gn" | "g0" => Some(Unit::plain(ACCELERATION, 9.80665)),
        "mg" => Some(Unit::plain(ACCELERATION, 9.80665e-3)),
        "nm" | "n_m" => Some(Unit::plain(TORQUE, 1.0)),
        "n" => Some(Unit::plain(FORCE, 1.0)),
        "mn" => Some(Unit::plain(FORCE, 1e-3)),
        "pa" => Some(Unit::plain(PRESSURE, 1.0)),
        "kpa" => Some(Unit::plain(PRESSURE, 1e3)),
        "k" => Some(Unit::plain(KELVIN, 1.0)),
        "nmm" | "Nmm" => Some(Unit::plain(TORQUE, 1e-3)),
        "ncm" | "Ncm" => Some(Unit::plain(TORQUE, 1e-2)),
        _ => None,
    };
    found.extend(also);
    found
}

/// The SI unit by which the name of a column of ours ends (`tau_z_nm`: N m), with the name's stem.
pub(crate) fn of_name(name: &str) -> Option<(&str, Unit)> {
    let tokens: Vec<usize> = name.match_indices('_').map(|(at, _)| at).collect();
    // The longest ending that is a unit: `_m_s2` before `_s2`.
    let from = tokens.len().saturating_sub(3);
    tokens[from..].iter().find_map(|&at| {
        let unit = suffix(&name[at + 1..])?;
        (at > 0).then_some((&name[..at], unit))
    })
}

/// A unit as names end in it: `m_s2` is m/s^2, `nm` is N m, `per_m` is 1/m; `mm` is a millimetre.
pub(crate) fn suffix(text: &str) -> Option<Unit> {
    match text {
        "nm" => return Some(Unit::plain(TORQUE, 1.0)),
        "n" => return Some(Unit::plain(FORCE, 1.0)),
        "pa" => return Some(Unit::plain(PRESSURE, 1.0)),
        "k" => return Some(Unit::plain(KELVIN, 1.0)),
        "v" => return Some(Unit::plain(VOLTAGE, 1.0)),
        "a" => return Some(Unit::plain(CURRENT, 1.0)),
        _ => {}
    }
    if let Some(below) = text.strip_prefix("per_") {
        return suffix(below).map(|unit| unit.power(-1));
    }
    match text.split_once('_') {
        Some((above, below)) => {
            let above = suffix(above)?;
            below.split('_').try_fold(above, |unit, below| Some(unit.times(suffix(below)?.power(-1))))
        }
        None => readings(text).first().copied(),
    }
}

/// One spelling for what looks alike.
fn plain(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.trim().chars() {
        match c {
            '²' => out.push_str("^2"),
            '³' => out.push_str("^3"),
            '⁻' => out.push_str("^-"),
            '¹' if out.ends_with("^-") => out.push('1'),
            'µ' | 'μ' => out.push('u'),
            '·' | '⋅' | '×' | '∙' => out.push('*'),
            '−' => out.push('-'),
            c => out.push(c),
        }
    }
    out.replace("**", "^").replace("^-^", "^-")
}

/// Factors and powers: `N*m`, `m/s^2`, `m s-2`, `kg m2`.
fn product(text: &str) -> Option<Unit> {
    if let Some(unit) = symbol(text) {
        return Some(unit);
    }
    let mut all = Unit::plain(NUMBER, 1.0);
    let (mut sign, mut rest, mut read) = (1, text, 0);
    while !rest.is_empty() {
        let length = rest.find(['*', '/', ' ', '.', '(', ')']).unwrap_or(rest.len());
        let (part, after) = rest.split_at(length);
        if !part.is_empty() {
            all = all.times(power(part)?.power(sign));
            sign = 1;
            read += 1;
        }
        let mut chars = after.chars();
        if chars.next() == Some('/') {
            sign = -1;
        }
        rest = chars.as_str();
    }
    (read > 0 && sign == 1).then_some(all)
}

/// One factor: `s^2`, `s2`, `s-2`, `s^-1`, `1`.
fn power(part: &str) -> Option<Unit> {
    if part == "1" {
        return Some(Unit::plain(NUMBER, 1.0));
    }
    let at = part.find(|c: char| c == '^' || c == '-' || c.is_ascii_digit()).unwrap_or(part.len());
    let (name, exponent) = part.split_at(at);
    let exponent = exponent.trim_start_matches('^');
    let exponent = if exponent.is_empty() { 1 } else { exponent.parse::<i32>().ok()? };
    (exponent.abs() <= 9).then_some(symbol(name)?.power(exponent))
}

fn symbol(name: &str) -> Option<Unit> {
    let lower = name.to_lowercase();
    let whole = |(names, dimension, factor): &(&[&str], Dimension, f64)| {
        (names.contains(&name) || (lower.chars().count() > 2 && names.contains(&lower.as_str())))
            .then_some(Unit::plain(*dimension, *factor))
    };
    if let Some(unit) = WHOLE.iter().find_map(whole) {
        return Some(unit);
    }
    PREFIXES.iter().find_map(|(prefix, by)| {
        let bare = name.strip_prefix(prefix)?;
        let (_, dimension, factor) = PREFIXED.iter().find(|(symbol, _, _)| *symbol == bare)?;
        Some(Unit::plain(*dimension, by * factor))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(text: &str, dimension: Dimension) -> f64 {
        let found = readings(text).into_iter().find(|u| u.dimension == dimension);
        found.unwrap_or_else(|| panic!("{text}: {:?}", readings(text))).factor
    }

    /// Factors of NIST SP 811, appendix B.8.
    #[test]
    fn units_are_read_as_people_write_them() {
        let near = |text: &str, dimension, expected: f64| {
            let got = factor(text, dimension);
            assert!((got / expected - 1.0).abs() < 1e-12, "{text}: {got}, expected {expected}");
        };
        for (text, expected) in
            [("ms", 1e-3), ("µs", 1e-6), ("min", 60.0), ("s", 1.0), ("SEC", 1.0), ("ns", 1e-9)]
        {
            near(text, TIME, expected);
        }
        for (text, expected) in
            [("mm", 1e-3), ("MM", 1e-3), ("cm", 0.01), ("in", 0.0254), ("μm", 1e-6), ("nm", 1e-9)]
        {
            near(text, LENGTH, expected);
        }
        for text in ["m/s²", "m/s^2", "m s-2", "m/s/s", "m·s⁻²", "m/s**2", "m*s^-2"] {
            near(text, ACCELERATION, 1.0);
        }
        near("g", ACCELERATION, 9.80665);
        near("mm/s²", ACCELERATION, 1e-3);
        for (text, expected) in
            [("Nm", 1.0), ("N·m", 1.0), ("N m", 1.0), ("N mm", 1e-3), ("mNm", 1e-3), ("nm", 1.0)]
        {
            near(text, TORQUE, expected);
        }
        near("kPa", PRESSURE, 1e3);
        near("N/mm²", PRESSURE, 1e6);
        near("psi", PRESSURE, 6894.757293168);
        near("°", ANGLE, std::f64::consts::PI / 180.0);
        near("deg/s", SPIN, std::f64::consts::PI / 180.0);
        near("rpm", SPIN, std::f64::consts::TAU / 60.0);
        near("ml", VOLUME, 1e-6);
        near("cm³", VOLUME, 1e-6);
        near("g", MASS, 1e-3);
        assert_eq!(readings("°C")[0].si(20.0), 293.15);
        for text in ["", "x", "filtered", "s^99", "m//", "/", "N m/"] {
            assert!(
                readings(text).iter().all(|u| u.dimension == NUMBER) || readings(text).is_empty(),
                "{text}"
            );
        }
    }

    #[test]
    fn the_unit_of_a_name_is_its_ending() {
        let of = |name| of_name(name).map(|(stem, unit)| (stem, unit.dimension, unit.factor));
        assert_eq!(of("accel_z_m_s2"), Some(("accel_z", ACCELERATION, 1.0)));
        assert_eq!(of("tau_z_nm"), Some(("tau_z", TORQUE, 1.0)));
        assert_eq!(of("spin_x_rad_s"), Some(("spin_x", SPIN, 1.0)));
        assert_eq!(of("volume_m3"), Some(("volume", VOLUME, 1.0)));
        assert_eq!(of("t_s"), Some(("t", TIME, 1.0)));
        assert_eq!(of("height_mm"), Some(("height", LENGTH, 1e-3)));
        assert_eq!(of("bounce"), None);
        assert_eq!(of("depth_image"), None);
    }
}
