//! Chromium without a window, told what to do through a pipe (Chrome DevTools Protocol).
#![allow(
    dead_code,
    clippy::unwrap_used,
    reason = "a test stops where it fails, and each test file uses what it needs of it"
)]

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use serde_json::{Value, json};

/// A browser with one page.
pub(crate) struct Browser {
    child: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    session: Option<String>,
    calls: u64,
    /// What was complained of, and what was asked for.
    complaints: Vec<String>,
    asked: Vec<String>,
    pub(crate) loaded: bool,
    _profile: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Browser {
    pub(crate) fn start() -> Self {
        let profile = tempfile::tempdir().unwrap();
        let mut child = Command::new("sh")
            .args(["-c", "exec chromium --headless --no-sandbox --disable-gpu --no-first-run --disable-background-networking --disable-component-update --disable-sync --remote-debugging-pipe --user-data-dir=\"$0\" 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null"])
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

    pub(crate) fn read(&mut self) -> Value {
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

    pub(crate) fn call(&mut self, method: &str, parameters: Value) -> Value {
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

    pub(crate) fn width(&mut self, width: u32) {
        let size = json!({"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": false});
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    pub(crate) fn media(&mut self, media: &str, scheme: &str) {
        let features = json!([{"name": "prefers-color-scheme", "value": scheme}]);
        self.call("Emulation.setEmulatedMedia", json!({"media": media, "features": features}));
    }

    pub(crate) fn open(&mut self, page: &Path) {
        self.loaded = false;
        self.call("Page.navigate", json!({"url": format!("file://{}", page.display())}));
        while !self.loaded {
            self.read();
        }
    }

    pub(crate) fn value(&mut self, script: &str) -> Value {
        let asked = json!({"expression": script, "returnByValue": true});
        let answer = self.call("Runtime.evaluate", asked);
        assert!(answer["exceptionDetails"].is_null(), "{script}: {answer}");
        answer["result"]["value"].clone()
    }

    pub(crate) fn text(&mut self, script: &str) -> String {
        self.value(script).as_str().unwrap().to_owned()
    }

    /// Waits for what the page has put off.
    pub(crate) fn settle(&mut self) {
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

    pub(crate) fn mouse(&mut self, kind: &str, part: f64, clicks: u32) {
        let [x, y] = self.place(part);
        let buttons = u32::from(kind != "mouseReleased");
        let button = if kind == "mouseMoved" && clicks == 0 { "none" } else { "left" };
        let event =
            json!({"type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": clicks});
        self.call("Input.dispatchMouseEvent", event);
        self.settle();
    }

    /// What is said of the row at a place, and its abscissa.
    pub(crate) fn point(&mut self, part: f64) -> (String, f64) {
        self.mouse("mouseMoved", 0.5, 0);
        self.mouse("mouseMoved", part, 0);
        let said = self.text("document.querySelector('.where').textContent");
        let number = said.rsplit(": ").next().unwrap().trim_end_matches(", set aside").parse();
        (said, number.unwrap_or(f64::NAN))
    }

    pub(crate) fn drag(&mut self, from: f64, to: f64) {
        self.mouse("mouseMoved", from, 0);
        self.mouse("mousePressed", from, 1);
        self.mouse("mouseMoved", 0.5 * (from + to), 1);
        self.mouse("mouseMoved", to, 1);
        self.mouse("mouseReleased", to, 1);
    }

    pub(crate) fn choose(&mut self, label: &str, index: usize) -> String {
        let script = format!(
            "(() => {{ const s = document.querySelector('select[aria-label=\"{label}\"]'); s.selectedIndex = {index}; s.dispatchEvent(new Event('change')); return s.selectedOptions[0].textContent; }})()"
        );
        let chosen = self.text(&script);
        self.settle();
        chosen
    }

    /// Nobody complained, and the page alone was read.
    pub(crate) fn quiet(&mut self) {
        self.settle();
        assert!(self.complaints.is_empty(), "{:?}", self.complaints);
        // What a page has made itself is no request that leaves it.
        let own = |url: &&String| url.starts_with("file://") || url.starts_with("blob:");
        let others: Vec<&String> = self.asked.iter().filter(|url| !own(url)).collect();
        assert!(others.is_empty(), "{others:?}");
    }

    /// Evaluates a script that takes time, and returns what it promises.
    pub(crate) fn awaited(&mut self, script: &str) -> Value {
        let asked = json!({"expression": script, "returnByValue": true, "awaitPromise": true});
        let answer = self.call("Runtime.evaluate", asked);
        assert!(answer["exceptionDetails"].is_null(), "{script}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Keeps a picture of the whole page, for people.
    pub(crate) fn picture(&mut self, name: &str) {
        let whole = json!({"captureBeyondViewport": true});
        let taken = self.call("Page.captureScreenshot", whole);
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        std::fs::write(folder.join(format!("{name}.png")), base64(taken["data"].as_str().unwrap())).unwrap();
    }
}

pub(crate) fn base64(text: &str) -> Vec<u8> {
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
