//! Which pressure next: the one that is expected to narrow the interval most, or the one at which the tip is as stiff as the object.

use nalgebra::DVector;

use super::estimate::{Palpation, Spread, covariance};
use super::reduce::{Reduced, node_pa};
use super::{Bound, StiffnessError, positive};

/// What a press will be like, as far as it is known before.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Pressures that can be had, Pa, at least one, all calibrated.
    pressures_pa: Vec<f64>,
    depth_m: f64,
    contact_m: f64,
    readings: f64,
    /// Moduli (Pa) that are thought of before the first press.
    range_pa: (f64, f64),
}

/// A pressure that is proposed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Next {
    /// Gauge pressure, Pa.
    pub pressure_pa: f64,
    /// Expected standard deviation of the logarithm of the modulus after the press, as the mean of its logarithm.
    pub error_share: f64,
}

impl Plan {
    /// Presses at one of some pressures (Pa), to a depth (m) beyond the contact's begin, with a contact (m) of about that size there, and so many readings,
    /// of an object whose modulus lies somewhere in a range (Pa).
    ///
    /// # Errors
    /// [`StiffnessError::Value`].
    pub fn new(
        pressures_pa: Vec<f64>,
        depth_m: f64,
        contact_m: f64,
        readings: usize,
        range_pa: (f64, f64),
    ) -> Result<Self, StiffnessError> {
        let readings = readings as f64;
        for (what, got) in [
            ("the number of pressures", pressures_pa.len() as f64),
            ("the depth", depth_m),
            ("the contact", contact_m),
            ("the number of readings", readings),
            ("the least modulus", range_pa.0),
            ("the range of moduli", range_pa.1 - range_pa.0),
        ] {
            positive(what, got)?;
        }
        Ok(Self { pressures_pa, depth_m, contact_m, readings, range_pa })
    }
}

/// Moduli over which the expectation is taken.
const THINNED: usize = 6;

impl Palpation {
    /// The pressure whose press is expected to leave the least variance of the modulus' logarithm (mean of the variance's logarithm over what is
    /// believed now: Lindley 1956, DOI 10.1214/aoms/1177728069, for normal laws).
    ///
    /// # Errors
    /// [`StiffnessError::Beyond`], for a pressure that was not calibrated.
    pub fn next(&self, plan: &Plan) -> Result<Next, StiffnessError> {
        let believed = self.believed(plan);
        let contact_m = self.contact_m(plan);
        let mut best = Next { pressure_pa: plan.pressures_pa[0], error_share: f64::INFINITY };
        for &pressure_pa in &plan.pressures_pa {
            let state = self.tip.at(pressure_pa, contact_m, 0.5 * plan.depth_m)?;
            let mut mean = 0.0;
            for &(node, weight) in &believed {
                let mut of: Vec<Spread> =
                    self.presses.iter().map(|p| Spread::of(p, &p.nodes[node])).collect();
                of.push(Spread::planned(&state, node_pa(node as f64), self.slope_variance(plan)));
                let gives = DVector::from_iterator(of.len(), of.iter().map(|s| 1.0 - s.share));
                let known =
                    covariance(&of, &self.instrument).cholesky().map_or(0.0, |c| gives.dot(&c.solve(&gives)));
                mean -= 0.5 * weight * known.max(f64::MIN_POSITIVE).ln();
            }
            if mean.exp() < best.error_share {
                best = Next { pressure_pa, error_share: mean.exp() };
            }
        }
        Ok(best)
    }

    /// The pressure at which the tip is as stiff as the object is thought to be; before the first press as the middle of the plan's range.
    ///
    /// # Errors
    /// [`StiffnessError::Beyond`], for a pressure that was not calibrated.
    pub fn matched(&self, plan: &Plan) -> Result<f64, StiffnessError> {
        let object_pa = match self.estimate().map(|e| e.modulus_pa) {
            Ok(Bound::Within { value, .. }) => value,
            Ok(Bound::AtLeast(low)) => low,
            Ok(Bound::AtMost(high)) => high,
            Err(_) => (plan.range_pa.0 * plan.range_pa.1).sqrt(),
        };
        let contact_m = self.contact_m(plan);
        let mut best = (f64::INFINITY, plan.pressures_pa[0]);
        for &pressure_pa in &plan.pressures_pa {
            let apart =
                (self.tip.at(pressure_pa, contact_m, 0.5 * plan.depth_m)?.modulus_pa / object_pa).ln().abs();
            if apart < best.0 {
                best = (apart, pressure_pa);
            }
        }
        Ok(best.1)
    }

    fn contact_m(&self, plan: &Plan) -> f64 {
        self.presses.iter().map(|p| p.contact_m).reduce(f64::max).unwrap_or(plan.contact_m)
    }

    /// Variance of the slope of the tip's indentation over the travel: as in the presses so far, or of a straight line from a begin that is fitted too.
    fn slope_variance(&self, plan: &Plan) -> f64 {
        let of_press = |p: &Reduced| p.nodes.last().map_or(0.0, |n| n.variance * n.share * n.share);
        let n = self.presses.len();
        if n > 0 {
            return self.presses.iter().map(of_press).sum::<f64>() / n as f64;
        }
        12.0 * (self.instrument.tip_noise_m / plan.depth_m).powi(2) / plan.readings
    }

    /// Nodes and how probable they are, a flat prior of the logarithm.
    fn believed(&self, plan: &Plan) -> Vec<(usize, f64)> {
        let inside = |e: f64| self.presses() > 0 || (plan.range_pa.0..=plan.range_pa.1).contains(&e);
        let points: Vec<(usize, f64)> = self
            .log_likelihood()
            .enumerate()
            .filter(|(_, [e, _])| inside(*e))
            .map(|(node, [_, l])| (node, l))
            .collect();
        let top = points.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        let likely: Vec<(usize, f64)> =
            points.into_iter().map(|(node, l)| (node, (l - top).exp())).filter(|p| p.1 > 1e-3).collect();
        let every = (likely.len() / (4 * THINNED)).max(1);
        let thinned: Vec<(usize, f64)> = likely.into_iter().step_by(every).collect();
        let sum: f64 = thinned.iter().map(|p| p.1).sum();
        thinned.into_iter().map(|(node, w)| (node, w / sum)).collect()
    }
}
