"""A simulator that takes forces on its joint is asked about friction that it knows nothing of."""

import math

import numpy as np
import pytest

import missing_physics as mp
from missing_physics import errors

T_S = 0.02 * np.arange(120)


def command(seed):
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(-2.0, 2.0, 12), 10)


def slider(parameters, inputs, forces):
    """A slider of 1 kg under a force that holds from row to row, by velocity Verlet."""
    acts, steps = forces["slider"], 10
    h = (inputs["t_s"][1] - inputs["t_s"][0]) / steps
    x, v, read = 0.0, 0.0, []

    def kick(v, u):  # for half a step; friction stops the slider, and does not turn it round
        v += 0.5 * h * (u - parameters["damping_kg_s"] * v + acts.force(x, v, u))
        return math.copysign(max(abs(v) - 0.5 * h * acts.friction(x, v, u), 0.0), v)

    for u in inputs["drive_n"]:
        read.append(x)
        for _ in range(steps):
            v = kick(v, u)
            x += h * v
            v = kick(v, u)
        if not abs(x) < 1e3:
            raise mp.NoPrediction("it flies away")
    return {"x_m": np.array(read)}


def recorded(seed, friction=0.0, late_s=0.0):
    """The same slider by Euler's steps of 20 us, with friction of its own and a late command, read to half a millimetre."""
    drive, h = command(seed), 2e-5
    x, v, read = 0.0, 0.0, []
    for step in range(round(T_S.size * 0.02 / h)):
        t = step * h
        if step % 1000 == 0:
            read.append(x)
        u = drive[max(min(int((t - late_s) / 0.02 + 1e-9), drive.size - 1), 0)]
        pushed = v + h * (u - 0.5 * v)
        brake = h * friction
        v = 0.0 if abs(pushed) <= brake else pushed - math.copysign(brake, pushed)
        x += h * v
    noise = 5e-4 * np.random.default_rng(100 + seed).standard_normal(T_S.size)
    return {"t_s": T_S, "drive_n": drive, "x_m": np.array(read) + noise}


def model(**more):
    joint = mp.Joint("slider", position="x_m", typical_force=1.0, force_unit="N", driven=True)
    damping = mp.Parameter("damping_kg_s", start=0.4, lower=0.0, scale=0.1)
    return mp.Model(slider, [damping], joints=[joint], acts={"drive_n": "hold"}, inputs=["t_s", "drive_n"], **more)


def test_friction_that_the_simulator_knows_nothing_of_is_named():
    answer = mp.diagnose(model(), [recorded(seed, friction=0.3) for seed in (1, 2)])
    assert (answer.verdict, answer.chosen) == ("explained", ["coulomb-friction"])
    low, high = answer.parameters["level"].ci95
    assert low < 0.3 < high and high - low < 0.1 and answer.parameters["level"].unit == "N"
    unseen = recorded(5, friction=0.3)
    predicted = answer.repaired().predict({"t_s": unseen["t_s"], "drive_n": unseen["drive_n"]})
    assert np.abs(predicted["x_m"] - unseen["x_m"]).max() < 4e-3


def test_a_late_command_is_named():
    answer = mp.diagnose(model(), [recorded(seed, late_s=0.013) for seed in (1, 2)])
    assert (answer.verdict, answer.chosen) == ("explained", ["input-delay"])
    assert answer.parameters["delay_s"].value == pytest.approx(0.013, abs=5e-4)


def test_where_nothing_acts_nothing_is_named():
    assert mp.diagnose(model(), [recorded(seed) for seed in (1, 2)]).verdict == "adequate"


def test_what_a_joint_lacks_is_said():
    joint = mp.Joint("slider", position="place_m", typical_force=1.0)
    with pytest.raises(errors.RecordingError, match="range"):
        mp.diagnose(mp.Model(slider, joints=[joint], inputs=["t_s", "drive_n"], channels=["x_m"]), [recorded(1)])
