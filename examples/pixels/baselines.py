"""Baselines of ``compare.py``: pixel models in JAX, each a function (film ``(s, t, h, w)``, dt, seed, seconds of CPU time,
settings) → ``Predictor``, with networks, an optimiser and rollouts that they share."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

import lagrangian as lg
from lagrangian.jax import dynamics, step

Array = NDArray[Any]

#: Principal components that the small baselines see and predict, and the horizon of their training, frames.
COMPONENTS, HORIZON = 48, 24


@dataclass
class Predictor:
    """A fitted model: ``motion``, (context ``(k, h, w)``, count, common) → frames ``(k + count, h, w)`` at the times of the
    context and after it, by the Runge–Kutta method with one step a frame if ``common``; the name of its own integrator, if it has
    one; and the learned energy at the start of a motion, up to scale and offset."""

    motion: Callable[[Array, int, bool], Array]
    integrator: str = ""
    energy: Callable[[Array], float] | None = None

    def predict(self, context: Array, count: int) -> Array:
        """The frames ``(count, h, w)`` after those of the context."""
        return self.motion(context, count, False)[len(context) :]


# What the baselines share: networks, Adam, rollouts, principal components.


def networks(seed: int, taps: int = 1, **sizes: tuple[int, ...]) -> dict[str, Any]:
    """Networks by name, of layers or of convolutions of several taps, with orthogonal weights (Saxe et al. 2014). The offsets are
    random: without them a network of tanh starts as an odd function, and an energy, which is even, is hardly learned."""
    keys = iter(jax.random.split(jax.random.key(seed), 80))
    start = jax.nn.initializers.orthogonal(1.4 if taps > 1 else 1.0)  # rectifiers halve what passes

    def layer(a: int, b: int) -> Any:
        return start(next(keys), (a, b)), jax.random.uniform(next(keys), (b,), minval=-1.0, maxval=1.0) / np.sqrt(a)

    return {name: [layer(taps * a, b) for a, b in zip(own, own[1:])] for name, own in sizes.items()}


def mlp(layers: list[Any], x: Any, bend: Callable[[Any], Any] = jnp.tanh) -> Any:
    for w, b in layers[:-1]:
        x = bend(x @ w + b)
    return x @ layers[-1][0] + layers[-1][1]


def descend(loss: Any, weights: Any, batch: Callable[[], Array], seconds: float, rate: float = 0.0) -> Any:
    """Adam (Kingma, Ba 2015) until the CPU time is spent, after compilation. ``loss`` takes the weights, a batch, the spent part
    of the time and a key. A rate is constant, as published; else it falls from 3e-3 along a cosine. Gradients are clipped."""

    @jax.jit
    def update(weights: Any, moments: Any, k: Any, part: Any, own: Any) -> Any:
        value, slopes = jax.value_and_grad(loss)(weights, own, part, jax.random.key(k))
        norm = jnp.sqrt(sum(jnp.sum(g * g) for g in jax.tree.leaves(slopes)))
        slopes = jax.tree.map(lambda g: g * jnp.minimum(1.0, 1.0 / (norm + 1e-12)), slopes)
        now = rate or 1.5e-3 * (1.0 + jnp.cos(jnp.pi * part)) * jnp.minimum(1.0, (k + 1) / 50)
        first = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, moments[0], slopes)
        second = jax.tree.map(lambda m, g: 0.999 * m + 0.001 * g * g, moments[1], slopes)
        a, b = 1.0 - 0.9 ** (k + 1.0), 1.0 - 0.999 ** (k + 1.0)
        weights = jax.tree.map(lambda w, m, v: w - now * (m / a) / (jnp.sqrt(v / b) + 1e-8), weights, first, second)
        return weights, (first, second), value

    weights = jax.tree.map(lambda w: jnp.asarray(w, jnp.float32), weights)
    moments, k, spent, value, begin = (jax.tree.map(jnp.zeros_like, weights),) * 2, 0, 0.0, np.nan, 0.0
    while spent < seconds:
        weights, moments, value = update(weights, moments, k, spent / seconds, batch())
        value.block_until_ready()
        k, begin = k + 1, begin if k else time.process_time()
        spent = time.process_time() - begin
    print(f"    {k} steps, loss {float(value):.3g}", flush=True)
    return weights


def rk4(field: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """One step of the classical Runge–Kutta method over a unit of time."""

    def move(w: Any, s: Any) -> Any:
        a = field(w, s)
        b = field(w, s + 0.5 * a)
        c = field(w, s + 0.5 * b)
        return s + (a + 2.0 * b + 2.0 * c + field(w, s + c)) / 6.0

    return move


def roll(move: Callable[[Any, Any], Any], weights: Any, state: Any, count: int) -> Any:
    """A state and ``count`` after it, along a first axis."""
    _, states = jax.lax.scan(lambda s, _: (move(weights, s),) * 2, state, None, length=count)
    return jnp.concatenate([state[None], states])


class Components:
    """Principal components of the pictures of a film, scaled so that the first two have a variance of about one."""

    def __init__(self, film: Array) -> None:
        flat = film.reshape(-1, film.shape[2] * film.shape[3])
        self.mean, self.shape = flat.mean(0), film.shape[2:]
        some = flat[np.random.default_rng(0).permutation(len(flat))[:3000]] - self.mean
        self.basis = np.linalg.eigh(some.T @ some)[1][:, ::-1][:, :COMPONENTS]
        self.scale = float((some @ self.basis[:, :2]).std())
        self.film = self.of(film)

    def of(self, frames: Array) -> Array:
        flat = frames.reshape(*frames.shape[:-2], -1)
        z: Array = ((flat - self.mean) @ self.basis / self.scale).astype(np.float32)
        return z

    def pictures(self, z: Any) -> Array:
        flat: Array = np.asarray(z) * self.scale @ self.basis.T + self.mean
        return flat.reshape(*z.shape[:-1], *self.shape)


def windows(values: Array, length: int, seed: int, size: int = 32) -> Callable[[], Array]:
    """Random windows ``(size, length, …)`` of sequences ``(s, t, …)``."""
    rng, limits = np.random.default_rng(seed), (len(values), values.shape[1] - length + 1)

    def batch() -> Array:
        row, start = (rng.integers(limit, size=(size, 1)) for limit in limits)
        chosen: Array = values[row, start + np.arange(length)]
        return chosen

    return batch


def near_first(errors: Any, part: Any) -> Any:
    """The mean of errors ``(t, …)`` with weights that fall in time, and less so as training goes on."""
    fall = jnp.exp(-jnp.arange(len(errors)) / (2.0 * 40.0 ** jnp.minimum(1.0, 2.0 * part)))
    return (errors.mean(tuple(range(1, errors.ndim))) * fall).mean()


# Baselines with a small latent state: a Lagrangian and a plain network on a circle, a neural ODE; and a recurrent network.


def latent(own: Components, seed: int, seconds: float, seen: int, weights: Any, *maps: Any) -> Predictor:
    """A model by its maps. ``start``: components ``(b, seen, c)`` → states ``(b, d)`` at the first frame; ``move``: states →
    those a frame later; ``decode``: states → components; a further loss; the energy of a state, or None. All frames of a window
    are predicted from its start. Where a prediction is given more, Levenberg–Marquardt steps fit the start to more and more."""
    start, move, decode, extra, energy = maps
    length = min(own.film.shape[1], max(seen, HORIZON))

    def loss(w: Any, z: Any, part: Any, key: Any) -> Any:
        states, frames = roll(move, w, start(w, z[:, :seen]), length - 1), jnp.moveaxis(z, 1, 0)
        return near_first((decode(w, states) - frames) ** 2, part) + extra(w, frames, states)

    weights = descend(loss, weights, windows(own.film, length, seed), seconds)
    path: Any = jax.jit(lambda state, count: decode(weights, roll(move, weights, state, count - 1)), static_argnums=1)

    @jax.jit
    def settled(z: Any) -> Any:
        def body(k: Any, held: Any) -> Any:
            s, damping = held
            used = jnp.arange(len(z)) <= 5 + k
            left: Any = lambda s: (used[:, None] * (path(s, len(z)) - z)).ravel()  # noqa: E731
            slopes, now = jax.jacfwd(left)(s), left(s)
            normal = slopes.T @ slopes + damping * jnp.diag(jnp.sum(slopes**2, 0)) + 1e-9 * jnp.eye(len(s))
            after = s - jnp.linalg.solve(normal, slopes.T @ now)
            better = jnp.sum(left(after) ** 2) < jnp.sum(now**2)
            return jnp.where(better, after, s), jnp.where(better, 0.2 * damping, 10.0 * damping)

        return jax.lax.fori_loop(0, len(z) + 5 if len(z) > seen else 0, body, (start(weights, z[None, :seen])[0], 1e-2))[0]

    def motion(context: Array, count: int, common: bool) -> Array:
        return own.pictures(path(settled(own.of(context)), len(context) + count))

    return Predictor(motion, "RK4", energy and (lambda context: float(energy(weights, settled(own.of(context))))))


def on_circle(kind: str, film: Array, dt: float, seed: int, seconds: float, context: int, **_: Any) -> Predictor:
    """A circle as latent position, moved by a Lagrangian network (Cranmer et al. 2020, arXiv 2003.04630) or a plain network of
    the acceleration: layers of this package, by their Runge–Kutta step."""
    parts, seen, width = Components(film), min(context, 15), COMPONENTS
    turns = np.unwrap(np.arctan2(parts.film[..., 1], parts.film[..., 0]))
    h = float(np.clip(np.diff(turns).std(), 0.02, 1.0))  # a frame, in the unit of time in which speeds are of order one
    family = lg.Lnn(width=16, form="convex", seed=seed) if kind == "lnn" else lg.Mlp(width=32, seed=seed)
    layer = lg.Layer.fresh(family, n=1, angles="all")
    advance, harmonics = step(layer, h), np.arange(1, 13)
    weights = networks(seed, encoder=(width, 64, 64, 2), decoder=(25, 64, 64, width), start=(seen + 2, 32, 2))
    weights |= {"first": np.eye(width)[:, :2], "waves": np.zeros((25, width)), "dynamics": layer.parameters}
    weights["line"] = np.linalg.pinv(np.vander(np.arange(seen), 3 if seen == 5 else 5, increasing=True))[:2].T

    def encode(w: Any, z: Any) -> Any:
        u = z @ w["first"] + 0.1 * mlp(w["encoder"], z)
        return u / jnp.sqrt(jnp.sum(u**2, -1, keepdims=True) + 1e-6)

    def start(w: Any, z: Any) -> Any:
        """Angle and speed at the first frame: a polynomial through those seen, and a learned correction."""
        u = encode(w, z)
        q = jnp.arctan2(u[..., 1], u[..., 0])
        change = jnp.pad(jnp.cumsum((q[:, 1:] - q[:, :-1] + np.pi) % (2.0 * np.pi) - np.pi, 1), ((0, 0), (1, 0)))
        more = change @ w["line"] + 0.01 * mlp(w["start"], jnp.concatenate([u[:, 0], change], 1))
        return jnp.stack([q[:, 0] + more[:, 0], more[:, 1] / h], 1)

    def decode(w: Any, s: Any) -> Any:
        waves = s[..., :1] * harmonics
        waves = jnp.concatenate([jnp.cos(waves), jnp.sin(waves), jnp.ones_like(waves[..., :1])], -1)
        return waves @ w["waves"] + 0.1 * mlp(w["decoder"], waves)

    def extra(w: Any, z: Any, states: Any) -> Any:
        u, q = encode(w, z), states[..., 0]
        apart = jnp.mean((jnp.stack([jnp.cos(q), jnp.sin(q)], -1) - u) ** 2)
        return jnp.mean((decode(w, jnp.arctan2(u[..., 1:], u[..., :1])) - z) ** 2) + 0.01 * apart

    def energy(w: Any, s: Any) -> Any:
        lagrangian, momentum = jax.value_and_grad(lambda v: dynamics(layer, "scalar")(w["dynamics"], s[:1], v))(s[1:])
        return s[1] * momentum[0] - lagrangian

    move = lambda w, s: advance(w["dynamics"], s[..., :1], s[..., 1:])  # noqa: E731
    return latent(parts, seed, seconds, seen, weights, start, move, decode, extra, energy if kind == "lnn" else None)


def neural_ode(film: Array, dt: float, seed: int, seconds: float, context: int, **_: Any) -> Predictor:
    """A latent state of 8 numbers, moved by a plain network of its rate (Chen et al. 2018, arXiv 1806.07366)."""
    parts, seen, width = Components(film), min(context, 15), COMPONENTS
    weights = networks(seed, encoder=(seen * width, 64, 64, 8), decoder=(8, 64, 64, width), field=(8, 64, 64, 8))
    start = lambda w, z: mlp(w["encoder"], z.reshape(len(z), -1))  # noqa: E731
    move, decode = rk4(lambda w, s: 0.3 * mlp(w["field"], s)), lambda w, s: mlp(w["decoder"], s)
    return latent(parts, seed, seconds, seen, weights, start, move, decode, lambda w, z, s: 0.0, None)


def gru(film: Array, dt: float, seed: int, seconds: float, context: int, **_: Any) -> Predictor:
    """A gated recurrent unit (Cho et al. 2014, arXiv 1406.1078) that reads the frames given, and then its own."""
    parts, width, seen = Components(film), 128, min(context, 15)
    length, both = min(film.shape[1], max(seen + 5, HORIZON)), COMPONENTS + width
    weights = networks(seed, gates=(both, 2 * width), state=(both, width), output=(width, COMPONENTS))

    def cell(w: Any, state: Any, z: Any) -> Any:
        reset, keep = jnp.split(jax.nn.sigmoid(mlp(w["gates"], jnp.concatenate([z, state], -1))), 2, -1)
        state = keep * state + (1.0 - keep) * jnp.tanh(mlp(w["state"], jnp.concatenate([z, reset * state], -1)))
        return state, z + 0.3 * mlp(w["output"], state)

    def run(w: Any, z: Any, count: int) -> Any:
        """The frame after each of ``(t, …, c)``, and ``count`` more."""
        state, after = jax.lax.scan(lambda s, own: cell(w, s, own), jnp.zeros((*z.shape[1:-1], width)), z)
        more = jax.lax.scan(lambda held, _: (cell(w, *held),) * 2, (state, after[-1]), None, length=count)[1][1]
        return jnp.concatenate([after, more])

    def loss(w: Any, z: Any, part: Any, key: Any) -> Any:
        frames = jnp.moveaxis(z, 1, 0)
        return near_first((run(w, frames[:seen], length - seen - 1) - frames[1:]) ** 2, part)

    weights = descend(loss, weights, windows(parts.film, length, seed), seconds)
    ahead = jax.jit(run, static_argnums=2)

    def motion(context: Array, count: int, common: bool) -> Array:
        z = parts.of(context)
        return parts.pictures(np.concatenate([z[:1], ahead(weights, z, count - 1)]))

    return Predictor(motion)


# Published models.


def pixel_hnn(kind: str, film: Array, dt: float, seed: int, seconds: float, **_: Any) -> Predictor:
    """Pixel HNN or its plain baseline (Greydanus, Dzamba, Yosinski 2019, arXiv 1906.01563, section 6, and their code): a frame
    and its change → latent (q, p) by a residual autoencoder; the rate of (q, p), by H or by a plain network, is trained as one
    step of Euler's method a frame, which is its own integrator here. A prediction starts from the last two frames given. Their
    weight decay of 1e-5 is omitted: on these pictures, whose losses are small, it drives H to zero."""
    pixels, inner = film.shape[2] * film.shape[3], (200, 200, 200)
    rates = (2, 200, 200, 1 if kind == "hnn" else 2)
    weights = networks(seed, encoder=(2 * pixels, *inner, 2), decoder=(2, *inner, 2 * pixels), field=rates)

    def residual(layers: list[Any], x: Any) -> Any:
        x = jax.nn.relu(x @ layers[0][0] + layers[0][1])
        for w, b in layers[1:-1]:
            x = x + jax.nn.relu(x @ w + b)
        return x @ layers[-1][0] + layers[-1][1]

    def rate(w: Any, z: Any) -> Any:
        if kind != "hnn":
            return mlp(w["field"], z)
        slopes = jax.grad(lambda own: mlp(w["field"], own).sum())(z)
        return jnp.stack([slopes[..., 1], -slopes[..., 0]], -1)

    def pairs(frames: Any) -> Any:
        flat = frames.reshape(*frames.shape[:-2], pixels)
        return jnp.concatenate([flat[..., 1:, :], flat[..., 1:, :] - flat[..., :-1, :]], -1)

    def loss(w: Any, frames: Any, part: Any, key: Any) -> Any:
        x = pairs(frames)
        z = residual(w["encoder"], x)
        now, after = z[:, 0], z[:, 1]
        decoded = jnp.mean((residual(w["decoder"], now) - x[:, 0]) ** 2)
        canonical = jnp.mean((now[:, 1] - (after[:, 0] - now[:, 0])) ** 2)
        return decoded + canonical + 0.1 * jnp.mean((after - now - rate(w, now)) ** 2)

    weights = descend(loss, weights, windows(film, 3, seed, 200), seconds, rate=1e-3)
    encode = jax.jit(lambda frames: residual(weights["encoder"], pairs(frames)))

    @partial(jax.jit, static_argnums=(1, 2))
    def run(z: Any, count: int, common: bool) -> Any:
        move = rk4(rate) if common else lambda w, s: s + rate(w, s)
        return residual(weights["decoder"], jnp.concatenate([z, roll(move, weights, z[-1], count)[1:]]))[:, :pixels]

    def motion(context: Array, count: int, common: bool) -> Array:
        following = np.asarray(run(encode(context), count, common))
        return np.concatenate([context[:1], following.reshape(-1, *film.shape[2:])])

    energy = lambda context: float(mlp(weights["field"], encode(context[:2]))[0, 0])  # noqa: E731
    return Predictor(motion, "Euler", energy if kind == "hnn" else None)


def hgn(film: Array, dt: float, seed: int, seconds: float, context: int, full: bool, **_: Any) -> Predictor:
    """Hamiltonian Generative Network (Toth et al. 2019, arXiv 1909.13789): a convolutional encoder of all frames given →
    posterior → (q, p) as maps of 4 × 4; a convolutional H, leapfrog; a convolutional decoder of q; the evidence lower bound, with
    a standard deviation of pixels of 0.1. Small: 4 maps of q, 8 in the layers, and 6 frames of a window decoded at a time, an
    unbiased estimate. Full: 16 and 64 maps, all frames, the published rate. A last layer spreads its maps over 4 × 4 pixels."""
    maps, width = (16, 64) if full else (4, 8)
    size, length, is_q = film.shape[2], min(film.shape[1], 35), np.arange(2 * maps) < maps
    weights = networks(
        seed,
        taps=9,
        encoder=(context, width, width, width, 4 * maps),
        transform=(2 * maps, width, 2 * maps),
        energy=(2 * maps, width, width, 1),
        decoder=(maps, 2 * width, 4 * width),
        painter=(width, 2 * width, 16),
    )
    near = np.stack([np.kron(np.eye(4, k=-i), np.eye(4, k=-j)) for i in (-1, 0, 1) for j in (-1, 0, 1)])

    def conv(own: Any, x: Any, stride: int = 1) -> Any:
        _, h, w, _ = x.shape
        x = jnp.pad(x, ((0, 0), (1, 1), (1, 1), (0, 0)))
        moved = [x[:, i : i + h : stride, j : j + w : stride] for i in range(3) for j in range(3)]
        return jnp.concatenate(moved, -1) @ own[0] + own[1]

    def spread(x: Any, by: int) -> Any:
        b, h, w, c = x.shape
        return x.reshape(b, h, w, by, by, c // by**2).transpose(0, 1, 3, 2, 4, 5).reshape(b, h * by, w * by, c // by**2)

    def posterior(w: Any, frames: Any) -> Any:
        x = jnp.pad(jnp.moveaxis(frames, 1, -1), ((0, 0), (0, 32 - size), (0, 32 - size), (0, 0)))
        for own in w["encoder"][:3]:
            x = jax.nn.relu(conv(own, x, 2))
        return jnp.split(0.3 * conv(w["encoder"][3], x), 2, -1)

    def transform(w: Any, z: Any) -> Any:
        return conv(w["transform"][1], jax.nn.relu(conv(w["transform"][0], z)))

    def matrices(w: Any) -> list[Any]:
        """The convolutions of H as matrices ``(16 c, 16 d)``: much faster on maps as small as 4 × 4."""
        full = [(jnp.einsum("kcd,kst->sctd", k.reshape(9, -1, len(b)), near), jnp.tile(b, 16)) for k, b in w["energy"]]
        return [(m.reshape(16 * m.shape[1], -1), b) for m, b in full]

    def hamiltonian(layers: Any, s: Any) -> Any:
        return mlp(layers, s.reshape(len(s), -1), jax.nn.softplus).sum(-1)

    def rate(layers: Any, s: Any) -> Any:
        slopes = dt * jax.grad(lambda own: hamiltonian(layers, own).sum())(s)
        return jnp.concatenate([slopes[..., maps:], -slopes[..., :maps]], -1)

    def leapfrog(layers: Any, s: Any) -> Any:
        s = s + 0.5 * rate(layers, s) * ~is_q
        s = s + rate(layers, s) * is_q
        return s + 0.5 * rate(layers, s) * ~is_q

    def decode(w: Any, s: Any) -> Any:
        (first, second), (third, last) = w["decoder"], w["painter"]
        x = spread(jax.nn.relu(conv(second, jax.nn.relu(conv(first, s[..., :maps])))), 2)
        return jax.nn.sigmoid(spread(0.4 * conv(last, jax.nn.relu(conv(third, x))), 4) - 2.0)[:, :size, :size, 0]

    def loss(w: Any, frames: Any, part: Any, key: Any) -> Any:
        mean, log = posterior(w, frames[:, :context])
        z = mean + jnp.exp(0.5 * log) * jax.random.normal(key, mean.shape)
        states = roll(leapfrog, matrices(w), transform(w, z), length - 1)
        at = jnp.arange(length) if full else jax.random.permutation(key, length)[:6]
        pictures = decode(w, states[at].reshape(-1, *z.shape[1:])).reshape(len(at), len(frames), size, size)
        divergence = 0.5 * jnp.sum(jnp.exp(log) + mean**2 - 1.0 - log) / len(frames)
        return jnp.mean((pictures - jnp.moveaxis(frames, 1, 0)[at]) ** 2) + 2.0 * 0.1**2 * divergence / (length * size**2)

    weights = descend(loss, weights, windows(film, length, seed, 16), seconds, rate=1.5e-4 if full else 0.0)
    start = jax.jit(lambda frames: transform(weights, posterior(weights, frames[None])[0]))

    @partial(jax.jit, static_argnums=(1, 2))
    def run(state: Any, count: int, common: bool) -> Any:
        return decode(weights, roll(rk4(rate) if common else leapfrog, matrices(weights), state, count - 1)[:, 0])

    motion = lambda context, count, common: np.asarray(run(start(context), len(context) + count, common))  # noqa: E731
    return Predictor(motion, "leapfrog", lambda context: float(hamiltonian(matrices(weights), start(context))[0]))
