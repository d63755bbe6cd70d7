//! NumPy's `.npy` and `.npz` (numpy.lib.format, versions 1 to 3): arrays of numbers of one or two axes, and structured ones of one.

use std::io::{Cursor, Read as _};
use std::path::Path;

use missing_physics_domains::recording::LARGEST_FILE;

use super::{Array, tables_of};
use crate::error::{ImportError, in_quotes};
use crate::table::Table;

pub(super) fn read_npy(path: &Path, bytes: &[u8]) -> Result<Vec<Table>, ImportError> {
    let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let arrays = arrays(&name, bytes).map_err(|why| ImportError::broken(path, why))?;
    Ok(tables_of(path, arrays))
}

pub(super) fn read_npz(path: &Path, bytes: &[u8]) -> Result<Vec<Table>, ImportError> {
    let broken = |why: String| ImportError::broken(path, why);
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(e.to_string()))?;
    let (mut found, mut left) = (Vec::new(), Vec::new());
    let mut room = LARGEST_FILE;
    for at in 0..archive.len() {
        let file = archive.by_index(at).map_err(|e| broken(e.to_string()))?;
        let name = file.name().map_err(|e| broken(e.to_string()))?.trim_end_matches(".npy").to_owned();
        let mut contents = Vec::new();
        // What it says of its size need not be true.
        let read =
            file.take(room + 1).read_to_end(&mut contents).map_err(|e| broken(format!("{name}: {e}")))?;
        room = room
            .checked_sub(read as u64)
            .ok_or_else(|| broken(format!("more than {LARGEST_FILE} bytes when it is unpacked")))?;
        match arrays(&name, &contents) {
            Ok(arrays) => found.extend(arrays),
            Err(why) => left.push(format!("{} is not read: {why}", in_quotes(&name))),
        }
    }
    if found.is_empty() {
        return Err(broken(left.into_iter().next().unwrap_or_else(|| "holds no array".into())));
    }
    let mut tables = tables_of(path, found);
    if let Some(first) = tables.first_mut() {
        first.remarks.extend(left);
    }
    Ok(tables)
}

/// The header of an array: its types by name, the order of its axes, its shape.
struct Header {
    fields: Vec<(String, Kind)>,
    fortran: bool,
    shape: Vec<usize>,
}

/// A number's type.
#[derive(Clone, Copy)]
struct Kind {
    big: bool,
    class: u8,
    size: usize,
}

fn arrays(name: &str, bytes: &[u8]) -> Result<Vec<Array>, String> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or("no array of NumPy (it has no magic number)")?;
    let length = match rest {
        [1, _, a, b, ..] => (4, usize::from(u16::from_le_bytes([*a, *b]))),
        [2 | 3, _, a, b, c, d, ..] => (6, u32::from_le_bytes([*a, *b, *c, *d]) as usize),
        _ => return Err("an unknown version of NumPy's format".into()),
    };
    let end = length.0 + length.1;
    let text = rest.get(length.0..end).ok_or("cut off within its header")?;
    let header = header(&String::from_utf8_lossy(text))?;
    let row: usize = header.fields.iter().map(|(_, kind)| kind.size).sum();
    let (rows, width) = match *header.shape.as_slice() {
        [] => (1, 1),
        [rows] => (rows, 1),
        [rows, width] => (rows, width),
        _ => return Err(format!("{} axes, expected one or two", header.shape.len())),
    };
    let data = &rest[end..];
    let expected = rows.checked_mul(width).and_then(|n| n.checked_mul(row)).ok_or("an impossible shape")?;
    if data.len() < expected || row == 0 || width == 0 || (width > 1 && header.fields.len() > 1) {
        return Err(format!("cut off: {} bytes of {expected}", data.len()));
    }
    let mut offset = 0;
    let mut found = Vec::new();
    for (field, kind) in &header.fields {
        let value = |at: usize, column: usize| {
            let place = if header.fortran { column * rows + at } else { at * width + column };
            let from = place * row + offset;
            number(&data[from..from + kind.size], *kind)
        };
        let values = (0..rows).flat_map(|at| (0..width).map(move |column| (at, column)));
        let name = if field.is_empty() { name.to_owned() } else { field.clone() };
        found.push(Array {
            name,
            rows,
            width,
            values: values.map(|(at, column)| value(at, column)).collect(),
        });
        offset += kind.size;
    }
    Ok(found)
}

/// A Python dictionary of `descr`, `fortran_order` and `shape`.
fn header(text: &str) -> Result<Header, String> {
    let value = |key: &str| {
        let at = text.find(&format!("'{key}'"))? + key.len() + 2;
        Some(text[at..].trim_start().strip_prefix(':')?.trim_start())
    };
    let (Some(descr), Some(order), Some(shape)) = (value("descr"), value("fortran_order"), value("shape"))
    else {
        return Err("its header lacks descr, fortran_order or shape".into());
    };
    let shape = shape.strip_prefix('(').and_then(|s| s.split_once(')')).ok_or("its shape is no tuple")?.0;
    let numbers = shape.split(',').map(str::trim).filter(|s| !s.is_empty());
    let shape: Vec<usize> =
        numbers.map(str::parse).collect::<Result<_, _>>().map_err(|_| "its shape is no tuple of numbers")?;
    let fields = if descr.starts_with('[') {
        // [('t', '<f8'), ('z', '<f8')]
        let list = &descr[..descr.find(']').unwrap_or(descr.len())];
        let quoted: Vec<&str> = list.split('\'').skip(1).step_by(2).collect();
        let pairs = quoted.chunks_exact(2).map(|pair| Ok((pair[0].to_owned(), kind(pair[1])?)));
        pairs.collect::<Result<Vec<_>, String>>()?
    } else {
        let kind = kind(descr.trim_start_matches('\'').split('\'').next().unwrap_or_default())?;
        vec![(String::new(), kind)]
    };
    Ok(Header { fields, fortran: order.starts_with("True"), shape })
}

fn kind(text: &str) -> Result<Kind, String> {
    let unread = || format!("values of the type {}, expected numbers", in_quotes(text));
    let (order, rest) = text.split_at_checked(1).ok_or_else(unread)?;
    let (class, size) = rest.split_at_checked(1).ok_or_else(unread)?;
    let kind =
        Kind { big: order == ">", class: class.as_bytes()[0], size: size.parse().map_err(|_| unread())? };
    let sound = match kind.class {
        b'f' => [4, 8].contains(&kind.size),
        b'i' | b'u' => [1, 2, 4, 8].contains(&kind.size),
        b'b' => kind.size == 1,
        _ => false,
    };
    if sound && "<>|=".contains(order) { Ok(kind) } else { Err(unread()) }
}

fn number(bytes: &[u8], kind: Kind) -> f64 {
    let mut wide = [0_u8; 8];
    let n = bytes.len();
    bytes.iter().enumerate().for_each(|(i, b)| wide[if kind.big { n - 1 - i } else { i }] = *b);
    let bits = u64::from_le_bytes(wide);
    match (kind.class, n) {
        (b'f', 4) => f64::from(f32::from_bits(bits as u32)),
        (b'f', _) => f64::from_bits(bits),
        (b'i', 1) => f64::from(bits as u8 as i8),
        (b'i', 2) => f64::from(bits as u16 as i16),
        (b'i', 4) => f64::from(bits as u32 as i32),
        (b'i', _) => bits as i64 as f64,
        _ => bits as f64,
    }
}
