"""How well a plain fit learns machines in MuJoCo: each is recorded for 40 s, learned, and judged by motions that were not recorded.

python run.py [--noisy] MACHINE …, such as dm_control:acrobot-swingup or robot.xml: pip install 'lagrangian[mujoco]' dm_control.
Half a minute each on two cores. With --noisy positions come from encoders of 16 bit without velocities, and torques err by 1 %.
"""

import sys

import numpy as np

import lagrangian as lg
from lagrangian import plant

names = sys.argv[1:]
sensors = {}
if "--noisy" in names:
    names.remove("--noisy")
    sensors = {"quantisation": 2.0 * np.pi / 2**16, "torque_noise": 0.01, "velocities": False}

print(f"{'machine':34s} {'kept':8s} {'verdict':8s} squared errors of the acceleration over its variance, in all; of each joint")
for name in names:
    machine = plant.load(name)
    fitted = lg.fit(plant.record(machine, duration=10.0, trajectories=4, seed=5, **sensors))
    errors, truths = [], []
    for motion in plant.record(machine, duration=10.0, trajectories=3, seed=77):
        states = motion.q[::5], motion.qd[::5], motion.tau[::5]
        truths.append(machine.forward_dynamics(*states))
        errors.append(fitted.model_.forward_dynamics(*states) - truths[-1])
    error, variance = (np.concatenate(errors) ** 2).mean(axis=0), np.concatenate(truths).var(axis=0)
    joints = ", ".join(f"{x:.1e}" for x in error / variance)
    print(f"{name:34s} {fitted.model_.family:8s} {fitted.verdict_:8s} {error.sum() / variance.sum():.1e}; {joints}", flush=True)
