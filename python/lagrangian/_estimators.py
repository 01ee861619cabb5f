"""One estimator a family, with the habits of scikit-learn."""

from __future__ import annotations

import json
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from . import _lagrangian
from ._model import Assessment, Model, urdf_text
from ._trajectory import Coordinate, Trajectories, Trajectory, _numbers, _real, _whole, trajectories
from .errors import (
    FitInterrupted,
    FitWarning,
    InvalidInput,
    InvalidType,
    ModelError,
    NotFitted,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

    from ._data import CheckReport

__all__ = ["Estimator", "fit"]

class Estimator:
    """The base of all estimators; see ``Lnn``, ``Delan``, ``Chain`` and the others.

    Constructors compute nothing; ``fit`` checks settings and data, and returns the estimator. After it:

    Attributes:
        model_: The fitted ``Model``; its methods are those of the estimator as well.
        verdict_: ``good``, ``fair`` or ``poor``.
        assessment_: The errors on held-out data, and why the verdict is not better.
        check_: What the check of the data found.
        choices_: Settings that were chosen from the data, with reasons.
        history_: What the fit said at each look at the validation data.
        summary_: All that is known of the fit.
        n_features_in_: The number of coordinates.
    """

    family: ClassVar[str | None] = None
    _tables: ClassVar[tuple[frozenset[str], frozenset[str], frozenset[str]]]
    _defaults: ClassVar[dict[str, Any]]
    _takes_robot: ClassVar[bool] = False
    # Whether the fit of free motions is refined by long rollouts, and drops friction that it does not need.
    _refine: bool = False

    def __init__(self, **settings: Any) -> None:
        for name in settings:
            if name not in self._defaults:
                raise TypeError(
                    f"{type(self).__name__} has no setting '{name}': choose from {', '.join(self._defaults)}"
                )
        for name, default in self._defaults.items():
            setattr(self, name, settings.get(name, default))

    # The habits of scikit-learn.

    @classmethod
    def _get_param_names(cls) -> list[str]:
        return sorted(cls._defaults)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """All settings by name."""
        return {name: getattr(self, name) for name in self._get_param_names()}

    def set_params(self, **settings: Any) -> Estimator:
        """Changes settings; those of a fit that was made stay with its model."""
        for name, value in settings.items():
            if name not in self._defaults:
                raise InvalidInput(
                    f"{type(self).__name__} has no setting '{name}': choose from {', '.join(self._defaults)}"
                )
            setattr(self, name, value)
        return self

    def clone(self) -> Estimator:
        """An estimator with the same settings that has not been fitted."""
        return type(self)(**self.get_params())

    def __sklearn_clone__(self) -> Estimator:
        return self.clone()

    def __sklearn_is_fitted__(self) -> bool:
        return "model_" in self.__dict__

    def __sklearn_tags__(self) -> Any:
        from sklearn.utils import InputTags, RegressorTags, Tags, TargetTags

        return Tags(
            estimator_type="regressor",
            target_tags=TargetTags(required=False, multi_output=True),
            regressor_tags=RegressorTags(),
            input_tags=InputTags(),
        )

    def __repr__(self) -> str:
        own = (
            f"{name}={getattr(self, name)!r}"
            for name, default in self._defaults.items()
            if not _same(getattr(self, name), default)
        )
        return f"{type(self).__name__}({', '.join(own)})"

    def __getattr__(self, name: str) -> Any:
        # Only what is missing comes here: the results of a fit, and the methods of its model.
        if name.endswith("_") and not name.startswith("_"):
            raise NotFitted(f"this {type(self).__name__} has no {name} before it is fitted: call fit first")
        if name in _OF_MODELS:
            return getattr(self.model_, name)
        raise AttributeError(f"'{type(self).__name__}' object has no attribute '{name}'")

    def __getstate__(self) -> dict[str, Any]:
        return {"version": _lagrangian.__version__, "format": _PICKLE, **self.__dict__}

    def __setstate__(self, state: dict[str, Any]) -> None:
        state = dict(state)
        version, form = state.pop("version", "an early version"), state.pop("format", None)
        if form != _PICKLE:
            raise ModelError(
                f"the pickle was written by version {version} in another format: load the model that it was saved to, or fit again"
            )
        self.__dict__.update(state)

    # What it is for.

    def fit(
        self,
        X: Any,
        y: ArrayLike | None = None,
        *,
        validation: Any = None,
        coordinates: Sequence[Coordinate] | None = None,
        progress: bool | None = None,
        callbacks: Callable[[dict[str, Any]], Any] | Iterable[Callable[[dict[str, Any]], Any]] = (),
        run: str | os.PathLike[str] | None = None,
        resume: bool = False,
        force: bool = False,
        tensorboard: bool = False,
    ) -> Estimator:
        """Fits the model.

        Args:
            X: Trajectories (of ``read``, ``simulate`` or your own arrays); or states, shape ``(m, 2 n)`` for (q, q̇) or
                ``(m, 3 n)`` for (q, q̇, τ), with ``y``.
            y: Accelerations of the states, shape ``(m, n)``.
            validation: Trajectories to validate on; a part of the others is held back by default.
            coordinates: Of states that come as arrays; all of them lines by default.
            progress: Whether to show a bar; by default where the output is a terminal or a notebook.
            callbacks: Functions that get a dictionary at each look at the validation data: ``step``, ``share``, ``seconds``,
                ``loss``, ``validation``. An exception ends the fit. Those of ``lagrangian.callbacks`` also see its begin and end.
            run: The folder of a run: record with settings and hashes, metrics, checkpoints, model and page, as the command leaves
                it; ``report`` shows the page.
            resume: Go on with the interrupted run in that folder, with the same settings and data, to the same bits.
            force: Restart in a folder that holds a run.
            tensorboard: Write an event file for TensorBoard into that folder too.

        Returns:
            The estimator. A ``FitWarning`` says where its verdict is poor. Ctrl-C ends the fit and keeps the best model, with
            a ``FitInterrupted`` warning.

        Raises:
            DataError: A fit of the data would be meaningless.
            InvalidInput: A setting or an argument is wrong.
        """
        watch = _Watch(progress, callbacks, type(self).__name__)
        motions = y is None and not _is_array(X)
        if run is None and (resume or force or tensorboard):
            raise InvalidInput("resume, force and tensorboard are about a run folder: give it as run")
        if run is not None and not motions:
            raise InvalidInput("a run folder is for trajectories: give them as X, without y, or omit run")
        place = None if run is None else self._place(Path(run), bool(resume), bool(force), bool(tensorboard))
        watch.begin(self)
        try:
            with watch:
                if motions:
                    model, summary = self._fit_motions(X, validation, place, watch)
                else:
                    model, summary = self._fit_samples(X, y, coordinates, watch)
            self._take(Model(model), summary, watch)
        except BaseException:
            watch.end(None, run)
            raise
        watch.end(self, run)
        self._warn()
        return self

    def _place(self, folder: Path, resume: bool, force: bool, tensorboard: bool) -> dict[str, Any]:
        own = {name: value for name, value in self._given().items() if name not in ("urdf", "nominal")}
        return {
            "folder": folder,
            "resume": resume,
            "force": force,
            "tensorboard": tensorboard,
            "call": f"lagrangian.{self!r}.fit(X, run={str(folder)!r})",
            "settings": json.dumps({"estimator": type(self).__name__, "asked": own}),
        }

    def _given(self) -> dict[str, Any]:
        """The settings that differ from their defaults, by the names that the command has for them."""
        own = {
            name: _plain(getattr(self, name))
            for name, default in self._defaults.items()
            if not _same(getattr(self, name), default)
        }
        if "delay" in own:
            own["delay"] = np.atleast_1d(_numbers(self.delay, "delay")).tolist()
        own.update({name: urdf_text(own[name]) for name in ("urdf", "nominal") if name in own})
        return own if self.family is None else {"model": self.family, **own}

    def _fit_motions(
        self, X: Any, validation: Any, place: dict[str, Any] | None, watch: _Watch
    ) -> tuple[_lagrangian.Model, dict[str, Any]]:
        return _lagrangian.fit(*self._motions(X, validation), place, watch.tell)

    def _motions(
        self, X: Any, validation: Any
    ) -> tuple[list[Trajectory], list[Trajectory], str, str]:
        """Recordings to learn from and to validate on, the request of the fit, and the layout of the recordings."""
        training = trajectories(X, "X")
        if not training:
            raise InvalidInput("X holds no trajectory: give at least one")
        others = [] if validation is None else trajectories(validation, "validation")
        return training, others, self._spec(), (X.layout or "") if isinstance(X, Trajectories) else ""

    def _fit_samples(
        self,
        X: Any,
        y: ArrayLike | None,
        coordinates: Sequence[Coordinate] | None,
        watch: _Watch,
    ) -> tuple[_lagrangian.Model, dict[str, Any]]:
        states = _table(X, "X")
        if y is None:
            raise InvalidInput(
                "y is not given: give the accelerations of the states of X, or trajectories as X, whose accelerations are estimated"
            )
        qdd = _table(y, "y")
        m, n = qdd.shape
        if states.shape[0] != m or states.shape[1] not in (2 * n, 3 * n):
            raise InvalidInput(
                f"X has shape {states.shape} and y {qdd.shape}: give X as (m, 2 n) for (q, q̇) or (m, 3 n) for (q, q̇, τ), y as (m, n)"
            )
        parts = [np.ascontiguousarray(part) for part in np.split(states, states.shape[1] // n, 1)]
        tau = parts[2] if len(parts) == 3 else None
        part = _real(self.validate_fraction, "validate_fraction")
        if not 0.0 <= part < 1.0:
            raise InvalidInput(f"validate_fraction is {part}: give a number from 0 to below 1")
        held = np.random.default_rng(_whole(self.seed, "seed")).permutation(m)[: round(m * part)]
        named = coordinates or [Coordinate(f"q{i + 1}", "m", "line") for i in range(n)]
        return _lagrangian.fit_samples(
            [parts[0], parts[1], qdd, tau],
            held.tolist(),
            [(c.name, c.unit, c.kind) for c in named],
            self._spec(),
            watch.tell,
        )

    def _spec(self) -> str:
        """The request of a fit, as JSON."""
        tables = [
            {name: _plain(getattr(self, name)) for name in sorted(table) if getattr(self, name) is not None}
            for table in self._tables
        ]
        own = self.urdf if self._takes_robot else None
        prepare = {
            "smooth": bool(self.smooth),
            "low_pass": None if self.low_pass is None else _real(self.low_pass, "low_pass"),
            "baseline": _whole(self.baseline, "baseline"),
            "validate_fraction": _real(self.validate_fraction, "validate_fraction"),
            "delay": np.atleast_1d(_numbers(self.delay, "delay")).tolist(),
            "cyclic": [self.cyclic] if isinstance(self.cyclic, str) else list(self.cyclic),
        }
        spec = {
            "family": self.family,
            **dict(zip(("settings", "training", "rollout"), tables, strict=True)),
            "steps": None if self.steps is None else _whole(self.steps, "steps"),
            "seconds": None if self.seconds is None else _real(self.seconds, "seconds"),
            "seed": _whole(self.seed, "seed"),
            "prepare": prepare,
            "urdf": None if own is None else urdf_text(own),
            "nominal": None if self.nominal is None else urdf_text(self.nominal),
            "joints": list(self.joints),
            "refine": self._refine,
        }
        return _json(spec)

    def _take(self, model: Model, summary: dict[str, Any], watch: _Watch) -> None:
        from ._data import CheckReport

        self.model_ = model
        self.summary_ = summary
        self.verdict_: str = summary["verdict"]
        self.assessment_ = Assessment(summary)
        self.check_: CheckReport = CheckReport(summary["check"])
        self.choices_: list[dict[str, Any]] = summary["choices"]
        self.history_ = watch.history
        self.coordinates_ = model.coordinates
        self.n_features_in_ = model.n

    def _warn(self) -> None:
        if self.summary_["ending"] == "interrupted":
            warnings.warn("the fit was interrupted: the best model until then is kept", FitInterrupted, stacklevel=3)
        if not self.summary_["improved"]:
            message = "the fit did not improve: check the data (lagrangian.check), take a smaller learning_rate or optimizer='adam'"
            warnings.warn(message, FitWarning, stacklevel=3)
        elif self.verdict_ == "poor":
            reason = self.assessment_.reasons[0]
            message = f"the model is poor: {reason['finding']}; {reason['remedy']}"
            warnings.warn(message, FitWarning, stacklevel=3)

    def predict(self, X: ArrayLike) -> NDArray[np.float64]:
        """Accelerations at states, shape ``(m, 2 n)`` for (q, q̇) or ``(m, 3 n)`` for (q, q̇, τ).

        >>> import lagrangian as lg
        >>> lg.Lnn().predict([[0.0, 1.0]])
        Traceback (most recent call last):
        lagrangian.errors.NotFitted: this Lnn has no model_ before it is fitted: call fit first
        """
        model, states = self.model_, _table(X, "X")
        n = model.n
        if states.shape[1] not in (2 * n, 3 * n):
            raise InvalidInput(
                f"X has shape {states.shape}: the model has {n} coordinates, give (m, {2 * n}) for (q, q̇) or (m, {3 * n}) for (q, q̇, τ)"
            )
        parts = np.split(states, states.shape[1] // n, 1)
        accelerations: NDArray[np.float64] = model.forward_dynamics(*parts)
        return accelerations

    def score(self, X: Any, y: ArrayLike | None = None) -> float:
        """The coefficient of determination R² of the accelerations, mean over the coordinates; 1 is perfect.

        Args:
            X: Trajectories, or states as for ``predict``.
            y: Accelerations of the states, shape ``(m, n)``.
        """
        if y is None and not _is_array(X):
            error = self.model_.score(X).score["acceleration"]
            if error is None:
                raise InvalidInput("the model has no forward dynamics: compare its torques, model_.score(X)")
            return 1.0 - float(np.mean(error["nmse"]))
        if y is None:
            raise InvalidInput("y is not given: give the accelerations of the states of X")
        truth, predicted = _table(y, "y"), self.predict(X)
        if truth.shape != predicted.shape:
            raise InvalidInput(f"y has shape {truth.shape}: give {predicted.shape}, a row for each state of X")
        residual = ((truth - predicted) ** 2).sum(0)
        total = ((truth - truth.mean(0)) ** 2).sum(0)
        return float(np.mean(1.0 - residual / np.where(total > 0.0, total, 1.0)))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the fitted model to a file; ``lagrangian.load`` reads it, and so does the command."""
        self.model_.save(path)

    def plot_loss(self, ax: Axes | None = None) -> Axes:
        """Draws the loss of training and validation over the steps."""
        from ._plot import plot_loss

        return plot_loss(self.history_, ax)

    def plot_parity(self, data: Any, ax: Axes | None = None) -> Axes:
        """Draws predicted over recorded accelerations."""
        from ._plot import plot_parity

        return plot_parity(self.model_, trajectories(data, "data"), ax)


#: The form of pickles.
_PICKLE = 1

#: The methods of a model that its estimator has as well.
_OF_MODELS = frozenset(
    (
        "forward_dynamics",
        "inverse_dynamics",
        "mass_matrix",
        "bias",
        "gravity",
        "energy",
        "momentum",
        "lagrangian",
        "rollout",
        "follow",
        "parameters",
        "plot_energy",
        "plot_torque",
        "torque_parts",
        "distance_from_data",
    )
)


def fit(
    data: Any,
    *,
    validation: Any = None,
    progress: bool | None = None,
    run: str | os.PathLike[str] | None = None,
    **settings: Any,
) -> Estimator:
    """Fits the best of several models to recordings.

    Where torques are recorded, the robot of ``urdf`` (if given), a chain of rigid bodies and a deep Lagrangian network are
    compared on held-out data; else a Lagrangian network is fitted. What is not given is chosen from the data, with reasons in
    ``choices_``.

    Args:
        data: Trajectories, as ``read`` returns them.
        validation: Trajectories to validate on; a part of the others is held back by default.
        progress: Whether to show a bar.
        run: The folder of a run, as ``Estimator.fit`` writes it.
        settings: Those of ``Best``.

    Returns:
        The fitted estimator.

    >>> import lagrangian as lg
    >>> swings = lg.simulate("pendulum", trajectories=10, duration=4.0, seed=1)
    >>> pendulum = lg.fit(swings, steps=100)
    >>> pendulum.verdict_
    'good'
    """
    from ._families import Best

    estimator: Estimator = Best(**settings)
    return estimator.fit(data, validation=validation, progress=progress, run=run)


def _same(value: Any, default: Any) -> bool:
    return value is default or (type(value) is type(default) and bool(np.all(value == default)))


def _json(settings: dict[str, Any]) -> str:
    try:
        return json.dumps(settings, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"the settings cannot be read ({error}): give finite numbers without quotes, names with them") from error


def _plain(value: Any) -> Any:
    """A value of a setting as JSON has it."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (tuple, set, frozenset)):
        return list(value)
    return value


def _is_array(X: Any) -> bool:
    if isinstance(X, (Trajectory, Trajectories)):
        return False
    if isinstance(X, (list, tuple)):
        return not any(isinstance(item, Trajectory) for item in X) and len(X) > 0
    return hasattr(X, "__array__") or hasattr(X, "shape")


def _table(values: Any, name: str) -> NDArray[np.float64]:
    table = _numbers(values, name)
    if table.ndim == 1 and name == "y":
        table = table.reshape(-1, 1)
    if table.ndim != 2 or 0 in table.shape:
        raise InvalidInput(f"{name} has shape {table.shape}: give a table with a row for each state")
    if not np.isfinite(table).all():
        raise InvalidInput(f"{name} contains NaN or infinity: remove or repair these rows")
    return table


class _Watch:
    """Shows the progress of a fit, keeps its history, calls callbacks."""

    def __init__(self, progress: bool | None, callbacks: Any, what: str) -> None:
        self.history: list[dict[str, Any]] = []
        self.callbacks = [callbacks] if callable(callbacks) else list(callbacks)
        self.what = what
        self.shown = (sys.stderr.isatty() or _in_notebook()) if progress is None else progress
        self.width = 0

    def begin(self, estimator: Estimator) -> None:
        """Tells callbacks that have a ``begin`` of the fit."""
        for callback in self.callbacks:
            if hasattr(callback, "begin"):
                callback.begin(estimator)

    def end(self, estimator: Estimator | None, run: str | os.PathLike[str] | None) -> None:
        """Tells callbacks that have an ``end`` how the fit ended: with an estimator, or with an exception."""
        for callback in self.callbacks:
            if hasattr(callback, "end"):
                callback.end(estimator, run)

    def __enter__(self) -> _Watch:
        return self

    def __exit__(self, *_: Any) -> None:
        if self.width:
            sys.stderr.write("\n")
            sys.stderr.flush()

    def tell(self, event: Mapping[str, Any]) -> None:
        if self.shown:
            self.show(event)
        if event.get("validation") is not None or "stage" not in event and event.get("share") == 1.0:
            self.history.append(dict(event))
            for callback in self.callbacks:
                callback(dict(event))

    def show(self, event: Mapping[str, Any]) -> None:
        share = min(max(float(event["share"]), 0.0), 1.0)
        bar = "█" * round(24 * share) + "░" * (24 - round(24 * share))
        if "stage" in event:
            words = str(event["stage"])
        else:
            words = f"step {event['step']}, loss {event['loss']:.2e}, {event['seconds']:.0f} s"
        line = f"{self.what} {bar} {100 * share:3.0f} % {words}"
        sys.stderr.write("\r" + line.ljust(self.width))
        sys.stderr.flush()
        self.width = len(line)


def _in_notebook() -> bool:
    shell = sys.modules.get("IPython")
    own = shell.get_ipython() if shell is not None else None
    return own is not None and type(own).__name__ == "ZMQInteractiveShell"
