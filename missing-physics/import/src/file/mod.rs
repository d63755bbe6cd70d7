//! One file a format: bytes in, tables out.

#[cfg(feature = "mat")]
mod matlab;
#[cfg(feature = "mcap")]
mod mcap;
#[cfg(feature = "numpy")]
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(feature = "mcap")]
mod ros;
mod text;
#[cfg(feature = "wav")]
mod wav;

use std::path::{Path, PathBuf};

use missing_physics_domains::recording::LARGEST_FILE;

use crate::error::ImportError;
use crate::table::Table;
#[cfg(any(feature = "mat", feature = "numpy"))]
use crate::table::{Column, Values};

/// Reads all tables of a file, or of a folder that is a bag or a data set.
///
/// # Errors
/// [`ImportError`].
pub fn read(path: &Path) -> Result<Vec<Table>, ImportError> {
    let tables: Vec<Table> =
        files(path)?.iter().map(|file| one(file)).collect::<Result<Vec<_>, _>>()?.concat();
    numbers(path, tables)
}

/// The files of a folder that is a bag (`*.mcap`) or a data set (`data/**/*.parquet`); else the file itself.
fn files(path: &Path) -> Result<Vec<PathBuf>, ImportError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let found = below(path, 4)
        .map_err(|e| ImportError::Open { file: path.into(), why: e.to_string() })?
        .into_iter()
        .filter(|file| matches!(ending(file).as_str(), "mcap" | "parquet"))
        // Statistics and tasks of a data set are no rows of it.
        .filter(|file| !file.components().any(|c| c.as_os_str() == "meta"))
        .collect::<Vec<_>>();
    if found.is_empty() {
        let why = "a folder without .mcap or .parquet files: name the files in it";
        return Err(ImportError::Broken { file: path.into(), why: why.into() });
    }
    Ok(found)
}

/// All files below a folder, by name.
fn below(folder: &Path, depth: usize) -> std::io::Result<Vec<PathBuf>> {
    let mut entries =
        std::fs::read_dir(folder)?.map(|e| e.map(|e| e.path())).collect::<Result<Vec<_>, _>>()?;
    entries.sort();
    let mut found = Vec::new();
    for entry in entries {
        if entry.is_dir() && depth > 0 {
            found.extend(below(&entry, depth - 1)?);
        } else if entry.is_file() {
            found.push(entry);
        }
    }
    Ok(found)
}

pub(crate) fn ending(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Reads all tables of a file of this name that is in memory.
///
/// # Errors
/// [`ImportError`]; of the formats, Parquet is read from files only.
pub fn read_bytes(name: &Path, bytes: &[u8]) -> Result<Vec<Table>, ImportError> {
    let tables = match format(name)? {
        Format::Whole(read) => {
            within(name, bytes.len() as u64)?;
            read(name, bytes)?
        }
        #[cfg(feature = "mcap")]
        Format::Bag => mcap::read(name, bytes)?,
        #[cfg(feature = "parquet")]
        Format::Seekable(_) => {
            return Err(ImportError::broken(name, "Parquet is read from a file on disk, not from memory"));
        }
    };
    numbers(name, tables)
}

fn one(path: &Path) -> Result<Vec<Table>, ImportError> {
    let format = format(path)?;
    let metadata = std::fs::metadata(path).map_err(|e| opened(path, &e))?;
    if !metadata.is_file() {
        return Err(ImportError::Open { file: path.into(), why: "not a file".into() });
    }
    match format {
        Format::Whole(read) => {
            within(path, metadata.len())?;
            read(path, &std::fs::read(path).map_err(|e| opened(path, &e))?)
        }
        #[cfg(feature = "mcap")]
        Format::Bag => mcap::read(path, std::fs::File::open(path).map_err(|e| opened(path, &e))?),
        #[cfg(feature = "parquet")]
        Format::Seekable(read) => {
            within(path, metadata.len())?;
            read(path)
        }
    }
}

/// How a format is read.
enum Format {
    /// All of it at once.
    Whole(fn(&Path, &[u8]) -> Result<Vec<Table>, ImportError>),
    /// Piece by piece, however large it is.
    #[cfg(feature = "mcap")]
    Bag,
    /// Here and there, with what lies beside it.
    #[cfg(feature = "parquet")]
    Seekable(fn(&Path) -> Result<Vec<Table>, ImportError>),
}

/// The format that a name tells.
fn format(path: &Path) -> Result<Format, ImportError> {
    #[cfg(not(all(
        feature = "mat",
        feature = "mcap",
        feature = "numpy",
        feature = "parquet",
        feature = "wav"
    )))]
    let left_out = |feature| Err(ImportError::LeftOut { file: path.into(), feature });
    let instead = |why: &str| Err(ImportError::Broken { file: path.into(), why: why.into() });
    match ending(path).as_str() {
        "csv" | "tsv" | "txt" | "dat" | "asc" | "prn" | "tab" => Ok(Format::Whole(text::read)),
        #[cfg(feature = "mcap")]
        "mcap" => Ok(Format::Bag),
        #[cfg(feature = "parquet")]
        "parquet" | "pq" => Ok(Format::Seekable(parquet::read)),
        #[cfg(feature = "numpy")]
        "npy" => Ok(Format::Whole(numpy::read_npy)),
        #[cfg(feature = "numpy")]
        "npz" => Ok(Format::Whole(numpy::read_npz)),
        #[cfg(feature = "mat")]
        "mat" => Ok(Format::Whole(matlab::read)),
        #[cfg(feature = "wav")]
        "wav" | "wave" => Ok(Format::Whole(wav::read)),
        #[cfg(not(feature = "mcap"))]
        "mcap" => left_out("mcap"),
        #[cfg(not(feature = "parquet"))]
        "parquet" | "pq" => left_out("parquet"),
        #[cfg(not(feature = "numpy"))]
        "npy" | "npz" => left_out("numpy"),
        #[cfg(not(feature = "mat"))]
        "mat" => left_out("mat"),
        #[cfg(not(feature = "wav"))]
        "wav" | "wave" => left_out("wav"),
        "db3" => instead("a bag in SQLite: make it MCAP by \"ros2 bag convert\" with storage_id: mcap"),
        "bag" => instead("a bag of ROS 1: make it MCAP by \"mcap convert in.bag out.mcap\""),
        "xls" | "xlsx" | "ods" => instead("a spreadsheet: save the sheet as CSV"),
        "h5" | "hdf5" | "pkl" | "tdms" => instead("not read: save its columns as CSV, .npz or Parquet"),
        _ => Err(ImportError::UnknownKind { file: path.into() }),
    }
}

/// Refuses what is too large to be read at once.
fn within(path: &Path, bytes: u64) -> Result<(), ImportError> {
    if bytes > LARGEST_FILE {
        return Err(ImportError::TooLarge { file: path.into(), bytes, most: LARGEST_FILE });
    }
    Ok(())
}

/// Tables that hold something.
fn numbers(path: &Path, tables: Vec<Table>) -> Result<Vec<Table>, ImportError> {
    if tables.iter().all(|t| t.rows() == 0) {
        return Err(ImportError::broken(path, "no numbers were found in it"));
    }
    Ok(tables)
}

fn opened(path: &Path, error: &std::io::Error) -> ImportError {
    let why = match error.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        _ => error.to_string(),
    };
    ImportError::Open { file: path.into(), why }
}

/// What a reader of somebody else's does with broken bytes: a panic there is an error here.
#[cfg(any(feature = "mat", feature = "parquet"))]
fn guarded<T>(path: &Path, read: impl FnOnce() -> Result<T, ImportError>) -> Result<T, ImportError> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(read))
        .unwrap_or_else(|_| Err(ImportError::broken(path, "broken: its reader gave up")))
}

/// Arrays by name as tables: columns of equally many rows are one table, the longest first.
#[cfg(any(feature = "mat", feature = "numpy"))]
fn tables_of(path: &Path, arrays: Vec<Array>) -> Vec<Table> {
    let mut tables: Vec<Table> = Vec::new();
    let mut remarks = Vec::new();
    for array in arrays {
        let rows = array.rows;
        if rows < 2 {
            remarks.push(format!("{} is one number, not a column", crate::error::in_quotes(&array.name)));
            continue;
        }
        let columns = array.columns();
        match tables.iter_mut().find(|t| t.rows() == rows) {
            Some(table) => table.columns.extend(columns),
            None => tables.push(Table::new(path, columns)),
        }
    }
    tables.sort_by_key(|t| std::cmp::Reverse((t.columns.len(), t.rows())));
    if tables.len() > 1 {
        for table in &mut tables {
            table.part = Some(format!("arrays of {} rows", table.rows()));
        }
    }
    if let Some(first) = tables.first_mut() {
        first.remarks = remarks;
    }
    tables
}

/// An array of one or two axes, row after row.
#[cfg(any(feature = "mat", feature = "numpy"))]
struct Array {
    name: String,
    rows: usize,
    width: usize,
    values: Vec<f64>,
}

#[cfg(any(feature = "mat", feature = "numpy"))]
impl Array {
    fn columns(self) -> Vec<Column> {
        let Self { name, rows, width, values } = self;
        let column = |k: usize| {
            let title = if width == 1 { name.clone() } else { format!("{name}[{k}]") };
            Column::new(title, Values::Numbers((0..rows).map(|row| values[row * width + k]).collect()))
        };
        (0..width).map(column).collect()
    }
}
