"""Laws as formulas, from Python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import lagrangian as lg


def swings(noise: float = 0.0) -> list[lg.Trajectory]:
    pendulum, rng = lg.system("pendulum"), np.random.default_rng(0)
    all_ = [pendulum.rollout([q], [0.0], duration=3.0, step=0.02) for q in (0.5, 1.0, 1.5, 2.0, 2.5, -1.2)]
    return [lg.Trajectory(q=s.q + noise * rng.normal(size=s.q.shape), t=s.t, angles="all") for s in all_]


@pytest.mark.parametrize("noise", [0.0, 2e-3])
def test_a_law_is_written_with_its_standard_errors(noise: float, tmp_path: Path) -> None:
    model = lg.Formula().fit(swings(noise)).model_
    law = model.law
    assert law is not None and law["verdict"] == "law" and r"\dot{q_{1}}^{2}" in law["latex"]
    terms = {p["name"]: p for p in model.parameters}
    assert set(terms) == {"q1'^2", "cos(q1)"}
    assert abs(terms["cos(q1)"]["value"] - 9.8) < max(1e-4, 5 * terms["cos(q1)"]["standard_error"])
    model.save(tmp_path / "law.safetensors")
    again = lg.load(tmp_path / "law.safetensors")
    assert again.law == law
    state = ([0.3], [1.0])
    assert again.forward_dynamics(*state) == model.forward_dynamics(*state)


def test_a_plain_fit_keeps_the_law_alone() -> None:
    model = lg.fit(swings(2e-3)).model_
    assert model.family == "formula" and model.law is not None and model.law["verdict"] == "law"


def test_other_models_have_no_law() -> None:
    assert lg.system("pendulum").law is None


def test_the_law_of_a_plain_network_is_found_in_its_motions() -> None:
    network = lg.Mlp(steps=400, seed=1).fit(swings()).model_
    law = network.formula().law
    assert law is not None and law["verdict"] == "law", law
    terms = {p["name"]: p["value"] for p in network.formula().parameters}
    assert terms["cos(q1)"] / terms["q1'^2"] == pytest.approx(19.6, rel=0.02)
    with pytest.raises(lg.LagrangianError, match="fitted"):
        lg.system("pendulum").formula()
