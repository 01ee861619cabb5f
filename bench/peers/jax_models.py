"""Lagrangian networks in JAX: the published formulation and the fastest ones that we know.

Notation as in docs/theory.md: q, qd, qdd, tau of one state have shape [n]; M qdd + c = tau. A network is a list of
layers (w [inputs, width], b [width]); every function here is of one state and is mapped over a batch by `jax.vmap`.
"""

import jax
import jax.numpy as jnp
import numpy as np


def layers(flat, sizes, output_bias):
    """Cuts a flat list of parameters (matrices [width, inputs] row-major, then biases) into layers."""
    found, at = [], 0
    for k, (inputs, width) in enumerate(zip(sizes[:-1], sizes[1:])):
        w = flat[at : at + width * inputs].reshape(width, inputs).T
        at += width * inputs
        if k + 2 < len(sizes) or output_bias:
            found.append((w, flat[at : at + width]))
            at += width
        else:
            found.append((w, None))
    assert at == len(flat), "the shape of the network is not that of the parameters"
    return found


def softplus(x):
    """log(1 + eˣ); its derivative is taken by rule, which is faster than that of `logaddexp`."""
    return jnp.maximum(x, 0) + jnp.log1p(jnp.exp(-jnp.abs(x)))


softplus = jax.custom_jvp(softplus)
softplus.defjvps(lambda t, _, x: t * jax.nn.sigmoid(x))


def network(weights, x):
    """A perceptron with softplus."""
    for w, b in weights[:-1]:
        x = softplus(x @ w + b)
    w, b = weights[-1]
    return x @ w if b is None else x @ w + b


def features(q, scaling, angles):
    """cos q and sin q of angles, (q - centre) / scale of lines."""
    if angles:
        return jnp.stack([jnp.cos(q), jnp.sin(q)], axis=-1).reshape(-1)
    return (q - scaling["q_center"]) / scaling["q_scale"]


def lnn(weights, scaling, angles, q, qd):
    """L = E [N(x(q), v) + |v|² / 2], v = qd / s."""
    v = qd / scaling["qd_scale"]
    x = jnp.concatenate([features(q, scaling, angles), v])
    return scaling["energy"] * (network(weights, x)[0] + 0.5 * jnp.sum(v * v))


def solve(m, f):
    """m⁻¹ f for a small matrix: in closed form up to 2 × 2, else by Cholesky."""
    if len(f) == 1:
        return f / m[0]
    if len(f) == 2:
        det = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
        return jnp.stack([m[1, 1] * f[0] - m[0, 1] * f[1], m[0, 0] * f[1] - m[1, 0] * f[0]]) / det
    return jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(m), f)


def published(lagrangian, q, qd, tau):
    """qdd by equation 6 of Cranmer et al. 2020 as its code writes it: pinv(hessian) and a jacobian of a gradient."""
    mass = jax.hessian(lagrangian, 1)(q, qd)
    mixed = jax.jacobian(jax.jacobian(lagrangian, 1), 0)(q, qd)
    return jnp.linalg.pinv(mass) @ (tau + jax.grad(lagrangian, 0)(q, qd) - mixed @ qd)


def linearised(lagrangian, q, qd, tau):
    """The same by one linearisation of the gradient of L and n + 1 tangents."""
    n = len(q)
    (dl_dq, _), push = jax.linearize(jax.grad(lagrangian, (0, 1)), q, qd)
    dq = jnp.concatenate([jnp.zeros((n, n), q.dtype), qd[None]])
    dqd = jnp.concatenate([jnp.eye(n, dtype=q.dtype), jnp.zeros((1, n), q.dtype)])
    columns = jax.vmap(push)(dq, dqd)[1]
    return solve(columns[:n], tau + dl_dq - columns[n])


def published_inverse(lagrangian, q, qd, qdd):
    """M qdd + c by the Hessian and the mixed jacobian of L, as public code of deep Lagrangian networks writes it."""
    mass = jax.hessian(lagrangian, 1)(q, qd)
    mixed = jax.jacobian(jax.grad(lagrangian, 1), 0)(q, qd)
    return mass @ qdd + mixed @ qd - jax.grad(lagrangian, 0)(q, qd)


def rk4(acceleration, step, state):
    """One step of (q, qd) by the classical Runge–Kutta method."""

    def rate(state):
        return state[1], acceleration(*state)

    move = lambda state, h, slope: jax.tree.map(lambda x, k: x + h * k, state, slope)
    k1 = rate(state)
    k2 = rate(move(state, 0.5 * step, k1))
    k3 = rate(move(state, 0.5 * step, k2))
    k4 = rate(move(state, step, k3))
    mean = jax.tree.map(lambda a, b, c, d: (a + 2 * b + 2 * c + d) / 6, k1, k2, k3, k4)
    return move(state, step, mean)


def balance(lagrangian, q, qd, qdd, direction):
    """direction · (M qdd + c): one number, by two tangents (theory.md, equation 16)."""

    def slope(q, qd):
        return jax.jvp(lambda v: lagrangian(q, v), (qd,), (direction,))[1]

    along = jax.jvp(slope, (q, qd), (qd, qdd))[1]
    return along - jax.jvp(lambda x: lagrangian(x, qd), (q,), (direction,))[1]


def inverse_dynamics(lagrangian, q, qd, qdd):
    """M qdd + c: the change of the momentum along the motion, less the slope of L."""
    gradient = jax.grad(lagrangian, (0, 1))
    (dl_dq, _), (_, rate) = jax.jvp(gradient, (q, qd), (qd, qdd))
    return rate - dl_dq


def delan_outputs(weights, scaling, shift, n, angles, q):
    """The factor G of M, and V: the diagonal before softplus, the entries below it row by row, V."""
    o = network(weights, features(q, scaling, angles))
    last = n * (n + 1) // 2
    entries = jnp.concatenate([softplus(o[:n]) + shift, o[n:last]])
    # A product with a constant 0/1 matrix: scattering is many times slower on the CPU.
    place = np.zeros((last, n * n), o.dtype)
    rows, columns = np.tril_indices(n, -1)
    place[np.arange(n), np.arange(n) * (n + 1)] = 1
    place[n + np.arange(len(rows)), rows * n + columns] = 1
    return (entries @ place).reshape(n, n), o[last]


def delan(weights, scaling, shift, angles, q, qd):
    """L = E [|Gᵀ v|² / 2 - V], v = qd / s."""
    g, potential = delan_outputs(weights, scaling, shift, len(q), angles, q)
    u = (qd / scaling["qd_scale"]) @ g
    return scaling["energy"] * (0.5 * u @ u - potential)


def delan_torque(weights, scaling, shift, angles, q, qd, qdd):
    """M qdd + c from one push of the outputs along qd and one pull back to q."""
    n = len(q)
    s, energy = scaling["qd_scale"], scaling["energy"]
    v, a = qd / s, qdd / s
    outputs = lambda q: delan_outputs(weights, scaling, shift, n, angles, q)
    (g, _), (g_rate, _) = jax.jvp(outputs, (q,), (qd,))
    u = v @ g
    rate = (g_rate @ u + g @ (v @ g_rate + a @ g)) / s
    _, pull = jax.vjp(outputs, q)
    slope = pull((jnp.outer(v, u), -jnp.ones((), q.dtype)))[0]
    return energy * (rate - slope)
