"""The compiled part; use the package's own names."""

from collections.abc import Callable, Sequence
from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "Density",
    "Prior",
    "Simulator",
    "Source",
    "diagnose",
    "domains",
    "fit_contact",
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
    def __new__(cls, predict: Callable[[dict[str, Any], dict[str, NDArray[np.float64]]], Any], batched: bool) -> Simulator: ...

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

def fit_contact(
    curves: Sequence[tuple[Any, Any]],
    shape: str,
    size: float,
    poisson_ratio: float,
) -> dict[str, Any]: ...
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
