"""Wrong arguments: an exception that names argument and remedy, never a crash of the interpreter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import lagrangian as lg

hypothesis = pytest.importorskip("hypothesis")
st = pytest.importorskip("hypothesis.strategies")


@pytest.fixture(scope="module")
def arm() -> lg.Model:
    return lg.system("two-link-arm")


Z = np.zeros(2)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ((np.zeros(3), Z), "q has shape"),
        ((Z, np.zeros((2, 3))), "qd has shape"),
        ((np.zeros((4, 2)), np.zeros((5, 2))), "qd has shape .* q has states"),
        ((0.0, Z), r"q has shape \(\)"),
        ((["a", "b"], Z), "q has dtype"),
        (([1 + 2j, 0], Z), "q has dtype complex"),
        (([None, 1], Z), "q has dtype object"),
        (([[1], [1, 2]], Z), "q cannot be made an array"),
        (([True, False], Z), "q has dtype bool"),
        (([np.nan, 0], Z), "not finite"),
        ((Z, [np.inf, 0]), "not finite"),
    ],
)
def test_states(arm: lg.Model, arguments: tuple[Any, Any], named: str) -> None:
    with pytest.raises(lg.LagrangianError, match=named) as caught:
        arm.energy(*arguments)
    assert isinstance(caught.value, (ValueError, TypeError))


@pytest.mark.parametrize(
    "out",
    [
        np.zeros(3),
        np.zeros((1, 2)),
        np.zeros(2, dtype=np.float32),
        np.zeros(4)[::2],
        [0.0, 0.0],
        np.frombuffer(bytes(16)),
    ],
)
def test_out(arm: lg.Model, out: Any) -> None:
    with pytest.raises(lg.LagrangianError, match="out .*: give a"):
        arm.bias(Z, Z, out=out)


def test_out_may_not_be_an_argument(arm: lg.Model) -> None:
    q = np.zeros(2)
    with pytest.raises(lg.LagrangianError, match="out"):
        arm.bias(q, Z, out=q)


def test_what_a_model_does_not_have_is_said(swings: lg.Trajectories) -> None:
    plain = lg.Mlp(width=8, steps=30).fit(swings)
    with pytest.raises(lg.errors.NotSupported, match="no mass matrix"):
        plain.mass_matrix([0.0])


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: lg.Trajectory([0, 1], [[1.0]]), "q has shape"),
        (lambda: lg.Trajectory([[0, 1]], [1.0]), "t has shape"),
        (lambda: lg.Trajectory([0, 1], [1, 2], [1, 2, 3]), "qd has shape"),
        (lambda: lg.Trajectory([0, 1], ["a", "b"]), "q has dtype"),
        (lambda: lg.Trajectory([0, 1], [1, 2], angles=["x"]), "angles has 'x'"),
        (lambda: lg.Trajectory([0, 1], [1, 2], names=["a", "b"]), "names must be"),
        (lambda: lg.Trajectory([0, 1], [[1, 2], [3, 4]], names=["a", "a"]), "differ"),
        (lambda: lg.read(3), "source is a int"),
        (lambda: lg.read({}), "no columns"),
        (lambda: lg.read({"x": [1, 2]}), "columns found: x"),
        (lambda: lg.read("log.xlsx"), "log.xlsx"),
        (lambda: lg.read({"t": [0, 1], "q1": [0, 1]}, every=0), "every is 0"),
        (lambda: lg.read({"t": [0, 1], "q1": [0, 1]}, q=""), "q has ''"),
        (lambda: lg.check([1, 2]), "data holds a int"),
        (lambda: lg.check("log.csv"), "data is a str"),
        (lambda: lg.simulate("pendulum", starts="none"), "starts is 'none'"),
        (lambda: lg.simulate("pendulum", q0=[1.0]), "q0 and qd0"),
        (lambda: lg.simulate("pendulum", step=0.0), "sample interval"),
        (lambda: lg.simulate("pendulum", duration=1e9), "duration"),
        (lambda: lg.simulate("pendulum", method="euler"), "no integration method 'euler'"),
        (lambda: lg.simulate("pendulum", length=-1.0), "length"),
        (lambda: lg.system("pendulum").rollout([0.0], [0.0]), "duration is not given"),
        (lambda: lg.system("pendulum").rollout([0.0], [0.0], times=[1, 0]), "increas"),
        (lambda: lg.system("pendulum").rollout([0.0, 1.0], [0.0], 1.0), "q0 has shape"),
        (lambda: lg.system("pendulum").rollout([0.0], [0.0], 1.0, tau=[[1.0]]), "tau has 1 rows"),
        (lambda: lg.system("pendulum").rollout([0.0], [0.0], 1.0, hold="x", tau=np.zeros((101, 1))), "hold is 'x'"),
        (lambda: lg.Lnn().fit([]), "X"),
        (lambda: lg.Lnn().fit(np.zeros((5, 2))), "y is not given"),
        (lambda: lg.Lnn().fit(np.zeros((5, 5)), np.zeros((5, 2))), "X has shape"),
        (lambda: lg.Lnn().fit([[np.nan, 1]], [[1.0]]), "X contains NaN"),
        (lambda: lg.Lnn(width=0).fit(lg.simulate("pendulum")), "width"),
        (lambda: lg.Lnn(width="a").fit(lg.simulate("pendulum")), "`width` is \"a\""),
        (lambda: lg.Lnn(loss="none").fit(lg.simulate("pendulum")), "`loss` is \"none\": it must be one of"),
        (lambda: lg.Lnn(steps=5, seconds=5).fit(lg.simulate("pendulum")), "both `steps` and `seconds`"),
        (lambda: lg.Lnn(horizon=5, steps=5).fit(lg.simulate("pendulum")), "horizon"),
        (lambda: lg.Rigid().fit(lg.simulate("pendulum")), "forces is none"),
        (lambda: lg.set_threads(10**6), "count is"),
        (lambda: lg.simulate("pendulum", step="x"), "step is 'x': give a number"),
        (lambda: lg.simulate("pendulum", seed=-1), "seed is -1: give a whole number"),
        (lambda: lg.Lnn(low_pass="5 Hz").fit(lg.simulate("pendulum")), "low_pass is '5 Hz'"),
        (lambda: lg.Lnn(seed=1.5).fit(np.zeros((5, 2)), np.zeros((5, 1))), "seed is 1.5"),
        (lambda: lg.Lnn(validate_fraction=np.nan).fit(np.zeros((5, 2)), np.zeros((5, 1))), "validate_fraction is nan"),
        (lambda: lg.read({"t": [0, 1], "q1": [[1], [1, 2]]}), "the column 'q1'"),
    ],
)
def test_arguments(call: Any, named: str) -> None:
    with pytest.raises((lg.LagrangianError, OSError), match=named):
        call()


ARRAYS = st.one_of(
    st.none(),
    st.integers(-5, 5),
    st.floats(),
    st.text(max_size=3),
    st.lists(st.floats(), max_size=4),
    st.builds(
        lambda shape, dtype, step: np.zeros(shape, dtype=dtype)[::step],
        st.lists(st.integers(0, 3), min_size=1, max_size=3),
        st.sampled_from(["f8", ">f8", "f4", "i4", "u1", "c16", "O", "U2", "?"]),
        st.sampled_from([1, 2, -1]),
    ),
)


@hypothesis.settings(max_examples=400, deadline=None)
@hypothesis.given(
    name=st.sampled_from(["forward_dynamics", "inverse_dynamics", "mass_matrix", "bias", "energy", "gravity"]),
    arguments=st.lists(ARRAYS, max_size=3),
    out=ARRAYS,
)
def test_random_calls_raise_or_answer(name: str, arguments: list[Any], out: Any) -> None:
    model = lg.system("two-link-arm")
    try:
        answer = getattr(model, name)(*arguments, out=out)
    except (lg.LagrangianError, TypeError) as error:
        assert str(error)
    else:
        assert isinstance(answer, np.ndarray)


@pytest.mark.parametrize("value", [float("nan"), np.array([np.inf]), object()])
def test_a_setting_that_json_has_no_form_for_is_refused(swings: lg.Trajectories, value: object) -> None:
    with pytest.raises(lg.errors.InvalidInput, match="finite numbers"):
        lg.Lnn(steps=1, width=value).fit(swings)
