//! The report for a person at a terminal.

use std::fmt::Write as _;

use missing_physics::diagnosis::{
    ChannelNoise, Diagnosis, Law, Location, MechanismReport, NEARLY_ALL, RunDifference, RunSpread, RunValue,
    SetReport, Verdict, listed,
};

use super::context::ReportContext;
use super::number::{estimate, in_unit, p_value, p_words, probability, significant, with_error};
use super::runs::sigma_of;

const WIDTH: usize = 100;
const INDENT: usize = 9;

/// The whole report as text.
pub fn text(d: &Diagnosis, _: &ReportContext) -> String {
    let mut page = Page(String::new());
    page.0.push_str(&headline(d));
    page.0.push_str("\n\n");
    for place in d.location.iter().take(3) {
        page.entry("where", &where_sentence(d, place));
    }
    as_if(d).into_iter().for_each(|line| page.entry("where", &line));
    for (label, line) in what(d) {
        page.entry(label, &line);
    }
    for line in closest(d) {
        page.entry("closest", &line);
    }
    if let Some(law) = &d.law {
        page.entry("law", &law_sentence(d, law));
        for coefficient in law.coefficients.iter().filter(|_| law.kind != "smooth") {
            page.entry("law", &estimate(coefficient));
        }
        if let Some(left) = left_by_law(d, law) {
            page.entry("law", &left);
        }
    }
    for (label, line) in unseen_errors(d) {
        page.entry(label, &line);
    }
    for place in d.leftover.iter().take(3) {
        page.entry("left", &leftover_sentence(d, place));
    }
    for line in runs(d) {
        page.entry("runs", &line);
    }
    if d.verdict == Verdict::Adequate {
        for noise in &d.noise {
            page.entry("noise", &noise_sentence(d, noise));
        }
        if !d.limits.is_empty() {
            page.entry("limits", &format!("larger ones would have shown: {}", limits(d).join("; ")));
        }
    }
    for line in d.undetermined.iter().chain(&d.remarks) {
        page.entry("unsure", line);
    }
    for o in d.outliers.iter().take(5) {
        let line = format!(
            "row {} of run {} ({}) was set aside: {:.0} sigma from what all other rows say",
            o.row + 1,
            o.run,
            o.channel,
            o.z.abs()
        );
        page.entry("outlier", &line);
    }
    if d.outliers.len() > 5 {
        page.entry("outlier", &format!("and {} more rows", d.outliers.len() - 5));
    }
    if let Some(next) = &d.next_experiment {
        let line = format!(
            "{}: separates {} (expected log Bayes factor {})",
            next.words,
            listed(&next.separates),
            significant(next.expected_log_bayes_factor, 2)
        );
        page.entry("next", &line);
    }
    page.0
}

/// The sets of mechanisms that lead, a line each: how probable they are, whether they are adequate, what they gain on unseen data.
pub fn tried(d: &Diagnosis) -> Vec<String> {
    let line = |set: &SetReport| {
        let name = if set.ids.is_empty() { "nothing".to_owned() } else { set.ids.join(" + ") };
        let mut said = format!("tried {name}: probability {}", probability(set.probability));
        // Writing to a string cannot fail.
        if let Some(p) = set.p_value {
            let _ = write!(said, ", adequate at p = {}", significant(p, 2));
        }
        if let Some(gain) = set.heldout_log_score_gain {
            let _ = write!(said, ", gains {} in log score on unseen data", significant(gain, 3));
        }
        if let Some(why) = &set.ruled_out {
            let _ = write!(said, ", ruled out: {why}");
        }
        said
    };
    d.sets.iter().map(line).collect()
}

/// The verdict in one sentence.
pub(super) fn headline(d: &Diagnosis) -> String {
    let p = p_value(d);
    let if_noise = slow_errors(d).map(|slow| format!(", if {slow} is noise"));
    let provided = if_noise.as_deref().unwrap_or_default();
    match d.verdict {
        Verdict::Adequate => {
            let within = if_noise.as_deref().unwrap_or(" to within its noise");
            format!("The simulation explains this recording{within} ({p}).")
        }
        Verdict::Explained => {
            let named = named(d, &d.chosen);
            format!("The simulation does not explain this recording ({p}); {named} does{provided}.")
        }
        Verdict::Partly => {
            let sets: Vec<String> =
                std::iter::once(&d.chosen).chain(&d.confused_with).map(|s| named(d, s)).collect();
            let share =
                d.explained_share.map_or_else(String::new, |s| format!(" {:.0} % of", 100.0 * floored(s)));
            let takes = if sets.len() == 1 { " takes" } else { ", equally well, take" };
            format!(
                "The simulation does not explain this recording ({p}); {}{takes} away{share} the misfit, and something smaller is left.",
                sets.join(" or ")
            )
        }
        Verdict::Ambiguous => {
            let sets: Vec<String> =
                std::iter::once(&d.chosen).chain(&d.confused_with).map(|s| named(d, s)).collect();
            format!(
                "The simulation does not explain this recording ({p}); {} explain it equally well{provided}.",
                listed(&sets)
            )
        }
        Verdict::Unexplained if d.law.is_some() => {
            format!(
                "Something is wrong here ({p}) that no known mechanism describes; the residual follows a law."
            )
        }
        Verdict::Unexplained if !d.run_differences.is_empty() => {
            let names: Vec<&str> = d.run_differences.iter().map(|of| of.name.as_str()).collect();
            format!(
                "Something is wrong here ({p}) that no known mechanism describes; it looks like {}.",
                names.join(" with ")
            )
        }
        Verdict::Unexplained => {
            format!(
                "Something is wrong here ({p}) that no known mechanism describes, and no law is supported."
            )
        }
    }
}

fn named(d: &Diagnosis, set: &[String]) -> String {
    let name = |id: &String| {
        d.mechanisms.iter().find(|m| m.id == *id).map_or_else(|| id.clone(), |m| m.name.clone())
    };
    set.iter().map(name).collect::<Vec<_>>().join(" together with ")
}

/// Whether the diagnosis has a second fit to draw.
pub(super) fn changed(d: &Diagnosis) -> bool {
    d.law.is_some()
        || !d.run_differences.is_empty()
        || matches!(d.verdict, Verdict::Explained | Verdict::Partly | Verdict::Ambiguous)
}

/// A share that is not the whole is not said to be the whole.
fn floored(share: f64) -> f64 {
    (100.0 * share).floor().min(99.0) / 100.0
}

/// A law, its kind, and the mechanisms on top of which it stands.
pub(super) fn law_sentence(d: &Diagnosis, law: &Law) -> String {
    let beside =
        if law.beside.is_empty() { String::new() } else { format!(", beside {}", named(d, &law.beside)) };
    format!("{} ({}{beside})", law.formula, law_kind(law.kind))
}

/// A law that was selected to fit leaves something where its p-value is at most this.
const LEAVES: f64 = 0.01;

/// Whether a law leaves no more than the noise.
fn leaves_nothing(law: &Law) -> bool {
    law.p_value.is_some_and(|p| p > LEAVES)
}

/// What a law leaves, where that was tested.
pub(super) fn left_by_law(d: &Diagnosis, law: &Law) -> Option<String> {
    let p = p_words(law.p_value?, d.p_floor);
    Some(if leaves_nothing(law) {
        format!("it leaves no more than the noise ({p})")
    } else {
        format!("it leaves more than the noise ({p})")
    })
}

/// What kind of law it is, in words.
pub(super) fn law_kind(kind: &str) -> &str {
    match kind {
        "sparse" => "a few terms",
        "power" => "another power",
        "reading" => "a scale that is curved",
        "periodic" => "an oscillation",
        _ => "a smooth curve without a formula",
    }
}

/// Where the baseline misses, in one sentence.
pub(super) fn where_sentence(d: &Diagnosis, l: &Location) -> String {
    /// A mean below this part of the largest is rounding: the fit has made it zero.
    const ROUNDING: f64 = 1e-6;
    let is_rounding = l.mean_residual.abs() < ROUNDING * l.largest_residual.abs();
    let mean = if is_rounding { 0.0 } else { l.mean_residual };
    let unit = unit_of(d, &l.channel);
    format!(
        "{}: measured less simulated is {} on average, at most {} ({:.0} % of the misfit, {:.0} sigma in all)",
        place_words(d, l),
        in_unit(mean, 2, unit),
        in_unit(l.largest_residual, 2, unit),
        100.0 * l.share,
        l.z,
    )
}

/// What would take the misfit away if it acted at its places alone, where no mechanism of the list does.
pub(super) fn as_if(d: &Diagnosis) -> Vec<String> {
    let said = |l: &Location| {
        let as_if = l.as_if.as_ref()?;
        let sizes: Vec<String> = as_if.sizes.iter().map(estimate).collect();
        Some(format!("as if {} acted there: {}", as_if.what, sizes.join(", ")))
    };
    let places = d.location.iter().take(3).filter(|_| d.verdict == Verdict::Unexplained);
    let mut lines: Vec<String> = places.filter_map(said).collect();
    lines.dedup();
    lines
}

/// What the chosen mechanisms leave, in one sentence.
pub(super) fn leftover_sentence(d: &Diagnosis, l: &Location) -> String {
    let unit = unit_of(d, &l.channel);
    let (left, noise) = (in_unit(l.rms, 2, unit), in_unit(l.sigma, 2, unit));
    format!("{}: {left} rms is left, beside noise of {noise}", place_words(d, l))
}

/// What comes closest where nothing explains the data, and what its parameters would be.
pub(super) fn closest(d: &Diagnosis) -> Vec<String> {
    let Some(closest) = &d.closest else { return Vec::new() };
    // What takes away nearly all is not named where a leftover may stand in for it, or for a member.
    let why = |share: f64| match closest.ids.len() {
        _ if share < NEARLY_ALL => "too little to be named",
        _ if d.law.as_ref().is_some_and(leaves_nothing) => "but the law does better",
        1 => "but something smooth would do as well",
        _ => "but something smooth in place of one of them would do as well",
    };
    let sets: Vec<String> =
        std::iter::once(&closest.ids).chain(&closest.as_likely).map(|ids| named(d, ids)).collect();
    let words = match closest.share {
        Some(share) => {
            let percent = 100.0 * floored(share.max(0.0));
            format!("{} takes away {percent:.0} % of the misfit, {}", sets.join(" or "), why(share))
        }
        None => format!(
            "clearly likelier than the simulation alone: {}; how much of the misfit stays is lost in the noise",
            sets.join(" or ")
        ),
    };
    let parameters = closest.parameters.iter().map(|e| format!("{}, if it is at work", estimate(e)));
    std::iter::once(words).chain(parameters).collect()
}

/// Runs whose differences are said one by one.
const SAID_RUNS: usize = 8;

/// How runs differ, and which contradict the others, a line each.
pub(super) fn runs(d: &Diagnosis) -> Vec<String> {
    let differs = |of: &RunDifference| {
        let value = |r: &RunValue| {
            format!("{} {} in run {}", with_error(r.value, r.standard_error), of.unit, r.run)
                .replace("  ", " ")
        };
        let mut order: Vec<&RunValue> = of.by_run.iter().collect();
        if order.len() > SAID_RUNS {
            let errors = |r: &RunValue| (r.value / r.standard_error).abs();
            order.sort_by(|a, b| errors(b).total_cmp(&errors(a)));
        }
        let (said, others) = order.split_at(order.len().min(SAID_RUNS));
        let values: Vec<String> = said.iter().map(|r| value(r)).collect();
        let others = match others {
            [] => String::new(),
            others => format!(", and by fewer standard errors in the other {} runs", others.len()),
        };
        format!("what is left looks like {}: {} = {}{others}", of.name, of.parameter, values.join(", "))
    };
    let spread = |s: &RunSpread| {
        // A name such as a rate's says nothing where several mechanisms have one.
        let is_of =
            |m: &&MechanismReport| m.parameters.iter().any(|e| e.name == s.parameter && e.value == s.value);
        let of = d.mechanisms.iter().filter(|m| d.chosen.contains(&m.id)).find(is_of);
        let of = of.map_or_else(String::new, |m| format!(" of {}", m.name));
        format!(
            "{}{of} differs from run to run by {} (one standard deviation) beyond their noise; its interval allows for that",
            s.parameter,
            in_unit(s.standard_deviation, 2, &s.unit)
        )
    };
    let mut lines: Vec<String> =
        d.run_differences.iter().map(differs).chain(d.between_runs.iter().map(spread)).collect();
    let Some(c) = &d.contradiction else { return lines };
    let (which, them) = match &c.runs[..] {
        [one] => (format!("run {one} contradicts the others and holds"), "it"),
        several => (format!("runs {} contradict the others and hold", listed(several)), "them"),
    };
    let sets: Vec<String> = std::iter::once(&c.chosen).chain(&c.confused_with).map(|s| named(d, s)).collect();
    let answer = match c.verdict {
        Verdict::Adequate => "the simulation explains the recording".to_owned(),
        Verdict::Partly => format!("{} takes away most of the misfit", sets.join(" or ")),
        _ => format!("{} explains the recording", sets.join(" or ")),
    };
    lines.push(format!("{which} {:.0} % of the misfit; without {them} {answer}", 100.0 * floored(c.share)));
    lines.extend(c.parameters.iter().map(|e| format!("without {them}: {}", estimate(e))));
    lines
}

/// The sizes of each mechanism that would have shown, a line each.
pub(super) fn limits(d: &Diagnosis) -> Vec<String> {
    let mut lines: Vec<(&str, Vec<String>)> = Vec::new();
    for limit in &d.limits {
        let size = format!("{} {}", limit.parameter, in_unit(limit.upper, 2, &limit.unit));
        match lines.last_mut().filter(|(id, _)| *id == limit.id) {
            Some((_, sizes)) => sizes.push(size),
            None => lines.push((&limit.id, vec![size])),
        }
    }
    lines.into_iter().map(|(id, sizes)| format!("{id}: {}", sizes.join(", "))).collect()
}

/// The unit of a channel or a variable; nothing where it has none.
fn unit_of<'d>(d: &'d Diagnosis, name: &str) -> &'d str {
    d.channels.iter().chain(&d.variables).find(|(n, _)| n == name).map_or("", |(_, unit)| unit.as_str())
}

/// Channel, runs and interval of a place.
fn place_words(d: &Diagnosis, l: &Location) -> String {
    let total = d.curves.len();
    let runs = match l.runs.len() {
        0 => "no run alone".into(),
        n if n == total && total == 1 => "the only run".into(),
        n if n == total && total == 2 => "both runs".into(),
        n if n == total => format!("all {n} runs"),
        1 => format!("run {}", l.runs[0]),
        n if n <= 6 => format!("runs {}", listed(&l.runs)),
        n => format!("{n} of {total} runs"),
    };
    let interval = match (&l.variable, l.from, l.to) {
        (Some(v), Some(from), Some(to)) => {
            let unit = &l.variable_unit;
            let (from, to) = (significant(from, 3), significant(to, 3));
            let ends =
                if from == to { format!("at {v} = {from}") } else { format!("{v} from {from} to {to}") };
            let ends = if l.whole_range { format!("all along {ends}") } else { ends };
            format!(", {ends} {unit}").trim_end().to_owned()
        }
        _ => String::new(),
    };
    format!("{}, {runs}{interval}", l.channel)
}

/// The mechanisms of the answer, then others that are probable beside them.
fn what(d: &Diagnosis) -> Vec<(&'static str, String)> {
    if d.verdict == Verdict::Adequate {
        return Vec::new();
    }
    let in_answer = |m: &MechanismReport| {
        d.chosen.contains(&m.id) || d.confused_with.iter().flatten().any(|id| *id == m.id)
    };
    let line = |m: &MechanismReport| {
        let parameters: Vec<String> = m.parameters.iter().map(estimate).collect();
        let said = format!("{}: {}", m.name, parameters.join(", "));
        // What does as well beside a leftover is told apart by what is left, of which a probability says nothing.
        if d.verdict == Verdict::Partly && !d.confused_with.is_empty() {
            return said;
        }
        format!("{said}; probability {}", probability(m.probability))
    };
    let (named, others): (Vec<_>, Vec<_>) = d.mechanisms.iter().partition(|m| in_answer(m));
    let probable = |m: &&MechanismReport| m.probability > 0.05 && d.verdict != Verdict::Unexplained;
    let named = named.into_iter().map(|m| ("what", line(m)));
    named.chain(others.into_iter().filter(probable).map(|m| ("also", line(m)))).collect()
}

/// Errors of unseen data before and after, by channel, each with what the one is beside the other.
fn unseen_errors(d: &Diagnosis) -> Vec<(&'static str, String)> {
    if d.chosen.is_empty() && d.law.is_none() {
        return Vec::new();
    }
    let unseen = if d.curves.len() > 1 { "runs left out" } else { "the part left out" };
    d.before
        .iter()
        .zip(&d.after)
        .map(|(before, after)| {
            let noise = d.noise.iter().find(|n| n.channel == before.channel);
            let noise = noise.map_or_else(String::new, |n| {
                let (sigma, of) = match &n.scatter {
                    Some(scatter) => (scatter.white, "noise of each reading"),
                    None => (sigma_of(d, &n.channel).unwrap_or(n.sigma), "noise"),
                };
                format!(" ({of} {})", in_unit(sigma, 2, unit_of(d, &n.channel)))
            });
            let line = format!(
                "{}: error on {unseen} {} -> {}{noise}",
                before.channel,
                significant(before.heldout_rmse, 3),
                in_unit(after.heldout_rmse, 3, unit_of(d, &before.channel)),
            );
            (if after.heldout_rmse > before.heldout_rmse { "worse" } else { "better" }, line)
        })
        .collect()
}

/// Noise that is correlated over more rows than this can hide a slow misfit.
const SLOW: f64 = 5.0;

/// Errors most of whose variance is slow, in words; none where no channel has such.
fn slow_errors(d: &Diagnosis) -> Option<String> {
    let slow =
        |n: &&ChannelNoise| n.scatter.is_none() && n.correlated_share > 0.5 && n.correlation_rows > SLOW;
    let of = |n: &ChannelNoise| {
        let size = in_unit(n.sigma, 2, unit_of(d, &n.channel));
        format!("an error of {} of {size} that varies over {}", n.channel, over(d, n))
    };
    let all: Vec<String> = d.noise.iter().filter(slow).map(of).collect();
    (!all.is_empty()).then(|| listed(&all))
}

/// Over what a channel's noise is correlated: along the noise variable, or from row to row.
fn over(d: &Diagnosis, n: &ChannelNoise) -> String {
    let by_row = n.correlation_length == n.correlation_rows;
    let unit = d.variables.first().filter(|_| !by_row).map_or("rows", |(_, unit)| unit.as_str());
    format!("{} {unit}", significant(n.correlation_length, 2))
}

/// A channel's noise, in one sentence.
pub(super) fn noise_sentence(d: &Diagnosis, n: &ChannelNoise) -> String {
    let unit = unit_of(d, &n.channel);
    if let Some(s) = &n.scatter {
        let alike = if s.memory > 0.0 {
            format!(", neighbours alike by {}", significant(s.memory, 2))
        } else {
            String::new()
        };
        return format!(
            "{}: {} of each reading, and what adds up along a run: {} scatters by {}{alike} (from {})",
            n.channel,
            in_unit(s.white, 2, unit),
            s.of,
            significant(s.sigma, 2),
            n.source.word()
        );
    }
    let over = over(d, n);
    let left = d.leftover.iter().find(|place| place.channel == n.channel);
    if let Some(place) = left.filter(|_| n.correlated_share > 0.0) {
        return format!(
            "{}: {} (from {}); what is left beside it is taken for an error of {} that varies over {over}",
            n.channel,
            in_unit(place.sigma, 2, unit),
            n.source.word(),
            in_unit(n.sigma, 2, unit)
        );
    }
    let colour = if n.correlated_share > 0.0 {
        let blind =
            if n.correlation_rows > SLOW { ": a slow misfit of that size would not be seen" } else { "" };
        format!(", {:.0} % of its variance correlated over {over}{blind}", 100.0 * n.correlated_share)
    } else {
        ", white".into()
    };
    format!("{}: {}{colour} (from {})", n.channel, in_unit(n.sigma, 2, unit), n.source.word())
}

struct Page(String);

impl Page {
    /// A labelled paragraph, wrapped; the label stands only at the first of its kind.
    fn entry(&mut self, label: &str, text: &str) {
        let again = self.0.lines().rev().find(|l| !l.starts_with(' ')).is_some_and(|l| l.starts_with(label));
        let mut line = format!("{:INDENT$}", if again { "" } else { label });
        let mut empty = true;
        for word in text.split_whitespace() {
            if !empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
                // Writing to a string cannot fail.
                let _ = writeln!(self.0, "{line}");
                line = " ".repeat(INDENT + 2);
                empty = true;
            }
            if !empty {
                line.push(' ');
            }
            line.push_str(word);
            empty = false;
        }
        let _ = writeln!(self.0, "{line}");
    }
}
