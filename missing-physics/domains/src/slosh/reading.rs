//! What a sensor reads of a decaying wave: the first mode, and what is added to it.

use liquid_haptics::slosh::{Decay, Effects, UprightCylinder};
use missing_physics::data::Run;
use missing_physics::model::ParameterRef;

use super::spec::Layout;

/// A run's reading as a function of the parameters, by their slots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reading<'a> {
    pub(super) layout: &'a Layout,
    /// The recorded fill, and this run's.
    pub(super) full: &'a UprightCylinder,
    pub(super) cylinder: &'a UprightCylinder,
    pub(super) density_kg_m3: f64,
    /// The largest amplitude with which a run begins, in the reading's unit.
    pub(super) largest: f64,
    pub(super) run: &'a Run,
}

impl Reading<'_> {
    /// Angular frequency (rad/s) and damping ratio of the first mode.
    pub(super) fn first_mode(&self, shared: &[f64]) -> [f64; 2] {
        let p = self.layout;
        let omega = self.cylinder.angular_frequency_rad_s(0, shared[p.tension.slot] / self.density_kg_m3);
        [omega, self.cylinder.damping_ratio(shared[p.viscosity.slot]).min(0.999)]
    }

    /// The first mode.
    fn wave(&self, shared: &[f64]) -> Decay {
        let p = self.layout;
        let [omega_rad_s, damping_ratio] = self.first_mode(shared);
        Decay {
            omega_rad_s,
            damping_ratio,
            effects: Effects {
                friction: shared[p.friction.slot],
                quadratic_per_reading: shared[p.quadratic.slot],
                frequency_change: shared[p.frequency.slot] * self.largest * self.largest,
                largest_amplitude: self.largest,
            },
        }
    }

    /// The reading of the first mode.
    pub(super) fn first(&self, shared: &[f64], nuisance: &[f64], out: &mut [f64]) -> Result<(), String> {
        let p = self.layout;
        read(&self.wave(shared), self.run, [nuisance[p.cos.slot], nuisance[p.sin.slot]], out)
    }

    /// The second mode, or the arm.
    fn oscillation(&self, part: Part, shared: &[f64]) -> Decay {
        let p = self.layout;
        let [omega_rad_s, damping_ratio] = if part == Part::Arm {
            [shared[p.arm_omega.slot], shared[p.arm_damping.slot]]
        } else {
            // With another fill the second mode moves by as much as theory says.
            let moved =
                self.cylinder.angular_frequency_rad_s(1, 0.0) / self.full.angular_frequency_rad_s(1, 0.0);
            [moved * shared[p.second_omega.slot], shared[p.second_damping.slot]]
        };
        Decay { omega_rad_s, damping_ratio, effects: Effects::default() }
    }

    /// A part of what is added to the first mode's reading.
    pub(super) fn part(
        &self,
        part: Part,
        shared: &[f64],
        nuisance: &[f64],
        out: &mut [f64],
    ) -> Result<(), String> {
        let p = self.layout;
        let start = match part {
            Part::Transient => {
                let (transient, lag) = (nuisance[p.transient.slot], shared[p.lag.slot]);
                fade(self.run, lag, out)?;
                out.iter_mut().for_each(|y| *y *= transient);
                return Ok(());
            }
            Part::Second => [nuisance[p.second_cos.slot], nuisance[p.second_sin.slot]],
            Part::Arm => [nuisance[p.arm_cos.slot], nuisance[p.arm_sin.slot]],
        };
        read(&self.oscillation(part, shared), self.run, start, out)
    }

    /// All of the reading.
    pub(super) fn all(&self, shared: &[f64], nuisance: &[f64], out: &mut [f64]) -> Result<(), String> {
        self.first(shared, nuisance, out)?;
        let zero = nuisance[self.layout.zero.slot];
        out.iter_mut().for_each(|y| *y += zero);
        let mut more = Vec::new();
        for part in [Part::Second, Part::Arm, Part::Transient] {
            if self.has(part, nuisance) {
                more.resize(out.len(), 0.0);
                self.part(part, shared, nuisance, &mut more)?;
                out.iter_mut().zip(&more).for_each(|(y, x)| *y += x);
            }
        }
        Ok(())
    }

    /// Whether a part is there at all.
    fn has(&self, part: Part, nuisance: &[f64]) -> bool {
        let p = self.layout;
        let sizes: &[_] = match part {
            Part::Second => &[p.second_cos, p.second_sin],
            Part::Arm => &[p.arm_cos, p.arm_sin],
            Part::Transient => &[p.transient],
        };
        sizes.iter().any(|size| nuisance[size.slot] != 0.0)
    }

    /// The derivative by a parameter that the reading is proportional to, in closed form; `None` for another one.
    pub(super) fn proportional(
        &self,
        shared: &[f64],
        slot: usize,
        out: &mut [f64],
    ) -> Option<Result<(), String>> {
        let p = self.layout;
        let is = |parameter: ParameterRef| parameter.slot == slot;
        let is_one_of = |pair: [ParameterRef; 2]| pair.into_iter().any(is);
        let unit = |pair: [ParameterRef; 2]| pair.map(|parameter| f64::from(is(parameter)));
        let (first, second, arm) = ([p.cos, p.sin], [p.second_cos, p.second_sin], [p.arm_cos, p.arm_sin]);
        if is(p.zero) {
            out.fill(1.0);
            Some(Ok(()))
        } else if is(p.transient) {
            Some(fade(self.run, shared[p.lag.slot], out))
        } else if is_one_of(second) {
            Some(read(&self.oscillation(Part::Second, shared), self.run, unit(second), out))
        } else if is_one_of(arm) {
            Some(read(&self.oscillation(Part::Arm, shared), self.run, unit(arm), out))
        } else {
            let wave = self.wave(shared);
            (is_one_of(first) && wave.is_linear()).then(|| read(&wave, self.run, unit(first), out))
        }
    }

    /// The part that a shared parameter acts on, where that is not the first mode.
    pub(super) fn part_of(&self, slot: usize) -> Option<Part> {
        let p = self.layout;
        let of = |parameters: &[ParameterRef]| parameters.iter().any(|a| a.slot == slot);
        if of(&[p.second_omega, p.second_damping]) {
            Some(Part::Second)
        } else if of(&[p.arm_omega, p.arm_damping]) {
            Some(Part::Arm)
        } else {
            of(&[p.lag]).then_some(Part::Transient)
        }
    }
}

/// What is added to the first mode's reading, beside the sensor's zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Part {
    Second,
    Arm,
    Transient,
}

fn times(run: &Run) -> Result<&[f64], String> {
    run.inputs.first().map(Vec::as_slice).ok_or_else(|| "there is no column of times".to_owned())
}

fn read(decay: &Decay, run: &Run, start: [f64; 2], out: &mut [f64]) -> Result<(), String> {
    decay.read(times(run)?, start, out).map_err(|e| e.to_string())
}

/// What is left of one unit of the sensor's transient.
fn fade(run: &Run, lag: f64, out: &mut [f64]) -> Result<(), String> {
    for (y, t) in out.iter_mut().zip(times(run)?) {
        *y = (-t / lag).exp();
    }
    Ok(())
}
