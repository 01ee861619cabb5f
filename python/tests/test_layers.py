"""Models as functions of JAX, compared with the library that wrote them."""

from __future__ import annotations

import os
import pickle
import warnings
from collections.abc import Callable
from math import factorial
from typing import Any

import numpy as np
import pytest

import lagrangian as lg

# Most of the time of these tests is that of the compiler.
os.environ.setdefault("XLA_FLAGS", "--xla_backend_optimization_level=0")
jax = pytest.importorskip("jax")
jax.config.update("jax_enable_x64", True)
jnp = jax.numpy

from jax.test_util import check_grads  # noqa: E402

from lagrangian.jax import dynamics, step  # noqa: E402

FRICTION = ("viscous", "coulomb", "stribeck", "load", "offset")
FAMILIES: dict[str, Any] = {
    "lnn": lg.Lnn(width=16, forces=(*FRICTION, "input-matrix"), seed=1),
    "lnn gelu": lg.Lnn(width=16, activation="gelu", seed=1),
    "lnn exponential": lg.Lnn(width=16, exponential=True, activation="xtanh", seed=1),
    "lnn convex": lg.Lnn(width=16, form="convex", forces=FRICTION, seed=2),
    "lnn below a speed": lg.Lnn(width=16, speed_limit=50.0, seed=3),
    "delan": lg.Delan(width=16, vector_potential=True, forces=(*FRICTION, "rotor", "gains"), seed=2),
    "delan with two trunks": lg.Delan(width=16, trunks="separate", activation="tanh", seed=2),
    "vin": lg.Vin(width=16, forces=("viscous",), seed=3),
    "mlp": lg.Mlp(width=16, seed=4),
    "mlp of torques": lg.Mlp(width=16, loss="torque", seed=4),
    "neural-ode": lg.NeuralOde(width=16, order="second", seed=5),
}
HAMILTONIANS: dict[str, Any] = {
    "free": lg.Hnn(width=16, seed=3),
    "mass": lg.Hnn(width=16, structure="mass", activation="tanh", forces=("viscous",), seed=3),
    "below a speed": lg.Hnn(width=16, speed_limit=5.0, seed=3),
}


def states(*axes: int) -> list[np.ndarray]:
    rng = np.random.default_rng(5)
    return [rng.normal(size=axes) for _ in range(3)]


def inside(layer: lg.Layer) -> np.ndarray:
    """Parameters of a layer that keep a distance to the border of their domain, and for which nothing is zero."""
    parameters = layer.parameters
    moved = np.where(layer.project(parameters - 1e3) > parameters - 1e3, parameters + 0.3, parameters + 0.01)
    return layer.project(moved)


def slope(f: Callable[[float], np.ndarray], h: float = 0.01) -> np.ndarray:
    """The derivative of f at 0 by central differences of the order 16, exact but for the rounding of analytic functions."""
    total = 0.0
    for k in range(1, 9):
        weight = -((-1) ** k) * factorial(8) ** 2 / (k * factorial(8 - k) * factorial(8 + k))
        total = total + weight / h * (f(k * h) - f(-k * h))
    return np.asarray(total)


def assert_equal(found: Any, expected: Any, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected).max())


@pytest.fixture(scope="module")
def layer() -> lg.Layer:
    forces = ("viscous", "offset")
    return lg.Layer.fresh(lg.Delan(width=16, forces=forces, seed=2), n=2, angles=[0])


@pytest.fixture(scope="module")
def driven() -> lg.Trajectories:
    """Motions of a cart with a pole, a length and an angle, under random forces."""
    return lg.simulate("cart-pole", trajectories=6, duration=2.0, step=0.02, drive=3.0, seed=1)


@pytest.fixture(scope="module", params=FAMILIES)
def family(request: pytest.FixtureRequest, driven: lg.Trajectories) -> tuple[lg.Layer, np.ndarray, lg.Model]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", lg.errors.FitWarning)
        layer = lg.Layer(FAMILIES[request.param].set_params(steps=3).fit(driven, progress=False))
    parameters = inside(layer)
    return layer, parameters, layer.model(parameters)


def own(model: lg.Model, map: str, q: Any, qd: Any, u: Any) -> np.ndarray:
    """A map by the library."""
    match map:
        case "acceleration":
            return model.forward_dynamics(q, qd, u)
        case "force":
            return model.inverse_dynamics(q, qd, u)
        case _:
            return np.asarray(model.lagrangian(q, qd))


def maps(layer: lg.Layer) -> tuple[str, ...]:
    names = ("acceleration", "force", "scalar")
    own = layer.source("jax")
    return tuple(x for x in names if f"\ndef {'lagrangian' if x == 'scalar' else x}(" in own)


def test_values_are_those_of_the_library(family: tuple[lg.Layer, np.ndarray, lg.Model]) -> None:
    layer, parameters, model = family
    q, qd, u = states(7, 2)
    for map in maps(layer):
        assert_equal(jax.jit(dynamics(layer, map))(parameters, q, qd, u), own(model, map, q, qd, u))
    if "acceleration" in maps(layer):
        rates = jax.jit(dynamics(layer, "rates"))(parameters, q, qd, u)
        assert_equal(rates, np.hstack([qd, model.forward_dynamics(q, qd, u)]))


def test_gradients_are_those_of_the_library(family: tuple[lg.Layer, np.ndarray, lg.Model]) -> None:
    layer, parameters, model = family
    q, qd, u = (0.5 * x for x in states(4, 2))
    rng = np.random.default_rng(1)
    direction = rng.uniform(-1.0, 1.0, parameters.size)
    direction[layer.spans.get("actuation/gains", slice(0, 0))] = 0.0
    direction[layer.spans.get("actuation/matrix", slice(0, 0))] *= 0.1
    for name in ("dissipation/smoothing", "dissipation/stribeck/speed"):
        span = layer.spans.get(name, slice(0, 0))
        direction[span] *= 0.3 * parameters[span]
    along = [0.3 * direction, *(0.04 * x for x in states(4, 2)[::-1])]
    given = (parameters, q, qd, u)
    for map in maps(layer):
        f, values = dynamics(layer, map), own(model, map, q, qd, u)
        g = rng.normal(size=values.shape)
        slopes = jax.jit(jax.grad(lambda *x: (f(*x) * g).sum(), argnums=(0, 1, 2, 3)))(*given)
        for at, (tangent, found) in enumerate(zip(along, slopes)):

            def moved(t: float) -> np.ndarray:
                x = [a + t * tangent if k == at else a for k, a in enumerate(given)]
                return own(layer.model(x[0]) if at == 0 else model, map, *x[1:])

            expected = slope(moved)
            size = np.abs(g).sum() * max(np.abs(expected).max(), np.abs(values).max())
            np.testing.assert_allclose(np.vdot(found, tangent), np.vdot(g, expected), rtol=0, atol=1e-12 * size)


@pytest.mark.parametrize("name", HAMILTONIANS)
def test_hamiltonians_move_as_in_the_library(name: str) -> None:
    layer = lg.Layer.fresh(HAMILTONIANS[name], n=2, angles=[0])
    model, parameters = layer.model(), layer.parameters
    assert layer.moves_in_momenta
    q, qd, tau = (0.5 * x for x in states(5, 2))
    p = model.momentum(q, qd)
    rates = dynamics(layer, "rates")
    found = rates(parameters, q, p, tau)
    assert_equal(found[:, :2], qd, 1e-10)
    velocity = lambda q, p: rates(parameters, q, p, tau)[:, :2]  # noqa: E731
    qdd = jax.jvp(velocity, (q, p), (found[:, :2], found[:, 2:]))[1]
    assert_equal(qdd, model.forward_dynamics(q, qd, tau), 1e-10)
    assert_equal(dynamics(layer, "scalar")(parameters, q, p), model.energy(q, qd), 1e-10)


def test_fitted_models_of_solved_families_are_layers_too() -> None:
    arm = lg.simulate(lg.robot("two_link_arm"), trajectories=6, duration=2.0, step=0.02, drive=3.0, seed=1)
    model = lg.Rigid(urdf="two_link_arm").fit(arm)
    layer = lg.Layer(model)
    q, qd, u = states(6, layer.n)
    assert_equal(dynamics(layer)(layer.parameters, q, qd, u), model.forward_dynamics(q, qd, u), 1e-10)
    with pytest.raises(lg.errors.InvalidInput, match="solved"):
        lg.Layer.fresh(lg.Chain(), n=1)


def test_a_fresh_layer_is_a_model_and_a_fitted_model_a_layer(lnn: lg.Estimator) -> None:
    layer = lg.Layer(lnn)
    q, qd, tau = states(7, 1)
    assert layer.family == "lnn" and not layer.moves_in_momenta and layer.n == 1
    assert_equal(dynamics(layer)(layer.parameters, q, qd, tau), lnn.forward_dynamics(q, qd, tau))
    other = layer.model(0.9 * layer.parameters)
    assert not np.allclose(other.forward_dynamics(q, qd, tau), lnn.forward_dynamics(q, qd, tau))
    again = pickle.loads(pickle.dumps(layer))
    np.testing.assert_array_equal(again.parameters, layer.parameters)


def test_fresh_layers_are_reproducible(layer: lg.Layer) -> None:
    again = lg.Layer.fresh(lg.Delan(width=16, forces=("viscous", "offset"), seed=2), n=2, angles=[0])
    np.testing.assert_array_equal(layer.parameters, again.parameters)
    other = lg.Layer.fresh(lg.Delan(width=16, forces=("viscous", "offset"), seed=3), n=2, angles=[0])
    assert not np.allclose(layer.parameters, other.parameters)
    assert layer.source("jax") == again.source("jax") == other.source("jax")


def test_bad_arguments_are_named(layer: lg.Layer) -> None:
    f, (q, qd, tau) = dynamics(layer), states(3, 2)
    with pytest.raises(ValueError, match="q has the shape"):
        f(layer.parameters, q[:, :1], qd, tau)
    with pytest.raises(ValueError, match="weights have the shape"):
        f(np.zeros(3), q, qd, tau)
    with pytest.raises(lg.errors.InvalidInput, match="weights"):
        layer.model(np.zeros(3))
    with pytest.raises(lg.errors.InvalidInput, match="parameters"):
        layer.project(np.zeros(3))
    with pytest.raises(lg.errors.NotSupported, match="acceleration, rates"):
        dynamics(layer, "speed")
    with pytest.raises(lg.errors.InvalidInput, match="'jax' or 'torch'"):
        layer.source("numpy")
    with pytest.raises(lg.errors.NotSupported, match="known system"):
        lg.Layer(lg.system("pendulum"))
    with pytest.raises(lg.errors.InvalidInput, match="written down"):
        lg.Layer.fresh(lg.Delan(width=16, forces=("viscous", "directional")), n=1)
    hnn = lg.Layer.fresh(lg.Hnn(width=16), n=1)
    with pytest.raises(lg.errors.InvalidInput, match="hnn.*rates"):
        dynamics(hnn, "acceleration")
    assert hnn.moves_in_momenta and dynamics(hnn, "rates")(hnn.parameters, [0.0], [0.0]).shape == (2,)


def test_projected_parameters_are_those_of_a_model() -> None:
    layer = lg.Layer.fresh(lg.Lnn(width=16, form="convex", forces=FRICTION, seed=2), n=1)
    outside = layer.parameters - 0.5
    with pytest.raises(lg.errors.InvalidInput):
        layer.model(outside)
    np.testing.assert_array_equal(layer.project(layer.parameters), layer.parameters)
    layer.model(layer.project(outside))


def test_second_derivatives_by_weights_and_states() -> None:
    layer = lg.Layer.fresh(lg.Delan(width=4, layers=1, forces=("viscous",), seed=2), n=1, angles=[0])
    f, (q, qd, tau) = dynamics(layer), states(3, 1)
    loss = lambda w, q: (f(w, q, qd, tau) ** 2).sum()  # noqa: E731
    hessian = jax.jit(jax.hessian(loss))(layer.parameters, q)
    assert hessian.shape == (layer.parameters.size,) * 2
    np.testing.assert_allclose(hessian, hessian.T, rtol=0, atol=1e-10 * np.abs(hessian).max())
    check_grads(jax.jit(loss), [layer.parameters, q], order=2, modes=["rev"], atol=1e-4, rtol=1e-4, eps=1e-5)
    at_rest = lg.Layer.fresh(lg.Lnn(width=8, seed=1), n=1)
    third = jax.jit(jax.jacfwd(jax.hessian(lambda q: dynamics(at_rest)(at_rest.parameters, q, [0.0])[0])))
    assert np.isfinite(third(jnp.zeros(1))).all()


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
    motion = layer.model().rollout(q, qd, duration=0.1, step=0.02, method="rk4")
    assert_equal(rollout(layer.parameters, q, qd)[:, :2], motion.q[1:], 1e-11)


def test_functions_of_jax_can_be_compiled_and_mapped(layer: lg.Layer) -> None:
    f = jax.jit(dynamics(layer))
    weights, (q, qd, tau) = jnp.asarray(layer.parameters), states(5, 2)
    all_at_once = f(weights, q, qd, tau)
    np.testing.assert_allclose(dynamics(layer)(weights, q, qd, tau), all_at_once, rtol=1e-12)
    mapped = jax.vmap(f, in_axes=(None, 0, 0, 0))
    np.testing.assert_allclose(mapped(weights, q, qd, tau), all_at_once, rtol=1e-12)
    loss = lambda of: lambda w: (of(w, q, qd, tau) ** 2).sum()  # noqa: E731
    np.testing.assert_allclose(jax.grad(loss(mapped))(weights), jax.grad(loss(f))(weights), rtol=1e-9, atol=1e-12)
    ensemble = jnp.stack([weights, 0.9 * weights])
    each = jax.vmap(f, in_axes=(0, None, None, None))(ensemble, q, qd, tau)
    np.testing.assert_allclose(each[0], all_at_once, rtol=1e-12)
    np.testing.assert_allclose(each[1], f(ensemble[1], q, qd, tau), rtol=1e-12)
    assert f(weights, q[:, None], qd[0], tau[0]).shape == (5, 1, 2)


def test_single_precision_is_answered_in_single_precision(layer: lg.Layer) -> None:
    f = jax.jit(dynamics(layer))
    single = [jnp.asarray(x, jnp.float32) for x in (layer.parameters, *states(6, 2))]
    value, gradient = f(*single), jax.grad(lambda *x: f(*x).sum())(*single)
    assert value.dtype == gradient.dtype == jnp.float32
    exact = f(layer.parameters, *states(6, 2))
    np.testing.assert_allclose(value, exact, rtol=1e-3, atol=1e-4)


def test_an_exported_module_tests_itself_and_has_the_numbers_of_the_model(
    lnn: lg.Estimator, command: str, tmp_path: Any
) -> None:
    import importlib.util
    import subprocess

    lnn.model_.save(tmp_path / "swing.safetensors")
    subprocess.run([command, "export", tmp_path / "swing.safetensors", "--jax", tmp_path / "out"], check=True)
    spec = importlib.util.spec_from_file_location("swing", tmp_path / "out" / "swing.py")
    assert spec is not None and spec.loader is not None
    swing = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(swing)
    swing.selftest()
    q, qd, tau = states(7, 1)
    assert_equal(swing.acceleration(swing.weights, q, qd, tau), lnn.forward_dynamics(q, qd, tau))
    assert_equal(swing.mass_matrix(swing.weights, q, qd), lnn.mass_matrix(q, qd))
    swing.weights = swing.project(swing.weights * 1.001)
    with pytest.raises(AssertionError, match="differs"):
        swing.selftest()
