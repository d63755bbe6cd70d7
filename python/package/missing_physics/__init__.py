"""Which physics does a simulation leave out? Recordings and a simulator in, a diagnosis out.

    >>> import missing_physics as mp
    >>> answer = mp.diagnose("recordings/dropped-ball")     # doctest: +SKIP
    >>> answer.verdict, answer.chosen                       # doctest: +SKIP
    ('explained', ['quadratic-drag'])
"""

from __future__ import annotations

from . import bayes_sim, bounce_audio, errors, granular_infer, hertz_contact, liquid_haptics, mujoco
from ._diagnose import diagnose, domains
from ._diagnosis import Diagnosis, Estimate, MechanismReport, Prediction, Repaired, RunCurves
from ._engine import version as _version
from ._forces import Force, Joint
from ._model import Mechanism, Model, Parameter
from ._prove import Proof, prove
from .errors import MissingPhysicsError, NoPrediction

__version__ = _version()

__all__ = [
    "Diagnosis",
    "Estimate",
    "Force",
    "Joint",
    "Mechanism",
    "MechanismReport",
    "MissingPhysicsError",
    "Model",
    "NoPrediction",
    "Parameter",
    "Prediction",
    "Proof",
    "Repaired",
    "RunCurves",
    "__version__",
    "bayes_sim",
    "bounce_audio",
    "diagnose",
    "domains",
    "errors",
    "granular_infer",
    "hertz_contact",
    "liquid_haptics",
    "mujoco",
    "prove",
]
