//! The sheet and its deflection over an object.

use super::object::Shape;

/// A rectangular sheet between two fingers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sheet {
    /// Length between the fingers without stretch, m.
    pub length_m: f64,
    /// Breadth, m.
    pub breadth_m: f64,
    /// Thickness, m.
    pub thickness_m: f64,
    /// Young's modulus, Pa.
    pub modulus_pa: f64,
    /// Strain with which it is mounted.
    pub mounted: f64,
}

impl Sheet {
    /// 100 x 90 x 2 mm of EcoFlex 50.
    pub fn matl_2021() -> Self {
        Self { length_m: 0.1, breadth_m: 0.09, thickness_m: 2e-3, modulus_pa: 83e3, mounted: 0.06 }
    }
}

/// A deflected sheet on a grid, x along the stretch; solved again from where it is.
#[derive(Debug, Clone)]
pub struct Membrane {
    sheet: Sheet,
    stretch_m: f64,
    columns: usize,
    rows: usize,
    deflection: Vec<f64>,
    obstacle: Vec<f64>,
    /// Tension along x and y, N/m.
    pub tension_n_m: [f64; 2],
    /// Force on the object, N.
    pub force_n: f64,
}

/// Grid spacing aimed at, m.
const SPACING_M: f64 = 1e-3;

impl Membrane {
    /// A sheet stretched by so much (m), level.
    pub fn new(sheet: Sheet, stretch_m: f64) -> Self {
        let cells = |length: f64| ((0.5 * length / SPACING_M).ceil().max(4.0) as usize) * 2 + 1;
        let (columns, rows) = (cells(sheet.length_m + stretch_m), cells(sheet.breadth_m));
        Self {
            sheet,
            stretch_m,
            columns,
            rows,
            deflection: vec![0.0; columns * rows],
            obstacle: vec![f64::NEG_INFINITY; columns * rows],
            tension_n_m: [0.0; 2],
            force_n: 0.0,
        }
    }

    /// Length between the fingers, m.
    pub fn length_m(&self) -> f64 {
        self.sheet.length_m + self.stretch_m
    }

    fn spacing(&self) -> [f64; 2] {
        [self.length_m() / (self.columns - 1) as f64, self.sheet.breadth_m / (self.rows - 1) as f64]
    }

    /// Presses the sheet onto an object at a place, whose highest point is so far above the level sheet (m).
    pub fn press(&mut self, shape: &Shape, at_m: [f64; 2], indentation_m: f64) {
        let [dx, dy] = self.spacing();
        for row in 0..self.rows {
            let y = dy * row as f64 - 0.5 * self.sheet.breadth_m - at_m[1];
            for column in 0..self.columns {
                let x = dx * column as f64 - 0.5 * self.length_m() - at_m[0];
                // An edge between two nodes belongs to the nearer one.
                let pull = 1.0 - 0.5 * dx.max(dy) / x.hypot(y).max(dx);
                let top = shape.height_m(x, y).or_else(|| shape.height_m(pull * x, pull * y));
                let top = top.map_or(f64::NEG_INFINITY, |h| h + indentation_m);
                self.obstacle[row * self.columns + column] = top;
            }
        }
        for _ in 0..5 {
            self.stretch();
            self.relax();
        }
        self.force_n = self.reaction();
    }

    /// Tensions: Neo-Hookean in pure shear at the mean stretch along each direction, the deflection's own included.
    fn stretch(&mut self) {
        let [dx, dy] = self.spacing();
        let (mut along, mut across, mut n) = (0.0, 0.0, 0.0);
        for row in 1..self.rows {
            for column in 1..self.columns {
                let i = row * self.columns + column;
                let w = &self.deflection;
                along += ((w[i] - w[i - 1]) / dx).powi(2);
                across += ((w[i] - w[i - self.columns]) / dy).powi(2);
                n += 1.0;
            }
        }
        let shear = self.sheet.modulus_pa / 3.0 * self.sheet.thickness_m;
        let x = 1.0 + self.stretch_m / self.sheet.length_m + self.sheet.mounted + 0.5 * along / n;
        // The fingers hold the breadth; what they hold it with is the other tension of pure shear.
        let y = 1.0 + 0.5 * across / n;
        let thin = (x * y).powi(-2);
        self.tension_n_m = [
            shear * (x / y - thin * y / x),
            shear * (y / x - thin * x / y).max(0.0) + 0.45 * shear * (x - 1.0),
        ];
    }

    /// Projected over-relaxation, every other node in turn, so that none waits for its neighbour. The ends are held, the sides are free.
    fn relax(&mut self) {
        for _ in 0..2000 {
            if self.sweep(0).max(self.sweep(1)) < 1e-7 {
                break;
            }
        }
    }

    /// Relaxes the nodes whose row and column add up to an even or an odd number; the largest change.
    fn sweep(&mut self, odd: usize) -> f64 {
        let [dx, dy] = self.spacing();
        let [tx, ty] = [self.tension_n_m[0] / (dx * dx), self.tension_n_m[1] / (dy * dy)];
        let over = 1.0 / (2.0 * (tx + ty));
        let (columns, rows) = (self.columns, self.rows);
        let mut largest = 0f64;
        for row in 0..rows {
            let above = if row == 0 { 1 } else { row - 1 } * columns;
            let below = if row + 1 == rows { row - 1 } else { row + 1 } * columns;
            let here = row * columns;
            for k in (1 + (row + 1 + odd) % 2..columns - 1).step_by(2) {
                let w = &mut self.deflection;
                let mean =
                    over * (tx * (w[here + k - 1] + w[here + k + 1]) + ty * (w[above + k] + w[below + k]));
                let old = w[here + k];
                let new = (old + 1.93 * (mean - old)).max(self.obstacle[here + k]);
                w[here + k] = new;
                largest = largest.max((new - old).abs());
            }
        }
        largest
    }

    /// Force on what touches: minus the operator, where it is not zero.
    fn reaction(&self) -> f64 {
        let [dx, dy] = self.spacing();
        let [tx, ty] = self.tension_n_m;
        let (w, columns) = (&self.deflection, self.columns);
        let mut sum = 0.0;
        for row in 1..self.rows - 1 {
            for column in 1..columns - 1 {
                let i = row * columns + column;
                if w[i] > self.obstacle[i] + 1e-9 {
                    continue;
                }
                let along = (w[i - 1] - 2.0 * w[i] + w[i + 1]) / (dx * dx);
                let across = (w[i - columns] - 2.0 * w[i] + w[i + columns]) / (dy * dy);
                sum -= (tx * along + ty * across) * dx * dy;
            }
        }
        sum
    }

    /// Height at a place, m; none beside the sheet.
    pub fn height_m(&self, x: f64, y: f64) -> Option<f64> {
        let [dx, dy] = self.spacing();
        let (u, v) = ((x + 0.5 * self.length_m()) / dx, (y + 0.5 * self.sheet.breadth_m) / dy);
        if !(u >= 0.0 && v >= 0.0 && u <= (self.columns - 1) as f64 && v <= (self.rows - 1) as f64) {
            return None;
        }
        let (column, row) = ((u as usize).min(self.columns - 2), (v as usize).min(self.rows - 2));
        let (du, dv) = (u - column as f64, v - row as f64);
        let i = row * self.columns + column;
        let w = &self.deflection;
        let line = |i: usize| w[i] * (1.0 - du) + w[i + 1] * du;
        Some(line(i) * (1.0 - dv) + line(i + self.columns) * dv)
    }
}
