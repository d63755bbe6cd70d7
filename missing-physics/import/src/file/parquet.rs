//! Parquet: columns of numbers, text and lists of numbers; LeRobot's layout with the names of its motors.

use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type as Physical};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;
use parquet::schema::types::Type;

use super::{guarded, opened};
use crate::error::{ImportError, in_quotes};
use crate::table::{Column, Table, Values};

/// More rows than this are not read at once.
const MOST_ROWS: i64 = 20_000_000;
/// Lists longer than this are no state of a machine.
const LONGEST_LIST: usize = 256;

pub(super) fn read(path: &Path) -> Result<Vec<Table>, ImportError> {
    guarded(path, || table(path)).map(|table| vec![table])
}

fn table(path: &Path) -> Result<Table, ImportError> {
    let broken = |e: parquet::errors::ParquetError| ImportError::broken(path, e.to_string());
    let file = File::open(path).map_err(|e| opened(path, &e))?;
    let reader = SerializedFileReader::new(file).map_err(broken)?;
    let metadata = reader.metadata().file_metadata();
    if metadata.num_rows() > MOST_ROWS {
        let why = format!("{} rows, expected at most {MOST_ROWS}", metadata.num_rows());
        return Err(ImportError::broken(path, why));
    }
    let schema = metadata.schema();
    let (kept, left): (Vec<_>, Vec<_>) = schema.get_fields().iter().cloned().partition(is_read);
    if kept.is_empty() {
        return Err(ImportError::broken(path, "no column of numbers or text"));
    }
    let names: Vec<String> = kept.iter().map(|field| field.name().to_owned()).collect();
    let clocks: Vec<Option<f64>> = kept.iter().map(ticks).collect();
    let projection = Type::group_type_builder(schema.name()).with_fields(kept).build().map_err(broken)?;
    let mut cells: Vec<Vec<Field>> = vec![Vec::new(); names.len()];
    for row in reader.get_row_iter(Some(projection)).map_err(broken)? {
        for ((_, field), cells) in row.map_err(broken)?.into_columns().into_iter().zip(&mut cells) {
            cells.push(field);
        }
    }
    let set = DataSet::of(path);
    let mut columns = Vec::new();
    for ((name, cells), clock) in names.iter().zip(cells).zip(clocks) {
        match clock {
            Some(tick) => columns.push(clock_column(name, &cells, tick)),
            None => columns.extend(set.columns(name, &cells)),
        }
    }
    let mut table = Table::new(path, columns);
    let find = |name: &str| table.columns.iter().position(|c| c.title == name);
    (table.time, table.run) = (find("timestamp"), find("episode_index"));
    if !left.is_empty() {
        let names: Vec<String> = left.iter().map(|f| in_quotes(f.name())).collect();
        table.remarks.push(format!("neither numbers nor text, not read: {}", names.join(", ")));
    }
    if let Some(fps) = set.frames_per_second.filter(|_| table.time.is_some()) {
        table.remarks.push(format!("a data set of {fps} frames a second"));
    }
    Ok(table)
}

/// Whether a column holds numbers, text or a list of numbers.
fn is_read(field: &Arc<Type>) -> bool {
    if field.is_primitive() {
        let text = field.get_basic_info().converted_type() == ConvertedType::UTF8
            || matches!(field.get_basic_info().logical_type_ref(), Some(LogicalType::String));
        return match field.get_physical_type() {
            Physical::BYTE_ARRAY => text,
            Physical::FIXED_LEN_BYTE_ARRAY | Physical::INT96 => false,
            _ => true,
        };
    }
    let list = field.get_basic_info().converted_type() == ConvertedType::LIST
        || matches!(field.get_basic_info().logical_type_ref(), Some(LogicalType::List));
    // list > list > element
    let element = field.get_fields().first().and_then(|inner| {
        if inner.is_primitive() { Some(inner.clone()) } else { inner.get_fields().first().cloned() }
    });
    list && element.is_some_and(|e| {
        e.is_primitive()
            && !matches!(
                e.get_physical_type(),
                Physical::BYTE_ARRAY | Physical::FIXED_LEN_BYTE_ARRAY | Physical::INT96
            )
    })
}

/// Seconds in one count of a column of times of day; `None` for other columns.
fn ticks(field: &Arc<Type>) -> Option<f64> {
    match (field.get_basic_info().logical_type_ref(), field.get_basic_info().converted_type()) {
        (Some(LogicalType::Timestamp(time)), _) => Some(match time.unit {
            TimeUnit::MILLIS => 1e-3,
            TimeUnit::MICROS => 1e-6,
            TimeUnit::NANOS => 1e-9,
        }),
        (_, ConvertedType::TIMESTAMP_MILLIS) => Some(1e-3),
        (_, ConvertedType::TIMESTAMP_MICROS) => Some(1e-6),
        _ => None,
    }
}

/// Times since the first one: counts since 1970 have more digits than a number of 64 bits.
fn clock_column(name: &str, cells: &[Field], tick: f64) -> Column {
    let count = |cell: &Field| match cell {
        Field::Long(v) | Field::TimestampMillis(v) | Field::TimestampMicros(v) => Some(*v),
        _ => None,
    };
    let first = cells.iter().find_map(count).unwrap_or(0);
    let seconds = |cell: &Field| count(cell).map_or(f64::NAN, |v| v.wrapping_sub(first) as f64 * tick);
    Column::with_unit(name, "s", Values::Numbers(cells.iter().map(seconds).collect()))
}

fn number(field: &Field) -> Option<f64> {
    Some(match field {
        Field::Bool(v) => f64::from(u8::from(*v)),
        Field::Byte(v) => f64::from(*v),
        Field::Short(v) => f64::from(*v),
        Field::Int(v) | Field::Date(v) | Field::TimeMillis(v) => f64::from(*v),
        Field::Long(v) | Field::TimeMicros(v) | Field::TimestampMillis(v) | Field::TimestampMicros(v) => {
            *v as f64
        }
        Field::UByte(v) => f64::from(*v),
        Field::UShort(v) => f64::from(*v),
        Field::UInt(v) => f64::from(*v),
        Field::ULong(v) => *v as f64,
        Field::Float16(v) => f64::from(f32::from(*v)),
        Field::Float(v) => f64::from(*v),
        Field::Double(v) => *v,
        _ => return None,
    })
}

/// What `meta/info.json` of a data set of LeRobot says.
#[derive(Default)]
struct DataSet {
    info: serde_json::Value,
    frames_per_second: Option<f64>,
}

impl DataSet {
    /// The description beside `data/`, one to three folders above the file.
    fn of(path: &Path) -> Self {
        let found = path.ancestors().skip(1).take(4).find_map(|folder| {
            let text = std::fs::read_to_string(folder.join("meta/info.json")).ok()?;
            serde_json::from_str::<serde_json::Value>(&text).ok()
        });
        let info = found.unwrap_or_default();
        Self { frames_per_second: info["fps"].as_f64(), info }
    }

    /// The names of the elements of a list: of motors, as a list or below one key.
    fn elements(&self, column: &str) -> Vec<&str> {
        let names = &self.info["features"][column]["names"];
        let list =
            names.as_array().or_else(|| names.as_object()?.values().find_map(serde_json::Value::as_array));
        list.map(|names| names.iter().filter_map(serde_json::Value::as_str).collect()).unwrap_or_default()
    }

    fn columns(&self, name: &str, cells: &[Field]) -> Vec<Column> {
        let width =
            cells.iter().map(|c| if let Field::ListInternal(list) = c { list.len() } else { 0 }).max();
        if let Some(width) = width.filter(|w| *w > 0) {
            let element = |cell: &Field, k: usize| match cell {
                Field::ListInternal(list) => list.elements().get(k).and_then(number).unwrap_or(f64::NAN),
                _ => f64::NAN,
            };
            let names = self.elements(name);
            let title = |k: usize| match names.get(k).filter(|_| names.len() == width) {
                Some(motor) => format!("{name}[{motor}]"),
                None => format!("{name}[{k}]"),
            };
            let width = width.min(LONGEST_LIST);
            let values = |k: usize| Values::Numbers(cells.iter().map(|c| element(c, k)).collect());
            return (0..width).map(|k| Column::new(title(k), values(k))).collect();
        }
        let unit = cells.iter().find_map(|cell| match cell {
            Field::TimeMillis(_) => Some("ms"),
            Field::TimeMicros(_) => Some("us"),
            _ => None,
        });
        let text = |cell: &Field| if let Field::Str(text) = cell { text.clone() } else { String::new() };
        let values = if cells.iter().any(|c| matches!(c, Field::Str(_))) {
            Values::Labels(cells.iter().map(text).collect())
        } else {
            Values::Numbers(cells.iter().map(|c| number(c).unwrap_or(f64::NAN)).collect())
        };
        // A data set's clock is in seconds.
        let unit = unit.or((name == "timestamp" && self.frames_per_second.is_some()).then_some("s"));
        vec![match unit {
            Some(unit) => Column::with_unit(name, unit, values),
            None => Column::new(name, values),
        }]
    }
}
