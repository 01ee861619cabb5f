"""The training step of a deep Lagrangian network in PyTorch on the CPU.

The derivatives that the equation of motion needs are carried by hand through the layers, one tangent along qd and one
pull-back to q, in plain batched products; autograd does the weights.
"""

import os

import torch
from contest import Entry, serve
from torch.nn.functional import softplus

RATE, SHIFT = 1e-3, 1e-3


def layers(flat, sizes):
    """Matrices [width, inputs] row-major, then biases."""
    found, at = [], 0
    for inputs, width in zip(sizes[:-1], sizes[1:]):
        found.append(flat[at : at + width * inputs].reshape(width, inputs).clone().requires_grad_())
        at += width * inputs
        found.append(flat[at : at + width].clone().requires_grad_())
        at += width
    return found


class Factor:
    """Where the outputs stand in the lower triangular factor G, and G of a batch."""

    def __init__(self, n):
        self.n = n
        self.diagonal = torch.arange(n) * (n + 1)
        rows, columns = torch.tril_indices(n, n, -1)
        self.below = rows * n + columns

    def place(self, diagonal, below):
        flat = diagonal.new_zeros(len(diagonal), self.n * self.n)
        flat = flat.index_copy(1, self.diagonal, diagonal).index_copy(1, self.below, below)
        return flat.reshape(-1, self.n, self.n)


def torque(weights, scaling, factor, q, qd, qdd):
    """M qdd + c of a batch [m, n] of angles."""
    n, s, energy = factor.n, scaling["qd_scale"], scaling["energy"]
    v, a = qd / s, qdd / s
    cos, sin = torch.cos(q), torch.sin(q)
    x = torch.stack([cos, sin], -1).flatten(1)
    rate = torch.stack([-sin * qd, cos * qd], -1).flatten(1)
    slopes = []
    for w, b in zip(weights[:-2:2], weights[1:-2:2]):
        z, z_rate = torch.addmm(b, x, w.T), rate @ w.T
        slope = torch.sigmoid(z)
        x, rate = softplus(z), slope * z_rate
        slopes.append(slope)
    o, o_rate = torch.addmm(weights[-1], x, weights[-2].T), rate @ weights[-2].T
    first = torch.sigmoid(o[:, :n])
    last = n * (n + 1) // 2
    g = factor.place(softplus(o[:, :n]) + SHIFT, o[:, n:last])
    g_rate = factor.place(first * o_rate[:, :n], o_rate[:, n:last])
    row = lambda x, m: torch.bmm(x[:, None], m)[:, 0]
    u = row(v, g)
    momentum_rate = row(u, g_rate.mT) + row(row(v, g_rate) + row(a, g), g.mT)
    # The slope of |Gᵀ v|² / 2 - V by the outputs, pulled back to q.
    outer = (v[:, :, None] * u[:, None]).flatten(1)
    potential = torch.full_like(o[:, :1], -1.0)
    back = torch.cat([first * outer[:, factor.diagonal], outer[:, factor.below], potential], 1) @ weights[-2]
    for w, slope in zip(weights[-4::-2], slopes[::-1]):
        back = (back * slope) @ w
    slope = back.reshape(-1, n, 2)
    return energy * (momentum_rate / s - (slope[..., 1] * cos - slope[..., 0] * sin))


def delan_step(task, data):
    """Mean square of the torque in units of its size."""
    dtype = {"f32": torch.float32, "f64": torch.float64}[task["precision"]]
    n = data["n"]
    q, qd, qdd, tau = (torch.tensor(data[k], dtype=dtype).reshape(-1, n) for k in ("q", "qd", "qdd", "tau"))
    scaling = {k: torch.tensor(v, dtype=dtype) for k, v in data["scaling"].items()}
    units, flat = torch.tensor(data["weights"], dtype=dtype), torch.tensor(data["parameters"], dtype=dtype)
    weights = layers(flat, [2 * n] + 2 * [task["width"]] + [n * (n + 1) // 2 + 1])
    optimizer = torch.optim.Adam(weights, lr=RATE, fused=True)
    factor = Factor(n)

    def step():
        optimizer.zero_grad(set_to_none=True)
        value = ((units * (torque(weights, scaling, factor, q, qd, qdd) - tau)) ** 2).mean()
        value.backward()
        optimizer.step()
        return value.detach()

    check = [float(step()) for _ in range(task["check"])]

    def run(laps):
        for _ in range(laps):
            step()

    return Entry(0.0, check, run)


if __name__ == "__main__":
    torch.set_num_threads(int(os.environ.get("OMP_NUM_THREADS", "1")))
    serve({"delan-step": delan_step})
