"""``lagrangian fit`` of films: the command of the package."""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Sequence
from pathlib import Path
from zipfile import BadZipFile, ZipFile

from ..errors import LagrangianError, LagrangianWarning
from ._film import FILMS, PICTURES
from ._fit import PREVIEW, fit

#: Exit codes, those of the program: a model that must not be used, wrong arguments, and Ctrl-C before there is one.
_POOR, _WRONG, _INTERRUPTED = 1, 2, 130


def takes(arguments: Sequence[str]) -> bool:
    """Whether arguments ask for the fit of a film: ``fit`` with a film among its files."""
    return len(arguments) > 1 and arguments[0] == "fit" and any(_is_film(Path(own)) for own in arguments[1:] if not own.startswith("-"))


def _is_film(path: Path) -> bool:
    try:
        if path.is_dir():
            inner = list(path.iterdir())
            inner += [own for folder in inner[:3] if folder.is_dir() for own in folder.iterdir()]
            return any(own.suffix.lower() in PICTURES for own in inner)
        if path.suffix.lower() == ".npz":
            with ZipFile(path) as held:
                return "frames.npy" in held.namelist()
    except (OSError, ValueError, BadZipFile):
        return False
    return path.suffix.lower() in (".npy", *FILMS)


def main(arguments: Sequence[str]) -> int:
    """Runs ``lagrangian fit FILM``, and returns the exit code."""
    given = _parser().parse_args(arguments[1:])
    folder = Path(given.out)
    if (folder / "model.safetensors").exists() and not given.force:
        return _fail(f"{folder} holds a model", "give another --out, or --force to replace it")
    said: list[str] = []
    began = time.time() - 1.0
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", LagrangianWarning)
            films = given.films[0] if len(given.films) == 1 else given.films
            model = fit(
                films,
                given.dt,
                coordinate=given.coordinate,
                size=given.size,
                friction=not given.no_friction,
                steps=given.steps,
                seed=given.seed,
                progress=False if given.quiet else None,
                run=folder,
            )
            said = [str(own.message) for own in caught]
        page = folder / "report.html"
        if model.held:
            model.report(page)
    except (LagrangianError, OSError) as error:
        shown = folder / PREVIEW
        return _fail(str(error), f"{shown} shows what was seen of the pictures" if shown.exists() and shown.stat().st_mtime >= began else "")
    except KeyboardInterrupt:
        print("interrupted before there was a model", file=sys.stderr)
        return _INTERRUPTED
    score = model.score
    verdict = score.verdict
    notes = [*model.notes, *said]
    if given.json:
        found = {"verdict": verdict, "valid": score.valid, "of": score.longest, "notes": notes, "folder": str(folder)}
        print(json.dumps({name: None if value != value else value for name, value in found.items()}, ensure_ascii=False))
        return _POOR if verdict == "poor" else 0
    for note in notes:
        print(f"note: {note}")
    print(f"model: {folder / 'model.safetensors'}, with {folder / 'pictures.npz'}")
    print(f"seen:  {folder / PREVIEW}")
    print(f"verdict: {verdict}")
    if model.held:
        print(f"  from five pictures, {score.valid:.0f} of {score.longest} are predicted before the error is half that of the mean picture")
        print(f"page:  {page}")
    else:
        print("  the film is too short to hold pictures back: film longer to know how far predictions hold")
    return _POOR if verdict == "poor" else 0


def _fail(what: str, hint: str = "") -> int:
    print(f"error: {what}", file=sys.stderr)
    if hint:
        print(f"hint: {hint}", file=sys.stderr)
    return _WRONG


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="lagrangian fit",
        allow_abbrev=False,
        description="Learn the mechanics of one thing that swings, turns or slides from pictures of it",
    )
    parser.add_argument("films", nargs="+", metavar="FILMS", help=f"{', '.join(FILMS)}, NPZ with the array 'frames', or folders of pictures")
    parser.add_argument("--dt", type=float, help="time between two pictures, s; of GIF and MP4 it is read from the file")
    parser.add_argument("--coordinate", choices=("auto", "circle", "line"), default="auto", help="what turns all round is a circle [auto]")
    parser.add_argument("--size", type=int, default=32, help="longest side of the pictures that the model sees, pixels [32]")
    parser.add_argument("--no-friction", action="store_true", help="look for no friction")
    parser.add_argument("--steps", type=int, help="steps of a fit of the Lagrangian [400]")
    parser.add_argument("--seed", type=int, default=0, help="seed of what is random [0]")
    parser.add_argument("--out", default="runs/latest", metavar="DIR", help="folder of the run [runs/latest]")
    parser.add_argument("--force", action="store_true", help="replace the model in that folder")
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    parser.add_argument("--json", action="store_true", help="print exactly one JSON object on standard output")
    return parser
