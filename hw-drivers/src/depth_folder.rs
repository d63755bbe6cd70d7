//! Depth pictures in a folder that fills: 16-bit PNG files, as cameras' programs and data sets write them.
//!
//! A file's name without its ending is its time in s (`1305031102.160407.png`, the convention of the TUM RGB-D data set,
//! doi:10.1109/IROS.2012.6385773). Files are taken in the order of their times; a file that is still being written is waited for.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use hw_traits::ErrorType;
use hw_traits::camera::DepthCamera;
use hw_traits::clock::Stamped;
use hw_traits::picture::{Intrinsics, Picture};

use crate::error::{DriverError, within};

/// The largest picture that is read, bytes.
const LARGEST: usize = 256 << 20;

/// A folder as a depth camera.
#[derive(Debug)]
pub struct DepthFolder {
    folder: PathBuf,
    intrinsics: Intrinsics,
    depth_unit_m: f64,
    timeout_s: f64,
    last_s: f64,
    size: Option<(usize, usize)>,
}

impl DepthFolder {
    /// Pictures of a pinhole, whose counts are `depth_unit_m` each (0.001 of most cameras, 0.0002 of the TUM data set); zero is unseen.
    /// A picture is waited for `timeout_s` at most.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for numbers that are none.
    pub fn new(
        folder: impl Into<PathBuf>,
        intrinsics: Intrinsics,
        depth_unit_m: f64,
        timeout_s: f64,
    ) -> Result<Self, DriverError> {
        within("focal length in pixels", intrinsics.fx.min(intrinsics.fy), f64::MIN_POSITIVE, 1e6)?;
        within("unit of depth in m", depth_unit_m, 1e-9, 1.0)?;
        within("timeout in s", timeout_s, 0.0, 3600.0)?;
        let (last_s, size) = (f64::NEG_INFINITY, None);
        Ok(Self { folder: folder.into(), intrinsics, depth_unit_m, timeout_s, last_s, size })
    }

    /// The pictures that are newer than the last one, by their times in ns.
    fn waiting(&self) -> Result<BTreeMap<i64, (f64, PathBuf)>, DriverError> {
        let link =
            |e: std::io::Error| DriverError::of_io(&self.folder.display().to_string(), "list", &e, 0.0);
        let mut waiting = BTreeMap::new();
        for entry in std::fs::read_dir(&self.folder).map_err(link)? {
            let path = entry.map_err(link)?.path();
            if path.extension().is_none_or(|e| e != "png") {
                continue;
            }
            let time =
                path.file_stem().and_then(|n| n.to_str()?.parse::<f64>().ok()).filter(|t| t.is_finite());
            let Some(t_s) = time else {
                let words = "expected a time in s as its name, as in 12.345.png".into();
                return Err(DriverError::File { file: path.display().to_string(), words });
            };
            if t_s > self.last_s {
                waiting.insert((t_s * 1e9) as i64, (t_s, path));
            }
        }
        Ok(waiting)
    }

    /// A picture; none while it is being written.
    fn read(&self, path: &Path) -> Result<Option<Picture<f32>>, DriverError> {
        let wrong = |words: String| DriverError::File { file: path.display().to_string(), words };
        let bytes = std::fs::read(path).map_err(|e| wrong(e.to_string()))?;
        // The last chunk of a PNG file.
        if !bytes.ends_with(&[b'I', b'E', b'N', b'D', 0xAE, 0x42, 0x60, 0x82]) {
            return Ok(None);
        }
        let limits = png::Limits { bytes: LARGEST };
        let mut reader = png::Decoder::new_with_limits(std::io::Cursor::new(bytes), limits)
            .read_info()
            .map_err(|e| wrong(e.to_string()))?;
        let (width, kind) = (reader.info().width as usize, reader.output_color_type());
        if kind != (png::ColorType::Grayscale, png::BitDepth::Sixteen) {
            return Err(wrong(format!("expected 16-bit grey, received {kind:?}")));
        }
        let size = reader.output_buffer_size().filter(|s| *s <= LARGEST);
        let mut buffer = vec![0; size.ok_or_else(|| wrong("it is too large".into()))?];
        reader.next_frame(&mut buffer).map_err(|e| wrong(e.to_string()))?;
        let depth = |b: &[u8]| match u16::from_be_bytes([b[0], b[1]]) {
            0 => f32::NAN,
            counts => (f64::from(counts) * self.depth_unit_m) as f32,
        };
        let picture = Picture::new(width, buffer.chunks_exact(2).map(depth).collect());
        picture.map(Some).map_err(|e| wrong(e.to_string()))
    }
}

impl ErrorType for DepthFolder {
    type Error = DriverError;
}

impl DepthCamera for DepthFolder {
    fn intrinsics(&self) -> Intrinsics {
        self.intrinsics
    }

    fn depth_m(&mut self) -> Result<Stamped<Picture<f32>>, DriverError> {
        let begin = Instant::now();
        loop {
            if let Some((t_s, path)) = self.waiting()?.into_values().next() {
                // A file that is wrong is said once, and left out.
                let read = self.read(&path);
                if read.as_ref().is_ok_and(Option::is_none) && begin.elapsed().as_secs_f64() < self.timeout_s
                {
                    std::thread::sleep(Duration::from_millis(2));
                    continue;
                }
                self.last_s = t_s;
                let file = path.display().to_string();
                let unfinished =
                    || DriverError::File { file: file.clone(), words: "it was never finished".into() };
                let value = read?.ok_or_else(unfinished)?;
                let size = (value.width(), value.height());
                if *self.size.get_or_insert(size) != size {
                    let words = format!("expected {:?} pixels, received {size:?}", self.size.unwrap_or(size));
                    return Err(DriverError::File { file, words });
                }
                return Ok(Stamped { t_s, value });
            }
            if begin.elapsed().as_secs_f64() >= self.timeout_s {
                let device = self.folder.display().to_string();
                return Err(DriverError::Late { device, waited_s: self.timeout_s });
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}
