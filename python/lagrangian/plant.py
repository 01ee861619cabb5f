"""Plants: machines that a simulator moves, as sources of recordings and as robots of control loops.

A plant is a model that moves by the simulator's own integrator, with its friction, rotors, limits and contacts. It answers for its
dynamics as any model does, and nothing of it is known to a fit::

    from lagrangian import plant

    arm = plant.load("robot.xml")
    model = lg.fit(plant.record(arm, duration=30.0))
    lg.track(model, arm, reference, speeds=[1.0, 1.5, 2.5])

MuJoCo is what moves them: ``pip install 'lagrangian[mujoco]'``.
"""

from __future__ import annotations

import math
import os
import re
import threading
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _lagrangian
from ._model import Model
from ._trajectory import Trajectories, Trajectory, _real, _whole
from .errors import InvalidInput, MissingExtra

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Self

    _Array = NDArray[np.float64]

__all__ = ["Plant", "compiled", "excitation", "load", "record"]

#: The largest description, bytes; meshes lie in files of their own.
_LARGEST = 64 << 20
#: The largest number of ticks of a loop: all are held in memory.
_MOST_TICKS = 5_000_000


class Plant(Model):
    """A machine in MuJoCo, made by ``load``. Forces act on its joints; the machine's own actuators are off.

    Attributes:
        limits: The largest torque of each drive, N·m (N), shape ``(n,)``: 0 for a joint without a drive, infinite without a limit.
        ranges: The range of each coordinate, shape ``(n, 2)``; infinite without a limit.
    """

    __slots__ = ("limits", "ranges")

    limits: _Array
    ranges: _Array

    def __new__(cls, machine: _Machine) -> Self:
        new = super().__new__(cls, _lagrangian.plant(machine, machine.coordinates))
        new.limits, new.ranges = machine.limits, machine.ranges
        return new

    def __reduce__(self) -> Any:
        raise InvalidInput("a plant cannot be pickled: load it again where it is needed")


def load(source: Any, *, joints: Sequence[str] = ()) -> Plant:
    """A plant of a file or of another library.

    Args:
        source: A file in MJCF or URDF; ``dm_control:DOMAIN-TASK`` such as ``dm_control:cartpole-swingup``; ``gymnasium:ID`` such as
            ``gymnasium:Reacher-v5``; the name of an example such as ``panda``; or a ``mujoco.MjModel``.
        joints: The joints that move, in the order of the coordinates; the others are locked. All of them by default.

    Raises:
        MissingExtra: MuJoCo, or the library of the source, is not installed.
        InvalidInput: There is no such machine, or it moves in ways other than hinges and slides.

    >>> from lagrangian import plant
    >>> arm = plant.load("ur5")
    >>> arm.n, float(arm.limits[0])
    (6, 150.0)
    """
    return Plant(_Machine(compiled(source), joints))


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtra("plants are moved by MuJoCo: pip install 'lagrangian[mujoco]'") from error
    return mujoco


def compiled(source: Any) -> Any:
    """The ``mujoco.MjModel`` of a source, as ``load`` takes it: its friction, rotors and masses can be changed before it is loaded."""
    mujoco = _mujoco()
    if isinstance(source, mujoco.MjModel):
        return source
    if not isinstance(source, (str, os.PathLike)):
        raise InvalidInput(f"source is a {type(source).__name__}: give a file, a name, or a mujoco.MjModel")
    text = os.fspath(source)
    library, _, name = text.partition(":")
    if library == "dm_control" and name:
        return _of_dm_control(name)
    if library == "gymnasium" and name:
        return _of_gymnasium(name)
    if not os.path.exists(text):
        known = _lagrangian.example_urdf(text)
        if known is None:
            raise InvalidInput(f"there is no file '{text}', and no example of that name: give a file in MJCF or URDF")
        return _of_urdf(known)
    if not os.path.isfile(text) or os.path.getsize(text) > _LARGEST:
        raise InvalidInput(f"'{text}' is no file of at most {_LARGEST >> 20} MiB: give the description of one machine")
    try:
        content = Path(text).read_text(encoding="utf-8")
        if re.search(r"<robot[\s>]", content):
            return _of_urdf(content)
        return mujoco.MjModel.from_xml_path(text)
    except (ValueError, ElementTree.ParseError) as error:
        raise InvalidInput(f"MuJoCo cannot read '{text}': {error}: correct the file") from error


def _of_dm_control(name: str) -> Any:
    # Nothing is drawn, and nothing looks for a display.
    os.environ.setdefault("MUJOCO_GL", "off")
    try:
        from dm_control import suite
    except ImportError as error:
        raise MissingExtra(f"'dm_control:{name}' needs dm_control: pip install dm_control") from error
    domain, _, task = name.partition("-")
    if (domain, task) not in suite.ALL_TASKS:
        known = ", ".join("-".join(pair) for pair in suite.ALL_TASKS)
        raise InvalidInput(f"dm_control has no '{name}': give one of {known}")
    try:
        return suite.load(domain, task).physics.model.ptr
    except AttributeError as error:
        # dm_control names the fields of a model of MuJoCo as its own version has them.
        raise InvalidInput(
            f"dm_control does not fit MuJoCo {_mujoco().__version__} ({error}): update it, or install an older one: pip install 'mujoco<4'"
        ) from error


def _of_gymnasium(name: str) -> Any:
    try:
        import gymnasium
    except ImportError as error:
        raise MissingExtra(f"'gymnasium:{name}' needs it: pip install 'gymnasium[mujoco]'") from error
    try:
        model = getattr(gymnasium.make(name).unwrapped, "model", None)
    except ImportError as error:
        raise MissingExtra(f"'gymnasium:{name}' needs more of it: pip install 'gymnasium[mujoco]' ({error})") from error
    except gymnasium.error.Error as error:
        raise InvalidInput(f"gymnasium cannot make '{name}': {error}") from error
    if not isinstance(model, _mujoco().MjModel):
        raise InvalidInput(f"'gymnasium:{name}' is not a machine in MuJoCo: give one of its MuJoCo environments")
    return model


def _of_urdf(text: str) -> Any:
    """A robot without its meshes, which seldom lie beside the text, and whose contacts they would be."""
    robot = ElementTree.fromstring(text)
    for link in robot.iter("link"):
        for part in link.findall("visual") + link.findall("collision"):
            link.remove(part)
    try:
        return _mujoco().MjModel.from_xml_string(ElementTree.tostring(robot, encoding="unicode"))
    except ValueError as error:
        raise InvalidInput(f"MuJoCo cannot read the URDF: {error}: correct the file") from error


class _Machine:
    """The state of a simulation in MuJoCo, and the answers that a plant gives of single states."""

    def __init__(self, model: Any, joints: Sequence[str]) -> None:
        mujoco = _mujoco()
        self.model = model.__copy__()
        names = [self.model.joint(k).name or f"q{k + 1}" for k in range(self.model.njnt)]
        hinge, slide = int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)
        for name, kind in zip(names, self.model.jnt_type):
            if kind not in (hinge, slide):
                raise InvalidInput(f"joint '{name}' is a ball or free: a plant has hinges and slides; fix its base")
        if unknown := [name for name in joints if name not in names]:
            raise InvalidInput(f"there is no joint '{unknown[0]}': its joints are {', '.join(names)}")
        if len(set(joints)) < len(joints):
            raise InvalidInput("joints names one of them twice")
        if not names:
            raise InvalidInput("the machine has no joints: give one that moves")
        if self.model.neq and self.model.eq_active0.any():
            raise InvalidInput("its joints are tied to each other (<equality>), so that no torques are those of a motion: remove the ties")
        #: The joints of the coordinates; each has one degree of freedom, in the same order.
        self.own = np.array([names.index(name) for name in joints] or range(len(names)))
        others = np.setdiff1d(np.arange(len(names)), self.own)
        # A joint of so large a rotor stands still.
        self.model.dof_armature[others] = 1e12
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
        self.step = float(self.model.opt.timestep)
        turns = self.model.jnt_type[self.own] == hinge
        self.coordinates = [
            (names[k], "rad" if turn else "m", "circle" if turn else "line") for k, turn in zip(self.own, turns)
        ]
        limited = self.model.jnt_limited[self.own].astype(bool)[:, None]
        self.ranges = np.where(limited, self.model.jnt_range[self.own], [-math.inf, math.inf])
        self.limits = _limits(self.model, names)[self.own]
        self.data = mujoco.MjData(self.model)
        self.rest = self.data.qpos.copy()
        # MuJoCo lets other threads of Python run while it computes.
        self.lock = threading.Lock()

    def _put(self, q: _Array, qd: _Array) -> Any:
        data, own = self.data, self.own
        data.qpos[:], data.qvel[:] = self.rest, 0.0
        data.qpos[own], data.qvel[own] = q, qd
        return data

    def advance(self, q: _Array, qd: _Array, tau: _Array, seconds: float) -> _Array:
        """The state (q, q̇) after some seconds of the simulator's steps; NaN where it has lost the machine."""
        mujoco = _mujoco()
        with self.lock:
            data = self._put(q, qd)
            data.qfrc_applied[self.own] = tau
            steps = max(1, math.ceil(seconds / self.step - 1e-6))
            self.model.opt.timestep = seconds / steps
            mujoco.mj_step(self.model, data, steps)
            # MuJoCo puts a machine that it has lost back to its start.
            if any(data.warning[kind].number for kind in _lost(mujoco)):
                mujoco.mj_resetData(self.model, data)
                return np.full(2 * len(self.own), math.nan)
            return np.concatenate([data.qpos[self.own], data.qvel[self.own]])

    def forward(self, q: _Array, qd: _Array, tau: _Array) -> _Array:
        """The accelerations under forces."""
        with self.lock:
            data = self._put(q, qd)
            data.qfrc_applied[self.own] = tau
            _mujoco().mj_forward(self.model, data)
            return np.array(data.qacc[self.own])

    def inverse(self, q: _Array, qd: _Array, qdd: _Array) -> _Array:
        """The forces that yield accelerations."""
        with self.lock:
            data = self._put(q, qd)
            data.qacc[:] = 0.0
            data.qacc[self.own] = qdd
            _mujoco().mj_inverse(self.model, data)
            return np.array(data.qfrc_inverse[self.own])

    def mass(self, q: _Array) -> _Array:
        """The mass matrix, with rotors."""
        mujoco, size = _mujoco(), self.model.nv
        rows, column = np.zeros((len(self.own), size)), np.zeros(size)
        with self.lock:
            data = self._put(q, np.zeros_like(q))
            mujoco.mj_forward(self.model, data)
            for row, joint in zip(rows, self.own):
                column[joint] = 1.0
                mujoco.mj_mulM(self.model, data, row, column)
                column[joint] = 0.0
        return np.ascontiguousarray(rows[:, self.own])


def _lost(mujoco: Any) -> list[int]:
    kinds = mujoco.mjtWarning
    return [int(kinds.mjWARN_BADQPOS), int(kinds.mjWARN_BADQVEL), int(kinds.mjWARN_BADQACC)]


def _limits(model: Any, names: list[str]) -> _Array:
    """The largest torque of the drives of each joint: the sum over its actuators. Without any actuator every joint has a drive."""
    mujoco = _mujoco()
    of_joint = np.where(model.jnt_actfrclimited, np.abs(model.jnt_actfrcrange).max(axis=1), math.inf)
    if model.nu == 0:
        return np.asarray(of_joint, dtype=float)
    found = np.zeros(len(names))
    plain = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
    fixed, none = int(mujoco.mjtGain.mjGAIN_FIXED), int(mujoco.mjtBias.mjBIAS_NONE)
    for k in range(model.nu):
        if model.actuator_trntype[k] not in plain:
            name = model.actuator(k).name or str(k)
            raise InvalidInput(f"actuator '{name}' acts through a tendon or a site: give a machine whose drives act on joints")
        gear, force = abs(float(model.actuator_gear[k, 0])), math.inf
        if model.actuator_forcelimited[k]:
            force = float(np.abs(model.actuator_forcerange[k]).max())
        elif model.actuator_ctrllimited[k] and (model.actuator_gaintype[k], model.actuator_biastype[k]) == (fixed, none):
            force = abs(float(model.actuator_gainprm[k, 0])) * float(np.abs(model.actuator_ctrlrange[k]).max())
        found[model.actuator_trnid[k, 0]] += gear * force
    return np.minimum(found, of_joint)


def record(
    robot: Model,
    policy: Callable[[float, _Array, _Array], ArrayLike] | None = None,
    *,
    duration: float = 10.0,
    trajectories: int = 1,
    start: tuple[ArrayLike, ArrayLike] | None = None,
    rate: float = 200.0,
    noise: float = 0.0,
    velocity_noise: float = 0.0,
    torque_noise: float = 0.0,
    quantisation: float = 0.0,
    velocities: bool = True,
    delay: int = 0,
    seed: int = 0,
) -> Trajectories:
    """Recordings of a robot, as its sensors see it.

    Args:
        robot: A plant, or any other model that moves.
        policy: A function of (t, q, qd), as they are measured, that returns the torques ``(n,)``. Without one, the drives follow sums
            of sines within the middle of their ranges, and joints without a drive begin anywhere at rest.
        duration: Of each recording, s.
        trajectories: The number of recordings.
        start: The state (q, qd) in which a policy begins; by default the start of a motion that it does not follow, at rest.
        rate: Of the log, and of the loop, Hz. A torque acts from one row to the next.
        noise, velocity_noise: Standard deviations of measured positions, rad (m), and velocities, rad/s (m/s).
        torque_noise: That of measured torques, relative to the root mean square of each.
        quantisation: The step of the encoders, rad (m).
        velocities: Whether velocities are in the log.
        delay: Ticks from a state to its measurement.
        seed: Of the motions and the noise.

    >>> from lagrangian import plant
    >>> [log] = plant.record(plant.load("two_link_arm"), duration=1.0)
    >>> log
    Trajectory('record 1': 200 samples of shoulder, elbow in 0.995 s; q, qd, tau)
    """
    duration, rate = _real(duration, "duration"), _real(rate, "rate")
    _require_rows(duration, rate)
    if _whole(trajectories, "trajectories") < 1:
        raise InvalidInput(f"trajectories is {trajectories}: record at least one")
    limits = _limits_of(robot)
    control = _control(rate, limits, (noise, velocity_noise), quantisation, sensor_delay=delay, seed=seed)
    draw = np.random.default_rng(seed)
    logs = []
    for k in range(trajectories):
        control["seed"] = int(seed) + k
        reference = _sines(robot, limits, duration, rate, draw)
        if policy is None:
            gains = _gains(robot, limits, reference)
            # Where every joint has a drive the robot knows what the motion takes, and feedback has little to do.
            own = robot if (limits > 0.0).all() else None
            found = _lagrangian.follow_reference(own, None, (robot, None), reference, ("feed-forward", 1.0, *gains), control)
        else:
            state = (reference.q[0], np.zeros(robot.n)) if start is None else start
            rows = [[_real(x, "start") for x in np.atleast_1d(own)] for own in state]
            found = _lagrangian.drive(robot, policy, (rows[0], rows[1]), duration, control)
        if found["diverged"] is not None:
            raise InvalidInput(
                f"the simulation has lost the robot after {found['diverged']} s: record at a higher rate, or move it more slowly"
            )
        log = Trajectory._of(found["measured"])
        assert log.tau is not None
        size = np.sqrt((log.tau**2).mean(axis=0))
        log.tau = log.tau + torque_noise * size * draw.standard_normal(log.tau.shape)
        log.qd = log.qd if velocities else None
        log.name = f"record {k + 1}"
        logs.append(log)
    return Trajectories(logs)


def _control(
    rate: float,
    limits: ArrayLike,
    noise: tuple[float, float] = (0.0, 0.0),
    quantisation: float = 0.0,
    *,
    drive_noise: float = 0.0,
    delay: int = 0,
    sensor_delay: int = 0,
    seed: int = 0,
) -> dict[str, Any]:
    """The loop between sensors and drives, as the library takes it."""
    return {
        "rate": _real(rate, "rate"),
        "limit": [float(limit) for limit in np.atleast_1d(limits)],
        "noise": (_real(noise[0], "noise"), _real(noise[1], "velocity_noise")),
        "quantisation": _real(quantisation, "quantisation"),
        "drive_noise": _real(drive_noise, "drive_noise"),
        "delay": _whole(delay, "delay"),
        "sensor_delay": _whole(sensor_delay, "delay"),
        "seed": _whole(seed, "seed"),
    }


def excitation(robot: Model, *, duration: float = 10.0, rate: float = 200.0, seed: int = 0) -> Trajectory:
    """The motion that ``record`` lets the drives of a robot follow without a policy: sums of sines within the middle of their ranges.

    Joints without a drive stay where they begin.

    >>> from lagrangian import plant
    >>> plant.excitation(plant.load("ur5"), duration=2.0).qd.shape
    (401, 6)
    """
    duration, rate = _real(duration, "duration"), _real(rate, "rate")
    _require_rows(duration, rate)
    return _sines(robot, _limits_of(robot), duration, rate, np.random.default_rng(seed))


def _limits_of(robot: Model) -> _Array:
    return np.asarray(getattr(robot, "limits", np.full(robot.n, math.inf)))


def _require_rows(duration: float, rate: float) -> None:
    if not 1 <= duration * rate <= _MOST_TICKS:
        raise InvalidInput(f"duration is {duration} s at {rate} Hz: give 1 to {_MOST_TICKS} rows")


def _sines(robot: Model, limits: _Array, duration: float, rate: float, draw: np.random.Generator) -> Trajectory:
    n = robot.n
    ranges = np.asarray(getattr(robot, "ranges", np.full((n, 2), math.inf)))
    bounded = np.isfinite(ranges).all(axis=1)
    low, high = np.where(bounded[:, None], ranges, [-math.pi, math.pi]).T
    middle, reach = 0.5 * (low + high), np.minimum(0.35 * (high - low), _REACH)
    drives = limits > 0.0
    t = np.arange(math.ceil(duration * rate) + 1) / rate
    q, qd, qdd = (np.zeros((len(t), n)) for _ in range(3))
    for i in range(n):
        if not drives[i]:
            wide = reach[i] if bounded[i] else high[i]
            q[:, i] = middle[i] + wide * draw.uniform(-1.0, 1.0)
            continue
        frequencies = 2.0 * math.pi * np.geomspace(0.06, 0.6, 4) * draw.uniform(0.8, 1.25, 4)
        sizes = reach[i] * draw.dirichlet(np.full(4, 4.0))
        for w, a, phase in zip(frequencies, sizes, draw.uniform(0.0, 2.0 * math.pi, 4)):
            q[:, i] += a * np.sin(w * t + phase)
            qd[:, i] += a * w * np.cos(w * t + phase)
            qdd[:, i] -= a * w * w * np.sin(w * t + phase)
        q[:, i] += middle[i]
    reference = Trajectory(t, q, qd, qdd)
    reference.coordinates = robot.coordinates
    return reference


def _gains(robot: Model, limits: _Array, reference: Trajectory) -> tuple[list[float], list[float]]:
    """Gains of the drives by what each moves alone, while the other joints give way."""
    q = reference.q
    free = np.linalg.pinv(robot.mass_matrix(q[:: max(1, len(q) // 20)]))
    inertia = np.where(limits > 0.0, 1.0 / np.einsum("kii->ki", free).max(axis=0), 0.0)
    return list(_STIFF**2 * inertia), list(2.0 * _STIFF * inertia)


#: The farthest that a drive is moved from the middle of its range, rad (m).
_REACH = 1.2
#: The bandwidth of the feedback that excites a machine, rad/s: gravity moves it little.
_STIFF = 20.0
