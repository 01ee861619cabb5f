"""Sweeps: many fits of the same data, each in a run folder that is named by the hash of its settings and data.

``python -m lagrangian.sweep plan.toml --out sweep`` runs the units of a plan on one machine, ``--unit 3/16`` every sixteenth of them,
from the third, as a task of a batch system. What is done lies in the folders alone, so that a sweep resumes wherever it was ended.
"""

from __future__ import annotations

import argparse
import csv
import io
import json
import math
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

from . import _lagrangian
from ._estimators import Estimator
from ._model import Model, load
from ._plan import Plan, Unit, replace
from .errors import FolderInUse, InvalidInput, LagrangianError

__all__ = ["Plan", "Results", "objective", "results", "run"]

#: The file of a unit that has ended, written last.
RESULT = "result.json"
#: The columns of the table after those of the settings that differ.
COLUMNS = ("verdict", "error", "loss", "steps", "family", "failure")
#: The largest number of rows of each kind that are printed.
SHOWN = 20
#: The largest number of processes.
MOST_WORKERS = 256


class Results:
    """The results of a sweep.

    Attributes:
        folder: The folder of the units; each is a run folder, see ``lagrangian.report``.
        rows: A dictionary for each unit: ``unit`` (its folder), ``settings`` that differ, ``verdict``, ``error`` (the squared error on
            held-out samples over the variance, of the torques where forces were recorded, else of the accelerations), ``loss``,
            ``steps``, ``family`` and ``failure``. Of a unit that has not ended it holds the first two alone.
    """

    def __init__(self, folder: Path, varied: Sequence[str], rows: Sequence[dict[str, Any]]) -> None:
        self.folder = folder
        self.varied = list(varied)
        self.rows = list(rows)

    @property
    def best(self) -> dict[str, Any] | None:
        """The row with the smallest error; ``None`` where no unit has one."""
        known = [row for row in self.rows if row.get("error") is not None]
        return min(known, key=lambda row: float(row["error"]), default=None)

    @property
    def failed(self) -> list[dict[str, Any]]:
        """The rows of units that failed."""
        return [row for row in self.rows if row.get("failure")]

    @property
    def model(self) -> Model:
        """The model of the best unit."""
        if self.best is None:
            raise InvalidInput(f"no unit of the sweep in '{self.folder}' has a model: see the failures in its results")
        return load(self.folder / self.best["unit"])

    def write(self) -> None:
        """Writes ``results.csv`` into the folder; it holds no times, so that it is the same after any number of interruptions."""
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(["unit", *self.varied, *COLUMNS])
        for row in self.rows:
            table.writerow([row["unit"], *row["settings"].values(), *(row.get(name) for name in COLUMNS)])
        replace(self.folder / "results.csv", text.getvalue())

    def __str__(self) -> str:
        """The table for people: the best units, the best first, then those that failed."""
        failed, done = self.failed, [row for row in self.rows if row.get("verdict")]
        done.sort(key=lambda row: math.inf if row["error"] is None else float(row["error"]))
        lines = []
        for rows in (done, failed):
            for row in rows[:SHOWN]:
                settings = ", ".join(f"{name} {value}" for name, value in row["settings"].items())
                lines.append(f"{row['unit']}  {row['verdict'] or ''}  {_words(row)}  {settings}")
            if len(rows) > SHOWN:
                lines.append(f"… and {len(rows) - SHOWN} more in results.csv")
        return "\n".join([*lines, f"{len(done)} of {len(self.rows)} units are done, {len(failed)} failed"])

    __repr__ = __str__


def run(
    plan: Plan | str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    workers: int = 1,
    unit: tuple[int, int] = (1, 1),
    tensorboard: bool = False,
    tell: Callable[[str], Any] | None = None,
) -> Results:
    """Runs the units of a plan that are not done yet, and writes the table of results.

    Where the plan has ``steps``, the models have the same bits on every machine of one kind, whatever the number of workers.

    Args:
        plan: A plan, or the path of its file.
        out: The folder of the run folders; on a cluster one that all machines share.
        workers: The number of processes, among which the processors of this machine are divided. A script that gives more than one
            calls this function under ``if __name__ == "__main__":``.
        unit: ``(3, 16)`` runs every sixteenth unit, from the third.
        tensorboard: Write event files into the run folders.
        tell: Is called with a line about each unit that has ended.

    Returns:
        The results of all units of the plan, with what other processes have done. A unit that failed is in the table with its error,
        and is tried again by the next call.

    Raises:
        InvalidInput: A setting is wrong, or the data changed since the sweep in that folder began.

    >>> import tempfile, lagrangian as lg
    >>> from lagrangian import sweep
    >>> swings = lg.simulate("pendulum", trajectories=6, duration=3.0, seed=1)
    >>> found = sweep.run(sweep.Plan(lg.Lnn(steps=40), {"width": [4, 16]}, swings), tempfile.mkdtemp())
    >>> [row["settings"]["width"] for row in found.rows]
    [4, 16]
    """
    plan, out = Plan.of(plan), Path(out)
    if not 1 <= workers <= MOST_WORKERS:
        raise InvalidInput(f"workers is {workers}: give a number from 1 to {MOST_WORKERS}")
    mine = plan.part(*unit)
    plan.begin(out)
    try:
        for k, (name, result) in enumerate(_done(plan, mine, out, workers, tensorboard), 1):
            if tell:
                tell(f"unit {k} of {len(mine)} ({name}): {_words(result)}")
    finally:
        found = results(plan, out)
        found.write()
    return found


def results(plan: Plan | str | os.PathLike[str], out: str | os.PathLike[str]) -> Results:
    """The results that the units of a plan have given until now, in a folder of a sweep."""
    plan, out = Plan.of(plan), Path(out)
    rows = [{"unit": unit.name, "settings": unit.varied, **(_result(out / unit.name) or {})} for unit in plan.units.values()]
    return Results(out, plan.varied, rows)


def objective(plan: Plan | str | os.PathLike[str], out: str | os.PathLike[str]) -> Callable[[Mapping[str, Any]], float]:
    """A function for optimisers: from settings, beside those of the plan, to the error of their unit in the folder; NaN for none."""
    own, folder = Plan.of(plan), Path(out)
    own.begin(folder)

    def error(settings: Mapping[str, Any]) -> float:
        while (result := _run(own, own.unit(settings), folder, False)) is None:
            time.sleep(0.5)  # Another process works on it.
        return math.nan if result["error"] is None else float(result["error"])

    return error


def _done(plan: Plan, names: list[str], out: Path, workers: int, tensorboard: bool) -> Iterator[tuple[str, dict[str, Any] | None]]:
    """The units, each when it has ended."""
    if min(workers, len(names)) < 2:
        yield from ((name, _run(plan, plan.units[name], out, tensorboard)) for name in names)
        return
    others = set(multiprocessing.active_children())
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, _begin, (plan, out, tensorboard, max(1, processors // workers)))
    try:
        futures = {pool.submit(_work, name): name for name in names}
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BrokenProcessPool as error:
        raise LagrangianError("a worker was ended, perhaps for want of memory: take fewer workers; the same call resumes") from error
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        # Ended at once: a unit resumes from its last checkpoint.
        for worker in set(multiprocessing.active_children()) - others:
            worker.terminate()


_OWN: list[Any] = []


def _begin(*own: Any) -> None:
    """Begins a worker, which its parent ends, and which ends when its parent is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _lagrangian.set_threads(own[-1])
    _OWN[:] = own


def _end_with_parent() -> None:
    if parent := multiprocessing.parent_process():
        parent.join()
        os._exit(1)


def _work(name: str) -> dict[str, Any] | None:
    plan, out, tensorboard, _ = _OWN
    return _run(plan, plan.units[name], out, tensorboard)


def _run(plan: Plan, unit: Unit, out: Path, tensorboard: bool) -> dict[str, Any] | None:
    """Runs a unit, resumes it, or takes the result that is there; ``None`` where another process works on it."""
    folder = out / unit.name
    result = _result(folder)
    if result is not None and not result["failure"]:
        return result
    # A run that left a result has ended, and what is wrong with it would come back.
    resume = (folder / "run.toml").is_file() and not (folder / RESULT).exists()
    place = unit.estimator._place(folder, resume, not resume, tensorboard)
    # The bytes of the model depend on the name of its unit alone, not on the folder.
    settings = json.dumps({"unit": unit.name, "varied": unit.varied, **json.loads(place["settings"])})
    place.update(call=f"unit {unit.name}", settings=settings)
    try:
        model, summary = _lagrangian.fit(plan.data, plan.validation, unit.estimator._spec(), plan.data.layout or "", place, None)
        result = _of_fit(model, summary)
    except FolderInUse:
        return None
    except (LagrangianError, OSError) as error:
        failure = " ".join(str(error).split())
        result = {"family": unit.estimator.family or "", "verdict": None, "error": None, "loss": None, "steps": 0, "failure": failure}
    folder.mkdir(parents=True, exist_ok=True)
    replace(folder / RESULT, json.dumps(result, indent=2))
    return result


def _of_fit(model: _lagrangian.Model, summary: Mapping[str, Any]) -> dict[str, Any]:
    if summary["ending"] == "interrupted":
        raise KeyboardInterrupt
    torque, acceleration = summary["score"]["torque"], summary["score"]["acceleration"]
    score = (torque or acceleration) if summary["samples"]["forces"] else (acceleration or torque)
    nmse = score["nmse"] if score else [None]
    error = None if None in nmse else sum(nmse) / len(nmse)
    own = {"family": model.family, "verdict": summary["verdict"], "error": error, "loss": summary["loss"]}
    return {**own, "steps": summary["steps"], "failure": None}


def _result(folder: Path) -> dict[str, Any] | None:
    """The result of a unit that failed, or whose model can be read."""
    try:
        result: dict[str, Any] = json.loads((folder / RESULT).read_text(encoding="utf-8"))
        row = {name: result[name] for name in COLUMNS}
        if not row["failure"]:
            load(folder)
        return row
    except (OSError, ValueError, TypeError, KeyError):
        return None


def _words(result: Mapping[str, Any] | None) -> str:
    if result is None:
        return "another process works on it"
    if result["failure"]:
        return f"failed: {result['failure']}"
    return "no error is known" if result["error"] is None else f"error {result['error']:.3e}"


def main(arguments: Sequence[str] | None = None) -> int:
    """The program ``python -m lagrangian.sweep``: its exit code is 0, 1 where a unit failed, 2 for a wrong plan, 130 at Ctrl-C."""
    parser = argparse.ArgumentParser("python -m lagrangian.sweep", description="Runs the fits of a plan, each in a run folder.")
    parser.add_argument("plan", type=Path, help="the plan, a TOML file")
    parser.add_argument("--out", type=Path, default=Path("runs/sweep"), metavar="DIR", help="folder of the runs and of results.csv")
    parser.add_argument("--unit", type=_part, default=(1, 1), metavar="I/N", help="run every Nth unit, from the Ith: a task of an array")
    parser.add_argument("--workers", type=int, default=1, help="number of processes, which share the processors (1)")
    parser.add_argument("--dry-run", action="store_true", help="list the units, and run none")
    given = parser.parse_args(arguments)

    def tell(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    mine: list[str] = []
    try:
        plan = Plan.read(given.plan)
        for note in plan.notes:
            tell(f"note: {note}")
        mine = plan.part(*given.unit)
        if given.dry_run:
            print(*(f"{name}  {plan.units[name].varied}" for name in mine), sep="\n")
            return 0
        found = run(plan, given.out, workers=given.workers, unit=given.unit, tensorboard=True, tell=tell)
    except (LagrangianError, OSError) as error:
        tell(f"error: {error}")
        return 1 if mine and not isinstance(error, InvalidInput) else 2
    except KeyboardInterrupt:
        tell("the sweep was interrupted: the same command resumes it")
        return 130
    print(found)
    tell(f"table: {given.out / 'results.csv'}")
    return int(any(row["unit"] in mine for row in found.failed))


def _part(text: str) -> tuple[int, int]:
    first, every = text.split("/")
    return int(first), int(every)


if __name__ == "__main__":
    sys.exit(main())
