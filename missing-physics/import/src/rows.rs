//! The rows of a recording: columns of all files put together, turned into SI units and cut into runs.

use std::collections::HashMap;
use std::path::PathBuf;

use crate::choose::{Choice, From};
use crate::error::{ImportError, in_quotes};
use crate::table::{Column, Table, Values};

/// Columns that are the same on all rows of a run.
const CONSTANT: [&str; 7] =
    ["spin_x_rad_s", "spin_y_rad_s", "spin_z_rad_s", "volume_m3", "pressure_pa", "stretch_m", "site"];
/// Numbers beyond this are no measurement.
const LARGEST: f64 = 1e12;
/// A pause of so many usual steps begins a new run.
const PAUSE: f64 = 20.0;
/// Decimal digits that are written.
const DIGITS: usize = 11;

/// How rows become runs.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Cut {
    /// A pause longer than this (s) begins a new run.
    pub(crate) gap_s: Option<f64>,
    /// So many rows are a run.
    pub(crate) every: Option<usize>,
    /// Rows a second, where no column tells the time.
    pub(crate) rate_hz: Option<f64>,
}

/// Rows in runs.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    /// Names and cells of the columns, without `run`.
    pub(crate) columns: Vec<(String, Values)>,
    /// Label and rows of each run.
    pub(crate) runs: Vec<(String, Vec<usize>)>,
    pub(crate) remarks: Vec<String>,
    /// The file that each row comes from.
    pub(crate) files: Vec<PathBuf>,
}

/// The part of the files whose rows become the recording's: the one that most columns are in.
pub(crate) fn part_of(choices: &[Choice], tables: &[Table]) -> Option<String> {
    let mut votes: Vec<(&Option<String>, usize)> = Vec::new();
    for choice in choices.iter().filter(|c| c.target != "t_s" && c.target != "run") {
        if let From::Column { part, .. } = &choice.from {
            match votes.iter_mut().find(|(of, _)| *of == part) {
                Some((_, count)) => *count += 1,
                None => votes.push((part, 1)),
            }
        }
    }
    let most = votes.iter().map(|(_, count)| *count).max();
    let first = votes.into_iter().find(|(_, count)| Some(*count) == most).map(|(part, _)| part.clone());
    first.unwrap_or_else(|| tables.first().and_then(|t| t.part.clone()))
}

/// Puts the chosen columns of all tables of a part together and cuts them into runs of at least `fewest` rows.
pub(crate) fn gather(
    tables: &[Table],
    choices: &[Choice],
    cut: Cut,
    domain: &str,
    fewest: usize,
) -> Result<Rows, ImportError> {
    let part = part_of(choices, tables);
    let mine: Vec<&Table> = tables.iter().filter(|t| t.part == part).collect();
    let mut rows = Rows::default();
    let (run, chosen): (Vec<&Choice>, Vec<&Choice>) = choices.iter().partition(|c| c.target == "run");
    rows.columns = chosen
        .iter()
        .map(|c| {
            (c.target.clone(), if c.label { Values::Labels(Vec::new()) } else { Values::Numbers(Vec::new()) })
        })
        .collect();
    let mut base: Vec<String> = Vec::new();
    let several = mine.iter().any(|t| t.file != mine[0].file);
    for table in &mine {
        for (choice, (_, cells)) in chosen.iter().zip(&mut rows.columns) {
            append(cells, choice, table, tables, choices)?;
        }
        let stem = table.file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        base.extend((0..table.rows()).map(|row| match run.first() {
            Some(choice) => label(choice, table, row),
            None if several => stem.clone(),
            None => String::new(),
        }));
        rows.files.extend((0..table.rows()).map(|_| table.file.clone()));
    }
    rows.condition(&mut base);
    let whole = rows.complete(domain == "motion");
    let dropped = base.len() - whole.len();
    if dropped > 0 {
        let names: Vec<&str> = rows.columns.iter().map(|(name, _)| name.as_str()).collect();
        if whole.is_empty() {
            let file = mine.first().map(|t| t.file.clone()).unwrap_or_default();
            return Err(ImportError::NoRows {
                file,
                columns: names.into_iter().map(str::to_owned).collect(),
            });
        }
        rows.remarks.push(format!("{dropped} rows without a number in {} are left out", names.join(", ")));
    }
    rows.cut(&base, whole, cut, domain);
    rows.clock(cut, domain)?;
    rows.runs.retain(|(_, rows)| !rows.is_empty());
    let short: Vec<String> =
        rows.runs.iter().filter(|(_, r)| r.len() < fewest).map(|(label, _)| in_quotes(label)).collect();
    if !short.is_empty() && short.len() < rows.runs.len() {
        rows.runs.retain(|(_, r)| r.len() >= fewest);
        rows.remarks.push(format!("runs of fewer than {fewest} rows are left out: {}", brief(&short)));
    }
    rows.drop_unfit(choices);
    Ok(rows)
}

fn brief(names: &[String]) -> String {
    let more = names.len().saturating_sub(8);
    let mut text = names[..names.len() - more].join(", ");
    if more > 0 {
        text.push_str(&format!(" and {more} more"));
    }
    text
}

fn find<'t>(table: &'t Table, choice: &Choice) -> Option<&'t Column> {
    table.columns.iter().find(|c| choice.is_of(c))
}

fn label(choice: &Choice, table: &Table, row: usize) -> String {
    match (&choice.from, find(table, choice)) {
        (_, Some(column)) => column.values.show(row).trim().to_owned(),
        _ => choice.formula(),
    }
}

/// Appends what a table holds of a choice.
fn append(
    cells: &mut Values,
    choice: &Choice,
    table: &Table,
    tables: &[Table],
    all: &[Choice],
) -> Result<(), ImportError> {
    let n = table.rows();
    let From::Column { part, title, .. } = &choice.from else {
        if let Values::Numbers(cells) = cells {
            cells.extend(std::iter::repeat_n(choice.offset, n));
        }
        return Ok(());
    };
    let lacks = |file: &std::path::Path| {
        ImportError::broken(file, format!("no column {}, which the other files have", in_quotes(title)))
    };
    if *part == table.part {
        let column = find(table, choice).ok_or_else(|| lacks(&table.file))?;
        match cells {
            Values::Labels(cells) => {
                cells.extend((0..n).map(|row| column.values.show(row).trim().to_owned()))
            }
            Values::Numbers(cells) => {
                let numbers = column.numbers().ok_or_else(|| {
                    ImportError::broken(
                        &table.file,
                        format!("{} holds text, expected numbers", in_quotes(title)),
                    )
                })?;
                cells.extend(numbers.iter().map(|v| choice.value(*v)));
            }
        }
        return Ok(());
    }
    // Of another topic: read at this one's times.
    let other =
        tables.iter().find(|t| t.file == table.file && t.part == *part).ok_or_else(|| lacks(&table.file))?;
    let time = |of: &Table| {
        let asked = all
            .iter()
            .find(|c| c.target == "t_s")
            .and_then(|c| find(of, c))
            .or(of.time.map(|at| &of.columns[at]));
        asked.and_then(Column::numbers).map(<[f64]>::to_vec)
    };
    let column = find(other, choice).and_then(Column::numbers);
    let (Some(here), Some(there), Some(column), Values::Numbers(cells)) =
        (time(table), time(other), column, cells)
    else {
        let why = format!("{} has rows of its own and no time to put it beside the others", in_quotes(title));
        return Err(ImportError::broken(&table.file, why));
    };
    let known: Vec<(f64, f64)> = there
        .into_iter()
        .zip(column.iter().copied())
        .filter(|(t, v)| t.is_finite() && v.is_finite())
        .collect();
    cells.extend(here.iter().map(|t| choice.value(between(&known, *t))));
    Ok(())
}

/// The value at a time on the line between its neighbours; NaN outside.
fn between(known: &[(f64, f64)], t: f64) -> f64 {
    let at = known.partition_point(|(time, _)| *time < t);
    match (at.checked_sub(1).and_then(|k| known.get(k)), known.get(at)) {
        (_, Some((time, value))) if *time == t => *value,
        (Some((t0, v0)), Some((t1, v1))) if t1 > t0 => v0 + (v1 - v0) * (t - t0) / (t1 - t0),
        _ => f64::NAN,
    }
}

impl Rows {
    /// A column of numbers.
    pub(crate) fn numbers(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|(n, _)| n == name).and_then(|(_, values)| match values {
            Values::Numbers(numbers) => Some(numbers.as_slice()),
            Values::Labels(_) => None,
        })
    }

    /// Where nothing else tells runs apart, a condition does.
    fn condition(&mut self, base: &mut [String]) {
        if base.iter().any(|label| !label.is_empty()) {
            return;
        }
        let several = |values: &Values| (1..values.len()).any(|row| values.show(row) != values.show(0));
        let found = self.columns.iter().find(|(name, values)| {
            ["pressure_pa", "stretch_m", "site"].contains(&name.as_str()) && several(values)
        });
        if let Some((name, values)) = found {
            base.iter_mut().enumerate().for_each(|(row, label)| *label = values.show(row));
            self.remarks.push(format!("nothing tells runs apart: each {name} is taken for a run"));
        }
    }

    /// Rows in which nothing is missing; with `gaps` only the time has to be there.
    fn complete(&self, gaps: bool) -> Vec<usize> {
        let rows = self.columns.first().map_or(0, |(_, values)| values.len());
        let whole = |row: &usize| {
            self.columns.iter().all(|(name, values)| match values {
                Values::Labels(labels) => !labels[*row].is_empty(),
                Values::Numbers(numbers) => (gaps && name != "t_s") || numbers[*row].abs() <= LARGEST,
            })
        };
        (0..rows).filter(whole).collect()
    }

    fn cut(&mut self, base: &[String], whole: Vec<usize>, cut: Cut, domain: &str) {
        let mut places: HashMap<&str, usize> = HashMap::new();
        let mut groups: Vec<(&str, Vec<usize>)> = Vec::new();
        for row in whole {
            let at = *places.entry(base[row].as_str()).or_insert_with(|| {
                groups.push((base[row].as_str(), Vec::new()));
                groups.len() - 1
            });
            groups[at].1.push(row);
        }
        let unnamed = groups.len() == 1 && groups[0].0.is_empty();
        let times = self.numbers("t_s").map(<[f64]>::to_vec);
        let counter = ["bounce", "step"].iter().find_map(|name| self.numbers(name)).map(<[f64]>::to_vec);
        let along = ["trajectory", "slosh", "custom", "motion"].contains(&domain);
        let mut runs = Vec::new();
        for (label, mut rows) in groups {
            if let Some(times) = &times {
                self.remarks.extend(without_odd_times(times, &mut rows));
            }
            let pause = cut.gap_s.or_else(|| {
                let usual = times.as_deref().map(|t| usual_step(t, &rows));
                usual.filter(|step| unnamed && along && *step > 0.0).map(|step| PAUSE * step)
            });
            let mut pieces: Vec<Vec<usize>> = Vec::new();
            for row in rows {
                let new = match pieces.last().map(Vec::as_slice) {
                    None => true,
                    Some([first, .., last]) | Some([first @ last]) => {
                        let back = times.as_ref().is_some_and(|t| {
                            t[row] < t[*last] && (t[row] - t[*first]) <= 0.5 * (t[*last] - t[*first])
                        });
                        let pause =
                            pause.is_some_and(|p| times.as_ref().is_some_and(|t| t[row] - t[*last] > p));
                        let anew = counter.as_ref().is_some_and(|c| c[row] <= c[*last]);
                        back || pause || anew
                    }
                    Some([]) => false,
                };
                let full = cut.every.is_some_and(|n| pieces.last().is_some_and(|piece| piece.len() >= n));
                if new || full {
                    pieces.push(Vec::new());
                }
                if let Some(piece) = pieces.last_mut() {
                    piece.push(row);
                }
            }
            let several = pieces.len() > 1;
            for (k, piece) in pieces.into_iter().enumerate() {
                let label = match (label, several) {
                    ("", _) => (k + 1).to_string(),
                    (label, true) => format!("{label}-{}", k + 1),
                    (label, false) => label.to_owned(),
                };
                runs.push((label, piece));
            }
        }
        if unnamed && runs.len() > 1 && cut == (Cut { rate_hz: cut.rate_hz, ..Cut::default() }) {
            let count = runs.len();
            self.remarks.push(format!(
                "{count} runs, cut where the time pauses or begins anew: --run or --every says it better"
            ));
        } else if unnamed && runs.len() == 1 {
            self.remarks
                .push("one run: no column, file or pause tells runs apart (--run, --gap, --every)".into());
        }
        self.runs = runs;
    }

    /// Times that rise in each run, from a zero that makes sense.
    fn clock(&mut self, cut: Cut, domain: &str) -> Result<(), ImportError> {
        if let (None, Some(rate)) = (self.numbers("t_s"), cut.rate_hz) {
            let mut times = vec![f64::NAN; self.files.len()];
            for (_, rows) in &self.runs {
                rows.iter().enumerate().for_each(|(k, row)| times[*row] = k as f64 / rate);
            }
            self.columns.insert(0, ("t_s".into(), Values::Numbers(times)));
            return Ok(());
        }
        let Some(mut times) = self.numbers("t_s").map(<[f64]>::to_vec) else { return Ok(()) };
        let (mut standing, mut early, mut moved, mut all) = (0, 0, 0, 0);
        for (_, rows) in &mut self.runs {
            let before = rows.len();
            all += before;
            if let (Some(&first), Some(&last)) = (rows.first(), rows.last()) {
                let (start, length) = (times[first], times[last] - times[first]);
                let negative = rows.iter().any(|row| times[*row] < 0.0);
                // The end of the motion is zero in `slosh`: what comes before is no decay.
                if domain == "slosh" && negative && times[last] > 0.0 {
                    rows.retain(|row| times[*row] >= 0.0);
                    early += before - rows.len();
                } else if negative || start > length {
                    rows.iter().for_each(|row| times[*row] -= start);
                    moved += usize::from(start != 0.0);
                }
            }
            let mut latest = f64::NEG_INFINITY;
            let rising = rows.len();
            if !["dough-roll", "liquid-tilt"].contains(&domain) {
                rows.retain(|row| {
                    times[*row] > latest && {
                        latest = times[*row];
                        true
                    }
                });
            }
            standing += rising - rows.len();
        }
        if 5 * standing > all {
            return Err(ImportError::option(
                "t_s",
                format!(
                    "the time stands still or runs back in {standing} of {all} rows: say how often rows come by --rate HZ"
                ),
            ));
        }
        let mut say = |count: usize, what: &str| {
            if count > 0 {
                self.remarks.push(format!("{count} {what}"));
            }
        };
        say(standing, "rows whose time does not rise are left out");
        say(early, "rows before t = 0 are left out: the motion ends there");
        say(moved, "runs begin far from t = 0: their first row is taken for zero");
        if let Some((_, values)) = self.columns.iter_mut().find(|(name, _)| name == "t_s") {
            *values = Values::Numbers(times);
        }
        Ok(())
    }

    /// Leaves out what nobody asked for and the domain would refuse: what should be constant in a run and is not.
    fn drop_unfit(&mut self, choices: &[Choice]) {
        let asked = |name: &str| choices.iter().any(|c| c.target == name && c.asked);
        let constant = |values: &Values| {
            self.runs.iter().all(|(_, rows)| {
                rows.iter().all(|row| match values {
                    Values::Labels(labels) => labels[*row] == labels[rows[0]],
                    Values::Numbers(numbers) => numbers[*row] == numbers[rows[0]],
                })
            })
        };
        let unfit: Vec<String> = self
            .columns
            .iter()
            .filter(|(name, values)| CONSTANT.contains(&name.as_str()) && !asked(name) && !constant(values))
            .map(|(name, _)| name.clone())
            .collect();
        for name in unfit {
            self.columns.retain(|(n, _)| *n != name);
            self.remarks.push(format!("{name} changes within a run: it is not used"));
        }
    }

    /// The table as CSV.
    pub(crate) fn to_csv(&self) -> String {
        let mut text = String::from("run");
        for (name, _) in &self.columns {
            text.push(',');
            text.push_str(name);
        }
        text.push('\n');
        for (label, rows) in &self.runs {
            for &row in rows {
                text.push_str(&cell(label));
                for (_, values) in &self.columns {
                    text.push(',');
                    match values {
                        Values::Labels(labels) => text.push_str(&cell(&labels[row])),
                        Values::Numbers(numbers) if numbers[row].is_finite() => {
                            text.push_str(&written(numbers[row]))
                        }
                        Values::Numbers(_) => {}
                    }
                }
                text.push('\n');
            }
        }
        text
    }
}

/// Takes away rows whose time stands apart from those of both neighbours, which are close to each other: one that was mistyped would begin a run of its
/// own, or take what follows it along.
fn without_odd_times(times: &[f64], rows: &mut Vec<usize>) -> Option<String> {
    /// Neighbours are close within so many usual steps, and what is further away from either is apart.
    const CLOSE: f64 = 3.0;
    let far = CLOSE * usual_step(times, rows);
    let odd = |w: &[usize]| {
        let [before, at, after] = [w[0], w[1], w[2]].map(|row| times[row]);
        let close = before < after && after - before <= far;
        (close && (at - after > far || before - at > far)).then(|| (w[1], [before, at, after]))
    };
    let found: Vec<(usize, [f64; 3])> = rows.windows(3).filter_map(odd).collect();
    rows.retain(|row| found.iter().all(|(odd, _)| odd != row));
    let said = |(_, [before, at, after]): &(usize, [f64; 3])| {
        format!("{} between {} and {}", written(*at), written(*before), written(*after))
    };
    let all: Vec<String> = found.iter().map(said).collect();
    (!all.is_empty())
        .then(|| format!("rows whose time is not one of its place are left out, t_s = {}", brief(&all)))
}

/// The usual time from row to row.
fn usual_step(times: &[f64], rows: &[usize]) -> f64 {
    let mut steps: Vec<f64> =
        rows.windows(2).map(|w| times[w[1]] - times[w[0]]).filter(|s| *s > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// A number without the dust of its last digits.
fn written(value: f64) -> String {
    let rounded = format!("{value:.DIGITS$e}").parse::<f64>().unwrap_or(value);
    let size = rounded.abs();
    if size == 0.0 || (1e-5..1e15).contains(&size) { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// A label as a cell of a CSV: on one line, quoted where it has to be.
fn cell(label: &str) -> String {
    let label: String = label.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if label.contains([',', '"']) { format!("\"{}\"", label.replace('"', "\"\"")) } else { label }
}
