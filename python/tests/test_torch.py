"""Models as modules of PyTorch. `conftest.py` says where PyTorch cannot be imported and these tests are not run."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
import torch

import lagrangian as lg
from lagrangian.torch import Dynamics

FAMILIES: dict[str, Any] = {
    "lnn": lg.Lnn(width=16, forces=("viscous", "coulomb", "offset", "input-matrix"), seed=1),
    "lnn gelu": lg.Lnn(width=16, activation="gelu", seed=1),
    "lnn convex": lg.Lnn(width=16, form="convex", forces=("viscous", "stribeck", "load"), seed=2),
    "lnn below a speed": lg.Lnn(width=16, speed_limit=5.0, seed=3),
    "delan": lg.Delan(width=16, vector_potential=True, forces=("viscous", "rotor", "gains"), seed=2),
    "vin": lg.Vin(width=16, seed=3),
    "mlp": lg.Mlp(width=16, seed=4),
    "neural-ode": lg.NeuralOde(width=16, order="second", seed=5),
}


@pytest.fixture(scope="module")
def layer() -> lg.Layer:
    return lg.Layer.fresh(lg.Delan(width=16, forces=("viscous", "gains"), seed=2), n=2, angles=[0])


def states(*axes: int) -> list[torch.Tensor]:
    rng = np.random.default_rng(5)
    return [torch.tensor(rng.normal(size=axes), requires_grad=True) for _ in range(3)]


@pytest.mark.parametrize("name", FAMILIES)
def test_values_are_those_of_the_library(name: str) -> None:
    layer = lg.Layer.fresh(FAMILIES[name], n=2, angles=[0])
    model, (q, qd, u) = layer.model(), states(6, 2)
    arrays = [x.detach().numpy() for x in (q, qd, u)]
    expected = {"acceleration": model.forward_dynamics(*arrays)}
    if layer.family not in ("mlp", "neural-ode"):
        expected |= {"force": model.inverse_dynamics(*arrays), "scalar": np.asarray(model.lagrangian(*arrays[:2]))}
    for map, values in expected.items():
        found = Dynamics(layer, map)(q, qd, u).detach().numpy()
        np.testing.assert_allclose(found, values, rtol=0, atol=1e-12 * np.abs(values).max())


@pytest.mark.parametrize("map", ("acceleration", "rates", "force", "step", "scalar"))
def test_gradients_pass_gradcheck(layer: lg.Layer, map: str) -> None:
    module = Dynamics(layer, map, h=0.02)
    assert torch.autograd.gradcheck(module, states(2, 2), fast_mode=True)

    def by_weights(own: torch.Tensor) -> torch.Tensor:
        return torch.func.functional_call(module, {"weights": own}, tuple(states(2, 2)))

    weights = module.weights.detach().clone().requires_grad_()
    assert torch.autograd.gradcheck(by_weights, weights, fast_mode=True)


@pytest.mark.parametrize("name", FAMILIES)
def test_gradients_are_those_of_jax(name: str) -> None:
    jax = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    from lagrangian.jax import dynamics

    layer = lg.Layer.fresh(FAMILIES[name], n=2, angles=[0])
    module, given = Dynamics(layer), states(4, 2)
    (module(*given) ** 2).sum().backward()
    f = dynamics(layer)
    arrays = [layer.parameters, *(x.detach().numpy() for x in given)]
    expected = jax.grad(lambda *x: (f(*x) ** 2).sum(), argnums=(0, 1, 2, 3))(*arrays)
    for x, own in zip((module.weights, *given), expected):
        found = np.zeros_like(own) if x.grad is None else x.grad.numpy()
        np.testing.assert_allclose(found, own, rtol=0, atol=1e-12 * max(1.0, np.abs(own).max()))


def test_second_derivatives_by_weights_and_states() -> None:
    layer = lg.Layer.fresh(lg.Delan(width=4, layers=1, seed=2), n=1, angles=[0])
    f, given = layer.function("torch", "acceleration"), states(3, 1)
    weights = torch.tensor(layer.parameters, requires_grad=True)
    assert torch.autograd.gradgradcheck(f, (weights, *given), fast_mode=True)
    slope = torch.func.jacrev(lambda w: (f(w, *given) ** 2).sum())
    hessian = torch.func.jacrev(slope)(weights.detach())
    torch.testing.assert_close(hessian, hessian.T)
    mapped = torch.vmap(f, (None, 0, 0, 0))(weights, *given)
    torch.testing.assert_close(mapped, f(weights, *given))


def test_a_module_learns_an_acceleration() -> None:
    torch.manual_seed(0)
    module = Dynamics(lg.Layer.fresh(lg.Lnn(width=16, seed=1), n=1, angles="all"))
    q, qd = torch.linspace(-2.0, 2.0, 32)[:, None], torch.zeros(32, 1)
    optimizer = torch.optim.Adam(module.parameters(), lr=1e-2)
    losses = []
    for _ in range(200):
        optimizer.zero_grad()
        loss = ((module(q, qd) + torch.sin(q)) ** 2).mean()
        loss.backward()
        optimizer.step()
        module.project()
        losses.append(loss.item())
    assert losses[-1] < 0.02 * losses[0]
    found = module.model().forward_dynamics([1.0], [0.0])
    np.testing.assert_allclose(found, [-np.sin(1.0)], atol=0.2)


def test_single_precision_and_states_of_different_shapes() -> None:
    module = Dynamics(lg.Layer.fresh(lg.Hnn(width=16), n=2), "rates").float()
    rates = module(torch.ones(5, 2), torch.zeros(2))
    assert rates.shape == (5, 4) and rates.dtype == torch.float32
    with pytest.raises(lg.errors.InvalidInput, match="hnn"):
        Dynamics(module.layer)


def test_a_module_can_be_copied_and_pickled(layer: lg.Layer) -> None:
    module, given = Dynamics(layer), states(3, 2)
    for other in (copy.deepcopy(module), pickle.loads(pickle.dumps(module))):
        torch.testing.assert_close(other(*given), module(*given))
