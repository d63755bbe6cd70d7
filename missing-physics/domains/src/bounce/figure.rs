//! What a drop sounded like with its impacts, and the table from above.

use missing_physics::diagnosis::Diagnosis;
use missing_physics::model::Spec;
use missing_physics_report::{Colour, Figure, Mark, Panel, Plane, Shape, shown};

use super::drop::Drop;
use super::effects::Effects;
use super::expected::Expected;
use super::read::Heard;
use super::sound::Wave;
use crate::figures::Fit;

/// Most runs that are drawn.
const MOST: usize = 6;

/// What is drawn of a recording.
pub(super) struct Shown {
    labels: Vec<String>,
    drops: Vec<Drop>,
    microphones_m: Vec<[f64; 3]>,
    waves: Vec<Wave>,
}

impl Shown {
    pub(super) fn new(
        heard: &[Heard],
        drops: Vec<Drop>,
        microphones_m: Vec<[f64; 3]>,
        waves: Vec<Wave>,
    ) -> Self {
        Self { labels: heard.iter().map(|h| h.label.clone()).collect(), drops, microphones_m, waves }
    }
}

/// The runs that miss most, as sound and from above, with the impacts that the fitted model expects.
pub(super) fn figures(
    recording: &Shown,
    spec: &Spec,
    effects: &dyn Fn(&[f64]) -> Effects,
    d: &Diagnosis,
) -> Vec<Figure> {
    let fit = Fit::last(d);
    let effects = effects(&fit.shared(spec, d));
    let (mut sounds, mut tables) = (Vec::new(), Vec::new());
    for curves in shown(d).into_iter().take(MOST).filter_map(|run| d.curves.get(run)) {
        let Some(at) = recording.labels.iter().position(|label| *label == curves.run) else { continue };
        let drop = &recording.drops[at];
        let expected = drop.expected(&effects);
        if let Some(wave) = recording.waves.get(at) {
            sounds.push(Panel::Plane(sound(&curves.run, wave, drop, &expected, fit.colour())));
        }
        if !drop.places_m.is_empty() {
            tables.push(Panel::Plane(table(&curves.run, drop, &expected, fit.colour())));
        }
    }
    if !tables.is_empty() {
        tables.insert(0, Panel::Plane(whole(&recording.drops, &recording.microphones_m)));
    }
    let words = match fit {
        Fit::Before => "expected by the simulation, each from the flight before it (ring)",
        Fit::After => "expected with what was found, each from the flight before it (ring)",
    };
    let mut key = vec![(Colour::Data, "heard (dot)".to_owned()), (fit.colour(), words.into())];
    let which =
        if d.curves.len() > MOST { format!(" of the {MOST} runs that miss most") } else { String::new() };
    let above = Figure {
        title: format!("The table from above{which}"),
        panels: tables,
        key: key.clone(),
        note: "Impacts are numbered as they were heard, triangles are microphones. From each impact a line leads to where the next was \
               expected; a ring that it passes on its way is an impact that went unheard."
            .into(),
    };
    key.push((Colour::Ink, "heard and left out: it fits no bounce (cross)".into()));
    let heard = Figure {
        title: format!("The sound{which}"),
        panels: sounds,
        key,
        note: "The first microphone. A ring without a dot is an impact that went unheard.".into(),
    };
    vec![heard, above]
}

/// A run as it sounded; above it what was heard, what was left out, and what was expected.
fn sound(label: &str, wave: &Wave, drop: &Drop, expected: &[Expected], colour: Colour) -> Plane {
    let loudest = wave.envelope.iter().flat_map(|(_, ends)| ends.map(f64::abs)).fold(0.0, f64::max);
    let level = 1.2 * loudest;
    let edge = |k: usize| wave.envelope.iter().map(move |(t_s, ends)| [*t_s, ends[k]]);
    let outline = edge(1).chain(edge(0).rev()).collect();
    let lines = drop.times_s.iter().flat_map(|t_s| [[*t_s, -loudest], [*t_s, level], [f64::NAN; 2]]);
    let row = |times: &mut dyn Iterator<Item = f64>| times.map(|t_s| [t_s, level]).collect::<Vec<_>>();
    let unheard = expected.iter().filter(|e| e.heard.is_none()).count();
    let marks = vec![
        Mark::new(Shape::Thin, Colour::Soft, lines.collect()),
        Mark::new(Shape::Area, Colour::Ink, outline).named("sound of the first microphone"),
        Mark::new(Shape::Rings, colour, row(&mut expected.iter().map(|e| e.t_s)))
            .named(format!("{} impacts expected, {unheard} of them unheard", expected.len())),
        Mark::new(Shape::Dots, Colour::Data, row(&mut drop.times_s.iter().copied()))
            .named(format!("{} impacts heard", drop.times_s.len())),
        Mark::new(Shape::Crosses, Colour::Ink, row(&mut wave.strays_s.iter().copied()))
            .named(format!("{} sounds left out", wave.strays_s.len())),
    ];
    Plane {
        title: format!(
            "run {label}: {} impacts, {} sounds left out",
            drop.times_s.len(),
            wave.strays_s.len()
        ),
        x_label: "time (s)".into(),
        y_label: "sound (of full scale)".into(),
        square: false,
        equal: false,
        marks,
    }
}

/// The table with its microphones, and where the ball was heard in all runs.
fn whole(drops: &[Drop], microphones_m: &[[f64; 3]]) -> Plane {
    let microphones: Vec<[f64; 2]> = microphones_m.iter().map(|m| [m[0], m[1]]).collect();
    let places = drops.iter().flat_map(|drop| drop.places_m.iter().copied()).collect();
    Plane {
        title: if drops.len() == 1 { "one run".into() } else { format!("all {} runs", drops.len()) },
        x_label: "x (m)".into(),
        y_label: "y (m)".into(),
        square: true,
        equal: true,
        marks: vec![
            Mark::new(Shape::Dots, Colour::Data, places).named("heard"),
            Mark::new(Shape::Triangles, Colour::Ink, microphones).named("microphones"),
        ],
    }
}

/// The table in a run: where the ball was heard, and from each impact to where it was expected next.
fn table(label: &str, drop: &Drop, expected: &[Expected], colour: Colour) -> Plane {
    // A way over impacts that went unheard leads on from them.
    let mut ways: Vec<[f64; 2]> = Vec::new();
    for (i, e) in expected.iter().enumerate() {
        if i == 0 || expected[i - 1].heard.is_some() {
            ways.extend([[f64::NAN; 2], drop.places_m[e.after]]);
        }
        ways.push(e.place_m);
    }
    let numbered = |(i, place): (usize, &[f64; 2])| {
        Mark::new(Shape::Text, Colour::Soft, vec![*place]).named((i + 1).to_string())
    };
    let mut marks = vec![
        Mark::new(Shape::Thin, Colour::Soft, drop.places_m.clone()),
        Mark::new(Shape::Thin, colour, ways),
        Mark::new(Shape::Rings, colour, expected.iter().map(|e| e.place_m).collect())
            .named("expected from the flight before"),
        Mark::new(Shape::Dots, Colour::Data, drop.places_m.clone()).named("heard"),
    ];
    marks.extend(drop.places_m.iter().enumerate().map(numbered));
    Plane {
        title: format!("run {label}"),
        x_label: "x (m)".into(),
        y_label: "y (m)".into(),
        square: true,
        equal: true,
        marks,
    }
}
