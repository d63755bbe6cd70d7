"""Posteriors over a simulator's parameters from simulations alone, with the names that users of sbi know.

    >>> import numpy as np
    >>> from missing_physics.bayes_sim import BoxUniform, NPE, simulate_for_sbi
    >>> prior = BoxUniform(low=[0.0], high=[1.0])
    >>> noise = lambda theta, rng: theta + rng.uniform(-0.1, 0.1, size=1)
    >>> theta, x = simulate_for_sbi(noise, prior, 500, seed=1)
    >>> inference = NPE(prior, density_estimator="mdrff")
    >>> posterior = inference.append_simulations(theta, x).train(max_num_epochs=40).build_posterior()
    >>> draws = posterior.sample((1000,), x=[0.5], seed=2)
    >>> draws.shape, bool(abs(np.median(draws) - 0.5) < 0.1)
    ((1000, 1), True)
"""

from __future__ import annotations

import inspect
import math
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _engine
from .errors import PosteriorError

Floats = NDArray[np.float64]
#: ``simulator(theta)`` or ``simulator(theta, rng)``: parameters of shape (parameters,) and a generator of its own in, features of shape
#: (features,) out. What has chance in it takes the generator, so that the same seed gives the same simulations.
Simulator = Callable[..., ArrayLike]
#: How many draws: a number, or a shape as sbi takes it.
Shape = int | tuple[int, ...]


class BoxUniform:
    """A prior that is flat between ``low`` and ``high``, each of shape (parameters,)."""

    def __init__(self, low: ArrayLike, high: ArrayLike) -> None:
        self.low = np.atleast_1d(np.asarray(low, dtype=np.float64))
        self.high = np.atleast_1d(np.asarray(high, dtype=np.float64))
        self._prior = _engine.Prior(self.low.tolist(), self.high.tolist())

    def sample(self, sample_shape: Shape = (), *, seed: int = 1) -> Floats:
        """Draws of shape (*sample_shape, parameters)."""
        count, shape = _counted(sample_shape)
        return self._prior.sample(count, seed).reshape(*shape, -1)

    def log_prob(self, theta: ArrayLike) -> Floats:
        """The logarithm of the density, of shape (count,), of parameters of shape (count, parameters)."""
        return np.asarray(self._prior.log_prob(np.atleast_2d(theta)))

    def __getstate__(self) -> dict[str, Any]:
        return {"low": self.low, "high": self.high}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["low"], state["high"])  # type: ignore[misc]


def _counted(sample_shape: Shape) -> tuple[int, tuple[int, ...]]:
    """How many draws a shape holds."""
    shape = (int(sample_shape),) if np.ndim(sample_shape) == 0 else tuple(sample_shape)  # type: ignore[arg-type]
    return math.prod(shape), shape


def _takes_generator(simulator: Simulator) -> bool:
    try:
        parameters = inspect.signature(simulator).parameters.values()
    except (TypeError, ValueError):
        return False
    places = [each for each in parameters if each.kind in (each.POSITIONAL_ONLY, each.POSITIONAL_OR_KEYWORD, each.VAR_POSITIONAL)]
    return sum(each.default is each.empty for each in places) > 1 or any(each.name == "rng" for each in places)


def simulate_one(simulator: Simulator, theta: Floats, seed: int, index: int) -> Floats | None:
    """Simulation ``index`` of a campaign: its generator depends on nothing but the seed and its index. ``None`` where it fails."""
    rng = np.random.default_rng([seed, index])
    given = (theta, rng) if _takes_generator(simulator) else (theta,)
    features = np.atleast_1d(np.asarray(simulator(*given), dtype=np.float64))
    if features.ndim != 1:
        raise PosteriorError(f"the simulator's features have the shape {features.shape}, expected (features,)")
    return features if np.isfinite(features).all() else None


def simulate_for_sbi(simulator: Simulator, proposal: BoxUniform, num_simulations: int, *, seed: int = 1) -> tuple[Floats, Floats]:
    """Parameters of shape (simulations, parameters) from the prior and what the simulator makes of each, (simulations, features).

    Simulations that are not finite are left out. The same seed gives the same numbers, here and over a cluster
    (:func:`missing_physics.campaigns.simulate`).
    """
    theta = proposal.sample(num_simulations, seed=seed)
    return kept(theta, [simulate_one(simulator, row, seed, index) for index, row in enumerate(theta)])


def kept(theta: Floats, features: list[Floats | None]) -> tuple[Floats, Floats]:
    """The simulations that gave something."""
    lengths = {each.size for each in features if each is not None}
    if len(lengths) > 1:
        raise PosteriorError(f"the simulator gave {min(lengths)} features and {max(lengths)}, expected one number of them")
    sound = [index for index, each in enumerate(features) if each is not None]
    if not sound:
        raise PosteriorError("no simulation gave finite numbers")
    return theta[sound], np.stack([features[index] for index in sound])  # type: ignore[misc]


class NPE:
    """Neural posterior estimation: simulations in, a density of parameters given an observation out.

    ``density_estimator`` is ``"mdn"`` (a mixture density network), ``"mdrff"`` (the same on random Fourier features) or
    ``"autoregressive"`` (one parameter after another; nothing leaks over the prior's bounds).
    """

    def __init__(self, prior: BoxUniform, density_estimator: str = "autoregressive") -> None:
        self.prior = prior
        self.density_estimator = density_estimator
        self._theta: list[Floats] = []
        self._x: list[Floats] = []
        self._density: _engine.Density | None = None

    def append_simulations(self, theta: ArrayLike, x: ArrayLike) -> NPE:
        """Adds parameters of shape (simulations, parameters) and features of shape (simulations, features)."""
        self._theta.append(np.atleast_2d(np.asarray(theta, dtype=np.float64)))
        self._x.append(np.atleast_2d(np.asarray(x, dtype=np.float64)))
        return self

    def train(self, *, max_num_epochs: int = 0, seed: int = 1) -> NPE:
        """Learns; the same seed gives the same bits. ``max_num_epochs`` 0: as many passes as the estimator usually takes at most."""
        if not self._theta:
            raise PosteriorError("no simulations were appended")
        theta, x = np.concatenate(self._theta), np.concatenate(self._x)
        self._density = _engine.Density.train(self.prior._prior, theta, x, self.density_estimator, max_num_epochs, seed)
        return self

    def build_posterior(self) -> Posterior:
        """The posterior, at any observation."""
        if self._density is None:
            raise PosteriorError("nothing was learned: call train first")
        return Posterior(self._density, self.density_estimator)


class Posterior:
    """What is known of the parameters, given an observation. It pickles."""

    def __init__(self, density: _engine.Density, kind: str, x: ArrayLike | None = None) -> None:
        self._density = density
        self._kind = kind
        self._x = None if x is None else np.atleast_1d(np.asarray(x, dtype=np.float64))

    def set_default_x(self, x: ArrayLike) -> Posterior:
        """The same posterior at an observation of shape (features,)."""
        return Posterior(self._density, self._kind, x)

    def sample(self, sample_shape: Shape = (), x: ArrayLike | None = None, *, seed: int = 1) -> Floats:
        """Draws of shape (*sample_shape, parameters)."""
        count, shape = _counted(sample_shape)
        return self._density.sample(self._at(x), count, seed).reshape(*shape, -1)

    def log_prob(self, theta: ArrayLike, x: ArrayLike | None = None) -> Floats:
        """The logarithm of the density, of shape (count,), of parameters of shape (count, parameters)."""
        return np.asarray(self._density.log_prob(np.atleast_2d(theta), self._at(x)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the density; the same bits come back."""
        self._density.save(os.fspath(path))

    def _at(self, x: ArrayLike | None) -> Floats:
        if x is not None:
            return np.atleast_1d(np.asarray(x, dtype=np.float64))
        if self._x is None:
            raise PosteriorError("no observation: give x, or set_default_x")
        return self._x

    def __getstate__(self) -> dict[str, Any]:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "density"
            self.save(path)
            return {"density": path.read_bytes(), "kind": self._kind, "x": self._x}

    def __setstate__(self, state: dict[str, Any]) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "density"
            path.write_bytes(state["density"])
            self._density = _engine.Density.load(os.fspath(path), state["kind"])
        self._kind, self._x = state["kind"], state["x"]
