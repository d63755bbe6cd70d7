//! The page that `.ci/web` builds, in a real browser: the command's answers, columns that are named, work that is cancelled; nothing is
//! complained of, and nothing is asked for from anywhere.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

#[path = "../../cli/tests/tool/chromium/mod.rs"]
mod chromium;

use std::path::{Path, PathBuf};
use std::time::Instant;

use chromium::Browser;
use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_cli::commands::{self, DiagnoseArguments};
use serde_json::{Value, json};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The page, open and ready.
fn page(width: u32) -> Browser {
    let page = root().join("target/web/missing-physics.html");
    assert!(page.exists(), "{}: build it by .ci/web", page.display());
    let mut browser = Browser::start();
    browser.width(width);
    browser.open(&page.canonicalize().unwrap());
    until(&mut browser, "document.documentElement.dataset.ready === 'yes'");
    browser
}

/// Waits until a condition holds.
fn until(browser: &mut Browser, condition: &str) {
    let script = format!(
        "new Promise((done) => {{ const begin = Date.now(); const look = () => {condition} ? done(true) : \
         Date.now() - begin > 120000 ? done(false) : setTimeout(look, 20); look(); }})"
    );
    assert_eq!(browser.awaited(&script), true, "{condition}: {}", browser.text("document.body.innerText"));
}

fn click(browser: &mut Browser, what: &str) {
    browser.value(&format!("document.querySelector('{what}').click()"));
}

/// Diagnoses what is on the page and waits for the report.
fn diagnosed(browser: &mut Browser) {
    until(browser, "!document.querySelector('#diagnose').disabled");
    click(browser, "#diagnose");
    until(browser, "!document.querySelector('#answer').hidden");
}

/// What a button saves, in bytes of base 64.
fn saved(browser: &mut Browser, button: &str) -> (String, String) {
    let script = format!(
        "new Promise((done) => {{ const save = files.save; files.save = async (name, blob) => {{ files.save = save; \
         const reader = new FileReader(); reader.onload = () => done([name, reader.result.split(',')[1]]); \
         reader.readAsDataURL(blob); }}; document.querySelector('{button}').click(); }})"
    );
    let found = browser.awaited(&script);
    (found[0].as_str().unwrap().to_owned(), found[1].as_str().unwrap().to_owned())
}

fn saved_text(browser: &mut Browser, button: &str) -> String {
    String::from_utf8(chromium::base64(&saved(browser, button).1)).unwrap()
}

/// What the command says and writes of a recording, and how long it takes on one thread.
struct Command {
    text: String,
    json: Value,
    html: String,
    took_s: f64,
}

fn command(folder: &Path) -> Command {
    let written = tempfile::tempdir().unwrap();
    let [json, html] = ["a.json", "a.html"].map(|name| written.path().join(name));
    let arguments = DiagnoseArguments {
        folder: folder.into(),
        json: Some(json.clone()),
        html: Some(html.clone()),
        options: Options::with_alpha(0.05),
        threads: 1,
        ..DiagnoseArguments::default()
    };
    let begin = Instant::now();
    let said = commands::diagnose(&arguments, &Silent).unwrap();
    let took_s = begin.elapsed().as_secs_f64();
    said.write_files().unwrap();
    let read = |path: &Path| std::fs::read_to_string(path).unwrap();
    Command { text: said.text, json: serde_json::from_str(&read(&json)).unwrap(), html: read(&html), took_s }
}

/// The largest relative difference of two numbers at the same place, and the place; anything else has to be the same.
fn differ(at: &str, a: &Value, b: &Value, most: &mut (f64, String)) {
    match (a, b) {
        (Value::Number(x), Value::Number(y)) => {
            let [x, y] = [x, y].map(|n| n.as_f64().unwrap());
            let off = (x - y).abs() / x.abs().max(y.abs()).max(f64::MIN_POSITIVE);
            if off > most.0 {
                *most = (off, format!("{at}: {x} and {y}"));
            }
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            let (x, y) = (by_name(x), by_name(y));
            x.iter().zip(y).enumerate().for_each(|(k, (a, b))| differ(&format!("{at}[{k}]"), a, b, most));
        }
        (Value::Object(x), Value::Object(y)) if x.keys().eq(y.keys()) => {
            x.iter().for_each(|(key, a)| differ(&format!("{at}.{key}"), a, &y[key], most));
        }
        _ => assert_eq!(a, b, "{at}"),
    }
}

/// A list in the order of its entries' names, where they have names: equally strong tests may come in either order.
fn by_name(list: &[Value]) -> Vec<&Value> {
    let mut sorted: Vec<&Value> = list.iter().collect();
    sorted.sort_by_key(|v| v["name"].as_str());
    sorted
}

/// What a report says in words and numbers; coordinates of pictures follow the last digits.
fn words(html: &str) -> Vec<String> {
    let body = html.split("<script").map(|part| part.split_once("</script>").map_or(part, |(_, rest)| rest));
    let body: String = body.collect();
    let pictures = body.split("<svg").map(|part| part.split_once("</svg>").map_or(part, |(_, rest)| rest));
    let text: String = pictures.collect();
    let words = text.split('<').filter_map(|part| part.split_once('>')).map(|(_, text)| text.trim());
    let mut words: Vec<String> =
        words.filter(|w| !w.is_empty() && !w.contains("diagnose '")).map(str::to_owned).collect();
    // Equally strong tests may come in either order.
    words.sort();
    words
}

/// Keeps a picture of all of the page, for people.
fn picture(browser: &mut Browser, shown: &str) {
    let size = "[innerWidth, document.documentElement.scrollHeight]";
    for _ in 0..2 {
        // What is not on the screen is not drawn.
        let size = browser.value(size);
        let size = json!({"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": false});
        browser.call("Emulation.setDeviceMetricsOverride", size);
        browser.awaited("new Promise((done) => setTimeout(done, 400))");
    }
    browser.picture(&format!("page-{shown}"));
    let width = browser.value("innerWidth").as_u64().unwrap();
    browser.width(width as u32);
}

/// Gives an input or a selection a value.
fn name(browser: &mut Browser, label: &str, value: &str) {
    browser.value(&format!(
        "{{ const s = document.querySelector('[aria-label=\"{label}\"]'); s.value = '{value}'; s.dispatchEvent(new Event('change', {{ bubbles: true }})); }}"
    ));
}

/// Writes into the header as somebody who types there.
fn write(browser: &mut Browser, instead: &str, text: &str) {
    browser.value(&format!(
        "{{ const h = document.querySelector('#header'); document.querySelector('#rig').open = true; h.focus(); \
         h.value = h.value.replace('{instead}', '{text}'); h.dispatchEvent(new Event('input')); h.blur(); }}"
    ));
}

/// Chooses files of the disk.
fn choose_files(browser: &mut Browser, files: &[PathBuf]) {
    let input = browser.call("Runtime.evaluate", json!({"expression": "document.querySelector('#files')"}));
    let files = json!({"files": files, "objectId": input["result"]["objectId"]});
    browser.call("DOM.setFileInputFiles", files);
}

/// Drops files of these names and texts on the page.
fn dropped(browser: &mut Browser, files: &[(&str, &str)]) {
    let files = serde_json::to_string(files).unwrap();
    browser.value(&format!(
        "{{ const d = new DataTransfer(); {files}.forEach(([name, text]) => d.items.add(new File([text], name))); \
         document.querySelector('#drop').dispatchEvent(new DragEvent('drop', {{ dataTransfer: d, bubbles: true, cancelable: true }})); }}"
    ));
    browser.settle();
}

/// The dropped ball as a laboratory might have it: milliseconds, centimetres without a word, decimal commas.
fn laboratory() -> String {
    let data = std::fs::read_to_string(root().join("recordings/dropped-ball/data.csv")).unwrap();
    let comma = |value: f64| format!("{value:.5}").replace('.', ",");
    let line = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let [t, z]: [f64; 2] = [cells[1], cells[2]].map(|cell| cell.parse().unwrap());
        format!("{};{};{};{}\n", comma(1e3 * t), comma(1e2 * z), comma(21.0), cells[0])
    };
    let rows: String = data.lines().skip(1).map(line).collect();
    format!("t [ms];Messwert A;Messwert B (mm);Versuch\n{rows}")
}

/// Numbers of the JSON that a processor and WebAssembly work out in other orders and with other exponentials.
const CLOSE: f64 = 1e-6;

#[test]
#[ignore = "needs chromium and the page that .ci/web builds, long: .ci/run --long"]
fn browser_page_answers_as_the_command() {
    let mut browser = page(1000);
    for (name, shown) in [
        ("dropped-ball", "ball"),
        ("practice/liquid-tilt/c02", "bottle"),
        ("measured/indentation/sand-plate-60mm", "sand"),
    ] {
        let name = format!("recordings/{name}");
        let command = command(&root().join(&name));
        click(&mut browser, &format!("#samples button[value=\"{name}\"]"));
        diagnosed(&mut browser);
        assert_eq!(browser.text("document.querySelector('#text').textContent"), command.text, "{name}");
        let took = browser.text("document.querySelector('#took').textContent");
        let mut json: Value = serde_json::from_str(&saved_text(&mut browser, "#save-json")).unwrap();
        assert_eq!(json["recording"].as_str(), Some(name.as_str()));
        json["recording"] = command.json["recording"].clone();
        let mut most = (0.0, String::new());
        differ("", &json, &command.json, &mut most);
        println!(
            "{name}: {took}, {:.1} s by the command on one thread; numbers differ by {:.1e}",
            command.took_s, most.0
        );
        assert!(most.0 < CLOSE, "{name}: {} {}", most.0, most.1);
        let html = saved_text(&mut browser, "#save-html");
        assert_eq!(words(&html), words(&command.html), "{name}");
        picture(&mut browser, shown);
    }
    // The same at night, and on a narrow screen.
    browser.media("screen", "dark");
    picture(&mut browser, "dark");
    browser.media("screen", "light");
    browser.width(400);
    let wide = browser.value("document.documentElement.scrollWidth");
    assert!(wide.as_u64().unwrap() <= 400, "{wide}");
    picture(&mut browser, "narrow");
    browser.quiet();
}

/// The text is the command's in every domain of the page, of folders whose files are chosen.
#[test]
#[ignore = "needs chromium and the page that .ci/web builds, long: .ci/run --long"]
fn browser_page_answers_in_every_domain() {
    let mut browser = page(1000);
    let mut others = Vec::new();
    for name in [
        "steel-ball",
        "thrown-ball",
        "measured/bounce/erickson-pingpong-times",
        "practice/bounce/c01",
        "practice/slosh/c01",
        "practice/indentation/c06",
        "measured/motion/pendulum-small-swing",
    ] {
        let folder = root().join("recordings").join(name).canonicalize().unwrap();
        let command = command(&folder);
        choose_files(&mut browser, &["recording.toml", "data.csv"].map(|file| folder.join(file)));
        until(&mut browser, "document.querySelector('#answer').hidden");
        diagnosed(&mut browser);
        let [text, took] =
            ["text", "took"].map(|id| browser.text(&format!("document.querySelector('#{id}').textContent")));
        println!("{name}: {took}, {:.1} s by the command on one thread", command.took_s);
        if text != command.text {
            println!("{text}{}", command.text);
            others.push(name);
        }
    }
    assert_eq!(others, [""; 0]);
    browser.quiet();
}

/// A laboratory's table: its columns are shown, named by hand, and diagnosed; what is saved is a recording for the command.
#[test]
#[ignore = "needs chromium and the page that .ci/web builds, long: .ci/run --long"]
fn browser_page_takes_a_laboratorys_table() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("Würfe.csv");
    std::fs::write(&table, laboratory()).unwrap();
    let mut browser = page(1000);
    choose_files(&mut browser, &[table]);
    until(&mut browser, "document.querySelector('#state').textContent === 'Say above what was recorded.'");
    click(&mut browser, "#domains button[value=trajectory]");
    until(&mut browser, "!document.querySelector('#mapping').hidden");
    let state = "document.querySelector('#state').textContent";
    until(&mut browser, "document.querySelector('#state').textContent.startsWith('no column found for z_m')");
    let header = "document.querySelector('#header').value";
    let rows = "[...document.querySelectorAll('#table tbody tr')].map((r) => r.cells[0].textContent + ': ' + r.querySelector('select').value).join()";
    assert_eq!(browser.text(rows), "t [ms]: t_s,Messwert A: ,Messwert B (mm): ,Versuch: run");
    picture(&mut browser, "columns");

    // One column is the height, without a unit until one is given; another tells runs apart.
    name(&mut browser, "what Messwert A is", "z_m");
    until(&mut browser, "document.querySelector('input[aria-label=\"unit of Messwert A\"]') !== null");
    until(&mut browser, &format!("{state}.includes('is z_m in centimetres?')"));
    name(&mut browser, "unit of Messwert A", "cm");
    until(&mut browser, &format!("{state}.includes('z_m -14.55 to 1.54 m')"));
    until(&mut browser, &format!("{rows}.endsWith('run') && {header}.includes('run = \"Versuch\"')"));
    assert_eq!(browser.text(rows), "t [ms]: t_s,Messwert A: z_m,Messwert B (mm): ,Versuch: run");

    // What somebody writes into the header is read, and can be taken back.
    write(&mut browser, "# mass_kg", "no_such_key");
    until(&mut browser, &format!("{state}.includes('unknown key rig.no_such_key')"));
    click(&mut browser, "#again");
    until(&mut browser, &format!("{state}.startsWith('trajectory: 4 runs')"));
    for key in ["mass_kg", "diameter_m", "gravity_m_s2", "air_density_kg_m3"] {
        write(&mut browser, &format!("# {key}"), key);
    }
    until(&mut browser, "document.querySelector('#diagnose').disabled");
    until(&mut browser, &format!("{state}.startsWith('trajectory: 4 runs')"));
    picture(&mut browser, "mapped");
    diagnosed(&mut browser);
    let text = browser.text("document.querySelector('#text').textContent");
    assert!(text.contains("air drag, quadratic: drag_coefficient = 0.4991"), "{text}");

    let (archive, bytes) = saved(&mut browser, "#save-recording");
    assert_eq!(archive, "Würfe.zip");
    let bytes = std::io::Cursor::new(chromium::base64(&bytes));
    zip::ZipArchive::new(bytes).unwrap().extract(folder.path()).unwrap();
    assert_eq!(command(&folder.path().join("Würfe")).text, text);
    browser.quiet();
}

/// Work that is cancelled ends at once, and the page goes on; what cannot be read is said on a line.
#[test]
#[ignore = "needs chromium and the page that .ci/web builds, long: .ci/run --long"]
fn browser_page_cancels_and_says_what_is_wrong() {
    let mut browser = page(1000);
    let failed = "document.querySelector('#failed').textContent";
    click(&mut browser, "#samples button[value$=pendulum-small-swing]");
    until(&mut browser, "!document.querySelector('#diagnose').disabled");
    click(&mut browser, "#diagnose");
    until(&mut browser, "document.querySelector('#stage').textContent.startsWith('comparing mechanisms')");
    assert!(browser.value("document.querySelector('#inputs').disabled").as_bool().unwrap());
    picture(&mut browser, "working");
    let begin = Instant::now();
    click(&mut browser, "#cancel");
    until(&mut browser, &format!("{failed} === 'Cancelled.'"));
    assert!(begin.elapsed().as_secs_f64() < 2.0);
    assert!(browser.value("document.querySelector('#work').hidden").as_bool().unwrap());
    click(&mut browser, "#samples button[value$=dropped-ball]");
    diagnosed(&mut browser);
    assert_eq!(browser.text(failed), "");

    // An option that makes no sense, a file that is none, a domain that needs the command.
    browser.value("document.querySelector('#alpha').value = '0.7'");
    click(&mut browser, "#diagnose");
    until(&mut browser, &format!("{failed}.startsWith('alpha is 0.7')"));
    let state = "document.querySelector('#state').textContent";
    dropped(&mut browser, &[("bericht.docx", "PK")]);
    until(&mut browser, &format!("{state}.startsWith('bericht.docx: unknown kind of file')"));
    let header = "format = 1\ndomain = \"custom\"\ndata = \"data.csv\"\n";
    dropped(&mut browser, &[("recording.toml", header), ("data.csv", "run,t_s\n")]);
    until(&mut browser, &format!("{state}.includes('other domains are diagnosed by the command')"));
    browser.quiet();
}
