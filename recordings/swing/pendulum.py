"""A pendulum: one question as a line of JSON in, one answer as a line of JSON out."""
import json, math, sys

def acceleration(angle, w, p):
    # tanh for sign: a step of the integrator must not jump over the turning point.
    return (-9.80665 / p["length_m"] * math.sin(angle) - 2 * p["damping_per_s"] * w
            - p["drag"] * abs(w) * w - p["friction_rad_s2"] * math.tanh(w / 0.01))

def swing(times, p):
    angle, w, t, angles = p["released_rad"], 0.0, times[0], []
    for until in times:
        steps = math.ceil((until - t) / 0.004)
        for _ in range(steps):  # Runge-Kutta, fourth order
            h = (until - t) / steps
            k1, l1 = w, acceleration(angle, w, p)
            k2, l2 = w + h / 2 * l1, acceleration(angle + h / 2 * k1, w + h / 2 * l1, p)
            k3, l3 = w + h / 2 * l2, acceleration(angle + h / 2 * k2, w + h / 2 * l2, p)
            k4, l4 = w + h * l3, acceleration(angle + h * k3, w + h * l3, p)
            angle += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            w += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4)
        t = until
        angles.append(angle)
    return angles

for line in sys.stdin:
    question = json.loads(line)
    angles = swing(question["inputs"]["t_s"], question["parameters"])
    print(json.dumps({"id": question["id"], "channels": {"angle_rad": angles}}), flush=True)
