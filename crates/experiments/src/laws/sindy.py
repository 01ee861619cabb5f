"""A sparse regression of accelerations by PySINDy, for one case of the experiment `laws`.

Standard input has a JSON object: `dt`; `angles`, whether each coordinate is one; `motions`, positions ``[rows][n]`` each; and, for
the choice of what a person would try, the true states `q`, `qd`, `qdd`, ``[m][n]``. Standard output gets the least error of the
accelerations over all settings, in parts of their variances, with the number of terms.
"""

import json
import sys
import warnings

import numpy as np

try:
    import pysindy as ps
except ImportError:
    sys.exit(3)

WINDOWS = (5, 11, 21, 41)  # samples that the derivative is smoothed over
THRESHOLDS = (3e-3, 0.03, 0.1, 0.5)  # the first is near least squares
MOST_TERMS = 400


def library(functions, speeds):
    """Polynomials of the velocities and of the functions of the place, of the highest degree that stays small."""
    degree = 4
    while ps.PolynomialLibrary(degree=degree).fit(np.zeros((2, functions + speeds))).n_output_features_ > MOST_TERMS:
        degree -= 1
    return ps.PolynomialLibrary(degree=degree)


def main():
    case = json.load(sys.stdin)
    angles = np.array(case["angles"])
    motions = [np.array(motion) for motion in case["motions"]]
    truth = [np.array(case[name]) for name in ("q", "qd", "qdd")]
    place = lambda q: np.hstack([q[:, ~angles], np.sin(q[:, angles]), np.cos(q[:, angles])])
    n = len(angles)
    best = {"error": None}
    for window in WINDOWS:
        derivative = ps.SmoothedFiniteDifference(smoother_kws={"window_length": window})
        times = [case["dt"] * np.arange(len(q)) for q in motions]
        inner = slice(window // 2, -(window // 2))
        speeds = [derivative._differentiate(q, t) for q, t in zip(motions, times)]
        rates = [derivative._differentiate(v, t)[inner] for v, t in zip(speeds, times)]
        x, u = [v[inner] for v in speeds], [place(q)[inner] for q in motions]
        for threshold in THRESHOLDS:
            model = ps.SINDy(
                feature_library=library(u[0].shape[1], n), optimizer=ps.STLSQ(threshold=threshold)
            )
            try:
                model.fit(x, t=case["dt"], x_dot=rates, u=u)
                found = np.asarray(model.predict(truth[1], u=place(truth[0])))
            except (ValueError, np.linalg.LinAlgError):
                continue
            error = float(np.mean(((found - truth[2]) ** 2).mean(0) / truth[2].var(0)))
            if np.isfinite(error) and (best["error"] is None or error < best["error"]):
                terms = int(np.count_nonzero(model.coefficients()))
                best = {"error": error, "terms": terms, "window": window, "threshold": threshold}
    json.dump(best, sys.stdout)


warnings.filterwarnings("ignore")
main()
