"""The Young's modulus behind measured curves of force against indentation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from . import _engine
from .errors import ChapterError


@dataclass(frozen=True)
class CurveFit:
    """What was found for a curve: contact point and depth in m, offset and noise in N."""

    contact_m: float
    contact_ci95_m: tuple[float, float]
    offset_n: float
    sigma_n: float
    depth_m: float
    misfit: bool
    contact_undetermined: bool


@dataclass(frozen=True)
class ContactFit:
    """One modulus in Pa for all curves, with its interval by profile likelihood; an end that the data leave open is infinite or zero."""

    modulus_pa: float
    ci95_pa: tuple[float, float]
    curves: list[CurveFit]
    converged: bool


def fit(
    curves: Sequence[tuple[Any, Any]],
    *,
    radius_m: float | None = None,
    angle_rad: float | None = None,
    shape: str = "sphere",
    poisson_ratio: float = 0.5,
) -> ContactFit:
    """Fits curves, each a pair of columns: indentation on the stage's own scale (m) and force (N), both positive under compression.

    ``shape`` is ``"sphere"`` or ``"cylinder"`` (a flat punch) with ``radius_m``, or ``"cone"`` with ``angle_rad`` between cone and
    surface. The law is Hertz's (``4/3 E/(1 - nu^2) sqrt(R) delta^(3/2)`` for a sphere), without adhesion, on a thick sample.
    Raises :class:`~missing_physics.errors.ChapterError`, also where a curve shows no contact.
    """
    size = angle_rad if shape == "cone" else radius_m
    if size is None:
        raise ChapterError(f"a {shape} needs {'angle_rad' if shape == 'cone' else 'radius_m'}")
    said = _engine.fit_contact(list(curves), shape, float(size), float(poisson_ratio))
    return ContactFit(said["modulus_pa"], said["modulus_interval_pa"], [CurveFit(*each) for each in said["curves"]], said["converged"])
