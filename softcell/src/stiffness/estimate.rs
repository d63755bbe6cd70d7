//! Presses together: the likelihood of each modulus, with the instrument's errors integrated out.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::press::{Instrument, Press};
use super::reduce::{Amplitude, NODES, Reduced, node_pa};
use super::tip::TipModulus;
use super::{StiffnessError, tip};

/// What presses say of a quantity that is above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// A value with its 95 % interval.
    Within {
        /// Most likely value.
        value: f64,
        /// Least value of the interval.
        low: f64,
        /// Greatest value of the interval.
        high: f64,
    },
    /// With 95 % at least this much: the object gives way too little beside the tip.
    AtLeast(f64),
    /// With 95 % at most this much: the tip gives way too little beside the object.
    AtMost(f64),
}

impl Bound {
    /// Whether a value is allowed.
    pub fn holds(&self, truth: f64) -> bool {
        match *self {
            Self::Within { low, high, .. } => (low..=high).contains(&truth),
            Self::AtLeast(low) => truth >= low,
            Self::AtMost(high) => truth <= high,
        }
    }

    /// Greatest over least value; infinite for a bound on one side.
    pub fn factor(&self) -> f64 {
        match *self {
            Self::Within { low, high, .. } => high / low,
            _ => f64::INFINITY,
        }
    }

    fn times(&self, by: f64) -> Self {
        match *self {
            Self::Within { value, low, high } => {
                Self::Within { value: by * value, low: by * low, high: by * high }
            }
            Self::AtLeast(low) => Self::AtLeast(by * low),
            Self::AtMost(high) => Self::AtMost(by * high),
        }
    }
}

/// How stiff an object is.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Modulus in plane strain, `E/(1 - nu^2)`, Pa.
    pub modulus_pa: Bound,
    /// Stiffness at the largest contact, `dF/d delta = 2 E* a` (Johnson 1985, section 4.2), N/m.
    pub spring_n_m: Bound,
    /// The largest contact, m.
    pub contact_m: f64,
    /// Weighted square of what presses leave together, of as many degrees of freedom as there are presses but one.
    pub chi_squared: f64,
}

/// Presses on one object.
#[derive(Debug, Clone, PartialEq)]
pub struct Palpation {
    pub(super) tip: TipModulus,
    pub(super) instrument: Instrument,
    pub(super) presses: Vec<Reduced>,
    log_likelihood: Vec<f64>,
}

/// Half of the quantiles of chi-squared with one degree of freedom, at 95 % and at 90 % (95 % on one side).
const TWO_SIDES: f64 = 1.920_729_410_347_062;
const ONE_SIDE: f64 = 1.352_771_727_047_702;
/// Probability below which presses are said to contradict each other.
const CONTRADICTION: f64 = 1e-4;

impl Palpation {
    /// No presses yet.
    ///
    /// # Errors
    /// [`StiffnessError::Value`].
    pub fn new(tip: TipModulus, instrument: Instrument) -> Result<Self, StiffnessError> {
        instrument.check()?;
        Ok(Self { tip, instrument, presses: Vec::new(), log_likelihood: vec![0.0; NODES] })
    }

    /// Takes a press; one that is refused is left out.
    ///
    /// # Errors
    /// [`StiffnessError`].
    pub fn add(&mut self, press: &Press) -> Result<(), StiffnessError> {
        let reduced = press.reduce(&self.tip, &self.instrument)?;
        self.presses.push(reduced);
        self.log_likelihood = (0..NODES).map(|node| self.at(node as f64)[0]).collect();
        Ok(())
    }

    /// Presses so far.
    pub fn presses(&self) -> usize {
        self.presses.len()
    }

    /// Moduli (Pa) with the logarithm of their likelihood, up to a constant.
    pub fn log_likelihood(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.log_likelihood.iter().enumerate().map(|(node, l)| [node_pa(node as f64), *l])
    }

    /// What the presses say together: moduli whose likelihood is not below the greatest by more than a quantile of chi-squared.
    ///
    /// # Errors
    /// [`StiffnessError::Undecided`], [`StiffnessError::Inconsistent`].
    pub fn estimate(&self) -> Result<Estimate, StiffnessError> {
        let presses = self.presses.len();
        let l = &self.log_likelihood;
        let undecided = StiffnessError::Undecided { presses };
        let node = (0..NODES).max_by(|a, b| l[*a].total_cmp(&l[*b])).ok_or(undecided)?;
        let peak = self.peak(node);
        let [top, chi_squared] = self.at(peak);
        let open = [0, NODES - 1].map(|end| l[end] > top - TWO_SIDES);
        if presses == 0 || open == [true, true] {
            return Err(undecided);
        }
        let freedom = (presses as f64 - 1.0).max(1.0);
        if ChiSquared::new(freedom).is_ok_and(|d| d.sf(chi_squared) < CONTRADICTION) {
            return Err(StiffnessError::Inconsistent { presses, chi_squared });
        }
        let edge = |up, drop| node_pa(self.edge(peak, up, top - drop));
        let modulus_pa = match open {
            [_, true] => Bound::AtLeast(edge(false, ONE_SIDE)),
            [true, _] => Bound::AtMost(edge(true, ONE_SIDE)),
            _ => Bound::Within {
                value: node_pa(peak),
                low: edge(false, TWO_SIDES),
                high: edge(true, TWO_SIDES),
            },
        };
        let contact_m = self.presses.iter().map(|p| p.contact_m).fold(0.0, f64::max);
        Ok(Estimate { spring_n_m: modulus_pa.times(2.0 * contact_m), modulus_pa, contact_m, chi_squared })
    }

    /// The place of the greatest likelihood within a node of one, by golden sections.
    fn peak(&self, node: usize) -> f64 {
        const GOLDEN: f64 = 0.618_033_988_749_894_9;
        let (mut low, mut high) = ((node as f64 - 1.0).max(0.0), (node as f64 + 1.0).min(NODES as f64 - 1.0));
        for _ in 0..40 {
            let (left, right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            if self.at(left)[0] > self.at(right)[0] {
                high = right;
            } else {
                low = left;
            }
        }
        let between = 0.5 * (low + high);
        if self.at(between)[0] > self.at(node as f64)[0] { between } else { node as f64 }
    }

    /// The place where the logarithm of the likelihood has fallen to a value, going up or down from the peak; the last node where it does not.
    fn edge(&self, peak: f64, up: bool, wanted: f64) -> f64 {
        let last = NODES as f64 - 1.0;
        let mut inside = peak;
        loop {
            let node = if up { (inside.floor() + 1.0).min(last) } else { (inside.ceil() - 1.0).max(0.0) };
            if self.at(node)[0] < wanted {
                let mut outside = node;
                for _ in 0..40 {
                    let middle = 0.5 * (inside + outside);
                    if self.at(middle)[0] < wanted { outside = middle } else { inside = middle }
                }
                return inside;
            }
            if node == inside || node == if up { last } else { 0.0 } {
                return node;
            }
            inside = node;
        }
    }

    /// Logarithm of the likelihood at a place among the nodes, and the weighted square of what the presses leave: amplitudes are 1 but for noise and the instrument's
    /// errors, which are normal given the modulus.
    fn at(&self, place: f64) -> [f64; 2] {
        let at: Vec<Amplitude> = self.presses.iter().map(|p| p.at(place)).collect();
        let of: Vec<Spread> = self.presses.iter().zip(&at).map(|(p, at)| Spread::of(p, at)).collect();
        let Some(cholesky) = covariance(&of, &self.instrument).cholesky() else {
            return [f64::NEG_INFINITY; 2];
        };
        let left = DVector::from_iterator(of.len(), at.iter().map(|a| a.value - 1.0));
        let chi_squared = left.dot(&cholesky.solve(&left));
        // Presses whose residuals are more than noise count for less, as in their amplitudes' variances.
        let of_shape: f64 = self.presses.iter().zip(&at).map(|(p, at)| at.chi_squared / p.scatter()).sum();
        let log_determinant: f64 = 2.0 * cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        // The variance of an amplitude is relative: that of the indentation itself is the same for all moduli.
        let scale: f64 = of.iter().map(|s| s.share.ln()).sum();
        [-0.5 * (chi_squared + of_shape + log_determinant) - scale, chi_squared]
    }
}

/// What an amplitude's errors are made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    /// By noise.
    pub(super) variance: f64,
    /// Part of the travel that is the tip's.
    pub(super) share: f64,
    /// Part of the tip's modulus that is the rubber's.
    pub(super) rubber_share: f64,
    /// Error of the tip's calibrated modulus.
    pub(super) error_share: f64,
    /// Modulus of the tip, Pa.
    pub(super) tip_pa: f64,
}

impl Spread {
    pub(super) fn of(press: &Reduced, at: &Amplitude) -> Self {
        let (rubber_share, error_share) = (press.rubber_share, press.error_share);
        Self { variance: at.variance, share: at.share, rubber_share, error_share, tip_pa: at.tip_pa }
    }

    pub(super) fn planned(state: &tip::TipState, object_pa: f64, slope_variance: f64) -> Self {
        let share = object_pa / (object_pa + state.modulus_pa);
        let variance = slope_variance / (share * share);
        let (rubber_share, error_share) = (state.rubber_share, state.error_share);
        Self { variance, share, rubber_share, error_share, tip_pa: state.modulus_pa }
    }
}

/// Covariance of amplitudes: `A = 1 + gain - (1 - s) (f ageing + (1 - f) air + gel + model)`. What two springs and the calibration's fit leave out is the same at
/// the same pressure, and fades from one to the next with the logarithm of the tip's modulus.
pub(super) fn covariance(of: &[Spread], instrument: &Instrument) -> DMatrix<f64> {
    let common = |s: &Spread| {
        let gives = 1.0 - s.share;
        [
            instrument.gain_share,
            -gives * s.rubber_share * instrument.ageing_share,
            -gives * (1.0 - s.rubber_share) * instrument.air_share,
            -gives * instrument.gel_share,
        ]
    };
    let model = |s: &Spread| (1.0 - s.share) * instrument.model_share.hypot(s.error_share);
    DMatrix::from_fn(of.len(), of.len(), |i, k| {
        let shared: f64 = common(&of[i]).iter().zip(common(&of[k])).map(|(a, b)| a * b).sum();
        let alike = (-(of[i].tip_pa / of[k].tip_pa).ln().abs()).exp();
        let noise = if i == k { of[i].variance } else { 0.0 };
        shared + alike * model(&of[i]) * model(&of[k]) + noise
    })
}
