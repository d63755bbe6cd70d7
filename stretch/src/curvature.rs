//! Curvature signals of an organised cloud (eq. 6.1; Nguyen and others).

use crate::cloud::Cloud;

/// Normal curvature along rows and columns of the picture, 1/m, positive where the membrane bulges towards the lens; NaN at the
/// border and next to holes.
///
/// Eq. 6.1's signal `<p(+) - p(-), n(+) - n(-)>` over `|p(+) - p(-)|^2`: the signal itself grows with the square of the distance
/// between the pixels, this does not.
#[derive(Debug, Clone, Default)]
pub struct Curvature {
    /// Along i: from row to row.
    pub i: Vec<f32>,
    /// Along j: from column to column, the direction of stretch.
    pub j: Vec<f32>,
}

impl Curvature {
    /// Takes a cloud in; room is used again.
    pub fn fill(&mut self, cloud: &Cloud) {
        let n = cloud.points.len();
        for out in [&mut self.i, &mut self.j] {
            out.clear();
            out.resize(n, f32::NAN);
        }
        let Some(window) = cloud.window else { return };
        let (columns, step) = (window.columns, cloud.step);
        for row in 0..window.rows {
            let points = &cloud.points[row * columns..][..columns];
            let normals = &cloud.normals[row * columns..][..columns];
            let out = &mut self.j[row * columns..][..columns];
            let pairs = points.iter().zip(&points[2 * step..]).zip(normals.iter().zip(&normals[2 * step..]));
            for (o, ((p, q), (m, n))) in out[step..].iter_mut().zip(pairs) {
                *o = between(p, q, m, n);
            }
            if row >= step && row + step < window.rows {
                let line = |r: usize| {
                    (&cloud.points[r * columns..][..columns], &cloud.normals[r * columns..][..columns])
                };
                let ((p, m), (q, n)) = (line(row - step), line(row + step));
                let out = &mut self.i[row * columns..][..columns];
                for (k, o) in out.iter_mut().enumerate() {
                    *o = between(&p[k], &q[k], &m[k], &n[k]);
                }
            }
        }
    }
}

fn between(p: &[f32; 3], q: &[f32; 3], m: &[f32; 3], n: &[f32; 3]) -> f32 {
    let d = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
    let t = [n[0] - m[0], n[1] - m[1], n[2] - m[2]];
    (d[0] * t[0] + d[1] * t[1] + d[2] * t[2]) / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
}
