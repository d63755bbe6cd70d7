"""Impacts of a ball on a table, heard by microphones: when, and where."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _engine
from .errors import ArrayError


@dataclass(frozen=True)
class Impact:
    """One impact: its time from the first sample and that time's sigma in s; its place on the table in m with its covariance in m^2, where the
    microphones' places are known; when each channel heard it in s; its loudness over the noise, a ratio of amplitudes."""

    t_s: float
    t_sigma_s: float
    place_m: tuple[float, float] | None
    covariance_m2: NDArray[np.float64] | None
    arrivals_s: NDArray[np.float64]
    amplitude_sigmas: float


@dataclass(frozen=True)
class Stray:
    """A sound that was no impact on the table: its time in s, and why."""

    t_s: float
    reason: str


@dataclass(frozen=True)
class Heard:
    """Impacts in order of time, and sounds that were none."""

    impacts: list[Impact]
    strays: list[Stray]


def hear(
    sound: ArrayLike, rate_hz: float, *, microphones_m: ArrayLike | None = None, speed_of_sound_m_s: float = 343.0
) -> Heard:
    """The impacts in a sound of shape (channels, samples), or (samples,), sampled at ``rate_hz``; full scale is 1.

    With ``microphones_m`` of shape (channels, 3), in the table's frame with z = 0 at its top and at least 3 not on a line, also where each
    was, and sounds from elsewhere are told apart. Raises :class:`~missing_physics.errors.ChapterError`.
    """
    places = None
    if microphones_m is not None:
        array = np.asarray(microphones_m, dtype=np.float64)
        if array.ndim != 2 or array.shape[1] != 3:
            raise ArrayError(f"microphones_m has the shape {array.shape}, expected (channels, 3)")
        places = array.tolist()
    channels = np.atleast_2d(np.asarray(sound, dtype=np.float64))
    said = _engine.hear_impacts(channels, float(rate_hz), places, float(speed_of_sound_m_s))
    impacts = [
        Impact(t_s, sigma, None if at is None else at[0], None if at is None else np.array(at[1]), np.array(arrivals), loud)
        for t_s, sigma, at, arrivals, loud in said["impacts"]
    ]
    return Heard(impacts, [Stray(*each) for each in said["strays"]])
