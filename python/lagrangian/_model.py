"""Models of a system: fitted, read from a file, or known."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _lagrangian
from ._trajectory import Coordinate, Outcome, Trajectory, _coordinates, _real, _whole
from .errors import InvalidInput, ModelError, RolloutWarning

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    import numpy as np
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Self

__all__ = ["Model", "integrators", "load", "own_system", "robot", "system", "systems"]


class Model(_lagrangian.Model):
    """A model that predicts motion, forces and energy.

    Its arrays are ``(n,)`` for one state or ``(…, n)`` for many, in SI units; ``out=`` takes the array that a result is
    written to. M and c contain no friction, inverse dynamics contain it.
    """

    __slots__ = ("_origin",)

    _origin: tuple[str, Any] | None

    def __new__(cls, core: _lagrangian.Model, origin: tuple[str, Any] | None = None) -> Self:
        model = super().__new__(cls, core)
        model._origin = origin
        return model

    def __init__(self, *_: Any) -> None:
        super().__init__()

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """The coordinates of the state."""
        return tuple(Coordinate(*c) for c in super().coordinates)

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return len(super().coordinates)

    def with_sites(self, sites: int) -> Model:
        """The law of a chain on another number of sites, as one that was learned on 32 moves 1000.

        Args:
            sites: The number of sites.

        Raises:
            LagrangianError: If the model is not a chain of equal sites.
        """
        return Model(super().with_sites(sites))

    def formula(self, *, seed: int = 0) -> Model:
        """The law that a fitted model has learned, as a formula.

        It is searched in motions that the model predicts from states that its data visited, with white noise of 0.01, 0.1 or 1 % of
        their deviation: the least within which it obeys a law. Any model that moves has one to be searched for, a plain network as well.

        Args:
            seed: Seed of the noise and of the forces that drive a model whose data had some.

        Returns:
            A model whose ``law`` is the formula, and whose ``parameters`` are its terms.

        Raises:
            LagrangianError: If it is no fitted model, has no dynamics, or no formula was found.
        """
        return Model(super().distil(seed)[0])

    def rollout(
        self,
        q0: ArrayLike,
        qd0: ArrayLike,
        duration: float | None = None,
        step: float = 0.01,
        *,
        times: ArrayLike | None = None,
        tau: ArrayLike | Callable[[float, Any, Any], ArrayLike] | None = None,
        hold: str = "previous",
        method: str = "dop853",
        rtol: float = 1e-10,
        atol: float = 1e-10,
        max_steps: int = 1_000_000,
    ) -> Trajectory:
        """The motion from an initial state.

        Args:
            q0, qd0: The initial state, shape ``(n,)`` each.
            duration: How long, s.
            step: The time between two samples, s, and the step of the methods of fixed step.
            times: The times of the samples instead of ``duration`` and ``step``, s.
            tau: Forces: an array ``(m, n)`` at the times, a function of (t, q, qd) that returns ``(n,)``, or none. The friction of
                a fitted model is its own, as it was learned; a known system has none unless it is given here, such as
                ``lambda t, q, qd: -0.1 * qd``.
            hold: Forces of an array between two times: ``previous`` as a digital controller, or ``linear``.
            method: A name of ``integrators()``.
            rtol, atol: Tolerances of the adaptive methods.
            max_steps: The number of steps at most.

        Returns:
            The motion; its ``outcome`` says how it ended. A motion that diverges is no error: a ``RolloutWarning`` says so,
            and the part until then is returned.

        >>> import lagrangian as lg
        >>> pendulum = lg.system("pendulum", length=0.5)
        >>> motion = pendulum.rollout([1.0], [0.0], duration=10.0)
        >>> energy = pendulum.energy(motion.q, motion.qd)
        >>> bool(abs(energy - energy[0]).max() < 1e-8)
        True
        """
        if times is None:
            if duration is None:
                raise InvalidInput("duration is not given: give duration (and step), or times")
            times = _lagrangian.times(_real(duration, "duration"), _real(step, "step"))
        how = integration(method, step=step, rtol=rtol, atol=atol, max_steps=max_steps)
        parts, end = _lagrangian.roll_out(self, (q0, qd0), times, tau, hold, how)
        return _predicted(parts, end)

    def follow(
        self,
        trajectory: Trajectory,
        *,
        hold: str = "previous",
        method: str = "dopri5",
        rtol: float = 1e-6,
        atol: float = 1e-6,
        max_steps: int = 1_000_000,
    ) -> Trajectory:
        """The motion of a recording again: from its first state, under its forces, at its times.

        >>> import lagrangian as lg
        >>> [swing] = lg.simulate("pendulum", duration=2.0)
        >>> again = lg.system("pendulum").follow(swing)
        >>> bool(abs(again.q - swing.q).max() < 1e-4)
        True
        """
        how = integration(method, step=0.01, rtol=rtol, atol=atol, max_steps=max_steps)
        parts, end = _lagrangian.follow(self, trajectory, hold, how)
        return _predicted(parts, end)

    def score(self, data: Any) -> Assessment:
        """How good the model is on recordings, and how far it can be trusted."""
        from ._trajectory import trajectories

        return Assessment(_lagrangian.score(self, trajectories(data, "data")))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the model to a file, the same as that of the command (``model.safetensors``)."""
        super().save(Path(path))

    def plot_energy(self, motion: Trajectory, ax: Axes | None = None) -> Axes:
        """Draws the energy along a motion as the change from its first sample."""
        from ._plot import plot_energy

        return plot_energy(self, motion, ax)

    def torque_parts(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """What the torques are made of: ``inertial``, ``coriolis``, ``gravity``, ``friction``, ``offset``; their sum is
        ``inverse_dynamics``. All have the shape ``(…, n)`` of ``q``.

        >>> import lagrangian as lg
        >>> parts = lg.system("pendulum", length=2.0).torque_parts([0.0], [3.0], [1.0])
        >>> float(parts["inertial"][0])
        4.0
        """
        return _lagrangian.torque_parts(self, q, qd, qdd)

    def plot_torque(self, motion: Trajectory, ax: Axes | None = None, coordinate: int = 0) -> Axes:
        """Draws the parts of the torque of a coordinate along a motion, and what was recorded."""
        from ._plot import plot_torque

        return plot_torque(self, motion, ax, coordinate)

    def __reduce__(self) -> tuple[Any, ...]:
        if self._origin is not None:
            return _again, self._origin
        return _unpickled, (self.to_bytes(),)

    def __deepcopy__(self, _: Any) -> Model:
        return self

    def __copy__(self) -> Model:
        return self

    def __repr__(self) -> str:
        return f"Model({self.family} of {', '.join(c.name for c in self.coordinates)})"


class Assessment:
    """How good a model is on some recordings.

    Attributes:
        verdict: ``good``, ``fair`` or ``poor``.
        expectation: By how much a prediction errs half a second ahead, and what new motions can expect; empty where it is unknown.
        reasons: Why it is not better, the gravest first: dictionaries with ``grade``, ``finding`` and ``remedy``.
        score: The errors: ``acceleration``, ``torque`` (each with ``mse`` and ``nmse`` for each coordinate), ``rollouts``, …
        details: All that was assessed.
    """

    def __init__(self, figures: Mapping[str, Any]) -> None:
        self.verdict: str = figures["verdict"]
        self.expectation: str = figures["assessment"]["expectation"]
        self.reasons: list[dict[str, str]] = figures["assessment"]["reasons"]
        self.score: dict[str, Any] = figures["score"]
        self.details: dict[str, Any] = figures["assessment"]

    def __str__(self) -> str:
        lines = [f"verdict: {self.verdict}"]
        if self.expectation and all(r["finding"] != self.expectation for r in self.reasons):
            lines.append(self.expectation)
        for name in ("acceleration", "torque"):
            error = self.score[name]
            if error is not None:
                values = ", ".join(f"{100.0 * x:.3g} %" for x in error["nmse"])
                lines.append(f"{name}: {values} of the variance")
        lines += [f"{r['grade']}: {r['finding']}; {r['remedy']}" for r in self.reasons]
        return "\n".join(lines)

    __repr__ = __str__


def integration(
    method: str, *, step: float, rtol: float, atol: float, max_steps: int = 1_000_000
) -> dict[str, Any]:
    return {
        "method": method,
        "step": _real(step, "step"),
        "rtol": _real(rtol, "rtol"),
        "atol": _real(atol, "atol"),
        "max_steps": _whole(max_steps, "max_steps"),
    }


def outcome(end: Mapping[str, Any]) -> Outcome:
    kind = end.get("outcome", end.get("kind"))
    counts = (int(end.get(name, 0)) for name in ("steps", "evaluations", "singular"))
    return Outcome(kind, end.get("t"), end.get("reason"), *counts)


def warn_of(end: Outcome, what: str, depth: int = 3) -> None:
    """Warns of a motion that has not reached its end."""
    if end.kind == "finished":
        return
    why = f" ({end.reason})" if end.reason else ""
    remedy = {
        "diverged": "start where the data were, or fit more of them",
        "step-limit": "loosen rtol and atol, or raise max_steps",
    }.get(end.kind, "start it again")
    message = f"{what} has ended at {end.t:g} s: {end.kind}{why}: {remedy}"
    warnings.warn(message, RolloutWarning, stacklevel=depth + 1)


def _predicted(parts: dict[str, Any], end: Mapping[str, Any]) -> Trajectory:
    own = outcome(end)
    warn_of(own, "the rollout")
    return Trajectory._of(parts, own)


def load(path: str | os.PathLike[str]) -> Model:
    """Reads a model from a file, or from the folder of a run.

    >>> import lagrangian as lg
    >>> lg.load("missing.safetensors")
    Traceback (most recent call last):
    FileNotFoundError: [Errno 2] No such file or directory: 'missing.safetensors'
    """
    file = Path(path)
    if file.is_dir():
        file = file / "model.safetensors"
    if not file.exists():
        raise FileNotFoundError(2, os.strerror(2), str(file))
    return Model(_lagrangian.load(file))


def system(name: str, **parameters: float) -> Model:
    """A system whose Lagrangian is known.

    Args:
        name: A name of ``systems()``.
        parameters: Its parameters, such as ``length=0.5``; the others have their usual values.

    >>> import lagrangian as lg
    >>> lg.system("two-link-arm").mass_matrix([0.0, 0.0]).shape
    (2, 2)
    """
    own = [(key.replace("_", "-"), _real(value, key)) for key, value in parameters.items()]
    known = _parameters(name)
    own = [(key if key in known else key.replace("-", "_"), value) for key, value in own]
    return Model(_lagrangian.system(name, own), ("system", (name, own)))


def own_system(
    lagrangian: Callable[[Any, Any], Any],
    n: int,
    *,
    angles: str | Iterable[str | int] = (),
    names: Sequence[str] | None = None,
    units: Sequence[str] | None = None,
    name: str = "own",
) -> Model:
    """A system whose Lagrangian is a Python function, for small data: its derivatives are exact, by hyper-dual numbers.

    Each evaluation of the motion calls the function some (n + 1)² times, in one thread.

    Args:
        lagrangian: A function of (q, qd), arrays of n numbers each, that returns L in J. It is made of arithmetic and
            functions of NumPy (not of ``math``).
        n: The number of coordinates.
        angles, names, units: Of the coordinates, as those of ``Trajectory``.
        name: The name of the system.

    >>> import numpy as np
    >>> import lagrangian as lg
    >>> bead = lg.own_system(lambda q, qd: 0.5 * qd[0] ** 2 + 9.8 * np.cos(q[0]), 1, angles="all")
    >>> bead.forward_dynamics([np.pi / 2], [0.0])
    array([-9.8])
    """
    if not callable(lagrangian):
        raise InvalidInput(f"lagrangian is a {type(lagrangian).__name__}: give a function of (q, qd)")
    if n < 1:
        raise InvalidInput(f"n is {n}: a system has at least one coordinate")
    own = [(c.name, c.unit, c.kind) for c in _coordinates(_whole(n, "n"), angles, names, units, ())]
    return Model(_lagrangian.own_system(name, lagrangian, own), ("own", (name, lagrangian, own)))


def _parameters(name: str) -> set[str]:
    return {p["name"] for s in systems() if s["name"] == name for p in s["parameters"]}


def robot(urdf: str | os.PathLike[str], joints: Sequence[str] = ()) -> Model:
    """The robot of a URDF file (or of its text, or an example's name such as ``iiwa7``), with the friction of its description.

    Args:
        urdf: The file, its text, or the name of an example.
        joints: Joints in the order of the coordinates; the others are locked at 0. All of them by default.

    >>> import lagrangian as lg
    >>> lg.robot("iiwa7").gravity([0.0, 1.57, 0.0, 0.0, 0.0, 0.0, 0.0]).shape
    (7,)
    """
    text = urdf_text(urdf)
    return Model(_lagrangian.robot(text, list(joints)), ("robot", (text, list(joints))))


def urdf_text(urdf: str | os.PathLike[str]) -> str:
    """The text of a URDF file, or what is no path as it is."""
    if isinstance(urdf, str) and ("<" in urdf or not os.path.exists(urdf)):
        if "<" not in urdf and (os.sep in urdf or urdf.endswith((".urdf", ".xml"))):
            raise FileNotFoundError(2, os.strerror(2), urdf)
        return urdf
    file = Path(urdf)
    if file.stat().st_size > 8 << 20:
        raise InvalidInput(f"urdf '{file}' is larger than 8 MiB: give the description of one robot")
    return file.read_text(encoding="utf-8")


def systems() -> list[dict[str, Any]]:
    """The systems whose Lagrangian is known: name, about, parameters with units and usual values."""
    found: list[dict[str, Any]] = json.loads(_lagrangian.systems())
    return found


def integrators() -> list[str]:
    """The names of the methods of integration."""
    return list(_lagrangian.integrators())


def _unpickled(data: bytes) -> Model:
    try:
        return Model(_lagrangian.load(data))
    except ModelError as error:
        raise ModelError(f"the pickle holds a model that cannot be read: {error}") from error


def _again(kind: str, arguments: Any) -> Model:
    if kind == "system":
        return Model(_lagrangian.system(*arguments), (kind, arguments))
    if kind == "own":
        return Model(_lagrangian.own_system(*arguments), (kind, arguments))
    if kind == "robot":
        return Model(_lagrangian.robot(*arguments), (kind, arguments))
    raise ModelError(f"the pickle holds a '{kind}', which this version does not know: install a newer one")
