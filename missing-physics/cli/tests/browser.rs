//! The pages in a real browser, which is told what to do through a pipe (Chrome DevTools Protocol): pointing, zooming, picking; nothing is
//! complained of, and nothing is asked for from anywhere.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_cli::commands::{DiagnoseArguments, diagnose, diagnose_many};
use serde_json::{Value, json};

struct Browser {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    session: Option<String>,
    calls: u64,
    /// What was complained of, and what was asked for.
    complaints: Vec<String>,
    asked: Vec<String>,
    loaded: bool,
    _profile: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Browser {
    fn start() -> Self {
        let profile = tempfile::tempdir().unwrap();
        let mut child = Command::new("sh")
            .args(["-c", "exec chromium --headless --no-sandbox --disable-gpu --remote-debugging-pipe --user-data-dir=\"$0\" 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null"])
            .arg(profile.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (to, from) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
        let (session, calls, loaded) = (None, 0, false);
        let (complaints, asked) = (Vec::new(), Vec::new());
        let mut browser =
            Self { child, to, from, session, calls, complaints, asked, loaded, _profile: profile };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let target = json!({"targetId": target["targetId"], "flatten": true});
        let attached = browser.call("Target.attachToTarget", target);
        browser.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser
    }

    fn read(&mut self) -> Value {
        let mut message = Vec::new();
        self.from.read_until(0, &mut message).unwrap();
        assert_eq!(message.pop(), Some(0), "the browser has gone");
        let message: Value = serde_json::from_slice(&message).unwrap();
        let parameters = &message["params"];
        match message["method"].as_str() {
            Some("Runtime.exceptionThrown" | "Runtime.consoleAPICalled" | "Log.entryAdded") => {
                self.complaints.push(parameters.to_string());
            }
            Some("Network.requestWillBeSent") => {
                self.asked.push(parameters["request"]["url"].as_str().unwrap().to_owned());
            }
            Some("Page.loadEventFired") => self.loaded = true,
            _ => {}
        }
        message
    }

    fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.calls += 1;
        let mut message = json!({"id": self.calls, "method": method, "params": parameters});
        if let Some(session) = &self.session {
            message["sessionId"] = session.as_str().into();
        }
        self.to.write_all(format!("{message}\0").as_bytes()).unwrap();
        loop {
            let answer = self.read();
            if answer["id"] == self.calls {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    fn width(&mut self, width: u32) {
        let size = json!({"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": false});
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    fn media(&mut self, media: &str, scheme: &str) {
        let features = json!([{"name": "prefers-color-scheme", "value": scheme}]);
        self.call("Emulation.setEmulatedMedia", json!({"media": media, "features": features}));
    }

    fn open(&mut self, page: &Path) {
        self.loaded = false;
        self.call("Page.navigate", json!({"url": format!("file://{}", page.display())}));
        while !self.loaded {
            self.read();
        }
    }

    fn value(&mut self, script: &str) -> Value {
        let asked = json!({"expression": script, "returnByValue": true});
        let answer = self.call("Runtime.evaluate", asked);
        assert!(answer["exceptionDetails"].is_null(), "{script}: {answer}");
        answer["result"]["value"].clone()
    }

    fn text(&mut self, script: &str) -> String {
        self.value(script).as_str().unwrap().to_owned()
    }

    /// Waits for what the page has put off.
    fn settle(&mut self) {
        let script = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))";
        self.call("Runtime.evaluate", json!({"expression": script, "awaitPromise": true}));
    }

    /// A place in the upper chart, in parts of its width.
    fn place(&mut self, part: f64) -> [f64; 2] {
        let place = self.value(
            "(() => { const u = document.querySelector('.plot .u-over'); u.scrollIntoView({block: 'center'}); const b = u.getBoundingClientRect(); return [b.left, b.top + 0.5 * b.height, b.width]; })()",
        );
        let [left, y, width] = [0, 1, 2].map(|k| place[k].as_f64().unwrap());
        [left + part * width, y]
    }

    fn mouse(&mut self, kind: &str, part: f64, clicks: u32) {
        let [x, y] = self.place(part);
        let buttons = u32::from(kind != "mouseReleased");
        let button = if kind == "mouseMoved" && clicks == 0 { "none" } else { "left" };
        let event =
            json!({"type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": clicks});
        self.call("Input.dispatchMouseEvent", event);
        self.settle();
    }

    /// What is said of the row at a place, and its abscissa.
    fn point(&mut self, part: f64) -> (String, f64) {
        self.mouse("mouseMoved", 0.5, 0);
        self.mouse("mouseMoved", part, 0);
        let said = self.text("document.querySelector('.where').textContent");
        let number = said.rsplit(": ").next().unwrap().trim_end_matches(", set aside").parse();
        (said, number.unwrap_or(f64::NAN))
    }

    fn drag(&mut self, from: f64, to: f64) {
        self.mouse("mouseMoved", from, 0);
        self.mouse("mousePressed", from, 1);
        self.mouse("mouseMoved", 0.5 * (from + to), 1);
        self.mouse("mouseMoved", to, 1);
        self.mouse("mouseReleased", to, 1);
    }

    fn choose(&mut self, label: &str, index: usize) -> String {
        let script = format!(
            "(() => {{ const s = document.querySelector('select[aria-label=\"{label}\"]'); s.selectedIndex = {index}; s.dispatchEvent(new Event('change')); return s.selectedOptions[0].textContent; }})()"
        );
        let chosen = self.text(&script);
        self.settle();
        chosen
    }

    /// Nobody complained, and the page alone was read.
    fn quiet(&mut self) {
        self.settle();
        assert!(self.complaints.is_empty(), "{:?}", self.complaints);
        let others: Vec<&String> = self.asked.iter().filter(|url| !url.starts_with("file://")).collect();
        assert!(others.is_empty(), "{others:?}");
    }

    /// Keeps a picture of the whole page, for people.
    fn picture(&mut self, name: &str) {
        let whole = json!({"captureBeyondViewport": true});
        let taken = self.call("Page.captureScreenshot", whole);
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        std::fs::write(folder.join(format!("{name}.png")), base64(taken["data"].as_str().unwrap())).unwrap();
    }
}

fn base64(text: &str) -> Vec<u8> {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bytes, mut held, mut bits) = (Vec::new(), 0_u32, 0);
    for digit in text.bytes().filter_map(|b| DIGITS.iter().position(|d| *d == b)) {
        held = held << 6 | digit as u32;
        bits += 6;
        if bits >= 8 {
            bits -= 8;
            bytes.push((held >> bits) as u8);
        }
    }
    bytes
}

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
