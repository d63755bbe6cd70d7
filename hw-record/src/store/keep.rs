use std::path::Path;

use hw_traits::picture::Picture;

use crate::error::RecordError;
use crate::source::Reading;

/// Keeps what is read; what was put before a flush is there if the program is killed after it.
pub(crate) trait Store {
    /// Keeps a reading of the source of a number, with its arrival on this computer's clock, s.
    fn put(&mut self, number: usize, arrival_s: f64, reading: &Reading) -> Result<(), RecordError>;

    fn flush(&mut self) -> Result<(), RecordError>;

    /// Ends it.
    fn finish(&mut self) -> Result<(), RecordError>;
}

pub(super) fn failed(path: &Path) -> impl Fn(std::io::Error) -> RecordError + use<> {
    let path = path.to_owned();
    move |error| RecordError::Io { path: path.clone(), error }
}

/// A depth picture as a 16-bit PNG of counts of `unit_m`; what is not seen, or too far for 16 bits, is zero.
pub(super) fn png_of(picture: &Picture<f32>, unit_m: f64) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width() as u32, picture.height() as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let count = |depth: &f32| {
        let counts = (f64::from(*depth) / unit_m).round();
        // NaN is in no range.
        if (1.0..=65_535.0).contains(&counts) { counts as u16 } else { 0 }
    };
    let counts: Vec<u8> = picture.data().iter().flat_map(|d| count(d).to_be_bytes()).collect();
    encoder.write_header()?.write_image_data(&counts)?;
    Ok(bytes)
}
