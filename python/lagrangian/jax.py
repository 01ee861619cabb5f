"""Models as functions of JAX, with exact derivatives: ``pip install 'lagrangian[jax]'``.

>>> import jax
>>> import lagrangian as lg
>>> from lagrangian.jax import dynamics
>>> layer = lg.Layer.fresh(lg.Lnn(width=16), n=1, angles="all")
>>> acceleration = dynamics(layer)
>>> loss = lambda weights, q, qd: (acceleration(weights, q, qd) ** 2).sum()
>>> gradient = jax.jit(jax.grad(loss))(layer.parameters, jax.numpy.ones((8, 1)), jax.numpy.zeros((8, 1)))
>>> gradient.shape == layer.parameters.shape
True

The functions compute in double precision on the CPU, through ``jax.pure_callback``, and answer in the precision of their
arguments. They work under ``jit``, ``grad`` (of first order, in reverse) and ``vmap``. Give batches as ``(…, n)``: one call
then serves them all, while the gradient by the parameters of a function under ``vmap`` costs a call for each state, as JAX asks
for it state by state.

A callback costs some 0.1 ms beside the computation itself: at best of 200 calls on two cores in use, 0.07 to 0.11 ms for an empty one,
and 0.4 ms for the accelerations of 32 states of a network of width 64, which the layer alone computes in 0.2 ms.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ._layer import Layer, known_map, layer_of
from .errors import MissingExtra

try:
    import jax
    import jax.numpy as jnp
except ImportError as error:
    raise MissingExtra("lagrangian.jax needs JAX: pip install 'lagrangian[jax]'") from error

if TYPE_CHECKING:
    from ._estimators import Estimator
    from ._model import Model

__all__ = ["dynamics", "step"]


def dynamics(model: Layer | Model | Estimator, map: str = "acceleration") -> Callable[..., jax.Array]:
    """A pure function f(parameters, q, v, u) of a model: ``(…, n)`` → ``(…, n)``.

    Args:
        model: A layer, or a fitted model or estimator.
        map: What it computes, see ``Layer.evaluate``: ``acceleration``, ``rates`` (which hnn and neural ODEs of first order have
            instead), ``force`` or ``scalar``.

    Returns:
        The function. ``parameters`` is an array of the shape of ``Layer.parameters``; q, v and u are broadcast against each
        other, and u may be omitted.

    Raises:
        InvalidInput: From the function, wrapped by JAX, where an argument is not finite or the model does not have the map.
    """
    return _function(layer_of(model), known_map(map), 0.0)


def step(model: Layer | Model | Estimator, h: float) -> Callable[..., jax.Array]:
    """A pure function f(parameters, q, v, u) → ``(…, 2 n)``: (q, v) after a Runge–Kutta step of the time ``h``, s.

    With ``jax.lax.scan`` it makes rollouts that can be differentiated.
    """
    return _function(layer_of(model), "step", float(h))


def _function(layer: Layer, map: str, h: float) -> Callable[..., jax.Array]:
    @jax.custom_vjp
    def inner(parameters: jax.Array, q: jax.Array, v: jax.Array, u: jax.Array) -> Any:
        width = layer.width(map)
        shape = q.shape[:-1] if width is None else (*q.shape[:-1], width)
        return _called(_Value(layer, map, h), _like(shape, q), parameters, q, v, u)

    def forward(*given: jax.Array) -> tuple[jax.Array, tuple[jax.Array, ...]]:
        return inner(*given), given

    def backward(given: tuple[jax.Array, ...], g: jax.Array) -> Any:
        return _called(_Pull(layer, map, h), tuple(_like(x.shape, x) for x in given), *given, g)

    inner.defvjp(forward, backward)

    def function(parameters: Any, q: Any, v: Any, u: Any = None) -> jax.Array:
        states = [jnp.asarray(x) for x in (q, v)]
        states.append(jnp.zeros_like(states[0]) if u is None else jnp.asarray(u))
        dtype = jnp.result_type(*states, jnp.float32)
        q, v, u = (x.astype(dtype) for x in jnp.broadcast_arrays(*states))
        result: jax.Array = inner(jnp.asarray(parameters, dtype), q, v, u)
        return result

    return function


def _like(shape: tuple[int, ...], other: jax.Array) -> Any:
    struct: Any = jax.ShapeDtypeStruct
    return struct(shape, other.dtype)


def _called(function: Callable[..., Any], result: Any, *given: jax.Array) -> Any:
    return jax.pure_callback(function, result, *given, vmap_method="expand_dims")


class _Value:
    """The value of a map on arrays of NumPy, whose leading axes those of ``vmap`` may be."""

    def __init__(self, layer: Layer, map: str, h: float) -> None:
        self.layer, self.map, self.h = layer, map, h

    def __call__(self, parameters: Any, q: Any, v: Any, u: Any) -> Any:
        dtype = np.asarray(q).dtype
        parameters, *given = (np.asarray(x, np.float64) for x in (parameters, q, v, u))
        states = list(np.broadcast_arrays(*given))
        if parameters.size == self.layer.parameters.size:
            return self.one(parameters.ravel(), states).astype(dtype)
        batch = np.broadcast_shapes(parameters.shape[:-1], states[0].shape[: parameters.ndim - 1])
        each = [self.one(*part) for part in _parts(batch, parameters, states)]
        return np.stack(each).reshape(*batch, *each[0].shape).astype(dtype)

    def one(self, parameters: Any, states: Any) -> Any:
        return self.layer.evaluate(self.map, *states, parameters=parameters, h=self.h)


class _Pull(_Value):
    """The sensitivities of a map; those to the parameters for each element of the axes of ``vmap``."""

    def __call__(self, parameters: Any, q: Any, v: Any, u: Any, g: Any = None) -> Any:
        types = [np.asarray(x).dtype for x in (parameters, q, v, u)]
        parameters, *given = (np.asarray(x, np.float64) for x in (parameters, q, v, u))
        states = list(np.broadcast_arrays(*given))
        g = np.asarray(g, np.float64)
        values = 0 if self.layer.width(self.map) is None else 1
        g = np.broadcast_to(g, (*states[0].shape[:-1], *g.shape[g.ndim - values :]))
        batch = np.broadcast_shapes(parameters.shape[:-1], states[0].shape[: parameters.ndim - 1])
        each = [
            self.layer.pull_back(self.map, *part[:3], g=part[3], parameters=weights, h=self.h)
            for weights, part in _parts(batch, parameters, [*states, g])
        ]
        together = (np.stack(x).reshape(*batch, *x[0].shape) for x in zip(*each))
        q, v, u, parameters = together
        return tuple(x.astype(t) for x, t in zip((parameters, q, v, u), types))


def _parts(batch: tuple[int, ...], parameters: Any, states: Any) -> Any:
    """Parameters and states of each element of the axes of ``vmap``."""
    parameters = np.broadcast_to(parameters, (*batch, parameters.shape[-1]))
    states = [np.broadcast_to(x, (*batch, *x.shape[len(batch) :])) for x in states]
    for at in np.ndindex(batch):
        yield np.ascontiguousarray(parameters[at]), [np.ascontiguousarray(x[at]) for x in states]
