//! Objects, ways to choose a pressure, and presses until an interval is narrow.

use softcell::fake::{Errors, Object, Palpator};
use softcell::stiffness::{Bound, Instrument, Palpation, Plan, TipModulus};

use crate::Outcome;

/// Greatest over least modulus of the interval that is wanted.
pub(crate) const WANTED: f64 = 1.5;
/// Most presses.
pub(crate) const PRESSES: usize = 8;
/// Pressures that can be had, Pa.
pub(crate) const PRESSURES_PA: [f64; 6] = [0.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

/// An object: modulus in plane strain (Pa), radius (m).
pub(crate) struct Kind {
    pub(crate) name: &'static str,
    pub(crate) modulus_pa: f64,
    radius_m: f64,
}

const fn kind(name: &'static str, modulus_pa: f64, radius_m: f64) -> Kind {
    Kind { name, modulus_pa, radius_m }
}

/// From a gel to wood; flat where the radius is infinite.
pub(crate) const OBJECTS: [Kind; 8] = [
    kind("gel", 2e3, f64::INFINITY),
    kind("gel, ball of 30 mm", 5e3, 0.030),
    kind("foam", 15e3, f64::INFINITY),
    kind("fat, ball of 30 mm", 40e3, 0.030),
    kind("muscle", 120e3, f64::INFINITY),
    kind("rubber, ball of 40 mm", 400e3, 0.040),
    kind("rubber, hard", 2e6, f64::INFINITY),
    kind("wood-like", 10e6, f64::INFINITY),
];

impl Kind {
    pub(crate) fn object(&self) -> Object {
        Object { modulus_pa: self.modulus_pa, radius_m: self.radius_m, dent: 0.0 }
    }
}

/// How the next pressure is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Policy {
    /// The one that is expected to narrow the interval most.
    Chosen,
    /// The one at which the tip is as stiff as the object.
    Matched,
    /// Always the same, Pa.
    Fixed(f64),
}

impl Policy {
    pub(crate) const ALL: [Self; 5] =
        [Self::Chosen, Self::Matched, Self::Fixed(0.0), Self::Fixed(1e3), Self::Fixed(8e3)];

    pub(crate) fn name(self) -> String {
        match self {
            Self::Chosen => "chosen".into(),
            Self::Matched => "matched".into(),
            Self::Fixed(p) => format!("{} kPa", 1e-3 * p),
        }
    }

    pub(crate) fn next_pa(self, palpation: &Palpation) -> Outcome<f64> {
        Ok(match self {
            Self::Chosen => palpation.next(&plan()?)?.pressure_pa,
            Self::Matched => palpation.matched(&plan()?)?,
            Self::Fixed(p) => p,
        })
    }
}

fn plan() -> Outcome<Plan> {
    Ok(Plan::new(PRESSURES_PA.to_vec(), 5e-3, 8e-3, 28, (1e3, 1e6))?)
}

/// What came of a palpation.
pub(crate) struct Felt {
    truth_pa: f64,
    pub(crate) bound: Bound,
    pub(crate) presses: usize,
    /// Whether the interval got as narrow as is wanted.
    pub(crate) there: bool,
    /// Presses that were refused, or made no estimate.
    pub(crate) refused: usize,
}

impl Felt {
    pub(crate) fn holds(&self) -> bool {
        self.bound.holds(self.truth_pa)
    }

    /// Error of the modulus' logarithm over its standard deviation.
    pub(crate) fn error(&self) -> Option<f64> {
        let Bound::Within { value, low, high } = self.bound else { return None };
        Some((value / self.truth_pa).ln() / ((high / low).ln() / 3.92))
    }
}

/// The tip, pressed on gels at seven pressures.
pub(crate) fn calibrated(rig: &mut Palpator) -> Outcome<TipModulus> {
    let samples = rig
        .calibrate(&[0.0, 300.0, 700.0, 1500.0, 3000.0, 5000.0, 8000.0])
        .ok_or("no contact to be solved")?;
    Ok(TipModulus::fit(&samples)?)
}

/// An object on a rig of its own, once for each policy.
pub(crate) fn on_rig(object: usize, seed: u64, policies: &[Policy], most: usize) -> Outcome<Vec<Felt>> {
    let mut rig = Palpator::new(Errors::matl_2021(), seed).ok_or("no tip")?;
    let tip = calibrated(&mut rig)?;
    policies
        .iter()
        .map(|policy| {
            let palpation = Palpation::new(tip.clone(), Instrument::matl_2021())?;
            palpate(&mut rig, palpation, object, *policy, most, &mut |_| {})
        })
        .collect()
}

/// Presses until the interval is narrow; `observe` sees what is known after each press.
pub(crate) fn palpate(
    rig: &mut Palpator,
    mut palpation: Palpation,
    object: usize,
    policy: Policy,
    most: usize,
    observe: &mut dyn FnMut(&Palpation),
) -> Outcome<Felt> {
    let kind = &OBJECTS[object];
    let (mut presses, mut refused) = (0, 0);
    let mut bound = Bound::AtLeast(0.0);
    let mut there = false;
    while presses < most && !there {
        let press =
            rig.press(&kind.object(), policy.next_pa(&palpation)?).ok_or("no contact to be solved")?;
        presses += 1;
        // One of some hundreds looks like hysteresis or a contradiction by chance; what was known before stands.
        match palpation.add(&press).and_then(|()| palpation.estimate()) {
            Ok(estimate) => bound = estimate.modulus_pa,
            Err(_) => refused += 1,
        }
        there = bound.factor() <= WANTED;
        observe(&palpation);
    }
    Ok(Felt { truth_pa: kind.modulus_pa, bound, presses, there, refused })
}
