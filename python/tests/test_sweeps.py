"""Sweeps: the same units on this machine, on a cluster, and by the command."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import lagrangian as lg

SPACE = {"width": [4, 6], "seed": [1, 2]}


def models(folder: Path) -> dict[str, bytes]:
    return {path.parent.name: path.read_bytes() for path in folder.glob("*/model.safetensors")}


@pytest.fixture(scope="module")
def few() -> lg.Trajectories:
    return lg.simulate("pendulum", trajectories=4, duration=2.0, step=0.02, seed=1)


@pytest.fixture(scope="module")
def alone(few: lg.Trajectories, tmp_path_factory: pytest.TempPathFactory) -> lg.Sweep:
    """The sweep on this machine."""
    return lg.sweep(lg.Lnn(steps=30), SPACE, few, run=tmp_path_factory.mktemp("sweep"))


def test_a_grid_is_a_table_and_its_best_model_is_loaded(alone: lg.Sweep) -> None:
    pytest.importorskip("pandas")
    table = alone.table
    assert list(table["width"]) == [4, 6, 4, 6] and list(table["seed"]) == [1, 1, 2, 2]
    assert alone.best is not None and alone.best["error"] == table["error"].min()
    assert alone.model.to_bytes() == models(alone.folder)[alone.best["unit"]]
    assert "4 of 4" in repr(alone)
    assert lg.report(alone.folder / alone.best["unit"]).path.is_file()


def test_what_has_ended_is_not_done_again(alone: lg.Sweep, few: lg.Trajectories) -> None:
    before = {path: path.stat().st_mtime_ns for path in alone.folder.glob("*/*")}
    again = lg.sweep(lg.Lnn(steps=30), SPACE, few, run=alone.folder)
    assert again.results == alone.results
    assert {path: path.stat().st_mtime_ns for path in alone.folder.glob("*/*")} == before


def test_the_same_units_as_those_of_the_command(few: lg.Trajectories, command: str, tmp_path: Path) -> None:
    lg.write(tmp_path / "few.csv", few)
    (tmp_path / "plan.toml").write_text(
        '[data]\nfiles = ["few.csv"]\n[fixed]\nmodel = "lnn"\nsteps = 30\n[space]\nwidth = [4, 6]\nseed = [1, 2]\n'
    )
    subprocess.run([command, "sweep", "plan.toml", "--out", "theirs", "--quiet"], cwd=tmp_path, check=True)
    ours = lg.sweep(lg.Lnn(steps=30), SPACE, lg.read(tmp_path / "few.csv"), run=tmp_path / "ours")
    assert models(tmp_path / "ours") == models(tmp_path / "theirs")
    own, other = ((tmp_path / name / "results.csv").read_text() for name in ("ours", "theirs"))
    assert sorted(own.splitlines()[1:]) == sorted(other.splitlines()[1:])
    assert len(ours.results) == 4


def test_wrong_spaces_and_changed_data_are_refused(alone: lg.Sweep, few: lg.Trajectories, tmp_path: Path) -> None:
    def refused(words: str, space: dict[str, Any], **others: Any) -> None:
        with pytest.raises(lg.errors.InvalidInput, match=words):
            lg.sweep(lg.Lnn(steps=5), space, few, **{"run": tmp_path / "s", **others})

    refused("did you mean 'width'", {"widht": [3]})
    refused("list is empty", {"width": []})
    refused("a grid has lists", {"width": lg.Range(4, 8, whole=True)})
    refused("no number", {"width": [4]}, method="random")
    refused("choose 'grid'", {"width": [4]}, method="annealing")
    refused("choose 'local'", {"width": [4]}, executor="dask")
    with pytest.raises(lg.errors.InvalidInput, match="changed since"):
        lg.sweep(lg.Lnn(steps=30), SPACE, few[:3], run=alone.folder)


def test_ray_and_optuna_that_are_missing_name_their_extras(
    few: lg.Trajectories, tmp_path: Path, without: Callable[[str], None]
) -> None:
    for package, how in (("ray", {"executor": "ray"}), ("optuna", {"method": "optuna", "number": 2})):
        without(package)
        with pytest.raises(lg.errors.MissingExtra, match=rf"lagrangian\[{package}\]"):
            lg.sweep(lg.Lnn(steps=5), {"width": [4]}, few, run=tmp_path, **how)


@pytest.mark.filterwarnings("ignore")
def test_optuna_searches_a_range(few: lg.Trajectories, tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    space = {"learning_rate": lg.Range(1e-3, 1e-1, log=True), "width": [4, 6]}
    found = lg.sweep(lg.Lnn(steps=10), space, few, run=tmp_path, method="optuna", number=4, seed=3)
    assert 1 <= len(found.results) <= 4
    assert all(1e-3 <= row["learning_rate"] <= 1e-1 for row in found.results)


@pytest.mark.filterwarnings("ignore")
def test_optuna_on_a_cluster_asks_for_several_trials_at_a_time(few: lg.Trajectories, tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    ray = pytest.importorskip("ray")
    space = {"learning_rate": lg.Range(1e-3, 1e-1, log=True), "width": [4, 6]}

    def found(name: str, **how: Any) -> lg.Sweep:
        return lg.sweep(lg.Lnn(steps=10), space, few, run=tmp_path / name, method="optuna", number=6, seed=3, **how)

    ray.init(num_cpus=2, log_to_driver=False)
    try:
        several = found("several", executor="ray")
        one = found("one", executor="ray", parallel=1)
    finally:
        ray.shutdown()
    assert 1 <= len(several.results) <= 6 and several.best is not None
    # One trial at a time is what this machine does alone: the same trials, to the same bits.
    alone = found("alone")
    assert one.results == alone.results
    assert models(tmp_path / "one") == models(tmp_path / "alone")
    with pytest.raises(lg.errors.InvalidInput, match="parallel"):
        found("wrong", parallel=2)


@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_loses_a_machine_gives_the_same_bits(few: lg.Trajectories, tmp_path: Path) -> None:
    ray = pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    estimator = lg.Lnn(steps=400, width=8)
    space = {"seed": [1, 2, 3, 4, 5, 6]}
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    try:
        lost = cluster.add_node(num_cpus=1)
        ray.init(address=cluster.address, log_to_driver=False)
        folder = tmp_path / "cluster"

        def kill() -> None:
            while len(list(folder.glob("*/result.json"))) < 2:
                time.sleep(0.05)
            cluster.remove_node(lost)

        killer = threading.Thread(target=kill)
        killer.start()
        spread = lg.sweep(estimator, space, few, run=folder, executor="ray")
        killer.join()
    finally:
        ray.shutdown()
        cluster.shutdown()
    alone = lg.sweep(estimator, space, few, run=tmp_path / "alone")
    assert spread.results == alone.results and len(spread.results) == 6
    assert models(folder) == models(tmp_path / "alone")
