//! The answer's format, field by field.

use std::collections::BTreeMap;

use missing_physics::diagnosis::{
    AsIf, ChannelFit, ChannelNoise, Closest, Confusion, Contradiction, Diagnosis, Estimate, Law, Limit,
    Location, MechanismReport, NextExperiment, Outlier, RunDifference, RunSpread, SetReport, TestOutcome,
};
use serde::Serialize;
use serde_json::{Value, json as value};

use super::context::ReportContext;

#[derive(Serialize)]
struct Answer<'a> {
    format: u32,
    domain: &'a str,
    recording: &'a str,
    verdict: &'a str,
    p_value: f64,
    noise: Vec<Value>,
    #[serde(rename = "where")]
    places: Vec<Value>,
    mechanisms: Vec<Value>,
    chosen: &'a [String],
    confused_with: &'a [Vec<String>],
    fit: Value,
    explained_share: Option<f64>,
    leftover: Vec<Value>,
    closest: Value,
    limits: Vec<Value>,
    between_runs: Vec<Value>,
    run_differences: Vec<Value>,
    contradiction: Value,
    law: Value,
    next_experiment: Value,
    #[serde(flatten)]
    additions: &'a serde_json::Map<String, Value>,
    // Beyond the fixed part.
    p_floor: f64,
    final_p_value: Option<f64>,
    baseline: &'a str,
    baseline_parameters: Vec<Value>,
    sets: Vec<Value>,
    confusion: Value,
    tests: Vec<Value>,
    undetermined: &'a [String],
    outliers: Vec<Value>,
    remarks: &'a [String],
    provenance: &'a Value,
}

/// The answer as JSON; numbers that are not finite become null.
pub fn json(d: &Diagnosis, context: &ReportContext) -> String {
    let answer = Answer {
        format: 1,
        additions: &context.additions,
        domain: &context.domain,
        recording: &context.recording,
        verdict: d.verdict.word(),
        p_value: d.p_value,
        noise: d.noise.iter().map(noise).collect(),
        places: d.location.iter().map(place).collect(),
        mechanisms: d.mechanisms.iter().map(mechanism).collect(),
        chosen: &d.chosen,
        confused_with: &d.confused_with,
        fit: value!({"before": fits(&d.before), "after": fits(&d.after)}),
        explained_share: d.explained_share,
        leftover: d.leftover.iter().map(place).collect(),
        closest: d.closest.as_ref().map_or(Value::Null, closest),
        limits: d.limits.iter().map(limit).collect(),
        between_runs: d.between_runs.iter().map(spread).collect(),
        run_differences: d.run_differences.iter().map(run_difference).collect(),
        contradiction: d.contradiction.as_ref().map_or(Value::Null, contradiction),
        law: d.law.as_ref().map_or(Value::Null, law),
        next_experiment: d.next_experiment.as_ref().map_or(Value::Null, next_experiment),
        p_floor: d.p_floor,
        final_p_value: d.final_p_value,
        baseline: &d.baseline,
        baseline_parameters: estimates(&d.baseline_parameters),
        sets: d.sets.iter().map(set).collect(),
        confusion: d.confusion.as_ref().map_or(Value::Null, confusion),
        tests: d.tests.iter().map(test).collect(),
        undetermined: &d.undetermined,
        outliers: d.outliers.iter().map(outlier).collect(),
        remarks: &d.remarks,
        provenance: &context.provenance,
    };
    // Numbers, texts and lists always serialise.
    let mut text = serde_json::to_string_pretty(&answer).unwrap_or_default();
    text.push('\n');
    text
}

fn noise(n: &ChannelNoise) -> Value {
    value!({"channel": n.channel, "sigma": n.sigma, "source": n.source.word(),
        "correlated_share": n.correlated_share, "correlation_length": n.correlation_length,
        "scatter": n.scatter.as_ref().map(|s| value!({"of": s.of, "sigma": s.sigma, "memory": s.memory, "white": s.white}))})
}

fn place(l: &Location) -> Value {
    value!({"channel": l.channel, "variable": l.variable, "from": l.from, "to": l.to, "runs": l.runs,
        "share": l.share, "mean_residual": l.mean_residual, "z": l.z, "largest_residual": l.largest_residual,
        "rms": l.rms, "sigma": l.sigma, "as_if": l.as_if.as_ref().map(as_if)})
}

fn as_if(a: &AsIf) -> Value {
    value!({"what": a.what, "parameters": estimates(&a.sizes)})
}

fn closest(c: &Closest) -> Value {
    value!({"ids": c.ids, "share": c.share, "as_likely": c.as_likely, "parameters": estimates(&c.parameters)})
}

fn limit(l: &Limit) -> Value {
    value!({"id": l.id, "parameter": l.parameter, "unit": l.unit, "upper": l.upper})
}

fn run_difference(d: &RunDifference) -> Value {
    let by_run: Vec<Value> = (d.by_run.iter())
        .map(|r| value!({"run": r.run, "value": r.value, "standard_error": r.standard_error}))
        .collect();
    value!({"name": d.name, "parameter": d.parameter, "unit": d.unit, "by_run": by_run})
}

fn spread(s: &RunSpread) -> Value {
    value!({"parameter": s.parameter, "unit": s.unit, "value": s.value, "standard_deviation": s.standard_deviation})
}

fn contradiction(c: &Contradiction) -> Value {
    value!({"runs": c.runs, "share": c.share, "verdict": c.verdict.word(), "chosen": c.chosen,
        "confused_with": c.confused_with, "parameters": estimates(&c.parameters)})
}

fn mechanism(m: &MechanismReport) -> Value {
    let rmse: BTreeMap<&str, f64> = m.heldout_rmse.iter().map(|(c, v)| (c.as_str(), *v)).collect();
    value!({"id": m.id, "name": m.name, "probability": m.probability.clamp(0.0, 1.0),
        "parameters": estimates(&m.parameters), "heldout_log_score_gain": m.heldout_log_score_gain,
        "heldout_rmse": rmse, "ruled_out": m.ruled_out})
}

fn law(l: &Law) -> Value {
    let rmse: BTreeMap<&str, Value> = l
        .heldout_rmse
        .iter()
        .map(|(c, without, with)| (c.as_str(), value!({"without": without, "with": with})))
        .collect();
    let quantity = |(name, unit): &(String, String)| value!({"name": name, "unit": unit});
    value!({"formula": l.formula, "kind": l.kind, "beside": l.beside, "adds_to": quantity(&l.adds_to),
        "variables": l.variables.iter().map(quantity).collect::<Vec<_>>(),
        "coefficients": estimates(&l.coefficients), "heldout_rmse": rmse,
        "heldout_log_score_gain": l.heldout_log_score_gain, "p_value": l.p_value})
}

fn next_experiment(n: &NextExperiment) -> Value {
    let action: BTreeMap<&str, f64> = n.action.iter().map(|(k, v)| (k.as_str(), *v)).collect();
    value!({"action": action, "separates": n.separates,
        "expected_log_bayes_factor": n.expected_log_bayes_factor, "words": n.words})
}

fn set(s: &SetReport) -> Value {
    value!({"ids": s.ids, "probability": s.probability, "p_value": s.p_value,
        "heldout_log_score_gain": s.heldout_log_score_gain})
}

fn confusion(c: &Confusion) -> Value {
    value!({"sets": c.sets, "matrix": c.matrix})
}

fn test(t: &TestOutcome) -> Value {
    value!({"name": t.name, "statistic": t.statistic, "p_value": t.p_value})
}

fn outlier(o: &Outlier) -> Value {
    value!({"run": o.run, "row": o.row, "channel": o.channel, "z": o.z})
}

fn estimates(list: &[Estimate]) -> Vec<Value> {
    list.iter().map(|e| value!({"name": e.name, "value": e.value, "ci95": e.ci95, "unit": e.unit})).collect()
}

fn fits(list: &[ChannelFit]) -> BTreeMap<&str, Value> {
    list.iter()
        .map(|f| (f.channel.as_str(), value!({"rmse": f.rmse, "heldout_rmse": f.heldout_rmse})))
        .collect()
}
