//! One small sound recording of every kind that is read, to be mutilated: by the test of that name, and by the targets in `fuzz`.

#![allow(unreachable_pub, reason = "the package `fuzz` takes this module in as well")]

pub mod fed;

use missing_physics_domains as domains;

/// A sound recording: its files.
type Files = Vec<(&'static str, Vec<u8>)>;

/// Header, data, and the name and bytes of a file beside them.
type Made = (String, String, &'static str, Vec<u8>);

/// A kind of recording: its name, its files, which of them are mutilated, and whether it is diagnosed where it is read.
pub struct Kind {
    pub name: &'static str,
    pub files: Files,
    pub victims: &'static [usize],
    pub diagnosed: bool,
}

const ALL: &[usize] = &[0, 1];
const LAST: &[usize] = &[2];

pub fn kinds() -> Vec<Kind> {
    let mut kinds: Vec<Kind> = domains::all()
        .iter()
        .map(|domain| {
            let template = domain.template();
            let (data, text) = template.data;
            let files = vec![("recording.toml", template.header.into()), (data, text.into())];
            // A heap is diagnosed by a campaign of minutes.
            Kind { name: domain.id(), files, victims: ALL, diagnosed: domain.id() != "grain-pour" }
        })
        .collect();
    let heap = (PILE.into(), "run,funnel_height_m,depth_image\n1,0.06,a.png\n".into(), "a.png", heap());
    let mesh = |file: &'static str, bytes| {
        let shape = format!("shape = \"mesh\", file = \"{file}\"");
        (BOTTLE.replace("SHAPE", &shape), SWEEP.to_owned(), file, bytes)
    };
    let sound = "format = 1\ndomain = \"bounce\"\n[audio]\nfiles = [\"a.wav\"]\n".to_owned();
    let line = (0..12).map(|i| format!("a,{i},{i}.1\n")).collect::<String>();
    let program = (PROGRAM.to_owned(), format!("run,t_s,y_m\n{line}"), "answers.jsonl", answers());
    let of_files: [(&'static str, bool, Made); 5] = [
        ("png", false, heap),
        ("stl", true, mesh("a.stl", stl())),
        ("obj", true, mesh("a.obj", obj())),
        ("wav", true, (sound, String::new(), "a.wav", wav())),
        ("json-lines", true, program),
    ];
    kinds.extend(of_files.map(|(name, diagnosed, (header, data, file, bytes))| Kind {
        name,
        files: vec![("recording.toml", header.into()), ("data.csv", data.into()), (file, bytes)],
        victims: LAST,
        diagnosed,
    }));
    kinds
}

const PILE: &str = "format = 1\ndomain = \"grain-pour\"\ndata = \"data.csv\"\n[camera]\nfx_px = 50\nfy_px = 50\ncx_px = 19.5\n\
    cy_px = 19.5\nheight_m = 0.35\ndepth_unit_m = 0.0001\n[rig]\ngrain_diameter_m = 0.004\ngrain_mass_kg = 4.356e-5\n\
    grain_count = 1000\nfunnel = { outlet_radius_m = 0.014, cone_half_angle_rad = 0.7854, tube_radius_m = 0.04 }\n";
const BOTTLE: &str = "format = 1\ndomain = \"liquid-tilt\"\ndata = \"data.csv\"\n[rig]\ncontainer = { SHAPE }\n\
    container_mass_kg = 0.0663\ngripper_mass_kg = 0.583\ngrasp_height_m = 0.083\n";
const SWEEP: &str = "run,theta_rad,fx_n,fy_n,tau_z_nm\n1,0.0,0.01,-7.33,0.0\n1,0.2,-0.02,-7.28,-0.0007\n1,0.4,0.0,-7.34,-0.003\n\
    1,0.6,0.01,-7.32,-0.006\n1,0.8,0.0,-7.31,-0.01\n1,1.0,0.0,-7.33,-0.02\n";
const PROGRAM: &str = "format = 1\ndomain = \"custom\"\ndata = \"data.csv\"\n[[input]]\nname = \"t_s\"\nunit = \"s\"\n[[channel]]\n\
    name = \"y_m\"\nunit = \"m\"\n[[parameter]]\nname = \"slope\"\nstart = 1.0\nscale = 0.1\n[simulator]\n\
    command = [\"cat\", \"answers.jsonl\"]\ntimeout_s = 0.2\n";

fn answers() -> Vec<u8> {
    let values: Vec<String> = (0..12).map(|i| format!("{i}.0")).collect();
    let line = |id: usize| format!("{{\"id\": {id}, \"channels\": {{\"y_m\": [{}]}}}}\n", values.join(", "));
    (1..40).map(line).collect::<String>().into_bytes()
}

/// A cone of about the volume of a thousand grains, from above.
fn heap() -> Vec<u8> {
    let depth = |at: usize| {
        let [u, v] = [at % 40, at / 40].map(|p| (p as f64 - 19.5) * 0.35 / 50.0);
        let height = 0.03 * (1.0 - u.hypot(v) / 0.034).max(0.0);
        ((0.35 - height) / 1e-4).round() as u16
    };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 40, 40);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let data: Vec<u8> = (0..1600).flat_map(|at| depth(at).to_be_bytes()).collect();
    encoder.write_header().unwrap().write_image_data(&data).unwrap();
    bytes
}

/// Corners of a twelve-sided bottle, and its triangles.
fn prism() -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    const SIDES: usize = 12;
    let mut corners = vec![[0.0; 3], [0.0, 0.0, 0.166]];
    for z in [0.0, 0.166] {
        corners.extend((0..SIDES).map(|k| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / SIDES as f64).sin_cos();
            [0.0355 * cos, 0.0355 * sin, z]
        }));
    }
    let mut faces = Vec::new();
    for k in 0..SIDES {
        let (a, b) = (2 + k, 2 + (k + 1) % SIDES);
        faces.extend([[0, b, a], [1, a + SIDES, b + SIDES], [a, b, b + SIDES], [a, b + SIDES, a + SIDES]]);
    }
    (corners, faces)
}

fn stl() -> Vec<u8> {
    let (corners, faces) = prism();
    let mut bytes = vec![b' '; 80];
    bytes.extend((faces.len() as u32).to_le_bytes());
    for face in faces {
        let numbers = [[0.0; 3]].into_iter().chain(face.map(|c| corners[c])).flatten();
        numbers.for_each(|x| bytes.extend((x as f32).to_le_bytes()));
        bytes.extend([0, 0]);
    }
    bytes
}

fn obj() -> Vec<u8> {
    let (corners, faces) = prism();
    let mut text: String = corners.iter().map(|[x, y, z]| format!("v {x:.6} {y:.6} {z:.6}\n")).collect();
    text.extend(faces.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)));
    text.into_bytes()
}

/// One channel of 16 bits in which six impacts click.
fn wav() -> Vec<u8> {
    const RATE: u32 = 8000;
    let mut samples = vec![0_i16; 2 * RATE as usize];
    let (mut at, mut gap) = (0.1, 0.4);
    for _ in 0..6 {
        let from = (at * f64::from(RATE)) as usize;
        for (i, sample) in samples[from..].iter_mut().take(200).enumerate() {
            *sample += (9000.0 * (-(i as f64) / 30.0).exp() * (i as f64).sin()) as i16;
        }
        at += gap;
        gap *= 0.8;
    }
    let length = 2 * samples.len() as u32;
    let mut bytes = b"RIFF".to_vec();
    bytes.extend((36 + length).to_le_bytes());
    bytes.extend(b"WAVEfmt \x10\0\0\0\x01\0\x01\0");
    bytes.extend(RATE.to_le_bytes());
    bytes.extend((2 * RATE).to_le_bytes());
    bytes.extend(b"\x02\0\x10\0data");
    bytes.extend(length.to_le_bytes());
    samples.iter().for_each(|s| bytes.extend(s.to_le_bytes()));
    bytes
}
