"""Models as modules of PyTorch: ``pip install 'lagrangian[torch]'``.

>>> import torch
>>> import lagrangian as lg
>>> from lagrangian.torch import Dynamics
>>> dynamics = Dynamics(lg.Layer.fresh(lg.Lnn(width=16), n=1, angles="all"))
>>> qdd = dynamics(torch.ones(8, 1), torch.zeros(8, 1))
>>> (qdd**2).sum().backward()
>>> dynamics.weights.grad.shape == dynamics.weights.shape
True

The module consists of operations on tensors alone: it can be differentiated to any order, mapped (``torch.func``) and moved to
any device. It computes in the precision and on the device of its weights, and answers in those of its arguments.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ._layer import Layer, layer_of
from .errors import MissingExtra

try:
    import torch
    from torch import nn
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
        map: What it computes, see ``Layer``: ``acceleration``, ``rates`` (which hnn and neural ODEs of first order have
            instead), ``force``, ``step`` or ``scalar``.
        h: The time of a step, s.

    Attributes:
        weights: The parameters, in the order of ``Layer.parameters``, in double precision at first.
        layer: The layer.
    """

    def __init__(self, model: Layer | Model | Estimator, map: str = "acceleration", *, h: float = 0.0) -> None:
        super().__init__()
        self.layer, self.map, self.h = layer_of(model), map, float(h)
        self.layer.function("torch", map)
        self.weights = nn.Parameter(torch.from_numpy(self.layer.parameters))

    def forward(self, q: torch.Tensor, v: torch.Tensor, u: torch.Tensor | None = None) -> torch.Tensor:
        """The value at states ``(…, n)``, which are broadcast against each other; u may be omitted."""
        given = [q, v]
        if self.map != "scalar":
            given.append(torch.zeros_like(q) if u is None else u)
        states = (x.to(self.weights.device, self.weights.dtype) for x in given)
        options = {"h": self.h} if self.map == "step" else {}
        value: torch.Tensor = self.layer.function("torch", self.map)(self.weights, *states, **options)
        return value.to(q.device, q.dtype)

    @torch.no_grad()
    def project(self) -> None:
        """Moves the weights to the nearest of their domain; call it after each step of an optimiser."""
        nearest = torch.from_numpy(self.layer.project(_array(self.weights)))
        self.weights.copy_(nearest)

    def model(self) -> Model:
        """The model with the weights of the module, to roll out, save and score."""
        return self.layer.model(_array(self.weights))


def _array(tensor: torch.Tensor) -> Any:
    """The numbers of a tensor, in double precision and on the CPU."""
    return tensor.detach().to("cpu", torch.float64).numpy()
