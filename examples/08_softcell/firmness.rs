//! Figures 5.5 to 5.7: forces, effective modulus, a pressure that swings, the smallest force that shows.

use examples::plot::{Panel, hue};
use hw_traits::camera::Camera;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use softcell::fake::{Air, Bench, Dome, Touch};
use softcell::flow::{Tracker, TrackerSettings};
use softcell::modulus::{POISSON_RATIO, Pair, State, Stiffness, effective, smallest_indentation_m};

use super::{Outcome, PROBE_M};

const PRESSURES_PA: [f64; 8] = [0.0, 1000.0, 2000.0, 3000.0, 4500.0, 6140.0, 9000.0, 12000.0];
/// Noise of the load cell, N.
const NOISE_N: f64 = 2e-3;

/// Figure 5.5: force over depth under the ball (a) and a plate (c), and the moduli behind them (d).
pub(crate) fn curves(panels: &mut Vec<Panel>) -> Outcome<Stiffness> {
    println!("Effective modulus (figure 5.5 d; [Matl 2021]: E* of 4.4 to 46.1 kPa from 0 to 6.14 kPa)");
    println!(
        "{:>9} {:>9} {:>19} {:>8} {:>11} {:>9}",
        "p (kPa)", "E (kPa)", "95 % interval", "misfit", "plate (kPa)", "E* (kPa)"
    );
    let mut rng = ChaCha8Rng::seed_from_u64(55);
    let mut moduli = Panel::new("5.5 d: effective modulus (kPa)", "pressure (kPa)", "");
    let mut states = Vec::new();
    let probes = [("5.5 a: force (N), ball of 19 mm", PROBE_M), ("5.5 c: force (N), plate", f64::INFINITY)];
    let mut drawn = probes.map(|(title, _)| Panel::new(title, "depth (mm)", ""));
    for (k, p) in PRESSURES_PA.into_iter().enumerate() {
        let colour = hue(k, PRESSURES_PA.len());
        let tip_m = Dome::matl_2021().radius_at_m(p);
        let mut found = Vec::new();
        for (panel, (_, probe_m)) in drawn.iter_mut().zip(probes) {
            let (stage, force) = pressed(p, probe_m, &mut rng);
            let e = effective(&stage, &force, &Pair { tip_m, probe_m })?;
            panel.line(stage.iter().zip(&force).map(|(d, f)| [1e3 * (d - e.contact_m), *f]), &colour);
            panel.name(format!("{:.1} kPa", 1e-3 * p), &colour);
            found.push(e);
        }
        let (low, high) = found[0].interval_pa;
        println!(
            "{:>9.2} {:>9.2} {:>9.2} {:>9.2} {:>8} {:>11.2} {:>9.2}",
            1e-3 * p,
            1e-3 * found[0].modulus_pa,
            1e-3 * low,
            1e-3 * high,
            found[0].misfit,
            1e-3 * found[1].modulus_pa,
            // Equation 5.2 of [Matl 2021] has 1 - nu where Hertz's law has 1 - nu^2.
            1e-3 * found[0].modulus_pa / (1.0 + POISSON_RATIO)
        );
        moduli.line([low, high].map(|e| [1e-3 * p, 1e-3 * e]), "steelblue");
        moduli.dots([[1e-3 * p, 1e-3 * found[0].modulus_pa]], "steelblue");
        moduli.dots([[1e-3 * p, 1e-3 * found[1].modulus_pa]], "crimson");
        states.push(State { pressure_pa: p, modulus_pa: found[0].modulus_pa, tip_m });
    }
    moduli.name("ball", "steelblue").name("plate", "crimson");
    panels.extend(drawn);
    panels.push(moduli);
    Ok(Stiffness::fit(&states)?)
}

/// A curve of 8 mm with the load cell's noise; contact a millimetre in.
fn pressed(pressure_pa: f64, probe_m: f64, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
    let dome = Dome::matl_2021();
    let mut noise = || -> f64 { NOISE_N * Distribution::<f64>::sample(&StandardNormal, rng) };
    let force = |d: f64| dome.force_n(pressure_pa, probe_m, d - 1e-3);
    (0..80).map(|k| 0.1e-3 * f64::from(k)).map(|d| (d, force(d) + noise())).unzip()
}

/// Figure 5.6: the valve's duty goes up and down; the force on a probe that just touches without pressure. Then 222 cycles at 1 Hz.
pub(crate) fn cycles() -> Panel {
    let dome = Dome::matl_2021();
    // The valve's largest opening in both programmes, by which the pressure gets to about 6 kPa.
    let (slow, fast) = (0.29, 0.48);
    let force = |air: &Air| dome.force_n(air.pressure_pa, PROBE_M, dome.growth_m_pa * air.pressure_pa);
    let mut panel = Panel::new("5.6: force (mN) and pressure (kPa / 0.1)", "time (s)", "");
    let (mut air, mut pressure, mut felt) = (Air::matl_2021(), Vec::new(), Vec::new());
    for k in 0..525 {
        let t = f64::from(k) / 10.0;
        air.command = slow * triangle(t / 17.5);
        air.pass(0.1);
        pressure.push([t, 1e-2 * air.pressure_pa]);
        felt.push([t, 1e3 * force(&air)]);
    }
    panel.line(pressure, "grey").name("pressure", "grey").line(felt, "steelblue").name("force", "steelblue");
    let (mut air, mut peaks) = (Air::matl_2021(), Vec::new());
    for _ in 0..222 {
        let mut peak = 0f64;
        for k in 0..100 {
            air.command = fast * triangle(f64::from(k) / 100.0);
            air.pass(0.01);
            peak = peak.max(force(&air));
        }
        peaks.push(peak);
    }
    let steady = &peaks[10..];
    let mean = steady.iter().sum::<f64>() / steady.len() as f64;
    let spread = (steady.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / steady.len() as f64).sqrt();
    println!(
        "\n222 cycles at 1 Hz (section 5.4): peaks of {:.3} +- {:.1e} N ([Matl 2021]: 1.17 +- 1.66e-4 N)",
        mean, spread
    );
    panel
}

/// Up and down between 0 and 1 with the period 1.
fn triangle(phase: f64) -> f64 {
    1.0 - (2.0 * phase.fract() - 1.0).abs()
}

/// Figure 5.7: the smallest indentation that the camera shows, and the force that it takes.
pub(crate) fn smallest(stiffness: &Stiffness) -> Outcome<Panel> {
    println!(
        "\nSmallest force that shows (figure 5.7), by the camera's noise and by the 0.6 mm of [Matl 2021]"
    );
    println!(
        "{:>9} {:>10} {:>8} {:>16} {:>14}",
        "p (kPa)", "gain", "markers", "delta_min (um)", "F_min (mN)"
    );
    let mut panel = Panel::new("5.7: smallest force (mN)", "pressure (kPa)", "");
    let (mut seen, mut printed) = (Vec::new(), Vec::new());
    for p in PRESSURES_PA {
        let (sigma_px, gain_px_m, markers) = sight(p)?;
        let least_m = smallest_indentation_m(sigma_px, gain_px_m, markers)?;
        let force = |depth_m: f64| stiffness.smallest_force_n(p, depth_m, PROBE_M).map(|f| 1e3 * f.value);
        let (ours, in_matl) = (force(least_m)?, force(0.6e-3)?);
        println!(
            "{:>9.2} {:>7.1}/mm {:>8} {:>16.1} {:>7.3} {:>6.1}",
            1e-3 * p,
            1e-3 * gain_px_m,
            markers,
            1e6 * least_m,
            ours,
            in_matl
        );
        seen.push([1e-3 * p, 100.0 * ours]);
        printed.push([1e-3 * p, in_matl]);
    }
    panel
        .line(seen.clone(), "steelblue")
        .dots(seen, "steelblue")
        .name("camera's noise, times 100", "steelblue");
    panel
        .line(printed.clone(), "crimson")
        .dots(printed, "crimson")
        .name("0.6 mm, as in [Matl 2021]", "crimson");
    Ok(panel)
}

/// Noise of a marker (px), its movement for a metre of indentation (px/m, root mean square), and the number of markers.
fn sight(pressure_pa: f64) -> Outcome<(f64, f64, usize)> {
    let mut bench = Bench::matl_2021(7);
    bench.holds_box = false;
    (bench.air.leak, bench.air.pressure_pa) = (0.0, pressure_pa);
    bench.touch = Touch::none();
    let mut tracker = Tracker::new(&bench.picture()?.value, TrackerSettings::default())?;
    let square = |tracker: &Tracker| {
        let seen: Vec<f64> = tracker
            .tracks()
            .iter()
            .filter(|t| t.seen())
            .map(|t| t.by_px().map(|v| v * v).iter().sum())
            .collect();
        (seen.iter().sum::<f64>() / seen.len().max(1) as f64, seen.len())
    };
    // Both axes, and the first picture's own noise.
    let mut still = 0.0;
    for _ in 0..10 {
        tracker.next(&bench.picture()?.value)?;
        still += square(&tracker).0 / 40.0;
    }
    bench.touch.indentation_m = 1e-3;
    tracker.next(&bench.picture()?.value)?;
    let (moved, markers) = square(&tracker);
    Ok((still.sqrt(), (moved - 4.0 * still).max(0.0).sqrt() / 1e-3, markers))
}
