"""Run folders and what else a fit can leave behind."""

from __future__ import annotations

import time
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import lagrangian as lg

tomllib = pytest.importorskip("tomllib")


def small(**settings: Any) -> lg.Lnn:
    return lg.Lnn(width=8, steps=50, seed=1, **settings)


def test_a_fit_leaves_a_run_folder_that_the_command_reads(
    swings: lg.Trajectories, command: str, tmp_path: Path
) -> None:
    folder = tmp_path / "run"
    fitted = small().fit(swings, run=folder, tensorboard=True)
    names = {path.name for path in folder.iterdir()}
    assert {"run.toml", "metrics.jsonl", "checkpoint.safetensors", "model.safetensors", "report.html"} <= names
    assert any(name.startswith("events.out.tfevents.") for name in names)
    record = tomllib.loads((folder / "run.toml").read_text())
    assert record["seed"] == 1 and record["settings"]["asked"]["width"] == 8
    assert [data["role"] for data in record["data"]] == ["training"]
    assert fitted.model_.to_bytes() == lg.load(folder).to_bytes()
    assert small().fit(swings).predict([[1.0, 0.5]]) == fitted.predict([[1.0, 0.5]])
    shown = subprocess.run([command, "report", str(folder), "--out", str(tmp_path / "again.html")], capture_output=True)
    assert shown.returncode == 0, shown.stderr
    assert (tmp_path / "again.html").read_bytes() == (folder / "report.html").read_bytes()
    refused = subprocess.run([command, "fit", "--resume", "--out", str(folder)], capture_output=True, text=True)
    assert refused.returncode == 2 and "from Python" in refused.stderr


def test_the_same_model_as_in_the_run_folder_of_the_command(
    swings: lg.Trajectories, command: str, tmp_path: Path
) -> None:
    lg.write(tmp_path / "swings.csv", swings)
    line = "fit swings.csv --model lnn --width 8 --steps 50 --seed 1 --out theirs --quiet"
    subprocess.run([command, *line.split()], cwd=tmp_path, check=True, capture_output=True)
    small().fit(lg.read(tmp_path / "swings.csv"), run=tmp_path / "ours")
    ours, theirs = lg.load(tmp_path / "ours"), lg.load(tmp_path / "theirs")
    states = [[0.3, 0.1], [1.0, -2.0]]
    for q, qd in states:
        assert ours.forward_dynamics([q], [qd]) == theirs.forward_dynamics([q], [qd])
    own, other = (
        tomllib.loads((tmp_path / name / "run.toml").read_text())["resolved"] for name in ("ours", "theirs")
    )
    assert own["fit"] == other["fit"] and own["data"]["columns"] == other["data"]["columns"]


def test_a_run_folder_is_neither_mixed_nor_lost(swings: lg.Trajectories, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    small().fit(swings, run=folder)
    first = (folder / "model.safetensors").read_bytes()
    with pytest.raises(lg.errors.InvalidInput, match="give another `run`, `resume`"):
        small().fit(swings, run=folder)
    with pytest.raises(lg.errors.InvalidInput, match="began with other settings"):
        lg.Lnn(width=16, steps=50, seed=1).fit(swings, run=folder, resume=True)
    with pytest.raises(lg.errors.InvalidInput, match="no longer the file"):
        small().fit(swings[:5], run=folder, resume=True)
    assert (folder / "model.safetensors").read_bytes() == first
    small().fit(swings, run=folder, resume=True)
    small().fit(swings, run=folder, force=True)
    for wrong in ({"resume": True}, {"tensorboard": True}, {"run": folder, "resume": True, "force": True}):
        with pytest.raises(lg.errors.InvalidInput):
            small().fit(swings, **wrong)
    with pytest.raises(lg.errors.InvalidInput, match="no run to resume"):
        small().fit(swings, run=tmp_path / "none", resume=True)
    assert not (tmp_path / "none").exists()


def test_an_interrupted_run_goes_on_to_the_same_bits(swings: lg.Trajectories, tmp_path: Path) -> None:
    whole = small().fit(swings, run=tmp_path / "whole")

    def stop(event: dict[str, Any]) -> None:
        if event["step"] >= 25:
            raise KeyboardInterrupt

    with pytest.warns(lg.errors.FitInterrupted):
        small().fit(swings, run=tmp_path / "run", callbacks=stop)
    again = small().fit(swings, run=tmp_path / "run", resume=True)
    assert again.summary_["steps"] == 50
    assert again.predict([[1.0, 0.5]]) == whole.predict([[1.0, 0.5]])


def test_the_page_of_a_run_is_shown(swings: lg.Trajectories, tmp_path: Path) -> None:
    small().fit(swings, run=tmp_path / "run")
    page = lg.report(tmp_path / "run")
    assert page.path == tmp_path / "run" / "report.html" and page.path.read_text() == page.html
    shown = page._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and "<script" not in shown
    assert "lagrangian.load(" in page.html and "--follow" not in page.html
    page.path.unlink()
    assert lg.report(tmp_path / "run").html == page.html
    with pytest.raises(lg.errors.InvalidInput, match="not a run folder"):
        lg.report(tmp_path)


def test_a_folder_of_a_bag_is_read_like_a_file(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    with pytest.raises(OSError, match="metadata.yaml"):
        lg.read(tmp_path / "bag")
    (tmp_path / "bag" / "metadata.yaml").write_text("relative_file_paths:\n  - part.csv\n")
    (tmp_path / "bag" / "part.csv").write_text("t,q1\n0,0\n0.1,1\n0.2,2\n")
    [motion] = lg.read(tmp_path / "bag")
    assert motion.name == "part" and motion.q.shape == (3, 1)


@pytest.mark.parametrize("package, make", [("mlflow", lg.callbacks.MLflow), ("wandb", lg.callbacks.WandB)])
def test_a_callback_that_is_not_installed_names_its_extra(
    without: Callable[[str], None], package: str, make: Any
) -> None:
    without(package)
    with pytest.raises(lg.errors.MissingExtra, match=rf"lagrangian\[{package}\]"):
        make()


@pytest.mark.filterwarnings("ignore")
def test_mlflow_keeps_settings_losses_verdict_and_files(swings: lg.Trajectories, tmp_path: Path) -> None:
    pytest.importorskip("mlflow")
    from mlflow.tracking import MlflowClient

    uri = f"sqlite:///{tmp_path}/mlflow.db"
    client = MlflowClient(uri)
    client.create_experiment("swings", artifact_location=(tmp_path / "artifacts").as_uri())
    callback = lg.callbacks.MLflow("swings", tracking_uri=uri)
    small().fit(swings, run=tmp_path / "run", callbacks=callback)
    kept = client.get_run(callback.run_id)
    assert kept.info.status == "FINISHED" and kept.data.tags["verdict"] in ("good", "fair", "poor")
    assert kept.data.params["width"] == "8" and kept.data.metrics["acceleration_nmse"] >= 0.0
    steps = [metric.step for metric in client.get_metric_history(callback.run_id, "validation")]
    assert steps == [25, 50]
    assert {file.path for file in client.list_artifacts(callback.run_id)} == set(lg.callbacks._FILES)

    def fail(event: dict[str, Any]) -> None:
        raise KeyError("enough")

    with pytest.raises(KeyError):
        small().fit(swings, callbacks=[callback, fail])
    assert client.get_run(callback.run_id).info.status == "FAILED"


@pytest.mark.filterwarnings("ignore")
def test_wandb_keeps_a_run_offline(
    swings: lg.Trajectories, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("wandb")
    monkeypatch.setenv("WANDB_SILENT", "true")
    callback = lg.callbacks.WandB("swings", mode="offline", dir=str(tmp_path))
    small().fit(swings, run=tmp_path / "run", callbacks=callback)
    [log] = tmp_path.glob("wandb/offline-run-*/run-*.wandb")
    assert callback.run.id in log.name
    # Written by a process of its own, which may still be at it.
    deadline = time.monotonic() + 30.0
    while b"acceleration_nmse" not in log.read_bytes() and time.monotonic() < deadline:
        time.sleep(0.1)
    kept = log.read_bytes()
    assert all(word in kept for word in (b"acceleration_nmse", b"validation", b"verdict"))
