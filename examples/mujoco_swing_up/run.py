"""Swings up the cart-pole and the acrobot of dm_control in MuJoCo, by a controller that knows only a learned model.

python run.py [--seed N] [--starts N] [--no-truth] [MACHINE …]: pip install 'lagrangian[mujoco]' dm_control scipy.

Each machine is recorded for 40 s and learned by a plain fit. ``controller.py`` plans a swing-up in the model; of at most
four plans the one that succeeds in the model itself from most of ten starts drives the machine from 30 others. The true
model takes the place of the learned one for comparison.
"""

from __future__ import annotations

import argparse
from itertools import islice

import numpy as np
from controller import Array, SwingUp

import lagrangian as lg
from lagrangian import plant

RATE = 100.0  # of the loop, Hz, as in dm_control
SECONDS, HELD = 20.0, 2.0  # the time for an attempt, and how long the machine is held at its end, s
UPRIGHT = 0.1  # the angle of each link from the vertical, rad


def learned(machine: plant.Plant, seed: int) -> lg.Model:
    """A model of motions that the drives follow or, where nothing stops a joint, of random pushes, which make it faster."""
    pushes = np.random.default_rng(seed).choice([-1.0, 1.0], (50, 1)) * machine.limits
    policy = None if np.isfinite(machine.ranges).any() else lambda t, q, qd: pushes[int(t / 0.3)]
    return lg.fit(plant.record(machine, policy, duration=10.0, trajectories=4, seed=seed)).model_


def attempts(robot: lg.Model, swing: SwingUp, count: int, seed: int) -> Array:
    """The times from which all links stay upright, s, from random starts near hanging; infinite where they do not."""
    draw, found = np.random.default_rng(seed), np.full(count, np.inf)
    for i in range(count):
        start = swing.hanging + draw.normal(0.0, 0.1, 2 * swing.n)
        try:
            [log] = plant.record(robot, swing, start=(start[: swing.n], start[swing.n :]), duration=SECONDS, rate=RATE)
        except lg.errors.InvalidInput:  # the simulation has lost the machine
            continue
        links = np.cumsum(log.q[:, swing.hinges[: swing.n]], axis=1)
        since = (np.flatnonzero((np.cos(links) < np.cos(UPRIGHT)).any(axis=1))[-1] + 1) / RATE
        found[i] = since if since <= SECONDS - HELD else np.inf
    return found


def controller(model: lg.Model, machine: plant.Plant, seed: int) -> SwingUp:
    """The controller with the plan, of four at most, that succeeds in the model from the most of ten starts."""
    swing, best = SwingUp(model, machine), -1
    plan = swing.x, swing.u, swing.gains
    for _ in islice(swing.plans(seed), 4):
        count = np.isfinite(attempts(model, swing, 10, seed + 1)).sum()
        if count > best:
            best, plan = count, (swing.x, swing.u, swing.gains)
        if best == 10:
            break
    swing.x, swing.u, swing.gains = plan
    return swing


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("machines", nargs="*", default=["dm_control:cartpole-swingup", "dm_control:acrobot-swingup"])
    parser.add_argument("--seed", type=int, default=0, help="of the recordings and of the search for a plan")
    parser.add_argument("--starts", type=int, default=0, help="the seed of the starts")
    parser.add_argument("--no-truth", action="store_true", help="the learned model alone")
    args = parser.parse_args()
    for name in args.machines:
        machine = plant.load(name)
        for kind in ["learned", "true"][: 1 if args.no_truth else 2]:
            model = learned(machine, args.seed) if kind == "learned" else machine
            times = attempts(machine, controller(model, machine, args.seed), 30, args.starts)
            print(f"{name:28s} {kind:8s} {np.isfinite(times).sum()} of 30, upright after {np.median(times):.2f} s", flush=True)
