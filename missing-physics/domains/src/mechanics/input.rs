//! What drives do to inputs.

use super::{CONTROL, Declares, InputEffect};
use missing_physics::model::UNBOUNDED;

/// Declares what a drive may do to an input of a unit: `range` is that of its commands, `longest_s` the longest delay or lag, `step_s` the
/// time between rows.
pub(crate) fn inputs<D: Declares<InputEffect>>(
    d: &mut D,
    unit: &str,
    range: [f64; 2],
    step_s: f64,
    longest_s: f64,
) {
    let [low, high] = range;
    let late = [0.0, longest_s];
    if d.wants("input-gain") {
        let gain = d.parameter(InputEffect::Gain, "gain", "", 0.0, [-0.9, 10.0], 0.1);
        let text = ["the input's gain", "What acts is the command times a factor.", "(1 + gain) u", CONTROL];
        d.mechanism("input-gain", &[gain], text, &["sensor-gain", "inertia"]);
    }
    if d.wants("input-offset") {
        let scale = 0.1 * (high - low);
        let offset = d.parameter(InputEffect::Offset, "offset", unit, 0.0, UNBOUNDED, scale);
        let text = ["the input's offset", "What acts is the command and a constant.", "u + offset", CONTROL];
        d.mechanism("input-offset", &[offset], text, &["constant-force", "asymmetric-friction"]);
    }
    if d.wants("input-delay") {
        let delay = d.parameter(InputEffect::Delay, "delay_s", "s", 0.0, late, step_s);
        let text = ["the input's delay", "The command acts later than it is given.", "u(t - delay)", CONTROL];
        d.mechanism("input-delay", &[delay], text, &["sensor-delay", "input-lag"]);
    }
    if d.wants("input-lag") {
        let lag = d.parameter(InputEffect::Lag, "tau_s", "s", 0.0, late, step_s);
        let text = [
            "the input's lag",
            "What acts follows the command with a first-order lag.",
            "tau du'/dt = u - u'",
            CONTROL,
        ];
        d.mechanism("input-lag", &[lag], text, &["input-delay", "sensor-lag"]);
    }
    if d.wants("input-saturation") {
        let tenth = 0.1 * (high - low);
        let [above, below] = [[low, high + 2.0 * tenth], [low - 2.0 * tenth, high]];
        let upper = d.parameter(InputEffect::Upper, "upper", unit, high + tenth, above, tenth);
        let lower = d.parameter(InputEffect::Lower, "lower", unit, low - tenth, below, tenth);
        let text = [
            "the input's saturation",
            "Commands beyond a bound act as the bound.",
            "min(max(u, lower), upper)",
            CONTROL,
        ];
        d.mechanism("input-saturation", &[upper, lower], text, &["quadratic-damping", "input-gain"])
            .may_be_open = vec![upper.index, lower.index];
    }
    if d.wants("input-dead-zone") && (low < 0.0 || high > 0.0) {
        let most = low.abs().max(high.abs());
        let zone = d.parameter(InputEffect::DeadZone, "width", unit, 0.0, [0.0, most], 0.05 * most);
        let text = [
            "the input's dead zone",
            "Small commands do nothing, and all others act smaller by as much.",
            "u - width sign(u), 0 below width",
            CONTROL,
        ];
        d.mechanism("input-dead-zone", &[zone], text, &["coulomb-friction", "input-gain"]);
    }
}
