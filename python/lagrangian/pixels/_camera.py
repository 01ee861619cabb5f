"""What the camera did: flicker and the shake of a hand are taken out, larger changes are refused."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import DataError
from ._film import Film, Frames, blurred

#: The width of the border by which the camera's movement is seen, in parts of the shorter side.
_BORDER = 0.15
#: Rounds in which the picture of what stands still is made anew, and steps of each: first on blurred pictures, then on sharp ones.
_ROUNDS, _STEPS = 2, 4
#: The correlation of the shifts seen above and to the left with those seen below and to the right above which the camera made them: what
#: moves before a fixed one shifts one of them, or each in its own sense.
_SHARED = 0.5
#: The deviation of a shake that is left as it is, pixels.
_LEAST = 0.03
#: Pictures by which a shake is recognised, and the number of pictures that are shifted at a time.
_SOME, _AT_ONCE = 80, 256
#: The ratio of what the border shows of shifts in the best and the worst direction above which it shows one alone.
_SEEN = 1e4


def judged(film: Film) -> Film:
    """The film without flicker and without the shake of its camera.

    Raises:
        DataError: The camera moves, or the light changes, by more than can be taken out.
    """
    film = _without_flicker(_held_still(film))
    _refuse_moving_camera(film)
    return film


def noise_variance(film: Film) -> NDArray[np.float64]:
    """The variance of the noise of each pixel, ``(h, w, c)``: what neighbours in time do not share."""
    parts = [np.square(np.diff(own, 2, axis=0)).sum(0, dtype=np.float64) for own in film.motions]
    count = sum(len(own) - 2 for own in film.motions)
    each = np.sum(parts, axis=0) / (6.0 * count)
    # Of a pixel that something passes quickly the differences are motion: noise is what quiet pixels have.
    floor: NDArray[np.float64] = np.minimum(each, 2.0 * np.median(each))
    return floor


def moving(film: Film) -> NDArray[np.float64]:
    """The variance of each pixel above that of its noise, ``(h, w, c)``."""
    count = len(film)
    mean = sum(own.sum(0, dtype=np.float64) for own in film.motions) / count
    variance = sum(np.square(own - mean).sum(0, dtype=np.float64) for own in film.motions) / count
    floor = noise_variance(film)
    return np.where(variance > 2.0 * floor, variance - floor, 0.0)


def _without_flicker(film: Film) -> Film:
    """Divides by the brightness of what does not move."""
    change = moving(film).sum(-1)
    quiet = change <= np.quantile(change, 0.5)
    light = [own[:, quiet].mean((1, 2), dtype=np.float64) for own in film.motions]
    every = np.concatenate(light)
    mean, noise = float(every.mean()), float(np.sqrt(noise_variance(film)[quiet].mean() / quiet.sum()))
    flicker = float(every.std())
    if mean < 0.02 or flicker < max(4.0 * noise, 0.004 * mean):
        return film
    if flicker > 0.3 * mean:
        raise DataError(f"the light changes by {flicker / mean:.0%}: film in steady light, with fixed exposure")
    motions = [(own * (mean / each)[:, None, None, None]).astype(np.float32) for own, each in zip(film.motions, light, strict=True)]
    return Film(motions, film.dt, [*film.notes, f"flicker of {flicker / mean:.1%} was divided out"], film.still)


def _held_still(film: Film) -> Film:
    """The film as a camera on a stand would have seen it, where the whole picture shakes."""
    every = max(1, len(film) // _SOME)
    some = np.concatenate([own[::every] for own in film.motions])[:_AT_ONCE]
    still, border = _still(some), _border(film.shape, _away(film.shape))
    for _ in range(_ROUNDS):
        shifts = _shifts(some, still, border)
        still = _still(shifted(some, shifts))
    height, width, _ = film.shape
    above = np.arange(height)[:, None] * width + np.arange(width) * height < height * width
    one, other = (own - own.mean(0) for own in (_shifts(some, still, border & half) for half in (above, ~above)))
    shared = (one * other).sum() / max(np.sqrt(np.square(one).sum() * np.square(other).sum()), 1e-300)
    shake = float(np.sqrt(np.square(shifts - np.median(shifts, 0)).sum(1).mean()))
    margin = int(np.ceil(np.abs(shifts).max())) + 1
    if shared > _SHARED and shake > _LEAST and margin < min(height, width) // 8:
        motions = [steadied(own, still) for own in film.motions]
        film = Film(motions, film.dt, [*film.notes, f"the camera shook by {shake:.2g} pixels: the film was steadied"], still)
    return film


def steadied(frames: Frames, still: Frames) -> Frames:
    """Pictures shifted to where the still picture is, which fills their margins."""
    by = _shifts(frames, still, _border(still.shape, _away(still.shape)))
    moved = shifted(frames, by)
    for axis in (1, 2):
        at = np.arange(frames.shape[axis]) + by[:, axis - 1, None]
        outside = (at < 0.0) | (at > frames.shape[axis] - 1)
        np.copyto(moved, still, where=np.expand_dims(outside, (3 - axis, 3)))
    return moved


def _still(frames: Frames) -> Frames:
    """The median of the pictures, in which nothing is that moves far."""
    own: Frames = np.median(frames, 0).astype(np.float32)
    return own


def _shifts(frames: Frames, still: Frames, border: NDArray[np.bool_]) -> NDArray[np.float64]:
    """The shifts ``(m, 2)`` down and to the right, pixels, at which pictures are nearest to the still one on its border: least squares
    in the slopes of the still picture (Lucas, Kanade 1981), with weights that leave out what moves before it."""
    shifts = np.zeros((len(frames), 2))
    grey = still.mean(-1, keepdims=True)
    for first in range(0, len(frames), _AT_ONCE):
        own = slice(first, first + _AT_ONCE)
        sharp = frames[own].mean(-1, keepdims=True)
        for pictures, reference in ((blurred(sharp), blurred(grey[None])[0]), (sharp, grey)):
            # The third is the light, whose change is none of the camera's.
            axes = [*np.gradient(reference, axis=(0, 1)), reference]
            slopes = np.stack([own[border].ravel() for own in axes], 1).astype(np.float64)
            normal = slopes.T @ slopes
            if not np.linalg.cond(normal[:2, :2]) < _SEEN:
                continue
            for _ in range(_STEPS):
                left = (shifted(pictures, shifts[own]) - reference)[:, border].reshape(len(pictures), -1).astype(np.float64)
                scale = 4.0 * np.median(np.abs(left), 1, keepdims=True) + 1e-6
                weights = np.square(np.clip(1.0 - np.square(left / scale), 0.0, None))
                weighted = np.einsum("mp,pi,pj->mij", weights, slopes, slopes, optimize=True) + 1e-3 * normal + 1e-9 * np.trace(normal) * np.eye(3)
                step = np.linalg.solve(weighted, ((weights * left) @ slopes)[..., None])[:, :2, 0]
                shifts[own] -= np.clip(step, -2.0, 2.0)
    return shifts


def shifted(frames: Frames, by: NDArray[np.float64]) -> Frames:
    """Pictures ``(m, h, w, c)`` seen ``(m, 2)`` pixels farther down and to the right, by cubic convolution (Keys 1981)."""
    moved = np.empty(frames.shape, np.float32)
    for first in range(0, len(frames), _AT_ONCE):
        own = frames[first : first + _AT_ONCE]
        for axis in (1, 2):
            own = _along(own, by[first : first + _AT_ONCE, axis - 1], axis)
        moved[first : first + _AT_ONCE] = own
    return moved


def _along(frames: Frames, by: NDArray[np.float64], axis: int) -> Frames:
    whole = np.floor(by).astype(int)
    t = by - whole
    weights = np.stack([-0.5 * t + t**2 - 0.5 * t**3, 1 - 2.5 * t**2 + 1.5 * t**3, 0.5 * t + 2 * t**2 - 1.5 * t**3, 0.5 * (t**3 - t**2)])
    at = np.arange(frames.shape[axis])
    shape = [len(frames), 1, 1, 1]
    moved = np.zeros(frames.shape, np.float32)
    for tap, weight in enumerate(weights):
        index = np.clip(at + whole[:, None] + tap - 1, 0, len(at) - 1)
        taken = np.take_along_axis(frames, index.reshape([*shape[:axis], len(at), *shape[axis + 1 :]]), axis)
        moved += weight.astype(np.float32).reshape(shape) * taken
    return moved


def _away(shape: tuple[int, ...]) -> int:
    """The pixels at the very border that a shift brings in."""
    return max(1, round(0.04 * min(shape[:2])))


def _border(shape: tuple[int, ...], margin: int, part: float = _BORDER) -> NDArray[np.bool_]:
    """The pixels along the border, without the outermost ``margin``."""
    height, width = shape[:2]
    edge = max(1, round(part * min(height, width))) + margin
    border = np.zeros((height, width), bool)
    border[margin : height - margin, margin : width - margin] = True
    border[edge : height - edge, edge : width - edge] = False
    return border


def _refuse_moving_camera(film: Film) -> None:
    ring = _border(film.shape, 0, 0.08)
    change = moving(film).sum(-1)
    changes = float(np.mean(change[ring] > 0.01 * change.max()))
    if changes > 0.6:
        raise DataError(
            f"the picture changes along {changes:.0%} of its border: the camera moves, or the motion leaves the picture; "
            "fix the camera, film from farther away, or steady the film first"
        )
