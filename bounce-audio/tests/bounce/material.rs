//! What a ball is made of: drops of simulated balls on tables that nothing was learned on.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use bounce_audio::fake::knock::{
    Board, Recorded, Recorder, SLABS, STRANGERS, SUBSTANCES, Striker, Substance,
};
use bounce_audio::material::{
    Classifier, Given, Labelled, MaterialError, Observation, Reliability, Senses, Verdict, Verdicts,
};
use bounce_audio::wav::Sound;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::sync::OnceLock;

/// Steel, acrylic, wood, rubber and a celluloid shell.
const KNOWN: [usize; 5] = [0, 2, 4, 6, 7];
const FLAT: [f64; 5] = [1.0; 5];

/// One drop from 0.3 m, and what a scale and calipers say of the ball.
fn drop(substance: &Substance, table: usize, rate_hz: f64, seed: u64) -> (Recorded, Given) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let ball = Striker::draw(substance, &mut rng);
    let board = Board::draw(&SLABS[table], &mut rng);
    let recorder = Recorder::draw(rate_hz, &mut rng).unwrap();
    let recorded = recorder.drop(&ball, &board, 0.3, &mut rng);
    let given = Given { mass_kg: Some(ball.mass_kg), diameter_m: Some(ball.diameter_m), height_m: Some(0.3) };
    (recorded, given)
}

/// So many drops of each known material, on tables in turn; those that are refused are left out.
fn drops(tables: &[usize], each: u64, rate_hz: f64, seed: u64) -> Vec<Labelled> {
    let all: Vec<(usize, u64)> = (0..KNOWN.len()).flat_map(|m| (0..each).map(move |k| (m, k))).collect();
    let one = |&(material, k): &(usize, u64)| {
        let table = tables[k as usize % tables.len()];
        let at = seed * 100_000 + material as u64 * 1_000 + k;
        let (recorded, given) = drop(&SUBSTANCES[KNOWN[material]], table, rate_hz, at);
        Some(Labelled { observation: Observation::of(&recorded.sound, &given).ok()?, material })
    };
    all.par_iter().filter_map(one).collect()
}

/// Learned on wood, particle board, glass and granite, calibrated on plywood and concrete.
fn learned() -> &'static Classifier {
    static LEARNED: OnceLock<Classifier> = OnceLock::new();
    LEARNED.get_or_init(|| {
        let (learn, calibrate) = (drops(&[0, 1, 2, 3], 44, 48e3, 1), drops(&[4, 5], 30, 48e3, 2));
        Classifier::learn(KNOWN.len(), &learn, calibrate).unwrap()
    })
}

/// Drops on bamboo, marble and steel.
fn unseen() -> &'static [Labelled] {
    static UNSEEN: OnceLock<Vec<Labelled>> = OnceLock::new();
    UNSEEN.get_or_init(|| drops(&[6, 7, 8], 24, 48e3, 3))
}

fn judged(senses: Senses) -> Verdicts {
    let mut verdicts = Verdicts::new(KNOWN.len());
    for drop in unseen() {
        let Ok(judge) = learned().judge(&drop.observation, senses) else { continue };
        let answer = judge.answer(&drop.observation, &FLAT).unwrap();
        verdicts.add(drop.material, &answer.probabilities).unwrap();
    }
    assert!(verdicts.count() > 100, "{}", verdicts.count());
    verdicts
}

#[test]
fn every_sense_beats_the_prior_and_all_together_beat_each() {
    let all = judged(Senses::ALL);
    assert!(all.accuracy() > 0.93, "{:?}", all.confusion());
    for senses in [Senses::SOUND, Senses::BOUNCE, Senses::WEIGHT] {
        let alone = judged(senses);
        assert!(alone.log_loss() < 5f64.ln() - 0.3, "{}: {}", senses.words(), alone.log_loss());
        assert!(alone.log_loss() > all.log_loss(), "{}: {}", senses.words(), alone.log_loss());
        // None claims more than it holds; 115 answers leave 0.09 of chance. The bounce alone claims less: these tables are harder than those that
        // it was calibrated on.
        let claimed = |r: &Reliability| r.count as f64 * r.confidence;
        let confidence = alone.reliability(5).iter().map(claimed).sum::<f64>() / alone.count() as f64;
        assert!(confidence < alone.accuracy() + 0.09, "{}: {:?}", senses.words(), alone.reliability(5));
    }
}

#[test]
fn flights_and_contact_times_are_those_of_the_force() {
    let mut off = Vec::new();
    for seed in 0..12 {
        let (recorded, given) = drop(&SUBSTANCES[2], 3, 48e3, 500 + seed);
        let Ok(seen) = Observation::of(&recorded.sound, &given) else { continue };
        let mut truth = recorded.restitutions.clone();
        truth.sort_by(f64::total_cmp);
        let e = seen.restitution().unwrap();
        assert!((e - truth[truth.len() / 2]).abs() < 0.04, "{e} {truth:?}");
        let reduced =
            recorded.contacts_s.iter().zip(&recorded.speeds_m_s).map(|(t, v)| t.ln() + 0.2 * v.ln());
        let mean = reduced.sum::<f64>() / recorded.contacts_s.len() as f64;
        off.push((seen.contact_time_s().unwrap().ln() - mean).abs());
    }
    off.sort_by(f64::total_cmp);
    // An acrylic ball on granite: median within a third, of 0.1 ms or so.
    assert!(off.len() >= 10 && off[off.len() / 2] < 0.3, "{off:?}");
}

#[test]
fn loudness_says_nothing() {
    let (recorded, given) = drop(&SUBSTANCES[4], 6, 48e3, 700);
    let quieter = |by: f64| Sound {
        rate_hz: 48e3,
        channels: vec![recorded.sound.channels[0].iter().map(|v| by * v).collect()],
    };
    let answer = |sound: &Sound| {
        let seen = Observation::of(sound, &given).unwrap();
        learned().judge(&seen, Senses::SOUND).unwrap().answer(&seen, &FLAT).unwrap()
    };
    let (a, b) = (answer(&recorded.sound), answer(&quieter(1.0 / 64.0)));
    for (p, q) in a.probabilities.iter().zip(&b.probabilities) {
        approx::assert_relative_eq!(p, q, epsilon = 1e-6);
    }
}

#[test]
fn a_prior_moves_the_odds_by_its_ratio() {
    let seen = &unseen()[30].observation;
    let judge = learned().judge(seen, Senses::SOUND).unwrap();
    let flat = judge.answer(seen, &FLAT).unwrap();
    let tilted = judge.answer(seen, &[3.0, 1.0, 1.0, 1.0, 1.0]).unwrap();
    let odds = |p: &[f64]| p[0] / p[1];
    approx::assert_relative_eq!(
        odds(&tilted.probabilities),
        3.0 * odds(&flat.probabilities),
        max_relative = 1e-9
    );
    assert_eq!(flat.p_values, tilted.p_values);
    let short = judge.answer(seen, &[1.0; 4]);
    assert!(matches!(short, Err(MaterialError::Materials { expected: 5, got: 4, .. })), "{short:?}");
    let none = judge.answer(seen, &[0.0, 1.0, 1.0, 1.0, 1.0]);
    assert!(matches!(none, Err(MaterialError::Value { .. })), "{none:?}");
}

/// Of lead, foam and tennis balls few get a name; of balls that are known few are said to be none.
#[test]
fn what_is_not_on_the_list_gets_no_confident_name() {
    let verdict = |seen: &Observation| {
        let judge = learned().judge(seen, Senses::ALL).unwrap();
        judge.answer(seen, &FLAT).unwrap().verdict(0.05, 0.9)
    };
    let (mut named, mut tried) = (0, 0);
    for stranger in [0, 4, 5] {
        for k in 0..12 {
            let (recorded, given) =
                drop(&STRANGERS[stranger], 6 + k as usize % 3, 48e3, 9_000 + 100 * stranger as u64 + k);
            let Ok(seen) = Observation::of(&recorded.sound, &given) else { continue };
            if seen.restitution().is_none() {
                continue;
            }
            tried += 1;
            named += usize::from(matches!(verdict(&seen), Verdict::Is(..)));
        }
    }
    assert!(tried >= 25 && named * 10 <= tried, "{named} of {tried} have a name");
    let whole: Vec<&Labelled> = unseen().iter().filter(|d| d.observation.restitution().is_some()).collect();
    let none = whole.iter().filter(|d| verdict(&d.observation) == Verdict::NoneOfThese).count();
    assert!(none * 7 <= whole.len(), "{none} of {} are said to be none of these", whole.len());
}

/// Twice the diameter makes an eighth of the density: no material sounds like the one and weighs like the other.
#[test]
fn a_diameter_that_is_wrong_is_noticed() {
    let (mut noticed, mut tried) = (0, 0);
    for k in 0..12 {
        let (recorded, given) = drop(&SUBSTANCES[0], 6 + k as usize % 3, 48e3, 3_000 + k);
        let wrong = Given { diameter_m: given.diameter_m.map(|d| 2.0 * d), ..given };
        let Ok(seen) = Observation::of(&recorded.sound, &wrong) else { continue };
        let Ok(judge) = learned().judge(&seen, Senses::ALL) else { continue };
        let verdict = judge.answer(&seen, &FLAT).unwrap().verdict(0.05, 0.9);
        noticed += usize::from(!matches!(verdict, Verdict::Is(..)));
        tried += 1;
    }
    assert!(tried >= 10 && noticed + 1 >= tried, "{noticed} of {tried}");
}

/// Of one impact there is no restitution to be seen, and the sound says less than that of all.
#[test]
fn one_impact_says_less_and_not_what_it_cannot() {
    let (mut one, mut all) = (Verdicts::new(5), Verdicts::new(5));
    for drop in unseen() {
        let first = drop.observation.first(1);
        assert_eq!(first.restitution(), None);
        let blind = learned().judge(&first, Senses::BOUNCE);
        assert!(matches!(blind, Err(MaterialError::Blind { .. })), "{blind:?}");
        for (verdicts, seen) in [(&mut one, &first), (&mut all, &drop.observation)] {
            let judge = learned().judge(seen, Senses::SOUND).unwrap();
            verdicts.add(drop.material, &judge.answer(seen, &FLAT).unwrap().probabilities).unwrap();
        }
    }
    assert!(one.log_loss() < 5f64.ln() - 0.3, "{}", one.log_loss());
    assert!(one.log_loss() > all.log_loss() - 0.05, "{} {}", one.log_loss(), all.log_loss());
    assert!(one.calibration_error(5) < 0.15, "{:?}", one.reliability(5));
}

fn a_low_rate_is_less_sure(each: u64, at_least: usize) {
    let mut verdicts = Verdicts::new(5);
    for drop in drops(&[6, 7, 8], each, 8e3, 5) {
        let judge = learned().judge(&drop.observation, Senses::SOUND).unwrap();
        verdicts.add(drop.material, &judge.answer(&drop.observation, &FLAT).unwrap().probabilities).unwrap();
    }
    assert!(verdicts.count() > at_least);
    assert!(verdicts.log_loss() > judged(Senses::SOUND).log_loss());
    assert!(verdicts.log_loss() < 5f64.ln(), "{}", verdicts.log_loss());
}

#[test]
#[ignore = "long: .ci/run --long"]
fn long_a_low_rate_is_less_sure_of_many_drops() {
    a_low_rate_is_less_sure(16, 50);
}

/// At 8 kHz what is above 3.6 kHz is not seen: answers are worse, and still as sure as they should be.
#[test]
fn a_low_rate_is_less_sure_and_a_lower_one_is_refused() {
    a_low_rate_is_less_sure(6, 20);
    let telephone = Sound { rate_hz: 4_000.0, channels: vec![vec![0.1; 4_000]] };
    let refused = Observation::of(&telephone, &Given::default());
    assert!(matches!(refused, Err(MaterialError::Rate { .. })), "{refused:?}");
    for rate_hz in [1e9, f64::INFINITY, f64::NAN] {
        assert!(
            Observation::of(&Sound { rate_hz, channels: vec![vec![0.1; 4_000]] }, &Given::default()).is_err()
        );
    }
}

#[test]
fn what_cannot_be_heard_is_refused_in_words() {
    let of = |x: Vec<f64>| Observation::of(&Sound { rate_hz: 48e3, channels: vec![x] }, &Given::default());
    for silence in [vec![], vec![0.0; 48_000]] {
        assert!(matches!(of(silence), Err(MaterialError::Silent { .. })));
    }
    let mut dice = super::common::Dice(5);
    let hiss: Vec<f64> = (0..48_000).map(|_| 0.01 * dice.normal()).collect();
    assert!(matches!(of(hiss), Err(MaterialError::Silent { .. })));
    assert!(matches!(of(vec![f64::NAN; 48_000]), Err(MaterialError::Onset(_))));
    let (recorded, given) = drop(&SUBSTANCES[0], 3, 48e3, 800);
    let x = &recorded.sound.channels[0];
    let most = x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let clipped = |limit: f64| of(x.iter().map(|v| v.clamp(-limit, limit)).collect());
    let all = clipped(0.1 * most);
    assert!(matches!(all, Err(MaterialError::Clipped { .. })), "{all:?}");
    // Where the loudest alone are clipped they are left out.
    let whole = of(x.clone()).unwrap().impacts();
    assert!((1..whole).contains(&clipped(0.7 * most).unwrap().impacts()));
    for wrong in [
        Given { mass_kg: Some(0.0), ..given },
        Given { diameter_m: Some(-1.0), ..given },
        Given { height_m: Some(f64::NAN), ..given },
    ] {
        let refused = Observation::of(&recorded.sound, &wrong);
        assert!(matches!(refused, Err(MaterialError::Value { .. })), "{refused:?}");
    }
}

/// The impacts of two balls make no chain of one.
#[test]
fn two_balls_at_once_are_refused() {
    let mut refused = 0;
    for k in 0..10 {
        let (a, given) = drop(&SUBSTANCES[2], 3, 48e3, 4_000 + k);
        let (b, _) = drop(&SUBSTANCES[0], 3, 48e3, 5_000 + k);
        let late = 4_700 + 977 * k as usize;
        let mut x = a.sound.channels[0].clone();
        x.resize(x.len().max(b.sound.channels[0].len() + late), 0.0);
        let scale = |x: &[f64]| x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let louder = scale(&a.sound.channels[0]) / scale(&b.sound.channels[0]);
        x[late..].iter_mut().zip(&b.sound.channels[0]).for_each(|(v, w)| *v += louder * w);
        let both = Observation::of(&Sound { rate_hz: 48e3, channels: vec![x] }, &given);
        refused += usize::from(matches!(both, Err(MaterialError::SeveralBalls { .. })));
    }
    assert!(refused >= 8, "{refused} of 10");
}

/// Before it has bounced twice, sound and weight say how it will: a mixture over what it may be made of.
#[test]
fn a_restitution_foretold_holds_as_often_as_it_says() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let (mut held, mut tried, mut width) = (0, 0, 0.0f64);
    for drop in unseen() {
        let Some(truth) = drop.observation.restitution() else { continue };
        let seen = drop.observation.first(1);
        let senses = Senses { bounce: false, ..Senses::ALL };
        let judge = learned().judge(&seen, senses).unwrap();
        let foretold = judge.restitution(&seen, &FLAT).unwrap().sample(800, &mut rng);
        let mut e: Vec<f64> = foretold.rows().map(|l| 1.0 / (1.0 + (-l[0]).exp())).collect();
        e.sort_by(f64::total_cmp);
        held += usize::from((e[20]..=e[779]).contains(&truth));
        width += e[779] - e[20];
        tried += 1;
    }
    assert!(tried > 100 && held * 100 >= tried * 87, "{held} of {tried}");
    // All drops together span 0.3 to 0.93.
    assert!(width / (tried as f64) < 0.45, "{width} over {tried}");
    let seen = &unseen()[0].observation;
    let looks = learned().judge(seen, Senses::ALL).unwrap().restitution(seen, &FLAT);
    assert!(matches!(looks, Err(MaterialError::Blind { .. })));
}

#[test]
fn too_little_to_learn_from_is_refused() {
    let few = drops(&[0], 4, 48e3, 6);
    let refused = Classifier::learn(5, &few, few.clone());
    assert!(matches!(refused, Err(MaterialError::TooFew { material: 0, least: 20, .. })), "{refused:?}");
    let more = Classifier::learn(4, &few, Vec::new());
    assert!(matches!(more, Err(MaterialError::Materials { expected: 4, got: 5, .. })), "{more:?}");
    let same: Vec<Labelled> =
        (0..60).map(|k| Labelled { material: k % 2, observation: few[0].observation.clone() }).collect();
    let flat = Classifier::learn(2, &same, same.clone());
    assert!(matches!(flat, Err(MaterialError::Flat { .. })), "{flat:?}");
}
