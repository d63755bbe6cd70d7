//! A simulated wrist that turns what it holds, feels it with the noise of a sensor, and keeps time.

use std::f64::consts::PI;

use hw_traits::clock::{Clock, Stamped};
use hw_traits::force_torque::{ForceTorque, Wrench};
use hw_traits::rotary::Rotary;
use hw_traits::{ErrorKind, ErrorType};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};

/// One sigma of a reading of a force (N) and of a torque (N m): an ATI Axia80's resolution.
const SIGMA_N: f64 = 0.1;
const SIGMA_NM: f64 = 0.005;

/// The last turn of the wrist: from an angle to an angle, in rad.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Turn {
    pub(super) from_rad: f64,
    pub(super) to_rad: f64,
}

/// What a wrist may hold.
pub(super) trait Load {
    /// The force along the vertical (N) and the torque (N m) so many seconds after a turn has ended.
    fn felt(&mut self, turn: &Turn, since_s: f64) -> Option<[f64; 2]>;
}

/// The wrist: it stands where it was told to as soon as somebody has waited.
pub(super) struct Wrist<L> {
    load: L,
    turn: Turn,
    turned_s: f64,
    now_s: f64,
    rng: ChaCha8Rng,
}

impl<L> Wrist<L> {
    pub(super) fn new(load: L, seed: u64) -> Self {
        let rng = ChaCha8Rng::seed_from_u64(seed);
        Self { load, turn: Turn::default(), turned_s: 0.0, now_s: 0.0, rng }
    }
}

impl<L> ErrorType for Wrist<L> {
    type Error = ErrorKind;
}

impl<L> Clock for Wrist<L> {
    fn now_s(&mut self) -> Result<f64, ErrorKind> {
        Ok(self.now_s)
    }

    fn sleep_s(&mut self, duration_s: f64) -> Result<(), ErrorKind> {
        self.now_s += duration_s.max(0.0);
        Ok(())
    }
}

impl<L> Rotary for Wrist<L> {
    fn limits_rad(&self) -> (f64, f64) {
        (0.0, PI)
    }

    fn turn_to(&mut self, angle_rad: f64, rate_rad_s: f64) -> Result<(), ErrorKind> {
        if !((0.0..=PI).contains(&angle_rad) && rate_rad_s > 0.0) {
            return Err(ErrorKind::OutOfRange);
        }
        self.turn = Turn { from_rad: self.turn.to_rad, to_rad: angle_rad };
        self.turned_s = self.now_s;
        Ok(())
    }

    fn angle_rad(&mut self) -> Result<Stamped<f64>, ErrorKind> {
        Ok(Stamped { t_s: self.now_s, value: self.turn.to_rad })
    }

    fn settled(&mut self) -> Result<bool, ErrorKind> {
        Ok(true)
    }
}

impl<L: Load> ForceTorque for Wrist<L> {
    fn read(&mut self) -> Result<Stamped<Wrench>, ErrorKind> {
        let felt = self.load.felt(&self.turn, self.now_s - self.turned_s);
        let [up_n, torque_nm] = felt.ok_or(ErrorKind::Other)?;
        let mut noise = || -> f64 { StandardNormal.sample(&mut self.rng) };
        // The sensor's axes turn with the wrist.
        let (sin, cos) = self.turn.to_rad.sin_cos();
        let value = Wrench {
            force_n: [-up_n * sin + SIGMA_N * noise(), up_n * cos + SIGMA_N * noise(), SIGMA_N * noise()],
            torque_nm: [SIGMA_NM * noise(), SIGMA_NM * noise(), torque_nm + SIGMA_NM * noise()],
        };
        Ok(Stamped { t_s: self.now_s, value })
    }

    fn tare(&mut self, _readings: usize) -> Result<(), ErrorKind> {
        Err(ErrorKind::Other)
    }
}
