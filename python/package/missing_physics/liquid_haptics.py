"""A liquid in a cylinder, felt at the wrist that tilts it: how much it is, and how far to tilt for a pour."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _engine

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Cylinder:
    """An upright cylinder: outer radius and length, and the thickness of wall, base and lid, all in m."""

    radius_m: float
    length_m: float
    wall_m: float = 0.0

    def _sizes(self) -> tuple[float, float, float]:
        return (float(self.radius_m), float(self.length_m), float(self.wall_m))


@dataclass(frozen=True)
class Grasp:
    """How a container hangs at the wrist: masses in kg, heights above its bottom in m of the grasp and of the empty container's centre of
    mass, gravity in m/s^2."""

    container_mass_kg: float
    gripper_mass_kg: float
    grasp_height_m: float
    shell_center_m: float
    gravity_m_s2: float = 9.80665

    def _held(self) -> tuple[float, float, float, float, float]:
        masses = (float(self.container_mass_kg), float(self.gripper_mass_kg))
        return (*masses, float(self.grasp_height_m), float(self.shell_center_m), float(self.gravity_m_s2))


@dataclass(frozen=True)
class Poses:
    """What the wrist reads at settled tilts: tilt in rad, forces across and along the vertical in N, torque in N m, each (poses,)."""

    tilt_rad: Floats
    fx_n: Floats
    fy_n: Floats
    tau_z_nm: Floats


@dataclass(frozen=True)
class VolumeEstimate:
    """A volume in m^3 with its 95 % interval, the mass at it in kg, and the torque's noise in N m.

    ``verdict`` is ``determined``, ``empty``, ``full``, ``misfit`` (no volume explains the torques), or why the volume is open: ``flat``,
    ``alike-poses``, ``several-volumes``, with each volume and its interval among ``candidates``. ``next_tilt_rad`` is where one more pose
    narrows it most, where that was asked for.
    """

    volume_m3: float
    ci95_m3: tuple[float, float]
    mass_kg: float
    sigma_nm: float
    misfit_p: float | None
    verdict: str
    candidates: list[tuple[float, tuple[float, float]]]
    next_tilt_rad: float | None


@dataclass(frozen=True)
class PourPlan:
    """The tilt in rad at which the wanted volume has left; liquid begins to leave at ``start_tilt_rad``, at least ``least_m3`` at once and at
    most ``most_m3``; ``tilt_rate_rad_s`` gives the flow that was asked for as the pour ends."""

    tilt_rad: float
    start_tilt_rad: float
    least_m3: float
    most_m3: float
    tilt_rate_rad_s: float | None


def readings(container: Cylinder, grasp: Grasp, tilt_rad: ArrayLike, *, mass_kg: float, volume_m3: float) -> Poses:
    """What the wrist would read of a liquid at tilts of shape (poses,), without noise."""
    tilts = np.atleast_1d(np.asarray(tilt_rad, dtype=np.float64))
    across, along, torque = _engine.liquid_wrench(container._sizes(), grasp._held(), tilts, float(mass_kg), float(volume_m3))
    return Poses(tilts, across, along, torque)


def volume(
    container: Cylinder,
    grasp: Grasp,
    poses: Poses,
    *,
    mass_kg: tuple[float, float] | None = None,
    density_kg_m3: float | None = None,
    sigma_nm: float | None = None,
    next_of: int = 0,
) -> VolumeEstimate:
    """The liquid's volume from poses.

    The mass is that of the forces, unless it is given with its standard error in kg, or the density is. ``sigma_nm`` is the torque's noise
    where it is known; only then can a misfit show. ``next_of``: the tilt to go to next is sought among so many steps from 0 to pi.
    Raises :class:`~missing_physics.errors.ChapterError`.
    """
    columns: list[tuple[str, Any]] = [(name, getattr(poses, name)) for name in ("tilt_rad", "fx_n", "fy_n", "tau_z_nm")]
    said = _engine.liquid_volume(container._sizes(), grasp._held(), columns, mass_kg, density_kg_m3, sigma_nm, next_of)
    return VolumeEstimate(**said)


def pour_plan(
    container: Cylinder,
    inside_m3: float,
    wanted_m3: float,
    *,
    bead_m: tuple[float, float] = (0.0, 0.0),
    steepest_rad: float = np.pi / 2,
    flow_m3_s: float | None = None,
) -> PourPlan:
    """How far to tilt an open cylinder so that ``wanted_m3`` of the ``inside_m3`` leave.

    ``bead_m``: how far above the rim the level stands before it breaks, and where it comes to rest. Raises
    :class:`~missing_physics.errors.ChapterError` for more than there is, or less than the bead lets out.
    """
    bead = (float(bead_m[0]), float(bead_m[1]))
    return PourPlan(*_engine.liquid_pour(container._sizes(), float(inside_m3), float(wanted_m3), bead, float(steepest_rad), flow_m3_s))
