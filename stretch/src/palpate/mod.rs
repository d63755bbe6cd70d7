//! Stiffness by active palpation (section 6.6), on any hand with a depth camera, a gripper and an arm.
//!
//! The hand first touches lightly to learn the object's height and radius, unstretched and most sensitive. Then it presses
//! deeper and, stretch by stretch, harder: at each new stretch it begins where the model's force is that of the stretch before, so
//! that the force only ever rises, until the object's top has sunk. What the force rose by since the first touch over the sinking is its
//! stiffness: the first touch itself has pressed it in a little, which nobody saw.

mod programme;

use hw_traits::Error;
use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::gripper::Gripper;

pub use self::programme::{PalpateError, Programme};
use crate::calibration::ForceModel;
use crate::cloud::{Cloud, Rest, Window};
use crate::contact::{Ball, ContactError, cap};
use crate::force::{Load, Seen, indentation_m, load};
use crate::measured::MeasuredLength;
use crate::segment::Segmenter;

/// One step of the palpation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Stretch, m.
    pub stretch_m: f64,
    /// How deep the object is in the membrane, seen, m.
    pub indentation_m: f64,
    /// Force by the model.
    pub load: Load,
    /// What the force rose by since the first touch, N.
    pub rise_n: f64,
    /// How far the object's top has sunk since, m.
    pub sunk_m: f64,
    /// Standard deviation of that, m.
    pub sunk_sigma_m: f64,
}

/// What was felt.
#[derive(Debug, Clone, PartialEq)]
pub struct Palpation {
    /// Radius of the object where it was touched.
    pub radius: MeasuredLength,
    /// All steps, in order.
    pub steps: Vec<Step>,
    /// Stiffness, N/m; none where the object did not yield: it is at least as stiff as the last step says.
    pub stiffness_n_m: Option<f64>,
    /// Its 95 % interval, N/m; up to infinity where the object did not yield.
    pub interval_n_m: (f64, f64),
}

/// What one look gave: means over the pictures.
#[derive(Debug, Clone, Copy)]
struct Look {
    /// Highest point of the ball over the membrane at rest, m.
    apex_m: f64,
    apex_sigma_m: f64,
    radius: MeasuredLength,
}

/// Palpates an object.
///
/// # Errors
/// [`PalpateError`].
pub fn palpate<R>(
    rig: &mut R,
    programme: &Programme,
    model: &impl ForceModel,
) -> Result<Palpation, PalpateError<R::Error>>
where
    R: DepthCamera + Gripper + Arm,
{
    programme.check()?;
    let mut eyes = Eyes::default();
    let stretch_m = programme.stretches_m[0];
    open(rig, programme, stretch_m)?;
    eyes.learn_rest(rig, programme, stretch_m)?;
    lower(rig, programme, programme.top_m - programme.touch_m)?;
    let first = eyes.look(rig, programme)?;
    // The light touch tells where the top is when nothing presses.
    let top_m = programme.top_m - programme.touch_m + first.apex_m;
    let deeper = first.apex_m + 0.5 * (programme.deepest_m - first.apex_m).max(0.0);
    lower(rig, programme, top_m - deeper)?;
    let shape = eyes.look(rig, programme)?;
    let mut out = Palpation {
        radius: shape.radius,
        steps: Vec::new(),
        stiffness_n_m: None,
        interval_n_m: (0.0, f64::INFINITY),
    };
    let force_of = |stretch_m: f64, look: &Look| {
        let seen = Seen {
            stretch_m,
            radius: shape.radius,
            indentation: MeasuredLength { value_m: look.apex_m.max(0.0), sigma_m: look.apex_sigma_m },
        };
        load(model, &seen).map_err(PalpateError::Force)
    };
    let first_n = force_of(stretch_m, &first)?.force_n;
    let mut force = first_n;
    for &stretch_m in &programme.stretches_m {
        lower(rig, programme, programme.above.position_m[2])?;
        open(rig, programme, stretch_m)?;
        eyes.learn_rest(rig, programme, stretch_m)?;
        let start =
            indentation_m(model, shape.radius.value_m, stretch_m, force).map_err(PalpateError::Force)?;
        let mut depth = start.max(programme.touch_m) + programme.depth_step_m;
        while depth <= programme.deepest_m {
            let tool_m = top_m - depth;
            lower(rig, programme, tool_m)?;
            let now = eyes.look(rig, programme)?;
            let load = force_of(stretch_m, &now)?;
            let sunk_m = top_m - (tool_m + now.apex_m);
            let sunk_sigma_m = now.apex_sigma_m.hypot(first.apex_sigma_m);
            let rise_n = load.force_n - first_n;
            let step = Step { stretch_m, indentation_m: now.apex_m, load, rise_n, sunk_m, sunk_sigma_m };
            out.steps.push(step);
            out.interval_n_m.0 = out.interval_n_m.0.max(at_least(&step));
            if sunk_m >= programme.yield_m && sunk_m > 3.0 * sunk_sigma_m {
                (out.stiffness_n_m, out.interval_n_m) = (Some(rise_n / sunk_m), between(&step));
                return Ok(out);
            }
            force = load.force_n.max(force);
            depth += programme.depth_step_m;
        }
    }
    Ok(out)
}

/// Least stiffness that a step without yield leaves.
fn at_least(step: &Step) -> f64 {
    let least = step.load.interval_n.0 / step.load.force_n;
    (step.rise_n * least).max(0.0) / (step.sunk_m + 1.96 * step.sunk_sigma_m).max(1e-6)
}

fn between(step: &Step) -> (f64, f64) {
    let k = step.rise_n / step.sunk_m;
    let of_force = 0.5 * (step.load.interval_n.1 - step.load.interval_n.0) / step.load.force_n;
    let part = of_force.hypot(1.96 * step.sunk_sigma_m / step.sunk_m);
    ((k * (1.0 - part)).max(0.0), k * (1.0 + part))
}

fn device<E: Error>(error: E) -> PalpateError<E> {
    let kind = error.kind();
    PalpateError::Device(error, kind)
}

fn open<R>(rig: &mut R, programme: &Programme, stretch_m: f64) -> Result<(), PalpateError<R::Error>>
where
    R: DepthCamera + Gripper + Arm,
{
    rig.open_to(programme.sheet_length_m + stretch_m, programme.gripper_m_s).map_err(device)?;
    rest(rig, programme)
}

fn lower<R>(rig: &mut R, programme: &Programme, z_m: f64) -> Result<(), PalpateError<R::Error>>
where
    R: DepthCamera + Gripper + Arm,
{
    let [x, y, _] = programme.above.position_m;
    rig.move_to(Pose { position_m: [x, y, z_m], ..programme.above }, programme.move_s).map_err(device)?;
    rest(rig, programme)
}

/// Waits until arm and gripper stand still; the camera's pictures are the clock.
fn rest<R>(rig: &mut R, programme: &Programme) -> Result<(), PalpateError<R::Error>>
where
    R: DepthCamera + Gripper + Arm,
{
    for _ in 0..programme.patience_pictures.max(1) {
        if Arm::settled(rig).map_err(device)? && Gripper::settled(rig).map_err(device)? {
            return Ok(());
        }
        rig.depth_m().map_err(device)?;
    }
    Err(PalpateError::Restless { pictures: programme.patience_pictures })
}

/// The camera's side: the membrane's plane, and room that is used again.
#[derive(Default)]
struct Eyes {
    rest: Option<(Rest, Window)>,
    cloud: Cloud,
    segmenter: Segmenter,
}

impl Eyes {
    /// The plane of the free membrane.
    fn learn_rest<R>(
        &mut self,
        rig: &mut R,
        programme: &Programme,
        stretch_m: f64,
    ) -> Result<(), PalpateError<R::Error>>
    where
        R: DepthCamera,
    {
        let picture = rig.depth_m().map_err(device)?.value;
        let intrinsics = rig.intrinsics();
        // Roughly first: the middle of the picture shows the membrane.
        let middle = Window {
            row: picture.height() * 3 / 8,
            column: picture.width() * 3 / 8,
            rows: picture.height() / 4,
            columns: picture.width() / 4,
        };
        let rough = Rest::fit(&picture, &intrinsics, &middle).map_err(PalpateError::Cloud)?;
        let size = (picture.width(), picture.height());
        let sheet = (programme.sheet_length_m + stretch_m, programme.sheet_breadth_m);
        let window = Window::of_membrane(size, &intrinsics, &rough, sheet, programme.margin_m)
            .map_err(PalpateError::Cloud)?;
        let rest = Rest::fit(&picture, &intrinsics, &window).map_err(PalpateError::Cloud)?;
        self.rest = Some((rest, window));
        Ok(())
    }

    fn look<R>(&mut self, rig: &mut R, programme: &Programme) -> Result<Look, PalpateError<R::Error>>
    where
        R: DepthCamera,
    {
        let (mut apexes, mut balls) = (Vec::new(), Vec::new());
        // A picture may show too little of the object; of so many more one will do.
        for taken in 1..=4 * programme.pictures {
            let picture = rig.depth_m().map_err(device)?.value;
            let Some((rest, window)) = self.rest else { continue };
            self.cloud
                .fill(&picture, &rig.intrinsics(), &rest, window, &programme.cloud)
                .map_err(PalpateError::Cloud)?;
            let states = self.segmenter.segment(&self.cloud, &programme.segment);
            match cap(&self.cloud, states) {
                Ok(touching) => {
                    apexes.push(rest.distance_m - (touching.centre_m[2] - touching.radius_m));
                    balls.push(touching);
                }
                Err(ContactError::Flat { .. }) if taken < 4 * programme.pictures || !balls.is_empty() => {}
                Err(e) => return Err(PalpateError::Contact(e)),
            }
            if balls.len() == programme.pictures {
                break;
            }
        }
        let n = apexes.len() as f64;
        let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / n;
        let apex_m = mean(&mut apexes.iter().copied());
        let radius_m = mean(&mut balls.iter().map(|b: &Ball| b.radius_m));
        let about = |values: &mut dyn Iterator<Item = f64>, middle: f64| {
            (values.map(|v| (v - middle).powi(2)).sum::<f64>() / (n - 1.0).max(1.0) / n).sqrt()
        };
        // Smoothing correlates neighbours, which the scatter of one picture does not show; a twentieth of a millimetre is the floor.
        let apex_sigma_m = about(&mut apexes.iter().copied(), apex_m).max(5e-5);
        let scatter = about(&mut balls.iter().map(|b| b.radius_m), radius_m);
        let of_one = balls.iter().map(|b| b.radius_sigma_m).fold(0.0, f64::max);
        Ok(Look {
            apex_m,
            apex_sigma_m,
            radius: MeasuredLength { value_m: radius_m, sigma_m: scatter.max(of_one) },
        })
    }
}
