//! What is known of a table on which balls bounce.

/// What is known of the set-up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Setup {
    pub(super) gravity_m_s2: f64,
    /// Drag (1/m) of a drag coefficient of one, where mass and diameter are known.
    pub(super) drag_unit: Option<f64>,
    /// Whether places were measured.
    pub(super) placed: bool,
    /// Whether the height of the drop is known.
    pub(super) dropped: bool,
    /// Whether there are drops enough to say how a hand lets go of balls.
    pub(super) released: bool,
    /// Whether the impacts come from sound, with their loudness.
    pub(super) listened: bool,
    /// Runs in which an impact went unheard, and runs.
    pub(super) unheard: [usize; 2],
    /// Microphones whose places are known.
    pub(super) microphones: usize,
}
