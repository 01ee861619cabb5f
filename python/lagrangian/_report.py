"""The page of a run, shown in a notebook."""

from __future__ import annotations

import html
import os
from pathlib import Path

from . import _lagrangian

__all__ = ["Report", "report"]


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
        page = html.escape(self.html, quote=True)
        style = "width:100%;height:80vh;border:0"
        return f'<iframe srcdoc="{page}" style="{style}" sandbox="allow-scripts"></iframe>'

    def __fspath__(self) -> str:
        return str(self.path)

    def __repr__(self) -> str:
        return f"Report({str(self.path)!r})"


def report(run: str | os.PathLike[str]) -> Report:
    """The page of a run: what the model is worth, a motion that it predicts, and how it came about.

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
