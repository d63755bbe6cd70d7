//! Many weighted particles thinned to a few, the expectation of every weight kept.

use super::particle::Particle;
use rand::{Rng, RngExt};

/// A particle, its ball's number and its weight (its logarithm while branches are weighed).
#[derive(Debug, Clone, Copy)]
pub(super) struct Weighted {
    pub(super) weight: f64,
    pub(super) ball: usize,
    pub(super) particle: Particle,
}

/// Makes the weights sum to 1.
pub(super) fn normalise(particles: &mut [Weighted]) {
    let total: f64 = particles.iter().map(|p| p.weight).sum();
    particles.iter_mut().for_each(|p| p.weight /= total);
}

/// Thins branches whose weights sum to 1 to `n` particles: those above a threshold stay as they are, of the others one is drawn from each
/// stratum by its weight and gets the threshold's (Fearnhead and Clifford 2003, doi:10.1111/1467-9868.00421).
pub(super) fn thin(branches: &mut [Weighted], n: usize, particles: &mut Vec<Weighted>, rng: &mut dyn Rng) {
    particles.clear();
    if branches.len() <= n {
        particles.extend_from_slice(branches);
        return;
    }
    branches.sort_unstable_by(|a, b| b.weight.total_cmp(&a.weight));
    // What is left of the weight after the first `kept`.
    let (mut kept, mut left) = (0, 1.0);
    while kept < n && branches[kept].weight * (n - kept) as f64 >= left {
        left -= branches[kept].weight;
        kept += 1;
    }
    let (heavy, light) = branches.split_at(kept);
    particles.extend_from_slice(heavy);
    let total: f64 = light.iter().map(|b| b.weight).sum();
    let stratum = total / (n - kept).max(1) as f64;
    let (mut sum, mut drawn) = (0.0, 0);
    let mut next = stratum * rng.random::<f64>();
    for branch in light {
        sum += branch.weight;
        while next < sum && drawn < n - kept {
            particles.push(Weighted { weight: stratum, ..*branch });
            drawn += 1;
            next = stratum * (drawn as f64 + rng.random::<f64>());
        }
    }
    normalise(particles);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix4, Vector4};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn weights_are_kept_in_expectation_and_heavy_ones_as_they_are() {
        let particle = Particle {
            restitution: 0.8,
            kappa: 1e3,
            mean: Vector4::zeros(),
            covariance: Matrix4::identity(),
            t_s: 0.0,
            down_m_s: None,
            misheard: 0,
        };
        let weights = [0.4, 0.2, 0.1, 0.08, 0.06, 0.05, 0.04, 0.03, 0.02, 0.02];
        let branches: Vec<Weighted> =
            (0..10).map(|ball| Weighted { weight: weights[ball], ball, particle }).collect();
        let (mut rng, mut sums, mut kept) = (ChaCha8Rng::seed_from_u64(1), [0.0; 10], Vec::new());
        for _ in 0..20_000 {
            thin(&mut branches.clone(), 5, &mut kept, &mut rng);
            assert_eq!(kept.len(), 5);
            assert_eq!((kept[0].ball, kept[1].ball), (0, 1));
            kept.iter().for_each(|k| sums[k.ball] += k.weight / 20_000.0);
        }
        for (sum, weight) in sums.iter().zip(weights) {
            assert!((sum - weight).abs() < 0.004, "{sum} for {weight}");
        }
        thin(&mut branches.clone(), 10, &mut kept, &mut rng);
        assert_eq!(kept.len(), 10);
    }
}
