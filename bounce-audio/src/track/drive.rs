//! One throw on any rig with microphones and an arm.

use super::{Goal, Seen, Tracker};
use crate::hear::HearError;
use crate::listen::{Listener, Sounded};
use hw_traits::arm::{Arm, Pose};
use hw_traits::microphones::Microphones;
use hw_traits::{Error, ErrorKind};
use rand::Rng;
use std::time::Instant;

/// Impacts that one buffer may hold; more are no ball.
const IN_A_BUFFER: usize = 8;
/// A deadline that the arm cannot keep grows by this factor, this often.
const PATIENCE: (f64, usize) = (1.25, 16);
/// Least deadline that is asked for, s.
const LEAST_DEADLINE_S: f64 = 0.02;

/// Why a throw could not be played to its end.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlayError {
    /// A device failed.
    #[error("{device}: {kind}")]
    Device {
        /// Which one.
        device: &'static str,
        /// What went wrong.
        kind: ErrorKind,
    },
    /// The sound could not be listened to.
    #[error(transparent)]
    Hear(#[from] HearError),
}

/// How a throw went.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Played {
    /// Impacts that were heard.
    pub impacts: Vec<Seen>,
    /// Goals that the arm took.
    pub goals: Vec<Goal>,
    /// Goals that the arm refused, whatever the deadline.
    pub refused: usize,
    /// The longest that a decision took: the buffer with its impact in, to the goal, on the computer's clock, s.
    pub slowest_s: f64,
    /// Kinetic energy of the paddle over its mass, integrated over time ([Matl 2021], figure 4.7), from its poses, m^2/s.
    pub energy_m2_s: f64,
}

/// What plays: ears, a tracker, a buffer of a fixed length.
pub struct Player<'a, T> {
    /// Hears the impacts.
    pub listener: &'a mut Listener,
    /// Decides.
    pub tracker: &'a mut T,
    /// The paddle's plane, m.
    pub plane_x_m: f64,
    /// Instants of a buffer: 485 are 11 ms at 44.1 kHz.
    pub buffer: usize,
}

/// Plays one throw until `over` says that it is.
///
/// A goal whose deadline the arm cannot keep is asked for again with later ones: it comes late rather than never. The tool keeps the
/// orientation that it has.
///
/// # Errors
/// [`PlayError`].
pub fn play<R: Microphones + Arm + ?Sized, T: Tracker>(
    rig: &mut R,
    player: &mut Player<'_, T>,
    mut over: impl FnMut(&R) -> bool,
    rng: &mut dyn Rng,
) -> Result<Played, PlayError> {
    let ears = |e: R::Error| PlayError::Device { device: "microphones", kind: e.kind() };
    let arm = |e: R::Error| PlayError::Device { device: "arm", kind: e.kind() };
    let mut samples = vec![0.0f32; player.buffer.max(1) * rig.channels()];
    let mut played = Played::default();
    let mut last: Option<(f64, [f64; 3])> = None;
    player.tracker.begin();
    while !over(rig) {
        let t_s = rig.read(&mut samples).map_err(ears)?;
        let now_s = t_s + player.buffer as f64 / rig.rate_hz();
        let began = Instant::now();
        let (mut heard, mut count) = ([None; IN_A_BUFFER], 0);
        player.listener.push(t_s, &samples, |sounded| {
            if let (Sounded::Impact(p), Some(slot)) = (sounded, heard.get_mut(count)) {
                *slot = Some(Seen { t_s: p.t_s, place_m: [p.location.x_m, p.location.y_m] });
                count += 1;
            }
        })?;
        let pose = rig.pose().map_err(arm)?;
        let [x, y, z] = pose.value.position_m;
        if let Some((then, from)) = last {
            let square = (x - from[0]).powi(2) + (y - from[1]).powi(2) + (z - from[2]).powi(2);
            played.energy_m2_s += 0.5 * square / (pose.t_s - then).max(1e-9);
        }
        last = Some((pose.t_s, [x, y, z]));
        for impact in heard.into_iter().flatten() {
            played.impacts.push(impact);
            let goal = player.tracker.heard(&impact, [y, z], rng);
            played.slowest_s = played.slowest_s.max(began.elapsed().as_secs_f64());
            let Some(goal) = goal else { continue };
            let to = Pose { position_m: [player.plane_x_m, goal.y_m, goal.z_m], ..pose.value };
            if reach(rig, to, goal.at_s - now_s).map_err(arm)? {
                played.goals.push(goal);
            } else {
                played.refused += 1;
            }
        }
    }
    Ok(played)
}

/// Asks for a pose by a deadline, or as soon after it as the arm can.
fn reach<A: Arm + ?Sized>(arm: &mut A, to: Pose, deadline_s: f64) -> Result<bool, A::Error> {
    let mut deadline = deadline_s.max(LEAST_DEADLINE_S);
    for _ in 0..PATIENCE.1 {
        match arm.move_to(to, deadline) {
            Ok(()) => return Ok(true),
            Err(e) if e.kind() == ErrorKind::Timeout => deadline *= PATIENCE.0,
            Err(e) if e.kind() == ErrorKind::OutOfRange => return Ok(false),
            Err(e) => return Err(e),
        }
    }
    Ok(false)
}
