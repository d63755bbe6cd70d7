/// A place on the table, from one impact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// Place, m.
    pub x_m: f64,
    /// Place, m.
    pub y_m: f64,
    /// Covariance of (x, y), m^2, from the scatter of the phases in the band.
    pub covariance_m2: [[f64; 2]; 2],
    /// Standard deviation of one microphone's arrival, s.
    pub arrival_sigma_s: f64,
    /// What is left of the arrivals after the place was fitted, root of the sum of squares over the degrees of freedom
    /// (microphones less 3), s; `None` with three microphones, which leave nothing.
    pub residual_s: Option<f64>,
    /// How far the time differences are from adding up around triangles, root mean square over the pairs, s.
    pub closure_s: f64,
    /// How well the phases of the channels agree with delays of one sound, in the pair that agrees least: 1 for one source without noise
    /// or echoes, near 0.3 for sounds that have nothing to do with each other.
    pub coherence: f64,
}
