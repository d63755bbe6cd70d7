//! What the files of a recording say: the rig, the camera, the pictures.

use std::f64::consts::PI;

use granular_infer::camera::Camera;
use granular_infer::campaign::Rig;
use granular_infer::seeing::HeightMap;

use crate::reading::{check_runs, number};
use crate::recording::{Column, Header, NamedFile, ReadError, Table, one_line, quoted};

pub(super) const COLUMNS: [Column; 3] = [
    Column { name: "run", what: "label of the run", label: true },
    number("funnel_height_m", "height of the funnel's outlet in metres"),
    Column { name: "depth_image", what: "name of a 16-bit PNG file", label: true },
];

/// A pour and its picture.
#[derive(Debug, Clone)]
pub(super) struct Picture {
    pub(super) label: String,
    pub(super) height_m: f64,
    pub(super) map: HeightMap,
}

/// What a recording says.
#[derive(Debug)]
pub(super) struct Read {
    pub(super) rig: Rig,
    /// The camera of all pictures.
    pub(super) camera: Camera,
    pub(super) pictures: Vec<Picture>,
}

impl Read {
    /// The lowest and the highest place of the funnel, m.
    pub(super) fn heights_m(&self) -> [f64; 2] {
        let heights = self.pictures.iter().map(|p| p.height_m);
        [heights.clone().fold(f64::INFINITY, f64::min), heights.fold(0.0, f64::max)]
    }
}

/// Reads a recording.
///
/// # Errors
/// [`ReadError`].
pub(super) fn read(header: &Header) -> Result<Read, ReadError> {
    header.section("noise")?.number("depth_m", f64::MIN_POSITIVE, 1.0)?;
    let rig = rig(header)?;
    let section = header.section("camera")?;
    let mut camera = Camera {
        focal_px: [section.required("fx_px", 1.0, 1e6)?, section.required("fy_px", 1.0, 1e6)?],
        centre_px: [section.required("cx_px", -1e6, 1e6)?, section.required("cy_px", -1e6, 1e6)?],
        height_m: section.required("height_m", 1e-3, 1e3)?,
        depth_unit_m: section.required("depth_unit_m", 1e-9, 1.0)?,
        size_px: [0, 0],
    };
    let table = header.table("data", &COLUMNS)?;
    let labels = table.labels("run", "the label of each row's run")?;
    let images = table.labels("depth_image", "the name of a 16-bit PNG file")?;
    let heights = table
        .numbers("funnel_height_m")
        .ok_or_else(|| table.missing("funnel_height_m", "height of the funnel's outlet in metres"))?;
    let mut pictures: Vec<Picture> = Vec::new();
    for (label, rows) in check_runs(&table, labels, 1, None)? {
        let row = rows[0];
        if let Some(&again) = rows.get(1) {
            return Err(text_cell(&table, again, "run", &label, "one row a run"));
        }
        if !(heights[row] > 0.0 && heights[row] < 10.0) {
            return Err(table.cell(row, "funnel_height_m", heights[row], "above 0 and below 10"));
        }
        let image = header.named_file(&table.file, "depth_image", &images[row])?;
        let (size, counts) = depth_image(&image)?;
        if camera.size_px == [0, 0] {
            camera.size_px = size;
        }
        let unfit = |why: String| ReadError::Open { file: image.file.clone(), why };
        if size != camera.size_px {
            let [w, h] = camera.size_px;
            let why = format!("{} x {} pixels, expected {w} x {h} as in the first picture", size[0], size[1]);
            return Err(unfit(why));
        }
        let volume_m3 = rig.count as f64 * PI / 6.0 * rig.diameter_m.powi(3);
        let map = HeightMap::new(&camera, &counts, volume_m3).map_err(|e| unfit(e.to_string()))?;
        pictures.push(Picture { label, height_m: heights[row], map });
    }
    Ok(Read { rig, camera, pictures })
}

fn text_cell(table: &Table, row: usize, column: &str, got: &str, expected: &str) -> ReadError {
    ReadError::Cell {
        file: table.file.clone(),
        row: table.lines[row],
        column: column.into(),
        got: quoted(got),
        expected: expected.into(),
    }
}

fn rig(header: &Header) -> Result<Rig, ReadError> {
    let section = header.section("rig")?;
    let funnel = section.section("funnel")?;
    let count = section.required("grain_count", 50.0, 5000.0)?;
    if count.fract() != 0.0 {
        return Err(section.unfit("grain_count", format!("{count}"), "a whole number"));
    }
    let rig = Rig {
        count: count as usize,
        diameter_m: section.required("grain_diameter_m", 1e-4, 0.1)?,
        mass_kg: section.required("grain_mass_kg", 1e-9, 1.0)?,
        outlet_radius_m: funnel.required("outlet_radius_m", 1e-4, 1.0)?,
        cone_half_angle_rad: funnel.required("cone_half_angle_rad", 0.05, 1.5)?,
        tube_radius_m: funnel.required("tube_radius_m", 1e-4, 1.0)?,
    };
    if rig.tube_radius_m <= rig.outlet_radius_m {
        let expected = format!("above {}, the outlet's", rig.outlet_radius_m);
        return Err(funnel.unfit("tube_radius_m", format!("{}", rig.tube_radius_m), expected));
    }
    if rig.outlet_radius_m < 1.5 * rig.diameter_m {
        let expected = format!("at least {}, 1.5 grain diameters: grains jam", 1.5 * rig.diameter_m);
        return Err(funnel.unfit("outlet_radius_m", format!("{}", rig.outlet_radius_m), expected));
    }
    let density = rig.density_kg_m3();
    if !(50.0..=25_000.0).contains(&density) {
        let expected = "a mass that fits the diameter: 50 to 25000 kg/m3";
        return Err(section.unfit(
            "grain_mass_kg",
            format!("{} ({density:.0} kg/m3)", rig.mass_kg),
            expected,
        ));
    }
    Ok(rig)
}

/// Size and counts of a 16-bit greyscale PNG.
///
/// # Errors
/// [`ReadError::Open`] for what is not one.
fn depth_image(image: &NamedFile) -> Result<([usize; 2], Vec<u16>), ReadError> {
    /// The largest picture in pixels.
    const MOST_PIXELS: usize = 1 << 24;
    let unfit = |why: String| ReadError::Open { file: image.file.clone(), why };
    let broken = |e: png::DecodingError| unfit(format!("not a sound PNG: {}", one_line(&e.to_string())));
    let mut reader = png::Decoder::new(std::io::Cursor::new(&image.bytes)).read_info().map_err(broken)?;
    let info = reader.info();
    if (info.bit_depth, info.color_type) != (png::BitDepth::Sixteen, png::ColorType::Grayscale) {
        let why = format!("{:?} bits, {:?}, expected 16-bit greyscale", info.bit_depth, info.color_type);
        return Err(unfit(why));
    }
    let size = [info.width as usize, info.height as usize];
    let pixels = size[0].saturating_mul(size[1]);
    if !(64..=MOST_PIXELS).contains(&pixels) {
        let why = format!("{} x {} pixels, expected 64 to {MOST_PIXELS} in all", size[0], size[1]);
        return Err(unfit(why));
    }
    let mut raw = vec![0; 2 * pixels];
    let frame = reader.next_frame(&mut raw).map_err(broken)?;
    let counts = raw[..frame.buffer_size().min(raw.len())].chunks_exact(2);
    Ok((size, counts.map(|b| u16::from_be_bytes([b[0], b[1]])).collect()))
}
