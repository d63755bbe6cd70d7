//! Random Fourier features (Rahimi and Recht 2007): a linear model in them is a model with the kernel they were drawn from.

use rand::{Rng, RngExt};
use rand_distr::{ChiSquared, Distribution, StandardNormal, StudentT};
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Gamma, StudentsT};

use crate::error::Error;
use crate::kernel::{Form, Kernel};
use crate::normal;

/// How frequencies are drawn; the density is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Draw {
    /// Independently.
    Random,
    /// From a shifted Kronecker lattice, by inverse distribution functions: covers the density more evenly.
    QuasiRandom,
}

/// `count` frequencies, each with its cosine and sine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RandomFeatures {
    dim: usize,
    /// Frequency after frequency, `dim` numbers each.
    frequencies: Vec<f64>,
}

impl RandomFeatures {
    /// Draws `count` frequencies from the kernel's spectral density for inputs of `dim` numbers: a normal for the squared
    /// exponential, a t with 2 nu degrees of freedom for Matern, multivariate (one chi-square for all dimensions) for the isotropic
    /// form, univariate (one for each) for the product.
    ///
    /// # Errors
    /// [`Error::Setting`] for no frequency, no dimension or a length scale that is not above 0.
    pub fn draw<R: Rng + ?Sized>(
        kernel: &Kernel,
        dim: usize,
        count: usize,
        draw: Draw,
        rng: &mut R,
    ) -> Result<Self, Error> {
        if dim == 0 || count == 0 {
            return Err(Error::Setting { name: "count", value: count as f64, rule: "at least 1" });
        }
        if !(kernel.length_scale > 0.0 && kernel.length_scale.is_finite()) {
            return Err(Error::Setting {
                name: "length_scale",
                value: kernel.length_scale,
                rule: "above 0 and finite",
            });
        }
        let mut frequencies = match draw {
            Draw::Random => random(kernel, dim, count, rng)?,
            Draw::QuasiRandom => quasi_random(kernel, dim, count, rng)?,
        };
        frequencies.iter_mut().for_each(|f| *f /= kernel.length_scale);
        Ok(Self { dim, frequencies })
    }

    /// Number of features: two for each frequency.
    pub fn len(&self) -> usize {
        2 * self.frequencies.len() / self.dim
    }

    /// Whether there are none; never, after [`RandomFeatures::draw`].
    pub fn is_empty(&self) -> bool {
        self.frequencies.is_empty()
    }

    /// The factor on features that makes the product of two points' the kernel.
    pub(crate) fn unit(&self) -> f64 {
        (0.5 * self.len() as f64).sqrt().recip()
    }

    /// Writes the features of `x`; the product of two points' features, divided by their number over 2, is about the kernel.
    pub fn write(&self, x: &[f64], out: &mut [f64]) {
        for (w, pair) in self.frequencies.chunks_exact(self.dim).zip(out.chunks_exact_mut(2)) {
            let phase: f64 = w.iter().zip(x).map(|(w, x)| w * x).sum();
            (pair[1], pair[0]) = phase.sin_cos();
        }
    }
}

fn bad_freedom(value: f64) -> Error {
    Error::Setting { name: "degrees of freedom", value, rule: "above 0" }
}

fn random<R: Rng + ?Sized>(
    kernel: &Kernel,
    dim: usize,
    count: usize,
    rng: &mut R,
) -> Result<Vec<f64>, Error> {
    let mut out = Vec::with_capacity(dim * count);
    let Some(freedom) = kernel.family.degrees_of_freedom() else {
        out.extend((0..dim * count).map(|_| -> f64 { StandardNormal.sample(rng) }));
        return Ok(out);
    };
    match kernel.form {
        Form::Product => {
            let t = StudentT::new(freedom).map_err(|_| bad_freedom(freedom))?;
            out.extend((0..dim * count).map(|_| -> f64 { t.sample(rng) }));
        }
        Form::Isotropic => {
            let chi_squared = ChiSquared::new(freedom).map_err(|_| bad_freedom(freedom))?;
            for _ in 0..count {
                let drawn: f64 = chi_squared.sample(rng);
                let scale = (freedom / drawn).sqrt();
                out.extend((0..dim).map(|_| {
                    let z: f64 = StandardNormal.sample(rng);
                    scale * z
                }));
            }
        }
    }
    Ok(out)
}

fn quasi_random<R: Rng + ?Sized>(
    kernel: &Kernel,
    dim: usize,
    count: usize,
    rng: &mut R,
) -> Result<Vec<f64>, Error> {
    let generators = normal::richtmyer(dim + 1);
    let shifts: Vec<f64> = generators.iter().map(|_| rng.random::<f64>()).collect();
    // Kept off 0 and 1, where the inverse functions are infinite.
    let uniform = |i: usize, j: usize| {
        let u = ((i + 1) as f64 * generators[j] + shifts[j]).fract();
        u.clamp(0.25 / count as f64, 1.0 - 0.25 / count as f64)
    };
    let mut out = Vec::with_capacity(dim * count);
    let freedom = kernel.family.degrees_of_freedom();
    let t = freedom.map(|f| StudentsT::new(0.0, 1.0, f).map_err(|_| bad_freedom(f))).transpose()?;
    let chi_squared = freedom.map(|f| Gamma::new(0.5 * f, 0.5).map_err(|_| bad_freedom(f))).transpose()?;
    for i in 0..count {
        match (kernel.form, &t, &chi_squared) {
            (Form::Product, Some(t), _) => out.extend((0..dim).map(|j| t.inverse_cdf(uniform(i, j)))),
            (Form::Isotropic, _, Some(chi_squared)) => {
                let scale = (freedom.unwrap_or(1.0) / chi_squared.inverse_cdf(uniform(i, dim))).sqrt();
                out.extend((0..dim).map(|j| scale * normal::quantile(uniform(i, j))));
            }
            _ => out.extend((0..dim).map(|j| normal::quantile(uniform(i, j)))),
        }
    }
    Ok(out)
}
