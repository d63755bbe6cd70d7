//! From drops that were read to a recording with its model.

use bounce_audio::missed::{typical_restitution, unheard};
use missing_physics::data::Recording;
use missing_physics::model::{Model as _, Quantity};

use super::array::Microphones;
use super::drop::Drop;
use super::effects::Effects;
use super::experiments::{experiments, of_times};
use super::figure::{Shown, figures};
use super::model::{BounceModel, copies};
use super::read::{Heard, Rig};
use super::rows::Rows;
use super::setup::Setup;
use super::sound::Wave;
use super::spec::build;
use super::spread::{Calibration, judge, released};
use super::times::{TimesModel, build_times};
use crate::domain::{Contents, Loaded, RunContents};
use crate::reading::resolution;

/// A ball that keeps all its speed cannot be, but clocks err.
const LIKELY_RESTITUTION: [f64; 2] = [0.05, 1.2];

/// The drops of a recording with all that is known of them: impacts that went unheard are marked.
pub(super) struct Drops {
    heard: Vec<Heard>,
    rig: Rig,
    calibration: Calibration,
    microphones: Microphones,
    setup: Setup,
    restitution: f64,
    /// What each drop sounded like, where it was heard.
    waves: Vec<Wave>,
}

impl Drops {
    pub(super) fn new(
        mut heard: Vec<Heard>,
        rig: Rig,
        calibration: Calibration,
        microphones: Microphones,
    ) -> Self {
        let (restitution, missed) = mark_unheard(&mut heard, &rig);
        let setup = Setup {
            gravity_m_s2: rig.gravity_m_s2,
            drag_unit: rig.drag_unit,
            placed: heard.iter().any(|h| !h.drop.places_m.is_empty()),
            dropped: rig.drop_height_m.is_some(),
            released: released(heard.len()),
            listened: heard.iter().any(|h| !h.drop.loudness.is_empty()),
            unheard: [missed, heard.len()],
            microphones: microphones.places_m.len(),
        };
        let waves = Vec::new();
        Self { heard, rig, calibration, microphones, setup, restitution, waves }
    }

    /// The same drops with what they sounded like.
    pub(super) fn sounding(self, waves: Vec<Wave>) -> Self {
        Self { waves, ..self }
    }

    /// What the recording holds.
    pub(super) fn contents(&self) -> Contents {
        let spare = self.microphones.spare();
        let placed = self.setup.placed;
        let channels = if placed { placed_channels(spare) } else { timed_channels() };
        let calibration =
            if placed { self.placed_calibration(channels.len()) } else { vec![None; channels.len()] };
        let run = |h: &Heard| {
            let rows = if placed { Rows::of(&h.drop, spare).heard } else { 0..h.numbers.len() };
            RunContents::new(&h.label, &h.numbers[rows])
        };
        let spec = if placed {
            build(&self.setup, self.restitution).0.build_unchecked()
        } else {
            build_times(&self.setup, self.restitution).0
        };
        let variable = Quantity::new("bounce", "");
        Contents { channels, calibration, variable, runs: self.heard.iter().map(run).collect(), spec }
    }

    /// The sigma of each channel, where it was calibrated. What directions scatter beyond it is judged before, and weighed with it.
    fn placed_calibration(&self, channels: usize) -> Vec<Option<f64>> {
        let Calibration { time_s, place_m: [x, y], .. } = self.calibration;
        let mut calibration = vec![time_s, x.or(y), y.or(x)];
        calibration.resize(channels, None);
        calibration
    }

    /// The recording with its model; on failure the row of the drop that makes no sense, and what was expected.
    pub(super) fn assemble(self) -> Result<Loaded, (usize, String)> {
        if self.setup.placed { self.placed() } else { Ok(self.timed()) }
    }

    /// Times and places: impact by impact.
    fn placed(self) -> Result<Loaded, (usize, String)> {
        let mut nominal = Effects::none(self.setup.gravity_m_s2, self.restitution);
        let mut drops: Vec<Drop> = self.heard.iter().map(|h| h.drop.clone()).collect();
        expect_first(&mut drops, &mut nominal);
        let senseless = |h: &Heard| {
            let label = crate::recording::quoted(&h.label);
            (h.row, format!("times and places of a bouncing ball in run {label}"))
        };
        let judged = judge(&drops, &Effects { unheard: 1.0, ..nominal }, self.calibration)
            .map_err(|drop| senseless(&self.heard[drop]))?;
        let kappa = judged.spread.kappa;
        (nominal.heads, nominal.outwards_per_m) = (judged.heads, judged.outwards_per_m);
        let mut model = BounceModel::new(
            self.setup,
            nominal,
            (judged.spread, judged.plausible),
            self.microphones.clone(),
        );
        let copies = copies(drops.len());
        let mut runs = Vec::new();
        for (h, linear) in self.heard.iter().zip(judged.drops) {
            runs.push(model.run(&h.label, linear, &h.drop, &h.numbers, copies).ok_or_else(|| senseless(h))?);
        }
        let channels = placed_channels(self.microphones.spare());
        let calibration = self.placed_calibration(channels.len());
        let recording = Recording {
            resolution: vec![0.0; channels.len()],
            calibration,
            channels,
            variables: vec![
                Quantity::new("bounce", ""),
                Quantity::new("speed_m_s", "m/s"),
                Quantity::new("x_m", "m"),
                Quantity::new("y_m", "m"),
            ],
            runs,
            noise_along: Some(0),
        };
        let mut undetermined = vec![format!(
            "how a direction was scattered and how a place was misheard are told apart by the lengths of the flights alone \
             (here: kappa about {:.0})",
            kappa
        )];
        if !self.setup.dropped {
            undetermined.push(UNTIED.into());
        }
        let experiments = experiments(&mut model);
        let shown = Shown::new(&self.heard, drops, self.microphones.places_m, self.waves);
        Ok(Loaded::drawn(recording, model, experiments, undetermined, move |model, d| {
            figures(&shown, model.spec(), &|shared| model.effects(shared), d)
        }))
    }

    /// Times alone.
    fn timed(self) -> Loaded {
        let mut model = TimesModel::new(
            self.setup,
            self.restitution,
            self.rig.drop_height_m,
            self.calibration.time_s.is_some(),
        );
        self.heard.iter().for_each(|h| model.heard(&h.label, &h.drop, self.restitution));
        let times: Vec<f64> = self.heard.iter().flat_map(|h| h.drop.times_s.iter().copied()).collect();
        // Directions scatter the times beyond the clock's noise, so that a calibrated clock is the least there is.
        let least = self.calibration.time_s.map_or(0.0, |sigma| sigma * 12f64.sqrt());
        let recording = Recording {
            channels: timed_channels(),
            variables: vec![
                Quantity::new("bounce", ""),
                Quantity::new("known_gaps", ""),
                Quantity::new("found_gaps", ""),
            ],
            runs: self.heard.iter().map(|h| TimesModel::run(&h.label, &h.drop, &h.numbers)).collect(),
            noise_along: Some(0),
            calibration: vec![None],
            resolution: vec![resolution(&times).max(least)],
        };
        let mut undetermined = vec![
            "times alone say nothing of where the ball went: a tilt, friction and the scale of places are not seen".into(),
        ];
        if !self.setup.dropped {
            undetermined.push(UNTIED.into());
        }
        if self.heard.len() == 1 {
            undetermined.push(
                "in a single drop, an error that wanders along it would look like physics: drop it again"
                    .into(),
            );
        }
        let experiments = of_times(&model, self.restitution, self.setup.gravity_m_s2);
        let drops = self.heard.iter().map(|h| h.drop.clone()).collect();
        let shown = Shown::new(&self.heard, drops, self.microphones.places_m, self.waves);
        Loaded::drawn(recording, model, experiments, undetermined, move |model, d| {
            figures(&shown, model.spec(), &|shared| model.effects(shared), d)
        })
    }
}

/// Channels of times and places, and of arrivals beyond those that place and time need.
fn placed_channels(spare: usize) -> Vec<Quantity> {
    let mut channels = vec![Quantity::new("t_s", "s"), Quantity::new("x_m", "m"), Quantity::new("y_m", "m")];
    channels.extend((0..spare).map(|k| {
        let name = if spare == 1 { "arrival_s".to_owned() } else { format!("arrival_{}_s", k + 1) };
        Quantity::new(name, "s")
    }));
    channels
}

fn timed_channels() -> Vec<Quantity> {
    vec![Quantity::new("t_s", "s")]
}

/// The typical restitution, and in how many drops an impact went unheard; where it did is marked in them.
fn mark_unheard(heard: &mut [Heard], rig: &Rig) -> (f64, usize) {
    let durations: Vec<Vec<f64>> =
        heard.iter().map(|h| h.drop.times_s.windows(2).map(|w| w[1] - w[0]).collect()).collect();
    let of_drop = rig.drop_height_m.map(|h| (8.0 * h / rig.gravity_m_s2).sqrt());
    let restitution = typical_restitution(durations.iter().map(Vec::as_slice))
        .or_else(|| Some(durations.first()?.first()? / of_drop?))
        .unwrap_or(0.8)
        .clamp(LIKELY_RESTITUTION[0], LIKELY_RESTITUTION[1]);
    let mut missed = 0;
    for (h, durations) in heard.iter_mut().zip(&durations) {
        // A sound begins anywhere: the first impact in it need not be where the fall ended.
        let listened = !h.drop.loudness.is_empty();
        let before = of_drop.zip(durations.first()).filter(|_| listened);
        let before = before.map_or(0, |(fall, first)| begins_late(first / fall, restitution));
        (h.drop.unheard[0], h.drop.known[0]) = (before, before);
        for (found, m) in h.drop.unheard.iter_mut().skip(1).zip(unheard(durations, restitution, None)) {
            *found = (*found).max(m);
        }
        missed += usize::from(h.drop.unheard != h.drop.known);
    }
    (restitution, missed)
}

/// How many impacts are before the first that was heard, where the first flight lasted a part `first` of that on which it would have
/// fallen from its height: as many as shorten flights by so much, if that is a whole number and no error of a clock or a height.
fn begins_late(first: f64, restitution: f64) -> usize {
    /// A restitution above this tells one impact from the next no better than a wrong clock would.
    const STEADY: f64 = 0.93;
    /// How near to a whole number.
    const NEAR: f64 = 0.25;
    let shortened = (first / restitution).ln() / restitution.ln();
    let whole = shortened.round();
    if restitution < STEADY && whole >= 1.0 && (shortened - whole).abs() < NEAR { whole as usize } else { 0 }
}

/// Where balls are expected to land, and to head where their fall is not known: a tilted table, or a hand, may send all of them one
/// way.
fn expect_first(drops: &mut [Drop], nominal: &mut Effects) {
    let headings: Vec<[f64; 2]> = drops.iter().map(|d| d.heading(0, nominal)).collect();
    let places: Vec<[f64; 2]> = drops.iter().map(|d| d.places_m[0]).collect();
    let mean =
        |all: &[[f64; 2]]| [0, 1].map(|k| all.iter().map(|v| v[k]).sum::<f64>() / all.len().max(1) as f64);
    let (usual, middle) = (mean(&headings), mean(&places));
    if drops.iter().all(|d| d.height_m.is_none()) {
        nominal.heads = usual;
    }
    let (mut together, mut square) = (0.0, 0.0);
    for (heading, place) in headings.iter().zip(&places) {
        for k in 0..2 {
            together += (heading[k] - usual[k]) * (place[k] - middle[k]);
            square += (place[k] - middle[k]).powi(2);
        }
    }
    // A beginning: places are measured with errors, which makes it too small.
    nominal.outwards_per_m = if released(drops.len()) && square > 0.0 { together / square } else { 0.0 };
    for drop in drops {
        drop.middle_m = middle;
    }
}

const UNTIED: &str = "without drop_height_m nothing ties the clock to gravity";

#[cfg(test)]
mod tests {
    use super::begins_late;

    #[test]
    fn a_sound_that_begins_late_is_told_from_a_wrong_clock() {
        for before in 0..4 {
            assert_eq!(begins_late(0.8f64.powi(before + 1), 0.8), before as usize);
        }
        // A clock that is four per cent off, a fall from a hand's breadth more.
        assert_eq!(
            [begins_late(0.8 * 0.96, 0.8), begins_late(0.8 * 1.1, 0.8), begins_late(0.9, 0.96)],
            [0; 3]
        );
    }
}
