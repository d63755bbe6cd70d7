//! Sound and other signals in WAV: a column for each channel, between -1 and 1.

use std::path::Path;

use hound::{SampleFormat, WavReader};

use crate::error::ImportError;
use crate::table::{Column, Table, Values};

pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Vec<Table>, ImportError> {
    let broken = |e: hound::Error| ImportError::broken(path, format!("no sound in a form that is read: {e}"));
    let mut reader = WavReader::new(bytes).map_err(broken)?;
    let spec = reader.spec();
    let width = usize::from(spec.channels);
    if width == 0 || spec.sample_rate == 0 || !(1..=32).contains(&spec.bits_per_sample) {
        return Err(ImportError::broken(path, "sound without channels or sample rate"));
    }
    let samples: Vec<f64> = match spec.sample_format {
        SampleFormat::Float => reader.samples::<f32>().map(|s| s.map(f64::from)).collect::<Result<_, _>>(),
        SampleFormat::Int => {
            let full = f64::from(1_u32 << (spec.bits_per_sample - 1));
            reader.samples::<i32>().map(|s| s.map(|s| f64::from(s) / full)).collect::<Result<_, _>>()
        }
    }
    .map_err(broken)?;
    let rows = samples.len() / width;
    let rate = f64::from(spec.sample_rate);
    let mut columns =
        vec![Column::with_unit("time", "s", Values::Numbers((0..rows).map(|i| i as f64 / rate).collect()))];
    for k in 0..width {
        let values = (0..rows).map(|row| samples[row * width + k]).collect();
        columns.push(Column::new(format!("channel {}", k + 1), Values::Numbers(values)));
    }
    let mut table = Table::new(path, columns);
    table.time = Some(0);
    Ok(vec![table])
}
