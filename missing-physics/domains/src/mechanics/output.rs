//! What sensors do to outputs.

use super::{CONTROL, Clock, Declares, OutputEffect};
use missing_physics::model::UNBOUNDED;

/// Declares what a sensor may do to an output of a unit, `range` its smallest and largest reading; errors in time where there is a clock.
pub(crate) fn outputs<D: Declares<OutputEffect>>(
    d: &mut D,
    unit: &str,
    range: [f64; 2],
    clock: Option<&Clock>,
) {
    let [low, high] = range;
    let span = high - low;
    if d.wants("sensor-gain") {
        let gain = d.parameter(OutputEffect::Gain, "gain", "", 0.0, [-0.9, 10.0], 0.1);
        let text =
            ["the sensor's gain", "Readings are the quantity times a factor.", "(1 + gain) y", CONTROL];
        d.mechanism("sensor-gain", &[gain], text, &["input-gain", "clock-rate"]);
    }
    if d.wants("sensor-offset") {
        let offset = d.parameter(OutputEffect::Offset, "offset", unit, 0.0, UNBOUNDED, 0.05 * span);
        let text =
            ["the sensor's offset", "Readings are the quantity and a constant.", "y + offset", CONTROL];
        d.mechanism("sensor-offset", &[offset], text, &["input-offset", "constant-force", "sensor-drift"]);
    }
    if let Some(clock) = clock {
        in_time(d, unit, span, clock);
    }
    if d.wants("sensor-saturation") {
        let tenth = 0.1 * span;
        let [above, below] = [[low, high + 2.0 * tenth], [low - 2.0 * tenth, high]];
        let upper = d.parameter(OutputEffect::Upper, "upper", unit, high + tenth, above, tenth);
        let lower = d.parameter(OutputEffect::Lower, "lower", unit, low - tenth, below, tenth);
        let text = [
            "the sensor's saturation",
            "Beyond a bound the sensor reads the bound.",
            "min(max(y, lower), upper)",
            CONTROL,
        ];
        d.mechanism("sensor-saturation", &[upper, lower], text, &["end-stop", "input-saturation"])
            .may_be_open = vec![upper.index, lower.index];
    }
}

/// Drift, delay and lag.
fn in_time<D: Declares<OutputEffect>>(d: &mut D, unit: &str, span: f64, clock: &Clock) {
    let late = [0.0, clock.longest_s()];
    if d.wants("sensor-drift") {
        let unit = if unit.is_empty() { "1/s".to_owned() } else { format!("{unit}/s") };
        let scale = 0.05 * span / clock.duration_s;
        let rate = d.parameter(OutputEffect::Drift, "rate_per_s", &unit, 0.0, UNBOUNDED, scale);
        let text = [
            "the sensor's drift",
            "Readings walk off steadily from each run's start.",
            "y + rate t",
            CONTROL,
        ];
        d.mechanism("sensor-drift", &[rate], text, &["constant-force", "sensor-offset"]);
    }
    if d.wants("sensor-delay") {
        let delay = d.parameter(OutputEffect::Delay, "delay_s", "s", 0.0, late, clock.step_s);
        let text = ["the sensor's delay", "Readings are old when they come.", "y(t - delay)", CONTROL];
        d.mechanism("sensor-delay", &[delay], text, &["input-delay", "sensor-lag"]);
    }
    if d.wants("sensor-lag") {
        let lag = d.parameter(OutputEffect::Lag, "tau_s", "s", 0.0, late, clock.step_s);
        let text = [
            "the sensor's lag",
            "Readings follow the quantity with a first-order lag.",
            "tau dy'/dt = y - y'",
            CONTROL,
        ];
        d.mechanism("sensor-lag", &[lag], text, &["sensor-delay", "input-lag"]);
    }
}
