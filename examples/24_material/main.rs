//! What a ball is made of, by its sound, its bounce and its weight: eight materials, on tables and in rooms that nothing was learned in.
//!
//! `cargo run --release -p examples --example 24_material` (2,900 drops; `--small`: 600) writes `material.svg` in the temporary folder: spectra
//! by material, whether probabilities are what they say, and a restitution foretold. `--wav FILE`, with `--mass-kg`, `--diameter-m` and `--height-m` where
//! they are known, is one more drop, of somebody's own.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod foretell;
mod judges;
mod picture;
mod recording;
mod rig;

use std::error::Error;

use bounce_audio::fake::knock::{SLABS, STRANGERS, SUBSTANCES};
use bounce_audio::material::{Classifier, Labelled, Senses, Verdict, Verdicts};

use judges::Judges;
use rig::{TABLES, Tried};

pub(crate) type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

pub(crate) const MATERIALS: usize = SUBSTANCES.len();
/// All materials as probable as each other before anything is observed.
pub(crate) const FLAT: [f64; MATERIALS] = [1.0; MATERIALS];
/// A drop as unusual as a twentieth of the drops of every material is none of these; a name has nine tenths of the probability.
const LEVEL: f64 = 0.05;
const CONFIDENT: f64 = 0.9;

fn main() -> Outcome<()> {
    let small = examples::small();
    let [learn, calibrate, test, strange] = if small { [30, 20, 15, 10] } else { [160, 90, 70, 60] };
    let learned = rig::drops(0..MATERIALS, &TABLES[0], learn, 1)?;
    let held_out = rig::drops(0..MATERIALS, &TABLES[1], calibrate, 2)?;
    let tried = rig::drops(0..MATERIALS, &TABLES[2], test, 3)?;
    let strangers = rig::drops(MATERIALS..MATERIALS + STRANGERS.len(), &TABLES[2], strange, 4)?;
    let names =
        |of: &std::ops::Range<usize>| SLABS[of.clone()].iter().map(|s| s.name).collect::<Vec<_>>().join(", ");
    println!("{} drops on {} are learned from,", learned.len(), names(&TABLES[0]));
    println!("{} on {} calibrate,", held_out.len(), names(&TABLES[1]));
    println!("{} on {} are tried, and {} of other balls\n", tried.len(), names(&TABLES[2]), strangers.len());
    heard(tried.iter().chain(&strangers));
    for drop in tried.iter().chain(&strangers) {
        if let Err(error) = &drop.seen {
            println!("refused, {}: {error}", rig::substance(drop.substance).name);
        }
    }
    let classifier = Classifier::learn(MATERIALS, &labelled(&learned), labelled(&held_out))?;
    println!("\ncovariances are drawn to that of all by {}", classifier.shrinkage());
    let mut judges = Judges::new(&classifier);
    let (sound, all) = by_sense(&mut judges, &tried)?;
    confusion("sound alone", &sound);
    confusion("sound, bounce and weight", &all);
    by_table(&mut judges, &tried)?;
    by_impacts(&mut judges, &tried)?;
    unknown(&mut judges, &strangers)?;
    foretell::print(&mut judges, &tried)?;
    recording::print(&classifier)?;
    let path = picture::draw(&mut judges, &tried, &[("sound alone", &sound), ("all", &all)])?;
    println!("picture: {}", path.display());
    Ok(())
}

fn labelled(drops: &[Tried]) -> Vec<Labelled> {
    let one = |t: &Tried| {
        let observation = t.seen.as_ref().ok()?.clone();
        Some(Labelled { observation, material: t.substance })
    };
    drops.iter().filter_map(one).collect()
}

/// What was heard of each kind of ball, beside what is true.
fn heard<'a>(drops: impl Iterator<Item = &'a Tried>) {
    let drops: Vec<&Tried> = drops.collect();
    println!(
        "{:16} {:>5} {:>7} {:>7} {:>13} {:>22} {:>12} {:>18}",
        "", "drops", "refused", "impacts", "contact, us", "heard over true", "restitution", "its error, 80 %"
    );
    for number in 0..MATERIALS + STRANGERS.len() {
        let of: Vec<&&Tried> = drops.iter().filter(|t| t.substance == number).collect();
        let seen: Vec<_> = of.iter().filter_map(|t| Some((**t, t.seen.as_ref().ok()?))).collect();
        let sorted = |values: Vec<f64>| {
            let mut values = values;
            values.sort_by(f64::total_cmp);
            move |share: f64| values.get((share * values.len() as f64) as usize).copied().unwrap_or(f64::NAN)
        };
        let contact = sorted(of.iter().map(|t| 1e6 * t.contact_s).collect());
        let ratio =
            sorted(seen.iter().filter_map(|(t, o)| Some(o.contact_time_s()? / t.contact_s)).collect());
        let bounce = sorted(of.iter().map(|t| t.restitution).collect());
        let off = sorted(seen.iter().filter_map(|(t, o)| Some(o.restitution()? - t.restitution)).collect());
        let impacts = seen.iter().map(|(_, o)| o.impacts()).sum::<usize>() as f64 / seen.len().max(1) as f64;
        println!(
            "{:16} {:5} {:7} {impacts:7.1} {:13.0} {:8.2} ({:5.2}, {:5.2}) {:12.2} {:+9.3}, {:+7.3}",
            rig::substance(number).name,
            of.len(),
            of.len() - seen.len(),
            contact(0.5),
            ratio(0.5),
            ratio(0.1),
            ratio(0.9),
            bounce(0.5),
            off(0.1),
            off(0.9)
        );
    }
}

/// Which senses say how much: answers by sound alone, and by all.
fn by_sense(judges: &mut Judges, tried: &[Tried]) -> Outcome<(Verdicts, Verdicts)> {
    let senses = |sound, bounce, weight| Senses { sound, bounce, weight };
    println!(
        "\n{:26} {:>5} {:>6} {:>16} {:>5} {:>5} {:>5} {:>13} {:>7} {:>13}",
        "",
        "drops",
        "right",
        "log loss (2.079)",
        "ECE",
        "power",
        "named",
        "of them wrong",
        "none of",
        "in 95 % set"
    );
    let mut kept = Vec::new();
    for senses in [
        Senses::SOUND,
        Senses::BOUNCE,
        Senses::WEIGHT,
        senses(true, true, false),
        senses(true, false, true),
        senses(false, true, true),
        Senses::ALL,
    ] {
        let mut verdicts = Verdicts::new(MATERIALS);
        let (mut named, mut wrong, mut none, mut within, mut power) = (0, 0, 0, 0, f64::NAN);
        for (truth, seen) in tried.iter().filter_map(|t| Some((t.substance, t.seen.as_ref().ok()?))) {
            // A drop of two impacts has no restitution.
            let Ok(judge) = judges.of(seen, senses) else { continue };
            let answer = judge.answer(seen, &FLAT)?;
            verdicts.add(truth, &answer.probabilities)?;
            power = judge.power();
            match answer.verdict(LEVEL, CONFIDENT) {
                Verdict::Is(material, _) => {
                    named += 1;
                    wrong += usize::from(material != truth);
                }
                Verdict::NoneOfThese => none += 1,
                Verdict::OneOf(_) => {}
            }
            let mut order: Vec<usize> = (0..MATERIALS).collect();
            order.sort_by(|&a, &b| answer.probabilities[b].total_cmp(&answer.probabilities[a]));
            let before: f64 =
                order.iter().take_while(|&&k| k != truth).map(|&k| answer.probabilities[k]).sum();
            within += usize::from(before < 0.95);
        }
        println!(
            "{:26} {:5} {:5.1}% {:16.3} {:5.3} {power:5.2} {named:5} {wrong:13} {none:7} {:12.1}%",
            senses.words(),
            verdicts.count(),
            100.0 * verdicts.accuracy(),
            verdicts.log_loss(),
            verdicts.calibration_error(10),
            100.0 * within as f64 / verdicts.count() as f64
        );
        kept.push(verdicts);
    }
    let all = kept.pop().ok_or("no senses")?;
    Ok((kept.swap_remove(0), all))
}

fn confusion(by: &str, verdicts: &Verdicts) {
    println!("\nsaid by {by} (columns), of what it is (rows):");
    for (row, substance) in verdicts.confusion().iter().zip(&SUBSTANCES) {
        let row: String = row.iter().map(|n| format!("{n:5}")).collect();
        println!("{:16}{row}", substance.name);
    }
}

/// How much it matters what the ball falls on.
fn by_table(judges: &mut Judges, tried: &[Tried]) -> Outcome<()> {
    println!("\non each table: right by sound alone, by all");
    for table in TABLES[2].clone() {
        let mut line = format!("{:16}", SLABS[table].name);
        for senses in [Senses::SOUND, Senses::ALL] {
            let mut verdicts = Verdicts::new(MATERIALS);
            for drop in tried.iter().filter(|t| t.table == table) {
                let Ok(seen) = &drop.seen else { continue };
                let Ok(judge) = judges.of(seen, senses) else { continue };
                verdicts.add(drop.substance, &judge.answer(seen, &FLAT)?.probabilities)?;
            }
            line += &format!("{:7.1} % of {}", 100.0 * verdicts.accuracy(), verdicts.count());
        }
        println!("{line}");
    }
    Ok(())
}

/// What more impacts of one drop add.
fn by_impacts(judges: &mut Judges, tried: &[Tried]) -> Outcome<()> {
    println!("\nby sound alone, of the first impacts (drops of five)");
    for impacts in [1, 2, 5] {
        let mut verdicts = Verdicts::new(MATERIALS);
        for (truth, seen) in tried.iter().filter_map(|t| Some((t.substance, t.seen.as_ref().ok()?))) {
            if seen.impacts() == 5 {
                let first = seen.first(impacts);
                let answer = judges.of(&first, Senses::SOUND)?.answer(&first, &FLAT)?;
                verdicts.add(truth, &answer.probabilities)?;
            }
        }
        println!(
            "{impacts} of {} drops: {:.1} % right, log loss {:.3}, ECE {:.3}",
            verdicts.count(),
            100.0 * verdicts.accuracy(),
            verdicts.log_loss(),
            verdicts.calibration_error(10)
        );
    }
    Ok(())
}

/// What is said of balls that are none of the list.
fn unknown(judges: &mut Judges, strangers: &[Tried]) -> Outcome<()> {
    println!("\nballs that are none of these: said to be none, undecided, named");
    for number in MATERIALS..MATERIALS + STRANGERS.len() {
        let mut line = format!("{:16}", rig::substance(number).name);
        for senses in [Senses::SOUND, Senses::ALL] {
            let (mut none, mut open, mut names) = (0, 0, [0; MATERIALS]);
            for seen in
                strangers.iter().filter(|t| t.substance == number).filter_map(|t| t.seen.as_ref().ok())
            {
                match judges.of(seen, senses)?.answer(seen, &FLAT)?.verdict(LEVEL, CONFIDENT) {
                    Verdict::NoneOfThese => none += 1,
                    Verdict::OneOf(_) => open += 1,
                    Verdict::Is(material, _) => names[material] += 1,
                }
            }
            let named: Vec<String> = names
                .iter()
                .zip(&SUBSTANCES)
                .filter(|(n, _)| **n > 0)
                .map(|(n, s)| format!("{n} {}", s.name))
                .collect();
            let by = if senses == Senses::ALL { "all" } else { "sound" };
            line += &format!("  by {by}: {none:2}, {open:2}, {:26}", named.join(", "));
        }
        println!("{}", line.trim_end());
    }
    Ok(())
}
