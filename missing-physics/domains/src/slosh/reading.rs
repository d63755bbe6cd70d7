//! What a sensor reads of a decaying wave: the first mode, and what is added to it.

use liquid_haptics::slosh::{Decay, Effects, LinearDecay, UprightCylinder};
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

/// An oscillation in the reading.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    First,
    Second,
    Arm,
}

/// What is added to the first mode.
const ADDED: [Mode; 2] = [Mode::Second, Mode::Arm];

/// A parameter by which the reading is derived, and the step of a difference.
#[derive(Debug, Clone, Copy)]
pub(super) struct Free {
    pub(super) is_shared: bool,
    pub(super) slot: usize,
    pub(super) step: f64,
}

impl Free {
    fn is_shared(&self, parameter: ParameterRef) -> bool {
        self.is_shared && parameter.slot == self.slot
    }

    fn is_nuisance(&self, parameter: ParameterRef) -> bool {
        !self.is_shared && parameter.slot == self.slot
    }

    /// The parameters, shared and nuisance, with this one moved by its step.
    fn moved(&self, parameters: [&[f64]; 2]) -> [Vec<f64>; 2] {
        let mut moved = parameters.map(<[f64]>::to_vec);
        moved[usize::from(!self.is_shared)][self.slot] += self.step;
        moved
    }
}

impl Reading<'_> {
    /// Angular frequency (rad/s) and damping ratio of the first mode.
    pub(super) fn first_mode(&self, [shared, nuisance]: [&[f64]; 2]) -> [f64; 2] {
        let p = self.layout;
        let cylinder = self.filled(nuisance);
        let omega = cylinder.angular_frequency_rad_s(0, shared[p.tension.slot] / self.density_kg_m3);
        [omega, cylinder.damping_ratio(shared[p.viscosity.slot]).min(0.999)]
    }

    /// The run's cylinder with what was in it then.
    fn filled(&self, nuisance: &[f64]) -> UprightCylinder {
        self.cylinder.filled_by(1.0 + nuisance[self.layout.fill.slot])
    }

    /// All of the reading.
    pub(super) fn all(&self, shared: &[f64], nuisance: &[f64], out: &mut [f64]) -> Result<(), String> {
        let p = self.layout;
        self.read(Mode::First, [shared, nuisance], out)?;
        let zero = nuisance[p.zero.slot];
        out.iter_mut().for_each(|y| *y += zero);
        let mut more = vec![0.0; out.len()];
        for mode in ADDED {
            if self.start(mode, nuisance) != [0.0; 2] {
                self.read(mode, [shared, nuisance], &mut more)?;
                add(out, 1.0, &more);
            }
        }
        let transient = nuisance[p.transient.slot];
        if transient != 0.0 {
            self.fade(shared, &mut more)?;
            add(out, transient, &more);
        }
        Ok(())
    }

    /// All of the reading, and its derivatives by parameters, one column each: in closed form, but for what the first mode's reading
    /// depends on where that is not linear in its start.
    pub(super) fn linearised(
        &self,
        parameters: [&[f64]; 2],
        free: &[Free],
        out: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), String> {
        let p = self.layout;
        let [shared, nuisance] = parameters;
        let [mut first, mut more, mut fade] = [0, 1, 2].map(|_| vec![0.0; out.len()]);
        let known = self.known(parameters, free)?;
        match known.first() {
            Some((Mode::First, decay)) => decay.read(self.start(Mode::First, nuisance), &mut first),
            _ => self.read(Mode::First, parameters, &mut first)?,
        }
        out.copy_from_slice(&first);
        for (mode, decay) in known.iter().filter(|(mode, _)| *mode != Mode::First) {
            decay.read(self.start(*mode, nuisance), &mut more);
            add(out, 1.0, &more);
        }
        let by_fade = |by: &Free| by.is_nuisance(p.transient) || by.is_shared(p.lag);
        if nuisance[p.transient.slot] != 0.0 || free.iter().any(by_fade) {
            self.fade(shared, &mut fade)?;
        }
        let (zero, transient, lag) = (nuisance[p.zero.slot], nuisance[p.transient.slot], shared[p.lag.slot]);
        add(out, transient, &fade);
        out.iter_mut().for_each(|y| *y += zero);
        for (by, column) in free.iter().zip(jacobian.chunks_exact_mut(out.len().max(1))) {
            if by.is_nuisance(p.zero) {
                column.fill(1.0);
            } else if by.is_nuisance(p.transient) {
                column.copy_from_slice(&fade);
            } else if by.is_shared(p.lag) {
                for ((d, fade), t) in column.iter_mut().zip(&fade).zip(times(self.run)?) {
                    *d = transient * fade * t / (lag * lag);
                }
            } else {
                // Modes of which each depends on it add up.
                column.fill(0.0);
                let mut derived = false;
                for known in &known {
                    if self.derive(known, parameters, by, &mut more) {
                        add(column, 1.0, &more);
                        derived = true;
                    }
                }
                let of_first = by.is_nuisance(p.fill) && known.first().is_none_or(|k| k.0 != Mode::First);
                if !derived || of_first {
                    let [shared, nuisance] = by.moved(parameters);
                    self.read(Mode::First, [&shared, &nuisance], &mut more)?;
                    add(&mut more, -1.0, &first);
                    add(column, by.step.recip(), &more);
                }
            }
        }
        Ok(())
    }

    /// Modes that are there, or that something is derived by, as far as their readings are linear in their starts; the first mode first.
    fn known(
        &self,
        [shared, nuisance]: [&[f64]; 2],
        free: &[Free],
    ) -> Result<Vec<(Mode, LinearDecay<'_>)>, String> {
        let mut known = Vec::new();
        for mode in [Mode::First, Mode::Second, Mode::Arm] {
            let (of_start, of_decay) = self.parameters(mode);
            let by = |f: &Free| of_start.iter().any(|p| f.is_nuisance(*p)) || self.moves(f, mode, of_decay);
            let decay = self.decay(mode, [shared, nuisance]);
            if decay.is_linear() && (self.start(mode, nuisance) != [0.0; 2] || free.iter().any(by)) {
                known.push((mode, decay.linear(times(self.run)?).map_err(|e| e.to_string())?));
            }
        }
        Ok(known)
    }

    /// The derivative by a parameter of a mode whose reading is linear in its start; whether it is one.
    fn derive(
        &self,
        (mode, known): &(Mode, LinearDecay<'_>),
        parameters: [&[f64]; 2],
        by: &Free,
        column: &mut [f64],
    ) -> bool {
        let (of_start, of_decay) = self.parameters(*mode);
        if let Some(place) = of_start.iter().position(|p| by.is_nuisance(*p)) {
            column.copy_from_slice(&known.unit()[place]);
            return true;
        }
        if !self.moves(by, *mode, of_decay) {
            return false;
        }
        let at = |parameters: [&[f64]; 2]| {
            let decay = self.decay(*mode, parameters);
            [decay.omega_rad_s, decay.damping_ratio]
        };
        let [shared, nuisance] = by.moved(parameters);
        let ([omega, ratio], [high_omega, high_ratio]) = (at(parameters), at([&shared, &nuisance]));
        let slope = [(high_omega - omega) / by.step, (high_ratio - ratio) / by.step];
        known.derivative(self.start(*mode, parameters[1]), slope, column);
        true
    }

    /// Whether a mode's frequency or damping depends on a parameter; `of_decay` are the shared ones that they depend on.
    fn moves(&self, by: &Free, mode: Mode, of_decay: [ParameterRef; 2]) -> bool {
        of_decay.iter().any(|p| by.is_shared(*p)) || mode != Mode::Arm && by.is_nuisance(self.layout.fill)
    }

    /// A mode as it decays.
    fn decay(&self, mode: Mode, parameters: [&[f64]; 2]) -> Decay {
        let [shared, nuisance] = parameters;
        let p = self.layout;
        let (omega_rad_s, damping_ratio) = match mode {
            Mode::First => self.first_mode(parameters).into(),
            // With another fill the second mode moves by as much as theory says.
            Mode::Second => {
                let [here, full] =
                    [self.filled(nuisance), *self.full].map(|c| c.angular_frequency_rad_s(1, 0.0));
                (here / full * shared[p.second_omega.slot], shared[p.second_damping.slot])
            }
            Mode::Arm => (shared[p.arm_omega.slot], shared[p.arm_damping.slot]),
        };
        let effects = match mode {
            Mode::First => Effects {
                friction: shared[p.friction.slot],
                quadratic_per_reading: shared[p.quadratic.slot],
                frequency_change: shared[p.frequency.slot] * self.largest * self.largest,
                largest_amplitude: self.largest,
            },
            Mode::Second | Mode::Arm => Effects::default(),
        };
        Decay { omega_rad_s, damping_ratio, effects }
    }

    /// The nuisance parameters that a mode starts from, and the shared ones of its frequency and damping.
    fn parameters(&self, mode: Mode) -> ([ParameterRef; 2], [ParameterRef; 2]) {
        let p = self.layout;
        match mode {
            Mode::First => ([p.cos, p.sin], [p.tension, p.viscosity]),
            Mode::Second => ([p.second_cos, p.second_sin], [p.second_omega, p.second_damping]),
            Mode::Arm => ([p.arm_cos, p.arm_sin], [p.arm_omega, p.arm_damping]),
        }
    }

    /// From where a mode starts.
    fn start(&self, mode: Mode, nuisance: &[f64]) -> [f64; 2] {
        self.parameters(mode).0.map(|parameter| nuisance[parameter.slot])
    }

    /// The reading of a mode.
    fn read(&self, mode: Mode, [shared, nuisance]: [&[f64]; 2], out: &mut [f64]) -> Result<(), String> {
        let decay = self.decay(mode, [shared, nuisance]);
        decay.read(times(self.run)?, self.start(mode, nuisance), out).map_err(|e| e.to_string())
    }

    /// What is left of one unit of the sensor's transient.
    fn fade(&self, shared: &[f64], out: &mut [f64]) -> Result<(), String> {
        let lag = shared[self.layout.lag.slot];
        for (y, t) in out.iter_mut().zip(times(self.run)?) {
            *y = (-t / lag).exp();
        }
        Ok(())
    }
}

/// Adds as many times another reading.
fn add(out: &mut [f64], times: f64, more: &[f64]) {
    out.iter_mut().zip(more).for_each(|(y, x)| *y += times * x);
}

fn times(run: &Run) -> Result<&[f64], String> {
    run.inputs.first().map(Vec::as_slice).ok_or_else(|| "there is no column of times".to_owned())
}
