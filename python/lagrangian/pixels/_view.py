"""The part of the pictures that the model sees."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import DataError, InvalidInput
from ._camera import moving, steadied
from ._film import Film, Frames, arrays, scaled


@dataclass
class View:
    """The part of a picture that moves, and the size at which it is seen.

    Attributes:
        box: Top, bottom, left and right of the part, pixels.
        whole: Height, width and colours of the pictures.
        height, width: Its size after scaling, pixels.
        still: What stands still in the pictures of a camera that shook, ``(height, width, colours)``.
    """

    box: tuple[int, int, int, int]
    whole: tuple[int, ...]
    height: int
    width: int
    still: Frames | None = field(default=None, compare=False, repr=False)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Height, width and colours of what is seen."""
        return (self.height, self.width, self.whole[2])

    def of(self, frames: Frames) -> Frames:
        """What is seen of pictures ``(m, h, w, c)``: of whole ones, or of such as are seen already."""
        if frames.shape[1:] != self.whole:
            if frames.shape[1:] == self.shape:
                return frames
            raise InvalidInput(f"the pictures have the shape {frames.shape[1:]}: give {self.whole} as in the film, or {self.shape}")
        return self.cut(frames if self.still is None else steadied(frames, self.still))

    def cut(self, frames: Frames) -> Frames:
        """What is seen of whole pictures of a steady camera."""
        top, bottom, left, right = self.box
        return scaled(frames[:, top:bottom, left:right], self.height, self.width)


def viewed(film: Film, size: int) -> View:
    """The part of the pictures in which nearly all motion is."""
    excess = moving(film).sum(-1)
    if not excess.max() > 1e-8:
        raise DataError("nothing moves in the film: is it the right one, and does the camera see the motion?")
    box: list[int] = []
    for axis in (1, 0):
        share = np.cumsum(excess.sum(axis)) / excess.sum()
        first, last = (int(np.searchsorted(share, part)) for part in (0.002, 0.998))
        margin = max(2, round(0.08 * (last - first)))
        box += [max(0, first - margin), min(len(share), last + 1 + margin)]
    top, bottom, left, right = box
    if (bottom - top) * (right - left) > 0.8 * excess.size:
        top, bottom, left, right = 0, excess.shape[0], 0, excess.shape[1]
    high, wide = bottom - top, right - left
    scale = size / max(high, wide)
    sides = [max(4, min(own, round(own * min(scale, 1.0)))) for own in (high, wide)]
    return View((top, bottom, left, right), film.shape, sides[0], sides[1], film.still)


def preview(film: Film, view: View) -> Frames:
    """Three pictures of a film with a line round what is seen, and beside each what the model sees: ``(h, w, 3)``, from 0 to 1."""
    high, wide, _ = film.shape
    top, bottom, left, right = view.box
    longest = max(film.motions, key=len)
    rows = []
    for own in longest[[len(longest) // 6, len(longest) // 2, len(longest) - 1]]:
        seen, scale = view.cut(own[None])[0], max(1, 256 // max(high, wide))
        whole = np.broadcast_to(own, (high, wide, 3)).repeat(scale, 0).repeat(scale, 1).copy()
        edges = np.zeros((high * scale, wide * scale), bool)
        edges[top * scale : bottom * scale, left * scale : right * scale] = True
        edges[top * scale + 2 : bottom * scale - 2, left * scale + 2 : right * scale - 2] = False
        whole[edges] = (1.0, 0.55, 0.0)
        part = max(1, min(whole.shape[0] // view.height, whole.shape[1] // view.width))
        large = np.broadcast_to(seen, (view.height, view.width, 3)).repeat(part, 0).repeat(part, 1)
        beside = np.ones((whole.shape[0], 8 + large.shape[1], 3), np.float32)
        beside[: large.shape[0], 8:] = large
        rows += [np.concatenate([whole, beside], 1), np.ones((8, whole.shape[1] + beside.shape[1], 3), np.float32)]
    shown: Frames = np.concatenate(rows[:-1])
    return shown


def write_png(picture: Frames, path: Path) -> None:
    """Writes a picture ``(h, w, 3)`` from 0 to 1 as PNG."""

    def chunk(kind: bytes, held: bytes) -> bytes:
        return struct.pack(">I", len(held)) + kind + held + struct.pack(">I", zlib.crc32(kind + held))

    values = np.round(255.0 * np.clip(picture, 0.0, 1.0)).astype(np.uint8)
    lines = b"".join(b"\0" + row.tobytes() for row in values)
    header = struct.pack(">IIBBBBB", values.shape[1], values.shape[0], 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b""))


def sequences(frames: Any, view: View, name: str) -> tuple[list[Frames], bool]:
    """What is seen of pictures of one motion, or of several; and whether they were several."""
    colours = view.whole[2]
    flat = frames if isinstance(frames, (list, tuple)) else np.asarray(frames)
    motions = arrays(flat, name)
    several = len(motions) > 1 or isinstance(flat, np.ndarray) and flat.ndim == (4 if colours == 1 else 5) and flat.shape[-1] != 1
    return [view.of(own) for own in motions], several
