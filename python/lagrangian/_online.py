"""Models that are learned while a robot moves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from . import _lagrangian
from ._estimators import Estimator
from ._model import Model
from ._trajectory import _coordinates, _real, _whole
from .errors import InvalidInput, InvalidType

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

__all__ = ["OnlineLearner"]


class OnlineLearner:
    """A model of torques that is learned from nothing, on a thread of its own, while a robot moves.

    A network learns by training steps; a robot of known kinematics, ``lg.Rigid(urdf=…)``, by a recursive regression of its bodies, rotors and
    friction, in which nothing of its masses is used (docs/theory.md, 59e). A chain, ``lg.Chain()``, is told nothing: its joints are searched for
    in the first 5 000 ticks, and again each time half as many more have come.

    ``update`` takes the row of a tick and returns in microseconds; it neither waits nor learns. ``model`` is the newest model that
    has passed: its torques are finite, and it predicts what is remembered no worse than the one before. Until the first one there is none, and only
    feedback should act (Lutter, Ritter, Peters 2019; docs/theory.md, equations 50 to 59).

    Args:
        estimator: The family and its settings, such as ``lg.Delan(width=24, dissipation=True)``.
        n: The number of coordinates.
        angles, names, units: Of the coordinates, as those of ``Trajectory``.
        seed: Of weights and batches.

    >>> import lagrangian as lg
    >>> arm = lg.system("two-link-arm")
    >>> with lg.OnlineLearner(lg.Delan(width=16), n=2, angles="all") as learner:
    ...     for k in range(3):
    ...         learner.update(0.002 * k, [0.1, 0.2], [0.0, 0.0], [1.0, 0.5])
    ...     learner.model is None
    True
    """

    def __init__(
        self,
        estimator: Estimator,
        n: int,
        *,
        angles: str | Iterable[str | int] = (),
        names: Sequence[str] | None = None,
        units: Sequence[str] | None = None,
        seed: int = 0,
    ) -> None:
        if not isinstance(estimator, Estimator):
            raise InvalidType(f"estimator is a {type(estimator).__name__}: give a family, such as lagrangian.Delan(width=24)")
        if estimator.family is None:
            raise InvalidInput("the best of several models is not a family: give one, such as Delan")
        named = [(c.name, c.unit, c.kind) for c in _coordinates(_whole(n, "n"), angles, names, units, ())]
        self._core = _lagrangian.Online(named, estimator._spec(), _whole(seed, "seed"))
        self._model: Model | None = None

    def update(self, t: float, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> None:
        """Takes what was measured at a tick, s from any instant, and the torque that acts from it on; ``(n,)`` each, in SI units.

        Rows that are not finite are dropped and counted; of a tick that the learner is too slow for, the oldest row is.
        """
        self._core.update(_real(t, "t"), q, qd, tau)

    @property
    def model(self) -> Model | None:
        """The newest model, or ``None`` before the first."""
        newest = self._core.take()
        if newest is not None:
            self._model = Model(newest)
        return self._model

    def close(self) -> dict[str, Any]:
        """Ends the thread; what it did: samples, steps, models that were handed over or refused, and events.

        Raises:
            LagrangianError: The error that ended the learner early.
        """
        return self._core.close() or {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._core.close()
