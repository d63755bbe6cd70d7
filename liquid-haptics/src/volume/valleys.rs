//! The misfit's valleys: a grid, Brent's method in every cell that may hold a minimum, and how far each valley reaches.

use argmin::core::{CostFunction, Error, Executor, State as _};
use argmin::solver::brent::BrentOpt;

use super::VolumeError;
use super::profile::{Mass, Profile};
use crate::container::ContainerError;
use crate::root::root;

/// Cells of the grid; narrower towards empty and full, where the torque changes fastest.
const CELLS: usize = 64;
/// Tolerance of a minimum, as a share of the capacity.
const MINIMUM_TOLERANCE: f64 = 1e-9;
/// Tolerance of an end of an interval, as a share of the capacity.
const END_TOLERANCE: f64 = 1e-8;

/// A valley of the misfit: shares of the capacity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Valley {
    pub(super) share: f64,
    pub(super) misfit: f64,
    pub(super) reach: [f64; 2],
}

/// The grid's shares, with the levers at each.
pub(super) struct Grid<'a> {
    profile: &'a Profile<'a>,
    shares: Vec<f64>,
    levers: Vec<Vec<f64>>,
}

struct Slice<'a> {
    profile: &'a Profile<'a>,
    mass: Mass,
}

impl CostFunction for Slice<'_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, share: &f64) -> Result<f64, Error> {
        Ok(self.profile.misfit(*share, self.mass)?)
    }
}

impl<'a> Grid<'a> {
    pub(super) fn new(profile: &'a Profile<'a>) -> Result<Self, ContainerError> {
        let shares: Vec<f64> = (0..=CELLS)
            .map(|k| {
                let u = k as f64 / CELLS as f64;
                u * u * (3.0 - 2.0 * u)
            })
            .collect();
        let levers = shares.iter().map(|s| profile.levers(*s)).collect::<Result<_, _>>()?;
        Ok(Self { profile, shares, levers })
    }

    fn misfits(&self, mass: Mass) -> Vec<f64> {
        let sum = |(share, levers): (&f64, &Vec<f64>)| {
            let (poses, prior) = self.profile.squares(levers, *share, mass);
            poses + prior
        };
        self.shares.iter().zip(&self.levers).map(sum).collect()
    }

    fn refine(
        &self,
        at: usize,
        [from, to]: [usize; 2],
        misfits: &[f64],
        mass: Mass,
    ) -> Result<(f64, f64), VolumeError> {
        let (low, high) = (self.shares[from], self.shares[to]);
        let solver = BrentOpt::new(low, high).set_tolerance(f64::EPSILON.sqrt(), MINIMUM_TOLERANCE);
        let slice = Slice { profile: self.profile, mass };
        let found = Executor::new(slice, solver).configure(|state| state.max_iters(100)).run();
        let found = found.map_err(|error| match error.downcast::<ContainerError>() {
            Ok(error) => VolumeError::Container(error),
            Err(error) => VolumeError::Search(error.to_string()),
        })?;
        let grid = (self.shares[at], misfits[at]);
        let state = found.state();
        // Brent's method does not try the ends.
        Ok(match state.get_best_param() {
            Some(share) if state.get_best_cost() < grid.1 => (*share, state.get_best_cost()),
            _ => grid,
        })
    }

    /// Share and misfit of the best minimum of the grid's best cell.
    pub(super) fn best(&self, mass: Mass) -> Result<(f64, f64), VolumeError> {
        let misfits = self.misfits(mass);
        let at = (0..=CELLS).min_by(|a, b| misfits[*a].total_cmp(&misfits[*b])).unwrap_or(0);
        self.refine(at, [at.saturating_sub(1), (at + 1).min(CELLS)], &misfits, mass)
    }

    /// All valleys that come within `level` (N m)^2 of the least misfit, rising, and which is the deepest.
    pub(super) fn valleys(&self, mass: Mass, level: f64) -> Result<(Vec<Valley>, Valley), VolumeError> {
        let misfits = self.misfits(mass);
        let mut minima = Vec::new();
        for (k, here) in misfits.iter().enumerate() {
            let falls = k == 0 || *here < misfits[k - 1];
            let rises = k == CELLS || *here <= misfits[k + 1];
            if falls && rises {
                // Twins that are about to meet may lie to either side of the point.
                for cell in [[k.saturating_sub(1), k], [k, (k + 1).min(CELLS)]] {
                    if cell[0] < cell[1] {
                        minima.push(self.refine(k, cell, &misfits, mass)?);
                    }
                }
            }
        }
        let least = minima.iter().map(|m| m.1).fold(f64::INFINITY, f64::min);
        let mut valleys: Vec<Valley> = Vec::new();
        for (share, misfit) in minima {
            if !(misfit <= least + level) {
                continue;
            }
            let end = |outward: &mut dyn Iterator<Item = usize>| {
                self.end((share, misfit), least + level, outward, &misfits, mass)
            };
            let first = self.shares.partition_point(|s| *s <= share);
            let low = end(&mut (0..first).rev().filter(|k| self.shares[*k] < share))?;
            let high = end(&mut (first..=CELLS))?;
            let next = Valley { share, misfit, reach: [low, high] };
            match valleys.last_mut() {
                Some(last) if next.reach[0] <= last.reach[1] => {
                    let deeper = if next.misfit < last.misfit { next } else { *last };
                    *last = Valley { reach: [last.reach[0].min(low), last.reach[1].max(high)], ..deeper };
                }
                _ => valleys.push(next),
            }
        }
        let deepest = valleys.iter().copied().min_by(|a, b| a.misfit.total_cmp(&b.misfit));
        let deepest = deepest.ok_or_else(|| VolumeError::Search("no misfit is a number".to_owned()))?;
        Ok((valleys, deepest))
    }

    /// Where the misfit passes `limit` on the way outward from a minimum; the last share where it does not.
    fn end(
        &self,
        (share, misfit): (f64, f64),
        limit: f64,
        outward: &mut dyn Iterator<Item = usize>,
        misfits: &[f64],
        mass: Mass,
    ) -> Result<f64, VolumeError> {
        // A root of the misfit is nearly straight about the minimum.
        let height = (limit - misfit).max(0.0).sqrt();
        let above = |value: f64| (value - misfit).max(0.0).sqrt() - height;
        let mut before = (share, above(misfit));
        for k in outward {
            let here = (self.shares[k], above(misfits[k]));
            if here.1 > 0.0 {
                let at = |s: f64| self.profile.misfit(s, mass).map(above);
                return Ok(root(at, before, here, END_TOLERANCE)?);
            }
            before = here;
        }
        Ok(before.0)
    }
}
