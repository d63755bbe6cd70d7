//! Drops of a few impacts in which nothing is hidden.

use worlds::physics::bounce::BounceWorld;

/// Drops of 3 to 8 impacts, timed alone or placed as well, with and without a calibration, the restitution scattered or not.
pub(crate) fn drops() -> Result<(), Box<dyn std::error::Error>> {
    let (count, fewest): (u64, _) = if examples::small() { (1, 8) } else { (20, 3) };
    let drops = BounceWorld::drops();
    let scattered = BounceWorld { restitution_scatter: 0.005, ..drops };
    let kinds = [
        ("placed, known noise", BounceWorld { noise_known: true, ..drops }),
        ("placed, unknown noise", BounceWorld { noise_known: false, ..drops }),
        ("placed, scattered", BounceWorld { noise_known: false, ..scattered }),
        ("placed, height known", BounceWorld { noise_known: true, height_known: true, ..drops }),
        ("timed, unknown noise", BounceWorld { noise_known: false, placed: false, ..drops }),
        ("timed, scattered", BounceWorld { noise_known: false, placed: false, ..scattered }),
    ];
    println!("{:36} {:>7} {:>8} {:>8}", "drops in which nothing is hidden", "number", "at 5 %", "at 1 %");
    let mut all = Vec::new();
    for (k, (name, world)) in kinds.iter().enumerate() {
        for impacts in fewest..=8 {
            let files = |seed: u64| {
                let runs = 10 + (seed % 3) as usize * 10;
                let [header, data] = BounceWorld { impacts, runs, ..*world }.files(seed);
                [("recording.toml", header), ("data.csv", data)]
                    .map(|(name, text)| (name.to_owned(), text.into_bytes()))
                    .into()
            };
            let first = 8_000_000 + 10_000 * k as u64 + 1000 * impacts as u64;
            let answers = examples::diagnose_files(&files, count, first, 399)?;
            let p: Vec<f64> = answers.iter().flatten().map(|d| d.p_value).collect();
            let name = format!("{name}, {impacts} impacts");
            println!(
                "{name:36} {:>7} {:>8} {:>8}",
                p.len(),
                super::alarms(&p, 0.05),
                super::alarms(&p, 0.01)
            );
            all.extend(p);
        }
    }
    super::compare(&all)
}
