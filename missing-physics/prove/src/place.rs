//! Whether a place was found.

use worlds::concealed::Place;

use super::world::Located;

/// The part that two intervals have in common, of what they cover together, from which they are the same place.
const OVERLAP: f64 = 0.5;
/// An effect that goes on to the end of a variable is found where its beginning is, to this part of the variable's extent: the other side
/// would then be off instead, which is the same.
const CLOSE: f64 = 0.1;
/// The part of the runs that two sets have in common, of all that are in either.
const COMMON: f64 = 0.75;
/// Half of the single events have to be found, and half of those that are named have to be there.
const EVENTS: f64 = 0.5;

/// Whether the first place that is named is the one at which an effect acts: the same variable, an interval that overlaps by half, the
/// same runs.
pub(super) fn found(place: &Place, named: &[Located], runs: &[String]) -> bool {
    let Some(first) = named.first() else { return false };
    let everywhere = place.from.is_infinite() && place.to.is_infinite();
    let inside = everywhere || (first.variable.as_deref() == Some(&place.variable) && overlaps(place, first));
    let acts = |run: &&String| place.runs.is_empty() || place.runs.contains(run);
    let truly: Vec<&String> = runs.iter().filter(acts).collect();
    let others: Vec<&String> = runs.iter().filter(|run| !acts(run)).collect();
    let said: Vec<&String> = runs.iter().filter(|run| first.runs.contains(run)).collect();
    // Where an effect is a change between runs, those before it differ as much as those after it.
    inside && (alike(&truly, &said) || (everywhere && alike(&others, &said)))
}

fn alike(a: &[&String], b: &[&String]) -> bool {
    let both = a.iter().filter(|run| b.contains(run)).count();
    let either = a.len() + b.len() - both;
    both as f64 >= COMMON * either as f64 && either > 0
}

fn overlaps(place: &Place, found: &Located) -> bool {
    let (Some(from), Some(to)) = (found.from, found.to) else { return false };
    let [low, high] = found.extent.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
    let [begin, end] = [place.from.max(low), place.to.min(high)];
    let common = to.min(end) - from.max(begin);
    let either = to.max(end) - from.min(begin);
    if common >= OVERLAP * either {
        return true;
    }
    let Some([low, high]) = found.extent else { return false };
    let near = |edge: f64| [from, to].iter().any(|f| (f - edge).abs() <= CLOSE * (high - low));
    let open = |edge: f64| edge <= low || edge >= high;
    (open(place.to) && near(place.from)) || (open(place.from) && near(place.to))
}

/// Whether single events are found: each at its row or the next one.
pub(super) fn found_events(events: &[(String, f64)], named: &[Located]) -> bool {
    let same = |(run, row): &(String, f64), place: &Located| {
        place.runs == [run.clone()]
            && place.from == place.to
            && place.from.is_some_and(|at| at == *row || at == row + 1.0)
    };
    let hits = events.iter().filter(|event| named.iter().any(|place| same(event, place))).count();
    let right = named.iter().filter(|place| events.iter().any(|event| same(event, place))).count();
    hits as f64 >= EVENTS * events.len() as f64 && right as f64 >= EVENTS * named.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn located(variable: &str, from: f64, to: f64, runs: &[&str]) -> Located {
        let runs = runs.iter().map(|run| (*run).to_owned()).collect();
        Located {
            variable: Some(variable.into()),
            from: Some(from),
            to: Some(to),
            extent: Some([0.0, 1.0]),
            runs,
        }
    }

    #[test]
    fn half_of_the_interval_the_variable_and_the_runs_have_to_be_right() {
        let runs: Vec<String> = (1..=8).map(|run| run.to_string()).collect();
        let all: Vec<&str> = runs.iter().map(String::as_str).collect();
        let push = Place::new("t_s", 0.2, 0.4);
        let judged = |place: &Place, named: Located| found(place, &[named], &runs);
        assert!(judged(&push, located("t_s", 0.22, 0.38, &all)));
        assert!(
            !judged(&push, located("t_s", 0.0, 0.8, &all)) && !judged(&push, located("z_m", 0.2, 0.4, &all))
        );
        assert!(!judged(&push, located("t_s", 0.2, 0.4, &["1", "2"])));
        let later = Place::new("run", f64::NEG_INFINITY, f64::INFINITY).in_runs(runs[3..].to_vec());
        assert!(judged(&later, located("x_m", 0.0, 1.0, &all[3..])));
        assert!(
            judged(&later, located("x_m", 0.0, 1.0, &all[..3]))
                && !judged(&later, located("x_m", 0.0, 1.0, &all))
        );
        let beyond = Place::new("x_m", 0.7, f64::INFINITY);
        assert!(
            judged(&beyond, located("x_m", 0.0, 0.68, &all))
                && !judged(&push, located("t_s", 0.0, 0.2, &all))
        );
        assert!(!found(&push, &[], &runs));
    }

    #[test]
    fn single_events_are_found_one_by_one() {
        let events = [("2".to_owned(), 3.0), ("5".to_owned(), 1.0)];
        let [one, other] = [located("bounce", 3.0, 3.0, &["2"]), located("bounce", 2.0, 2.0, &["5"])];
        assert!(
            found_events(&events, &[one.clone(), other]) && found_events(&events, std::slice::from_ref(&one))
        );
        let wide = located("bounce", 1.0, 4.0, &["2"]);
        assert!(!found_events(&events, &[wide]) && !found_events(&events, &[]));
    }
}
