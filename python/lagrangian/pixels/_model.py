"""A model of what a film shows: pictures to places on a curve, their motion by a Lagrangian, and places to pictures."""

from __future__ import annotations

import io
import os
import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .._model import Model, load as load_model
from .._trajectory import Trajectories, Trajectory, _whole
from ..errors import InvalidInput, ModelError, RolloutWarning
from ._curve import Array, Components, Curve, continuous
from ._film import Frames
from ._view import View, sequences

if TYPE_CHECKING:
    from .._report import Report

#: Pictures from which held-out motions are predicted, how many at most are, and the least number of a later part.
_CONTEXT, _AHEAD, _LEAST = 5, 1000, 40
#: The file beside the model.
_FILE = "pictures.npz"
_FORMAT = 1


@dataclass
class Score:
    """How well held-out pictures are predicted from the five before.

    Attributes:
        valid: The median number of pictures until the error exceeds half that of the mean picture; of motions that end before, their
            length.
        longest: The number of pictures that could be compared, median over the motions.
        error: The mean square error of predicted pictures, in parts of that of the mean picture, at each picture ahead; the noise of
            the pictures counts in neither.
    """

    valid: float = float("nan")
    longest: int = 0
    error: Array = field(default_factory=lambda: np.empty(0))

    @property
    def verdict(self) -> str:
        """``good`` where half of the pictures are predicted, ``poor`` below a fifth, else ``fair``, as where none could be compared."""
        part = self.valid / self.longest if self.longest else 0.3
        return "good" if part >= 0.5 else "fair" if part >= 0.2 else "poor"

    def worse(self, other: Score) -> bool:
        """Whether predictions err by more than half more than others, and by more than a hundredth of the mean picture's error."""
        mine, its = (float(np.mean(np.minimum(own.error, 1.0))) if len(own.error) else 0.0 for own in (self, other))
        return mine > 1.5 * its + 0.01


class PixelModel:
    """What a film shows as mechanics, made by ``fit`` or ``load``.

    Attributes:
        dynamics: The ``Model`` of the coordinate, which every command and export takes.
        curve: The curve of the pictures, which is encoder and decoder.
        view: Which part of the pictures is seen.
        dt: The time between two pictures, s.
        trajectories: The coordinate of the film's motions; empty for a model that was loaded.
        held: Pictures that were held back.
        score: How well they are predicted.
        notes: What was found and done.
    """

    def __init__(self, dynamics: Model, curve: Curve, components: Components, view: View, dt: float) -> None:
        self.dynamics = dynamics
        self.curve = curve
        self.components = components
        self.view = view
        self.dt = dt
        self.trajectories = Trajectories(())
        self.held: list[Frames] = []
        self.score = Score()
        self.notes: list[str] = []

    def encode(self, frames: Any) -> Array:
        """The coordinate in pictures of a motion, ``(m, 1)``; angles unwrapped, in radians. Of several motions one array with one axis
        more.

        Args:
            frames: Pictures as those of the film, or as they are seen (``view.shape``).
        """
        motions, several = sequences(frames, self.view, "frames")
        found = [self._places(own)[1][:, None] for own in motions]
        return np.stack(found) if several else found[0]

    def decode(self, q: Any) -> Frames:
        """Pictures at places ``(m,)`` or ``(m, 1)``: ``(m, h, w)``, or ``(m, h, w, 3)`` in colour, from 0 to 1."""
        places = np.asarray(q, np.float64).reshape(-1)
        flat = np.clip(self.components.pictures(self.curve.at(places)), 0.0, 1.0)
        pictures: Frames = flat.reshape(len(places), *self.view.shape)
        return pictures[..., 0] if self.view.shape[2] == 1 else pictures

    def state(self, frames: Any) -> tuple[Array, Array]:
        """The coordinate and its speed in the first of some pictures of one motion, shape ``(1,)`` each: those whose motion is nearest
        to all the pictures."""
        motions, several = sequences(frames, self.view, "frames")
        if several:
            raise InvalidInput("frames hold several motions: give the pictures of one")
        if len(motions[0]) < 3:
            raise InvalidInput(f"frames holds {len(motions[0])} pictures: give at least 3, which show the speed")
        return self._state(motions[0])

    def rollout(self, frames: Any, count: int, **settings: Any) -> Trajectory:
        """The motion of the coordinate from the first of some pictures on, over ``count`` steps of the film.

        Args:
            frames: Three pictures of one motion or more, one after the other.
            count: The number of pictures after the first.
            settings: Those of ``Model.rollout``, such as ``method``.
        """
        start = self.state(frames)
        times = self.dt * np.arange(_whole(count, "count") + 1)
        return self.dynamics.rollout(*start, times=times, **settings)

    def predict(self, frames: Any, count: int) -> Frames:
        """The ``count`` pictures after those of ``frames``: ``(count, h, w)``, or ``(count, h, w, 3)`` in colour, from 0 to 1, as they
        are seen (``view``). Where a motion diverges, with a ``RolloutWarning``, its last picture stays."""
        motions, several = sequences(frames, self.view, "frames")
        count = _whole(count, "count")
        if count < 1:
            raise InvalidInput(f"count is {count}: give the number of pictures, 1 or more")
        if min(len(own) for own in motions) < 3:
            raise InvalidInput(f"frames holds {len(motions[0])} pictures: give at least 3, which show the speed")
        found = [self._predicted(own, count) for own in motions]
        return np.stack(found) if several else found[0]

    def energy(self, q: Any, qd: Any) -> Array:
        """The energy at states, up to a factor: pictures show no masses."""
        return self.dynamics.energy(q, qd)

    # Its parts.

    def _places(self, seen: Frames) -> tuple[Array, Array]:
        components = self.components.project(seen.reshape(len(seen), -1))
        return components, continuous(self.curve, components, self.curve.place(components))

    def _predicted(self, seen: Frames, count: int) -> Frames:
        q0, qd0 = self._state(seen)
        times = self.dt * np.concatenate([[0.0], len(seen) + np.arange(count)])
        q = self.dynamics.rollout(q0, qd0, times=times).q[1:, 0]
        if len(q) < count:
            q = np.concatenate([q, np.full(count - len(q), q[-1] if len(q) else q0[0])])
        return self.decode(q)

    def _state(self, seen: Frames) -> tuple[Array, Array]:
        """The start whose motion is nearest to the places in the pictures: least squares through the dynamics, over more and more of
        them, from the slopes of several polynomials."""
        _, q = self._places(seen)
        m = len(q)
        starts = []
        for used, degree in ((5, 2), (9, 3), (17, 4), (33, 5)):
            used = min(used, m)
            line = np.polynomial.Polynomial.fit(np.arange(used), q[:used], min(degree, used - 1))
            starts.append(np.array([line(0.0), line.deriv()(0.0) / self.dt]))
            if used == m:
                break
        best, least = starts[0], np.inf
        for start in starts:
            used = min(5, m)
            while True:
                start, error = self._nearest(start, q[:used])
                if used == m:
                    break
                used = min(m, round(1.6 * used))
            if error < least:
                best, least = start, error
        return best[:1], best[1:]

    def _nearest(self, start: Array, q: Array) -> tuple[Array, float]:
        """The start near another whose motion is nearest to places, and the mean square of their distance."""
        times = self.dt * np.arange(len(q))

        def left(at: Array) -> Array:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RolloutWarning)
                moved = self.dynamics.rollout(at[:1], at[1:], times=times, method="dopri5", rtol=1e-8, atol=1e-8).q[:, 0]
            return np.concatenate([moved - q[: len(moved)], np.full(len(q) - len(moved), 10.0)])

        now, damping = left(start), 1e-6
        for _ in range(8):
            widths = np.array([1e-5, 1e-5 / self.dt])
            slopes = np.stack([(left(start + width * unit) - now) / width for width, unit in zip(widths, np.eye(2))], 1)
            normal = slopes.T @ slopes
            step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)) + 1e-12 * np.eye(2), slopes.T @ now)
            after = left(start + step)
            if not after @ after < now @ now:
                damping = max(1e-3, 10.0 * damping)
                if damping > 1e3:
                    break
                continue
            settled = after @ after > (1.0 - 1e-6) * (now @ now)
            start, now, damping = start + step, after, 0.1 * damping
            if settled:
                break
        return start, float(now @ now) / len(now)

    # Files.

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes ``model.safetensors``, the model of the coordinate that every command takes, and beside it ``pictures.npz``."""
        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        self.dynamics.save(path / "model.safetensors")
        held: dict[str, Any] = {
            "format": _FORMAT,
            "kind": self.curve.kind,
            "coefficients": self.curve.coefficients,
            "mean": self.components.mean,
            "basis": self.components.basis,
            "box": self.view.box,
            "whole": self.view.whole,
            "seen": self.view.shape,
            "dt": self.dt,
            "valid": self.score.valid,
            "longest": self.score.longest,
            "error": self.score.error,
            "notes": np.array(self.notes, np.str_),
        }
        if self.view.still is not None:
            held["still"] = self.view.still
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **held)
        part = path / (_FILE + ".part")
        part.write_bytes(buffer.getvalue())
        part.replace(path / _FILE)

    def report(self, path: str | os.PathLike[str]) -> Report:
        """Writes the page of the model: the film that it predicts beside the true one, errors, potential and phase portrait."""
        from ._page import page

        return page(self, Path(path))

    def __repr__(self) -> str:
        kind = "angle" if self.curve.closed else "place on a line"
        return f"PixelModel({kind}, {self.view.height} × {self.view.width} pixels, {self.score.valid:g} valid pictures)"


def load(folder: str | os.PathLike[str]) -> PixelModel:
    """A model from its folder.

    Raises:
        ModelError: The folder holds no model of pictures, or a damaged one.
    """
    path = Path(folder)
    dynamics = load_model(path / "model.safetensors")
    try:
        with np.load(path / _FILE, allow_pickle=False) as file:
            held = {name: file[name] for name in file.files}
        if int(held["format"]) > _FORMAT:
            raise ModelError(f"{path / _FILE} is of a later version: update the package")
        height, width = held["seen"].tolist()[:2]
        view = View(tuple(held["box"].tolist()), tuple(held["whole"].tolist()), height, width, held.get("still"))
        curve = Curve(str(held["kind"]), held["coefficients"])
        model = PixelModel(dynamics, curve, Components(held["mean"], held["basis"]), view, float(held["dt"]))
        model.score = Score(float(held["valid"]), int(held["longest"]), held["error"])
        model.notes = held["notes"].tolist()
        shapes = (held["mean"].shape, held["basis"].shape[0], held["coefficients"].shape[1])
    except ModelError:
        raise
    except FileNotFoundError as error:
        raise ModelError(f"{path} holds no {_FILE}: give the folder that a fit of a film has written") from error
    except Exception as error:
        raise ModelError(f"{path / _FILE} is damaged ({error}): write the model again") from error
    pixels = int(np.prod(view.shape))
    if shapes != ((pixels,), pixels, held["basis"].shape[1]) or held.get("still", np.empty(view.whole)).shape != view.whole or dynamics.n != 1 or curve.kind not in ("circle", "line"):
        raise ModelError(f"{path} holds parts of different models: write the model again")
    return model


def scored(model: PixelModel, held: list[Frames]) -> Score:
    """Predictions of held-out motions from five pictures: the first ones, and of long motions later ones too."""
    errors = []
    for own in held:
        if len(own) < _CONTEXT + 5:
            continue
        _, places = model._places(own)
        left = np.square(own.reshape(len(own), -1) - model.components.pictures(model.curve.at(places))).mean(1, dtype=np.float64)
        noise = float(np.median(left))
        plain = float(np.square(own.reshape(len(own), -1) - model.components.mean).mean(dtype=np.float64))
        for first in range(0, max(1, len(own) - _LEAST), max(_LEAST, len(own) // 8)):
            seen, truth = own[first : first + _CONTEXT], own[first + _CONTEXT :][:_AHEAD]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", RolloutWarning)
                predicted = model._predicted(seen, len(truth))
            error = np.square(predicted.reshape(len(truth), -1) - truth.reshape(len(truth), -1)).mean(1, dtype=np.float64)
            errors.append(np.maximum(error - noise, 0.0) / max(plain - noise, 1e-300))
    if not errors:
        return Score()
    valid = [int(np.argmax(own > 0.5)) if (own > 0.5).any() else len(own) for own in errors]
    padded: NDArray[np.float64] = np.full((len(errors), max(len(own) for own in errors)), np.nan)
    for row, own in zip(padded, errors):
        row[: len(own)] = own
    return Score(float(np.median(valid)), int(np.median([len(own) for own in errors])), np.nanmedian(padded, 0))
