//! Many drops at once: a generator for each, so that threads change nothing.

use super::{Bounce, DropError, DropModel, Release};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Drops that one thread takes at a time.
const BATCH: usize = 64;

/// The impacts of one drop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trace<const N: usize> {
    bounces: [Bounce; N],
    count: usize,
}

impl<const N: usize> Trace<N> {
    /// The impacts, `N` or fewer where the ball came to rest before.
    pub fn bounces(&self) -> &[Bounce] {
        &self.bounces[..self.count]
    }
}

/// Does one thing `count` times in parallel, each time with its number and a generator of its own: the same results in the same order on
/// any number of threads.
pub fn each<T: Send>(count: usize, seed: u64, one: impl Fn(usize, &mut ChaCha8Rng) -> T + Sync) -> Vec<T> {
    let run = |i: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(i as u64);
        one(i, &mut rng)
    };
    (0..count).into_par_iter().with_min_len(BATCH).map(run).collect()
}

/// Many drops of one ball, at most `N` impacts each.
///
/// ```
/// use bounce_audio::drop::{Ball, DropModel, Release, Table, drops};
///
/// let model = DropModel::new(Ball::new(0.8, 1e3)?, Table::LEVEL, 9.80665)?;
/// let traces = drops::<4>(&model, &Release::at(0.26), 1_000, 1)?;
/// let first = traces[0].bounces();
/// assert!((first[0].t_s - 0.23).abs() < 0.02 && first.len() == 4);
/// # Ok::<(), bounce_audio::drop::DropError>(())
/// ```
///
/// # Errors
/// [`DropError::Below`] for a release below the table.
pub fn drops<const N: usize>(
    model: &DropModel,
    release: &Release,
    count: usize,
    seed: u64,
) -> Result<Vec<Trace<N>>, DropError> {
    let below_m = -model.table().height_m(&release.position_m);
    if !(below_m <= 0.0) {
        return Err(DropError::Below { below_m });
    }
    let one = |_, rng: &mut ChaCha8Rng| {
        let mut trace = Trace { bounces: [Bounce::default(); N], count: 0 };
        trace.count = model.run(&release.draw(rng), rng, &mut trace.bounces)?;
        Ok(trace)
    };
    each(count, seed, one).into_iter().collect()
}
