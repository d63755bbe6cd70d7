//! What ball it is, from the drops of it that were heard: learned from simulated drops as in chapter 4 of [Matl 2021].

use bayes_sim::mdn::{Mdn, MdnSettings, MixtureDensity};
use bayes_sim::points::Points;
use bayes_sim::posterior::Posterior;
use bayes_sim::simulations::Simulations;
use bounce_audio::drop::each;
use bounce_audio::features::{Features, Scale};
use bounce_audio::posterior::{DropSimulator, Hearing, prior, projected_product};
use std::error::Error;

/// How well impacts are heard offline (example 13).
pub const HEARING: Hearing = Hearing { time_sigma_s: 20e-6, position_sigma_m: 0.7e-3 };

/// The simulator of drops, heard as well as that.
pub fn simulator() -> DropSimulator {
    DropSimulator { hearing: HEARING, scale: Scale::Logarithms, ..DropSimulator::new() }
}

/// The density of a ball given a drop's features, from this many simulations.
///
/// # Errors
/// Where a drop cannot be simulated, or nothing can be learned.
pub fn learn(
    simulator: &DropSimulator,
    count: usize,
) -> Result<Box<dyn MixtureDensity>, Box<dyn Error + Send + Sync>> {
    let prior = prior()?;
    let drawn = each(count, 1, |_, rng| {
        let theta = prior.sample(rng);
        simulator.features(&theta, rng).map(|f| (theta, f.numbers(simulator.observed, simulator.scale)))
    });
    let mut simulations: Option<(Points, Points)> = None;
    for one in drawn {
        let (theta, numbers) = one?;
        let (t, x) = simulations.get_or_insert_with(|| (Points::new(2), Points::new(numbers.len())));
        t.push(&theta)?;
        x.push(&numbers)?;
    }
    let (theta, x) = simulations.ok_or("nothing was simulated")?;
    let mut settings = MdnSettings::default();
    if crate::small() {
        (settings.members, settings.training.max_epochs) = (1, 60);
    }
    Ok(Box::new(Mdn::train(&prior, &Simulations::new(theta, x)?, &settings, 1)?))
}

/// The joint posterior (e, log10 kappa) of drops of one ball.
///
/// # Errors
/// Where there is no drop.
pub fn joint(
    density: &dyn MixtureDensity,
    simulator: &DropSimulator,
    drops: &[Features],
) -> Result<Posterior, Box<dyn Error + Send + Sync>> {
    let mut posteriors = Vec::with_capacity(drops.len());
    for drop in drops {
        posteriors.push(density.posterior(&drop.numbers(simulator.observed, simulator.scale))?);
    }
    Ok(projected_product(&posteriors)?)
}
