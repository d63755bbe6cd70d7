//! What is printed: errors, widths, how often intervals hold, twins, contradictions.

use liquid_haptics::fusion::{Marginal, Quantity};
use statrs::statistics::{Data, OrderStatistics as _};

use crate::rig::{FILLS, LIQUIDS, SENSORS};
use crate::{SENSES, Said, Tried};

/// Quantities, and what each is printed in.
const QUANTITIES: [&str; 3] = ["volume, mL", "density, %", "viscosity, factor"];
/// A posterior that puts this much on one side has told twins apart.
const SURE: f64 = 0.95;

fn truths(tried: &Tried) -> [f64; 3] {
    [tried.case.volume_m3(), tried.case.kind().density, tried.case.kind().viscosity]
}

/// Error of the median, and the width of the 95 % intervals together, as they are printed; and whether they hold the truth.
fn judged(marginal: &Marginal, truth: f64, quantity: usize) -> ([f64; 2], bool) {
    let pieces = marginal.highest_density(0.95);
    let holds = pieces.iter().any(|p| (p[0]..=p[1]).contains(&truth));
    let median = marginal.median();
    let numbers = match quantity {
        0 => [1e6 * (median - truth).abs(), 1e6 * pieces.iter().map(|p| p[1] - p[0]).sum::<f64>()],
        1 => [
            100.0 * (median / truth - 1.0).abs(),
            100.0 * pieces.iter().map(|p| p[1] - p[0]).sum::<f64>() / truth,
        ],
        _ => {
            [(median / truth).ln().abs().exp(), pieces.iter().map(|p| (p[1] / p[0]).ln()).sum::<f64>().exp()]
        }
    };
    (numbers, holds)
}

fn number(value: f64) -> String {
    match value {
        v if v >= 1e4 => format!("{v:.0e}"),
        v if v >= 99.95 => format!("{v:.0}"),
        v if v >= 9.995 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}

pub(crate) fn print(tried: &[Tried]) {
    for (of, (name, _)) in SENSORS.iter().enumerate() {
        println!("{name}: median error (median width of the 95 % intervals) by {}\n", SENSES.join(" | "));
        print!("{:16}", "");
        for quantity in QUANTITIES {
            print!(" {quantity:^43}");
        }
        println!();
        for (k, liquid) in LIQUIDS.iter().enumerate() {
            for fill in FILLS {
                let rows: Vec<&Tried> =
                    tried.iter().filter(|t| t.case.liquid == k && t.case.fill == fill).collect();
                if rows.is_empty() {
                    continue;
                }
                print!("{:16}", format!("{} {fill}", liquid.name));
                for quantity in 0..3 {
                    let cell = |sense: usize| {
                        let each: Vec<[f64; 2]> = rows
                            .iter()
                            .map(|t| {
                                judged(&t.said[of].marginals[sense][quantity], truths(t)[quantity], quantity)
                                    .0
                            })
                            .collect();
                        let [error, width] = [0, 1].map(|i| {
                            number(Data::new(each.iter().map(|e| e[i]).collect::<Vec<_>>()).median())
                        });
                        format!("{error} ({width})")
                    };
                    print!(" {:>43}", [cell(0), cell(1), cell(2)].join(" | "));
                }
                println!();
            }
        }
        println!();
        held(tried, of);
        twins(tried, of);
        let times: Vec<f64> = tried.iter().map(|t| t.said[of].took_s).collect();
        println!(
            "a posterior by both takes {:.2} s (median, other work beside it)\n",
            Data::new(times).median()
        );
    }
}

fn held(tried: &[Tried], of: usize) {
    for (sense, name) in SENSES.iter().enumerate() {
        let holds = |quantity: usize| {
            let hold =
                |t: &&Tried| judged(&t.said[of].marginals[sense][quantity], truths(t)[quantity], quantity).1;
            tried.iter().filter(hold).count()
        };
        println!(
            "95 % intervals by {name:6} hold of {}: volume {}, density {}, viscosity {}",
            tried.len(),
            holds(0),
            holds(1),
            holds(2)
        );
    }
    let mean =
        |a, b| tried.iter().map(|t| t.said[of].three[2].correlation(a, b)).sum::<f64>() / tried.len() as f64;
    println!(
        "mean correlations by both: volume and density {:+.2}, volume and viscosity {:+.2}, density and viscosity {:+.2}",
        mean(Quantity::Volume, Quantity::Density),
        mean(Quantity::Volume, Quantity::Viscosity),
        mean(Quantity::Density, Quantity::Viscosity)
    );
}

/// How often the posterior is on the right side of the middle, where the truth is not in it.
fn twins(tried: &[Tried], of: usize) {
    for pair in [[0.1, 0.9], [0.25, 0.75]] {
        let rows: Vec<&Tried> = tried.iter().filter(|t| pair.contains(&t.case.fill)).collect();
        if rows.is_empty() {
            continue;
        }
        let line = |sense: usize| {
            let right = |t: &&Tried| {
                let half = 0.5 * t.case.volume_m3() / t.case.fill;
                let below = t.said[of].marginals[sense][0].between(0.0, half);
                if t.case.fill < 0.5 { below } else { 1.0 - below }
            };
            let right_ones = rows.iter().filter(|t| right(t) > SURE).count();
            let wrong = rows.iter().filter(|t| right(t) < 1.0 - SURE).count();
            format!("{} {right_ones} right, {wrong} wrong", SENSES[sense])
        };
        println!(
            "{} and {} told apart, of {}: {}",
            pair[0],
            pair[1],
            rows.len(),
            [line(0), line(1), line(2)].join("; ")
        );
    }
    let ps: Vec<f64> = tried.iter().filter_map(|t| t.said[of].frequency_p).collect();
    let below = |p: f64| ps.iter().filter(|v| **v < p).count();
    println!(
        "frequency as the poses predict it: p below 0.05 in {} of {}, below 0.001 in {}",
        below(0.05),
        ps.len(),
        below(0.001)
    );
    let few = |get: &dyn Fn(&Said) -> Option<f64>| {
        tried.iter().filter(|t| get(&t.said[of]).is_some_and(|p| p < 1e-3)).count()
    };
    let strange: Vec<String> = tried
        .iter()
        .filter(|t| t.said[of].three[2].swing_p().is_some_and(|p| p < 1e-3))
        .map(|t| format!("{} {}", t.case.kind().name, t.case.fill))
        .collect();
    println!(
        "p below 0.001 of {}: poses {}, swing {} ({}); a wave stands out in {}",
        tried.len(),
        few(&|s| s.three[2].poses_p()),
        strange.len(),
        strange.join(", "),
        tried.iter().filter(|t| t.said[of].swings).count()
    );
}

/// Whether a wave of another radius than is stated is noticed.
pub(crate) fn contradictions(tried: &[Tried]) {
    println!("water, 0.4 full; the surface lies where the bottle is wider than stated:");
    for wider in [1.0, 1.1, 1.25] {
        let rows: Vec<&Tried> = tried.iter().filter(|t| t.case.wider == wider).collect();
        let low =
            |of: usize| rows.iter().filter(|t| t.said[of].frequency_p.is_some_and(|p| p < 1e-3)).count();
        println!(
            "  radius {:+3.0} %: p of the frequency below 0.001 in {} of {} (six axes), {} (small tilts), {} (torque alone)",
            100.0 * (wider - 1.0),
            low(0),
            rows.len(),
            low(1),
            low(2)
        );
    }
}
