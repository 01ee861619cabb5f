"""A robot that follows a motion through a model: what the model is worth to a controller."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _lagrangian
from ._estimators import Estimator
from ._model import Model
from ._online import OnlineLearner
from ._trajectory import Trajectory, _real, _whole
from .errors import InvalidInput, InvalidType

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    _Array = NDArray[np.float64]

__all__ = ["Followed", "Tracking", "track"]

CONTROLLERS = ("feed-forward", "computed-torque")
#: The names of what drives, in the order in which each speed is followed.
DRIVERS = ("model", "feedback", "truth")


class Followed(NamedTuple):
    """A robot that has followed a motion once.

    Attributes:
        driver: What gave its torques: ``model``, ``feedback`` alone, or ``truth``, the robot's own dynamics.
        speed: How many times as fast as the reference.
        rmse: The root mean square of the error of each coordinate, rad (m), shape ``(n,)``.
        largest: The largest error of each, rad (m).
        at_limit: The part of the ticks at which the torque of each was at its limit.
        error: The errors ``q_d − q`` at the ticks, rad (m), shape ``(m, n)``.
        motion: The motion, with the torques that acted.
        measured: What the sensors saw of it, with the torques that were asked for.
        diverged: When the robot was lost, s; ``None`` where it was not.
        latency: The median, the 99th percentile and the longest time of a tick of the controller, s.
        real_time: Seconds of motion that were simulated in a second.
        record: What an online learner did: samples, steps, models that were handed over or refused, and events; else ``None``.
    """

    driver: str
    speed: float
    rmse: _Array
    largest: _Array
    at_limit: _Array
    error: _Array
    motion: Trajectory
    measured: Trajectory
    diverged: float | None
    latency: tuple[float, float, float]
    real_time: float
    record: dict[str, Any] | None = None

    @property
    def overall(self) -> float:
        """The root mean square of the error over all coordinates; infinite for a robot that was lost."""
        return math.inf if self.diverged is not None else float(np.sqrt((self.rmse**2).mean()))


class Tracking(list[Followed]):
    """The motions of ``track``: for each speed the model, feedback alone, and the true dynamics where the robot has them."""

    def of(self, driver: str, speed: float = 1.0) -> Followed:
        """The motion of a driver, ``model``, ``feedback`` or ``truth``, at a speed."""
        for own in self:
            if (own.driver, own.speed) == (driver, speed):
                return own
        known = ", ".join(f"{own.driver} at {own.speed:g}" for own in self)
        raise InvalidInput(f"there is no {driver!r} at speed {speed}: there are {known}")

    def over_truth(self, speed: float = 1.0) -> float:
        """The error of the model over that of the true dynamics: 1 for a model that is right."""
        return self.of("model", speed).overall / self.of("truth", speed).overall

    def __repr__(self) -> str:
        lines = ["Tracking errors over all coordinates, root mean square:", f"{'speed':>7}  {'with':<10}{'error':>11}"]
        lines += [f"{own.speed:>7g}  {own.driver:<10}{own.overall:>11.3e}" for own in self]
        return "\n".join(lines)


def track(
    model: Model | Estimator | OnlineLearner,
    robot: Model | Estimator,
    reference: Trajectory,
    *,
    speeds: float | Sequence[float] = 1.0,
    controller: str = "feed-forward",
    rate: float = 500.0,
    kp: float | Sequence[float] = (),
    kd: float | Sequence[float] = (),
    limit: ArrayLike | None = None,
    noise: float = 0.0,
    velocity_noise: float = 0.0,
    quantisation: float = 0.0,
    drive_noise: float = 0.0,
    delay: int = 0,
    change: tuple[float, Model] | None = None,
    seed: int = 0,
) -> Tracking:
    """Lets a robot follow a motion through a model, by feedback alone, and through its own dynamics.

    Args:
        model: The model of the controller, or an ``OnlineLearner`` like which a new one learns from nothing during each motion, in lock step
            with it, by feed-forward; beside one of known kinematics an estimate of the load in the hand acts.
        robot: The robot that moves: a plant (``lagrangian.plant``), or any other model with forward dynamics.
        reference: The motion, with velocities.
        speeds: How many times as fast it is followed, one or several.
        controller: ``feed-forward`` adds the torque of the model along the reference to low-gain feedback; ``computed-torque``
            linearises the feedback by the model at the measured state.
        rate: Of the loop, Hz.
        kp, kd: Gains of the feedback, one or one for each coordinate, N·m/rad and N·m·s/rad (for ``computed-torque`` s⁻² and
            s⁻¹). By default those of 5 rad/s, critically damped, for the inertia of each joint.
        limit: The largest torques, one or one for each coordinate, N·m (N). By default those of the plant's drives.
        noise, velocity_noise: Standard deviations of measured positions, rad (m), and velocities, rad/s (m/s).
        quantisation: The step of the encoders, rad (m).
        drive_noise: The standard deviation of a drive's torque, relative to its limit.
        delay: Ticks from a decision to its torque.
        change: A robot that takes the place of the first during the motion, such as one with a load in its hand, and when, s from the start
            of the motion at each speed. The driver ``truth`` moves that robot from the start, by its own dynamics.
        seed: Of the noise.

    >>> import lagrangian as lg
    >>> from lagrangian import plant
    >>> arm = lg.system("two-link-arm")
    >>> letter = plant.excitation(arm, duration=3.0)
    >>> heavier = lg.system("two-link-arm", payload=0.05)
    >>> followed = lg.track(heavier, arm, letter, speeds=[1.0, 1.5])
    >>> followed.of("truth").overall < followed.of("model").overall < followed.of("feedback").overall
    True
    """
    from .plant import _control

    known = None if isinstance(model, OnlineLearner) else _model_of(model, "model")
    robot = _model_of(robot, "robot")
    if controller not in CONTROLLERS:
        raise InvalidInput(f"controller is {controller!r}: give one of {', '.join(CONTROLLERS)}")
    limits = getattr(robot, "limits", np.full(robot.n, math.inf)) if limit is None else np.asarray(limit, dtype=float)
    if limits.ndim == 0:
        limits = np.full(robot.n, limits)
    control = _control(
        rate, limits, (noise, velocity_noise), quantisation, drive_noise=drive_noise, delay=delay, seed=_whole(seed, "seed")
    )
    stiff, damped = ([_real(x, "kp and kd") for x in np.atleast_1d(given)] for given in (kp, kd))
    other = None if change is None else _change_of(change)
    found = Tracking()
    for speed in np.atleast_1d(speeds):
        for driver, own in zip(DRIVERS, (known, None, robot)):
            law = (controller, _real(speed, "speeds"), stiff, damped)
            learner = model._core if isinstance(model, OnlineLearner) and driver == "model" else None
            clock = time.perf_counter()
            robots = (robot, other)
            if driver == "truth" and other is not None:
                own, robots = other[1], (other[1], None)
            parts = _lagrangian.follow_reference(own, learner, robots, reference, law, control)
            found.append(_followed(driver, law, parts, clock))
    return found


def _model_of(given: Model | Estimator, name: str) -> Model:
    model = given.model_ if isinstance(given, Estimator) else given
    if not isinstance(model, Model):
        raise InvalidType(f"{name} is a {type(given).__name__}: give a model, or a plant of lagrangian.plant")
    return model


def _change_of(given: Any) -> tuple[float, Model]:
    if not (isinstance(given, tuple) and len(given) == 2):
        raise InvalidType(f"change is a {type(given).__name__}: give when, s, and the robot from then on, (20.0, heavier)")
    if not (at := _real(given[0], "change")) >= 0.0:
        raise InvalidInput(f"change is at {at} s: give seconds from the start of the motion")
    return at, _model_of(given[1], "change")


def _followed(driver: str, law: Any, found: dict[str, Any], clock: float) -> Followed:
    following, motion = found["following"], Trajectory._of(found["motion"])
    return Followed(
        driver=driver,
        speed=law[1],
        rmse=np.array(following["rmse"]),
        largest=np.array(following["largest"]),
        at_limit=np.array(following["at_limit"]),
        error=found["error"],
        motion=motion,
        measured=Trajectory._of(found["measured"]),
        diverged=found["diverged"],
        latency=found["latency"],
        real_time=float(motion.t[-1] - motion.t[0]) / (time.perf_counter() - clock),
        record=found["record"],
    )
