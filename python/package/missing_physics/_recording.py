"""Runs of a recording as arrays, made into what the engine reads."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, Union

import numpy as np

from . import _engine
from .errors import ArrayError, RecordingError

#: One run: columns by name, each of shape (rows,); a number stands for a column of it.
Run = Mapping[str, Any]
#: Runs as a list (labelled "1", "2", ... or by their own key "run"), by label, or as a data frame with a column "run".
Runs = Union[Sequence[Run], Mapping[str, Run], Any]

_TABLE = "data.csv"


class Table:
    """Runs one after another, as columns of one table."""

    def __init__(self, runs: Runs, *, gaps: bool = False, wanted: Sequence[str] = ()) -> None:
        self.labels, given = labelled(runs)
        self.lengths: list[int] = []
        names = [name for name in dict.fromkeys([*(given[0] if given else ()), *wanted]) if name != "run"]
        columns: dict[str, list[np.ndarray[Any, Any]]] = {name: [] for name in names}
        for at, run in enumerate(given):
            place = f"runs[{at}]"
            length = _length(run, place)
            self.lengths.append(length)
            unknown = [name for name in run if name not in columns and name != "run"]
            if unknown:
                raise RecordingError(f"{place} has the column {unknown[0]}, runs[0] has not")
            for name in names:
                if name in run:
                    columns[name].append(_column(run[name], length, f'{place}["{name}"]', gaps))
                elif gaps:
                    columns[name].append(np.full(length, np.nan))
                else:
                    raise RecordingError(f"{place} has not the column {name}, runs[0] has it")
        self.columns: list[tuple[str, Any]] = [
            ("run", [label for label, length in zip(self.labels, self.lengths) for _ in range(length)])
        ]
        for name, parts in columns.items():
            whole = np.concatenate(parts) if parts else np.zeros(0)
            self.columns.append((name, whole.tolist() if whole.dtype.kind == "U" else whole))

    def first(self) -> dict[str, np.ndarray[Any, Any]]:
        """The columns of numbers of the first run."""
        rows = self.lengths[0] if self.lengths else 0
        return {name: values[:rows] for name, values in self.columns if isinstance(values, np.ndarray)}

    def located(self, error: RecordingError) -> RecordingError:
        """The same error with the run's place and the row within it, where it names a row of the table."""
        found = re.match(rf".*?{re.escape(_TABLE)}, row (\d+), column (.*)", str(error), re.DOTALL)
        if found is None:
            return error
        row = int(found[1]) - 1
        for at, length in enumerate(self.lengths):
            if row < length:
                return type(error)(f"runs[{at}], row {row}, column {found[2]}")
            row -= length
        return error


def labelled(runs: Runs) -> tuple[list[str], list[Run]]:
    """The labels and the runs of any form in which they may come."""
    if hasattr(runs, "groupby"):
        if "run" not in runs:
            raise RecordingError("the data frame has not the column run, which tells its runs apart")
        grouped = [(str(label), frame) for label, frame in runs.groupby("run", sort=False)]
        return [label for label, _ in grouped], [
            {name: frame[name].to_numpy() for name in frame.columns if name != "run"} for _, frame in grouped
        ]
    if isinstance(runs, Mapping):
        if runs and all(isinstance(run, Mapping) for run in runs.values()):
            return [str(label) for label in runs], list(runs.values())
        return [str(runs.get("run", "1"))], [runs]
    listed = list(runs)
    for at, run in enumerate(listed):
        if not isinstance(run, Mapping):
            raise ArrayError(f"runs[{at}] is a {type(run).__name__}, expected columns by name")
    return [str(run.get("run", at + 1)) for at, run in enumerate(listed)], listed


def memory(
    header: Mapping[str, Any], table: Table, name: str, files: Mapping[str, bytes | str | PathLike[str]] | None
) -> _engine.Source:
    """A recording in memory; a file is its bytes, or a path to be read."""
    whole = {"format": 1, "data": _TABLE, **header}
    read = []
    for file, content in (files or {}).items():
        if not isinstance(content, bytes):
            with open(content, "rb") as opened:
                content = opened.read()
        read.append((file, content))
    return _engine.Source.memory(name, json.dumps(_plain(whole)), table.columns, read)


def _length(run: Run, place: str) -> int:
    for name, values in run.items():
        if name != "run" and np.ndim(values) > 0:
            return len(values)
    raise ArrayError(f"{place} has no column of numbers")


def _column(values: Any, length: int, place: str, gaps: bool) -> np.ndarray[Any, Any]:
    array = np.asarray(values)
    if array.dtype.kind == "O" and all(isinstance(value, str) for value in array.ravel()):
        array = array.astype(str)
    if array.dtype.kind not in "fiubU":
        try:
            if array.dtype.kind == "c":
                raise TypeError
            array = array.astype(np.float64)
        except (TypeError, ValueError):
            raise ArrayError(f"{place} holds {array.dtype}, expected numbers") from None
    if array.ndim == 0:
        array = np.full(length, array)
    if array.ndim != 1:
        raise ArrayError(f"{place} has the shape {array.shape}, expected ({length},)")
    if len(array) != length:
        raise ArrayError(f"{place} has {len(array)} rows, expected {length} as in the run's first column")
    if array.dtype.kind == "U":
        return array
    array = np.ascontiguousarray(array, dtype=np.float64)
    wrong = ~np.isfinite(array)
    if gaps:
        wrong &= ~np.isnan(array)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise RecordingError(f"{place} is {array[row]} at row {row}, expected a finite number")
    return array


def _plain(value: Any) -> Any:
    """A header's value as JSON knows it; infinite bounds are no bounds."""
    if isinstance(value, Mapping):
        kept = {str(key): _plain(inner) for key, inner in value.items()}
        return {key: inner for key, inner in kept.items() if inner is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
