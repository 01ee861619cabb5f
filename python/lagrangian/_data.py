"""Recordings: from files, from tables, from systems that are known; their check."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from . import _lagrangian
from ._trajectory import SIGNALS, Trajectories, Trajectory, _numbers, _real, _whole, trajectories
from .errors import InvalidInput, InvalidType, MissingExtra

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._model import Model

__all__ = ["CheckReport", "Item", "Structure", "check", "constraints", "read", "write"]

Names = str | Sequence[str]


def read(
    source: Any,
    *,
    angles: Names = (),
    time: str | None = None,
    q: Names = (),
    qd: Names = (),
    qdd: Names = (),
    tau: Names = (),
    p: Names = (),
    goal: Names = (),
    kp: Names = (),
    kd: Names = (),
    supply: Names = (),
    enabled: Names = (),
    trajectory: str | None = None,
    parameters: Names = (),
    actuated: Names = (),
    units: Mapping[str, str] | None = None,
    degrees: bool = False,
    every: int = 1,
    topic: str | None = None,
    layout: str = "",
    rows: int | None = None,
) -> Trajectories:
    """Reads recordings from files or from a table.

    Without names of columns, ``t``, ``q1 … qn``, ``qd1 … qdn``, ``qdd1 …``, ``tau1 …``, ``p1 …`` and ``trajectory`` are
    expected. A layout file beside the data (``log.toml`` or ``lagrangian.toml``) is read as the command reads it; what is
    given here goes before it.

    Args:
        source: A path or several (.csv, .npz, .parquet, .db3, .mcap), or a table: a pandas or polars frame, an Arrow table,
            anything with the Arrow PyCapsule interface, or a mapping of names to columns.
        angles: Coordinates that are angles, or ``"all"``.
        time: The column of time, s.
        q, qd, qdd, tau, p: Columns of each signal, in the order of the coordinates.
        goal, kp, kd, supply, enabled: Columns of what position-controlled drives were told.
        trajectory: The column that tells trajectories apart.
        parameters: Coordinates that never move.
        actuated: Coordinates that the forces act on, where these are fewer.
        units: Units of coordinates that are not angles.
        degrees: Whether angles and their rates are in degrees.
        every: The number of rows of which one is kept.
        topic: The topic of a bag.
        layout: The text of a layout file, such as the attribute ``layout`` of other trajectories; the arguments above go before it, and
            it before the file beside the data.
        rows: Rows that are kept, at most; of longer files a sample is taken in one pass.

    Returns:
        A list of trajectories, with the attributes ``notes`` (what was passed over) and ``layout``.

    Raises:
        DataError: The file cannot be read; the message says where and what to do.
        OSError: The file cannot be opened.

    >>> import io
    >>> table = {"t": [0.0, 0.1, 0.2], "theta": [0.0, 5.7, 11.5]}
    >>> [swing] = read(table, q="theta", angles="theta", degrees=True)
    >>> swing.coordinates
    (Coordinate(name='theta', unit='rad', kind='circle'),)
    """
    columns = dict(
        zip(SIGNALS, (q, qd, qdd, tau, p, goal, kp, kd, supply, enabled)),
    )
    if every < 1:
        raise InvalidInput(f"every is {every}: it must be 1 (all rows) or more")
    if rows is not None and not 1 <= _whole(rows, "rows") < 1 << 53:
        raise InvalidInput(f"rows is {rows}: give the largest number of rows, 1 or more, or omit it for all")
    told = {
        "columns": {signal: _names(signal, names) for signal, names in columns.items()},
        "trajectory": trajectory,
        "time": time,
        "topic": topic,
        "angles": _names("angles", angles),
        "parameters": _names("parameters", parameters),
        "actuated": _names("actuated", actuated),
        "units": dict(units or {}),
        "degrees": bool(degrees),
        "every": int(every) if every > 1 else 0,
        "layout": layout,
        "rows": None if rows is None else int(rows),
    }
    if isinstance(source, (str, os.PathLike)):
        paths: list[Any] = [source]
    elif isinstance(source, (list, tuple)) and source and all(
        isinstance(path, (str, os.PathLike)) for path in source
    ):
        paths = list(source)
    else:
        table, words = _table(source)
        parts, notes, layout = _lagrangian.read_table(table, told)
        for motion in parts:
            motion["name"] = words.get(motion["name"], motion["name"])
        return Trajectories([Trajectory._of(motion) for motion in parts], notes, layout)
    parts, notes, layout = _lagrangian.read([Path(path) for path in paths], told)
    return Trajectories([Trajectory._of(motion) for motion in parts], notes, layout)


def write(path: str | os.PathLike[str], motions: Trajectory | Iterable[Trajectory]) -> None:
    """Writes trajectories to a file (.csv, .npz, .parquet), and beside it a layout file that ``read`` takes up.

    Reading gives the same bits. An existing file is replaced.

    Args:
        path: The file; its extension is the format.
        motions: One trajectory or several of the same coordinates.
    """
    if not isinstance(path, (str, os.PathLike)):
        raise InvalidType(f"path is a {type(path).__name__}: give the file first, then the motions")
    _lagrangian.write(Path(path), trajectories(motions, "motions"))


def _names(what: str, given: Names) -> list[str]:
    names = [given] if isinstance(given, str) else list(given)
    for name in names:
        if not isinstance(name, str) or not name:
            raise InvalidType(f"{what} has {name!r}: give names of columns")
    return names


def _table(source: Any) -> tuple[bytes, dict[str, str]]:
    """The columns of a table as the bytes of an NPZ file, and the words for its trajectories."""
    columns = _columns(source)
    if not columns:
        raise InvalidInput("source has no columns: give a table with t and q1 … qn, or name its columns")
    words: dict[str, str] = {}
    arrays: dict[str, Any] = {}
    for name, values in columns.items():
        try:
            array = np.asarray(values)
        except (TypeError, ValueError) as error:
            raise InvalidType(f"the column '{name}' cannot be made an array ({error}): give a number for each row") from error
        if array.dtype.kind in "OUST":
            array, words = _numbered(name, array)
        arrays[name] = array
    file = io.BytesIO()
    _archive(file, arrays)
    return file.getvalue(), words


def _archive(file: IO[bytes], arrays: Mapping[str, Any]) -> None:
    """Writes an NPZ file; ``numpy.savez`` has no array named ``file``, and cuts names at a zero."""
    with zipfile.ZipFile(file, "w") as archive:
        for name, values in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                np.lib.format.write_array(entry, np.asanyarray(values), allow_pickle=False)


def _numbered(name: str, array: Any) -> tuple[Any, dict[str, str]]:
    """A column of words as numbers, by their first appearance; a column of objects that are numbers as these."""
    try:
        return array.astype(np.float64), {}
    except (TypeError, ValueError):
        words = {str(word): k for k, word in enumerate(dict.fromkeys(map(str, array)))}
        numbers = np.array([words[str(word)] for word in array], dtype=np.int64)
        return numbers, {str(k): word for word, k in words.items()}


def _columns(source: Any) -> dict[str, Any]:
    if isinstance(source, Mapping):
        return {str(name): values for name, values in source.items()}
    kind = type(source).__module__.split(".")[0]
    if kind in ("pandas", "polars"):
        return {str(name): source[name].to_numpy() for name in source.columns}
    if hasattr(source, "__arrow_c_stream__"):
        try:
            import pyarrow
        except ImportError as error:
            raise MissingExtra("an Arrow table needs pyarrow: pip install 'lagrangian[parquet]'") from error
        table = pyarrow.table(source)
        return {name: table[name].to_numpy() for name in table.column_names}
    raise InvalidType(
        f"source is a {type(source).__name__}: give a path, several paths, a pandas or polars frame, an Arrow table, "
        "or a mapping of names to columns"
    )


def _starts(q0: ArrayLike, qd0: ArrayLike, n: int) -> list[tuple[list[float], list[float]]]:
    """Initial states as rows."""
    rows = []
    for name, values in (("q0", q0), ("qd0", qd0)):
        array = _numbers(values, name)
        if array.ndim not in (1, 2) or array.shape[-1] != n:
            raise InvalidInput(f"{name} has shape {array.shape}: give ({n},) for one state or (k, {n}) for several")
        rows.append(array.reshape(-1, n).tolist())
    if len(rows[0]) != len(rows[1]):
        raise InvalidInput(f"qd0 has {len(rows[1])} states and q0 {len(rows[0])}: give as many of each")
    return list(zip(*rows))


class Item:
    """A finding of a check.

    Attributes:
        name: What was checked, such as ``velocity``.
        trajectory: The trajectory; ``None`` if it is about all of them.
        verdict: ``pass``, ``warn`` or ``fail``.
        finding: What was found.
        remedy: What to do; ``None`` where there is nothing to do.
        values: The figures of the finding.
        doubtful: Whether the values themselves are in doubt, so that no model of them can be called good.
    """

    __slots__ = ("doubtful", "finding", "name", "remedy", "trajectory", "values", "verdict")

    name: str
    trajectory: str | None
    verdict: str
    finding: str
    remedy: str | None
    values: dict[str, float]
    doubtful: bool

    def __init__(self, **item: Any) -> None:
        for slot in self.__slots__:
            setattr(self, slot, item[slot])

    def __repr__(self) -> str:
        about = f" [{self.trajectory}]" if self.trajectory else ""
        return f"{self.verdict}: {self.name}{about}: {self.finding}"


class CheckReport:
    """The findings of a check; printed as text, shown as a table in a notebook.

    Of more than three trajectories the text says all that is about them together, and each problem of single ones once, with the number
    of those that have it.

    Attributes:
        verdict: The worst verdict: ``pass``, ``warn`` or ``fail``.
        items: The findings, first those about all trajectories together.
    """

    verdict: str
    items: list[Item]

    def __init__(self, report: Mapping[str, Any]) -> None:
        self.verdict = report["verdict"]
        self.items = [Item(**item) for item in report["items"]]
        self._shown: list[tuple[Item, list[str]]] = [
            (self.items[group["first"]], group["trajectories"]) for group in report["shown"]
        ]

    @property
    def passed(self) -> bool:
        """Whether a fit makes sense: no finding fails."""
        return self.verdict != "fail"

    @property
    def problems(self) -> list[Item]:
        """The findings that warn or fail, the gravest first."""
        order = {"fail": 0, "warn": 1}
        found = [item for item in self.items if item.verdict in order]
        return sorted(found, key=lambda item: order[item.verdict])

    def __str__(self) -> str:
        lines = []
        for item, names in self._shown:
            others = f" (alike in {len(names) - 1} more)" if len(names) > 1 else ""
            lines.append(repr(item) + others)
            if item.verdict != "pass" and item.remedy:
                lines.append(f"      → {item.remedy}")
        return "\n".join([*lines, f"verdict: {self.verdict}"])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        colours = {"pass": "#2e7d32", "warn": "#b26a00", "fail": "#c62828"}
        from html import escape

        rows = []
        for item, names in sorted(self._shown, key=lambda shown: ("fail", "warn", "pass").index(shown[0].verdict)):
            about = (item.trajectory or "all") + (f" and {len(names) - 1} more" if len(names) > 1 else "")
            words = (item.name, about, item.finding, item.remedy or "")
            cells = "".join(f"<td style='text-align:left'>{escape(word)}</td>" for word in words)
            colour = colours[item.verdict]
            rows.append(
                f"<tr><td style='color:{colour};font-weight:bold'>{item.verdict}</td>{cells}</tr>"
            )
        head = "".join(f"<th>{word}</th>" for word in ("", "check", "trajectory", "finding", "remedy"))
        return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def check(data: Trajectory | Iterable[Trajectory], *, low_pass: float | None = None) -> CheckReport:
    """Whether recordings are good enough for a fit: rate, gaps, noise, units, signs, delays, coverage.

    Args:
        data: One trajectory or several.
        low_pass: The cut-off that a fit will use, Hz; found from the data by default.

    Returns:
        A report with a verdict, and a remedy for each problem.

    >>> import lagrangian as lg
    >>> report = lg.check(lg.simulate("pendulum", trajectories=5, seed=1))
    >>> report.passed
    True
    """
    return CheckReport(_lagrangian.check(trajectories(data, "data"), low_pass))


@dataclass(frozen=True)
class Structure:
    """The constraints between recorded points.

    Attributes:
        degrees_of_freedom: The number of independent motions that they leave.
        constraints: Of each constraint a dictionary: ``name`` in words, ``kind`` (``fixed``, ``line``, ``circle``, ``rod``,
            ``quadric``), ``points`` (their places in ``points``), ``length`` of a rod or radius of a circle, ``scatter`` (the
            deviation of the positions from it, m) and ``noise`` (what their noise makes of that, m).
        points: Of each point its ``name`` and the places of its coordinates, ``axes``.
    """

    degrees_of_freedom: int
    constraints: list[dict[str, Any]]
    points: list[dict[str, Any]]

    def __str__(self) -> str:
        lines = [constraint["name"] for constraint in self.constraints]
        return "\n".join([*lines, f"degrees of freedom: {self.degrees_of_freedom}"])


def constraints(
    data: Trajectory | Iterable[Trajectory], *, points: Iterable[Iterable[str | int]] | None = None
) -> Structure:
    """The rods, circles and lines that join recorded points, found in their positions.

    A constraint holds where all positions are as far from it as their noise says, in every motion. Relations that one motion may
    follow by chance, all but rods and circles, need three motions.

    Args:
        data: One trajectory or several, of Cartesian positions.
        points: The coordinates of each point, by name or number; by default those of names such as ``x1, y1`` or ``p1x, p1y``,
            else two or three in turn.

    >>> import numpy as np
    >>> import lagrangian as lg
    >>> angle = np.sin(0.1 * np.arange(200))
    >>> bob = 1.5 * np.column_stack([np.sin(angle), -np.cos(angle)])
    >>> print(lg.constraints(lg.Trajectory(q=bob, t=0.02 * np.arange(200), names=["x", "y"])))
    p on a circle about (0.000, 0.000), radius 1.500
    degrees of freedom: 1
    """
    motions = trajectories(data, "data")
    names = [coordinate.name for coordinate in motions[0].coordinates] if motions else []
    places = None if points is None else [[_place(axis, names) for axis in point] for point in points]
    found = _lagrangian.constraints(motions, places)
    for constraint in found["constraints"]:
        constraint.update(constraint.pop("constraint"))
    return Structure(**found)


def _place(axis: str | int, names: list[str]) -> int:
    """The place of a coordinate that is given by its name or number."""
    place = names.index(axis) if axis in names else axis
    if not isinstance(place, int) or not 0 <= place < len(names):
        raise InvalidInput(f"`points`: {axis!r} is not a coordinate; there are {', '.join(names)}")
    return place


def simulate(
    system: str | Model,
    *,
    trajectories: int = 1,
    duration: float = 10.0,
    step: float = 0.01,
    q0: ArrayLike | None = None,
    qd0: ArrayLike | None = None,
    starts: str = "training",
    drive: float = 0.0,
    friction: float = 0.0,
    momenta: bool = False,
    noise: float | None = None,
    seed: int = 0,
    method: str = "dop853",
    tolerance: float = 1e-10,
    **parameters: float,
) -> Trajectories:
    """Recordings of a system whose Lagrangian is known.

    Args:
        system: A name of ``systems()``, or a model of ``system``, ``robot`` or ``own_system``.
        trajectories: The number of motions from random states.
        duration: Of each, s.
        step: The time between two samples, s.
        q0, qd0: The initial state, shape ``(n,)`` each, or several, ``(k, n)``; random by default.
        starts: Random states that models are trained on (``training``) or that rollouts are tested from (``test``).
        drive: The amplitude of driving forces, sums of random sines.
        friction: The coefficient of viscous friction of each coordinate.
        momenta: Whether momenta are recorded.
        noise: The standard deviation of noise on q and q̇; accelerations are then left out.
        seed: The seed of starts, drive and noise.
        method: A name of ``integrators()``.
        tolerance: The tolerance of the adaptive methods.
        parameters: Parameters of the system, such as ``length=0.5``.

    Returns:
        The motions, numbered from 1: the same bits as those of the command.

    >>> import lagrangian as lg
    >>> motions = lg.simulate("double-pendulum", trajectories=2, duration=1.0, seed=7)
    >>> motions[0].q.shape
    (101, 2)
    """
    from ._model import Model, integration, outcome, warn_of
    from ._model import system as known

    if starts not in ("training", "test"):
        raise InvalidInput(f"starts is {starts!r}: choose 'training' or 'test'")
    if isinstance(system, str):
        model = known(system, **parameters)
    elif isinstance(system, Model):
        model = system
        if parameters:
            raise InvalidInput(f"{next(iter(parameters))} is a parameter of a system that is named: omit it")
    else:
        raise InvalidType(f"system is a {type(system).__name__}: give a name or a model")
    if (q0 is None) != (qd0 is None):
        raise InvalidInput("q0 and qd0 are given together: give both, or neither for random states")
    first = [] if q0 is None or qd0 is None else _starts(q0, qd0, model.n)
    if first and trajectories != 1 and trajectories != len(first):
        raise InvalidInput(f"trajectories is {trajectories}, and q0 has {len(first)} states: omit one of the two")
    asked = {
        "starts": first,
        "test_starts": starts == "test",
        "trajectories": _whole(trajectories, "trajectories"),
        "duration": _real(duration, "duration"),
        "step": _real(step, "step"),
        "drive": _real(drive, "drive"),
        "friction": _real(friction, "friction"),
        "momenta": bool(momenta),
        "noise": None if noise is None else _real(noise, "noise"),
        "seed": _whole(seed, "seed"),
    }
    how = integration(method, step=step, rtol=tolerance, atol=tolerance)
    parts, ends = _lagrangian.simulate(model, asked, how)
    motions = [Trajectory._of(motion) for motion in parts]
    for motion, end in zip(motions, ends):
        warn_of(outcome(end), f"motion {motion.name}")
    return Trajectories(motions)
