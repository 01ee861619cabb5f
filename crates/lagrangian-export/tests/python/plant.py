"""The cart with a pole of the fixture, written a second time: what adapters are compared with."""

import numpy as np

CART, POLE, LENGTH, GRAVITY, RUB = 1.0, 0.3, 0.5, 9.81, np.array([0.1, 0.01])


def mass(q):
    off = POLE * LENGTH * np.cos(q[1])
    return np.array([[CART + POLE, off], [off, POLE * LENGTH**2]])


def energy(q, qd):
    return 0.5 * qd @ mass(q) @ qd - POLE * GRAVITY * LENGTH * np.cos(q[1])


def bias(q, qd):
    s = np.sin(q[1])
    return np.array([-POLE * LENGTH * s * qd[1] ** 2, POLE * GRAVITY * LENGTH * s])


def accelerations(q, qd, u, rub=RUB):
    return np.linalg.solve(mass(q), np.array([u, 0.0]) - bias(q, qd) - rub * qd)


def force(q, qd, qdd):
    return (mass(q) @ qdd + bias(q, qd) + RUB * qd)[0]


def simulate(x, u_of_t, duration, step=1e-3, rub=RUB):
    """The last state (q, qd) of a motion, by the classical Runge-Kutta method; the force is held over a step."""
    rate = lambda x, u: np.concatenate([x[2:], accelerations(x[:2], x[2:], u, rub)])
    for k in range(round(duration / step)):
        u = u_of_t(k * step)
        a = rate(x, u)
        b = rate(x + step / 2 * a, u)
        c = rate(x + step / 2 * b, u)
        d = rate(x + step * c, u)
        x = x + step / 6 * (a + 2 * b + 2 * c + d)
    return x


def differences(f, x, h=1e-6):
    """The Jacobian of f by central differences."""
    columns = []
    for k in range(len(x)):
        e = np.zeros(len(x))
        e[k] = h
        columns.append((np.atleast_1d(f(x + e)) - np.atleast_1d(f(x - e))) / (2 * h))
    return np.stack(columns, -1)
