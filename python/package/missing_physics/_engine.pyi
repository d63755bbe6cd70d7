"""The compiled part; use the package's own names."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Density",
    "Prior",
    "Proof",
    "Simulator",
    "Source",
    "diagnose",
    "domains",
    "fit_contact",
    "grain_series",
    "grain_statistics",
    "hear_impacts",
    "infer_grains",
    "liquid_pour",
    "liquid_volume",
    "liquid_wrench",
    "pour_grains",
    "predict",
    "unit_of",
    "version",
]

@final
class Source:
    @staticmethod
    def folder(path: str | PathLike[str]) -> Source: ...
    @staticmethod
    def memory(
        name: str,
        header: str,
        columns: Sequence[tuple[str, Any]],
        files: Sequence[tuple[str, bytes]],
    ) -> Source: ...
    @property
    def name(self) -> str: ...
    @property
    def program(self) -> list[str] | None: ...

@final
class Simulator:
    def __new__(
        cls,
        predict: Callable[[dict[str, Any], dict[str, NDArray[np.float64]]], Any]
        | Callable[[dict[str, Any], dict[str, NDArray[np.float64]], dict[str, Any]], Any],
        batched: bool,
    ) -> Simulator: ...

@final
class Prior:
    def __new__(cls, low: Sequence[float], high: Sequence[float]) -> Prior: ...
    def sample(self, count: int, seed: int) -> NDArray[np.float64]: ...
    def log_prob(self, theta: Any) -> list[float]: ...

@final
class Density:
    @staticmethod
    def train(prior: Prior, theta: Any, x: Any, kind: str, epochs: int, seed: int) -> Density: ...
    @staticmethod
    def load(path: str | PathLike[str], kind: str) -> Density: ...
    def sample(self, x: Any, count: int, seed: int) -> NDArray[np.float64]: ...
    def log_prob(self, theta: Any, x: Any) -> list[float]: ...
    def save(self, path: str | PathLike[str]) -> None: ...

@final
class Proof:
    def __new__(
        cls,
        folder: str | PathLike[str],
        domain: str | None,
        worlds: int,
        kind: str | None,
        seed: int,
        threads: int,
    ) -> Proof: ...
    def prove(self, progress: Callable[[str, float], object] | None) -> str: ...
    def seal(self) -> list[str]: ...
    def world(self, name: str) -> None: ...

def fit_contact(
    curves: Sequence[tuple[Any, Any]],
    shape: str,
    size: float,
    poisson_ratio: float,
) -> dict[str, Any]: ...
def liquid_wrench(
    sizes: tuple[float, float, float],
    held: tuple[float, float, float, float, float],
    tilt_rad: Any,
    mass_kg: float,
    volume_m3: float,
) -> list[NDArray[np.float64]]: ...
def liquid_volume(
    sizes: tuple[float, float, float],
    held: tuple[float, float, float, float, float],
    poses: Sequence[tuple[str, Any]],
    mass_kg: tuple[float, float] | None,
    density_kg_m3: float | None,
    sigma_nm: float | None,
    steps: int,
) -> dict[str, Any]: ...
def liquid_pour(
    sizes: tuple[float, float, float],
    inside_m3: float,
    wanted_m3: float,
    bead_m: tuple[float, float],
    steepest_rad: float,
    flow_m3_s: float | None,
) -> tuple[float, float, float, float, float | None]: ...
def hear_impacts(
    sound: Any,
    rate_hz: float,
    microphones_m: Sequence[Sequence[float]] | None,
    speed_of_sound_m_s: float,
) -> dict[str, Any]: ...
def pour_grains(
    grain: Sequence[float], height_m: float, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def infer_grains(
    statistics: Any, any_cloth: bool, count: int, seed: int
) -> tuple[NDArray[np.float64], list[float], float]: ...
def grain_series() -> list[float]: ...
def grain_statistics() -> list[str]: ...
def diagnose(
    source: Source,
    simulator: Simulator | None,
    seed: int,
    alpha: float,
    threads: int,
    progress: Callable[[str, float], object] | None,
) -> dict[str, Any]: ...
def predict(model: str, source: Source, simulator: Simulator | None, threads: int) -> dict[str, Any]: ...
def domains() -> str: ...
def unit_of(name: str) -> str: ...
def version() -> str: ...
