"""Fits with the habits of scikit-learn."""

from __future__ import annotations

import copy
import inspect
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lagrangian as lg
from lagrangian._families import ESTIMATORS


@pytest.mark.parametrize("name", list(ESTIMATORS))
def test_constructors_compute_nothing_and_parameters_are_kept(name: str) -> None:
    estimator = ESTIMATORS[name]
    names = list(inspect.signature(estimator).parameters)
    assert names == list(estimator().get_params()) or sorted(names) == sorted(estimator().get_params())
    odd = object()
    kept = estimator(seed=odd)
    assert kept.get_params()["seed"] is odd and kept.clone().seed is odd
    assert kept.set_params(seed=3) is kept and kept.seed == 3
    assert repr(estimator(seed=3)) == f"{name}(seed=3)"
    assert repr(estimator()) == f"{name}()"
    for needed in ("Args:", "seed: ", "loss: "):
        assert needed in (estimator.__doc__ or "")
    with pytest.raises(TypeError, match="no setting 'widht'"):
        estimator(widht=3)
    with pytest.raises(ValueError, match="no setting 'widht'"):
        estimator().set_params(widht=3)
    with pytest.raises(lg.errors.NotFitted, match="call fit first"):
        estimator().predict([[0.0, 0.0]])


def test_scikit_learn_clones_and_searches(lnn: lg.Estimator) -> None:
    sklearn = pytest.importorskip("sklearn")
    from sklearn.model_selection import GridSearchCV
    from sklearn.pipeline import make_pipeline

    assert not hasattr(sklearn.base.clone(lnn), "model_")
    assert sklearn.base.is_regressor(lnn)
    # Swings that do not turn over: arrays alone do not say that q is an angle.
    q0 = np.linspace(2.0, 0.2, 10)[:, None]
    swings = lg.simulate("pendulum", q0=q0, qd0=0.0 * q0, duration=4.0, step=0.02)
    X = np.vstack([np.hstack([m.q, m.qd]) for m in swings])
    y = np.vstack([m.qdd for m in swings if m.qdd is not None])
    search = GridSearchCV(lg.Lnn(steps=60, batch=64), {"width": [4, 16]}, cv=2)
    search.fit(X, y)
    assert search.best_score_ > 0.9
    assert make_pipeline(lg.Lnn(width=8, steps=100)).fit(X, y).predict(X).shape == y.shape


def test_a_fit_of_motions(swings: lg.Trajectories, lnn: lg.Estimator) -> None:
    assert lnn.verdict_ == "good" and lnn.n_features_in_ == 1
    assert lnn.score(swings) > 0.999
    assert lnn.check_.passed and lnn.assessment_.score["acceleration"]["nmse"][0] < 1e-3
    assert any(choice["setting"] == "form" for choice in lnn.choices_)
    assert lnn.history_[-1]["step"] == 150 and lnn.history_[0]["validation"] is not None
    truth = lg.system("pendulum", length=0.5)
    motion = lnn.rollout([2.0], [0.0], duration=20.0, step=0.1)
    energy = truth.energy(motion.q, motion.qd)
    assert np.ptp(energy) < 0.01 * 2 * 9.8 * 0.5


def test_the_same_seed_gives_the_same_bits(swings: lg.Trajectories, lnn: lg.Estimator) -> None:
    again = lnn.clone().fit(swings)
    assert again.model_.to_bytes() == lnn.model_.to_bytes()
    lg.set_threads(1)
    try:
        alone = lnn.clone().fit(swings)
    finally:
        lg.set_threads(0)
    assert alone.model_.to_bytes() == lnn.model_.to_bytes()
    other = lnn.clone().set_params(seed=4).fit(swings)
    assert other.model_.to_bytes() != lnn.model_.to_bytes()


def test_the_same_bits_as_the_command(
    swings: lg.Trajectories, lnn: lg.Estimator, command: str, tmp_path: Path
) -> None:
    lg.write(tmp_path / "swings.csv", swings)
    settings = ["--model", "lnn", "--width", "16", "--batch", "64", "--steps", "150", "--seed", "3"]
    run = [command, "fit", "swings.csv", "--out", "run", "--quiet", *settings]
    subprocess.run(run, cwd=tmp_path, check=True, capture_output=True)
    ours, theirs = lnn.clone().fit(lg.read(tmp_path / "swings.csv")), lg.load(tmp_path / "run")
    q, qd = np.linspace(-2, 2, 50)[:, None], np.linspace(3, -3, 50)[:, None]
    assert np.array_equal(ours.forward_dynamics(q, qd), theirs.forward_dynamics(q, qd))
    assert ours.model_.preparation == theirs.preparation
    shown = subprocess.run(
        [command, "score", "run/model.safetensors", "swings.csv", "--json"],
        cwd=tmp_path,
        check=True,
        capture_output=True,
    )
    figures = json.loads(shown.stdout)
    assert ours.model_.score(swings).score == figures["score"]


def test_the_same_simulation_as_the_command(command: str, tmp_path: Path) -> None:
    words = "simulate double-pendulum --trajectories 2 --duration 1 --seed 9 --noise 0.01 --drive 1"
    run = [command, *words.split(), "--out", "motions.csv"]
    subprocess.run(run, cwd=tmp_path, check=True, capture_output=True)
    ours = lg.simulate(
        "double-pendulum", trajectories=2, duration=1.0, seed=9, noise=0.01, drive=1.0
    )
    assert list(lg.read(tmp_path / "motions.csv")) == list(ours)


def test_a_fit_of_samples() -> None:
    arm = lg.system("two-link-arm")
    rng = np.random.default_rng(1)
    q, qd, tau = (rng.uniform(-2, 2, (2000, 2)) for _ in range(3))
    y = arm.forward_dynamics(q, qd, tau)
    X = np.hstack([q, qd, tau])
    names = [lg.Coordinate("a", "rad", "circle"), lg.Coordinate("b", "rad", "circle")]
    fitted = lg.Lnn(width=24, steps=250).fit(X[:1800], y[:1800], coordinates=names)
    assert fitted.score(X[1800:], y[1800:]) > 0.99
    assert fitted.verdict_ == "good"
    assert fitted.assessment_.score["samples"] == 360


def test_pickles_hold_the_fit_and_an_older_form_is_refused(lnn: lg.Estimator) -> None:
    for again in (pickle.loads(pickle.dumps(lnn)), copy.deepcopy(lnn)):
        assert again.get_params() == lnn.get_params()
        assert again.verdict_ == "good"
        assert np.array_equal(again.predict([[1.0, 0.5]]), lnn.predict([[1.0, 0.5]]))
    state = lnn.__getstate__()
    state["format"] = 0
    with pytest.raises(lg.errors.ModelError, match="another format"):
        lg.Lnn().__setstate__(state)


def test_callbacks_see_every_look_and_end_a_fit_by_an_exception(swings: lg.Trajectories) -> None:
    seen: list[dict[str, Any]] = []
    lg.Lnn(width=8, steps=100).fit(swings, callbacks=seen.append)
    assert [event["step"] for event in seen] == [25, 50, 75, 100]

    def stop(event: dict[str, Any]) -> None:
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        lg.Lnn(width=8, steps=100_000).fit(swings, callbacks=stop)


def test_ctrl_c_ends_a_fit_and_keeps_the_best_model(swings: lg.Trajectories) -> None:
    timer = threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT))

    def begun(event: dict[str, Any]) -> None:
        # However long it took to prepare the data.
        if timer.ident is None:
            timer.start()

    with pytest.warns(lg.errors.FitInterrupted, match="best model"):
        fitted = lg.Lnn(width=16, seconds=120.0).fit(swings, callbacks=begun)
    assert fitted.summary_["ending"] == "interrupted" and fitted.summary_["seconds"] < 60.0
    assert np.isfinite(fitted.predict([[1.0, 0.0]])).all()


def test_a_model_that_must_not_be_used_is_warned_of() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(400) * 0.01
    noise = [
        lg.Trajectory(t, rng.normal(size=(400, 1)), rng.normal(size=(400, 1)), rng.normal(size=(400, 1)))
        for _ in range(3)
    ]
    with pytest.warns(lg.errors.FitWarning, match="poor"):
        assert lg.Lnn(steps=20).fit(noise).verdict_ == "poor"
    with pytest.warns(lg.errors.FitWarning):
        fitted = lg.Lnn(width=4, steps=2, learning_rate=1e-9).fit(
            lg.simulate("double-pendulum", trajectories=4, duration=2.0)
        )
    assert fitted.verdict_ == "poor"


def test_the_best_of_several_models_is_kept() -> None:
    driven = lg.simulate("two-link-arm", trajectories=4, duration=5.0, drive=3.0, seed=2)
    fitted = lg.fit(driven, steps=60, dissipation=True)
    assert {c["family"] for c in fitted.summary_["tried"]} >= {"delan", "lnn"}
    assert fitted.verdict_ in ("good", "fair")
    torque = fitted.inverse_dynamics(driven[0].q, driven[0].qd, driven[0].qdd)
    assert np.mean((torque - driven[0].tau) ** 2) < 0.01 * np.var(driven[0].tau)


def test_a_robot_is_identified_from_its_description() -> None:
    robot = lg.robot("two_link_arm")
    driven = lg.simulate(robot, trajectories=3, duration=5.0, drive=3.0, seed=2)
    fitted = lg.Rigid(urdf="two_link_arm").fit(driven)
    q = np.array([[0.3, -0.4], [1.0, 0.2]])
    assert np.allclose(fitted.mass_matrix(q), robot.mass_matrix(q), rtol=1e-3)


def test_a_fit_in_a_process_that_was_forked_after_threads_were_begun(
    swings: lg.Trajectories, lnn: lg.Estimator
) -> None:
    program = (
        "import os, lagrangian as lg\n"
        "data = lg.simulate('pendulum', trajectories=4, duration=2.0)\n"
        "fit = lambda: lg.Lnn(width=8, steps=20, seed=1).fit(data).model_.to_bytes()\n"
        "first = fit()\n"
        "if os.fork() == 0:\n"
        "    os._exit(0 if fit() == first else 3)\n"
        "raise SystemExit(os.waitstatus_to_exitcode(os.wait()[1]))\n"
    )
    run = subprocess.run([sys.executable, "-W", "ignore", "-c", program], timeout=120)
    assert run.returncode == 0
