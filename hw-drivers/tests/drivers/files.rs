//! Folders of depth pictures and WAV files: contracts, files that are being written, files that are wrong.
#![cfg(all(feature = "depth-folder", feature = "wav"))]
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::io::Write;
use std::path::Path;
use std::time::Duration;

use hw_drivers::depth_folder::DepthFolder;
use hw_drivers::wav::WavMicrophones;
use hw_traits::camera::DepthCamera;
use hw_traits::microphones::Microphones;
use hw_traits::picture::Intrinsics;
use hw_traits::{Error as _, ErrorKind, conformance};

const PINHOLE: Intrinsics = Intrinsics { fx: 600.0, fy: 600.0, cx: 1.0, cy: 0.5 };

fn png(counts: &[u16], width: u32, depth: png::BitDepth) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, counts.len() as u32 / width);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(depth);
    let data: Vec<u8> = match depth {
        png::BitDepth::Sixteen => counts.iter().flat_map(|c| c.to_be_bytes()).collect(),
        _ => counts.iter().map(|c| *c as u8).collect(),
    };
    encoder.write_header().unwrap().write_image_data(&data).unwrap();
    bytes
}

fn camera(folder: &Path) -> DepthFolder {
    DepthFolder::new(folder, PINHOLE, 1e-3, 0.2).unwrap()
}

#[test]
fn a_folder_is_a_depth_camera() {
    let folder = tempfile::tempdir().unwrap();
    for t in ["10.5", "9.25", "100.0"] {
        let picture = png(&[0, 1000, 1, 65535], 2, png::BitDepth::Sixteen);
        std::fs::write(folder.path().join(format!("{t}.png")), picture).unwrap();
    }
    std::fs::write(folder.path().join("notes.txt"), "no picture").unwrap();
    conformance::depth_camera(&mut camera(folder.path()), 3).unwrap();
    let mut camera = camera(folder.path());
    let first = camera.depth_m().unwrap();
    assert_eq!((first.t_s, &first.value.data()[1..]), (9.25, &[1.0f32, 0.001, 65.535][..]));
    assert!(first.value.data()[0].is_nan());
    assert_eq!((camera.depth_m().unwrap().t_s, camera.depth_m().unwrap().t_s), (10.5, 100.0));
    assert_eq!(camera.depth_m().unwrap_err().kind(), ErrorKind::Timeout);
}

#[test]
fn a_picture_that_is_being_written_is_waited_for_and_a_wrong_one_is_said_once() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = png(&[5; 4], 2, png::BitDepth::Sixteen);
    let path = folder.path().join("1.0.png");
    let writer = std::thread::spawn(move || {
        let mut file = std::fs::File::create(path).unwrap();
        for part in bytes.chunks(20) {
            file.write_all(part).unwrap();
            std::thread::sleep(Duration::from_millis(5));
        }
    });
    let mut camera = camera(folder.path());
    assert_eq!(camera.depth_m().unwrap().t_s, 1.0);
    writer.join().unwrap();
    let wrong = [
        ("2.0", png(&[5; 4], 2, png::BitDepth::Eight)),
        ("3.0", png(&[5; 6], 2, png::BitDepth::Sixteen)),
        ("4.0", b"no picture".to_vec()),
    ];
    for (time, bytes) in wrong {
        std::fs::write(folder.path().join(format!("{time}.png")), bytes).unwrap();
        let error = camera.depth_m().unwrap_err();
        assert!(error.kind() == ErrorKind::Other && error.to_string().contains(time), "{error}");
    }
    std::fs::write(folder.path().join("5.0.png"), png(&[5; 4], 2, png::BitDepth::Sixteen)).unwrap();
    assert_eq!(camera.depth_m().unwrap().t_s, 5.0);
    std::fs::write(folder.path().join("yesterday.png"), b"").unwrap();
    assert!(camera.depth_m().unwrap_err().to_string().contains("time in s"));
}

#[test]
fn a_wav_file_is_microphones() {
    let folder = tempfile::tempdir().unwrap();
    for (bits, sample_format) in [(16, hound::SampleFormat::Int), (32, hound::SampleFormat::Float)] {
        let path = folder.path().join(format!("{bits}.wav"));
        let spec = hound::WavSpec { channels: 2, sample_rate: 1000, bits_per_sample: bits, sample_format };
        let mut writer = hound::WavWriter::create(&path, spec).unwrap();
        for k in 0..200i16 {
            match sample_format {
                hound::SampleFormat::Int => writer.write_sample(k * 100).unwrap(),
                hound::SampleFormat::Float => writer.write_sample(f32::from(k) / 327.68).unwrap(),
            }
        }
        writer.finalize().unwrap();
        let mut sound = WavMicrophones::open(&path).unwrap();
        conformance::microphones(&mut sound, 3, 10).unwrap();
        let mut buffer = [0.0; 140];
        assert_eq!(sound.read(&mut buffer).unwrap(), 0.03);
        assert!((buffer[1] - 61.0 / 327.68).abs() < 1e-4);
        assert_eq!(sound.read(&mut buffer[..2]).unwrap_err().kind(), ErrorKind::EndOfRecording);
    }
    let path = folder.path().join("none.wav");
    std::fs::write(&path, b"RIFF").unwrap();
    assert_eq!(WavMicrophones::open(path).map(drop).unwrap_err().kind(), ErrorKind::Other);
}
