//! The domain `motion`: machines with concealed effects.

mod kinds;
mod plants;
mod sizes;

use std::fmt::Write as _;

use rand_chacha::ChaCha8Rng;

use super::draw::{self, between, choose, log_between, stated, whole};
use super::key::{Hidden, Key, Place};
use super::nuisances::{Nuisances, difference, size_of_strength};
use super::rig::{Choice, Rig};
use crate::noise::Noise;
use crate::physics::machine::{Effects, MachineWorld, Run, Unlisted, What};
use kinds::{Kind, Shapes};
use sizes::Sizes;

/// Kinds of machines.
const PLANTS: usize = 8;
/// Kinds of what is on no list.
const UNLISTED: usize = 4;
/// A mechanism of which the baseline takes all but this part has nothing to show.
const BEYOND: f64 = 0.03;
/// The strength at which that is judged, in sigmas.
const CLEAR: f64 = 30.0;
/// A run in which an effect acts has its readings moved by this many sigmas together.
const MOVED: f64 = 3.0;

/// A machine with its sensors.
pub(crate) struct Machine {
    world: MachineWorld,
    /// Of each output.
    noises: Vec<Noise>,
    sizes: Sizes,
    shapes: Shapes,
    listed: Vec<Kind>,
    /// What the baseline can take away, in sigmas.
    nuisances: Nuisances,
    /// Readings where nothing is hidden, in sigmas.
    baseline: Vec<f64>,
    unlisted: [Unlisted; UNLISTED],
}

impl Rig for Machine {
    const DOMAIN: &'static str = "motion";
    type Effects = Effects;

    fn draw(hidden: Hidden, rng: &mut ChaCha8Rng) -> (Self, Choice) {
        let machine = Self::drawn(whole(rng, 0, PLANTS - 1), rng);
        // Dry friction that differs with the direction is some only where there is dry friction.
        let alone: Vec<usize> = (0..machine.listed.len())
            .filter(|l| !matches!(machine.listed[*l], Kind::Asymmetric(_)) && machine.shows(*l))
            .collect();
        let mut listed = Vec::new();
        for _ in 0..50 {
            listed = choose(rng, alone.len(), hidden.listed()).into_iter().map(|l| alone[l]).collect();
            match listed.as_slice() {
                [first, second] => {
                    let [first, second] = [first, second].map(|l| machine.listed[*l].place());
                    if first != second || first == 0 {
                        break;
                    }
                }
                _ => break,
            }
        }
        if let &[first, _] = listed.as_slice()
            && let Kind::Coulomb(joint) = machine.listed[first]
            && whole(rng, 0, 3) == 0
            && let Some(asymmetric) = machine.listed.iter().position(|k| *k == Kind::Asymmetric(joint))
        {
            listed[1] = asymmetric;
        }
        let placed: Vec<usize> = (0..UNLISTED).filter(|k| machine.place(*k).is_some()).collect();
        let unlisted = match hidden {
            Hidden::Local if !placed.is_empty() => placed[whole(rng, 0, placed.len() - 1)],
            _ => whole(rng, 0, UNLISTED - 1),
        };
        (machine, Choice { listed, unlisted })
    }

    fn candidates(&self) -> Vec<usize> {
        (0..self.listed.len()).collect()
    }

    fn nuisances(&self) -> Nuisances {
        self.nuisances.clone()
    }

    fn response(&self, effects: Effects) -> Vec<f64> {
        difference(&self.baseline, &self.readings(&self.world, &effects))
    }

    fn size_bounds(&self, listed: usize) -> [f64; 2] {
        self.listed[listed].bounds(&self.sizes)
    }

    fn apply(&self, effects: &mut Effects, listed: usize, size: f64) {
        self.listed[listed].apply(effects, size, &self.shapes, &self.sizes);
    }

    fn describe(&self, effects: &Effects, listed: usize, key: &mut Key) {
        self.listed[listed].describe(effects, &self.world, key);
    }

    fn unlisted_size_bounds(&self, which: usize) -> [f64; 2] {
        let force = self
            .sizes
            .joints
            .first()
            .map_or_else(|| self.sizes.output_span(0) / self.sizes.duration_s, |joint| joint.acceleration);
        let speed = self.sizes.joints.first().map_or(self.sizes.output_span(0), |joint| joint.speed);
        match self.unlisted[which].what {
            What::Change => [1e-4 * force / speed, 0.5 * force / speed],
            _ => [1e-4 * force, force],
        }
    }

    fn unlisted(&self, beside: Effects, which: usize, sign: f64, size: f64) -> Effects {
        let kind = self.unlisted[which];
        let sign = if kind.what == What::Change { 1.0 } else { sign };
        Effects { unlisted: Unlisted { size: sign * size, ..kind }, ..beside }
    }

    fn describe_unlisted(&self, which: usize, key: &mut Key) {
        let Unlisted { what, run, .. } = self.unlisted[which];
        let text = match what {
            What::Push => format!("a push in run {}", run + 1),
            What::Patch => "a bump in a range of positions".into(),
            What::Hum => "a force that comes and goes".into(),
            What::Change => format!("more resistance from run {} on", run + 1),
        };
        key.unlisted = Some(text);
        key.place = self.place(which);
    }

    /// A bump is in the runs that it moves: a flank is felt where it is steep, and a machine may creep over the top.
    fn where_shown(&self, place: Place, change: &[f64]) -> Place {
        if !place.runs.is_empty() {
            return place;
        }
        let mut rest = change;
        let mut moved = |run: &Run| {
            let of_run;
            (of_run, rest) = rest.split_at(run.rows * self.noises.len());
            of_run.iter().map(|c| c * c).sum::<f64>().sqrt() >= MOVED
        };
        place
            .in_the_runs(self.world.runs.iter().enumerate().map(|(r, run)| ((r + 1).to_string(), moved(run))))
    }

    fn files(self, effects: Effects, rng: &mut ChaCha8Rng) -> [String; 2] {
        let header = self.header(rng);
        let input = plants::statement(&self.world.plant).input;
        let names: Vec<&str> =
            input.into_iter().chain(self.world.plant.outputs().iter().map(|o| o.0)).collect();
        let mut data = format!("run,t_s,{}\n", names.join(","));
        for (number, run) in self.world.runs.iter().enumerate() {
            let mut columns = self.world.readings(number, &effects);
            for (column, noise) in columns.iter_mut().zip(&self.noises) {
                noise.apply(column, rng);
            }
            for row in 0..run.rows {
                let _ = write!(data, "{},{:.4}", number + 1, row as f64 * self.world.row_s);
                if let Some(command) = run.command.get(row) {
                    let _ = write!(data, ",{command}");
                }
                for column in &columns {
                    let _ = write!(data, ",{:.7}", column[row]);
                }
                data.push('\n');
            }
        }
        [header, data]
    }
}

impl Machine {
    fn drawn(which: usize, rng: &mut ChaCha8Rng) -> Self {
        let world = plants::draw(which, rng);
        let sizes = Sizes::of(&world);
        let noises: Vec<Noise> = (0..world.plant.outputs().len())
            .map(|output| {
                let sigma = sizes.output_span(output) * log_between(rng, 3e-4, 6e-3);
                draw::noise(rng, sigma)
            })
            .collect();
        let unlisted = Self::strange(&world, &sizes, rng);
        let mut machine = Self {
            listed: kinds::all(&world),
            shapes: Shapes::draw(rng),
            world,
            noises,
            sizes,
            nuisances: Nuisances::default(),
            baseline: Vec::new(),
            unlisted,
        };
        machine.baseline = machine.readings(&machine.world, &Effects::default());
        machine.nuisances = machine.taken();
        machine
    }

    /// Where an unlisted effect acts, if at a place.
    fn place(&self, which: usize) -> Option<Place> {
        let Unlisted { what, at, width, run, .. } = self.unlisted[which];
        match what {
            What::Push => {
                let place = Place::new("t_s", at - width, f64::INFINITY);
                Some(place.in_runs([(run + 1).to_string()]))
            }
            What::Patch => {
                let position = self.world.plant.joints().first().map_or(0, |joint| joint.position);
                let outputs = self.world.plant.outputs();
                let (name, _) = outputs.iter().find(|o| o.1 == position)?;
                Some(Place::new(name, at - 2.0 * width, at + 2.0 * width))
            }
            What::Change => {
                let later = (run..self.world.runs.len()).map(|run| (run + 1).to_string());
                Some(Place::new("run", f64::NEG_INFINITY, f64::INFINITY).in_runs(later))
            }
            What::Hum => None,
        }
    }

    /// What of the unlisted could happen to a machine.
    fn strange(world: &MachineWorld, sizes: &Sizes, rng: &mut ChaCha8Rng) -> [Unlisted; UNLISTED] {
        let run = whole(rng, 0, world.runs.len() - 1);
        let lasts_s = world.runs[run].rows as f64 * world.row_s;
        let [low, high] = sizes.joints.first().map_or(sizes.outputs[0], |joint| joint.range);
        let push = Unlisted {
            run,
            at: lasts_s * between(rng, 0.2, 0.7),
            width: world.row_s * between(rng, 2.0, 5.0),
            ..Unlisted::default()
        };
        let patch = Unlisted {
            what: What::Patch,
            at: low + (high - low) * between(rng, 0.25, 0.75),
            width: (high - low) * between(rng, 0.03, 0.06),
            ..Unlisted::default()
        };
        // Ten times in a run or more.
        let omega = std::f64::consts::TAU / sizes.duration_s * between(rng, 8.0, 20.0);
        let hum = Unlisted { what: What::Hum, at: omega, ..Unlisted::default() };
        let half = world.runs.len().div_ceil(2);
        let change = Unlisted { what: What::Change, run: half, ..Unlisted::default() };
        [push, patch, hum, change]
    }

    /// All readings in sigmas, run by run, output by output.
    fn readings(&self, world: &MachineWorld, effects: &Effects) -> Vec<f64> {
        (0..world.runs.len()).flat_map(|run| self.in_sigmas(world.readings(run, effects))).collect()
    }

    fn in_sigmas(&self, columns: Vec<Vec<f64>>) -> Vec<f64> {
        let scaled = columns.into_iter().zip(&self.noises).flat_map(|(column, noise)| {
            let sigma = draw::sigma(noise);
            column.into_iter().map(move |x| x / sigma)
        });
        scaled.collect()
    }

    /// What the baseline's constants and the states at each run's start can do.
    fn taken(&self) -> Nuisances {
        let statement = plants::statement(&self.world.plant);
        let mut nuisances = Nuisances::default();
        for (which, _) in statement.constants.iter().enumerate().filter(|(_, c)| !c.2) {
            let plant = plants::with_constant(self.world.plant, which, 1.001);
            let other = MachineWorld { plant, ..self.world.clone() };
            nuisances.add(&difference(&self.baseline, &self.readings(&other, &Effects::default())));
        }
        if statement.from_rest {
            return nuisances;
        }
        let mut before = 0;
        for run in &self.world.runs {
            let rows = run.rows * self.noises.len();
            for state in 0..self.world.plant.states() {
                let mut start = run.start;
                start[state] += 1e-3;
                let other = Run { start, ..run.clone() };
                let alone = MachineWorld { runs: vec![other], ..self.world.clone() };
                let mut column = vec![0.0; self.baseline.len()];
                let moved = self.in_sigmas(alone.readings(0, &Effects::default()));
                let part = before..before + rows;
                column[part.clone()].copy_from_slice(&difference(&self.baseline[part], &moved));
                nuisances.add(&column);
            }
            before += rows;
        }
        nuisances
    }

    /// Whether the baseline leaves something of a mechanism.
    fn shows(&self, listed: usize) -> bool {
        let size_of = |size| Nuisances::default().residual_norm(&self.response(self.alone(listed, size)));
        let size = size_of_strength(CLEAR, self.size_bounds(listed), size_of);
        let response = self.response(self.alone(listed, size));
        let whole = Nuisances::default().residual_norm(&response);
        whole > 0.0 && self.nuisances.residual_norm(&response) > BEYOND * whole
    }

    fn header(&self, rng: &mut ChaCha8Rng) -> String {
        let statement = plants::statement(&self.world.plant);
        let named = |pairs: &[(&str, &str)]| {
            let pairs: Vec<String> =
                pairs.iter().map(|(name, text)| format!("{name} = \"{text}\"")).collect();
            format!("{{ {} }}", pairs.join(", "))
        };
        let outputs: Vec<(&str, &str)> = self
            .world
            .plant
            .outputs()
            .iter()
            .map(|(name, state)| (*name, statement.states[*state].0))
            .collect();
        let mut header = String::from("format = 1\ndomain = \"motion\"\ndata = \"data.csv\"\n");
        if whole(rng, 0, 2) > 0 {
            header.push_str("\n[noise]\n");
            for ((name, _), noise) in outputs.iter().zip(&self.noises) {
                let _ = writeln!(header, "{name} = {:.3e}", stated(rng, noise));
            }
        }
        let _ = write!(
            header,
            "\n[model]\nstates = {}\noutputs = {}\n",
            named(statement.states),
            named(&outputs)
        );
        if let Some(input) = statement.input {
            let between = if self.world.linear { "linear" } else { "hold" };
            let _ = writeln!(header, "inputs = {}", named(&[(input, between)]));
        }
        let constants = plants::constants(&self.world.plant);
        for (&(name, unit, known), value) in statement.constants.iter().zip(constants) {
            // The true value, or what somebody would have guessed.
            let (key, value) =
                if known { ("value", value) } else { ("start", value * log_between(rng, 0.75, 1.3)) };
            let value = if known { format!("{value}") } else { format!("{value:.3e}") };
            let _ =
                write!(header, "\n[[parameter]]\nname = \"{name}\"\nunit = \"{unit}\"\n{key} = {value}\n");
        }
        if statement.from_rest {
            header.push_str("\n[start]\n");
            for (state, _) in statement.states {
                let _ = writeln!(header, "{state} = 0.0");
            }
        }
        for joint in self.world.plant.joints() {
            let [position, velocity] = [joint.position, joint.velocity].map(|s| statement.states[s].0);
            let _ = write!(
                header,
                "\n[[joint]]\nname = \"{}\"\nposition = \"{position}\"\nvelocity = \"{velocity}\"\n",
                joint.name
            );
            if let Some(input) = statement.input.filter(|_| joint.driven) {
                let _ = writeln!(header, "drive = \"{input}\"");
            }
            if joint.turns {
                header.push_str("turns = true\n");
            }
        }
        if let Some(level) = self.world.plant.level() {
            let _ = write!(header, "\n[[level]]\nstate = \"{}\"\n", statement.states[level].0);
        }
        header
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng as _;

    use super::*;

    /// Every mechanism of every machine is seen in its readings; what its baseline says already is found out.
    #[test]
    fn every_effect_changes_the_readings() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for which in 0..PLANTS {
            let machine = Machine::drawn(which, &mut rng);
            for listed in machine.candidates() {
                let [low, high] = machine.size_bounds(listed);
                let kind = machine.listed[listed];
                let moved =
                    Nuisances::default().residual_norm(&machine.response(machine.alone(listed, high)));
                let faint = Nuisances::default().residual_norm(&machine.response(machine.alone(listed, low)));
                if !matches!(kind, Kind::Asymmetric(_)) {
                    assert!(moved > 10.0 && moved > faint, "{which}: {kind:?} {faint} {moved}");
                }
            }
            for unlisted in 0..UNLISTED {
                let all = machine.unlisted(
                    Effects::default(),
                    unlisted,
                    1.0,
                    machine.unlisted_size_bounds(unlisted)[1],
                );
                let left = machine.nuisances.residual_norm(&machine.response(all));
                assert!(left > 5.0, "{which}: {unlisted} {left}");
            }
            let says =
                |kind| machine.listed.iter().position(|k| *k == kind).is_some_and(|l| machine.shows(l));
            assert!(!says(Kind::Damping(0, 0)), "{which}");
            assert!(which == 5 || says(Kind::Coulomb(0)), "{which}");
        }
    }

    /// Other constants and starts are nothing new.
    #[test]
    fn the_baseline_takes_what_is_its_own() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        for which in 0..PLANTS {
            let machine = Machine::drawn(which, &mut rng);
            let mut other = machine.world.clone();
            let free = plants::statement(&other.plant).constants.iter().position(|c| !c.2);
            other.plant = plants::with_constant(other.plant, free.unwrap(), 1.0002);
            if !plants::statement(&other.plant).from_rest {
                other.runs[1].start[0] += 2e-4;
            }
            let moved = difference(&machine.baseline, &machine.readings(&other, &Effects::default()));
            let whole = Nuisances::default().residual_norm(&moved);
            assert!(machine.nuisances.residual_norm(&moved) < 0.02 * whole, "{which}");
        }
    }
}
