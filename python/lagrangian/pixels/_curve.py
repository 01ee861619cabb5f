"""A curve through pictures: the coordinate of a thing that moves along one.

Pictures of a system with one coordinate lie on a curve in the space of pictures, whatever they show. A graph of neighbours tells
its order (Laplacian eigenmaps, Belkin and Niyogi 2003, made independent of the density of the samples as by Coifman and Lafon 2006);
harmonics or cosines are fitted through it and pictures are projected on it (principal curves, Hastie and Stuetzle 1989).
The coordinate is the length along the curve. Nothing of it knows of time or of mechanics.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]

#: Components that are kept at most, and pictures from which they are computed.
_COMPONENTS, _SEEN = 64, 1500
#: Pictures of the graph of neighbours, and the neighbour whose distance is the width of a kernel.
_LANDMARKS, _NEIGHBOUR = 600, 10
#: Orders of curves that are tried, and how often each is fitted and projected on.
_ORDERS, _ROUNDS = (4, 8, 12, 16, 24, 32, 48, 64), 3
#: Points of a curve on which pictures are projected before the place is refined.
_POINTS = 1024
#: How far a picture may move along the curve in a round, in parts of half of it: neighbours tell the order, not the curve.
_REACH = 0.15
#: A curve of higher order must err by this factor less.
_SIMPLER = 0.98


@dataclass
class Components:
    """Principal components of pictures: ``mean`` ``(p,)`` and an orthonormal ``basis`` ``(p, k)``."""

    mean: NDArray[np.float32]
    basis: NDArray[np.float32]

    @classmethod
    def of(cls, pictures: NDArray[np.float32], rng: np.random.Generator) -> Components:
        """Those of pictures ``(m, p)``."""
        mean = pictures.mean(0)
        seen = (pictures[rng.permutation(len(pictures))[:_SEEN]] - mean).astype(np.float64)
        tall = len(seen) >= seen.shape[1]
        values, vectors = np.linalg.eigh(seen.T @ seen if tall else seen @ seen.T)
        values, vectors = values[::-1], vectors[:, ::-1]
        kept = max(2, min(_COMPONENTS, int((values > 1e-8 * values[0]).sum())))
        basis = vectors[:, :kept] if tall else seen.T @ (vectors[:, :kept] / np.sqrt(np.maximum(values[:kept], 1e-300)))
        return cls(mean, basis.astype(np.float32))

    def project(self, pictures: NDArray[np.float32]) -> Array:
        """The components of pictures ``(m, p)``: ``(m, k)``."""
        return ((pictures - self.mean) @ self.basis).astype(np.float64)

    def pictures(self, components: Array) -> NDArray[np.float32]:
        """The pictures of components ``(m, k)``: ``(m, p)``."""
        return (components.astype(np.float32) @ self.basis.T + self.mean).astype(np.float32)


@dataclass
class Curve:
    """A curve in the space of components.

    Attributes:
        kind: ``circle``, for q from −π to π, closed, in harmonics; or ``line``, for q from −1 to 1, in a cubic and cosines.
        coefficients: Shape ``(2 order + 1, k)``.
    """

    kind: str
    coefficients: Array

    @property
    def closed(self) -> bool:
        """Whether the coordinate is an angle."""
        return self.kind == "circle"

    @property
    def order(self) -> int:
        return len(self.coefficients) // 2

    def at(self, q: Array) -> Array:
        """The components at places ``(m,)``: ``(m, k)``; beyond the end of a line those of its end."""
        return basis(self.kind, q, self.order) @ self.coefficients

    @cached_property
    def grid(self) -> Array:
        """Places from end to end."""
        half = np.pi if self.closed else 1.0
        return np.linspace(-half, half, _POINTS + 1)

    @cached_property
    def points(self) -> Array:
        """The components at the grid."""
        return self.at(self.grid)

    def place(self, components: Array, near: Array | None = None) -> Array:
        """The places of the nearest points of the curve, ``(m,)``; with ``near``, of those not far from these places."""
        grid, points = self.grid, self.points
        inner = slice(0, _POINTS) if self.closed else slice(1, _POINTS)
        sizes = np.square(points).sum(1)
        found = []
        for rows in np.array_split(np.arange(len(components)), max(1, len(components) // 4096)):
            part = components[rows]
            squares = sizes - 2.0 * part @ points.T
            if near is not None:
                squares[self.apart(grid, near[rows, None]) > _REACH * grid[-1]] = np.inf
            nearest = squares[:, inner].argmin(1) + inner.start
            each = np.arange(len(part))
            before, here, after = (squares[each, (nearest + k) % _POINTS if self.closed else nearest + k] for k in (-1, 0, 1))
            ends = ~np.isfinite(before + after)
            before[ends] = after[ends] = here[ends] + 1.0
            bend = np.maximum(before - 2.0 * here + after, 1e-300)
            found.append(grid[nearest] + (grid[1] - grid[0]) * np.clip(0.5 * (before - after) / bend, -1.0, 1.0))
        return np.concatenate(found)

    def apart(self, q: Array, other: Array) -> Array:
        """The distance of places."""
        own: Array = np.abs(np.angle(np.exp(1j * (q - other)))) if self.closed else np.abs(q - other)
        return own

    def lengths(self) -> tuple[Array, Array]:
        """Places, and the length along the curve there, from −π to π or −1 to 1."""
        grid = self.grid
        steps = np.sqrt(np.square(np.diff(self.points, axis=0)).sum(1))
        along = np.concatenate([[0.0], np.cumsum(steps)])
        return grid, grid[0] + (grid[-1] - grid[0]) * along / max(along[-1], 1e-300)

    def error(self, components: Array) -> float:
        """The mean square distance of components from the curve."""
        return float(np.square(self.at(self.place(components)) - components).sum(1).mean())


def basis(kind: str, q: Array, order: int) -> Array:
    """The functions of a curve, ``(m, 2 order + 1)``: of a line a cubic, which takes what does not fit at its ends, and cosines."""
    if kind == "line":
        q = np.clip(q, -1.0, 1.0)
        waves = 0.5 * np.pi * (q[:, None] + 1.0) * np.arange(1, 2 * order - 2)
        return np.concatenate([q[:, None] ** np.arange(4), np.cos(waves)], 1)
    angles = q[:, None] * np.arange(1, order + 1)
    return np.concatenate([np.ones((len(q), 1)), np.cos(angles), np.sin(angles)], 1)


def through(kind: str, q: Array, components: Array, order: int) -> Curve:
    """The curve of an order nearest to components ``(m, k)`` at places ``(m,)``; its higher terms are held back a little."""
    functions = basis(kind, q, order)
    waves = np.arange(1, order + 1)
    powers = np.concatenate([np.zeros(4), np.arange(1, 2 * order - 2) / 2.0]) if kind == "line" else np.concatenate([[0.0], waves, waves])
    held = 1e-8 * len(q) * np.diag(powers**4)
    return Curve(kind, np.linalg.solve(functions.T @ functions + held, functions.T @ components))


def embedding(components: Array, rng: np.random.Generator) -> Array:
    """The first two eigenfunctions of the Laplacian at pictures, ``(m, 2)``: at such as are spread over all, and at the others those of the
    nearest."""
    chosen = [int(rng.integers(len(components)))]
    distance = np.square(components - components[chosen[0]]).sum(1)
    nearest = np.zeros(len(components), np.intp)
    least = 1e-9 * distance.max()
    while len(chosen) < _LANDMARKS and distance.max() > least:
        chosen.append(int(distance.argmax()))
        other = np.square(components - components[chosen[-1]]).sum(1)
        nearest[other < distance] = len(chosen) - 1
        distance = np.minimum(distance, other)
    marks = components[chosen]
    squares = np.square(marks).sum(1)
    apart = np.sqrt(np.maximum(squares[:, None] + squares - 2.0 * marks @ marks.T, 0.0))
    near = np.sort(apart, 1)[:, min(_NEIGHBOUR, len(marks) - 1)]
    near = np.maximum(near, 1e-3 * np.median(near) + 1e-300)
    kernel = np.exp(-np.square(apart) / (near[:, None] * near))
    density = kernel.sum(1)
    kernel /= density[:, None] * density
    root = np.sqrt(kernel.sum(1))
    _, vectors = np.linalg.eigh(kernel / (root[:, None] * root))
    functions: Array = vectors[:, [-2, -3]] / vectors[:, -1:]
    return functions[nearest]


def first_places(kind: str, functions: Array) -> Array:
    """Places by eigenfunctions: sine and cosine of a circle, half a cosine of a line."""
    if kind == "circle":
        angle: Array = np.arctan2(functions[:, 1] / functions[:, 1].std(), functions[:, 0] / functions[:, 0].std())
        return angle
    low, high = functions[:, 0].min(), functions[:, 0].max()
    half: Array = np.arccos(np.clip((high + low - 2.0 * functions[:, 0]) / (high - low), -1.0, 1.0))
    return 2.0 * half / np.pi - 1.0


def curve(kind: str, train: Array, held: Array, first: Array) -> tuple[Curve, Array]:
    """The curve whose distance from held-out components is least, and the places of the others on it; ``first`` are their places to
    begin with."""
    best: tuple[Curve, Array] | None = None
    least = np.inf
    for order in _ORDERS:
        if 4 * order + 2 > len(train):
            break
        q = first
        own = through(kind, q, train, order)
        error = own.error(held)
        for _ in range(_ROUNDS):
            moved = np.interp(own.place(train, q), *own.lengths())
            if kind == "line":
                moved = 2.0 * (moved - moved.min()) / max(np.ptp(moved), 1e-300) - 1.0
            other = through(kind, moved, train, order)
            after = other.error(held)
            # A curve that is worse has lost the order of the pictures.
            if after > error / _SIMPLER:
                break
            own, q, error = other, moved, after
        if best is None or error < _SIMPLER * least:
            best, least = (own, q), error
    assert best is not None
    return best


def jumps(places: list[Array]) -> float:
    """The mean square of second differences of places over that of first ones: 4 without any order, 0 for slow motion."""
    first = sum(float(np.square(np.diff(q)).sum()) for q in places)
    second = sum(float(np.square(np.diff(q, 2)).sum()) for q in places)
    return second / max(first, 1e-300)


def smoothed(q: Array) -> Array:
    """Places of a motion by cubics over seven of them (Savitzky and Golay 1964); the first and the last three as they are."""
    if len(q) < 7:
        return q
    inner = np.convolve(q, np.array([-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0]) / 21.0, "valid")
    return np.concatenate([q[:3], inner, q[-3:]])


def unwrapped(own: Curve, q: Array) -> Array:
    """Angles without jumps of 2π."""
    return np.unwrap(q) if own.closed else q


def continuous(own: Curve, components: Array, q: Array) -> Array:
    """Places of a motion ``(m,)``, of which those far from where their neighbours expect them are sought there again: pictures of
    other places may look alike."""
    q = unwrapped(own, q)
    if len(q) < 5:
        return q
    half = np.pi if own.closed else 1.0
    expected = q.copy()
    expected[2:-2] = (4.0 * (q[1:-3] + q[3:-1]) - (q[:-4] + q[4:])) / 6.0
    away = np.abs(q - expected)
    limit = max(8.0 * float(np.median(away)), 0.02 * half)
    grid, points = own.grid, own.points
    for k in np.flatnonzero(away > limit):
        around = slice(max(0, int(k) - 2), int(k) + 3)
        near = q[around][away[around] <= limit]
        if len(near) == 0:
            continue
        middle = float(np.median(near))
        reach = own.apart(grid, np.array(middle)) <= max(2.0 * float(np.ptp(near)), 0.1 * half)
        best = grid[reach][np.square(points[reach] - components[k]).sum(1).argmin()]
        q[k] = middle + float(np.angle(np.exp(1j * (best - middle)))) if own.closed else best
    return unwrapped(own, q)
