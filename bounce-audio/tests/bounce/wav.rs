//! Sound files: what another package writes, other layouts, and what is broken.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use bounce_audio::wav::{Fault, Sound};
use hound::{SampleFormat, WavSpec, WavWriter};
use std::io::Cursor;

fn chunk(name: &[u8; 4], body: &[u8], padded: bool) -> Vec<u8> {
    let mut out = name.to_vec();
    out.extend((body.len() as u32).to_le_bytes());
    out.extend(body);
    if padded && body.len() % 2 == 1 {
        out.push(0);
    }
    out
}

fn riff(chunks: &[Vec<u8>]) -> Vec<u8> {
    let body = chunks.concat();
    let mut out = b"RIFF".to_vec();
    out.extend((body.len() as u32 + 4).to_le_bytes());
    out.extend(b"WAVE");
    out.extend(body);
    out
}

/// A format chunk of 16 bytes.
fn format(tag: u16, channels: u16, rate: u32, bits: u16) -> Vec<u8> {
    let frame = channels.wrapping_mul(bits / 8);
    let mut out = Vec::new();
    for (value, bytes) in
        [(u32::from(tag), 2), (u32::from(channels), 2), (rate, 4), (rate.wrapping_mul(u32::from(frame)), 4)]
    {
        out.extend(&value.to_le_bytes()[..bytes]);
    }
    out.extend(frame.to_le_bytes());
    out.extend(bits.to_le_bytes());
    chunk(b"fmt ", &out, true)
}

/// Another package's files, 1 to 5 channels (it writes `WAVE_FORMAT_EXTENSIBLE` where that is due).
#[test]
fn what_hound_writes_is_read() {
    for (bits, sample_format) in
        [(16, SampleFormat::Int), (24, SampleFormat::Int), (32, SampleFormat::Int), (32, SampleFormat::Float)]
    {
        for channels in 1..=5u16 {
            let spec = WavSpec { channels, sample_rate: 48_000, bits_per_sample: bits, sample_format };
            let mut bytes = Cursor::new(Vec::new());
            let mut writer = WavWriter::new(&mut bytes, spec).unwrap();
            let value = |k: i32, c: u16| f64::from((k * 37 + i32::from(c) * 11) % 200 - 100) / 128.0;
            for k in 0..50 {
                for c in 0..channels {
                    match sample_format {
                        SampleFormat::Float => writer.write_sample(value(k, c) as f32).unwrap(),
                        SampleFormat::Int => {
                            let full = f64::from(1u32 << (bits - 1));
                            writer.write_sample((value(k, c) * full) as i32).unwrap();
                        }
                    }
                }
            }
            writer.finalize().unwrap();
            let sound = Sound::from_bytes(bytes.get_ref()).unwrap();
            assert_eq!((sound.rate_hz, sound.channels.len()), (48_000.0, usize::from(channels)));
            for (c, x) in sound.channels.iter().enumerate() {
                assert_eq!(x.len(), 50);
                for (k, v) in x.iter().enumerate() {
                    assert_eq!(*v, value(k as i32, c as u16), "{bits} bits, channel {c}, sample {k}");
                }
            }
            approx::assert_relative_eq!(sound.duration_s(), 50.0 / 48_000.0);
        }
    }
}

/// Chunks of odd length before the sound, with the pad byte and without, and others after it.
#[test]
fn other_chunks_are_skipped() {
    let data = chunk(b"data", &[0, 64, 0, 192, 255, 127, 0, 128], true);
    let expected = vec![vec![0.5, 32_767.0 / 32_768.0], vec![-0.5, -1.0]];
    for padded in [true, false] {
        for length in [0usize, 1, 26, 27] {
            let junk = chunk(b"JUNK", &vec![7; length], padded);
            let list = chunk(b"LIST", &vec![65; length], padded);
            let file =
                riff(&[junk, format(1, 2, 22_050, 16), list, data.clone(), chunk(b"id3 ", &[1, 2, 3], true)]);
            let sound = Sound::from_bytes(&file).unwrap();
            assert_eq!(sound.channels, expected, "{length} bytes, padded: {padded}");
        }
    }
}

#[test]
fn what_is_broken_is_an_error() {
    let data = chunk(b"data", &[0; 24], true);
    let fault = |bytes: &[u8]| Sound::from_bytes(bytes).unwrap_err();
    assert!(matches!(fault(b""), Fault::NotWave { .. }));
    assert!(matches!(fault(b"RIFX\0\0\0\0WAVE"), Fault::NotWave { .. }));
    assert!(matches!(fault(&riff(&[])), Fault::Missing { expected: "fmt " }));
    assert!(matches!(fault(&riff(std::slice::from_ref(&data))), Fault::Missing { expected: "fmt " }));
    assert!(matches!(fault(&riff(&[format(1, 1, 44_100, 16)])), Fault::Missing { expected: "data" }));
    for (tag, channels, rate, bits) in [
        (1, 0, 44_100, 16),
        (1, 65, 44_100, 16),
        (1, 1, 0, 16),
        (1, 1, u32::MAX, 16),
        (1, 1, 44_100, 8),
        (1, 1, 44_100, 0),
        (3, 1, 44_100, 24),
        (3, 1, 44_100, 16),
        (2, 1, 44_100, 16),
        (85, 2, 44_100, 16),
    ] {
        let found = fault(&riff(&[format(tag, channels, rate, bits), data.clone()]));
        assert!(matches!(found, Fault::Format { .. }), "{tag} {channels} {rate} {bits}: {found}");
    }
    let short = fault(&riff(&[chunk(b"fmt ", &[1, 0, 1, 0], true), data.clone()]));
    assert!(matches!(short, Fault::Truncated { expected: 16, got: 4, .. }), "{short}");
    let ragged = fault(&riff(&[format(1, 5, 44_100, 16), data.clone()]));
    assert!(matches!(ragged, Fault::Ragged { frame: 10, got: 24 }), "{ragged}");
    // A header that promises four gigabytes.
    let mut absurd = riff(&[format(1, 1, 44_100, 16), data.clone()]);
    let at = absurd.len() - 28;
    absurd[at..at + 4].fill(0xFF);
    assert!(matches!(fault(&absurd), Fault::Truncated { expected: 0xFFFF_FFFF, got: 24, .. }));
    let float = riff(&[format(3, 2, 44_100, 32), chunk(b"data", &[0, 0, 0, 0, 0, 0, 0xC0, 0x7F], true)]);
    assert!(matches!(fault(&float), Fault::NotFinite { channel: 1, sample: 0, .. }));
}

/// Cut anywhere, or with any byte changed, a file is read or refused, never a panic.
#[test]
fn no_file_is_a_panic() {
    let whole =
        riff(&[chunk(b"JUNK", &[1; 5], true), format(0xFFFE, 2, 48_000, 24), chunk(b"data", &[9; 60], true)]);
    let plain =
        riff(&[chunk(b"JUNK", &[1; 5], true), format(1, 2, 48_000, 24), chunk(b"data", &[9; 60], true)]);
    assert!(Sound::from_bytes(&plain).is_ok());
    for file in [&whole, &plain] {
        for end in 0..file.len() {
            assert!(Sound::from_bytes(&file[..end]).is_err(), "cut at {end}");
            for value in [0, 1, 0x7F, 0xFF] {
                let mut changed = file.clone();
                changed[end] = value;
                let _ = Sound::from_bytes(&changed);
            }
        }
    }
}

#[test]
fn an_error_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("drop-00.wav");
    assert!(Sound::read(&missing).unwrap_err().to_string().contains("drop-00.wav: cannot be read"));
    std::fs::write(&missing, riff(&[format(1, 0, 44_100, 16)])).unwrap();
    let said = Sound::read(&missing).unwrap_err().to_string();
    assert!(said.ends_with("drop-00.wav: the number of channels is 0, expected 1 to 64"), "{said}");
}

/// Floats of 64 bits, which hound does not write.
#[test]
fn floats_of_64_bits_are_read() {
    let values = [0.1, -0.25, 1.5, f64::MIN_POSITIVE];
    let body: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    let sound = Sound::from_bytes(&riff(&[format(3, 2, 44_100, 64), chunk(b"data", &body, true)])).unwrap();
    assert_eq!(sound.channels, [[0.1, 1.5], [-0.25, f64::MIN_POSITIVE]]);
    let short = riff(&[format(3, 2, 44_100, 64), chunk(b"data", &body[..24], true)]);
    assert!(matches!(Sound::from_bytes(&short), Err(Fault::Ragged { frame: 16, got: 24 })));
}
