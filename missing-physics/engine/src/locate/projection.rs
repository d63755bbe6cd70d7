//! What the baseline's parameters cannot take away.

/// The baseline's columns made orthonormal: those of each run's nuisance parameters by themselves, those of shared parameters over all
/// runs; and what is left of the residual beside them.
#[derive(Clone)]
pub(crate) struct Projection {
    /// `[run][direction]`.
    nuisance: Vec<Vec<Vec<f64>>>,
    /// `[direction][run]`.
    shared: Vec<Vec<Vec<f64>>>,
    /// By run.
    pub(crate) residual: Vec<Vec<f64>>,
    pub(crate) rows: f64,
}

/// A direction that keeps less than this of its length beside the others is one of them.
const WITHIN: f64 = 1e-7;

impl Projection {
    /// Of columns by run: those of nuisance parameters, those of shared ones, the residual; all as if noise were white.
    pub(crate) fn new(columns: &[Vec<Vec<f64>>], (n_nuisance, n_shared): (usize, usize)) -> Self {
        let basis = |run: &Vec<Vec<f64>>| {
            let mut basis: Vec<Vec<f64>> = Vec::new();
            for column in &run[..n_nuisance] {
                let before = dot(column, column).sqrt();
                let mut rest = column.clone();
                (0..2).for_each(|_| take_away(&mut rest, &basis));
                push_unit(&mut basis, rest, before);
            }
            basis
        };
        let nuisance: Vec<_> = columns.iter().map(basis).collect();
        let mut this = Self { nuisance, shared: Vec::new(), residual: Vec::new(), rows: 0.0 };
        for k in n_nuisance..n_nuisance + n_shared {
            let column: Vec<Vec<f64>> = columns.iter().map(|run| run[k].clone()).collect();
            let before = norm(&column);
            let mut rest = column;
            (0..2).for_each(|_| rest = this.rest(rest.clone()));
            let size = norm(&rest);
            if size > WITHIN * before {
                rest.iter_mut().flatten().for_each(|v| *v /= size);
                this.shared.push(rest);
            }
        }
        let last = columns.iter().map(|run| run[n_nuisance + n_shared].clone()).collect();
        this.residual = this.rest(last);
        this.rows = this.residual.iter().map(|run| run.len() as f64).sum();
        this
    }

    /// A column over all runs beside all directions.
    pub(crate) fn rest(&self, mut column: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        column.iter_mut().enumerate().for_each(|(run, of_run)| self.beside_nuisance(run, of_run));
        for direction in &self.shared {
            let along: f64 = direction.iter().zip(&column).map(|(d, c)| dot(d, c)).sum();
            column.iter_mut().zip(direction).for_each(|(c, d)| add(c, d, -along));
        }
        column
    }

    /// Takes a run's nuisance directions out of a column of it.
    pub(crate) fn beside_nuisance(&self, run: usize, column: &mut [f64]) {
        take_away(column, &self.nuisance[run]);
    }

    /// A run's column along each shared direction.
    pub(crate) fn along_shared(&self, run: usize, column: &[f64]) -> Vec<f64> {
        self.shared.iter().map(|direction| dot(&direction[run], column)).collect()
    }

    /// Takes another direction of one run for one of its nuisance parameters', from now on; by how much the squares fall.
    pub(crate) fn add_to_run(&mut self, run: usize, column: &[f64]) -> f64 {
        let mut rest = column.to_vec();
        take_away(&mut rest, &self.nuisance[run]);
        push_unit(&mut self.nuisance[run], rest, dot(column, column).sqrt());
        let before = norm(&self.residual);
        let residual = std::mem::take(&mut self.residual);
        self.residual = self.rest(residual);
        before * before - norm(&self.residual).powi(2)
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn add(to: &mut [f64], what: &[f64], times: f64) {
    to.iter_mut().zip(what).for_each(|(t, w)| *t += times * w);
}

fn norm(column: &[Vec<f64>]) -> f64 {
    column.iter().map(|run| dot(run, run)).sum::<f64>().sqrt()
}

fn take_away(column: &mut [f64], basis: &[Vec<f64>]) {
    for unit in basis {
        let along = dot(unit, column);
        add(column, unit, -along);
    }
}

fn push_unit(basis: &mut Vec<Vec<f64>>, mut rest: Vec<f64>, before: f64) {
    let size = dot(&rest, &rest).sqrt();
    if size > WITHIN * before && size > 0.0 {
        rest.iter_mut().for_each(|v| *v /= size);
        basis.push(rest);
    }
}
