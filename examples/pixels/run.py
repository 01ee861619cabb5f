"""A pendulum that is learned from pictures: an autoencoder, and a Lagrangian, a Hamiltonian or a plain network in its latent
space (after Greydanus, Dzamba, Yosinski 2019, arXiv 1906.01563, section 6).

    python examples/pixels/run.py --quick
    python examples/pixels/run.py --seeds 3 --picture examples/pixels/errors.png

It needs the extras of the package: pip install 'lagrangian[jax,plot]'.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

import lagrangian as lg
from lagrangian.jax import dynamics, step

SIZE = 28
FRAME = 0.05  # s between two frames
TIME = 0.3  # s, the unit of time of the latent space, in which a swing has a frequency of order one
H = FRAME / TIME
AHEAD = 8  # frames that the latent dynamics predicts in training: a fifth of a swing
SPANS = (1.0, 10.0, 30.0)  # s, over which predictions are compared
WIDTH = 32
BATCH = 32  # windows of pictures of a step

FAMILIES: dict[str, Callable[[int], Any]] = {
    "Lagrangian": lambda seed: lg.Lnn(width=WIDTH, activation="softplus", seed=seed),
    "Hamiltonian": lambda seed: lg.Hnn(width=WIDTH, activation="softplus", seed=seed),
    "plain network": lambda seed: lg.NeuralOde(width=WIDTH, activation="softplus", order="first", seed=seed),
}


def render(angles: np.ndarray) -> np.ndarray:
    """Pictures ``(…, 28 · 28)`` of a rod that hangs at these angles, between 0 and 1."""
    at = (np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0
    x, y = np.meshgrid(at, -at)
    rod = np.stack([np.sin(angles), -np.cos(angles)], -1)[..., None, None, :]
    along = np.clip(x * rod[..., 0] + y * rod[..., 1], 0.0, 0.8)
    distance = np.hypot(x - along * rod[..., 0], y - along * rod[..., 1])
    pictures = np.exp(-0.5 * (distance / 0.12) ** 2)
    return pictures.reshape(*angles.shape, SIZE * SIZE).astype(np.float32)


def swings(count: int, duration: float, rng: np.random.Generator) -> np.ndarray:
    """Angles ``(count, frames)`` of pendulums of 1 m that were let go at up to 1 rad, from a random moment on."""
    pendulum = lg.system("pendulum", length=1.0)
    frames, rows = round(duration / FRAME) + 2, []
    for amplitude, start in zip(rng.uniform(0.3, 1.0, count), rng.uniform(0.0, 2.0, count)):
        times = np.concatenate([[0.0], start + 0.1 + FRAME * np.arange(frames)])
        rows.append(pendulum.rollout([amplitude], [0.0], times=times).q[1:, 0])
    return np.stack(rows)


def pairs(pictures: Any) -> Any:
    """Two pictures each, one after the other: ``(…, frames, p)`` → ``(…, frames - 1, 2 p)``."""
    return jnp.concatenate([pictures[..., :-1, :], pictures[..., 1:, :]], -1)


def dense(key: Any, sizes: tuple[int, ...]) -> list[tuple[Any, Any]]:
    keys = jax.random.split(key, len(sizes) - 1)
    shapes = zip(keys, sizes, sizes[1:])
    return [(jax.random.normal(k, (a, b)) / jnp.sqrt(a), jnp.zeros(b)) for k, a, b in shapes]


def apply(layers: list[tuple[Any, Any]], x: Any) -> Any:
    for w, b in layers[:-1]:
        x = jnp.tanh(x @ w + b)
    w, b = layers[-1]
    return x @ w + b


def encode(weights: Any, frames: Any) -> Any:
    """The latent states (q, v) of all frames but the last: ``(…, frames, p)`` → ``(…, frames - 1, 2)``. q is read from one picture, and
    v from the change of q, with a correction by two pictures."""
    bright = 4.0 * (frames - 0.08)  # most pixels are dark
    q = apply(weights["position"], bright)
    v = (q[..., 1:, :] - q[..., :-1, :]) / H + 0.1 * apply(weights["velocity"], pairs(bright))
    return jnp.concatenate([q[..., :-1, :], v], -1)


def decode(weights: Any, z: Any) -> Any:
    """The pictures at latent states, from q alone: a picture shows a position."""
    return jax.nn.sigmoid(apply(weights["decoder"], z[..., :1]))


def loss_of(move: Callable[..., Any]) -> Callable[[Any, Any], Any]:
    """The loss of windows of pictures ``(m, AHEAD + 2, p)``: reconstruction, and prediction from the first state of a window, in pictures
    and in latent states."""

    def loss(weights: Any, windows: Any) -> Any:
        z, frames = encode(weights, windows), windows[:, :-1]
        reconstruction = jnp.mean((decode(weights, z) - frames) ** 2)
        state, states = z[:, 0], []
        for _ in range(AHEAD):
            state = move(weights["dynamics"], state[:, :1], state[:, 1:])
            states.append(state)
        ahead = jnp.stack(states, 1)
        latent = jnp.mean((ahead - z[:, 1:]) ** 2 / (jnp.var(z, (0, 1)) + 1e-4))
        predicted = jnp.mean((decode(weights, ahead) - frames[:, 1:]) ** 2)
        return reconstruction + predicted + 0.1 * latent

    return loss


def adam(loss: Callable[[Any, Any], Any], steps: int) -> Callable[..., Any]:
    """One step of Adam with clipped slopes, whose rate falls to nothing along a cosine."""

    @jax.jit
    def descend(weights: Any, moments: Any, k: Any, batch: Any) -> Any:
        value, slopes = jax.value_and_grad(loss)(weights, batch)
        norm = jnp.sqrt(sum(jnp.sum(g * g) for g in jax.tree.leaves(slopes)))
        slopes = jax.tree.map(lambda g: g * jnp.minimum(1.0, 0.1 / (norm + 1e-12)), slopes)
        rate = 3e-3 * 0.5 * (1.0 + jnp.cos(jnp.pi * k / steps))
        first = jax.tree.map(lambda m, g: 0.9 * m + 0.1 * g, moments[0], slopes)
        second = jax.tree.map(lambda m, g: 0.999 * m + 0.001 * g * g, moments[1], slopes)
        a, b = 1.0 - 0.9 ** (k + 1.0), 1.0 - 0.999 ** (k + 1.0)
        update = lambda w, m, v: w - rate * (m / a) / (jnp.sqrt(v / b) + 1e-8)  # noqa: E731
        return jax.tree.map(update, weights, first, second), (first, second), value

    return descend


class Data(NamedTuple):
    """Pictures of many short swings, and of a few long ones."""

    train: np.ndarray
    test: np.ndarray


def data(seed: int) -> Data:
    rng = np.random.default_rng(seed)
    return Data(render(swings(80, 3.0, rng)), render(swings(10, SPANS[-1], rng)))


def train(name: str, pictures: np.ndarray, seed: int, steps: int) -> tuple[lg.Layer, Any]:
    layer = lg.Layer.fresh(FAMILIES[name](seed), n=1)
    loss = loss_of(step(layer, H))
    keys = jax.random.split(jax.random.key(seed), 3)
    pixels = SIZE * SIZE
    weights = {
        "position": dense(keys[0], (pixels, 48, 48, 1)),
        "velocity": dense(keys[2], (2 * pixels, 48, 48, 1)),
        "decoder": dense(keys[1], (1, 48, 48, pixels)),
        "dynamics": jnp.asarray(layer.parameters, jnp.float32),
    }
    moments = (jax.tree.map(jnp.zeros_like, weights),) * 2
    descend, rng = adam(loss, steps), np.random.default_rng(seed)
    windows = np.arange(AHEAD + 2)
    for k in range(steps):
        rows = rng.integers(len(pictures), size=BATCH)
        starts = rng.integers(pictures.shape[1] - AHEAD - 1, size=BATCH)
        batch = pictures[rows[:, None], starts[:, None] + windows]
        weights, moments, value = descend(weights, moments, k, batch)
        if k % 500 == 0 or k == steps - 1:
            print(f"  {name}, seed {seed}, step {k}: loss {value:.5f}", flush=True)
    return layer, weights


def rollout(layer: lg.Layer, weights: Any, start: np.ndarray, frames: int) -> np.ndarray:
    """Latent states ``(frames, m, 2)``; a motion that leaves every bound stays where it was."""
    move, states = jax.jit(step(layer, H)), [np.asarray(start)]
    for _ in range(frames - 1):
        after = np.asarray(move(weights["dynamics"], states[-1][:, :1], states[-1][:, 1:]))
        states.append(np.where(np.isfinite(after), after, states[-1]))
    return np.stack(states)


def measure(layer: lg.Layer, weights: Any, pictures: np.ndarray) -> dict[str, Any]:
    """Errors of pictures over the spans, and how much of its range the latent energy drifts."""
    z, frames = encode(weights, pictures), pictures[:, :-1]
    latent = rollout(layer, weights, z[:, 0], frames.shape[1])
    predicted = np.asarray(decode(weights, jnp.asarray(latent, jnp.float32))).transpose(1, 0, 2)
    error = ((predicted - frames) ** 2).mean(2).mean(0)
    again = np.asarray(decode(weights, z))
    found = {f"{s:g} s": float(error[: round(s / FRAME)].mean()) for s in SPANS}
    found["autoencoder"] = float(((again - frames) ** 2).mean())
    energy = latent_energy(layer, weights, latent)
    if energy is not None:
        spread = energy[0].max() - energy[0].min()
        found["energy drift"] = float(np.abs(energy - energy[0]).max(0).mean() / spread)
    return {"figures": found, "error": error}


def latent_energy(layer: lg.Layer, weights: Any, latent: np.ndarray) -> np.ndarray | None:
    parameters = np.asarray(weights["dynamics"], np.float64)
    q, v = latent[..., :1], latent[..., 1:]
    if layer.moves_in_momenta:
        return np.asarray(dynamics(layer, "scalar")(parameters, q, v))
    if layer.family == "lnn":
        return layer.model(parameters).energy(q, v)
    return None


def draw(results: dict[str, list[dict[str, Any]]], path: str) -> None:
    from matplotlib import pyplot

    _, ax = pyplot.subplots(figsize=(7, 4))
    for name, runs in results.items():
        errors = np.stack([run["error"] for run in runs])
        times = FRAME * np.arange(errors.shape[1])
        [line] = ax.plot(times, np.median(errors, 0), label=name)
        ax.fill_between(times, errors.min(0), errors.max(0), color=line.get_color(), alpha=0.2)
    ax.set(xlabel="time ahead, s", ylabel="mean squared error of pixels", yscale="log")
    ax.legend()
    pyplot.tight_layout()
    pyplot.savefig(path, dpi=120)


def table(results: dict[str, list[dict[str, Any]]]) -> str:
    columns = [f"{s:g} s" for s in SPANS] + ["autoencoder", "energy drift"]
    lines = ["| latent dynamics | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for name, runs in results.items():
        cells = []
        for column in columns:
            values = [run["figures"][column] for run in runs if column in run["figures"]]
            cells.append(f"{np.median(values):.2g} ({min(values):.2g} … {max(values):.2g})" if values else "–")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one seed and a quarter of the steps")
    parser.add_argument("--seeds", type=int, default=3, help="number of seeds (3)")
    parser.add_argument("--steps", type=int, default=3000, help="steps of training (3000)")
    parser.add_argument("--picture", help="file of a picture of the errors over time")
    parser.add_argument("--json", help="file of all figures")
    given = parser.parse_args()
    if given.seeds < 1 or given.steps < 1:
        parser.error("--seeds and --steps must be at least 1")
    seeds, steps = (1, given.steps // 4 or 1) if given.quick else (given.seeds, given.steps)
    results: dict[str, list[dict[str, Any]]] = {name: [] for name in FAMILIES}
    for seed in range(seeds):
        pictures = data(seed)
        for name in FAMILIES:
            begin = time.monotonic()
            layer, weights = train(name, pictures.train, seed, steps)
            results[name].append(measure(layer, weights, pictures.test))
            print(f"  {name}, seed {seed}: {time.monotonic() - begin:.0f} s", flush=True)
    print(table(results))
    if given.picture:
        draw(results, given.picture)
    if given.json:
        figures = {name: [run["figures"] for run in runs] for name, runs in results.items()}
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump(figures, file, indent=1)


if __name__ == "__main__":
    main()
