//! What each domain asks of its columns beyond their names.

use std::path::PathBuf;

use crate::choose::{self, Choice, From};
use crate::error::{ImportError, in_quotes};
use crate::rows::Rows;
use crate::table::{Table, Values};
use crate::units::{self, Dimension, Unit};
use crate::wanted::Wanted;

/// Rows without which a run says nothing.
pub(crate) fn fewest(domain: &str) -> usize {
    match domain {
        "trajectory" | "motion" => 4,
        "slosh" => 8,
        "indentation" | "liquid-tilt" | "custom" | "bounce" => 3,
        _ => 1,
    }
}

/// Leaves out proposals that a domain does not take together.
pub(crate) fn agree(domain: &str, choices: &mut Vec<Choice>) {
    let has = |choices: &[Choice], name: &str| choices.iter().any(|c| c.target == name);
    let unfit: Vec<&str> = match domain {
        "trajectory" => {
            let spins = ["spin_x_rad_s", "spin_y_rad_s", "spin_z_rad_s"];
            let space = ["x_m", "y_m", "z_m"].iter().all(|name| has(choices, name));
            let mut unfit = vec![];
            unfit.extend(has(choices, "z_m").then_some("accel_z_m_s2"));
            unfit.extend(["x_m", "y_m"].iter().filter(|_| !space));
            unfit.extend(spins.iter().filter(|_| !space || !spins.iter().all(|s| has(choices, s))));
            unfit
        }
        "slosh" if has(choices, "tau_z_nm") && has(choices, "fx_n") => {
            let asked = |name: &str| choices.iter().any(|c| c.asked && c.target == name);
            vec![if asked("fx_n") && !asked("tau_z_nm") { "tau_z_nm" } else { "fx_n" }]
        }
        "bounce" if !(has(choices, "x_m") && has(choices, "y_m")) => vec!["x_m", "y_m"],
        "indentation" => {
            let conditions = ["pressure_pa", "stretch_m", "site"];
            let first = conditions.iter().filter(|name| has(choices, name));
            let first =
                first.max_by_key(|name| choices.iter().any(|c| c.asked && c.target == ***name)).copied();
            conditions.into_iter().filter(|name| Some(*name) != first).collect()
        }
        _ => Vec::new(),
    };
    choices.retain(|c| c.asked || !unfit.contains(&c.target.as_str()));
}

/// Whether a proposed column really tells runs apart: whole numbers or words that come more than once.
pub(crate) fn tells_runs(choice: &Choice, tables: &[Table]) -> bool {
    let columns = tables.iter().flat_map(|t| t.columns.iter().filter(|c| choice.is_of(c)));
    let (mut rows, mut distinct) = (0, std::collections::BTreeSet::new());
    for column in columns {
        if column.numbers().is_some_and(|n| n.iter().any(|v| v.is_finite() && v.fract() != 0.0)) {
            return false;
        }
        rows += column.values.len();
        distinct.extend((0..column.values.len()).map(|row| column.values.show(row)));
    }
    2 * distinct.len() <= rows
}

/// Numbers impacts and rolls where no column does.
pub(crate) fn count(domain: &str, rows: &mut Rows) {
    let name = match domain {
        "bounce" => "bounce",
        "dough-roll" => "step",
        _ => return,
    };
    if rows.numbers(name).is_some() {
        return;
    }
    let mut counted = vec![0.0; rows.files.len()];
    for (_, of) in &rows.runs {
        of.iter().enumerate().for_each(|(k, row)| counted[*row] = (k + 1) as f64);
    }
    rows.columns.insert(0, (name.into(), Values::Numbers(counted)));
    rows.remarks.push(format!("{name} is counted from 1 in each run, as if none were missing"));
}

/// Pictures that the table names, beside the file that names them; they are copied under plain names.
pub(crate) fn pictures(rows: &mut Rows) -> Result<Vec<(PathBuf, String)>, ImportError> {
    let Some((_, Values::Labels(names))) = rows.columns.iter_mut().find(|(name, _)| name == "depth_image")
    else {
        return Ok(Vec::new());
    };
    let mut copies = Vec::new();
    for (_, of) in &rows.runs {
        for &row in of {
            let folder = rows.files[row].parent().map(PathBuf::from).unwrap_or_default();
            let from = folder.join(&names[row]);
            if !from.is_file() {
                let why = format!("no picture {} beside it", in_quotes(&names[row]));
                return Err(ImportError::broken(&rows.files[row], why));
            }
            let name = format!("{}.png", copies.len() + 1);
            names[row] = name.clone();
            copies.push((from, name));
        }
    }
    Ok(copies)
}

/// Segments of a curve by the names that other machines give them.
pub(crate) fn segments(rows: &mut Rows) {
    let Some((_, Values::Labels(labels))) = rows.columns.iter_mut().find(|(name, _)| name == "segment")
    else {
        return;
    };
    for label in labels.iter_mut() {
        let lower = label.to_lowercase();
        let known = match lower.as_str() {
            "load" | "loading" | "approach" | "extend" | "trace" | "indent" | "belastung" => "load",
            "hold" | "pause" | "dwell" | "holding" | "halten" => "hold",
            "unload" | "unloading" | "retract" | "withdraw" | "retrace" | "entlastung" => "unload",
            _ => continue,
        };
        *label = known.to_owned();
    }
    if labels.iter().any(|l| !["load", "hold", "unload"].contains(&l.as_str())) {
        rows.columns.retain(|(name, _)| name != "segment");
        rows.remarks.push("segment holds other words than load, hold and unload: it is not used".into());
    }
}

/// Asks for what a domain cannot be read without.
pub(crate) fn required(
    domain: &str,
    wanted: &Wanted,
    names: &[&str],
    tables: &[Table],
) -> Result<(), ImportError> {
    let has = |name: &str| names.contains(&name);
    let either = |a: &'static str, b: &'static str| if has(b) { b } else { a };
    let mut needed: Vec<String> = match domain {
        "trajectory" => vec!["t_s", either("z_m", "accel_z_m_s2")],
        "slosh" => vec!["t_s", either("tau_z_nm", "fx_n")],
        "indentation" => vec!["delta_m", "force_n"],
        "liquid-tilt" => vec!["theta_rad", "fx_n", "fy_n", "tau_z_nm"],
        "bounce" => vec!["t_s"],
        "grain-pour" => vec!["funnel_height_m", "depth_image"],
        "dough-roll" => vec![
            "length_m",
            "width_m",
            "height_m",
            "throw_m",
            "depth_m",
            "next_length_m",
            "next_width_m",
            "next_height_m",
        ],
        _ => Vec::new(),
    }
    .into_iter()
    .map(str::to_owned)
    .collect();
    needed.extend(wanted.named.iter().cloned());
    needed.extend((domain == "motion").then(|| "t_s".to_owned()));
    if wanted.like.is_none() && domain == "motion" {
        let why = "its equations stand in recording.toml: write them there first (new motion FOLDER), then say --like FOLDER";
        return Err(ImportError::Domain { domain: domain.into(), why: why.into() });
    }
    needed.retain(|name| !has(name));
    if needed.is_empty() {
        Ok(())
    } else {
        Err(ImportError::Missing { missing: needed, there: choose::titles(tables) })
    }
}

/// What a simulator's table holds: inputs and channels by name.
pub(crate) fn custom<'n>(names: &[&'n str]) -> Result<(Vec<&'n str>, Vec<&'n str>), ImportError> {
    let measured = |name: &&&str| names.iter().any(|n| n.strip_prefix("sim_") == Some(**name));
    let channels: Vec<&str> = names.iter().filter(measured).copied().collect();
    let inputs: Vec<&str> =
        names.iter().filter(|n| !n.starts_with("sim_") && !channels.contains(*n)).copied().collect();
    let why = if channels.is_empty() {
        "no column of what your simulation says: --map sim_angle_rad=\"NAME\" beside --map angle_rad=\"NAME\", or --like FOLDER, a recording that names your program"
    } else if inputs.is_empty() {
        "no input: name the time, or what was set, by --map t_s=\"NAME\" or --rate HZ"
    } else {
        return Ok((inputs, channels));
    };
    Err(ImportError::Domain { domain: "custom".into(), why: why.into() })
}

/// Proposals of `custom`: columns of which another is the simulation (`angle`, `angle sim`).
pub(crate) fn simulated(tables: &[Table], settled: &[Choice], closed: &[String]) -> Vec<Choice> {
    const MARKS: [&str; 6] = ["sim", "simulated", "simulation", "model", "modell", "predicted"];
    let mut found = Vec::new();
    for table in tables {
        for simulation in &table.columns {
            let words = &simulation.name.words;
            let plain: Vec<&String> = words.iter().filter(|w| !MARKS.contains(&w.as_str())).collect();
            if plain.len() == words.len() || simulation.numbers().is_none() {
                continue;
            }
            let Some(measured) =
                table.columns.iter().find(|c| c.name.words.iter().collect::<Vec<_>>() == plain)
            else {
                continue;
            };
            let stem: Vec<&str> = plain.iter().map(|w| w.as_str()).collect();
            let unit = measured.name.units.first().copied();
            let name =
                format!("{}{}", stem.join("_"), unit.map_or_else(String::new, |u| format!("_{}", suffix(u))));
            let sound = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.is_ascii();
            for (target, column) in [(name.clone(), measured), (format!("sim_{name}"), simulation)] {
                let known =
                    settled.iter().any(|c| c.target == target || c.is_of(column)) || closed.contains(&target);
                if sound && !known {
                    let unit = column.name.units.first().copied().or(unit);
                    let from = From::Column { part: table.part.clone(), title: column.title.clone(), unit };
                    found.push(Choice { target, label: false, from, scale: 1.0, offset: 0.0, asked: false });
                }
            }
        }
    }
    found
}

/// How a name ends in a unit.
pub(crate) fn suffix(unit: Unit) -> &'static str {
    let known =
        |name: &&&str| units::suffix(name).is_some_and(|u| u.dimension == unit.dimension && u.factor == 1.0);
    const NAMES: [&str; 19] = [
        "m", "s", "kg", "rad", "n", "nm", "pa", "k", "v", "a", "m3", "m2", "m_s", "m_s2", "rad_s", "rad_s2",
        "n_m", "per_s", "per_m",
    ];
    let none: Dimension = [0; 6];
    NAMES.iter().find(known).copied().unwrap_or(if unit.dimension == none { "share" } else { "si" })
}
