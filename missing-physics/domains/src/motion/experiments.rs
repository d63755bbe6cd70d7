//! What a machine could be commanded next: columns of an input that change slowly, at once or fast.

use std::f64::consts::TAU;

use missing_physics::data::{Recording, Run};
use missing_physics::model::{Experiment, Model as _, Scope};

use super::model::MotionModel;
use super::scales::range;

/// Rows of a proposed run.
const MOST_ROWS: usize = 400;
/// Sizes of a column that are tried, in parts of the input's recorded size.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.1];
/// How far beyond its recorded range an output may go, in parts of that range.
const BEYOND: f64 = 0.5;
/// An input whose range reaches to this part of it on either side of zero rests at zero, another one in the middle.
const BOTH_WAYS: f64 = 0.2;
/// Rows in a period of the fastest wave.
const FASTEST_ROWS: f64 = 10.0;
/// Shapes, and how long they last, in parts of the longest run.
const COLUMNS: [(Shape, f64); 4] =
    [(Shape::Ramp, 1.0), (Shape::Ramp, 3.0), (Shape::Steps, 1.0), (Shape::Chirp, 1.0)];

/// How an input changes over a run.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// To one side, to the other and back along straight lines.
    Ramp,
    /// To one side and to the other at once, with rests between.
    Steps,
    /// To and fro, faster and faster.
    Chirp,
}

impl Shape {
    fn name(self) -> &'static str {
        match self {
            Self::Ramp => "ramp",
            Self::Steps => "steps",
            Self::Chirp => "chirp",
        }
    }

    /// How far from rest the input is at a part of the run, in parts of its size; the fastest wave would have so many periods in the run.
    fn at(self, part: f64, periods: f64) -> f64 {
        match self {
            Self::Ramp if part < 0.25 => 4.0 * part,
            Self::Ramp if part < 0.75 => 2.0 - 4.0 * part,
            Self::Ramp => 4.0 * part - 4.0,
            Self::Steps => [0.0, 1.0, 0.0, -1.0, 0.0][((5.0 * part) as usize).min(4)],
            // Its frequency grows evenly, from one period in the run.
            Self::Chirp => (TAU * part * (1.0 + 0.5 * (periods - 1.0) * part)).sin(),
        }
    }

    fn words(self, input: &str, [rest, size, lasts_s]: [f64; 3]) -> String {
        let (up, down) = (rest + size, rest - size);
        match self {
            Self::Ramp => format!(
                "lead {input} along straight lines from {rest:.3} to {up:.3}, to {down:.3} and back in {lasts_s:.3} s, from rest"
            ),
            Self::Steps => format!(
                "set {input} to {rest:.3}, {up:.3}, {rest:.3}, {down:.3} and {rest:.3}, each for a fifth of {lasts_s:.3} s, from rest"
            ),
            Self::Chirp => format!(
                "swing {input} between {down:.3} and {up:.3}, faster and faster, for {lasts_s:.3} s, from rest"
            ),
        }
    }
}

/// Ramps, steps and waves of each input that moves the machine, from rest, the other inputs as they were in the first row; each as large as
/// the equations alone allow without going far beyond what was recorded. Rows are `step_s` apart, or more; the longest run lasts
/// `duration_s`.
pub(super) fn experiments(
    model: &MotionModel,
    recording: &Recording,
    [step_s, duration_s]: [f64; 2],
) -> Vec<Experiment> {
    let Some(first) = recording.runs.first() else { return Vec::new() };
    let equations = model.equations();
    let mut list = Vec::new();
    for (input, of) in equations.inputs.iter().enumerate() {
        if !equations.states.iter().any(|s| s.rate.has(equations.input_name(input))) {
            continue;
        }
        let [low, high] = commanded(recording, input);
        let both_ways = high.min(-low) > BOTH_WAYS * (high - low);
        let rest = if both_ways { 0.0 } else { 0.5 * (low + high) };
        for (shape, longer) in COLUMNS {
            let lasts_s = longer * duration_s;
            let rows = ((lasts_s / step_s).round() as usize).clamp(8, MOST_ROWS);
            let fitting = SHARES.iter().find_map(|share| {
                let size = share * (high - rest).min(rest - low);
                let part = |row: usize| row as f64 / rows as f64;
                let periods = rows as f64 / FASTEST_ROWS;
                let column = (0..=rows).map(|row| rest + size * shape.at(part(row), periods)).collect();
                let mut run = from_rest(first, (0..=rows).map(|row| lasts_s * part(row)).collect());
                run.inputs[1 + input] = column;
                stays_near(model, recording, &run).then_some((size, run))
            });
            list.extend(fitting.map(|(size, run)| Experiment {
                action: vec![
                    (format!("{}_{}", shape.name(), of.name), size),
                    (format!("rest_{}", of.name), rest),
                    ("duration_s".into(), lasts_s),
                ],
                words: shape.words(&of.name, [rest, size, lasts_s]),
                nuisance: vec![model.at_rest(first)],
                runs: vec![run],
            }));
        }
    }
    list
}

/// From where to where an input was commanded; of one that was the same throughout, between that and nothing.
fn commanded(recording: &Recording, input: usize) -> [f64; 2] {
    let all = || recording.runs.iter().flat_map(|r| r.inputs[1 + input].iter().copied());
    match all().find(|v| v.is_finite()).filter(|first| *first != 0.0) {
        Some(first) if all().all(|v| v == first) => [first.min(0.0), first.max(0.0)],
        _ => range(all()),
    }
}

/// A run with given times that begins as another did; its inputs stay as they were there in the first row.
fn from_rest(first: &Run, times: Vec<f64>) -> Run {
    let rows = times.len();
    let stay = |column: &Vec<f64>| {
        let begun = column.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
        vec![begun; rows]
    };
    let inputs = std::iter::once(times).chain(first.inputs[1..].iter().map(stay)).collect();
    Run { label: "next".into(), inputs, outputs: first.outputs.iter().map(stay).collect(), kind: 0 }
}

/// Whether the equations alone lead no output far beyond its recorded range.
fn stays_near(model: &MotionModel, recording: &Recording, run: &Run) -> bool {
    let rows = run.len();
    let mut out = vec![0.0; rows * recording.channels.len()];
    let Ok(()) = model.predict(run, &model.spec().starts(Scope::Shared), &model.at_rest(run), &mut out)
    else {
        return false;
    };
    out.chunks(rows).enumerate().all(|(channel, predicted)| {
        let [low, high] = range(recording.runs.iter().flat_map(|r| r.outputs[channel].iter().copied()));
        let more = BEYOND * (high - low);
        predicted.iter().all(|v| (low - more..=high + more).contains(v))
    })
}

#[cfg(test)]
mod tests {
    use missing_physics::data::{Recording, Run};

    use super::{Shape, commanded};

    /// An input that was the same throughout may be off, and no more than it was; another one as far as it went.
    #[test]
    fn an_input_that_never_changed_is_between_that_and_nothing() {
        let inputs = |command: [f64; 3]| vec![vec![0.0, 1.0, 2.0], command.into()];
        let run = |command| Run { label: "1".into(), inputs: inputs(command), outputs: Vec::new(), kind: 0 };
        let asked = |command| {
            let runs = vec![run(command)];
            commanded(
                &Recording {
                    channels: Vec::new(),
                    variables: Vec::new(),
                    runs,
                    noise_along: None,
                    calibration: Vec::new(),
                    resolution: Vec::new(),
                },
                0,
            )
        };
        assert_eq!(asked([50.0; 3]), [0.0, 50.0]);
        assert_eq!(asked([-2.0; 3]), [-2.0, 0.0]);
        assert_eq!(asked([0.0; 3]), [-0.5, 0.5]);
        assert_eq!(asked([1.0, 3.0, 2.0]), [1.0, 3.0]);
    }

    /// A ramp's ends and middle, the order of steps, and that the fastest wave is as fast as it should be.
    #[test]
    fn columns_have_the_shapes_of_their_words() {
        let ramp = [0.0, 0.125, 0.25, 0.5, 0.75, 0.875, 1.0].map(|part| Shape::Ramp.at(part, 40.0));
        assert_eq!(ramp, [0.0, 0.5, 1.0, 0.0, -1.0, -0.5, 0.0]);
        let steps = [0.0, 0.3, 0.5, 0.7, 0.9, 1.0].map(|part| Shape::Steps.at(part, 40.0));
        assert_eq!(steps, [0.0, 1.0, 0.0, -1.0, 0.0, 0.0]);
        let crossings = |from: f64, to: f64| {
            let wave = |k: u32| Shape::Chirp.at(from + (to - from) * f64::from(k) / 1e4, 40.0);
            (0..10_000).filter(|&k| wave(k) <= 0.0 && wave(k + 1) > 0.0).count()
        };
        // 40 periods in a run would be 4 in its last tenth, a little less as it only then becomes so fast.
        assert!((3..=4).contains(&crossings(0.9, 1.0)), "{}", crossings(0.9, 1.0));
        assert!((19..=22).contains(&crossings(0.0, 1.0)), "{}", crossings(0.0, 1.0));
    }
}
