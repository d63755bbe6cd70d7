//! Long work says how far it is, what it takes, and what is kept where it is stopped.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn tool() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_missing-physics"));
    command.current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings"));
    command
}

/// A recording whose simulator starts another program, and never answers.
fn hanging(folder: &Path) {
    let header = "format = 1\ndomain = \"custom\"\ndata = \"data.csv\"\n[[input]]\nname = \"t_s\"\n[[channel]]\nname = \"y_m\"\n\
                  [simulator]\ntimeout_s = 300\ncommand = [\"sh\", \"-c\", \"sleep 987 & echo $! > sleeper; sleep 986\"]\n\
                  [[parameter]]\nname = \"slope\"\nstart = 1.0\nscale = 0.1\n";
    std::fs::write(folder.join("recording.toml"), header).unwrap();
    let rows: String = (0..24).map(|k| format!("{},{},{}\n", k / 12, k % 12, k % 12)).collect();
    std::fs::write(folder.join("data.csv"), format!("run,t_s,y_m\n{rows}")).unwrap();
}

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

/// Whether a process is gone, or dead and not yet buried by whoever adopted it, within a time: a signal is delivered when its
/// process next runs.
fn ends_within(limit: Duration, process: &str) -> bool {
    let begin = Instant::now();
    loop {
        let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
        if status.is_empty() || status.contains("State:\tZ") {
            return true;
        }
        if begin.elapsed() > limit {
            return false;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Every ten seconds a line is said, though not a step ends; what is interrupted says what is kept, and ends what it has started.
#[test]
fn a_step_that_hangs_is_told_of_and_stopped() {
    let folder = tempfile::tempdir().unwrap();
    hanging(folder.path());
    let begin = Instant::now();
    let mut child = tool()
        .args(["diagnose", "--allow-command"])
        .arg(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stderr = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    assert!(line.starts_with("missing-physics: 10 s so far, "), "{line}");
    assert!(begin.elapsed() < Duration::from_secs(20));
    let sleeper = std::fs::read_to_string(folder.path().join("sleeper")).unwrap();
    interrupt(&child);
    let said: Vec<String> = stderr.lines().map(Result::unwrap).filter(|l| !l.contains(" so far, ")).collect();
    assert_eq!(said, ["", "missing-physics: stopped; nothing was written"]);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(ends_within(Duration::from_secs(5), sleeper.trim()), "the process {sleeper} goes on");
}

/// What came through a pipe is in the recording's table, and that is said.
#[test]
fn a_watch_that_is_stopped_says_where_its_rows_are() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["recording.toml", "data.csv"] {
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings/dropped-ball").join(name);
        std::fs::copy(from, folder.path().join(name)).unwrap();
    }
    let mut child = tool()
        .args(["watch", "--pipe", "--reference", "3"])
        .arg(folder.path())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It has begun when it speaks of its reference.
    let mut said = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut said).unwrap();
    interrupt(&child);
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert!(err.contains("stopped; rows that came are kept in") && err.contains("data.csv"), "{err}");
}

/// What is said before and after a diagnosis of its memory, MB.
fn memory_mb(recording: &Path) -> [f64; 2] {
    let output = tool().args(["diagnose", "-v"]).arg(recording).output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    let number = |before: &str, after: &str| -> f64 {
        let line =
            err.lines().find(|l| l.contains(before) && l.contains(after)).unwrap_or_else(|| panic!("{err}"));
        let end = line.split(after).next().unwrap();
        end.rsplit(' ').next().unwrap().parse().unwrap()
    };
    [1e3 * number("takes up to ", " GB of memory"), number(" in all, ", " MB of memory at most")]
}

#[test]
fn memory_is_said_beforehand_and_bounded() {
    for recording in ["thrown-ball", "practice/bounce-audio/c04", "practice/liquid-tilt/c02"] {
        let [most, taken] = memory_mb(Path::new(recording));
        assert!(taken > 5.0 && taken < most, "{recording}: {taken} of {most} MB");
    }
    let output = tool().args(["diagnose", "dropped-ball", "--memory", "0.1"]).output().unwrap();
    let err = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), output.stdout.len(), err.lines().count()), (Some(2), 0, 1), "{err}");
    assert!(
        err.contains("takes up to 0.3 GB of memory, and 0.1 GB are free") && err.contains("--memory 1"),
        "{err}"
    );
}

/// Fifteen thousand values of four throws, and as many throws as their parts may be.
#[test]
#[ignore = "long: .ci/run --long"]
fn long_memory_of_long_and_of_many_runs_is_bounded() {
    use rand::SeedableRng as _;
    use rand_distr::Distribution as _;
    let header = "format = 1\ndomain = \"trajectory\"\ndata = \"data.csv\"\n[rig]\ngravity_m_s2 = 9.80665\n";
    let normal = rand_distr::Normal::new(0.0, 0.004).unwrap();
    for (runs, rows) in [(4, 1250), (60, 20)] {
        let folder = tempfile::tempdir().unwrap();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        std::fs::write(folder.path().join("recording.toml"), header).unwrap();
        let mut table = String::from("run,t_s,x_m,y_m,z_m,spin_x_rad_s,spin_y_rad_s,spin_z_rad_s\n");
        for row in 0..runs * rows {
            let t = 1.5 * f64::from(row % rows) / f64::from(rows);
            let [a, b, c] = std::array::from_fn(|_| normal.sample(&mut rng));
            let (x, z) = (3.0 * t - 0.05 * t * t + a, 20.0 + 2.0 * t - 4.85 * t * t + c);
            let run = row / rows;
            table.push_str(&format!("{run},{t:.7},{x:.6},{:.6},{z:.6},{run},{},7\n", t + b, 3 * run));
        }
        std::fs::write(folder.path().join("data.csv"), table).unwrap();
        let [most, taken] = memory_mb(folder.path());
        assert!(taken > 100.0 && taken < most, "{runs} runs: {taken} of {most} MB");
    }
}
