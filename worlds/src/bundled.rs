//! The recordings that come with the tool, made from fixed seeds.

use crate::noise::Noise;
use crate::physics::flight::{Effects, FlightWorld, Measured};
use crate::physics::pendulum::{Friction, PendulumWorld};

/// A bundled recording: its folder's name and its files' contents.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Bundled {
    /// Folder below `recordings/`.
    pub name: &'static str,
    /// Contents of `recording.toml`.
    pub header: String,
    /// Contents of `data.csv`.
    pub data: String,
    /// Contents of `README.md`: what is hidden in it.
    pub readme: String,
}

/// Quadratic drag in 1/m of a sphere.
fn drag(coefficient: f64, diameter_m: f64, mass_kg: f64) -> f64 {
    1.2 * coefficient * std::f64::consts::FRAC_PI_4 * diameter_m * diameter_m / (2.0 * mass_kg)
}

/// All bundled recordings.
pub fn all() -> Vec<Bundled> {
    let header = |mass_kg: f64, diameter_m: f64| {
        format!(
            "format = 1\ndomain = \"trajectory\"\ndata = \"data.csv\"\n\n[rig]\nmass_kg = {mass_kg}\ndiameter_m = {diameter_m}\ngravity_m_s2 = 9.80665\nair_density_kg_m3 = 1.2\n"
        )
    };
    let readme = |title: &str, text: &str| {
        format!(
            "# {title}\n\nSimulated, not measured: `cargo run -p worlds --example bundled` makes these files again, bit for bit.\n\n{text}\n"
        )
    };
    let dropped = FlightWorld {
        effects: Effects { quadratic_per_m: drag(0.5, 0.0655, 0.0577), ..Effects::default() },
        noise: Noise { correlation: 0.3, ..Noise::white(0.005) },
        ..FlightWorld::dropped(4, [48, 58], 30.0)
    };
    let thrown = FlightWorld {
        effects: Effects {
            quadratic_per_m: drag(0.47, 0.0427, 0.0459),
            camera_tilt_rad: [0.006, -0.004],
            ..Effects::default()
        },
        noise: Noise::white(0.001),
        ..FlightWorld::thrown(Measured::Position)
    };
    let swing = PendulumWorld {
        length_m: 0.52,
        friction: Friction { dry_rad_s2: 0.04, ..Friction::default() },
        released_rad: vec![0.25, 0.42, 0.6],
        rows: 160,
        rate_hz: 25.0,
        noise: Noise { digit: 0.001, ..Noise::white(0.002) },
    };
    let steel = FlightWorld { noise: Noise::white(0.0015), ..FlightWorld::thrown(Measured::Position) };
    vec![
        Bundled {
            name: "dropped-ball",
            header: header(0.0577, 0.0655),
            data: dropped.draw(20).csv(4),
            readme: readme(
                "A tennis ball, dropped four times",
                "Height alone, 30 frames a second, a fall of 12 to 16 m. Hidden: quadratic drag, Cd = 0.5. Noise: 5 mm, neighbouring rows correlated by 0.3.",
            ),
        },
        Bundled {
            name: "thrown-ball",
            header: header(0.0459, 0.0427),
            data: thrown.draw(21).csv(4),
            readme: readme(
                "A golf ball, thrown five times",
                "All coordinates, 60 frames a second. Hidden: quadratic drag, Cd = 0.47, and a camera tilted by 0.006 rad about x and -0.004 rad about y. Noise: 1 mm, white.",
            ),
        },
        Bundled {
            name: "steel-ball",
            header: header(0.0561, 0.024),
            data: steel.draw(22).csv(4),
            readme: readme(
                "A steel ball, thrown five times",
                "All coordinates, 60 frames a second. Hidden: nothing. Noise: 1.5 mm, white.",
            ),
        },
        Bundled {
            name: "swing",
            header: include_str!("swing.toml").into(),
            data: swing.csv(23),
            readme: readme(
                "A pendulum, let go three times",
                "Its angle, 25 readings a second; the simulator is the program `pendulum.py` (Python, standard library). Hidden: dry friction in the bearing, 0.04 rad/s^2. Length 0.52 m, stated as 0.5. Noise: 2 mrad, in steps of 1 mrad.",
            ),
        },
    ]
}
