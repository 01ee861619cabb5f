"""Models as functions of JAX: ``pip install 'lagrangian[jax]'``.

>>> import jax
>>> import lagrangian as lg
>>> from lagrangian.jax import dynamics
>>> layer = lg.Layer.fresh(lg.Lnn(width=16), n=1, angles="all")
>>> acceleration = dynamics(layer)
>>> loss = lambda weights, q, qd: (acceleration(weights, q, qd) ** 2).sum()
>>> gradient = jax.jit(jax.grad(loss))(layer.parameters, jax.numpy.ones((8, 1)), jax.numpy.zeros((8, 1)))
>>> gradient.shape == layer.parameters.shape
True

The functions are operations on arrays alone: ``jit``, ``vmap`` and derivatives of any order work, on any device. They compute in
the precision of the states; set ``jax_enable_x64`` for double precision. Compile them (``jit``): each call outside of it runs
some hundred operations one by one.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from ._layer import Layer, layer_of
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
        map: What it computes, see ``Layer``: ``acceleration``, ``rates`` (which hnn and neural ODEs of first order have
            instead), ``force`` or ``scalar``.

    Returns:
        The function. ``parameters`` is an array of the shape of ``Layer.parameters``; q, v and u are broadcast against each
        other, and u may be omitted.

    Raises:
        InvalidInput: The model does not have the map.
    """
    return _function(layer_of(model).function("jax", map), scalar=map == "scalar")


def step(model: Layer | Model | Estimator, h: float) -> Callable[..., jax.Array]:
    """A pure function f(parameters, q, v, u) → ``(…, 2 n)``: (q, v) after a Runge–Kutta step of the time ``h``, s.

    With ``jax.lax.scan`` it makes rollouts that can be differentiated.
    """
    return _function(layer_of(model).function("jax", "step"), h=h)


def _function(own: Callable[..., jax.Array], scalar: bool = False, **options: float) -> Callable[..., jax.Array]:
    def function(parameters: Any, q: Any, v: Any, u: Any = None) -> jax.Array:
        given = [jnp.asarray(x) for x in (q, v)]
        if not scalar:
            given.append(jnp.zeros_like(given[0]) if u is None else jnp.asarray(u))
        dtype = jnp.result_type(*given, jnp.float32)
        states = (x.astype(dtype) for x in given)
        return own(jnp.asarray(parameters, dtype), *states, **options)

    return function
