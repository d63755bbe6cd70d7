//! Tables as text: any delimiter, either decimal point, comments, units in names or in a row of their own.

use std::path::Path;

use crate::clock;
use crate::error::{ImportError, in_quotes};
use crate::table::{Column, Table, Values};
use crate::units::readings;

/// Lines that are looked at to find the delimiter.
const LOOKED_AT: usize = 400;
/// Delimiters, the surest first: a decimal comma is taken for one last.
const DELIMITERS: [u8; 5] = [b'\t', b';', b'|', b',', b' '];
/// More columns than this are no table.
const MOST_COLUMNS: usize = 4096;

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Vec<Table>, ImportError> {
    let mut remarks = Vec::new();
    let text = decode(path, bytes, &mut remarks)?;
    let (lines, comments) = lines(&text);
    if lines.is_empty() {
        return Err(ImportError::broken(path, "no line with a value: expected a table with a row of names"));
    }
    let (delimiter, width) = delimiter(&lines);
    if width > MOST_COLUMNS {
        return Err(ImportError::broken(path, format!("{width} columns, expected at most {MOST_COLUMNS}")));
    }
    let mut rows: Vec<Vec<String>> = lines.iter().map(|line| split(line, delimiter)).collect();
    rows.iter_mut().for_each(|row| trim(row, width));
    let begin = first_values(&rows, width);
    // The names stand above the values, or above a row of units.
    let above = |at: usize| at.checked_sub(1).filter(|at| rows[*at].len() == width);
    let units = above(begin).filter(|at| above(*at).is_some()).and_then(|at| row_of_units(&rows[at], width));
    let first = if units.is_some() { begin - 2 } else { above(begin).unwrap_or(begin) };
    let mut titles = titles(&rows[first], comments.last(), delimiter);
    for (title, unit) in titles.iter_mut().zip(units.unwrap_or_default()) {
        if !unit.is_empty() {
            *title = format!("{title} [{unit}]");
        }
    }
    if first > 0 {
        remarks.push(format!("{first} lines above the names of the columns are not read"));
    }
    let body: Vec<&Vec<String>> =
        rows[begin.min(rows.len())..].iter().filter(|row| row.len() == width).collect();
    let ragged = rows.len() - begin.min(rows.len()) - body.len();
    if ragged > 0 {
        remarks.push(format!("{ragged} lines with another number of cells than {width} are not read"));
    }
    if body.is_empty() {
        return Err(ImportError::broken(
            path,
            format!("no row of {width} cells below the names of the columns"),
        ));
    }
    let columns = titles.into_iter().enumerate().map(|(k, title)| {
        let cells: Vec<&str> = body.iter().map(|row| row[k].trim()).collect();
        column(title, &cells, &mut remarks)
    });
    let mut table = Table::new(path, columns.collect());
    table.remarks = remarks;
    Ok(vec![table])
}

/// Text of any usual encoding.
fn decode(path: &Path, bytes: &[u8], remarks: &mut Vec<String>) -> Result<String, ImportError> {
    let wide = |of: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|pair| of([pair[0], pair[1]])).collect();
        String::from_utf16_lossy(&units)
    };
    match bytes {
        [0xff, 0xfe, ..] => return Ok(wide(u16::from_le_bytes)),
        [0xfe, 0xff, ..] => return Ok(wide(u16::from_be_bytes)),
        _ => {}
    }
    if bytes.iter().take(4096).filter(|b| **b == 0).count() > 0 {
        return Err(ImportError::broken(path, "not text: its name says that it is a table"));
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(text.strip_prefix('\u{feff}').unwrap_or(text).to_owned()),
        Err(_) => {
            remarks.push("the text is not UTF-8: read as Windows-1252".into());
            Ok(bytes.iter().map(|b| if *b == 0x80 { '€' } else { char::from(*b) }).collect())
        }
    }
}

/// Lines with values, and comments above the first of them without their marks.
fn lines(text: &str) -> (Vec<&str>, Vec<&str>) {
    let (mut lines, mut comments) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let bare = line.trim();
        let comment = ["#", "%", "//"].iter().find_map(|mark| bare.strip_prefix(mark));
        match comment {
            Some(comment) if lines.is_empty() => comments.push(comment.trim()),
            Some(_) => {}
            // Excel writes `sep=;`.
            None if bare.is_empty() || bare.starts_with("sep=") => {}
            None => lines.push(line),
        }
    }
    (lines, comments)
}

/// The delimiter that cuts most lines into equally many cells, two at least, and how many.
fn delimiter(lines: &[&str]) -> (u8, usize) {
    let looked = &lines[lines.len().saturating_sub(LOOKED_AT)..];
    for delimiter in DELIMITERS {
        // Rows may end in empty cells, which come and go: they count where the names count them.
        let cells = |line: &&str| split(line, delimiter).len();
        let filled = |line: &&str| {
            let row = split(line, delimiter);
            row.iter().rposition(|cell| !cell.trim().is_empty()).map_or(1, |last| last + 1)
        };
        let whole = usual(looked.iter().map(cells)).filter(|width| named(lines, delimiter, *width));
        if let Some(width) = whole.or_else(|| usual(looked.iter().map(filled))) {
            return (delimiter, width);
        }
    }
    (b',', 1)
}

/// The number of cells that seven lines of ten have, if it is two at least.
fn usual(counts: impl Iterator<Item = usize>) -> Option<usize> {
    let mut tally = std::collections::BTreeMap::new();
    counts.for_each(|n| *tally.entry(n).or_insert(0_usize) += 1);
    let all: usize = tally.values().sum();
    let (&width, &lines) = tally.iter().max_by_key(|(width, lines)| (**lines, **width))?;
    (width > 1 && 10 * lines >= 7 * all).then_some(width)
}

/// Whether one of the first lines has that many names.
fn named(lines: &[&str], delimiter: u8, width: usize) -> bool {
    let names = |line: &&str| {
        let row = split(line, delimiter);
        row.len() == width && row.iter().all(|cell| !cell.trim().is_empty())
    };
    lines.iter().take(60).any(names)
}

/// The cells of a line; quotes hold a delimiter.
fn split(line: &str, delimiter: u8) -> Vec<String> {
    if delimiter == b' ' {
        return line.split_whitespace().map(str::to_owned).collect();
    }
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .from_reader(line.as_bytes());
    let mut record = csv::StringRecord::new();
    match reader.read_record(&mut record) {
        Ok(true) => record.iter().map(str::to_owned).collect(),
        _ => vec![line.to_owned()],
    }
}

/// Empty cells at the end of a row come and go.
fn trim(row: &mut Vec<String>, width: usize) {
    while row.len() > width && row.last().is_some_and(|cell| cell.trim().is_empty()) {
        row.pop();
    }
    if row.len() + 1 == width && width > 1 {
        row.push(String::new());
    }
}

/// The first row of values: numbers in it and in the next row, in the same columns.
fn first_values(rows: &[Vec<String>], width: usize) -> usize {
    let numbers =
        |row: &Vec<String>| -> Vec<bool> { row.iter().map(|c| !is_gap(c.trim()) && is_value(c)).collect() };
    let begins = |at: &usize| {
        let (row, next) = (&rows[*at], rows.get(at + 1).unwrap_or(&rows[*at]));
        row.len() == width && next.len() == width && {
            let (here, there) = (numbers(row), numbers(next));
            here.contains(&true) && here.iter().zip(&there).all(|(a, b)| !a || *b)
        }
    };
    // Where no two rows agree, the first that has any number; where none has, all below the first row.
    let any = |row: &Vec<String>| row.len() == width && numbers(row).contains(&true);
    (0..rows.len()).find(begins).or_else(|| rows.iter().position(any)).unwrap_or(1)
}

/// The names of the columns: a row of words, or the comment above a row of values.
fn titles(row: &[String], comment: Option<&&str>, delimiter: u8) -> Vec<String> {
    let names = |cells: &[String]| {
        let mut seen = std::collections::HashMap::new();
        let name = |(k, cell): (usize, &String)| {
            let cell = cell.trim();
            let name = if cell.is_empty() { format!("column {}", k + 1) } else { cell.to_owned() };
            let times = seen.entry(name.clone()).and_modify(|n| *n += 1).or_insert(1);
            if *times > 1 { format!("{name} ({times})") } else { name }
        };
        cells.iter().enumerate().map(name).collect()
    };
    if row.iter().any(|cell| !cell.trim().is_empty() && !is_value(cell)) {
        return names(row);
    }
    // numpy.savetxt writes the names into a comment.
    let above = comment.map(|comment| split(comment, delimiter)).filter(|cells| cells.len() == row.len());
    names(&above.unwrap_or_else(|| vec![String::new(); row.len()]))
}

fn is_value(cell: &str) -> bool {
    let cell = cell.trim();
    number(cell, false).is_some()
        || number(cell, true).is_some()
        || is_gap(cell)
        || clock::seconds(cell).is_some()
}

/// The units of a row in which nothing else stands.
fn row_of_units(row: &[String], width: usize) -> Option<Vec<String>> {
    let bare = |cell: &str| cell.trim().trim_matches(['[', ']', '(', ')']).trim().to_owned();
    let cells: Vec<String> = row.iter().map(|cell| bare(cell)).collect();
    let unit = |cell: &String| cell.is_empty() || cell == "-" || !readings(cell).is_empty();
    let any = cells.iter().any(|cell| !cell.is_empty() && cell.parse::<f64>().is_err());
    (row.len() == width && any && cells.iter().all(unit)).then_some(cells)
}

fn is_gap(cell: &str) -> bool {
    cell.is_empty()
        || ["nan", "na", "n/a", "null", "none", "-", "--", "?", "#n/a"]
            .contains(&cell.to_lowercase().as_str())
}

/// A number with a decimal point, or with a decimal comma.
fn number(cell: &str, comma: bool) -> Option<f64> {
    let sign = |c: char| if c == '\u{2212}' { '-' } else { c };
    let plain: String = match comma {
        false => cell.chars().map(sign).collect(),
        // 1.234,5 and 1 234,5
        true => cell
            .chars()
            .filter(|c| !['.', ' ', '\u{a0}', '\''].contains(c))
            .map(sign)
            .collect::<String>()
            .replace(',', "."),
    };
    let begins = plain.trim_start_matches(['-', '+']).starts_with(|c: char| c.is_ascii_digit() || c == '.');
    plain.parse::<f64>().ok().filter(|v| begins && v.is_finite())
}

fn column(title: String, cells: &[&str], remarks: &mut Vec<String>) -> Column {
    let filled: Vec<&str> = cells.iter().copied().filter(|cell| !is_gap(cell)).collect();
    let commas = filled.iter().any(|cell| cell.contains(','));
    // A point and no comma anywhere is a decimal point.
    let comma = commas && filled.iter().all(|cell| number(cell, true).is_some() || !cell.contains(','));
    let read = |cell: &&str| if comma { number(cell, true) } else { number(cell, false) };
    let count = filled.iter().filter(|cell| read(cell).is_some()).count();
    if count == filled.len() || (count > 0 && 20 * count >= 19 * filled.len()) {
        if count < filled.len() {
            let odd = filled.iter().find(|cell| read(cell).is_none()).copied().unwrap_or_default();
            let odd = in_quotes(odd);
            remarks.push(format!(
                "{}: {} cells such as {odd} are no numbers",
                in_quotes(&title),
                filled.len() - count
            ));
        }
        let values = cells.iter().map(|cell| read(cell).unwrap_or(f64::NAN));
        return Column::new(title, Values::Numbers(values.collect()));
    }
    let times: Option<Vec<f64>> = filled.iter().map(|cell| clock::seconds(cell)).collect();
    if times.is_some() {
        let values = cells.iter().map(|cell| clock::seconds(cell).unwrap_or(f64::NAN));
        return Column::with_unit(title, "s", Values::Numbers(values.collect()));
    }
    Column::new(title, Values::Labels(cells.iter().map(|cell| (*cell).to_owned()).collect()))
}
