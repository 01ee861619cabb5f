"""The estimators of the families of models, made from the tables of settings of the library."""

from __future__ import annotations

import inspect
import json
from collections.abc import Mapping
from typing import Any

from . import _lagrangian
from ._estimators import Estimator

#: What every fit has beside the settings of its family, of the training and of the rollout loss.
COMMON: dict[str, tuple[Any, str]] = {
    "steps": (None, "The number of steps; the same seed then gives the same bits."),
    "seconds": (None, "The number of seconds, 60 by default."),
    "seed": (0, "Seed of weights, split and batches."),
    "validate_fraction": (0.2, "Part of the data that is held back for validation, where no other is given."),
    "smooth": (False, "Smooth measured q and q̇ over windows that are chosen from the data."),
    "low_pass": (None, "Cut-off of a low-pass of motion and forces, Hz; 0 for none. Found from the data by default."),
    "baseline": (1, "Distance of neighbours of a loss of positions, in samples."),
    "delay": ((), "Delays of the forces, s: one for all coordinates, or one for each."),
    "cyclic": (
        (),
        "Names of cyclic coordinates, on which no network may depend; ``find`` for those that the data show, ``none`` for none. By default"
        " they are found where several models are tried.",
    ),
    "nominal": (None, "URDF of a nominal model, whose omissions a network learns."),
    "joints": ((), "Joints of the robot in the order of the data."),
}

TABLES: dict[str, Any] = {
    "families": json.loads(_lagrangian.families()),
    **json.loads(_lagrangian.training_settings()),
}

#: The classes of the families by their names.
CLASSES = {
    "lnn": "Lnn",
    "delan": "Delan",
    "vin": "Vin",
    "hnn": "Hnn",
    "mlp": "Mlp",
    "neural-ode": "NeuralOde",
    "rigid": "Rigid",
    "chain": "Chain",
    "servo": "Servo",
    "formula": "Formula",
    "cartesian": "Cartesian",
    "lattice": "Lattice",
}


def _describe(setting: Mapping[str, Any]) -> str:
    text = setting["help"] + "."
    values = setting["values"]
    if setting["kind"] in ("choice", "choices"):
        names = ", ".join(f"``{name}``" for name, _ in values)
        text += f" {'Some' if setting['kind'] == 'choices' else 'One'} of {names}."
    elif setting["kind"] == "document":
        names = ", ".join(f"``{name}``" for name, _ in values)
        text += f" One of {names}, or a document."
    elif setting["kind"] == "integer":
        text += f" A whole number from {values[0]}."
    elif setting["kind"] in ("number", "numbers"):
        text += f" {'Numbers' if setting['kind'] == 'numbers' else 'A number'} {values}."
    if setting["default"]:
        text += f" Default: {setting['default']}."
    return text


def _make(name: str, family: Mapping[str, Any]) -> type[Estimator]:
    own = family["settings"]
    settings = [s for s in own if s["kind"] != "robot"]
    takes_robot = len(settings) < len(own)
    # A family has some settings of the training as well; each is given once.
    tables = (settings, TABLES["training"], TABLES["rollout"])
    defaults: dict[str, Any] = {}
    docs = []
    for table in tables:
        for setting in table:
            defaults[setting["name"]] = None
            docs.append(f"    {setting['name']}: {_describe(setting)}")
    common = dict(COMMON)
    if takes_robot:
        common["urdf"] = (None, "URDF of the robot: a file, its text, or the name of an example.")
    for key, (default, text) in common.items():
        defaults[key] = default
        docs.append(f"    {key}: {text}")
    body = {
        "family": family["name"],
        "_tables": tuple(frozenset(s["name"] for s in table) for table in tables),
        "_defaults": defaults,
        "_takes_robot": takes_robot,
        "__doc__": f"{family['about']}.\n\nArgs:\n" + "\n".join(docs),
        "__module__": "lagrangian",
        "__signature__": inspect.Signature(
            [
                inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=default)
                for key, default in defaults.items()
            ]
        ),
    }
    return type(name, (Estimator,), body)


#: The best of several families, with the settings of all; each goes to the models that have it.
BEST = {
    "name": None,
    "about": "The best of several models, compared on held-out data",
    "settings": list({s["name"]: s for family in reversed(TABLES["families"]) for s in reversed(family["settings"])}.values())[::-1],
}

#: All estimators by the names of their classes.
ESTIMATORS: dict[str, type[Estimator]] = {
    "Best": _make("Best", BEST),
    **{CLASSES[family["name"]]: _make(CLASSES[family["name"]], family) for family in TABLES["families"]},
}
globals().update(ESTIMATORS)

__all__ = ["ESTIMATORS", *ESTIMATORS]
