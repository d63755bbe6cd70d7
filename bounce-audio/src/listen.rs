//! Hearing as it happens: impacts from buffers of microphones, each with its place, without allocation.

use crate::hear::{HearError, HearSettings, Stray, StrayReason, doubt};
use crate::localise::{LocaliseError, Localiser, Location};
use crate::onset::{OnsetStream, Started};
use crate::quantile::quantile;

/// How time delays are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delays {
    /// Phase correlation, as offline.
    Phase,
    /// Peak times, as [Matl 2021] does in real time: when each channel is loudest. Echoes that add up make outliers of several
    /// centimetres.
    Peaks,
}

/// An impact heard in a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placed {
    /// When it was, at the table, on the samples' clock, s.
    pub t_s: f64,
    /// Standard deviation of that time, s.
    pub t_sigma_s: f64,
    /// Where it was. Of peak times the covariance holds only what a sample's length makes uncertain, and coherence is 1.
    pub location: Location,
    /// The impact's loudness over the noise, a ratio of amplitudes.
    pub amplitude_sigmas: f64,
}

/// A sound in a stream.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sounded {
    /// An impact on the table.
    Impact(Placed),
    /// Something else.
    Stray(Stray),
}

/// Hears impacts in a stream: [`OnsetStream`] and [`Localiser`] put together, planned once.
///
/// What is reported is 7 to 9 ms old: the sound that phase correlation wants. The rules for what is an impact are those of
/// [`hear`](crate::hear::hear()).
///
/// ```
/// use bounce_audio::hear::HearSettings;
/// use bounce_audio::listen::{Delays, Listener};
///
/// let microphones = [[0.0, 0.0, 0.08], [0.5, 0.0, 0.08], [0.25, 0.5, 0.08]];
/// let mut listener = Listener::new(&microphones, 44_100.0, 343.0, &HearSettings::default(), Delays::Phase)?;
/// let buffer = [0.0f32; 3 * 485];
/// for k in 0..20 {
///     listener.push(f64::from(k) * 485.0 / 44_100.0, &buffer, |sound| panic!("{sound:?} in silence"))?;
/// }
/// # Ok::<(), bounce_audio::hear::HearError>(())
/// ```
pub struct Listener {
    stream: OnsetStream,
    placer: Placer,
}

struct Placer {
    localiser: Localiser,
    settings: HearSettings,
    delays: Delays,
    lead: isize,
    rate_hz: f64,
    samples: Vec<f64>,
    arrivals_s: Vec<f64>,
    means: Vec<f64>,
}

impl Listener {
    /// For microphones in the table's frame (m, z = 0 at its top), a sample rate (Hz) and a speed of sound (m/s).
    ///
    /// # Errors
    /// [`HearError`].
    pub fn new(
        microphones_m: &[[f64; 3]],
        rate_hz: f64,
        speed_of_sound_m_s: f64,
        settings: &HearSettings,
        delays: Delays,
    ) -> Result<Self, HearError> {
        let n = microphones_m.len();
        let array = crate::localise::Array::new(microphones_m, speed_of_sound_m_s)?;
        let after_s = settings.length_s + array.longest_lag_s();
        let buffer = (after_s * rate_hz).ceil() as usize;
        let stream = OnsetStream::new(n, rate_hz, settings.onset, after_s)?;
        let localiser = Localiser::new(microphones_m, rate_hz, speed_of_sound_m_s, buffer)?;
        let placer = Placer {
            samples: vec![0.0; n * localiser.buffer()],
            localiser,
            settings: *settings,
            delays,
            lead: (settings.lead_s * rate_hz).round() as isize,
            rate_hz,
            arrivals_s: vec![0.0; n],
            means: vec![0.0; n],
        };
        Ok(Self { stream, placer })
    }

    /// Takes the next samples, channel after channel for each instant, the first of them at `t_s` on their clock; calls `on` for each sound.
    ///
    /// # Errors
    /// [`HearError::Onset`] for samples that are no numbers, or no whole number of instants; nothing of the buffer is taken then.
    pub fn push(
        &mut self,
        t_s: f64,
        interleaved: &[f32],
        mut on: impl FnMut(Sounded),
    ) -> Result<(), HearError> {
        let placer = &mut self.placer;
        self.stream.push(t_s, interleaved, |stream, started| on(placer.place(stream, started)))?;
        Ok(())
    }
}

impl Placer {
    fn place(&mut self, stream: &OnsetStream, started: &Started) -> Sounded {
        let first = started.first.t_s;
        let stray = |reason| Sounded::Stray(Stray { t_s: first, reason });
        let start = started.sample as isize - self.lead;
        let found = match self.delays {
            Delays::Phase => self.by_phase(stream, start),
            Delays::Peaks => Ok(self.by_peaks(stream, start)),
        };
        // A channel that is dead just then says nothing about where the sound came from.
        let Ok(location) = found else { return stray(StrayReason::Incoherent(0.0)) };
        if let Some(reason) =
            doubt(self.localiser.array(), &location, started.amplitude_sigmas, &self.settings)
        {
            return stray(reason);
        }
        // Every channel's onset less its delay is one time; the median forgives one that was misled.
        for ((mean, instant), delay) in self.means.iter_mut().zip(stream.instants()).zip(&self.arrivals_s) {
            *mean = instant.t_s - delay;
        }
        let Some(mean_s) = quantile(&mut self.means, 0.5) else {
            return stray(StrayReason::Incoherent(0.0));
        };
        let (n, array) = (self.means.len(), self.localiser.array());
        let travel = (0..n).map(|i| array.travel_s(i, location.x_m, location.y_m)).sum::<f64>() / n as f64;
        Sounded::Impact(Placed {
            t_s: mean_s - travel,
            t_sigma_s: started.first.sigma_s,
            location,
            amplitude_sigmas: started.amplitude_sigmas,
        })
    }

    fn by_phase(&mut self, stream: &OnsetStream, start: isize) -> Result<Location, LocaliseError> {
        let buffer = self.localiser.buffer();
        for (channel, samples) in self.samples.chunks_exact_mut(buffer).enumerate() {
            stream.cut(channel, start, samples);
        }
        let location = self.localiser.locate_planar(&self.samples)?;
        self.arrivals_s.copy_from_slice(self.localiser.arrivals_s());
        Ok(location)
    }

    fn by_peaks(&mut self, stream: &OnsetStream, start: isize) -> Location {
        let buffer = self.localiser.buffer();
        for (channel, samples) in self.samples.chunks_exact_mut(buffer).enumerate() {
            stream.cut_filtered(channel, start, samples);
            let loudest = |a: (f64, usize), (i, v): (usize, &f64)| {
                if v.abs() > a.0 { (v.abs(), i) } else { a }
            };
            let at = samples.iter().enumerate().fold((0.0, 0), loudest).1;
            self.arrivals_s[channel] = at as f64 / self.rate_hz;
        }
        let n = self.arrivals_s.len() as f64;
        let mean = self.arrivals_s.iter().sum::<f64>() / n;
        self.arrivals_s.iter_mut().for_each(|t| *t -= mean);
        let arrival_sigma_s = 12f64.sqrt().recip() / self.rate_hz;
        self.localiser.array().location(&self.arrivals_s, arrival_sigma_s, 0.0, 1.0)
    }
}
