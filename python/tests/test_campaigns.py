"""Dask's local cluster: the same bits as one process, and a killed worker loses nothing."""

import os
import signal
import threading
import time

import numpy as np
import pytest

from missing_physics import campaigns
from missing_physics.bayes_sim import BoxUniform, simulate_for_sbi

pytestmark = pytest.mark.long

def slow(theta, rng):
    """Chance of its own, and time enough to be killed in."""
    time.sleep(0.02)
    return theta + rng.standard_normal(theta.size)

def test_a_cluster_gives_the_same_bits_though_a_worker_is_killed():
    distributed = pytest.importorskip("distributed")
    prior = BoxUniform([0.0, -1.0], [1.0, 1.0])
    alone = simulate_for_sbi(slow, prior, 200, seed=5)
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            pids = list(client.run(os.getpid).values())
            threading.Timer(0.5, os.kill, (pids[0], signal.SIGKILL)).start()
            spread = campaigns.simulate(client, slow, prior, 200, seed=5, chunk=8)
            now = list(client.run(os.getpid).values())
    assert pids[0] not in now
    assert all(np.array_equal(a, b) for a, b in zip(alone, spread))
