//! What is known of a flight that is recorded.

/// What was measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axes {
    /// Height alone.
    Height,
    /// The height and the coordinate along the picture: one camera, square to the plane of the flight.
    Plane,
    /// All three coordinates.
    Space,
    /// The specific force along z, by an accelerometer on board.
    Accelerometer,
}

/// The columns of x, y and z.
pub(super) const PLACE: [&str; 3] = ["x_m", "y_m", "z_m"];

impl Axes {
    /// The columns that are measured, one a channel.
    pub(super) fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Height => &["z_m"],
            Self::Plane => &["x_m", "z_m"],
            Self::Space => &PLACE,
            Self::Accelerometer => &["accel_z_m_s2"],
        }
    }

    /// Number of unknowns of a run's start.
    pub fn starts(self) -> usize {
        2 * self.channels().len()
    }

    /// Which of x, y and z (0 to 2) are seen, one a channel; none of them is felt.
    pub fn seen(self) -> &'static [usize] {
        match self {
            Self::Height => &[2],
            Self::Plane => &[0, 2],
            Self::Space => &[0, 1, 2],
            Self::Accelerometer => &[],
        }
    }

    /// The axes about which a spin pushes a ball across its path so that it is seen: within a picture, that across it.
    pub(super) fn spins(self) -> std::ops::Range<usize> {
        match self {
            Self::Space => 0..3,
            Self::Plane => 1..2,
            Self::Height | Self::Accelerometer => 0..0,
        }
    }

    /// Whether distances along the ground are seen.
    pub(super) fn along_ground(self) -> bool {
        self.seen().len() > 1
    }
}

/// What is known of the set-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup {
    /// What was measured.
    pub axes: Axes,
    /// Mass in kg.
    pub mass_kg: Option<f64>,
    /// Diameter in m.
    pub diameter_m: Option<f64>,
    /// Gravity in m/s^2.
    pub gravity_m_s2: f64,
    /// Density of the air in kg/m^3.
    pub air_density_kg_m3: f64,
    /// Whether the spin is known (inputs 1 to 3).
    pub spin: bool,
}

/// A run of this kind films a rod of known length: the z channel reads its ends.
pub const ROD: u32 = 1;
