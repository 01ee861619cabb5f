"""One law of many sites, and the family that finds it."""

from __future__ import annotations

import numpy as np
import pytest

import lagrangian as lg

SITES = 14


def accelerations(q: np.ndarray) -> np.ndarray:
    """A ring of unit masses whose springs pull by 2 s + s³."""
    stretch = np.roll(q, -1) - q
    pull = 2.0 * stretch + stretch**3
    return pull - np.roll(pull, 1)


def motions(count: int = 6, noise: float = 3e-4) -> list[lg.Trajectory]:
    rng = np.random.default_rng(3)
    found = []
    for _ in range(count):
        q, qd = rng.normal(scale=0.4, size=(2, SITES))
        rows, h = [], 0.002
        for _ in range(250):
            rows.append(q.copy())
            for _ in range(10):
                qd = qd + h / 2 * accelerations(q)
                q = q + h * qd
                qd = qd + h / 2 * accelerations(q)
        places = np.array(rows) + noise * rng.normal(size=(250, SITES))
        found.append(lg.Trajectory(q=places, t=0.02 * np.arange(250)))
    return found


def test_a_plain_fit_takes_the_law_of_a_ring_which_holds_for_more_sites() -> None:
    model = lg.fit(motions()).model_
    law = model.law
    assert law is not None and law["verdict"] == "law", law
    values = [own["value"] for own in model.parameters]
    assert values == pytest.approx([1.0, 0.25], rel=0.02), law
    more = model.with_sites(50)
    q = 0.3 * np.sin(np.arange(50.0))
    own = more.forward_dynamics(q, np.zeros(50))
    stretch = np.roll(q, -1) - q
    pull = 2.0 * stretch + stretch**3
    assert own == pytest.approx(pull - np.roll(pull, 1), abs=0.01)
    with pytest.raises(lg.LagrangianError, match="sites"):
        model.with_sites(1)


def test_neighbours_and_ends_may_be_given_and_are_checked() -> None:
    fit = lg.Lattice(neighbours=[1], ends="ring").fit(motions(4))
    assert fit.model_.law is not None
    with pytest.raises(lg.LagrangianError, match="half the number of sites"):
        lg.Lattice(neighbours=[9]).fit(motions(2))
    with pytest.raises(lg.LagrangianError, match="lattice"):
        lg.system("pendulum").with_sites(3)
