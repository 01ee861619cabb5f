"""Plans of sweeps: recordings, settings that all units have, and settings that differ."""

from __future__ import annotations

import difflib
import hashlib
import itertools
import json
import math
import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from . import _lagrangian
from ._data import read
from ._estimators import Estimator, _plain
from ._families import CLASSES, ESTIMATORS
from ._model import urdf_text
from ._trajectory import Trajectories, _whole, trajectories
from .errors import InvalidInput, LagrangianError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["Plan", "Unit"]

#: The largest number of units of a sweep.
MOST_UNITS = 100_000
#: The largest plan, bytes.
MOST_TEXT = 8 << 20
#: The largest number of rows that are used where the plan does not say it; of longer logs a sample is taken.
ROWS = 1 << 20


class Unit(NamedTuple):
    """A fit of a sweep: the name of its folder, its values of the settings that differ, and its estimator."""

    name: str
    varied: dict[str, Any]
    estimator: Estimator


class Plan:
    """The fits of a sweep: fixed settings with all combinations of lists, or with random draws from lists and ranges.

    Args:
        fixed: The settings of all fits: an estimator, or a mapping by the names of the flags of ``lagrangian fit``, where ``model`` is
            the family.
        space: The settings that differ, each a list of values or a range ``{"from": 1e-3, "to": 1e-1, "log": True, "whole": False}``,
            whose logarithm is drawn evenly or of which whole numbers are drawn.
        data: Trajectories, as ``lagrangian.read`` returns them.
        validation: Trajectories to validate on; a part of the others is held back by default.
        method: ``grid`` (all combinations of lists) or ``random`` (``number`` draws).
        number: The number of draws.
        seed: The seed of the draws; each depends on its number and the name of its setting alone.

    Attributes:
        units: The fits by the names of their folders, hashes of settings, data and layout; equal ones occur once.
        varied: The names of the settings that differ.
        notes: What readers passed over or decided, of a plan that was read from a file.

    Raises:
        InvalidInput: A setting, the space or the search is wrong.
    """

    def __init__(
        self,
        fixed: Estimator | Mapping[str, Any],
        space: Mapping[str, Any],
        data: Any = None,
        *,
        validation: Any = None,
        method: str = "grid",
        number: int | None = None,
        seed: int = 0,
    ) -> None:
        self.fixed = fixed._given() if isinstance(fixed, Estimator) else dict(fixed)
        self.varied = sorted(space)
        self.notes: list[str] = []
        self.files: list[dict[str, Any]] = []
        choices = {name: _choices(name, space[name]) for name in self.varied}
        # Settings are refused before long files are read.
        self._points = [(point, self._estimator(point)) for point in _points(choices, method, number, seed)]
        self._take(Trajectories(), None) if data is None else self._take(data, validation)

    @staticmethod
    def of(plan: Plan | str | os.PathLike[str]) -> Plan:
        """A plan as it is, or from its file."""
        return plan if isinstance(plan, Plan) else Plan.read(plan)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Plan:
        """Reads a TOML file with ``[data]``, ``[fixed]``, ``[space]`` and ``[search]``; its paths lead from its folder."""
        path = Path(path)
        shown = f"cannot read the plan '{path}'"
        if path.stat().st_size > MOST_TEXT or not path.is_file():
            raise InvalidInput(f"{shown}: it is not a file of at most {MOST_TEXT >> 20} MiB: give a TOML file with [data], [fixed] and [space]")
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except (ValueError, RecursionError) as error:
            raise InvalidInput(f"{shown}: {error}: a plan has [data], [fixed], [space] and [search]; see examples/sweep/plan.toml") from error
        tables = {"data": ("files", "validate", "layout", "rows"), "fixed": (), "space": (), "search": ("method", "number", "seed")}
        _refuse_unknown("the plan", table, tables)
        for name, known in tables.items():
            if not isinstance(table.setdefault(name, {}), dict):
                raise InvalidInput(f"{shown}: '{name}' is a {type(table[name]).__name__}: write it as a table, [{name}]")
            if known:
                _refuse_unknown(f"[{name}] of the plan", table[name], known)
        fixed = table["fixed"]
        for name in ("urdf", "nominal"):
            if isinstance(fixed.get(name), str) and (path.parent / fixed[name]).is_file():
                fixed[name] = urdf_text(path.parent / fixed[name])
        plan = cls(fixed, table["space"], **table["search"])
        plan._read(path.parent, **table["data"])
        return plan

    def _read(self, folder: Path, files: Any = (), validate: Any = (), layout: Any = None, rows: Any = ROWS) -> None:
        """Reads the recordings of [data]."""
        if not isinstance(layout or {}, dict):
            raise InvalidInput(f'the layout of [data] is {layout!r}: write it as a table, such as layout = {{ angle = "all" }}')
        text = "\n".join(f"{json.dumps(key)} = {_toml(value)}" for key, value in (layout or {}).items())
        found = []
        for role, named in (("training", files), ("validation", validate)):
            if not isinstance(named, (list, tuple)) or not all(isinstance(name, str) for name in named):
                raise InvalidInput(f'the files of [data] are {named!r}: give a list of names, such as files = ["motion.csv"]')
            paths = [folder / name for name in named]
            found.append(read(paths, layout=text, rows=rows) if paths else Trajectories())
            self.notes += found[-1].notes
            for path in filter(Path.is_file, paths):
                content = path.read_bytes()
                sha256 = hashlib.sha256(content).hexdigest()
                self.files.append({"role": role, "path": str(path), "bytes": len(content), "sha256": sha256})
        if not files:
            raise InvalidInput('[data] of the plan names no files: give files = ["motion.csv"]')
        self._take(found[0], found[1] or None)

    def _take(self, data: Any, validation: Any) -> None:
        """Takes the recordings, and names the units."""
        self.data = data if isinstance(data, Trajectories) else Trajectories(trajectories(data, "data"))
        self.validation = [] if validation is None else list(validation if isinstance(validation, Trajectories) else trajectories(validation, "validation"))
        self.hashes: list[dict[str, Any]] = _lagrangian.content_hashes(self.data, self.validation)
        self.units: dict[str, Unit] = {}
        for varied, estimator in self._points:
            unit = self._named(varied, estimator)
            self.units.setdefault(unit.name, unit)

    def _named(self, varied: dict[str, Any], estimator: Estimator) -> Unit:
        hashes = [(file["role"], file["sha256"]) for file in self.hashes]
        return Unit(_lagrangian.unit_name(estimator._spec(), self.data.layout or "", hashes), varied, estimator)

    def unit(self, settings: Mapping[str, Any]) -> Unit:
        """The unit of other settings beside the fixed ones."""
        varied = {name: _plain(value) for name, value in settings.items()}
        return self._named(varied, self._estimator(varied))

    def part(self, first: int, every: int) -> list[str]:
        """The names of every so manyth unit, from the first, which counts from 1."""
        if not 1 <= first <= every:
            raise InvalidInput(f"there is no unit {first} of {every}: write 3/16 for every sixteenth, from the third, from 1/16 to 16/16")
        return list(self.units)[first - 1 :: every]

    def _estimator(self, varied: Mapping[str, Any]) -> Estimator:
        for name in self.fixed.keys() & varied.keys():
            raise InvalidInput(f"the setting '{name}' is both fixed and varied: omit one of the two")
        settings = {**self.fixed, **varied}
        family = settings.pop("model", None)
        if family is not None:
            _refuse_unknown("the package", [family], CLASSES, "model")
        estimator = ESTIMATORS["Best" if family is None else CLASSES[family]]
        _refuse_unknown("a fit" if family is None else f"the model {family}", settings, [*estimator._defaults, "model"], "setting")
        try:
            own = estimator(**_quick(settings))
            json.dumps(own.get_params(), allow_nan=False)
            if not isinstance(own.smooth, bool):
                raise TypeError("smooth is true or false")
            _lagrangian.unit_name(own._spec(), "", [])
        except (LagrangianError, OSError):
            raise
        except (TypeError, ValueError, OverflowError) as error:
            raise InvalidInput(f"the settings cannot be read ({error}): give finite numbers without quotes, names with them") from error
        return own

    def begin(self, out: Path) -> None:
        """Writes down the data that a sweep begins with; those of one that has begun must be the same."""
        path = out / "sweep.json"
        if not self.data:
            raise InvalidInput("the plan has no recordings: give trajectories as data")
        if not path.exists():
            out.mkdir(parents=True, exist_ok=True)
            return replace(path, json.dumps({"data": self.hashes, "layout": self.data.layout, "files": self.files}, indent=2))
        try:
            then = json.loads(path.read_text(encoding="utf-8"))
            known = {file["sha256"] for file in then["files"]}
            same = [{**file, "path": ""} for file in then["data"]] == [{**file, "path": ""} for file in self.hashes]
            layout = then["layout"]
        except (ValueError, TypeError, KeyError) as error:
            raise InvalidInput(f"cannot read '{path}' ({error}): give another folder, or remove that one") from error
        if same and layout == self.data.layout:
            return None
        changed = [f"'{file['path']}'" for file in self.files if file["sha256"] not in known]
        named = changed[0] if changed else "the layout of the data" if same else "the data"
        raise InvalidInput(f"{named} changed since the sweep in '{out}' began: bring the old state back, or give another folder")


def replace(path: Path, text: str) -> None:
    """Writes a whole file or none."""
    own = path.with_name(f".{path.name}.{os.getpid()}")
    own.write_text(text, encoding="utf-8")
    os.replace(own, path)


def _refuse_unknown(where: str, given: Iterable[Any], known: Iterable[str], what: str = "key") -> None:
    known = list(known)
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(str(name)[:60], known, 1)
            remedy = f"did you mean '{near[0]}'?" if near else f"choose from {', '.join(known)}"
            raise InvalidInput(f"{where} has no {what} '{str(name)[:60]}': {remedy}")


def _toml(value: Any) -> str:
    """A value of a TOML file as it is written there."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(own)}" for key, own in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False, default=str)


def _quick(settings: dict[str, Any]) -> dict[str, Any]:
    """The settings of a fit that ends after ``LAGRANGIAN_QUICK`` seconds, for tests that run documented commands."""
    text = os.environ.get("LAGRANGIAN_QUICK", "")
    if text in ("", "0"):
        return settings
    try:
        most = float(text)
    except ValueError as error:
        raise InvalidInput(f"LAGRANGIAN_QUICK={text}: give it the largest number of seconds of a fit, or unset it") from error
    return {**settings, "steps": None, "seconds": min(settings.get("seconds") or most, most)}


def _choices(name: str, values: Any) -> list[Any] | dict[str, Any]:
    def refused(remedy: str) -> InvalidInput:
        return InvalidInput(f"the values of '{str(name)[:60]}' cannot be used: {remedy}")

    if isinstance(values, Mapping):
        own = {"from": None, "to": None, "log": False, "whole": False, **{key: _plain(value) for key, value in values.items()}}
        low, high, log, whole = (own.pop(key) for key in ("from", "to", "log", "whole"))
        if own or not (isinstance(log, bool) and isinstance(whole, bool)):
            raise refused("give a range as { from = 1e-3, to = 1e-1, log = true }")
        if not all(isinstance(end, (int, float)) and not isinstance(end, bool) and abs(end) < 1e300 for end in (low, high)) or low >= high:
            raise refused("give two numbers, 'from' below 'to'")
        if log and low <= 0:
            raise refused("a logarithmic range begins above 0")
        if whole and not all(float(end).is_integer() and abs(end) < 9e15 for end in (low, high)):
            raise refused("a range of whole numbers has whole ends")
        return {"low": float(low), "high": float(high), "log": log, "whole": whole}
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise refused("give a list of values, or a range { from, to }; one value is among the fixed settings")
    if not (choices := [_plain(value) for value in values]):
        raise refused("the list is empty: give values")
    return choices


def _points(choices: Mapping[str, Any], method: str, number: int | None, seed: int) -> list[dict[str, Any]]:
    """The settings of each unit that differ."""
    if method == "random":
        count = 0 if number is None else _whole(number, "number")
        if count < 1:
            raise InvalidInput("a random search has no number of units: give number = 20")
    elif method == "grid":
        ranges = [name for name, own in choices.items() if isinstance(own, dict)]
        if number is not None or ranges:
            what = "'number' is" if number is not None else f"the range of '{ranges[0]}' is"
            raise InvalidInput(f"{what} for a random search, and this is a grid: give lists alone, or method = \"random\"")
        count = math.prod(len(own) for own in choices.values())
    else:
        raise InvalidInput(f"method is {method!r}: choose 'grid' or 'random'")
    if count > MOST_UNITS:
        raise InvalidInput(f"the sweep has {count} units: make it smaller, at most {MOST_UNITS}")
    if method == "grid":
        return [dict(zip(choices, values)) for values in itertools.product(*choices.values())]
    seed = _whole(seed, "seed")
    return [{name: _drawn(own, f"{seed}/{k}/{name}") for name, own in choices.items()} for k in range(count)]


def _drawn(choices: Any, text: str) -> Any:
    """A value that depends on a text alone."""
    first = int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big")
    part = (first >> 11) / (1 << 53)
    if isinstance(choices, list):
        return choices[int(part * len(choices))]
    low, high = choices["low"], choices["high"]
    # The last of whole numbers has as much of the range as the others.
    end = high + 1.0 if choices["whole"] else high
    x = math.exp(math.log(low) + part * (math.log(end) - math.log(low))) if choices["log"] else low + part * (end - low)
    if choices["whole"]:
        return int(min(max(math.floor(x), low), high))
    # Six digits, so that a value reads well and does not depend on the mathematical library of a machine.
    return min(max(float(f"{x:.5e}"), low), high)
