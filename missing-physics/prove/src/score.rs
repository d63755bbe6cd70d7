//! How often the tool was right, wrong and silent.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use statrs::distribution::{Binomial, DiscreteCDF as _};
use statrs::statistics::{Data, OrderStatistics as _};
use worlds::concealed::Hidden;

use super::place;
use super::world::Judged;

/// A rate: so many of so many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Part {
    /// How many.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
}

impl Part {
    fn add(&mut self, hit: bool) {
        self.hits += usize::from(hit);
        self.of += 1;
    }

    fn join(&mut self, other: Self) {
        self.hits += other.hits;
        self.of += other.of;
    }

    /// The rate, in [0, 1]; NaN of nothing.
    pub fn rate(self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// The counts between which 95 % of draws lie where the true rate is `rate`.
    pub fn band(self, rate: f64) -> [u64; 2] {
        Binomial::new(rate, self.of as u64)
            .map_or([0, 0], |law| [law.inverse_cdf(0.025), law.inverse_cdf(0.975)])
    }
}

/// The score of one domain (or of all).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DomainScore {
    /// The domain.
    pub domain: String,
    /// Worlds in which nothing is hidden that were doubted at 5 %.
    pub alarms_5: Part,
    /// Worlds in which nothing is hidden that were doubted at 1 %.
    pub alarms_1: Part,
    /// Worlds with listed effects that were doubted at 5 %.
    pub detected: Part,
    /// Worlds with listed effects that an oracle's likelihood-ratio test, which knows what to look for, doubts at 5 %.
    pub oracle_detected: Part,
    /// Of the worlds where the data decide: `explained` by exactly what is hidden.
    pub right: Part,
    /// `ambiguous`, the truth among the rivals.
    pub ambiguous: Part,
    /// A mechanism named that is not there, the truth not among the rivals.
    pub wrong: Part,
    /// The answer set holds the truth, of the worlds with an answer where the data decide.
    pub holds: Part,
    /// Mean number of sets in those answers.
    pub set_size: f64,
    /// A mechanism named that is not there, of all worlds with listed effects.
    pub wrong_of_all: Part,
    /// Worlds of listed effects alone whose names are right, answered `partly`: a leftover is said that is not there.
    pub leftover_alarms: Part,
    /// Unlisted effects answered `unexplained`, of those that were doubted.
    pub unexplained: Part,
    /// Worlds of a listed effect with a smaller unlisted one: answered by exactly the listed one.
    pub main_cause: Part,
    /// Of those, the listed one alone is the answer or one of its rivals.
    pub main_cause_among: Part,
    /// Of those, a mechanism named that is not there, the listed one alone not among the rivals.
    pub wrong_beside: Part,
    /// Of those, answered `partly`: the smaller one is said.
    pub leftover_said: Part,
    /// The same where an oracle that knows what the smaller one does finds it.
    pub leftover_shown: Part,
    /// Of those, where the set is right, intervals of 95 % that hold the true value.
    pub covered_beside: Part,
    /// Unlisted effects that a listed one imitates to 40 to 85 %: a name was given.
    pub imitated: Part,
    /// Local effects with p at most 0.001 for which variable, interval and runs of the first place are right.
    pub located: Part,
    /// Intervals of 95 % that hold the true value, where the set is right.
    pub covered: Part,
    /// Median error on data left out over that of the true model's refit, where the set is right.
    pub heldout_ratio: f64,
    /// Median time of a diagnosis in s (of this machine, as busy as it was).
    pub seconds: f64,
    /// Detection against the size of an effect: `sqrt` of the oracle's likelihood ratio at the middle of each bin, detected by the
    /// tool, by the oracle's test.
    pub power: Vec<(f64, Part, Part)>,
    /// What was answered to each single hidden mechanism: `confusion[truth][answer]`.
    pub confusion: BTreeMap<String, BTreeMap<String, usize>>,
    sizes: Vec<f64>,
    ratios: Vec<f64>,
    times: Vec<f64>,
}

/// The scores of all domains.
#[derive(Debug, Clone, PartialEq)]
pub struct Score {
    /// Domain by domain.
    pub domains: Vec<DomainScore>,
    /// All together.
    pub all: DomainScore,
}

/// Edges of the bins of `sqrt` of the oracle's likelihood ratio.
const EDGES: [f64; 9] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, f64::INFINITY];
/// Where the oracle's log Bayes factor against every rival is at least this, the data decide.
const DECISIVE: f64 = 5.0;

impl Score {
    pub(super) fn of(domains: &[String], judged: &[Judged]) -> Self {
        let one = |name: &str, worlds: &mut dyn Iterator<Item = &Judged>| {
            let bins = EDGES.windows(2).map(|w| {
                let middle = if w[1].is_finite() { 0.5 * (w[0] + w[1]) } else { w[0] * 1.2 };
                (middle, Part::default(), Part::default())
            });
            let mut score =
                DomainScore { domain: name.into(), power: bins.collect(), ..DomainScore::default() };
            worlds.for_each(|w| score.add(w));
            score.finish();
            score
        };
        Self {
            domains: domains.iter().map(|d| one(d, &mut judged.iter().filter(|w| w.domain == d))).collect(),
            all: one("all", &mut judged.iter()),
        }
    }

    pub(super) fn to_json(&self, seal: &str, seed: u64, worlds: usize) -> String {
        let domains: Vec<Value> = self.domains.iter().chain([&self.all]).map(DomainScore::to_json).collect();
        let value = json!({"format": 1, "seal": seal, "seed": seed, "worlds": worlds, "domains": domains});
        // Numbers, texts and lists always serialise.
        serde_json::to_string_pretty(&value).unwrap_or_default() + "\n"
    }
}

impl DomainScore {
    fn add(&mut self, w: &Judged) {
        let o = &w.outcome;
        let doubted = o.p_value <= 0.05;
        self.times.push(o.seconds);
        match w.key.hidden {
            Hidden::Nothing => {
                self.alarms_5.add(doubted);
                self.alarms_1.add(o.p_value <= 0.01);
            }
            Hidden::Unlisted | Hidden::Local => {
                // Impacts that go unheard are on the list, wherever they are.
                if doubted && w.key.events.is_empty() {
                    self.unexplained.add(o.verdict == "unexplained");
                }
            }
            Hidden::Leftover => {
                let Named { right: named, among, wrong, .. } = Named::of(w);
                self.main_cause.add(named);
                self.main_cause_among.add(among);
                self.wrong_beside.add(wrong);
                self.leftover_said.add(o.verdict == "partly");
                if w.oracle.as_ref().and_then(|oracle| oracle.leftover).is_some_and(|l| l >= DECISIVE) {
                    self.leftover_shown.add(o.verdict == "partly");
                }
                if named {
                    Self::add_intervals(&mut self.covered_beside, w);
                }
            }
            Hidden::Imitated => self.imitated.add(!o.chosen.is_empty()),
            Hidden::One | Hidden::Two => self.add_listed(w, doubted),
        }
        // Beside a second effect the baseline misses where that acts, too.
        let alone = !matches!(w.key.hidden, Hidden::Two | Hidden::Leftover) && o.p_value <= 0.001;
        if alone && (w.key.place.is_some() || !w.key.events.is_empty()) {
            let found = match &w.key.place {
                Some(place) => place::found(place, &o.places, &o.runs),
                None => place::found_events(&w.key.events, &o.places),
            };
            self.located.add(found);
        }
    }

    fn add_listed(&mut self, w: &Judged, doubted: bool) {
        let o = &w.outcome;
        let Named { truth, chosen, right, among, wrong } = Named::of(w);
        self.detected.add(doubted);
        self.wrong_of_all.add(wrong);
        if let [single] = truth.as_slice() {
            let answer = match o.verdict.as_str() {
                "explained" => chosen.join(" + "),
                word => word.to_owned(),
            };
            *self.confusion.entry(single.clone()).or_default().entry(answer).or_default() += 1;
        }
        if let Some(oracle) = &w.oracle {
            self.oracle_detected.add(oracle.p_value <= 0.05);
            let size = oracle.likelihood_ratio.sqrt();
            let bin = EDGES.windows(2).position(|e| size >= e[0] && size < e[1]);
            if let Some((_, tool, test)) = bin.and_then(|b| self.power.get_mut(b)) {
                tool.add(doubted);
                test.add(oracle.p_value <= 0.05);
            }
            if oracle.decisive >= DECISIVE {
                self.right.add(o.verdict == "explained" && right);
                self.ambiguous.add(o.verdict == "ambiguous" && among);
                self.wrong.add(wrong);
                if !o.chosen.is_empty() {
                    self.holds.add(among);
                    self.sizes.push(1.0 + o.confused_with.len() as f64);
                }
            }
        }
        if right {
            self.leftover_alarms.add(o.verdict == "partly");
            self.add_right(w);
        }
    }

    /// What can be scored only where the right mechanisms were chosen.
    fn add_right(&mut self, w: &Judged) {
        Self::add_intervals(&mut self.covered, w);
        if let Some(oracle) = &w.oracle {
            let pairs = w.outcome.heldout_rmse.iter().zip(&oracle.heldout_rmse);
            let ratios: Vec<f64> = pairs.filter_map(|(a, b)| Some((*a)? / (*b)?)).collect();
            if !ratios.is_empty() {
                self.ratios.push(ratios.iter().sum::<f64>() / ratios.len() as f64);
            }
        }
    }

    /// Counts the intervals that hold the true values.
    fn add_intervals(covered: &mut Part, w: &Judged) {
        for p in &w.key.parameters {
            let found = w.outcome.estimates.iter().find(|e| e.mechanism == p.mechanism && e.name == p.name);
            if let Some(e) = found {
                covered.add((e.ci95[0]..=e.ci95[1]).contains(&p.value));
            }
        }
    }

    fn finish(&mut self) {
        self.set_size = self.sizes.iter().sum::<f64>() / self.sizes.len() as f64;
        self.heldout_ratio = Data::new(&mut self.ratios[..]).median();
        self.seconds = Data::new(&mut self.times[..]).median();
        let mut merged: Vec<(f64, Part, Part)> = Vec::new();
        for (middle, tool, test) in std::mem::take(&mut self.power) {
            match merged.last_mut().filter(|last| last.1.of == 0) {
                Some(last) => {
                    last.0 = middle;
                    last.1.join(tool);
                    last.2.join(test);
                }
                None => merged.push((middle, tool, test)),
            }
        }
        merged.retain(|bin| bin.1.of > 0);
        self.power = merged;
    }

    fn to_json(&self) -> Value {
        let part = |p: Part| json!([p.hits, p.of]);
        let number = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
        let power: Vec<Value> =
            self.power.iter().map(|(size, tool, test)| json!([size, part(*tool), part(*test)])).collect();
        json!({"domain": self.domain, "false_alarms_5": part(self.alarms_5), "false_alarms_1": part(self.alarms_1),
            "detected": part(self.detected), "oracle_detected": part(self.oracle_detected),
            "right": part(self.right), "ambiguous": part(self.ambiguous), "wrong": part(self.wrong),
            "answer_set_holds": part(self.holds), "answer_set_size": number(self.set_size),
            "wrong_of_all": part(self.wrong_of_all), "leftover_alarms": part(self.leftover_alarms),
            "unlisted_unexplained": part(self.unexplained),
            "main_cause": part(self.main_cause), "main_cause_among": part(self.main_cause_among),
            "wrong_beside_leftover": part(self.wrong_beside), "leftover_said": part(self.leftover_said),
            "leftover_shown": part(self.leftover_shown),
            "covered_beside_leftover": part(self.covered_beside), "imitated_named": part(self.imitated),
            "located": part(self.located), "covered": part(self.covered),
            "heldout_ratio": number(self.heldout_ratio), "power": power, "confusion": self.confusion})
    }
}

/// The names of an answer beside the true ones, both without what is no matter of the world's.
struct Named {
    truth: Vec<String>,
    chosen: Vec<String>,
    /// The answer is the truth.
    right: bool,
    /// The answer is the truth, or one of its rivals is.
    among: bool,
    /// Something is named that is not there, and no rival is the truth.
    wrong: bool,
}

impl Named {
    fn of(w: &Judged) -> Self {
        let without_nuisances = |ids: &[String]| sorted(ids, &w.key.beside);
        let truth = without_nuisances(&w.key.mechanisms);
        let chosen = without_nuisances(&w.outcome.chosen);
        let right = chosen == truth;
        let among = right || w.outcome.confused_with.iter().any(|set| without_nuisances(set) == truth);
        let wrong = !among && !chosen.iter().all(|m| truth.contains(m));
        Self { truth, chosen, right, among, wrong }
    }
}

/// Identifiers in order, without those that do not matter.
fn sorted(ids: &[String], but: &[String]) -> Vec<String> {
    let mut ids: Vec<String> = ids.iter().filter(|id| !but.contains(id)).cloned().collect();
    ids.sort();
    ids
}
