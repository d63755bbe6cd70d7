//! What a machine is commanded in a run, and what was commanded before it, of which commands that are late tell at its beginning.

use joint_laws::Number;
use joint_laws::signal::{Between, Signal};
use missing_physics::data::Run;

use super::model::MotionModel;
use super::setting::Setting;
use super::start::rates;
use super::windows;

/// Rows before a window whose commands may still be on their way at its beginning.
const BEFORE: usize = 40;
/// The command before a run holds since so long before, s: longer than any delay.
const LONG_BEFORE_S: f64 = 1e6;
/// A machine rests under a command where its states change by no more than this part of what they do under another.
const RESTS: f64 = 0.05;

impl MotionModel {
    /// What a machine feels of an input that begins a run in a state.
    pub(super) fn signal<T: Number>(
        &self,
        run: &Run,
        setting: &Setting<T>,
        input: usize,
        x: &[T],
        shortest_s: f64,
    ) -> Signal<T> {
        let equations = self.equations();
        let between = equations.inputs[input].between;
        let mut drive = setting.drives[input].0;
        let mut joints = equations.joints.iter();
        if let (Some((_, follower)), Some(joint)) = (&mut drive.play, joints.find(|j| j.drive == Some(input)))
        {
            *follower = x[joint.position];
        }
        // Play begins where the joint stands at the run's beginning; what is late or slow still has what was before that.
        let [times, commands] = match drive.play {
            Some(_) => [&run.inputs[0][..], &run.inputs[1 + input]],
            None => self.commands(run, input),
        };
        let (Some(before), Some(begin)) = (setting.before[input], times.first()) else {
            return Signal::new(times, commands, between, &drive, shortest_s);
        };
        let [times, commands] = [(begin - LONG_BEFORE_S, times), (before, commands)]
            .map(|(first, rest)| [&[first], rest].concat());
        Signal::new(&times, &commands, between, &drive, shortest_s)
    }

    /// Times, and what an input is then: of a window with some rows before its beginning.
    fn commands<'a>(&'a self, run: &'a Run, input: usize) -> [&'a [f64]; 2] {
        let whole = self.cut.as_ref().filter(|_| windows::continues(run));
        let columns =
            whole.and_then(|runs| runs.get(windows::of_run(run))).map_or(&run.inputs, |w| &w.inputs);
        let (Some(first), Some(last)) = (run.inputs[0].first(), run.inputs[0].last()) else {
            return [&run.inputs[0], &run.inputs[1 + input]];
        };
        let from = columns[0].partition_point(|t| t < first).saturating_sub(BEFORE);
        let to = columns[0].partition_point(|t| t <= last);
        [&columns[0][from..to], &columns[1 + input][from..to]]
    }

    /// By input, what was commanded before a run, if that is not its first command: a machine that rests at first may have rested under
    /// another (a step is commanded when the run begins). Whichever is nearer to the run.
    pub(super) fn commanded_before<T: Number>(
        &self,
        run: &Run,
        setting: &Setting<T>,
        [shared, nuisance]: [&[T]; 2],
        moving: &[usize],
    ) -> Vec<Option<f64>> {
        let none = vec![None; self.equations().inputs.len()];
        let late_s = |k: usize| {
            let drive = &setting.drives[k].0;
            drive.delay_s.re() + drive.lag_s.map_or(0.0, |lag| lag.re())
        };
        let late: Vec<usize> = (0..none.len()).filter(|k| late_s(*k) > 0.0).collect();
        if late.is_empty() || run.is_empty() || windows::continues(run) {
            return none;
        }
        let [shared, nuisance]: [Vec<f64>; 2] =
            [shared, nuisance].map(|v| v.iter().map(|v| v.re()).collect());
        let begins = self.begins(run, &nuisance);
        let mut rested = none.clone();
        late.iter().for_each(|&k| rested[k] = self.rests_under(run, setting, &begins, k));
        if rested == none {
            return none;
        }
        // What is felt late for a few rows moves the machine for as long as it swings, and a fit sees all of that.
        let misses = |before: &[Option<f64>]| -> f64 {
            let mut out = vec![0.0; run.len() * run.outputs.len()];
            let mut setting = self.setting(run, &shared, &nuisance, moving);
            setting.before = before.to_vec();
            if self.predict_under(run, setting, &nuisance, &mut out).is_err() {
                return f64::INFINITY;
            }
            let of_output = |(c, column): (usize, &[f64])| -> f64 {
                let size = self.output_size(c);
                let known = column.iter().zip(&run.outputs[c]).filter(|(_, read)| read.is_finite());
                known.map(|(value, read)| ((value - read) / size).powi(2)).sum()
            };
            out.chunks(run.len()).enumerate().map(of_output).sum()
        };
        if misses(&rested) < misses(&none) { rested } else { none }
    }

    /// The command under which a machine rests where a run begins, if there is one and it is not the run's first.
    fn rests_under<T: Number>(
        &self,
        run: &Run,
        setting: &Setting<T>,
        begins: &[f64],
        input: usize,
    ) -> Option<f64> {
        let equations = self.equations();
        let held = equations.inputs[input].between == Between::Hold;
        let driven = equations.states.iter().position(|s| s.rate.has(equations.input_name(input)));
        let (true, Some(driven)) = (held, driven) else { return None };
        let mut names: Vec<f64> = setting.values[..equations.names()].iter().map(|v| v.re()).collect();
        names[..begins.len()].copy_from_slice(begins);
        for (k, column) in run.inputs[1..].iter().enumerate() {
            names[equations.input_name(k)] = column[0];
        }
        *names.last_mut()? = run.inputs[0][0];
        let mut under = |command: f64| {
            names[equations.input_name(input)] = command;
            rates(equations, &names)
        };
        let first = run.inputs[1 + input][0];
        let [now, beside] = [under(first), under(first + 1.0)];
        let rested = first - now[driven] / (beside[driven] - now[driven]);
        let changes = |rates: &[f64]| rates.iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
        let rests = rested.is_finite() && changes(&under(rested)) <= RESTS * changes(&now);
        (rests && rested != first).then_some(rested)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use missing_physics::model::{Model as _, Scope};

    use super::super::equations::Equations;
    use super::super::follow::{first_pace, sizes};
    use super::super::recorded;
    use super::*;
    use crate::recording::{Header, Memory, Source};

    const CART: &str = r#"
format = 1
[model]
states = { place_m = "speed_m_s", speed_m_s = "4*force_n - 2*speed_m_s" }
outputs = { laser_m = "place_m" }
inputs = { force_n = "hold" }
[start]
place_m = 0.0
speed_m_s = 0.0
[[joint]]
name = "cart"
position = "place_m"
velocity = "speed_m_s"
drive = "force_n"
"#;

    /// A step that is commanded when the run begins and is late finds the machine at rest; one that was commanded before does not. The
    /// readings say which of the two it was.
    #[test]
    fn a_late_step_finds_the_machine_at_rest() {
        let header = Header::parse(Source::Memory(Memory::new("a cart")), CART, false).unwrap();
        let times: Vec<f64> = (0..100).map(|k| 0.01 * f64::from(k)).collect();
        for late_s in [0.05, 0.0] {
            let moved = |t: &f64| {
                let t = (t - late_s).max(0.0);
                6.0 * t - 3.0 * (1.0 - (-2.0 * t).exp())
            };
            let expected: Vec<f64> = times.iter().map(moved).collect();
            let inputs = vec![times.clone(), vec![3.0; times.len()]];
            let run = Run { label: "1".into(), inputs, outputs: vec![expected.clone()], kind: 0 };
            let recording = recorded(&["laser_m"], "force_n", run, 0.0);
            let baseline = MotionModel::baseline(Equations::read(&header).unwrap(), first_pace(&recording));
            let scales = sizes(&baseline, &recording, &[]).unwrap();
            let model = baseline.full(scales, &[], None);
            let delay = model.spec().mechanisms.iter().find(|m| m.id == "input-delay").unwrap();
            let mut shared = model.spec().starts(Scope::Shared);
            shared[model.spec().slots()[delay.parameters[0]]] = 0.05;
            let mut out = vec![0.0; times.len()];
            model.predict(&recording.runs[0], &shared, &[], &mut out).unwrap();
            for (value, expected) in out.iter().zip(&expected) {
                // By the delay the two are 10 mm apart; the steps of the integration are of a first guess.
                assert!((value - expected).abs() < 1e-4, "{late_s}: {value} {expected}");
            }
        }
    }
}
