"""The diagnosis of a folder, of arrays, or of arrays beside one's own simulator."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from os import PathLike, fspath
from typing import Any

from . import _engine
from ._diagnosis import Diagnosis, Setting
from ._model import Model
from ._recording import Runs, Table, memory
from .errors import DiagnosisError, RecordingError

#: Called with a stage and how much of it is done, from 0 to 1; what it raises stops the diagnosis.
Progress = Callable[[str, float], object]


def diagnose(
    recording: Model | str | PathLike[str] | None = None,
    runs: Runs | None = None,
    *,
    domain: str | None = None,
    rig: Mapping[str, Any] | None = None,
    noise: Mapping[str, float] | None = None,
    settings: Mapping[str, Any] | None = None,
    files: Mapping[str, bytes | str | PathLike[str]] | None = None,
    name: str = "runs",
    seed: int = 1,
    alpha: float = 0.05,
    threads: int = 0,
    progress: Progress | bool | None = None,
    allow_command: bool = False,
) -> Diagnosis:
    """Says what a simulation misses in a recording, where, and what explains it.

    One of three: a folder with ``recording.toml``; ``domain=`` and ``runs=`` with what that domain asks for (:func:`domains`); a
    :class:`Model` of one's own and ``runs``. ``rig`` and ``noise`` are those sections of the header (SI units, as the keys say),
    ``settings`` any further keys, ``files`` further files by name (bytes, or paths): pictures, sounds, meshes. ``seed`` is of every
    random draw, ``alpha`` the rate of false alarms that is put up with (above 0, below 0.5), ``threads`` 0 for all cores; the answer
    does not depend on their number. ``progress`` is called with stage and part done, or ``True`` for a bar by tqdm. A recording that
    starts a program of its own is refused without ``allow_command``.

    Raises :class:`~missing_physics.errors.RecordingError`, :class:`~missing_physics.errors.DiagnosisError`,
    :class:`~missing_physics.errors.SimulatorError`, ``KeyboardInterrupt``, and what ``progress`` or a model's function raises.
    """
    model, setting, table, simulator = None, None, None, None
    if isinstance(recording, Model):
        if runs is None:
            raise DiagnosisError("runs is missing: a model is diagnosed against runs")
        if domain is not None or rig is not None or settings is not None or files is not None:
            raise DiagnosisError("domain, rig, settings and files are a recording's, and a model has none of them")
        if noise is not None:
            raise DiagnosisError("the noise of a model's channels is given to the model")
        model = recording
        source, table = model._source(runs, name)
        simulator = model._simulator()
    elif recording is not None:
        if runs is not None or domain is not None:
            raise DiagnosisError("a folder holds its runs and names its domain: give it alone")
        source = _engine.Source.folder(fspath(recording))
        if source.program is not None and not allow_command:
            program = " ".join(source.program)
            raise DiagnosisError(f"{source.name}: starts the program {program}: allow_command=True lets it run")
    else:
        if domain is None or runs is None:
            raise DiagnosisError("expected a folder, a model and runs, or domain= and runs=")
        setting = Setting({"domain": domain, **_sections(rig, noise, settings)}, files)
        if "command" in (setting.header.get("simulator") or {}) and not allow_command:
            raise DiagnosisError(f"{name}: starts a program: allow_command=True lets it run")
        table = Table(runs)
        source = memory(setting.header, table, name, files)
    try:
        with _bar(progress) as told:
            said = _engine.diagnose(source, simulator, seed, float(alpha), threads, told)
    except RecordingError as error:
        raise (error if table is None else table.located(error)) from None
    return Diagnosis(said, model, setting)


def domains() -> list[dict[str, Any]]:
    """The domains with their baselines, the columns and keys that they read, and the mechanisms that they know."""
    listed: list[dict[str, Any]] = json.loads(_engine.domains())
    return listed


def _sections(
    rig: Mapping[str, Any] | None, noise: Mapping[str, float] | None, settings: Mapping[str, Any] | None
) -> dict[str, Any]:
    sections = dict(settings or {})
    for key, section in (("rig", rig), ("noise", noise)):
        if section is not None:
            sections[key] = dict(section)
    return sections


class _bar:
    """What is told of the progress: nothing, a function of the caller's, or a bar by tqdm."""

    def __init__(self, progress: Progress | bool | None) -> None:
        self._told: Progress | None = progress if callable(progress) else None
        self._bar: Any = None
        if progress is True:
            from tqdm.auto import tqdm

            self._bar = tqdm(total=1.0, bar_format="{desc}: {percentage:3.0f} %|{bar}| {elapsed}")
            self._told = self._show

    def _show(self, stage: str, done: float) -> None:
        self._bar.set_description_str(stage, refresh=False)
        self._bar.n = done
        self._bar.refresh()

    def __enter__(self) -> Progress | None:
        return self._told

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
