//! A container that is tilted slowly, its weight and torque at each pose: the liquid's moments by Gauss's quadrature over the
//! columns of liquid in the cavity, the level found by bisection.

use std::f64::consts::PI;
use std::sync::OnceLock;

use super::bisection::bisect;
use super::quadrature::gauss;
use crate::GRAVITY_M_S2;

/// The space inside a cylindrical container, upright on its base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cavity {
    /// Radius in m.
    pub radius_m: f64,
    /// Length in m.
    pub length_m: f64,
}

fn rule() -> &'static [[f64; 2]] {
    static RULE: OnceLock<Vec<[f64; 2]>> = OnceLock::new();
    RULE.get_or_init(|| gauss(20))
}

impl Cavity {
    /// Volume in m^3.
    pub fn volume_m3(&self) -> f64 {
        PI * self.radius_m * self.radius_m * self.length_m
    }

    /// Volume and the moments of x and y (from the base's centre, x across the axis, y along it) of liquid that stands below a
    /// level, for a clockwise tilt: where `y cos - x sin <= level`.
    fn moments(&self, rule: &[[f64; 2]], tilt_rad: f64, level_m: f64) -> [f64; 3] {
        let (s, c) = tilt_rad.sin_cos();
        let (r, length) = (self.radius_m, self.length_m);
        // Between two kinks of the surface's outline all is smooth in the angle a, x = r cos a.
        let kink = |x: f64| if s.abs() < 1e-12 { PI } else { (x / s / r).clamp(-1.0, 1.0).acos() };
        let mut ends = [0.0, kink(-level_m), kink(length * c - level_m), PI];
        ends.sort_unstable_by(f64::total_cmp);
        // The column of liquid over a place.
        let column = |x: f64| {
            let above = level_m + x * s;
            let y = if c.abs() < 1e-12 {
                length * f64::from(u8::from(above > 0.0))
            } else {
                (above / c).clamp(0.0, length)
            };
            if c < -1e-12 { [y, length] } else { [0.0, y] }
        };
        let mut sum = [0.0; 3];
        for pair in ends.windows(2).filter(|pair| pair[1] > pair[0]) {
            let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
            for [node, weight] in rule {
                let (sine, cosine) = (middle + half * node).sin_cos();
                let (x, [from, to]) = (r * cosine, column(r * cosine));
                let part = half * weight * 2.0 * r * r * sine * sine * (to - from);
                sum[0] += part;
                sum[1] += part * x;
                sum[2] += part * 0.5 * (from + to);
            }
        }
        sum
    }

    /// Centre of mass (x across, y along the axis, from the base's centre) of a volume of liquid, its surface as at a tilt.
    pub fn centre_m(&self, volume_m3: f64, tilt_rad: f64) -> [f64; 2] {
        let (s, c) = tilt_rad.sin_cos();
        let (across, along) = ((self.radius_m * s).abs(), self.length_m * c);
        let ends = [along.min(0.0) - across, along.max(0.0) + across];
        let [low, high] = bisect(ends, 44, |level| self.moments(rule(), tilt_rad, level)[0] < volume_m3);
        let [volume, x, y] = self.moments(rule(), tilt_rad, 0.5 * (low + high));
        [x / volume, y / volume]
    }
}

/// Everything that may act beside weight; all zero is a rigid container of no thickness and a faultless sensor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effects {
    /// Thickness of wall, base and lid in m.
    pub wall_m: f64,
    /// Relative error of the forces.
    pub force_gain: f64,
    /// Offset of the torque, N m.
    pub torque_offset_nm: f64,
    /// The container's tilt less the stated one, rad.
    pub angle_offset_rad: f64,
    /// True less stated grasp height, m.
    pub grasp_offset_m: f64,
    /// The shell's centre of mass above the middle, m.
    pub cap_shift_m: f64,
    /// The grasp height jumps by this in one run, from a pose on: m.
    pub slip_m: f64,
    /// Run of the jump, counted from 0.
    pub slip_run: usize,
    /// First pose after the jump, counted from 0.
    pub slip_pose: usize,
    /// Torque that is added from row to row of the whole file, N m.
    pub drift_nm_per_row: f64,
    /// The surface stands as at the tilt less this, rad.
    pub surface_lag_rad: f64,
    /// Unlisted: a cable that is taut beyond an angle.
    pub cable: Cable,
    /// Unlisted: half the width of the sensor's hysteresis (a play), N m.
    pub play_nm: f64,
    /// Unlisted: the gripper gives way with the torque squared, rad/(N m)^2.
    pub flex: f64,
    /// Unlisted: kg of liquid spilt at the run and pose of the slip.
    pub spilt_kg: f64,
    /// Unlisted: another grip from the run of the slip on, m.
    pub regrasped_m: f64,
}

/// A cable to the sensor that turns it once it is taut.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Cable {
    /// Tilt from which the cable is taut, rad.
    pub taut_from_rad: f64,
    /// Torque for each radian beyond, N m/rad.
    pub stiffness_nm_rad: f64,
}

/// A container's liquid and the poses of one run.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Mass of the liquid in kg.
    pub mass_kg: f64,
    /// Volume of the liquid in m^3.
    pub volume_m3: f64,
    /// Stated tilt of each pose in rad.
    pub tilts_rad: Vec<f64>,
}

/// A container in a gripper.
#[derive(Debug, Clone, PartialEq)]
pub struct TiltWorld {
    /// The container from outside.
    pub outside: Cavity,
    /// Mass of the empty container in kg.
    pub container_kg: f64,
    /// Mass of the gripper in kg.
    pub gripper_kg: f64,
    /// Stated height of the grasp above the bottom in m.
    pub grasp_m: f64,
    /// The sweeps.
    pub sweeps: Vec<Sweep>,
    /// The effects at work.
    pub effects: Effects,
}

impl TiltWorld {
    /// Upward force in N and torque in N m of every pose without noise, run after run (the sideways force is none).
    pub fn readings(&self) -> Vec<[f64; 2]> {
        let e = &self.effects;
        let mut readings = Vec::new();
        for (run, sweep) in self.sweeps.iter().enumerate() {
            let mut reading = None;
            for (pose, &tilt) in sweep.tilts_rad.iter().enumerate() {
                let late = run == e.slip_run && pose >= e.slip_pose;
                let regrasped = if run >= e.slip_run { e.regrasped_m } else { 0.0 };
                let [force, torque] = self.load(sweep, tilt, late, regrasped);
                let torque = torque + e.cable.stiffness_nm_rad * (tilt - e.cable.taut_from_rad).max(0.0);
                // A play follows only where it is pushed.
                let followed = reading
                    .map_or(torque, |before: f64| before.clamp(torque - e.play_nm, torque + e.play_nm));
                reading = Some(followed);
                let drift = e.drift_nm_per_row * readings.len() as f64;
                readings.push([force * (1.0 + e.force_gain), followed + e.torque_offset_nm + drift]);
            }
        }
        readings
    }

    /// Force and torque of the weights at a tilt.
    fn load(&self, sweep: &Sweep, stated_rad: f64, late: bool, regrasped_m: f64) -> [f64; 2] {
        let e = &self.effects;
        let slip = if late { e.slip_m } else { 0.0 };
        let spilt = if late { e.spilt_kg } else { 0.0 };
        let grasp = self.grasp_m + e.grasp_offset_m + slip + regrasped_m;
        let liquid_kg = sweep.mass_kg - spilt;
        let volume = sweep.volume_m3 * liquid_kg / sweep.mass_kg;
        let cavity = Cavity {
            radius_m: self.outside.radius_m - e.wall_m,
            length_m: self.outside.length_m - 2.0 * e.wall_m,
        };
        let weigh = |tilt: f64| {
            let [x, y] = cavity.centre_m(volume, tilt - e.surface_lag_rad);
            let (s, c) = tilt.sin_cos();
            let liquid = x * c + (y + e.wall_m - grasp) * s;
            let shell = (0.5 * self.outside.length_m + e.cap_shift_m - grasp) * s;
            -GRAVITY_M_S2 * (self.container_kg * shell + liquid_kg * liquid)
        };
        let tilt = stated_rad + e.angle_offset_rad;
        let mut torque = weigh(tilt);
        if e.flex != 0.0 {
            for _ in 0..6 {
                torque = weigh(tilt + e.flex * torque * torque);
            }
        }
        let force = -GRAVITY_M_S2 * (self.gripper_kg + self.container_kg + liquid_kg);
        [force, torque]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    const CAN: Cavity = Cavity { radius_m: 0.04, length_m: 0.2 };

    fn near(found: [f64; 2], expected: [f64; 2]) {
        for (a, b) in found.iter().zip(expected) {
            approx::assert_abs_diff_eq!(*a, b, epsilon = 1e-9);
        }
    }

    /// Upright and turned over it is a short cylinder; lying half full half a disc, 4r/(3 pi) below the axis.
    #[test]
    fn centres_that_are_known() {
        let part = 0.3 * CAN.volume_m3();
        near(CAN.centre_m(part, 0.0), [0.0, 0.03]);
        near(CAN.centre_m(part, PI), [0.0, 0.17]);
        near(CAN.centre_m(0.5 * CAN.volume_m3(), FRAC_PI_2), [0.04 * 4.0 / (3.0 * PI), 0.1]);
        near(CAN.centre_m(CAN.volume_m3() * (1.0 - 1e-12), 0.7), [0.0, 0.1]);
    }

    /// A surface that cuts the wall all round: x = r^2 tan/(4 h), y = h/2 + r^2 tan^2/(8 h), h the depth on the axis.
    #[test]
    fn a_slanted_surface_shifts_the_centre_as_the_closed_form_says() {
        for (tilt, h) in [(0.3f64, 0.1), (0.7, 0.09), (1e-6, 0.02), (1.0, 0.12)] {
            let t = tilt.tan();
            let volume = PI * 0.04 * 0.04 * h;
            near(CAN.centre_m(volume, tilt), [0.0016 * t / (4.0 * h), 0.5 * h + 0.0016 * t * t / (8.0 * h)]);
        }
    }

    /// A hoof: liquid that just reaches the axis of the base, V = 2/3 r^3 / tan, centre 3 pi/16 r from the axis.
    #[test]
    fn a_hoof_is_where_the_closed_form_puts_it() {
        let tilt: f64 = 1.2;
        let slope = 1.0 / tilt.tan();
        let [volume, x, y] = CAN.moments(rule(), tilt, 0.0);
        // Its height at the wall is r tan(tilt) = 0.103: below the lid.
        let height = 0.04 / slope;
        approx::assert_relative_eq!(volume, 2.0 / 3.0 * 0.0016 * height, max_relative = 1e-9);
        approx::assert_relative_eq!(x / volume, 3.0 * PI / 16.0 * 0.04, max_relative = 1e-9);
        approx::assert_relative_eq!(y / volume, 3.0 * PI / 32.0 * height, max_relative = 1e-9);
    }

    /// Twenty nodes a piece do as well as 300, to far below a millionth of the arm; and both as well as counting cells.
    #[test]
    fn the_quadrature_has_converged() {
        let fine = gauss(300);
        let cells = 300;
        let place = |k: i32, from: f64, size: f64| from + size * (f64::from(k) + 0.5) / f64::from(cells);
        for tilt in [0.05, 0.4, 1.1, FRAC_PI_2 - 1e-4, FRAC_PI_2, FRAC_PI_2 + 1e-4, 2.0, 2.9] {
            let (s, c): (f64, f64) = tilt.sin_cos();
            for level in [-0.02, 0.001, 0.03, 0.1].map(|above| above - 0.2 * f64::from(u8::from(c < 0.0))) {
                let [volume, x, y] = CAN.moments(rule(), tilt, level);
                let better = CAN.moments(&fine, tilt, level);
                for (a, b) in [volume, x, y].iter().zip(better) {
                    approx::assert_abs_diff_eq!(*a, b, epsilon = 1e-10 * CAN.volume_m3());
                }
                let mut sum = [0.0; 3];
                for i in 0..cells {
                    let across = place(i, -0.04, 0.08);
                    let area =
                        2.0 * (0.0016 - across * across).sqrt() * 0.08 * 0.2 / f64::from(cells * cells);
                    for along in
                        (0..cells).map(|k| place(k, 0.0, 0.2)).filter(|y| y * c - across * s <= level)
                    {
                        sum = [sum[0] + area, sum[1] + area * across, sum[2] + area * along];
                    }
                }
                // A cell's edge is 1/300 of the length, and errors of its sharp edges average out.
                for (found, counted, size) in [(volume, sum[0], 1.0), (x, sum[1], 0.04), (y, sum[2], 0.2)] {
                    approx::assert_abs_diff_eq!(found, counted, epsilon = 3e-3 * size * CAN.volume_m3());
                }
            }
        }
    }

    /// Turned by pi less the tilt and seen from the other end, a container is the same.
    #[test]
    fn turned_over_is_the_mirror_of_upright() {
        for tilt in [0.2, 0.8, 1.4, 1.57] {
            let volume = 0.37 * CAN.volume_m3();
            let [x, y] = CAN.centre_m(volume, tilt);
            near(CAN.centre_m(volume, PI - tilt), [x, 0.2 - y]);
        }
    }

    #[test]
    fn weights_pull_down_and_the_torque_is_arm_times_force() {
        let sweep = Sweep { mass_kg: 0.3, volume_m3: 3e-4, tilts_rad: vec![0.0, 0.4] };
        let world = TiltWorld {
            outside: CAN,
            container_kg: 0.1,
            gripper_kg: 0.5,
            grasp_m: 0.15,
            sweeps: vec![sweep],
            effects: Effects::default(),
        };
        let [upright, tilted] = [world.readings()[0], world.readings()[1]];
        approx::assert_relative_eq!(upright[0], -0.9 * GRAVITY_M_S2, max_relative = 1e-12);
        approx::assert_abs_diff_eq!(upright[1], 0.0, epsilon = 1e-9);
        let [x, y] = CAN.centre_m(3e-4, 0.4);
        let liquid = x * 0.4f64.cos() + (y - 0.15) * 0.4f64.sin();
        let centre = (0.1 * (0.1 - 0.15) * 0.4f64.sin() + 0.3 * liquid) / 0.9;
        approx::assert_relative_eq!(tilted[1], centre * tilted[0], max_relative = 1e-9);
        // Held above the centre of mass it hangs: a clockwise tilt makes an anticlockwise torque.
        assert!(tilted[1] > 0.0);
    }
}
