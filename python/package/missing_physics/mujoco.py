"""An MJCF file as a model: its attributes are the parameters and the mechanisms, and the repaired file is written.

    >>> import missing_physics as mp
    >>> arm = mp.mujoco.model("arm.xml", joints=["shoulder", "elbow"])     # doctest: +SKIP
    >>> answer = mp.diagnose(arm, runs)                                    # doctest: +SKIP
    >>> answer.repaired().file("arm-repaired.xml")                         # doctest: +SKIP

It needs the package mujoco (``pip install missing-physics[mujoco]``).
"""

from __future__ import annotations

import copy
import re
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._model import Mechanism, Model, Parameter
from .errors import DiagnosisError

Floats = NDArray[np.float64]

#: What may differ from the file: attributes of a joint, the force of an actuator, a delay of all commands, and readings.
MECHANISMS = ("damping", "frictionloss", "stiffness", "armature", "gain", "delay", "sensor-offset", "sensor-gain")

#: Attribute of a joint: the column of MuJoCo's model, units for a hinge and a slide, what it does, its law.
_JOINT = {
    "damping": ("dof_damping", "N m s/rad", "N s/m", "viscous friction", "force = -damping velocity"),
    "frictionloss": ("dof_frictionloss", "N m", "N", "dry (Coulomb) friction", "|force| <= frictionloss, against the motion"),
    "stiffness": ("jnt_stiffness", "N m/rad", "N/m", "a spring", "force = -stiffness (position - springref)"),
    "armature": ("dof_armature", "kg m^2", "kg", "a rotor's inertia", "inertia + armature"),
}


@dataclass(frozen=True)
class _Attribute:
    """A number of the file that a parameter stands for: of a joint or an actuator with this name."""

    parameter: str
    kind: str
    of: str
    value: float


def model(
    file: str | PathLike[str],
    joints: Sequence[str] | None = None,
    *,
    channels: Sequence[str] | None = None,
    mechanisms: Sequence[str] = MECHANISMS,
    free: Sequence[str] = (),
    begins_at_rest: bool = True,
    longest_delay_s: float = 0.2,
    threads: int = 0,
) -> Model:
    """The model of an MJCF file: what joints do where actuators are told what they were told.

    A run has the columns ``t_s``, one for each actuator under its name in the file (its control, held from row to row) and the
    ``channels``: the joints' positions, ``<joint>_rad`` of a hinge and ``<joint>_m`` of a slide, unless others are named: velocities
    ``<joint>_rad_s``, ``<joint>_m_s``. ``joints`` are those of one degree of freedom that are measured (all, where nothing is said). A run
    begins where its channels say, a parameter of its own each, and at rest unless ``begins_at_rest`` is false; all else is as in
    the file's ``qpos0``.

    ``mechanisms`` are those of :data:`MECHANISMS` that may be left out, for each joint (``elbow-frictionloss``), for each actuator
    (``gain``: a factor of its force), for all commands (``command-delay``, in s, up to ``longest_delay_s``) and for each channel; each
    is off at the value that the file has. ``free`` names attributes that are unknown anyway, ``"elbow.damping"``, and are fitted
    in the baseline. Simulated is with the file's own timestep and integrator by ``mujoco.rollout``, on ``threads`` (0: this one).

    Raises :class:`~missing_physics.errors.DiagnosisError` where the file has not what is named, and what MuJoCo raises of the file.
    """
    simulation = _Simulation(fspath(file), joints, channels, threads)
    unknown = [kind for kind in mechanisms if kind not in MECHANISMS]
    if unknown:
        raise DiagnosisError(f"no mechanism {unknown[0]}, expected some of {', '.join(MECHANISMS)}")
    parameters = [
        Parameter(simulation.start_of(name), start="measured", scale=0.01, per_run=True, unit=unit)
        for name, unit in simulation.measured_positions()
    ]
    if not begins_at_rest:
        parameters += [
            Parameter(f"{joint.velocity}_at_start", scale=0.1, per_run=True, unit=joint.unit + "/s") for joint in simulation.joints
        ]
    declared: list[Mechanism] = []
    wanted = list(free)
    for mechanism, place in _mechanisms(simulation, longest_delay_s):
        if place in wanted:
            wanted.remove(place)
            parameters += mechanism.parameters
        elif place.rpartition(".")[2] in mechanisms:
            declared.append(mechanism)
    if wanted:
        raise DiagnosisError(f"no attribute {wanted[0]} of a joint or an actuator, expected one as elbow.damping")
    return Model(
        simulation,
        parameters=parameters,
        mechanisms=declared,
        inputs=["t_s", *simulation.actuators],
        channels=simulation.channels,
        baseline=f"the MuJoCo model {Path(fspath(file)).name} as the file has it",
        batched=True,
        units={**simulation.units(), **{actuator: "" for actuator in simulation.actuators}},
        file=simulation.file,
    )


def _mechanisms(simulation: _Simulation, longest_delay_s: float) -> list[tuple[Mechanism, str]]:
    """All mechanisms, each with its place in the file: ``elbow.damping``."""
    made: list[tuple[Mechanism, str]] = []
    for joint in simulation.joints:
        for kind, (_, of_hinge, of_slide, name, law) in _JOINT.items():
            start = simulation.attribute(f"{joint.name}_{kind}").value
            unit = of_hinge if joint.hinge else of_slide
            # What stops 1 rad/s, or drives it, within a second.
            scale = joint.inertia * (0.1 if kind == "armature" else 1.0)
            parameter = Parameter(f"{joint.name}_{kind}", start=start, lower=0.0, scale=scale, unit=unit)
            mechanism = Mechanism(_id(joint.name, kind), [parameter], f"{name} in {joint.name}", equation=law)
            made.append((mechanism, f"{joint.name}.{kind}"))
    for actuator in simulation.actuators:
        factor = Parameter(f"{actuator}_gain", start=1.0, lower=0.0, scale=0.1, unit="")
        mechanism = Mechanism(_id(actuator, "gain"), [factor], f"another force of {actuator}", equation="gain force")
        made.append((mechanism, f"{actuator}.gain"))
    if simulation.actuators:
        delay = Parameter("command_delay_s", lower=0.0, upper=longest_delay_s, scale=0.01)
        made.append((Mechanism("command-delay", [delay], "late commands", equation="control(t - delay)"), "command.delay"))
    for channel, unit in simulation.units().items():
        offset = Parameter(f"{channel}_offset", scale=0.01, unit=unit)
        made.append((Mechanism(_id(channel, "sensor-offset"), [offset], f"an offset of {channel}"), f"{channel}.sensor-offset"))
        factor = Parameter(f"{channel}_factor", start=1.0, lower=0.0, scale=0.01, unit="")
        made.append((Mechanism(_id(channel, "sensor-gain"), [factor], f"a gain of {channel}"), f"{channel}.sensor-gain"))
    return made


def _id(of: str, kind: str) -> str:
    return re.sub("[^a-z0-9]+", "-", f"{of}-{kind}".lower()).strip("-")


@dataclass(frozen=True)
class _Joint:
    """A joint of one degree of freedom: where it stands in MuJoCo's model."""

    name: str
    hinge: bool
    id: int
    position_at: int
    velocity_at: int
    inertia: float

    @property
    def unit(self) -> str:
        return "rad" if self.hinge else "m"

    @property
    def position(self) -> str:
        return f"{self.name}_{self.unit}"

    @property
    def velocity(self) -> str:
        return f"{self.name}_{self.unit}_s"


class _Simulation:
    """Many sets of parameters at once through MuJoCo: ``predict`` of a batched model. It pickles, with the file's text."""

    def __init__(self, path: str, joints: Sequence[str] | None, channels: Sequence[str] | None, threads: int) -> None:
        import mujoco

        self._path = path
        self._text = Path(path).read_text(encoding="utf-8")
        self._threads = threads
        self._compiled = model = mujoco.MjSpec.from_file(path).compile()
        self._prepare()
        named = [(model.joint(k).name, k) for k in range(model.njnt) if model.jnt_type[k] in (2, 3) and model.joint(k).name]
        wanted = [name for name, _ in named] if joints is None else list(joints)
        absent = [name for name in wanted if name not in dict(named)]
        if absent or not wanted:
            have = ", ".join(name for name, _ in named) or "none with a name"
            raise DiagnosisError(f"{path}: no joint {absent[0] if absent else ''} of one degree of freedom; it has {have}")
        self.joints = [self._joint(name, dict(named)[name]) for name in wanted]
        self.actuators = [model.actuator(k).name or f"actuator{k}" for k in range(model.nu)]
        known = [name for joint in self.joints for name in (joint.position, joint.velocity)]
        self.channels = [joint.position for joint in self.joints] if channels is None else list(channels)
        absent = [name for name in self.channels if name not in known]
        if absent:
            raise DiagnosisError(f"{path}: no channel {absent[0]}, expected some of {', '.join(known)}")
        self._attributes = {each.parameter: each for each in self._listed()}

    def _prepare(self) -> None:
        import mujoco

        # As it was compiled, and some to set: MuJoCo lets the interpreter go on while it simulates, and others may ask then.
        self._models = [copy.copy(self._compiled)]
        self._data = [mujoco.MjData(self._compiled)]
        self._lock = threading.Lock()

    def _joint(self, name: str, at: int) -> _Joint:
        model = self._compiled
        dof = int(model.jnt_dofadr[at])
        return _Joint(name, model.jnt_type[at] == 3, at, int(model.jnt_qposadr[at]), dof, float(model.dof_M0[dof]))

    def _listed(self) -> list[_Attribute]:
        """The numbers of the file that parameters stand for."""
        model = self._compiled
        listed = [
            _Attribute(f"{joint.name}_{kind}", kind, joint.name, float(getattr(model, column)[self._slot(column, joint)]))
            for joint in self.joints
            for kind, (column, *_) in _JOINT.items()
        ]
        return listed + [_Attribute(f"{actuator}_gain", "gain", actuator, 1.0) for actuator in self.actuators]

    @staticmethod
    def _slot(column: str, joint: _Joint) -> int:
        return joint.id if column.startswith("jnt") else joint.velocity_at

    def attribute(self, parameter: str) -> _Attribute:
        """The number of the file behind a parameter."""
        return self._attributes[parameter]

    def units(self) -> dict[str, str]:
        """Units of the channels."""
        of = {name: unit for joint in self.joints for name, unit in ((joint.position, joint.unit), (joint.velocity, joint.unit + "/s"))}
        return {name: of[name] for name in self.channels}

    def measured_positions(self) -> list[tuple[str, str]]:
        """The joints' positions among the channels, with their units."""
        return [(joint.position, joint.unit) for joint in self.joints if joint.position in self.channels]

    @staticmethod
    def start_of(position: str) -> str:
        """The parameter of a run that says where it began."""
        return f"{position}_at_start"

    def __call__(self, parameters: dict[str, Floats], inputs: dict[str, Floats]) -> dict[str, Floats]:
        """Columns of shape (sets,) and (rows,) in, channels of shape (sets, rows) out."""
        from mujoco import rollout

        t_s = inputs["t_s"] - inputs["t_s"][0]
        sets = len(next(iter(parameters.values())))
        with self._lock:
            models = [self._at(k, {name: float(values[k]) for name, values in parameters.items()}) for k in range(sets)]
            step_s = float(models[0].opt.timestep)
            steps = max(int(np.ceil(t_s[-1] / step_s - 1e-9)), 1)
            begun = np.stack([self._begin(models[k], parameters, k) for k in range(sets)])
            control = self._control(parameters.get("command_delay_s", np.zeros(sets)), inputs, step_s * np.arange(steps, dtype=np.float64), t_s)
            kept = self._data if self._threads else self._data[:1]
            state, _ = rollout.rollout(models, kept, begun, control, nstep=steps)
        # Time, positions, velocities; the first row is where it began.
        state = np.concatenate([begun[:, None], np.asarray(state)], axis=1)
        answer: dict[str, Floats] = {}
        positions = 1 + models[0].nq
        for joint in self.joints:
            for name, at in ((joint.position, 1 + joint.position_at), (joint.velocity, positions + joint.velocity_at)):
                if name in self.channels:
                    read = np.stack([np.interp(t_s, step_s * np.arange(steps + 1), each) for each in state[:, :, at]])
                    factor, offset = (parameters.get(f"{name}_{what}") for what in ("factor", "offset"))
                    read = read if factor is None else read * factor[:, None]
                    answer[name] = read if offset is None else read + offset[:, None]
        return {name: answer[name] for name in self.channels}

    def _at(self, k: int, values: dict[str, float]) -> Any:
        """Model ``k`` of those that are kept, with these numbers in it."""
        import mujoco

        while len(self._models) <= k:
            self._models.append(copy.copy(self._compiled))
        while len(self._data) < max(self._threads, 1):
            self._data.append(mujoco.MjData(self._compiled))
        model = self._models[k]
        for joint in self.joints:
            for kind, (column, *_) in _JOINT.items():
                name = f"{joint.name}_{kind}"
                if name in values:
                    getattr(model, column)[self._slot(column, joint)] = values[name]
        for at, actuator in enumerate(self.actuators):
            factor = values.get(f"{actuator}_gain", 1.0)
            model.actuator_gainprm[at, :3] = factor * self._compiled.actuator_gainprm[at, :3]
            model.actuator_biasprm[at, :3] = factor * self._compiled.actuator_biasprm[at, :3]
        # The inertias that constraints are scaled by depend on the armature.
        mujoco.mj_setConst(model, self._data[0])
        return model

    def _begin(self, model: Any, parameters: dict[str, Floats], k: int) -> Floats:
        """MuJoCo's full state at the start of a run."""
        import mujoco

        data = self._data[0]
        mujoco.mj_resetData(model, data)
        for joint in self.joints:
            for name, values, at in ((joint.position, data.qpos, joint.position_at), (joint.velocity, data.qvel, joint.velocity_at)):
                begun = parameters.get(self.start_of(name))
                if begun is not None:
                    values[at] = begun[k]
        state = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        return state

    def _control(self, delay_s: Floats, inputs: dict[str, Floats], at_s: Floats, t_s: Floats) -> Floats:
        """Controls at each step, of shape (sets, steps, actuators): held from row to row, and late as MuJoCo's own delay is, between
        steps linearly. What was told before the first row is taken for what that row says."""
        held = np.searchsorted(t_s, at_s + 1e-9, side="right") - 1
        told = np.stack([inputs[name][held] for name in self.actuators], axis=1) if self.actuators else np.zeros((len(at_s), 0))
        late = [np.stack([np.interp(at_s - delay, at_s, each) for each in told.T], axis=1) if delay else told for delay in delay_s]
        return np.stack(late)

    def file(self, parameters: dict[str, float]) -> str:
        """The MJCF file at these parameters, as MuJoCo writes it (six digits); readings are no part of it."""
        import mujoco

        path = Path(self._path)
        same = path.is_file() and path.read_text(encoding="utf-8") == self._text
        spec = mujoco.MjSpec.from_file(self._path) if same else mujoco.MjSpec.from_string(self._text)
        for name, value in parameters.items():
            attribute = self._attributes.get(name)
            if attribute is None or value == attribute.value:
                continue
            if attribute.kind == "gain":
                actuator = spec.actuators[self.actuators.index(attribute.of)]
                actuator.gainprm[:3] *= value
                actuator.biasprm[:3] *= value
            else:
                _set_first(spec.joint(attribute.of), attribute.kind, value)
        delay_s = parameters.get("command_delay_s", 0.0)
        if delay_s > 0:
            for actuator in spec.actuators:
                if not hasattr(actuator, "delay"):
                    raise DiagnosisError("this MuJoCo knows no delay of an actuator: a later one does")
                actuator.delay += delay_s
                actuator.interp = 1
                actuator.nsample = int(np.ceil(actuator.delay / spec.option.timestep)) + 2
        spec.compile()
        return str(spec.to_xml())

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key not in ("_models", "_data", "_lock")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()


def _set_first(element: Any, attribute: str, value: float) -> None:
    """Sets an attribute, or its first number where it has several (the linear one of a polynomial)."""
    now = getattr(element, attribute)
    if np.ndim(now) == 0:
        setattr(element, attribute, value)
    else:
        setattr(element, attribute, [value, *list(now)[1:]])
