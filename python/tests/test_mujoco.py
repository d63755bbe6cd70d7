"""An MJCF file as a model: what it predicts is what MuJoCo says of the file that it writes."""

import pickle

import numpy as np
import pytest

import missing_physics as mp
from missing_physics import errors

mujoco = pytest.importorskip("mujoco")

ARM = """<mujoco><compiler angle="radian"/><option timestep="0.002"><flag contact="disable"/></option>
<worldbody><body name="upper"><joint name="shoulder" axis="0 1 0" damping="0.05"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.35" size="0.03" mass="1.6"/>
<body name="lower" pos="0 0 -0.35"><joint name="elbow" axis="0 1 0" damping="0.03"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.025" mass="0.9"/></body></body></worldbody>
<actuator><position name="lift" joint="shoulder" kp="40" kv="3"/><motor name="bend" joint="elbow" gear="2"/></actuator></mujoco>"""

PENDULUM = """<mujoco><option timestep="0.01" integrator="RK4"/><worldbody><body><joint name="pivot" axis="0 1 0" damping="0.01"/>
<geom type="capsule" fromto="0 0 0 0 0 -0.5" size="0.02" mass="1"/></body></worldbody></mujoco>"""


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.xml").write_text(ARM, encoding="utf-8")
    return mp.mujoco.model(tmp_path / "arm.xml", channels=["shoulder_rad", "elbow_rad", "elbow_rad_s"])


def told(rows=60):
    t_s = 0.01 * np.arange(rows)
    return {"t_s": t_s, "lift": 0.5 * np.sin(5 * t_s), "bend": np.where(t_s > 0.2, 0.4, -0.2)}


def stepped(xml, begun, inputs, rows):
    """The same by MuJoCo alone, step by step."""
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    mujoco.mj_resetData(model, data)
    data.qpos[:] = begun
    read, row = [], 0
    while len(read) < rows:
        if abs(data.time - inputs["t_s"][len(read)]) < 1e-9:
            read.append([*data.qpos, data.qvel[1]])
        row = min(int(np.floor(data.time / 0.01 + 1e-6)), rows - 1)
        data.ctrl[:] = inputs["lift"][row], inputs["bend"][row]
        mujoco.mj_step(model, data)
    return np.array(read).T


SETS = {
    "shoulder_rad_at_start": 0.2,
    "elbow_rad_at_start": -0.3,
    "elbow_frictionloss": 0.15,
    "elbow_damping": 0.02,
    "shoulder_armature": 0.01,
    "shoulder_stiffness": 1.5,
    "lift_gain": 0.9,
    "bend_gain": 1.2,
}


def asked(**change):
    return {name: np.array([value, value]) for name, value in {**SETS, **change}.items()}


def test_predictions_are_those_of_the_file_that_is_written(arm):
    inputs = told()
    predicted = arm.predict(asked(), inputs)
    alone = stepped(arm.file(SETS), [0.2, -0.3], inputs, 60)
    for channel, expected in zip(arm.channels, alone):
        assert predicted[channel].shape == (2, 60) and np.array_equal(*predicted[channel])
        assert np.abs(predicted[channel][0] - expected).max() < 1e-5 * max(1.0, np.abs(expected).max()), channel


def test_a_delay_is_that_of_the_file(arm):
    inputs = told()
    # MuJoCo's buffer holds zeros before a run, the model what the first row says: the same where that is zero.
    inputs["bend"] = np.where(inputs["t_s"] > 0.2, 0.4, 0.0)
    late = arm.predict(asked(command_delay_s=0.0173), inputs)
    alone = stepped(arm.file({**SETS, "command_delay_s": 0.0173}), [0.2, -0.3], inputs, 60)
    on_time = arm.predict(asked(), inputs)
    for channel, expected in zip(arm.channels, alone):
        least = np.abs(on_time[channel][0] - expected).max()
        assert np.abs(late[channel][0] - expected).max() < 0.02 * least, channel


def test_sets_do_not_touch_each_other_and_a_model_pickles(arm):
    inputs = told()
    both = {name: np.array([value, 1.1 * value]) for name, value in SETS.items()}
    together = arm.predict(both, inputs)
    again = pickle.loads(pickle.dumps(arm))
    for k in (1, 0):
        alone = again.predict({name: values[k : k + 1] for name, values in both.items()}, inputs)
        assert all(np.array_equal(alone[channel][0], together[channel][k]) for channel in arm.channels)
    assert again.file(SETS) == arm.file(SETS)


def swing(friction, seed, seconds=1.6):
    """A pendulum with dry friction in scaled steps: MuJoCo with another integrator and a hundredth of the step, read to 1 mrad."""
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec.from_string(PENDULUM)
    spec.option.timestep, spec.option.integrator = 0.0001, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.joint("pivot").frictionloss = friction
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[0] = rng.uniform(0.5, 0.9)
    t_s, read = 0.02 * np.arange(int(seconds / 0.02)), []
    for at in t_s:
        while data.time < at - 1e-9:
            mujoco.mj_step(model, data)
        read.append(data.qpos[0])
    return {"t_s": t_s, "pivot_rad": np.array(read) + 1e-3 * rng.standard_normal(t_s.size)}


def test_concealed_friction_is_found_and_written(tmp_path):
    (tmp_path / "pendulum.xml").write_text(PENDULUM, encoding="utf-8")
    model = mp.mujoco.model(tmp_path / "pendulum.xml", mechanisms=["frictionloss", "damping", "armature"])
    answer = mp.diagnose(model, [swing(0.03, seed) for seed in (1, 2)])
    assert (answer.verdict, answer.chosen) == ("explained", ["pivot-frictionloss"])
    assert answer.parameters["pivot_frictionloss"].value == pytest.approx(0.03, rel=0.05)
    repaired = answer.repaired()
    text = repaired.file(tmp_path / "repaired.xml")
    written = mujoco.MjModel.from_xml_string(text)
    assert written.dof_frictionloss[0] == pytest.approx(repaired.parameters["pivot_frictionloss"], rel=1e-5)
    assert (tmp_path / "repaired.xml").read_text(encoding="utf-8") == text
    unseen = swing(0.03, 9)
    begun = {**unseen, "pivot_rad": np.where(unseen["t_s"] < 0.3, unseen["pivot_rad"], np.nan)}
    assert np.sqrt(np.mean((repaired.predict(begun)["pivot_rad"] - unseen["pivot_rad"]) ** 2)) < 2e-3
    again = mp.mujoco.model(tmp_path / "repaired.xml", mechanisms=["damping"])
    assert mp.diagnose(again, [swing(0.03, seed) for seed in (1, 2)]).verdict == "adequate"


def test_what_a_file_has_not_is_said(tmp_path):
    path = tmp_path / "arm.xml"
    path.write_text(ARM, encoding="utf-8")
    for arguments, match in [
        ({"joints": ["wrist"]}, "no joint wrist of one degree of freedom; it has shoulder, elbow"),
        ({"channels": ["wrist_rad"]}, "no channel wrist_rad, expected some of shoulder_rad, shoulder_rad_s, elbow_rad"),
        ({"mechanisms": ["friction"]}, "no mechanism friction, expected some of damping, frictionloss"),
        ({"free": ["elbow.dampings"]}, "no attribute elbow.dampings"),
    ]:
        with pytest.raises(errors.DiagnosisError, match=match):
            mp.mujoco.model(path, **arguments)
    free = mp.mujoco.model(path, free=["elbow.damping"])
    assert "elbow_damping" in [each.name for each in free.parameters]
    assert "elbow-damping" not in [each.id for each in free.mechanisms]
    with pytest.raises(errors.RecordingError, match="bend"):
        mp.diagnose(free, [{"t_s": np.arange(9.0), "lift": 0.0, "shoulder_rad": np.zeros(9), "elbow_rad": np.zeros(9)}])
    with pytest.raises(errors.RepairError, match="no file of its own"):
        mp.Repaired("{}", None).file()
