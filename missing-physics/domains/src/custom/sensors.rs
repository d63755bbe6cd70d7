//! What a sensor and a clock may do to what a simulator predicts, whatever it simulates: mechanisms that nobody has to ask for.

use missing_physics::data::Run;
use missing_physics::model::{Quantity, SpecBuilder};

use super::carrier::{Carrier, Part};
use crate::mechanics::{self, CONTROL, Clock, Declares, OutputEffect};

/// What a parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    /// Of the sensor of a channel.
    Output(usize, OutputEffect),
    /// By how much the clock of all channels is fast.
    Clock,
}

/// The errors of all sensors.
#[derive(Debug, Default)]
pub(super) struct Sensors {
    parts: Vec<Part<Role>>,
    /// Smallest and largest reading of each channel.
    ranges: Vec<[f64; 2]>,
    step_s: f64,
}

/// Adds the errors of the sensors and of the clock to a specification: those in time where the first input is `t_s` and rises.
pub(super) fn add(b: &mut SpecBuilder, channels: &[Quantity], inputs: &[Quantity], runs: &[Run]) -> Sensors {
    let declared: Vec<String> = b.so_far().mechanisms.iter().map(|m| m.id.clone()).collect();
    let but: Vec<&str> = declared.iter().map(String::as_str).collect();
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
    let mut parts = Vec::new();
    for (c, (channel, &range)) in channels.iter().zip(&ranges).enumerate() {
        // A channel that never changes shows none of them.
        if !(range[1] - range[0]).is_normal() {
            continue;
        }
        let of = (channels.len() > 1).then_some(channel.name.as_str());
        let role = |effect| Role::Output(c, effect);
        let but = but.clone();
        let mut carrier = Carrier { b: &mut *b, parts: &mut parts, of, role, but, unasked: true };
        mechanics::outputs(&mut carrier, &channel.unit, range, timed.then_some(&clock));
    }
    let role = |()| Role::Clock;
    let any = !parts.is_empty();
    let mut carrier = Carrier { b, parts: &mut parts, of: None, role, but, unasked: true };
    if timed && any && carrier.wants("clock-rate") {
        let rate = carrier.parameter((), "rate", "", 0.0, [-0.5, 0.5], 0.01);
        let text =
            ["the clock", "The recording's clock runs fast or slow.", "t = (1 + rate) t_true", CONTROL];
        carrier.mechanism("clock-rate", &[rate], text, &["sensor-gain", "sensor-delay"]);
    }
    Sensors { parts, ranges, step_s: clock.step_s }
}

impl Sensors {
    /// Turns the predictions of all channels of a run into readings, in place: clock, delay, lag, gain, offset and drift, saturation.
    pub(super) fn read(&self, shared: &[f64], t: &[f64], out: &mut [f64]) {
        let on = |part: &&Part<Role>| shared[part.slot] != part.off;
        if !self.parts.iter().any(|part| on(&part)) {
            return;
        }
        let begin = t.first().copied().unwrap_or(0.0);
        let of = |role: Role| self.parts.iter().filter(on).find(|p| p.role == role).map(|p| shared[p.slot]);
        let rate = of(Role::Clock).unwrap_or(0.0);
        for (c, column) in out.chunks_exact_mut(t.len().max(1)).enumerate() {
            let value = |effect: OutputEffect| of(Role::Output(c, effect));
            let delay = value(OutputEffect::Delay).unwrap_or(0.0);
            if rate != 0.0 || delay != 0.0 {
                let read: Vec<f64> = t
                    .iter()
                    .map(|&t_s| along(t, column, begin + (t_s - begin - delay) / (1.0 + rate)))
                    .collect();
                column.copy_from_slice(&read);
            }
            if let Some(lag_s) = value(OutputEffect::Lag) {
                lag(t, column, lag_s);
            }
            let [gain, offset, drift] = [OutputEffect::Gain, OutputEffect::Offset, OutputEffect::Drift]
                .map(|effect| value(effect).unwrap_or(0.0));
            let upper = value(OutputEffect::Upper).unwrap_or(f64::INFINITY);
            let lower = value(OutputEffect::Lower).unwrap_or(f64::NEG_INFINITY);
            for (y, t_s) in column.iter_mut().zip(t) {
                *y = (*y * (1.0 + gain) + offset + drift * (t_s - begin)).min(upper).max(lower);
            }
        }
    }

    /// Where to begin fitting a mechanism of these parameters, by their indices.
    pub(super) fn starts(&self, parameters: &[usize]) -> Vec<Vec<(usize, f64)>> {
        let part = parameters.first().and_then(|first| self.parts.iter().find(|p| p.index == *first));
        match part.map(|part| part.role) {
            Some(Role::Output(c, effect)) => {
                mechanics::output_starts(effect, parameters, self.ranges[c], self.step_s)
            }
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
        let own = b.shared("offset_n", "N", 0.0, missing_physics::model::UNBOUNDED, 1.0);
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
