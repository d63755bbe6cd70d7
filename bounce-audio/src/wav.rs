//! Sound files: RIFF WAVE with any number of channels, 16, 24 or 32-bit integers, 32 or
//! 64-bit floats.
//!
//! Chunks may come in any order after each other, with or without the pad byte that RIFF wants after an odd length; those that
//! hold no sound are skipped. Format: IBM and Microsoft 1991, *Multimedia Programming Interface and Data Specifications 1.0*;
//! `WAVE_FORMAT_EXTENSIBLE`: Microsoft, *Multiple channel audio data and WAVE files*.

use std::path::{Path, PathBuf};
use thiserror::Error;

/// Most channels that a recording may have.
const MOST_CHANNELS: u16 = 64;
/// Sample rates that are believed, Hz.
const RATES: std::ops::RangeInclusive<u32> = 1_000..=1_000_000;
/// Longest file that is read, bytes.
const LONGEST: u64 = 4 << 30;

/// The tail of every `WAVE_FORMAT_EXTENSIBLE` sub-format that stands for a plain format tag.
const GUID_TAIL: [u8; 14] = [0, 0, 0, 0, 0x10, 0, 0x80, 0, 0, 0xAA, 0, 0x38, 0x9B, 0x71];

/// A sound of one or more channels.
#[derive(Debug, Clone, PartialEq)]
pub struct Sound {
    /// Samples per second, Hz.
    pub rate_hz: f64,
    /// One vector of samples a channel, all of one length; full scale is 1 (floats may go beyond it).
    pub channels: Vec<Vec<f64>>,
}

/// Why a sound file cannot be read.
#[derive(Debug, Error)]
#[error("{}: {fault}", file.display())]
pub struct WavError {
    /// The file, as it was named.
    pub file: PathBuf,
    /// What is wrong with it.
    #[source]
    pub fault: Fault,
}

/// What is wrong with a sound file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Fault {
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// The file is longer than what is read.
    #[error("{got} bytes, expected at most {expected}")]
    TooLong {
        /// The limit, bytes.
        expected: u64,
        /// Its length, bytes.
        got: u64,
    },
    /// The file does not start as a RIFF WAVE file does.
    #[error("expected a WAVE file (RIFF....WAVE), got {got:?}")]
    NotWave {
        /// Its first bytes, as text.
        got: String,
    },
    /// A chunk is not there.
    #[error("no {expected:?} chunk")]
    Missing {
        /// Its name.
        expected: &'static str,
    },
    /// A chunk ends before its header says.
    #[error("truncated: chunk {chunk:?} should hold {expected} bytes, {got} are left")]
    Truncated {
        /// The chunk's name.
        chunk: String,
        /// Bytes that its header states.
        expected: usize,
        /// Bytes up to the end of the file.
        got: usize,
    },
    /// A field of the format has a value that is not read.
    #[error("{what} is {got}, expected {expected}")]
    Format {
        /// The field.
        what: &'static str,
        /// What can be read.
        expected: String,
        /// The value found.
        got: String,
    },
    /// The sound is not a whole number of samples of all channels.
    #[error("the sound has {got} bytes, expected a multiple of {frame}")]
    Ragged {
        /// Bytes of one sample of every channel.
        frame: usize,
        /// Bytes found.
        got: usize,
    },
    /// A sample is no number.
    #[error("channel {channel}, sample {sample}: expected a finite number, got {got}")]
    NotFinite {
        /// Channel, from 0.
        channel: usize,
        /// Sample, from 0.
        sample: usize,
        /// The value found.
        got: f64,
    },
}

/// How samples are written.
#[derive(Clone, Copy)]
enum Coding {
    Int,
    Float,
}

struct Format {
    channels: usize,
    rate_hz: u32,
    /// Bytes of one sample of one channel.
    bytes: usize,
    coding: Coding,
}

impl Sound {
    /// Reads a file; [`WavError`] names it and says what is wrong.
    pub fn read(file: impl AsRef<Path>) -> Result<Self, WavError> {
        let file = file.as_ref();
        let read = || {
            let got = std::fs::metadata(file)?.len();
            if got > LONGEST {
                return Err(Fault::TooLong { expected: LONGEST, got });
            }
            Self::from_bytes(&std::fs::read(file)?)
        };
        read().map_err(|fault| WavError { file: file.to_path_buf(), fault })
    }

    /// Reads the bytes of a file; [`Fault`] says what is wrong with them.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Fault> {
        let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
        if bytes.get(..4) != Some(b"RIFF") || bytes.get(8..12) != Some(b"WAVE") {
            return Err(Fault::NotWave { got: text(&bytes[..bytes.len().min(12)]) });
        }
        let (mut format, mut at) = (None, 12);
        while let Some(header) = bytes.get(at..at + 8) {
            let expected = u32_at(header, 4) as usize;
            let body = &bytes[at + 8..];
            let name = &header[..4];
            if matches!(name, b"fmt " | b"data") && body.len() < expected {
                return Err(Fault::Truncated { chunk: text(name), expected, got: body.len() });
            }
            match (name, &format) {
                (b"fmt ", _) => format = Some(Format::of(&body[..expected])?),
                (b"data", Some(format)) => return samples(&body[..expected], format),
                (b"data", None) => return Err(Fault::Missing { expected: "fmt " }),
                _ => {}
            }
            at = after(bytes, at + 8, expected);
        }
        Err(Fault::Missing { expected: if format.is_some() { "data" } else { "fmt " } })
    }

    /// Length, s.
    pub fn duration_s(&self) -> f64 {
        self.channels.first().map_or(0, Vec::len) as f64 / self.rate_hz
    }
}

/// Where the next chunk starts: after the pad byte of an odd length, unless the writer left it out.
fn after(bytes: &[u8], body: usize, length: usize) -> usize {
    let end = body.saturating_add(length);
    let name_at =
        |at: usize| bytes.get(at..at + 4).is_some_and(|n| n.iter().all(|b| (0x20..0x7f).contains(b)));
    let unpadded = length % 2 == 1 && bytes.get(end).is_some_and(|&b| b != 0) && name_at(end);
    if unpadded { end } else { end.saturating_add(length % 2) }
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

impl Format {
    fn of(chunk: &[u8]) -> Result<Self, Fault> {
        let wrong = |what, expected: &str, got: String| {
            Err(Fault::Format { what, expected: expected.to_owned(), got })
        };
        if chunk.len() < 16 {
            return Err(Fault::Truncated { chunk: "fmt ".to_owned(), expected: 16, got: chunk.len() });
        }
        let (mut tag, channels) = (u16_at(chunk, 0), u16_at(chunk, 2));
        let (rate_hz, frame, bits) = (u32_at(chunk, 4), u16_at(chunk, 12), u16_at(chunk, 14));
        if tag == 0xFFFE {
            if chunk.len() < 40 {
                return Err(Fault::Truncated { chunk: "fmt ".to_owned(), expected: 40, got: chunk.len() });
            }
            if chunk[26..40] != GUID_TAIL {
                return wrong("the sub-format", "PCM or IEEE float", format!("{:02x?}", &chunk[24..40]));
            }
            tag = u16_at(chunk, 24);
        }
        let coding = match tag {
            1 => Coding::Int,
            3 => Coding::Float,
            _ => return wrong("the format tag", "1 (PCM) or 3 (IEEE float)", tag.to_string()),
        };
        if !(1..=MOST_CHANNELS).contains(&channels) {
            return wrong("the number of channels", &format!("1 to {MOST_CHANNELS}"), channels.to_string());
        }
        if !RATES.contains(&rate_hz) {
            let expected = format!("{} to {} Hz", RATES.start(), RATES.end());
            return wrong("the sample rate", &expected, rate_hz.to_string());
        }
        let bytes = usize::from(frame / channels);
        match (coding, bytes) {
            (Coding::Int, 2..=4) | (Coding::Float, 4 | 8) if bits > 0 => {}
            (Coding::Int, _) => return wrong("the integer sample", "2, 3 or 4 bytes", bytes.to_string()),
            (Coding::Float, _) => return wrong("the float sample", "4 or 8 bytes", bytes.to_string()),
        }
        if usize::from(frame) != bytes * usize::from(channels) || usize::from(bits) > 8 * bytes {
            let expected = format!("at most {} bits in blocks of {channels} samples", 8 * bytes);
            return wrong("the block", &expected, format!("{bits} bits in {frame} bytes"));
        }
        Ok(Self { channels: usize::from(channels), rate_hz, bytes, coding })
    }
}

/// Tells the channels apart and scales integers by full scale (left-aligned in their bytes, as the format demands).
fn samples(data: &[u8], format: &Format) -> Result<Sound, Fault> {
    let frame = format.bytes * format.channels;
    if !data.len().is_multiple_of(frame) {
        return Err(Fault::Ragged { frame, got: data.len() });
    }
    let mut channels = vec![Vec::with_capacity(data.len() / frame); format.channels];
    for (sample, block) in data.chunks_exact(frame).enumerate() {
        for (channel, b) in block.chunks_exact(format.bytes).enumerate() {
            let value = match (format.coding, b) {
                (Coding::Float, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
                (Coding::Float, &[a, b, c, d, e, f, g, h]) => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
                (Coding::Int, &[a, b]) => f64::from(i16::from_le_bytes([a, b])) / 32_768.0,
                (Coding::Int, &[a, b, c]) => f64::from(i32::from_le_bytes([0, a, b, c])) / 2_147_483_648.0,
                (Coding::Int, &[a, b, c, d]) => f64::from(i32::from_le_bytes([a, b, c, d])) / 2_147_483_648.0,
                _ => 0.0,
            };
            if !value.is_finite() {
                return Err(Fault::NotFinite { channel, sample, got: value });
            }
            channels[channel].push(value);
        }
    }
    Ok(Sound { rate_hz: f64::from(format.rate_hz), channels })
}
