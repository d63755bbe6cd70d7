"""What can go wrong, each with the words of the command.

All but :class:`NoPrediction` derive from :class:`MissingPhysicsError`.
"""

from __future__ import annotations


class MissingPhysicsError(Exception):
    """Any failure of this package."""


class RecordingError(MissingPhysicsError, ValueError):
    """A recording that cannot be read, or is not sound; it says which file, row and column, and what is expected."""


class ArrayError(RecordingError, TypeError):
    """A column of the wrong shape or kind."""


class DiagnosisError(MissingPhysicsError, ValueError):
    """A model or an option that makes no sense."""


class SimulatorError(MissingPhysicsError, RuntimeError):
    """A simulator that gave no usable prediction where one is needed, or another answer to the same question."""


class RepairError(MissingPhysicsError, ValueError):
    """A repaired model that does not fit what it is to predict."""


class PosteriorError(MissingPhysicsError, ValueError):
    """A prior, simulations or an observation from which no posterior is learned."""


class ChapterError(MissingPhysicsError, ValueError):
    """Arguments that a chapter's estimator refuses."""


class NoPrediction(Exception):
    """To be raised by a simulator that has no prediction at these parameters, where it may have one at others."""
