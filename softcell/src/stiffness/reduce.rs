//! One press: what part of the travel is the tip's, for each modulus that the object may have.

use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

use super::StiffnessError;
use super::press::{Instrument, Press, Reading};
use super::tip::{TipModulus, TipState};

/// Logarithms of the moduli that are looked at: 100 Pa to 1 GPa.
pub(super) const NODES: usize = 404;
const STEP: f64 = 0.04;

/// Modulus at a node, or at a place between two, Pa.
pub(super) fn node_pa(place: f64) -> f64 {
    (100f64.ln() + STEP * place).exp()
}

/// What a press says if the object has the modulus of a node: the tip's indentation as measured over the predicted one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Amplitude {
    pub(super) value: f64,
    pub(super) variance: f64,
    pub(super) chi_squared: f64,
    /// Part of the travel that is the tip's, at the deepest reading, and the tip's modulus there, Pa.
    pub(super) share: f64,
    pub(super) tip_pa: f64,
    /// Contact's end less its begin, m, and its variance.
    shift_m: f64,
    shift_variance: f64,
}

/// A press, reduced.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reduced {
    pub(super) nodes: Vec<Amplitude>,
    pub(super) rubber_share: f64,
    pub(super) error_share: f64,
    pub(super) contact_m: f64,
    /// Readings that count, less what is fitted.
    pub(super) freedom: f64,
}

impl Reduced {
    /// What the press says at a place between nodes.
    pub(super) fn at(&self, place: f64) -> Amplitude {
        let node = (place.max(0.0) as usize).min(NODES - 2);
        let part = place - node as f64;
        let (a, b) = (&self.nodes[node], &self.nodes[node + 1]);
        let mix = |of: fn(&Amplitude) -> f64| (1.0 - part) * of(a) + part * of(b);
        Amplitude {
            value: mix(|n| n.value),
            variance: mix(|n| n.variance),
            chi_squared: mix(|n| n.chi_squared),
            share: mix(|n| n.share),
            tip_pa: mix(|n| n.tip_pa),
            shift_m: mix(|n| n.shift_m),
            shift_variance: mix(|n| n.shift_variance),
        }
    }

    /// Least square of the residuals over its degrees of freedom, at least 1.
    pub(super) fn scatter(&self) -> f64 {
        let least = self.nodes.iter().map(|n| n.chi_squared).fold(f64::INFINITY, f64::min);
        (least / self.freedom).max(1.0)
    }
}

/// A reading with what the tip is there.
struct Row {
    travel_m: f64,
    tip_m: f64,
    out: bool,
    state: State,
}

/// The tip's modulus at an indentation that depends on the object's.
#[derive(Debug, Clone, Copy)]
struct State {
    /// Where the tip takes none of the depth, Pa.
    bare_pa: f64,
    /// What is added where it takes all, Pa.
    stretched_pa: f64,
}

impl State {
    fn new(state: &TipState) -> Self {
        Self { bare_pa: (state.modulus_pa - state.stretched_pa).max(1.0), stretched_pa: state.stretched_pa }
    }

    fn tip_pa(&self, object_pa: f64) -> f64 {
        let mut tip_pa = self.bare_pa;
        for _ in 0..4 {
            tip_pa = (self.bare_pa + self.stretched_pa * share(object_pa, tip_pa).powi(2)).max(1.0);
        }
        tip_pa
    }
}

/// Part of the travel that is the tip's.
fn share(object_pa: f64, tip_pa: f64) -> f64 {
    object_pa / (object_pa + tip_pa)
}

/// Standard deviation of the contact's begin as the contacts show it, m.
const BEGIN_M: f64 = 1e-3;
/// Readings each way.
const LEAST: usize = 5;

impl Press {
    pub(super) fn reduce(
        &self,
        tip: &TipModulus,
        instrument: &Instrument,
    ) -> Result<Reduced, StiffnessError> {
        tip.at(self.pressure_pa, 0.0, 0.0)?;
        let all = || self.loading.iter().chain(&self.unloading);
        for r in all() {
            for (what, got) in [
                ("a travel", r.travel_m),
                ("an indentation", r.tip_m),
                ("a shear", r.shear_m),
                ("a contact", r.contact_m),
            ] {
                if !got.is_finite() {
                    return Err(StiffnessError::Value { what, expected: "a finite number", got });
                }
            }
            if r.contact_m > 0.0 && r.shear_m.abs() > instrument.shear_share * r.contact_m.max(3e-3) {
                return Err(StiffnessError::Slipped { shear_m: r.shear_m, contact_m: r.contact_m });
            }
        }
        let touches = all().filter(|r| r.contact_m > 0.0).count();
        if touches < LEAST {
            return Err(StiffnessError::NoContact { got: touches, of: all().count() });
        }
        let seen = self.seen();
        let [begin_m, rise_m] = straight(&seen, instrument.play_m)
            .ok_or(StiffnessError::NoContact { got: seen.len(), of: all().count() })?;
        let settled = Settled { begins_m: [begin_m; 2], rise_m, bend: 0.0 };
        let first = self.rows(tip, &settled)?;
        // Once the begins are better known, so are the contacts.
        let noise_m = instrument.tip_noise_m;
        let start = Vector4::new(0.0, begin_m, begin_m, first.rows.first().map_or(0.0, |r| r.tip_m));
        let middle = first.deepest.1;
        let (_, at) =
            amplitude(&first.rows, middle.modulus_pa, [begin_m, noise_m], start, State::new(&middle));
        let Contacts { rows, deepest: (contact_m, state, depth_m) } =
            self.rows(tip, &bent(&seen, [at[1], at[2]], settled))?;
        let mut start = at;
        let deepest = State::new(&state);
        let mut nodes = Vec::with_capacity(NODES);
        for node in 0..NODES {
            let (mut of_node, at) =
                amplitude(&rows, node_pa(node as f64), [begin_m, noise_m], start, deepest);
            start = at;
            let drift = instrument.drift_m / (of_node.share * depth_m);
            of_node.variance += drift * drift;
            of_node.shift_variance += (instrument.drift_m / (of_node.share * of_node.value)).powi(2);
            nodes.push(of_node);
        }
        let best = nodes.iter().min_by(|a, b| a.chi_squared.total_cmp(&b.chi_squared));
        if let Some(best) = best {
            let times = (best.chi_squared / (rows.len() as f64 - 4.0).max(1.0)).sqrt();
            if !(times < 5.0) {
                return Err(StiffnessError::Misfit { times });
            }
            let error_m = times.max(1.0) * best.shift_variance.sqrt();
            if best.shift_m.abs() > instrument.play_m + 4.0 * error_m {
                let (shift_m, play_m) = (best.shift_m, instrument.play_m);
                return Err(StiffnessError::Hysteresis { shift_m, error_m, play_m });
            }
        }
        Ok(Reduced {
            nodes,
            rubber_share: state.rubber_share,
            error_share: state.error_share,
            contact_m,
            freedom: rows.len() as f64 - 4.0,
        })
    }

    /// Readings with a contact: travel, radius, and whether on the way out.
    fn seen(&self) -> Vec<(f64, f64, bool)> {
        let of = |readings: &[Reading], out: bool| -> Vec<(f64, f64, bool)> {
            readings.iter().filter(|r| r.contact_m > 0.0).map(|r| (r.travel_m, r.contact_m, out)).collect()
        };
        [of(&self.loading, false), of(&self.unloading, true)].concat()
    }

    /// Readings with the tip's modulus there; those beyond the calibrated contacts are left out.
    fn rows(&self, tip: &TipModulus, settled: &Settled) -> Result<Contacts, StiffnessError> {
        let mut rows = Vec::new();
        let mut deepest = (0.0, tip.at(self.pressure_pa, 0.0, 0.0)?, 0.0);
        for (readings, out) in [(&self.loading, false), (&self.unloading, true)] {
            let before = rows.len();
            for r in readings {
                let depth_m = (r.travel_m - settled.begins_m[usize::from(out)]).max(0.0);
                let contact_m = settled.contact_m(depth_m);
                let Ok(state) = tip.at(self.pressure_pa, contact_m, depth_m) else { continue };
                if depth_m > deepest.2 {
                    deepest = (contact_m, state, depth_m);
                }
                rows.push(Row { travel_m: r.travel_m, tip_m: r.tip_m, out, state: State::new(&state) });
            }
            let (got, way) = (rows.len() - before, if out { "on the way out" } else { "on the way in" });
            if got < LEAST {
                return Err(StiffnessError::TooFew { way, expected: LEAST, got });
            }
        }
        Ok(Contacts { rows, deepest })
    }
}

/// Readings that count, and the deepest of them: radius of the contact (m), the tip there, and its depth (m).
struct Contacts {
    rows: Vec<Row>,
    deepest: (f64, TipState, f64),
}

/// Where contact begins and ends, and the square of its radius over the depth: `a^2 = rise depth + bend depth^2`.
struct Settled {
    begins_m: [f64; 2],
    rise_m: f64,
    bend: f64,
}

impl Settled {
    fn contact_m(&self, depth_m: f64) -> f64 {
        (self.rise_m * depth_m + self.bend * depth_m * depth_m).max(0.0).sqrt()
    }
}

/// Where contact begins (m of travel) and how the square of its radius rises with the travel (m), by a straight line through the squares; none where it does
/// not rise, or over no more travel than the play.
fn straight(seen: &[(f64, f64, bool)], play_m: f64) -> Option<[f64; 2]> {
    let n = seen.len() as f64;
    let mean = |of: fn(&(f64, f64, bool)) -> f64| seen.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|s| s.0), mean(|s| s.1 * s.1));
    let [mut xx, mut xy] = [0.0; 2];
    for s in seen {
        xx += (s.0 - x).powi(2);
        xy += (s.0 - x) * (s.1 * s.1 - y);
    }
    let rise_m = xy / xx;
    (rise_m > 0.0 && xx > n * play_m * play_m).then_some([x - y / rise_m, rise_m])
}

/// The square of the radius as a parabola from known begins; what it was where that is none that rises.
fn bent(seen: &[(f64, f64, bool)], begins_m: [f64; 2], before: Settled) -> Settled {
    let (mut a, mut b, mut most) = (Matrix2::zeros(), Vector2::zeros(), 0.0f64);
    for &(travel_m, contact_m, out) in seen {
        let depth_m = (travel_m - begins_m[usize::from(out)]).max(0.0);
        most = most.max(depth_m);
        let row = Vector2::new(depth_m, depth_m * depth_m);
        a += row * row.transpose();
        b += row * contact_m * contact_m;
    }
    let Some(x) = a.try_inverse().map(|inverse| inverse * b) else { return before };
    if x[0] > 0.0 && x[0] + 2.0 * x[1] * most > 0.0 {
        Settled { begins_m, rise_m: x[0], bend: x[1] }
    } else {
        before
    }
}

/// Least squares of `tip = zero + A s (travel - begin)_+` with `s = E_o/(E_o + E_t)`, a begin each way, for one modulus of the object, by Gauss and Newton's
/// steps, halved where they do not descend.
fn amplitude(
    rows: &[Row],
    object_pa: f64,
    [begin_m, noise_m]: [f64; 2],
    start: Vector4<f64>,
    deepest: State,
) -> (Amplitude, Vector4<f64>) {
    let share = |state: &State| share(object_pa, state.tip_pa(object_pa));
    // A times the share at the deepest reading is what hardly changes from one modulus to the next.
    let tip_pa = deepest.tip_pa(object_pa);
    let deepest = share(&deepest);
    let shares: Vec<f64> = rows.iter().map(|r| share(&r.state) / deepest).collect();
    let normal = |x: &Vector4<f64>| {
        let (mut a, mut b, mut chi) = (Matrix4::zeros(), Vector4::zeros(), 0.0);
        for (r, &s) in rows.iter().zip(&shares) {
            let which = if r.out { 2 } else { 1 };
            let depth = r.travel_m - x[which];
            let mut row = Vector4::new(0.0, 0.0, 0.0, 1.0);
            let mut predicted = x[3];
            if depth > 0.0 {
                row[0] = s * depth;
                row[which] = -x[0] * s;
                predicted += x[0] * s * depth;
            }
            let residual = (r.tip_m - predicted) / noise_m;
            row /= noise_m;
            a += row * row.transpose();
            b += row * residual;
            chi += residual * residual;
        }
        for which in [1, 2] {
            let residual = (begin_m - x[which]) / BEGIN_M;
            a[(which, which)] += BEGIN_M.powi(-2);
            b[which] += residual / BEGIN_M;
            chi += residual * residual;
        }
        (a, b, chi)
    };
    let mut x = start;
    let (mut a, mut b, mut chi) = normal(&x);
    for _ in 0..30 {
        let Some(step) = a.cholesky().map(|c| c.solve(&b)) else { break };
        let mut scale = 1.0;
        let mut moved = false;
        while scale > 1e-3 {
            let next = x + step * scale;
            let of_next = normal(&next);
            if of_next.2 < chi {
                moved = chi - of_next.2 > 1e-6;
                x = next;
                (a, b, chi) = of_next;
                break;
            }
            scale *= 0.5;
        }
        if !moved {
            break;
        }
    }
    let inverse = a.try_inverse().unwrap_or_else(|| Matrix4::from_element(f64::INFINITY));
    let scatter = (chi / (rows.len() as f64 - 4.0).max(1.0)).max(1.0);
    let of_node = Amplitude {
        value: x[0] / deepest,
        variance: scatter * inverse[(0, 0)] / (deepest * deepest),
        chi_squared: chi,
        share: deepest,
        tip_pa,
        shift_m: x[2] - x[1],
        shift_variance: inverse[(1, 1)] + inverse[(2, 2)] - 2.0 * inverse[(1, 2)],
    };
    (of_node, x)
}
