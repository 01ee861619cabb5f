"""What models answer, and how they move."""

from __future__ import annotations

import pickle
import threading
from pathlib import Path

import numpy as np
import pytest

import lagrangian as lg


@pytest.fixture(scope="module")
def arm() -> lg.Model:
    return lg.system("two-link-arm")


def states(n: int, *batch: int) -> list[np.ndarray]:
    rng = np.random.default_rng(5)
    return [rng.uniform(-1.0, 1.0, (*batch, n)) for _ in range(3)]


@pytest.mark.parametrize("batch", [(), (1,), (7,), (3, 4), (0,)])
def test_every_quantity_has_the_shape_of_its_states(arm: lg.Model, batch: tuple[int, ...]) -> None:
    q, qd, qdd = states(2, *batch)
    for answer in (
        arm.forward_dynamics(q, qd),
        arm.inverse_dynamics(q, qd, qdd),
        arm.bias(q, qd),
        arm.gravity(q),
        arm.momentum(q, qd),
    ):
        assert answer.shape == (*batch, 2) and answer.dtype == np.float64
    assert arm.mass_matrix(q).shape == (*batch, 2, 2)
    assert arm.energy(q, qd).shape == arm.lagrangian(q, qd).shape == batch


def test_the_quantities_belong_together(arm: lg.Model) -> None:
    q, qd, qdd = states(2, 50)
    tau = arm.inverse_dynamics(q, qd, qdd)
    assert np.allclose(np.einsum("kij,kj->ki", arm.mass_matrix(q), qdd) + arm.bias(q, qd), tau)
    assert np.allclose(arm.forward_dynamics(q, qd, tau), qdd)
    product = (arm.momentum(q, qd) * qd).sum(-1)
    assert np.allclose(arm.lagrangian(q, qd), product - arm.energy(q, qd))


def test_many_states_are_the_same_as_one_by_one_and_one_state_is_repeated(arm: lg.Model) -> None:
    q, qd, qdd = states(2, 50)
    together = arm.inverse_dynamics(q, qd, qdd)
    alone = [arm.inverse_dynamics(*state) for state in zip(q, qd, qdd)]
    assert np.allclose(together, alone, rtol=0, atol=1e-12)
    assert np.array_equal(arm.energy(q[0], qd), arm.energy(np.broadcast_to(q[0], q.shape), qd))


def test_results_are_written_where_they_are_wanted(arm: lg.Model) -> None:
    q, qd, qdd = states(2, 5)
    out = np.empty_like(q)
    assert arm.inverse_dynamics(q, qd, qdd, out=out) is out
    assert np.array_equal(out, arm.inverse_dynamics(q, qd, qdd))
    scalar = np.empty(())
    assert arm.energy(q[0], qd[0], out=scalar) is scalar and scalar == arm.energy(q[0], qd[0])


def test_arrays_of_other_kinds_are_converted(arm: lg.Model) -> None:
    q, qd, _ = states(2, 6)
    wanted = arm.energy(q, qd)
    assert np.allclose(arm.energy(q.astype(np.float32), qd), wanted, rtol=1e-6)
    assert np.array_equal(arm.energy(np.asfortranarray(q), qd), wanted)
    assert np.array_equal(arm.energy(q[::2], qd[::2]), wanted[::2])
    assert np.array_equal(arm.energy(q.tolist(), qd.tolist()), wanted)
    assert np.array_equal(arm.energy(q.astype(">f8"), qd), wanted)
    frozen = q.copy()
    frozen.flags.writeable = False
    assert np.array_equal(arm.energy(frozen, qd), wanted)


def test_a_rollout_is_a_trajectory_and_says_how_it_ended() -> None:
    pendulum = lg.system("pendulum")
    motion = pendulum.rollout([1.0], [0.0], duration=5.0, step=0.1)
    assert isinstance(motion, lg.Trajectory) and len(motion) == 51
    assert motion.outcome is not None and motion.outcome.kind == "finished"
    energy = pendulum.energy(motion.q, motion.qd)
    assert np.ptp(energy) < 1e-8
    with pytest.warns(lg.errors.RolloutWarning, match="step-limit"):
        cut = pendulum.rollout([1.0], [0.0], duration=5.0, step=0.1, max_steps=5)
    assert len(cut) < 51


def test_forces_come_as_arrays_or_as_a_function() -> None:
    pendulum = lg.system("pendulum")
    t = np.linspace(0.0, 2.0, 201)
    held = pendulum.rollout([0.0], [0.0], times=t, tau=np.sin(t)[:, None], hold="linear")
    called = pendulum.rollout([0.0], [0.0], times=t, tau=lambda t, q, qd: np.sin([t]))
    assert np.abs(held.q - called.q).max() < 1e-4 and called.tau is not None
    damped = pendulum.rollout([1.0], [0.0], duration=20.0, tau=lambda t, q, qd: -0.5 * qd)
    assert abs(damped.q[-1, 0]) < 0.1
    with pytest.raises(ZeroDivisionError):
        pendulum.rollout([1.0], [0.0], duration=1.0, tau=lambda t, q, qd: 1 / 0)
    with pytest.raises(lg.errors.InvalidInput, match="value of tau"):
        pendulum.rollout([1.0], [0.0], duration=1.0, tau=lambda t, q, qd: [1.0, 2.0])


def test_a_model_is_used_by_many_threads_at_once(arm: lg.Model) -> None:
    q, qd, qdd = states(2, 500)
    wanted = arm.inverse_dynamics(q, qd, qdd)
    wrong: list[int] = []

    def work(k: int) -> None:
        for _ in range(50):
            if not np.array_equal(arm.inverse_dynamics(q, qd, qdd), wanted):
                wrong.append(k)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_a_robot_of_a_file_a_text_or_a_name(tmp_path: Path) -> None:
    text = """<robot name="bar"><link name="base"/><link name="bar"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
      <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <joint name="hinge" type="revolute"><parent link="base"/><child link="bar"/><axis xyz="0 1 0"/>
      <limit effort="10" velocity="5" lower="-3" upper="3"/></joint></robot>"""
    path = tmp_path / "bar.urdf"
    path.write_text(text)
    for robot in (lg.robot(path), lg.robot(text)):
        assert robot.n == 1 and robot.coordinates[0].name == "hinge"
        assert np.allclose(robot.mass_matrix([0.3]), 0.1 + 2 * 0.25)
    assert lg.robot("iiwa7").n == 7
    with pytest.raises(FileNotFoundError):
        lg.robot(tmp_path / "none.urdf")
    with pytest.raises(lg.errors.InvalidInput, match="robot"):
        lg.robot("<robot>")


def test_models_are_saved_and_pickled_to_the_bit(lnn: lg.Estimator, tmp_path: Path) -> None:
    path = tmp_path / "pendulum.safetensors"
    lnn.save(path)
    again = lg.load(path)
    q, qd, _ = states(1, 20)
    wanted = lnn.forward_dynamics(q, qd)
    assert np.array_equal(again.forward_dynamics(q, qd), wanted)
    assert np.array_equal(pickle.loads(pickle.dumps(again)).forward_dynamics(q, qd), wanted)
    assert again.preparation is not None and again.family == "lnn"
    damaged = bytearray(path.read_bytes())
    damaged[-3] ^= 1
    path.write_bytes(damaged)
    with pytest.raises(lg.errors.ModelError, match="checksum|damaged"):
        lg.load(path)
    path.write_bytes(b"no model")
    with pytest.raises(lg.errors.ModelError):
        lg.load(path)
    with pytest.raises(FileNotFoundError):
        lg.load(tmp_path / "none.safetensors")


def test_a_lagrangian_of_ones_own_has_exact_derivatives() -> None:
    def double_pendulum(q: np.ndarray, qd: np.ndarray) -> object:
        kinetic = qd[0] ** 2 + 0.5 * qd[1] * qd[1] + qd[0] * qd[1] * np.cos(q[0] - q[1])
        return kinetic + 9.8 * (2 * np.cos(q[0]) + np.cos(q[1]))

    own = lg.own_system(double_pendulum, 2, angles="all")
    known = lg.system("double-pendulum")
    q, qd, qdd = states(2, 5)
    assert np.allclose(own.inverse_dynamics(q, qd, qdd), known.inverse_dynamics(q, qd, qdd), rtol=1e-13)
    [motion] = lg.simulate(own, q0=[1.0, 0.5], qd0=[0.0, 0.0], duration=0.5)
    assert np.allclose(motion.q, known.rollout([1.0, 0.5], [0.0, 0.0], 0.5).q, atol=1e-8)
    assert len(lg.simulate(own, trajectories=2, duration=0.1)) == 2
    every = lg.own_system(
        lambda q, qd: np.exp(-q[0] ** 2) / (1 + abs(qd[0])) - np.sqrt(2 + np.sin(q[0])) ** 1.5 + np.tanh(qd[0]) * 2**q[0], 1
    )
    step = 1e-5
    slope = (every.lagrangian([0.3], [0.7 + step]) - every.lagrangian([0.3], [0.7 - step])) / (2 * step)
    assert np.allclose(every.momentum([0.3], [0.7]), slope, rtol=1e-8)


def test_what_a_function_raises_is_raised() -> None:
    import math

    broken = lg.own_system(lambda q, qd: 1 / 0, 1)
    with pytest.raises(ZeroDivisionError):
        broken.energy([0.0], [0.0])
    with pytest.raises(ZeroDivisionError):
        lg.simulate(broken, duration=0.1)
    with pytest.raises(ZeroDivisionError):
        broken.rollout([0.0], [0.0], 0.1)
    with pytest.raises(TypeError, match="functions of numpy"):
        lg.own_system(lambda q, qd: math.sin(q[0]), 1).energy([0.0], [0.0])
    with pytest.raises(TypeError, match="one number"):
        lg.own_system(lambda q, qd: q, 1).energy([0.0], [0.0])
    with pytest.raises(lg.errors.InvalidInput, match="give a function"):
        lg.own_system(3, 1)  # type: ignore[arg-type]
