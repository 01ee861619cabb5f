"""A Lagrangian by xL-SINDy (py-xl-sindy), for one case of the experiment `laws`.

Input and output as of `sindy.py`. The catalogue has products of two velocities at most, and of two functions of places at most, sines and
cosines for angles, and viscous friction; that of a system of more than two coordinates takes hours. No force acts, so that the regression is the
implicit one.
"""

import contextlib
import io
import itertools
import json
import logging
import sys
import warnings

import numpy as np

try:
    import pysindy as ps
    import sympy as sp
    from xlsindy import catalog, catalog_base, dynamics_modeling, simulation, symbolic_util
except ImportError:
    sys.exit(3)

WINDOWS = (11, 41)  # samples that the derivative is smoothed over
WEIGHTS = (1e-7, 1e-5, 1e-3)  # of the size of the coefficients
LEAST = 1e-2  # of the norm of all coefficients, below which one is none
MOST_TERMS = 100
SAMPLES = 4  # for each term of the catalogue
EVERY = 7  # of the states that judge


def terms(angles, symbols):
    """The terms of a Lagrangian; without squares of sines, which those of cosines make up."""
    n = len(angles)
    places = [f(symbols[1, i]) for i in range(n) for f in ((sp.sin, sp.cos) if angles[i] else (lambda x: x,))]
    sines = [sp.sin(symbols[1, i]) for i in range(n)]
    pairs = itertools.combinations_with_replacement(places, 2)
    places += [a * b for a, b in pairs if not (a == b and a in sines)]
    speeds = symbolic_util.generate_full_catalog([lambda i: symbols[2, i]], n, 2)
    return symbolic_util.cross_catalog(np.array(speeds), np.array(places))


def error_of(solution, parts, symbols, time, truth):
    """The error of the accelerations of a solution, and its terms; none where it has no inertia."""
    solution = np.where(np.abs(solution) < LEAST * np.linalg.norm(solution), 0.0, solution)
    function, valid = dynamics_modeling.generate_acceleration_function(solution, parts, symbols, time)
    if not valid:
        return None
    q, qd, qdd = (x[::EVERY] for x in truth)
    found = []
    for place, speed in zip(q, qd):
        state = np.zeros((4, q.shape[1]))
        state[1], state[2] = place, speed
        found.append(function(state)[:, 0])
    error = float(np.mean(((np.array(found) - qdd) ** 2).mean(0) / qdd.var(0)))
    return (error, int(np.count_nonzero(solution))) if np.isfinite(error) else None


def main():
    case = json.load(sys.stdin)
    angles, best = case["angles"], {"error": None}
    n, time = len(angles), sp.symbols("t")
    truth = [np.array(case[name]) for name in ("q", "qd", "qdd")]
    symbols = symbolic_util.generate_symbolic_matrix(n, time)
    friction = catalog_base.Classical(np.array([symbols[2, i] for i in range(n)]), np.ones((n, n), dtype=int))
    parts = catalog.CatalogRepartition([catalog_base.Lagrange(terms(angles, symbols), symbols, time), friction])
    size = parts.catalog_length
    for window in WINDOWS if size <= MOST_TERMS else ():
        derivative, states = ps.SmoothedFiniteDifference(smoother_kws={"window_length": window}), []
        for motion in case["motions"]:
            q, t = np.array(motion), case["dt"] * np.arange(len(motion))
            qd = derivative._differentiate(q, t)
            rows = np.stack([q, qd, derivative._differentiate(qd, t)])
            states.append(rows[:, window:-window])
        all_of_them = np.concatenate(states, axis=1)
        some = np.linspace(0, all_of_them.shape[1] - 1, SAMPLES * size, dtype=int)
        for weight in WEIGHTS:
            with contextlib.suppress(Exception):  # of the solver, where a problem has no solution
                found, _ = simulation.regression_implicite(*all_of_them[:, some], time, symbols, parts, l1_lambda=weight)
                for solution in found.T:
                    own = error_of(solution[:, None], parts, symbols, time, truth)
                    if own and (best["error"] is None or own[0] < best["error"]):
                        best = {"error": own[0], "terms": own[1], "window": window, "weight": weight}
    return best


warnings.filterwarnings("ignore")
logging.disable(logging.CRITICAL)
with contextlib.redirect_stdout(io.StringIO()):  # the solver reports its iterations
    result = main()
json.dump(result, sys.stdout)
