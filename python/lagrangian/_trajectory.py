"""Motions: recorded or predicted, both are a ``Trajectory``."""

from __future__ import annotations

import reprlib
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .errors import InvalidInput, InvalidType, MissingExtra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from ._report import Animation

__all__ = ["Coordinate", "Trajectory"]

SIGNALS = ("q", "qd", "qdd", "tau", "p", "goal", "kp", "kd", "supply", "enabled")


class Coordinate(NamedTuple):
    """A generalised coordinate.

    Attributes:
        name: Its name.
        unit: Its SI unit, ``rad`` or ``m``.
        kind: ``circle`` for an angle (q and q + 2π are the same), ``line``, or ``parameter`` for one that never moves.
    """

    name: str
    unit: str
    kind: str


class Trajectory:
    """One motion, recorded or predicted.

    Args:
        t: Times, s, shape ``(m,)``, increasing.
        q: Generalised coordinates, shape ``(m, n)`` or ``(m,)`` for one; angles unwrapped, in radians.
        qd: Velocities, shape ``(m, n)``; estimated by a fit where they are missing.
        qdd: Accelerations, shape ``(m, n)``; estimated alike.
        tau: Generalised forces, N·m or N, shape ``(m, n)``; none for a free motion.
        p: Momenta in SI units, shape ``(m, n)``.
        angles: Which coordinates are angles: their names or numbers, or ``"all"``.
        names: Names of the coordinates, ``q1 … qn`` by default.
        units: Units of coordinates that are not angles, ``m`` by default.
        parameters: Names or numbers of coordinates that never move.
        name: A name to tell the motion from others; of several with the same name, findings add their numbers.
        goal, kp, kd, supply, enabled: What position-controlled drives were told, shape ``(m, n)`` each.

    Arrays of float64 that are contiguous are kept without a copy.

    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> swing = Trajectory(t, 0.1 * np.cos(3.0 * t), angles="all")
    >>> swing
    Trajectory('motion': 101 samples of q1 in 1 s; q)
    """

    __slots__ = (*SIGNALS, "coordinates", "name", "outcome", "t")

    t: NDArray[np.float64]
    q: NDArray[np.float64]
    qd: NDArray[np.float64] | None
    qdd: NDArray[np.float64] | None
    tau: NDArray[np.float64] | None
    p: NDArray[np.float64] | None
    goal: NDArray[np.float64] | None
    kp: NDArray[np.float64] | None
    kd: NDArray[np.float64] | None
    supply: NDArray[np.float64] | None
    enabled: NDArray[np.float64] | None
    name: str
    coordinates: tuple[Coordinate, ...]
    #: How a predicted motion ended; ``None`` for a recorded one.
    outcome: Outcome | None

    def __init__(
        self,
        t: ArrayLike,
        q: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        p: ArrayLike | None = None,
        *,
        angles: str | Iterable[str | int] = (),
        names: Sequence[str] | None = None,
        units: Sequence[str] | None = None,
        parameters: Iterable[str | int] = (),
        name: str = "motion",
        goal: ArrayLike | None = None,
        kp: ArrayLike | None = None,
        kd: ArrayLike | None = None,
        supply: ArrayLike | None = None,
        enabled: ArrayLike | None = None,
    ) -> None:
        self.t = _numbers(t, "t")
        if self.t.ndim != 1:
            raise InvalidInput(f"t has shape {self.t.shape}: give the times as one row, (m,)")
        m = len(self.t)
        positions = _numbers(q, "q")
        if positions.ndim == 1:
            positions = positions.reshape(-1, 1)
        if positions.ndim != 2 or len(positions) != m or positions.shape[1] == 0:
            raise InvalidInput(
                f"q has shape {positions.shape} and t has {m} times: give q as (m, n), a row for each time"
            )
        n = positions.shape[1]
        self.q = positions
        given = dict(
            qd=qd, qdd=qdd, tau=tau, p=p, goal=goal, kp=kp, kd=kd, supply=supply, enabled=enabled
        )
        for signal, values in given.items():
            setattr(self, signal, None if values is None else _rows(values, signal, m, n))
        self.name = str(name)
        self.outcome = None
        self.coordinates = _coordinates(n, angles, names, units, parameters)

    @classmethod
    def _of(cls, parts: dict[str, Any], outcome: Outcome | None = None) -> Trajectory:
        motion = cls.__new__(cls)
        for signal in SIGNALS:
            setattr(motion, signal, parts.get(signal))
        motion.t = parts["t"]
        motion.name = parts["name"]
        motion.coordinates = tuple(Coordinate(*c) for c in parts["coordinates"])
        motion.outcome = outcome
        return motion

    def _parts(self) -> tuple[str, list[tuple[str, str, str]], Any, dict[str, Any]]:
        signals = {s: getattr(self, s) for s in SIGNALS}
        known = {s: values for s, values in signals.items() if values is not None}
        return self.name, [(c.name, c.unit, c.kind) for c in self.coordinates], self.t, known

    def __getstate__(self) -> dict[str, Any]:
        return {slot: getattr(self, slot) for slot in self.__slots__}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for slot, value in state.items():
            setattr(self, slot, value)

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return int(self.q.shape[1])

    @property
    def duration(self) -> float:
        """The time from the first sample to the last, s."""
        return float(self.t[-1] - self.t[0]) if len(self.t) else 0.0

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, rows: slice) -> Trajectory:
        """The samples of a slice."""
        if not isinstance(rows, slice):
            raise TypeError(
                "a trajectory is cut by a slice, such as motion[100:200]; single samples are in motion.q[k]"
            )
        part = self._copy()
        part.t = self.t[rows]
        for signal in SIGNALS:
            values = getattr(self, signal)
            setattr(part, signal, None if values is None else values[rows])
        return part

    def _copy(self) -> Trajectory:
        motion = type(self).__new__(type(self))
        motion.__setstate__(self.__getstate__())
        return motion

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Trajectory):
            return NotImplemented
        same = self.name == other.name and self.coordinates == other.coordinates
        return same and all(
            _equal(getattr(self, s), getattr(other, s)) for s in ("t", *SIGNALS)
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        names = ", ".join(c.name for c in self.coordinates)
        known = ", ".join(s for s in SIGNALS if getattr(self, s) is not None)
        text = f"Trajectory({self.name!r}: {len(self)} samples of {names} in {self.duration:g} s; {known}"
        if self.outcome is not None and self.outcome.kind != "finished":
            text += f"; {self.outcome.kind} at {self.outcome.t:g} s"
        return text + ")"

    def to_dict(self) -> dict[str, NDArray[np.float64]]:
        """The columns by their names, as a file has them: ``t``, ``q1 … qn``, ``qd1 …``.

        >>> Trajectory([0.0, 0.1], [1.0, 2.0]).to_dict()["q1"]
        array([1., 2.])
        """
        columns = {"t": self.t}
        for signal in SIGNALS:
            values = getattr(self, signal)
            if values is not None:
                for i in range(self.n):
                    columns[f"{signal}{i + 1}"] = values[:, i]
        return columns

    def to_pandas(self) -> Any:
        """The columns of ``to_dict`` as a ``pandas.DataFrame``."""
        try:
            import pandas
        except ImportError as error:
            raise MissingExtra("to_pandas needs pandas: pip install 'lagrangian[pandas]'") from error
        return pandas.DataFrame(self.to_dict())

    def plot(self, ax: Axes | None = None, signal: str = "q") -> Axes:
        """Draws a signal over time.

        Args:
            ax: Where to draw; new axes by default.
            signal: ``q``, ``qd``, ``qdd``, ``tau`` or another that is known.

        Returns:
            The axes.
        """
        from ._plot import plot_signal

        return plot_signal(self, ax, signal)

    def plot_phase(self, ax: Axes | None = None, coordinate: int = 0) -> Axes:
        """Draws the phase portrait of a coordinate: its velocity over its position."""
        from ._plot import plot_phase

        return plot_phase(self, ax, coordinate)

    def animate(
        self, *others: Trajectory, links: str = "absolute", lengths: Sequence[float] | None = None
    ) -> Animation:
        """The motion as a chain of links that moves in the notebook, beside others of the same chain.

        Args:
            others: Motions to show beside it, up to five, such as a prediction.
            links: Where angles are measured: ``absolute``, from hanging down, ``relative``, from the link before, or ``horizontal``,
                the first from the horizontal and each other from the link before.
            lengths: Of the links, one for each; all the same by default.

        Raises:
            InvalidInput: A coordinate is no angle, or another argument is wrong.

        >>> import lagrangian as lg
        >>> [swing] = lg.simulate("double-pendulum", duration=2.0)
        >>> swing.animate(lengths=[1.0, 0.5]).html[:15]
        '<!DOCTYPE html>'
        """
        from ._report import Animation

        return Animation([self, *others], links, lengths)


class Outcome(NamedTuple):
    """How a rollout ended.

    Attributes:
        kind: ``finished``, ``diverged``, ``step-limit`` or ``stopped``.
        t: The time that was reached, s; ``None`` where it finished.
        reason: Why it diverged.
        steps: The number of accepted steps.
        evaluations: The number of evaluations of the forward dynamics.
        singular: The number of those at which the mass matrix was singular.
    """

    kind: str
    t: float | None
    reason: str | None
    steps: int
    evaluations: int
    singular: int


def _equal(a: Any, b: Any) -> bool:
    if a is None or b is None:
        return a is b
    return bool(np.array_equal(a, b, equal_nan=True))


def _numbers(values: ArrayLike, name: str) -> NDArray[np.float64]:
    try:
        array = np.asarray(values)
    except (ValueError, TypeError) as error:
        raise InvalidType(f"{name} cannot be made an array ({error}): give real numbers") from error
    if array.dtype.kind not in "fiu":
        raise InvalidType(f"{name} has dtype {array.dtype}: give an array of real numbers (float64)")
    return np.ascontiguousarray(array, dtype=np.float64)


def _real(value: Any, name: str) -> float:
    """An argument that is a number."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidType(f"{name} is {reprlib.repr(value)}: give a number") from error


def _whole(value: Any, name: str) -> int:
    """An argument that is a whole number, 0 or above."""
    number = value if isinstance(value, (int, np.integer)) else _real(value, name)
    if not (0 <= number < 2**63 and number == int(number)):
        raise InvalidInput(f"{name} is {reprlib.repr(value)}: give a whole number, 0 or above")
    return int(number)


def _rows(values: ArrayLike, name: str, m: int, n: int) -> NDArray[np.float64]:
    array = _numbers(values, name)
    if array.ndim == 1 and n == 1:
        array = array.reshape(-1, 1)
    if array.shape != (m, n):
        raise InvalidInput(
            f"{name} has shape {array.shape}: give ({m}, {n}), a row for each time and a column for each coordinate"
        )
    return array


def _coordinates(
    n: int,
    angles: str | Iterable[str | int],
    names: Sequence[str] | None,
    units: Sequence[str] | None,
    parameters: Iterable[str | int],
) -> tuple[Coordinate, ...]:
    if names is None:
        names = [f"q{i + 1}" for i in range(n)]
    for what, given in (("names", names), ("units", units)):
        if given is not None and (isinstance(given, str) or len(given) != n):
            raise InvalidInput(f"{what} must be a list of {n}, one for each coordinate: {given!r}")
    if len(set(names)) != n:
        raise InvalidInput(f"names must differ from each other: {list(names)!r}")
    circles = set(range(n)) if angles == "all" else _numbered("angles", angles, list(names))
    still = _numbered("parameters", parameters, list(names))
    kinds = [
        "parameter" if i in still else "circle" if i in circles else "line" for i in range(n)
    ]
    units = units or ["rad" if kind == "circle" else "m" for kind in kinds]
    return tuple(Coordinate(str(a), str(b), c) for a, b, c in zip(names, units, kinds))


def _numbered(what: str, given: str | Iterable[str | int], names: list[str]) -> set[int]:
    numbers = set()
    for item in [given] if isinstance(given, str) else given:
        if isinstance(item, str) and item in names:
            numbers.add(names.index(item))
        elif isinstance(item, (int, np.integer)) and 0 <= item < len(names):
            numbers.add(int(item))
        else:
            raise InvalidInput(
                f"{what} has {item!r}, which is not a coordinate: give names of {names} or numbers from 0"
            )
    return numbers


def trajectories(data: Any, name: str = "trajectories") -> list[Trajectory]:
    """One trajectory or several as a list."""
    if isinstance(data, Trajectory):
        return [data]
    if isinstance(data, (str, bytes)) or not isinstance(data, Iterable):
        raise InvalidType(
            f"{name} is a {type(data).__name__}: give lagrangian.Trajectory objects, as lagrangian.read returns them"
        )
    motions = list(data)
    for motion in motions:
        if not isinstance(motion, Trajectory):
            raise InvalidType(
                f"{name} holds a {type(motion).__name__}: give lagrangian.Trajectory objects, as lagrangian.read returns them"
            )
    return _told_apart(motions)


def _told_apart(motions: list[Trajectory]) -> list[Trajectory]:
    """Motions of the same name with their numbers, so that findings say which they are about."""
    names = Counter(motion.name for motion in motions)
    numbered = []
    for k, motion in enumerate(motions, 1):
        if names[motion.name] > 1:
            motion = motion._copy()
            motion.name = f"{motion.name} {k}"
        numbered.append(motion)
    return numbered


class Trajectories(list[Trajectory]):
    """The trajectories of some files, with what their reader said.

    Attributes:
        notes: What was passed over or decided.
        layout: Which columns were what, as a layout file says it; a fit stores it with the model.
    """

    notes: list[str]
    layout: str

    def __init__(
        self, motions: Iterable[Trajectory] = (), notes: Iterable[str] = (), layout: str = ""
    ) -> None:
        super().__init__(motions)
        self.notes = list(notes)
        self.layout = layout
