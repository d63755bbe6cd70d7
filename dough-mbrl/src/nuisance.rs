//! What each dough does for itself: nuisance parameters of a dough, shared by all its rolls.

use nalgebra::{DVector, Vector3};

/// Trends of a dough: a level, and half a cosine, a whole one, one and a half along its rolls.
pub const TRENDS: usize = 4;
/// Nuisance parameters of a dough: trends of each dimension's change, and (the last) a part of every change, as softer dough does.
pub const NUISANCES: usize = 3 * TRENDS + 1;

/// Variances of the nuisance parameters, from dough to dough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NuisanceVariances {
    /// Of the amplitude of each trend ([`trends`]), by dimension, m^2.
    pub trend_m2: Vector3<f64>,
    /// Of the part by which all rolls of a dough do more or less.
    pub softness: f64,
}

impl NuisanceVariances {
    /// That of one of the [`NUISANCES`] parameters.
    pub(crate) fn of(&self, parameter: usize) -> f64 {
        if parameter < 3 * TRENDS { self.trend_m2[parameter % 3] } else { self.softness }
    }
}

/// Nuisance parameters of a dough.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Nuisance {
    /// Amplitudes of the trends, by dimension, m.
    pub(crate) trends: [Vector3<f64>; TRENDS],
    /// The part by which all rolls do more.
    pub(crate) softness: f64,
}

/// The trends along so many rolls, each of unit mean square: at most [`TRENDS`], one for every five rolls and one more; of a single
/// roll none.
pub fn trends(rolls: usize) -> Vec<DVector<f64>> {
    let count = if rolls < 2 { 0 } else { (1 + rolls / 5).min(TRENDS) };
    let trend = |k: usize| {
        let phase = |i: usize| std::f64::consts::PI * k as f64 * (i as f64 + 0.5) / rolls as f64;
        let size = if k == 0 { 1.0 } else { std::f64::consts::SQRT_2 };
        DVector::from_fn(rolls, |i, _| size * phase(i).cos())
    };
    (0..count).map(trend).collect()
}
