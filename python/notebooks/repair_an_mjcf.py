# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # Repair an MJCF file
#
# An arm of two links hangs from a ceiling and follows commands. Its MJCF file knows nothing of two things that the arm has: dry (Coulomb)
# friction in the elbow, and commands that come late. Both are found from three recordings, and the repaired file is written.
#
# It needs `pip install missing-physics[mujoco] mujoco[sysid]`.

# %%
import tempfile
from pathlib import Path

import mujoco
import numpy as np

import missing_physics as mp

FOLDER = Path(tempfile.mkdtemp())
FILE = FOLDER / "arm.xml"
FILE.write_text("""<mujoco model="arm">
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="RK4" gravity="0 0 -9.80665"><flag contact="disable"/></option>
  <worldbody>
    <body name="upper" pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" damping="0.05"/>
      <geom type="capsule" fromto="0 0 0 0 0 -0.35" size="0.03" mass="1.6"/>
      <body name="lower" pos="0 0 -0.35">
        <joint name="elbow" axis="0 1 0" damping="0.03"/>
        <geom type="capsule" fromto="0 0 0 0 0 -0.30" size="0.025" mass="0.9"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="shoulder_servo" joint="shoulder" kp="40" kv="3"/>
    <position name="elbow_servo" joint="elbow" kp="15" kv="1"/>
  </actuator>
  <sensor><jointpos name="shoulder_sensor" joint="shoulder"/><jointpos name="elbow_sensor" joint="elbow"/></sensor>
</mujoco>""")
JOINTS = ["shoulder", "elbow"]

# %% [markdown]
# ## The arm
#
# The arm is MuJoCo as well, yet not the file: another integrator with a twentieth of the step, friction of 0.5 N m in the elbow, commands
# 24 ms late. Its encoders are read every 10 ms with 1 mrad of noise.

# %%
FRICTION_N_M, DELAY_S, NOISE_RAD = 0.5, 0.024, 1e-3


def record(seed, seconds=1.2):
    rng = np.random.default_rng(seed)
    spec = mujoco.MjSpec.from_file(str(FILE))
    spec.option.timestep, spec.option.integrator = 0.0001, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.joint("elbow").frictionloss = FRICTION_N_M
    model = spec.compile()
    data = mujoco.MjData(model)
    t_s = 0.01 * np.arange(int(seconds / 0.01))
    told = [sum(rng.uniform(-0.5, 0.5) * np.sin(2 * np.pi * f * t_s) for f in (0.4, 0.9, 1.7)) for _ in JOINTS]
    data.qpos[:] = rng.uniform(-0.6, 0.6, 2)
    read = []
    for at in t_s:
        while data.time < at - 1e-9:
            row = max(int(np.floor((data.time - DELAY_S) / 0.01 + 1e-6)), 0)
            data.ctrl[:] = told[0][row], told[1][row]
            mujoco.mj_step(model, data)
        read.append(data.qpos.copy())
    read = np.array(read).T + NOISE_RAD * rng.standard_normal((2, t_s.size))
    return {"t_s": t_s, "shoulder_servo": told[0], "elbow_servo": told[1], "shoulder_rad": read[0], "elbow_rad": read[1]}


runs = [record(seed) for seed in range(3)]
unseen = [record(seed) for seed in (10, 11, 12)]

# %% [markdown]
# ## The diagnosis
#
# Every attribute of the joints, the actuators' forces, a delay of the commands, and the encoders' offsets and gains may be what the file has
# not right: sixteen mechanisms.

# %%
arm = mp.mujoco.model(FILE, joints=JOINTS)
answer = mp.diagnose(arm, runs, progress=False)
print(answer)
assert {"elbow-frictionloss", "command-delay"} <= set(answer.chosen)

# %% [markdown]
# ## The file, repaired and written

# %%
REPAIRED = FOLDER / "arm-repaired.xml"
print(answer.repaired().file(REPAIRED))


# %% [markdown]
# Unseen runs, each file simulated by MuJoCo alone from where the run began:


# %%
def error_rad(file, run):
    model = mujoco.MjModel.from_xml_path(str(file))
    data = mujoco.MjData(model)
    data.qpos[:] = run["shoulder_rad"][0], run["elbow_rad"][0]
    simulated = []
    for at in run["t_s"]:
        while data.time < at - 1e-9:
            row = int(np.floor(data.time / 0.01 + 1e-6))
            data.ctrl[:] = run["shoulder_servo"][row], run["elbow_servo"][row]
            mujoco.mj_step(model, data)
        simulated.append(data.qpos.copy())
    measured = np.stack([run["shoulder_rad"], run["elbow_rad"]], axis=1)
    return np.sqrt(np.mean((np.array(simulated) - measured) ** 2))


for at, run in enumerate(unseen):
    print(f"unseen run {at}: error {1e3 * error_rad(FILE, run):6.2f} mrad before, {1e3 * error_rad(REPAIRED, run):5.2f} mrad after")
    assert error_rad(REPAIRED, run) < 0.1 * error_rad(FILE, run)

# %% [markdown]
# ## Beside `mujoco.sysid`
#
# MuJoCo's own identification fits the parameters that it is told to, all of them at once. It gets the same recordings and the joints' damping,
# dry friction and armature; and a delay: first that of the sensors, which is the one that it offers, then, for those who know where to look,
# that of the actuators, as an attribute of the file.

# %%
from mujoco import sysid  # noqa: E402


def identified(delay_of_commands):
    spec = mujoco.MjSpec.from_file(str(FILE))
    parameters, transform = sysid.ParameterDict(), sysid.SignalTransform()
    for joint in JOINTS:
        damping = float(np.ravel(spec.joint(joint).damping)[0])
        for attribute, start, most in (("damping", damping, 1.0), ("frictionloss", 0.02, 2.0), ("armature", 0.001, 0.1)):

            def put(spec, parameter, joint=joint, attribute=attribute):
                element = spec.joint(joint)
                now = getattr(element, attribute)
                setattr(element, attribute, parameter.value[0] if np.ndim(now) == 0 else [parameter.value[0], *now[1:]])

            parameters.add(sysid.Parameter(f"{joint}_{attribute}", start, 0.0, most, modifier=put))

    def late(spec, parameter):
        for actuator in spec.actuators:
            actuator.delay, actuator.nsample, actuator.interp = parameter.value[0], 60, 1

    parameters.add(sysid.Parameter("delay_s", 0.005, 0.0, 0.1, modifier=late if delay_of_commands else None))
    if delay_of_commands:
        late(spec, parameters["delay_s"])
    else:
        transform.delay("*", parameters["delay_s"])
    model = spec.compile()
    step_s = model.opt.timestep
    begun, controls, readings = [], [], []
    for run in runs:
        begun.append(sysid.create_initial_state(model, np.array([run["shoulder_rad"][0], run["elbow_rad"][0]])))
        steps_s = step_s * np.arange(int(run["t_s"][-1] / step_s) + 2)
        held = np.minimum(np.floor(steps_s / 0.01 + 1e-6).astype(int), len(run["t_s"]) - 1)
        controls.append(sysid.TimeSeries(steps_s, np.stack([run["shoulder_servo"][held], run["elbow_servo"][held]], axis=1)))
        readings.append(sysid.TimeSeries.from_names(run["t_s"], np.stack([run["shoulder_rad"], run["elbow_rad"]], axis=1), model))
    sequences = sysid.ModelSequences("arm", spec, [f"run{k}" for k in range(len(runs))], begun, controls, readings)
    residual = sysid.build_residual_fn(models_sequences=[sequences], modify_residual=transform.apply)
    fitted, result = sysid.optimize(parameters, residual, optimizer="scipy", verbose=False)
    left, _, _ = residual(result.x, fitted.copy())
    _, half = sysid.calculate_intervals(left, result.jac)
    return {name: f"{value:.4f} +- {width:.4f}" for name, value, width in zip(fitted.keys(), fitted.as_vector(), half)}


of_sensors, of_commands = identified(False), identified(True)

# %%
concealed = {"elbow_frictionloss": FRICTION_N_M, "delay_s": DELAY_S, "shoulder_damping": 0.05, "elbow_damping": 0.03}
found = answer.parameters
print(f"{'':24}{'concealed':>10}   {'sysid, late sensors':<22}{'sysid, late commands':<22}missing-physics")
for name in of_sensors:
    estimate = found.get("command_delay_s" if name == "delay_s" else name)
    said = "as in the file" if estimate is None else f"{estimate.value:.4f} ({estimate.ci95[0]:.4f} to {estimate.ci95[1]:.4f})"
    print(f"{name:24}{concealed.get(name, 0.0):>10}   {of_sensors[name]:<22}{of_commands[name]:<22}{said}")

# %% [markdown]
# `mujoco.sysid` says the best value of each parameter that was freed, by how much it is uncertain if the model is right, and nothing of which
# were needed, nor whether anything is left: with the wrong delay it fits other numbers, as surely. The diagnosis says which two of sixteen
# the recordings ask for, that the rest is noise, and leaves everything else as the file has it.
