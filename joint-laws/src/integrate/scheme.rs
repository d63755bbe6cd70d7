//! Runge-Kutta schemes with their interpolants.

/// How a smooth stretch of the motion is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Heun's of the third order with an interpolant of the second: three evaluations a step, for steps that are short beside the motion.
    Heun,
    /// Runge and Kutta's of the fourth order with its interpolant of the third: four evaluations a step, for steps that inputs keep short.
    Kutta,
    /// Dormand and Prince's of the fifth order with their interpolant of the fourth, the last evaluation of a step the first of the next
    /// (Hairer, Norsett and Wanner 1993, Solving Ordinary Differential Equations I, section II.6): six evaluations, for long steps.
    DormandPrince,
}

/// The numbers of a method.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scheme {
    /// Where in the step each stage is evaluated.
    pub(super) nodes: &'static [f64],
    /// What each stage after the first takes of the rates before it.
    pub(super) stages: &'static [&'static [f64]],
    /// Each stage's weight in the state at a part of the step: coefficients of its powers from the first.
    pub(super) weights: &'static [[f64; 4]],
    /// Each stage's weight in the difference to the embedded scheme of the next lower order; none, where a method has none.
    pub(super) error: &'static [f64],
    /// Whether the last stage stands at the end of the step.
    pub(super) last_is_end: bool,
}

impl Scheme {
    /// A stage's weight in the change of the state up to a part of the step.
    pub(super) fn weight(w: &[f64; 4], part: f64) -> f64 {
        part * (w[0] + part * (w[1] + part * (w[2] + part * w[3])))
    }

    /// A stage's weight in the interpolant's rate of change at a part of the step.
    pub(super) fn slope(w: &[f64; 4], part: f64) -> f64 {
        w[0] + part * (2.0 * w[1] + part * (3.0 * w[2] + part * 4.0 * w[3]))
    }
}

impl Method {
    pub(super) fn scheme(self) -> Scheme {
        match self {
            Self::Heun => Scheme {
                nodes: &[0.0, 1.0 / 3.0, 2.0 / 3.0],
                stages: &[&[1.0 / 3.0], &[0.0, 2.0 / 3.0]],
                weights: &[[1.0, -0.75, 0.0, 0.0], [0.0; 4], [0.0, 0.75, 0.0, 0.0]],
                error: &[],
                last_is_end: false,
            },
            Self::Kutta => Scheme {
                nodes: &[0.0, 0.5, 0.5, 1.0],
                stages: &[&[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]],
                weights: &[
                    [1.0, -1.5, 2.0 / 3.0, 0.0],
                    [0.0, 1.0, -2.0 / 3.0, 0.0],
                    [0.0, 1.0, -2.0 / 3.0, 0.0],
                    [0.0, -0.5, 2.0 / 3.0, 0.0],
                ],
                error: &[],
                last_is_end: false,
            },
            Self::DormandPrince => Scheme {
                nodes: &[0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0],
                stages: &[
                    &[0.2],
                    &[3.0 / 40.0, 9.0 / 40.0],
                    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
                    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
                    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
                    &[END[0], END[1], END[2], END[3], END[4], END[5]],
                ],
                weights: &WEIGHTS,
                error: &ERROR,
                last_is_end: true,
            },
        }
    }
}

/// Dormand and Prince's weights at the end of a step.
const END: [f64; 7] = [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0];
/// These less the weights of the embedded scheme of the fourth order.
const ERROR: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];
/// What their interpolant has beyond Hermite's.
const BEYOND: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];
const WEIGHTS: [[f64; 4]; 7] = {
    let mut weights = [[0.0; 4]; 7];
    let mut i = 0;
    while i < 7 {
        let first = if i == 0 { 1.0 } else { 0.0 };
        let last = if i == 6 { 1.0 } else { 0.0 };
        let (a, b, d) = (first - END[i], 2.0 * END[i] - last - first, BEYOND[i]);
        weights[i] = [first, b - a + d, -b - 2.0 * d, d];
        i += 1;
    }
    weights
};

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error of dx/dt = x cos(t) over one step of a length, at its end and within it.
    fn errors(method: Method, h: f64) -> [f64; 2] {
        let scheme = method.scheme();
        let rate = |t: f64, x: f64| x * t.cos();
        let mut rates = vec![rate(0.0, 1.0)];
        for (k, row) in scheme.stages.iter().enumerate() {
            let x = 1.0 + h * row.iter().zip(&rates).map(|(a, r)| a * r).sum::<f64>();
            rates.push(rate(h * scheme.nodes[k + 1], x));
        }
        let error = |part: f64| {
            let change = scheme.weights.iter().zip(&rates).map(|(w, r)| Scheme::weight(w, part) * r);
            let x = 1.0 + h * change.sum::<f64>();
            (x - (part * h).sin().exp()).abs()
        };
        [error(1.0), (1..20).map(|k| error(f64::from(k) / 20.0)).fold(0.0, f64::max)]
    }

    /// The difference to the embedded scheme falls as that scheme's error does, and is larger than the scheme's own error.
    #[test]
    fn the_estimate_is_of_the_fourth_order() {
        let estimate = |h: f64| {
            let scheme = Method::DormandPrince.scheme();
            let rate = |t: f64, x: f64| x * t.cos();
            let mut rates = vec![rate(0.0, 1.0)];
            for (k, row) in scheme.stages.iter().enumerate() {
                let x = 1.0 + h * row.iter().zip(&rates).map(|(a, r)| a * r).sum::<f64>();
                rates.push(rate(h * scheme.nodes[k + 1], x));
            }
            (h * scheme.error.iter().zip(&rates).map(|(w, r)| w * r).sum::<f64>()).abs()
        };
        let (coarse, fine) = (estimate(0.2), estimate(0.1));
        assert!((coarse / fine).log2() > 4.6, "{coarse}, {fine}");
        assert!(coarse > errors(Method::DormandPrince, 0.2)[0]);
    }

    /// Halving the step divides a step's error by two to the power of the order and one more.
    #[test]
    fn errors_fall_as_the_orders_say() {
        let methods =
            [(Method::Heun, 4.0, 3.0), (Method::Kutta, 5.0, 4.0), (Method::DormandPrince, 6.0, 5.0)];
        for (method, at_end, within) in methods {
            let (coarse, fine) = (errors(method, 0.1), errors(method, 0.05));
            assert!((coarse[0] / fine[0]).log2() > at_end - 0.4, "{method:?}: {coarse:?}, {fine:?}");
            assert!((coarse[1] / fine[1]).log2() > within - 0.4, "{method:?}: {coarse:?}, {fine:?}");
        }
    }
}
