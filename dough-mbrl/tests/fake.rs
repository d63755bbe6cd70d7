//! The fake is physics that does not know what is tested: volume, stiffness, goals.

use dough_mbrl::dynamics::Roll;
use dough_mbrl::fake::{DoughKind, Effects, FakeRig};
use dough_mbrl::goal::Goal;
use dough_mbrl::policy::{Explore, Heuristic, Policy};
use dough_mbrl::rollout::{End, Setup};
use dough_mbrl::stiffness::{BandForce, Palpation, Press};
use hw_traits::clock::Clock;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn band() -> BandForce {
    let mut rig = FakeRig::new(DoughKind::A, Effects::default(), 1).with_rigid_probe(0.03);
    let setup = Setup::of(rig.camera_in_world());
    let mut presses = Vec::new();
    for throw_mm in (40..=120).step_by(10) {
        for depth_mm in (2..=30).step_by(4) {
            let (throw_m, depth_m) = (1e-3 * f64::from(throw_mm), 1e-3 * f64::from(depth_mm));
            setup.handling.stretch(&mut rig, throw_m).unwrap();
            setup.handling.go(&mut rig, [0.4, 0.0, 0.03 - depth_m], 0.1).unwrap();
            presses.push(Press { throw_m, depth_m, force_n: rig.probe_force_n() });
            setup.handling.go(&mut rig, [0.4, 0.0, 0.1], 0.3).unwrap();
        }
    }
    BandForce::fit(&presses).unwrap()
}

#[test]
fn stiffness_is_that_of_table_7_1() {
    let band = band();
    println!("band sigma {}", band.sigma_n);
    for (water_g, table) in [(1.0, 1.23), (2.0, 0.97), (3.0, 0.85), (4.0, 0.67), (5.0, 0.49)] {
        let felt: Vec<f64> = (0..6)
            .map(|seed| {
                let mut rig = FakeRig::new(DoughKind { water_g, ..DoughKind::A }, Effects::default(), seed);
                let setup = Setup::of(rig.camera_in_world());
                let felt = Palpation::default().run(&mut rig, &setup, &band).unwrap();
                1e-3 * felt.stiffness_n_m
            })
            .collect();
        let mean = felt.iter().sum::<f64>() / felt.len() as f64;
        println!("{water_g} g: {mean:.3} N/mm of {table}: {felt:.2?}");
    }
}

#[test]
fn rollouts() {
    for inches in [2.0, 4.0, 6.0, 8.0, 10.0] {
        for name in ["random", "heuristic"] {
            let mut line = String::new();
            for seed in 0..4 {
                let begin = std::time::Instant::now();
                let mut rig = FakeRig::new(DoughKind::A, Effects::default(), seed);
                let setup = Setup::of(rig.camera_in_world());
                let goal = Goal::cylinder(0.0254 * inches, rig.volume_m3()).unwrap();
                let mut rng = ChaCha8Rng::seed_from_u64(seed);
                let mut policy: Box<dyn Policy> = if name == "random" { Box::new(Explore) } else { Box::new(Heuristic::default()) };
                let done = setup.run(&mut rig, &mut *policy, &goal, 4e-5, &mut rng);
                match done {
                    Ok(d) => {
                        line += &format!("{:?} {} ({:.2} s); ", d.end, d.rolls.len(), begin.elapsed().as_secs_f64());
                        if seed == 0 && inches == 6.0 {
                            for r in &d.rolls { println!("{:.1?} {:.1?} -> {:.1?}", r.roll.state.map(|v| 1e3*v), r.roll.action.map(|v| 1e3*v), r.roll.next.map(|v| 1e3*v)); }
                            println!("truth {:.1?} at {:.0} s", rig.truth().map(|v| 1e3*v), rig.now_s().unwrap());
                        }
                    }
                    Err(e) => line += &format!("{e}; "),
                }
            }
            println!("{inches} in {name}: {line}");
        }
    }
    let _ = (End::Reached, None::<Roll>);
}
