//! Cells for finding neighbours, wrapped around so that grains may be anywhere.

use std::ops::Range;

/// A cubic grid of cells, its counts a power of two along each axis; cells a whole grid apart are one.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    bits: u32,
    per_edge: f64,
    start: Vec<u32>,
    entries: Vec<u32>,
    cell: Vec<u32>,
}

impl Cells {
    /// Cells of `edge` m for a number of grains.
    pub(crate) fn new(grains: usize, edge: f64) -> Self {
        let bits = match grains {
            0..=250 => 3,
            251..=1000 => 4,
            1001..=10_000 => 5,
            _ => 6,
        };
        Self {
            bits,
            per_edge: 1.0 / edge,
            start: vec![0; (1 << (3 * bits)) + 1],
            entries: vec![0; grains],
            cell: vec![0; grains],
        }
    }

    /// How many cells there are.
    pub(crate) fn count(&self) -> usize {
        self.start.len() - 1
    }

    /// The cell's number along one axis, before wrapping.
    #[inline(always)]
    pub(crate) fn along(&self, x: f64) -> i64 {
        // Rounded down, without a call: what is below zero and not whole was cut towards zero.
        let scaled = x * self.per_edge;
        let cut = scaled as i64;
        cut - i64::from(scaled < cut as f64)
    }

    /// The index of a cell.
    #[inline(always)]
    pub(crate) fn index(&self, at: [i64; 3]) -> usize {
        let mask = (1_i64 << self.bits) - 1;
        let (x, y, z) = (at[0] & mask, at[1] & mask, at[2] & mask);
        ((z << (2 * self.bits)) | (y << self.bits) | x) as usize
    }

    /// Where the grains of a row of cells from `low` to `high` along x are in [`Cells::entries`]: two runs, as the row wraps.
    #[inline(always)]
    pub(crate) fn runs(&self, low: i64, high: i64, y: i64, z: i64) -> [Range<usize>; 2] {
        let (first, last) = (self.index([low, y, z]), self.index([high, y, z]));
        let at = |cell: usize| self.start[cell] as usize;
        if first <= last {
            [at(first)..at(last + 1), 0..0]
        } else {
            let row = self.index([0, y, z]);
            [at(row)..at(last + 1), at(first)..at(row + (1 << self.bits))]
        }
    }

    /// The grains, cell by cell.
    pub(crate) fn entries(&self) -> &[u32] {
        &self.entries
    }

    /// Sorts the grains into cells; within a cell they keep their order.
    pub(crate) fn sort(&mut self, places: &[[f64; 4]]) {
        self.start.fill(0);
        for (i, p) in places.iter().enumerate() {
            let cell = self.index([self.along(p[0]), self.along(p[1]), self.along(p[2])]);
            self.cell[i] = cell as u32;
            self.start[cell] += 1;
        }
        let mut sum = 0;
        for s in &mut self.start {
            sum += *s;
            *s = sum;
        }
        // Filled from behind, each start moves down to where its cell begins.
        for (i, &cell) in self.cell.iter().enumerate().rev() {
            let s = &mut self.start[cell as usize];
            *s -= 1;
            self.entries[*s as usize] = i as u32;
        }
    }
}
