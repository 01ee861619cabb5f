"""Tries an installed package in a folder without its sources: simulates, fits, predicts, saves and loads."""

import sys
import tempfile
from pathlib import Path

import lagrangian as lg
import numpy as np

sources = Path(__file__).resolve().parents[1]
package = Path(lg.__file__).resolve()
if package.is_relative_to(sources):
    sys.exit(f"{package} is the package of the sources, not that of the wheel")

motion = lg.simulate("pendulum", duration=5.0, seed=0)
model = lg.Lnn(width=8, steps=20, seed=0).fit(motion)
q, qd = np.array([0.3]), np.array([0.1])
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "pendulum.safetensors"
    model.save(path)
    again = lg.load(path)
same = np.array_equal(again.forward_dynamics(q, qd), model.forward_dynamics(q, qd))
if not same:
    sys.exit("the loaded model is another one")
print(f"lagrangian {lg.__version__} in {package.parent}: fits, predicts, saves and loads")
