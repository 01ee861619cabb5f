"""Mechanics from pictures: a film of a thing that swings, turns or slides becomes a coordinate, a Lagrangian and future pictures.

Three lines from a film to a model::

    import lagrangian as lg

    model = lg.pixels.fit("clip.gif")
    pictures = model.predict(model.held[0][:5], 300)

Arrays and NPZ files need no more than the package; ``pip install 'lagrangian[pixels]'`` reads GIF and folders of pictures too, and
with PyAV (``pip install av``) MP4.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._film import Film, read
from ._fit import fit
from ._model import PixelModel, Score, load
from ._view import View

__all__ = ["Film", "PixelModel", "Score", "View", "drawn", "fit", "load", "read"]


def drawn(q: ArrayLike, size: int = 32) -> NDArray[np.float32]:
    """Pictures ``(…, size, size)`` of the bob of a pendulum at angles, rad, from the bottom: a film to try.

    >>> drawn([0.0, 1.0]).shape
    (2, 32, 32)
    """
    angles = np.asarray(q, np.float64)[..., None, None]
    at = (np.arange(size) + 0.5) / size * 2.0 - 1.0
    x, y = np.meshgrid(at, -at)
    distance = np.hypot(x - 0.62 * np.sin(angles), y + 0.62 * np.cos(angles))
    pictures: NDArray[np.float32] = (1.0 / (1.0 + np.exp(np.clip((distance - 0.2) / 0.05, -50.0, 50.0)))).astype(np.float32)
    return pictures
