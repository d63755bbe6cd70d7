//! stub
use missing_physics::diagnosis::Diagnosis;
/// Where.
pub struct ReportContext {
    /// d
    pub domain: String,
    /// r
    pub recording: String,
    /// t
    pub title: String,
}
/// t
pub fn text(d: &Diagnosis, _c: &ReportContext) -> String {
    format!("{} {:?} {:?}\n", d.verdict.word(), d.chosen, d.confused_with)
}
/// t
pub fn json(_d: &Diagnosis, _c: &ReportContext) -> String {
    String::new()
}
/// t
pub fn html(_d: &Diagnosis, _c: &ReportContext) -> String {
    String::new()
}
