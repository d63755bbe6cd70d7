//! A machine's recording read and, up to 2,000 rows, diagnosed again and again, by rows and joints; larger ones are diagnosed once, for what
//! is said of them.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a bench stops where it fails, and says what it saw"
)]

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_domains::load;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Time between rows, s, and steps of the simulation in it: one a row would be an error of its own, which a diagnosis finds.
const ROW_S: f64 = 1e-3;
const SUBSTEPS: usize = 50;

/// Writes a recording of joints side by side, each a drive with dry friction under a command of its own at 1 kHz, and where something is to
/// be left over with a spring that no mechanism is.
fn write(folder: &Path, joints: usize, runs: usize, rows: usize, left: bool) {
    let mut header = String::from("format = 1\ndomain = \"motion\"\ndata = \"data.csv\"\n[model]\n");
    let list = |each: &dyn Fn(usize) -> String| (0..joints).map(each).collect::<Vec<_>>().join(", ");
    let states = list(&|j| {
        format!(
            "x{j}_rad = \"v{j}_rad_s\", v{j}_rad_s = \"gain*u{j}_v - damping_per_s*v{j}_rad_s - k_per_s2*x{j}_rad\""
        )
    });
    let _ = writeln!(header, "states = {{ {states} }}");
    let _ = writeln!(header, "outputs = {{ {} }}", list(&|j| format!("encoder{j}_rad = \"x{j}_rad\"")));
    let _ = writeln!(header, "inputs = {{ {} }}", list(&|j| format!("u{j}_v = \"hold\"")));
    for (name, start) in [("gain", 10.0), ("damping_per_s", 1.0), ("k_per_s2", 5.0)] {
        let _ = writeln!(header, "[[parameter]]\nname = \"{name}\"\nstart = {start}");
    }
    for j in 0..joints {
        let _ = writeln!(
            header,
            "[[joint]]\nname = \"j{j}\"\nposition = \"x{j}_rad\"\nvelocity = \"v{j}_rad_s\"\ndrive = \"u{j}_v\""
        );
    }
    std::fs::write(folder.join("recording.toml"), header).unwrap();
    let (mut rng, noise) = (ChaCha8Rng::seed_from_u64(1), Normal::new(0.0, 1e-3).unwrap());
    let columns = (0..joints).map(|j| format!(",encoder{j}_rad,u{j}_v")).collect::<String>();
    let mut data = format!("run,t_s{columns}\n");
    let dt = ROW_S / SUBSTEPS as f64;
    for run in 0..runs {
        let mut motion = vec![[0.0_f64; 2]; joints];
        for row in 0..rows {
            let t = ROW_S * row as f64;
            let _ = write!(data, "{run},{t:.3}");
            for (j, [x, v]) in motion.iter_mut().enumerate() {
                let u = 2.0 * ((3.0 + j as f64 + 0.3 * run as f64) * t).sin();
                let _ = write!(data, ",{:.6},{u:.4}", *x + noise.sample(&mut rng));
                for _ in 0..SUBSTEPS {
                    let left = if left { 0.6 * ((4.0 * *x).tanh() + 0.5 * (5.0 * *x).sin()) } else { 0.0 };
                    let force = 12.0 * u - 1.5 * *v - 6.0 * *x - left;
                    let held = *v == 0.0 && force.abs() <= 1.0;
                    let way = if *v == 0.0 { force } else { *v };
                    let next = if held { 0.0 } else { *v + dt * (force - way.signum()) };
                    *v = if next * *v < 0.0 { 0.0 } else { next };
                    *x += dt * *v;
                }
            }
            data.push('\n');
        }
    }
    std::fs::write(folder.join("data.csv"), data).unwrap();
}

fn machine(c: &mut Criterion) {
    let mut group = c.benchmark_group("machine");
    group.sample_size(10);
    let all = [
        (1, 4, 500, false),
        (1, 4, 500, true),
        (1, 10, 2000, false),
        (1, 10, 2000, true),
        (2, 4, 500, false),
        (1, 10, 10_000, false),
    ];
    // With `--test` nothing is timed, and the others take minutes.
    let asked = if std::env::args().any(|a| a == "--test") { &all[..1] } else { &all[..] };
    for &(joints, runs, rows, left) in asked {
        let folder = tempfile::tempdir().unwrap();
        write(folder.path(), joints, runs, rows, left);
        let beside = if left { ", a spring left over" } else { "" };
        let id = format!("{joints} joints, {} rows{beside}", runs * rows);
        group.bench_with_input(BenchmarkId::new("read", &id), &rows, |b, _| {
            b.iter(|| load(folder.path()).unwrap());
        });
        let (_, loaded) = load(folder.path()).unwrap();
        let diagnose = || loaded.diagnose(&Options::default(), &Silent).unwrap();
        let begin = Instant::now();
        let answer = diagnose();
        let took = begin.elapsed().as_secs_f64();
        println!("machine/diagnose/{id}: {} {:?}, once in {took:.1} s", answer.verdict.word(), answer.chosen);
        if runs * rows <= 2000 {
            group.bench_with_input(BenchmarkId::new("diagnose", &id), &rows, |b, _| b.iter(diagnose));
        }
    }
    group.finish();
}

criterion_group!(benches, machine);
criterion_main!(benches);
