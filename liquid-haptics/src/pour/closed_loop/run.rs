//! A pour from the first weighing to the last.

use hw_traits::Severity;
use hw_traits::force_torque::ForceTorque;
use hw_traits::rotary::Rotary;

use super::error::of_device;
use super::filter::Filter;
use super::joint::{Joint, STEADY_RAD_S};
use super::plan::{ClosedLoop, Moment, Phase, Poured};
use super::stream::Stream;
use super::{ClosedLoopError, PourError};

/// How often a device that gives no answer is asked again.
const TRIES: usize = 5;
/// Head (m) below the one at which the bead is said to break, where the wrist weighs a last time before it pours.
const BEFORE_M: f64 = 2.5e-3;
/// How fast the surface rises over the lip until something flows, m/s.
const CREEP_M_S: f64 = 1e-3;
/// What has to have left for a flow to have begun, m^3, and in standard errors.
const BEGUN_M3: f64 = 1e-6;
const BEGUN_ERRORS: f64 = 4.0;
/// How loosely the volume is held before, mL per root of a second.
const LOOSE_ML: f64 = 1.0;
/// How well the bead at which a stream stops is known when the flow begins, mm.
const CREST_MM: f64 = 1.5;
/// Time in which the wrist makes up for a head that is not the wanted one, s.
const HEAD_S: f64 = 0.3;
/// What is left on its way at the end of the last, slow part, m^3.
const LAST_M3: f64 = 0.6e-6;
/// Most that is on its way while it pours, m^3.
const MOST_M3: f64 = 2e-6;
/// Where less than that (m^3) leaves in that time (s), and four lags, nothing flows any more.
const STALL_M3: f64 = 1e-6;
const STALL_S: f64 = 8.0;
/// Longest time of the last part over what flows then, s.
const SLOWING_S: f64 = 3.0;

pub(super) type Outcome<T, D> = Result<T, ClosedLoopError<<D as hw_traits::ErrorType>::Error>>;

/// A pour under way.
pub(super) struct Run<'a, 'd, D: Rotary + ForceTorque> {
    plan: &'a ClosedLoop<'a>,
    device: &'d mut D,
    stream: Stream<'a>,
    filter: Filter<'a>,
    observer: &'d mut dyn FnMut(&Moment),
    begin_s: Option<f64>,
    t_s: f64,
    joint: Joint,
    /// How much older the last block is than the last tilt, s.
    delay_s: f64,
}

impl<'a, 'd, D: Rotary + ForceTorque> Run<'a, 'd, D> {
    /// Before the first reading.
    pub(super) fn new(
        plan: &'a ClosedLoop<'a>,
        device: &'d mut D,
        observer: &'d mut dyn FnMut(&Moment),
    ) -> Self {
        let stream = Stream {
            pour: plan.pour,
            inside_m3: plan.inside.volume_m3,
            viscosity_m2_s: plan.inside.viscosity_m2_s,
            gravity_m_s2: plan.gravity_m_s2,
        };
        let filter = Filter::new(stream, plan.scale, plan.inside.density_kg_m3);
        Self {
            plan,
            device,
            stream,
            filter,
            observer,
            begin_s: None,
            t_s: f64::NEG_INFINITY,
            joint: Joint::default(),
            delay_s: 0.0,
        }
    }

    /// Sends the wrist upright; one that does not answer cannot be helped.
    pub(super) fn give_up(&mut self) {
        let upright = self.upright_rad();
        let _ = self.device.turn_to(upright, self.plan.manner.turn_rad_s);
    }

    fn upright_rad(&self) -> f64 {
        let (least, most) = self.device.limits_rad();
        0f64.clamp(least, most)
    }

    fn steepest_rad(&self) -> f64 {
        self.plan.pour.steepest_rad.min(self.device.limits_rad().1)
    }

    /// All of it.
    pub(super) fn whole(&mut self, wanted_m3: f64) -> Outcome<Poured, D> {
        let manner = self.plan.manner;
        self.turn(self.upright_rad())?;
        self.settle(Phase::Upright)?;
        self.weigh(Phase::Upright, manner.weigh_s)?;
        self.turn(self.lip_rad()?)?;
        self.settle(Phase::ToTheLip)?;
        self.weigh(Phase::ToTheLip, manner.weigh_s)?;
        self.creep()?;
        let predicted_m3 = self.flow(wanted_m3)?;
        let passed_error_m3 = self.filter.passed_error_m3();
        self.turn(self.upright_rad())?;
        self.settle(Phase::Back)?;
        self.weigh(Phase::Back, 1.0 + 4.0 * self.stream.lag_s())?;
        self.weigh(Phase::After, manner.weigh_s)?;
        let volume_m3 = self.filter.poured_m3();
        let share = self.plan.inside.density_error_share;
        let error_m3 = self.filter.error_m3().hypot(share * volume_m3);
        let half = 1.96 * error_m3;
        Ok(Poured {
            volume_m3,
            error_m3,
            interval_m3: [(volume_m3 - half).max(0.0), volume_m3 + half],
            predicted_m3,
            predicted_error_m3: passed_error_m3.hypot(share * predicted_m3),
            took_s: self.t_s - self.begin_s.unwrap_or(self.t_s),
        })
    }

    /// The tilt at which the surface stands a little below where the bead is said to break.
    fn lip_rad(&self) -> Result<f64, PourError> {
        let pour = &self.plan.pour;
        let before = pour.bead.hold_m() - BEFORE_M;
        let tilt = pour.first_tilt(0.0, before, self.stream.inside_m3)?.unwrap_or(0.0);
        Ok(tilt.min(self.steepest_rad()))
    }

    fn turn(&mut self, to_rad: f64) -> Outcome<(), D> {
        self.turn_at(to_rad, self.plan.manner.turn_rad_s)
    }

    fn turn_at(&mut self, to_rad: f64, rate_rad_s: f64) -> Outcome<(), D> {
        self.ask(|device| device.turn_to(to_rad, rate_rad_s))
    }

    /// Asks the device, and again where that may help.
    fn ask<T>(&mut self, mut question: impl FnMut(&mut D) -> Result<T, D::Error>) -> Outcome<T, D> {
        let mut tries = 0;
        loop {
            tries += 1;
            match question(self.device) {
                Ok(answer) => return Ok(answer),
                Err(error) => {
                    let transient = hw_traits::Error::kind(&error).severity() == Severity::Transient;
                    if !transient || tries == TRIES {
                        return Err(of_device::<D>(error, tries, self.filter.poured_m3()));
                    }
                }
            }
        }
    }

    fn settle(&mut self, phase: Phase) -> Outcome<(), D> {
        while !self.ask(D::settled)? {
            self.block(phase)?;
        }
        Ok(())
    }

    fn weigh(&mut self, phase: Phase, duration_s: f64) -> Outcome<(), D> {
        let first = self.block(phase)?;
        while self.t_s < first.t_s + duration_s {
            self.block(phase)?;
        }
        Ok(())
    }

    /// Turns on slowly until something has left.
    fn creep(&mut self) -> Outcome<(), D> {
        let steepest = self.steepest_rad();
        let mut waits_from = None;
        loop {
            let moment = self.block(Phase::Creeping)?;
            if moment.poured_m3 > BEGUN_M3.max(BEGUN_ERRORS * moment.error_m3) {
                self.filter.begin(CREST_MM);
                return Ok(());
            }
            let tilt = self.joint.now_rad();
            if tilt > steepest - 1e-3 {
                let from = *waits_from.get_or_insert(moment.t_s);
                if moment.t_s > from + 3.0 + 4.0 * self.stream.lag_s() {
                    let inside_m3 = self.stream.inside_m3;
                    return Err(ClosedLoopError::NothingFlows { tilt_rad: tilt, inside_m3 });
                }
            }
            let rate = (CREEP_M_S / self.rise_m(tilt, self.filter.crest_m())?).clamp(1e-3, 0.1);
            self.turn_at(steepest, rate)?;
        }
    }

    /// How fast the surface rises over the lip with the tilt, m/rad.
    fn rise_m(&self, tilt: f64, crest_m: f64) -> Result<f64, PourError> {
        let left = self.filter.poured_m3();
        let half = 2e-3;
        let high = self.stream.head_m(tilt + half, left, crest_m)?;
        Ok(((high - self.stream.head_m(tilt - half, left, crest_m)?) / (2.0 * half)).max(5e-3))
    }

    /// Pours until turning back makes up the wanted volume; what is then predicted.
    fn flow(&mut self, wanted_m3: f64) -> Outcome<f64, D> {
        let manner = self.plan.manner;
        let steepest = self.steepest_rad();
        let mut risen = None;
        loop {
            let moment = self.block(Phase::Pouring)?;
            let missing = wanted_m3 - moment.if_stopped_m3;
            if missing <= 0.0 {
                return Ok(moment.if_stopped_m3);
            }
            let lag = self.stream.lag_s();
            let last = manner.last_flow_m3_s.min(LAST_M3 / (lag + 0.3));
            let most = manner.flow_m3_s.min(MOST_M3 / lag).max(last);
            let wanted_flow = (missing / (SLOWING_S + lag)).clamp(last, most);
            let (from_s, from_m3) = *risen.get_or_insert((moment.t_s, moment.poured_m3));
            if moment.poured_m3 > from_m3 + STALL_M3 {
                risen = None;
            } else if moment.t_s > from_s + STALL_S + 4.0 * lag {
                return Err(ClosedLoopError::RanDry { poured_m3: moment.poured_m3, wanted_m3 });
            }
            let tilt = self.joint.now_rad();
            let head = self.stream.head_m(tilt, self.filter.poured_m3(), self.filter.crest_m())?;
            let wanted_head = self.stream.head_for_m(tilt, wanted_flow, self.filter.factor());
            let change = (wanted_head - head) / self.rise_m(tilt, self.filter.crest_m())?;
            let fastest = 0.8 * STEADY_RAD_S;
            let rate = (change / (HEAD_S + 2.0 * lag)).clamp(-fastest, fastest);
            // A second's way ahead, so that the wrist does not stop between two commands.
            let to = (tilt + rate).clamp(self.upright_rad(), steepest);
            self.turn_at(to, rate.abs().max(1e-4))?;
        }
    }

    /// Reads a block, and lets the filter see it.
    fn block(&mut self, phase: Phase) -> Outcome<Moment, D> {
        let (t_s, force) = self.mean()?;
        let poured = self.filter.poured_m3();
        let angle = self.ask(D::angle_rad)?;
        if !angle.value.is_finite() {
            return Err(ClosedLoopError::NotFinite { t_s: angle.t_s });
        }
        let begin = *self.begin_s.get_or_insert(t_s);
        let patience_s = self.plan.manner.patience_s;
        if t_s > begin + patience_s {
            return Err(ClosedLoopError::TimeOut { poured_m3: poured, patience_s });
        }
        self.joint.push(angle.t_s, angle.value);
        self.delay_s = (angle.t_s - t_s).clamp(0.0, 1.0);
        let tilt = self.joint.at(t_s);
        let dt = if self.t_s.is_finite() { t_s - self.t_s } else { 0.0 };
        self.t_s = t_s;
        self.filter.predict(dt, tilt)?;
        if phase == Phase::Creeping {
            self.filter.look(dt, LOOSE_ML);
        }
        if self.joint.steady(t_s) {
            self.filter.update(force, tilt, self.plan.manner.readings);
        }
        let pours = phase == Phase::Pouring;
        let moment = Moment {
            t_s,
            phase,
            tilt_rad: tilt,
            poured_m3: self.filter.poured_m3(),
            error_m3: self.filter.error_m3(),
            flow_m3_s: self.filter.flow_m3_s(tilt)?,
            flow_error_m3_s: self.filter.flow_error_m3_s(tilt)?,
            if_stopped_m3: if pours {
                self.filter.after_turning_back_m3(tilt, self.delay_s, self.plan.manner.turn_rad_s)?
            } else {
                self.filter.poured_m3()
            },
        };
        (self.observer)(&moment);
        Ok(moment)
    }

    /// Mean time and mean force along x and y of a block of readings.
    fn mean(&mut self) -> Outcome<(f64, [f64; 2]), D> {
        let readings = self.plan.manner.readings;
        let (mut time, mut force, mut last) = (0.0, [0.0; 2], self.t_s);
        for _ in 0..readings {
            let reading = self.ask(D::read)?;
            let [fx, fy, _] = reading.value.force_n;
            if !(reading.t_s.is_finite() && fx.is_finite() && fy.is_finite()) {
                return Err(ClosedLoopError::NotFinite { t_s: reading.t_s });
            }
            if reading.t_s <= last {
                return Err(ClosedLoopError::Time { t_s: reading.t_s, before_s: last });
            }
            last = reading.t_s;
            time += reading.t_s / readings as f64;
            force = [force[0] + fx / readings as f64, force[1] + fy / readings as f64];
        }
        Ok((time, force))
    }
}
