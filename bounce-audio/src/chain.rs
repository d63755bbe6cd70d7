//! The chain that the impacts of a drop form: flights shorten by a steady ratio. A sound that does not fit it is none of the ball's, but a
//! ratio may change (a softer place of the table, another ball) where the chain goes on behind it.

use crate::missed::parts;

/// A sound that may have been an impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// When it was heard, s.
    pub t_s: f64,
    /// Logarithm of its loudness: of an impact and its echo the impact is the louder one.
    pub loudness: f64,
}

/// One sigma of the logarithm of a flight over what the chain makes of the one before it: drag, a restitution that depends on the speed,
/// errors of times.
const SPREAD: f64 = 0.04;
/// A flight that is off by more is none of the chain's.
const MOST_OFF: f64 = 0.45;
/// What a flight that is off costs at most, in impacts: more than one, so that a single sound behind it is none of the ball's.
const BREAK_COSTS: f64 = 1.25;
/// One sigma of the logarithm of a drop's restitution about that of all drops: another ball, another place.
const BETWEEN_DROPS: f64 = 0.1;
/// What a drop's restitution costs at most, in impacts: a long chain is one, whatever its ratio.
const ANOTHER_COSTS: f64 = 2.0;
/// Most impacts in a row that may have gone unheard, and what each of them costs, in impacts.
const MOST_UNHEARD: usize = 3;
const UNHEARD_COSTS: f64 = 0.5;
/// What a sound is worth less for each factor of e by which it is fainter than the loudest, and at most.
const FAINT: f64 = 0.1;
const FAINTEST: f64 = 0.5;
/// Logarithms of the restitutions that are tried: 0.3 to 1.
const RESTITUTIONS: [f64; 2] = [-1.2, 0.0];
const STEP: f64 = 0.02;
/// Flights between these are looked at, s.
const FLIGHTS_S: [f64; 2] = [5e-3, 3.0];
/// Sounds without which there is no chain.
const FEWEST: usize = 3;
/// Sounds among which a chain is looked for: the loudest.
const MOST: usize = 120;

/// Which sounds of each drop (rising times) are the ball's: those of the longest chains that about one restitution makes of all drops. All
/// of a drop in which no three form a chain; of more than 120 sounds in a drop the loudest are looked at.
pub fn impacts(drops: &[Vec<Candidate>]) -> Vec<Vec<usize>> {
    let steps = ((RESTITUTIONS[1] - RESTITUTIONS[0]) / STEP).round() as usize;
    let of_step = |step: usize| -> Vec<(f64, Vec<usize>)> {
        let restitution = (RESTITUTIONS[0] + STEP * step as f64).exp();
        drops.iter().map(|drop| longest(drop, restitution)).collect()
    };
    let by_step: Vec<Vec<(f64, Vec<usize>)>> = (0..=steps).map(of_step).collect();
    let worth = |chains: &[(f64, Vec<usize>)]| chains.iter().map(|chain| chain.0).sum::<f64>();
    // The first of those that are worth as much.
    let first_best = |worths: &mut dyn Iterator<Item = f64>| {
        worths
            .enumerate()
            .fold((0, f64::NEG_INFINITY), |best, (at, w)| if w > best.1 { (at, w) } else { best })
            .0
    };
    let common = first_best(&mut by_step.iter().map(|chains| worth(chains)));
    let of_drop = |(number, drop): (usize, &Vec<Candidate>)| {
        let away = |step: usize| STEP * (step as f64 - common as f64) / BETWEEN_DROPS;
        let mut worths = by_step
            .iter()
            .enumerate()
            .map(|(step, chains)| chains[number].0 - (0.5 * away(step).powi(2)).min(ANOTHER_COSTS));
        let (_, chain) = &by_step[first_best(&mut worths)][number];
        if chain.len() < FEWEST { (0..drop.len()).collect() } else { chain.clone() }
    };
    drops.iter().enumerate().map(of_drop).collect()
}

/// The end of a chain: two sounds in a row, with so many impacts unheard between them.
#[derive(Clone, Copy)]
struct End {
    from: usize,
    unheard: usize,
    worth: f64,
    /// The end that it goes on from: its place among those of `from`.
    before: Option<usize>,
}

/// The most valuable chain of a drop for a restitution: what it is worth, in impacts, and its sounds.
fn longest(drop: &[Candidate], restitution: f64) -> (f64, Vec<usize>) {
    if drop.len() < FEWEST {
        return (0.0, Vec::new());
    }
    if drop.len() > MOST {
        let mut loudest: Vec<usize> = (0..drop.len()).collect();
        loudest.sort_by(|&a, &b| drop[b].loudness.total_cmp(&drop[a].loudness));
        loudest.truncate(MOST);
        loudest.sort_unstable();
        let part: Vec<Candidate> = loudest.iter().map(|&i| drop[i]).collect();
        let (worth, chain) = longest(&part, restitution);
        return (worth, chain.into_iter().map(|i| loudest[i]).collect());
    }
    let loudest = drop.iter().map(|s| s.loudness).fold(f64::NEG_INFINITY, f64::max);
    let worth = |k: usize| 1.0 - (FAINT * (loudest - drop[k].loudness)).clamp(0.0, FAINTEST);
    let mut ends: Vec<Vec<End>> = vec![Vec::new(); drop.len()];
    let mut best: (f64, Option<[usize; 2]>) = (0.0, None);
    for to in 1..drop.len() {
        for from in (0..to).rev() {
            let flight = drop[to].t_s - drop[from].t_s;
            if flight > FLIGHTS_S[1] {
                break;
            }
            if flight < FLIGHTS_S[0] {
                continue;
            }
            for unheard in 0..=MOST_UNHEARD {
                let first = parts(flight, unheard, restitution).0;
                let costs = UNHEARD_COSTS * unheard as f64;
                // A chain begins with two sounds.
                let mut end = End { from, unheard, worth: worth(from) + worth(to) - costs, before: None };
                for (at, before) in ends[from].iter().enumerate() {
                    let last = parts(drop[from].t_s - drop[before.from].t_s, before.unheard, restitution).1;
                    let off = (first / (restitution * last)).ln();
                    let gains =
                        before.worth + worth(to) - costs - (0.5 * (off / SPREAD).powi(2)).min(BREAK_COSTS);
                    if off.abs() < MOST_OFF && gains > end.worth {
                        (end.worth, end.before) = (gains, Some(at));
                    }
                }
                // Nothing behind an impact that went unheard says that what follows is the ball's.
                if end.worth > best.0 && unheard == 0 {
                    best = (end.worth, Some([to, ends[to].len()]));
                }
                ends[to].push(end);
            }
        }
    }
    let mut chain = Vec::new();
    let mut next = best.1;
    while let Some([to, at]) = next {
        let end = ends[to][at];
        chain.push(to);
        next = end.before.map(|at| [end.from, at]);
        if next.is_none() {
            chain.push(end.from);
        }
    }
    chain.reverse();
    (best.0, chain)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Impacts of a drop whose flights shorten by `e`, each fainter than the one before.
    fn drop(e: f64, impacts: usize) -> Vec<Candidate> {
        let mut t_s = 0.4;
        (0..impacts as i32)
            .map(|k| {
                let sound = Candidate { t_s, loudness: 4.0 + f64::from(k) * e.ln() };
                t_s += 0.5 * e.powi(k);
                sound
            })
            .collect()
    }

    fn with(mut drop: Vec<Candidate>, t_s: f64, loudness: f64) -> (Vec<Candidate>, usize) {
        let at = drop.iter().take_while(|s| s.t_s < t_s).count();
        drop.insert(at, Candidate { t_s, loudness });
        (drop, at)
    }

    fn without(n: usize, which: usize) -> Vec<usize> {
        (0..n).filter(|i| *i != which).collect()
    }

    #[test]
    fn a_sound_between_two_impacts_is_none_and_all_others_are() {
        for e in [0.5, 0.7, 0.85, 0.95] {
            let all = drop(e, 7);
            assert_eq!(impacts(std::slice::from_ref(&all)), [(0..7).collect::<Vec<_>>()], "e {e}");
            for gap in 0..6 {
                for part in [0.1, 0.3, 0.5, 0.7, 0.9] {
                    let t_s = all[gap].t_s + part * (all[gap + 1].t_s - all[gap].t_s);
                    let (heard, stray) = with(all.clone(), t_s, 2.0);
                    assert_eq!(impacts(&[heard]), [without(8, stray)], "e {e}, gap {gap}, part {part}");
                }
            }
        }
    }

    /// An echo 7 ms after each of three impacts, a hand's noise before the first, and a clatter behind the last.
    #[test]
    fn echoes_and_what_a_hand_does_are_none() {
        let all = drop(0.9, 12);
        let mut heard = all.clone();
        for k in [1, 4, 9] {
            heard = with(heard, all[k].t_s + 0.007, all[k].loudness - 1.0).0;
        }
        heard = with(heard, 0.11, 4.5).0;
        let last = all[11].t_s;
        for late in [0.31, 0.33, 0.5] {
            heard = with(heard, last + late, 4.0).0;
        }
        let [kept] = &impacts(&[heard.clone()])[..] else { unreachable!("one drop") };
        let kept: Vec<f64> = kept.iter().map(|&i| heard[i].t_s).collect();
        assert_eq!(kept, all.iter().map(|s| s.t_s).collect::<Vec<f64>>());
    }

    /// A sound that begins in the middle of a drop, and impacts that went unheard: what is left of the chain is one.
    #[test]
    fn a_chain_may_begin_anywhere_and_have_gaps() {
        let whole = drop(0.85, 10);
        for unheard in 1..8 {
            let mut heard = whole.clone();
            heard.remove(unheard);
            assert_eq!(impacts(&[heard.clone()]), [(0..9).collect::<Vec<_>>()], "{unheard}");
            let late = heard.split_off(2);
            assert_eq!(impacts(&[late, whole.clone()])[0], (0..7).collect::<Vec<_>>(), "{unheard}");
        }
    }

    /// A softer place under one impact, and a softer ball in one drop: all are the ball's still, and a stray sound is not.
    #[test]
    fn a_ratio_may_change() {
        let steady = drop(0.85, 7);
        for softer in [0.6, 0.7, 0.95] {
            for at in 2..5 {
                let mut times: Vec<f64> = steady.iter().map(|s| s.t_s).collect();
                let (mut flight, mut t_s) = (times[1] - times[0], times[1]);
                for (k, time) in times.iter_mut().enumerate().skip(2) {
                    flight *= if k == at + 1 { softer } else { 0.85 };
                    t_s += flight;
                    *time = t_s;
                }
                let changed: Vec<Candidate> =
                    times.iter().zip(&steady).map(|(&t_s, s)| Candidate { t_s, ..*s }).collect();
                let whole: Vec<usize> = (0..7).collect();
                assert_eq!(
                    impacts(&[changed.clone(), steady.clone()]),
                    [whole.clone(), whole.clone()],
                    "{softer} {at}"
                );
                let (heard, stray) = with(changed, times[0] + 0.3 * (times[1] - times[0]), 2.0);
                assert_eq!(impacts(&[heard, steady.clone()])[0], without(8, stray), "{softer} {at}");
            }
            let all = [drop(0.85, 7), drop(0.85, 7), drop(softer, 7)];
            assert!(impacts(&all).iter().all(|kept| kept.len() == 7), "{softer}");
        }
    }

    #[test]
    fn what_is_no_chain_is_left_as_it_is() {
        let none: Vec<Candidate> = [0.1, 0.2, 0.9].map(|t_s| Candidate { t_s, loudness: 0.0 }).into();
        assert_eq!(impacts(&[none, Vec::new()]), [vec![0, 1, 2], Vec::new()]);
    }
}
