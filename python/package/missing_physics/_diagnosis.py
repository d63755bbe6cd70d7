"""What a diagnosis says, and the model that it repairs."""

from __future__ import annotations

import html as _html
import json
import math
import pickle
from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _engine
from ._model import Model
from ._recording import Runs, Table, labelled, memory
from .errors import RecordingError, RepairError

if TYPE_CHECKING:
    import pandas

#: Half the width of a 95 % interval of a normal law, in sigmas.
_SIGMAS = 1.959963984540054


@dataclass(frozen=True)
class Estimate:
    """A parameter's best value with its 95 % interval, in its unit; NaN where the data bound nothing."""

    name: str
    value: float
    ci95: tuple[float, float]
    unit: str

    @classmethod
    def _of(cls, said: Mapping[str, Any]) -> Estimate:
        value, low, high = (math.nan if v is None else float(v) for v in (said["value"], *said["ci95"]))
        return cls(said["name"], value, (low, high), said["unit"])


@dataclass(frozen=True)
class MechanismReport:
    """What is said of one mechanism: its probability given these data and the others listed, and its parameters where it is on."""

    id: str
    name: str
    probability: float
    parameters: dict[str, Estimate]
    heldout_log_score_gain: float | None
    ruled_out: str | None


@dataclass(frozen=True)
class RunCurves:
    """Data and fits of one run: columns by name, each of shape (rows,)."""

    run: str
    inputs: dict[str, NDArray[np.float64]]
    measured: dict[str, NDArray[np.float64]]
    before: dict[str, NDArray[np.float64]]
    after: dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Prediction:
    """What a repaired model says of one run: columns by channel, each of shape (rows,), in the channel's unit.

    ``sigma`` is that of the simulated value; a reading lies between ``low95`` and ``high95`` with 95 %.
    """

    run: str
    inputs: dict[str, NDArray[np.float64]]
    channels: dict[str, NDArray[np.float64]]
    sigma: dict[str, NDArray[np.float64]]
    low95: dict[str, NDArray[np.float64]]
    high95: dict[str, NDArray[np.float64]]

    def __getitem__(self, channel: str) -> NDArray[np.float64]:
        return self.channels[channel]


@dataclass(frozen=True)
class Setting:
    """What a recording in memory says beside its runs."""

    header: Mapping[str, Any]
    files: Mapping[str, Any] | None = None
    channels: tuple[str, ...] = ()


class Repaired:
    """The model that a diagnosis ended with: the chosen mechanisms on, each by as much as was found."""

    def __init__(self, model: str, caveat: str | None, own: Model | None = None, setting: Setting | None = None) -> None:
        self._json = model
        #: What whoever predicts by it should know; none where the diagnosis left nothing open.
        self.caveat = caveat
        self._model = own
        self._setting = setting

    @property
    def parameters(self) -> dict[str, float]:
        """All shared parameters of the full model, by name."""
        return {each["name"]: each["value"] for each in json.loads(self._json)["model"]["parameters"]}

    @property
    def mechanisms(self) -> list[str]:
        """Identifiers of the mechanisms that are on."""
        return list(json.loads(self._json)["model"]["mechanisms"])

    def json(self) -> str:
        """The file that the command ``predict`` takes."""
        return self._json

    def file(self, path: str | PathLike[str] | None = None) -> str:
        """The simulator's own file (MJCF) with what was found in it; written to ``path`` as well, where one is given."""
        if self._model is None or self._model.file is None:
            raise RepairError("the model has no file of its own: json() is what the command predict takes")
        text = self._model.file(self.parameters)
        if path is not None:
            Path(fspath(path)).write_text(text, encoding="utf-8")
        return text

    def save(self, path: str | PathLike[str]) -> None:
        """Writes what :meth:`json` says."""
        Path(fspath(path)).write_text(self._json, encoding="utf-8")

    @classmethod
    def load(cls, path: str | PathLike[str], model: Model | None = None) -> Repaired:
        """Reads that file; ``model`` is one's own, where it is of one."""
        return cls(Path(fspath(path)).read_text(encoding="utf-8"), None, model)

    def predict(self, runs: Runs | str | PathLike[str], *, threads: int = 0) -> Any:
        """Predicts runs, or the recording in a folder: every row, measured or not.

        The shared parameters stay as they were found; where each run began is fitted to what is measured of it. A channel that a run has
        not, or NaN in it, is what was not measured. One run in, one :class:`Prediction` out; else a list of them.
        """
        table = None
        if isinstance(runs, (str, PathLike)):
            source = _engine.Source.folder(fspath(runs))
        elif self._model is not None:
            source, table = self._model._source(runs, "runs", gaps=True, channels=self._channels())
        elif self._setting is not None:
            table = Table(runs, gaps=True, wanted=self._setting.channels)
            source = memory(self._setting.header, table, "runs", self._setting.files)
        else:
            raise RepairError("the model is of a folder, or came without its simulator: give it a folder to predict, or the simulator")
        simulator = self._model._simulator() if self._model is not None and table is not None else None
        try:
            said = _engine.predict(self._json, source, simulator, threads)
        except RecordingError as error:
            raise (error if table is None else table.located(error)) from None
        predicted = [self._prediction(said, *run) for run in said["runs"]]
        single = isinstance(runs, Mapping) and len(labelled(runs)[1]) == 1 and not all(isinstance(v, Mapping) for v in runs.values())
        return predicted[0] if single else predicted

    def _channels(self) -> list[str]:
        return [each["channel"] for each in json.loads(self._json)["model"]["noise"]]

    @staticmethod
    def _prediction(said: Mapping[str, Any], label: str, inputs: Any, values: Any, sigmas: Any) -> Prediction:
        names = said["channels"]
        half = {name: _SIGMAS * np.hypot(s, noise) for name, s, noise in zip(names, sigmas, said["noise"])}
        channels = dict(zip(names, values))
        low = {name: channels[name] - half[name] for name in names}
        high = {name: channels[name] + half[name] for name in names}
        return Prediction(label, dict(zip(said["variables"], inputs)), channels, dict(zip(names, sigmas)), low, high)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Repaired) and self._json == other._json

    def __hash__(self) -> int:
        return hash(self._json)

    def __repr__(self) -> str:
        on = ", ".join(self.mechanisms) or "nothing beside the baseline"
        return f"<Repaired: {on}>"

    def __getstate__(self) -> dict[str, Any]:
        return _without_what_does_not_pickle(self.__dict__)


class Diagnosis:
    """A verdict, with everything that stands behind it. It pickles, compares by its JSON, and shows its report in a notebook."""

    def __init__(self, said: Mapping[str, Any], model: Model | None, setting: Setting | None) -> None:
        self._said = dict(said)
        self._model = model
        self._setting = setting
        #: The answer's format as a dict: docs/format.md has every key.
        self.answer: dict[str, Any] = json.loads(said["json"])

    @property
    def verdict(self) -> str:
        """``adequate``, ``explained``, ``partly``, ``ambiguous`` or ``unexplained``."""
        return str(self.answer["verdict"])

    @property
    def chosen(self) -> list[str]:
        """Identifiers of the mechanisms that explain the recording."""
        return list(self.answer["chosen"])

    @property
    def p_value(self) -> float:
        """Of the baseline's adequacy."""
        return float(self.answer["p_value"])

    @property
    def parameters(self) -> dict[str, Estimate]:
        """Parameters of the chosen mechanisms by name; by ``mechanism.name`` where two have one name."""
        found: dict[str, Estimate] = {}
        chosen = [mechanism for mechanism in self.mechanisms if mechanism.id in self.chosen]
        names = [name for mechanism in chosen for name in mechanism.parameters]
        for mechanism in chosen:
            for name, estimate in mechanism.parameters.items():
                found[name if names.count(name) == 1 else f"{mechanism.id}.{name}"] = estimate
        return found

    @property
    def baseline_parameters(self) -> dict[str, Estimate]:
        """Shared parameters of the baseline's fit, by name."""
        return {each["name"]: Estimate._of(each) for each in self.answer["baseline_parameters"]}

    @property
    def mechanisms(self) -> list[MechanismReport]:
        """Every mechanism that these data can speak of, likeliest first."""
        return [
            MechanismReport(
                said["id"],
                said["name"],
                said["probability"],
                {each["name"]: Estimate._of(each) for each in said["parameters"]},
                said["heldout_log_score_gain"],
                said["ruled_out"],
            )
            for said in self.answer["mechanisms"]
        ]

    @property
    def law(self) -> str | None:
        """The empirical law found where nothing listed explains the recording."""
        return None if self.answer["law"] is None else str(self.answer["law"]["formula"])

    @property
    def curves(self) -> list[RunCurves]:
        """What was measured and simulated in each run."""
        variables = [name for name, _ in self._said["variables"]]
        channels = [name for name, _ in self._said["channels"]]
        return [
            RunCurves(run, dict(zip(variables, inputs)), *(dict(zip(channels, columns)) for columns in rest))
            for run, inputs, *rest in self._said["curves"]
        ]

    def json(self) -> str:
        """The answer, the same bytes as the command's ``--json``."""
        return str(self._said["json"])

    def text(self) -> str:
        """The report as the command prints it."""
        return str(self._said["text"])

    def html(self, path: str | PathLike[str] | None = None) -> str:
        """The report as one page; written to ``path`` as well, where one is given."""
        return self._written("html", path)

    def svg(self, path: str | PathLike[str] | None = None) -> str:
        """A picture of where it misses most; written to ``path`` as well, where one is given."""
        return self._written("svg", path)

    def _written(self, key: str, path: str | PathLike[str] | None) -> str:
        text = str(self._said[key])
        if path is not None:
            Path(fspath(path)).write_text(text, encoding="utf-8")
        return text

    def repaired(self, model: Model | None = None) -> Repaired:
        """The model with what was found; ``model`` where the diagnosis has lost its own on the way (it did not pickle)."""
        if self._said["model"] is None:
            domain = self.answer["domain"]
            raise RepairError(f"the domain {domain} judges errors that it has whitened, not channels: its repaired model predicts none")
        setting = self._setting
        if setting is not None:
            setting = Setting(setting.header, setting.files, tuple(name for name, _ in self._said["channels"]))
        return Repaired(self._said["model"], self._said["caveat"], model or self._model, setting)

    def to_dataframe(self) -> pandas.DataFrame:
        """Mechanisms and their parameters, one row a parameter (needs pandas)."""
        import pandas

        rows = [
            {
                "mechanism": mechanism.id,
                "chosen": mechanism.id in self.chosen,
                "probability": mechanism.probability,
                "parameter": estimate.name,
                "value": estimate.value,
                "low95": estimate.ci95[0],
                "high95": estimate.ci95[1],
                "unit": estimate.unit,
                "heldout_log_score_gain": mechanism.heldout_log_score_gain,
            }
            for mechanism in self.mechanisms
            for estimate in mechanism.parameters.values()
        ]
        columns = "mechanism chosen probability parameter value low95 high95 unit heldout_log_score_gain".split()
        return pandas.DataFrame(rows, columns=columns)

    def curves_to_dataframe(self) -> pandas.DataFrame:
        """Inputs, measurements and fits, one row a measured row (needs pandas)."""
        import pandas

        parts = []
        for curves in self.curves:
            columns: dict[str, Any] = dict(curves.inputs)
            for what, values in (("", curves.measured), ("before_", curves.before), ("after_", curves.after)):
                columns.update({what + name: column for name, column in values.items()})
            parts.append(pandas.DataFrame({"run": curves.run, **columns}))
        return pandas.concat(parts, ignore_index=True)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Diagnosis) and self.json() == other.json()

    def __hash__(self) -> int:
        return hash(self.json())

    def __repr__(self) -> str:
        return f"<Diagnosis: {self.text().splitlines()[0]}>"

    def __str__(self) -> str:
        return self.text()

    def _repr_html_(self) -> str:
        page = _html.escape(self.html(), quote=True)
        return f'<iframe srcdoc="{page}" style="width:100%;height:720px;border:0" title="diagnosis"></iframe>'

    def __getstate__(self) -> dict[str, Any]:
        return _without_what_does_not_pickle(self.__dict__)


def _without_what_does_not_pickle(state: Mapping[str, Any]) -> dict[str, Any]:
    """A model whose function is local stays behind; everything else goes along."""
    kept = dict(state)
    try:
        pickle.dumps(kept["_model"])
    except (pickle.PicklingError, AttributeError, TypeError):
        kept["_model"] = None
    return kept
