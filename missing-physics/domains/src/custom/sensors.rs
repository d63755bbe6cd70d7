//! What a sensor and a clock may do to what a simulator predicts, whatever it simulates: mechanisms that nobody has to ask for.

use std::collections::BTreeSet;

use missing_physics::data::Run;
use missing_physics::model::{ParameterRef, Quantity, SpecBuilder, UNBOUNDED};

use crate::mechanics::{self, Clock};

/// What a sensor or the clock does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Gain,
    Offset,
    Drift,
    Delay,
    Lag,
    Upper,
    Lower,
    /// Of all channels.
    Clock,
}

/// A parameter of a sensor's error: what it does, in which channel.
#[derive(Debug, Clone, Copy)]
struct Part {
    slot: usize,
    index: usize,
    kind: Kind,
    channel: usize,
    /// Where it is off.
    off: f64,
}

/// The errors of all sensors.
#[derive(Debug, Default)]
pub(super) struct Sensors {
    parts: Vec<Part>,
    /// Smallest and largest reading of each channel.
    ranges: Vec<[f64; 2]>,
    step_s: f64,
}

const CONTROL: &str = "Astrom and Murray, Feedback Systems, 2nd ed. 2021";

/// A specification in the making, with the errors of its sensors.
struct Errors<'a> {
    b: &'a mut SpecBuilder,
    sensors: Sensors,
    /// What the recording declares itself is not tried.
    declared: BTreeSet<String>,
    several: bool,
}

impl Errors<'_> {
    fn parameter(
        &mut self,
        (kind, channel): (Kind, usize),
        name: &str,
        unit: &str,
        off: f64,
        bounds: [f64; 2],
        scale: f64,
    ) -> ParameterRef {
        let at = self.b.shared(name, unit, off, bounds, scale);
        self.sensors.parts.push(Part { slot: at.slot, index: at.index, kind, channel, off });
        at
    }

    /// The identifier of an error of a channel, unless the recording has one of its own of that name.
    fn wanted(&self, kind: &str, channel: &Quantity) -> Option<String> {
        let of_channel = if self.several { format!("{kind}@{}", channel.name) } else { kind.to_owned() };
        (!self.declared.contains(kind) && !self.declared.contains(&of_channel)).then_some(of_channel)
    }

    fn mechanism(&mut self, id: &str, own: &[ParameterRef], text: [&str; 3], confused: &[&str]) {
        let [name, what, equation] = text;
        let name = match id.split_once('@') {
            Some((_, of)) => format!("{name} of {of}"),
            None => name.to_owned(),
        };
        self.b.mechanism(id, own, [&name, what, equation, CONTROL], confused).unasked = true;
    }

    /// Errors that need no time.
    fn still(&mut self, c: usize, channel: &Quantity, [low, high]: [f64; 2]) {
        let span = high - low;
        if let Some(id) = self.wanted("sensor-gain", channel) {
            let gain = self.parameter((Kind::Gain, c), "gain", "", 0.0, [-0.9, 10.0], 0.1);
            let text = ["the sensor's gain", "Readings are the quantity times a factor.", "(1 + gain) y"];
            self.mechanism(&id, &[gain], text, &["clock-rate"]);
        }
        if let Some(id) = self.wanted("sensor-offset", channel) {
            let offset =
                self.parameter((Kind::Offset, c), "offset", &channel.unit, 0.0, UNBOUNDED, 0.05 * span);
            let text = ["the sensor's offset", "Readings are the quantity and a constant.", "y + offset"];
            self.mechanism(&id, &[offset], text, &["sensor-drift"]);
        }
        if let Some(id) = self.wanted("sensor-saturation", channel) {
            let (tenth, unit) = (0.1 * span, channel.unit.clone());
            let [open_above, open_below] = [high + tenth, low - tenth];
            let upper = (Kind::Upper, c);
            let upper = self.parameter(upper, "upper", &unit, open_above, [low, high + 2.0 * tenth], tenth);
            let lower = (Kind::Lower, c);
            let lower = self.parameter(lower, "lower", &unit, open_below, [low - 2.0 * tenth, high], tenth);
            let text = [
                "the sensor's saturation",
                "Beyond a bound the sensor reads the bound.",
                "min(max(y, lower), upper)",
            ];
            self.mechanism(&id, &[upper, lower], text, &[]);
            if let Some(mechanism) = self.b.mechanism_mut(&id) {
                mechanism.may_be_open = vec![upper.index, lower.index];
            }
        }
    }

    /// Errors in time.
    fn timed(&mut self, c: usize, channel: &Quantity, [low, high]: [f64; 2], clock: &Clock) {
        let step_s = clock.step_s;
        let late = [0.0, clock.longest_s()];
        if let Some(id) = self.wanted("sensor-drift", channel) {
            let unit = if channel.unit.is_empty() { "1/s".into() } else { format!("{}/s", channel.unit) };
            let scale = 0.05 * (high - low) / clock.duration_s;
            let rate = self.parameter((Kind::Drift, c), "rate_per_s", &unit, 0.0, UNBOUNDED, scale);
            let text =
                ["the sensor's drift", "Readings walk off steadily from each run's start.", "y + rate t"];
            self.mechanism(&id, &[rate], text, &["sensor-offset"]);
        }
        if let Some(id) = self.wanted("sensor-delay", channel) {
            let delay = self.parameter((Kind::Delay, c), "delay_s", "s", 0.0, late, step_s);
            let text = ["the sensor's delay", "Readings are old when they come.", "y(t - delay)"];
            self.mechanism(&id, &[delay], text, &["sensor-lag"]);
        }
        if let Some(id) = self.wanted("sensor-lag", channel) {
            let lag = self.parameter((Kind::Lag, c), "tau_s", "s", 0.0, late, step_s);
            let text = [
                "the sensor's lag",
                "Readings follow the quantity with a first-order lag.",
                "tau dy'/dt = y - y'",
            ];
            self.mechanism(&id, &[lag], text, &["sensor-delay"]);
        }
    }
}

/// Adds the errors of the sensors and of the clock to a specification: those in time where the first input is `t_s` and rises.
pub(super) fn add(b: &mut SpecBuilder, channels: &[Quantity], inputs: &[Quantity], runs: &[Run]) -> Sensors {
    let declared = b.so_far().mechanisms.iter().map(|m| m.id.clone()).collect();
    let time = |run: &Run| run.inputs[0].windows(2).all(|w| w[0] < w[1]);
    let timed = inputs.first().is_some_and(|first| first.name == "t_s") && runs.iter().all(time);
    let clock = Clock::of(runs);
    let range = |c: usize| {
        let readings = runs.iter().flat_map(|run| run.outputs[c].iter().copied()).filter(|v| v.is_finite());
        let range =
            readings.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)]);
        // Of what is still to be predicted nothing was measured: it has the errors of what was diagnosed.
        if range[0].is_finite() { range } else { [-1.0, 1.0] }
    };
    let ranges: Vec<[f64; 2]> = (0..channels.len()).map(range).collect();
    let sensors = Sensors { ranges: ranges.clone(), step_s: clock.step_s, ..Sensors::default() };
    let mut errors = Errors { b, sensors, declared, several: channels.len() > 1 };
    for (c, (channel, range)) in channels.iter().zip(ranges).enumerate() {
        // A channel that never changes shows none of them.
        if !(range[1] - range[0]).is_normal() {
            continue;
        }
        errors.still(c, channel, range);
        if timed {
            errors.timed(c, channel, range, &clock);
        }
    }
    if timed && !errors.sensors.parts.is_empty() && !errors.declared.contains("clock-rate") {
        let rate = errors.parameter((Kind::Clock, 0), "rate", "", 0.0, [-0.5, 0.5], 0.01);
        let text = ["the clock", "The recording's clock runs fast or slow.", "t = (1 + rate) t_true"];
        errors.mechanism("clock-rate", &[rate], text, &["sensor-gain", "sensor-delay"]);
    }
    errors.sensors
}

impl Sensors {
    /// Turns the predictions of all channels of a run into readings, in place: clock, delay, lag, gain, offset and drift, saturation.
    pub(super) fn read(&self, shared: &[f64], t: &[f64], out: &mut [f64]) {
        let on = |part: &&Part| shared[part.slot] != part.off;
        if !self.parts.iter().any(|part| on(&part)) {
            return;
        }
        let begin = t.first().copied().unwrap_or(0.0);
        let value = |kind: Kind, channel: usize| {
            let found = self.parts.iter().filter(on).find(|p| p.kind == kind && p.channel == channel);
            found.map(|p| shared[p.slot])
        };
        let rate = value(Kind::Clock, 0).unwrap_or(0.0);
        for (c, column) in out.chunks_exact_mut(t.len().max(1)).enumerate() {
            let delay = value(Kind::Delay, c).unwrap_or(0.0);
            if rate != 0.0 || delay != 0.0 {
                let read: Vec<f64> = t
                    .iter()
                    .map(|&t_s| along(t, column, begin + (t_s - begin - delay) / (1.0 + rate)))
                    .collect();
                column.copy_from_slice(&read);
            }
            if let Some(lag_s) = value(Kind::Lag, c) {
                lag(t, column, lag_s);
            }
            let [gain, offset, drift] =
                [Kind::Gain, Kind::Offset, Kind::Drift].map(|kind| value(kind, c).unwrap_or(0.0));
            let upper = value(Kind::Upper, c).unwrap_or(f64::INFINITY);
            let lower = value(Kind::Lower, c).unwrap_or(f64::NEG_INFINITY);
            for (y, t_s) in column.iter_mut().zip(t) {
                *y = (*y * (1.0 + gain) + offset + drift * (t_s - begin)).min(upper).max(lower);
            }
        }
    }

    /// Where to begin fitting a mechanism whose first parameter has this index.
    pub(super) fn starts(&self, first: usize) -> Vec<Vec<(usize, f64)>> {
        let Some(part) = self.parts.iter().find(|p| p.index == first) else { return Vec::new() };
        match part.kind {
            Kind::Delay | Kind::Lag => mechanics::late(first, self.step_s),
            // The lower bound is the next parameter.
            Kind::Upper => mechanics::sensor_bounds(first, first + 1, self.ranges[part.channel]),
            _ => Vec::new(),
        }
    }
}

/// The value of a curve through rows at a time: a cubic between two rows with the slopes of parabolas at them, straight on beyond the ends.
fn along(t: &[f64], y: &[f64], at: f64) -> f64 {
    let n = t.len();
    if n < 2 {
        return y.first().copied().unwrap_or(f64::NAN);
    }
    let slope = |i: usize| super::terms::rate(t, y, i);
    if at <= t[0] {
        return y[0] + slope(0) * (at - t[0]);
    }
    if at >= t[n - 1] {
        return y[n - 1] + slope(n - 1) * (at - t[n - 1]);
    }
    let i = t.partition_point(|t| *t <= at).clamp(1, n - 1) - 1;
    let h = t[i + 1] - t[i];
    let s = (at - t[i]) / h;
    let (a, b) = (slope(i) * h, slope(i + 1) * h);
    let rise = y[i + 1] - y[i];
    // Hermite's cubic.
    y[i] + s * (a + s * (3.0 * rise - 2.0 * a - b + s * (a + b - 2.0 * rise)))
}

/// A first-order lag of values that run straight from row to row, in the steady state of the first of these lines at first.
fn lag(t: &[f64], y: &mut [f64], lag_s: f64) {
    if y.len() < 2 || lag_s <= 0.0 {
        return;
    }
    let mut before = y[0];
    let mut reading = before - lag_s * (y[1] - y[0]) / (t[1] - t[0]);
    y[0] = reading;
    for i in 1..y.len() {
        let (now, dt) = (y[i], t[i] - t[i - 1]);
        let behind = lag_s * (now - before) / dt;
        reading = now - behind + (reading - before + behind) * (-dt / lag_s).exp();
        y[i] = reading;
        before = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    fn sensors(b: &mut SpecBuilder) -> Sensors {
        let t: Vec<f64> = (0..200).map(|i| 0.02 * f64::from(i)).collect();
        let y = t.iter().map(|t| (3.0 * t).sin()).collect();
        let run = Run { label: "1".into(), inputs: vec![t], outputs: vec![y], kind: 0 };
        add(b, &[Quantity::new("angle_rad", "rad")], &[Quantity::new("t_s", "s")], &[run])
    }

    fn read(set: &[(&str, f64)]) -> Vec<f64> {
        let mut b = SpecBuilder::default();
        let sensors = sensors(&mut b);
        let spec = b.build().unwrap();
        let mut shared: Vec<f64> = spec.parameters.iter().map(|p| p.start).collect();
        for (name, value) in set {
            shared[spec.parameters.iter().position(|p| p.name == *name).unwrap()] = *value;
        }
        let t: Vec<f64> = (0..200).map(|i| 0.02 * f64::from(i)).collect();
        let mut out: Vec<f64> = t.iter().map(|t| (3.0 * t).sin()).collect();
        sensors.read(&shared, &t, &mut out);
        out
    }

    /// Each error is what its equation says, on a sine whose delayed and lagging forms are known.
    #[test]
    fn errors_are_what_their_equations_say() {
        let t = |i: usize| 0.02 * i as f64;
        for (i, y) in read(&[]).iter().enumerate() {
            assert_eq!(*y, (3.0 * t(i)).sin());
        }
        for (i, y) in read(&[("gain", 0.1), ("offset", 0.2), ("rate_per_s", -0.3)]).iter().enumerate() {
            assert_abs_diff_eq!(*y, 1.1 * (3.0 * t(i)).sin() + 0.2 - 0.3 * t(i), epsilon = 1e-12);
        }
        for (i, y) in read(&[("delay_s", 0.033)]).iter().enumerate() {
            // Straight on before the first row.
            assert_abs_diff_eq!(*y, (3.0 * (t(i) - 0.033)).sin(), epsilon = if i < 2 { 3e-3 } else { 2e-5 });
        }
        for (i, y) in read(&[("rate", 0.05)]).iter().enumerate() {
            assert_abs_diff_eq!(*y, (3.0 * t(i) / 1.05).sin(), epsilon = 2e-5);
        }
        // A sine is behind by the angle whose tangent is omega tau, and smaller by its cosine.
        let behind: f64 = (3.0 * 0.1_f64).atan();
        for (i, y) in read(&[("tau_s", 0.1)]).iter().enumerate().skip(60) {
            assert_abs_diff_eq!(*y, behind.cos() * (3.0 * t(i) - behind).sin(), epsilon = 5e-4);
        }
        assert!(read(&[("upper", 0.5), ("lower", -0.25)]).iter().all(|y| (-0.25..=0.5).contains(y)));
    }

    /// Without time there is no clock, no drift and nothing late; what is declared is not tried again; a channel is named among several.
    #[test]
    fn only_what_makes_sense_is_tried() {
        let run = Run {
            label: "1".into(),
            inputs: vec![vec![3.0, 1.0, 2.0]],
            outputs: vec![vec![1.0, 2.0, 3.0], vec![5.0, 5.0, 5.0]],
            kind: 0,
        };
        let mut b = SpecBuilder::default();
        let own = b.shared("offset_n", "N", 0.0, UNBOUNDED, 1.0);
        b.mechanism("sensor-offset", &[own], ["", "", "", ""], &[]);
        let channels = [Quantity::new("force_n", "N"), Quantity::new("still_n", "N")];
        add(&mut b, &channels, &[Quantity::new("load_kg", "kg")], &[run]);
        let spec = b.build().unwrap();
        let ids: Vec<(&str, bool)> = spec.mechanisms.iter().map(|m| (m.id.as_str(), m.unasked)).collect();
        let expected =
            [("sensor-offset", false), ("sensor-gain@force_n", true), ("sensor-saturation@force_n", true)];
        assert_eq!(ids, expected);
    }
}
