"""A simulator of one's own as a model: what it predicts, what is unknown in it, what it may leave out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _engine
from ._forces import Force, Joint, forces
from ._recording import Run, Runs, Table, labelled, memory
from .errors import DiagnosisError, RecordingError

#: ``predict(parameters, inputs)``: numbers by name and columns by name in, columns of the channels by name out. With joints, a third argument
#: holds what acts on each.
Predict = Callable[..., Any]


@dataclass(frozen=True)
class Parameter:
    """A number that the simulator needs and nobody knows exactly.

    ``start`` is where a fit begins; in a mechanism, the value at which it makes no difference. ``scale`` is a typical error of
    ``start`` (a tenth of it, or 1, where nothing is said). ``per_run``: each run has its own (where it began), and ``start`` may then be
    one number for each run, or ``"measured"``: the first reading of the channel with whose name the parameter's begins
    (``angle_rad_at_start``). The unit is the name's ending (``k_per_m``) unless ``unit`` says another.
    """

    name: str
    start: float | str | Sequence[float] = 0.0
    lower: float = -math.inf
    upper: float = math.inf
    scale: float | None = None
    per_run: bool = False
    unit: str | None = None

    def _first(self) -> float:
        """A value to ask with before anything was measured."""
        if isinstance(self.start, str):
            return 0.0
        return float(np.ravel(self.start)[0])

    def _header(self, start: str) -> dict[str, Any]:
        unit = _engine.unit_of(self.name) if self.unit is None else self.unit
        begins = self.start if isinstance(self.start, str) or np.ndim(self.start) else float(self.start)  # type: ignore[arg-type]
        scale = self.scale
        if scale is None:
            scale = abs(begins) / 10 or 1.0 if isinstance(begins, float) else 1.0
        keys = {"name": self.name, "unit": unit, start: begins, "scale": float(scale)}
        bounds = {"lower": float(self.lower), "upper": float(self.upper)}
        return {**keys, **bounds, **({"per_run": True} if self.per_run else {})}


@dataclass(frozen=True)
class Mechanism:
    """Physics that the simulator can do, and that is off in the baseline: each of its parameters at its ``start``.

    ``id`` is in lower case with hyphens (``dry-friction``).
    """

    id: str
    parameters: Sequence[Parameter]
    name: str = ""
    explanation: str = ""
    equation: str = ""
    reference: str = ""
    confused_with: Sequence[str] = ()

    def _header(self) -> dict[str, Any]:
        texts = {key: getattr(self, key) for key in ("name", "explanation", "equation", "reference")}
        header: dict[str, Any] = {"id": self.id, **{key: text for key, text in texts.items() if text}}
        if self.confused_with:
            header["confused_with"] = list(self.confused_with)
        return {**header, "parameter": [parameter._header("off") for parameter in self.parameters]}


@dataclass(frozen=True)
class Model:
    """A simulator with its parameters and mechanisms.

    ``predict(parameters, inputs)`` gets a dict of numbers by name and a dict of arrays of shape (rows,) by name, and returns a dict of
    arrays of shape (rows,), one a channel; with one channel the array alone will do. With ``batched`` the numbers are arrays of shape
    (sets,) and each channel has the shape (sets, rows). The same question has to have the same answer: seed what is random. It may raise
    :class:`~missing_physics.errors.NoPrediction` where there is no answer at these parameters; whatever else it raises ends the
    diagnosis and is raised there.

    Which columns of the runs are ``inputs`` (known exactly; noise may be correlated along the first) and which are ``channels``
    (measured) is asked of ``predict`` where it is not said. ``step`` is that of derivatives, in scales of a parameter: well above
    the simulator's own rounding. With ``joints``, ``predict(parameters, inputs, forces)`` also gets a dict of :class:`Force` by the joints'
    names (lists of them, one a set, with ``batched``), applies them, and is asked about friction, springs and stops that it knows nothing
    of. ``acts`` says which inputs drive it, and what they are between rows (``{"command_v": "hold"}``, or ``"linear"``): gains, delays,
    lags, dead zones and saturations of these are tried. ``noise`` holds one sigma of a channel where there was a calibration. ``file`` writes the simulator's
    own file at given parameters, where it has one (MJCF), for :meth:`Repaired.file`.
    """

    predict: Predict
    parameters: Sequence[Parameter] = ()
    mechanisms: Sequence[Mechanism] = ()
    inputs: Sequence[str] = ()
    channels: Sequence[str] = ()
    baseline: str = ""
    batched: bool = False
    step: float = 1e-3
    joints: Sequence[Joint] = ()
    acts: Mapping[str, str] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    file: Callable[[dict[str, float]], str] | None = None

    def _starts(self) -> dict[str, float]:
        freed = [parameter for mechanism in self.mechanisms for parameter in mechanism.parameters]
        return {parameter.name: parameter._first() for parameter in [*self.parameters, *freed]}

    def _columns(self, table: Table, channels: Sequence[str]) -> tuple[list[str], list[str]]:
        """The inputs and the channels among a table's columns."""
        given = [name for name, _ in table.columns if name != "run"]
        channels = list(channels)
        if not channels:
            if self.batched:
                raise DiagnosisError("a batched model says which columns are its channels, and this one has none")
            none = {joint.name: Force(("0", "0")) for joint in self.joints}
            answer = self.predict(self._starts(), table.first(), *([none] if none else []))
            if not isinstance(answer, Mapping):
                raise DiagnosisError("a model that returns an array alone says which column is its channel")
            channels = [str(name) for name in answer]
        absent = [name for name in channels if name not in given]
        if absent:
            raise RecordingError(f"the channel {absent[0]} is no column of the runs, which have {', '.join(given)}")
        return list(self.inputs) or [name for name in given if name not in channels], channels

    def _source(self, runs: Runs, name: str, gaps: bool = False, channels: Sequence[str] = ()) -> tuple[_engine.Source, Table]:
        """Runs as a recording in memory; ``channels`` where they are known already, and may be absent with ``gaps``."""
        channels = channels or self.channels
        if self.inputs and channels:
            runs = _only(runs, [*self.inputs, *channels])
        table = Table(runs, gaps=gaps, wanted=channels if gaps else ())
        inputs, channels = self._columns(table, channels)
        header: dict[str, Any] = {
            "domain": "custom",
            "input": [{**self._quantity(name), **({"acts": self.acts[name]} if name in self.acts else {})} for name in inputs],
            "channel": [self._quantity(name) for name in channels],
            "simulator": {"step": float(self.step)},
        }
        if self.parameters:
            header["parameter"] = [parameter._header("start") for parameter in self.parameters]
        if self.mechanisms:
            header["mechanism"] = [mechanism._header() for mechanism in self.mechanisms]
        if self.joints:
            header["joint"] = [joint._header() for joint in self.joints]
        if self.noise:
            header["noise"] = {name: float(sigma) for name, sigma in self.noise.items()}
        if self.baseline:
            header["baseline"] = self.baseline
        return memory(header, table, name, None), table

    def _quantity(self, name: str) -> dict[str, str]:
        return {"name": name, "unit": self.units.get(name, _engine.unit_of(name))}

    def _simulator(self) -> _engine.Simulator:
        if not self.joints:
            return _engine.Simulator(self.predict, self.batched)
        predict = self.predict

        def with_forces(parameters: dict[str, Any], inputs: dict[str, NDArray[np.float64]], acts: dict[str, Any]) -> Any:
            return predict(parameters, inputs, forces(acts))

        return _engine.Simulator(with_forces, self.batched)


def _only(runs: Runs, wanted: Sequence[str]) -> Runs:
    """Runs without the columns that a model does not speak of."""
    labels, given = labelled(runs)
    kept: list[Run] = [{name: run[name] for name in run if name in wanted} for run in given]
    return [{"run": label, **run} for label, run in zip(labels, kept)]
