"""Recordings from files, tables, arrays and known systems."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest

import lagrangian as lg


def test_arrays_are_kept_without_a_copy_where_they_can_be() -> None:
    q = np.zeros((5, 2))
    motion = lg.Trajectory(np.arange(5.0), q, names=["a", "b"], angles=["b"])
    assert motion.q is q
    assert motion.n == 2 and len(motion) == 5 and motion.duration == 4.0
    assert motion.coordinates[1] == ("b", "rad", "circle")
    assert lg.Trajectory(np.arange(5), q[::1, 0]).q.shape == (5, 1)


def test_a_slice_is_a_trajectory_and_a_copy_is_equal() -> None:
    motion = lg.simulate("double-pendulum", duration=1.0)[0]
    part = motion[10:20]
    assert len(part) == 10 and part.qdd is not None and np.array_equal(part.q, motion.q[10:20])
    assert pickle.loads(pickle.dumps(motion)) == motion == copy.deepcopy(motion)
    assert part != motion
    with pytest.raises(TypeError, match="slice"):
        motion[3]  # type: ignore[index]


@pytest.mark.parametrize("extension", ["csv", "npz", "parquet"])
def test_files_keep_every_bit(tmp_path: Path, extension: str) -> None:
    motions = lg.simulate("double-pendulum", trajectories=3, duration=1.0, drive=2.0, seed=4)
    path = tmp_path / f"motions.{extension}"
    lg.write(path, motions)
    again = lg.read(path)
    assert list(again) == list(motions)
    assert "angle" in again.layout


@pytest.mark.parametrize("kind", ["pandas", "polars", "arrow", "mapping"])
def test_tables_are_read_like_files(kind: str) -> None:
    pendulum = lg.simulate("pendulum", trajectories=2, duration=0.5, seed=4)
    columns = {
        "run": np.repeat(["first", "second"], 51),
        "time": np.concatenate([m.t for m in pendulum]),
        "theta": np.rad2deg(np.concatenate([m.q[:, 0] for m in pendulum])),
        "spare": np.zeros(102),
    }
    table: object = columns
    if kind != "mapping":
        library = pytest.importorskip({"arrow": "pyarrow"}.get(kind, kind))
        table = library.table(columns) if kind == "arrow" else library.DataFrame(columns)
    motions = lg.read(
        table, trajectory="run", time="time", q="theta", angles="theta", degrees=True
    )
    assert [m.name for m in motions] == ["first", "second"]
    assert np.allclose(motions[1].q, pendulum[1].q, atol=1e-12)
    assert motions.notes == ["columns not used: spare"]


def test_a_frame_has_the_columns_of_a_file() -> None:
    pytest.importorskip("pandas")
    frame = lg.simulate("pendulum", duration=0.1)[0].to_pandas()
    assert list(frame.columns) == ["t", "q1", "qd1", "qdd1"]


def test_a_layout_beside_the_file_speaks_for_it(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,x\n0,1\n0.1,2\n0.2,4\n")
    (tmp_path / "log.toml").write_text('[columns]\nt = "time"\nq = "x"\n[units]\nx = "m"\n')
    [motion] = lg.read(tmp_path / "log.csv")
    assert motion.coordinates == (("x", "m", "line"),)


def test_a_check_names_what_is_wrong() -> None:
    good = lg.simulate("pendulum", trajectories=5, duration=4.0, seed=2)
    assert lg.check(good).passed
    bad = [lg.Trajectory(m.t, m.q, np.rad2deg(m.qd), angles="all", name=m.name) for m in good]
    report = lg.check(bad)
    assert report.verdict == "fail" and "degrees" in str(report)
    assert report.problems[0].remedy
    assert "<table>" in report._repr_html_() and "fail" in report._repr_html_()
    with pytest.raises(lg.errors.DataError, match="degrees"):
        lg.Lnn(steps=1).fit(bad)


def test_known_systems_and_their_parameters() -> None:
    names = [s["name"] for s in lg.systems()]
    assert {"pendulum", "double-pendulum", "cart-pole"} <= set(names)
    short, long = (lg.system("pendulum", length=length) for length in (0.5, 2.0))
    assert short.mass_matrix([0.0]) < long.mass_matrix([0.0])
    with pytest.raises(lg.errors.InvalidInput, match="choose one of"):
        lg.system("pendulumm")
    with pytest.raises(lg.errors.InvalidInput, match="mass"):
        lg.system("pendulum", weight=1.0)
    assert pickle.loads(pickle.dumps(long)).mass_matrix([0.0]) == long.mass_matrix([0.0])


def test_of_many_motions_each_problem_is_said_once_and_those_of_one_name_are_numbered() -> None:
    t = np.linspace(0.0, 2.0, 201)
    pairs = [(np.sin(k * t), np.rad2deg(k * np.cos(k * t))) for k in range(4, 10)]
    motions = [lg.Trajectory(t, q, qd, angles="all") for q, qd in pairs]
    report = lg.check(motions)
    assert {item.trajectory for item in report.items} == {None, *(f"motion {k}" for k in range(1, 7))}
    assert motions[0].name == "motion"
    text = str(report)
    assert text.count("\n") < 25, text
    assert "(alike in 5 more)" in text
    assert "and 5 more" in report._repr_html_()
    few = lg.check(motions[:2])
    assert all(repr(item) in str(few) for item in few.items)


def test_a_column_may_have_any_name() -> None:
    [swing] = lg.read({"t": [0.0, 0.1, 0.2], "file": [0.0, 0.1, 0.2]}, q="file")
    assert swing.coordinates[0].name == "file" and swing.q.shape == (3, 1)
