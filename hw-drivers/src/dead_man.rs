//! The dead-man's rule: what moves stops where nobody looks.
//!
//! * No command without a fresh reading: one that is older than the patience, and one that was never taken, refuse a command
//!   with the kind [`Stale`](hw_traits::ErrorKind::Stale).
//! * A time-out stops: where a device moves and has not been read for the patience, it is stopped, by a thread of its own, and
//!   takes no command before [`DeadMan::clear`]. A stop that the link does not take is sent again until it is taken. One call
//!   of the device may still be under way: it ends by the link's own time-out.
//! * Limits are the device's type's: a command outside them is not sent, and a reading outside them stops.
//! * A program that ends stops its devices. For one that is killed, devices that can watch their line themselves are told to.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use hw_traits::clock::Stamped;

use crate::error::DriverError;

/// A device that moves, as the rule sees it.
pub trait Machine: Send + 'static {
    /// What a reading tells.
    type State: Copy + Send;
    /// What it can be told.
    type Command: Copy + Send;

    /// Whether a command is within the limits.
    ///
    /// # Errors
    /// [`DriverError::Limit`].
    fn admissible(&self, command: &Self::Command) -> Result<(), DriverError>;

    /// What of a reading is beyond the limits of place, speed or force, in words with its unit.
    fn beyond(&self, state: &Self::State) -> Option<String>;

    /// Reads, and says whether the last command has been carried out.
    ///
    /// # Errors
    /// The device's error.
    fn look(&mut self) -> Result<(Stamped<Self::State>, bool), DriverError>;

    /// Sends a command.
    ///
    /// # Errors
    /// The device's error.
    fn send(&mut self, command: &Self::Command) -> Result<(), DriverError>;

    /// Stops.
    ///
    /// # Errors
    /// The device's error.
    fn stop(&mut self) -> Result<(), DriverError>;

    /// How often [`Machine::beat`] is called, for a device that watches its line also while it stands.
    fn beat_every(&self) -> Option<Duration> {
        None
    }

    /// Tells the device that its program lives; nothing may move by it that was not commanded. What fails shows at the next reading.
    fn beat(&mut self) {}
}

struct Watched<M> {
    machine: M,
    seen: Option<Instant>,
    moving: bool,
    stopped: Option<String>,
    ended: bool,
}

struct Shared<M> {
    watched: Mutex<Watched<M>>,
    changed: Condvar,
    patience: Duration,
}

/// A device that moves, under the dead-man's rule.
pub struct DeadMan<M: Machine> {
    shared: Arc<Shared<M>>,
    keeper: Option<JoinHandle<()>>,
}

impl<M> Shared<M> {
    /// A thread that panicked with the lock left a device behind that still has to be stopped.
    fn lock(&self) -> MutexGuard<'_, Watched<M>> {
        self.watched.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<M: Machine> Watched<M> {
    /// Stops, and remembers why; what could not be stopped still counts as moving.
    fn stop(&mut self, why: String) -> Result<(), DriverError> {
        self.stopped = Some(why);
        self.machine.stop()?;
        self.moving = false;
        Ok(())
    }
}

/// Stops what moves and is not read, until the device is given up.
fn keep<M: Machine>(shared: &Shared<M>) {
    let mut watched = shared.lock();
    loop {
        if watched.ended {
            if watched.moving {
                // The link may be gone: the device's own watch is what is left.
                let _ = watched.machine.stop();
            }
            return;
        }
        let age = watched.seen.map_or(shared.patience, |seen| seen.elapsed());
        let beat = watched.machine.beat_every();
        let mut rest = beat.map_or(shared.patience, |beat| beat.min(shared.patience));
        if watched.moving && age >= shared.patience {
            let why = format!("it moved, and was not read for {:.3} s", age.as_secs_f64());
            // Tried again after the patience.
            let _ = watched.stop(why);
        } else if watched.moving {
            rest = rest.min(shared.patience - age);
        }
        if beat.is_some() {
            watched.machine.beat();
        }
        watched = shared.changed.wait_timeout(watched, rest).unwrap_or_else(PoisonError::into_inner).0;
    }
}

impl<M: Machine> DeadMan<M> {
    /// Watches over a machine; `patience_s` is the longest time between readings, 0.001 to 10 s.
    ///
    /// # Errors
    /// [`DriverError::Limit`] for another patience, [`DriverError::Link`] where no thread can be started.
    pub fn new(machine: M, patience_s: f64) -> Result<Self, DriverError> {
        crate::error::within("patience in s", patience_s, 1e-3, 10.0)?;
        let watched = Watched { machine, seen: None, moving: false, stopped: None, ended: false };
        let patience = Duration::from_secs_f64(patience_s);
        let shared = Arc::new(Shared { watched: Mutex::new(watched), changed: Condvar::new(), patience });
        let theirs = Arc::clone(&shared);
        let started = std::thread::Builder::new().name("dead-man".into()).spawn(move || keep(&theirs));
        let keeper = started.map_err(|e| DriverError::of_io("dead-man", "start a thread", &e, 0.0))?;
        Ok(Self { shared, keeper: Some(keeper) })
    }

    /// Reads; the reading makes commands possible for the patience. A reading beyond the limits stops.
    ///
    /// # Errors
    /// The device's error; [`DriverError::Stopped`] where a reading is beyond the limits while it moves.
    pub fn look(&mut self) -> Result<(Stamped<M::State>, bool), DriverError> {
        let mut watched = self.shared.lock();
        let (state, settled) = watched.machine.look()?;
        if let Some(why) = watched.machine.beyond(&state.value).filter(|_| watched.moving) {
            watched.stop(why.clone())?;
            return Err(DriverError::Stopped { why });
        }
        watched.seen = Some(Instant::now());
        if settled {
            watched.moving = false;
        }
        Ok((state, settled))
    }

    /// Reads, and says whether the last command has been carried out.
    ///
    /// # Errors
    /// As [`DeadMan::look`], and [`DriverError::Stopped`] where it never will be: the rule stopped the device on its way.
    pub fn settled(&mut self) -> Result<bool, DriverError> {
        let (_, settled) = self.look()?;
        self.stopped().map_or(Ok(settled), |why| Err(DriverError::Stopped { why }))
    }

    /// Commands.
    ///
    /// # Errors
    /// Of several that apply the first: [`DriverError::Limit`], [`DriverError::Stale`], [`DriverError::Stopped`], the device's error.
    pub fn command(&mut self, command: &M::Command) -> Result<(), DriverError> {
        let mut watched = self.shared.lock();
        watched.machine.admissible(command)?;
        let age_s = watched.seen.map_or(f64::INFINITY, |seen| seen.elapsed().as_secs_f64());
        let patience_s = self.shared.patience.as_secs_f64();
        if age_s > patience_s {
            return Err(DriverError::Stale { age_s, patience_s });
        }
        if let Some(why) = watched.stopped.clone() {
            return Err(DriverError::Stopped { why });
        }
        // From here on it may move, also where the answer is lost.
        watched.moving = true;
        let sent = watched.machine.send(command);
        drop(watched);
        self.shared.changed.notify_all();
        sent
    }

    /// Stops now; a later command needs no clearing.
    ///
    /// # Errors
    /// The device's error; it is then tried again after the patience.
    pub fn stop(&mut self) -> Result<(), DriverError> {
        let mut watched = self.shared.lock();
        watched.machine.stop()?;
        watched.moving = false;
        Ok(())
    }

    /// Why it was stopped, if it was.
    pub fn stopped(&self) -> Option<String> {
        self.shared.lock().stopped.clone()
    }

    /// Lets a stopped device take commands again; whoever calls this has looked at it.
    pub fn clear(&mut self) {
        self.shared.lock().stopped = None;
    }

    /// The machine, for what is no motion.
    #[cfg(feature = "ur")]
    pub(crate) fn with<T>(&self, ask: impl FnOnce(&mut M) -> T) -> T {
        ask(&mut self.shared.lock().machine)
    }
}

impl<M: Machine> Drop for DeadMan<M> {
    fn drop(&mut self) {
        self.shared.lock().ended = true;
        self.shared.changed.notify_all();
        if let Some(keeper) = self.keeper.take() {
            // A keeper that panicked has nothing more to do.
            let _ = keeper.join();
        }
    }
}
