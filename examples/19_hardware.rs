//! [Matl 2021], chapter 2, on devices: a bottle is weighed at many tilts, 50 mL are poured, it is weighed again; what is wrong is found in the
//! recording of it. One programme, on whatever rig is there.
//!
//! `cargo run --release -p examples --example 19_hardware` starts emulators of an ATI Net F/T sensor and a Universal Robots arm on 127.0.0.1 (a minute; `--small`: fewer poses). `--fake` takes a simulated rig, `--replay FOLDER` the tape of an earlier run, and
//! `--device ati=192.0.2.1,ur=192.0.2.2` devices (`--send-program`: the robot's controller is given `ur::SCRIPT`; it is started on its panel
//! otherwise). `--emulate` starts the emulators alone, says their addresses, and ends with its input. `--out FOLDER` says where tape and recording go, `--seed N` draws another bottle.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

use std::fs::File;
use std::io::{BufReader, BufWriter, Write as _};
use std::path::PathBuf;

use examples::rig::{
    Addresses, Devices, Diagnosed, Loopback, Outcome, Plan, Story, Truth, World, recording, story,
};
use hw_traits::clock::Clock;
use hw_traits::force_torque::ForceTorque;
use hw_traits::rotary::Rotary;
use hw_traits::tape::{Event, Playback, Recorder, TapeError, read_tape, write_event};

/// The tape's name in a folder.
const TAPE: &str = "tape.cbor";
/// By how much a command may differ from the one on the tape, rad and rad/s.
const SAME: f64 = 1e-9;

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let given = |name: &str| words.iter().any(|w| w == name);
    let value = |name: &str| words.iter().position(|w| w == name).and_then(|k| words.get(k + 1));
    let seed = value("--seed").map_or(Ok(1), |s| s.parse())?;
    let plan = Plan::new(given("--small"));
    let kept = tempfile::tempdir()?;
    let out = value("--out").map_or_else(|| kept.path().to_owned(), PathBuf::from);
    std::fs::create_dir_all(&out)?;
    if let Some(folder) = value("--replay") {
        let tape = read_tape(BufReader::new(File::open(PathBuf::from(folder).join(TAPE))?))?;
        println!(
            "rig: {} events of {folder}{}",
            tape.events.len(),
            if tape.cut { ", whose end is cut" } else { "" }
        );
        let outcome = story(&mut Playback::new(tape.events, SAME), &plan)?;
        return say(&outcome, &recording(&outcome, &out)?, None);
    }
    if given("--fake") {
        println!("rig: a simulated one, in simulated time");
        let mut world = World::new(seed).map_err(|e| e.to_string())?;
        let outcome = taped(&mut world, &plan, &out)?;
        return say(&outcome, &recording(&outcome, &out)?, Some(world.truth()));
    }
    if let Some(words) = value("--device") {
        println!("rig: {words}");
        let mut devices = Devices::connect(&Addresses::parse(words)?, given("--send-program"))?;
        let outcome = taped(&mut devices, &plan, &out)?;
        println!(
            "{} records of the sensor came while the programme waited and were not kept",
            devices.lost()
        );
        return say(&outcome, &recording(&outcome, &out)?, None);
    }
    if given("--emulate") {
        let loopback = Loopback::start(seed)?;
        println!("--device {}", loopback.addresses());
        std::io::copy(&mut std::io::stdin(), &mut std::io::sink())?;
        println!("{}", words_of(&loopback.truth()));
        return Ok(());
    }
    println!("rig: an ATI Net F/T by RDT and a Universal Robots arm by RTDE, emulated on 127.0.0.1");
    let loopback = Loopback::start(seed)?;
    let mut devices = Devices::connect(&loopback.addresses(), false)?;
    let outcome = taped(&mut devices, &plan, &out)?;
    say(&outcome, &recording(&outcome, &out)?, Some(loopback.truth()))
}

/// Runs with a tape that keeps all that passes.
fn taped<R: Rotary + ForceTorque + Clock>(rig: &mut R, plan: &Plan, out: &std::path::Path) -> Outcome<Story> {
    let mut file = BufWriter::new(File::create(out.join(TAPE))?);
    let mut failed: Option<TapeError> = None;
    let outcome = story(
        &mut Recorder::new(rig, |event: Event| {
            failed = write_event(&event, &mut file).err().or(failed.take())
        }),
        plan,
    );
    file.flush()?;
    failed.map_or(Ok(()), Err)?;
    outcome
}

fn say(outcome: &Story, found: &Diagnosed, truth: Option<Truth>) -> Outcome<()> {
    let [before, after] =
        outcome.volumes_m3.map(|[value, error]| format!("{:.1} +- {:.1} mL", 1e6 * value, 1.96e6 * error));
    println!("in the bottle before: {before}");
    println!("poured at {:.1} degrees", outcome.pour_rad.to_degrees());
    println!("in the bottle after:  {after}");
    let answer = &found.answer;
    println!("diagnosis: {} {:?}, p = {:.4}", answer.verdict.word(), answer.chosen, answer.p_value);
    let slip = found.slip();
    if let Some((by_m, [low, high], pose)) = slip {
        let tilt = outcome.sweeps[1].get(pose).map_or(f64::NAN, |p| p.angle_rad.to_degrees());
        println!(
            "the grip slips by {:.2} mm [{:.2}, {:.2}] at pose {pose} after the pour, {tilt:.1} degrees",
            1e3 * by_m,
            1e3 * low,
            1e3 * high
        );
    }
    let Some(truth) = truth else { return Ok(()) };
    println!("{}", words_of(&truth));
    let (by_m, ..) = slip.ok_or("the grip's slip is not what the diagnosis chose")?;
    if (by_m - truth.slip_m).abs() > 1e-3 {
        return Err("the slip that was found is off by more than a millimetre".into());
    }
    Ok(())
}

fn words_of(truth: &Truth) -> String {
    format!(
        "truth: {:.1} mL, then {:.1} mL; a slip of {:.2} mm at {:.1} degrees",
        1e6 * truth.before_m3,
        1e6 * truth.now_m3,
        1e3 * truth.slip_m,
        truth.slip_tilt_rad.to_degrees()
    )
}
