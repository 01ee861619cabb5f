"""Random calls of the whole public interface: an answer, or an exception that says what is wrong; never a crash of the interpreter.

``LAGRANGIAN_RANDOM_CALLS`` sets the number of calls, 300 by default.
"""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lagrangian as lg
from lagrangian import sweep

hypothesis = pytest.importorskip("hypothesis")
st = pytest.importorskip("hypothesis.strategies")

CALLS = int(os.environ.get("LAGRANGIAN_RANDOM_CALLS", "300"))

#: What a call may raise: all of these have a message, which is looked at.
EXPECTED = (lg.LagrangianError, TypeError, OSError)

DTYPES = ["f8", "f8", "f8", ">f8", "f4", "f2", "i4", "i8", "u1", "?", "c16", "O", "U2", "M8[s]"]
SPECIAL = [0.0, -0.0, 1.0, -1.0, 1e-300, 1e300, np.nan, np.inf, -np.inf, 1e16]


@st.composite
def arrays(draw: Any, *shapes: tuple[int, ...]) -> Any:
    """An array of one of these shapes, or of another; of any type and layout."""
    own = st.sampled_from(shapes) if shapes else st.nothing()
    shape = draw(st.one_of(own, own, own, st.lists(st.integers(0, 4), max_size=4).map(tuple)))
    dtype = np.dtype(draw(st.sampled_from(DTYPES)))
    numbers = np.asarray(draw(st.lists(st.one_of(st.floats(-3, 3), st.sampled_from(SPECIAL)), min_size=1, max_size=4)))
    full = np.resize(numbers, shape)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        array = full.astype("i8").astype(dtype) if dtype.kind == "M" else full.astype(dtype)
    match draw(st.integers(0, 5)):
        case 0:
            array = np.asfortranarray(array)
        case 1 if array.ndim:
            array = np.repeat(array, 2, axis=-1)[..., ::2]
        case 2 if array.ndim:
            array = array[::-1]
        case 3:
            array = np.broadcast_to(array, shape)
        case 4:
            array.setflags(write=False)
    return array


def anything(*shapes: tuple[int, ...]) -> Any:
    """Arrays for the most part."""
    others = [
        st.none(),
        st.booleans(),
        st.integers(-3, 3),
        st.floats(),
        st.text(max_size=3),
        st.binary(max_size=3),
        st.lists(st.floats(), max_size=4),
        st.lists(st.lists(st.floats(-1, 1), max_size=3), max_size=3),
        st.dictionaries(st.text(max_size=2), st.floats(), max_size=2),
        st.just(object()),
    ]
    return st.one_of(arrays(*shapes), arrays(*shapes), arrays(*shapes), st.one_of(others))


STATE = anything((2,), (1, 2), (5, 2), (2, 3, 2))
NUMBER = st.one_of(st.integers(-2, 5), st.floats(), st.sampled_from([0.1, 1.0, 1e-9, 1e300]), st.none(), st.text(max_size=2))
WORD = st.one_of(st.text(max_size=4), st.sampled_from(["lnn", "previous", "linear", "dopri5", "rk4", "q1", "all"]), st.none(), st.integers())


@cache
def models() -> list[Any]:
    """A known system, a robot, and fitted ones."""
    arm = lg.simulate("two-link-arm", trajectories=4, duration=1.0, step=0.02, drive=1.0)
    fitted = [family(steps=3, width=8).fit(arm).model_ for family in (lg.Lnn, lg.Delan, lg.Mlp)]
    return [lg.system("two-link-arm"), lg.robot("two_link_arm"), *fitted]


@cache
def an_ensemble() -> lg.Ensemble:
    arm = lg.simulate("two-link-arm", trajectories=6, duration=1.0, step=0.02, drive=1.0)
    return lg.Ensemble(lg.Lnn(steps=2, width=4), 2).fit(arm)


@st.composite
def motions(draw: Any) -> Any:
    """A trajectory as it is made of arrays."""
    rows = draw(st.integers(0, 12))
    t = draw(st.one_of(st.just(0.05 * np.arange(rows)), anything((rows,))))
    q = draw(st.one_of(st.just(np.sin(np.outer(np.arange(rows), [0.1, 0.2]))), anything((rows, 2), (rows,))))
    given = {name: draw(anything((rows, 2), (rows,))) for name in draw(st.sets(st.sampled_from(["qd", "qdd", "tau", "p", "goal"])))}
    how = draw(st.fixed_dictionaries({}, optional={"angles": WORD, "names": st.lists(st.text(max_size=2), max_size=3), "name": WORD}))
    return lg.Trajectory(t, q, **given, **how)


def data(draw: Any) -> Any:
    """Recordings, good or not."""
    good = st.integers(1, 3).map(lambda n: lg.simulate("two-link-arm", trajectories=n, duration=0.2, step=0.02))
    return draw(st.one_of(good, st.lists(motions(), max_size=3), motions(), anything((5, 2))))


def answer(draw: Any) -> None:
    model = draw(st.sampled_from(models()))
    names = ["forward_dynamics", "inverse_dynamics", "mass_matrix", "bias", "gravity", "momentum", "energy", "lagrangian", "distance_from_data"]
    arguments = draw(st.lists(STATE, max_size=3))
    out = draw(st.one_of(st.none(), anything((2,), (5, 2), (2, 2), ()), st.sampled_from(arguments or [None])))
    getattr(model, draw(st.sampled_from(names)))(*arguments, out=out)


def parts(draw: Any) -> None:
    draw(st.sampled_from(models())).torque_parts(draw(STATE), draw(STATE), draw(STATE))


def roll_out(draw: Any) -> None:
    how = draw(st.fixed_dictionaries({}, optional={"times": anything((4,)), "tau": anything((4, 2), (2,)), "hold": WORD, "method": WORD, "rtol": NUMBER}))
    draw(st.sampled_from(models())).rollout(draw(STATE), draw(STATE), draw(NUMBER), draw(st.sampled_from([0.1, 0.0, -1.0, np.nan, "x"])), max_steps=50, **how)


def follow(draw: Any) -> None:
    draw(st.sampled_from(models())).follow(draw(motions()), max_steps=50)


def score(draw: Any) -> None:
    draw(st.sampled_from(models())).score(data(draw))


def check(draw: Any) -> None:
    str(lg.check(data(draw), low_pass=draw(NUMBER)))


def read(draw: Any) -> None:
    columns = st.dictionaries(st.sampled_from(["t", "q1", "q2", "qd1", "tau1", "trajectory", "x"]), anything((6,)), max_size=4)
    how = draw(st.fixed_dictionaries({}, optional={"angle": WORD, "q": WORD, "every": NUMBER}))
    lg.read(draw(st.one_of(columns, anything(), st.just("no.csv"))), **how)


def write(draw: Any) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / draw(st.sampled_from(["a.csv", "a.npz", "a.xyz", "a"]))
        lg.write(path, data(draw))
        lg.read(path)


def fit(draw: Any) -> None:
    family = draw(st.sampled_from([lg.Lnn, lg.Delan, lg.Mlp, lg.Best]))
    own = st.sampled_from(["width", "learning_rate", "loss", "horizon", "low_pass", "validate_fraction", "seed", "delay", "optimizer", "batch"])
    settings = draw(st.dictionaries(own, st.one_of(NUMBER, WORD, anything((2,))), max_size=2))
    settings = {name: value for name, value in settings.items() if name in family._defaults}
    if draw(st.booleans()):
        family(steps=1, **settings).fit(draw(anything((8, 4), (8, 6))), draw(anything((8, 2))))
    else:
        family(steps=1, **settings).fit(data(draw))


def estimate(draw: Any) -> None:
    estimator = draw(st.sampled_from([lg.Lnn(), fitted_estimator()]))
    getattr(estimator, draw(st.sampled_from(["predict", "score"])))(draw(anything((3, 4), (3, 6))))


@cache
def fitted_estimator() -> Any:
    return lg.Lnn(steps=3, width=8).fit(lg.simulate("two-link-arm", trajectories=4, duration=1.0, step=0.02, drive=1.0))


def ensemble(draw: Any) -> None:
    own = an_ensemble()
    match draw(st.integers(0, 3)):
        case 0:
            own.forward_dynamics(draw(STATE), draw(STATE), draw(STATE)).band(draw(st.one_of(st.floats(-1, 2), st.just(0.8))))
        case 1:
            own.inverse_dynamics(draw(STATE), draw(STATE), draw(STATE)).quantile(draw(st.floats(-1, 2)))
        case 2:
            own.rollout(draw(STATE), draw(STATE), 0.2, max_steps=50)
        case _:
            own.coverage(data(draw))


def layer(draw: Any) -> None:
    own = lg.Layer(models()[2])
    parameters = draw(anything((len(own.parameters),)))
    match draw(st.integers(0, 2)):
        case 0:
            own.model(parameters)
        case 1:
            own.project(parameters)
        case _:
            own.function(draw(st.one_of(st.just("jax"), WORD)), draw(st.one_of(st.sampled_from(["force", "scalar"]), WORD)))


def simulate(draw: Any) -> None:
    system = draw(st.sampled_from(["pendulum", "two-link-arm", "none", None, 3]))
    how = draw(st.fixed_dictionaries({}, optional={"q0": STATE, "qd0": STATE, "noise": NUMBER, "friction": NUMBER, "seed": NUMBER, "trajectories": st.integers(-1, 3)}))
    lg.simulate(system, duration=0.1, step=draw(st.sampled_from([0.05, 0.0, np.nan, "x", None])), **how)


def space(draw: Any) -> None:
    ranges = st.dictionaries(st.sampled_from(["from", "to", "log", "whole", "x"]), NUMBER, max_size=4)
    values = st.one_of(st.lists(NUMBER, max_size=2), ranges, anything((2,)))
    own = draw(st.dictionaries(st.sampled_from(["width", "batch", "learning_rate", "x"]), values, max_size=2))
    sweep.Plan(lg.Lnn(steps=1, width=4), own, [], method=draw(st.sampled_from(["grid", "random", "x"])), number=draw(st.integers(-1, 2)))


def animate(draw: Any) -> None:
    draw(motions()).animate(lengths=draw(st.one_of(st.none(), st.lists(NUMBER, max_size=3))), links=draw(st.sampled_from(["absolute", "relative", "x"])))


OFTEN: list[Callable[[Any], None]] = [answer, answer, answer, answer, answer, answer, parts, roll_out, follow, check, read, estimate, ensemble, layer]
SELDOM: list[Callable[[Any], None]] = [score, write, fit, simulate, space, animate]


@hypothesis.settings(max_examples=CALLS, deadline=None, database=None, suppress_health_check=list(hypothesis.HealthCheck))
@hypothesis.given(given=st.data())
def test_random_calls(given: Any) -> None:
    call = given.draw(st.sampled_from(OFTEN * 3 + SELDOM))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            call(given.draw)
        except EXPECTED as error:
            assert str(error)
