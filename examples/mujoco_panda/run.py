"""A Panda in MuJoCo: record it, learn it, follow a motion through the model, and again through the model's C.

pip install 'lagrangian[mujoco]'; python run.py [FOLDER]. It needs a C compiler. About a minute on two cores.
"""

import ctypes
import subprocess
import sys
from pathlib import Path

import numpy as np

import lagrangian as lg
from lagrangian import plant

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "mujoco_panda")
folder.mkdir(parents=True, exist_ok=True)

# The Panda of the examples, with the friction and the rotors that its description lacks.
machine = plant.compiled("panda")
machine.dof_armature[:] = [0.4, 0.4, 0.3, 0.3, 0.1, 0.1, 0.05]
machine.dof_frictionloss[:] = [0.8, 0.8, 0.6, 0.6, 0.3, 0.3, 0.2]
machine.dof_damping[:] = 0.5
arm = plant.load(machine)

# Nothing of the arm is told: its joints, bodies, rotors and friction are found in the log.
logs = plant.record(arm, duration=20.0, velocity_noise=1e-3, seed=1)
model = lg.Chain().fit(logs, run=folder / "run", force=True)

# A motion that the fit has not seen, at three speeds.
letter = plant.excitation(arm, duration=8.0, seed=2)
kp, kd = [150.0, 150.0, 100.0, 100.0, 30.0, 30.0, 10.0], [25.0, 25.0, 18.0, 18.0, 5.0, 5.0, 2.0]
followed = lg.track(model, arm, letter, speeds=[0.5, 1.0, 1.5], kp=kp, kd=kd)
print(followed)

# The same loop through the C of the model.
code = folder / "c"
command = [sys.executable, "-m", "lagrangian", "export", folder / "run", "--c", code, "--name", "panda", "--force"]
subprocess.run(command, check=True)
library = folder / "panda.so"
subprocess.run(["cc", "-O3", "-shared", "-fPIC", "-o", library, code / "panda.c", "-lm"], check=True)
feed_forward = ctypes.CDLL(library.resolve()).panda_feed_forward
tau, address = np.zeros(7), lambda x: np.ascontiguousarray(x).ctypes.data_as(ctypes.c_void_p)


def controller(t, q, qd):
    desired = [np.array([np.interp(t, letter.t, x) for x in rows.T]) for rows in (letter.q, letter.qd, letter.qdd)]
    feed_forward(ctypes.c_double(0.1), address(q), *map(address, desired), address(tau))
    return tau + kp * (desired[0] - q) + kd * (desired[1] - qd)


[log] = plant.record(arm, controller, duration=8.0, rate=500.0, start=(letter.q[0], letter.qd[0]))
error = log.q - np.array([np.interp(log.t, letter.t, x) for x in letter.q.T]).T
print(f"through C: {np.sqrt((error**2).mean()):.3e} rad")
