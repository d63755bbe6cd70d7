//! The Gram matrix of a block's columns, most of which may be zero all through.

use nalgebra::DMatrix;

use crate::linalg::{dot, gram};

/// Products of columns with one another; a column that is zero all through takes no room (what acts on another channel or in another run).
pub(super) struct Gram {
    /// Where each column stands among those that are not zero.
    places: Vec<Option<usize>>,
    values: DMatrix<f64>,
    /// The products of what some columns leave of each.
    beside: DMatrix<f64>,
}

impl Gram {
    /// Of columns of one length.
    pub(super) fn new(columns: &[Vec<f64>]) -> Self {
        let acts = |column: &&Vec<f64>| column.iter().any(|v| *v != 0.0);
        let full: Vec<&Vec<f64>> = columns.iter().filter(acts).collect();
        let mut numbers = 0..full.len();
        let places = columns.iter().map(|column| if acts(&column) { numbers.next() } else { None }).collect();
        Self { places, values: gram(&full), beside: DMatrix::zeros(0, 0) }
    }

    /// Takes away from each product what columns that are eliminated have of it: their `borders` with each column.
    pub(super) fn eliminate(&mut self, borders: &[Vec<f64>]) {
        let full = self.places.iter().zip(borders).filter(|(place, _)| place.is_some());
        let borders: Vec<&Vec<f64>> = full.map(|(_, border)| border).collect();
        let n = borders.len();
        self.beside = DMatrix::from_fn(n, n, |i, j| self.values[(i, j)] - dot(borders[i], borders[j]));
    }

    /// Where a column stands among those that are not zero.
    pub(super) fn place(&self, column: usize) -> Option<usize> {
        self.places[column]
    }

    /// Products of the column at a place with those at all places.
    pub(super) fn at(&self, place: usize) -> &[f64] {
        let n = self.values.nrows();
        &self.values.as_slice()[place * n..(place + 1) * n]
    }

    /// The same beside the columns that were eliminated.
    pub(super) fn beside(&self, place: usize) -> &[f64] {
        let n = self.beside.nrows();
        &self.beside.as_slice()[place * n..(place + 1) * n]
    }

    /// The product of two columns.
    pub(super) fn of(&self, a: usize, b: usize) -> f64 {
        match (self.places[a], self.places[b]) {
            (Some(a), Some(b)) => self.values[(a, b)],
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products stand where their columns do, with columns that are zero among them; beside an eliminated column its share is gone.
    #[test]
    fn products_are_those_of_the_columns() {
        let columns = [vec![1.0, 2.0, -1.0], vec![0.0; 3], vec![0.5, 1.0, 4.0], vec![3.0, 0.0, 1.0]];
        let mut gram = Gram::new(&columns);
        for (a, of_a) in columns.iter().enumerate() {
            for (b, of_b) in columns.iter().enumerate() {
                assert_eq!(gram.of(a, b), dot(of_a, of_b));
            }
        }
        assert_eq!([gram.place(1), gram.place(2)], [None, Some(1)]);
        assert_eq!(gram.at(1)[2], dot(&columns[2], &columns[3]));
        let length = dot(&columns[0], &columns[0]).sqrt();
        let borders: Vec<Vec<f64>> = columns.iter().map(|c| vec![dot(c, &columns[0]) / length]).collect();
        gram.eliminate(&borders);
        assert!(gram.beside(0)[1].abs() < 1e-14);
        let rest = |k: usize| -> Vec<f64> {
            let along = borders[k][0] / length;
            columns[k].iter().zip(&columns[0]).map(|(v, of_first)| v - along * of_first).collect()
        };
        assert!((gram.beside(1)[2] - dot(&rest(2), &rest(3))).abs() < 1e-14);
    }
}
