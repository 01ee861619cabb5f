"""any_model.py FOLDER NAME: whether the adapters of one exported model agree, whatever the model.

FOLDER holds NAME_casadi.so, and NAME.fmu with a library for this platform.
"""

import sys
from pathlib import Path

import casadi as ca
import fmpy
import numpy as np
from fmpy.validation import validate_fmu

folder, name = Path(sys.argv[1]), sys.argv[2]
UNIT = str(folder / f"{name}.fmu")
SPAN = 0.2  # s


def external(call, **options):
    return ca.external(f"{name}_casadi_{call}", str(folder / f"{name}_casadi.so"), options)


def start():
    """The first state, q and then qd, of the unit."""
    model = fmpy.read_model_description(UNIT)
    return np.array([float(v.start) for v in model.modelVariables if v.name.startswith(("q[", "qd["))])


def jacobians_agree():
    """Jacobians are those of differences, relative to the largest entry of each block."""
    rng, x, checked = np.random.default_rng(0), start(), 0
    for call in ("forward_dynamics", "inverse_dynamics"):
        try:
            f = external(call)
        except RuntimeError:
            continue
        sizes = [f.size1_in(k) for k in range(3)]
        arguments = [ca.MX.sym(f.name_in(k), sizes[k]) for k in range(3)]
        blocks = ca.Function("j", arguments, [ca.jacobian(f(*arguments), a) for a in arguments])
        for _ in range(5):
            at = np.concatenate([x + 0.01 * rng.normal(size=len(x)), 0.1 * rng.normal(size=sizes[2])])
            parts = np.split(at, np.cumsum(sizes)[:2])
            for k, exact in enumerate(blocks(*parts)):
                found = np.zeros(exact.shape)
                for j in range(sizes[k]):
                    e = [np.zeros(n) for n in sizes]
                    e[k][j] = 1e-5
                    ahead = f(*[p + d for p, d in zip(parts, e)]).full().ravel()
                    behind = f(*[p - d for p, d in zip(parts, e)]).full().ravel()
                    found[:, j] = (ahead - behind) / 2e-5
                np.testing.assert_allclose(found, exact.full(), atol=1e-5 * max(1.0, abs(found).max()))
                checked += 1
    assert checked > 0, "the model has neither forward nor inverse dynamics"


def motions_agree():
    """Both kinds of simulation and CasADi's integrator end in the same state."""
    x, ends = start(), []
    f = external("forward_dynamics")
    n = len(x) // 2
    state = ca.MX.sym("x", 2 * n)
    rate = ca.vertcat(state[n:], f(state[:n], state[n:], np.zeros(f.size1_in(2))))
    tight = {"abstol": 1e-10, "reltol": 1e-10}
    ends.append(ca.integrator("i", "cvodes", {"x": state, "ode": rate}, 0.0, SPAN, tight)(x0=x)["xf"].full().ravel())
    names = [f"{s}[{k + 1}]" for s in ("q", "qd") for k in range(n)]
    assert validate_fmu(UNIT) == []
    for kind in ("CoSimulation", "ModelExchange"):
        found = fmpy.simulate_fmu(
            UNIT, stop_time=SPAN, output_interval=SPAN / 4, relative_tolerance=1e-9, output=names, fmi_type=kind
        )
        ends.append(np.array([found[k][-1] for k in names]))
    assert abs(ends[0] - x).max() > 1e-6, "nothing moved: begin at another state"
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], atol=1e-5 * max(1.0, abs(x).max()))


for check in (jacobians_agree, motions_agree):
    check()
    print(f"{check.__name__}: holds")
