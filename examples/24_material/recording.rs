//! What is said of a sound file of somebody's own, learned from simulated balls.

use bounce_audio::fake::knock::SUBSTANCES;
use bounce_audio::material::{Classifier, Given, Observation, Senses};
use bounce_audio::wav::Sound;
use examples::argument;

use crate::{CONFIDENT, FLAT, LEVEL, Outcome};

/// Answers for the file of `--wav`, by each sense that it and `--mass-kg`, `--diameter-m` allow.
pub(crate) fn print(classifier: &Classifier) -> Outcome<()> {
    let Some(file) = argument("--wav") else { return Ok(()) };
    let number = |name: &str| -> Outcome<Option<f64>> { Ok(argument(name).map(|v| v.parse()).transpose()?) };
    let given = Given {
        mass_kg: number("--mass-kg")?,
        diameter_m: number("--diameter-m")?,
        height_m: number("--height-m")?,
    };
    let seen = Observation::of(&Sound::read(&file)?, &given)?;
    println!("\n{file}: {} impacts are listened to, restitution {:?}", seen.impacts(), seen.restitution());
    println!("contact time at 1 m/s {:.0} us", 1e6 * seen.contact_time_s().unwrap_or(f64::NAN));
    for (sound, bounce, weight) in [
        (true, false, false),
        (false, true, false),
        (true, true, false),
        (false, true, true),
        (true, true, true),
    ] {
        let senses = Senses { sound, bounce, weight };
        let Ok(judge) = classifier.judge(&seen, senses) else { continue };
        let answer = judge.answer(&seen, &FLAT)?;
        let mut order: Vec<usize> = (0..SUBSTANCES.len()).collect();
        order.sort_by(|&a, &b| answer.probabilities[b].total_cmp(&answer.probabilities[a]));
        let three: Vec<String> = order[..3]
            .iter()
            .map(|&k| {
                format!("{} {:.3} (p {:.3})", SUBSTANCES[k].name, answer.probabilities[k], answer.p_values[k])
            })
            .collect();
        println!("by {:26} {}: {:?}", senses.words(), three.join(", "), answer.verdict(LEVEL, CONFIDENT));
    }
    Ok(())
}
