"""Ensembles: their bands, their files, wrong arguments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import lagrangian as lg
from lagrangian.errors import InvalidInput, NotFitted


@pytest.fixture(scope="module")
def swings() -> lg.Trajectories:
    return lg.simulate("pendulum", trajectories=12, duration=2.0, seed=3)


@pytest.fixture(scope="module")
def ensemble(swings: lg.Trajectories) -> lg.Ensemble:
    return lg.Ensemble(lg.Lnn(width=8, steps=25), 3).fit(swings)


def test_shapes_and_bands(ensemble: lg.Ensemble) -> None:
    q = np.linspace(-1.0, 1.0, 6).reshape(2, 3, 1)
    prediction = ensemble.forward_dynamics(q, np.zeros_like(q))
    assert prediction.mean.shape == prediction.deviation.shape == (2, 3, 1)
    low, high = prediction.band(0.8)
    assert (low < prediction.mean).all() and (prediction.mean < high).all()
    assert np.array_equal(prediction.quantile(0.5), prediction.mean)
    mean = np.mean([m.forward_dynamics(q, np.zeros_like(q)) for m in ensemble.members_], axis=0)
    assert np.allclose(mean, prediction.mean, rtol=1e-12)
    assert np.allclose(ensemble.predict([[0.3, 0.1]]), ensemble.forward_dynamics([[0.3]], [[0.1]]).mean)


def test_coverage_and_motions(ensemble: lg.Ensemble, swings: lg.Trajectories) -> None:
    coverage = ensemble.coverage(swings)
    assert coverage.acceleration is not None and coverage.torque is None
    assert "80 %" in str(coverage) and "acceleration" in str(coverage)
    motion = ensemble.rollout([0.5], [0.0], duration=0.5, step=0.1)
    assert motion.t is not None and motion.mean.shape == (6, 1) and len(motion.t) == 6
    assert ensemble.follow(swings[0]).mean.shape == swings[0].q.shape
    assert ensemble.distance_from_data(swings[0].q[50], swings[0].qd[50]) <= 1.0  # type: ignore[index]
    assert ensemble.distance_from_data([0.5], [50.0]) > 1.0


def test_plot(ensemble: lg.Ensemble) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    ax = ensemble.rollout([0.5], [0.0], duration=0.5, step=0.1).plot(level=0.5)
    assert ax.get_legend_handles_labels()[1] == ["50 %", "mean"]
    plt.close("all")


def test_saved_and_read_again(ensemble: lg.Ensemble, tmp_path: Path) -> None:
    ensemble.save(tmp_path / "own")
    again = lg.Ensemble.load(tmp_path / "own")
    state = ([0.3], [0.7])
    assert np.array_equal(again.forward_dynamics(*state).band(0.8), ensemble.forward_dynamics(*state).band(0.8))
    assert again.distance_from_data(*state) == ensemble.distance_from_data(*state)
    (tmp_path / "own" / "ensemble.json").write_text("{}")
    with pytest.raises(lg.LagrangianError, match="ensemble"):
        lg.Ensemble.load(tmp_path / "own")
    with pytest.raises(FileNotFoundError):
        lg.Ensemble.load(tmp_path / "none")


def test_the_page_of_a_run_has_the_bands(swings: lg.Trajectories, tmp_path: Path) -> None:
    own = lg.Ensemble(lg.Lnn(width=8, steps=25), 3)
    own.fit(swings, run=tmp_path / "run")
    page = lg.report(tmp_path / "run").html
    for part in ("In the band of 80 %", "The members of the ensemble", "band-acceleration-1", "band-position-1"):
        assert part in page
    again = lg.Ensemble.load(tmp_path / "run")
    state = ([0.3], [0.7])
    assert np.array_equal(again.forward_dynamics(*state).mean, own.forward_dynamics(*state).mean)
    # The members are those that are fitted without a folder.
    plain = lg.Ensemble(lg.Lnn(width=8, steps=25), 3).fit(swings)
    assert np.array_equal(plain.forward_dynamics(*state).mean, own.forward_dynamics(*state).mean)
    with pytest.raises(InvalidInput, match="not empty"):
        own.fit(swings, run=tmp_path / "run")
    with pytest.raises(InvalidInput, match="run folder"):
        own.fit(swings, force=True)


def test_wrong_arguments(ensemble: lg.Ensemble, swings: lg.Trajectories) -> None:
    with pytest.raises(NotFitted, match="call fit first"):
        lg.Ensemble(lg.Lnn()).forward_dynamics([0.0], [0.0])
    for n in (0, 1, 101, 2.5, True, -3):
        with pytest.raises(InvalidInput, match="members|number"):
            lg.Ensemble(lg.Lnn(steps=1), n).fit(swings)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="estimator"):
        lg.Ensemble("lnn").fit(swings)  # type: ignore[arg-type]
    with pytest.raises(InvalidInput, match="level"):
        ensemble.forward_dynamics([0.0], [0.0]).band(1.0)
    with pytest.raises(InvalidInput, match="X has shape"):
        ensemble.predict([[0.0]])
    with pytest.raises(lg.LagrangianError, match="bands of torques"):
        ensemble.inverse_dynamics([0.0], [0.0], [0.0])
    with pytest.raises(lg.LagrangianError, match="does not know the states"):
        lg.system("pendulum").distance_from_data([0.0], [0.0])


def test_the_distance_of_fitted_models(ensemble: lg.Ensemble) -> None:
    model = ensemble.members_[0]
    q = np.array([[0.0], [0.5], [0.5]])
    qd = np.array([[0.0], [0.0], [90.0]])
    distances = model.distance_from_data(q, qd)
    assert distances.shape == (3,) and distances[2] > 1.0
    out = np.empty(3)
    assert model.distance_from_data(q, qd, out=out) is out and np.array_equal(out, distances)
