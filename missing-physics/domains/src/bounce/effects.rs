//! What changes a bounce.

/// What changes a bounce; all zero but the restitution and gravity: the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Effects {
    pub(super) gravity_m_s2: f64,
    /// Restitution at 1 m/s.
    pub(super) restitution: f64,
    /// By how much it falls for each m/s more.
    pub(super) slope_s_m: f64,
    pub(super) drag_per_m: f64,
    /// Slopes dz/dx and dz/dy of the table.
    pub(super) table: [f64; 2],
    /// By how much those slopes grow for each metre from where balls land on average: a bowl, or a dome below zero; 1/m.
    pub(super) curved_per_m: f64,
    /// Where balls head on average when they first come to the table (or leave it, where their fall is not known), in the
    /// recording's units of length and time.
    pub(super) heads: [f64; 2],
    /// How much farther out they head then for each metre that they land farther out, rad/m.
    pub(super) outwards_per_m: f64,
    /// Share of the speed along the table that is lost beyond the restitution.
    pub(super) friction: f64,
    pub(super) clock_rate: f64,
    /// By how much later a sound is heard that is louder by a factor of e, s: weak and loud onsets are not detected alike.
    pub(super) walk_s: f64,
    pub(super) position_scale: f64,
    /// By how much places are too large, relative to 1, where they have been heard again with the right speed of sound.
    pub(super) heard_scale: f64,
    /// 1: flights that hide unheard impacts are taken for what they are; 0: for one flight.
    pub(super) unheard: f64,
    /// Candidate terms of an unknown law, added to the logarithm of the restitution: x, y (per m), speed squared (s^2/m^2).
    pub(super) terms: [f64; 3],
}

/// Smallest restitution that is computed with.
const LEAST: f64 = 1e-3;

impl Effects {
    /// The baseline: gravity and a constant restitution.
    pub(super) const fn none(gravity_m_s2: f64, restitution: f64) -> Self {
        Self {
            gravity_m_s2,
            restitution,
            slope_s_m: 0.0,
            drag_per_m: 0.0,
            table: [0.0; 2],
            curved_per_m: 0.0,
            heads: [0.0; 2],
            outwards_per_m: 0.0,
            friction: 0.0,
            clock_rate: 0.0,
            walk_s: 0.0,
            position_scale: 0.0,
            heard_scale: 0.0,
            unheard: 0.0,
            terms: [0.0; 3],
        }
    }

    /// Slopes of the table so far (m) from where balls land on average.
    pub(super) fn table_at(&self, from_middle: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| self.table[k] + self.curved_per_m * from_middle[k])
    }

    /// Logarithm of the restitution of an impact at a place and a speed.
    pub(super) fn log_restitution(&self, place: [f64; 2], speed_m_s: f64) -> f64 {
        let [x, y, squared] = self.terms;
        (self.restitution - self.slope_s_m * (speed_m_s - 1.0)).max(LEAST).ln()
            + x * place[0]
            + y * place[1]
            + squared * speed_m_s * speed_m_s
    }
}
