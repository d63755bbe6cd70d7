"""A pendulum: one question as a line of JSON in, one answer as a line of JSON out."""
import json, math, sys

def swing(times, p):
    pull, viscous = -9.80665 / p["length_m"], 2 * p["damping_per_s"]
    drag, dry = p["drag"], p["friction_rad_s2"]
    sin, tanh = math.sin, math.tanh

    def acceleration(angle, w):
        # tanh for sign: a step of the integrator must not jump over the turning point.
        return pull * sin(angle) - viscous * w - drag * abs(w) * w - dry * tanh(w / 0.01)

    angle, w, t, angles = p["released_rad"], 0.0, times[0], []
    for until in times:
        steps = math.ceil((until - t) / 0.004)
        for _ in range(steps):  # Runge-Kutta, fourth order
            h = (until - t) / steps
            half, sixth = h / 2, h / 6
            k1, l1 = w, acceleration(angle, w)
            k2 = w + half * l1
            l2 = acceleration(angle + half * k1, k2)
            k3 = w + half * l2
            l3 = acceleration(angle + half * k2, k3)
            k4 = w + h * l3
            l4 = acceleration(angle + h * k3, k4)
            angle += sixth * (k1 + 2 * k2 + 2 * k3 + k4)
            w += sixth * (l1 + 2 * l2 + 2 * l3 + l4)
        t = until
        angles.append(angle)
    return angles

for line in sys.stdin:
    question = json.loads(line)
    angles = swing(question["inputs"]["t_s"], question["parameters"])
    print(json.dumps({"id": question["id"], "channels": {"angle_rad": angles}}), flush=True)
