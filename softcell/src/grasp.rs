//! A grasp that answers shear with pressure (section 5.5).
//!
//! Each turn takes one picture and one pressure reading. Where the picture shows shear, or shear that runs, the wanted pressure
//! rises by a step, up to the limit; then the tip is left to settle, and home is where the markers come to rest, since a
//! growing tip moves all of them. The pressure follows by a PI law on the valve.

use hw_traits::camera::Camera;
use hw_traits::clock::Stamped;
use hw_traits::picture::Picture;
use hw_traits::pneumatics::{Pressure, Valve};
use hw_traits::{Error, ErrorKind};

use crate::flow::{TrackError, Tracker, TrackerSettings};
use crate::shear::{Motion, MotionError, MotionSettings, Moved, motion};
use crate::slip::{SlipDetector, SlipError};

/// Why the grasp stopped. The valve has been told to close, or to let air out where the pressure was too high.
#[derive(Debug, thiserror::Error)]
pub enum GraspError<E: std::fmt::Debug> {
    /// A device failed.
    #[error("{1}: {0:?}")]
    Device(E, ErrorKind),
    /// The markers cannot be followed.
    #[error(transparent)]
    Track(#[from] TrackError),
    /// Their motion cannot be judged.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// A setting of the slip detector.
    #[error(transparent)]
    Slip(#[from] SlipError),
    /// A setting out of range.
    #[error("{what} is {got}; expected {expected}")]
    Setting {
        /// Which.
        what: &'static str,
        /// What it has to be.
        expected: &'static str,
        /// What it is.
        got: f64,
    },
    /// The pressure is above the limit and its margin.
    #[error("{got_pa:.0} Pa in the tip; the limit is {limit_pa:.0} Pa")]
    OverPressure {
        /// Limit.
        limit_pa: f64,
        /// Measured pressure.
        got_pa: f64,
    },
}

/// How the grasp reacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GraspSettings {
    /// How markers are followed.
    pub tracker: TrackerSettings,
    /// Noise of one marker along one axis, pixels.
    pub sigma_px: f64,
    /// Shear of the contact from which on the grasp reacts, pixels.
    pub shear_px: f64,
    /// Pressure at first, Pa.
    pub start_pa: f64,
    /// Rise at each detected shear, Pa.
    pub step_pa: f64,
    /// Highest wanted pressure, Pa.
    pub limit_pa: f64,
    /// Measured above the limit by more than this, the grasp stops, Pa.
    pub margin_pa: f64,
    /// Pressure is settled within this of the wanted one, Pa, ...
    pub settled_pa: f64,
    /// ... for this long, s.
    pub settle_s: f64,
    /// Proportional gain: the valve's opening for each Pa that is missing, 1/Pa.
    pub proportional_per_pa: f64,
    /// Integral gain: the valve's opening for each missing Pa and second, 1/(Pa s).
    pub integral_per_pa_s: f64,
}

impl Default for GraspSettings {
    fn default() -> Self {
        Self {
            tracker: TrackerSettings::default(),
            sigma_px: 0.1,
            shear_px: 1.0,
            start_pa: 0.0,
            step_pa: 500.0,
            limit_pa: 4000.0,
            margin_pa: 400.0,
            settled_pa: 60.0,
            settle_s: 0.3,
            proportional_per_pa: 4e-4,
            integral_per_pa_s: 1.2e-3,
        }
    }
}

/// What one turn saw and did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    /// Time of the picture, s on the camera's clock.
    pub t_s: f64,
    /// Measured pressure, Pa.
    pub pressure_pa: f64,
    /// Wanted pressure, Pa.
    pub wanted_pa: f64,
    /// Motion from home; none while the tip settles.
    pub motion: Option<Motion>,
    /// Whether shear was detected in this turn.
    pub shear: bool,
    /// Whether shear was detected with no pressure left to answer it: the object may be lost.
    pub exhausted: bool,
}

/// The controller's memory.
#[derive(Debug)]
pub struct Grasp {
    settings: GraspSettings,
    tracker: Option<Tracker>,
    slip: SlipDetector,
    wanted_pa: f64,
    /// Sum of what was missing, Pa s, and when it was last added to.
    missing: f64,
    last_s: Option<f64>,
    /// Since when the pressure is settled.
    settled_since: Option<f64>,
    rebase: bool,
    moved: Vec<Moved>,
}

impl Grasp {
    /// A controller that has seen nothing yet.
    ///
    /// # Errors
    /// [`GraspError::Setting`], [`GraspError::Slip`].
    pub fn new<E: std::fmt::Debug>(settings: GraspSettings) -> Result<Self, GraspError<E>> {
        let s = &settings;
        for (what, got) in [
            ("the marker noise", s.sigma_px),
            ("the shear", s.shear_px),
            ("the step", s.step_pa),
            ("the limit", s.limit_pa),
            ("the margin", s.margin_pa),
            ("the settled band", s.settled_pa),
            ("the proportional gain", s.proportional_per_pa),
        ] {
            if !(got > 0.0 && got.is_finite()) {
                return Err(GraspError::Setting { what, expected: "a finite number above 0", got });
            }
        }
        if !(s.start_pa >= 0.0 && s.start_pa <= s.limit_pa) {
            let expected = "0 up to the limit";
            return Err(GraspError::Setting { what: "the first pressure", expected, got: s.start_pa });
        }
        // A slip is to be noticed when it covers the threshold within ten pictures; a false alarm an hour at 30 Hz.
        let slip = SlipDetector::new(s.sigma_px, 0.1 * s.shear_px, 1e5)?;
        let wanted_pa = s.start_pa;
        Ok(Self {
            settings,
            tracker: None,
            slip,
            wanted_pa,
            missing: 0.0,
            last_s: None,
            settled_since: None,
            rebase: true,
            moved: Vec::new(),
        })
    }

    /// The pressure that is wanted now, Pa.
    pub fn wanted_pa(&self) -> f64 {
        self.wanted_pa
    }

    /// One turn: picture, pressure, judgement, valve.
    ///
    /// # Errors
    /// [`GraspError`]; the valve was told to close first (to let air out after [`GraspError::OverPressure`]). The next turn goes on.
    pub fn turn<R>(&mut self, rig: &mut R) -> Result<Turn, GraspError<R::Error>>
    where
        R: Camera + Pressure + Valve,
    {
        let turn = self.judge(rig);
        let command = match &turn {
            Ok(turn) => self.command(turn),
            Err(GraspError::OverPressure { .. }) => -1.0,
            Err(_) => 0.0,
        };
        let valve = rig.open(command).map_err(device);
        // What went wrong first wins.
        turn.and_then(|t| valve.map(|()| t))
    }

    fn judge<R>(&mut self, rig: &mut R) -> Result<Turn, GraspError<R::Error>>
    where
        R: Camera + Pressure + Valve,
    {
        let pressure_pa = rig.pressure_pa().map_err(device)?.value;
        let limit_pa = self.settings.limit_pa;
        if !(pressure_pa <= limit_pa + self.settings.margin_pa) {
            return Err(GraspError::OverPressure { limit_pa, got_pa: pressure_pa });
        }
        let Stamped { t_s, value: picture } = rig.picture().map_err(device)?;
        self.follow(&picture)?;
        let settled = self.settle(t_s, pressure_pa);
        let motion = if settled { self.motion()? } else { None };
        let shear = motion.is_some_and(|m| self.shears(t_s, &m));
        let exhausted = shear && self.wanted_pa >= limit_pa;
        if shear {
            self.wanted_pa = (self.wanted_pa + self.settings.step_pa).min(limit_pa);
            self.settled_since = None;
            self.rebase = true;
        }
        Ok(Turn { t_s, pressure_pa, wanted_pa: self.wanted_pa, motion, shear, exhausted })
    }

    fn follow(&mut self, picture: &Picture<u8>) -> Result<(), TrackError> {
        match &mut self.tracker {
            Some(tracker) => tracker.next(picture).map(|_| ()),
            None => {
                self.tracker = Some(Tracker::new(picture, self.settings.tracker)?);
                Ok(())
            }
        }
    }

    /// Whether the pressure has been where it is wanted for long enough.
    fn settle(&mut self, t_s: f64, pressure_pa: f64) -> bool {
        if !((pressure_pa - self.wanted_pa).abs() <= self.settings.settled_pa) {
            self.settled_since = None;
            // Home is taken anew after any time without rest: the tip has changed its size.
            self.rebase = true;
            return false;
        }
        let since = *self.settled_since.get_or_insert(t_s);
        t_s - since >= self.settings.settle_s
    }

    /// Motion of the seen markers from home.
    fn motion(&mut self) -> Result<Option<Motion>, MotionError> {
        let Some(tracker) = &mut self.tracker else { return Ok(None) };
        if std::mem::take(&mut self.rebase) {
            tracker.rebase();
            self.slip.reset();
        }
        self.moved.clear();
        let seen = tracker.tracks().iter().filter(|t| t.seen());
        self.moved.extend(seen.map(|t| Moved { home: t.home_px, by: t.by_px() }));
        motion(&self.moved, &MotionSettings::new(self.settings.sigma_px)).map(Some)
    }

    fn shears(&mut self, t_s: f64, m: &Motion) -> bool {
        let far = m.shear[0].hypot(m.shear[1]) >= self.settings.shear_px;
        let runs = self.slip.push(t_s, m.mean).is_some();
        m.shear_part.present && (far || runs)
    }

    /// PI law with its sum held where the valve is at its stop.
    fn command(&mut self, turn: &Turn) -> f64 {
        let error = self.wanted_pa - turn.pressure_pa;
        let dt_s = self.last_s.map_or(0.0, |last| (turn.t_s - last).clamp(0.0, 0.2));
        self.last_s = Some(turn.t_s);
        let GraspSettings { proportional_per_pa: p, integral_per_pa_s: i, .. } = self.settings;
        let missing = self.missing + error * dt_s;
        let wanted = p * error + i * missing;
        if wanted.abs() < 1.0 {
            self.missing = missing;
        }
        wanted.clamp(-1.0, 1.0)
    }
}

fn device<E: Error>(error: E) -> GraspError<E> {
    let kind = error.kind();
    GraspError::Device(error, kind)
}
