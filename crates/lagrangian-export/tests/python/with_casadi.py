"""with_casadi.py LIBRARY [NAME]: the functions of the cart-pole in CasADi against a second implementation; an integrator; a swing-up.

With the NAME of a model that was learned from motions of this cart-pole: the swing-up alone, by that model.
"""

import sys

import casadi as ca
import numpy as np
import plant

rng = np.random.default_rng(0)
library, name = (sys.argv[1:] + ["cart_pole"])[:2]


def external(call, **options):
    return ca.external(f"{name}_casadi_{call}", library, options)


def array(value):
    return value.full().ravel()


def states(count):
    return rng.uniform([-2, -4, -3, -8], [2, 4, 3, 8], (count, 4))


def values_agree():
    forward, inverse = external("forward_dynamics"), external("inverse_dynamics")
    assert [forward.name_in(k) for k in range(3)] == ["q", "qd", "tau"] and forward.name_out(0) == "qdd"
    mass, energy, step = external("mass_matrix"), external("energy"), external("step")
    for x in states(20):
        q, qd, u, qdd = x[:2], x[2:], rng.normal() * 5, rng.normal(size=2)
        np.testing.assert_allclose(array(forward(q, qd, u)), plant.accelerations(q, qd, u), atol=1e-10)
        np.testing.assert_allclose(float(inverse(q, qd, qdd)), plant.force(q, qd, qdd), atol=1e-10)
        np.testing.assert_allclose(mass(q, qd).full(), plant.mass(q), atol=1e-12)
        np.testing.assert_allclose(float(energy(q, qd)), plant.energy(q, qd), atol=1e-12)
        q_next, qd_next = step(1e-4, q, qd, u)
        np.testing.assert_allclose(np.append(array(q_next), array(qd_next)), plant.simulate(x, lambda t: u, 1e-4, 1e-4), atol=1e-8)
    far = forward([100.0, 0.0], [0.0, 0.0], 0.0)  # outside of the data: values all the same
    assert np.isfinite(far.full()).all()
    try:
        forward([float("nan"), 0.0], [0.0, 0.0], 0.0)
    except RuntimeError:
        return
    raise AssertionError("a state that is not finite gave values")


def jacobians_agree():
    q, qd, u, qdd = ca.MX.sym("q", 2), ca.MX.sym("qd", 2), ca.MX.sym("u"), ca.MX.sym("qdd", 2)
    forward, inverse = external("forward_dynamics"), external("inverse_dynamics")
    x = ca.vertcat(q, qd, u)
    of_forward = ca.Function("j", [x], [ca.jacobian(forward(q, qd, u), x)])
    y = ca.vertcat(q, qd, qdd)
    of_inverse = ca.Function("j", [y], [ca.jacobian(inverse(q, qd, qdd), y)])
    energy = external("energy", enable_fd=True)
    of_energy = ca.Function("j", [q, qd], [ca.gradient(energy(q, qd), qd)])
    for state in states(20):
        at = np.append(state, rng.normal() * 5)
        slopes = plant.differences(lambda v: plant.accelerations(v[:2], v[2:4], v[4]), at)
        np.testing.assert_allclose(of_forward(at).full(), slopes, atol=1e-5)
        at = np.append(state, rng.normal(size=2))
        slopes = plant.differences(lambda v: plant.force(v[:2], v[2:4], v[4:]), at)
        np.testing.assert_allclose(of_inverse(at).full(), slopes, atol=1e-5)
        momentum = plant.mass(state[:2]) @ state[2:]
        np.testing.assert_allclose(array(of_energy(state[:2], state[2:])), momentum, atol=1e-4)


def integrator_agrees():
    x, u = ca.MX.sym("x", 4), ca.MX.sym("u")
    rate = ca.vertcat(x[2:], external("forward_dynamics")(x[:2], x[2:], u))
    options = {"abstol": 1e-10, "reltol": 1e-10}
    cvodes = ca.integrator("swing", "cvodes", {"x": x, "p": u, "ode": rate}, 0.0, 1.0, options)
    for x0 in states(3):
        end = array(cvodes(x0=x0, p=2.0)["xf"])
        np.testing.assert_allclose(end, plant.simulate(x0, lambda t: 2.0, 1.0), atol=1e-6)


def controller(intervals, h):
    """Direct multiple shooting: the controls and states of the best motion from x0, and what the solver begins with."""
    forward = external("forward_dynamics")
    x, u = ca.MX.sym("x", 4), ca.MX.sym("u")
    forces = u if forward.size1_in(2) == 1 else ca.vertcat(u, 0)
    rate = ca.Function("rate", [x, u], [ca.vertcat(x[2:], forward(x[:2], x[2:], forces))])
    a = rate(x, u)
    b = rate(x + h / 2 * a, u)
    c = rate(x + h / 2 * b, u)
    d = rate(x + h * c, u)
    step = ca.Function("step", [x, u], [x + h / 6 * (a + 2 * b + 2 * c + d)])
    xs, us, x0 = ca.MX.sym("xs", 4, intervals + 1), ca.MX.sym("us", 1, intervals), ca.MX.sym("x0", 4)
    away = lambda x: 10 * (x[1] - np.pi) ** 2 + x[0] ** 2 + 0.1 * ca.sumsqr(x[2:])
    cost = 10 * away(xs[:, -1]) + 1e-3 * ca.sumsqr(us) + sum(away(xs[:, k]) for k in range(intervals))
    gaps = ca.vertcat(xs[:, 0] - x0, *[xs[:, k + 1] - step(xs[:, k], us[k]) for k in range(intervals)])
    all_of = ca.vertcat(ca.vec(xs), ca.vec(us))
    # The model has no second derivatives: the Hessian is that of the cost, without the curvature of the motion.
    scale, multipliers = ca.MX.sym("scale"), ca.MX.sym("multipliers", gaps.shape[0])
    hessian = ca.triu(scale * ca.hessian(cost, all_of)[0])
    names = ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
    hessian = ca.Function("nlp_hess_l", [all_of, x0, scale, multipliers], [hessian], *names)
    quiet = {"print_level": 0, "sb": "yes", "max_iter": 200, "tol": 1e-6}
    problem = {"x": all_of, "p": x0, "f": cost, "g": gaps}
    solver = ca.nlpsol("swing_up", "ipopt", problem, {"ipopt": quiet, "print_time": False, "hess_lag": hessian})
    bound = np.concatenate([np.tile([2.0, np.inf, np.inf, np.inf], intervals + 1), np.full(intervals, 20.0)])

    def solve(now, guess):
        found = solver(x0=guess, p=now, lbx=-bound, ubx=bound, lbg=0, ubg=0)
        values = array(found["x"])
        return values[: 4 * (intervals + 1)].reshape(-1, 4), values[4 * (intervals + 1) :]

    return solve


def swings_up():
    intervals, h = 40, 0.05
    solve = controller(intervals, h)
    now, ramp = np.array([0.0, 0.1, 0.0, 0.0]), np.linspace(0, np.pi, intervals + 1)
    xs, us = np.stack([0 * ramp, ramp, 0 * ramp, 0 * ramp], -1), np.zeros(intervals)
    largest = 0.0
    for _ in range(80):
        xs, us = solve(now, np.concatenate([xs.ravel(), us]))
        # The real cart has a tenth more friction than the model.
        now = plant.simulate(now, lambda t: us[0], h, rub=1.1 * plant.RUB)
        largest = max(largest, abs(us).max(), 10 * abs(now[0]))
        xs, us = np.vstack([xs[1:], xs[-1:]]), np.append(us[1:], 0.0)
    assert largest <= 20.01, largest
    assert np.cos(now[1]) < -0.999 and abs(now[2:]).max() < 0.1 and abs(now[0]) < 0.2, now
    print("after the swing-up:", now.round(4))


of_fixture = (values_agree, jacobians_agree, integrator_agrees) if name == "cart_pole" else ()
for check in (*of_fixture, swings_up):
    check()
    print(f"{check.__name__}: holds")
