"""Work that is spread over a cluster by Dask, with the same results as in one process.

Each piece depends on nothing but its own arguments and seed, and Dask gives what a lost worker had to another: a worker that is killed
in the middle loses nothing. ``client`` is a ``distributed.Client``: of a local cluster, or of any of Dask's own deployments
(Slurm, Kubernetes, clouds). The package has to be installed on the workers, and functions that they are given have to pickle.
"""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Sequence
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from . import _engine
from ._diagnose import diagnose
from ._diagnosis import Diagnosis
from ._prove import Proof, finished
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


def prove(
    client: Any,
    folder: str | PathLike[str],
    *,
    domain: str | None = None,
    worlds: int = 20,
    kind: str | None = None,
    seed: int = 1,
) -> Proof:
    """As :func:`missing_physics.prove`, a world a task: the same diagnoses, reports and score, to the byte (each outcome says the seconds that it took).

    Answers are sealed here first. Workers need no common file system: a world's files come back, and lie in ``folder`` as soon as it is
    done, so that the same call goes on where one was stopped, whoever was stopped.
    """
    distributed: Any = importlib.import_module("distributed")
    arguments = (domain, worlds, kind, seed)
    proof = _engine.Proof(fspath(folder), *arguments, 1)
    open_worlds = [name for name in proof.seal() if not Path(fspath(folder), name, _DONE).exists()]
    tasks = [client.submit(_world, arguments, name, pure=False) for name in open_worlds]
    for task in distributed.as_completed(tasks):
        files: dict[str, bytes] = task.result()
        # Whether a world is done is said last.
        for name, content in sorted(files.items(), key=lambda file: file[0].endswith(_DONE)):
            path = Path(fspath(folder), name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
    return finished(proof, folder, None)


#: The file of a world that is written last.
_DONE = "outcome.json"


def _world(arguments: tuple[str | None, int, str | None, int], name: str) -> dict[str, bytes]:
    """The files of a world that was diagnosed here, by their path in the proof's folder."""
    with tempfile.TemporaryDirectory() as folder:
        _engine.Proof(folder, *arguments, 1).world(name)
        written = sorted(path for path in Path(folder).rglob("*") if path.is_file())
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in written}


def _some(simulator: Simulator, theta: Floats, seed: int, start: int) -> list[Floats | None]:
    return [simulate_one(simulator, row, seed, start + at) for at, row in enumerate(theta)]


def _one(arguments: dict[str, Any]) -> Diagnosis:
    return diagnose(**arguments)
