//! What the restitution will be, from one impact's sound and the weight: a mixture over materials.

use bounce_audio::material::{Observation, Senses};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::judges::Judges;
use crate::rig::Tried;
use crate::{FLAT, Outcome};

const DRAWS: usize = 4_000;

/// Draws of the restitution that is foretold by some senses, ascending.
pub(crate) fn draws(judges: &mut Judges, seen: &Observation, senses: Senses) -> Outcome<Vec<f64>> {
    let mixture = judges.of(seen, senses)?.restitution(seen, &FLAT)?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut e: Vec<f64> =
        mixture.sample(DRAWS, &mut rng).rows().map(|l| 1.0 / (1.0 + (-l[0]).exp())).collect();
    e.sort_by(f64::total_cmp);
    Ok(e)
}

/// How often the 95 % interval of what is foretold holds, and how wide it is.
pub(crate) fn print(judges: &mut Judges, tried: &[Tried]) -> Outcome<()> {
    println!("\nrestitution foretold from one impact, before it bounces again");
    for (name, sound, weight) in [("sound", true, false), ("weight", false, true), ("both", true, true)] {
        let senses = Senses { sound, bounce: false, weight };
        let (mut held, mut count, mut width, mut off) = (0, 0, 0.0, 0.0);
        for seen in tried.iter().filter_map(|t| t.seen.as_ref().ok()) {
            let Some(truth) = seen.restitution() else { continue };
            let e = draws(judges, &seen.first(1), senses)?;
            let (low, high) = (e[DRAWS / 40], e[DRAWS - DRAWS / 40 - 1]);
            held += usize::from((low..=high).contains(&truth));
            count += 1;
            width += high - low;
            off += (e[DRAWS / 2] - truth).powi(2);
        }
        let n = count as f64;
        println!(
            "by {name:7} {:.3} off (root mean square), its 95 % interval {:.3} wide on average holds {held} of {count} ({:.1} %)",
            (off / n).sqrt(),
            width / n,
            100.0 * held as f64 / n
        );
    }
    Ok(())
}
