//! Columns for Python: `numpy.load(file)["mu_s"]`.

use std::io::{Cursor, Write};

use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

/// A file that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ColumnsError {
    /// A table's values do not make whole rows.
    #[error("{name} has {received} values, which make no rows of {width}")]
    Rows {
        /// The table.
        name: String,
        /// Values that came.
        received: usize,
        /// Values in a row.
        width: usize,
    },
    /// The archive.
    #[error("the archive could not be made: {0}")]
    Archive(#[from] zip::result::ZipError),
    /// Its bytes.
    #[error("the archive could not be made: {0}")]
    Bytes(#[from] std::io::Error),
}

/// A named table, row by row; one column wide, it is a vector.
#[derive(Debug, Clone, PartialEq)]
pub struct Table<'a> {
    /// What Python knows it by.
    pub name: &'a str,
    /// Values in a row.
    pub width: usize,
    /// All values.
    pub values: Vec<f64>,
}

/// An NPZ archive of tables of 64-bit floats (NPY format 1.0, not compressed).
///
/// # Errors
/// [`ColumnsError::Rows`]; the others where memory is short.
pub fn npz(tables: &[Table<'_>]) -> Result<Vec<u8>, ColumnsError> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    for table in tables {
        let (received, width) = (table.values.len(), table.width);
        if width == 0 || received % width != 0 {
            return Err(ColumnsError::Rows { name: table.name.to_owned(), received, width });
        }
        archive.start_file(format!("{}.npy", table.name), options)?;
        archive.write_all(&header(received / width, width))?;
        for value in &table.values {
            archive.write_all(&value.to_le_bytes())?;
        }
    }
    Ok(archive.finish()?.into_inner())
}

/// Magic, version, length and dictionary; with its end the header fills whole 64 bytes.
fn header(rows: usize, width: usize) -> Vec<u8> {
    let shape = if width == 1 { format!("({rows},)") } else { format!("({rows}, {width})") };
    let mut text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    let before = 10;
    let padding = 63 - (before + text.len()) % 64;
    text.push_str(&" ".repeat(padding));
    text.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((text.len() as u16).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use super::*;

    /// numpy 2.4: numpy.lib.format.write_array_header_1_0 gives the same 128 bytes for this shape.
    #[test]
    fn a_header_is_what_numpy_writes() {
        let bytes = header(3, 2);
        assert_eq!(bytes.len(), 128);
        assert_eq!(&bytes[..10], b"\x93NUMPY\x01\x00\x76\x00");
        assert!(bytes[10..].starts_with(b"{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }"));
        assert_eq!(header(1, 1).len() % 64, 0);
    }

    #[test]
    fn tables_come_back_and_ragged_ones_are_refused() {
        let table = Table { name: "theta", width: 2, values: vec![1.0, 2.0, -3.5, f64::MIN_POSITIVE] };
        let bytes = npz(&[table]).unwrap();
        let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
        let mut file = archive.by_name("theta.npy").unwrap();
        let mut raw = Vec::new();
        std::io::copy(&mut file, &mut raw).unwrap();
        let values: Vec<f64> =
            raw[128..].chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(values, [1.0, 2.0, -3.5, f64::MIN_POSITIVE]);
        let ragged = Table { name: "x", width: 2, values: vec![1.0; 3] };
        assert!(matches!(npz(&[ragged]), Err(ColumnsError::Rows { received: 3, width: 2, .. })));
    }
}
