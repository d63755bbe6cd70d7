//! Markers found and followed in pictures whose truth is known.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use hw_traits::camera::Camera;
use hw_traits::picture::Picture;
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use softcell::fake::{Bench, Eye, Touch};
use softcell::flow::{Status, TrackError, Tracker, TrackerSettings};
use softcell::image::{ImageError, ImageSettings, regions};
use softcell::markers::{MarkerError, MarkerSettings, find};

fn still() -> Bench {
    let mut bench = Bench::matl_2021(7);
    bench.holds_box = false;
    bench
}

fn nearest(at: [f64; 2], places: &[[f64; 2]]) -> f64 {
    places.iter().map(|p| (p[0] - at[0]).hypot(p[1] - at[1])).fold(f64::INFINITY, f64::min)
}

#[test]
fn every_marker_is_found_within_a_tenth_of_a_pixel() {
    let mut bench = still();
    let picture = bench.picture().unwrap().value;
    let truth = bench.markers_px();
    let found = find(&picture, &MarkerSettings::default()).unwrap();
    assert_eq!(found.len(), truth.len());
    let mut errors: Vec<f64> = found.iter().map(|m| nearest(m.at_px, &truth)).collect();
    errors.sort_by(f64::total_cmp);
    assert!(errors[errors.len() / 2] < 0.05, "median {}", errors[errors.len() / 2]);
    assert!(errors[errors.len() - 1] < 0.2, "worst {}", errors[errors.len() - 1]);
    assert!(found.iter().all(|m| !m.merged));
}

#[test]
fn two_markers_that_touch_are_two_and_say_so() {
    let eye = Eye::matl_2021();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    // Twelve far apart and a pair 1.5 mm apart (radius 1 mm).
    let mut points: Vec<[f64; 3]> = (0..12)
        .map(|k| [-0.02 + 0.008 * f64::from(k % 4), -0.012 + 0.008 * f64::from(k / 4), 0.02])
        .collect();
    points.extend([[0.015, 0.0, 0.02], [0.0165, 0.0, 0.02]]);
    let picture = eye.picture(&points, &mut rng).unwrap();
    let found = find(&picture, &MarkerSettings::default()).unwrap();
    assert_eq!(found.len(), 14);
    let merged: Vec<_> = found.iter().filter(|m| m.merged).collect();
    assert_eq!(merged.len(), 2);
    for (m, p) in merged.iter().zip(&points[12..]) {
        assert!(nearest(m.at_px, &[eye.pixel(*p).unwrap()]) < 1.5, "{m:?}");
    }
}

#[test]
fn pictures_without_markers_are_refused_with_the_reason() {
    let grey = |value: u8| Picture::new(64, vec![value; 64 * 48]).unwrap();
    for value in [0, 128, 255] {
        let error = find(&grey(value), &MarkerSettings::default()).unwrap_err();
        assert!(matches!(error, MarkerError::Image(ImageError::NoContrast { .. })), "{error}");
    }
    // Noise has a threshold too, but no two classes.
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let noise = Eye::matl_2021().picture(&[], &mut rng).unwrap();
    assert!(matches!(
        find(&noise, &MarkerSettings::default()),
        Err(MarkerError::Image(ImageError::NoContrast { .. }))
    ));
    let tiny = Picture::new(4, vec![0; 16]).unwrap();
    assert!(matches!(
        find(&tiny, &MarkerSettings::default()),
        Err(MarkerError::Image(ImageError::Size { .. }))
    ));
    // Half the picture bright: one region, far too large.
    let half =
        Picture::new(200, (0..200 * 100).map(|i| if i % 200 < 100 { 20 } else { 220 }).collect()).unwrap();
    assert!(matches!(
        find(&half, &MarkerSettings::default()),
        Err(MarkerError::NoMarkers { regions: 1, .. })
    ));
    let settings = ImageSettings { blur_px: f64::NAN, ..ImageSettings::default() };
    assert!(matches!(regions(&half, &settings), Err(ImageError::Setting { what: "the blur", .. })));
}

/// The skin is dragged along, twisted and pressed for a hundred pictures: places stay right, and do not drift.
#[test]
fn tracks_stay_on_their_markers() {
    let mut bench = still();
    bench.touch.indentation_m = 2e-3;
    let first = bench.picture().unwrap().value;
    let start = bench.markers_px();
    let mut tracker = Tracker::new(&first, TrackerSettings::default()).unwrap();
    let whose: Vec<usize> = tracker
        .tracks()
        .iter()
        .map(|t| {
            (0..start.len())
                .min_by(|&a, &b| nearest(t.at_px, &[start[a]]).total_cmp(&nearest(t.at_px, &[start[b]])))
                .unwrap()
        })
        .collect();
    for k in 1..=100 {
        let phase = f64::from(k) / 100.0 * std::f64::consts::TAU;
        bench.touch.shear_m = [2e-3 * phase.sin(), 1e-3 * (1.0 - phase.cos())];
        bench.touch.turn_rad = 0.15 * phase.sin();
        bench.touch.indentation_m = 2e-3 + 2e-3 * (0.5 * phase).sin();
        let picture = bench.picture().unwrap().value;
        tracker.next(&picture).unwrap();
    }
    let truth = bench.markers_px();
    let mut errors = Vec::new();
    for (t, &k) in tracker.tracks().iter().zip(&whose) {
        assert!(t.seen(), "{t:?}");
        errors.push(nearest(t.at_px, &[truth[k]]));
    }
    errors.sort_by(f64::total_cmp);
    assert!(errors[errors.len() - 1] < 0.25, "worst {}", errors[errors.len() - 1]);
}

#[test]
fn a_covered_marker_is_lost_and_found_again() {
    let mut bench = still();
    let mut tracker = Tracker::new(&bench.picture().unwrap().value, TrackerSettings::default()).unwrap();
    let at = tracker.tracks()[0].at_px;
    let cover = |picture: &mut Picture<u8>| {
        let width = picture.width();
        for (i, p) in picture.data_mut().iter_mut().enumerate() {
            if ((i % width) as f64 - at[0]).hypot((i / width) as f64 - at[1]) < 14.0 {
                *p = 30;
            }
        }
    };
    for _ in 0..5 {
        let mut picture = bench.picture().unwrap().value;
        cover(&mut picture);
        tracker.next(&picture).unwrap();
    }
    assert!(
        matches!(tracker.tracks()[0].status, Status::Lost { pictures: 3.. }),
        "{:?}",
        tracker.tracks()[0]
    );
    assert!(tracker.tracks()[1..].iter().all(softcell::flow::Track::seen));
    tracker.next(&bench.picture().unwrap().value).unwrap();
    assert!(tracker.tracks()[0].seen());
    assert!(nearest(tracker.tracks()[0].at_px, &[at]) < 0.2);
}

/// Two markers run into each other and part again; neither takes the other's place.
#[test]
fn markers_that_meet_keep_their_names() {
    let eye = Eye { noise: 1.0, ..Eye::matl_2021() };
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let points = |apart: f64| {
        let mut p: Vec<[f64; 3]> = (0..15)
            .map(|k| [-0.02 + 0.008 * f64::from(k % 5), -0.012 + 0.01 * f64::from(k / 5), 0.02])
            .collect();
        // The last two pass at 1.6 mm of each other: their discs overlap.
        p.extend([[-0.015 - 0.5 * apart, -0.007, 0.02], [-0.015 + 0.5 * apart, -0.007, 0.02]]);
        p
    };
    let mut tracker =
        Tracker::new(&eye.picture(&points(0.005), &mut rng).unwrap(), TrackerSettings::default()).unwrap();
    let index = |t: &Tracker, p: [f64; 3]| {
        let at = eye.pixel(p).unwrap();
        (0..t.tracks().len())
            .min_by(|&a, &b| {
                nearest(t.tracks()[a].at_px, &[at]).total_cmp(&nearest(t.tracks()[b].at_px, &[at]))
            })
            .unwrap()
    };
    let pair = [index(&tracker, points(0.005)[15]), index(&tracker, points(0.005)[16])];
    let mut met = false;
    for k in 0..=40 {
        let apart = 0.0016 + 0.0034 * (f64::from(k - 20) / 20.0).abs();
        tracker.next(&eye.picture(&points(apart), &mut rng).unwrap()).unwrap();
        met |= pair.iter().any(|&i| tracker.tracks()[i].status == Status::Merged);
    }
    assert!(met);
    for (i, p) in pair.iter().zip(&points(0.005)[15..]) {
        let t = tracker.tracks()[*i];
        assert!(t.seen() && nearest(t.at_px, &[eye.pixel(*p).unwrap()]) < 0.3, "{t:?}");
    }
}

#[test]
fn darkness_and_other_sizes_are_errors_and_the_tracker_goes_on() {
    let mut bench = still();
    let first = bench.picture().unwrap().value;
    let mut tracker = Tracker::new(&first, TrackerSettings::default()).unwrap();
    let small = Picture::new(320, vec![0; 320 * 240]).unwrap();
    assert!(matches!(tracker.next(&small), Err(TrackError::Size { .. })));
    let dark = Picture::new(640, vec![0; 640 * 480]).unwrap();
    assert!(matches!(tracker.next(&dark), Err(TrackError::Lost { seen: 0, .. })));
    // The light comes back. Without neighbours there is no motion to go by: it starts from home.
    let back = tracker.next(&bench.picture().unwrap().value).map(<[_]>::len);
    assert!(back.is_ok(), "{back:?}");
}

#[test]
fn the_same_pictures_give_the_same_bits() {
    let run = || {
        let mut bench = still();
        bench.touch = Touch { indentation_m: 3e-3, ..Touch::none() };
        let mut tracker = Tracker::new(&bench.picture().unwrap().value, TrackerSettings::default()).unwrap();
        bench.touch.shear_m = [1e-3, 0.0];
        tracker.next(&bench.picture().unwrap().value).unwrap().to_vec()
    };
    assert_eq!(run(), run());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Any picture gives an answer or an error.
    #[test]
    fn no_picture_panics(width in 1usize..80, height in 1usize..80, seed in any::<u64>(), steep in 1u32..9) {
        let mut state = seed;
        let mut next = || { state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407); (state >> 56) as u8 };
        let data: Vec<u8> = (0..width * height).map(|_| if u32::from(next()) % steep == 0 { next() } else { 0 }).collect();
        let picture = Picture::new(width, data.clone()).unwrap();
        let _ = find(&picture, &MarkerSettings::default());
        if let Ok(mut tracker) = Tracker::new(&picture, TrackerSettings { least: 1, ..TrackerSettings::default() }) {
            let mut turned = data;
            turned.rotate_left(width / 2 + 1);
            let _ = tracker.next(&Picture::new(width, turned).unwrap());
        }
    }
}
