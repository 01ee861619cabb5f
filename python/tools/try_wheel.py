"""Tries an installed package in a folder without its sources: simulates, fits, predicts, saves and loads, and runs its command."""

import subprocess
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
    command = [Path(sys.executable).with_name("lagrangian")]
    table, bag = Path(folder) / "arm.csv", Path(folder) / "arm.mcap"
    subprocess.run([*command, "simulate", "two-link-arm", "--drive", "1", "--out", table], check=True)
    subprocess.run([sys.executable, sources / "tests" / "bags.py", table, bag], check=True)
    [recorded] = lg.read(bag)
    subprocess.run([*command, "convert", bag, "--out", Path(folder) / "again.csv"], check=True)
    refused = subprocess.run([*command, "check", Path(folder) / "none.csv"], capture_output=True)
same = np.array_equal(again.forward_dynamics(q, qd), model.forward_dynamics(q, qd))
if recorded.q.shape[1] != 2 or refused.returncode != 2:
    sys.exit("the command has another exit code, or the bag other joints")
if not same:
    sys.exit("the loaded model is another one")
print(f"lagrangian {lg.__version__} in {package.parent}: fits, predicts, saves, loads, and reads bags; so does its command")
