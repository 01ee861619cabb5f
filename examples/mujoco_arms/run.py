"""What a model from a log is worth to a controller: arms with friction and rotors in MuJoCo are recorded for 30 s, learned, and follow a
motion that was not recorded, at three speeds; the error is that over the true model's (MuJoCo's own inverse dynamics).

python run.py [--family rigid|chain|plain] [--seeds 11,12] [ARM …]: pip install 'lagrangian[mujoco]'. Ten seconds a line and seed on two
cores, with --family plain a minute.
"""

import argparse

import numpy as np
from arms import ARMS, compiled

import lagrangian as lg
from lagrangian import plant

SENSORS = {
    "exact": {},
    "noise of velocities 1e-3": {"velocity_noise": 1e-3},
    "16 bit, no velocities": {"quantisation": 2.0 * np.pi / 2**16, "velocities": False},
    "torques 1 %": {"torque_noise": 0.01},
    "all of these": {"velocity_noise": 3e-3, "noise": 1e-5, "torque_noise": 0.01},
    "100 Hz": {"rate": 100.0},
    "500 Hz": {"rate": 500.0},
}
SPEEDS = [0.5, 0.8, 1.25]

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("arms", nargs="*", metavar="ARM", help=", ".join(ARMS))
parser.add_argument("--family", default="rigid", choices=["rigid", "chain", "plain"])
parser.add_argument("--seeds", default="11,12")
asked = parser.parse_args()
if unknown := [name for name in asked.arms if name not in ARMS]:
    parser.error(f"there is no arm '{unknown[0]}': give {', '.join(ARMS)}")
seeds = [int(seed) for seed in asked.seeds.split(",")]

print(f"error over the true model's at {', '.join(f'{own:g}' for own in SPEEDS)} ×; a column for each seed", flush=True)
for name in asked.arms or ["two_link_arm", "ur5", "panda"]:
    arm = plant.load(compiled(name))
    for sensors, given in SENSORS.items():
        cells = []
        for seed in seeds:
            logs = plant.record(arm, duration=30.0, seed=seed, **given)
            estimator = {"rigid": lambda: lg.Rigid(urdf=name), "chain": lg.Chain, "plain": lambda: lg.Best(seconds=30.0)}
            model = estimator[asked.family]().fit(logs)
            followed = lg.track(model, arm, plant.excitation(arm, duration=8.0, seed=seed + 6), speeds=SPEEDS)
            cells.append(" / ".join(f"{followed.over_truth(speed):.2f}" for speed in SPEEDS))
        print(f"{name:14s} {asked.family:6s} {sensors:26s} {'   '.join(cells)}", flush=True)
