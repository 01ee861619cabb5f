"""Swings a machine with one drive up and holds it, knowing the forward dynamics of a model and the limit of the drive.

A swing-up from hanging at rest is planned once. Random feedback laws are tried in the model, and the motions that come nearest
to the top are refined by differential dynamic programming within the limit (Tassa, Mansard and Todorov 2014, Control-limited
differential dynamic programming). A linear-quadratic regulator of the model along the plan follows it, and that of the top holds.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are

import lagrangian as lg
from lagrangian import plant

Array = NDArray[np.float64]
Pair = tuple[Array, Array]
Weights = tuple[Array, Array, float]
STEP = 0.02  # of plans, s
PLANNED = 0.8  # the part of the drive that a plan may use; the rest is for feedback


class SwingUp:
    """States x are (q, q̇), inputs u torques of the drive. At q = 0 the machine stands; with its first hinge at π it hangs."""

    def __init__(self, model: lg.Model, machine: plant.Plant) -> None:
        self.model, self.n, self.drive = model, model.n, int(machine.limits.argmax())
        self.limit = float(machine.limits[self.drive])
        self.hinges = np.array([c.kind == "circle" for c in machine.coordinates] + [False] * self.n)
        self.hanging = np.where(np.arange(2 * self.n) == self.hinges.argmax(), np.pi, 0.0)
        self.costs = np.diag(np.repeat([1.0, 0.1], self.n))
        a, b = self.slopes(np.zeros(2 * self.n), np.zeros(()))
        self.cost_to_go = solve_continuous_are(a, b[:, None], self.costs, np.eye(1))
        self.hold = b @ self.cost_to_go
        self.x, self.u, self.gains = np.zeros((1, 2 * self.n)), np.zeros(0), np.zeros((0, 2 * self.n))

    def __call__(self, t: float, q: Array, qd: Array) -> Array:
        """The torques at a time since the start, s."""
        k, now = int(t / STEP + 1e-6), np.concatenate([q, qd])
        if k < len(self.u):
            part = t / STEP - k
            wanted = self.u[k] + self.gains[k] @ (now - (1.0 - part) * self.x[k] - part * self.x[k + 1])
        else:
            wanted = -self.hold @ self.from_top(now)
        return np.where(np.arange(self.n) == self.drive, np.clip(wanted, -self.limit, self.limit), 0.0)

    def plans(self, seed: int, guesses: int = 2000, most: int = 30) -> Iterator[None]:
        """Takes one plan after the other that reaches the top in the model, of the best guesses."""
        slides = STEP * np.diag(np.append(~self.hinges[: self.n], np.zeros(self.n)))
        for end, u in self.guess(np.random.default_rng(seed), guesses)[:most]:
            goal = np.where(self.hinges, end - self.from_top(end), 0.0)
            x, u = self.refine(np.append(u, np.zeros(50)), goal, (slides, np.diag(np.repeat([100.0, 10.0], self.n)), 1e-2))
            if abs(x[-1] - goal).max() < 0.3:
                self.x, self.u = self.refine(u, goal, (slides, self.cost_to_go, STEP))
                _, self.gains = self.improve(self.x, self.u, goal, (STEP * self.costs, self.cost_to_go, STEP))
                yield

    def flow(self, x: Array, u: Array) -> Array:
        """The rate ẋ of states."""
        q, qd = np.ascontiguousarray(x[..., : self.n]), np.ascontiguousarray(x[..., self.n :])
        tau = np.zeros_like(q)
        tau[..., self.drive] = u
        return np.concatenate([qd, self.model.forward_dynamics(q, qd, tau)], axis=-1)

    def step(self, x: Array, u: Array) -> Array:
        """States a step later, by the method of Runge and Kutta."""
        a = self.flow(x, u)
        b = self.flow(x + 0.5 * STEP * a, u)
        c = self.flow(x + 0.5 * STEP * b, u)
        return x + STEP / 6.0 * (a + 2.0 * (b + c) + self.flow(x + STEP * c, u))

    def slopes(self, x: Array, u: Array) -> Pair:
        """∂ẋ/∂x and ∂ẋ/∂u, by differences over more than the speeds at which the friction of a model turns about."""
        size, moves = 2 * self.n, 0.03 * np.eye(2 * self.n + 1)
        high, low = (self.flow(x[..., None, :] + m[:, :size], u[..., None] + m[:, size]) for m in (moves, -moves))
        both = np.swapaxes(high - low, -1, -2) / 0.06
        return both[..., :size], both[..., size]

    def from_top(self, x: Array) -> Array:
        """States relative to the nearest top."""
        return np.where(self.hinges, (x + np.pi) % (2.0 * np.pi) - np.pi, x)

    def guess(self, draw: np.random.Generator, count: int, steps: int = 500) -> list[tuple[Array, Array]]:
        """Ends and inputs of motions under random feedback, each cut where it is nearest to the top; the nearest first."""
        shape = count, 2 * self.n
        w = draw.normal(size=shape) * draw.integers(0, 2, shape) * 10.0 ** draw.uniform(-1.0, 1.0, (count, 1))
        w[:, self.n + self.drive] = abs(w[:, self.n + self.drive])  # the drive gives energy rather than takes it
        x, u = np.tile(self.hanging, (steps + 1, count, 1)), np.empty((steps, count))
        for k in range(steps):
            seen = np.where(self.hinges, np.sin(x[k]), x[k])
            u[k] = PLANNED * self.limit * np.tanh((seen * w).sum(axis=-1) + 0.1)
            x[k + 1] = self.step(x[k], u[k])
        far = np.nan_to_num((self.from_top(x) ** 2 * np.repeat([1.0, 0.06], self.n)).sum(axis=-1), nan=np.inf)
        ends = far.argmin(axis=0)
        return [(x[ends[i], i], u[: ends[i], i]) for i in far.min(axis=0).argsort()]

    def refine(self, u: Array, goal: Array, by: Weights) -> Pair:
        """The motion from hanging, and its inputs, of least cost near some: of x² at each step, (x − goal)² at the end, u²."""
        near, last, price = by
        most, scales, damping, cost = PLANNED * self.limit, np.array([1.0, 0.5, 0.2, 0.05, 0.01]), 1e-3, np.inf
        x, feed, gains = np.tile(self.hanging, (len(u) + 1, 1)), np.zeros(len(u)), np.zeros((len(u), 2 * self.n))
        for _ in range(100):
            xs, us = np.tile(self.hanging, (len(scales), len(u) + 1, 1)), np.empty((len(scales), len(u)))
            for k in range(len(u)):
                us[:, k] = np.clip(u[k] + scales * feed[k] + (xs[:, k] - x[k]) @ gains[k], -most, most)
                xs[:, k + 1] = self.step(xs[:, k], us[:, k])
            e = xs[:, -1] - goal
            costs = ((e @ last) * e).sum(-1) + ((xs @ near) * xs).sum((-1, -2)) + price * (us**2).sum(-1)
            best, before = np.nan_to_num(costs, nan=np.inf).argmin(), cost
            if costs[best] < cost:
                x, u, cost, damping = xs[best], us[best], costs[best], max(damping / 15.0, 2e-7)
            damping *= 5.0
            if damping > 1e6 or cost < before < (1.0 + 1e-4) * cost:
                break
            feed, gains = self.improve(x, u, goal, by, damping, most)
        return x, u

    def improve(self, x: Array, u: Array, goal: Array, by: Weights, damping: float = 0.0, most: float = np.inf) -> Pair:
        """Changes of the inputs, and gains, that lower the cost to second order, from the last step to the first."""
        (near, last, price), (a, b), eye = by, self.slopes(0.5 * (x[1:] + x[:-1]), u), np.eye(2 * self.n)
        held = STEP * (eye + STEP / 2.0 * a @ (eye + STEP / 3.0 * a @ (eye + STEP / 4.0 * a)))  # ∫ exp(A t) dt
        a, b = eye + a @ held, (held @ b[..., None])[..., 0]
        feed, gains, curve, slope = np.empty(len(u)), np.empty((len(u), 2 * self.n)), last, last @ (x[-1] - goal)
        for k in reversed(range(len(u))):
            down, across, stiff = price * u[k] + b[k] @ slope, b[k] @ curve @ a[k], price + b[k] @ curve @ b[k]
            wanted = -down / (stiff + damping)
            feed[k] = np.clip(wanted, -most - u[k], most - u[k])
            gains[k] = -across / (stiff + damping) * (feed[k] == wanted)
            slope = near @ x[k] + a[k].T @ slope + gains[k] * (stiff * feed[k] + down) + across * feed[k]
            curve = near + a[k].T @ curve @ a[k] + np.outer(gains[k], stiff * gains[k] + across) + np.outer(across, gains[k])
        return feed, gains
