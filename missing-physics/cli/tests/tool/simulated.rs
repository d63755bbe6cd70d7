//! Simulated machines, and what the tool says of them.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::ops::Range;
use std::process::Command;

use serde_json::Value;

/// What the tool says of a machine's recording.
pub(super) fn answer(header: &str, data: &str) -> Value {
    answer_in("motion", header, data)
}

/// What the tool says of a recording of a domain.
pub(super) fn answer_in(domain: &str, header: &str, data: &str) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let header = format!("format = 1\ndomain = \"{domain}\"\ndata = \"data.csv\"\n{header}");
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    std::fs::write(folder.path().join("data.csv"), data).unwrap();
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let output = Command::new(tool).args(["diagnose", "--json", "-"]).arg(folder.path()).output().unwrap();
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The interval of a mechanism's first parameter.
pub(super) fn interval(answer: &Value, id: &str) -> Range<f64> {
    let of = answer["mechanisms"].as_array().unwrap().iter().find(|m| m["id"] == id).unwrap();
    let [low, high] = [0, 1].map(|end| of["parameters"][0]["ci95"][end].as_f64().unwrap());
    low..high
}

/// The mechanisms that an answer names are these, and the interval of the first parameter of each holds its value.
pub(super) fn assert_named(answer: &Value, truth: &[(&str, f64)]) {
    let named: Vec<&str> =
        answer["chosen"].as_array().unwrap().iter().map(|id| id.as_str().unwrap()).collect();
    let expected: Vec<&str> = truth.iter().map(|t| t.0).collect();
    assert_eq!(named, expected, "{}", answer["verdict"]);
    for (id, value) in truth {
        let interval = interval(answer, id);
        assert!(interval.contains(value), "{id}: {value}, {interval:?}");
    }
}

/// Follows a motion for a while in steps of Runge and Kutta's.
pub(super) fn follow<const N: usize>(
    x: &mut [f64; N],
    time_s: f64,
    steps: usize,
    rates: impl Fn(&[f64; N]) -> [f64; N],
) {
    let h = time_s / steps as f64;
    let beside = |x: &[f64; N], h: f64, k: &[f64; N]| std::array::from_fn(|i| x[i] + h * k[i]);
    for _ in 0..steps {
        let first = rates(x);
        let second = rates(&beside(x, 0.5 * h, &first));
        let third = rates(&beside(x, 0.5 * h, &second));
        let fourth = rates(&beside(x, h, &third));
        for i in 0..N {
            x[i] += h / 6.0 * (first[i] + 2.0 * second[i] + 2.0 * third[i] + fourth[i]);
        }
    }
}
