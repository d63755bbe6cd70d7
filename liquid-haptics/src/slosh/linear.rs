//! The linear motion of a damped mode in closed form.

/// The linear motion over a time: position and speed after it from those before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Propagator([f64; 4]);

impl Propagator {
    /// A mode of the angular frequency `w` (rad/s) without damping and a damping ratio, over `h` (s).
    pub(super) fn new(w: f64, ratio: f64, h: f64) -> Self {
        let damped = w * (1.0 - ratio * ratio).sqrt();
        let (sin, cos) = (damped * h).sin_cos();
        let (fade, tilt) = ((-ratio * w * h).exp(), ratio * w / damped);
        Self([
            fade * (cos + tilt * sin),
            fade * sin / damped,
            -fade * w * w / damped * sin,
            fade * (cos - tilt * sin),
        ])
    }

    pub(super) fn apply(&self, x: f64, v: f64) -> (f64, f64) {
        let m = &self.0;
        (m[0] * x + m[1] * v, m[2] * x + m[3] * v)
    }
}

/// Steps per radian of a mode within which its motion is a [`Series`].
pub(super) const STEPS_PER_RADIAN: f64 = 8.0;

/// How many motions are worked out at once: a processor divides for several of them in the time of one.
pub(super) const LANES: usize = 8;

/// A motion within a step: where it begins, and how it departs from the linear one.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stretch {
    /// How long the step is, s.
    pub(super) h: f64,
    /// Position and speed at its beginning.
    pub(super) begin: [f64; 2],
    /// Second derivative of the departure at the beginning; value, slope and second derivative of it at the end; in shares of the step.
    pub(super) departing: Option<(f64, [f64; 3])>,
}

/// Motions within some steps, as polynomials in the share of a step that has passed: `[term][step]`.
pub(super) struct Series([[f64; LANES]; TERMS]);

/// Terms of a polynomial.
const TERMS: usize = 10;

impl Series {
    /// The motions of a mode of the angular frequency `w` (rad/s); where `w h` is at most `1 / STEPS_PER_RADIAN`, the first term left out of
    /// the linear one is below 1e-15 of the amplitude.
    pub(super) fn new(w: f64, ratio: f64, stretches: &[Stretch; LANES]) -> Self {
        let (mut pull, mut drag, mut terms) = ([0.0; LANES], [0.0; LANES], [[0.0; LANES]; TERMS]);
        for (lane, stretch) in stretches.iter().enumerate() {
            let Stretch { h, begin: [x, v], .. } = *stretch;
            (pull[lane], drag[lane]) = (w * w * h * h, 2.0 * ratio * w * h);
            (terms[0][lane], terms[1][lane]) = (x, v * h);
        }
        for k in 0..TERMS - 2 {
            let n = (k + 1) as f64;
            for lane in 0..LANES {
                let push = pull[lane] * terms[k][lane] + drag[lane] * n * terms[k + 1][lane];
                terms[k + 2][lane] = -push / (n * (n + 1.0));
            }
        }
        for (lane, stretch) in stretches.iter().enumerate() {
            // The polynomial of the fifth degree whose value and slope are zero at the beginning, with this second derivative there, and
            // this value, slope and second derivative at the end.
            if let Some((begin, [value, slope, second])) = stretch.departing {
                let quadratic = 0.5 * begin;
                let (d0, d1, d2) = (value - quadratic, slope - begin, second - begin);
                terms[2][lane] += quadratic;
                terms[3][lane] += 10.0 * d0 - 4.0 * d1 + 0.5 * d2;
                terms[4][lane] += -15.0 * d0 + 7.0 * d1 - d2;
                terms[5][lane] += 6.0 * d0 - 3.0 * d1 + 0.5 * d2;
            }
        }
        Self(terms)
    }

    /// The positions where shares of a step, in [0, 1], have passed, in their place.
    fn read(&self, lane: usize, rows: &mut [f64]) {
        let c: [f64; TERMS] = std::array::from_fn(|k| self.0[k][lane]);
        for row in rows {
            // Even and odd terms apart: two short chains of multiplications in place of a long one.
            let (share, square) = (*row, *row * *row);
            let even = (((c[8] * square + c[6]) * square + c[4]) * square + c[2]) * square + c[0];
            let odd = (((c[9] * square + c[7]) * square + c[5]) * square + c[3]) * square + c[1];
            *row = odd * share + even;
        }
    }
}

/// Rows that are read off steps, some steps at a time. A row waits as the share of its step that has passed.
pub(super) struct Rows<'a> {
    out: &'a mut [f64],
    w: f64,
    ratio: f64,
    stretches: [Stretch; LANES],
    /// The first row of each step that waits, and one more than the last of all.
    rows: [usize; LANES + 1],
    waiting: usize,
}

impl<'a> Rows<'a> {
    /// The rows of a mode of an angular frequency (rad/s) and a damping ratio.
    pub(super) fn new(w: f64, ratio: f64, out: &'a mut [f64]) -> Self {
        Self { out, w, ratio, stretches: [Stretch::default(); LANES], rows: [0; LANES + 1], waiting: 0 }
    }

    /// Takes another step, off which the rows from here on are read.
    pub(super) fn step(&mut self, stretch: Stretch) {
        if self.waiting == LANES {
            self.read();
        }
        self.stretches[self.waiting] = stretch;
        self.waiting += 1;
        self.rows[self.waiting] = self.rows[self.waiting - 1];
    }

    /// Takes the next rows, as many as have a share of the last step that has passed.
    pub(super) fn rows(&mut self, shares: impl Iterator<Item = f64>) -> usize {
        let end = self.rows[self.waiting];
        let mut taken = 0;
        for (row, share) in self.out[end..].iter_mut().zip(shares) {
            *row = share;
            taken += 1;
        }
        self.rows[self.waiting] = end + taken;
        taken
    }

    /// Takes the next row, whose reading is known.
    pub(super) fn known(&mut self, reading: f64) {
        self.read();
        self.out[self.rows[0]] = reading;
        self.rows[0] += 1;
    }

    /// Reads the rows that wait.
    pub(super) fn read(&mut self) {
        if self.waiting > 0 {
            let series = Series::new(self.w, self.ratio, &self.stretches);
            for lane in 0..self.waiting {
                series.read(lane, &mut self.out[self.rows[lane]..self.rows[lane + 1]]);
            }
            self.rows[0] = self.rows[self.waiting];
            self.waiting = 0;
        }
    }

    /// The first row of those that were read that is beyond a bound, or no number.
    pub(super) fn beyond(&self, bound: f64) -> Option<usize> {
        (0..self.rows[0]).find(|&row| !(self.out[row].abs() <= bound))
    }
}
