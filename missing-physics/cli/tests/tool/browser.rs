//! The pages in a real browser: pointing, zooming, picking; nothing is complained of, and nothing is asked for from anywhere.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::path::{Path, PathBuf};

use crate::chromium::Browser;
use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_cli::commands::{DiagnoseArguments, diagnose, diagnose_many};
use serde_json::json;

fn bundled(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings").join(name)
}

fn page_of(recording: &Path, page: &Path) {
    let arguments = DiagnoseArguments {
        folder: recording.into(),
        html: Some(page.into()),
        options: Options { replicates: 19, ..Options::default() },
        ..DiagnoseArguments::default()
    };
    diagnose(&arguments, &Silent).unwrap().write_files().unwrap();
}

#[test]
#[ignore = "needs chromium, long: .ci/run --long"]
fn browser_explores_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("a.html");
    page_of(&bundled("thrown-ball"), &page);
    let mut browser = Browser::start();
    browser.width(1000);
    browser.open(&page);
    assert_eq!(browser.text("document.documentElement.dataset.explored"), "yes");
    assert_eq!(browser.value("document.querySelectorAll('#explore canvas').length"), 2);
    browser.picture("report");

    // Each run is reached, those that miss most first.
    let runs = browser.value("document.querySelector('select[aria-label=\"run\"]').length").as_u64().unwrap();
    let mut off = f64::INFINITY;
    for k in 0..runs as usize {
        let chosen = browser.choose("run", k);
        let (said, _) = browser.point(0.3);
        if let Some((run, misfit)) = chosen.split_once(": off by ") {
            assert!(said.starts_with(&format!("{run}, time (s): ")), "{chosen}: {said}");
            let misfit: f64 = misfit.split(' ').next().unwrap().parse().unwrap();
            assert!(misfit <= off, "{chosen}");
            off = misfit;
        } else {
            assert_eq!(chosen, "all 5 runs");
        }
    }
    browser.choose("run", 0);
    let values = browser.text("(document.querySelector('.key output').textContent)");
    assert!(values.is_empty(), "{values}");
    let (_, begin) = browser.point(0.01);
    let (_, end) = browser.point(0.99);
    let values =
        browser.text("[...document.querySelectorAll('.key output')].map((o) => o.textContent).join()");
    assert_eq!(values.matches(" m").count(), 3, "{values}");
    assert!(begin < 0.05 && end > 1.0, "{begin} {end}");

    // A stretch is drawn larger, in both charts, and all of it comes back.
    browser.drag(0.5, 0.8);
    let (_, zoomed) = browser.point(0.02);
    assert!(zoomed > begin + 0.4 * (end - begin) && zoomed < begin + 0.6 * (end - begin), "{zoomed}");
    browser.picture("zoomed");
    browser.mouse("mousePressed", 0.5, 1);
    browser.mouse("mouseReleased", 0.5, 1);
    browser.mouse("mousePressed", 0.5, 2);
    browser.mouse("mouseReleased", 0.5, 2);
    let (_, back) = browser.point(0.01);
    assert!((back - begin).abs() < 0.05, "{back}");

    // Another channel, one channel against another, logarithmic axes.
    assert_eq!(browser.choose("channel", 1), "height (m)");
    assert_eq!(browser.choose("horizontal axis", 1), "against position x (m)");
    let (said, _) = browser.point(0.5);
    assert!(said.contains("position x (m)"), "{said}");
    browser.value("document.querySelector('input[type=checkbox]').click()");
    browser.picture("logarithmic");

    // Seen from above, the ball's places: along against across.
    browser.value("document.querySelector('input[type=checkbox]').click()");
    assert_eq!(browser.choose("channel", 3), "seen from above");
    let axis = browser.text(
        "document.querySelector('select[aria-label=\"horizontal axis\"]').selectedOptions[0].textContent",
    );
    let label = browser.point(0.5).0;
    assert!(axis == "against position x (m)" && label.contains("position x (m)"), "{axis}: {label}");
    browser.picture("above");

    // A narrow page scrolls down alone; dark and on paper.
    browser.width(400);
    browser.media("screen", "dark");
    browser.open(&page);
    browser.settle();
    let wide = browser.value("document.documentElement.scrollWidth");
    assert!(wide.as_u64().unwrap() <= 400, "{wide}");
    browser.picture("narrow");
    browser.width(800);
    browser.media("print", "dark");
    browser.settle();
    let paper = browser.text("getComputedStyle(document.body).backgroundColor");
    assert_eq!(paper, "rgb(255, 255, 255)");
    browser.picture("paper");
    browser.quiet();

    // Without scripts the worst run is a still picture.
    browser.media("screen", "light");
    browser.call("Emulation.setScriptExecutionDisabled", json!({"value": true}));
    browser.open(&page);
    assert_eq!(browser.value("document.querySelectorAll('#explore figure svg').length"), 6);
    browser.picture("still");
}

/// The pictures of domains are seen, wide and narrow, light and dark.
#[test]
#[ignore = "needs chromium, long: .ci/run --long"]
fn browser_shows_what_the_people_of_a_domain_look_at() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("a.html");
    let mut browser = Browser::start();
    for (recording, panels, name) in
        [("liquid-tilt/c02", 6, "bottle"), ("bounce-audio/c04", 7, "sound"), ("grain-pour/c06", 12, "heap")]
    {
        page_of(&bundled("practice").join(recording), &page);
        for (width, scheme) in [(1000, "light"), (400, "dark")] {
            browser.width(width);
            browser.media("screen", scheme);
            browser.open(&page);
            browser.settle();
            // As wide as the page allows, and letters of eight pixels and more.
            let sizes = browser.value(
                "[...document.querySelectorAll('.panels svg')].map((s) => [s.getBoundingClientRect().width, 11 * s.getBoundingClientRect().width / s.viewBox.baseVal.width])",
            );
            let sizes = sizes.as_array().unwrap().clone();
            assert_eq!(sizes.len(), panels, "{recording}");
            let fits = |s: &serde_json::Value| {
                s[0].as_f64().unwrap() < f64::from(width) && s[1].as_f64().unwrap() > 8.0
            };
            assert!(sizes.iter().all(fits), "{recording}, {width}: {sizes:?}");
            let wide = browser.value("document.documentElement.scrollWidth").as_u64().unwrap();
            assert!(wide <= u64::from(width), "{recording}: {wide}");
            browser.value("document.querySelector('.panels').scrollIntoView()");
            browser.picture(&format!("{name}-{scheme}"));
        }
    }
    browser.quiet();
}

/// Labels of a recording that are markup stay text, and nothing that they name is asked for.
#[test]
#[ignore = "needs chromium, long: .ci/run --long"]
fn browser_takes_names_for_names() {
    let folder = tempfile::tempdir().unwrap();
    let hostile =
        "</script><script>window.hacked=1</script><img src=//example.org/x onerror=window.hacked=2>";
    let header = std::fs::read_to_string(bundled("dropped-ball/recording.toml")).unwrap();
    let data = std::fs::read_to_string(bundled("dropped-ball/data.csv")).unwrap();
    let labelled: Vec<String> =
        data.lines()
            .map(|l| {
                if let Some(rest) = l.strip_prefix("1,") { format!("{hostile},{rest}") } else { l.to_owned() }
            })
            .collect();
    assert!(labelled.iter().any(|l| l.starts_with(hostile)));
    std::fs::write(folder.path().join("recording.toml"), header).unwrap();
    std::fs::write(folder.path().join("data.csv"), labelled.join("\n")).unwrap();
    let page = folder.path().join("a.html");
    page_of(folder.path(), &page);
    let mut browser = Browser::start();
    browser.width(1000);
    browser.open(&page);
    assert_eq!(browser.text("document.documentElement.dataset.explored"), "yes");
    let found = (0..4).any(|k| {
        browser.choose("run", k);
        browser.point(0.3).0.contains(hostile)
    });
    assert!(found);
    assert!(browser.value("window.hacked === undefined").as_bool().unwrap());
    browser.quiet();
}

#[test]
#[ignore = "needs chromium, long: .ci/run --long"]
fn browser_goes_from_the_index_to_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("reports");
    let folders = ["dropped-ball", "none here", "steel-ball"].map(bundled);
    let common = DiagnoseArguments {
        html: Some(out.clone()),
        options: Options { replicates: 19, ..Options::default() },
        ..DiagnoseArguments::default()
    };
    let said = diagnose_many(&folders, &common, &Silent).unwrap();
    assert_eq!(said.failure.as_deref(), Some("1 of 3 recordings have no diagnosis"));
    said.write_files().unwrap();
    let mut browser = Browser::start();
    browser.width(1000);
    browser.open(&out.join("index.html"));
    assert_eq!(browser.value("document.querySelectorAll('.card').length"), 3);
    assert_eq!(browser.value("document.querySelectorAll('a.card').length"), 2);
    browser.picture("index");
    browser.loaded = false;
    browser.value("document.querySelector('a.card').click()");
    while !browser.loaded {
        browser.read();
    }
    assert_eq!(browser.text("document.documentElement.dataset.explored"), "yes");
    browser.quiet();
}
