//! How chapter 3 looks at what was poured: from grains or counts of a depth camera to the 16 statistics.

use bayes_sim::campaign::Results;
use bayes_sim::error::Error;
use bayes_sim::points::Points;
use bayes_sim::simulations::Simulations;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::camera::{Camera, Flaws};
use crate::campaign::{Grains, Rig};
use crate::scene::Scene;
use crate::seeing::{HeightMap, SeeError};
use crate::summary::{COUNT, Mask, SummaryError, points, summary};

/// A camera, what spoils its pictures, and how they are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: Camera,
    /// Its flaws.
    pub flaws: Flaws,
    /// Side in pixels of the blocks to which pictures are down-sampled.
    pub block: usize,
    /// Least height of a block's mean that shows grains, over the grains' diameter.
    pub least: f64,
    /// Whether pixels are chosen by colour (grains on dark cloth) and not by height.
    pub by_colour: bool,
}

impl Default for View {
    /// 40 cm above the cloth, 256 by 256 pixels of 2 mm, noise of 0.5 mm, blocks of 2 by 2.
    fn default() -> Self {
        Self {
            camera: Camera {
                focal_px: [200.0; 2],
                centre_px: [127.5; 2],
                height_m: 0.4,
                depth_unit_m: 1e-4,
                size_px: [256; 2],
            },
            flaws: Flaws { noise_m: 5e-4, ..Flaws::default() },
            block: 2,
            least: 0.35,
            by_colour: false,
        }
    }
}

/// Why a picture has no statistics.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LookError {
    /// The picture does not show grains on a ground.
    #[error(transparent)]
    See(#[from] SeeError),
    /// The points have no statistics.
    #[error(transparent)]
    Summary(#[from] SummaryError),
}

impl View {
    /// What the camera sees of grains: heights above the ground that is found, and where a colour camera would see grains.
    ///
    /// # Errors
    /// [`SeeError`].
    pub fn look(
        &self,
        grains: &Grains,
        rig: &Rig,
        rng: &mut dyn Rng,
    ) -> Result<(HeightMap, Vec<bool>), SeeError> {
        let depth = self.camera.render(grains);
        let coloured = depth.iter().map(|d| *d < self.camera.height_m - 1e-6).collect();
        let counts = self.camera.expose(&depth, &self.flaws, rng);
        // What lies outside the picture is not missed: half a grain in twenty is enough.
        let seen_m3 = 0.1 * rig.count as f64 * rig.grain_volume_m3();
        Ok((HeightMap::new(&self.camera, &counts, seen_m3)?, coloured))
    }

    /// The 16 statistics of a picture; `coloured` counts where [`View::by_colour`] is set.
    ///
    /// # Errors
    /// [`SummaryError`].
    pub fn statistics(
        &self,
        map: &HeightMap,
        coloured: &[bool],
        diameter_m: f64,
    ) -> Result<[f64; COUNT], SummaryError> {
        Ok(summary(&self.chosen(map, coloured, diameter_m)?)?.values)
    }

    /// The points (m) of a picture that show grains; `coloured` as in [`View::statistics`].
    ///
    /// # Errors
    /// [`SummaryError::Mask`], [`SummaryError::Block`].
    pub fn chosen(
        &self,
        map: &HeightMap,
        coloured: &[bool],
        diameter_m: f64,
    ) -> Result<Vec<[f64; 3]>, SummaryError> {
        let mask =
            if self.by_colour { Mask::Marked(coloured) } else { Mask::Higher(self.least * diameter_m) };
        points(map, self.block, mask)
    }

    /// The points (m) at which grains are seen, once.
    ///
    /// # Errors
    /// [`LookError`].
    pub fn points(&self, grains: &Grains, rig: &Rig, rng: &mut dyn Rng) -> Result<Vec<[f64; 3]>, LookError> {
        let (map, coloured) = self.look(grains, rig, rng)?;
        Ok(self.chosen(&map, &coloured, rig.diameter_m)?)
    }

    /// The 16 statistics of grains, seen once.
    ///
    /// # Errors
    /// [`LookError`].
    pub fn features(&self, grains: &Grains, rig: &Rig, rng: &mut dyn Rng) -> Result<[f64; COUNT], LookError> {
        let (map, coloured) = self.look(grains, rig, rng)?;
        Ok(self.statistics(&map, &coloured, rig.diameter_m)?)
    }
}

/// A campaign as a camera saw it.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Parameters and statistics, 16 a picture.
    pub simulations: Simulations,
    /// Pours that gave none, by number: their grains had left the picture.
    pub left_out: Vec<(usize, LookError)>,
}

/// The statistics of all pours of a campaign, those of a series one pour after the other; each picture's flaws come from the seed and the
/// pour's number.
///
/// # Errors
/// [`Error::Length`] for a campaign of another number of grains, [`Error::TooFew`] below 50 pictures.
pub fn seen(results: &Results, scene: &Scene, view: &View, seed: u64) -> Result<Seen, Error> {
    use rayon::prelude::*;
    let of_pour = 3 * scene.rig.count;
    let length = |got| Error::Length { what: "coordinates of grains", expected: of_pour, got };
    let of = |(index, x): (usize, &[f64])| -> Result<Result<Vec<f64>, LookError>, Error> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(index as u64);
        let mut all = Vec::new();
        for pour in x.chunks(of_pour) {
            let grains = scene.from_features(pour).ok_or_else(|| length(pour.len()))?;
            match view.features(&grains, &scene.rig, &mut rng) {
                Ok(of_picture) => all.extend(of_picture),
                Err(error) => return Ok(Err(error)),
            }
        }
        Ok(Ok(all))
    };
    let pictures = results.campaign.x_dim.div_ceil(of_pour);
    let poured: Vec<(usize, &[f64], &[f64])> = results
        .records
        .values()
        .filter_map(|r| r.outcome.as_ref().ok().map(|x| (r.index, r.theta.as_slice(), x.as_slice())))
        .collect();
    let looked: Vec<_> = poured.par_iter().map(|p| of((p.0, p.2))).collect::<Result<_, Error>>()?;
    let (mut theta, mut x) = (Points::new(results.campaign.prior.dim()), Points::new(pictures * COUNT));
    let mut left_out = Vec::new();
    for ((index, parameters, _), look) in poured.iter().zip(looked) {
        match look {
            Ok(values) => {
                theta.push(parameters)?;
                x.push(&values)?;
            }
            Err(error) => left_out.push((*index, error)),
        }
    }
    Ok(Seen { simulations: Simulations::new(theta, x)?, left_out })
}
