use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use super::keep::{Store, failed, png_of};
use crate::error::RecordError;
use crate::source::{Contents, Kind, Reading, Source};

/// `NAME.csv` for each source, beside it `NAME.wav` for sound and a folder `NAME` of PNG files for pictures.
pub(crate) struct Folder {
    files: Vec<Stream>,
}

struct Stream {
    path: PathBuf,
    rows: BufWriter<File>,
    beside: Beside,
}

enum Beside {
    Nothing,
    Sound { file: hound::WavWriter<BufWriter<File>>, channels: usize, instants: u64 },
    Pictures { folder: PathBuf, unit_m: f64 },
}

fn unheard(error: hound::Error) -> std::io::Error {
    std::io::Error::other(error)
}

impl Folder {
    pub(crate) fn new(folder: &Path, sources: &[Source]) -> Result<Self, RecordError> {
        std::fs::create_dir_all(folder).map_err(failed(folder))?;
        let files: Result<Vec<Stream>, RecordError> =
            sources.iter().map(|source| Stream::new(folder, source)).collect();
        Ok(Self { files: files? })
    }
}

impl Stream {
    fn new(folder: &Path, source: &Source) -> Result<Self, RecordError> {
        let path = folder.join(format!("{}.csv", source.name));
        let mut rows = BufWriter::new(File::create(&path).map_err(failed(&path))?);
        let (columns, beside) = match &source.kind {
            Kind::Numbers(columns) => (columns.join(","), Beside::Nothing),
            Kind::Sound { channels, rate_hz } => {
                let sound = folder.join(format!("{}.wav", source.name));
                let spec = hound::WavSpec {
                    channels: *channels,
                    sample_rate: *rate_hz,
                    bits_per_sample: 32,
                    sample_format: hound::SampleFormat::Float,
                };
                let file = hound::WavWriter::create(&sound, spec).map_err(unheard).map_err(failed(&sound))?;
                let channels = usize::from((*channels).max(1));
                ("first_instant,instants".into(), Beside::Sound { file, channels, instants: 0 })
            }
            Kind::Depth { intrinsics, unit_m } => {
                let pictures = folder.join(&source.name);
                std::fs::create_dir_all(&pictures).map_err(failed(&pictures))?;
                let pinhole = pictures.join("camera.toml");
                let (fx, fy, cx, cy) = (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy);
                let words = format!(
                    "fx_px = {fx}\nfy_px = {fy}\ncx_px = {cx}\ncy_px = {cy}\ndepth_unit_m = {unit_m}\n"
                );
                std::fs::write(&pinhole, words).map_err(failed(&pinhole))?;
                ("file".into(), Beside::Pictures { folder: pictures, unit_m: *unit_m })
            }
        };
        writeln!(rows, "arrival_s,t_s,{columns}").map_err(failed(&path))?;
        Ok(Self { path, rows, beside })
    }

    /// What stands in a row after the times.
    fn keep(&mut self, reading: &Reading) -> std::io::Result<String> {
        match (&reading.contents, &mut self.beside) {
            (Contents::Numbers(numbers), _) => {
                Ok(numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(","))
            }
            (Contents::Sound(samples), Beside::Sound { file, channels, instants }) => {
                samples.iter().try_for_each(|s| file.write_sample(*s)).map_err(unheard)?;
                let (first, count) = (*instants, (samples.len() / *channels) as u64);
                *instants += count;
                Ok(format!("{first},{count}"))
            }
            (Contents::Depth(picture), Beside::Pictures { folder, unit_m }) => {
                // Its name is its time, as `hw_drivers::depth_folder` reads it; it has that name when it is whole.
                let name = format!("{:.6}.png", reading.t_s);
                let whole = folder.join(&name);
                let part = whole.with_extension("part");
                std::fs::write(&part, png_of(picture, *unit_m).map_err(std::io::Error::other)?)?;
                std::fs::rename(&part, &whole)?;
                Ok(name)
            }
            _ => Err(std::io::Error::other("a reading of another kind than its source's")),
        }
    }
}

impl Store for Folder {
    fn put(&mut self, number: usize, arrival_s: f64, reading: &Reading) -> Result<(), RecordError> {
        let Some(stream) = self.files.get_mut(number) else { return Ok(()) };
        let row = stream.keep(reading).map_err(failed(&stream.path))?;
        writeln!(stream.rows, "{arrival_s:.6},{:.6},{row}", reading.t_s).map_err(failed(&stream.path))
    }

    fn flush(&mut self) -> Result<(), RecordError> {
        for stream in &mut self.files {
            // Sound first: a row then never tells of samples that are not there.
            if let Beside::Sound { file, .. } = &mut stream.beside {
                file.flush().map_err(unheard).map_err(failed(&stream.path))?;
            }
            stream.rows.flush().map_err(failed(&stream.path))?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        self.flush()
    }
}
