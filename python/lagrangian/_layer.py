"""Models as functions on arrays, and their weights."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _lagrangian
from ._model import Model
from ._trajectory import _coordinates, _numbers, _whole
from .errors import InvalidInput, InvalidType, NotSupported

if TYPE_CHECKING:
    from ._estimators import Estimator

__all__ = ["Layer"]

_Array = NDArray[np.float64]

#: The functions of a layer.
MAPS = ("acceleration", "rates", "force", "step", "scalar")


class Layer:
    """A model as functions of JAX or PyTorch, which differentiate, compile and map them.

    ``lagrangian.jax`` and ``lagrangian.torch`` take it. The maps are ``acceleration``: (q, q̇, τ) → q̈; ``rates``: (q, v, τ) →
    (dq/dt, dv/dt), for every family, ``(…, 2 n)``; ``force``: (q, q̇, q̈) → τ; ``step``: (q, v) after a Runge–Kutta step,
    ``(…, 2 n)``; ``scalar``: L(q, q̇) or H(q, p), ``(…)``. v are the velocities q̇, or the momenta p of a Hamiltonian network.

    Args:
        model: A fitted model or estimator whose equations can be written down: lnn, delan, vin, hnn, mlp, neural-ode, rigid
            or chain, without directional and quadratic friction. ``Layer.fresh`` makes one with random weights.

    >>> import lagrangian as lg
    >>> layer = lg.Layer.fresh(lg.Delan(width=16, forces=("viscous",)), n=2, angles="all")
    >>> layer.parameters.shape, layer.spans["dissipation/viscous"]
    ((422,), slice(420, 422, None))
    """

    __slots__ = ("_bounds", "_functions", "_model", "_parameters", "_spans")

    def __init__(self, model: Model | Estimator) -> None:
        own = model if isinstance(model, _lagrangian.Model) else getattr(model, "model_", None)
        if not isinstance(own, _lagrangian.Model):
            raise InvalidType(f"model is a {type(model).__name__}: give a fitted model or estimator")
        self._model = own
        self._functions: dict[str, dict[str, Any]] = {}
        (self._parameters, *self._bounds), spans = _lagrangian.weights(own)
        self._spans = {name: slice(first, first + count) for name, first, count in spans}

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
        return cls(Model(_lagrangian.fresh(named, estimator._spec())))

    @property
    def n(self) -> int:
        """The number of coordinates."""
        return self.model().n

    @property
    def family(self) -> str:
        """The family of the model."""
        return str(self.model().family)

    @property
    def moves_in_momenta(self) -> bool:
        """Whether v are momenta p, and the scalar is H(q, p)."""
        return "\ndef hamiltonian(" in self.source("jax")

    @property
    def parameters(self) -> _Array:
        """All parameters, shape ``(p,)``: weights, then those of rotors, friction and actuation in SI units. A new array."""
        return self._parameters.copy()

    @property
    def spans(self) -> dict[str, slice]:
        """The places of the parameters by name."""
        return dict(self._spans)

    def project(self, parameters: ArrayLike) -> _Array:
        """The nearest parameters of their domain: some weights of a convex Lagrangian and friction are not negative."""
        given = _numbers(parameters, "parameters")
        if given.shape != self._parameters.shape:
            raise InvalidInput(f"parameters have shape {given.shape}: give {self._parameters.shape}, those of this layer")
        return np.clip(given, *self._bounds)

    def model(self, parameters: ArrayLike | None = None) -> Model:
        """The model with these parameters, to roll out, save and score; with those of the layer by default."""
        if parameters is None:
            return Model(self._model)
        return Model(_lagrangian.with_weights(self._model, parameters))

    def source(self, library: str) -> str:
        """The functions as source of Python for ``"jax"`` or ``"torch"``, as ``lagrangian export`` writes it."""
        if library not in ("jax", "torch"):
            raise InvalidInput(f"library is {library!r}: give 'jax' or 'torch'")
        return _lagrangian.layer_source(self._model, library)

    def function(self, library: str, map: str) -> Callable[..., Any]:
        """The function f(parameters, q, v, u) of a map for ``"jax"`` or ``"torch"``; u may be omitted, ``step`` has the keyword h.

        Raises:
            InvalidInput: The model does not have the map.
        """
        if map not in MAPS:
            raise NotSupported(f"there is no map '{map}': choose one of {', '.join(MAPS)}")
        if library not in self._functions:
            functions: dict[str, Any] = {"__name__": "lagrangian.layer"}
            exec(compile(self.source(library), "<layer of lagrangian>", "exec"), functions)
            functions["scalar"] = functions.get("hamiltonian", functions.get("lagrangian"))
            self._functions[library] = {map: functions[map] for map in MAPS if functions.get(map)}
        own = self._functions[library]
        if map not in own:
            raise InvalidInput(f"this model of the family {self.family} has no {map}: take {' or '.join(own)}")
        function: Callable[..., Any] = own[map]
        return function

    def __repr__(self) -> str:
        return f"Layer({self.family}, n={self.n})"

    def __reduce__(self) -> tuple[Any, ...]:
        return Layer, (self.model(),)


def layer_of(model: Layer | Model | Estimator) -> Layer:
    """The layer itself, or that of a model."""
    return model if isinstance(model, Layer) else Layer(model)
