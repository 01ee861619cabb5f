import os
from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import Self, disjoint_base

__version__: str

_Array = NDArray[np.float64]

@disjoint_base
class Model:
    """A model that predicts motion, forces and energy."""

    def __new__(cls, core: Model, *_others: Any) -> Self: ...
    @property
    def coordinates(self) -> Any: ...
    @property
    def family(self) -> str:
        """The family, or the name of the system."""
    @property
    def moves(self) -> bool:
        """Whether it has forward dynamics, so that it can be rolled out."""
    @property
    def preparation(self) -> dict[str, Any] | None:
        """How its recordings were prepared; ``None`` where that is not known."""
    @property
    def parameters(self) -> list[dict[str, Any]]:
        """The parameters that have a name and a unit: friction, offsets, inertias, terms of a formula."""
    @property
    def law(self) -> dict[str, str] | None:
        """The law of a formula: ``text``, ``latex``, ``verdict`` (law, expansion or none) and its ``meaning``; ``None`` for other models."""
    def with_sites(self, sites: int) -> Model: ...
    def distil(self, seed: int) -> tuple[Model, float]: ...
    def forward_dynamics(
        self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike | None = None, *, out: _Array | None = None
    ) -> _Array:
        """Accelerations q̈ of states under forces, rad/s² or m/s².

        Args:
            q, qd: Coordinates and velocities, ``(n,)`` or ``(…, n)``.
            tau: Forces, N·m or N, of the same shape; none by default.
            out: The array that the result is written to.

        Returns:
            An array of the shape of q; ``out`` where it was given.

        Raises:
            InvalidInput: An argument has another shape or is not finite.
            NotSupported: A plain network of torques has no forward dynamics.
        """
    def inverse_dynamics(
        self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, *, out: _Array | None = None
    ) -> _Array:
        """Forces τ that yield the accelerations, with friction, N·m or N; arguments as ``forward_dynamics``."""
    def mass_matrix(
        self, q: ArrayLike, qd: ArrayLike | None = None, *, out: _Array | None = None
    ) -> _Array:
        """The mass matrix M = ∂²L/∂q̇∂q̇, kg·m² or kg, shape ``(…, n, n)``; at rest where no velocities are given."""
    def bias(self, q: ArrayLike, qd: ArrayLike, *, out: _Array | None = None) -> _Array:
        """The bias c = (∂p/∂q) q̇ − ∂L/∂q: Coriolis, centrifugal and conservative forces, without friction."""
    def gravity(self, q: ArrayLike, *, out: _Array | None = None) -> _Array:
        """The forces that hold the system at rest, c(q, 0)."""
    def momentum(self, q: ArrayLike, qd: ArrayLike, *, out: _Array | None = None) -> _Array:
        """The momentum p = ∂L/∂q̇."""
    def energy(self, q: ArrayLike, qd: ArrayLike, *, out: _Array | None = None) -> _Array:
        """The energy H = p·q̇ − L, J, shape ``(…)``."""
    def lagrangian(self, q: ArrayLike, qd: ArrayLike, *, out: _Array | None = None) -> _Array:
        """The Lagrangian L = p·q̇ − H, J, shape ``(…)``."""
    def distance_from_data(self, q: ArrayLike, qd: ArrayLike, *, out: _Array | None = None) -> _Array:
        """The distance of states from those that the data of the fit visited, shape ``(…)``.

        Above 1 the model extrapolates: the state is farther from the data than the recorded states are from each other, or beyond
        the range of a coordinate or velocity by a tenth of that range. The distance is in parts of that border.

        Raises ``NotSupported`` for a system that was not fitted.
        """
    def to_bytes(self) -> bytes:
        """The bytes of the file of the model."""
    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the file of the model: a whole one or none."""

@final
class Online:
    """A learner, whose thread begins with the first row."""

    def __new__(cls, named: Sequence[tuple[str, str, str]], request: str, seed: int) -> Self: ...
    def update(self, t: float, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> None: ...
    def take(self) -> Model | None: ...
    def close(self) -> dict[str, Any] | None: ...

@final
class Prediction:
    """What an ensemble predicts."""

    @property
    def mean(self) -> _Array:
        """The mean of the members."""
    @property
    def deviation(self) -> _Array:
        """The deviation to be expected of the truth."""
    def band(self, level: float) -> tuple[_Array, _Array]:
        """The lower and the upper end of the band that holds the truth with a probability."""
    def quantile(self, probability: float) -> _Array:
        """The quantile of the truth with a probability."""

@final
class Ensemble:
    """Several models of the same data."""

    @staticmethod
    def read(folder: str | os.PathLike[str]) -> tuple[Ensemble, dict[str, Any]]:
        """Reads the ensemble of a folder, and what was said of its fit."""
    def write(self, folder: str | os.PathLike[str], summary: str) -> None:
        """Writes the ensemble to a folder, with what was said of its fit as JSON."""
    def members(self) -> list[Model]:
        """Its members."""
    def accelerations(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> Prediction:
        """The accelerations at states under forces."""
    def torques(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Prediction:
        """The torques of motions."""
    def positions(self, motions: Sequence[ArrayLike]) -> Prediction:
        """The positions of a motion that all members predicted, from the positions of each."""
    def coverage(self, trajectories: Sequence[Any]) -> dict[str, Any]:
        """The parts of the samples of recordings that lie in the bands."""

@final
class Asked:
    """The columns that a layout needs of a file."""

    @property
    def topic(self) -> str | None:
        """The topic of a bag."""
    @property
    def actuated(self) -> list[str]:
        """The joints that forces act on; all where there are none."""
    def columns(self, signal: str) -> list[str]:
        """The columns of a signal that were named."""
    def asks_for(self, name: str) -> bool:
        """Whether the layout reads a column of this name, with or without a number after it."""
    def used(self, arrays: Sequence[tuple[str, int | None]]) -> list[int]:
        """Of arrays, each with its name and the number of its columns where it has two axes, the indices of those that are read."""

@final
class Number:
    """A number that carries derivatives through a Lagrangian that is written in Python."""

def own_system(
    name: str, function: Callable[[Any, Any], Any], named: Sequence[tuple[str, str, str]]
) -> Model: ...
def check(trajectories: Sequence[Any], low_pass: float | None = None) -> dict[str, Any]: ...
def constraints(trajectories: Sequence[Any], points: Sequence[Sequence[int]] | None = None) -> dict[str, Any]: ...
def command(arguments: Sequence[str]) -> int: ...
def content_hashes(training: Sequence[Any], validation: Sequence[Any]) -> list[dict[str, Any]]: ...
def drive(
    robot: Model,
    policy: Callable[[float, _Array, _Array], ArrayLike],
    start: tuple[Sequence[float], Sequence[float]],
    seconds: float,
    control: dict[str, Any],
) -> dict[str, Any]: ...
def example_urdf(name: str) -> str | None: ...
def families() -> str: ...
def fit(
    training: Sequence[Any],
    validation: Sequence[Any],
    request: str,
    layout: str,
    run: dict[str, Any] | None = None,
    callback: Callable[[dict[str, Any]], Any] | None = None,
) -> tuple[Model, dict[str, Any]]: ...
def fit_ensemble(
    training: Sequence[Any],
    validation: Sequence[Any],
    request: str,
    layout: str,
    members: int,
    run: dict[str, Any] | None = None,
    callback: Callable[[dict[str, Any]], Any] | None = None,
) -> tuple[Ensemble, dict[str, Any]]: ...
def fit_samples(
    samples: Sequence[_Array | None],
    validation: Sequence[int],
    names: Sequence[tuple[str, str, str]],
    request: str,
    callback: Callable[[dict[str, Any]], Any] | None = None,
) -> tuple[Model, dict[str, Any]]: ...
def fresh(named: Sequence[tuple[str, str, str]], request: str) -> Model: ...
def follow(
    model: Model, trajectory: Any, hold: str, integration: dict[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]: ...
def follow_reference(
    model: Model | None,
    learner: Online | None,
    robots: tuple[Model, tuple[float, Model] | None],
    reference: Any,
    law: tuple[str, float, Sequence[float], Sequence[float]],
    control: dict[str, Any],
) -> dict[str, Any]: ...
def integrators() -> list[str]: ...
def layer_source(model: Model, library: str) -> str: ...
def library_seconds(
    model: Model, motion: tuple[ArrayLike, ArrayLike, ArrayLike], calls: int
) -> float:
    """The time of one ``inverse_dynamics`` of the library at some states, s; ``tools/figures.py`` compares it with a call."""

def load(source: bytes | os.PathLike[str]) -> Model: ...
def read(
    paths: Sequence[os.PathLike[str]], columns: dict[str, Any]
) -> tuple[list[dict[str, Any]], list[str], str]: ...
def read_table(table: bytes, columns: dict[str, Any]) -> tuple[list[dict[str, Any]], list[str], str]: ...
def page(report: str) -> str: ...
def animation(motions: Sequence[Any], links: str, lengths: Sequence[float] | None) -> str: ...
def torque_parts(
    model: Model, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike
) -> dict[str, _Array]: ...
def plant(machine: Any, named: Sequence[tuple[str, str, str]]) -> Model: ...
def report(run: os.PathLike[str]) -> tuple[os.PathLike[str], str]: ...
def robot(urdf: str, joints: Sequence[str]) -> Model: ...
def roll_out(
    model: Model,
    start: tuple[ArrayLike, ArrayLike],
    times: ArrayLike,
    tau: Any,
    hold: str,
    integration: dict[str, Any],
) -> tuple[dict[str, Any], dict[str, Any]]: ...
def score(model: Model, trajectories: Sequence[Any]) -> dict[str, Any]: ...
def set_threads(count: int) -> None:
    """Sets the number of threads of later fits and rollouts; 0 for one on each core."""

def simulate(
    model: Model, asking: dict[str, Any], integration: dict[str, Any]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]: ...
def system(name: str, parameters: Sequence[tuple[str, float]]) -> Model: ...
def systems() -> str: ...
def times(duration: float, step: float) -> _Array: ...
def training_settings() -> str: ...
def unit_name(
    request: str, layout: str, data: Sequence[tuple[str, str]]
) -> str: ...
def weights(model: Model) -> tuple[list[_Array], list[tuple[str, int, int]]]: ...
def with_weights(model: Model, weights: ArrayLike) -> Model: ...
def write(path: os.PathLike[str], motions: Sequence[Any]) -> None: ...
