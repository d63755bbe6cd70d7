"""Prints, and checks, what a call of a simulator in Python costs beside the simulator's own time: the limit of the package is 20 us.

It is the time from the return of one call to the beginning of the next, of a simulator with six parameters whose derivatives take
twelve calls one after another; the median, since the engine does its own work between some of them.
"""

import time

import numpy as np

import missing_physics as mp


LIMIT_US = 20


def main(rows=100):
    t_s = np.linspace(0.0, 5.0, rows)
    rng = np.random.default_rng(1)
    runs = [{"t_s": t_s, "u_v": np.exp(-0.4 * t_s) + 0.1 * t_s + 0.003 * rng.standard_normal(rows)} for _ in range(3)]
    began, ended = [], []

    def predict(parameters, inputs):
        began.append(time.perf_counter_ns())
        t = inputs["t_s"]
        answer = {"u_v": np.exp(-parameters["rate_per_s"] * t) + sum(parameters[f"a{k}"] * t**k for k in range(5))}
        ended.append(time.perf_counter_ns())
        return answer

    drift = mp.Mechanism("drift", [mp.Parameter(f"a{k}", scale=0.1**k) for k in range(5)])
    rate = mp.Parameter("rate_per_s", start=0.3, lower=0.0, scale=0.1)
    mp.diagnose(mp.Model(predict, parameters=[rate], mechanisms=[drift]), runs, threads=1)
    own_us = np.median(np.subtract(ended, began)) / 1e3
    beside_us = np.median(np.subtract(began[1:], ended[:-1])) / 1e3
    print(f"{len(began)} calls with {rows} rows: {own_us:.1f} us in the simulator, {beside_us:.1f} us from one call to the next (median)")
    assert beside_us <= LIMIT_US, f"{beside_us:.1f} us, expected at most {LIMIT_US}"


main()
