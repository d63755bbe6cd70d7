//! Figures 6.6 and 6.8: objects put together from touches, and a cookie.

use examples::plot::{Panel, hue};
use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::gripper::Gripper;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rayon::prelude::*;
use stretch::contact::points;
use stretch::fake::{Filling, Lump, Rig, Shape};
use stretch::reconstruct::Merged;
use stretch::segment::State;
use stretch::shape::{Rolling, Settling, circularity, roll};

use super::{Outcome, at, look};

/// An object that is touched.
struct Object {
    name: &'static str,
    shape: Shape,
    filling: Filling,
    /// The least and the largest x and y of it, m.
    extent_m: [[f64; 2]; 2],
    /// Where it is touched: along x, and how far below its highest point (m).
    touches: Vec<[f64; 2]>,
    /// What it is turned by before each round of touches, about an axis along y so far (m) below its highest point.
    turns: (f64, Vec<f64>),
}

impl Object {
    fn new(name: &'static str, shape: Shape, extent_m: [[f64; 2]; 2], touches: &[[f64; 2]]) -> Self {
        let (touches, turns) = (touches.to_vec(), (0.0, vec![0.0]));
        Self { name, shape, filling: Filling::Rigid, extent_m, touches, turns }
    }

    /// Of folded paper, whose top sinks by the force over a stiffness.
    fn of_paper(self) -> Self {
        Self { filling: Filling::Springy(PAPER_N_M), ..self }
    }

    /// Touched from so many sides about an axis so far (m) below its highest point.
    fn touched_round(self, sides: u32, axis_m: f64) -> Self {
        let angle = |k: u32| std::f64::consts::TAU * f64::from(k) / f64::from(sides);
        Self { turns: (axis_m, (0..sides).map(angle).collect()), ..self }
    }
}

/// Stiffness of a box of folded paper from above, N/m: 3 mm for half a newton.
const PAPER_N_M: f64 = 160.0;

/// The ten of figure 6.6, a standing cylinder and a ball; a bridge is a bar here.
fn objects() -> Vec<Object> {
    let one = &[[0.0, 0.008]];
    let three = &[[-0.016, 0.008], [0.0, 0.008], [0.016, 0.008]];
    let cube = |name| Object::new(name, Shape::Box { half_m: [0.015, 0.015] }, [[-0.015, 0.015]; 2], one);
    let half_cylinder = |name| {
        let shape = Shape::Ridge { radius_m: 0.012, half_length_m: 0.03 };
        Object::new(name, shape, [[-0.03, 0.03], [-0.012, 0.012]], three)
    };
    let (circle_m, corner_m, wire_m) = (0.02, 0.025, 0.002);
    // A side of the triangle, and how far it is from the middle.
    let (half_side_m, to_side_m) = (0.5 * 3f64.sqrt() * corner_m, 0.5 * corner_m);
    let upright = |half_m: f64| [[-half_m, half_m], [-wire_m, wire_m]];
    vec![
        cube("cube"),
        Object::new("cylinder", Shape::Cylinder { radius_m: 0.015 }, [[-0.015, 0.015]; 2], one),
        Object::new("ball", Shape::Ball { radius_m: 0.02 }, [[-0.02, 0.02]; 2], &[[0.0, 0.012]]),
        Object::new(
            "prism",
            Shape::Prism { half_m: 0.015, height_m: 0.015, half_length_m: 0.03 },
            [[-0.03, 0.03], [-0.015, 0.015]],
            three,
        ),
        half_cylinder("half-cylinder"),
        Object::new("bridge", Shape::Box { half_m: [0.03, 0.01] }, [[-0.03, 0.03], [-0.01, 0.01]], three),
        Object::new(
            "snowman",
            Shape::Snowman { radii_m: [0.015, 0.0135, 0.012] },
            [[-0.015, 0.066], [-0.015, 0.015]],
            &[[0.0, 0.008], [0.0285, 0.011], [0.054, 0.014]],
        ),
        cube("paper cube").of_paper(),
        half_cylinder("paper half-cyl.").of_paper(),
        Object::new(
            "paper pyramid",
            Shape::Pyramid { half_m: 0.02, height_m: 0.02 },
            [[-0.02, 0.02]; 2],
            &[[0.0, 0.012]],
        )
        .of_paper(),
        Object::new("circle, lying", Shape::Hoop { radius_m: circle_m, wire_m }, [[-0.022, 0.022]; 2], one),
        Object::new("circle, upright", Shape::Rim { radius_m: circle_m, wire_m }, upright(0.022), one)
            .touched_round(6, circle_m + wire_m),
        Object::new(
            "triangle, lying",
            Shape::Triangle { radius_m: corner_m, wire_m },
            [[-0.015, 0.027], [-0.024, 0.024]],
            one,
        ),
        Object::new(
            "triangle, upright",
            Shape::Ridge { radius_m: wire_m, half_length_m: half_side_m },
            upright(half_side_m),
            one,
        )
        .touched_round(3, to_side_m + wire_m),
    ]
}

/// Figure 6.6: touches at no stretch, merged in the frame of the object.
pub(crate) fn reconstructed(panels: &mut Vec<Panel>) -> Outcome<()> {
    println!(
        "\nObjects from touches at no stretch (figure 6.6; [Matl 2021]: dimensions within 2 mm, of paper 3 mm)"
    );
    println!(
        "{:>18} {:>8} {:>8} {:>24} {:>10}",
        "", "touches", "points", "off the surface: median", "95 % (mm)"
    );
    let objects = objects();
    let objects = if examples::small() { &objects[..1] } else { &objects[..] };
    for object in objects {
        let mut merged = Merged::new(1.5e-3)?;
        let (axis_m, turns) = &object.turns;
        let mut surface_m = Vec::new();
        for (side, &turn) in turns.iter().enumerate() {
            let turned = about(turn, *axis_m);
            for (k, &[x, below]) in object.touches.iter().enumerate() {
                let mut rig = Rig::new(object.shape, object.filling, 660 + (3 * side + k) as u64);
                let (cloud, segmenter) = look(&mut rig, 0.0, at(x, -below))?;
                // The camera looks down on the membrane: its rows go against the world's y.
                let camera = Isometry3::from_parts(
                    Translation3::new(x, 0.0, rig.eye.distance_m - below),
                    UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI),
                );
                merged.add(&pose(&(turned * camera)), &points(&cloud, &segmenter.states))?;
            }
            let upper = surface(&object.shape, object.extent_m);
            surface_m.extend(
                upper.iter().map(|p| -> [f64; 3] { turned.transform_point(&(*p).into()).coords.into() }),
            );
        }
        let seen = merged.points(3);
        let mut off: Vec<f64> = seen.iter().map(|p| nearest_m(&surface_m, p)).collect();
        off.sort_by(f64::total_cmp);
        let share = |part: usize| off.get(off.len() * part / 100).map_or(f64::NAN, |d| 1e3 * d);
        println!(
            "{:>18} {:>8} {:>8} {:>24.2} {:>10.2}",
            object.name,
            turns.len() * object.touches.len(),
            seen.len(),
            share(50),
            share(95)
        );
        panels.push(if turns.len() > 1 {
            from_side(object.name, &seen, &surface_m)
        } else {
            heights(object.name, &seen, object.extent_m)
        });
    }
    Ok(())
}

/// A turn (rad) about an axis along y, so far (m) below the origin.
fn about(turn: f64, axis_m: f64) -> Isometry3<f64> {
    let below = Translation3::new(0.0, 0.0, -axis_m);
    below * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn) * below.inverse()
}

fn pose(of: &Isometry3<f64>) -> Pose {
    Pose { position_m: of.translation.vector.into(), rotation_xyzw: of.rotation.coords.into() }
}

/// What stands upright from the side: points that were felt over those of its surface.
fn from_side(name: &str, seen: &[[f64; 3]], surface_m: &[[f64; 3]]) -> Panel {
    let of = |points: &[[f64; 3]]| points.iter().map(|p| [1e3 * p[0], 1e3 * p[2]]).collect::<Vec<_>>();
    let step = 1 + surface_m.len() / 2000;
    let mut panel = Panel::new(format!("6.6: {name}"), "x (mm)", "z (mm)").map();
    for [x, z] in of(&surface_m.iter().step_by(step).copied().collect::<Vec<_>>()) {
        panel.cell([x, z], [0.6, 0.6], "lightgrey");
    }
    for [x, z] in of(seen) {
        panel.cell([x, z], [0.8, 0.8], "firebrick");
    }
    panel
}

/// Points of an object's upper side every half millimetre, m.
fn surface(shape: &Shape, [along_x, along_y]: [[f64; 2]; 2]) -> Vec<[f64; 3]> {
    let steps =
        |[from, to]: [f64; 2]| (0..=(2e3 * (to - from)) as usize).map(move |k| 5e-4 * k as f64 + from);
    let at = |x: f64, y: f64| shape.height_m(x, y).map(|z| [x, y, z]);
    steps(along_x).flat_map(|x| steps(along_y).filter_map(move |y| at(x, y)).collect::<Vec<_>>()).collect()
}

/// Distance from the nearest of some points, m.
fn nearest_m(points: &[[f64; 3]], to: &[f64; 3]) -> f64 {
    let square = |p: &[f64; 3]| (0..3).map(|k| (p[k] - to[k]).powi(2)).sum::<f64>();
    points.iter().map(square).fold(f64::INFINITY, f64::min).sqrt()
}

/// A map of heights with the object's outline.
fn heights(name: &str, seen: &[[f64; 3]], extent_m: [[f64; 2]; 2]) -> Panel {
    let mut panel =
        Panel::new(format!("6.6: {name}"), "x (mm)", "y (mm), colour: height, blue 0, red -5 mm").map();
    for p in seen {
        let level = (10.0 + 2e3 * p[2]).clamp(0.0, 10.0) as usize;
        panel.cell([1e3 * p[0], 1e3 * p[1]], [1.5, 1.5], &hue(10 - level, 11));
    }
    let [[left, right], [down, up]] = extent_m.map(|along| along.map(|m| 1e3 * m));
    panel.line([[left, down], [right, down], [right, up], [left, up], [left, down]], "black");
    panel
}

/// What became of a lump of dough.
struct Cookie {
    heights_mm: Vec<f64>,
    settled: bool,
    roundness: f64,
    mask: (Vec<bool>, usize),
}

/// Side of the cube of dough, m.
const SIDE_M: f64 = 0.02;

/// Figure 6.8: a cube of dough rolled in circles until its height settles, then pressed flat; and one that is only pressed.
pub(crate) fn cookies(panels: &mut Vec<Panel>) -> Outcome<()> {
    println!(
        "\nCookies from a cube of 20 mm (figure 6.8; [Matl 2021]: circularity 0.888 on average, a square 0.785)"
    );
    println!("{:>10} {:>8} {:>8} {:>18} {:>12}", "", "circles", "settled", "height (mm)", "circularity");
    let ways = [("rolled", true), ("not rolled", false)];
    let ways = if examples::small() { &ways[..1] } else { &ways[..] };
    let cookies: Vec<Cookie> = ways.par_iter().map(|(_, rolls)| cookie(*rolls)).collect::<Outcome<_>>()?;
    let mut heights = Panel::new("6.8: height while rolled (mm)", "circle", "");
    for ((name, rolls), cookie) in ways.iter().zip(&cookies) {
        let [first, last] =
            [cookie.heights_mm.first(), cookie.heights_mm.last()].map(|h| h.copied().unwrap_or(f64::NAN));
        let words = if *rolls { format!("{first:.1} to {last:.1}") } else { "-".into() };
        println!(
            "{name:>10} {:>8} {:>8} {words:>18} {:>12.3}",
            cookie.heights_mm.len(),
            cookie.settled,
            cookie.roundness
        );
        if *rolls {
            let line: Vec<[f64; 2]> =
                cookie.heights_mm.iter().enumerate().map(|(k, h)| [k as f64 + 1.0, *h]).collect();
            heights.line(line.clone(), "steelblue").dots(line, "steelblue");
        }
    }
    panels.push(heights);
    for ((name, _), cookie) in ways.iter().zip(cookies) {
        let (mask, columns) = cookie.mask;
        let title = format!("6.8: {name}, circularity {:.2}", cookie.roundness);
        let mut panel = Panel::new(title, "column (px)", "row (px)").map();
        for k in (0..mask.len()).filter(|k| mask[*k]) {
            panel.cell([(k % columns) as f64, (k / columns) as f64], [1.0, 1.0], "peru");
        }
        panels.push(panel);
    }
    Ok(())
}

fn cookie(rolls: bool) -> Outcome<Cookie> {
    let lump = Lump::cube(SIDE_M);
    let mut rig = Rig::new(Shape::Lump(lump), Filling::Dough(0.15, 1.2), 68);
    rig.top_m = [0.0, 0.0, lump.height_m()];
    let (mut heights_mm, mut settled) = (Vec::new(), !rolls);
    if rolls {
        // Medium firmness; half a circle's way to each side.
        rig.open_to(0.13, 0.05)?;
        let rolling =
            Rolling { middle: at(0.0, SIDE_M - 6e-3), circle_m: 8e-3, moves: 6, move_s: 0.17, most: 60 };
        let height = |rig: &mut Rig| top_m(rig);
        let done = roll(&mut rig, &rolling, Settling::matl_2021(), height).map_err(|e| e.to_string())?;
        settled = done.settled;
        heights_mm = done.heights_m.iter().map(|h| 1e3 * h).collect();
    }
    // The highest stiffness, from above.
    rig.move_to(at(0.0, 0.08), 1.0)?;
    rig.open_to(0.18, 0.05)?;
    let start = rig.top_m[2];
    for k in 1..=12 {
        rig.move_to(at(0.0, start - 2e-3 * f64::from(k)), 1.0)?;
    }
    let flat = at(0.0, rig.top_m[2] - 6e-3);
    let (cloud, segmenter) = look(&mut rig, 0.0, flat)?;
    let mask: Vec<bool> = segmenter.states.iter().map(|s| *s == State::Contact).collect();
    let roundness = circularity(&mask, cloud.columns())?;
    Ok(Cookie { heights_mm, settled, roundness, mask: (mask, cloud.columns()) })
}

/// Height of the dough's top over the table, m: the membrane's highest part, by the arm.
fn top_m(rig: &mut Rig) -> Result<f64, stretch::fake::FakeError> {
    let tool = rig.pose()?.value.position_m[2];
    let picture = rig.depth_m()?.value;
    let mut near: Vec<f32> = picture.data().iter().copied().filter(|z| z.is_finite()).collect();
    near.sort_by(f32::total_cmp);
    let part = near.get(near.len() / 200).map_or(f64::NAN, |z| f64::from(*z));
    Ok(tool + rig.eye.distance_m - part)
}
