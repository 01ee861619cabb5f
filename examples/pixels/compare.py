"""Models of a pendulum from pictures, compared on the same films, frames of context and budget of CPU time.

    python examples/pixels/compare.py --quick
    python examples/pixels/compare.py --protocol all --json figures.json --picture errors.png

Three protocols: ``pendulum``, clean pictures and a prediction of 1000 frames from 5; ``hgn``, after Toth et al. 2019 (arXiv
1909.13789), with noise in the angle of every frame; ``hnn``, after Greydanus, Dzamba, Yosinski 2019 (arXiv 1906.01563), small
swings of the pendulum of gym. Two rows bound the table: the mean picture, and the true physics fitted to the frames of context.
A model whose own integrator is not the classical Runge–Kutta method is measured a second time with it, at one step a frame.

It needs the extra of the package for the baselines, pip install 'lagrangian[jax]', and SciPy; the picture needs matplotlib. The
budget of the baselines is time, so that their figures change from run to run; those of lagrangian.pixels do not.
"""

from __future__ import annotations

import argparse
import json
import time
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import lagrangian as lg
from baselines import Predictor, gru, hgn, neural_ode, on_circle, pixel_hnn

Array = NDArray[Any]

#: Test motions, their seed, and frames over which the short error is taken.
TESTS, TEST_SEED, SHORT = 20, 1_000_003, 30


# The true systems, their pictures, and the angle in a picture.


@dataclass(frozen=True)
class Protocol:
    """A pendulum, θ″ = −k sin θ with θ from the bottom, and how it is filmed: at ``size`` pixels, every ``dt`` seconds. A frame
    of gym is one step of the semi-implicit Euler method. ``noise``, rad, is added to the angles of film and context."""

    name: str
    stiffness: float  # k, 1/s²
    inertia: float  # factor of the energy ½ θ̇² + k (1 − cos θ)
    dt: float
    size: int
    sequences: int
    frames: int
    context: int
    ahead: int
    noise: float = 0.0

    def motions(self, count: int, frames: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Angles and speeds ``(count, frames)`` from random starts: gym's, below π/6; or with the radius of (q, p) in [1.3, 2.3],
        p = m l² θ̇, m = 0.5, l = 1."""
        if self.name == "hnn":
            return self.motion(rng.uniform(-np.pi / 6, np.pi / 6, count), rng.uniform(-1.0, 1.0, count), frames)
        radius, phase = rng.uniform(1.3, 2.3, count), rng.uniform(0.0, 2.0 * np.pi, count)
        return self.motion(radius * np.cos(phase), radius * np.sin(phase) / 0.5, frames)

    def motion(self, q: Array, v: Array, frames: int) -> tuple[Array, Array]:
        """Angles and speeds ``(…, frames)``, by gym's step or by a symplectic one of fourth order (Yoshida 1990) at dt/20."""
        c, h = 1.0 / (2.0 - 2.0 ** (1.0 / 3.0)), self.dt / 20
        states = [(q, v)]
        for _ in range(frames - 1):
            if self.name == "hnn":
                v = np.clip(v - self.dt * self.stiffness * np.sin(q), -8.0, 8.0)
                q = q + self.dt * v
            else:
                for part in (c, 1.0 - 2.0 * c, c) * 20:
                    q = q + 0.5 * h * part * v
                    v = v - h * part * self.stiffness * np.sin(q)
                    q = q + 0.5 * h * part * v
            states.append((q, v))
        return np.stack([q for q, _ in states], -1), np.stack([v for _, v in states], -1)

    def energy(self, q: Array, v: Array) -> Array:
        return self.inertia * (0.5 * v**2 + self.stiffness * (1.0 - np.cos(q)))

    def energies(self, angles: Array) -> Array:
        """Energies at the inner frames of a motion, with speeds by central differences: of fourth order, or for the steps of gym
        of second order, which fits them."""
        d = wrapped(np.diff(angles)) / self.dt
        if self.name == "hnn":
            return self.energy(angles[1:-1], 0.5 * (d[1:] + d[:-1]))
        return self.energy(angles[2:-2], (7.0 * (d[1:-2] + d[2:-1]) - d[:-3] - d[3:]) / 12.0)

    def pictures(self, q: Array) -> Array:
        parts = [lg.pixels.drawn(part, self.size) for part in np.array_split(q.reshape(-1), 1 + q.size // 1000)]
        return np.concatenate(parts).reshape(*q.shape, self.size, self.size)

    def film(self, seed: int) -> Array:
        """The training film ``(s, t, h, w)`` of a seed."""
        rng = np.random.default_rng(seed)
        q, _ = self.motions(self.sequences, self.frames, rng)
        return self.pictures(q + self.noise * rng.normal(size=q.shape))


PROTOCOLS = {
    "pendulum": Protocol("pendulum", 3.0, 0.5, 0.125, 32, 500, 35, 5, 1000),
    "hgn": Protocol("hgn", 3.0, 0.5, 0.125, 32, 500, 30, 30, 30, noise=0.1),
    "hnn": Protocol("hnn", 15.0, 1.0 / 3.0, 0.05, 28, 200, 103, 5, 98),
}


def wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


class Reader:
    """Angles from pictures: the nearest of 2048 pictures, refined by a parabola through the errors of its neighbours."""

    def __init__(self, protocol: Protocol) -> None:
        self.step = 2.0 * np.pi / 2048
        self.grid = protocol.pictures(self.step * np.arange(2048)).reshape(2048, -1)
        self.squares = np.square(self.grid).sum(1)

    def __call__(self, frames: Array) -> tuple[Array, Array]:
        """Angles ``(m,)`` of frames ``(m, h, w)``, and the mean square errors of the nearest pictures."""
        flat = frames.reshape(len(frames), -1)
        nearest = (self.squares - 2.0 * flat @ self.grid.T).argmin(1)
        left, here, right = (np.square(self.grid[(nearest + k) % 2048].astype(np.float64) - flat).sum(1) for k in (-1, 0, 1))
        bend = np.maximum(left - 2.0 * here + right, 1e-12)
        return self.step * (nearest + np.clip(0.5 * (left - right) / bend, -0.5, 0.5)), here / flat.shape[1]


# Contestants that are no baselines.


def mean_frame(film: Array, dt: float, seed: int, seconds: float, **_: Any) -> Predictor:
    """The mean picture of the film, always."""
    return Predictor(lambda context, count, common: np.repeat(film.mean((0, 1))[None], len(context) + count, 0))


def oracle(film: Array, dt: float, seed: int, seconds: float, protocol: Protocol, **_: Any) -> Predictor:
    """The true physics, from the angle and the speed at the first frame by least squares over the angles of the context: the most
    likely start where the noise is that of angles. The window grows, from up to three speeds."""
    reader = Reader(protocol)

    def start(context: Array) -> Array:
        angles, fits = np.unwrap(reader(context)[0]), []
        slope = float(np.polyfit(np.arange(5), angles[:5], 2)[1]) / dt
        for change in (0.0, -1.0, 1.0) if protocol.noise else (0.0,):
            at = np.array([angles[0], slope + change])
            for used in sorted({min(n, len(angles)) for n in (5, 8, 12, 20, len(angles))}):
                left = partial(lambda x, n: wrapped(protocol.motion(x[0], x[1], n)[0] - angles[:n]), n=used)
                fitted = least_squares(left, at, xtol=1e-14, ftol=1e-14, gtol=1e-14)
                at = fitted.x
            fits.append((fitted.cost, *at))
        return np.array(min(fits)[1:])

    def angles(context: Array, count: int) -> Array:
        q, v = start(context)
        return protocol.motion(q, v, len(context) + count)[0]

    return Predictor(
        lambda context, count, common: protocol.pictures(angles(context, count)),
        energy=lambda context: float(protocol.energies(angles(context, 100)).mean()),
    )


def ours(film: Array, dt: float, seed: int, seconds: float, **_: Any) -> Predictor:
    """``lagrangian.pixels``: a curve through the pictures and a Lagrangian of the place on it, without a budget."""
    model = lg.pixels.fit(film, dt, seed=seed, progress=False)
    print(f"  lagrangian.pixels: {'; '.join(model.notes)}", flush=True)
    top, bottom, left, right = model.view.box

    def motion(context: Array, count: int, common: bool) -> Array:
        times = dt * np.arange(len(context) + count)
        settings: dict[str, Any] = {"method": "rk4", "step": dt} if common else {}
        q = model.dynamics.rollout(*model.state(context), times=times, **settings).q[:, 0]
        frames = np.repeat(film.mean((0, 1))[None], len(times), 0)
        # The view is a part of the picture, at its own scale for pictures of at most 32 pixels.
        frames[:, top:bottom, left:right] = model.decode(np.pad(q, (0, len(times) - len(q)), "edge"))
        return frames

    return Predictor(motion, "DOP853", lambda context: float(np.squeeze(model.energy(*model.state(context)))))


CONTESTANTS: dict[str, Callable[..., Predictor]] = {
    "mean-frame": mean_frame,
    "oracle": oracle,
    "ours": ours,
    "lnn": partial(on_circle, "lnn"),
    "plain": partial(on_circle, "plain"),
    "neural-ode": neural_ode,
    "gru": gru,
    "hnn": partial(pixel_hnn, "hnn"),
    "hnn-baseline": partial(pixel_hnn, "plain"),
    "hgn": hgn,
}


# Figures.

#: Errors over the frames given, and the columns of the table of each protocol.
GIVEN = ("MSE, given with noise", "MSE, given")
COLUMNS = {
    "pendulum": ("valid frames", "energy error", f"MSE, {SHORT} ahead", "corr(H, E)"),
    "hgn": (*GIVEN, f"MSE, {SHORT} ahead", "given / oracle", "ahead / oracle", "corr(H, E)"),
    "hnn": ("energy MSE", "median energy MSE", "valid frames", f"MSE, {SHORT} ahead", "corr(H, E)"),
}


def measure(protocol: Protocol, mean: Array, predictor: Predictor, common: bool) -> dict[str, Any]:
    """Figures of a model on the test motions. A prediction is valid until its error exceeds half that of the mean picture."""
    rng, k, reader = np.random.default_rng(TEST_SEED), protocol.context, Reader(protocol)
    angles, _ = protocol.motions(TESTS, k + protocol.ahead, rng)
    offsets = protocol.noise * rng.normal(size=(TESTS, k))
    relative, squares, energies, learned, truth = [], [], [], [], []
    for q, offset in zip(angles, offsets, strict=True):
        clean, context = protocol.pictures(q), protocol.pictures(q[:k] + offset)
        frames = np.nan_to_num(predictor.motion(context, protocol.ahead, common), posinf=1.0, neginf=0.0).clip(-1.0, 2.0)
        errors = np.square(frames - clean).mean((1, 2))
        still = float(np.square(mean - clean[k:]).mean())
        relative.append(errors[k:] / still)
        squares.append([np.square(frames[:k] - context).mean(), errors[:k].mean(), errors[k : k + SHORT].mean()])
        last = 24 if protocol.name == "pendulum" else protocol.ahead
        read, away = reader(frames[-last:])
        truth.append(protocol.energies(q).mean())
        off = protocol.energies(read) - truth[-1]
        end = abs(np.median(off)) / truth[-1] if np.median(away) < 0.5 * still else np.inf
        energies.append((end, np.square(off).mean()))
        learned.append(predictor.energy(context) if predictor.energy else 0.0)
    valid = [int(own.argmax()) if own.any() else protocol.ahead for own in np.stack(relative) > 0.5]
    correlation = abs(np.corrcoef(learned, truth)[0, 1]) if np.std(learned) > 0.0 else np.nan
    names = ("valid frames", "energy error", "median energy MSE", "energy MSE", *GIVEN, f"MSE, {SHORT} ahead", "corr(H, E)")
    values = (np.median(valid), *np.median(energies, 0), np.mean(energies, 0)[1], *np.mean(squares, 0), correlation)
    return {name: float(value) for name, value in zip(names, values, strict=True)} | {"errors": np.median(relative, 0).tolist()}


def compare(protocol: Protocol, names: list[str], seeds: int, seconds: float, full: bool) -> dict[str, list[dict[str, Any]]]:
    """Figures of each contestant and seed; a contestant that fails is reported and left out."""
    rows: dict[str, list[dict[str, Any]]] = {}
    for seed in range(seeds):
        film = protocol.film(seed)
        for name in names:
            try:
                begin, settings = time.process_time(), {"context": protocol.context, "protocol": protocol, "full": full}
                predictor = CONTESTANTS[name](film, protocol.dt, seed, seconds, **settings)
                spent = time.process_time() - begin
                for common in [False, True] if predictor.integrator not in ("", "RK4") else [False]:
                    figures = measure(protocol, film.mean((0, 1)), predictor, common) | {"CPU-s": spent}
                    label = f"{name}, RK4" if common else ", ".join(filter(None, (name, predictor.integrator)))
                    rows.setdefault(label, []).append(figures)
                    shown = ", ".join(f"{column} {number(figures[column])}" for column in figures if column != "errors")
                    print(f"  {protocol.name}, seed {seed}, {label}: {shown}", flush=True)
            except Exception as error:
                traceback.print_exc(limit=-3)
                print(f"  {protocol.name}, seed {seed}, {name} failed: {error}", flush=True)
    for runs in rows.values():
        for own, floor in zip(runs, rows.get("oracle", [])):
            own["given / oracle"] = own["MSE, given"] / floor["MSE, given"]
            own["ahead / oracle"] = own[f"MSE, {SHORT} ahead"] / floor[f"MSE, {SHORT} ahead"]
    return rows


def table(protocol: Protocol, rows: dict[str, list[dict[str, Any]]]) -> str:
    """Medians over seeds, and least … greatest."""
    columns = (*COLUMNS[protocol.name], "CPU-s")
    lines = ["| model, integrator | " + " | ".join(columns) + " |", "|---" * (len(columns) + 1) + "|"]
    for name, runs in rows.items():
        values = [[run.get(column, np.nan) for run in runs] for column in columns]
        lines.append(f"| {name} | " + " | ".join(map(cell, values)) + " |")
    return "\n".join(lines)


def cell(values: list[float]) -> str:
    middle = number(float(np.median(values)))
    return middle if len(values) == 1 else f"{middle} ({number(min(values))} … {number(max(values))})"


def number(value: float) -> str:
    return "–" if not np.isfinite(value) else f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def draw(rows: dict[str, list[dict[str, Any]]], path: str) -> None:
    """Errors over the frames ahead, in parts of those of the mean picture: means over 10 frames, medians over seeds."""
    from matplotlib import pyplot

    _, ax = pyplot.subplots(figsize=(8, 4.5))
    for name, runs in rows.items():
        smooth = np.stack([np.convolve(run["errors"], np.ones(10) / 10, "valid") for run in runs])
        [line] = ax.plot(np.median(smooth, 0), label=name)
        ax.fill_between(np.arange(smooth.shape[1]), smooth.min(0), smooth.max(0), color=line.get_color(), alpha=0.2)
    ax.axhline(0.5, color="grey", linewidth=0.5)
    ax.set(xlabel="frames ahead", ylabel="error, in parts of that of the mean picture", yscale="log", ylim=(1e-6, 5.0))
    ax.legend(fontsize=7)
    pyplot.tight_layout()
    pyplot.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--protocol", choices=[*PROTOCOLS, "all"], default="pendulum", help="what is filmed (pendulum)")
    parser.add_argument("--sequences", type=int, help="sequences of the training film (as the protocol says)")
    parser.add_argument("--seeds", type=int, default=3, help="number of seeds (3)")
    parser.add_argument("--seconds", type=float, default=120.0, help="CPU time of the training of each baseline, s (120)")
    parser.add_argument("--quick", action="store_true", help="one seed, at most 100 sequences and 15 s for each baseline")
    parser.add_argument("--full", action="store_true", help="Hamiltonian Generative Network at its published size, for a GPU")
    parser.add_argument("--only", default=",".join(CONTESTANTS), help="names, with commas: " + ", ".join(CONTESTANTS))
    parser.add_argument("--json", help="file of all figures")
    parser.add_argument("--picture", help="file of a picture of the errors over time, of the last protocol")
    given = parser.parse_args()
    names = given.only.split(",")
    if unknown := [name for name in names if name not in CONTESTANTS]:
        parser.error(f"no contestant {', '.join(unknown)}: give some of {', '.join(CONTESTANTS)}")
    if given.picture:
        import matplotlib  # noqa: F401 — where it is missing this fails before the fits, not after
    seeds, seconds = (1, min(given.seconds, 15.0)) if given.quick else (given.seeds, given.seconds)
    warnings.simplefilter("ignore", lg.errors.RolloutWarning)
    every: dict[str, Any] = {}
    for protocol in PROTOCOLS.values() if given.protocol == "all" else [PROTOCOLS[given.protocol]]:
        most = min(100, protocol.sequences) if given.quick else protocol.sequences
        protocol = replace(protocol, sequences=given.sequences or most)
        rows = every[protocol.name] = compare(protocol, names, seeds, seconds, given.full)
        print(f"\n{protocol.name}: {protocol.sequences} sequences of {protocol.frames} frames, seeds 0 … {seeds - 1}\n")
        print(table(protocol, rows), flush=True)
        if given.json:
            with open(given.json, "w", encoding="utf-8") as file:
                json.dump(every, file, indent=1)
    if given.picture:
        draw(rows, given.picture)


if __name__ == "__main__":
    main()
