//! A liquid that runs along a tilted cylinder: finite volumes along its axis, implicit in time.
//!
//! Each cell holds the area of the circle's segment that is wet. What drives is the height of the surface, what brakes is the shear in
//! the liquid (`g w d^3 / (3 nu)` for a segment of width `w` and depth `d`) and, for thin liquids, friction as of an open channel.

use std::f64::consts::PI;

/// Cells along the axis.
const CELLS: usize = 48;
/// Points of the table from the wet area to the depth.
const TABLE: usize = 256;
/// Below this tilt (rad) the liquid lies level at once: far from any rim.
const STEEP_RAD: f64 = 0.35;
/// Width of the slot above a full section, over the diameter (Preissmann's): what is beyond full is a pressure.
const SLOT: f64 = 2e-4;
/// Speed of a thin liquid over the slope of its surface, m/s.
const CHANNEL_M_S: f64 = 3.0;

/// The liquid in a cylinder of inner radius and length (m).
#[derive(Debug, Clone)]
pub(super) struct Channel {
    radius: f64,
    length: f64,
    viscosity: f64,
    gravity: f64,
    areas: [f64; CELLS],
    /// Area, depth and first moment of segments, over powers of the radius.
    table: Vec<[f64; 3]>,
    leveled: Option<f64>,
}

impl Channel {
    pub(super) fn new(radius: f64, length: f64, volume: f64, viscosity: f64, gravity: f64) -> Self {
        let table = (0..=TABLE)
            .map(|k| {
                let (sin, cos) = (PI * k as f64 / TABLE as f64).sin_cos();
                let angle = PI * k as f64 / TABLE as f64;
                [angle - sin * cos, 1.0 - cos, 2.0 / 3.0 * sin.powi(3)]
            })
            .collect();
        let areas = [volume / length; CELLS];
        let mut channel = Self { radius, length, viscosity, gravity, areas, table, leveled: None };
        channel.level(0.0);
        channel
    }

    fn cell(&self) -> f64 {
        self.length / CELLS as f64
    }

    fn along(&self, i: usize) -> f64 {
        (i as f64 + 0.5) * self.cell()
    }

    pub(super) fn volume(&self) -> f64 {
        self.areas.iter().sum::<f64>() * self.cell()
    }

    /// Depth and first moment of a wet area, over powers of the radius; beyond full the depth goes on up the slot.
    fn segment(&self, area: f64) -> [f64; 2] {
        let share = area / (self.radius * self.radius);
        if share >= PI {
            return [2.0 + (share - PI) / (2.0 * SLOT), 0.0];
        }
        let k = self.table.partition_point(|row| row[0] <= share).clamp(1, TABLE);
        let ([a, d, m], [b, e, n]) = (self.table[k - 1], self.table[k]);
        let mut u = ((share - a) / (b - a)).max(0.0);
        if k == 1 {
            // Near the wall the area goes with the depth to the power of 3/2.
            u = u.powf(2.0 / 3.0);
        }
        [d + u * (e - d), m + u * (n - m)]
    }

    /// Lets the liquid lie level at a tilt.
    fn level(&mut self, tilt: f64) {
        let volume = self.volume();
        let (sin, cos) = tilt.sin_cos();
        let sin = sin.abs().max(1e-9);
        let area = |depth: f64| {
            let c = (1.0 - depth / self.radius).clamp(-1.0, 1.0);
            let angle = c.acos();
            self.radius * self.radius * (angle - angle.sin() * c)
        };
        let depth = |height: f64, i: usize| {
            ((height - self.along(i) * cos) / sin + self.radius).clamp(0.0, 2.0 * self.radius)
        };
        let reach = self.length + self.radius;
        let (mut low, mut high) = (-reach, reach);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            let held: f64 = (0..CELLS).map(|i| area(depth(middle, i))).sum::<f64>() * self.cell();
            if held < volume { low = middle } else { high = middle }
        }
        let areas: [f64; CELLS] = std::array::from_fn(|i| area(depth(high, i)));
        let held = areas.iter().sum::<f64>() * self.cell();
        self.areas = areas.map(|a| a * volume / held.max(f64::MIN_POSITIVE));
        self.leveled = Some(tilt);
    }

    /// Height of the surface at the mouth along up, from the axis at the cavity's bottom, m.
    pub(super) fn at_mouth(&self, tilt: f64) -> f64 {
        let (sin, cos) = tilt.sin_cos();
        let depth = self.segment(self.areas[CELLS - 1])[0] * self.radius;
        self.along(CELLS - 1) * cos + (depth - self.radius) * sin
    }

    /// Where the liquid's centre of mass lies, across towards the lower wall and along from the cavity's bottom, m.
    pub(super) fn center(&self) -> [f64; 2] {
        let mut sums = [0.0; 3];
        for (i, area) in self.areas.iter().enumerate() {
            sums[0] += area;
            sums[1] += self.segment(*area)[1] * self.radius.powi(3);
            sums[2] += area * self.along(i);
        }
        if sums[0] > 0.0 { [sums[1] / sums[0], sums[2] / sums[0]] } else { [0.0; 2] }
    }

    /// Goes on by `h` (s) at a tilt while `out` (m^3/s) leaves over the lip; the volume that left, m^3.
    pub(super) fn advance(&mut self, h: f64, tilt: f64, out: f64) -> f64 {
        let cell = self.cell();
        if tilt < STEEP_RAD {
            if self.leveled != Some(tilt) {
                self.level(tilt);
            }
            return 0.0;
        }
        self.leveled = None;
        let out = out.min(0.5 * self.areas[CELLS - 1] * cell / h);
        let (sin, cos) = tilt.sin_cos();
        let (mut heights, mut slopes, mut carry) = ([0.0; CELLS], [0.0; CELLS], [0.0; CELLS]);
        for i in 0..CELLS {
            let depth = self.segment(self.areas[i])[0];
            let width = if depth < 2.0 { 2.0 * (depth * (2.0 - depth)).sqrt().max(0.05) } else { 2.0 * SLOT };
            heights[i] = self.along(i) * cos + (depth - 1.0) * self.radius * sin;
            slopes[i] = sin / (width * self.radius);
            let shear = self.gravity * width.max(0.1) * (depth.min(2.0) * self.radius).powi(3) * self.radius
                / (3.0 * self.viscosity);
            let thin = CHANNEL_M_S * self.areas[i];
            carry[i] = if thin > 0.0 { shear * thin / (shear + thin) } else { 0.0 };
        }
        // Faces: what flows from the higher surface to the lower one, over the difference.
        let face: [f64; CELLS - 1] =
            std::array::from_fn(|i| if heights[i] > heights[i + 1] { carry[i] } else { carry[i + 1] } / cell);
        let before = |i: usize| if i == 0 { 0.0 } else { face[i - 1] };
        let after = |i: usize| if i + 1 == CELLS { 0.0 } else { face[i] };
        let flow = |i: usize| if i + 1 == CELLS { out } else { -face[i] * (heights[i + 1] - heights[i]) };
        // Thomas's elimination of the three diagonals.
        let (mut up, mut right) = ([0.0; CELLS], [0.0; CELLS]);
        for i in 0..CELLS {
            let low = if i == 0 { 0.0 } else { -before(i) * slopes[i - 1] };
            let high = if i + 1 == CELLS { 0.0 } else { -after(i) * slopes[i + 1] };
            let middle = cell / h + (before(i) + after(i)) * slopes[i];
            let sum = if i == 0 { 0.0 } else { flow(i - 1) } - flow(i);
            let (u, r) = if i == 0 { (0.0, 0.0) } else { (up[i - 1], right[i - 1]) };
            let pivot = middle - low * u;
            (up[i], right[i]) = (high / pivot, (sum - low * r) / pivot);
        }
        let mut next = 0.0;
        for i in (0..CELLS).rev() {
            next = right[i] - up[i] * next;
            self.areas[i] += next;
        }
        // A cell that has run dry takes what it owes from the one behind it.
        for i in (1..CELLS).rev() {
            if self.areas[i] < 0.0 {
                self.areas[i - 1] += self.areas[i];
                self.areas[i] = 0.0;
            }
        }
        self.areas[0] = self.areas[0].max(0.0);
        out * h
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Water left to itself comes to lie level, its volume kept; honey takes longer.
    #[test]
    fn it_comes_to_lie_level() {
        for (viscosity, seconds) in [(1e-6, 5.0), (7e-3, 120.0)] {
            let mut channel = Channel::new(0.034, 0.17, 300e-6, viscosity, 9.81);
            channel.advance(1e-3, 0.3, 0.0);
            let mut t = 0.0;
            while t < seconds {
                channel.advance(2.5e-3, 1.0, 0.0);
                t += 2.5e-3;
            }
            approx::assert_relative_eq!(channel.volume(), 300e-6, max_relative = 1e-9);
            let [x, z] = channel.center();
            let mut level = channel.clone();
            level.level(1.0);
            let [at_x, at_z] = level.center();
            assert!((x - at_x).abs() < 5e-4 && (z - at_z).abs() < 5e-4, "{x} {z}, level {at_x} {at_z}");
        }
    }
}
