//! Grains on a fake rig, and pictures of them as SVG.

use std::fmt::{Error, Write};

use granular_infer::campaign::Grains;
use granular_infer::fake::FakeRig;
use granular_infer::seeing::HeightMap;
use granular_infer::tasks::Ring;
use hw_traits::arm::{Arm as _, Pose};
use hw_traits::camera::DepthCamera as _;
use hw_traits::clock::Clock as _;
use hw_traits::gripper::Gripper as _;

/// Pixels a panel is wide and high.
pub const PANEL: f64 = 320.0;

/// Carries the funnel to a place (m, its outlet), pours it out and waits.
///
/// # Errors
/// The rig's, for a place that it cannot reach.
pub fn pour(rig: &mut FakeRig, position_m: [f64; 3]) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    rig.move_to(Pose { position_m, rotation_xyzw: [0.0, 0.0, 0.0, 1.0] }, 2.0)?;
    rig.sleep_s(2.1)?;
    rig.refill()?;
    let (_, open) = rig.limits_m();
    rig.open_to(open, 0.1)?;
    Ok(rig.sleep_s(2.0)?)
}

/// A picture of the rig's camera as heights.
///
/// # Errors
/// Those of a picture that shows no grains on a ground.
pub fn look(rig: &mut FakeRig) -> Result<HeightMap, Box<dyn std::error::Error + Send + Sync>> {
    let picture = rig.depth_m()?.value;
    let depths: Vec<f64> = picture.data().iter().map(|d| f64::from(*d)).collect();
    Ok(HeightMap::from_depths(&rig.view().camera, &depths, 1e-6)?)
}

/// Begins a picture of so many panels in a row, and rows of them.
pub fn begin(columns: usize, rows: usize) -> String {
    let (width, height) = (columns as f64 * PANEL, rows as f64 * PANEL);
    format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {width} {height}' font-family='sans-serif' font-size='12'>\
         <defs><radialGradient id='g' cx='0.38' cy='0.32' r='0.75'><stop offset='0' stop-color='#fff3d6'/>\
         <stop offset='0.6' stop-color='#dfb56c'/><stop offset='1' stop-color='#7d5a24'/></radialGradient></defs>\
         <rect width='{width}' height='{height}' fill='white'/>\n"
    )
}

/// Opens a panel with a title; close it with `</g>`.
///
/// # Errors
/// None; writing into a string does not fail.
pub fn panel(svg: &mut String, column: usize, row: usize, title: &str) -> Result<(), Error> {
    let (x, y) = (column as f64 * PANEL, row as f64 * PANEL);
    write!(svg, "<g transform='translate({x},{y})'><text x='10' y='18'>{title}</text>")
}

/// Grains on dark cloth from the side and above (35 degrees), the far ones first, those within `extent_m` of the axis.
///
/// # Errors
/// As [`panel`].
pub fn heap(svg: &mut String, grains: &Grains, extent_m: f64) -> Result<(), Error> {
    let (sine, cosine) = 35.0_f64.to_radians().sin_cos();
    let scale = 0.46 * PANEL / extent_m;
    write!(svg, "<rect x='4' y='26' width='312' height='288' fill='#23212b'/>")?;
    let inside = |p: &&[f64; 3]| p[0].abs() < extent_m && p[1].abs() < extent_m && p[2] < extent_m;
    let mut order: Vec<(&[f64; 3], &f64)> =
        grains.positions_m.iter().zip(&grains.radii_m).filter(|(p, _)| inside(p)).collect();
    let depth = |p: &[f64; 3]| p[1] * cosine - p[2] * sine;
    order.sort_by(|a, b| depth(b.0).total_cmp(&depth(a.0)));
    for (p, r) in order {
        let (x, y) = (0.5 * PANEL + scale * p[0], 0.58 * PANEL - scale * (p[1] * sine + p[2] * cosine));
        write!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='{:.1}' fill='url(#g)'/>", scale * r)?;
    }
    svg.push_str("</g>\n");
    Ok(())
}

/// Heights above the ground in the middle `part` of a picture (at most 1), two by two pixels each, white at `most_m`.
///
/// # Errors
/// As [`panel`].
pub fn height_map(svg: &mut String, map: &HeightMap, most_m: f64, part: f64) -> Result<(), Error> {
    let [width, height] = map.size_px;
    let [left, top] = [width, height].map(|side| (0.5 * (1.0 - part) * side as f64) as usize);
    let size = 288.0 / (part * width.max(height) as f64);
    write!(svg, "<rect x='16' y='26' width='288' height='288' fill='black'/>")?;
    for v in (top..height - top - 1).step_by(2) {
        for u in (left..width - left - 1).step_by(2) {
            let z = map.heights_m[v * width + u];
            let share = (z / most_m).clamp(0.0, 1.0);
            // Noise of the cloth stays black.
            if share > 0.06 {
                let (x, y) = (16.0 + size * (u - left) as f64, 26.0 + size * (v - top) as f64);
                let (hue, light) = (260.0 - 220.0 * share, 20.0 + 60.0 * share);
                write!(
                    svg,
                    "<rect x='{x:.1}' y='{y:.1}' width='{0:.1}' height='{0:.1}' fill='hsl({hue:.0},80%,{light:.0}%)'/>",
                    2.0 * size
                )?;
            }
        }
    }
    svg.push_str("</g>\n");
    Ok(())
}

/// Draws of two parameters within their bounds, the truth as a cross; `names` of both axes.
///
/// # Errors
/// As [`panel`].
pub fn scatter(
    svg: &mut String,
    draws: &[[f64; 2]],
    truth: [f64; 2],
    bounds: [[f64; 2]; 2],
    names: [&str; 2],
) -> Result<(), Error> {
    let at = |p: [f64; 2]| {
        let share = |k: usize| (p[k] - bounds[k][0]) / (bounds[k][1] - bounds[k][0]);
        (40.0 + 260.0 * share(0), 290.0 - 250.0 * share(1))
    };
    write!(svg, "<path d='M40,40 V290 H300' fill='none' stroke='black'/>")?;
    for (k, (x, y)) in [(0, (150.0, 314.0)), (1, (8.0, 34.0))] {
        let [low, high] = bounds[k];
        write!(svg, "<text x='{x}' y='{y}'>{}: {low:.2} to {high:.2}</text>", names[k])?;
    }
    for draw in draws {
        let (x, y) = at(*draw);
        write!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='1.6' fill='#3366aa' fill-opacity='0.35'/>")?;
    }
    let (x, y) = at(truth);
    write!(
        svg,
        "<path d='M{:.1},{y:.1} h16 M{x:.1},{:.1} v16' stroke='red' stroke-width='2.5'/></g>",
        x - 8.0,
        y - 8.0
    )?;
    Ok(())
}

/// Grains from above, and at each place the wanted ring (green) and the one that was poured (red, dashed).
///
/// # Errors
/// As [`panel`].
pub fn rings(
    svg: &mut String,
    grains: &Grains,
    places: &[([f64; 2], Ring, Ring)],
    extent_m: f64,
) -> Result<(), Error> {
    let scale = 144.0 / extent_m;
    let at = |p: [f64; 2]| (160.0 + scale * p[0], 170.0 - scale * p[1]);
    write!(svg, "<rect x='16' y='26' width='288' height='288' fill='#23212b'/>")?;
    for (p, r) in grains.positions_m.iter().zip(&grains.radii_m) {
        if p[0].abs() < extent_m && p[1].abs() < extent_m {
            let (x, y) = at([p[0], p[1]]);
            write!(svg, "<circle cx='{x:.1}' cy='{y:.1}' r='{:.2}' fill='url(#g)'/>", scale * r)?;
        }
    }
    for (place, wanted, got) in places {
        let (x, y) = at(*place);
        for (ring, style) in [(wanted, "stroke='#33dd55'"), (got, "stroke='#ff4444' stroke-dasharray='5 4'")]
        {
            for radius in [ring.inner_m, ring.outer_m] {
                write!(
                    svg,
                    "<circle cx='{x:.1}' cy='{y:.1}' r='{:.1}' fill='none' stroke-width='2' {style}/>",
                    scale * radius
                )?;
            }
        }
    }
    svg.push_str("</g>\n");
    Ok(())
}
