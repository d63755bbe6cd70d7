//! Where the liquid lies, the volume of a sweep, a viscosity, a pour; the error against a slow reference is printed beside.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(clippy::print_stdout, reason = "quality stands beside time")]

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::hint::black_box;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use liquid_haptics::container::mesh::MeshContainer;
use liquid_haptics::container::{Container, Cylinder, up_at_tilt};
use liquid_haptics::fake::{Cavity, Round};
use liquid_haptics::pour::{Bead, Mouth, Pour};
use liquid_haptics::slosh::UprightCylinder;
use liquid_haptics::viscosity::{Bottle, Drain, Verdict, ViscosityFit};
use liquid_haptics::volume::{ErrorCorrelation, Liquid, SettledPose, VolumeFit};
use liquid_haptics::wrench::{Departures, Grasp};
use nalgebra::Point3;

const GRAVITY: f64 = 9.80665;

/// Prints the shortest of 200 rounds: on a machine that others use as well the mean counts them too.
fn fastest<T>(name: &str, calls: u32, mut call: impl FnMut() -> T) {
    let round = |_| {
        let begin = Instant::now();
        for _ in 0..calls {
            black_box(call());
        }
        begin.elapsed().as_secs_f64() / f64::from(calls)
    };
    let least = (0..200).map(round).fold(f64::INFINITY, f64::min);
    println!("{name}: fastest {:.3} us", 1e6 * least);
}

fn bottle() -> Result<Cylinder, Box<dyn Error>> {
    Ok(Cylinder::new(0.035, 0.172, 0.001)?)
}

fn cylinder(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let bottle = bottle()?;
    let columns = Round::new(0.034, 0.170, 0.001, 20_000);
    let mut group = c.benchmark_group("cylinder_center");
    for (name, tilt, share) in
        [("wedge", 1.2, 0.1), ("upright", 0.3, 0.5), ("both_ends", 1.5, 0.5), ("over", 2.3, 0.7)]
    {
        let (up, volume) = (up_at_tilt(tilt), share * bottle.capacity_m3());
        let center = bottle.fill(&up, volume)?.center_of_mass;
        let [x, z] = columns.center(tilt, volume);
        println!("cylinder_center/{name}: {:.1e} m off 20,000 columns", (center.x - x).hypot(center.z - z));
        let fill = || bottle.fill(black_box(&up), black_box(volume));
        fastest(&format!("cylinder_center/{name}"), 1000, fill);
        group.bench_function(name, |b| b.iter(fill));
    }
    group.finish();
    Ok(())
}

/// A cylinder of so many triangles, as many rings as make them even.
fn drum(triangles: usize) -> Result<MeshContainer, Box<dyn Error>> {
    let n = ((triangles as f64 / 4.0).sqrt().round() as u32).max(8) * 2;
    let rings = (triangles as u32 / (2 * n)).max(2);
    let mut vertices = vec![Point3::new(0.0, 0.0, 0.0), Point3::new(0.0, 0.0, 0.17)];
    for ring in 0..rings {
        for k in 0..n {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
            let z = 0.17 * f64::from(ring) / f64::from(rings - 1);
            vertices.push(Point3::new(0.034 * cos, 0.034 * sin, z));
        }
    }
    let at = |ring: u32, k: u32| 2 + ring * n + k % n;
    let mut faces = Vec::new();
    for k in 0..n {
        faces.push([0, at(0, k + 1), at(0, k)]);
        faces.push([1, at(rings - 1, k), at(rings - 1, k + 1)]);
        for ring in 0..rings - 1 {
            faces.push([at(ring, k), at(ring, k + 1), at(ring + 1, k + 1)]);
            faces.push([at(ring, k), at(ring + 1, k + 1), at(ring + 1, k)]);
        }
    }
    Ok(MeshContainer::new(vertices, faces)?)
}

fn mesh(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let round = Cylinder::new(0.034, 0.17, 0.0)?;
    let up = up_at_tilt(0.7);
    let mut group = c.benchmark_group("mesh");
    for triangles in [1_000_usize, 10_000, 100_000] {
        let drum = drum(triangles)?;
        let (plan, volume) = (drum.plan(&up), 0.4 * drum.capacity_m3());
        let off =
            plan.fill(volume)?.center_of_mass - round.fill(&up, 0.4 * round.capacity_m3())?.center_of_mass;
        println!(
            "mesh/{triangles}: {} triangles, centre {:.1e} m off the cylinder's",
            drum.triangles().len(),
            off.norm()
        );
        fastest(&format!("mesh/plan/{triangles}"), 1, || drum.plan(black_box(&up)));
        fastest(&format!("mesh/query/{triangles}"), 1000, || plan.fill(black_box(volume)));
        group.bench_with_input(BenchmarkId::new("plan", triangles), &up, |b, up| b.iter(|| drum.plan(up)));
        group.bench_with_input(BenchmarkId::new("query", triangles), &volume, |b, v| {
            b.iter(|| plan.fill(black_box(*v)));
        });
    }
    group.finish();
    Ok(())
}

fn volume(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let bottle = bottle()?;
    let grasp = Grasp {
        container_mass_kg: 0.085,
        gripper_mass_kg: 0.9,
        grasp_height_m: 0.129,
        shell_center_m: 0.086,
        gravity_m_s2: GRAVITY,
    };
    let (truth, none) = (300e-6, Departures::default());
    let mut poses = Vec::new();
    for k in 0..19 {
        let tilt_rad = f64::from(10 * k).to_radians();
        let mut wrench = grasp.wrench(&bottle, tilt_rad, 0.3, truth, &none)?;
        wrench.tau_z_nm += 2e-4 * f64::from((k * 7) % 5 - 2);
        poses.push(SettledPose { tilt_rad, wrench });
    }
    let liquid = Liquid::Mass { mass_kg: 0.3, error_kg: 2e-4 };
    let fit = VolumeFit {
        container: &bottle,
        grasp,
        departures: none,
        liquid,
        sigma_nm: None,
        error_correlation: ErrorCorrelation::NONE,
        widest_share: 0.5,
    };
    let estimate = fit.estimate(&poses)?;
    println!(
        "volume/19 poses: {:+.2} mL, interval {:.2} mL wide",
        1e6 * (estimate.volume_m3 - truth),
        1e6 * (estimate.interval_m3[1] - estimate.interval_m3[0])
    );
    fastest("volume/19", 1, || fit.estimate(black_box(&poses)));
    c.bench_function("volume/19", |b| b.iter(|| fit.estimate(black_box(&poses))));
    Ok(())
}

fn viscosity(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let bottle = Bottle::new(&bottle()?, 300e-6, 0.3, GRAVITY)?;
    let fit = ViscosityFit { bottle, mass_error_share: 0.0, head_start_s: 0.0, widest_factor: 4.0 };
    let times: Vec<f64> = (0..1000).map(|i| 0.01 * f64::from(i)).collect();
    // A saw that is nobody's model stands for the noise: half a millinewton metre.
    let noise = |i: usize| 5e-4 * (((i * 7919) % 1009) as f64 / 504.5 - 1.0);
    let mode = UprightCylinder::new(bottle.radius_m, bottle.level_m(), GRAVITY)?;
    let (omega, gamma) = (mode.angular_frequency_rad_s(0, 0.0), mode.damping_ratio(1e-5));
    let slosh: Vec<f64> = times
        .iter()
        .enumerate()
        .map(|(i, t)| {
            0.01 * (-gamma * omega * t).exp() * (omega * t * (1.0 - gamma * gamma).sqrt()).cos() + noise(i)
        })
        .collect();
    let film = Drain::new(&bottle);
    let weight = bottle.density_kg_m3() * GRAVITY;
    let drain: Vec<f64> =
        times.iter().enumerate().map(|(i, t)| -weight * film.moment_m4(5e-3, *t) + noise(i)).collect();
    let mut group = c.benchmark_group("viscosity");
    for (name, truth, torque) in [("slosh", 1e-5, &slosh), ("drain", 5e-3, &drain)] {
        if let Verdict::Viscosity(e) = fit.estimate(&times, torque)? {
            println!("viscosity/{name}: {:+.1} %", 100.0 * (e.kinematic_m2_s / truth - 1.0));
        }
        fastest(&format!("viscosity/{name}"), 1, || fit.estimate(&times, black_box(torque)));
        group.bench_function(BenchmarkId::new(name, times.len()), |b| {
            b.iter(|| fit.estimate(&times, black_box(torque)))
        });
    }
    group.finish();
    Ok(())
}

fn pour(c: &mut Criterion) -> Result<(), Box<dyn Error>> {
    let bottle = bottle()?;
    let (lip, rim, bead) = (0.027, 0.171, 0.0048);
    let pour = Pour::new(&bottle, Mouth::new(lip, rim)?, Bead::measured(bead, bead)?, PI)?;
    let tilt = pour.tilt_rad(400e-6, 100e-6)?;
    let stays =
        Round::new(0.034, 0.170, 0.001, 20_000).below(tilt, rim * tilt.cos() - lip * tilt.sin() + bead)[0];
    println!("pour/cylinder: {:+.1e} mL of 100 mL", 1e6 * (300e-6 - stays));
    fastest("pour/cylinder", 100, || pour.tilt_rad(black_box(400e-6), 100e-6));
    c.bench_function("pour/cylinder", |b| b.iter(|| pour.tilt_rad(black_box(400e-6), 100e-6)));
    Ok(())
}

fn liquid(c: &mut Criterion) {
    for (name, bench) in [
        ("cylinder", cylinder as fn(&mut Criterion) -> Result<(), Box<dyn Error>>),
        ("mesh", mesh),
        ("volume", volume),
        ("viscosity", viscosity),
        ("pour", pour),
    ] {
        if let Err(error) = bench(c) {
            println!("{name}: {error}");
        }
    }
}

criterion_group!(benches, liquid);
criterion_main!(benches);
