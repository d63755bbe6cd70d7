//! A simulator in another language beside a recording with hidden friction: Python's standard library, and MuJoCo where it
//! is installed (`--small`: one of them).

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use missing_physics::observer::Silent;
use missing_physics_cli::commands::{DiagnoseArguments, diagnose};

/// Whether Python is there, with a module.
fn python(module: &str) -> bool {
    let import = format!("import {module}");
    Command::new("python3").args(["-c", &import]).output().is_ok_and(|o| o.status.success())
}

#[allow(clippy::print_stdout, reason = "an example prints")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let swing = root.join("recordings/swing");
    let ask = |title: &str, folder: &Path| -> Result<(), Box<dyn std::error::Error>> {
        let arguments = DiagnoseArguments { folder: folder.into(), ..DiagnoseArguments::default() };
        let begun = Instant::now();
        let text = diagnose(&arguments, &Silent)?.text;
        println!("== {title}: {:.0} s\n{text}", begun.elapsed().as_secs_f64());
        Ok(())
    };
    println!("Hidden: dry friction, 0.04 rad/s^2.\n");
    if !python("json") {
        println!("python3 is not installed: nothing was tried");
        return Ok(());
    }
    ask("pendulum.py, Python's standard library", &swing)?;
    // Another program, and perhaps another header, beside the same table.
    let beside = |title: &str, header: &Path, program: &Path| -> Result<(), Box<dyn std::error::Error>> {
        let folder = tempfile::tempdir()?;
        std::fs::copy(header, folder.path().join("recording.toml"))?;
        std::fs::copy(swing.join("data.csv"), folder.path().join("data.csv"))?;
        std::fs::copy(program, folder.path().join("pendulum.py"))?;
        ask(title, folder.path())
    };
    if examples::small() {
        println!("== --small: no other program is tried");
        return Ok(());
    }
    let [stated, forces] = ["recordings/swing", "docs/forces"].map(|f| root.join(f).join("recording.toml"));
    let title = "docs/forces/pendulum.py, which knows of no friction and lets forces act on its joint";
    beside(title, &forces, &root.join("docs/forces/pendulum.py"))?;
    if !python("mujoco") {
        println!("== MuJoCo: not installed: not tried");
        return Ok(());
    }
    beside("docs/mujoco/pendulum.py, MuJoCo", &stated, &root.join("docs/mujoco/pendulum.py"))?;
    beside(
        "docs/mujoco/forces.py, MuJoCo, which knows of no friction",
        &forces,
        &root.join("docs/mujoco/forces.py"),
    )
}
