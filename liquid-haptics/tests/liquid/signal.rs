//! The pre-processing: streaming against batch, filters against a direct reference and known signals, clocks.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::f64::consts::{PI, TAU};

use hw_traits::clock::Stamped;
use hw_traits::force_torque::Wrench;
use liquid_haptics::signal::{
    ClockMap, Pipeline, PipelineSettings, SignalError, Smoother, align, align_at, batch, low_pass,
};
use proptest::prelude::*;

const NONE: PipelineSettings = PipelineSettings {
    sensor_from_joint: ClockMap::SAME,
    factor: 1,
    offset: Wrench { force_n: [0.0; 3], torque_nm: [0.0; 3] },
    smoothing: 0.0,
};

fn stamped<T>(t_s: f64, value: T) -> Stamped<T> {
    Stamped { t_s, value }
}

fn wrench(fx: f64, fy: f64, tau: f64) -> Wrench {
    Wrench { force_n: [fx, fy, 0.2 * fx], torque_nm: [0.1 * tau, 0.3, tau] }
}

/// A weight that hangs from a turning sensor pulls straight down in the world, whatever filters are in between.
#[test]
fn a_weight_pulls_down() {
    let tilt = |t: f64| 1.5 * (0.5 - 0.5 * (PI * t / 8.0).cos());
    let sensor: Vec<_> = (0..8000)
        .map(|i| {
            let t = f64::from(i) * 1e-3;
            let (sin, cos) = tilt(t).sin_cos();
            stamped(
                t,
                Wrench { force_n: [10.0 * sin + 0.7, -10.0 * cos - 0.2, 0.0], torque_nm: [0.0, 0.0, -0.3] },
            )
        })
        .collect();
    // The joint's clock began 2.5 s later and is slow.
    let map = ClockMap { offset_s: 2.5, rate: 1.0001 };
    let joint: Vec<_> = (0..1000)
        .map(|i| {
            let t = f64::from(i) * 0.008;
            stamped((t - 2.5) / 1.0001, tilt(t))
        })
        .collect();
    let offset = Wrench { force_n: [0.7, -0.2, 0.0], torque_nm: [0.0, 0.0, -0.1] };
    let settings = PipelineSettings { sensor_from_joint: map, factor: 20, offset, smoothing: 5.0 };
    let out = batch(settings, &sensor, &joint).unwrap();
    assert!((380..=400).contains(&out.len()), "{}", out.len());
    for one in &out[25..out.len() - 25] {
        let [fx, fy, _] = one.wrench_in_world.force_n;
        assert!(fx.abs() < 0.01 && (fy + 10.0).abs() < 0.01, "{one:?}");
        assert!((one.wrench_in_world.torque_nm[2] + 0.2).abs() < 1e-9);
        assert!((one.tilt_rad - tilt(one.t_s)).abs() < 1e-4);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever the order in which the two streams arrive, the very same bits come out as from the recording.
    #[test]
    fn streaming_is_the_batch(
        seed in 0u64..1000, factor in 1usize..9, smoothing in 0.0f64..6.0, ahead in 0.0f64..1.0, rate in 0.9f64..1.1
    ) {
        let settings = PipelineSettings {
            sensor_from_joint: ClockMap { offset_s: 0.1, rate }, factor, smoothing, offset: wrench(0.3, 0.1, 0.01)
        };
        let jitter = |i: u64| ((seed * 7919 + i * 104_729) % 1000) as f64 / 1000.0;
        let sensor: Vec<_> = (0..400u64).map(|i| {
            stamped(0.01 * (i as f64 + 0.5 * jitter(i)), wrench(jitter(3 * i), jitter(5 * i), jitter(7 * i)))
        }).collect();
        let joint: Vec<_> = (0..90u64).map(|i| stamped(0.04 * (i as f64 + 0.5 * jitter(2 * i)), jitter(11 * i))).collect();
        let expected = batch(settings, &sensor, &joint).unwrap();
        let (mut pipeline, mut out) = (Pipeline::new(settings).unwrap(), Vec::new());
        let (mut i, mut j) = (0, 0);
        while i < sensor.len() || j < joint.len() {
            let joint_next = j < joint.len()
                && (i == sensor.len() || joint[j].t_s + ahead - 0.5 < sensor[i].t_s);
            if joint_next {
                pipeline.angle(&joint[j], &mut out).unwrap();
                j += 1;
            } else {
                pipeline.wrench(&sensor[i], &mut out).unwrap();
                i += 1;
            }
        }
        pipeline.finish(&mut out);
        prop_assert!(!expected.is_empty());
        prop_assert_eq!(out, expected);
    }

    /// Against the definition, written out: weights of a Gaussian over what there is.
    #[test]
    fn smoothing_is_the_weighted_mean(sigma in 0.0f64..8.0, count in 1usize..80) {
        let value = |i: usize| ((i * 37) % 23) as f64;
        let mut smoother = Smoother::new(sigma).unwrap();
        let mut got: Vec<f64> = (0..count).filter_map(|i| smoother.push(i as f64, [value(i); 6])).map(|o| o.1[3]).collect();
        got.extend(std::iter::from_fn(|| smoother.finish()).map(|o| o.1[3]));
        prop_assert_eq!(got.len(), count);
        let half = (4.0 * sigma + 0.5) as usize;
        for (i, got) in got.iter().enumerate() {
            let (mut sum, mut whole) = (0.0, 0.0);
            for k in i.saturating_sub(half)..=(i + half).min(count - 1) {
                let w = if sigma > 0.0 { (-0.5 * ((k as f64 - i as f64) / sigma).powi(2)).exp() } else { 1.0 };
                sum += w * value(k);
                whole += w;
            }
            prop_assert!((got - sum / whole).abs() < 1e-12 * 23.0, "{} {}", got, sum / whole);
        }
    }
}

/// What the thinned stream can hold passes, what would be folded back does not.
#[test]
fn the_low_pass_passes_low() {
    for factor in [2_usize, 10, 78] {
        let taps = low_pass(factor).unwrap();
        let response = |share: f64| {
            let w = PI * share / factor as f64;
            let middle = (taps.len() / 2) as f64;
            taps.iter().enumerate().map(|(k, t)| t * (w * (k as f64 - middle)).cos()).sum::<f64>()
        };
        assert!((response(0.0) - 1.0).abs() < 1e-12 && (response(0.3) - 1.0).abs() < 0.01);
        for share in [1.3, 1.5, 2.0, 2.7] {
            assert!(response(share).abs() < 0.01, "{factor} {share}: {}", response(share));
        }
    }
    assert_eq!(low_pass(1).unwrap(), [1.0]);
    assert!(low_pass(0).is_err());
}

#[test]
fn clocks_are_found() {
    let moments: Vec<[f64; 2]> =
        (0..20).map(|i| f64::from(i) * 3.0).map(|t| [1e3 + 1.00002 * t, t]).collect();
    let map = align(&moments).unwrap();
    assert!((map.rate - 1.00002).abs() < 1e-12 && (map.at(10.0) - 1_010.000_2).abs() < 1e-9);
    let motion = |t: f64| (TAU * 0.31 * t).sin() + 0.4 * (TAU * 0.83 * t + 1.0).sin();
    let first: Vec<_> =
        (0..4000).map(|i| 0.003 * f64::from(i)).map(|t| stamped(t, 2.0 + 3.0 * motion(t))).collect();
    let second: Vec<_> =
        (0..1400).map(|i| 0.008 * f64::from(i)).map(|t| stamped(t, motion(t + 0.1234))).collect();
    let found = align_at(&first, &second, 0.5).unwrap();
    assert!((found.offset_s - 0.1234).abs() < 2e-4, "{found:?}");
    let noise: Vec<_> =
        (0..1400).map(|i| stamped(0.008 * f64::from(i), f64::from((i * 7919) % 101))).collect();
    assert!(matches!(align_at(&first, &noise, 0.5), Err(SignalError::NotAlike { .. })));
    assert!(align(&moments[..1]).is_err() && align(&[[1.0, 2.0], [3.0, 2.0]]).is_err());
}

#[test]
fn what_is_no_stream_is_an_error() {
    let mut pipeline = Pipeline::new(NONE).unwrap();
    let mut out = Vec::new();
    pipeline.wrench(&stamped(1.0, wrench(0.0, 1.0, 0.0)), &mut out).unwrap();
    let late = pipeline.wrench(&stamped(1.0, wrench(0.0, 1.0, 0.0)), &mut out);
    assert!(matches!(late, Err(SignalError::Time { stream: "sensor", .. })));
    assert!(matches!(pipeline.angle(&stamped(0.0, f64::NAN), &mut out), Err(SignalError::Value { .. })));
    assert!(matches!(pipeline.angle(&stamped(f64::NAN, 0.0), &mut out), Err(SignalError::Time { .. })));
    // A refused reading leaves no trace.
    pipeline.angle(&stamped(0.5, 0.0), &mut out).unwrap();
    pipeline.angle(&stamped(1.5, 0.0), &mut out).unwrap();
    assert_eq!(out.len(), 1);
    assert!(Pipeline::new(PipelineSettings { factor: 0, ..NONE }).is_err());
    assert!(Pipeline::new(PipelineSettings { smoothing: f64::NAN, ..NONE }).is_err());
    assert!(batch(NONE, &[], &[]).unwrap().is_empty());
}
