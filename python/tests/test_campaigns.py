"""Dask's local cluster: the same bits as one process, and a killed worker loses nothing."""

import json
import os
import signal
import threading
import time

import numpy as np
import pytest

import missing_physics as mp
from conftest import falls
from missing_physics import campaigns, errors
from missing_physics.bayes_sim import NPE, BoxUniform, simulate_for_sbi


def slow(theta, rng):
    """Chance of its own, and time enough to be killed in."""
    time.sleep(0.02)
    return theta + rng.standard_normal(theta.size)


@pytest.fixture(scope="module")
def client():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster) as client:
            yield client


def kill_one(client, after_s):
    """Kills a worker in the middle; returns its process."""
    victim = next(iter(client.run(os.getpid).values()))
    threading.Timer(after_s, os.kill, (victim, signal.SIGKILL)).start()
    return victim


@pytest.mark.long
def test_simulations_have_the_same_bits_though_a_worker_is_killed(client):
    prior = BoxUniform([0.0, -1.0], [1.0, 1.0])
    alone = simulate_for_sbi(slow, prior, 200, seed=5)
    victim = kill_one(client, 0.5)
    spread = campaigns.simulate(client, slow, prior, 200, seed=5, chunk=8)
    assert victim not in client.run(os.getpid).values()
    assert all(np.array_equal(a, b) for a, b in zip(alone, spread))
    posteriors = [NPE(prior, "mdn").append_simulations(*each).train(max_num_epochs=5).build_posterior() for each in (alone, spread)]
    assert np.array_equal(*(each.sample((50,), x=[0.5, 0.0]) for each in posteriors))


@pytest.mark.long
def test_diagnoses_are_the_same_over_a_cluster(client):
    asked = [{"domain": "trajectory", "runs": falls(seed=seed)} for seed in (1, 2, 3)]
    spread = campaigns.diagnose_many(client, asked)
    assert [each.json() for each in spread] == [mp.diagnose(**arguments).json() for arguments in asked]


def files(folder):
    """All that a proof keeps, score and reports among it, without the seconds that it took."""
    kept = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    for name in [name for name in kept if name.endswith("outcome.json")]:
        said = json.loads(kept[name])
        assert said.pop("seconds") > 0
        kept[name] = said
    # The page says the seconds.
    kept.pop("score.html")
    return kept


@pytest.mark.long
def test_worlds_are_proven_the_same_though_a_worker_is_killed(client, tmp_path):
    arguments = {"domain": "trajectory", "worlds": 3, "seed": 3}
    alone = mp.prove(tmp_path / "alone", **arguments)
    victim = kill_one(client, 1.0)
    spread = campaigns.prove(client, tmp_path / "spread", **arguments)
    assert victim not in client.run(os.getpid).values()
    assert files(spread.folder) == files(alone.folder)
    again = campaigns.prove(client, tmp_path / "spread", **arguments)
    assert again.score == spread.score


def test_a_proof_says_its_score_and_goes_on(tmp_path):
    told = []
    proof = mp.prove(tmp_path, domain="trajectory", worlds=2, progress=lambda stage, done: told.append(stage))
    assert "2 worlds of each domain" in str(proof) and proof.score["domains"][0]["domain"] == "trajectory"
    assert any(stage.startswith("diagnosing") for stage in told)
    assert mp.prove(tmp_path, domain="trajectory", worlds=2).score == proof.score
    with pytest.raises(errors.DiagnosisError, match="another proof"):
        mp.prove(tmp_path, domain="trajectory", worlds=3)
    with pytest.raises(errors.DiagnosisError, match='no worlds of the domain "flight"'):
        mp.prove(tmp_path / "b", domain="flight")
