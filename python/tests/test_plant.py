"""Plants in MuJoCo: their dynamics are those of an independent program; recordings, control loops, the command, and wrong machines."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
import time
import types
from pathlib import Path

import numpy as np
import pytest

import lagrangian as lg
from lagrangian import plant

mujoco = pytest.importorskip("mujoco")

PENDULUM = """<mujoco><option timestep="0.001"/><worldbody><body>
  <joint name="{name}" type="{kind}" axis="0 1 0" {more}/>
  <geom type="sphere" size="0.05" pos="0 0 -0.5" mass="2"/></body></worldbody>{rest}</mujoco>"""


def pendulum(path: Path, *, kind: str = "hinge", more: str = "", rest: str = "", name: str = "swing") -> Path:
    path.write_text(PENDULUM.format(kind=kind, more=more, rest=rest, name=name))
    return path


@pytest.mark.parametrize("name", ["ur5", "iiwa7", "panda", "two_link_arm"])
def test_a_plant_has_the_dynamics_of_the_same_robot(name: str) -> None:
    machine = plant.compiled(name)
    arm, own = plant.load(machine), lg.robot(name)
    draw = np.random.default_rng(0)
    low, high = np.clip(arm.ranges, -3.0, 3.0).T
    q, qd, qdd = draw.uniform(low, high, (20, arm.n)), *draw.uniform(-1.0, 1.0, (2, 20, arm.n))
    assert np.abs(arm.inverse_dynamics(q, qd, qdd) - own.inverse_dynamics(q, qd, qdd)).max() < 1e-6
    assert np.abs(arm.mass_matrix(q) - own.mass_matrix(q)).max() < 1e-6
    assert np.abs(arm.forward_dynamics(q, qd, arm.inverse_dynamics(q, qd, qdd)) - qdd).max() < 1e-6


def test_joints_that_are_not_named_are_locked() -> None:
    arm = plant.load("ur5", joints=["elbow_joint", "shoulder_lift_joint"])
    assert [c.name for c in arm.coordinates] == ["elbow_joint", "shoulder_lift_joint"]
    own = lg.robot("ur5", joints=["elbow_joint", "shoulder_lift_joint"])
    assert np.abs(arm.mass_matrix([0.3, -0.4]) - own.mass_matrix([0.3, -0.4])).max() < 1e-6


def test_a_recording_has_what_was_asked_for_and_is_the_same_again() -> None:
    arm = plant.load("two_link_arm")
    logs = plant.record(arm, duration=2.0, trajectories=2, rate=100.0, noise=1e-4, seed=3)
    assert [len(log.t) for log in logs] == [200, 200] and logs[0].qd is not None
    assert logs[0].coordinates[0].kind == "circle" and not np.array_equal(logs[0].q, logs[1].q)
    again = plant.record(arm, duration=2.0, trajectories=2, rate=100.0, noise=1e-4, seed=3)
    assert np.array_equal(logs[1].q, again[1].q) and np.array_equal(logs[0].tau, again[0].tau)
    [bare] = plant.record(arm, duration=1.0, velocities=False, quantisation=0.01)
    assert bare.qd is None and np.abs(bare.q / 0.01 - np.round(bare.q / 0.01)).max() < 1e-9


def test_a_policy_drives_and_a_joint_without_a_drive_swings(tmp_path: Path) -> None:
    drive = '<actuator><motor joint="other" ctrlrange="-1 1" gear="3"/></actuator>'
    body = '</body><body pos="1 0 0"><joint name="other" axis="0 1 0"/><geom size="0.1" mass="1"/>'
    text = PENDULUM.format(kind="hinge", more="", rest=drive, name="swing").replace("</body>", body + "</body>")
    file = tmp_path / "two.xml"
    file.write_text(text)
    machine = plant.load(file)
    assert machine.limits.tolist() == [0.0, 3.0]
    seen = []
    [log] = plant.record(
        machine, lambda t, q, qd: seen.append(t) or [5.0, 5.0], duration=0.5, start=([1.0, 0.0], [0.0, 0.0])
    )
    assert len(seen) == len(log.t) == 100
    assert log.tau is not None and np.array_equal(log.tau[-1], [0.0, 3.0])
    # A pendulum of half a metre, and a turn of 3 N·m about a ball of 4e-3 kg·m².
    expected = lg.system("pendulum", length=0.5, mass=2.0).rollout([1.0], [0.0], times=log.t)
    assert np.abs(log.q[:, 0] - expected.q[:, 0]).max() < 5e-3
    [swing] = plant.record(machine, duration=0.5, seed=1)
    assert swing.tau is not None and not swing.tau[:, 0].any() and swing.tau[:, 1].any()


CART = """<mujoco><option timestep="0.001"/><worldbody><body><joint name="cart" type="slide" axis="1 0 0" damping="0.2"/>
  <geom type="box" size="0.1 0.1 0.1" mass="1.5" contype="0"/><body><joint name="pole" axis="0 1 0" damping="0.002"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.8" size="0.03" mass="0.4" contype="0"/></body></body></worldbody>
  <actuator><motor joint="cart" ctrlrange="-8 8"/></actuator></mujoco>"""


def test_a_cart_and_a_pole_without_a_drive_are_found_from_their_log(tmp_path: Path) -> None:
    file = tmp_path / "cart.xml"
    file.write_text(CART)
    machine = plant.load(file)
    fitted = lg.Chain().fit(plant.record(machine, trajectories=3, seed=3))
    [choice] = [own for own in fitted.choices_ if own["setting"] == "delay"]
    assert abs(choice["value"] - 0.0025) < 1e-9  # the torque acts from one row to the next
    [new] = plant.record(machine, seed=9)
    assert new.tau is not None
    truth = machine.forward_dynamics(new.q, new.qd, new.tau)
    error = fitted.model_.forward_dynamics(new.q, new.qd, new.tau) - truth
    assert ((error**2).mean(axis=0) < 1e-4 * truth.var(axis=0)).all()


def test_a_model_is_followed_by_the_arm_of_another_program() -> None:
    arm, model = plant.load("ur5"), lg.robot("ur5")
    letter = plant.excitation(arm, duration=4.0, seed=1)
    followed = lg.track(model, arm, letter, speeds=[0.5, 1.0])
    assert [own.driver for own in followed] == ["model", "feedback", "truth"] * 2
    assert followed.over_truth(0.5) < 1.05 and followed.over_truth() < 1.05
    assert followed.of("feedback").overall > 50.0 * followed.of("model").overall
    assert followed.of("model").motion.tau is not None and followed.of("model").real_time > 0.0
    assert "feedback" in repr(followed)
    with pytest.raises(lg.errors.InvalidInput, match="there is no 'model' at speed 3"):
        followed.of("model", 3.0)


def test_an_arm_with_friction_is_followed_as_by_its_true_model() -> None:
    machine = plant.compiled("ur5")
    machine.dof_armature[:] = [0.5, 0.5, 0.4, 0.1, 0.1, 0.1]
    machine.dof_frictionloss[:] = [1.6, 1.4, 1.1, 0.4, 0.3, 0.3]
    machine.dof_damping[:] = [2.0, 1.8, 1.5, 0.5, 0.5, 0.4]
    arm = plant.load(machine)
    logs = plant.record(arm, duration=20.0, velocity_noise=1e-3, seed=3)
    fitted = lg.Rigid(urdf="ur5").fit(logs)
    [choice] = [own for own in fitted.choices_ if own["setting"] == "delay"]
    assert abs(choice["value"] - 0.0025) < 1e-9
    letter = plant.excitation(arm, duration=6.0, seed=4)
    assert lg.track(fitted, arm, letter).over_truth() < 1.2


def test_the_command_follows_with_a_plant(tmp_path: Path) -> None:
    arm = plant.load("two_link_arm")
    lg.Rigid(urdf="two_link_arm").fit(plant.record(arm, duration=10.0)).save(tmp_path / "arm.safetensors")
    lg.write(tmp_path / "letter.csv", [plant.excitation(arm, duration=2.0, seed=4)])
    command = [sys.executable, "-m", "lagrangian", "track", "arm.safetensors", "--reference", "letter.csv"]
    command += ["--plant", "two_link_arm", "--speeds", "0.5,1", "--kp", "20", "--kd", "4"]
    done = subprocess.run([*command, "--json", "--plot", "page.html"], cwd=tmp_path, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    assert [own["speed"] for own in found["speeds"]] == [0.5, 1.0]
    ours, theirs = (found["tracking"][key]["rmse"] for key in ("model", "feedback"))
    assert max(ours) < 0.1 * max(theirs) and "over the true model" in (tmp_path / "page.html").read_text()
    nowhere = ["nowhere.xml" if word == "two_link_arm" else word for word in command]
    wrong = subprocess.run(nowhere, cwd=tmp_path, capture_output=True, text=True)
    assert wrong.returncode == 2 and "there is no file 'nowhere.xml'" in wrong.stderr


def test_the_example_learns_a_panda_and_follows_through_its_c(tmp_path: Path) -> None:
    example = Path(__file__).parents[2] / "examples" / "mujoco_panda" / "run.py"
    assert len(example.read_text().splitlines()) <= 60
    done = subprocess.run([sys.executable, example, tmp_path], capture_output=True, text=True, check=True)
    rows = [line.split() for line in done.stdout.splitlines() if line.split()[1:2] in (["model"], ["feedback"])]
    models, feedback = ([float(row[2]) for row in rows if row[1] == who] for who in ("model", "feedback"))
    through_c = float(done.stdout.split("through C: ")[1].split()[0])
    assert models[0] < 0.02 * feedback[0] and models[1] < 0.02 * feedback[1]
    assert through_c < 2.0 * models[1]


UPRIGHT = """<mujoco><option timestep="0.002"/><worldbody><body><joint name="cart" type="slide" axis="1 0 0" range="-1.8 1.8" limited="true"/>
  <geom type="box" size="0.1 0.05 0.05" mass="1"/><body><joint name="pole" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 0 0 1" size="0.045" mass="0.1" contype="0" conaffinity="0"/></body></body></worldbody>
  <actuator><motor joint="cart" ctrlrange="-10 10"/></actuator></mujoco>"""


def test_the_example_swings_a_cart_pole_up_by_what_was_learned(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = Path(__file__).parents[2] / "examples" / "mujoco_swing_up"
    monkeypatch.syspath_prepend(folder)
    run = importlib.import_module("run")
    file = tmp_path / "cart.xml"
    file.write_text(UPRIGHT)
    machine = plant.load(file)
    model = lg.Chain().fit(plant.record(machine, trajectories=3, seed=3)).model_
    swing = run.SwingUp(model, machine)
    next(swing.plans(seed=0, guesses=300))
    times = run.attempts(machine, swing, 3, seed=0)
    assert (times < 12.0).all(), times  # upright from then on to 20 s
    # Without the swing-up, the regulator of the top alone fails.
    swing.u = swing.u[:0]
    assert np.isinf(run.attempts(machine, swing, 1, seed=0)).all()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"kind": "ball"}, "ball or free"),
        ({"rest": '<tendon><fixed name="t"><joint joint="swing" coef="1"/></fixed></tendon><actuator><motor tendon="t"/></actuator>'}, "tendon"),
        ({"rest": "<nonsense/>"}, "MuJoCo cannot read"),
    ],
)
def test_machines_that_cannot_be_used_are_refused(tmp_path: Path, change: dict[str, str], says: str) -> None:
    with pytest.raises(lg.errors.InvalidInput, match=says):
        plant.load(pendulum(tmp_path / "own.xml", **change))


def test_wrong_arguments_are_refused(tmp_path: Path) -> None:
    arm, wrong = plant.load(pendulum(tmp_path / "own.xml")), lg.errors.InvalidInput
    with pytest.raises(wrong, match="there is no file 'absent.xml'"):
        plant.load("absent.xml")
    with pytest.raises(wrong, match="there is no joint 'elbow'"):
        plant.load(tmp_path / "own.xml", joints=["elbow"])
    with pytest.raises(wrong, match="give a file, a name"):
        plant.load(7)
    for arguments in ({"duration": -1.0}, {"duration": float("nan")}, {"trajectories": 0}, {"rate": 1e9}, {"noise": -1.0}):
        with pytest.raises(wrong):
            plant.record(arm, **arguments)
    with pytest.raises(ZeroDivisionError):
        plant.record(arm, lambda t, q, qd: [1.0 / 0.0], duration=1.0)
    with pytest.raises(wrong, match="the value of policy"):
        plant.record(arm, lambda t, q, qd: [1.0, 2.0], duration=1.0)
    letter = plant.excitation(arm, duration=1.0)
    for arguments in ({"controller": "magic"}, {"speeds": 0.0}, {"kp": [1.0, 2.0]}, {"rate": 1.0}, {"limit": [1.0, 2.0]}):
        with pytest.raises(wrong):
            lg.track(arm, arm, letter, **arguments)
    with pytest.raises(lg.errors.InvalidType, match="model is a str"):
        lg.track("run", arm, letter)
    with pytest.raises(wrong, match="cannot be pickled"):
        arm.__reduce__()


def test_a_robot_of_known_kinematics_is_learned_while_it_moves() -> None:
    machine = plant.compiled("ur5")
    machine.dof_armature[:], machine.dof_frictionloss[:], machine.dof_damping[:] = 0.2, 0.8, 1.0
    arm = plant.load(machine)
    letter = plant.excitation(arm, duration=45.0, seed=3)
    learner = lg.OnlineLearner(lg.Rigid(urdf="ur5"), n=6, angles="all")
    followed = lg.track(learner, arm, letter, speeds=0.6, velocity_noise=1e-3)
    late = slice(-7500, None)  # from 60 s on
    errors = {own.driver: np.sqrt((own.error[late] ** 2).mean()) for own in followed}
    assert errors["model"] < 1.2 * errors["truth"] and errors["model"] < 0.05 * errors["feedback"]


def test_a_load_is_taken_by_a_robot_that_is_learned_while_it_moves() -> None:
    machine = plant.compiled("ur5")
    machine.dof_armature[:], machine.dof_frictionloss[:], machine.dof_damping[:] = 0.2, 0.8, 1.0
    arm = plant.load(machine)
    machine.body_mass[-1] += 2.0
    heavier = plant.load(machine)
    letter = plant.excitation(arm, duration=20.0, seed=4)
    learner = lg.OnlineLearner(lg.Rigid(urdf="ur5"), n=6, angles="all")
    followed = lg.track(learner, arm, letter, speeds=0.6, velocity_noise=1e-3, change=(25.0, heavier))
    for first in (24.0, 25.0, 26.0, 30.0):
        span = slice(int(500 * first), int(500 * (first + 1.0)))
        errors = {own.driver: np.sqrt((own.error[span] ** 2).mean()) for own in followed}
        assert errors["model"] < 0.05 * errors["feedback"], (first, errors)
    record = followed.of("model", 0.6).record
    assert record is not None
    noticed = [event["t"] for event in record["events"] if event["kind"] == "discarded-body"]
    assert any(25.0 < t < 25.3 for t in noticed), noticed
    assert followed.of("feedback", 0.6).record is None
    with pytest.raises(lg.errors.InvalidType, match="change is a float"):
        lg.track(learner, arm, letter, change=(25.0, 2.0))  # type: ignore[arg-type]
    with pytest.raises(lg.errors.InvalidType, match="give when"):
        lg.track(learner, arm, letter, change=heavier)  # type: ignore[arg-type]
    with pytest.raises(lg.errors.InvalidInput, match="change is at -1"):
        lg.track(learner, arm, letter, change=(-1.0, heavier))
    with pytest.raises(lg.errors.LagrangianError, match="reference"):
        lg.track(learner, arm, letter, change=(1.0, plant.load("panda")))


def test_a_model_is_learned_while_a_plant_moves() -> None:
    arm = plant.load("two_link_arm")
    letter = plant.excitation(arm, duration=12.0, seed=2)
    learner = lg.OnlineLearner(lg.Delan(width=16), n=2, angles="all", seed=1)
    followed = lg.track(learner, arm, letter, kp=20.0, kd=4.0)
    late = slice(-2000, None)  # the last four seconds
    errors = {own.driver: np.sqrt((own.error[late] ** 2).mean()) for own in followed}
    assert errors["model"] < 0.2 * errors["feedback"]
    # The same learner beside a loop of one's own, on its thread.
    log = followed.of("feedback").measured
    with learner:
        for k, (t, q, qd, tau) in enumerate(zip(log.t, log.q, log.qd, log.tau, strict=True)):
            learner.update(t, q, qd, tau)
            if k % 100 == 0:
                time.sleep(0.1)
        assert learner.model is not None
        learned = learner.model.inverse_dynamics(log.q[-1], log.qd[-1], [0.0, 0.0])
        assert learned.shape == (2,) and np.isfinite(learned).all()
        record = learner.close()
    assert record["handed_over"] >= 1 and record["samples"] > 1000
    with pytest.raises(lg.errors.InvalidInput, match="many states"):
        learner.update(0.0, [[0.0, 0.0]] * 2, [0.0, 0.0], [0.0, 0.0])
    with pytest.raises(lg.errors.InvalidType, match="estimator is a str"):
        lg.OnlineLearner("delan", n=2)  # type: ignore[arg-type]
    with pytest.raises(lg.errors.InvalidInput, match="not a family"):
        lg.OnlineLearner(lg.Best(), n=2)
    with pytest.raises(lg.errors.InvalidInput, match="formula learns nothing online"):
        lg.OnlineLearner(lg.Formula(), n=2)
    with pytest.raises(lg.errors.InvalidInput, match="at most 12 joints"):
        lg.OnlineLearner(lg.Chain(), n=13)


def test_a_dm_control_that_does_not_fit_mujoco_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def load(domain: str, task: str) -> None:
        raise AttributeError("'MjModel' object has no attribute 'flex_vertedge'")

    suite = types.ModuleType("dm_control.suite")
    suite.ALL_TASKS, suite.load = (("cartpole", "swingup"),), load  # type: ignore[attr-defined]
    package = types.ModuleType("dm_control")
    package.suite = suite  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "dm_control", package)
    monkeypatch.setitem(sys.modules, "dm_control.suite", suite)
    with pytest.raises(lg.errors.InvalidInput, match="dm_control does not fit MuJoCo"):
        plant.load("dm_control:cartpole-swingup")
