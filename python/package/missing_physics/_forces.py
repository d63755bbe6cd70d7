"""What acts on the joints of a simulator beside what it knows."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

#: A force by position, speed and driving force.
Law = Callable[[float, float, float], float]

_FUNCTIONS: dict[str, Any] = {
    "__builtins__": {},
    "abs": abs,
    "exp": math.exp,
    "max": max,
    "min": min,
    "sign": lambda v: int(v > 0) - int(v < 0),
    "sin": math.sin,
}


@dataclass(frozen=True)
class Joint:
    """A joint of a simulator on which friction, springs and stops may act that the simulator knows nothing of.

    ``position`` is the channel that measures it, or its name where none does: then ``range`` (two positions between which it moves),
    ``speed`` (a typical one) and ``unit`` say what the channel would. ``typical_force`` is a mass times a typical acceleration, in
    ``force_unit``. ``driven``: the simulator knows the driving force ``u``; ``turns``: it rotates, so that cogging makes sense.
    ``without`` lists mechanisms that are not to be tried, such as what a parameter of the simulator says already.
    """

    name: str
    position: str
    typical_force: float
    force_unit: str = ""
    range: tuple[float, float] | None = None
    speed: float | None = None
    unit: str | None = None
    driven: bool = False
    turns: bool = False
    without: Sequence[str] = ()

    def _header(self) -> dict[str, Any]:
        keys: dict[str, Any] = {"name": self.name, "position": self.position, "typical_force": float(self.typical_force)}
        given = {"range": self.range and [float(each) for each in self.range], "speed": self.speed, "unit": self.unit}
        keys.update({key: value for key, value in given.items() if value is not None})
        keys.update({key: True for key in ("driven", "turns") if getattr(self, key)})
        if self.without:
            keys["without"] = list(self.without)
        return {**keys, "force_unit": self.force_unit} if self.force_unit else keys


@dataclass(frozen=True)
class Force:
    """What acts on a joint, by its position ``x``, its speed ``v`` and its driving force ``u``.

    ``force(x, v, u)`` adds to all other forces. ``friction(x, v, u)`` is the modulus of what opposes the motion, and holds at rest what is
    below it: MuJoCo's ``frictionloss``. ``texts`` are the two as expressions.
    """

    texts: tuple[str, str]

    @property
    def force(self) -> Law:
        return _law(self.texts[0])

    @property
    def friction(self) -> Law:
        return _law(self.texts[1])


@functools.lru_cache(maxsize=4096)
def _law(text: str) -> Law:
    law: Law = eval(f"lambda x, v, u: {text}", dict(_FUNCTIONS))  # the package's own text, of numbers and the names above
    return law


def forces(acts: dict[str, Any]) -> dict[str, Any]:
    """What the compiled part says of each joint, as forces; one a set of parameters where there are many."""
    return {name: Force(said) if isinstance(said, tuple) else [Force(each) for each in said] for name, said in acts.items()}
