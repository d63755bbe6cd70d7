//! What is wrong with a machine's equations or rows is said in one line, and nothing is written.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::process::{Command, Output};

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, Normal};

const EQUATION: &str = "-g_per_l*sin(angle_rad) + gain*command_v";

/// A pendulum with a motor: its equation, what its encoder should read, and its rows.
fn diagnosed(equation: &str, output: &str, rows: &[String]) -> (Output, bool) {
    let folder = tempfile::tempdir().unwrap();
    let header = format!(
        "format = 1\ndomain = \"motion\"\ndata = \"data.csv\"\n[model]\n\
         states = {{ angle_rad = \"rate_rad_s\", rate_rad_s = \"{equation}\" }}\n\
         outputs = {{ encoder_rad = \"{output}\" }}\ninputs = {{ command_v = \"hold\" }}\n\
         [[parameter]]\nname = \"g_per_l\"\nunit = \"1/s^2\"\nstart = 20.0\n\
         [[parameter]]\nname = \"gain\"\nunit = \"rad/(V s^2)\"\nstart = 1.0\n\
         [start]\nangle_rad = \"measured\"\nrate_rad_s = 0.0\n"
    );
    let data = format!("run,t_s,encoder_rad,command_v\n{}\n", rows.join("\n"));
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    std::fs::write(folder.path().join("data.csv"), data).unwrap();
    let json = folder.path().join("a.json");
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let arguments = [folder.path().as_os_str(), "--quiet".as_ref(), "--json".as_ref(), json.as_os_str()];
    (Command::new(tool).arg("diagnose").args(arguments).output().unwrap(), json.exists())
}

/// Rows of two runs, sampled every so many seconds.
fn rows(steps_s: [f64; 2]) -> Vec<String> {
    let row = |run: usize, i: usize, t: f64| {
        let noise = ((i * 7919) % 13) as f64 - 6.0;
        format!("{run},{t:.4},{:.5},0.1", 0.3 * (4.47 * t).cos() + 2e-4 * noise)
    };
    let run = |(run, step): (usize, f64)| (0..40).map(move |i| row(run + 1, i, i as f64 * step));
    steps_s.into_iter().enumerate().flat_map(run).collect()
}

/// The rows with one cell of the tenth in other words.
fn with_cell(column: usize, text: &str) -> Vec<String> {
    let mut rows = rows([0.05, 0.05]);
    let mut cells: Vec<&str> = rows[9].split(',').collect();
    cells[column] = text;
    rows[9] = cells.join(",");
    rows
}

#[test]
fn what_is_wrong_with_a_machine_is_said_in_one_line() {
    let sound = rows([0.05, 0.05]);
    for (equation, output, rows, says) in [
        ("-g_per_l*sin(angle_rad", "angle_rad", sound.clone(), vec!["rate_rad_s", "character 23", "missing"]),
        ("-g_per_l*sin(angel_rad)", "angle_rad", sound.clone(), vec!["angel_rad is not known", "angle_rad"]),
        (
            "-g_per_l*angle_rad/rate_rad_s",
            "angle_rad",
            sound.clone(),
            vec!["angle_rad is NaN", "run 2", "rate_rad_s = 0"],
        ),
        ("g_per_l*angle_rad^3 + 90*angle_rad", "angle_rad", sound.clone(), vec!["at t = ", "g_per_l = 20"]),
        (
            EQUATION,
            "rate_rad_s",
            sound.clone(),
            vec!["encoder_rad", "in rad/s", "expected a quantity in rad"],
        ),
        ("angle_rad", "angle_rad", sound, vec!["rate_rad_s", "expected a derivative in rad/s^2"]),
        (EQUATION, "angle_rad", with_cell(3, ""), vec!["row 11", "command_v", "known in every row"]),
        (EQUATION, "angle_rad", with_cell(1, "0.4000"), vec!["row 11", "t_s", "more than 0.4"]),
    ] {
        let (output, written) = diagnosed(equation, output, &rows);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{equation}: {said}");
        assert!(said.trim_end().lines().count() == 1 && !written, "{equation}: {said}");
        assert!(says.iter().all(|part| said.contains(part)), "{equation}: {said}");
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn runs_may_differ_in_their_rates() {
    let (output, written) = diagnosed(EQUATION, "angle_rad", &rows([0.05, 0.02]));
    assert!(output.status.success() && written, "{output:?}");
}

/// Rows of a pendulum that is let go of after so many of them, from 0.8 rad; steps of a hundredth of the time between rows.
fn let_go(run: &str, after: usize, g_per_l: f64) -> String {
    let (mut q, mut w) = (0.8_f64, 0.0);
    let (mut text, noise) = (String::new(), Normal::new(0.0, 1e-3).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(g_per_l.to_bits());
    for i in 0..200 {
        let reading = q + noise.sample(&mut rng);
        text += &format!("{run},{:.3},{reading:.5}\n", 0.02 * f64::from(i as u32));
        for _ in 0..if i < after { 0 } else { 100 } {
            w -= 2e-4 * g_per_l * q.sin();
            q += 2e-4 * w;
        }
    }
    text
}

/// The report on such rows, its words with one space between them.
fn report_on(rows: &str, more: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let header = format!(
        "format = 1\ndomain = \"motion\"\ndata = \"data.csv\"\n[model]\n\
         states = {{ angle_rad = \"rate_rad_s\", rate_rad_s = \"-g_per_l*sin(angle_rad)\" }}\n\
         outputs = {{ encoder_rad = \"angle_rad\" }}\n\
         [[parameter]]\nname = \"g_per_l\"\nunit = \"1/s^2\"\nstart = 20.0\n{more}"
    );
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    std::fs::write(folder.path().join("data.csv"), format!("run,t_s,encoder_rad\n{rows}")).unwrap();
    let tool = env!("CARGO_BIN_EXE_missing-physics");
    let output = Command::new(tool).arg("diagnose").arg(folder.path()).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    text.split_whitespace().collect::<Vec<&str>>().join(" ")
}

#[test]
fn rows_in_which_a_hand_held_a_machine_are_said() {
    let held = report_on(&let_go("1", 25, 24.0), "");
    assert!(held.contains("run 1 rests in its first 2"), "{held}");
    let free = report_on(&let_go("1", 0, 24.0), "");
    assert!(!free.contains("rests in its first"), "{free}");
}

/// Pendulums of 10 cm, 40 cm and 1 m, all of which begin at 49 cm.
#[test]
fn a_value_of_each_run_is_found_from_far_off() {
    let rows: String = [("a", 98.0), ("b", 24.5), ("c", 9.8)].map(|(run, of)| let_go(run, 0, of)).concat();
    let report = report_on(&rows, "per_run = true\n");
    assert!(report.starts_with("The simulation explains this recording"), "{report}");
}
