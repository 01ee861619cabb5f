"""What can go wrong, and what to do: every message ends with the remedy.

``LagrangianError`` is the base of all errors. Those about arguments are also ``ValueError`` or ``TypeError``, where Python
expects these.
"""

from __future__ import annotations

__all__ = [
    "DataError",
    "FitInterrupted",
    "FitWarning",
    "FolderInUse",
    "InvalidInput",
    "InvalidType",
    "LagrangianError",
    "LagrangianWarning",
    "MissingExtra",
    "ModelError",
    "NotFitted",
    "NotSupported",
    "RolloutWarning",
    "SingularMassMatrix",
]


class LagrangianError(Exception):
    """The base of all errors of this package."""


class InvalidInput(LagrangianError, ValueError):
    """An argument has a wrong shape or value."""


class FolderInUse(InvalidInput):
    """Another process is writing a run into the folder."""


class InvalidType(LagrangianError, TypeError):
    """An argument has a wrong type."""


class DataError(LagrangianError, ValueError):
    """Recordings cannot be read, or a fit of them would be meaningless."""


class ModelError(LagrangianError, ValueError):
    """The file of a model is damaged, of a later version, or no model."""


class NotSupported(LagrangianError, NotImplementedError):
    """The model does not have what was asked for, as a plain network has no mass matrix."""


class NotFitted(LagrangianError, ValueError, AttributeError):
    """The estimator has not been fitted."""


class MissingExtra(LagrangianError, ImportError):
    """An optional dependency is not installed; the message names the extra."""


class LagrangianWarning(UserWarning):
    """The base of all warnings of this package."""


class FitWarning(LagrangianWarning):
    """A fit has ended with a model that must not be used, or the data look wrong."""


class FitInterrupted(FitWarning):
    """A fit was ended by Ctrl-C; the best model until then is kept."""


class RolloutWarning(LagrangianWarning):
    """A rollout has ended before the last of its times; it holds the part that was computed."""


class SingularMassMatrix(LagrangianWarning):
    """The mass matrix is singular at some states; their accelerations are the least-norm ones."""
