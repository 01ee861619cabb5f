"""Callbacks of ``fit`` that send its figures elsewhere: MLflow, Weights & Biases.

Each is given to ``fit`` as one of its ``callbacks``, and serves one fit after another::

    robot = lg.Lnn(steps=500).fit(swings, run="runs/first", callbacks=lg.callbacks.MLflow("swings"))
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import MissingExtra

if TYPE_CHECKING:
    from ._estimators import Estimator

__all__ = ["MLflow", "WandB"]

#: The figures of an event of a fit that change with its steps.
_FIGURES = ("loss", "validation", "rate")

#: The files of a run folder that are kept beside its figures.
_FILES = ("run.toml", "model.safetensors", "report.html")


def _figures(event: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(event[name]) for name in _FIGURES if event.get(name) is not None}


def _verdict(estimator: Estimator) -> dict[str, float]:
    score = estimator.summary_["score"]
    named = ((name, score[name]) for name in ("acceleration", "torque"))
    return {f"{name}_nmse": sum(e["nmse"]) / len(e["nmse"]) for name, e in named if e is not None}


def _files(run: str | os.PathLike[str] | None) -> list[Path]:
    if run is None:
        return []
    return [path for path in (Path(run) / name for name in _FILES) if path.is_file()]


class MLflow:
    """Settings, losses, verdict, and the files of the run folder where there is one, as a run of MLflow.

    Args:
        experiment: The name of the experiment.
        run_name: The name of each run; MLflow chooses one by default.
        tracking_uri: Where to: a server, or ``sqlite:///mlflow.db``; as MLflow is configured by default.

    Raises:
        MissingExtra: MLflow is not installed.
    """

    def __init__(
        self,
        experiment: str | None = None,
        *,
        run_name: str | None = None,
        tracking_uri: str | None = None,
    ) -> None:
        try:
            from mlflow.tracking import MlflowClient
        except ImportError as error:
            raise MissingExtra("MLflow is not installed: pip install lagrangian[mlflow]") from error
        self._client: Any = MlflowClient(tracking_uri=tracking_uri)
        self._experiment = experiment
        self._name = run_name
        self.run_id: str | None = None

    def begin(self, estimator: Estimator) -> None:
        run = self._client.create_run(self._experiment_id(), run_name=self._name)
        self.run_id = run.info.run_id
        self._client.log_param(self.run_id, "family", estimator.family or "best")
        for name, value in estimator.get_params().items():
            if value is not None:
                # MLflow refuses longer values, such as the text of a robot.
                self._client.log_param(self.run_id, name, str(value)[:500])

    def _experiment_id(self) -> str:
        if self._experiment is None:
            return "0"
        known = self._client.get_experiment_by_name(self._experiment)
        own = self._client.create_experiment(self._experiment) if known is None else known.experiment_id
        return str(own)

    def __call__(self, event: Mapping[str, Any]) -> None:
        for name, value in _figures(event).items():
            self._client.log_metric(self.run_id, name, value, step=int(event["step"]))

    def end(self, estimator: Estimator | None, run: str | os.PathLike[str] | None) -> None:
        if estimator is not None:
            for name, value in _verdict(estimator).items():
                self._client.log_metric(self.run_id, name, value)
            self._client.set_tag(self.run_id, "verdict", estimator.verdict_)
            for path in _files(run):
                self._client.log_artifact(self.run_id, str(path))
        self._client.set_terminated(self.run_id, "FINISHED" if estimator is not None else "FAILED")


class WandB:
    """Settings, losses, verdict, and the files of the run folder where there is one, as a run of Weights & Biases.

    Args:
        project: The name of the project.
        settings: Further arguments of ``wandb.init``, such as ``mode="offline"``.

    Raises:
        MissingExtra: wandb is not installed.
    """

    def __init__(self, project: str | None = None, **settings: Any) -> None:
        try:
            import wandb
        except ImportError as error:
            raise MissingExtra("Weights & Biases is not installed: pip install lagrangian[wandb]") from error
        self._wandb: Any = wandb
        self._settings = {"project": project, **settings}
        self.run: Any = None

    def begin(self, estimator: Estimator) -> None:
        given = {name: value for name, value in estimator.get_params().items() if value is not None}
        config = {"family": estimator.family or "best", **given}
        self.run = self._wandb.init(config=config, reinit="create_new", **self._settings)

    def __call__(self, event: Mapping[str, Any]) -> None:
        self.run.log(_figures(event), step=int(event["step"]))

    def end(self, estimator: Estimator | None, run: str | os.PathLike[str] | None) -> None:
        if estimator is not None:
            self.run.summary.update({"verdict": estimator.verdict_, **_verdict(estimator)})
            for path in _files(run):
                self.run.save(str(path), base_path=str(path.parent), policy="now")
        self.run.finish(exit_code=0 if estimator is not None else 1)
