//! `recording.toml` from a domain's template: what is known in its place, what is not known marked.

use missing_physics_domains::Domain;
use missing_physics_domains::recording::PLACEHOLDER;

use crate::choose::Choice;
use crate::error::{ImportError, in_quotes, one_line};
use crate::names::Name;
use crate::units;

/// Keys without which a domain reads nothing.
const NEEDED: [(&str, &[&str]); 4] = [
    ("liquid-tilt", &["container", "container_mass_kg", "gripper_mass_kg", "grasp_height_m"]),
    ("slosh", &["container", "liquid_mass_kg", "volume_m3"]),
    ("indentation", &["indenter"]),
    (
        "grain-pour",
        &[
            "fx_px",
            "fy_px",
            "cx_px",
            "cy_px",
            "height_m",
            "depth_unit_m",
            "grain_diameter_m",
            "grain_mass_kg",
            "grain_count",
            "funnel",
        ],
    ),
];

/// A value that was given for a key.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Setting {
    /// The section, where it was named (`noise`).
    section: Option<String>,
    key: String,
    /// The value as TOML.
    value: String,
}

impl Setting {
    /// Reads `KEY=VALUE`: TOML, or a number with its unit (`liquid_mass_kg=282 g`).
    ///
    /// # Errors
    /// [`ImportError::Option`].
    pub(crate) fn parse(option: &str) -> Result<Self, ImportError> {
        let fail = |why: &str| ImportError::option(format!("--set {}", in_quotes(option)), why);
        let (key, value) = option.split_once('=').ok_or_else(|| fail("expected KEY=VALUE"))?;
        let (section, key) = match key.trim().split_once('.') {
            Some((section, key)) => (Some(section.trim().to_owned()), key.trim()),
            None => (None, key.trim()),
        };
        let plain =
            |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !plain(key) || section.as_deref().is_some_and(|s| !plain(s)) {
            return Err(fail("expected a key of recording.toml, such as mass_kg or noise.z_m"));
        }
        let value = value.trim();
        let toml = |value: &str| {
            !value.contains('\n')
                && format!("x = {value}").parse::<toml::Table>().is_ok_and(|table| table.len() == 1)
        };
        let value = if toml(value) {
            value.to_owned()
        } else {
            let at =
                value.find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c))).unwrap_or(value.len());
            let number: f64 =
                value[..at].parse().map_err(|_| fail("expected a value as TOML, or a number with a unit"))?;
            let (_, wanted) = units::of_name(key).ok_or_else(|| fail("that key has no unit"))?;
            let given = Name::parse(&format!("x [{}]", value[at..].trim())).units;
            let unit = given.iter().find(|u| u.dimension == wanted.dimension);
            let unit = unit.ok_or_else(|| fail("that unit measures something else, or is not known"))?;
            format!("{}", format!("{:.11e}", unit.si(number)).parse::<f64>().unwrap_or(number))
        };
        Ok(Self { section, key: key.to_owned(), value })
    }

    fn is(&self, section: &str, key: &str) -> bool {
        self.key == key && self.section.as_deref().map_or(section != "noise", |named| named == section)
    }
}

/// The header of an imported recording, and the keys whose values are not known.
pub(crate) fn header(
    domain: &dyn Domain,
    origin: &[String],
    columns: &[&str],
    settings: &[Setting],
) -> (String, Vec<String>) {
    let needed = NEEDED.iter().find(|(of, _)| *of == domain.id()).map_or(&[][..], |(_, keys)| keys);
    let mut unknown = Vec::new();
    let mut out: Vec<String> = origin.iter().map(|line| format!("# {}", one_line(line))).collect();
    let mut section = String::new();
    let mut used = vec![false; settings.len()];
    let mut body: Vec<(String, String)> = Vec::new();
    for line in domain.template().header.lines() {
        let (hidden, bare) = match line.strip_prefix("# ") {
            Some(bare) => (true, bare),
            None => (false, line),
        };
        let opened = bare.trim_end_matches(|c| c != ']').strip_prefix('[').and_then(|s| s.strip_suffix(']'));
        if let Some(name) = opened.filter(|name| name.chars().all(|c| c.is_ascii_lowercase())) {
            section = name.to_owned();
            body.push((section.clone(), if hidden { format!("# {bare}") } else { line.to_owned() }));
            continue;
        }
        let key = bare.split_once(" = ").map(|(key, _)| key.trim());
        let key = key.filter(|k| !k.is_empty() && k.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'));
        let Some(key) = key else {
            // What the template says of columns that may be there is said of those that are.
            if !line.trim_start().starts_with("#    ") {
                body.push((section.clone(), line.to_owned()));
            }
            continue;
        };
        let note = comment(bare);
        let given = settings.iter().position(|s| s.is(&section, key));
        body.push((
            section.clone(),
            if key == "data" {
                format!("data = \"data.csv\"            # columns: run, {}", columns.join(", "))
            } else if section.is_empty() {
                line.to_owned()
            } else if let Some(at) = given {
                used[at] = true;
                format!(
                    "{key} = {}{}",
                    settings[at].value,
                    note.map(|n| format!("   # {n}")).unwrap_or_default()
                )
            } else if hidden {
                line.to_owned()
            } else if needed.contains(&key) {
                unknown.push(key.to_owned());
                let value = bare.split_once(" = ").map_or("", |(_, value)| value);
                let value = value.split(" # ").next().unwrap_or_default().trim_end();
                let note = note.map(|n| format!(": {n}")).unwrap_or_default();
                format!("{key} = {value}   # {PLACEHOLDER}{note}")
            } else {
                format!("# {line}")
            },
        ));
    }
    for (setting, _) in settings.iter().zip(&used).filter(|(_, used)| !**used) {
        let section = setting.section.clone().unwrap_or_else(|| "rig".into());
        let line = format!("{} = {}", setting.key, setting.value);
        match body.iter().rposition(|(of, _)| *of == section) {
            Some(at) => body.insert(at + 1, (section, line)),
            None => body.extend([
                (section.clone(), String::new()),
                (section.clone(), format!("[{section}]")),
                (section, line),
            ]),
        }
    }
    open_sections(&mut body);
    out.extend(body.into_iter().map(|(_, line)| line));
    (out.join("\n") + "\n", unknown)
}

/// Takes the mark of a comment from a section's name where a key below it holds.
fn open_sections(body: &mut [(String, String)]) {
    for at in 0..body.len() {
        let hidden = format!("# [{}]", body[at].0);
        if !body[at].1.starts_with(&hidden) {
            continue;
        }
        let section = body[at].0.clone();
        if body[at..].iter().any(|(of, line)| *of == section && !line.starts_with('#') && line.contains('='))
        {
            body[at].1 = format!("[{section}]");
        }
    }
}

/// What stands behind a value.
fn comment(line: &str) -> Option<&str> {
    line.split_once(" # ").map(|(_, comment)| comment.trim())
}

/// The header of a simulator's columns: what is known, what is measured.
pub(crate) fn custom(
    origin: &[String],
    inputs: &[&str],
    channels: &[&str],
    unit: impl Fn(&str) -> String,
) -> String {
    let mut out: Vec<String> = origin.iter().map(|line| format!("# {}", one_line(line))).collect();
    out.extend(["format = 1".into(), "domain = \"custom\"".into(), "data = \"data.csv\"".into()]);
    out.push("baseline = \"the simulation as it came with the file\"".into());
    for (kind, names) in [("input", inputs), ("channel", channels)] {
        for name in names {
            out.push(format!("\n[[{kind}]]\nname = \"{name}\"\nunit = \"{}\"", unit(name)));
        }
    }
    out.push("\n# One sigma of each measured channel, if a calibration gave it.\n# [noise]".into());
    out.extend(channels.iter().map(|name| format!("# {name} = ")));
    out.join("\n") + "\n"
}

/// Where each column comes from, a line each.
pub(crate) fn origin(files: &[String], choices: &[Choice]) -> Vec<String> {
    let mut lines = vec![format!("Imported from {}.", files.join(", "))];
    lines.extend(choices.iter().map(|c| format!("  {} = {}", c.target, c.formula())));
    lines
}
