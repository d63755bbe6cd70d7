"""A pendulum in MuJoCo that knows of no friction, and lets others act on its joint: the program of docs/forces in another engine."""
import functools, json, math, sys
import mujoco

XML = """<mujoco><option gravity="0 0 -9.80665" timestep="0.004" integrator="implicitfast"/>
<worldbody><body><joint name="pivot" type="hinge" axis="0 1 0"/>
<inertial pos="0 0 -{length}" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body></worldbody></mujoco>"""
NAMES = {"abs": abs, "sign": lambda v: int(v > 0) - int(v < 0), "min": min, "max": max, "exp": math.exp, "sin": math.sin}

@functools.cache
def law(text):  # a force by position, speed and driving force
    return eval("lambda x, v, u: " + text, NAMES)

def swing(times, p, acts):
    force, friction = law(acts["force"]), law(acts["friction"])
    inertia = p["length_m"] ** 2  # forces are asked for an inertia of 1
    model = mujoco.MjModel.from_xml_string(XML.format(length=p["length_m"]))
    data, angles = mujoco.MjData(model), []
    data.qpos[0], before = p["released_rad"], (0.0, p["released_rad"])
    for until in times:
        while data.time < until - times[0] - 1e-9:
            x, v = float(data.qpos[0]), float(data.qvel[0])
            before = (data.time, x)
            data.qfrc_applied[0] = inertia * force(x, v, 0.0)
            model.dof_frictionloss[0] = inertia * friction(x, v, 0.0)
            mujoco.mj_step(model, data)
        (t0, a0), (t1, a1) = before, (data.time, data.qpos[0])
        angles.append(a0 + (a1 - a0) * (until - times[0] - t0) / (t1 - t0) if t1 > t0 else a1)
    return angles

for line in sys.stdin:
    q = json.loads(line)
    angles = swing(q["inputs"]["t_s"], q["parameters"], q["forces"]["pivot"])
    print(json.dumps({"id": q["id"], "channels": {"angle_rad": angles}}), flush=True)
