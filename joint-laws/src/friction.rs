//! Dry friction: a force that opposes sliding, and holds at rest whatever is below it.

use crate::Number;

/// Dry friction of one joint, in units of the derivative of its velocity.
///
/// While the joint slides with the velocity `v` (direction `s` = 1 forward, -1 backward) the friction is `-s F(s, v)`,
/// `F(s, v) = level + s forward_less_backward / 2 + stribeck_level exp(-(v / stribeck_speed)^2) + load_fraction |load|`,
/// where `load` is the driving force. At rest it balances any force between `-F(-1, 0)` and `F(1, 0)`
/// (Armstrong-Helouvry, Dupont and Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DryFriction<T> {
    /// Coulomb's friction, at least 0.
    pub level: T,
    /// By how much the friction of forward motion exceeds that of backward motion.
    pub forward_less_backward: T,
    /// Stribeck's extra friction at rest, at least 0.
    pub stribeck_level: T,
    /// The speed over which that fades, above 0.
    pub stribeck_speed: T,
    /// The part of the modulus of the driving force that is lost, at least 0.
    pub load_fraction: T,
}

impl<T: Number> DryFriction<T> {
    /// No friction; `stribeck_speed` is where Stribeck's friction would fade.
    pub fn none(stribeck_speed: T) -> Self {
        let zero = T::from(0.0);
        Self {
            level: zero,
            forward_less_backward: zero,
            stribeck_level: zero,
            stribeck_speed,
            load_fraction: zero,
        }
    }

    /// The friction `F(s, v)` that opposes sliding in the direction `forward` with a velocity, under a driving force.
    ///
    /// May be below 0 where the asymmetry exceeds the rest.
    #[inline(always)]
    pub fn resistance(&self, forward: bool, velocity: T, load: T) -> T {
        // Most joints have few of these, and each costs its derivatives.
        let zero = T::from(0.0);
        let mut all = self.level;
        if self.forward_less_backward != zero {
            all += self.forward_less_backward * if forward { 0.5 } else { -0.5 };
        }
        if self.load_fraction != zero {
            all += self.load_fraction * load.modulus();
        }
        if self.stribeck_level != zero {
            let ratio = velocity / self.stribeck_speed;
            all += self.stribeck_level * (-ratio * ratio).exp();
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn each_part_is_what_the_law_says() {
        let law = DryFriction {
            level: 2.0,
            forward_less_backward: 0.4,
            stribeck_level: 1.0,
            stribeck_speed: 0.1,
            load_fraction: 0.25,
        };
        assert_relative_eq!(law.resistance(true, 0.0, -4.0), 2.0 + 0.2 + 1.0 + 1.0);
        assert_relative_eq!(law.resistance(false, -0.1, 4.0), 2.0 - 0.2 + (-1.0_f64).exp() + 1.0);
        assert_relative_eq!(DryFriction::none(0.1).resistance(true, 0.3, 5.0), 0.0);
    }
}
