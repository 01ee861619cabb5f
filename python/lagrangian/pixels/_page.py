"""The page of a model of pictures."""

from __future__ import annotations

import json
from base64 import b64encode
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _lagrangian
from .._report import Report
from ..errors import InvalidInput
from ._curve import Array
from ._film import Frames

if TYPE_CHECKING:
    from ._model import PixelModel

#: Pictures of the film, and of the long prediction whose energy is drawn.
_SHOWN, _LONG = 240, 1000
#: Cells of the map of energy.
_CELLS = 80


def page(model: PixelModel, path: Path) -> Report:
    """Writes the page."""
    if not model.held:
        raise InvalidInput("the model holds no pictures to predict: a page is made after fit, of a film long enough to hold some back")
    html = _lagrangian.page(json.dumps(_content(model), allow_nan=False))
    path.write_text(html, encoding="utf-8")
    return Report(path, html)


def _content(model: PixelModel) -> dict[str, Any]:
    seen = max(model.held, key=len)
    context = min(5, len(seen) - 1)
    count = min(_SHOWN, len(seen) - context)
    predicted = model.predict(seen[:context], count)
    long = model.rollout(seen[:context], _LONG)
    energy = np.asarray(model.energy(long.q, long.qd)).reshape(-1)
    motion = model.rollout(seen[:context], count).q[:, 0]
    depth = float(np.ptp(np.asarray(model.energy(*_at_rest(model)))))
    drift = float(np.ptp(energy)) / max(depth, 1e-300)
    valid = f"{model.score.valid:.0f}"
    return {
        "title": "Mechanics from pictures",
        "subtitle": f"{len(model.trajectories)} {'motion' if len(model.trajectories) == 1 else 'motions'}, a picture every {model.dt:.3g} s",
        "answer": f"From five pictures, {valid} of {model.score.longest} are predicted before the error is half that of the mean picture.",
        "headlines": [
            {"label": "Pictures predicted", "value": valid, "note": f"of {model.score.longest}, median of held-out motions", "role": "lnn"},
            {"label": f"Change of energy over {_LONG} pictures", "value": f"{100 * drift:.2g}", "unit": "%", "note": "of the potential's range"},
        ],
        "summary": [f"{note[0].upper()}{note[1:]}." for note in model.notes],
        "animations": [_film(model, seen[context : context + count], predicted)],
        "figures": [_errors(model), *_physics(model), _track(model, seen, motion), _energies(model, energy)],
        "maps": [_phases(model)],
        "commands": [{"makes": "The model in C", "line": "lagrangian export model.safetensors --format c --out model.c"}],
    }


def _film(model: PixelModel, truth: Frames, predicted: Frames) -> dict[str, Any]:
    def text(pictures: Frames) -> str:
        return b64encode(np.round(255.0 * np.clip(pictures, 0.0, 1.0)).astype(np.uint8).tobytes()).decode()

    height, width, colours = model.view.shape
    kept = colours if colours == 3 else 1
    films = [own.reshape(len(truth), height, width, colours)[..., :kept] for own in (truth, predicted)]
    shown = {
        "shape": [height, width, kept],
        "step": model.dt,
        "names": ["film", "prediction"],
        "pictures": [text(own) for own in films],
        "difference": "difference",
    }
    caption = "Held-out pictures, those predicted from the five before, and their difference, grey where they agree."
    return {"id": "film", "title": "What comes next", "caption": caption, "film": shown}


def _axis(label: str, unit: str = "", log: bool = False, span: tuple[float, float] | None = None) -> dict[str, Any]:
    return {"label": label, "unit": unit, "scale": "log" if log else "linear", "range": span}


def _series(name: str, role: Any, x: Array, y: Array) -> dict[str, Any]:
    numbers = [[float(value) if np.isfinite(value) else None for value in own] for own in (x, y)]
    return {"name": name, "role": role, "kind": "line", "x": numbers[0], "y": numbers[1]}


def _unit(model: PixelModel) -> str:
    return "rad" if model.curve.closed else ""


def _errors(model: PixelModel) -> dict[str, Any]:
    error = np.maximum(model.score.error, 1e-5)
    time = model.dt * np.arange(1, len(error) + 1)
    return {
        "id": "errors",
        "title": "Error of predicted pictures",
        "caption": "Mean square error after five pictures, in parts of that of the mean picture; median of held-out motions.",
        "x": _axis("time ahead", "s"),
        "y": _axis("error", log=True),
        "series": [_series("this model", "lnn", time, error), _series("mean picture", "baseline", time, np.ones_like(time))],
    }


def _visited(model: PixelModel) -> tuple[float, float]:
    every = np.concatenate([own.q[:, 0] for own in model.trajectories])
    if model.curve.closed:
        every = np.angle(np.exp(1j * every))
    return float(every.min()), float(every.max())


def _at_rest(model: PixelModel) -> tuple[Array, Array]:
    """Places from end to end of what was seen, without speed."""
    q = np.linspace(*_visited(model), 240)[:, None]
    return q, np.zeros_like(q)


def _physics(model: PixelModel) -> list[dict[str, Any]]:
    places, rest = _at_rest(model)
    q, potential = places[:, 0], np.asarray(model.energy(places, rest)).reshape(-1)
    inertia = np.asarray(model.dynamics.mass_matrix(places)).reshape(-1)
    potential = (potential - potential.min()) / float(np.median(inertia))
    x = _axis("q", _unit(model))
    return [
        {
            "id": "potential",
            "title": "Potential",
            "caption": "V(q) over the inertia, which pictures do not show: of a pendulum it is (g / l) (1 − cos q).",
            "x": x,
            "y": _axis("V / M"),
            "series": [_series("V / M", "lnn", q, potential)],
        },
        {
            "id": "inertia",
            "title": "Inertia",
            "caption": "M(q) over its median: the coordinate is chosen so that it is constant.",
            "x": x,
            "y": _axis("M"),
            "series": [_series("M", "lnn", q, inertia / float(np.median(inertia)))],
        },
    ]


def _track(model: PixelModel, seen: Frames, motion: Array) -> dict[str, Any]:
    found = model._places(seen[: len(motion)])[1]
    time = model.dt * np.arange(len(motion))
    return {
        "id": "coordinate",
        "title": "Coordinate",
        "caption": "The coordinate read from each held-out picture, and its motion from the first five.",
        "x": _axis("time", "s"),
        "y": _axis("q", _unit(model)),
        "series": [_series("read", "truth", time[: len(found)], found), _series("predicted", "lnn", time, motion)],
    }


def _energies(model: PixelModel, energy: Array) -> dict[str, Any]:
    time = model.dt * np.arange(len(energy))
    return {
        "id": "energy",
        "title": f"Energy over {_LONG} pictures",
        "caption": "H over its start along a long prediction.",
        "x": _axis("time", "s"),
        "y": _axis("H / H(0)"),
        "series": [_series("H", "lnn", time, energy / (energy[0] if energy[0] != 0.0 else 1.0))],
    }


def _phases(model: PixelModel) -> dict[str, Any]:
    low, high = _visited(model)
    speeds = np.concatenate([np.gradient(own.q[:, 0], model.dt) for own in model.trajectories if len(own.q) > 2])
    fastest = float(np.quantile(np.abs(speeds), 0.99))
    q, qd = np.meshgrid(np.linspace(low, high, _CELLS), np.linspace(-fastest, fastest, _CELLS))
    energy = np.asarray(model.energy(q.reshape(-1, 1), qd.reshape(-1, 1))).reshape(_CELLS, _CELLS)
    shown = energy - np.median(energy)
    return {
        "id": "phases",
        "title": "Energy of each state",
        "caption": "H less its median: motions follow lines of one colour.",
        "x": _axis("q", _unit(model), span=(low, high)),
        "y": _axis("velocity", f"{_unit(model) or '1'}/s", span=(-fastest, fastest)),
        "columns": _CELLS,
        "values": shown.reshape(-1).tolist(),
        "limit": float(np.abs(shown).max()),
    }
