"""A robot that is learned from nothing while it moves, its kinematics known or (--model chain) not, and that changes after 40 s: it takes a
load, its friction grows by half, or a link in its middle does. Arms with friction and rotors in MuJoCo; the error is that over the true model's,
which has the change from the start (in brackets that of feedback alone).

python online.py [--model rigid|chain] [--change load|friction|link|none] [--seeds 11,12] [ARM …]: pip install 'lagrangian[mujoco]'. Fifteen
seconds a line, a chain 30.
"""

import argparse

import mujoco
import numpy as np
from arms import ARMS, compiled

import lagrangian as lg
from lagrangian import plant

AT, RATE = 40.0, 500.0
LOADS = {"two_link_arm": 0.3}  # kg; 2 kg for the others
SPANS = [(-20.0, -10.0), (-5.0, 0.0), (0.0, 0.5), (0.5, 1.5), (1.5, 5.0), (5.0, 10.0), (10.0, 20.0)]  # s from the change on


def changed(name, change):
    """The arm after the change."""
    machine = compiled(name)
    if change == "load":
        kg, hand = LOADS.get(name, 2.0), machine.nbody - 1
        mass = machine.body_mass[hand] + kg
        machine.body_ipos[hand] += kg / mass * (np.array([0.0, 0.0, 0.05]) - machine.body_ipos[hand])
        machine.body_mass[hand] = mass
    if change == "friction":
        machine.dof_frictionloss[:] *= 1.5
        machine.dof_damping[:] *= 1.5
    if change == "link":
        machine.body_mass[machine.nbody // 2] *= 1.5
    mujoco.mj_setConst(machine, mujoco.MjData(machine))
    return plant.load(machine)


parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("arms", nargs="*", metavar="ARM", help=", ".join(ARMS))
parser.add_argument("--model", default="rigid", choices=["rigid", "chain"])
parser.add_argument("--change", default="load", choices=["load", "friction", "link", "none"])
parser.add_argument("--seeds", default="11,12")
asked = parser.parse_args()
if unknown := [name for name in asked.arms if name not in ARMS]:
    parser.error(f"there is no arm '{unknown[0]}': give {', '.join(ARMS)}")

print(f"{asked.model}, change: {asked.change}; seconds from it: {', '.join(f'{a:g} … {b:g}' for a, b in SPANS)}", flush=True)
for name in asked.arms or ARMS:
    arm, other = plant.load(compiled(name)), changed(name, asked.change)
    for seed in (int(seed) for seed in asked.seeds.split(",")):
        letter = plant.excitation(arm, duration=37.5, seed=seed)
        family = lg.Chain() if asked.model == "chain" else lg.Rigid(urdf=name)
        learner = lg.OnlineLearner(family, n=arm.n, angles="all")
        followed = lg.track(
            learner, arm, letter, speeds=37.5 / 60.0, rate=RATE, velocity_noise=1e-3, noise=1e-5, change=(AT, other)
        )
        cells = []
        for span in SPANS:
            first, last = (int((AT + t) * RATE) for t in span)
            error = {own.driver: np.sqrt((own.error[first:last] ** 2).mean()) for own in followed}
            cells.append(f"{error['model'] / error['truth']:.2f} ({error['feedback'] / error['truth']:.0f})")
        print(f"{name:14s} {seed:3d}  {'  '.join(cells)}", flush=True)
