"""Models as differentiable layers, in NumPy and in JAX."""

from __future__ import annotations

import numpy as np
import pytest

import lagrangian as lg

jax = pytest.importorskip("jax")
jax.config.update("jax_enable_x64", True)
jnp = jax.numpy

from jax.test_util import check_grads  # noqa: E402

from lagrangian.jax import dynamics, step  # noqa: E402

MAPS = ("acceleration", "rates", "force", "scalar")


def states(*axes: int) -> list[np.ndarray]:
    rng = np.random.default_rng(5)
    return [rng.normal(size=axes) for _ in range(3)]


@pytest.fixture(scope="module")
def layer() -> lg.Layer:
    forces = ("viscous", "offset")
    return lg.Layer.fresh(lg.Delan(width=16, forces=forces, seed=2), n=2, angles=[0])


def test_a_fresh_layer_is_a_model_and_a_fitted_model_a_layer(lnn: lg.Estimator) -> None:
    layer = lg.Layer(lnn)
    q, qd, tau = states(7, 1)
    own = layer.evaluate("acceleration", q, qd, tau)
    np.testing.assert_array_equal(own, lnn.forward_dynamics(q, qd, tau))
    assert layer.family == "lnn" and not layer.moves_in_momenta
    other = layer.model(layer.initialise(4))
    assert not np.allclose(other.forward_dynamics(q, qd, tau), own)
    energy = other.energy(q, qd)
    assert energy.shape == (7,) and np.isfinite(energy).all()


def test_fresh_layers_are_reproducible(layer: lg.Layer) -> None:
    again = lg.Layer.fresh(lg.Delan(width=16, forces=("viscous", "offset"), seed=2), n=2, angles=[0])
    np.testing.assert_array_equal(layer.parameters, again.parameters)
    call = ("acceleration", *states(100, 2))
    first = layer.pull_back(*call, g=np.ones((100, 2)))
    second = again.pull_back(*call, g=np.ones((100, 2)))
    for a, b in zip(first, second):
        np.testing.assert_array_equal(a, b)


def test_bad_arguments_are_named(layer: lg.Layer) -> None:
    q, qd, tau = states(3, 2)
    with pytest.raises(lg.errors.InvalidInput, match="q has shape"):
        layer.evaluate("acceleration", q[:, :1], qd, tau)
    with pytest.raises(lg.errors.InvalidInput, match="not finite"):
        layer.evaluate("acceleration", np.full((3, 2), np.nan), qd, tau)
    with pytest.raises(lg.errors.InvalidInput, match="parameters"):
        layer.evaluate("acceleration", q, qd, tau, parameters=np.zeros(3))
    with pytest.raises(lg.errors.InvalidInput, match="acceleration, rates"):
        layer.evaluate("speed", q, qd, tau)
    with pytest.raises(lg.errors.NotSupported, match="acceleration, rates"):
        dynamics(layer, "speed")
    with pytest.raises(lg.errors.InvalidInput, match="weights"):
        lg.Layer.fresh(lg.Features(), n=1)
    with pytest.raises(lg.errors.NotSupported, match="known system"):
        lg.Layer(lg.system("pendulum"))
    hnn = lg.Layer.fresh(lg.Hnn(width=16), n=1)
    with pytest.raises(lg.errors.InvalidInput, match="hnn"):
        hnn.evaluate("acceleration", [0.0], [0.0])
    assert hnn.moves_in_momenta and hnn.evaluate("rates", [0.0], [0.0]).shape == (2,)


@pytest.mark.parametrize("map", MAPS)
def test_gradients_of_jax_agree_with_differences(layer: lg.Layer, map: str) -> None:
    f = dynamics(layer, map)
    given = [layer.parameters, *states(4, 2)]
    check_grads(f, given, order=1, modes=["rev"], atol=1e-5, rtol=1e-5, eps=1e-5)


def test_a_rollout_of_steps_has_the_gradient_of_differences(layer: lg.Layer) -> None:
    one = step(layer, 0.02)
    still = jnp.zeros(2)

    def rollout(weights: jax.Array, q: jax.Array, qd: jax.Array) -> jax.Array:
        def move(state: jax.Array, _: None) -> tuple[jax.Array, jax.Array]:
            after = one(weights, state[:2], state[2:], still)
            return after, after

        return jax.lax.scan(move, jnp.concatenate([q, qd]), None, length=5)[1]

    q, qd, _ = states(2)
    check_grads(jax.jit(rollout), [layer.parameters, q, qd], order=1, modes=["rev"], atol=1e-5, rtol=1e-5, eps=1e-5)


def test_functions_of_jax_can_be_compiled_and_mapped(layer: lg.Layer) -> None:
    f = dynamics(layer)
    weights, (q, qd, tau) = jnp.asarray(layer.parameters), states(5, 2)
    all_at_once = f(weights, q, qd, tau)
    np.testing.assert_array_equal(jax.jit(f)(weights, q, qd, tau), all_at_once)
    mapped = jax.vmap(f, in_axes=(None, 0, 0, 0))
    np.testing.assert_allclose(mapped(weights, q, qd, tau), all_at_once, rtol=1e-12)
    loss = lambda of: lambda w: (of(w, q, qd, tau) ** 2).sum()  # noqa: E731
    np.testing.assert_allclose(jax.grad(loss(mapped))(weights), jax.grad(loss(f))(weights), rtol=1e-9, atol=1e-12)
    ensemble = jnp.stack([weights, layer.initialise(7)])
    each = jax.vmap(f, in_axes=(0, None, None, None))(ensemble, q, qd, tau)
    np.testing.assert_allclose(each[0], all_at_once, rtol=1e-12)
    np.testing.assert_allclose(each[1], f(ensemble[1], q, qd, tau), rtol=1e-12)
    squares = jax.vmap(jax.grad(lambda w, q: (f(w, q, qd[0]) ** 2).sum()), in_axes=(None, 0))(weights, q)
    np.testing.assert_allclose(squares[3], jax.grad(lambda w: (f(w, q[3], qd[0]) ** 2).sum())(weights), rtol=1e-9)


def test_single_precision_is_answered_in_single_precision(layer: lg.Layer) -> None:
    f = dynamics(layer)
    single = [jnp.asarray(x, jnp.float32) for x in (layer.parameters, *states(6, 2))]
    value, gradient = f(*single), jax.grad(lambda *x: f(*x).sum())(*single)
    assert value.dtype == gradient.dtype == jnp.float32
    exact = f(layer.parameters, *states(6, 2))
    np.testing.assert_allclose(value, exact, rtol=1e-3, atol=1e-4)


def test_an_error_inside_a_compiled_function_says_what_is_wrong(layer: lg.Layer) -> None:
    f = jax.jit(dynamics(layer))
    with pytest.raises(Exception, match="not finite"):
        f(layer.parameters, jnp.full(2, jnp.nan), jnp.zeros(2)).block_until_ready()
