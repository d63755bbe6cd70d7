//! Cells for finding neighbours, wrapped around so that grains may be anywhere.

/// A cubic grid of cells, its counts a power of two along each axis; cells a whole grid apart are one.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    bits: u32,
    edge: f64,
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
            edge,
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
        (x / self.edge).floor() as i64
    }

    /// The index of a cell.
    #[inline(always)]
    pub(crate) fn index(&self, at: [i64; 3]) -> usize {
        let mask = (1_i64 << self.bits) - 1;
        let (x, y, z) = (at[0] & mask, at[1] & mask, at[2] & mask);
        ((z << (2 * self.bits)) | (y << self.bits) | x) as usize
    }

    /// The grains in a cell.
    #[inline(always)]
    pub(crate) fn members(&self, cell: usize) -> &[u32] {
        &self.entries[self.start[cell] as usize..self.start[cell + 1] as usize]
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
