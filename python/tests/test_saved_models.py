"""The reader of docs/saved-models.md says what the library says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lagrangian as lg

PAGE = Path(__file__).parents[2] / "docs" / "saved-models.md"


@pytest.fixture(scope="module")
def reader() -> dict[str, Any]:
    """The names of the page's program."""
    (program,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    names: dict[str, Any] = {}
    exec(program, names)
    return names


# Whether the fit is any good does not matter.
@pytest.mark.filterwarnings("ignore::lagrangian.errors.FitWarning")
@pytest.mark.parametrize("system", ["two-link-arm", "cart-pole"])
def test_the_reader_computes_the_same_mass_matrix_and_torques(reader: dict[str, Any], system: str, tmp_path: Path) -> None:
    motions = lg.simulate(system, trajectories=4, duration=2.0, step=0.02, drive=1.0, friction=0.1, seed=1)
    fitted = lg.Delan(width=16, steps=30, forces=["viscous", "coulomb", "rotor", "gains", "offset"], seed=2).fit(motions)
    path = tmp_path / "model.safetensors"
    fitted.model_.save(path)
    about, tensors = reader["read"](path)
    model, rng = lg.load(path), np.random.default_rng(1)
    for q, qd, qdd in rng.uniform(-2.0, 2.0, (20, 3, 2)):
        mass, _ = reader["mass_and_potential"](about, tensors, q + 0j)
        expected = model.mass_matrix(q)
        assert np.abs(mass.real - expected).max() <= 1e-12 * np.abs(expected).max()
        torque, expected = reader["inverse_dynamics"](about, tensors, q, qd, qdd), model.inverse_dynamics(q, qd, qdd)
        assert np.abs(torque - expected).max() <= 1e-12 * np.abs(expected).max()
