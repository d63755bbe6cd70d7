//! Drops of balls of known materials on tables of several kinds, recorded in rooms, and what is observed of them.

use bounce_audio::fake::knock::{Board, Recorder, SLABS, STRANGERS, SUBSTANCES, Striker, Substance};
use bounce_audio::material::{Given, MaterialError, Observation};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;

/// Tables to learn on, to calibrate on, and to be tried on, as numbers of [`SLABS`].
pub(crate) const TABLES: [std::ops::Range<usize>; 3] = [0..4, 4..6, 6..9];
/// Rate of the microphone, Hz.
pub(crate) const RATE_HZ: f64 = 48_000.0;

/// A drop that was observed, and what is true of it.
pub(crate) struct Tried {
    /// Number of the substance: of [`SUBSTANCES`], or after them of [`STRANGERS`].
    pub(crate) substance: usize,
    pub(crate) table: usize,
    pub(crate) seen: Result<Observation, MaterialError>,
    /// Contact time of a mean impact, reduced to 1 m/s, s.
    pub(crate) contact_s: f64,
    /// Median restitution.
    pub(crate) restitution: f64,
}

/// What a number stands for.
pub(crate) fn substance(number: usize) -> &'static Substance {
    SUBSTANCES.get(number).unwrap_or_else(|| &STRANGERS[(number - SUBSTANCES.len()) % STRANGERS.len()])
}

/// One drop of a ball of a substance on a table of a kind: from 0.15 to 0.6 m, weighed to 1 %, measured to 2 % (a ball is not quite round).
pub(crate) fn one(number: usize, table: usize, seed: u64) -> Result<Tried, String> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let ball = Striker::draw(substance(number), &mut rng);
    let board = Board::draw(&SLABS[table], &mut rng);
    let recorder = Recorder::draw(RATE_HZ, &mut rng).map_err(|e| e.to_string())?;
    let height_m = 0.15 + 0.45 * rng.random::<f64>();
    let recorded = recorder.drop(&ball, &board, height_m, &mut rng);
    let mut off = |sigma: f64| (sigma * rng.sample::<f64, _>(StandardNormal)).exp();
    let given = Given {
        mass_kg: Some(ball.mass_kg * off(0.01)),
        diameter_m: Some(ball.diameter_m * off(0.02)),
        height_m: Some(height_m * off(0.02)),
    };
    let n = recorded.contacts_s.len() as f64;
    let reduced = recorded.contacts_s.iter().zip(&recorded.speeds_m_s).map(|(t, v)| t.ln() + 0.2 * v.ln());
    let mut sorted = recorded.restitutions.clone();
    sorted.sort_by(f64::total_cmp);
    Ok(Tried {
        substance: number,
        table,
        seen: Observation::of(&recorded.sound, &given),
        contact_s: (reduced.sum::<f64>() / n).exp(),
        restitution: sorted[sorted.len() / 2],
    })
}

/// So many drops of each of some substances, on tables of the given kinds in turn.
pub(crate) fn drops(
    substances: std::ops::Range<usize>,
    tables: &std::ops::Range<usize>,
    each: usize,
    seed: u64,
) -> Result<Vec<Tried>, String> {
    let count = substances.len() * each;
    (0..count)
        .into_par_iter()
        .map(|k| {
            let table = tables.start + k % tables.len();
            one(substances.start + k / each, table, seed.wrapping_mul(1 << 20) + k as u64)
        })
        .collect()
}
