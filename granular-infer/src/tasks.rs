//! What the inferred grains are good for (section 3.6): the height for a wanted ring, patterns of rings, what a bowl spills.

use bayes_sim::campaign::Results;
use bayes_sim::error::Error;
use bayes_sim::mdn::MixtureDensity;
use bayes_sim::mdrff::{Mdrff, MdrffSettings};
use bayes_sim::points::Points;
use bayes_sim::posterior::Posterior;
use bayes_sim::prior::Prior;
use bayes_sim::simulations::Simulations;
use bayes_sim::training::TrainingSettings;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use statrs::statistics::Statistics as _;

use crate::dem::{DemError, Mesh, Shape, Wall};
use crate::scene::{Grain, Scene};
use crate::shipped::{self, ShippedError};
use crate::summary::{COUNT, summary};
use crate::view::View;

/// A ring, as [Matl 2021] measures one: the 5th and the 50th percentile of the distances at which grains are seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// 5th percentile in m: about the inner radius.
    pub inner_m: f64,
    /// 50th percentile in m: about the middle of the wall.
    pub outer_m: f64,
}

impl Ring {
    /// The ring that points (m) make about a centre, those within `most_m` of it; none for fewer than 20.
    pub fn of(points_m: &[[f64; 3]], centre_m: [f64; 2], most_m: f64) -> Option<Self> {
        let mut radii: Vec<f64> = points_m
            .iter()
            .map(|p| (p[0] - centre_m[0]).hypot(p[1] - centre_m[1]))
            .filter(|r| *r < most_m)
            .collect();
        if radii.len() < 20 {
            return None;
        }
        radii.sort_unstable_by(f64::total_cmp);
        let at = |q: f64| radii[(q * (radii.len() - 1) as f64).round() as usize];
        Some(Self { inner_m: at(0.05), outer_m: at(0.5) })
    }
}

/// The shipped heights, as `granular-infer/examples/study.rs` writes them.
const SHIPPED: &[u8] = include_bytes!("../heights.json.gz");

/// Which height makes which ring, learned from pours of one kind of grain.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RingHeights {
    /// From a ring's two radii.
    of_radii: Mdrff,
    /// From all statistics of a picture.
    of_pictures: Mdrff,
}

/// Pours of one kind of grain from known heights.
#[derive(Debug, Clone, PartialEq)]
pub struct Heights {
    /// Heights (m) and radii ([`Ring`]).
    pub radii: Simulations,
    /// Heights (m) and the 16 statistics of each picture.
    pub pictures: Simulations,
}

/// Heights, rings and statistics of a campaign of [`crate::scene::OfGrain`]: what [`RingHeights::train`] learns from.
///
/// # Errors
/// [`Error::Length`] for a campaign of another number of grains; [`Error::TooFew`] below 50 pictures.
pub fn heights(results: &Results, scene: &Scene, view: &View, seed: u64) -> Result<Heights, Error> {
    let (mut theta, mut radii, mut pictures) = (Points::new(1), Points::new(2), Points::new(COUNT));
    for record in results.records.values() {
        let Ok(centres) = &record.outcome else { continue };
        let grains = scene.from_features(centres).ok_or(Error::Length {
            what: "coordinates of grains",
            expected: 3 * scene.rig.count,
            got: centres.len(),
        })?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(record.index as u64);
        let points = view.points(&grains, &scene.rig, &mut rng).unwrap_or_default();
        if let (Some(ring), Ok(picture)) = (Ring::of(&points, [0.0; 2], f64::INFINITY), summary(&points)) {
            theta.push(&record.theta)?;
            radii.push(&[ring.inner_m, ring.outer_m])?;
            pictures.push(&picture.values)?;
        }
    }
    Ok(Heights {
        radii: Simulations::new(theta.clone(), radii)?,
        pictures: Simulations::new(theta, pictures)?,
    })
}

impl RingHeights {
    /// Learns heights from rings; 50 frequencies and two components do for two numbers.
    ///
    /// # Errors
    /// Those of [`Mdrff::train`].
    pub fn train(prior: &Prior, poured: &Heights, seed: u64) -> Result<Self, Error> {
        let few = MdrffSettings { frequencies: 50, components: 2, ..MdrffSettings::default() };
        // A few hundred pictures of 16 numbers are soon learned by heart.
        let training = TrainingSettings { weight_decay: 0.05, max_epochs: 200, ..few.training.clone() };
        let fewer = MdrffSettings { frequencies: 40, training, ..few.clone() };
        Ok(Self {
            of_radii: Mdrff::train(prior, &poured.radii, &few, seed)?,
            of_pictures: Mdrff::train(prior, &poured.pictures, &fewer, seed)?,
        })
    }

    /// The heights that are shipped: pours of [`crate::scene::COUSCOUS`] from 1 to 13 cm, in the scene and the view of chapter 3.
    ///
    /// # Errors
    /// [`ShippedError`], if the crate's file is damaged.
    pub fn shipped() -> Result<Self, ShippedError> {
        shipped::unpack(SHIPPED)
    }

    /// Compressed JSON, as it is shipped.
    ///
    /// # Errors
    /// [`ShippedError`].
    pub fn to_bytes(&self) -> Result<Vec<u8>, ShippedError> {
        shipped::pack(self)
    }

    /// The posterior over the height in m for a ring that is wanted by its radii.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn infer(&self, wanted: Ring) -> Result<Posterior, Error> {
        self.of_radii.posterior(&[wanted.inner_m, wanted.outer_m])
    }

    /// The posterior over the height in m from which a picture's heap was poured: surer than that for its radii alone.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn infer_poured(&self, statistics: &[f64; COUNT]) -> Result<Posterior, Error> {
        self.of_pictures.posterior(statistics)
    }

    /// Mean and spread of [`RingHeights::infer`], m.
    ///
    /// # Errors
    /// As [`RingHeights::infer`].
    pub fn height_m(&self, wanted: Ring) -> Result<(f64, f64), Error> {
        Ok(mean_and_spread(&self.infer(wanted)?))
    }

    /// Mean and spread of [`RingHeights::infer_poured`], m.
    ///
    /// # Errors
    /// As [`RingHeights::infer_poured`].
    pub fn poured_from_m(&self, statistics: &[f64; COUNT]) -> Result<(f64, f64), Error> {
        Ok(mean_and_spread(&self.infer_poured(statistics)?))
    }
}

/// Of a posterior over one number, by 2,000 draws of a separate generator.
fn mean_and_spread(posterior: &Posterior) -> (f64, f64) {
    let draws = posterior.sample(2000, &mut ChaCha8Rng::seed_from_u64(0)).theta.column(0);
    (draws.as_slice().mean(), draws.as_slice().population_std_dev())
}

/// A bowl that stands on the cloth under the funnel.
#[derive(Debug, Clone, PartialEq)]
pub struct Bowl {
    /// Its inner surface.
    pub mesh: Mesh,
    /// Radius of its rim in m: a grain that lies farther out is spilled.
    pub rim_m: f64,
}

impl Bowl {
    /// A round bowl: a flat bottom and a wall that rises like a parabola.
    ///
    /// # Errors
    /// [`crate::dem::MeshError`] for sizes that make no surface.
    pub fn round(bottom_m: f64, rim_m: f64, height_m: f64) -> Result<Self, crate::dem::MeshError> {
        let mut profile = vec![[0.0, 1e-3], [bottom_m, 1e-3]];
        for k in 1..=5 {
            let t = f64::from(k) / 5.0;
            profile.push([bottom_m + (rim_m - bottom_m) * t.sqrt(), 1e-3 + height_m * t]);
        }
        Ok(Self { mesh: Mesh::turned(&profile, 32)?, rim_m })
    }
}

/// How many of the scene's grains a bowl spills when they are poured into it from a height in m.
///
/// # Errors
/// [`DemError`] for grains or heights outside physics.
pub fn spilled(
    scene: &Scene,
    bowl: &Bowl,
    grain: &Grain,
    height_m: f64,
    seed: u64,
) -> Result<usize, DemError> {
    let pour = scene.pour(grain, height_m);
    let wall = Wall { shape: Shape::Mesh(bowl.mesh.clone()), coefficients: pour.grains };
    let poured = pour.pour_out(pour.filled_among(&[wall], &[], &[], seed)?)?;
    Ok(poured.positions_m.iter().filter(|p| p[0].hypot(p[1]) > bowl.rim_m).count())
}
