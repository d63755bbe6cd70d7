//! Sections 3.5 and 3.6 of [Matl 2021] on simulated pours: how far equal pours differ, sliding friction learned alone, how far errors of grains show,
//! grains of other shapes, and grains of a rig calibrated by ten pours and poured from other heights.
//!
//! `cargo run --release -p examples --example 26_pours` (half an hour of one core; `--small`: few and small heaps) draws `pours.svg` into the
//! temporary folder: what the rig poured and what was foretold, from 2 to 12 cm.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod alone;
mod calibrate;
mod reach;
mod repeated;
mod shapes;

use std::error::Error;

use granular_infer::campaign::{Grains, Rig};
use granular_infer::dem::Clump;
use granular_infer::posterior::GrainPosterior;
use granular_infer::scene::{Grain, Scene};
use granular_infer::summary::COUNT;
use granular_infer::view::View;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use statrs::statistics::Statistics as _;

pub(crate) type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

/// Height of the outlet in m from which the posterior was learned.
pub(crate) const HEIGHT_M: f64 = 0.12;

/// What all sections share.
pub(crate) struct Bench {
    pub(crate) scene: Scene,
    pub(crate) view: View,
    pub(crate) posterior: GrainPosterior,
    pub(crate) small: bool,
}

impl Bench {
    /// One number for a trial of the command, another for its figures.
    pub(crate) fn either(&self, small: usize, whole: usize) -> usize {
        if self.small { small } else { whole }
    }

    /// The statistics of grains poured once, spheres where no shape is given; none where too few stay in the picture.
    pub(crate) fn pour(
        &self,
        grain: &Grain,
        shape: Option<&Clump>,
        height_m: f64,
        seed: u64,
    ) -> Option<[f64; COUNT]> {
        let of = |clump| {
            let poured = self.scene.pour(grain, height_m).run_with(clump, seed)?;
            Ok(Grains { positions_m: poured.positions_m, radii_m: poured.radii_m })
        };
        let grains = shape.map_or_else(|| self.scene.grains(grain, height_m, seed), of).ok()?;
        self.view.features(&grains, &self.scene.rig, &mut ChaCha8Rng::seed_from_u64(seed)).ok()
    }
}

/// Mean, half of its 95 % interval, and the spread.
pub(crate) fn spread(values: &[f64]) -> String {
    if let [value] = values {
        return format!("{value:+.4} (one)");
    }
    let sd = values.std_dev();
    format!("{:+.4} +- {:.4} (spread {sd:.4})", values.mean(), 1.96 * sd / (values.len() as f64).sqrt())
}

fn main() -> Outcome<()> {
    let small = examples::small();
    let mut scene = Scene::default();
    if small {
        scene.rig = Rig { count: 80, ..scene.rig };
    }
    let bench = Bench { scene, view: View::default(), posterior: GrainPosterior::shipped()?, small };
    repeated::print(&bench)?;
    alone::print(&bench)?;
    reach::print(&bench);
    shapes::print(&bench)?;
    calibrate::print(&bench)
}
