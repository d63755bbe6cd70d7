//! Figures 6.6 and 6.8: objects put together from touches, and a cookie.

use examples::plot::{Panel, hue};
use hw_traits::arm::{Arm, Pose};
use hw_traits::camera::DepthCamera;
use hw_traits::gripper::Gripper;
use rayon::prelude::*;
use stretch::contact::points;
use stretch::fake::{Filling, Lump, Rig, Shape};
use stretch::reconstruct::Merged;
use stretch::segment::State;
use stretch::shape::{Rolling, Settling, circularity, roll};

use super::{Outcome, at, look};

/// Objects: what they are, half their sides along x and y (m), and where they are touched along x (m).
const OBJECTS: [(&str, Shape, [f64; 2], &[f64]); 3] = [
    ("cube, 1 touch", Shape::Box { half_m: [0.015, 0.015] }, [0.015, 0.015], &[0.0]),
    (
        "half-cylinder, 3",
        Shape::Ridge { radius_m: 0.012, half_length_m: 0.03 },
        [0.03, 0.012],
        &[-0.016, 0.0, 0.016],
    ),
    ("bridge, 3", Shape::Box { half_m: [0.03, 0.01] }, [0.03, 0.01], &[-0.016, 0.0, 0.016]),
];

/// Figure 6.6: touches at no stretch, merged in the world.
pub(crate) fn reconstructed(panels: &mut Vec<Panel>) -> Outcome<()> {
    println!("\nObjects from touches at no stretch (figure 6.6; the thesis: within 2 mm)");
    println!("{:>18} {:>15} {:>15} {:>12}", "", "length (mm)", "breadth (mm)", "top (mm)");
    for (name, shape, half_m, places) in OBJECTS {
        let mut merged = Merged::new(1e-3)?;
        for (k, &x) in places.iter().enumerate() {
            let mut rig = Rig::new(shape, Filling::Rigid, 660 + k as u64);
            let (cloud, segmenter) = look(&mut rig, 0.0, at(x, -8e-3))?;
            // The camera looks down on the membrane: its rows go against the world's y.
            let z = rig.eye.distance_m - 8e-3;
            let camera = Pose { position_m: [x, 0.0, z], rotation_xyzw: [1.0, 0.0, 0.0, 0.0] };
            merged.add(&camera, &points(&cloud, &segmenter.states))?;
        }
        let seen = merged.points(3);
        let spread = |axis: usize| {
            let mut v: Vec<f64> = seen.iter().map(|p| p[axis]).collect();
            v.sort_by(f64::total_cmp);
            v.get(v.len() * 99 / 100).zip(v.get(v.len() / 100)).map_or(f64::NAN, |(high, low)| high - low)
        };
        let mut heights: Vec<f64> = seen.iter().map(|p| p[2]).collect();
        heights.sort_by(f64::total_cmp);
        let top = heights.get(heights.len() * 9 / 10).copied().unwrap_or(f64::NAN);
        let cell = |k: usize| format!("{:.1} of {:.0}", 1e3 * spread(k), 2e3 * half_m[k]);
        println!("{name:>18} {:>15} {:>15} {:>12.2}", cell(0), cell(1), 1e3 * top);
        let mut panel = Panel::new(format!("6.6: {name}"), "x (mm)", "y (mm), colour: height").map();
        let low = heights.first().copied().unwrap_or(0.0);
        for p in &seen {
            let level = ((p[2] - low) / (top - low).max(1e-9) * 10.0).clamp(0.0, 10.0) as usize;
            panel.cell([1e3 * p[0], 1e3 * p[1]], [1.0, 1.0], &hue(level, 11));
        }
        let [a, b] = half_m.map(|h| 1e3 * h);
        panel.line([[-a, -b], [a, -b], [a, b], [-a, b], [-a, -b]], "black");
        panels.push(panel);
    }
    Ok(())
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
    println!("\nCookies from a cube of 20 mm (figure 6.8; the thesis: circularity 0.888 on average, a square 0.785)");
    println!("{:>10} {:>8} {:>8} {:>18} {:>12}", "", "circles", "settled", "height (mm)", "circularity");
    let ways = [("rolled", true), ("not rolled", false)];
    let cookies: Vec<Cookie> = ways.par_iter().map(|(_, rolls)| cookie(*rolls)).collect::<Outcome<_>>()?;
    let mut heights = Panel::new("6.8: height while rolled (mm)", "circle", "");
    for ((name, rolls), cookie) in ways.iter().zip(&cookies) {
        let [first, last] = [cookie.heights_mm.first(), cookie.heights_mm.last()].map(|h| h.copied().unwrap_or(f64::NAN));
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
            Rolling { middle: at(0.0, SIDE_M - 6e-3), circle_m: 8e-3, moves: (6, 0.17), most: 60 };
        let height = |rig: &mut Rig| top_m(rig);
        let done = roll(&mut rig, &rolling, Settling::thesis(), height).map_err(|e| e.to_string())?;
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
