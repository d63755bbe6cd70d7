//! Which column of the files is which of the domain: as asked for, or proposed by name and unit.

use crate::error::{ImportError, in_quotes};
use crate::names::{Name, words};
use crate::table::{Column, Table, Values, short};
use crate::units::{SECONDS, Unit};
use crate::wanted::Target;

/// Where the values of a column of ours come from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum From {
    /// A column of the files: the part that it is in, its title, and its unit.
    Column { part: Option<String>, title: String, unit: Option<Unit> },
    /// One number in all rows.
    Constant,
}

/// A column of ours and where it comes from: `scale * SI value + offset`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Choice {
    pub(crate) target: String,
    pub(crate) label: bool,
    pub(crate) from: From,
    pub(crate) scale: f64,
    pub(crate) offset: f64,
    /// Whether somebody asked for it.
    pub(crate) asked: bool,
}

impl Choice {
    /// The value that is written for one of the file's.
    pub(crate) fn value(&self, raw: f64) -> f64 {
        let si = match self.from {
            From::Column { unit: Some(unit), .. } => unit.si(raw),
            _ => raw,
        };
        self.scale * si + self.offset
    }

    /// How it is worked out, for a person (`0.001 × "Höhe (mm)" + 1.2`).
    pub(crate) fn formula(&self) -> String {
        let From::Column { title, unit, .. } = &self.from else { return short(self.offset) };
        let unit = unit.unwrap_or(Unit { dimension: SECONDS, factor: 1.0, zero: 0.0 });
        let (factor, offset) = (self.scale * unit.factor, self.scale * unit.zero + self.offset);
        let times = match factor {
            1.0 => String::new(),
            -1.0 => "-".into(),
            factor => format!("{} × ", short(factor)),
        };
        let plus = match offset {
            0.0 => String::new(),
            offset if offset < 0.0 => format!(" - {}", short(-offset)),
            offset => format!(" + {}", short(offset)),
        };
        format!("{times}{}{plus}", in_quotes(title))
    }

    pub(crate) fn is_of(&self, column: &Column) -> bool {
        matches!(&self.from, From::Column { title, .. } if *title == column.title)
    }
}

/// Reads `TARGET=COLUMN`; `None` where nothing stands right of the sign: the column is to be left out.
///
/// # Errors
/// [`ImportError::Option`].
pub(crate) fn asked(
    option: &str,
    tables: &[Table],
    targets: &[Target],
    free: bool,
) -> Result<(String, Option<Choice>), ImportError> {
    let said = format!("--map {}", in_quotes(option));
    let fail = |why: String| ImportError::option(said.clone(), why);
    let (name, spec) = option
        .split_once('=')
        .ok_or_else(|| fail("expected COLUMN_OF_THE_DOMAIN=\"NAME IN THE FILE\"".into()))?;
    let (name, spec) = (name.trim(), spec.trim().trim_matches('"').trim());
    let known = targets.iter().find(|t| t.name == name);
    let sound = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let target = match known {
        Some(target) => target.clone(),
        None if name == "run" => Target::new("run", true),
        None if free && sound(name) => Target::new(name, false),
        None => {
            let names: Vec<&str> = targets.iter().map(|t| t.name.as_str()).chain(["run"]).collect();
            return Err(fail(format!(
                "the domain has no column {}, expected one of: {}",
                in_quotes(name),
                names.join(", ")
            )));
        }
    };
    if spec.is_empty() {
        return Ok((target.name, None));
    }
    let mut choice = Choice {
        target: target.name.clone(),
        label: target.label,
        from: From::Constant,
        scale: 1.0,
        offset: 0.0,
        asked: true,
    };
    let (found, scale, offset) = match resolve(spec, tables) {
        Some(found) => (found, 1.0, 0.0),
        None => match (spec.parse::<f64>(), arithmetic(spec, tables)) {
            (_, Some(found)) => found,
            (Ok(value), None) if value.is_finite() => {
                choice.offset = value;
                return Ok((target.name, Some(choice)));
            }
            _ => return Err(fail(format!("no such column; there are: {}", titles(tables).join(", ")))),
        },
    };
    let (part, column, given) = found;
    let numeric = column.numbers().is_some();
    if !target.label && !numeric {
        let first = in_quotes(&column.values.show(0));
        return Err(fail(format!("that column holds text ({first}), expected numbers")));
    }
    let unit = match given {
        Some(units) => {
            match units.iter().find(|u| target.unit.is_none_or(|wanted| wanted.dimension == u.dimension)) {
                Some(unit) => Some(*unit),
                None => return Err(fail(format!("its unit measures something else than {name}"))),
            }
        }
        None => column.unit_for(target.unit).map_err(|()| {
            let unit = column.name.unit.clone().unwrap_or_default();
            fail(format!("its unit {} measures something else than {name}", in_quotes(&unit)))
        })?,
    };
    choice.from = From::Column { part, title: column.title.clone(), unit };
    (choice.scale, choice.offset) = (scale, offset);
    Ok((target.name, Some(choice)))
}

/// A column, the part that it is in, and the unit that was given for it beyond its own.
type Found<'t> = (Option<String>, &'t Column, Option<Vec<Unit>>);

/// The column that a text names: its title, its name without unit, or with a unit that the file lacks.
fn resolve<'t>(spec: &str, tables: &'t [Table]) -> Option<Found<'t>> {
    let columns = || tables.iter().flat_map(|t| t.columns.iter().map(move |c| (t.part.clone(), c)));
    let lower = spec.to_lowercase();
    let exact = columns().find(|(_, c)| c.title == spec);
    let loose =
        || columns().find(|(_, c)| c.title.to_lowercase() == lower || c.name.stem.to_lowercase() == lower);
    if let Some((part, column)) = exact.or_else(loose) {
        return Some((part, column, None));
    }
    let name = Name::parse(spec);
    if name.units.is_empty() {
        return None;
    }
    let stem = name.stem.to_lowercase();
    let (part, column) =
        columns().find(|(_, c)| c.title.to_lowercase() == stem || c.name.stem.to_lowercase() == stem)?;
    Some((part, column, Some(name.units)))
}

/// `-COLUMN`, `COLUMN * 2`, `COLUMN + 1.2`, `-COLUMN - 0.3`: scale and offset in the unit of the domain.
fn arithmetic<'t>(spec: &str, tables: &'t [Table]) -> Option<(Found<'t>, f64, f64)> {
    if let Some(bare) = spec.strip_prefix('-')
        && let Some(found) = resolve(bare.trim(), tables)
    {
        return Some((found, -1.0, 0.0));
    }
    for (mark, sign) in [('+', 1.0), ('-', -1.0), ('*', 0.0)] {
        let Some((before, after)) = spec.rsplit_once(mark) else { continue };
        let Ok(number) = after.trim().parse::<f64>() else { continue };
        if !number.is_finite() {
            continue;
        }
        let before = before.trim();
        let inner =
            resolve(before, tables).map(|found| (found, 1.0, 0.0)).or_else(|| arithmetic(before, tables));
        if let Some((found, scale, offset)) = inner {
            return Some(match mark {
                '*' => (found, scale * number, offset * number),
                _ => (found, scale, offset + sign * number),
            });
        }
    }
    None
}

pub(crate) fn titles(tables: &[Table]) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    for column in tables.iter().flat_map(|t| &t.columns) {
        let title = in_quotes(&column.title);
        if !found.contains(&title) {
            found.push(title);
        }
    }
    let more = found.len().saturating_sub(40);
    found.truncate(40);
    found.extend((more > 0).then(|| format!("and {more} more")));
    found
}

/// Columns for the targets that nobody has settled, by name and unit: the surest first, each column once.
pub(crate) fn propose(tables: &[Table], targets: &[Target], settled: &[Choice]) -> Vec<Choice> {
    let mut pairs = Vec::new();
    for (order, target) in targets.iter().enumerate() {
        let mut seen: Vec<(&Option<String>, &str)> = Vec::new();
        for table in tables {
            for (at, column) in table.columns.iter().enumerate() {
                let whole = (&table.part, column.title.as_str());
                if seen.contains(&whole) || settled.iter().any(|c| c.is_of(column)) {
                    continue;
                }
                seen.push(whole);
                let native = target.name == "t_s" && table.time == Some(at);
                let native = native || (target.name == "run" && table.run == Some(at));
                if let Some((points, unit)) = points(target, column, native) {
                    let from = From::Column { part: table.part.clone(), title: column.title.clone(), unit };
                    pairs.push((points, order, at, target, from));
                }
            }
        }
    }
    pairs.sort_by_key(|(points, order, at, _, _)| (std::cmp::Reverse(*points), *order, *at));
    let mut chosen: Vec<Choice> = Vec::new();
    for (_, _, _, target, from) in pairs {
        let taken = |c: &Choice| c.target == target.name || c.from == from || same_column(&c.from, &from);
        if !chosen.iter().any(taken) {
            let (target, label) = (target.name.clone(), target.label);
            chosen.push(Choice { target, label, from, scale: 1.0, offset: 0.0, asked: false });
        }
    }
    chosen
}

fn same_column(a: &From, b: &From) -> bool {
    match (a, b) {
        (From::Column { part: p, title: t, .. }, From::Column { part: q, title: u, .. }) => p == q && t == u,
        _ => false,
    }
}

/// How well a column fits a target, if it does, and the unit in which it is read.
fn points(target: &Target, column: &Column, native: bool) -> Option<(u32, Option<Unit>)> {
    let numeric = matches!(column.values, Values::Numbers(_));
    if !target.label && !numeric {
        return None;
    }
    let unit = if target.label { None } else { column.unit_for(target.unit).ok()? };
    if native {
        return Some((900, unit));
    }
    if column.title == target.name {
        return Some((1000, unit));
    }
    let have = &column.name.words;
    let mut best = None;
    for (at, called) in target.called.iter().enumerate() {
        let wanted = words(called);
        let points = if *have == wanted {
            300
        } else if have.ends_with(&wanted) {
            200
        } else if wanted.iter().map(String::len).sum::<usize>() > 2
            && have.windows(wanted.len()).any(|w| *w == *wanted)
        {
            100
        } else {
            continue;
        };
        let points = points - 3 * at.min(30) as u32 + if unit.is_some() { 50 } else { 0 };
        best = best.max(Some(points));
    }
    best.map(|points| (points, unit))
}
