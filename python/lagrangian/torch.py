"""Models as modules of PyTorch, with exact derivatives: ``pip install 'lagrangian[torch]'``.

>>> import torch
>>> import lagrangian as lg
>>> from lagrangian.torch import Dynamics
>>> dynamics = Dynamics(lg.Layer.fresh(lg.Lnn(width=16), n=1, angles="all"))
>>> qdd = dynamics(torch.ones(8, 1), torch.zeros(8, 1))
>>> (qdd**2).sum().backward()
>>> dynamics.weights.grad.shape == dynamics.weights.shape
True

The module computes in double precision on the CPU, whatever the precision and the device of its arguments, and answers in
these. It can be differentiated once, in reverse.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ._layer import Layer, known_map, layer_of
from .errors import MissingExtra

try:
    import torch
    from torch import nn
    from torch.autograd.function import once_differentiable
except ImportError as error:
    raise MissingExtra("lagrangian.torch needs PyTorch: pip install 'lagrangian[torch]'") from error

if TYPE_CHECKING:
    from ._estimators import Estimator
    from ._model import Model

__all__ = ["Dynamics"]


class Dynamics(nn.Module):
    """A model as a module: (q, v, u) ↦ its accelerations, or another map of a layer.

    Args:
        model: A layer, or a fitted model or estimator.
        map: What it computes, see ``Layer.evaluate``: ``acceleration``, ``rates`` (which hnn and neural ODEs of first order have
            instead), ``force``, ``step`` or ``scalar``.
        h: The time of a step, s.

    Attributes:
        weights: The parameters, in the order of ``Layer.parameters``, in double precision at first.
        layer: The layer.
    """

    def __init__(self, model: Layer | Model | Estimator, map: str = "acceleration", *, h: float = 0.0) -> None:
        super().__init__()
        self.layer, self.map, self.h = layer_of(model), known_map(map), float(h)
        self.weights = nn.Parameter(torch.from_numpy(self.layer.parameters))

    def forward(self, q: torch.Tensor, v: torch.Tensor, u: torch.Tensor | None = None) -> torch.Tensor:
        """The value at states ``(…, n)``, which are broadcast against each other; u may be omitted."""
        given = (q, v, torch.zeros_like(q) if u is None else u)
        q, v, u = torch.broadcast_tensors(*given)
        result: torch.Tensor = _Function.apply(self, self.weights, q, v, u)
        return result

    @torch.no_grad()
    def project(self) -> None:
        """Moves the weights to the nearest of their domain; call it after each step of an optimiser."""
        nearest = torch.from_numpy(self.layer.project(_array(self.weights)))
        self.weights.copy_(nearest)

    def model(self) -> Model:
        """The model with the weights of the module, to roll out, save and score."""
        return self.layer.model(_array(self.weights))


def _array(tensor: torch.Tensor) -> Any:
    """The numbers of a tensor: its own memory where it is contiguous, in double precision and on the CPU."""
    return tensor.detach().to("cpu", torch.float64).contiguous().numpy()


def _tensor(values: Any, like: torch.Tensor) -> torch.Tensor:
    return torch.from_numpy(np.asarray(values)).to(like.device, like.dtype)


class _Function(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, module: Dynamics, *given: torch.Tensor) -> torch.Tensor:
        weights, *states = map(_array, given)
        ctx.module = module
        ctx.save_for_backward(*given)
        values = module.layer.evaluate(module.map, *states, parameters=weights, h=module.h)
        return _tensor(values, given[1])

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, g: torch.Tensor) -> Any:
        module, given = ctx.module, ctx.saved_tensors
        weights, *states = map(_array, given)
        pulled = module.layer.pull_back(
            module.map, *states, g=_array(g), parameters=weights, h=module.h
        )
        slopes = (pulled.parameters, pulled.q, pulled.v, pulled.u)
        return None, *(_tensor(x, like) for x, like in zip(slopes, given))
