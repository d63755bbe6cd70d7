//! A simulator in another language beside a recording with hidden friction: Python's standard library, and MuJoCo where it
//! is installed.

use std::path::Path;
use std::process::Command;

use missing_physics::engine::Options;
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
        let arguments = DiagnoseArguments {
            folder: folder.into(),
            json: None,
            html: None,
            svg: None,
            model: None,
            options: Options::default(),
            threads: 0,
            memory: None,
            say: None,
            verbose: false,
        };
        println!("== {title}\n{}", diagnose(&arguments, &Silent)?.text);
        Ok(())
    };
    println!("Hidden: dry friction, 0.04 rad/s^2.\n");
    if python("json") {
        ask("pendulum.py, Python's standard library", &swing)?;
    } else {
        println!("== pendulum.py: python3 is not installed, not tried\n");
    }
    if examples::small() || !python("mujoco") {
        println!("== MuJoCo: not installed, or --small: not tried");
        return Ok(());
    }
    let folder = tempfile::tempdir()?;
    for file in ["recording.toml", "data.csv"] {
        std::fs::copy(swing.join(file), folder.path().join(file))?;
    }
    std::fs::copy(root.join("docs/mujoco/pendulum.py"), folder.path().join("pendulum.py"))?;
    ask("docs/mujoco/pendulum.py, MuJoCo", folder.path())
}
