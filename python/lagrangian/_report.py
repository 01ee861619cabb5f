"""Pages that a notebook shows: of a run, of motions."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from . import _lagrangian
from ._trajectory import _real

if TYPE_CHECKING:
    from ._trajectory import Trajectory

__all__ = ["Animation", "Report", "report"]


def _frame(page: str, height: str) -> str:
    from html import escape

    own = escape(page, quote=True)
    return f'<iframe srcdoc="{own}" style="width:100%;height:{height};border:0" sandbox="allow-scripts"></iframe>'


class Animation:
    """Motions that move side by side; a notebook shows them.

    Attributes:
        html: The page.
    """

    def __init__(self, motions: Sequence[Trajectory], links: str, lengths: Sequence[float] | None) -> None:
        own = None if lengths is None else [_real(length, "lengths") for length in lengths]
        self.html = _lagrangian.animation(list(motions), links, own)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the page, which needs no network."""
        Path(path).write_text(self.html, encoding="utf-8")

    def _repr_html_(self) -> str:
        return _frame(self.html, "32em")

    def __repr__(self) -> str:
        return f"Animation({len(self.html)} bytes of HTML)"


class Report:
    """The page of a run; a notebook shows it.

    Attributes:
        path: The file of the page, to open in a browser.
        html: The page.
    """

    def __init__(self, path: Path, page: str) -> None:
        self.path = path
        self.html = page

    def _repr_html_(self) -> str:
        return _frame(self.html, "80vh")

    def __fspath__(self) -> str:
        return str(self.path)

    def __repr__(self) -> str:
        return f"Report({str(self.path)!r})"


def report(run: str | os.PathLike[str]) -> Report:
    """The page of a run: what the model is worth, a motion that it predicts, the bands of its ensemble, and how it came about.

    Args:
        run: The folder of the run, of a fit with ``run=`` or of the command.

    Raises:
        InvalidInput: The folder holds no run, or one that has not ended.

    >>> import tempfile, lagrangian as lg
    >>> folder = tempfile.mkdtemp() + "/run"
    >>> swings = lg.simulate("pendulum", trajectories=10, duration=4.0, seed=1)
    >>> _ = lg.Lnn(steps=60, width=16).fit(swings, run=folder)
    >>> lg.report(folder).path.name
    'report.html'
    """
    path, page = _lagrangian.report(Path(run))
    return Report(Path(path), page)
