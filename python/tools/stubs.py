"""Writes python/lagrangian/_families.pyi from the tables of settings: `python python/tools/stubs.py [--check]`."""

from __future__ import annotations

import sys
from pathlib import Path

from lagrangian import _lagrangian  # noqa: F401 (says at once where the package is not built)
from lagrangian._families import COMMON, ESTIMATORS, TABLES

STUB = Path(__file__).parents[1] / "lagrangian" / "_families.pyi"

TYPES = {
    "choice": "str | None",
    "choices": "Sequence[str] | None",
    "flag": "bool | None",
    "integer": "int | None",
    "number": "float | None",
    "numbers": "Sequence[float] | None",
    "document": "str | Mapping[str, Any] | Sequence[Mapping[str, Any]] | None",
}

COMMON_TYPES = {
    "steps": "int | None",
    "seconds": "float | None",
    "seed": "int",
    "validate_fraction": "float",
    "smooth": "bool",
    "cyclic": "str | Sequence[str]",
    "low_pass": "float | None",
    "baseline": "int",
    "delay": "float | Sequence[float]",
    "nominal": "str | os.PathLike[str] | None",
    "joints": "Sequence[str]",
    "urdf": "str | os.PathLike[str] | None",
}

HEAD = '''\
# Made by python/tools/stubs.py from the tables of settings of the library.
import os
from collections.abc import Mapping, Sequence
from typing import Any

from ._estimators import Estimator

COMMON: dict[str, tuple[Any, str]]
TABLES: dict[str, Any]
CLASSES: dict[str, str]
ESTIMATORS: dict[str, type[Estimator]]
'''


def choice(setting: dict) -> str:
    names = ", ".join(f'"{name}"' for name, _ in setting["values"])
    kind = f"Literal[{names}]"
    return f"{kind} | None" if setting["kind"] == "choice" else f"Sequence[{kind}] | None"


def text() -> str:
    kinds: dict[str, str] = {}
    tables = [f["settings"] for f in TABLES["families"]] + [TABLES["training"], TABLES["rollout"]]
    for setting in (setting for table in tables for setting in table):
        named = setting["kind"] in ("choice", "choices")
        kinds[setting["name"]] = choice(setting) if named else TYPES.get(setting["kind"], "Any")
    kinds.update(COMMON_TYPES)
    assert set(COMMON) < set(kinds)
    lines = [HEAD.replace("import Any\n", "import Any, Literal\n")]
    for name, estimator in ESTIMATORS.items():
        lines.append(f"class {name}(Estimator):")
        doc = (estimator.__doc__ or "").strip().replace("\n", "\n    ")
        lines.append(f'    """{doc}\n    """')
        own = estimator._defaults
        lines += [f"    {key}: {kinds[key]}" for key in own]
        arguments = "".join(f"        {key}: {kinds[key]} = ...,\n" for key in own)
        lines.append(f"    def __init__(\n        self,\n        *,\n{arguments}    ) -> None: ...\n")
    return "\n".join(lines)


def main() -> int:
    wanted = text()
    if "--check" not in sys.argv:
        STUB.write_text(wanted, encoding="utf-8")
        return 0
    if STUB.exists() and STUB.read_text(encoding="utf-8") == wanted:
        return 0
    print(f"{STUB} is not what the tables of settings say: run python {Path(__file__).name}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
