"""Sweeps: units of work that may be divided, interrupted and repeated."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import lagrangian as lg
from lagrangian import sweep

#: Four fits of a pendulum.
PLAN = """\
[data]
files = ["a.csv"]
layout = { angle = "all" }

[fixed]
model = "lnn"
steps = 30

[space]
width = [4, 6]
seed = [1, 2]
"""
SPACE = {"width": [4, 6], "seed": [1, 2]}


def models(folder: Path) -> dict[str, bytes]:
    return {path.parent.name: path.read_bytes() for path in folder.glob("*/model.safetensors")}


def program(*arguments: str, folder: Path) -> subprocess.Popen[str]:
    words = [sys.executable, "-m", "lagrangian.sweep", *arguments]
    own = {**os.environ, "PYTHONPATH": str(Path(lg.__file__).parents[1])}
    return subprocess.Popen(words, cwd=folder, env=own, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def ran(*arguments: str, folder: Path) -> tuple[int, str, str]:
    process = program(*arguments, folder=folder)
    out, err = process.communicate(timeout=300)
    return process.returncode, out, err


@pytest.fixture(scope="module")
def few() -> lg.Trajectories:
    return lg.simulate("pendulum", trajectories=4, duration=2.0, step=0.02, seed=1)


@pytest.fixture
def planned(few: lg.Trajectories, tmp_path: Path) -> Callable[[str], Path]:
    """Writes a plan beside its data."""
    lg.write(tmp_path / "a.csv", few)

    def write(text: str) -> Path:
        (tmp_path / "plan.toml").write_text(text)
        return tmp_path / "plan.toml"

    return write


@pytest.fixture(scope="module")
def alone(few: lg.Trajectories, tmp_path_factory: pytest.TempPathFactory) -> sweep.Results:
    """The sweep in this process."""
    return sweep.run(sweep.Plan(lg.Lnn(steps=30), SPACE, few), tmp_path_factory.mktemp("sweep"))


def test_a_grid_is_a_table_and_its_best_model_is_loaded(alone: sweep.Results) -> None:
    assert [tuple(row["settings"].values()) for row in alone.rows] == [(1, 4), (1, 6), (2, 4), (2, 6)]
    assert alone.best is not None and alone.best["error"] == min(row["error"] for row in alone.rows)
    assert alone.model.to_bytes() == models(alone.folder)[alone.best["unit"]]
    assert str(alone).startswith(alone.best["unit"]) and "4 of 4 units are done, 0 failed" in str(alone)
    head, *rows = (alone.folder / "results.csv").read_text().splitlines()
    assert head == "unit,seed,width,verdict,error,loss,steps,family,failure" and len(rows) == 4
    assert lg.report(alone.folder / alone.best["unit"]).path.is_file()


def test_what_has_ended_is_not_done_again(alone: sweep.Results, few: lg.Trajectories) -> None:
    before = {path: path.stat().st_mtime_ns for path in alone.folder.glob("*/*")}
    again = sweep.run(sweep.Plan({"model": "lnn", "steps": 30}, SPACE, few), alone.folder)
    assert again.rows == alone.rows
    assert {path: path.stat().st_mtime_ns for path in alone.folder.glob("*/*")} == before


def test_a_plan_has_the_same_units_in_its_file_and_in_python(alone: sweep.Results, planned: Callable[[str], Path]) -> None:
    path = planned(PLAN)
    code, listed, _ = ran(path.name, "--dry-run", folder=path.parent)
    assert code == 0 and not (path.parent / "runs").exists(), "nothing is done"
    in_python = sweep.Plan(lg.Lnn(steps=30), SPACE, lg.read(path.parent / "a.csv", layout='angle = "all"'))
    assert [line.split()[0] for line in listed.splitlines()] == list(in_python.units)
    # The name of a unit depends on how angles were declared, since a model remembers it.
    other = sweep.Plan.read(planned(PLAN.replace('"all"', '["q1"]')))
    assert not set(other.units) & set(in_python.units)
    assert len(sweep.Plan.read(planned(PLAN.replace("[4, 6]", "[4, 4]"))).units) == 2


def test_parts_by_several_workers_give_the_table_and_the_models_of_one_process(planned: Callable[[str], Path]) -> None:
    path = planned(PLAN)
    whole = sweep.run(path, path.parent / "whole")
    for part in ("2/2", "1/2"):
        code, _, err = ran(path.name, "--out", "parts", "--unit", part, "--workers", "2", folder=path.parent)
        assert code == 0 and err.count("unit ") == 2, err
    table = [(path.parent / name / "results.csv").read_text() for name in ("whole", "parts")]
    assert table[0] == table[1] and len(whole.rows) == 4
    assert models(path.parent / "whole") == models(path.parent / "parts")


def test_two_programs_at_once_in_one_folder_do_each_unit_once(planned: Callable[[str], Path]) -> None:
    path = planned(PLAN.replace("steps = 30", "steps = 200"))
    both = [program(path.name, "--out", "s", folder=path.parent) for _ in range(2)]
    for process in both:
        _, err = process.communicate(timeout=300)
        assert process.returncode == 0, err
    found = sweep.run(path, path.parent / "s")
    assert all(row["steps"] == 200 for row in found.rows) and not found.failed
    assert models(path.parent / "s") == models(sweep.run(path, path.parent / "alone").folder)


@pytest.mark.parametrize("workers", ["1", "2"])
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_sweep_that_was_ended_resumes_to_the_same_bits(planned: Callable[[str], Path], how: signal.Signals, workers: str) -> None:
    path = planned(PLAN.replace("steps = 30", "steps = 600").replace("[1, 2]", "[1]"))
    folder = path.parent / "s"
    process = program(path.name, "--out", "s", "--workers", workers, folder=path.parent)
    until = time.monotonic() + 60
    while not list(folder.glob("*/metrics.jsonl")) and time.monotonic() < until:
        time.sleep(0.01)
    process.send_signal(how)
    _, err = process.communicate(timeout=60)
    if how == signal.SIGINT:
        assert process.returncode == 130 and "resumes" in err, err
    until = time.monotonic() + 60
    while "another process" in (ended := ran(path.name, "--out", "s", folder=path.parent))[2] and time.monotonic() < until:
        time.sleep(0.2)
    assert ended[0] == 0, ended
    assert models(folder) == models(sweep.run(path, path.parent / "whole").folder)


def test_a_unit_without_a_model_that_can_be_read_is_done_again(planned: Callable[[str], Path]) -> None:
    path = planned(PLAN)
    done = sweep.run(path, path.parent / "s")
    before = models(done.folder)
    removed, damaged, cut = (done.folder / row["unit"] for row in done.rows[:3])
    (removed / "model.safetensors").unlink()
    (damaged / "model.safetensors").write_bytes(before[damaged.name][:-40])
    (cut / "result.json").write_text("{")
    assert [("steps" in row) for row in sweep.results(path, done.folder).rows] == [False, False, False, True]
    assert sweep.run(path, done.folder).rows == done.rows
    assert models(done.folder) == before


def test_a_unit_that_fails_is_in_the_table_and_is_tried_again(planned: Callable[[str], Path]) -> None:
    path = planned(PLAN.replace('model = "lnn"', "").replace("width = [4, 6]", 'model = ["hnn", "lnn"]'))
    code, table, err = ran(path.name, "--out", "s", folder=path.parent)
    assert code == 1 and table.count("failed: ") == 2 and "2 of 4 units are done, 2 failed" in table, err
    assert table.index("error ") < table.index("failed: "), "the best are first"
    found = sweep.results(path, path.parent / "s")
    assert [row["settings"]["model"] for row in found.failed] == ["hnn", "hnn"] and found.best["settings"]["model"] == "lnn"
    again: list[str] = []
    sweep.run(path, path.parent / "s", tell=again.append)
    assert sum("failed" in line for line in again) == 2
    # A part without these units does not fail.
    assert ran(path.name, "--out", "s", "--unit", "3/4", folder=path.parent)[0] == 0


def test_data_that_changed_since_the_sweep_began_are_named(planned: Callable[[str], Path], few: lg.Trajectories) -> None:
    path = planned(PLAN)
    sweep.run(path, path.parent / "s", unit=(1, 4))
    lg.write(path.parent / "a.csv", few[:3])
    with pytest.raises(lg.errors.InvalidInput, match=r"a.csv' changed since the sweep"):
        sweep.run(path, path.parent / "s")
    (path.parent / "s" / "sweep.json").write_text("[]")
    with pytest.raises(lg.errors.InvalidInput, match="remove that one"):
        sweep.run(path, path.parent / "s")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("width", "widht", "did you mean 'width'?"),
        ("[4, 6]", "[]", "the list is empty"),
        ("[4, 6]", "4", "a list of values, or a range"),
        ("[4, 6]", '"ab"', "a list of values, or a range"),
        ("[4, 6]", "[0]", "`width` is 0"),
        ("[4, 6]", "[1e999]", "finite numbers"),
        ("[4, 6]", "[nan]", "finite numbers"),
        ("[4, 6]", "[99999999999999999999]", "`width` is"),
        ("[4, 6]", "[1979-05-27]", "cannot be read"),
        ("[4, 6]", "{ from = 1, to = 4 }", 'method = "random"'),
        ("[4, 6]", "{ from = 4, to = 1 }", "'from' below 'to'"),
        ("[4, 6]", "{ from = 0, to = 1, log = true }", "begins above 0"),
        ("[4, 6]", "{ from = 0.5, to = 3, whole = true }", "whole ends"),
        ("[4, 6]", "{ from = 1, to = inf }", "two numbers"),
        ("[4, 6]", "{ form = 1, to = 4 }", "give a range as"),
        ("[1, 2]", str(list(range(60_000))), "120000 units"),
        ("seed = [1, 2]", "[search]\nmethod = 'random'", "no number of units"),
        ("seed = [1, 2]", "[search]\nmethod = 'random'\nnumber = 1000000000000", "at most 100000"),
        ("seed = [1, 2]", "[search]\nmethod = 'annealing'", "'grid' or 'random'"),
        ("seed = [1, 2]", "[search]\nnumbre = 3", "did you mean 'number'?"),
        ('["a.csv"]', "[]", "names no files"),
        ('["a.csv"]', '"a.csv"', "give a list of names"),
        ('["a.csv"]', '3', "give a list of names"),
        ('["a.csv"]', '["b.csv"]', "b.csv"),
        ('{ angle = "all" }', "3", "write it as a table"),
        ("layout", "rows = 0\nlayout", "1 or more"),
        ("layout", "rows = -10000000000000000000000\nlayout", "rows"),
        ("layout", "rows = 'x'\nlayout", "rows"),
        ("steps = 30", "width = 3", "both fixed and varied"),
        ("steps = 30", "steps = 'many'", "steps"),
        ("steps = 30", "joints = 3", "cannot be read"),
        ("steps = 30", "smooth = 3", "smooth is true or false"),
        ("steps = 30", "steps = 30\nseconds = 1.0", "give one of them"),
        ('"lnn"', '"lmn"', "did you mean 'lnn'?"),
        ("[space]", "[spaec]", "did you mean 'space'?"),
        ("angle", "angel", "angel"),
        ("[data]", "[", "plan.toml"),
        ("[data]", "x = " + "[" * 5000 + "\n[data]", "plan.toml"),
    ],
)
def test_a_bad_plan_says_what_to_change(planned: Callable[[str], Path], old: str, new: str, words: str) -> None:
    path = planned(PLAN.replace(old, new))
    with pytest.raises((lg.LagrangianError, OSError)) as refused:
        sweep.run(path, path.parent / "s")
    assert words in str(refused.value)
    assert not (path.parent / "s").exists()


def test_wrong_arguments_are_refused_with_exit_code_2(planned: Callable[[str], Path]) -> None:
    path = planned(PLAN)
    for words in (["missing.toml"], ["."], ["plan.toml", "--unit", "5/4"], ["plan.toml", "--unit", "x"], ["plan.toml", "--workers", "0"]):
        code, _, err = ran(*words, folder=path.parent)
        assert code == 2 and "error: " in err and "Traceback" not in err, err
    assert not (path.parent / "runs").exists()


def test_random_draws_fill_their_ranges_and_do_not_depend_on_their_number(few: lg.Trajectories) -> None:
    space = {
        "learning_rate": {"from": 1e-3, "to": 1e-1, "log": True},
        "layers": {"from": 1, "to": 3, "whole": True},
        "form": ["convex", "free"],
    }

    def drawn(number: int, **others: Any) -> list[dict[str, Any]]:
        plan = sweep.Plan(lg.Lnn(steps=5, width=16), space, few, method="random", number=number, **others)
        return [unit.varied for unit in plan.units.values()]

    points = drawn(300, seed=7)
    assert points[:10] == drawn(10, seed=7) != drawn(10, seed=8)
    rates = [point["learning_rate"] for point in points]
    assert all(1e-3 <= rate <= 1e-1 for rate in rates) and 100 < sum(rate < 1e-2 for rate in rates) < 200
    assert {point["layers"] for point in points} == {1, 2, 3} and {point["form"] for point in points} == {"convex", "free"}


def test_a_setting_with_the_name_of_a_result_keeps_its_value(few: lg.Trajectories, tmp_path: Path) -> None:
    losses = ["acceleration", "acceleration-l1"]
    found = sweep.run(sweep.Plan(lg.Lnn(steps=3, width=4), {"loss": losses}, few), tmp_path)
    assert [row["settings"]["loss"] for row in found.rows] == losses and isinstance(found.rows[0]["loss"], float)
    assert [line.split(",")[1] for line in (tmp_path / "results.csv").read_text().splitlines()] == ["loss", *losses]


def test_short_fits_for_tests_are_other_units(few: lg.Trajectories, monkeypatch: pytest.MonkeyPatch) -> None:
    names = set(sweep.Plan(lg.Lnn(steps=30), SPACE, few).units)
    monkeypatch.setenv("LAGRANGIAN_QUICK", "0.5")
    quick = sweep.Plan(lg.Lnn(steps=30), SPACE, few)
    assert all(unit.estimator.seconds == 0.5 and unit.estimator.steps is None for unit in quick.units.values())
    assert not names & set(quick.units)
    monkeypatch.setenv("LAGRANGIAN_QUICK", "soon")
    with pytest.raises(lg.errors.InvalidInput, match="LAGRANGIAN_QUICK"):
        sweep.Plan(lg.Lnn(steps=30), SPACE, few)


def test_an_objective_is_the_error_of_a_unit_and_nan_of_one_that_fails(alone: sweep.Results, few: lg.Trajectories) -> None:
    error = sweep.objective(sweep.Plan(lg.Lnn(steps=30), {}, few), alone.folder)
    assert [error(row["settings"]) for row in alone.rows] == [row["error"] for row in alone.rows]
    assert math.isnan(error({"loss": "torque"}))
    with pytest.raises(lg.errors.InvalidInput, match="did you mean 'width'"):
        error({"widht": 3})


@pytest.mark.filterwarnings("ignore")
def test_ray_runs_units_as_tasks(alone: sweep.Results, few: lg.Trajectories, tmp_path: Path) -> None:
    ray = pytest.importorskip("ray")
    plan = sweep.Plan(lg.Lnn(steps=30), SPACE, few)
    ray.init(num_cpus=2, log_to_driver=False)
    try:
        shared, count = ray.put(plan), len(plan.units)
        task = ray.remote(num_cpus=1, max_retries=3)(sweep.run)
        ray.get([task.remote(shared, tmp_path, unit=(k, count)) for k in range(1, count + 1)])
    finally:
        ray.shutdown()
    assert sweep.results(plan, tmp_path).rows == alone.rows
    assert models(tmp_path) == models(alone.folder)


def test_the_record_of_a_run_and_its_result_say_which_unit_it_is(alone: sweep.Results) -> None:
    folder = alone.folder / alone.rows[0]["unit"]
    text = (folder / "run.toml").read_text()
    assert f'command = "unit {folder.name}"' in text and f'unit = "{folder.name}"' in text
    assert set(json.loads((folder / "result.json").read_text())) == {"family", "verdict", "error", "loss", "steps", "failure"}
