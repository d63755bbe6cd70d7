"""A pendulum that knows of no friction, and lets others act on its joint."""
import functools, json, math, sys

NAMES = {"abs": abs, "sign": lambda v: int(v > 0) - int(v < 0), "min": min, "max": max, "exp": math.exp, "sin": math.sin}

@functools.cache
def law(text):  # a force by position, speed and driving force
    return eval("lambda x, v, u: " + text, NAMES)

def swing(times, p, acts):
    force, friction = law(acts["force"]), law(acts["friction"])
    pull, h = -9.80665 / p["length_m"], 0.004
    x, v, t, angles, before = p["released_rad"], 0.0, times[0], [], (times[0], p["released_rad"])

    def kick(x, v):  # for half a step; friction stops the joint, and does not turn it round
        v += 0.5 * h * (pull * math.sin(x) + force(x, v, 0.0))
        return math.copysign(max(abs(v) - 0.5 * h * friction(x, v, 0.0), 0.0), v)

    for until in times:
        while t < until - 1e-9:
            before = (t, x)
            v = kick(x, v)
            x += h * v
            v = kick(x, v)
            t += h
        angles.append(x if t == before[0] else before[1] + (x - before[1]) * (until - before[0]) / (t - before[0]))
    return angles

for line in sys.stdin:
    q = json.loads(line)
    angles = swing(q["inputs"]["t_s"], q["parameters"], q["forces"]["pivot"])
    print(json.dumps({"id": q["id"], "channels": {"angle_rad": angles}}), flush=True)
