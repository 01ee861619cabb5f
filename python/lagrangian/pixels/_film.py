"""Films: pictures of motions, read from what users have, and scaled."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._trajectory import _real
from ..errors import DataError, InvalidInput, InvalidType, MissingExtra

Frames = NDArray[np.floating[Any]]

#: The longest side of a picture that is kept, pixels: larger ones are reduced as they are read.
_LARGEST = 192
#: The least number of pictures of a film, and of one of its motions.
_FEWEST, _SHORTEST = 40, 5
#: The largest number of values of a film in memory.
_MOST = 400_000_000
_MOVIES = (".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v")
FILMS = (".gif", *_MOVIES)
PICTURES = (".png", ".jpg", ".jpeg", ".bmp")


@dataclass
class Film:
    """Pictures of one motion or several.

    Attributes:
        motions: The pictures of each motion, shape ``(m, height, width, colours)``, from 0 (dark) to 1.
        dt: The time between two pictures, s.
        notes: What was done to the pictures.
        still: What stands still in the pictures of a camera that shook, ``(height, width, colours)``.
    """

    motions: list[Frames]
    dt: float
    notes: list[str] = field(default_factory=list)
    still: Frames | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Height, width and colours of a picture."""
        return self.motions[0].shape[1:]

    def __len__(self) -> int:
        return sum(len(own) for own in self.motions)


def read(video: Any, dt: float | None = None) -> Film:
    """A film from arrays, files or folders.

    Args:
        video: An array of pictures ``(m, h, w)`` or ``(m, h, w, colours)``, of motions of equal length with one axis more, or a
            list of arrays; or a path: NPZ or NPY (the array ``frames``, and ``dt``), a folder of PNG or JPEG files in the order of
            their names (or of such folders, one for each motion), GIF, and MP4 where PyAV is installed; or a list of paths.
        dt: The time between two pictures, s; of a GIF or MP4 it is read from the file.

    Raises:
        InvalidInput, DataError: What the video is lacks something, in words.
    """
    motions, own = _motions(video)
    step = dt if dt is not None else own
    if step is None:
        raise InvalidInput("dt is not given: give the time between two pictures in seconds, such as dt=1/30")
    step = _real(step, "dt")
    if not 0.0 < step < 1e6:
        raise InvalidInput(f"dt is {step}: give the time between two pictures in seconds, above 0")
    shapes = sorted({own.shape[1:] for own in motions})
    if len(shapes) > 1:
        raise InvalidInput(f"the motions have pictures of different sizes {shapes}: give pictures of one camera, of one size")
    film = Film(motions, step)
    short = min(len(own) for own in motions)
    if short < _SHORTEST or len(film) < _FEWEST:
        count = f"{len(film)} pictures, {short} of the shortest motion"
        raise DataError(f"too few pictures ({count}): film at least {_FEWEST}, better some hundred, and {_SHORTEST} of each motion")
    return film


def arrays(frames: Any, name: str) -> list[Frames]:
    """Arrays of pictures as motions ``(m, h, w, colours)``, from 0 to 1."""
    if isinstance(frames, (list, tuple)) and frames and np.ndim(frames[0]) >= 3:
        return [own for each in frames for own in arrays(each, name)]
    try:
        given = np.asarray(frames)
    except ValueError as error:
        raise InvalidInput(f"{name} is no array ({error}): give pictures of one size") from error
    if given.dtype.kind not in "uifb":
        raise InvalidType(f"{name} has values of the type {given.dtype}: give numbers, 0 to 255 or 0 to 1")
    if given.ndim < 3 or 0 in given.shape:
        raise InvalidInput(f"{name} has shape {given.shape}: give pictures (m, height, width) or (m, height, width, colours)")
    if given.ndim == 3 or given.ndim == 4 and given.shape[-1] > 4:
        given = given[..., None]
    if given.ndim == 4:
        given = given[None]
    if given.ndim != 5 or given.shape[-1] not in (1, 2, 3, 4) or min(given.shape[2:4]) < 4:
        raise InvalidInput(
            f"{name} has shape {np.shape(frames)}: give pictures (m, height, width) of at least 4 by 4 pixels, with 1, 3 or 4 colours"
        )
    if given.size > _MOST:
        raise InvalidInput(f"{name} holds {given.size:.1e} values: give at most {_MOST:.0e}, of smaller or fewer pictures")
    return [_reduced(_between_0_and_1(own, name)) for own in given[..., : {2: 1, 4: 3}.get(given.shape[-1])]]


def _between_0_and_1(given: NDArray[Any], name: str) -> Frames:
    if not np.isfinite(given).all():
        raise DataError(f"{name} holds NaN or infinity: leave these pictures out")
    low, high = float(given.min()), float(given.max())
    if given.dtype.kind in "ui" or high > 2.0:
        if low < 0.0 or high > 255.0:
            raise InvalidInput(f"{name} has values from {low:g} to {high:g}: give 0 to 255, or 0 to 1")
        given = given.astype(np.float32) / np.float32(255.0)
    own: Frames = given.astype(np.float32)
    return own


def averaged(length: int, size: int) -> NDArray[np.float32]:
    """Weights ``(size, length)`` of the mean of pixels over each of ``size`` parts."""
    edges = np.linspace(0.0, length, size + 1)
    at = np.arange(length)
    within = np.minimum(edges[1:, None], at + 1.0) - np.maximum(edges[:-1, None], at)
    weights = np.clip(within, 0.0, None)
    own: NDArray[np.float32] = (weights / weights.sum(1, keepdims=True)).astype(np.float32)
    return own


def scaled(frames: Frames, height: int, width: int) -> Frames:
    """Pictures ``(m, h, w, c)`` at another size, by means over their areas."""
    return _mixed(frames, averaged(frames.shape[1], height), averaged(frames.shape[2], width))


def _mixed(frames: Frames, rows: NDArray[np.float32], columns: NDArray[np.float32]) -> Frames:
    """Pictures whose rows and columns are mixed by weights."""
    own: Frames = np.einsum("yh,mhwc,xw->myxc", rows, frames, columns, optimize=True).astype(np.float32)
    return own


def blurred(frames: Frames) -> Frames:
    """Pictures ``(m, h, w, c)`` blurred by a sixteenth of their longer side: what moves then changes them over a longer way."""
    sigma = max(frames.shape[1:3]) / 16.0

    def weights(length: int) -> NDArray[np.float32]:
        at = np.arange(length)
        own = np.exp(-0.5 * np.square((at[:, None] - at) / sigma))
        soft: NDArray[np.float32] = (own / own.sum(1, keepdims=True)).astype(np.float32)
        return soft

    return _mixed(frames, weights(frames.shape[1]), weights(frames.shape[2]))


def _reduced(frames: Frames) -> Frames:
    longest = max(frames.shape[1:3])
    if longest <= _LARGEST:
        return frames
    size = [max(4, round(side * _LARGEST / longest)) for side in frames.shape[1:3]]
    return scaled(frames, size[0], size[1])


def _motions(video: Any) -> tuple[list[Frames], float | None]:
    if isinstance(video, Film):
        return video.motions, video.dt
    if isinstance(video, (str, os.PathLike)):
        return _of_path(Path(video))
    if isinstance(video, (list, tuple)) and video and all(isinstance(own, (str, os.PathLike)) for own in video):
        parts = [_of_path(Path(own)) for own in video]
        rates = {own for _, own in parts if own is not None}
        if len(rates) > 1 and max(rates) > 1.01 * min(rates):
            raise InvalidInput(f"the files have different times between pictures, {sorted(rates)} s: fit each on its own")
        return [motion for motions, _ in parts for motion in motions], next(iter(rates), None)
    return arrays(video, "video"), None


def _of_path(path: Path) -> tuple[list[Frames], float | None]:
    if not path.exists():
        raise InvalidInput(f"there is no file or folder {path}")
    if path.is_dir():
        return _of_folder(path), None
    kind = path.suffix.lower()
    readers: dict[str, Callable[[Path], tuple[list[Frames], float | None]]] = {".npz": _of_numpy, ".npy": _of_numpy, ".gif": _of_gif}
    readers.update({own: _of_movie for own in _MOVIES})
    if kind not in readers:
        raise InvalidInput(f"{path} is no video that can be read: give {', '.join(readers)} or a folder of pictures")
    try:
        return readers[kind](path)
    except (InvalidInput, DataError, InvalidType, MissingExtra):
        raise
    except Exception as error:
        raise DataError(f"{path} cannot be read ({error}): is it whole, and of the kind that its name says?") from error


def _of_numpy(path: Path) -> tuple[list[Frames], float | None]:
    with path.open("rb") as file:
        held = np.load(file, allow_pickle=False)
        if isinstance(held, np.ndarray):
            return arrays(held, str(path)), None
        names = [name for name in held.files if held[name].ndim >= 3]
        name = "frames" if "frames" in names else names[0] if len(names) == 1 else None
        if name is None:
            raise InvalidInput(f"{path} holds the arrays {', '.join(held.files)}: name that of the pictures 'frames'")
        dt = float(held["dt"]) if "dt" in held.files and held["dt"].ndim == 0 else None
        return arrays(held[name], str(path)), dt


def natural(path: Path) -> list[Any]:
    """A key that sorts names with numbers as a person would."""
    return [int(own) if own.isdigit() else own.lower() for own in re.split(r"(\d+)", path.name)]


def _of_folder(path: Path) -> list[Frames]:
    pictures = sorted((own for own in path.iterdir() if own.suffix.lower() in PICTURES), key=natural)
    if not pictures:
        folders = sorted((own for own in path.iterdir() if own.is_dir()), key=natural)
        motions = [motion for own in folders for motion in _of_folder(own)]
        if not motions:
            raise InvalidInput(f"the folder {path} holds no PNG or JPEG files, and no folders of them")
        return motions
    image = _pillow(path)

    def opened() -> Iterator[NDArray[Any]]:
        for own in pictures:
            try:
                with image.open(own) as picture:
                    yield np.asarray(_plain(picture))
            except OSError as error:
                raise DataError(f"{own} cannot be read ({error}): leave it out") from error

    return [_gathered(opened(), path)]


def _plain(picture: Any) -> Any:
    return picture if picture.mode in ("L", "RGB") else picture.convert("L" if picture.mode in ("1", "LA", "I;16", "I", "F") else "RGB")


def _gathered(pictures: Iterator[NDArray[Any]], path: Path) -> Frames:
    """The pictures of one motion, reduced one by one."""
    found: list[Frames] = []
    for own in pictures:
        [reduced] = arrays(own[None], str(path))
        if found and reduced.shape[1:] != found[0].shape[1:]:
            raise InvalidInput(f"the pictures of {path} have different sizes: give those of one camera")
        found.append(reduced)
        if len(found) * reduced.size > _MOST:
            raise InvalidInput(f"{path} holds more than {_MOST:.0e} values: cut it, or give smaller pictures")
    return np.concatenate(found)


def _pillow(path: Path) -> Any:
    try:
        from PIL import Image
    except ImportError as error:
        raise MissingExtra(f"Pillow reads {path}: pip install 'lagrangian[pixels]', or give an NPZ file") from error
    return Image


def _of_gif(path: Path) -> tuple[list[Frames], float | None]:
    times: list[float] = []
    with _pillow(path).open(path) as picture:

        def frames() -> Iterator[NDArray[Any]]:
            for k in range(getattr(picture, "n_frames", 1)):
                picture.seek(k)
                times.append(picture.info.get("duration", 0.0) / 1000.0)
                yield np.asarray(picture.convert("RGB"))

        motion = _gathered(frames(), path)
    lasting = times[1:-1] or times
    even = max(lasting) <= 1.01 * min(lasting) and min(lasting) > 0.0
    return [motion], float(np.median(lasting)) if even else None


def _of_movie(path: Path) -> tuple[list[Frames], float | None]:
    try:
        import av
    except ImportError as error:
        raise MissingExtra(f"PyAV reads {path}: pip install av, or give a folder of its pictures (ffmpeg -i {path.name} p%04d.png)") from error
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        rate = stream.average_rate
        motion = _gathered((own.to_ndarray(format="rgb24") for own in file.decode(stream)), path)
    return [motion], 1.0 / float(rate) if rate else None
