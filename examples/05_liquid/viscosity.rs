//! Nine liquids that are swung, and which of them are told apart.

use std::f64::consts::PI;

use examples::liquid::{self, Swing};
use liquid_haptics::classify::cross_validate;
use liquid_haptics::fake::{AXIA80, FakeWrist};
use liquid_haptics::viscosity::{Bottle, Verdict, ViscosityFit};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::vessel::{LARGE, SMALL, Vessel};
use super::{GAIN, GRAVITY, Outcome, line, shown};

/// Name, density (kg/m3), and viscosity (Pa s) of the liquids of [Matl 2021], thinnest first; the numbers are ours, and all are Newtonian.
const LIQUIDS: [(&str, f64, f64); 9] = [
    ("water", 997.0, 1e-3),
    ("isopropyl alcohol", 785.0, 2.04e-3),
    ("coconut milk", 1000.0, 5e-3),
    ("evaporated milk", 1070.0, 2e-2),
    ("oil", 915.0, 6.4e-2),
    ("mango juice", 1040.0, 0.2),
    ("dish soap", 1030.0, 0.5),
    ("syrup", 1330.0, 2.0),
    ("honey", 1420.0, 9.94),
];
/// The liquids that the larger bottle is filled with too.
const IN_BOTH: [&str; 3] = ["water", "oil", "honey"];
/// Fills: in the small bottle, and in the larger one.
const SMALL_M3: [f64; 3] = [137e-6, 292e-6, 442e-6];
const LARGE_M3: f64 = 636.11e-6;

/// A liquid in a vessel, swung once.
struct Swung {
    liquid: usize,
    volume_m3: f64,
    verdict: Verdict,
}

impl Swung {
    /// The viscosity that was felt, Pa s.
    fn viscosity(&self) -> Option<f64> {
        match &self.verdict {
            Verdict::Viscosity(e) => Some(e.kinematic_m2_s * LIQUIDS[self.liquid].1),
            _ => None,
        }
    }
}

/// What a swing from the side to upright shows of a viscosity.
fn swing(
    vessel: &Vessel,
    volume_m3: f64,
    (_, density, viscosity): (&str, f64, f64),
    seed: u64,
) -> Outcome<Verdict> {
    let mut load = vessel.load(volume_m3, density, viscosity / density);
    load.force_gain = GAIN;
    let mut wrist = FakeWrist::new(load, AXIA80, seed).map_err(|e| e.to_string())?;
    let Swing { turn_s, times_s, torques_nm } = liquid::swing(&mut wrist).map_err(|e| e.to_string())?;
    let bottle = Bottle::new(&vessel.inner()?, volume_m3, density * volume_m3, GRAVITY)?;
    let head_start_s = 2.0 / PI * turn_s;
    Ok(ViscosityFit { bottle, mass_error_share: 0.002, head_start_s, widest_factor: 4.0 }
        .estimate(&times_s, &torques_nm)?)
}

/// Each liquid swung so many times at each fill.
pub(crate) fn which_liquid(each: u64) -> Outcome<()> {
    let small = (0..LIQUIDS.len()).flat_map(|k| SMALL_M3.map(|v| (k, SMALL, v)));
    let both = (0..LIQUIDS.len()).filter(|k| IN_BOTH.contains(&LIQUIDS[*k].0));
    let tries: Vec<(usize, Vessel, f64, u64)> = small
        .chain(both.map(|k| (k, LARGE, LARGE_M3)))
        .flat_map(|(k, vessel, v)| (0..each).map(move |i| (k, vessel, v, i)))
        .collect();
    let felt: Outcome<Vec<Swung>> = tries
        .into_par_iter()
        .map(|(liquid, vessel, volume_m3, i)| {
            let seed = 7000 + 100 * liquid as u64 + 10 * (1e5 * volume_m3) as u64 + i;
            Ok(Swung { liquid, volume_m3, verdict: swing(&vessel, volume_m3, LIQUIDS[liquid], seed)? })
        })
        .collect();
    let felt = felt?;
    table(&felt);
    figure(&felt);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut accuracy = |names: &[&str]| -> Outcome<String> {
        // Of the fills that [Matl 2021] takes.
        let of_fills = felt.iter().filter(|f| f.volume_m3 > SMALL_M3[0]);
        let (x, y): (Vec<Vec<f64>>, Vec<String>) = of_fills
            .filter(|f| names.contains(&LIQUIDS[f.liquid].0))
            .filter_map(|f| Some((vec![f.viscosity()?.ln()], LIQUIDS[f.liquid].0.to_owned())))
            .unzip();
        let confusion = cross_validate(&x, &y, 1.0, if each < 5 { 2 } else { 5 }, &mut rng)?;
        let (mean, spread) = (100.0 * confusion.accuracy(), 200.0 * confusion.fold_deviation());
        Ok(format!("{mean:.0} +- {spread:.0} %"))
    };
    line("told apart: water, oil, honey", &accuracy(&IN_BOTH)?, "98 +- 10 %");
    let four: Vec<&str> = LIQUIDS.iter().take(4).map(|l| l.0).collect();
    line("told apart: the four thinnest", &accuracy(&four)?, "78 +- 11 %");
    let all: Vec<&str> = LIQUIDS.iter().map(|l| l.0).collect();
    line("told apart: all nine", &accuracy(&all)?, "");
    Ok(())
}

/// Errors of the viscosities, fill by fill.
fn table(felt: &[Swung]) {
    let fills = [SMALL_M3[0], SMALL_M3[1], SMALL_M3[2], LARGE_M3];
    println!("\nviscosity, error in %: mean +- its 95 % interval (refused)");
    let head = fills.map(|v| format!("{:>24}", format!("{:.0} mL", v * 1e6)));
    println!("{:29}{}", "", head.concat());
    for (k, (name, _, truth)) in LIQUIDS.iter().enumerate() {
        print!("{:29}", format!("{name}, {truth:.1e} Pa s"));
        for volume in fills {
            let of_fill: Vec<&Swung> =
                felt.iter().filter(|f| f.liquid == k && f.volume_m3 == volume).collect();
            let errors: Vec<f64> =
                of_fill.iter().filter_map(|f| Some(f.viscosity()? / truth - 1.0)).collect();
            let refused = of_fill.len() - errors.len();
            let cell = match (of_fill.is_empty(), errors.is_empty()) {
                (true, _) => String::new(),
                (_, true) => format!("({refused})"),
                _ => format!("{} ({refused})", shown(&errors, 100.0, "").trim_end()),
            };
            print!("{cell:>24}");
        }
        println!();
    }
    let honey = felt.iter().filter(|f| f.volume_m3 == LARGE_M3 && LIQUIDS[f.liquid].0 == "honey");
    let errors: Vec<f64> = honey.filter_map(|f| Some((f.viscosity()? - LIQUIDS[f.liquid].2).abs())).collect();
    println!();
    line("honey, larger bottle: size of the error", &shown(&errors, 1.0, "Pa s"), "0.197 +- 0.096 Pa s");
}

/// The viscosities as felt, on a log axis: `o` a swing, `8` several, `|` the liquid's own.
fn figure(felt: &[Swung]) {
    const COLUMNS: usize = 90;
    let (low, high) = (3e-4_f64.ln(), 30_f64.ln());
    let place = |v: f64| {
        let share = ((v.ln() - low) / (high - low)).clamp(0.0, 1.0);
        (share * (COLUMNS - 1) as f64).round() as usize
    };
    println!("\n{:19}viscosity felt, 0.0003 to 30 Pa s, log axis", "");
    for (k, (name, _, truth)) in LIQUIDS.iter().enumerate() {
        let mut row = vec![' '; COLUMNS];
        for v in felt.iter().filter(|f| f.liquid == k).filter_map(Swung::viscosity) {
            let cell = &mut row[place(v)];
            *cell = if *cell == ' ' { 'o' } else { '8' };
        }
        row[place(*truth)] = '|';
        println!("{name:19}{}", row.into_iter().collect::<String>().trim_end());
    }
    println!();
}
