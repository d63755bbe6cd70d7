//! What is said of an import: columns, runs, pictures, what is not known.

use std::fmt::Write as _;

use missing_physics_domains::Domain;
use missing_physics_domains::recording::unit_of;

use crate::choose::{Choice, From};
use crate::error::one_line;
use crate::names::words;
use crate::picture::picture;
use crate::rows::{Rows, part_of};
use crate::table::{Column, Table, Values};
use crate::units;

/// First values that are shown of a column.
const SHOWN: usize = 3;
/// Columns that are shown of one part of a file.
const MOST_SHOWN: usize = 60;

/// All there is to say.
pub(crate) struct Story<'a> {
    pub(crate) tables: &'a [Table],
    pub(crate) choices: &'a [Choice],
    pub(crate) rows: &'a Rows,
    pub(crate) unknown: &'a [String],
    pub(crate) domain: &'static dyn Domain,
}

impl Story<'_> {
    pub(crate) fn tell(&self) -> String {
        let mut text = columns(self.tables, self.choices);
        for choice in self.choices.iter().filter(|c| matches!(c.from, From::Constant)) {
            let _ = writeln!(text, "  {} = {} in all rows", choice.target, choice.formula());
        }
        self.runs(&mut text);
        self.pictures(&mut text);
        let notes = self.notes();
        if !notes.is_empty() {
            text.push_str("\nnot known, or taken for granted\n");
            notes.iter().for_each(|note| text.push_str(&format!("  {note}\n")));
        }
        text
    }

    fn runs(&self, text: &mut String) {
        let rows: usize = self.rows.runs.iter().map(|(_, rows)| rows.len()).sum();
        let shown: Vec<String> = self
            .rows
            .runs
            .iter()
            .take(8)
            .map(|(label, rows)| format!("{} ({} rows)", one_line(label), rows.len()))
            .collect();
        let more = self.rows.runs.len().saturating_sub(8);
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "\n{} runs, {rows} rows: {}{more}", self.rows.runs.len(), shown.join(", "));
    }

    /// Runs one after the other, over the first number that rises, or row by row.
    fn pictures(&self, text: &mut String) {
        let total: usize = self.rows.runs.iter().map(|(_, rows)| rows.len()).sum();
        for (name, values) in &self.rows.columns {
            let Values::Numbers(values) = values else { continue };
            if name == "t_s" || name == "bounce" || name == "step" {
                continue;
            }
            let order = self.rows.runs.iter().flat_map(|(_, rows)| rows);
            let points: Vec<(f64, f64)> =
                order.enumerate().map(|(k, row)| (k as f64 / total.max(1) as f64, values[*row])).collect();
            let _ = writeln!(text, "\n{name}, row after row");
            picture(&points).iter().for_each(|line| text.push_str(&format!("  {line}\n")));
        }
    }

    /// What is not known, or was taken for granted.
    pub(crate) fn notes(&self) -> Vec<String> {
        let mut notes = self.rows.remarks.clone();
        for choice in self.choices {
            let wanted = units::of_name(&choice.target).map(|(_, unit)| unit);
            if let (From::Column { title, unit: None, .. }, Some(_), false) =
                (&choice.from, wanted, choice.label)
            {
                let name = one_line(title);
                notes.push(format!(
                    "\"{name}\" has no unit: taken as {} (else --map {}=\"{name} [UNIT]\")",
                    unit_of(&choice.target),
                    choice.target
                ));
            }
            // A height that is called y is a guess.
            if let (From::Column { title, .. }, "z_m", false) =
                (&choice.from, choice.target.as_str(), choice.asked)
                && words(title).first().is_some_and(|w| w == "y")
            {
                notes.push(format!("\"{}\" is taken for the height: z_m points up", one_line(title)));
            }
        }
        if !self.unknown.is_empty() {
            notes.push(format!(
                "recording.toml holds the template's values for {}: write your own there, or give them by --set {}=VALUE",
                self.unknown.join(", "),
                self.unknown[0]
            ));
        }
        if self.domain.id() != "custom" || !self.choices.is_empty() {
            notes.push(
                "the noise of the channels: it is estimated (a calibration's goes into [noise])".into(),
            );
        }
        notes
    }
}

/// Files with their columns: units, first values, and what each is taken as.
pub(crate) fn columns(tables: &[Table], choices: &[Choice]) -> String {
    let part = part_of(choices, tables);
    let mut text = String::new();
    let mut listed: Vec<(&Option<String>, Vec<&str>)> = Vec::new();
    for table in tables {
        let file = one_line(&table.file.display().to_string());
        let part_name = table.part.as_ref().map(|p| format!(", {}", one_line(p))).unwrap_or_default();
        let titles: Vec<&str> = table.columns.iter().map(|c| c.title.as_str()).collect();
        let again = listed.iter().any(|(of, known)| **of == table.part && *known == titles);
        let _ = writeln!(
            text,
            "{file}{part_name}: {} rows{}",
            table.rows(),
            if again { ", the same columns" } else { "" }
        );
        table.remarks.iter().for_each(|remark| text.push_str(&format!("  {}\n", one_line(remark))));
        if again {
            continue;
        }
        let used = |column: &Column| {
            choices.iter().find(|c| match &c.from {
                From::Column { part: of, .. } => c.is_of(column) && *of == table.part,
                From::Constant => false,
            })
        };
        let mut lines = vec![["column".to_owned(), "unit".into(), "first values".into(), String::new()]];
        for column in table.columns.iter().take(MOST_SHOWN) {
            let first: Vec<String> =
                (0..table.rows().min(SHOWN)).map(|row| clip(&column.values.show(row), 16)).collect();
            let taken = match used(column) {
                Some(choice) => {
                    let other = if table.part == part || choice.target == "t_s" {
                        ""
                    } else {
                        ", read at the other's times"
                    };
                    format!("{} = {}{other}", choice.target, one_line(&choice.formula()))
                }
                None if choices.is_empty() => String::new(),
                None => "not used".into(),
            };
            let unit = column.name.unit.clone().unwrap_or_default();
            lines.push([clip(&column.title, 48), clip(&unit, 12), first.join(", "), taken]);
        }
        text.push_str(&aligned(&lines));
        if table.columns.len() > MOST_SHOWN {
            let _ = writeln!(text, "  and {} more", table.columns.len() - MOST_SHOWN);
        }
        listed.push((&table.part, titles));
    }
    text
}

fn clip(text: &str, most: usize) -> String {
    let line = one_line(text);
    if line.chars().count() > most { line.chars().take(most - 1).chain(['…']).collect() } else { line }
}

fn aligned(lines: &[[String; 4]]) -> String {
    let width = |k: usize| lines.iter().map(|line| line[k].chars().count()).max().unwrap_or(0);
    let widths = [width(0), width(1), width(2)];
    let mut text = String::new();
    for line in lines {
        let mut row = String::from("  ");
        for (cell, width) in line.iter().zip(widths.into_iter().chain([0])) {
            let _ = write!(row, "{cell:width$}  ");
        }
        text.push_str(row.trim_end());
        text.push('\n');
    }
    text
}

/// What is not known of sound.
pub(crate) const SOUND_NOTES: [&str; 2] = [
    "where the microphones are: without microphones_m only times are heard",
    "the speed of sound: 343 m/s, unless temperature_k says otherwise",
];

/// What is to say of sound that is taken as it is.
pub(crate) fn sound(tables: &[Table]) -> String {
    let mut text = format!("\n{} files of sound, one a run\n", tables.len());
    for table in tables.iter().take(4) {
        if let Some(values) = table.columns.get(1).and_then(Column::numbers) {
            let points: Vec<(f64, f64)> =
                values.iter().enumerate().map(|(k, v)| (k as f64 / values.len() as f64, *v)).collect();
            let _ = writeln!(text, "\n{}", one_line(&table.file.display().to_string()));
            picture(&points).iter().for_each(|line| text.push_str(&format!("  {line}\n")));
        }
    }
    text.push_str("\nnot known, or taken for granted\n");
    SOUND_NOTES.iter().for_each(|note| text.push_str(&format!("  {note}\n")));
    text
}
