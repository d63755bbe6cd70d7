"""Grains that are poured through a funnel onto a cloth, and what a depth picture of the heap tells of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _engine
from .errors import ArrayError

Floats = NDArray[np.float64]

#: Names of the 16 statistics of a depth picture, in their order.
STATISTICS: tuple[str, ...] = tuple(_engine.grain_statistics())

#: Heights in m from which the grains of a series are poured, once each.
SERIES_M: tuple[float, ...] = tuple(_engine.grain_series())


@dataclass(frozen=True)
class Poured:
    """Grains at rest: their centres in m, of shape (grains, 3), the outlet above x = y = 0; the statistics of a depth picture of them, (16,)."""

    positions_m: Floats
    statistics: Floats


@dataclass(frozen=True)
class Inferred:
    """Draws of a posterior over sliding friction, rolling friction and restitution, of shape (draws, 3), and their mean, (3,).

    ``p_value`` is the share of simulated pictures that are as unlike the others as this one: below 0.01 it resembles none.
    """

    draws: Floats
    estimate: Floats
    p_value: float


def pour(
    sliding_friction: float = 0.6687,
    rolling_friction: float = 0.05,
    restitution: float = 0.5,
    *,
    height_m: float = 0.12,
    seed: int = 1,
) -> Poured:
    """Pours 600 grains of 4 mm (couscous, unless other coefficients are given) from an outlet ``height_m`` above the cloth and looks at them.

    The same seed gives the same bits. Raises :class:`~missing_physics.errors.ChapterError` for coefficients outside physics, and where too
    few grains are left in the picture.
    """
    grain = [float(sliding_friction), float(rolling_friction), float(restitution)]
    return Poured(*_engine.pour_grains(grain, float(height_m), seed))


def infer(statistics: ArrayLike, *, any_cloth: bool = False, count: int = 4000, seed: int = 1) -> Inferred:
    """What the statistics (16,) of a picture of a heap poured from 12 cm tell of its grains, by the posterior that is shipped; or those
    (3, 16) of three heaps of the same grains, poured from each of :data:`SERIES_M`, which tell more.

    The cloth is taken for velvet, on which grains roll as :func:`pour` has them; ``any_cloth`` is for three heaps on one whose rolling friction is
    not known.

    Raises :class:`~missing_physics.errors.ChapterError`, and :class:`~missing_physics.errors.ArrayError` for another shape.
    """
    values = np.asarray(statistics, dtype=np.float64)
    series = (len(SERIES_M), len(STATISTICS))
    if values.ndim != 1 and values.shape != series:
        raise ArrayError(f"statistics has the shape {values.shape}, expected {series[1:]} or {series}")
    draws, estimate, p_value = _engine.infer_grains(values.ravel(), any_cloth, count, seed)
    return Inferred(draws, np.array(estimate), p_value)
