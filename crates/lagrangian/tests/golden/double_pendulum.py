"""Makes double_pendulum.csv: the free double pendulum by an independent code.

m1 = m2 = l1 = l2 = 1, g = 9.8, absolute angles, textbook equations of motion (not a Lagrangian), SciPy's
DOP853 at rtol = atol = 1e-13. The header line gives the evaluations that it needed.

    python -m venv venv && venv/bin/pip install scipy==1.17.1 && venv/bin/python double_pendulum.py

Never run by the tests.
"""

import numpy as np
import scipy
from scipy.integrate import solve_ivp

G = 9.8


def slope(_, x):
    a, b, wa, wb = x
    delta = a - b
    s, c = np.sin(delta), np.cos(delta)
    den = 2.0 - c * c
    da = (-s * (wb * wb + wa * wa * c) + G * (np.sin(b) * c - 2.0 * np.sin(a))) / den
    db = (s * (2.0 * wa * wa + wb * wb * c) + 2.0 * G * (np.sin(a) * c - np.sin(b))) / den
    return [wa, wb, da, db]


STARTS = [(0.3, -0.2, 0.0, 0.1), (2.0, 1.0, 0.05, 0.02), (3.0, 2.9, -4.0, 6.0)]
times = np.linspace(0.0, 5.0, 11)
with open("double_pendulum.csv", "w", encoding="ascii") as out:
    runs = [solve_ivp(slope, (0, 5), s, "DOP853", times, rtol=1e-13, atol=1e-13) for s in STARTS]
    out.write(f"# scipy {scipy.__version__}, evaluations {' '.join(str(r.nfev) for r in runs)}\n")
    out.write("trajectory,t,q1,q2,qd1,qd2\n")
    for index, run in enumerate(runs):
        for t, x in zip(run.t, run.y.T):
            out.write(",".join([str(index), *(repr(float(v)) for v in (t, *x))]) + "\n")
