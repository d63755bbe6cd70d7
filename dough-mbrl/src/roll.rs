//! Rolls: what is measured of one, and the bounds within which one may lie ([Matl 2021], section 7.4).

/// Length, width and height of a dough, m.
pub type State = [f64; 3];
/// Throw and depth of the band, m.
pub type Action = [f64; 2];

/// One roll as it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Roll {
    /// The state before it.
    pub state: State,
    /// Throw and depth of the band.
    pub action: Action,
    /// The state after it.
    pub next: State,
}

/// What a rig and a person allow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Smallest throw, m.
    pub least_throw_m: f64,
    /// Largest throw, m.
    pub most_throw_m: f64,
    /// Smallest depth, so that the band touches, m.
    pub least_depth_m: f64,
}

impl Default for Limits {
    /// A depth of 5 mm ([Matl 2021]); throws of a gripper of 40 to 120 mm.
    fn default() -> Self {
        Self { least_throw_m: 0.04, most_throw_m: 0.12, least_depth_m: 5e-3 }
    }
}

/// The box in which a throw and a depth may lie.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest throw and depth, m.
    pub low: Action,
    /// Largest, m; not below `low`.
    pub high: Action,
}

impl Limits {
    /// The bounds at a state: the band is at least as long as the dough is wide, and pressed no deeper than the dough is high. A dough
    /// that is wider than the gripper opens, or lower than the smallest depth, leaves the largest throw, or its own height.
    pub fn at(&self, state: &State) -> Bounds {
        let low = state[1].max(self.least_throw_m).min(self.most_throw_m);
        let deepest = state[2].max(0.0);
        Bounds { low: [low, self.least_depth_m.min(deepest)], high: [self.most_throw_m.max(low), deepest] }
    }
}

impl Bounds {
    /// The action at a place of the unit square, from the lowest corner to the highest.
    pub fn place(&self, unit: [f64; 2]) -> Action {
        std::array::from_fn(|k| {
            let u = unit[k].clamp(0.0, 1.0);
            (self.low[k] + u * (self.high[k] - self.low[k])).clamp(self.low[k], self.high[k])
        })
    }

    /// The nearest action within; the lowest for what is no number.
    pub fn clamp(&self, action: Action) -> Action {
        std::array::from_fn(|k| {
            if action[k].is_nan() { self.low[k] } else { action[k].clamp(self.low[k], self.high[k]) }
        })
    }

    /// Whether an action lies within.
    pub fn contain(&self, action: &Action) -> bool {
        (0..2).all(|k| action[k] >= self.low[k] && action[k] <= self.high[k])
    }
}
