"""A model of what a film shows: the curve of its pictures, and the Lagrangian of the place on it."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._estimators import _Watch
from .._families import Delan
from .._model import Model
from .._trajectory import Trajectories, Trajectory, _whole
from ..errors import DataError, FitInterrupted, FitWarning, InvalidInput
from ._camera import judged
from ._curve import Array, Components, Curve, continuous, curve, embedding, first_places, jumps, smoothed, through
from ._film import Frames, blurred, read
from ._model import PixelModel, Score, scored
from ._view import preview, viewed, write_png

#: The file of a run that shows what the model sees.
PREVIEW = "preview.png"
#: Steps of a fit of the Lagrangian.
_STEPS = 400
#: Units of a hidden layer: the Lagrangian of one coordinate is a simple function.
_WIDTH = 16
#: Pictures through which a curve is laid.
_OF_CURVE = 4000
#: The least number of different pictures.
_DIFFERENT = 18
#: How often a curve is laid anew through places that are smoothed in time, and how much less the next picture must err each time.
_SMOOTHED, _SMOOTHER = 6, 0.95
#: The part of the motions, or of the last one, that is held back to measure predictions.
_HELD = 0.2
#: Second differences over first ones, mean squares, above which a motion cannot be followed from picture to picture: 1 is a swing of six.
_FAST = 1.0
#: The change from picture to picture, in parts of that between any two, below which pictures change little by little.
_GRADUAL = 0.4
#: The deviation of energies, in parts of the largest, below which a film shows one amplitude.
_ONE_AMPLITUDE = 0.03
#: The part of its energy that a motion loses from its first third to its last above which the film shows friction.
_LOST = 0.05
#: The part of the motion in the pictures that one coordinate must explain.
_EXPLAINED = 0.8


def fit(
    video: Any,
    dt: float | None = None,
    *,
    coordinate: str = "auto",
    size: int = 32,
    friction: bool = True,
    steps: int | None = None,
    seed: int = 0,
    progress: bool | None = None,
    run: str | os.PathLike[str] | None = None,
) -> PixelModel:
    """Learns the mechanics of one thing that swings, turns or slides from pictures of it.

    Args:
        video: What ``read`` takes: arrays of pictures, or a path to NPZ, GIF, MP4 or a folder of pictures.
        dt: The time between two pictures, s.
        coordinate: ``circle`` for what can turn all round, ``line`` for what cannot; ``auto`` takes that which predicts the next
            picture better.
        size: The longest side of the pictures that the model sees, pixels.
        friction: Whether friction is looked for; where the film shows none the model keeps its energy.
        steps: Steps of the fit of the Lagrangian, 400 by default. The same seed and steps give the same bits.
        seed: Seed of what is random.
        progress: Whether to show a bar; by default where the output is a terminal or a notebook.
        run: A folder to save the model to; ``preview.png`` in it shows from the start what of the pictures is seen.

    Returns:
        The model. Ctrl-C ends the fit and keeps the best until then, with a ``FitInterrupted`` warning.

    Raises:
        InvalidInput: An argument is wrong.
        DataError: The film shows no motion of one coordinate: the message says what it shows.

    >>> import lagrangian as lg, numpy as np
    >>> swings = [lg.system("pendulum").rollout([a], [0.0], duration=2.0, step=0.05).q[:, 0] for a in np.linspace(0.5, 2.5, 8)]
    >>> model = lg.pixels.fit([lg.pixels.drawn(q) for q in swings], dt=0.05, coordinate="circle", steps=100)
    >>> model.predict(lg.pixels.drawn(swings[0])[:5], 20).shape
    (20, 32, 32)
    """
    if coordinate not in ("auto", "circle", "line"):
        raise InvalidInput(f"coordinate is {coordinate!r}: give 'auto', 'circle' or 'line'")
    size, seed = _whole(size, "size"), _whole(seed, "seed")
    if not 8 <= size <= 128:
        raise InvalidInput(f"size is {size}: give 8 to 128 pixels")
    film = judged(read(video, dt))
    view = viewed(film, size)
    if run is not None:
        Path(run).mkdir(parents=True, exist_ok=True)
        write_png(preview(film, view), Path(run) / PREVIEW)
    watch = _Watch(progress, (), "pixels")
    with watch:
        watch.tell({"stage": "the curve of the pictures is sought", "share": 0.0})
        seen = [view.cut(own) for own in film.motions]
        trained, held = _split(seen, seed)
        components, motions = _components(trained, seed)
        best, places = _curve(trained, motions, coordinate, seed)
        watch.tell({"stage": "the curve of the pictures is found", "share": 1.0})
    _check(best, motions, places)
    how = _How(_STEPS if steps is None else _whole(steps, "steps"), seed, progress)

    def tried(own: Curve, places: list[Array], friction: bool) -> tuple[PixelModel, bool]:
        dynamics, ended = _learned(_trajectories(own, places, film.dt), how, friction)
        model = PixelModel(dynamics, own, components, view, film.dt)
        model.score = scored(model, held or seen)
        return model, ended

    model, ended = tried(best, places, friction)
    if not ended:
        even, evened = _even(model.dynamics, best, motions, places)
        other, ended = tried(even, evened, friction)
        # Where the first fit could not tell the inertia, its coordinate stays.
        if not other.score.worse(model.score):
            model, best, places = other, even, evened
    if friction and not ended:
        other, ended = tried(best, places, False)
        if not other.score.worse(model.score) and _lost(other, _trajectories(best, places, film.dt)) < _LOST:
            model = other
    if ended:
        warnings.warn("the fit was interrupted: the best model until then is kept", FitInterrupted, stacklevel=2)
    model.trajectories, model.held = _trajectories(best, places, film.dt), held
    if not held:
        model.score = Score()  # what was learned from does not tell
    model.notes = [*film.notes, *_notes(model)]
    if model.score.verdict == "poor":
        message = f"the model is poor: it predicts {model.score.valid:.0f} of {model.score.longest} pictures; film longer, or with more pictures a second"
        warnings.warn(message, FitWarning, stacklevel=2)
    if run is not None:
        model.save(run)
    return model


class _How(NamedTuple):
    """How a Lagrangian is fitted."""

    steps: int
    seed: int
    progress: bool | None


def _split(seen: list[Frames], seed: int) -> tuple[list[Frames], list[Frames]]:
    """Motions to learn from, and to measure predictions on: whole ones of several, else the end of the only one."""
    if len(seen) >= 5:
        order = np.random.default_rng(seed).permutation(len(seen))
        held = set(order[: min(20, max(1, round(_HELD * len(seen))))].tolist())
        return [own for k, own in enumerate(seen) if k not in held], [seen[k] for k in sorted(held)]
    longest = max(range(len(seen)), key=lambda k: len(seen[k]))
    cut = len(seen[longest]) - round(_HELD * len(seen[longest]))
    if cut < 20 or len(seen[longest]) - cut < 10:
        return seen, []
    train = [own[:cut] if k == longest else own for k, own in enumerate(seen)]
    return train, [seen[longest][cut:]]


def _components(trained: list[Frames], seed: int) -> tuple[Components, list[Array]]:
    flat = [own.reshape(len(own), -1) for own in trained]
    components = Components.of(np.concatenate(flat), np.random.default_rng(seed))
    return components, [components.project(own) for own in flat]


def _curve(trained: list[Frames], motions: list[Array], coordinate: str, seed: int) -> tuple[Curve, list[Array]]:
    """The curve of the wanted kind, or that which predicts the next picture better, and the places of all pictures."""
    rng = np.random.default_rng(seed)
    every = np.concatenate(motions)
    held = (np.arange(len(every)) // 4) % 5 == 2
    train, others = (rng.permutation(np.flatnonzero(own))[:_OF_CURVE] for own in (~held, held))
    # The order of the pictures is that of blurred ones, in which what moves changes more pixels; places are those of sharp ones.
    soft = blurred(np.concatenate(trained)[train]).reshape(len(train), -1)
    softened = Components.of(soft, rng).project(soft)
    if len(np.unique(softened, axis=0)) < _DIFFERENT:
        raise DataError("the pictures are nearly all the same: film a motion that is seen, in different places")
    functions = embedding(softened, rng)
    curves = []
    for kind in ("line", "circle") if coordinate == "auto" else (coordinate,):
        _, places = curve(kind, softened, softened, first_places(kind, functions))
        curves.append(curve(kind, every[train], every[others], places)[0])
    found = [_in_time(own, motions) for own in curves]
    # What cannot turn round is a line: the circle must predict better.
    best, found_places, _ = found[-1 if found[-1][2] < 0.9 * found[0][2] else 0]
    return best, found_places


def _in_time(own: Curve, motions: list[Array]) -> tuple[Curve, list[Array], float]:
    """The curve with places that change smoothly in time, as noise and pictures that look alike may have disturbed their order; the
    places, and the error of the next picture."""
    every = np.concatenate(motions)
    ends = np.cumsum([len(q) for q in motions])[:-1]

    def placed(own: Curve) -> tuple[Curve, list[Array], float]:
        places = [continuous(own, part, q) for part, q in zip(motions, np.split(own.place(every), ends), strict=True)]
        return own, places, _ahead(own, motions, places)

    best = placed(own)
    for _ in range(_SMOOTHED):
        q = np.concatenate([smoothed(own) for own in best[1]])
        if own.kind == "line":
            q = 2.0 * (q - q.min()) / max(np.ptp(q), 1e-300) - 1.0
        other = placed(through(own.kind, q, every, own.order))
        if not other[2] < _SMOOTHER * best[2]:
            break
        best = other
    return best


def _ahead(own: Curve, motions: list[Array], places: list[Array]) -> float:
    """The square error of pictures that are predicted from the two before at constant speed."""
    following = np.concatenate([components[2:] for components in motions])
    expected = np.concatenate([2.0 * q[1:-1] - q[:-2] for q in places])
    return float(np.square(own.at(expected) - following).sum())


def _check(own: Curve, motions: list[Array], places: list[Array]) -> None:
    """Refuses what one coordinate does not explain, or does not follow in time."""
    several = "several things move, or one in two directions; cut the film to one of them, or hold the others still"
    if jumps(places) > _FAST:
        change = sum(float(np.square(np.diff(own, axis=0)).sum()) for own in motions)
        spread = sum(float(np.square(own).sum()) for own in motions)
        if change < _GRADUAL * 2.0 * spread:
            raise DataError(f"the pictures change little by little, yet not along one curve: {several}")
        raise DataError(
            "the motion cannot be followed from picture to picture: film with more pictures a second and a shorter exposure, "
            "or less noise and more light"
        )
    shared, total = 0.0, 0.0
    ends = np.cumsum([len(q) for q in places])[:-1]
    for components, shown in zip(motions, np.split(own.at(np.concatenate(places)), ends), strict=True):
        left = components - shown
        # Noise is new in each picture; what the curve lacks stays from one to the next.
        shared += float((left[1:] * left[:-1]).sum())
        total += float((components[1:] * components[:-1]).sum())
    explained = 1.0 - max(shared, 0.0) / max(total, 1e-300)
    if explained < _EXPLAINED:
        raise DataError(f"one coordinate explains {explained:.0%} of the change of the pictures: {several}")


def _trajectories(own: Curve, places: list[Array], dt: float) -> Trajectories:
    angles = "all" if own.closed else ()
    return Trajectories(Trajectory(dt * np.arange(len(q)), q, angles=angles, name=f"motion {k + 1}") for k, q in enumerate(places))


def _learned(latents: Trajectories, how: _How, friction: bool) -> tuple[Model, bool]:
    """The model of motions along the curve, and whether its fit was interrupted."""
    estimator = Delan(width=_WIDTH, steps=how.steps, seed=how.seed, forces=("viscous", "coulomb") if friction else None)
    estimator._refine = True
    with warnings.catch_warnings():
        # The verdict is that of the pictures.
        warnings.simplefilter("ignore", FitWarning)
        fitted = estimator.fit(latents, progress=how.progress)
    return fitted.model_, fitted.summary_["ending"] == "interrupted"


def _even(fitted: Model, own: Curve, motions: list[Array], places: list[Array]) -> tuple[Curve, list[Array]]:
    """The curve and the places by the coordinate in which the inertia is constant: ∫ √M dq."""
    grid = own.grid
    inertia = np.asarray(fitted.mass_matrix(grid[:, None])).reshape(-1)
    every = np.concatenate(places)
    if own.closed:
        every = np.angle(np.exp(1j * every))
    visited = np.histogram(every, grid)[0] > 0
    seen = np.concatenate([visited[:1], visited[1:] | visited[:-1], visited[-1:]])
    typical = float(np.median(inertia[seen]))
    root = np.sqrt(np.clip(inertia, 0.05 * typical, 20.0 * typical))
    if not seen.all():
        root = np.interp(grid, grid[seen], root[seen], period=2.0 * np.pi if own.closed else None)
    along = np.concatenate([[0.0], np.cumsum(0.5 * (root[1:] + root[:-1]) * np.diff(grid))])
    along = grid[0] + (grid[-1] - grid[0]) * along / along[-1]
    moved = []
    for q in places:
        turns = 2.0 * np.pi * np.round((q - np.angle(np.exp(1j * q))) / (2.0 * np.pi)) if own.closed else 0.0
        moved.append(np.interp(q - turns, grid, along) + turns)
    return through(own.kind, np.concatenate(moved), np.concatenate(motions), own.order), moved


def _notes(model: PixelModel) -> list[str]:
    loses = any(own["name"].startswith("viscous") for own in model.dynamics.parameters)
    top, bottom, left, right = model.view.box
    notes = [
        f"rows {top} … {bottom} and columns {left} … {right} of the pictures are seen, at {model.view.height} × {model.view.width} pixels",
        "the coordinate is an angle" if model.curve.closed else "the coordinate lies on a line, from −1 to 1 where the film shows it",
        "the motion loses energy: friction is learned" if loses else "the motion keeps its energy",
    ]
    if not loses and _energies_spread(model) < _ONE_AMPLITUDE:
        notes.append("the film shows one amplitude: inertia and potential cannot be told apart; start it with different swings")
    return notes


def _energies(model: PixelModel, motions: Trajectories) -> list[Array]:
    """The energy along each motion, above the least potential."""
    along, least = [], np.inf
    for own in motions:
        speed = np.gradient(own.q[:, 0], model.dt)[:, None]
        along.append(np.asarray(model.energy(own.q, speed)).reshape(-1))
        least = min(least, float(np.min(np.asarray(model.energy(own.q, np.zeros_like(speed))))))
    return [own - least for own in along]


def _energies_spread(model: PixelModel) -> float:
    """The deviation of the energies of the motions, in parts of the largest."""
    levels = [float(np.median(own)) for own in _energies(model, model.trajectories)]
    return float(np.std(levels)) / max(*levels, 1e-300)


def _lost(model: PixelModel, motions: Trajectories) -> float:
    """The part of its energy that a motion loses from its first third to its last, median over the motions."""
    thirds = [(own[: len(own) // 3].mean(), own[-(len(own) // 3) :].mean()) for own in _energies(model, motions) if len(own) >= 3]
    return float(np.median([1.0 - last / max(first, 1e-300) for first, last in thirds])) if thirds else 0.0
