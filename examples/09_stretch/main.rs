//! Chapter 6 on a simulated hand: contacts seen, forces with a radius left out, objects put together from touches, fillings of balloons
//! by palpation, a cookie.
//!
//! `cargo run --release -p examples --example 09_stretch` (`--small`: fewer states); prints the figures' tables and draws them into
//! `stretch.svg` in the temporary folder. Not drawn: the photographs of figure 6.1.
#![allow(clippy::print_stdout, reason = "printing is what an example is for")]

mod forces;
mod geometry;
mod objects;
mod palpation;

use std::error::Error;

use examples::plot;
use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::gripper::Gripper;
use stretch::cloud::{Cloud, CloudSettings, Rest, Window};
use stretch::fake::Rig;
use stretch::segment::{SegmentSettings, Segmenter};

/// Errors that cross threads.
type Outcome<T> = Result<T, Box<dyn Error + Send + Sync>>;

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut panels = Vec::new();
    geometry::section(&mut panels)?;
    let model = forces::curves(&mut panels)?;
    geometry::faces(&mut panels);
    objects::reconstructed(&mut panels)?;
    palpation::balloons(&model, &mut panels)?;
    objects::cookies(&mut panels)?;
    let path = plot::write("stretch.svg", &panels, 4)?;
    println!("\nfigures drawn: {}", path.display());
    Ok(())
}

/// Stretches, m.
fn stretches() -> Vec<f64> {
    if examples::small() { vec![0.0, 0.03, 0.06] } else { (0..=6).map(|k| 0.01 * f64::from(k)).collect() }
}

/// The tool over a place.
fn at(x: f64, z: f64) -> Pose {
    Pose { position_m: [x, 0.0, z], rotation_xyzw: [0.0, 0.0, 0.0, 1.0] }
}

/// What the camera sees of an object with the tool at a place, and what of it touches.
fn look(rig: &mut Rig, stretch_m: f64, tool: Pose) -> Outcome<(Cloud, Segmenter)> {
    rig.open_to(0.1 + stretch_m, 0.1)?;
    let [x, y, _] = tool.position_m;
    rig.move_to(Pose { position_m: [x, y, 0.2], ..tool }, 1.0)?;
    let free = rig.depth_m()?.value;
    let level = Rest::level(rig.eye.distance_m)?;
    let window = Window::of_membrane((640, 480), &rig.intrinsics(), &level, (0.1 + stretch_m, 0.09), 4e-3)?;
    let rest = Rest::fit(&free, &rig.intrinsics(), &window)?;
    rig.move_to(tool, 1.0)?;
    let picture = rig.depth_m()?.value;
    let mut cloud = Cloud::default();
    cloud.fill(&picture, &rig.intrinsics(), &rest, window, &CloudSettings::default())?;
    let mut segmenter = Segmenter::default();
    segmenter.segment(&cloud, &SegmentSettings::default());
    Ok((cloud, segmenter))
}
