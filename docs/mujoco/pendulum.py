"""The pendulum of recordings/swing in MuJoCo: one question as a line of JSON in, one answer as a line of JSON out."""
import json, sys
import mujoco

XML = """<mujoco><option gravity="0 0 -9.80665" timestep="0.002" integrator="implicitfast"/>
<worldbody><body><joint name="pivot" type="hinge" axis="0 1 0" damping="{damping}" frictionloss="{friction}"/>
<inertial pos="0 0 -{length}" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body></worldbody></mujoco>"""

def swing(times, p):
    inertia = p["length_m"] ** 2
    model = mujoco.MjModel.from_xml_string(XML.format(
        length=p["length_m"], damping=2 * p["damping_per_s"] * inertia, friction=p["friction_rad_s2"] * inertia))
    data, angles = mujoco.MjData(model), []
    data.qpos[0], before = p["released_rad"], (0.0, p["released_rad"])
    for until in times:
        while data.time < until - times[0] - 1e-9:
            before = (data.time, data.qpos[0])
            data.qfrc_applied[0] = -p["drag"] * inertia * abs(data.qvel[0]) * data.qvel[0]
            mujoco.mj_step(model, data)
        (t0, a0), (t1, a1) = before, (data.time, data.qpos[0])
        angles.append(a0 + (a1 - a0) * (until - times[0] - t0) / (t1 - t0) if t1 > t0 else a1)
    return angles

for line in sys.stdin:
    question = json.loads(line)
    angles = swing(question["inputs"]["t_s"], question["parameters"])
    print(json.dumps({"id": question["id"], "channels": {"angle_rad": angles}}), flush=True)
