//! Pouring with the scale in the loop: the wrist weighs while it pours, and turns back in time for what is still on its way.
//!
//! [Matl 2021], section 2.7, leaves it as its outlook. The weight is the length of the measured force: where the liquid lies in the container
//! does not matter to it, so that neither slosh nor a thick liquid's lag within does. An extended Kalman filter holds the volume that has come
//! off the lip and that has passed it (the one follows the other with a lag that grows with the viscosity), the height of the bead, a factor of
//! the flow, and the sensor's offset, wander and drift along two axes that turn with the wrist. What will still leave while it turns back is
//! predicted by the same law; the wrist turns back when that makes up the wanted volume. The torque is not used.

mod error;
mod filter;
mod joint;
mod plan;
mod run;
mod stream;

use hw_traits::force_torque::ForceTorque;
use hw_traits::rotary::Rotary;

pub use error::ClosedLoopError;
pub use plan::{ClosedLoop, Inside, Manner, Moment, Phase, Poured, Scale};

use super::{Pour, PourError};
use run::{Outcome, Run};

impl ClosedLoop<'_> {
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
        let mut run = Run::new(self, device, observer);
        let outcome = run.whole(wanted_m3);
        if outcome.is_err() {
            run.give_up();
        }
        outcome
    }
}
