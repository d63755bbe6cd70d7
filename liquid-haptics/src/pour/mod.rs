//! Pouring a wanted volume: how far to tilt, when liquid begins to leave, and how fast to turn.
//!
//! [Matl 2021], eq. 2.7: in an open container at a tilt stays what lies below the lowest point of its rim. Surface tension holds the level a
//! little higher, by the thickness of a puddle, `2 l_c sin(angle / 2)` with the capillary length `l_c = sqrt(sigma / (rho g))`
//! (de Gennes, Brochard-Wyart and Quere 2004, Capillarity and Wetting Phenomena, section 2.2,
//! doi:10.1007/978-0-387-21656-0): a level at rest at the lip must rise to the bead of the advancing contact angle before it
//! breaks, and a stream stops at that of the receding one. Liquid at rest, turned slowly; a viscous film that stays on the
//! wall is not counted.

pub mod closed_loop;
mod error;

pub use error::PourError;

use std::f64::consts::PI;

use crate::container::{Container, Cylinder, up_at_tilt};
use crate::root::root;

/// Steps of the scan for the first tilt at which a volume has left: 5 degrees of 180, as every new tilt of a mesh costs a plan.
const STEPS: usize = 36;
/// To which a tilt is found, rad.
const TILT_TOLERANCE_RAD: f64 = 1e-14;
/// Volumes that differ by less than this share of the capacity are alike.
const ROUNDING: f64 = 1e-13;
/// Half the step of the central difference of the volume by the tilt, rad: rounding and cubic terms are both near 1e-10.
const HALF_STEP_RAD: f64 = 1e-5;

/// The inner rim that liquid leaves over: a circle about the container's axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mouth {
    radius_m: f64,
    height_m: f64,
}

impl Mouth {
    /// A rim of inner radius (m, above 0; a lip's where there is one) at a height (m) above the container's outer bottom.
    ///
    /// # Errors
    /// [`PourError::Range`].
    pub fn new(radius_m: f64, height_m: f64) -> Result<Self, PourError> {
        positive("radius_m", radius_m)?;
        positive("height_m", height_m)?;
        Ok(Self { radius_m, height_m })
    }

    /// The rim of a cylinder without its lid: as wide as the cavity, at its upper end.
    pub fn of_cylinder(cylinder: &Cylinder) -> Self {
        Self { radius_m: cylinder.inner_radius_m(), height_m: cylinder.wall_m() + cylinder.inner_length_m() }
    }

    /// Height of the rim's lowest point at a tilt (rad, 0 to pi), along up from the container's origin, m.
    pub fn lowest_m(&self, tilt_rad: f64) -> f64 {
        let (sin, cos) = tilt_rad.sin_cos();
        self.height_m * cos - self.radius_m * sin
    }
}

/// How far above the rim the level stands before liquid begins to leave, and when it stops.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bead {
    hold_m: f64,
    rest_m: f64,
}

impl Bead {
    /// A measured bead: the level breaks over the rim at `hold_m` above it and comes to rest at `rest_m` (both m, 0 or more, the
    /// latter not above the former).
    ///
    /// # Errors
    /// [`PourError::Range`].
    pub fn measured(hold_m: f64, rest_m: f64) -> Result<Self, PourError> {
        within("hold_m", hold_m, f64::MAX, "0 or more")?;
        within("rest_m", rest_m, hold_m, "0 to hold_m")?;
        Ok(Self { hold_m, rest_m })
    }

    /// The bead of a liquid of surface tension (N/m), density (kg/m^3) and advancing and receding contact angle on the rim (rad,
    /// 0 to pi, the latter not above the former) under gravity (m/s^2): `2 l_c sin(angle / 2)` each.
    ///
    /// Water at 90 degrees stands 3.9 mm high, at 135 degrees 5.0 mm. A rim's edge pins the liquid at larger angles than its flat
    /// material would, so that a measured bead is better.
    ///
    /// # Errors
    /// [`PourError::Range`].
    pub fn capillary(
        surface_tension_n_m: f64,
        density_kg_m3: f64,
        advancing_rad: f64,
        receding_rad: f64,
        gravity_m_s2: f64,
    ) -> Result<Self, PourError> {
        positive("surface_tension_n_m", surface_tension_n_m)?;
        positive("density_kg_m3", density_kg_m3)?;
        positive("gravity_m_s2", gravity_m_s2)?;
        within("advancing_rad", advancing_rad, PI, "0 to pi")?;
        within("receding_rad", receding_rad, advancing_rad, "0 to advancing_rad")?;
        let capillary_length = (surface_tension_n_m / (density_kg_m3 * gravity_m_s2)).sqrt();
        let height = |angle: f64| 2.0 * capillary_length * (0.5 * angle).sin();
        Ok(Self { hold_m: height(advancing_rad), rest_m: height(receding_rad) })
    }

    /// Height above the rim at which the level breaks, m.
    pub fn hold_m(&self) -> f64 {
        self.hold_m
    }

    /// Height above the rim at which a stream stops, m.
    pub fn rest_m(&self) -> f64 {
        self.rest_m
    }
}

/// What can be poured of a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pourable {
    /// The tilt at which the bead breaks, rad.
    pub start_tilt_rad: f64,
    /// The least that leaves once it has broken, m^3.
    pub least_m3: f64,
    /// The most that leaves up to the steepest tilt, m^3.
    pub most_m3: f64,
}

/// An open container that is poured from by tilting it from upright.
#[derive(Clone, Copy)]
pub struct Pour<'a> {
    container: &'a dyn Container,
    mouth: Mouth,
    bead: Bead,
    steepest_rad: f64,
}

impl<'a> Pour<'a> {
    /// Pouring from a container over its mouth, tilts up to `steepest_rad` (above 0, at most pi).
    ///
    /// # Errors
    /// [`PourError::Range`].
    pub fn new(
        container: &'a dyn Container,
        mouth: Mouth,
        bead: Bead,
        steepest_rad: f64,
    ) -> Result<Self, PourError> {
        positive("steepest_rad", steepest_rad)?;
        within("steepest_rad", steepest_rad, PI, "above 0, at most pi")?;
        Ok(Self { container, mouth, bead, steepest_rad })
    }

    /// The volume that stays at a tilt (rad) of a container from which liquid runs: what lies below the rim and the bead's rest,
    /// m^3.
    ///
    /// # Errors
    /// [`PourError::Range`] for a tilt beyond 0 to the steepest, and the container's.
    pub fn stays_m3(&self, tilt_rad: f64) -> Result<f64, PourError> {
        within("tilt_rad", tilt_rad, self.steepest_rad, "0 to the steepest tilt")?;
        self.below(tilt_rad, self.bead.rest_m)
    }

    /// What can be poured with a volume (m^3) inside.
    ///
    /// # Errors
    /// [`PourError::Range`] for a volume that does not fit, [`PourError::NothingLeaves`], and the container's.
    pub fn pourable(&self, inside_m3: f64) -> Result<Pourable, PourError> {
        positive("inside_m3", inside_m3)?;
        within("inside_m3", inside_m3, self.container.capacity_m3(), "above 0, at most the capacity")?;
        let nothing = PourError::NothingLeaves { inside_m3, steepest_rad: self.steepest_rad };
        let Some(start_tilt_rad) = self.first_tilt(0.0, self.bead.hold_m, inside_m3 * (1.0 - ROUNDING))?
        else {
            return Err(nothing);
        };
        let after = self.below(start_tilt_rad, self.bead.rest_m)?;
        let least_m3 = (inside_m3 - after).max(0.0);
        let mut lowest = after;
        for tilt in self.scan(start_tilt_rad) {
            lowest = lowest.min(self.below(tilt, self.bead.rest_m)?);
        }
        Ok(Pourable { start_tilt_rad, least_m3, most_m3: inside_m3 - lowest })
    }

    /// The tilt (rad) at which `wanted_m3` of the `inside_m3` have left ([Matl 2021], eq. 2.7), to rounding.
    ///
    /// # Errors
    /// [`PourError::NotPourable`] for more than there is or less than the bead lets out, with what can be poured; else as
    /// [`Pour::pourable`].
    pub fn tilt_rad(&self, inside_m3: f64, wanted_m3: f64) -> Result<f64, PourError> {
        positive("wanted_m3", wanted_m3)?;
        let pourable = self.pourable(inside_m3)?;
        let (least_m3, most_m3) = (pourable.least_m3, pourable.most_m3);
        // Rounding must not refuse the very ends.
        let slack = ROUNDING * self.container.capacity_m3();
        let refused = PourError::NotPourable { wanted_m3, least_m3, most_m3 };
        if wanted_m3 < least_m3 - slack || wanted_m3 > most_m3 + slack {
            return Err(refused);
        }
        let stays = inside_m3 - wanted_m3.clamp(least_m3, most_m3) + slack;
        self.first_tilt(pourable.start_tilt_rad, self.bead.rest_m, stays)?.ok_or(refused)
    }

    /// The rate of tilting (rad/s) at a tilt (rad) for a volume flow (m^3/s) over the rim, of a container from which liquid runs.
    ///
    /// # Errors
    /// [`PourError::NoFlow`] where tilting further lets nothing out, [`PourError::Range`], and the container's.
    pub fn tilt_rate_rad_s(&self, tilt_rad: f64, flow_m3_s: f64) -> Result<f64, PourError> {
        within("tilt_rad", tilt_rad, self.steepest_rad, "0 to the steepest tilt")?;
        positive("flow_m3_s", flow_m3_s)?;
        let low = (tilt_rad - HALF_STEP_RAD).max(0.0);
        let high = (tilt_rad + HALF_STEP_RAD).min(self.steepest_rad);
        let fall = self.below(low, self.bead.rest_m)? - self.below(high, self.bead.rest_m)?;
        // A difference of rounding errors is no flow.
        if !(fall > ROUNDING * self.container.capacity_m3()) {
            return Err(PourError::NoFlow { tilt_rad });
        }
        Ok(flow_m3_s * (high - low) / fall)
    }

    fn below(&self, tilt_rad: f64, bead_m: f64) -> Result<f64, PourError> {
        let level = self.mouth.lowest_m(tilt_rad) + bead_m;
        Ok(self.container.volume_below(&up_at_tilt(tilt_rad), level)?)
    }

    /// Tilts beyond `from` up to the steepest.
    fn scan(&self, from: f64) -> impl Iterator<Item = f64> + use<> {
        let steepest = self.steepest_rad;
        (1..=STEPS).map(move |k| steepest * k as f64 / STEPS as f64).filter(move |tilt| *tilt > from)
    }

    /// The first tilt from `from` on at which less than `volume` lies below rim and bead.
    ///
    /// Volumes that stay need not fall all the way (a belly behind a lip fills again): what counts is the first time.
    fn first_tilt(&self, from: f64, bead: f64, volume: f64) -> Result<Option<f64>, PourError> {
        let excess = |tilt: f64| self.below(tilt, bead).map(|below| below - volume);
        let mut before = (from, excess(from)?);
        if before.1 < 0.0 {
            return Ok(Some(from));
        }
        for tilt in self.scan(from) {
            let here = (tilt, excess(tilt)?);
            if here.1 < 0.0 {
                return root(excess, before, here, TILT_TOLERANCE_RAD).map(Some);
            }
            before = here;
        }
        Ok(None)
    }
}

fn positive(name: &'static str, got: f64) -> Result<(), PourError> {
    if got > 0.0 && got.is_finite() {
        Ok(())
    } else {
        Err(PourError::Range { name, got, expected: "above 0", most: f64::INFINITY })
    }
}

fn within(name: &'static str, got: f64, most: f64, expected: &'static str) -> Result<(), PourError> {
    if got >= 0.0 && got <= most { Ok(()) } else { Err(PourError::Range { name, got, expected, most }) }
}
