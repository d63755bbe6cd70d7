//! A small network in batches: dense layers with a smooth rectifier, and a linear path past them to chosen outputs.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

/// What follows a hidden layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Activation {
    /// `max(0, x)`.
    Relu,
    /// x above 0, `x / sqrt(1 + x^2)` below: smooth, and no transcendental function (Carlile et al. 2017, arXiv:1710.09967).
    Isrlu,
}

impl Activation {
    fn apply(self, values: &mut [f64]) {
        match self {
            Self::Relu => values.iter_mut().for_each(|v| *v = v.max(0.0)),
            Self::Isrlu => values.iter_mut().for_each(|v| {
                let low = v.min(0.0);
                *v = v.max(0.0) + low / (1.0 + low * low).sqrt();
            }),
        }
    }
}

/// What a network is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Shape {
    pub(crate) inputs: usize,
    pub(crate) hidden: Vec<usize>,
    pub(crate) outputs: usize,
    /// Whether the last hidden layer (the inputs, if there is none) reaches the outputs.
    pub(crate) body: bool,
    /// Outputs that the inputs reach linearly, past the hidden layers.
    pub(crate) linear: Vec<usize>,
    pub(crate) activation: Activation,
}

/// Where a matrix lies among the parameters; its bias lies behind it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Block {
    at: usize,
    pub(crate) rows: usize,
    pub(crate) columns: usize,
}

impl Block {
    pub(crate) fn of<'a, T>(&self, params: &'a [T]) -> MatRef<'a, T> {
        MatRef::from_column_major_slice(&params[self.range()], self.rows, self.columns)
    }

    pub(crate) fn of_mut<'a, T>(&self, params: &'a mut [T]) -> MatMut<'a, T> {
        let range = self.range();
        MatMut::from_column_major_slice_mut(&mut params[range], self.rows, self.columns)
    }

    pub(crate) fn range(&self) -> Range<usize> {
        self.at..self.at + self.rows * self.columns
    }

    pub(crate) fn bias(&self) -> Range<usize> {
        let end = self.range().end;
        end..end + self.rows
    }
}

impl Shape {
    /// Weights of the layers, outputs' included: `rows x columns`, each followed by its bias; then the linear path.
    pub(crate) fn blocks(&self) -> (Vec<Block>, Block, Block) {
        let (mut at, mut columns, mut layers) = (0, self.inputs, Vec::new());
        for &rows in &self.hidden {
            layers.push(Block { at, rows, columns });
            at += rows * columns + rows;
            columns = rows;
        }
        let last = Block { at, rows: self.outputs, columns: if self.body { columns } else { 0 } };
        at += self.outputs * last.columns + self.outputs;
        (layers, last, Block { at, rows: self.linear.len(), columns: self.inputs })
    }

    fn parameters(&self) -> usize {
        self.blocks().2.range().end
    }
}

/// A network and its parameters, in one slice.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Network {
    pub(crate) shape: Shape,
    pub(crate) params: Vec<f64>,
}

/// Activations of one batch; the memory serves the next one.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    layers: Vec<Vec<f64>>,
    linear: Vec<f64>,
    pub(crate) outputs: Vec<f64>,
}

fn matrix(values: &[f64], rows: usize, columns: usize) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(&values[..rows * columns], rows, columns)
}

fn matrix_mut(values: &mut [f64], rows: usize, columns: usize) -> MatMut<'_, f64> {
    MatMut::from_column_major_slice_mut(&mut values[..rows * columns], rows, columns)
}

impl Network {
    /// Weights uniform within `gain / sqrt(inputs of the layer)`; those of the last layer smaller by `last`; the rest zero.
    pub(crate) fn new<R: Rng + ?Sized>(shape: Shape, gain: f64, last: f64, rng: &mut R) -> Self {
        let mut params = vec![0.0; shape.parameters()];
        let (layers, output, _) = shape.blocks();
        for (block, factor) in layers.iter().map(|b| (b, 1.0)).chain([(&output, last)]) {
            let bound = factor * gain / (block.columns.max(1) as f64).sqrt();
            params[block.range()].iter_mut().for_each(|p| *p = bound * (2.0 * rng.random::<f64>() - 1.0));
        }
        Self { shape, params }
    }

    /// Glorot's bounds as scikit-learn has them, weights and biases alike.
    pub(crate) fn glorot<R: Rng + ?Sized>(shape: Shape, factor: f64, rng: &mut R) -> Self {
        let mut params = vec![0.0; shape.parameters()];
        let (layers, output, _) = shape.blocks();
        for block in layers.iter().chain([&output]) {
            let bound = (factor / (block.rows + block.columns) as f64).sqrt();
            let range = block.at..block.bias().end;
            params[range].iter_mut().for_each(|p| *p = bound * (2.0 * rng.random::<f64>() - 1.0));
        }
        Self { shape, params }
    }

    pub(crate) fn output_bias_mut(&mut self) -> &mut [f64] {
        let range = self.shape.blocks().1.bias();
        &mut self.params[range]
    }

    /// Adds to the biases of these outputs.
    pub(crate) fn shift_biases(&mut self, rows: &[usize], shift: f64) {
        let biases = self.output_bias_mut();
        rows.iter().for_each(|&r| biases[r] += shift);
    }

    /// Weight from input `column` to output `row` past the hidden layers (with no hidden layer: of the body).
    pub(crate) fn set_linear(&mut self, row: usize, column: usize, value: f64) {
        let (_, output, linear) = self.shape.blocks();
        if let Some(r) = self.shape.linear.iter().position(|&l| l == row) {
            self.params[linear.at + column * linear.rows + r] = value;
        } else if self.shape.hidden.is_empty() && output.columns > column {
            self.params[output.at + column * output.rows + row] = value;
        }
    }

    /// Takes a factor on each of the first `count` inputs into their weights; there must be no hidden layer.
    pub(crate) fn scale_inputs(&mut self, count: usize, factor: f64) {
        let output = self.shape.blocks().1;
        let weights = &mut self.params[output.range()];
        weights.iter_mut().take(count * output.rows).for_each(|w| *w *= factor);
    }

    /// Outputs of `batch` inputs, column after column, into `scratch.outputs`.
    pub(crate) fn forward(&self, inputs: &[f64], batch: usize, scratch: &mut Scratch) {
        let (layers, output, linear) = self.shape.blocks();
        scratch.layers.resize_with(layers.len(), Vec::new);
        for (l, block) in layers.iter().enumerate() {
            let (before, here) = scratch.layers.split_at_mut(l);
            let source = before.last().map_or(inputs, Vec::as_slice);
            self.affine(block, source, batch, &mut here[0]);
            self.shape.activation.apply(&mut here[0][..block.rows * batch]);
        }
        let source = scratch.layers.last().map_or(inputs, Vec::as_slice);
        self.affine(&output, source, batch, &mut scratch.outputs);
        if linear.rows > 0 {
            let n = linear.rows * batch;
            scratch.linear.resize(n, 0.0);
            let target = matrix_mut(&mut scratch.linear, linear.rows, batch);
            let x = matrix(inputs, linear.columns, batch);
            matmul(target, Accum::Replace, linear.of(&self.params), x, 1.0, Par::Seq);
            let rows = scratch.outputs.chunks_exact_mut(output.rows);
            for (out, add) in rows.zip(scratch.linear.chunks_exact(linear.rows)) {
                for (&row, add) in self.shape.linear.iter().zip(add) {
                    out[row] += add;
                }
            }
        }
    }

    fn affine(&self, block: &Block, source: &[f64], batch: usize, target: &mut Vec<f64>) {
        target.resize(block.rows * batch, 0.0);
        let bias = &self.params[block.bias()];
        target.chunks_exact_mut(block.rows).for_each(|column| column.copy_from_slice(bias));
        if block.columns > 0 {
            let x = matrix(source, block.columns, batch);
            let y = matrix_mut(target, block.rows, batch);
            matmul(y, Accum::Add, block.of(&self.params), x, 1.0, Par::Seq);
        }
    }
}
