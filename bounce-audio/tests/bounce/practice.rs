//! Whole recordings: the practice drops against their keys, and a real ping-pong ball against its author's times.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test stops where it fails, and says what it saw"
)]

use std::path::PathBuf;

use crate::common::{bundled, quantile, shared};
use bounce_audio::hear::{HearSettings, hear, hear_times};
use bounce_audio::wav::Sound;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Every impact of every drop is heard, none is invented, in time and place, under the true geometry; under the stated one as many.
fn drops_are_heard(folder: PathBuf, least: usize) {
    let mut recordings = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let folder = entry.unwrap().path();
        let Ok(text) = std::fs::read_to_string(folder.join("key.json")) else { continue };
        let key: Value = serde_json::from_str(&text).unwrap();
        let recording: toml::Value =
            toml::from_str(&std::fs::read_to_string(folder.join("recording.toml")).unwrap()).unwrap();
        let stated: Vec<[f64; 3]> = recording["audio"]["microphones_m"].clone().try_into().unwrap();
        let actual: Vec<[f64; 3]> = serde_json::from_value(key["true_microphones_m"].clone()).unwrap();
        let speed = key["true_speed_of_sound_m_s"].as_f64().unwrap();
        let (mut times, mut places, mut z, mut zt) = (Vec::new(), Vec::new(), 0.0, Vec::new());
        let (mut found, mut expected, mut clicks) = (0, 0, 0);
        for (file, events) in key["events"].as_object().unwrap() {
            let sound = Sound::read(folder.join(file)).unwrap();
            let heard = hear(&sound, &actual, speed, &HearSettings::default()).unwrap();
            let (t, x, y) = (numbers(&events["t_s"]), numbers(&events["x_m"]), numbers(&events["y_m"]));
            found += heard.impacts.len();
            expected += t.len();
            let at: Vec<f64> = heard.impacts.iter().map(|i| i.t_s).collect();
            assert_eq!(
                at.len(),
                t.len(),
                "{}: {file}: {at:?} for {t:?}, {:?}",
                folder.display(),
                heard.strays
            );
            for (k, impact) in heard.impacts.iter().enumerate() {
                assert_eq!(impact.number, k);
                let place = impact.location.unwrap();
                let off = [place.x_m - x[k], place.y_m - y[k]];
                places.push(1e3 * off[0].hypot(off[1]));
                times.push(1e6 * (impact.t_s - t[k]));
                zt.push(1e6 * impact.t_sigma_s);
                z += 0.5 * off[0] * off[0] / place.covariance_m2[0][0]
                    + 0.5 * off[1] * off[1] / place.covariance_m2[1][1];
            }
            let wrong = hear(&sound, &stated, 343.0, &HearSettings::default()).unwrap();
            assert_eq!(wrong.impacts.len(), t.len(), "{}: {file}, stated geometry", folder.display());
            let single = Sound { channels: sound.channels[..1].to_vec(), ..sound };
            let alone = hear_times(&single, &HearSettings::default()).unwrap();
            // One microphone cannot tell where a click came from.
            clicks += alone.impacts.len() - t.len();
        }
        let bias = times.iter().sum::<f64>() / times.len() as f64;
        let sd = (times.iter().map(|t| (t - bias).powi(2)).sum::<f64>() / times.len() as f64).sqrt();
        let z = z / places.len() as f64;
        let [median, p90, worst] = [0.5, 0.9, 1.0].map(|q| quantile(&places, q));
        println!(
            "{}: {found} of {expected}, places {median:.2} / {p90:.2} / {worst:.2} mm (median, p90, worst), mean square of z \
             {z:.2}, times {bias:.0} +- {sd:.1} us (stated {:.1})",
            folder.display(),
            quantile(&zt, 0.5)
        );
        // The peer's errors on the same files are in the key.
        let peer = &key["listener"]["true_geometry"];
        let peer_mm = 1e3 * peer["place_error_median_m"].as_f64().unwrap();
        assert!(median <= peer_mm, "median {median} mm, a plain listener has {peer_mm}");
        assert!(
            1e-6 * sd <= peer["onset_sd_s"].as_f64().unwrap() && bias.abs() < 60.0,
            "times {bias} +- {sd} us"
        );
        assert!((0.2..4.0).contains(&z), "mean square of z {z}");
        let known = key.get("other_sounds").map_or(0, |o| o.as_array().unwrap().len());
        assert_eq!(clicks, known, "one channel hears the clicks that there are");
        recordings += 1;
    }
    assert!(recordings >= least, "{recordings} recordings");
}

#[test]
fn the_practice_drops_are_heard() {
    drops_are_heard(bundled("practice/bounce-audio"), 1);
}

#[test]
#[ignore = "needs ../shared"]
fn shared_practice_drops_are_heard() {
    drops_are_heard(shared("practice/bounce-audio"), 4);
}

/// The author's 30 times, read to 1 ms, and those that were heard.
#[test]
#[ignore = "needs ../shared"]
fn shared_a_real_ball_is_heard_when_its_author_heard_it() {
    let folder = shared("recordings/real/bounce");
    let sound = Sound::read(folder.join("erickson-pingpong-audio/run-00.wav")).unwrap();
    let heard = hear_times(&sound, &HearSettings::default()).unwrap();
    let text = std::fs::read_to_string(folder.join("erickson-pingpong-times/data.csv")).unwrap();
    let times: Vec<f64> =
        text.lines().skip(1).map(|l| l.rsplit(',').next().unwrap().parse().unwrap()).collect();
    let at: Vec<f64> = heard.impacts.iter().map(|i| i.t_s).collect();
    let off: Vec<f64> = times.iter().zip(&at).map(|(t, a)| 1e3 * (a - t)).collect();
    let late = off.iter().map(|o| -o).collect::<Vec<f64>>();
    let [median, worst] = [0.5, 1.0].map(|q| quantile(&late, q));
    println!("{} heard; its author's times are {median:.1} ms after the onsets (worst {worst:.1})", at.len());
    // One for one, within a few ms: the author's times are read off the loudest part of the sound.
    assert!(at.len() >= times.len());
    assert!(off.iter().all(|o| (-5.0..0.5).contains(o)), "{off:.1?} ms");
    // The flights shorten as a ball's do, beyond the author's last time: no echo was taken for an impact.
    let flights: Vec<f64> = at.windows(2).map(|w| w[1] - w[0]).collect();
    assert!(flights.windows(2).all(|f| (0.85..1.0).contains(&(f[1] / f[0]))), "{flights:.4?} s");
}
