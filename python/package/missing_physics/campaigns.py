"""Work that is spread over a cluster by Dask, with the same results as in one process.

Each piece depends on nothing but its own arguments and seed, and Dask gives what a lost worker had to another: a worker that is killed
in the middle loses nothing. ``client`` is a ``distributed.Client``: of a local cluster, or of any of Dask's own deployments
(Slurm, Kubernetes, clouds).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ._diagnose import diagnose
from ._diagnosis import Diagnosis
from .bayes_sim import BoxUniform, Floats, Simulator, kept, simulate_one


def simulate(
    client: Any, simulator: Simulator, prior: BoxUniform, num_simulations: int, *, seed: int = 1, chunk: int = 32
) -> tuple[Floats, Floats]:
    """As :func:`missing_physics.bayes_sim.simulate_for_sbi`, ``chunk`` simulations a task: the same bits."""
    theta = prior.sample(num_simulations, seed=seed)
    starts = range(0, num_simulations, max(chunk, 1))
    tasks = [client.submit(_some, simulator, theta[at : at + chunk], seed, at, pure=False) for at in starts]
    return kept(theta, [each for some in client.gather(tasks) for each in some])


def diagnose_many(client: Any, recordings: Sequence[dict[str, Any]]) -> list[Diagnosis]:
    """One diagnosis for each set of arguments of :func:`missing_physics.diagnose`, in their order."""
    tasks = [client.submit(_one, {"threads": 1, **arguments}, pure=False) for arguments in recordings]
    found: list[Diagnosis] = client.gather(tasks)
    return found


def _some(simulator: Simulator, theta: Floats, seed: int, start: int) -> list[Floats | None]:
    return [simulate_one(simulator, row, seed, start + at) for at, row in enumerate(theta)]


def _one(arguments: dict[str, Any]) -> Diagnosis:
    return diagnose(**arguments)
