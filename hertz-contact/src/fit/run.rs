//! A fit from beginning to end: curves loaded, settled, cut to the range, reported.

use super::interval::report;
use super::report::Report;
use super::settings::{Curve, Fit, FitError, Range};
use super::solve::{Settled, Workspace, settle};
use super::state::State;

impl Fit {
    /// Fits curves.
    ///
    /// The workspace's room is used again; a report allocates for its list of curves only.
    ///
    /// # Errors
    /// [`FitError`].
    pub fn run(&self, curves: &[Curve<'_>], work: &mut Workspace) -> Result<Report, FitError> {
        self.check()?;
        if curves.is_empty() {
            return Err(FitError::Empty);
        }
        work.curves.resize_with(curves.len(), State::default);
        for (index, (curve, state)) in curves.iter().zip(&mut work.curves).enumerate() {
            state.load(self, index, curve)?;
            state.step = state.ready.step(&mut work.room);
        }
        let mut settled = settle(self, work)?;
        match self.range {
            Range::All => {}
            Range::UpTo(depth_m) => {
                for _ in 0..4 {
                    let mut moved = false;
                    for (index, state) in work.curves.iter_mut().enumerate() {
                        moved |= state.cut(self, index, depth_m / state.ready.span_m)?;
                    }
                    if !moved {
                        break;
                    }
                    settled = settle(self, work)?;
                }
            }
            Range::Automatic => settled = shorten(self, work)?,
        }
        Ok(report(self, work, settled))
    }
}

/// Shortens curves until their residuals have no trend.
fn shorten(fit: &Fit, work: &mut Workspace) -> Result<Settled, FitError> {
    let tenth_of_radius_m = fit.indenter.radius_m().map_or(f64::INFINITY, |r| 0.1 * r);
    let tenth_of_layer_m = fit.layer.map_or(f64::INFINITY, |below| 0.1 / below.inverse_thickness_per_m);
    let limit_m = tenth_of_radius_m.min(tenth_of_layer_m);
    let mut depths = Vec::with_capacity(work.curves.len());
    for (index, state) in work.curves.iter_mut().enumerate() {
        let depth = (0.5 - state.at).min(limit_m / state.ready.span_m);
        // A range so short that it has too few samples is an error of the data, not of the law.
        state.cut(fit, index, depth)?;
        depths.push((depth, depth));
    }
    let mut settled = settle(fit, work)?;
    for _ in 0..8 {
        let mut moved = false;
        for (index, (state, (whole, depth))) in work.curves.iter_mut().zip(&mut depths).enumerate() {
            let shorter = 0.8 * *depth;
            if state.trend() > 3.0 && shorter > 0.2 * *whole && state.in_contact(state.at + shorter) >= 20 {
                *depth = shorter;
                moved |= state.cut(fit, index, shorter)?;
            }
        }
        if !moved {
            break;
        }
        settled = settle(fit, work)?;
    }
    Ok(settled)
}
