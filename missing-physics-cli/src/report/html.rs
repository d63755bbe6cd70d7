//! x
use super::ReportContext; use missing_physics::diagnosis::Diagnosis;
/// x
pub fn html(_: &Diagnosis, _: &ReportContext) -> String { String::new() }
