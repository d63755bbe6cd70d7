//! Chapter 6 on a simulated hand: diameters of faces, forces with a radius left out, fillings of balloons by palpation.
//!
//! `cargo run --release -p examples --example 09_stretch` (`--small`: fewer states); draws `stretch.svg` into the temporary folder
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::error::Error;
use std::fmt::Write;

use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::gripper::Gripper;
use rayon::prelude::*;
use stretch::cloud::{Cloud, CloudSettings, Rest, Window};
use stretch::contact::{Ball, Diameters, cap, diameters};
use stretch::fake::{Filling, Membrane, Rig, Shape, Sheet};
use stretch::modulus::{Press, Surface};
use stretch::palpate::{Palpation, Programme, palpate};
use stretch::segment::{SegmentSettings, Segmenter};

fn main() -> Result<(), Box<dyn Error>> {
    geometry()?;
    let surface = forces()?;
    let felt = balloons(&surface)?;
    let path = std::env::temp_dir().join("stretch.svg");
    std::fs::write(&path, picture(&felt)?)?;
    println!("\nforce over depth of each palpation drawn: {}", path.display());
    Ok(())
}

fn at(z: f64) -> Pose {
    Pose { position_m: [0.0, 0.0, z], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] }
}

/// What the camera sees of a rigid object, and what of it touches.
fn seen(shape: Shape, stretch_m: f64, depth_m: f64, seed: u64) -> Result<(Cloud, Segmenter), Box<dyn Error>> {
    let mut rig = Rig::new(shape, Filling::Rigid, seed);
    rig.open_to(0.1 + stretch_m, 0.1)?;
    let free = rig.depth_m()?.value;
    let level = Rest::level(rig.eye.distance_m)?;
    let window = Window::of_membrane((640, 480), &rig.intrinsics(), &level, (0.1 + stretch_m, 0.09), 4e-3)?;
    let rest = Rest::fit(&free, &rig.intrinsics(), &window)?;
    rig.move_to(at(-depth_m), 1.0)?;
    let picture = rig.depth_m()?.value;
    let mut cloud = Cloud::default();
    cloud.fill(&picture, &rig.intrinsics(), &rest, window, &CloudSettings::default())?;
    let mut segmenter = Segmenter::default();
    segmenter.segment(&cloud, &SegmentSettings::default());
    Ok((cloud, segmenter))
}

/// A standing cylinder's diameters.
fn face(radius_m: f64, stretch_m: f64, depth_m: f64) -> Result<Diameters, Box<dyn Error>> {
    let (cloud, segmenter) = seen(Shape::Cylinder { radius_m }, stretch_m, depth_m, 64)?;
    Ok(diameters(&cloud, &segmenter.states)?)
}

/// A ball.
fn sphere(radius_m: f64, stretch_m: f64, depth_m: f64) -> Result<Ball, Box<dyn Error>> {
    let (cloud, segmenter) = seen(Shape::Ball { radius_m }, stretch_m, depth_m, 64)?;
    Ok(cap(&cloud, &segmenter.states)?)
}

/// Figure 6.4: errors of a 20 mm cylinder's diameters, and of a 30 mm ball's.
fn geometry() -> Result<(), Box<dyn Error>> {
    let (depths, stretches): (Vec<f64>, Vec<f64>) = if examples::small() {
        (vec![0.006, 0.012], vec![0.0, 0.06])
    } else {
        (vec![0.002, 0.004, 0.006, 0.009, 0.012, 0.015], vec![0.0, 0.02, 0.04, 0.06])
    };
    let table = |title: &str, cell: &(dyn Fn(f64, f64) -> String + Sync)| {
        println!("{title}; rows: stretch (mm), columns: depth (mm)");
        let head: String = depths.iter().map(|d| format!("{:>17.0}", 1e3 * d)).collect();
        println!("{:>4}{head}", "");
        for x in &stretches {
            let cells: Vec<String> = depths.par_iter().map(|d| format!("{:>17}", cell(*x, *d))).collect();
            println!("{:>4.0}{}", 1e3 * x, cells.concat());
        }
    };
    table("Errors of a 20 mm face's diameters along i / j (mm)", &|x, d| match face(0.01, x, d) {
        Ok(f) => format!("{:+.2} / {:+.2}", 1e3 * (f.i_m.0 - 0.02), 1e3 * (f.j_m.0 - 0.02)),
        Err(_) => "no edge".to_owned(),
    });
    table("\nErrors of a 30 mm ball's diameter (mm), and their 95 % half width", &|x, d| match sphere(
        0.015, x, d,
    ) {
        Ok(b) => format!("{:+.2} +- {:.2}", 2e3 * (b.radius_m - 0.015), 3.92e3 * b.radius_sigma_m),
        Err(_) => "flat".to_owned(),
    });
    Ok(())
}

/// Figures 6.3 and 6.5: presses of rigid balls, and forces with each inner radius left out.
fn forces() -> Result<Surface, Box<dyn Error>> {
    let radii = [0.008, 0.011, 0.014, 0.018, 0.024];
    let stretches: Vec<f64> = if examples::small() {
        vec![0.0, 0.03, 0.06]
    } else {
        (0..=6).map(|k| 0.01 * f64::from(k)).collect()
    };
    let states: Vec<(f64, f64, f64)> = radii
        .iter()
        .flat_map(|r| stretches.iter().flat_map(move |x| [0.004, 0.007, 0.010, 0.013].map(|d| (*r, *x, d))))
        .collect();
    let presses: Vec<Press> = states
        .into_par_iter()
        .map(|(radius_m, stretch_m, indentation_m)| {
            let mut membrane = Membrane::new(Sheet::thesis(), stretch_m);
            membrane.press(&Shape::Ball { radius_m }, [0.0; 2], indentation_m);
            Press { stretch_m, radius_m, indentation_m, force_n: membrane.force_n }
        })
        .collect();
    let surface = Surface::fit(&presses)?;
    println!("\nEffective modulus (kPa); rows: stretch (mm), columns: diameter (mm) (figure 6.3 e)");
    println!("{:>4}{}", "", radii.iter().map(|r| format!("{:>9.0}", 2e3 * r)).collect::<String>());
    for x in &stretches {
        let cells: Result<String, _> =
            radii.iter().map(|r| surface.modulus_pa(*r, *x).map(|e| format!("{:>9.2}", 1e-3 * e))).collect();
        println!("{:>4.0}{}", 1e3 * x, cells?);
    }
    let (mean, spread) = surface.left_out_error_n();
    let range = presses.iter().map(|p| p.force_n).fold(0.0, f64::max);
    println!(
        "left out: {mean:.3} +- {spread:.3} N of {range:.2} N (the thesis, on its own hand: 0.023 +- 0.011 N)"
    );
    Ok(surface)
}

/// Figure 6.7: four fillings, each palpated three times.
fn balloons(surface: &Surface) -> Result<Vec<(&'static str, Palpation)>, Box<dyn Error>> {
    let fillings = [("air", 80.0), ("water", 150.0), ("pudding", 260.0), ("seeds", 450.0)];
    let times: u64 = if examples::small() { 1 } else { 3 };
    println!("\nStiffness by palpation (figure 6.7)");
    println!(
        "{:>8} {:>12} {:>12} {:>21} {:>6}",
        "filling", "true (N/m)", "felt (N/m)", "95 % interval", "steps"
    );
    let trials: Vec<(&'static str, f64, u64)> =
        fillings.iter().flat_map(|(name, k)| (0..times).map(|s| (*name, *k, s))).collect();
    let felt: Vec<(&'static str, f64, Palpation)> = trials
        .into_par_iter()
        .map(|(name, stiffness, seed)| {
            let mut rig = Rig::new(Shape::Ball { radius_m: 0.02 }, Filling::Springy(stiffness), 100 + seed);
            let stretches_m = vec![0.0, 0.02, 0.04, 0.06];
            let programme = Programme { stretches_m, pictures: 2, ..Programme::thesis(at(0.03), 0.0) };
            palpate(&mut rig, &programme, surface).map(|p| (name, stiffness, p)).map_err(|e| e.to_string())
        })
        .collect::<Result<_, String>>()?;
    for (name, stiffness, p) in &felt {
        let value = p.stiffness_n_m.map_or("not yielded".to_owned(), |k| format!("{k:.0}"));
        let (low, high) = p.interval_n_m;
        println!("{name:>8} {stiffness:>12.0} {value:>12} {low:>10.0} to {high:>6.0} {:>7}", p.steps.len());
    }
    Ok(felt.into_iter().map(|(name, _, p)| (name, p)).collect())
}

fn picture(felt: &[(&'static str, Palpation)]) -> Result<String, std::fmt::Error> {
    let mut svg = String::from(
        "<svg xmlns='http://www.w3.org/2000/svg' width='520' height='380' font-family='sans-serif' font-size='12'>\
         <rect width='520' height='380' fill='white'/><text x='40' y='20'>force (N) over depth (mm) until the top has sunk</text>\
         <path d='M50,340 h440 M50,340 v-300' stroke='black'/>",
    );
    for k in 0..=3 {
        write!(
            svg,
            "<text x='{}' y='356'>{}</text><text x='22' y='{}'>{:.1}</text>",
            50 + 140 * k,
            5 * k,
            344 - 100 * k,
            0.4 * f64::from(k)
        )?;
    }
    let names = ["air", "water", "pudding", "seeds"];
    for (name, p) in felt {
        let hue = 90 * names.iter().position(|n| n == name).unwrap_or(0);
        let points: String = p
            .steps
            .iter()
            .map(|s| format!("{:.1},{:.1} ", 50.0 + 28e3 * s.indentation_m, 340.0 - 250.0 * s.load.force_n))
            .collect();
        write!(svg, "<polyline points='{points}' fill='none' stroke='hsl({hue},70%,40%)'/>")?;
    }
    for (k, name) in names.iter().enumerate() {
        write!(svg, "<text x='60' y='{}' fill='hsl({},70%,40%)'>{name}</text>", 50 + 16 * k, 90 * k)?;
    }
    svg.push_str("</svg>");
    Ok(svg)
}
