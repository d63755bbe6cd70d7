//! Pouring with the scale in the loop: the wrist weighs while it pours, and turns back in time for what is still on its way.
//!
//! [Matl 2021], section 2.7, leaves it as its outlook. The weight is the length of the measured force: where the liquid lies in the container
//! does not matter to it, so that neither slosh nor a thick liquid's lag within does. An extended Kalman filter holds the volume that has come
//! off the lip and that has passed it, the height of the bead, a factor of the flow, the lag of what hangs from the lip (its prior from the
//! viscosity), and the sensor's offset, wander and drift along two axes that turn with the wrist. What will still leave while it turns back is
//! predicted by the same law; the wrist turns back when that makes up the wanted volume. The torque is not used.

mod error;
mod filter;
mod joint;
mod stream;

use hw_traits::force_torque::ForceTorque;
use hw_traits::rotary::Rotary;

pub use error::ClosedLoopError;

use super::{Pour, PourError};
use error::of_device;
use filter::Filter;
use joint::{Joint, STEADY_RAD_S};
use stream::Stream;

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

/// How good the sensor is; the filter's prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Standard deviation of a reading's force, N.
    pub noise_n: f64,
    /// Error of a mean of readings that does not fall with their number, N.
    pub block_n: f64,
    /// Standard deviation of a wander along each axis, N.
    pub wander_n: f64,
    /// How long the wander remembers, s.
    pub wander_s: f64,
    /// Standard deviation of a constant offset, N; the turn to the lip tells it apart from the weight.
    pub offset_n: f64,
    /// Standard deviation of a drift, N/s.
    pub drift_n_s: f64,
    /// Standard deviation of the measured tilt's error, rad.
    pub tilt_rad: f64,
}

impl Scale {
    /// The simulated ATI Axia80 of [Matl 2021], section 2.5: 0.1 N a reading, a wander of 2 mN over 30 s, offsets of half a newton, a drift of
    /// 0.1 mN/s, a tilt known to 2 mrad.
    pub const AXIA80: Self = Self {
        noise_n: 0.105,
        block_n: 2e-3,
        wander_n: 2e-3,
        wander_s: 30.0,
        offset_n: 0.5,
        drift_n_s: 1e-4,
        tilt_rad: 2e-3,
    };
}

/// What is known of the liquid before it is poured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inside {
    /// Volume inside, m^3.
    pub volume_m3: f64,
    /// Density, kg/m^3, as the same sensor weighs it: a gain of the forces that mass and pour share cancels.
    pub density_kg_m3: f64,
    /// Standard error of that, as a share.
    pub density_error_share: f64,
    /// Kinematic viscosity (m^2/s), to a factor of two.
    pub viscosity_m2_s: f64,
}

/// How to pour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manner {
    /// Readings of which the mean is taken before the filter sees them.
    pub readings: usize,
    /// How long the wrist weighs before the flow, upright and again at the lip, and after it, s.
    pub weigh_s: f64,
    /// Fastest flow, m^3/s.
    pub flow_m3_s: f64,
    /// Slowest flow, at which a thin liquid is stopped, m^3/s; thick ones are slower by their lag.
    pub last_flow_m3_s: f64,
    /// Rate of turning to the lip and back from it, rad/s.
    pub turn_rad_s: f64,
    /// Longest time of all, s.
    pub patience_s: f64,
}

impl Default for Manner {
    /// Means of 156 readings (50 a second of 7812), 3 s of weighing, 8 mL/s down to 1.2, turns at 1 rad/s, patience of 300 s.
    fn default() -> Self {
        Self {
            readings: 156,
            weigh_s: 3.0,
            flow_m3_s: 8e-6,
            last_flow_m3_s: 1.2e-6,
            turn_rad_s: 1.0,
            patience_s: 300.0,
        }
    }
}

/// Which part of a pour it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// Weighing upright.
    Upright,
    /// Turning to the lip, and weighing there.
    ToTheLip,
    /// Creeping until something flows.
    Creeping,
    /// Pouring.
    Pouring,
    /// Turning back, and waiting for what hangs.
    Back,
    /// Weighing upright what is left.
    After,
}

/// What is believed after a block of readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Time of the readings, s.
    pub t_s: f64,
    /// The part of the pour.
    pub phase: Phase,
    /// Measured tilt, rad.
    pub tilt_rad: f64,
    /// Volume that has come off the lip, m^3, and its standard error without that of the density.
    pub poured_m3: f64,
    /// Its standard error, m^3.
    pub error_m3: f64,
    /// Flow over the lip, m^3/s.
    pub flow_m3_s: f64,
    /// Its standard error, m^3/s.
    pub flow_error_m3_s: f64,
    /// What would have been poured if the wrist were to turn back now, m^3.
    pub if_stopped_m3: f64,
}

/// What has been poured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poured {
    /// Volume, m^3.
    pub volume_m3: f64,
    /// Its standard error, m^3, the density's included.
    pub error_m3: f64,
    /// Its 95 % interval, m^3.
    pub interval_m3: [f64; 2],
    /// What was predicted when the wrist was turned back, m^3.
    pub predicted_m3: f64,
    /// How long it took, s.
    pub took_s: f64,
}

/// A pour with the scale in the loop.
#[derive(Clone, Copy)]
pub struct ClosedLoop<'a> {
    /// Container, mouth, bead and steepest tilt.
    pub pour: Pour<'a>,
    /// The liquid.
    pub inside: Inside,
    /// The sensor.
    pub scale: Scale,
    /// How to pour.
    pub manner: Manner,
    /// Gravity, m/s^2.
    pub gravity_m_s2: f64,
}

/// A pour under way.
struct Run<'a, 'd, D: Rotary + ForceTorque> {
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

type Outcome<T, D> = Result<T, ClosedLoopError<<D as hw_traits::ErrorType>::Error>>;

impl<'a> ClosedLoop<'a> {
    /// Pours `wanted_m3` (m^3), the wrist upright before and after.
    ///
    /// # Errors
    /// [`ClosedLoopError`]; the wrist is sent upright first, as far as it answers.
    pub fn pour<D: Rotary + ForceTorque>(&self, device: &mut D, wanted_m3: f64) -> Outcome<Poured, D> {
        self.pour_observed(device, wanted_m3, &mut |_| {})
    }

    /// The same, with a look at every block of readings.
    ///
    /// # Errors
    /// As [`ClosedLoop::pour`].
    pub fn pour_observed<D: Rotary + ForceTorque>(
        &self,
        device: &mut D,
        wanted_m3: f64,
        observer: &mut dyn FnMut(&Moment),
    ) -> Outcome<Poured, D> {
        self.check()?;
        // A wanted volume that the geometry refuses is refused before anything moves.
        self.pour.tilt_rad(self.inside.volume_m3, wanted_m3)?;
        let stream = Stream {
            pour: self.pour,
            inside_m3: self.inside.volume_m3,
            viscosity_m2_s: self.inside.viscosity_m2_s,
            gravity_m_s2: self.gravity_m_s2,
        };
        let filter = Filter::new(stream, self.scale, self.inside.density_kg_m3);
        let mut run = Run {
            plan: self,
            device,
            stream,
            filter,
            observer,
            begin_s: None,
            t_s: f64::NEG_INFINITY,
            joint: Joint::default(),
            delay_s: 0.0,
        };
        let outcome = run.whole(wanted_m3);
        if outcome.is_err() {
            // The pour has failed already; a wrist that does not answer either cannot be helped.
            let upright = run.upright_rad();
            let _ = run.device.turn_to(upright, self.manner.turn_rad_s);
        }
        outcome
    }

    fn check<E: std::fmt::Debug>(&self) -> Result<(), ClosedLoopError<E>> {
        let (inside, scale, manner) = (&self.inside, &self.scale, &self.manner);
        let above = [
            ("density_kg_m3", inside.density_kg_m3),
            ("viscosity_m2_s", inside.viscosity_m2_s),
            ("gravity_m_s2", self.gravity_m_s2),
            ("noise_n", scale.noise_n),
            ("wander_s", scale.wander_s),
            ("readings", manner.readings as f64),
            ("weigh_s", manner.weigh_s),
            ("flow_m3_s", manner.flow_m3_s),
            ("last_flow_m3_s", manner.last_flow_m3_s),
            ("turn_rad_s", manner.turn_rad_s),
            ("patience_s", manner.patience_s),
        ];
        for (name, got) in above {
            if !(got > 0.0 && got.is_finite()) {
                return Err(ClosedLoopError::Plan { name, got, expected: "above 0" });
            }
        }
        let not_below = [
            ("density_error_share", inside.density_error_share),
            ("block_n", scale.block_n),
            ("wander_n", scale.wander_n),
            ("offset_n", scale.offset_n),
            ("drift_n_s", scale.drift_n_s),
            ("tilt_rad", scale.tilt_rad),
        ];
        for (name, got) in not_below {
            if !(got >= 0.0 && got.is_finite()) {
                return Err(ClosedLoopError::Plan { name, got, expected: "0 or more" });
            }
        }
        Ok(())
    }
}

impl<D: Rotary + ForceTorque> Run<'_, '_, D> {
    fn upright_rad(&self) -> f64 {
        let (least, most) = self.device.limits_rad();
        0f64.clamp(least, most)
    }

    fn steepest_rad(&self) -> f64 {
        self.plan.pour.steepest_rad.min(self.device.limits_rad().1)
    }

    fn whole(&mut self, wanted_m3: f64) -> Outcome<Poured, D> {
        let manner = self.plan.manner;
        self.turn(self.upright_rad())?;
        self.weigh(Phase::Upright, manner.weigh_s)?;
        self.turn(self.lip_rad()?)?;
        self.settle(Phase::ToTheLip)?;
        self.weigh(Phase::ToTheLip, manner.weigh_s)?;
        self.creep()?;
        let predicted_m3 = self.flow(wanted_m3)?;
        self.turn(self.upright_rad())?;
        self.settle(Phase::Back)?;
        self.weigh(Phase::Back, 1.0 + 4.0 * self.stream.lag_s())?;
        self.weigh(Phase::After, manner.weigh_s)?;
        let volume_m3 = self.filter.poured_m3();
        let density = self.plan.inside.density_error_share * volume_m3;
        let error_m3 = self.filter.error_m3().hypot(density);
        let half = 1.96 * error_m3;
        Ok(Poured {
            volume_m3,
            error_m3,
            interval_m3: [(volume_m3 - half).max(0.0), volume_m3 + half],
            predicted_m3,
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
        let poured = self.filter.poured_m3();
        self.device.turn_to(to_rad, rate_rad_s).map_err(|e| of_device::<D>(e, 1, poured))
    }

    fn settle(&mut self, phase: Phase) -> Outcome<(), D> {
        let poured = self.filter.poured_m3();
        while !self.device.settled().map_err(|e| of_device::<D>(e, 1, poured))? {
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
        let angle = self.device.angle_rad().map_err(|e| of_device::<D>(e, 1, poured))?;
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
            let mut tries = 0;
            let reading = loop {
                tries += 1;
                match self.device.read() {
                    Ok(reading) => break reading,
                    Err(error) => {
                        let kind = hw_traits::Error::kind(&error);
                        let again = kind.severity() == hw_traits::Severity::Transient && tries < TRIES;
                        if !again {
                            return Err(of_device::<D>(error, tries, self.filter.poured_m3()));
                        }
                    }
                }
            };
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
