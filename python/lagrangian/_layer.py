"""Models as differentiable layers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _lagrangian
from ._model import Model
from ._trajectory import _coordinates, _numbers, _real, _whole
from .errors import InvalidInput, InvalidType, NotSupported

if TYPE_CHECKING:
    from ._estimators import Estimator

__all__ = ["Layer", "Slopes"]

_Array = NDArray[np.float64]

#: The values of a layer; see ``Layer.evaluate``.
MAPS = ("acceleration", "rates", "force", "step", "scalar")


class Slopes(NamedTuple):
    """The sensitivities of a loss to what a layer depends on; each has the shape of its argument."""

    q: _Array
    v: _Array
    u: _Array
    parameters: _Array


class Layer:
    """A model as a differentiable layer: values, and exact products of a sensitivity with their derivatives.

    ``lagrangian.jax`` and ``lagrangian.torch`` make functions of these libraries from it. A layer never changes: every call
    takes the parameters that it computes with. Arrays are ``(n,)`` for one state or ``(…, n)`` for many; v are the velocities
    q̇, or the momenta p of a Hamiltonian network.

    Args:
        model: A fitted model or estimator of the families lnn, delan, vin, hnn, mlp or neural-ode; ``Layer.fresh`` makes one
            with random weights.

    >>> import numpy as np
    >>> import lagrangian as lg
    >>> layer = lg.Layer.fresh(lg.Lnn(width=16), n=2, angles="all")
    >>> q, qd, tau = np.ones((3, 10, 2))
    >>> qdd = layer.evaluate("acceleration", q, qd, tau)
    >>> slopes = layer.pull_back("acceleration", q, qd, tau, g=qdd)
    >>> qdd.shape, slopes.q.shape, slopes.parameters.shape == layer.parameters.shape
    ((10, 2), (10, 2), True)
    """

    __slots__ = ("_core",)

    def __init__(self, model: Model | Estimator) -> None:
        own = model if isinstance(model, _lagrangian.Model) else getattr(model, "model_", None)
        if not isinstance(own, _lagrangian.Model):
            raise InvalidType(f"model is a {type(model).__name__}: give a fitted model or estimator")
        self._core = _lagrangian.Layer.of(own)

    @classmethod
    def fresh(
        cls,
        estimator: Estimator,
        n: int,
        *,
        angles: str | Iterable[str | int] = (),
        names: Sequence[str] | None = None,
        units: Sequence[str] | None = None,
    ) -> Layer:
        """The layer of a new model with random weights and scales of one: give states and forces of order one.

        Args:
            estimator: The family and its settings, such as ``lg.Delan(width=32, seed=1)``; it is not fitted.
            n: The number of coordinates.
            angles, names, units: Of the coordinates, as those of ``Trajectory``.
        """
        if estimator.family is None:
            raise InvalidInput("the best of several models is not a family: give one, such as Lnn or Delan")
        named = [(c.name, c.unit, c.kind) for c in _coordinates(_whole(n, "n"), angles, names, units, ())]
        layer = cls.__new__(cls)
        layer._core = _lagrangian.Layer.fresh(named, estimator._spec())
        return layer

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return self._core.n

    @property
    def family(self) -> str:
        """The family of the model."""
        return self._core.family

    @property
    def moves_in_momenta(self) -> bool:
        """Whether v are momenta p, and the scalar is H(q, p)."""
        return self._core.moves_in_momenta

    @property
    def parameters(self) -> _Array:
        """All parameters, shape ``(p,)``: weights, then those of friction and actuation. A new array."""
        return self._core.parameters

    def initialise(self, seed: int = 0) -> _Array:
        """Random parameters, the same for the same seed."""
        return self._core.initialise(_whole(seed, "seed"))

    def project(self, parameters: ArrayLike) -> _Array:
        """The nearest parameters of their domain: some weights of a convex Lagrangian and friction are not negative."""
        return self._core.project(parameters)

    def model(self, parameters: ArrayLike | None = None) -> Model:
        """The model with these parameters, to roll out, save and score; with those of the layer by default."""
        return Model(self._core.model(parameters))

    def width(self, map: str) -> int | None:
        """The number of values of a map at each state; ``None`` for one number without an axis."""
        return {"acceleration": self.n, "force": self.n, "scalar": None}.get(map, 2 * self.n)

    def evaluate(
        self,
        map: str,
        q: ArrayLike,
        v: ArrayLike,
        u: ArrayLike | None = None,
        *,
        parameters: ArrayLike | None = None,
        h: float = 0.0,
    ) -> _Array:
        """The value of a map.

        Args:
            map: ``acceleration``: (q, q̇, τ) → q̈. ``rates``: (q, v, τ) → (dq/dt, dv/dt), for every family, ``(…, 2 n)``.
                ``force``: (q, q̇, q̈) → τ. ``step``: (q, v) after a Runge–Kutta step of the time ``h``, ``(…, 2 n)``.
                ``scalar``: L(q, q̇) or H(q, p), ``(…)``.
            q, v: The states.
            u: Forces τ, or accelerations of ``force``; none by default.
            parameters: Those of the layer by default.
            h: The time of a step, s.

        Raises:
            InvalidInput: An argument has another shape or is not finite, or the model does not have the map.
        """
        return self._core.evaluate((map, _real(h, "h"), self._states(q, v, u), parameters))

    def pull_back(
        self,
        map: str,
        q: ArrayLike,
        v: ArrayLike,
        u: ArrayLike | None = None,
        *,
        g: ArrayLike,
        parameters: ArrayLike | None = None,
        h: float = 0.0,
    ) -> Slopes:
        """The products gᵀ ∂y of the value y of a map; ``g`` has its shape, the other arguments are those of ``evaluate``."""
        call = (map, _real(h, "h"), self._states(q, v, u), parameters)
        return Slopes(*self._core.pull_back(call, g))

    def _states(self, q: ArrayLike, v: ArrayLike, u: ArrayLike | None) -> list[ArrayLike]:
        return [q, v, np.zeros(_numbers(q, "q").shape) if u is None else u]

    def __repr__(self) -> str:
        return f"Layer({self.family}, n={self.n})"

    def __reduce__(self) -> tuple[Any, ...]:
        return Layer, (self.model(),)


def layer_of(model: Layer | Model | Estimator) -> Layer:
    """The layer itself, or that of a model."""
    return model if isinstance(model, Layer) else Layer(model)


def known_map(map: str) -> str:
    """The name of a map, or an error that names all."""
    if map not in MAPS:
        raise NotSupported(f"there is no map '{map}': choose one of {', '.join(MAPS)}")
    return map
