"""Figures: axes in, axes out."""

from __future__ import annotations

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
