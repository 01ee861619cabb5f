"""Figures: axes in, axes out."""

from __future__ import annotations

import numpy as np
import pytest

import lagrangian as lg

matplotlib = pytest.importorskip("matplotlib")
matplotlib.use("agg")


def test_every_figure_draws_into_the_axes_that_it_gets(swings: lg.Trajectories, lnn: lg.Estimator) -> None:
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, 2)
    motion = lnn.rollout([1.0], [0.0], duration=1.0)
    assert motion.plot(axes[0, 0], "qd") is axes[0, 0]
    assert "q1" in axes[0, 0].get_legend().get_texts()[0].get_text()
    assert lnn.plot_energy(motion, axes[0, 1]).get_ylabel().endswith("(J)")
    assert len(lnn.plot_loss(axes[1, 0]).lines) == 2
    assert lnn.plot_parity(swings, axes[1, 1]) is axes[1, 1]
    assert motion.plot().get_xlabel() == "t (s)"
    with pytest.raises(lg.errors.InvalidInput, match="no such signal"):
        motion.plot(signal="tau")
    pyplot.close("all")


def test_phase_portraits_and_parts_of_torques() -> None:
    from matplotlib import pyplot

    arm = lg.system("two-link-arm")
    [motion] = lg.simulate(arm, duration=1.0, drive=2.0, seed=1)
    assert motion.plot_phase(coordinate=1).get_xlabel() == "q2 (rad)"
    ax = arm.plot_torque(motion, coordinate=1)
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels[0] == "inertial" and labels[-1] == "recorded"
    parts = arm.torque_parts(motion.q, motion.qd, motion.qdd)
    total = sum(parts.values())
    assert np.allclose(total, arm.inverse_dynamics(motion.q, motion.qd, motion.qdd), atol=1e-10)
    assert arm.torque_parts([0.1, 0.2], [0.0, 0.0], [0.0, 0.0])["gravity"].shape == (2,)
    for wrong in (-1, 2):
        with pytest.raises(lg.errors.InvalidInput, match="coordinate"):
            motion.plot_phase(coordinate=wrong)
    with pytest.raises(lg.errors.InvalidInput, match="qdd has shape"):
        arm.torque_parts([0.1, 0.2], [0.0, 0.0], [[0.0, 0.0]])
    pyplot.close("all")


def test_motions_move_side_by_side() -> None:
    double = lg.system("double-pendulum")
    motion = double.rollout([1.0, 0.5], [0.0, 0.0], duration=2.0)
    shown = motion.animate(double.rollout([1.1, 0.5], [0.0, 0.0], duration=2.0), lengths=[1.0, 0.7])
    assert "<script" in shown.html and "srcdoc" in shown._repr_html_() and "http" not in shown._repr_html_()[:60]
    assert motion.animate(links="relative").html != motion.animate().html
    with pytest.raises(lg.errors.InvalidInput, match="links"):
        motion.animate(links="elbow")
    for lengths in ([1.0], [1.0, -1.0], [1.0, float("nan")]):
        with pytest.raises(lg.errors.InvalidInput, match="lengths"):
            motion.animate(lengths=lengths)
    with pytest.raises(lg.errors.InvalidInput, match="not a motion of a chain"):
        lg.system("mass-spring").rollout([1.0], [0.0], duration=1.0).animate()
    with pytest.raises(lg.errors.InvalidInput, match="7 motions"):
        motion.animate(*[motion] * 6)
