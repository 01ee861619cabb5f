"""Learns the mechanics of a physical system from its trajectories.

Three lines from a log to a model::

    import lagrangian as lg

    robot = lg.fit(lg.read("log.csv", angles="all"))
    tau = robot.inverse_dynamics(q, qd, qdd)

Arrays are NumPy's, in SI units, ``(n,)`` for one state or ``(…, n)`` for many: ``q``, ``qd``, ``qdd`` are coordinates,
velocities and accelerations, ``tau`` are forces. Angles are in radians and unwrapped.
"""

from __future__ import annotations

from . import callbacks, errors, pixels
from ._data import CheckReport, Item, Structure, check, constraints, read, simulate, write
from ._ensemble import Coverage, Ensemble, Prediction
from ._estimators import Estimator, fit
from ._families import (
    Best,
    Cartesian,
    Chain,
    Delan,
    Formula,
    Hnn,
    Lattice,
    Lnn,
    Mlp,
    NeuralOde,
    Rigid,
    Servo,
    Vin,
)
from ._lagrangian import __version__, set_threads
from ._layer import Layer
from ._model import Assessment, Model, integrators, load, own_system, robot, system, systems
from ._online import OnlineLearner
from ._report import Animation, Report, report
from ._tracking import Followed, Tracking, track
from ._trajectory import Coordinate, Outcome, Trajectories, Trajectory
from .errors import LagrangianError

__all__ = [
    "Animation",
    "Assessment",
    "Best",
    "Cartesian",
    "Chain",
    "CheckReport",
    "Coordinate",
    "Coverage",
    "Delan",
    "Formula",
    "Ensemble",
    "Estimator",
    "Followed",
    "Hnn",
    "Item",
    "LagrangianError",
    "Lattice",
    "Layer",
    "Lnn",
    "Mlp",
    "Model",
    "NeuralOde",
    "OnlineLearner",
    "Outcome",
    "Prediction",
    "Report",
    "Rigid",
    "Servo",
    "Structure",
    "Tracking",
    "Trajectories",
    "Trajectory",
    "Vin",
    "__version__",
    "callbacks",
    "check",
    "constraints",
    "errors",
    "fit",
    "integrators",
    "load",
    "own_system",
    "pixels",
    "read",
    "report",
    "robot",
    "set_threads",
    "simulate",
    "system",
    "systems",
    "track",
    "write",
]
