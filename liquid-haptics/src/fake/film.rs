//! A thick liquid on the wall of a cylinder that was turned from its side to upright: finite volumes of second order in strips along the
//! wall (minmod slopes; Heun's method in time).

use std::f64::consts::PI;

const STRIPS: usize = 48;
/// Cells along the wall, finer towards its top, where the film is steep.
const CELLS: usize = 120;
/// Share of a cell that the flow may cross in a step.
const COURANT: f64 = 0.5;
/// Times shorter than this are gathered before the film goes on, s.
const GATHERED_S: f64 = 1e-3;

/// Film and pool.
#[derive(Debug, Clone)]
pub(super) struct Film {
    radius: f64,
    length: f64,
    volume: f64,
    viscosity: f64,
    gravity: f64,
    /// Depth of each strip's cells from the top down, m, and where the strips are (cosine and width of their angle).
    depths: Vec<[f64; CELLS]>,
    walls: Vec<[f64; 2]>,
    waiting_s: f64,
    sideways: f64,
}

impl Film {
    /// The prism in which the liquid lies on its side.
    pub(super) fn new(radius: f64, length: f64, volume: f64, viscosity: f64, gravity: f64) -> Self {
        let step = PI / STRIPS as f64;
        let walls: Vec<[f64; 2]> = (0..STRIPS)
            .map(|k| ((k as f64 + 0.5) * step - 0.5 * PI).cos() * radius)
            .map(|wall| [wall, wall * step])
            .collect();
        let depth = |wall: f64, chord: f64| (wall - chord.max(-wall)).max(0.0);
        let (mut low, mut high) = (-radius, radius);
        for _ in 0..60 {
            let chord = 0.5 * (low + high);
            let area: f64 = walls.iter().map(|[wall, width]| depth(*wall, chord) * width).sum();
            if area * length > volume { low = chord } else { high = chord }
        }
        let depths = walls.iter().map(|[wall, _]| [depth(*wall, high); CELLS]).collect();
        let mut film =
            Self { radius, length, volume, viscosity, gravity, depths, walls, waiting_s: 0.0, sideways: 0.0 };
        film.sideways = film.sum_sideways();
        film
    }

    /// Where a cell begins, m from the top.
    fn edge(&self, i: usize) -> f64 {
        self.length * (i as f64 / CELLS as f64).powi(2)
    }

    fn size(&self, i: usize) -> f64 {
        self.edge(i + 1) - self.edge(i)
    }

    /// How many cells, the last one in part, lie above the pool.
    fn above_pool(&self) -> f64 {
        let disc = PI * self.radius * self.radius;
        let mut film = 0.0;
        for i in 0..CELLS {
            let slice: f64 = self.depths.iter().zip(&self.walls).map(|(d, w)| d[i] * w[1]).sum();
            let (level, size) = (self.length - self.edge(i + 1), self.size(i));
            if disc * level + film + slice * size < self.volume {
                let spare = disc * (level + size) + film - self.volume;
                return i as f64 + (spare / ((disc - slice) * size)).clamp(0.0, 1.0);
            }
            film += slice * size;
        }
        CELLS as f64
    }

    /// Goes on by a time (s) at a tilt (rad): gravity pulls along the wall with its cosine.
    pub(super) fn advance(&mut self, duration_s: f64, tilt_rad: f64) {
        let pull = self.gravity * tilt_rad.cos().max(0.0);
        self.waiting_s += duration_s;
        if self.waiting_s < GATHERED_S {
            return;
        }
        let sizes: [f64; CELLS] = std::array::from_fn(|i| self.size(i));
        let mut left = std::mem::take(&mut self.waiting_s);
        while left > 0.0 && pull > 0.0 {
            // The wave that runs into the pool needs a cell or two of it.
            let wet = (self.above_pool().ceil() as usize + 2).min(CELLS);
            // The fastest crossing of a cell, over gravity and viscosity.
            let cells = self.depths.iter().flat_map(|d| d[..wet].iter().zip(&sizes));
            let pace = cells.fold(0.0f64, |most, (depth, size)| most.max(depth * depth / size));
            if pace == 0.0 {
                break;
            }
            let h = (COURANT * self.viscosity / (pull * pace)).min(left);
            let flux = pull / (3.0 * self.viscosity);
            for strip in &mut self.depths {
                let before = *strip;
                euler(&mut strip[..wet], &sizes, h, flux);
                euler(&mut strip[..wet], &sizes, h, flux);
                strip[..wet]
                    .iter_mut()
                    .zip(&before)
                    .for_each(|(depth, before)| *depth = 0.5 * (*depth + before));
            }
            left -= h;
        }
        self.sideways = self.sum_sideways();
    }

    /// Where the whole liquid's centre of mass lies off the axis, m.
    pub(super) fn sideways(&self) -> f64 {
        self.sideways
    }

    fn sum_sideways(&self) -> f64 {
        let above = self.above_pool();
        let mut moment = 0.0;
        for i in 0..CELLS {
            let share = (above - i as f64).clamp(0.0, 1.0) * self.size(i);
            for (strip, [wall, width]) in self.depths.iter().zip(&self.walls) {
                moment += share * width * strip[i] * (wall - 0.5 * strip[i]);
            }
        }
        moment / self.volume
    }
}

/// One explicit step of a strip's cells, from the top down: the depth at each lower edge by the limited slope.
fn euler(strip: &mut [f64], sizes: &[f64], h: f64, flux: f64) {
    let (mut inflow, mut above) = (0.0, 0.0);
    let mut gap_above = 0.5 * sizes[0];
    for i in 0..strip.len() {
        let (depth, size) = (strip[i], sizes[i]);
        let before = (depth - above) / gap_above;
        let gap = 0.5 * (size + sizes.get(i + 1).copied().unwrap_or(size));
        let after = strip.get(i + 1).map_or(before, |below| (below - depth) / gap);
        let slope = if before * after > 0.0 { before.signum() * before.abs().min(after.abs()) } else { 0.0 };
        let outflow = flux * (depth + 0.5 * slope * size).max(0.0).powi(3);
        strip[i] = depth + h / size * (inflow - outflow);
        (inflow, above, gap_above) = (outflow, depth, gap);
    }
}
