//! The domain `custom`: anybody's simulator, as a program that is asked or as columns that it has written.

mod answer;
mod carrier;
mod declare;
mod machine;
mod model;
mod process;
mod sensors;
mod simulator;
mod terms;

use std::collections::HashMap;
use std::sync::Arc;

use missing_physics::data::{Recording, Run};
use missing_physics::model::{Experiment, Quantity, Scope, Spec, SpecBuilder};

use crate::domain::{CheckedRecording, Domain, Loaded, Template};
use crate::plausible;
use crate::reading::{calibration, check_runs, number, resolution, sensor_steps};
use crate::recording::{Column, Header, ReadError, Source, Table, quoted};
pub use answer::{Failure, fill, read_answer, read_batch};
pub use machine::JointForce;
use model::{CustomModel, Program, Simulation};
use process::Pool;
pub use process::end_all;
pub use simulator::{Questions, Simulator};
use terms::Sizes;

/// A run with fewer rows says nothing of a curve.
const FEWEST_ROWS: usize = 3;
/// Where the file does not say what the simulation is.
const BASELINE: &str = "the simulation as it came with the recording";

/// The domain.
#[derive(Debug, Clone, Copy)]
pub struct Custom;

impl Domain for Custom {
    fn id(&self) -> &'static str {
        "custom"
    }

    fn summary(&self) -> &'static str {
        "anybody's simulator: a program that answers JSON lines, or columns sim_<channel> that it has written"
    }

    fn reads(&self) -> &'static [(&'static str, &'static str)] {
        &[
            ("run, the inputs, the channels", "one row a measurement; names as in [[input]] and [[channel]]"),
            ("sim_<channel>", "what the simulation says of each channel, where no program is named"),
            (
                "[[input]] name, unit, acts",
                "known exactly; noise may be correlated along the first, if it rises; acts = \"hold\" or \"linear\": drives the program",
            ),
            ("[[channel]] name, unit", "measured"),
            ("baseline", "optional: what the simulation is, in a sentence"),
            (
                "[simulator] command",
                "a list of texts: the program and its arguments, run in the recording's folder",
            ),
            (
                "[simulator] timeout_s, processes, step, batch",
                "optional: 60 s an answer, 1 at once, 1e-3 scales for derivatives, sets of parameters in a line",
            ),
            ("[[parameter]] name, unit, start, lower, upper, scale, per_run", "free in the baseline"),
            (
                "[[mechanism]] id, name, explanation, equation, reference, confused_with",
                "what may have been left out",
            ),
            (
                "[[joint]] name, position, typical_force, force_unit, range, speed, driven, turns, without",
                "a joint of the program, which takes further forces: the mechanisms of motion's joints are tried",
            ),
            ("[[mechanism.parameter]] name, unit, off, lower, upper, scale, per_run", "off at `off` (0)"),
            (
                "experiments",
                "optional, with a program: a CSV of runs that could be recorded next, inputs only",
            ),
            ("[noise] a channel's name", "optional: one sigma from a calibration"),
        ]
    }

    fn spec(&self) -> Spec {
        Spec { baseline: BASELINE.into(), ..Spec::default() }
    }

    fn template(&self) -> Template {
        Template { header: include_str!("template.toml"), data: ("data.csv", include_str!("template.csv")) }
    }

    fn read(&self, header: &Header) -> Result<CheckedRecording, ReadError> {
        read(header, None)
    }
}

/// Reads a recording whose header names no program, and which `simulator` predicts: what a `command` does, done within the program.
///
/// With `gaps`, cells of the table may be empty where nothing was measured: what is to be predicted.
///
/// # Errors
/// [`ReadError`].
pub fn load_with(source: &Source, simulator: Arc<dyn Simulator>, gaps: bool) -> Result<Loaded, ReadError> {
    let header = if gaps { Header::read_with_gaps(source) } else { Header::read(source) }?;
    match header.root().text("domain", "\"custom\"")? {
        "custom" => {}
        other => return Err(header.root().unfit("domain", quoted(other), "\"custom\"")),
    }
    let checked = read(&header, Some(simulator))?;
    header.finish()?;
    checked.prepare()
}

/// Reads the recording of a header; `within` predicts it in place of a program that the header names.
fn read(header: &Header, within: Option<Arc<dyn Simulator>>) -> Result<CheckedRecording, ReadError> {
    let inputs = quantities(header, "input")?;
    let channels = quantities(header, "channel")?;
    let (start, relative_step) = declare::program(header)?;
    let program = within.or_else(|| start.map(|start| -> Arc<dyn Simulator> { Arc::new(Pool::new(start)) }));
    let mut b = SpecBuilder::default();
    let (parameters, by_run) = declare::declare(header, &mut b)?;
    b.baseline(header.root().optional_text("baseline", "a sentence")?.unwrap_or(BASELINE));
    let channel_names: Vec<&str> = channels.iter().map(|c| c.name.as_str()).collect();
    let calibration = calibration(header, &channel_names)?;

    let simulated: Vec<String> = channels.iter().map(|c| format!("sim_{}", c.name)).collect();
    let mut known = vec![Column { name: "run", what: "label of the run", label: true }];
    known.extend(inputs.iter().map(|q| number(&q.name, "a known input")));
    known.extend(channels.iter().map(|q| number(&q.name, "a measured channel")));
    if program.is_none() {
        known.extend(simulated.iter().map(|n| number(n, "the simulation's prediction of a channel")));
    }
    let table = header.table("data", &known)?;
    let runs = runs(&table, &inputs, &channels)?;
    let begins = by_run.iter().map(|p| p.begins(&runs, &channels)).collect::<Result<Vec<_>, ReadError>>()?;
    let rises = |run: &Run| run.inputs[0].windows(2).all(|w| w[0] < w[1]);
    let along = runs.iter().all(rises);
    let sizes = |quantities: &[Quantity], column: fn(&Run, usize) -> &[f64]| -> Vec<(Quantity, f64)> {
        let size = |k| match root_mean_square(runs.iter().flat_map(|r| column(r, k).iter().copied())) {
            // What is to be predicted has the terms of what was diagnosed, whatever was measured of it.
            size if header.gaps() && !(size > 0.0) => 1.0,
            size => size,
        };
        quantities.iter().enumerate().map(|(k, q)| (q.clone(), size(k))).collect()
    };
    let extent = || {
        let spans = runs.iter().map(|r| r.inputs[0].last().unwrap_or(&0.0) - r.inputs[0][0]);
        spans.fold(0.0, f64::max)
    };
    let terms = terms::add(
        &mut b,
        &Sizes {
            inputs: &sizes(&inputs, |run, k| &run.inputs[k]),
            channels: &sizes(&channels, |run, k| &run.outputs[k]),
            extent: along.then(extent),
        },
    );
    let machine = machine::declare(header, &mut b, &inputs, &channels, &runs)?;
    let sensors = sensors::add(&mut b, &channels, &inputs, &runs);
    let experiments = experiments(header, &inputs, channels.len(), b.so_far(), program.is_some())?;
    let simulation = match program {
        Some(simulator) => {
            let program = Program::new(simulator, &inputs, &channels, parameters, machine, relative_step);
            Simulation::Program(Box::new(program))
        }
        None if !parameters.is_empty() || !machine.is_empty() => {
            let expected =
                "a program, for the parameters, mechanisms, joints and acting inputs that are declared";
            return Err(header.section("simulator")?.unfit("command", "absent", expected));
        }
        None => Simulation::Precomputed(precomputed(&table, &simulated)?),
    };
    let steps = channels.iter().map(|c| table.numbers(&c.name).map_or(0.0, resolution));
    let resolution = if along { sensor_steps(&runs, steps) } else { steps.collect() };
    let columns = channels.iter().chain(&inputs);
    let largest =
        |name: &str| table.numbers(name).unwrap_or_default().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let hints = plausible::angles(columns.map(|q| (q.name.as_str(), largest(&q.name))));
    let recording = Recording {
        channels,
        variables: inputs,
        runs,
        noise_along: along.then_some(0),
        calibration,
        resolution,
    };
    let model = CustomModel { spec: b.build_unchecked(), simulation, terms, sensors, begins, relative_step };
    let loaded = Loaded::new(recording, model, experiments, Vec::new());
    Ok(CheckedRecording::from(loaded).with_hints(hints))
}

/// The declared inputs or channels.
fn quantities(header: &Header, kind: &str) -> Result<Vec<Quantity>, ReadError> {
    let mut all: Vec<Quantity> = Vec::new();
    let expected = "the name of a column, with its unit as a suffix, unlike the others'";
    for section in header.root().sections(kind)? {
        let name = section.text("name", expected)?;
        let taken = name == "run" || name.starts_with("sim_") || all.iter().any(|q| q.name == name);
        if name.is_empty() || taken {
            return Err(section.unfit("name", quoted(name), expected));
        }
        let unit = section.optional_text("unit", "a unit, such as \"rad\"")?.unwrap_or_default();
        all.push(Quantity::new(name, unit));
    }
    if all.is_empty() {
        let missing = format!("at least one [[{kind}]] with the name of a column");
        return Err(header.root().unfit(kind, "absent", missing));
    }
    Ok(all)
}

fn columns<'t>(
    table: &'t Table<'_>,
    names: impl Iterator<Item = &'t str>,
) -> Result<Vec<&'t [f64]>, ReadError> {
    names.map(|n| table.numbers(n).ok_or_else(|| table.missing(n, "a column of that name"))).collect()
}

/// The runs of a table, with channels where there are any.
fn runs(table: &Table<'_>, inputs: &[Quantity], channels: &[Quantity]) -> Result<Vec<Run>, ReadError> {
    let labels = table.labels("run", "the label of each row's run")?;
    let known = columns(table, inputs.iter().map(|q| q.name.as_str()))?;
    let measured = columns(table, channels.iter().map(|q| q.name.as_str()))?;
    let by_run = check_runs(
        table,
        labels,
        FEWEST_ROWS,
        inputs.first().map(|q| q.name.as_str()).filter(|n| *n == "t_s"),
    )?;
    let run = |(label, rows): (String, Vec<usize>)| {
        let pick = |all: &[&[f64]]| -> Vec<Vec<f64>> {
            all.iter().map(|column| rows.iter().map(|&r| column[r]).collect()).collect()
        };
        Run { label, inputs: pick(&known), outputs: pick(&measured), kind: 0 }
    };
    Ok(by_run.into_iter().map(run).collect())
}

/// What was simulated before, by run.
fn precomputed(table: &Table<'_>, simulated: &[String]) -> Result<HashMap<String, Vec<f64>>, ReadError> {
    let expected = "the simulation's prediction, or a program in [simulator] command";
    let labels = table.labels("run", "the label of each row's run")?;
    let columns: Vec<&[f64]> = simulated
        .iter()
        .map(|n| table.numbers(n).ok_or_else(|| table.missing(n, expected)))
        .collect::<Result<_, _>>()?;
    let one = |rows: Vec<usize>| columns.iter().flat_map(|c| rows.iter().map(|&r| c[r])).collect();
    Ok(Table::by_run(labels).into_iter().map(|(label, rows)| (label, one(rows))).collect())
}

/// Runs that could be recorded next.
fn experiments(
    header: &Header,
    inputs: &[Quantity],
    channels: usize,
    spec: &Spec,
    program: bool,
) -> Result<Vec<Experiment>, ReadError> {
    let expected = "the name of a CSV file with the inputs of runs that could be recorded";
    let Some(name) = header.root().optional_text("experiments", expected)? else { return Ok(Vec::new()) };
    if !program {
        return Err(header.root().unfit("experiments", quoted(name), "no experiments without a program"));
    }
    let mut known = vec![Column { name: "run", what: "label of the run", label: true }];
    known.extend(inputs.iter().map(|q| number(&q.name, "a known input")));
    let table = header.table("experiments", &known)?;
    let nuisance = spec.starts(Scope::PerRun);
    let experiment = |mut run: Run| {
        run.outputs = vec![vec![0.0; run.len()]; channels];
        let constant = |column: &[f64]| column.windows(2).all(|w| w[0] == w[1]);
        let action = inputs.iter().zip(&run.inputs).filter(|(_, c)| constant(c));
        let action = action.map(|(q, c)| (q.name.clone(), c[0])).collect();
        let words = format!("record the run {} of {name}", quoted(&run.label));
        // Not to be taken for a run that was recorded.
        run.label = format!("next: {}", run.label);
        Experiment { action, words, runs: vec![run], nuisance: vec![nuisance.clone()] }
    };
    Ok(runs(&table, inputs, &[])?.into_iter().map(experiment).collect())
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let measured = values.filter(|v| !v.is_nan());
    let (sum, n) = measured.fold((0.0, 0usize), |(sum, n), v| (sum + v * v, n + 1));
    (sum / n.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
    use std::sync::Mutex;

    use super::*;
    use crate::recording::Memory;

    /// A line through zero, which notes how many sets it was asked for at once.
    #[derive(Debug, Default)]
    struct Line(Mutex<Vec<usize>>);

    impl Simulator for Line {
        fn predict(&self, questions: &Questions<'_>) -> Result<Vec<Vec<f64>>, Failure> {
            self.0.lock().unwrap().push(questions.sets.len());
            let (_, x) = questions.inputs[0];
            Ok(questions.sets.iter().map(|set| x.iter().map(|x| set[0] * x).collect()).collect())
        }

        fn batches(&self) -> bool {
            true
        }

        fn fault(&self) -> Option<String> {
            None
        }

        fn give_up(&self, why: String) -> Failure {
            Failure::Fatal(why)
        }
    }

    fn source(domain: &str) -> Source {
        let header = format!(
            "format = 1\ndomain = \"{domain}\"\ndata = \"data.csv\"\n[[input]]\nname = \"x_m\"\n[[channel]]\nname = \"y_m\"\n\
             [[parameter]]\nname = \"slope\"\nstart = 1.0\nscale = 0.1\n"
        );
        let rows: String = (0..9).map(|i| format!("a,{i},{}\n", 2 * i)).collect();
        Source::Memory(
            Memory::new("m")
                .with_file("recording.toml", header)
                .with_file("data.csv", "run,x_m,y_m\n".to_owned() + &rows),
        )
    }

    /// What derivatives need is asked for at once: the parameters, and two sets a derivative; it is one answer whatever is asked first.
    #[test]
    fn a_function_stands_in_for_a_command_and_is_asked_for_many_sets_at_once() {
        let line = Arc::new(Line::default());
        let loaded = load_with(&source("custom"), line.clone(), false).unwrap();
        let (model, run) = (&loaded.model, &loaded.recording.runs[0]);
        // All that is beside the slope is off.
        let mut shared = model.spec().starts(Scope::Shared);
        shared[0] = 1.5;
        let (mut out, mut slope) = (vec![0.0; 9], vec![0.0; 9]);
        model.jacobian(run, &shared, &[], &[0], &[], &mut out, &mut slope).unwrap();
        assert_eq!(line.0.lock().unwrap().as_slice(), [3]);
        assert!(slope.iter().zip(&run.inputs[0]).all(|(d, x)| (d - x).abs() < 1e-9), "{slope:?}");
        assert_eq!(out[8], 12.0);
    }

    /// Terms are among the parameters of a repaired model, so they may not depend on what was measured of what it is to predict.
    #[test]
    fn what_is_to_be_predicted_has_the_terms_of_what_was_diagnosed() {
        let names = |loaded: Loaded| -> Vec<String> {
            loaded.model.spec().parameters.iter().map(|p| p.name.clone()).collect()
        };
        let diagnosed = names(load_with(&source("custom"), Arc::new(Line::default()), false).unwrap());
        let Source::Memory(memory) = source("custom") else { unreachable!() };
        for rows in ["a,0,\na,1,\na,2,\n", "a,0,0\na,1,\na,2,4\n"] {
            let open = memory.clone().with_file("data.csv", "run,x_m,y_m\n".to_owned() + rows);
            let open = load_with(&Source::Memory(open), Arc::new(Line::default()), true).unwrap();
            assert_eq!(names(open), diagnosed, "{rows}");
        }
    }

    #[test]
    fn a_function_predicts_recordings_of_this_domain_alone() {
        let said = load_with(&source("slosh"), Arc::new(Line::default()), false).unwrap_err().to_string();
        assert_eq!(said, "m/recording.toml: key domain is \"slosh\", expected \"custom\"");
    }
}
