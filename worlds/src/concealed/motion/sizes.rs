//! How large a machine's motions, commands and readings are where nothing is left out.

use crate::physics::machine::{Effects, MachineWorld};

/// Sizes of a machine's motion.
pub(super) struct Sizes {
    pub(super) joints: Vec<OfJoint>,
    /// Smallest and largest command.
    pub(super) command: [f64; 2],
    /// Smallest and largest reading, by output.
    pub(super) outputs: Vec<[f64; 2]>,
    pub(super) row_s: f64,
    /// The longest run, s.
    pub(super) duration_s: f64,
}

/// Sizes of a joint's motion.
pub(super) struct OfJoint {
    /// Root mean square.
    pub(super) acceleration: f64,
    /// Root mean square.
    pub(super) speed: f64,
    /// Largest modulus of the position.
    pub(super) reach: f64,
    /// Smallest and largest position.
    pub(super) range: [f64; 2],
}

impl OfJoint {
    pub(super) fn span(&self) -> f64 {
        self.range[1] - self.range[0]
    }
}

impl Sizes {
    pub(super) fn of(world: &MachineWorld) -> Self {
        let states: Vec<Vec<[f64; 4]>> = (0..world.runs.len()).map(|run| world.states(run)).collect();
        let all = |state: usize| states.iter().flatten().map(move |x| x[state]);
        let joints = world.plant.joints().iter().map(|joint| {
            let changes = states.iter().flat_map(|run| {
                run.windows(2).map(|w| (w[1][joint.velocity] - w[0][joint.velocity]) / world.row_s)
            });
            let range = extremes(all(joint.position));
            OfJoint {
                acceleration: rms(changes),
                speed: rms(all(joint.velocity)),
                reach: range[0].abs().max(range[1].abs()).max(1e-9),
                range,
            }
        });
        let outputs = (0..world.plant.outputs().len()).map(|output| {
            let columns = (0..world.runs.len()).map(|run| world.readings(run, &Effects::default()));
            extremes(columns.flat_map(|mut c| c.swap_remove(output)))
        });
        let longest = world.runs.iter().map(|run| run.rows).max().unwrap_or(0);
        Self {
            joints: joints.collect(),
            command: extremes(world.runs.iter().flat_map(|run| run.command.iter().copied())),
            outputs: outputs.collect(),
            row_s: world.row_s,
            duration_s: longest as f64 * world.row_s,
        }
    }

    pub(super) fn command_span(&self) -> f64 {
        self.command[1] - self.command[0]
    }

    pub(super) fn output_span(&self, output: usize) -> f64 {
        self.outputs[output][1] - self.outputs[output][0]
    }
}

fn extremes(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), v| (sum + v * v, count + 1.0));
    (sum / f64::max(count, 1.0)).sqrt().max(1e-9)
}
