"""Concealed effects: worlds drawn, sealed, diagnosed and scored."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any

from . import _engine


@dataclass(frozen=True)
class Proof:
    """What a proof has shown: its score as the command prints it, and as a dict (``score.json`` in its folder)."""

    folder: Path
    text: str
    score: dict[str, Any]

    def __str__(self) -> str:
        return self.text


def prove(
    folder: str | PathLike[str],
    *,
    domain: str | None = None,
    worlds: int = 20,
    kind: str | None = None,
    seed: int = 1,
    threads: int = 0,
    progress: Callable[[str, float], object] | None = None,
) -> Proof:
    """Proves the tool on worlds whose answers are sealed before any diagnosis, as the command ``prove`` does.

    ``worlds`` of a ``domain`` (all, where nothing is said), ``kind`` of what they hide (``nothing``, ``one``, ``two``, ``unlisted``, ``leftover``,
    ``imitated``, ``local``; in turns, where nothing is said). All is kept in ``folder`` as it is made: the same call goes on where one was
    stopped. Over a cluster: :func:`missing_physics.campaigns.prove`. Raises :class:`~missing_physics.errors.DiagnosisError`.
    """
    return finished(_engine.Proof(fspath(folder), domain, worlds, kind, seed, threads), folder, progress)


def finished(proof: _engine.Proof, folder: str | PathLike[str], progress: Callable[[str, float], object] | None) -> Proof:
    """The proof, once whatever is left of it is done here."""
    text = proof.prove(progress)
    score: dict[str, Any] = json.loads(Path(fspath(folder), "score.json").read_text(encoding="utf-8"))
    return Proof(Path(fspath(folder)), text, score)
