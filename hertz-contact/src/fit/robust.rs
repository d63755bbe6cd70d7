//! Weights and scales that outliers do not move.

use super::settings::Loss;

/// Weight of a residual of u standard deviations, and the derivative of `u weight(u)`.
pub(super) fn weight(loss: Loss, u: f64) -> (f64, f64) {
    match loss {
        Loss::Square => (1.0, 1.0),
        Loss::Huber => {
            const K: f64 = 1.345;
            if u.abs() <= K { (1.0, 1.0) } else { (K / u.abs(), 0.0) }
        }
        Loss::Tukey => {
            const C: f64 = 4.685;
            let left = 1.0 - (u / C) * (u / C);
            if left > 0.0 { (left * left, left * (5.0 * left - 4.0)) } else { (0.0, 0.0) }
        }
    }
}

/// Standard deviation of residuals: their median size over that of a normal variable. `room` is overwritten.
pub(super) fn scale(residuals: impl Iterator<Item = f64>, room: &mut Vec<f64>) -> f64 {
    room.clear();
    room.extend(residuals.map(f64::abs));
    if room.is_empty() {
        return 0.0;
    }
    let middle = room.len() / 2;
    *room.select_nth_unstable_by(middle, f64::total_cmp).1 * 1.482_602_218_505_602
}

#[cfg(test)]
mod tests {
    use super::{Loss, scale, weight};

    #[test]
    fn influence_has_the_derivative_that_is_said() {
        for loss in [Loss::Square, Loss::Huber, Loss::Tukey] {
            for u in [-6.0, -3.0, -1.0, 0.0, 0.5, 2.0, 4.6, 5.0] {
                let f = |u: f64| u * weight(loss, u).0;
                let slope = (f(u + 1e-6) - f(u - 1e-6)) / 2e-6;
                assert!((slope - weight(loss, u).1).abs() < 1e-5, "{loss:?} {u}");
            }
        }
    }

    #[test]
    fn outliers_do_not_move_the_scale() {
        let mut room = Vec::new();
        let regular: Vec<f64> = (1..100).map(|i| f64::from(i) / 50.0 - 1.0).collect();
        let wild = regular.iter().map(|x| if *x > 0.9 { 1e9 } else { *x });
        let ratio = scale(wild, &mut room) / scale(regular.iter().copied(), &mut room);
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");
        assert_eq!(scale(std::iter::empty(), &mut room), 0.0);
    }
}
