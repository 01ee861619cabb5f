"""What the package costs over the library: calls, the import, a fit beside that of the command.

    python tools/figures.py [--command PATH]

Each figure is a ratio or a difference within one run, the least or the median of several rounds that alternate, since machines are
never quiet. A release build is measured: ``maturin build --release``, installed. Exits with 1 where a figure misses its limit.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import lagrangian as lg
from lagrangian import _lagrangian

ROUNDS = 20


def least(call: Callable[[], object], calls: int) -> float:
    """The least mean time of so many calls in ten rounds, s, as the library measures its own."""

    def mean() -> float:
        start = time.perf_counter()
        for _ in range(calls):
            call()
        return (time.perf_counter() - start) / calls

    return min(mean() for _ in range(10))


def overhead(states: int, calls: int) -> tuple[float, float]:
    """The time of one ``inverse_dynamics`` of a robot of seven joints with ``out=``, and the library's own, s."""
    robot = lg.robot("iiwa7")
    shape = (7,) if states == 1 else (states, 7)
    q, qd, qdd = np.random.default_rng(0).uniform(-1.0, 1.0, (3, *shape))
    out = np.empty(shape)
    pairs = []
    for _ in range(ROUNDS):
        own = _lagrangian.library_seconds(robot, (q, qd, qdd), calls)
        pairs.append((least(lambda: robot.inverse_dynamics(q, qd, qdd, out=out), calls), own))
    return min(all for all, _ in pairs), min(own for _, own in pairs)


def imported(code: str) -> float:
    """The least time of an interpreter that runs this, s."""

    def once() -> float:
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        return time.perf_counter() - start

    return min(once() for _ in range(ROUNDS))


def fits(command: str) -> tuple[list[float], list[float], bool]:
    """Times of the same fit from Python and by the command, and whether the weights have the same bits."""
    with tempfile.TemporaryDirectory() as folder:
        data = Path(folder) / "swings.csv"
        lg.write(data, lg.simulate("double-pendulum", trajectories=10, duration=4.0, seed=1))
        ours, theirs = [], []
        for k in range(7):
            start = time.perf_counter()
            motions = lg.read(data)
            fitted = lg.Lnn(steps=400, width=32, seed=3).fit(motions, run=Path(folder) / f"ours{k}")
            ours.append(time.perf_counter() - start)
            words = ["fit", str(data), "--model", "lnn", "--steps", "400", "--width", "32", "--seed", "3", "--quiet"]
            start = time.perf_counter()
            subprocess.run([command, *words, "--out", f"{folder}/theirs{k}"], check=True, capture_output=True)
            theirs.append(time.perf_counter() - start)
        states = lg.read(data)[0]
        one, other = (model.energy(states.q, states.qd) for model in (fitted.model_, lg.load(f"{folder}/theirs0")))
        return ours, theirs, bool(np.array_equal(one, other))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--command", help="the command `lagrangian`, in release, for the fits")
    asked = parser.parse_args()
    missed = []

    def tell(what: str, figure: float, limit: float, unit: str) -> None:
        print(f"{what:<62}{figure:9.2f} {unit:<3} (at most {limit:g})")
        if figure > limit:
            missed.append(what)

    one, own = overhead(1, 1000)
    print(f"one inverse_dynamics, n = 7: {1e6 * one:.2f} µs, the library's own {1e6 * own:.2f} µs")
    tell("overhead of one call", 1e6 * (one - own), 2.0, "µs")
    many, own = overhead(10_000, 1)
    tell("10 000 states over the library's own time", 100.0 * (many / own - 1.0), 5.0, "%")
    bare, numpy = imported("pass"), imported("import numpy")
    whole = imported("import lagrangian")
    print(f"import: {1e3 * (whole - bare):.0f} ms, {1e3 * (numpy - bare):.0f} ms of them NumPy's")
    tell("import lagrangian", 1e3 * (whole - bare), 150.0, "ms")
    if asked.command:
        ours, theirs, same = fits(asked.command)
        ratio = statistics.median(a / b for a, b in zip(ours, theirs))
        print(f"a fit: {statistics.median(ours):.2f} s from Python, {statistics.median(theirs):.2f} s by the command")
        tell("the same fit from Python over that by the command", 100.0 * (ratio - 1.0), 3.0, "%")
        tell("fits whose bits differ", float(not same), 0.0, "")
    for what in missed:
        print(f"missed: {what}")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
