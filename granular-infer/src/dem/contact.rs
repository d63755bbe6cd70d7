//! One contact: normal force, tangential spring, rolling spring, twisting dashpot.

use super::{
    material::Factors,
    vector::{V3, along, cross, dot, scale, sub},
};

/// What a contact remembers while it lasts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct History {
    /// Tangential spring's force in N.
    pub(crate) shear: V3,
    /// s at the step before; 0 for a contact that begins.
    pub(crate) size: f64,
    /// Rolling spring's couple in N m.
    pub(crate) couple: V3,
    /// The round of forces in which the contact last was.
    pub(crate) round: u64,
}

/// What two bodies are together, worked out when they become neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Pair {
    /// Reduced radius R* in m.
    pub(crate) radius: f64,
    /// Square root of the reduced mass m*.
    pub(crate) root_mass: f64,
    /// Square root of the reduced inertia about the contact point, `I_r`.
    pub(crate) root_inertia: f64,
}

impl Pair {
    /// Two grains by radius and mass.
    pub(crate) fn of(radius: [f64; 2], mass: [f64; 2]) -> Self {
        let reduced = |a: f64, b: f64| a * b / (a + b);
        let inertia = |i: usize| 1.4 * mass[i] * radius[i] * radius[i];
        Self {
            radius: reduced(radius[0], radius[1]),
            root_mass: reduced(mass[0], mass[1]).sqrt(),
            root_inertia: reduced(inertia(0), inertia(1)).sqrt(),
        }
    }

    /// A grain on a wall.
    pub(crate) fn wall(radius: f64, mass: f64) -> Self {
        Self { radius, root_mass: mass.sqrt(), root_inertia: (1.4 * mass).sqrt() * radius }
    }
}

/// How two bodies lie and move: the second seen from the first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Touch {
    /// Unit vector from the second body to the first.
    pub(crate) normal: V3,
    /// Overlap in m, positive.
    pub(crate) overlap: f64,
    /// s and q of [`sizes`].
    pub(crate) sizes: (f64, f64),
    /// Velocity of the first centre less that of the second, m/s.
    pub(crate) velocity: V3,
    /// Sum of angular velocities times the distances from centre to contact, m/s.
    pub(crate) surface: V3,
    /// Angular velocity of the first less that of the second, rad/s.
    pub(crate) rotation: V3,
}

/// What the first body feels; the second feels the opposite force and couple.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reaction {
    /// Force in N.
    pub(crate) force: V3,
    /// `normal x force`: times minus the lever, the torque on either body.
    pub(crate) turn: V3,
    /// Couple in N m.
    pub(crate) couple: V3,
}

/// `s = sqrt(R* delta)` and `q = sqrt(s)` for Hertz, 1 and 1 for the linear law.
#[inline(always)]
pub(crate) fn sizes(hertz: bool, radius: f64, overlap: f64) -> (f64, f64) {
    if hertz {
        let s = (radius * overlap).sqrt();
        (s, s.sqrt())
    } else {
        (1.0, 1.0)
    }
}

/// Forces of a contact, its history moved on by one step.
///
/// The tangential spring holds its force, which falls with the stiffness while the contact unloads: kept as a displacement it
/// would create energy (Elata and Berryman 1996, Mechanics of Materials 24, 229). Springs slip at their limits; dashpots fill
/// what is left below them.
#[inline(always)]
pub(crate) fn react(f: &Factors, pair: &Pair, touch: &Touch, history: &mut History, step: f64) -> Reaction {
    let n = touch.normal;
    let (s, q) = touch.sizes;
    let damping = q * pair.root_mass;
    let approach = dot(touch.velocity, n);
    let pressed = f.elastic * s * touch.overlap - f.damping_n * damping * approach;
    let held = pressed.max(0.0);

    // A contact that begins has size 0 and springs at 0.
    let less = (s / history.size).min(1.0);
    let before = along(scale(history.shear, less), -less * dot(history.shear, n), n);
    history.size = s;

    let stiffness = f.shear * s;
    let slip = sub(along(touch.velocity, -approach, n), cross(touch.surface, n));
    let trial = along(before, -stiffness * step, slip);
    let tangential;
    (history.shear, tangential) = spring(trial, f.damping_t * damping, slip, f.friction * held);

    let spin = dot(touch.rotation, n);
    let rolls = along(touch.rotation, -spin, n);
    let dashpot = f.damping_r * q * pair.root_inertia;
    let rate = stiffness * step * pair.radius * pair.radius;
    let trial = along(scale(history.couple, less), -rate, rolls);
    let rolled;
    (history.couple, rolled) = spring(trial, dashpot * pair.radius, rolls, f.rolling * pair.radius * held);

    // Twisting: damped as a spring S_t a^2 / 2 with 2/7 of rolling's inertia would be, at most 2/3 mu_s a F_n.
    let a = if f.hertz { s } else { (pair.radius * touch.overlap).sqrt() };
    let most = if f.rolling > 0.0 { 2.0 / 3.0 * f.friction * a * held } else { 0.0 };
    let twist = (1.0 / 7.0_f64).sqrt() * dashpot * a * spin;
    let couple = along(rolled, -twist.min(most).max(-most), n);
    Reaction {
        force: along(tangential, pressed - f.adhesion * pair.radius, n),
        turn: cross(n, tangential),
        couple,
    }
}

/// Cuts a spring's load to a limit and adds a dashpot as far as the limit allows: what is stored, what acts.
///
/// All cases are worked out and one is chosen, without a branch: that lets contacts go side by side.
#[inline(always)]
fn spring(load: V3, dashpot: f64, rate: V3, limit: f64) -> (V3, V3) {
    let (square, most) = (dot(load, load), limit * limit);
    let size = square.sqrt();
    let slips = square > most;
    let whole = along(load, -dashpot, rate);
    let share = ((limit - size) / (dashpot * dot(rate, rate).sqrt())).clamp(0.0, 1.0);
    let share = if dot(whole, whole) <= most { 1.0 } else { share };
    let stored = scale(load, if slips { limit / size } else { 1.0 });
    (stored, along(stored, -dashpot * if slips { 0.0 } else { share }, rate))
}
