//! Names of quantities in words, as axes have them.

use missing_physics::diagnosis::Diagnosis;

use super::context::ReportContext;

/// A quantity in words with its unit: `height (m)`.
pub(super) fn label(context: &ReportContext, (name, unit): &(String, String)) -> String {
    let words = context.words.get(name).cloned().unwrap_or_else(|| without_unit(name, unit));
    if unit.is_empty() { words } else { format!("{words} ({unit})") }
}

/// The label of a variable by its number; `row` where there is none.
pub(super) fn axis_label(d: &Diagnosis, context: &ReportContext, variable: usize) -> String {
    d.variables.get(variable).map_or_else(|| "row".into(), |quantity| label(context, quantity))
}

/// A name without the unit that it ends in, and with spaces: `tip_speed_m_s` in m/s is `tip speed`.
fn without_unit(name: &str, unit: &str) -> String {
    let ending = match unit.strip_prefix("1/") {
        Some(below) => format!("_per_{below}"),
        None => format!("_{unit}"),
    };
    let plain = |text: &str| text.replace('/', "_").replace(['^', ' '], "").to_lowercase();
    let stem = name.strip_suffix(&plain(&ending)).filter(|_| !unit.is_empty()).unwrap_or(name);
    stem.replace('_', " ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_words_with_a_unit() {
        let mut context = ReportContext::default();
        context.words.insert("z_m".into(), "height".into());
        let of = |name: &str, unit: &str| label(&context, &(name.into(), unit.into()));
        assert_eq!(of("z_m", "m"), "height (m)");
        assert_eq!(of("tip_speed_m_s", "m/s"), "tip speed (m/s)");
        assert_eq!(of("accel_z_m_s2", "m/s^2"), "accel z (m/s^2)");
        assert_eq!(of("tau_z_nm", "N m"), "tau z (N m)");
        assert_eq!(of("drag_per_m", "1/m"), "drag (1/m)");
        assert_eq!(of("bounce", ""), "bounce");
    }
}
