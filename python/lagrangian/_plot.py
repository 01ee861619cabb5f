"""Figures, with matplotlib: axes in, axes out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InvalidInput, MissingExtra

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ._model import Model
    from ._trajectory import Coordinate, Trajectory

UNITS = {"q": "", "qd": "/s", "qdd": "/s²", "goal": ""}


def axes(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise MissingExtra("figures need matplotlib: pip install 'lagrangian[plot]'") from error
    return pyplot.subplots()[1]


def plot_signal(motion: Trajectory, ax: Axes | None, signal: str) -> Axes:
    values = getattr(motion, signal, None) if signal != "t" else None
    if not isinstance(values, np.ndarray):
        raise InvalidInput(f"signal is {signal!r}: the trajectory has no such signal, see {motion!r}")
    ax = axes(ax)
    for i, coordinate in enumerate(motion.coordinates):
        ax.plot(motion.t, values[:, i], label=coordinate.name)
    kinds = {c.unit for c in motion.coordinates}
    unit = f" ({kinds.pop()}{UNITS[signal]})" if signal in UNITS and len(kinds) == 1 else ""
    ax.set(xlabel="t (s)", ylabel=f"{signal}{unit}", title=motion.name)
    ax.legend()
    return ax


def plot_phase(motion: Trajectory, ax: Axes | None, coordinate: int) -> Axes:
    if motion.qd is None:
        raise InvalidInput("the trajectory has no velocities: give one with qd, or a predicted motion")
    own = _coordinate(motion, coordinate)
    ax = axes(ax)
    ax.plot(motion.q[:, coordinate], motion.qd[:, coordinate], label=motion.name)
    ax.set(xlabel=f"{own.name} ({own.unit})", ylabel=f"velocity ({own.unit}/s)")
    return ax


def plot_torque(model: Model, motion: Trajectory, ax: Axes | None, coordinate: int) -> Axes:
    if motion.qd is None or motion.qdd is None:
        raise InvalidInput("motion has no velocities or accelerations: give one with qd and qdd")
    own = _coordinate(motion, coordinate)
    ax = axes(ax)
    for name, part in model.torque_parts(motion.q, motion.qd, motion.qdd).items():
        if part[:, coordinate].any():
            ax.plot(motion.t, part[:, coordinate], label=name)
    if motion.tau is not None:
        ax.plot(motion.t, motion.tau[:, coordinate], color="#888888", label="recorded")
    ax.set(xlabel="t (s)", ylabel=f"torque of {own.name}", title=motion.name)
    ax.legend()
    return ax


def _coordinate(motion: Trajectory, coordinate: int) -> Coordinate:
    if not 0 <= coordinate < motion.n:
        raise InvalidInput(f"coordinate is {coordinate}: give 0 … {motion.n - 1}")
    return motion.coordinates[coordinate]


def plot_energy(model: Model, motion: Trajectory, ax: Axes | None) -> Axes:
    if motion.qd is None:
        raise InvalidInput("motion has no velocities: give a predicted motion, or one with qd")
    ax = axes(ax)
    energy = model.energy(motion.q, motion.qd)
    ax.plot(motion.t, energy - energy[0])
    ax.set(xlabel="t (s)", ylabel="change of the energy (J)", title=motion.name)
    return ax


def plot_band(t: Any, mean: Any, low: Any, high: Any, *, level: float, ax: Axes | None) -> Axes:
    ax = axes(ax)
    along = np.arange(len(mean)) if t is None else t
    ax.fill_between(along, low, high, alpha=0.3, linewidth=0, label=f"{100 * level:g} %")
    ax.plot(along, mean, label="mean")
    ax.set(xlabel="sample" if t is None else "t (s)")
    ax.legend()
    return ax


def plot_loss(history: Sequence[Mapping[str, Any]], ax: Axes | None) -> Axes:
    ax = axes(ax)
    steps = [event["step"] for event in history]
    ax.plot(steps, [event["loss"] for event in history], label="training")
    ax.plot(steps, [event["validation"] for event in history], label="validation")
    ax.set(xlabel="step", ylabel="loss", yscale="log")
    ax.legend()
    return ax


def plot_parity(model: Model, motions: Sequence[Trajectory], ax: Axes | None) -> Axes:
    ax = axes(ax)
    usable = [(m, m.qd, m.qdd) for m in motions if m.qd is not None and m.qdd is not None]
    if not usable:
        raise InvalidInput("no trajectory has velocities and accelerations: give some with qd and qdd")
    truth = np.concatenate([qdd for _, _, qdd in usable])
    predicted = np.concatenate([model.forward_dynamics(m.q, qd, m.tau) for m, qd, _ in usable])
    for i, coordinate in enumerate(model.coordinates):
        ax.plot(truth[:, i], predicted[:, i], ".", markersize=3, label=coordinate.name)
    ends = [float(truth.min()), float(truth.max())]
    ax.plot(ends, ends, color="grey", linewidth=0.8)
    ax.set(xlabel="recorded acceleration", ylabel="predicted acceleration")
    ax.legend()
    return ax
