//! A network while it learns: forward and backward in batches, and Adam, with no allocation once the buffers are there.
//!
//! One unit's values of a whole batch lie side by side, so that everything but the matrix products is loops over long columns.

use faer::{Accum, MatMut, MatRef};
use pulp::Arch;

use crate::network::{Activation, Block, Network, Shape};
use crate::real::{LANES, Real, load, store, sum};

/// Adam's moments (Kingma and Ba 2014, arXiv:1412.6980).
struct Adam<T> {
    first: Vec<T>,
    second: Vec<T>,
    steps: i32,
}

/// Where gradients are and what they are made from.
pub(crate) struct Learner<T> {
    shape: Shape,
    hidden: Vec<Block>,
    last: Block,
    linear: Block,
    pub(crate) params: Vec<T>,
    pub(crate) gradient: Vec<T>,
    adam: Adam<T>,
    /// Values of each hidden layer, `batch x units`.
    units: Vec<Vec<T>>,
    deltas: [Vec<T>; 2],
    /// What comes by the linear path, or goes back by it.
    picked: Vec<T>,
    /// `batch x outputs`.
    pub(crate) outputs: Vec<T>,
    /// Derivative of the loss by the outputs, `batch x outputs`: to be filled between forward and backward.
    pub(crate) output_gradient: Vec<T>,
    arch: Arch,
}

/// `batch` columns of `rows` numbers each, one after another, seen as one row a column.
fn turned<T>(values: &[T], rows: usize, batch: usize) -> MatRef<'_, T> {
    MatRef::from_column_major_slice(&values[..rows * batch], rows, batch).transpose()
}

fn tall<T>(values: &[T], batch: usize, units: usize) -> MatRef<'_, T> {
    MatRef::from_column_major_slice(&values[..batch * units], batch, units)
}

fn tall_mut<T>(values: &mut [T], batch: usize, units: usize) -> MatMut<'_, T> {
    MatMut::from_column_major_slice_mut(&mut values[..batch * units], batch, units)
}

impl<T: Real> Learner<T> {
    pub(crate) fn new(network: &Network) -> Self {
        let (hidden, last, linear) = network.shape.blocks();
        let n = network.params.len();
        Self {
            shape: network.shape.clone(),
            units: hidden.iter().map(|_| Vec::new()).collect(),
            hidden,
            last,
            linear,
            params: network.params.iter().map(|p| T::of(*p)).collect(),
            gradient: vec![T::ZERO; n],
            adam: Adam { first: vec![T::ZERO; n], second: vec![T::ZERO; n], steps: 0 },
            deltas: [Vec::new(), Vec::new()],
            picked: Vec::new(),
            outputs: Vec::new(),
            output_gradient: Vec::new(),
            arch: Arch::new(),
        }
    }

    /// Copies the parameters back.
    pub(crate) fn write(&self, network: &mut Network) {
        network.params.iter_mut().zip(&self.params).for_each(|(to, from)| *to = from.to_f64());
    }

    /// Outputs of `batch` inputs, which lie one after another.
    pub(crate) fn forward(&mut self, inputs: &[T], batch: usize) {
        let x = turned(inputs, self.shape.inputs, batch);
        for l in 0..self.hidden.len() {
            let (before, here) = self.units.split_at_mut(l);
            let source = before.last().map_or(x, |u| tall(u, batch, self.hidden[l].columns));
            affine(self.arch, &self.params, &self.hidden[l], source, &mut here[0], batch);
            activate(self.arch, self.shape.activation, &mut here[0]);
        }
        let source = self.units.last().map_or(x, |u| tall(u, batch, u.len() / batch));
        affine(self.arch, &self.params, &self.last, source, &mut self.outputs, batch);
        let rows = self.linear.rows;
        if rows > 0 {
            self.picked.resize(batch * rows, T::ZERO);
            let target = tall_mut(&mut self.picked, batch, rows);
            T::multiply(target, Accum::Replace, x, self.linear.of(&self.params).transpose());
            for (&row, add) in self.shape.linear.iter().zip(self.picked.chunks_exact(batch)) {
                let out = &mut self.outputs[row * batch..(row + 1) * batch];
                out.iter_mut().zip(add).for_each(|(o, a)| *o += *a);
            }
        }
    }

    /// Gradient of the parameters from the gradient of the outputs, after [`Learner::forward`] of the same inputs.
    pub(crate) fn backward(&mut self, inputs: &[T], batch: usize) {
        let x = turned(inputs, self.shape.inputs, batch);
        if self.linear.rows > 0 {
            for (&row, pick) in self.shape.linear.iter().zip(self.picked.chunks_exact_mut(batch)) {
                pick.copy_from_slice(&self.output_gradient[row * batch..(row + 1) * batch]);
            }
            let d = tall(&self.picked, batch, self.linear.rows);
            T::multiply(self.linear.of_mut(&mut self.gradient), Accum::Replace, d.transpose(), x);
        }
        let [delta, next] = &mut self.deltas;
        std::mem::swap(delta, &mut self.output_gradient);
        for l in (0..=self.hidden.len()).rev() {
            let block = self.hidden.get(l).unwrap_or(&self.last);
            let bias = &mut self.gradient[block.bias()];
            self.arch.dispatch(
                #[inline(always)]
                || {
                    for (b, column) in bias.iter_mut().zip(delta.chunks_exact(batch)) {
                        *b = sum(column, |v| v);
                    }
                },
            );
            if block.columns == 0 {
                continue;
            }
            let d = tall(delta, batch, block.rows);
            let source = if l == 0 { x } else { tall(&self.units[l - 1], batch, block.columns) };
            T::multiply(block.of_mut(&mut self.gradient), Accum::Replace, d.transpose(), source);
            if l > 0 {
                next.resize(batch * block.columns, T::ZERO);
                let target = tall_mut(next, batch, block.columns);
                T::multiply(target, Accum::Replace, d, block.of(&self.params));
                times_derivative(self.arch, self.shape.activation, &self.units[l - 1], next);
                std::mem::swap(delta, next);
            }
        }
    }

    /// Scales the gradient so that its norm is at most `most`; to nothing if it is not finite.
    pub(crate) fn clip(&mut self, most: f64) {
        let gradient = &mut self.gradient;
        self.arch.dispatch(
            #[inline(always)]
            || {
                let norm = sum(gradient, |g| g * g).sqrt().to_f64();
                if !norm.is_finite() {
                    gradient.fill(T::ZERO);
                } else if norm > most {
                    let factor = T::of(most / norm);
                    gradient.iter_mut().for_each(|g| *g = *g * factor);
                }
            },
        );
    }

    /// One step of Adam down the gradient; weights (not biases) shrink by the share `rate * decay`.
    pub(crate) fn step(&mut self, rate: f64, decay: f64) {
        const B1: f64 = 0.9;
        const B2: f64 = 0.999;
        let adam = &mut self.adam;
        adam.steps = adam.steps.saturating_add(1);
        let corrected = T::of(rate * (1.0 - B2.powi(adam.steps)).sqrt() / (1.0 - B1.powi(adam.steps)));
        let [b1, c1, b2, c2, tiny] = [B1, 1.0 - B1, B2, 1.0 - B2, 1e-8].map(T::of);
        let (params, gradient) = (&mut self.params, &self.gradient);
        self.arch.dispatch(
            #[inline(always)]
            || {
                let moments = adam.first.iter_mut().zip(adam.second.iter_mut());
                for ((p, g), (m, v)) in params.iter_mut().zip(gradient).zip(moments) {
                    *m = b1 * *m + c1 * *g;
                    *v = b2 * *v + c2 * *g * *g;
                    *p = *p - corrected * *m / (v.sqrt() + tiny);
                }
            },
        );
        if decay > 0.0 {
            let shrink = T::of(1.0 - rate * decay);
            for block in self.hidden.iter().chain([&self.last, &self.linear]) {
                self.params[block.range()].iter_mut().for_each(|p| *p = *p * shrink);
            }
        }
    }

    /// Adds `share` of each weight (not bias) to its gradient; gives the sum of the squared weights.
    pub(crate) fn penalise(&mut self, share: f64) -> f64 {
        let (share, mut squares) = (T::of(share), 0.0);
        for block in self.hidden.iter().chain([&self.last, &self.linear]) {
            let weights = &self.params[block.range()];
            squares += sum(weights, |w| w * w).to_f64();
            self.gradient[block.range()].iter_mut().zip(weights).for_each(|(g, w)| *g += share * *w);
        }
        squares
    }

    /// Forgets the moments.
    pub(crate) fn restart(&mut self) {
        self.adam.first.fill(T::ZERO);
        self.adam.second.fill(T::ZERO);
        self.adam.steps = 0;
    }
}

fn affine<T: Real>(
    arch: Arch,
    params: &[T],
    block: &Block,
    source: MatRef<'_, T>,
    target: &mut Vec<T>,
    batch: usize,
) {
    target.resize(batch * block.rows, T::ZERO);
    let bias = &params[block.bias()];
    arch.dispatch(
        #[inline(always)]
        || target.chunks_exact_mut(batch).zip(bias).for_each(|(column, b)| column.fill(*b)),
    );
    if block.columns > 0 {
        let y = tall_mut(target, batch, block.rows);
        T::multiply(y, Accum::Add, source, block.of(params).transpose());
    }
}

fn activate<T: Real>(arch: Arch, activation: Activation, values: &mut [T]) {
    arch.dispatch(
        #[inline(always)]
        || match activation {
            Activation::Relu => values.iter_mut().for_each(|v| *v = v.larger(T::ZERO)),
            Activation::Isrlu => values.iter_mut().for_each(|v| {
                let low = v.smaller(T::ZERO);
                *v = v.larger(T::ZERO) + low / (T::ONE + low * low).sqrt();
            }),
        },
    );
}

/// Multiplies by the activation's derivative, which is known from its value: below 0, for the smooth one, `(1 - y^2)^(3/2)`.
fn times_derivative<T: Real>(arch: Arch, activation: Activation, values: &[T], gradient: &mut [T]) {
    arch.dispatch(
        #[inline(always)]
        || {
            for (g, v) in gradient.chunks_mut(LANES).zip(values.chunks(LANES)) {
                let (mut lanes, y) = (load(g), load(v));
                for (g, y) in lanes.iter_mut().zip(y) {
                    *g = match activation {
                        Activation::Relu => {
                            if y > T::ZERO {
                                *g
                            } else {
                                T::ZERO
                            }
                        }
                        Activation::Isrlu => {
                            let low = y.smaller(T::ZERO);
                            let c = T::ONE - low * low;
                            *g * c * c.sqrt()
                        }
                    };
                }
                store(&lanes, g);
            }
        },
    );
}
