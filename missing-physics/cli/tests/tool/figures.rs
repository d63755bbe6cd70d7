//! What the people of a domain look at: drawn from the data and the fitted model, on the page, and not empty.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use std::path::{Path, PathBuf};

use missing_physics::diagnosis::Diagnosis;
use missing_physics::engine::Options;
use missing_physics::observer::Silent;
use missing_physics_domains as domains;
use missing_physics_report::{Colour, Figure, Map, Mark, Panel, Plane, ReportContext, Shape, html, page};

fn bundled(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings").join(name)
}

/// A recording's diagnosis and figures; all of them are on its page, each panel with its labels.
fn figures(recording: &Path) -> (Diagnosis, Vec<Figure>) {
    let (domain, loaded) = domains::load(recording).unwrap();
    let options = Options { replicates: 19, ..Options::default() };
    let found = loaded.diagnose(&options, &Silent).unwrap();
    let figures = loaded.figures(&found);
    let context = ReportContext { figures, words: domain.words(), ..ReportContext::default() };
    let page = html(&found, &context);
    assert!(!context.figures.is_empty());
    for figure in &context.figures {
        let title = figure.title.as_str();
        let (_, section) = page.split_once(&format!("<h2>{title}</h2>")).unwrap_or_else(|| panic!("{title}"));
        let (section, _) = section.split_once("</section>").unwrap();
        assert!(!section.contains("NaN"), "{title}");
        assert_eq!(section.matches("<figure>").count(), figure.panels.len(), "{title}");
        for panel in &figure.panels {
            let (x, y) = match panel {
                Panel::Plane(plane) => (&plane.x_label, &plane.y_label),
                Panel::Map(map) => (&map.x_label, &map.y_label),
            };
            let written = |label: &str| section.contains(&format!(">{}</text>", page::escape(label)));
            assert!(written(x) && written(y), "{title}: {x}, {y}");
        }
    }
    (found, context.figures)
}

fn titled<'a>(figures: &'a [Figure], begins: &str) -> &'a Figure {
    let found = figures.iter().find(|figure| figure.title.starts_with(begins));
    found.unwrap_or_else(|| panic!("{begins}: {:?}", figures.iter().map(|f| &f.title).collect::<Vec<_>>()))
}

fn planes(figure: &Figure) -> Vec<&Plane> {
    figure
        .panels
        .iter()
        .filter_map(|p| if let Panel::Plane(plane) = p { Some(plane) } else { None })
        .collect()
}

fn maps(figure: &Figure) -> Vec<&Map> {
    figure.panels.iter().filter_map(|p| if let Panel::Map(map) = p { Some(map) } else { None }).collect()
}

fn points(plane: &Plane, shape: Shape, colour: Colour) -> Vec<[f64; 2]> {
    let marks = plane.marks.iter().filter(|m| m.shape == shape && m.colour == colour);
    marks.flat_map(|m: &Mark| m.points.iter().copied()).filter(|p| p.iter().all(|v| v.is_finite())).collect()
}

fn area(outline: &[[f64; 2]]) -> f64 {
    let turned = (0..outline.len()).map(|i| {
        let ([a, b], [c, d]) = (outline[i], outline[(i + 1) % outline.len()]);
        0.5 * (a * d - b * c)
    });
    turned.sum::<f64>().abs()
}

/// The heap is as high as the picture has it, and holds the grains; it is simulated as high, and the difference is that of both.
#[test]
#[ignore = "long: .ci/run --long"]
fn long_figure_of_a_heap() {
    let (found, figures) = figures(&bundled("practice/grain-pour/c06"));
    let maps = maps(titled(&figures, "The heap of run"));
    assert_eq!(maps.len(), 5);
    let (measured, simulated, left) = (maps[0], maps[1], maps[2]);
    let volume = |map: &Map| {
        let cell = (map.extent[0][1] - map.extent[0][0]) / map.columns as f64;
        map.cells.iter().filter(|v| v.is_finite()).sum::<f64>() * cell * cell
    };
    // A thousand grains of 4 mm, and the holes between them.
    let grains = 1000.0 * std::f64::consts::PI / 6.0 * 4f64.powi(3);
    for map in [measured, simulated, maps[3]] {
        let filled = volume(map) / grains;
        assert!(filled > 1.0 && filled < 2.5, "{}: {filled}", map.title);
        assert!(map.most > 8.0 && map.most < 40.0, "{} mm", map.most);
    }
    for ((m, s), l) in measured.cells.iter().zip(&simulated.cells).zip(&left.cells) {
        assert!(((m - s) - l).abs() < 1e-9 || !l.is_finite());
    }
    let profile = planes(titled(&figures, "The heap of run"))[0];
    let heights = points(profile, Shape::Dots, Colour::Data);
    assert!(heights[0][1] > 8.0 && heights.last().unwrap()[1] < 1.0, "{heights:?}");
    // The ground reads 5 mm too deep, which the simulation has not and what was found has.
    let statistics = planes(titled(&figures, "What the pictures show"));
    assert_eq!(statistics.len(), 6);
    let ground = statistics[0];
    assert!(ground.y_label.starts_with("ground below") && ground.x_label == "height of the funnel (mm)");
    let level = |shape, colour| points(ground, shape, colour).iter().map(|p| p[1]).collect::<Vec<_>>();
    assert_eq!(level(Shape::Dots, Colour::Data).len(), found.curves.len());
    assert!(level(Shape::Dots, Colour::Data).iter().all(|mm| (mm - 5.0).abs() < 0.2));
    assert!(level(Shape::Line, Colour::Before).iter().all(|mm| mm.abs() < 0.2));
    assert!(level(Shape::Line, Colour::After).iter().all(|mm| (mm - 5.0).abs() < 0.2));
}

/// Each impact that was heard is marked in the sound, and expected near there; a click between them is heard and left out.
#[test]
fn figure_of_a_sound_and_of_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let from = bundled("practice/bounce-audio/c04");
    for entry in std::fs::read_dir(&from).unwrap().map(|e| e.unwrap()) {
        std::fs::copy(entry.path(), folder.path().join(entry.file_name())).unwrap();
    }
    // A loud sample of all channels in the middle of the first flight of the first drop, which no table makes.
    let wav = folder.path().join("drop-00.wav");
    let mut bytes = std::fs::read(&wav).unwrap();
    let data = bytes.windows(4).position(|w| w == b"data").unwrap() + 8;
    let format = bytes.windows(4).position(|w| w == b"fmt ").unwrap() + 8;
    let channels = usize::from(bytes[format + 2]);
    let rate = f64::from(u16::from_le_bytes([bytes[format + 4], bytes[format + 5]]));
    let frame = 2 * channels;
    let click_s = 0.15;
    for k in 0..30 {
        let at = data + frame * ((click_s * rate) as usize + k);
        for c in 0..channels {
            let loud: i16 = if k % 2 == 0 { 9000 } else { -9000 };
            bytes[at + 2 * c..at + 2 * c + 2].copy_from_slice(&loud.to_le_bytes());
        }
    }
    std::fs::write(&wav, bytes).unwrap();
    let (found, figures) = figures(folder.path());
    let impacts = |run: &str| found.curves.iter().find(|c| c.run == run).unwrap().measured[0].len();
    let sounds = planes(titled(&figures, "The sound"));
    assert_eq!(sounds.len(), 3);
    for sound in sounds {
        let run = sound.title.strip_prefix("run ").unwrap().split(':').next().unwrap();
        assert!(sound.x_label == "time (s)" && sound.y_label.starts_with("sound"));
        assert!(points(sound, Shape::Area, Colour::Ink).len() > 500);
        let heard = points(sound, Shape::Dots, Colour::Data);
        // Of the last impact nothing is known but when it was.
        assert_eq!(heard.len(), impacts(run) + 1, "{heard:?}");
        let expected = points(sound, Shape::Rings, Colour::After);
        assert_eq!(expected.len(), heard.len() - 1);
        for (e, h) in expected.iter().zip(&heard[1..]) {
            assert!((e[0] - h[0]).abs() < 5e-3, "{e:?} {h:?}");
        }
        let left_out = points(sound, Shape::Crosses, Colour::Ink);
        if run == "1" {
            assert!(left_out.len() == 1 && (left_out[0][0] - click_s).abs() < 2e-3, "{left_out:?}");
        } else {
            assert!(left_out.is_empty(), "{left_out:?}");
        }
    }
    let tables = planes(titled(&figures, "The table from above"));
    assert_eq!(tables.len(), 4);
    assert_eq!(points(tables[0], Shape::Triangles, Colour::Ink).len(), 3);
    for table in &tables[1..] {
        let heard = points(table, Shape::Dots, Colour::Data);
        let expected = points(table, Shape::Rings, Colour::After);
        assert_eq!(expected.len(), heard.len() - 1);
        // Directions scatter: in the table's fifty centimetres within four, and on the whole nearer than where it came from.
        let (mut off, mut flown) = (0.0, 0.0);
        for (e, pair) in expected.iter().zip(heard.windows(2)) {
            let far = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            assert!(far(e, &pair[1]) < 0.04, "{e:?} {pair:?}");
            off += far(e, &pair[1]);
            flown += far(&pair[0], &pair[1]);
        }
        assert!(off < flown, "{off} {flown}");
    }
}

/// The liquid stands level and holds as much at each tilt as its cut says; the weight pulls where the torque says.
#[test]
fn figure_of_a_bottle_at_its_tilts() {
    let (found, figures) = figures(&bundled("practice/liquid-tilt/c02"));
    let tilts = planes(titled(&figures, "The container at its tilts"));
    assert_eq!(tilts.len(), 6);
    let run = &found.curves[0];
    for (tilt, degrees) in tilts.iter().zip([0.0_f64, 30.0, 70.0, 100.0, 140.0, 180.0]) {
        assert_eq!(tilt.title, format!("tilted by {degrees:.0} degrees"));
        let bottle = points(tilt, Shape::Line, Colour::Ink);
        assert!((area(&bottle) - 2.0 * 0.0326 * 0.169).abs() < 1e-9);
        let surface = points(tilt, Shape::Line, Colour::After);
        assert!(surface.len() == 2 && (surface[0][1] - surface[1][1]).abs() < 1e-9, "{surface:?}");
        let wet = points(tilt, Shape::Area, Colour::After);
        assert!(area(&wet) > 0.05 * area(&bottle), "{wet:?}");
        assert!(wet.iter().all(|p| p[1] <= surface[0][1] + 1e-9));
        assert_eq!(points(tilt, Shape::Line, Colour::Before).len(), 2);
        let row = run.inputs[0].iter().position(|t| (t.to_degrees() - degrees).abs() < 0.1).unwrap();
        let pulls = points(tilt, Shape::Dots, Colour::Data)[0][0];
        assert!((pulls - run.measured[2][row] / run.measured[1][row]).abs() < 1e-12, "{pulls}");
    }
    // Upright it is a circle's area times the height: the volume that the torque tells, as the note has it.
    let upright = points(tilts[0], Shape::Area, Colour::After);
    let deep = area(&upright) / (2.0 * 0.0326);
    let volume_ml = 1e6 * std::f64::consts::PI * 0.0326_f64.powi(2) * deep;
    let note = &titled(&figures, "The container").note;
    assert!(note.contains(&format!("in {volume_ml:.0} ml (with what was found)")), "{note}: {volume_ml}");
}
