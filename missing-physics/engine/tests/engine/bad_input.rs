//! Specifications, recordings and experiments that make no sense: each is refused by its own error, and nothing panics.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use crate::common::{Ball, World, mechanism, parameter};
use missing_physics::data::{Recording, RecordingError, Run};
use missing_physics::engine::{DiagnoseError, Options, diagnose};
use missing_physics::likelihood::{Likelihood, Scores};
use missing_physics::model::{
    Experiment, Mechanism, Model, Parameter, PredictError, Quantity, Scope, Spec, SpecBuilder, SpecError,
    Term, UNBOUNDED,
};
use missing_physics::observer::Silent;
use missing_physics::oracle::oracle;
use missing_physics::repaired::RepairedError;
use missing_physics::synthetic::{Simulator, Synthetic, SyntheticError};
use rand::Rng;

/// A model that says nothing but its specification.
struct Said(Spec);

impl Model for Said {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn predict(&self, _: &Run, _: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), PredictError> {
        out.fill(0.0);
        Ok(())
    }
}

/// Two parameters, one freed by a mechanism, the other the coefficient of a term.
fn sound() -> Spec {
    Spec {
        parameters: vec![parameter("rate", 0.0, [0.0, 1.0]), parameter("factor", 0.0, UNBOUNDED)],
        mechanisms: vec![mechanism("drag", vec![0])],
        terms: vec![Term {
            parameter: 1,
            formula: "v".into(),
            adds_to: Quantity::new("a", ""),
            variables: vec![],
        }],
        ..Spec::default()
    }
}

/// What the check, and a diagnosis, say of a sound specification that is changed.
fn refused(change: impl Fn(&mut Spec)) -> SpecError {
    let mut spec = sound();
    change(&mut spec);
    let error = spec.check().unwrap_err();
    let said = diagnose(&Said(spec), &World::NULL.draw(1), &[], &Options::default(), &Silent);
    // By their words: NaN is unlike itself.
    assert!(matches!(said, Err(DiagnoseError::Spec(e)) if e.to_string() == error.to_string()));
    error
}

#[test]
fn a_sound_specification_passes() {
    assert_eq!(sound().check(), Ok(()));
    assert_eq!(Ball::default().spec().check(), Ok(()));
}

#[test]
fn an_index_is_one_of_a_parameter() {
    let beyond = |index, parameters| move |e: SpecError| matches!(e, SpecError::Index { index: i, parameters: p, .. } if (i, p) == (index, parameters));
    assert!(beyond(2, 2)(refused(|s| s.mechanisms[0].parameters.push(2))));
    assert!(beyond(7, 2)(refused(|s| s.mechanisms[0].companions.push(7))));
    assert!(beyond(3, 2)(refused(|s| s.mechanisms[0].shape_parameters.push(3))));
    assert!(beyond(4, 2)(refused(|s| s.mechanisms[0].integer_parameters.push(4))));
    assert!(beyond(usize::MAX, 2)(refused(|s| s.terms[0].parameter = usize::MAX)));
}

#[test]
fn numbers_of_a_parameter_make_sense() {
    for [lower, upper] in
        [[1.0, 0.0], [f64::NAN, 1.0], [0.0, f64::NAN], [f64::INFINITY; 2], [f64::NEG_INFINITY; 2]]
    {
        let crossed = |s: &mut Spec| (s.parameters[0].lower, s.parameters[0].upper) = (lower, upper);
        assert!(matches!(refused(crossed), SpecError::Bounds { parameter, .. } if parameter == "rate"));
    }
    for start in [-0.1, 1.1, f64::NAN, f64::INFINITY] {
        let outside = |s: &mut Spec| s.parameters[0].start = start;
        assert!(matches!(refused(outside), SpecError::Start { parameter, .. } if parameter == "rate"));
    }
    let endless = |s: &mut Spec| s.parameters[1].start = f64::NEG_INFINITY;
    assert!(matches!(refused(endless), SpecError::Start { .. }));
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let flat = |s: &mut Spec| s.parameters[1].scale = scale;
        assert!(matches!(refused(flat), SpecError::Scale { parameter, .. } if parameter == "factor"));
    }
}

#[test]
fn names_are_unlike() {
    let twice = |s: &mut Spec| s.mechanisms.push(mechanism("drag", vec![]));
    assert_eq!(refused(twice), SpecError::DuplicateMechanism { id: "drag".into() });
    let doubled = |s: &mut Spec| {
        s.parameters.push(parameter("rate", 0.0, UNBOUNDED));
        s.mechanisms[0].parameters.push(2);
    };
    let same = SpecError::DuplicateParameter { mechanism: "drag".into(), parameter: "rate".into() };
    assert_eq!(refused(doubled), same);
    assert_eq!(refused(|s| s.mechanisms[0].parameters.push(0)), same);
}

#[test]
fn a_mechanism_frees_no_term() {
    let freed = |e| matches!(e, SpecError::FreedTerm { parameter, mechanism, .. } if (parameter.as_str(), mechanism.as_str()) == ("factor", "drag"));
    assert!(freed(refused(|s| s.mechanisms[0].parameters.push(1))));
    assert!(freed(refused(|s| s.mechanisms[0].companions.push(1))));
}

#[test]
fn shape_and_integer_parameters_are_of_the_mechanism_and_bounded() {
    type List = fn(&mut Mechanism) -> &mut Vec<usize>;
    let lists: [(&str, List); 2] =
        [("shape", |m| &mut m.shape_parameters), ("integer", |m| &mut m.integer_parameters)];
    for (role, list) in lists {
        let strange = |s: &mut Spec| {
            s.parameters.push(parameter("row", 0.0, [0.0, 5.0]));
            list(&mut s.mechanisms[0]).push(2);
        };
        assert!(matches!(refused(strange), SpecError::NotFreed { role: r, .. } if r == role));
        let with = |parameter: Parameter| {
            move |s: &mut Spec| {
                s.parameters.push(parameter.clone());
                s.mechanisms[0].parameters.push(2);
                list(&mut s.mechanisms[0]).push(2);
            }
        };
        let row = parameter("row", 0.0, [0.0, 5.0]);
        let mut good = sound();
        with(row.clone())(&mut good);
        assert_eq!(good.check(), Ok(()));
        for bad in [
            Parameter { scope: Scope::PerRun, ..row.clone() },
            Parameter { upper: f64::INFINITY, ..row.clone() },
            Parameter { lower: f64::NEG_INFINITY, ..row },
        ] {
            assert!(matches!(refused(with(bad)), SpecError::Unbounded { role: r, .. } if r == role));
        }
    }
}

#[test]
fn a_builder_checks_what_it_built() {
    let mut b = SpecBuilder::new("a level");
    let level = b.nuisance_from("level", "m", 2.0, UNBOUNDED, 1.0);
    let [slope, row] =
        [b.shared("slope", "", 0.0, UNBOUNDED, 0.1), b.shared("row", "", 1.0, [0.0, 9.0], 1.0)];
    b.mechanism("step", &[slope, row], ["a step", "", "", ""], &[]).integer_parameters = vec![row.index];
    b.mechanism_mut("step").unwrap().equation = "y + h".into();
    assert!(b.mechanism_mut("ramp").is_none());
    let factor = b.shared("factor", "", 0.0, UNBOUNDED, 1.0);
    b.term(factor, "y", Quantity::new("y", "m"), vec!["y".into()]);
    assert_eq!((level.index, level.slot, row.index, row.slot, factor.slot), (0, 0, 2, 1, 2));
    assert_eq!(b.so_far().parameters.len(), 4);
    let spec = b.build().unwrap();
    assert_eq!((spec.mechanisms[0].equation.as_str(), spec.terms[0].parameter), ("y + h", factor.index));

    let mut b = SpecBuilder::default();
    b.baseline("nothing");
    b.shared("rate", "", 0.0, [1.0, -1.0], 1.0);
    assert!(matches!(b.build(), Err(SpecError::Bounds { .. })));
}

fn recording_refused(change: impl Fn(&mut Recording)) -> DiagnoseError {
    let mut recording = World::NULL.draw(1);
    change(&mut recording);
    diagnose(&Ball::default(), &recording, &[], &Options::default(), &Silent).unwrap_err()
}

#[test]
fn a_recording_has_the_shape_that_it_says() {
    let along = recording_refused(|r| r.noise_along = Some(1));
    assert_eq!(along, RecordingError::NoiseAlong { index: 1, variables: 1 }.into());
    // As many columns as expected, but inputs in the place of outputs.
    let swapped = recording_refused(|r| {
        let column = r.runs[0].outputs.remove(0);
        r.runs[0].inputs.push(column);
    });
    assert!(matches!(swapped, DiagnoseError::Recording(RecordingError::Shape { .. })));
}

/// Models find what they know of a run by its label.
#[test]
fn two_runs_of_one_label_are_refused() {
    let twice = recording_refused(|r| r.runs[1].label = r.runs[0].label.clone());
    assert_eq!(twice, RecordingError::Label { label: "1".into() }.into());
}

#[test]
fn an_experiment_fits_the_model() {
    let recording = World::NULL.draw(1);
    let runs = vec![recording.runs[0].clone()];
    let sound = Experiment { action: vec![], words: "again".into(), runs, nuisance: vec![vec![0.0; 2]] };
    let refused = |change: &dyn Fn(&mut Experiment)| {
        let mut experiment = sound.clone();
        change(&mut experiment);
        diagnose(&Ball::default(), &recording, &[experiment], &Options::default(), &Silent).unwrap_err()
    };
    let wrong =
        |what, got, expected| DiagnoseError::Experiment { words: "again".into(), what, got, expected };
    assert_eq!(refused(&|e| e.nuisance.clear()), wrong("lists of nuisance parameters", 0, 1));
    assert_eq!(refused(&|e| e.nuisance[0].push(0.0)), wrong("nuisance parameters of a run", 3, 2));
    assert_eq!(refused(&|e| e.runs[0].inputs.clear()), wrong("inputs of a run", 0, 1));
    let ragged = |e: &mut Experiment| {
        e.runs[0].inputs[0].truncate(7);
        e.runs[0].inputs.push(vec![0.0; 8]);
    };
    assert_eq!(refused(&ragged), wrong("inputs of a run", 2, 1));
}

/// A specification whose bounds are crossed.
fn crossed() -> Said {
    let parameters = vec![parameter("rate", 0.0, [1.0, -1.0])];
    Said(Spec { parameters, ..Spec::default() })
}

#[test]
fn a_repaired_model_and_an_oracle_check_the_specification_too() {
    let recording = World::NULL.draw(1);
    let options = Options { replicates: 99, ..Options::default() };
    let repaired = diagnose(&Ball::default(), &recording, &[], &options, &Silent).unwrap().repaired;
    let refused = repaired.predict(&crossed(), &recording);
    assert!(matches!(refused, Err(RepairedError::Spec(SpecError::Bounds { .. }))));
    let refused = oracle(&crossed(), &recording, &[], &options);
    assert!(matches!(refused, Err(DiagnoseError::Spec(SpecError::Bounds { .. }))));
}

/// A simulator that makes nothing.
struct Idle(Spec);

impl Simulator for Idle {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn statistics(&self) -> &[Quantity] {
        &[]
    }

    fn simulate(
        &self,
        _: &Run,
        _: &[f64],
        _: &[f64],
        _: &mut dyn Rng,
        _: &mut [f64],
    ) -> Result<(), PredictError> {
        Ok(())
    }
}

/// A likelihood that is the same everywhere.
struct Flat(Spec);

impl Likelihood for Flat {
    fn spec(&self) -> &Spec {
        &self.0
    }

    fn log_density(&self, _: &Run, _: &[f64]) -> Result<f64, PredictError> {
        Ok(0.0)
    }

    fn draw(&self, _: &mut Run, _: &[f64], _: &mut dyn Rng) -> Result<(), PredictError> {
        Ok(())
    }
}

#[test]
fn stochastic_models_check_the_specification_too() {
    let runs = World::NULL.draw(1).runs;
    let refused = Synthetic::new(Idle(crossed().0), &[], 10, 1).err();
    assert!(matches!(refused, Some(SyntheticError::Spec(SpecError::Bounds { .. }))));
    let refused = Scores::put(Flat(crossed().0), &runs, 10, 1).err();
    assert!(matches!(refused, Some(SyntheticError::Spec(SpecError::Bounds { .. }))));
}

#[test]
fn a_rate_that_no_p_value_reaches_is_refused_or_gets_more_replicates() {
    let recording = World::NULL.draw(1);
    let rare = Options { alpha: 1e-4, replicates: 999, ..Options::default() };
    let refused = diagnose(&Ball::default(), &recording, &[], &rare, &Silent).unwrap_err();
    assert!(matches!(refused, DiagnoseError::Option { name: "alpha", .. }), "{refused}");
    assert_eq!(Options::with_alpha(0.05), Options::default());
    assert_eq!(Options::with_alpha(0.01).replicates, 4999);
    let refused = diagnose(&Ball::default(), &recording, &[], &Options::with_alpha(1e-6), &Silent);
    assert!(matches!(refused, Err(DiagnoseError::Option { name: "alpha", .. })));
}
