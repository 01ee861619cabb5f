"""Ensembles: several models of the same data, which together say how sure they are."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _lagrangian
from ._estimators import Estimator, _Watch
from ._model import Model
from ._trajectory import Trajectory, _numbers, _real, trajectories
from .errors import InvalidInput, NotFitted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Coverage", "Ensemble", "Prediction"]


class Prediction:
    """What an ensemble predicts: values and bands around them.

    Attributes:
        mean: The mean of the members, shape ``(…, n)``.
        deviation: The deviation to be expected of the truth, from that of the members and from what held-out blocks left
            unexplained, shape ``(…, n)``.
        t: The times of a motion, s, shape ``(m,)``; else ``None``.
    """

    def __init__(self, core: _lagrangian.Prediction, t: NDArray[np.float64] | None = None) -> None:
        self._core = core
        self.mean: NDArray[np.float64] = core.mean
        self.deviation: NDArray[np.float64] = core.deviation
        self.t = t

    def band(self, level: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The lower and the upper end of the band that holds the truth with a probability of 0 … 0.99."""
        return self._core.band(_real(level, "level"))

    def quantile(self, probability: float) -> NDArray[np.float64]:
        """The quantile of the truth with a probability of 0.005 … 0.995; the median is the mean."""
        return self._core.quantile(_real(probability, "probability"))

    def plot(self, ax: Axes | None = None, *, level: float = 0.8, coordinate: int = 0) -> Axes:
        """Draws the mean and a band of one coordinate, over time for a motion."""
        from ._plot import plot_band

        low, high = self.band(level)
        columns = (np.atleast_2d(x)[:, coordinate] for x in (self.mean, low, high))
        return plot_band(self.t, *columns, level=level, ax=ax)

    def __repr__(self) -> str:
        return f"Prediction(mean={self.mean!r}, deviation={self.deviation!r})"


class Coverage:
    """The part of the samples of recordings that lies in the bands of 50, 80 and 95 %.

    Attributes:
        acceleration, torque, position: Dictionaries with ``all`` (a number for each band), ``each`` (for each band a number for
            each coordinate) and ``samples``; ``None`` of what cannot be compared. Positions are those of motions of one second.
    """

    def __init__(self, figures: Mapping[str, Any]) -> None:
        self.acceleration: dict[str, Any] | None = figures["acceleration"]
        self.torque: dict[str, Any] | None = figures["torque"]
        self.position: dict[str, Any] | None = figures["position"]

    def __str__(self) -> str:
        lines = ["in the bands of  50 %   80 %   95 %"]
        for name in ("acceleration", "torque", "position"):
            own = getattr(self, name)
            if own is not None:
                lines.append(f"{name:<13}" + "".join(f"{100 * x:6.1f} " for x in own["all"]) + f" of {own['samples']} samples")
        return "\n".join(lines)

    __repr__ = __str__


class Ensemble:
    """Several models of the same data, whose bands hold a stated part of new samples.

    Each member is fitted to blocks of time that are drawn with replacement from the recordings, with a seed of its own. The errors
    of members on the blocks that they have not seen calibrate the bands, whatever the distribution of these errors.

    Args:
        estimator: What is fitted: an estimator such as ``Chain()`` or ``Best()``. Its ``steps`` or ``seconds`` are those of each
            member. ``None`` for an ensemble that was read.
        n: The number of members, 2 … 100.

    Attributes:
        members_: The fitted models.
        coverage_: The part of held-out samples that lies in the bands.
        summary_: All that is known of the fit.

    >>> import lagrangian as lg
    >>> swings = lg.simulate("pendulum", trajectories=10, duration=2.0, seed=1)
    >>> ensemble = lg.Ensemble(lg.Lnn(steps=20, width=8), 3).fit(swings)
    >>> acceleration = ensemble.forward_dynamics([0.5], [0.0])
    >>> low, high = acceleration.band(0.8)
    >>> bool(low < acceleration.mean < high)
    True
    """

    def __init__(self, estimator: Estimator | None, n: int = 8) -> None:
        self.estimator = estimator
        self.n = n

    def fit(
        self,
        X: Any,
        *,
        validation: Any = None,
        progress: bool | None = None,
        callbacks: Callable[[dict[str, Any]], Any] | Iterable[Callable[[dict[str, Any]], Any]] = (),
        run: str | os.PathLike[str] | None = None,
        resume: bool = False,
        force: bool = False,
    ) -> Ensemble:
        """Fits all members.

        Args:
            X: Trajectories, as ``read`` returns them.
            validation: Trajectories to validate on; a part of the others is held back by default.
            progress: Whether to show a bar.
            callbacks: As of ``Estimator.fit``.
            run: The folder of a run: a model is fitted first, as by ``Estimator.fit``, and the members stand beside it; ``report``
                shows their bands on the motions that were held back.
            resume, force: As of ``Estimator.fit``.

        Returns:
            The ensemble. Ctrl-C ends the fit and keeps the members that were begun, if these are two or more.
        """
        if not isinstance(self.estimator, Estimator):
            raise InvalidInput("estimator is not an estimator: give one such as lagrangian.Chain()")
        if isinstance(self.n, bool) or not isinstance(self.n, (int, np.integer)):
            raise InvalidInput(f"n is {self.n!r}: give the number of members, 2 … 100")
        if run is None and (resume or force):
            raise InvalidInput("resume and force are about a run folder: give it as run")
        watch = _Watch(progress, callbacks, "Ensemble")
        with watch:
            training, others, spec, layout = self.estimator._motions(X, validation)
            place = None
            if run is not None:
                call = f"lagrangian.{self!r}.fit(X, run={os.fspath(run)!r})"
                place = {**self.estimator._place(Path(run), bool(resume), bool(force), False), "call": call}
            core, summary = _lagrangian.fit_ensemble(
                training, others, spec, layout, max(int(self.n), 0), place, watch.tell
            )
        self._take(core, summary)
        return self

    def _take(self, core: _lagrangian.Ensemble, summary: dict[str, Any]) -> None:
        self._core = core
        self.members_ = [Model(member) for member in core.members()]
        self.summary_ = summary
        self.coverage_ = Coverage(summary["coverage"])

    def _fitted(self) -> _lagrangian.Ensemble:
        if "_core" not in self.__dict__:
            raise NotFitted("this Ensemble has no members_ before it is fitted: call fit first")
        return self._core

    def forward_dynamics(self, q: ArrayLike, qd: ArrayLike, tau: ArrayLike | None = None) -> Prediction:
        """Accelerations at states under forces (none by default), shape ``(…, n)`` each."""
        core = self._fitted()
        return Prediction(core.accelerations(q, qd, np.zeros_like(_numbers(q, "q")) if tau is None else tau))

    def inverse_dynamics(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Prediction:
        """Torques of motions, shape ``(…, n)`` each."""
        return Prediction(self._fitted().torques(q, qd, qdd))

    def rollout(self, q0: ArrayLike, qd0: ArrayLike, duration: float | None = None, step: float = 0.01, **how: Any) -> Prediction:
        """The positions of the motion from an initial state; arguments as of ``Model.rollout``.

        Bands of positions are calibrated on motions of one second; as the members part, they widen. The prediction is as long as
        the motion of each member.
        """
        core = self._fitted()
        motions = [member.rollout(q0, qd0, duration, step, **how) for member in self.members_]
        prediction = core.positions([motion.q for motion in motions])
        return Prediction(prediction, motions[0].t[: len(prediction.mean)])

    def follow(self, trajectory: Trajectory, **how: Any) -> Prediction:
        """The positions of a recording again, from its first state under its forces; arguments as of ``Model.follow``."""
        core = self._fitted()
        motions = [member.follow(trajectory, **how) for member in self.members_]
        prediction = core.positions([motion.q for motion in motions])
        return Prediction(prediction, motions[0].t[: len(prediction.mean)])

    def predict(self, X: ArrayLike) -> NDArray[np.float64]:
        """Mean accelerations at states, ``(m, 2 n)`` for (q, q̇) or ``(m, 3 n)`` for (q, q̇, τ)."""
        self._fitted()
        states = np.asarray(X, dtype=np.float64)
        n = self.members_[0].n
        if states.ndim != 2 or states.shape[1] not in (2 * n, 3 * n):
            raise InvalidInput(f"X has shape {states.shape}: give (m, {2 * n}) for (q, q̇) or (m, {3 * n}) for (q, q̇, τ)")
        return self.forward_dynamics(*np.split(states, states.shape[1] // n, 1)).mean

    def coverage(self, data: Any) -> Coverage:
        """The part of the samples of recordings that lies in the bands of 50, 80 and 95 %."""
        return Coverage(self._fitted().coverage(trajectories(data, "data")))

    def distance_from_data(self, q: ArrayLike, qd: ArrayLike) -> NDArray[np.float64]:
        """The distance of states from those that the data visited, shape ``(…)``: above 1 all members extrapolate."""
        self._fitted()
        return self.members_[0].distance_from_data(q, qd)

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes the members and their calibration to a folder, which is made if it is missing; ``Ensemble.load`` reads it."""
        core, path = self._fitted(), Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        core.write(path, json.dumps(self.summary_))

    @staticmethod
    def load(folder: str | os.PathLike[str]) -> Ensemble:
        """Reads an ensemble from its folder, which may be that of a run of ``lagrangian fit --ensemble``."""
        path = Path(folder)
        if not (path / "ensemble.json").exists():
            raise FileNotFoundError(2, os.strerror(2), str(path / "ensemble.json"))
        core, summary = _lagrangian.Ensemble.read(path)
        ensemble = Ensemble(None, len(core.members()))
        ensemble._take(core, summary)
        return ensemble

    def __repr__(self) -> str:
        return f"Ensemble({self.estimator!r}, {self.n})"
