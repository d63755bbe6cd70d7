//! The noise floor: from the quieter stretches of a sound.

use crate::quantile::quantile;

/// Blocks, s; their quantile that is taken, and what it is of the mean for such blocks of noise.
const FLOOR: (f64, f64, f64) = (2e-3, 0.2, 0.85);
/// The noise is at least this part of a channel's root mean square, so that digital silence is a floor too.
const LEAST_NOISE: f64 = 1e-4;
/// Blocks that a stream remembers: 3 s, so that a ball's last bounces and their echoes leave some quiet ones.
const REMEMBERED: usize = 1500;
/// Once this many are known the floor is looked at only every few blocks.
const ENOUGH: (usize, usize) = (100, 5);
/// Blocks before a stream's floor is believed: 50 ms.
const FEWEST: usize = 25;

/// Samples of a block.
pub(super) fn block(rate_hz: f64) -> usize {
    ((FLOOR.0 * rate_hz) as usize).max(8)
}

/// Standard deviation of the noise, from the powers of blocks (their order is lost) and the power of the whole.
pub(super) fn sigma(blocks: &mut [f64], all: f64) -> f64 {
    let quiet = quantile(blocks, FLOOR.1).unwrap_or(0.0);
    (quiet / FLOOR.2).max(LEAST_NOISE.powi(2) * all).max(1e-24).sqrt()
}

/// The floor of a stream's last 3 s.
#[derive(Debug)]
pub(super) struct Floor {
    block: usize,
    powers: Vec<f64>,
    scratch: Vec<f64>,
    /// Blocks so far, and samples and squares of the one under way.
    blocks: usize,
    samples: usize,
    squares: f64,
    sigma: f64,
}

impl Floor {
    pub(super) fn new(rate_hz: f64) -> Self {
        let room = || Vec::with_capacity(REMEMBERED);
        Self {
            block: block(rate_hz),
            powers: room(),
            scratch: room(),
            blocks: 0,
            samples: 0,
            squares: 0.0,
            sigma: 1e-12,
        }
    }

    pub(super) fn step(&mut self, filtered: f64) {
        self.squares += filtered * filtered;
        self.samples += 1;
        if self.samples < self.block {
            return;
        }
        let power = self.squares / self.block as f64;
        if self.powers.len() < REMEMBERED {
            self.powers.push(power);
        } else {
            self.powers[self.blocks % REMEMBERED] = power;
        }
        (self.blocks, self.samples, self.squares) = (self.blocks + 1, 0, 0.0);
        if self.blocks > ENOUGH.0 && !self.blocks.is_multiple_of(ENOUGH.1) {
            return;
        }
        self.scratch.clear();
        self.scratch.extend_from_slice(&self.powers);
        let all = self.powers.iter().sum::<f64>() / self.powers.len() as f64;
        self.sigma = sigma(&mut self.scratch, all);
    }

    /// Standard deviation of the noise.
    pub(super) fn sigma(&self) -> f64 {
        self.sigma
    }

    /// Whether it has heard enough.
    pub(super) fn is_known(&self) -> bool {
        self.blocks >= FEWEST
    }
}
