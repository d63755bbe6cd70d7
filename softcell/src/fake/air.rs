//! Air in the tip: a pulsed valve from a compressor, and an orifice that always leaks.

/// The chamber, its valve and its leak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    /// Gauge pressure of the supply, Pa.
    pub supply_pa: f64,
    /// Rise of the pressure with the valve open, Pa/s for each sqrt(Pa) between supply and chamber.
    pub inlet: f64,
    /// Fall by the leak, Pa/s for each sqrt(Pa).
    pub leak: f64,
    /// Fall by the valve when it lets air out, Pa/s for each sqrt(Pa).
    pub outlet: f64,
    /// Period of the pulses, s.
    pub period_s: f64,
    /// Command, -1 to 1.
    pub command: f64,
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    phase_s: f64,
}

impl Air {
    /// A compressor of 410 kPa, pulses of 50 Hz.
    pub fn matl_2021() -> Self {
        Self {
            supply_pa: 410e3,
            inlet: 40.0,
            leak: 90.0,
            outlet: 300.0,
            period_s: 0.02,
            command: 0.0,
            pressure_pa: 0.0,
            phase_s: 0.0,
        }
    }

    /// Lets time pass, in steps of at most 0.5 ms: the valve is open or shut, the fraction is one of time.
    pub fn pass(&mut self, duration_s: f64) {
        let steps = (duration_s / 0.5e-3).ceil().max(1.0);
        let dt = duration_s / steps;
        for _ in 0..steps as usize {
            self.phase_s = (self.phase_s + dt) % self.period_s;
            let open = self.phase_s < self.command.abs() * self.period_s;
            let gap = (self.supply_pa - self.pressure_pa).max(0.0);
            let mut rate = -self.leak * self.pressure_pa.sqrt();
            if open && self.command > 0.0 {
                rate += self.inlet * gap.sqrt();
            } else if open {
                rate -= self.outlet * self.pressure_pa.sqrt();
            }
            self.pressure_pa = (self.pressure_pa + rate * dt).max(0.0);
        }
    }
}
