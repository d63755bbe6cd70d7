//! A tip on a stage that presses objects: noise, wandering zeros, a camera's gain, a pressure sensor's zero, backlash, rubber that ages, gels that are not what
//! their labels say.

use std::collections::HashMap;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

use super::contact::{Contact, Object, Rings, SoftTip};
use crate::stiffness::{Calibration, Press, Reading};

/// How large the errors of a rig are, standard deviations unless said otherwise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// White noise of the tip's indentation, m.
    pub tip_noise_m: f64,
    /// Step of its random walk from reading to reading, m.
    pub tip_walk_m: f64,
    /// Error of the camera's gain, drawn anew for calibration and use, as a share.
    pub gain_share: f64,
    /// Noise of the contact's radius, m.
    pub contact_noise_m: f64,
    /// Error of the contact's radius that stays, as a share.
    pub contact_share: f64,
    /// Zero of the pressure sensor, Pa.
    pub pressure_zero_pa: f64,
    /// Ageing of the rubber since the calibration, as a share.
    pub ageing_share: f64,
    /// Error of the gels' moduli, as a share: one rheometer measured them.
    pub gel_share: f64,
    /// Difference of this tip's rubber from the usual one, as a share.
    pub make_share: f64,
    /// Most play of the stage, m: drawn evenly from 0 on.
    pub play_m: f64,
    /// Noise of the stage, m.
    pub travel_noise_m: f64,
}

impl Errors {
    /// A bench with the camera of [Matl 2021], whose static noise is 0.14 mm (0.6 mm over 4.37).
    pub fn matl_2021() -> Self {
        Self {
            tip_noise_m: 1.4e-4,
            tip_walk_m: 5e-6,
            gain_share: 0.01,
            contact_noise_m: 2e-4,
            contact_share: 0.02,
            pressure_zero_pa: 20.0,
            ageing_share: 0.05,
            gel_share: 0.03,
            make_share: 0.15,
            play_m: 8e-5,
            travel_noise_m: 3e-6,
        }
    }
}

/// Moduli of the gels in plane strain, by their labels, Pa.
const GELS_PA: [f64; 2] = [6e3, 40e3];
/// Least indentation of tip and gel that a calibration takes, m.
const LEAST_M: f64 = 3e-4;
/// Travel before the contact, and how far a press goes beyond, m.
const BEFORE_M: f64 = 7e-4;
/// Readings in and out.
const READINGS: [usize; 2] = [16, 12];

/// The rig.
#[derive(Debug, Clone)]
pub struct Palpator {
    /// Its errors.
    pub errors: Errors,
    /// How deep it presses, m of travel beyond where the object is thought to begin.
    pub depth_m: f64,
    /// Mean shear that each press makes, m.
    pub drag_m: f64,
    fresh: SoftTip,
    aged: SoftTip,
    rings: Rings,
    gain: f64,
    contact_gain: f64,
    zero_pa: f64,
    play_m: f64,
    gels_pa: [f64; 2],
    rng: ChaCha8Rng,
    known: HashMap<[u64; 3], Vec<Contact>>,
}

impl Palpator {
    /// A rig with errors that are drawn; none for a tip that is none.
    pub fn new(errors: Errors, seed: u64) -> Option<Self> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut draw = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, &mut rng);
        let usual = SoftTip::matl_2021();
        let fresh = SoftTip {
            body_pa: usual.body_pa * draw(errors.make_share).exp(),
            skin_n_m: usual.skin_n_m * draw(errors.make_share).exp(),
            ..usual
        };
        let aged = fresh.aged(draw(errors.ageing_share).exp() - 1.0);
        let gain = 1.0 + draw(errors.gain_share);
        let contact_gain = 1.0 + draw(errors.contact_share);
        let zero_pa = draw(errors.pressure_zero_pa);
        let rheometer = draw(errors.gel_share).exp();
        let gels_pa = GELS_PA.map(|e| e * rheometer);
        let play_m = errors.play_m * rng.random::<f64>();
        let rings = Rings::new(fresh.radius_m)?;
        let known = HashMap::new();
        let depth_m = 5e-3;
        Some(Self {
            errors,
            depth_m,
            drag_m: 0.0,
            fresh,
            aged,
            rings,
            gain,
            contact_gain,
            zero_pa,
            play_m,
            gels_pa,
            rng,
            known,
        })
    }

    fn draw(&mut self, sigma: f64) -> f64 {
        sigma * Distribution::<f64>::sample(&StandardNormal, &mut self.rng)
    }

    /// Presses of the fresh tip on both gels at some pressures; none where the skin has no solution.
    pub fn calibrate(&mut self, pressures_pa: &[f64]) -> Option<Vec<Calibration>> {
        let gain = 1.0 + self.draw(self.errors.gain_share);
        let mut samples = Vec::new();
        // A hundred pictures each.
        for &pressure_pa in pressures_pa {
            for (label_pa, modulus_pa) in GELS_PA.into_iter().zip(self.gels_pa) {
                let gel = Object { modulus_pa, radius_m: f64::INFINITY, dent: 0.0 };
                let contacts =
                    self.rings.press(&self.fresh, &gel, (pressure_pa + self.zero_pa).max(0.0), 6e-3)?;
                // Where the gel begins is found to a few hundredths of a millimetre.
                let begin_m = self.draw(1.5e-5);
                for c in contacts.iter().filter(|c| c.contact_m > 2.5e-3) {
                    let tip_m = gain * c.tip_m + self.draw(0.1 * self.errors.tip_noise_m);
                    let contact_m =
                        self.contact_gain * c.contact_m + self.draw(0.5 * self.errors.contact_noise_m);
                    let gel_m = c.travel_m + begin_m - tip_m;
                    // Where one of both hardly gives way, errors of the begin are large.
                    if tip_m.min(gel_m) < LEAST_M {
                        continue;
                    }
                    samples.push(Calibration { pressure_pa, tip_m, gel_m, contact_m, gel_pa: label_pa });
                }
            }
        }
        Some(samples)
    }

    /// Contacts of the tip as it is now; none where the skin has no solution.
    pub fn contacts(&mut self, object: &Object, pressure_pa: f64) -> Option<&[Contact]> {
        let key = [object.modulus_pa, object.radius_m, pressure_pa].map(f64::to_bits);
        if !self.known.contains_key(&key) {
            let truly_pa = (pressure_pa + self.zero_pa).max(0.0);
            let contacts = self.rings.press(&self.aged, object, truly_pa, self.depth_m + 1.5e-3)?;
            self.known.insert(key, contacts);
        }
        self.known.get(&key).map(Vec::as_slice)
    }

    /// Presses an object, in and out; none where the skin has no solution.
    pub fn press(&mut self, object: &Object, pressure_pa: f64) -> Option<Press> {
        let contacts = self.contacts(object, pressure_pa)?.to_vec();
        let (begin_m, mut zero_m) = (self.draw(1.5e-4), self.draw(5e-5));
        let largest = between(&contacts, self.depth_m - begin_m);
        let dent_m = object.dent * (largest.travel_m - largest.tip_m);
        let mut ways = READINGS.map(Vec::with_capacity);
        for (out, way) in ways.iter_mut().enumerate() {
            let n = READINGS[out];
            for k in 0..n {
                let part = k as f64 / (n as f64 - 1.0);
                let part = if out == 1 { 1.0 - part } else { part };
                let travel_m = -BEFORE_M + part * (self.depth_m + BEFORE_M);
                // On the way out the base is behind by the play, and the object by its dent.
                let late_m = if out == 1 { self.play_m - dent_m } else { 0.0 };
                let truly_m = travel_m - begin_m + late_m + self.draw(self.errors.travel_noise_m);
                let c = between(&contacts, truly_m);
                zero_m += self.draw(self.errors.tip_walk_m);
                let tip_m = self.gain * c.tip_m + zero_m + self.draw(self.errors.tip_noise_m);
                let seen_m = self.contact_gain * c.contact_m + self.draw(self.errors.contact_noise_m);
                // A contact of less than a millimetre does not show between the markers.
                let contact_m = if c.contact_m > 1e-3 { seen_m } else { 0.0 };
                let shear_m = self.drag_m * (c.contact_m / 5e-3).min(1.0) + self.draw(2e-5);
                way.push(Reading { travel_m, tip_m, contact_m, shear_m });
            }
        }
        let [loading, unloading] = ways;
        Some(Press { pressure_pa: pressure_pa + self.draw(5.0), loading, unloading })
    }
}

/// The contact at a travel, between those that were solved.
fn between(contacts: &[Contact], travel_m: f64) -> Contact {
    let none = Contact { travel_m: 0.0, tip_m: 0.0, contact_m: 0.0, force_n: 0.0 };
    let next =
        contacts.iter().position(|c| c.travel_m > travel_m).unwrap_or(contacts.len().saturating_sub(1));
    let (Some(after), Some(before)) = (contacts.get(next), next.checked_sub(1).and_then(|k| contacts.get(k)))
    else {
        return none;
    };
    let part = ((travel_m - before.travel_m) / (after.travel_m - before.travel_m)).clamp(0.0, 1.0);
    let mix = |a: f64, b: f64| a + part * (b - a);
    Contact {
        travel_m: mix(before.travel_m, after.travel_m),
        tip_m: mix(before.tip_m, after.tip_m),
        contact_m: mix(before.contact_m, after.contact_m),
        force_n: mix(before.force_n, after.force_n),
    }
}
