"""Constraints between points, and the family that keeps them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import lagrangian as lg


def films(count: int = 6, noise: float = 1e-3) -> list[lg.Trajectory]:
    """Two marks of a double pendulum of unit rods and masses of 1 and 0.5 kg."""
    rng = np.random.default_rng(1)
    truth = lg.system("double-pendulum", mass2=0.5)
    found = []
    for _ in range(count):
        swing = truth.rollout(rng.uniform(-1.5, 1.5, 2), [0.0, 0.0], duration=3.0, step=0.02)
        x, y = np.cumsum(np.sin(swing.q), axis=1), -np.cumsum(np.cos(swing.q), axis=1)
        places = np.column_stack([x[:, 0], y[:, 0], x[:, 1], y[:, 1]])
        places += noise * rng.normal(size=places.shape)
        found.append(lg.Trajectory(q=places, t=swing.t, names=["x1", "y1", "x2", "y2"]))
    return found


def test_rods_are_found_and_kept_by_a_model_that_is_saved(tmp_path: Path) -> None:
    data = films()
    structure = lg.constraints(data)
    assert [own["kind"] for own in structure.constraints] == ["circle", "rod"]
    assert structure.degrees_of_freedom == 2
    assert "rod p1–p2" in str(structure)
    model = lg.Cartesian().fit(data).model_
    masses = [own["value"] for own in model.parameters if own["name"].startswith("mass")]
    assert masses[0] / masses[1] == pytest.approx(2.0, rel=0.02)
    start = data[0].q[0]
    away = model.rollout(start, np.zeros(4), duration=20.0, step=0.05)
    assert np.ptp(np.hypot(*(away.q[:, 2:] - away.q[:, :2]).T)) < 1e-9
    model.save(tmp_path / "rods.safetensors")
    again = lg.load(tmp_path / "rods.safetensors").rollout(start, np.zeros(4), duration=20.0, step=0.05)
    assert np.array_equal(again.q, away.q)


def test_points_are_named_by_coordinate_or_number() -> None:
    data = films(3)
    assert lg.constraints(data, points=[["x1", "y1"], [2, 3]]).degrees_of_freedom == 2
    with pytest.raises(lg.errors.InvalidInput, match="'z' is not a coordinate"):
        lg.constraints(data, points=[["x1", "z"]])
