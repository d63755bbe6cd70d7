//! A machine one of whose states is far from zero: a temperature in kelvins.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::fmt::Write as _;

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

use super::simulated::{answer, follow, interval};

const HEATER: &str = r#"
[model]
states = { block_k = "gain*power - (block_k - 300)/tau_s" }
outputs = { sensor_k = "block_k" }
inputs = { power = "hold" }
[[parameter]]
name = "gain"
unit = "K/s"
start = 0.5
[[parameter]]
name = "tau_s"
unit = "s"
start = 150.0
"#;

/// How far a temperature moves, not how far it is from zero, says how a deviation of the start grows: whole runs are followed, in which the lag of a
/// sensor that the equations lack has its size, and is not told from a lag of the heater. In windows with free starts the heater's was named alone.
#[test]
fn a_lag_of_a_temperature_is_found_over_whole_runs() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let mut data = String::from("run,t_s,power,sensor_k\n");
    for (run, on) in [0.4, 0.7].into_iter().enumerate() {
        // The block, and the sensor that follows it.
        let mut x = [300.0, 300.0];
        for i in 0..300 {
            let power = if i < 20 { 0.0 } else { on };
            let noise: f64 = StandardNormal.sample(&mut rng);
            writeln!(data, "{run},{i},{power},{:.3}", x[1] + 0.2 * noise).unwrap();
            follow(&mut x, 1.0, 4, |[block, sensor]| {
                [0.5 * power - (block - 300.0) / 200.0, (block - sensor) / 12.0]
            });
        }
    }
    let answer = answer(HEATER, &data);
    assert_eq!(answer["verdict"], "ambiguous", "{}", answer["chosen"]);
    let names = format!("{}{}", answer["chosen"], answer["confused_with"]);
    assert!(names.contains("input-lag") && names.contains("sensor-lag"), "{names}");
    for id in ["input-lag", "sensor-lag"] {
        let tau_s = interval(&answer, id);
        assert!(tau_s.contains(&12.0) && tau_s.end - tau_s.start < 2.0, "{id}: {tau_s:?}");
    }
}
