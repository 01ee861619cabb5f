"""Sweeps: many fits of the same data, on this machine or on a cluster."""

from __future__ import annotations

import json
import os
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _lagrangian
from ._estimators import Estimator, _plain
from ._model import Model, load
from ._trajectory import Trajectories, Trajectory, _whole, trajectories
from .errors import FitInterrupted, FitWarning, InvalidInput, MissingExtra

if TYPE_CHECKING:
    import pandas

__all__ = ["Range", "Sweep", "sweep"]


class Range(NamedTuple):
    """The numbers between two ends, of which a random search draws.

    Attributes:
        low, high: The ends, both included.
        log: Whether the logarithm is drawn evenly.
        whole: Whether whole numbers are drawn.
    """

    low: float
    high: float
    log: bool = False
    whole: bool = False

    def _parts(self) -> dict[str, Any]:
        return {"from": self.low, "to": self.high, "log": self.log, "whole": self.whole}


class Sweep:
    """What a sweep has given.

    Attributes:
        folder: The folder of the units; each is a run folder, see ``report``.
        results: A row for each unit: its folder, the settings that differ, verdict, error, loss, steps, failure.
        best: The row with the least error; ``None`` where no unit has one.
    """

    def __init__(self, folder: Path, rows: Sequence[Mapping[str, Any]], best: str | None) -> None:
        self.folder = folder
        self.results: list[dict[str, Any]] = [
            {"unit": row["unit"], **row["settings"], **(row["result"] or {})} for row in rows
        ]
        self.best = next((row for row in self.results if row["unit"] == best), None)

    @property
    def table(self) -> pandas.DataFrame:
        """The results as a pandas table; ``results.csv`` in the folder says the same."""
        try:
            import pandas
        except ImportError as error:
            raise MissingExtra("pandas is not installed: pip install lagrangian[pandas]") from error
        return pandas.DataFrame(self.results)

    @property
    def model(self) -> Model:
        """The model of the best unit."""
        if self.best is None:
            raise InvalidInput(f"no unit of the sweep in '{self.folder}' has a model: see its results")
        return load(self.folder / self.best["unit"])

    def __repr__(self) -> str:
        done = sum("steps" in row for row in self.results)
        return f"Sweep({str(self.folder)!r}: {done} of {len(self.results)} units are done)"


def sweep(
    estimator: Estimator,
    space: Mapping[str, Any],
    data: Any,
    *,
    run: str | os.PathLike[str],
    validation: Any = None,
    method: str = "grid",
    number: int | None = None,
    seed: int = 0,
    executor: str = "local",
    threads: int | None = None,
    retries: int = 3,
    parallel: int | None = None,
    tensorboard: bool = False,
) -> Sweep:
    """Fits an estimator with many settings, each in a run folder that is named by the hash of its settings and data.

    What has ended is not done again: a sweep that was killed goes on, and so does one of the command ``lagrangian sweep`` with the
    same settings and data. Where the estimator has ``steps``, every machine of one kind gives the same bits.

    Args:
        estimator: Its settings are those of all fits.
        space: The settings that differ: lists of values, or ``Range`` for random searches.
        data: Trajectories, as ``read`` returns them.
        run: The folder of the run folders; on a cluster one that all machines share.
        validation: Trajectories to validate on; a part of the others is held back by default.
        method: ``grid`` (all combinations), ``random`` (``number`` draws), or ``optuna`` (``number`` trials, each proposed after
            what others have given; the errors steer the search).
        number: The number of draws or trials.
        seed: The seed of the draws.
        executor: ``local``, or ``ray``: each unit is a task of the Ray cluster that is connected, or of this machine.
        threads: The threads of each fit; on Ray also the processors that it asks for, 1 by default.
        retries: How often Ray begins a unit again whose machine is lost.
        parallel: How many trials of ``optuna`` are under way at a time on Ray; by default as many as it has processors for. With
            one, the trials are those of this machine alone; with more, they depend on which of them end first.
        tensorboard: Write event files into the run folders.

    Returns:
        The results as a table, and the best model.

    Raises:
        InvalidInput: A setting or the space is wrong, or the data changed since the sweep in that folder began.
        MissingExtra: Ray or Optuna is not installed.

    >>> import tempfile, lagrangian as lg
    >>> swings = lg.simulate("pendulum", trajectories=6, duration=3.0, seed=1)
    >>> found = lg.sweep(lg.Lnn(steps=40), {"width": [4, 16]}, swings, run=tempfile.mkdtemp())
    >>> [row["width"] for row in found.results]
    [4, 16]
    """
    work = _Work(estimator, data, validation, Path(run), tensorboard, threads)
    if executor not in ("local", "ray"):
        raise InvalidInput(f"executor is {executor!r}: choose 'local' or 'ray'")
    if method not in ("grid", "random", "optuna"):
        raise InvalidInput(f"method is {method!r}: choose 'grid', 'random' or 'optuna'")
    if parallel is not None and (method != "optuna" or executor != "ray" or parallel < 1):
        raise InvalidInput("parallel is the number of trials of 'optuna' at a time on 'ray', 1 or more: omit it, or give both")
    # What is no space is refused with the same words by all methods, and before anything begins.
    search = {"method": "random", "number": 1} if method == "optuna" else {"method": method, "number": number, "seed": _whole(seed, "seed")}
    known = _lagrangian.Sweep.points(json.dumps(_parts(space)), json.dumps(search))
    for point in known:
        work.own.id(json.dumps(point))
    pool = _OnRay(work, retries, parallel) if executor == "ray" else _Here(work)
    most = pool.most if method == "optuna" or executor == "local" else len(known)
    points = _Trials(space, number, seed, most) if method == "optuna" else _Points(known, most)
    work.own.begin()
    _done(pool, points)
    table = work.own.table([json.dumps(point) for point in points.points], sorted(space))
    found = Sweep(work.folder, table["rows"], table["best"])
    if found.best is None and points.points:
        warnings.warn("no unit has given a model with an error: see the results", FitWarning, stacklevel=2)
    return found


def _parts(space: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: values._parts() if isinstance(values, Range) else [_plain(value) for value in values]
        for name, values in space.items()
    }


class _Work:
    """The units of a sweep, for one process or for many."""

    def __init__(
        self,
        estimator: Estimator,
        data: Any,
        validation: Any,
        folder: Path,
        tensorboard: bool,
        threads: int | None,
    ) -> None:
        self.training: list[Trajectory] = list(trajectories(data, "data"))
        if not self.training:
            raise InvalidInput("data holds no trajectory: give at least one")
        self.validation = [] if validation is None else list(trajectories(validation, "validation"))
        self.layout = (data.layout or "") if isinstance(data, Trajectories) else ""
        self.fixed = json.dumps(estimator._given())
        self.folder = folder
        self.tensorboard = tensorboard
        self.threads = threads
        self.own = self._open()

    def _open(self) -> _lagrangian.Sweep:
        return _lagrangian.Sweep(self.training, self.validation, self.layout, self.fixed, self.folder)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "own"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.own = self._open()

    def run(self, point: Mapping[str, Any]) -> dict[str, Any]:
        """Does one unit in this process."""
        if self.threads is not None:
            _lagrangian.set_threads(self.threads)
        call = f"lagrangian.sweep(…, {dict(point)!r}, run={str(self.folder)!r})"
        return self.own.run(json.dumps(point), call, self.tensorboard)


_Result = dict[str, Any]


class _Here:
    """Does units in this process, one after the other."""

    most = 1

    def __init__(self, work: _Work) -> None:
        self.work = work
        self.done: dict[int, _Result] = {}

    def begin(self, point: Mapping[str, Any]) -> int:
        """Does a unit; the number of its result."""
        self.done[len(self.done)] = self.work.run(point)
        return len(self.done) - 1

    def wait(self, begun: Iterable[int]) -> tuple[int, _Result]:
        """The next unit that has ended, and its result."""
        first = next(iter(begun))
        return first, self.done[first]

    def cancel(self, begun: Iterable[int]) -> None:
        """Nothing is under way."""


class _OnRay:
    """Does units as tasks of Ray; at most so many searches at a time as there are processors for."""

    def __init__(self, work: _Work, retries: int, parallel: int | None) -> None:
        try:
            import ray
        except ImportError as error:
            raise MissingExtra("Ray is not installed: pip install lagrangian[ray]") from error
        self.ray: Any = ray
        if not ray.is_initialized():
            ray.init(log_to_driver=False)
        self.threads = work.threads or 1
        self.most = parallel or max(1, int(self.ray.cluster_resources().get("CPU", 1)) // self.threads)
        self.shared = ray.put(work)
        self.task = ray.remote(num_cpus=self.threads, max_retries=int(retries))(_unit)

    def begin(self, point: Mapping[str, Any]) -> Any:
        """Hands a unit to the cluster."""
        return self.task.remote(self.shared, dict(point), self.threads)

    def wait(self, begun: Iterable[Any]) -> tuple[Any, _Result]:
        """The next unit that has ended, and its result."""
        [done], _ = self.ray.wait(list(begun), num_returns=1)
        return done, self.ray.get(done)

    def cancel(self, begun: Iterable[Any]) -> None:
        """Ends what is under way."""
        for one in begun:
            self.ray.cancel(one, force=True)


def _unit(work: _Work, point: Mapping[str, Any], threads: int) -> _Result:
    """One unit, as a task of Ray."""
    work.threads = threads
    # A worker of a machine that was lost may hold the folder a little longer.
    while (result := work.run(point))["ended"] == "busy":
        time.sleep(0.5)
    return result


def _done(pool: _Here | _OnRay, points: _Points) -> None:
    """Does all units; as many at a time as the points ask for."""
    begun: dict[Any, Mapping[str, Any]] = {}
    try:
        while True:
            while (point := points.next(len(begun))) is not None:
                begun[pool.begin(point)] = point
            if not begun:
                return
            handle, result = pool.wait(begun)
            points.tell(begun.pop(handle), result)
            if result["ended"] == "interrupted":
                break
    except KeyboardInterrupt:
        pass
    pool.cancel(begun)
    warnings.warn("the sweep was interrupted: the same call goes on with it", FitInterrupted, stacklevel=3)


class _Points:
    """The points of a sweep, all of which are known."""

    def __init__(self, points: Sequence[Mapping[str, Any]], most: int) -> None:
        self.points = list(points)
        self.left = list(reversed(self.points))
        self.most = most

    def next(self, begun: int) -> Mapping[str, Any] | None:
        """Another point, where fewer than the most are under way."""
        return self.left.pop() if self.left and begun < self.most else None

    def tell(self, point: Mapping[str, Any], result: _Result) -> None:
        """The result of a point."""


class _Trials(_Points):
    """Points that Optuna proposes, each after the results that are known until then."""

    def __init__(self, space: Mapping[str, Any], number: int | None, seed: int, most: int) -> None:
        try:
            import optuna
        except ImportError as error:
            raise MissingExtra("Optuna is not installed: pip install lagrangian[optuna]") from error
        if number is None or number < 1:
            raise InvalidInput("number is not given: give the number of trials, such as 20")
        super().__init__([], most)
        self.optuna, self.space, self.number = optuna, space, number
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        # A trial that is under way counts as a bad one, so that the next ones lie elsewhere.
        sampler = optuna.samplers.TPESampler(seed=seed, constant_liar=most > 1)
        self.study = optuna.create_study(sampler=sampler)
        self.trials: list[Any] = []

    def next(self, begun: int) -> Mapping[str, Any] | None:
        if len(self.points) == self.number or begun >= self.most:
            return None
        trial = self.study.ask()
        point = {name: _suggested(trial, name, values) for name, values in self.space.items()}
        self.points.append(point)
        self.trials.append(trial)
        return point

    def tell(self, point: Mapping[str, Any], result: _Result) -> None:
        if result["ended"] == "interrupted":
            return
        trial = next(trial for own, trial in zip(self.points, self.trials) if own is point)
        least = (result["result"] or {}).get("error")
        if least is None:
            self.study.tell(trial, state=self.optuna.trial.TrialState.FAIL)
        else:
            self.study.tell(trial, least)


def _suggested(trial: Any, name: str, values: Any) -> Any:
    if not isinstance(values, Range):
        values = [_plain(value) for value in values]
        return values[trial.suggest_categorical(name, list(range(len(values))))]
    if values.whole:
        return trial.suggest_int(name, int(values.low), int(values.high), log=values.log)
    return trial.suggest_float(name, values.low, values.high, log=values.log)
