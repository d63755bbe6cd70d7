//! Which noise a data vector has, of the shapes on the family's lattice.

use super::plane::Linearised;

/// Where the model and every mechanism leave fewer degrees of freedom than this, of all channels together or of one, its noise is that of
/// the model alone: what next to nothing is left of says nothing of noise.
const LEAST_FREEDOM: f64 = 5.0;

/// Most moves of a climb at one stride.
const CLIMB: usize = 8;

impl Linearised<'_> {
    /// The noise of a data vector once the model *and* every mechanism are fitted to it: shape of the family and sigma, by
    /// channel. Where the noise of null worlds is taken from, so that what is tested for does not swell it.
    pub(crate) fn noise_beyond_mechanisms(&self, data: &[Vec<Vec<f64>>]) -> Vec<(usize, f64)> {
        let products = self.products(data);
        let nuisance: Vec<usize> = (0..self.n_nuisance).collect();
        let [(_, alone), (_, with)] = [0, self.mechanisms].map(|n| self.columns_with(n));
        let start = self.white_start(&products);
        let noise_beside = |shared: &[usize]| self.alternate(&products, &nuisance, shared, &start, 8).1;
        let enough = |c: usize| self.freedom_of(c, &nuisance, &with) >= LEAST_FREEDOM;
        let mut enough: Vec<bool> = (0..self.problem.channels()).map(enough).collect();
        if self.freedom_beside(with.len() - self.n_shared) < LEAST_FREEDOM {
            enough.fill(false);
        }
        let mut noise = noise_beside(if enough.contains(&true) { &with } else { &alone });
        if enough.contains(&true) && enough.contains(&false) {
            let of_model = noise_beside(&alone);
            let short = (0..noise.len()).filter(|&c| !enough[c]);
            short.for_each(|c| noise[c] = of_model[c]);
        }
        noise.into_iter().map(|(shape, sigma)| (self.in_play[shape], sigma)).collect()
    }

    /// The noise of a data vector as [`Self::noise_beyond_mechanisms`] finds it, of the shapes between those in play as well;
    /// those a standard error about it are put in play beside the others: another vector of this noise would choose among them.
    pub(crate) fn sharpen(&mut self, data: &[Vec<Vec<f64>>]) -> Vec<(usize, f64)> {
        let mut shapes = self.in_play.clone();
        let mut noise = self.noise_beyond_mechanisms(data);
        for stride in self.problem.family.strides() {
            for _ in 0..CLIMB {
                self.play(&self.around(&noise, |_| stride));
                let next = self.noise_beyond_mechanisms(data);
                let still = next.iter().zip(&noise).all(|(a, b)| a.0 == b.0);
                noise = next;
                if still {
                    break;
                }
            }
        }
        let problem = self.problem;
        shapes.extend(self.around(&noise, |channel| problem.family.error_steps(problem.count(channel))));
        shapes.sort_unstable();
        shapes.dedup();
        self.play(&shapes);
        noise
    }

    /// White noise, each channel's shape, and the shapes so many steps about it.
    fn around(&self, noise: &[(usize, f64)], stride: impl Fn(usize) -> usize) -> Vec<usize> {
        let family = self.problem.family;
        let mut shapes = vec![0];
        for (channel, &(shape, _)) in noise.iter().enumerate() {
            let beside = family.around(shape, stride(channel)).into_iter();
            shapes.extend(beside.filter(|&s| self.rule.admits(&family.shape(s))).chain([shape]));
        }
        shapes.sort_unstable();
        shapes.dedup();
        shapes
    }
}
