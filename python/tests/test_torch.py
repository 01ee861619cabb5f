"""Models as modules of PyTorch. `conftest.py` says where PyTorch cannot be imported and these tests are not run."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import lagrangian as lg
from lagrangian.torch import Dynamics


@pytest.fixture(scope="module")
def layer() -> lg.Layer:
    return lg.Layer.fresh(lg.Delan(width=16, forces=("viscous", "gains"), seed=2), n=2, angles=[0])


def states(*axes: int) -> list[torch.Tensor]:
    rng = np.random.default_rng(5)
    return [torch.tensor(rng.normal(size=axes), requires_grad=True) for _ in range(3)]


@pytest.mark.parametrize("map", ("acceleration", "rates", "force", "step", "scalar"))
def test_gradients_pass_gradcheck(layer: lg.Layer, map: str) -> None:
    module = Dynamics(layer, map, h=0.02)
    assert torch.autograd.gradcheck(module, states(3, 2))

    weights = module.weights.detach()

    def by_weights(own: torch.Tensor) -> torch.Tensor:
        # The gain of the first joint keeps the unit of energy and is not learned.
        given = {"weights": torch.cat([own, weights[-2:]])}
        return torch.func.functional_call(module, given, tuple(states(3, 2)))

    assert torch.autograd.gradcheck(by_weights, weights[:-2].clone().requires_grad_())


def test_gradients_by_the_weights_are_those_of_the_layer(layer: lg.Layer) -> None:
    module = Dynamics(layer)
    q, qd, tau = states(4, 2)
    module(q, qd, tau).sum().backward()
    own = layer.pull_back("acceleration", *(x.detach().numpy() for x in (q, qd, tau)), g=np.ones((4, 2)))
    np.testing.assert_array_equal(module.weights.grad.numpy(), own.parameters)
    np.testing.assert_array_equal(tau.grad.numpy(), own.u)


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
        Dynamics(module.layer)(torch.ones(2), torch.zeros(2))
