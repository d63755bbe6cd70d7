//! A thick liquid on the wall of a cylinder that was turned from its side to upright: finite volumes in strips along the wall.

use std::f64::consts::PI;

const STRIPS: usize = 32;
const CELLS: usize = 160;
/// Share of a cell that the flow may cross in a step.
const COURANT: f64 = 0.8;

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
        Self { radius, length, volume, viscosity, gravity, depths, walls }
    }

    fn cell(&self) -> f64 {
        self.length / CELLS as f64
    }

    /// How many cells, the last one in part, lie above the pool.
    fn above_pool(&self) -> f64 {
        let disc = PI * self.radius * self.radius;
        let mut film = 0.0;
        for i in 0..CELLS {
            let slice: f64 = self.depths.iter().zip(&self.walls).map(|(d, w)| d[i] * w[1]).sum();
            let level = self.length - (i as f64 + 1.0) * self.cell();
            if disc * level + film + slice * self.cell() < self.volume {
                let spare = disc * (level + self.cell()) + film - self.volume;
                return i as f64 + (spare / ((disc - slice) * self.cell())).clamp(0.0, 1.0);
            }
            film += slice * self.cell();
        }
        CELLS as f64
    }

    /// Goes on by a time (s) at a tilt (rad): gravity pulls along the wall with its cosine.
    pub(super) fn advance(&mut self, duration_s: f64, tilt_rad: f64) {
        let pull = self.gravity * tilt_rad.cos().max(0.0);
        let mut left = duration_s;
        while left > 0.0 && pull > 0.0 {
            let wet = (self.above_pool().ceil() as usize).min(CELLS);
            let deepest = self.depths.iter().flat_map(|d| &d[..wet]).fold(0.0f64, |a, b| a.max(*b));
            if deepest == 0.0 {
                return;
            }
            let h = (COURANT * self.cell() * self.viscosity / (pull * deepest * deepest)).min(left);
            let flux = pull / (3.0 * self.viscosity);
            for strip in &mut self.depths {
                let mut inflow = 0.0;
                for depth in &mut strip[..wet] {
                    let outflow = flux * depth.powi(3);
                    *depth += h * CELLS as f64 / self.length * (inflow - outflow);
                    inflow = outflow;
                }
            }
            left -= h;
        }
    }

    /// Where the whole liquid's centre of mass lies off the axis, m.
    pub(super) fn sideways(&self) -> f64 {
        let above = self.above_pool();
        let mut moment = 0.0;
        for i in 0..CELLS {
            let share = (above - i as f64).clamp(0.0, 1.0);
            for (strip, [wall, width]) in self.depths.iter().zip(&self.walls) {
                moment += share * width * strip[i] * (wall - 0.5 * strip[i]);
            }
        }
        moment * self.cell() / self.volume
    }
}
