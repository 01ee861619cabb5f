"""Sweeps: many fits of the same data, on this machine or on a cluster."""

from __future__ import annotations

import json
import os
import time
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from . import _lagrangian
from ._estimators import Estimator, _plain
from ._model import Model, load
from ._trajectory import Trajectories, Trajectory, trajectories
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
        method: ``grid`` (all combinations), ``random`` (``number`` draws), or ``optuna`` (``number`` trials, each after what the
            ones before have given; its errors steer the search, one trial after the other).
        number: The number of draws or trials.
        seed: The seed of the draws.
        executor: ``local``, or ``ray``: each unit is a task of the Ray cluster that is connected, or of this machine.
        threads: The threads of each fit; on Ray also the processors that it asks for, 1 by default.
        retries: How often Ray begins a unit again whose machine is lost.
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
    if method == "optuna":
        if executor != "local":
            raise InvalidInput("method 'optuna' takes one trial after the other: omit executor, or search by 'random'")
        points = _optuna(work, space, number, seed)
    elif method in ("grid", "random"):
        search = {"method": method, "number": number, "seed": int(seed)}
        points = _lagrangian.Sweep.points(json.dumps(_parts(space)), json.dumps(search))
        work.own.begin()
        for point in points:
            work.own.id(json.dumps(point))
        if executor == "ray":
            _on_ray(work, points, retries)
        else:
            _here(work, points)
    else:
        raise InvalidInput(f"method is {method!r}: choose 'grid', 'random' or 'optuna'")
    table = work.own.table([json.dumps(point) for point in points], sorted(space))
    found = Sweep(work.folder, table["rows"], table["best"])
    if found.best is None and points:
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


def _here(work: _Work, points: Sequence[Mapping[str, Any]]) -> None:
    for point in points:
        if work.run(point)["ended"] == "interrupted":
            warnings.warn("the sweep was interrupted: the same call goes on with it", FitInterrupted, stacklevel=3)
            return


def _on_ray(work: _Work, points: Sequence[Mapping[str, Any]], retries: int) -> None:
    try:
        import ray
    except ImportError as error:
        raise MissingExtra("Ray is not installed: pip install lagrangian[ray]") from error
    if not ray.is_initialized():
        ray.init(log_to_driver=False)
    shared = ray.put(work)
    task = ray.remote(num_cpus=work.threads or 1, max_retries=int(retries))(_unit)
    threads = work.threads or 1
    waiting = [task.remote(shared, dict(point), threads) for point in points]
    try:
        while waiting:
            done, waiting = ray.wait(waiting, num_returns=1)
            ray.get(done)
    except KeyboardInterrupt:
        for one in waiting:
            ray.cancel(one, force=True)
        warnings.warn("the sweep was interrupted: the same call goes on with it", FitInterrupted, stacklevel=3)


def _unit(work: _Work, point: Mapping[str, Any], threads: int) -> None:
    """One unit, as a task of Ray."""
    work.threads = threads
    # A worker of a machine that was lost may hold the folder a little longer.
    while work.run(point)["ended"] == "busy":
        time.sleep(0.5)


def _optuna(work: _Work, space: Mapping[str, Any], number: int | None, seed: int) -> list[dict[str, Any]]:
    try:
        import optuna
    except ImportError as error:
        raise MissingExtra("Optuna is not installed: pip install lagrangian[optuna]") from error
    if number is None or number < 1:
        raise InvalidInput("number is not given: give the number of trials, such as 20")
    # Refuses what is no space, with the same words as the other methods.
    _lagrangian.Sweep.points(json.dumps(_parts(space)), json.dumps({"method": "random", "number": 1}))
    work.own.begin()
    points: list[dict[str, Any]] = []
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))
    for _ in range(number):
        trial = study.ask()
        point = {name: _suggested(trial, name, values) for name, values in space.items()}
        points.append(point)
        done = work.run(point)
        if done["ended"] == "interrupted":
            warnings.warn("the sweep was interrupted: the same call goes on with it", FitInterrupted, stacklevel=3)
            break
        least = (done["result"] or {}).get("error")
        if least is None:
            study.tell(trial, state=optuna.trial.TrialState.FAIL)
        else:
            study.tell(trial, least)
    return points


def _suggested(trial: Any, name: str, values: Any) -> Any:
    if not isinstance(values, Range):
        values = [_plain(value) for value in values]
        return values[trial.suggest_categorical(name, list(range(len(values))))]
    if values.whole:
        return trial.suggest_int(name, int(values.low), int(values.high), log=values.log)
    return trial.suggest_float(name, values.low, values.high, log=values.log)
