"""The tasks of the race in JAX on the CPU."""

import json
import math
import time
from functools import partial

import jax

jax.config.update("jax_enable_x64", True)  # float32 stays float32 where it is asked for

import jax.numpy as jnp
import jax_models as models
import numpy as np
from contest import Entry, milliseconds, serve

RATE, RATE_ADAM, BETA1, BETA2, EPSILON = 1e-3, 3e-3, 0.9, 0.999, 1e-8


def arrays(task, data):
    """The samples, weights and scales of a data file in the precision of the task."""
    dtype = {"f32": jnp.float32, "f64": jnp.float64}[task["precision"]]
    n = data["n"]
    samples = [jnp.array(data[k], dtype).reshape(-1, n) for k in ("q", "qd", "qdd", "tau")]
    scaling = {k: jnp.array(v, dtype) for k, v in data["scaling"].items()}
    flat = jnp.array(data["parameters"], dtype)
    return samples, flat, scaling, jnp.array(data["weights"], dtype)


def compiled(function, *arguments, donate=()):
    """The compiled function, and the milliseconds that compiling took."""
    return milliseconds(lambda: jax.jit(function, donate_argnums=donate).lower(*arguments).compile())


def adam(loss, rate=RATE, clip=None):
    """One step of Adam on `loss(weights, samples)`; the state is (weights, first, second, step)."""

    def step(state, samples):
        weights, first, second, k = state
        value, gradient = jax.value_and_grad(loss)(weights, samples)
        if clip is not None:
            shorten = jnp.minimum(1, clip / jnp.linalg.norm(gradient))
            gradient = jnp.where(jnp.isfinite(shorten), shorten * gradient, 0)
        k = k + 1
        correct1, correct2 = 1 - BETA1**k, 1 - BETA2**k
        first = jax.tree.map(lambda m, g: BETA1 * m + (1 - BETA1) * g, first, gradient)
        second = jax.tree.map(lambda v, g: BETA2 * v + (1 - BETA2) * g * g, second, gradient)
        move = lambda w, m, v: w - rate * (m / correct1) / (jnp.sqrt(v / correct2) + EPSILON)
        return (jax.tree.map(move, weights, first, second), first, second, k), value

    return step


def iterate(task, step, state, samples):
    """`step`, compiled, with its buffers given away, from `state` on."""
    step, compile_ms = compiled(step, state, samples, donate=(0,))
    check = []
    for _ in range(task["check"]):
        state, value = step(state, samples)
        check.append(float(value))

    def run(laps):
        nonlocal state
        for _ in range(laps):
            state, value = step(state, samples)
        value.block_until_ready()

    return Entry(compile_ms, check, run)


def training(task, loss, weights, samples):
    """Steps of Adam from `weights` on."""
    zeros = lambda: jax.tree.map(jnp.zeros_like, weights)
    state = (weights, zeros(), zeros(), jnp.zeros((), jax.tree.leaves(weights)[0].dtype))
    return iterate(task, adam(loss), state, samples)


def lnn_loss(task, data):
    """Mean |qdd predicted - qdd| in units of its size, by the variant of the task."""
    samples, flat, scaling, units = arrays(task, data)
    n = data["n"]
    weights = models.layers(flat, [2 * n] + 2 * [task["width"]] + [1], output_bias=False)
    lagrangian = lambda w: partial(models.lnn, w, scaling, False)
    acceleration = {"published": models.published, "linearised": models.linearised}
    method = acceleration.get(task["variant"], models.linearised)

    def loss(weights, samples):
        q, qd, qdd, tau = samples
        found = jax.vmap(partial(method, lagrangian(weights)))(q, qd, tau)
        return jnp.mean(jnp.abs(units * (found - qdd)))

    def adjoint(weights, samples):
        # The gradient of the acceleration is that of lambda · (M qdd + c) with both frozen (theory.md, equation 15).
        q, qd, qdd, tau = samples
        frozen = lagrangian(jax.lax.stop_gradient(weights))

        def one(q, qd, qdd, tau):
            (dl_dq, _), push = jax.linearize(jax.grad(frozen, (0, 1)), q, qd)
            dq = jnp.concatenate([jnp.zeros((n, n), q.dtype), qd[None]])
            dqd = jnp.concatenate([jnp.eye(n, dtype=q.dtype), jnp.zeros((1, n), q.dtype)])
            columns = jax.vmap(push)(dq, dqd)[1]
            found = models.solve(columns[:n], tau + dl_dq - columns[n])
            error = units * (found - qdd)
            direction = models.solve(columns[:n], units * jnp.sign(error))
            scalar = models.balance(lagrangian(weights), q, qd, found, direction)
            return jnp.sum(jnp.abs(error)), jax.lax.stop_gradient(scalar) - scalar

        value, scalar = jax.vmap(one)(q, qd, qdd, tau)
        return (jnp.sum(value) + jnp.sum(scalar)) / q.size

    return (adjoint if task["variant"] == "adjoint" else loss), weights, samples


def lnn_step(task, data):
    return training(task, *lnn_loss(task, data))


RATE_NATURAL, MOMENTUM, DAMPING, LEAST_DAMPING, LONGEST = 0.5, 0.9, 1e-1, 1e-11, 1.0


def natural(rows, state, samples, rate, damping, longest, follows_loss=False):
    """phi <- mu phi + Jᵀ (J Jᵀ + lambda N)⁻¹ (r - mu J phi), theta <- theta - eta phi (theory.md, equation 19).

    `rows(theta, q, qd, qdd, tau)` are the residuals [m] of one sample and their slopes [m, P].
    """
    flat, phi = state
    r, j = jax.vmap(rows, (None, 0, 0, 0, 0))(flat, *samples)
    r, j = r.reshape(-1), j.reshape(r.size, -1)
    if follows_loss:
        damping = jnp.minimum(damping, jnp.maximum(jnp.mean(r * r), LEAST_DAMPING))
    # As ours: less damping near the solution, and no step longer than a bound.
    damping = damping * jnp.sqrt(jnp.minimum(jnp.mean(jnp.abs(r)), 1.0))
    gram = j @ j.T + damping * r.size * jnp.eye(r.size, dtype=r.dtype)
    factor = jax.scipy.linalg.cho_factor(gram, lower=True)
    phi = MOMENTUM * phi + j.T @ jax.scipy.linalg.cho_solve(factor, r - MOMENTUM * (j @ phi))
    rate = jnp.minimum(rate, longest / jnp.linalg.norm(phi))
    return (flat - rate * phi, phi), jnp.mean(r * r)


def with_slopes(residual):
    """The residuals of one sample and their slopes by all weights."""
    return lambda flat, *sample: (residual(flat, *sample), jax.jacrev(residual)(flat, *sample))


def acceleration_residual(task, data, angles):
    """(qdd predicted - qdd) in units of its size, relative to the size of qdd where the data say so."""
    _, _, scaling, units = arrays(task, data)
    sizes = [(3 if angles else 2) * data["n"]] + 2 * [task["width"]] + [1]

    def residual(flat, q, qd, qdd, tau):
        lagrangian = partial(models.lnn, models.layers(flat, sizes, False), scaling, angles)
        error = units * (models.linearised(lagrangian, q, qd, tau) - qdd)
        return error / jnp.sqrt(0.1 + jnp.mean((units * qdd) ** 2)) if data.get("relative") else error

    return residual


def natural_step(task, data):
    samples, flat, scaling, units = arrays(task, data)
    sizes = [2 * data["n"]] + 2 * [task["width"]] + [1]
    rows = with_slopes(acceleration_residual(task, data, False))

    def frozen(flat, q, qd, qdd, tau):
        # dr = -w M⁻¹ d(M qdd + c) at the acceleration of the model, which spares the derivative of the solve.
        lagrangian = lambda flat: partial(models.lnn, models.layers(flat, sizes, False), scaling, False)
        mass = jax.hessian(lagrangian(flat), 1)(q, qd)
        found = models.linearised(lagrangian(flat), q, qd, tau)
        slopes = jax.jacrev(lambda flat: models.inverse_dynamics(lagrangian(flat), q, qd, found))(flat)
        return units * (found - qdd), -units[:, None] * models.solve(mass, slopes)

    rows = frozen if task["variant"] == "frozen" else rows
    step = lambda state, samples: natural(rows, state, samples, RATE_NATURAL, 1e-3, jnp.inf)
    return iterate(task, step, (flat, jnp.zeros_like(flat)), samples)


def delan_step(task, data):
    """Mean square of the torque in units of its size."""
    samples, flat, scaling, units = arrays(task, data)
    n, shift = data["n"], 1e-3
    sizes = [2 * n] + 2 * [task["width"]] + [n * (n + 1) // 2 + 1]
    weights = models.layers(flat, sizes, output_bias=True)

    def torque(weights, q, qd, qdd):
        if task["variant"] == "lagrangian":
            lagrangian = partial(models.delan, weights, scaling, shift, True)
            return models.inverse_dynamics(lagrangian, q, qd, qdd)
        if task["variant"] == "published":
            lagrangian = partial(models.delan, weights, scaling, shift, True)
            return models.published_inverse(lagrangian, q, qd, qdd)
        return models.delan_torque(weights, scaling, shift, True, q, qd, qdd)

    def loss(weights, samples):
        q, qd, qdd, tau = samples
        found = jax.vmap(partial(torque, weights))(q, qd, qdd)
        return jnp.mean((units * (found - tau)) ** 2)

    return training(task, loss, weights, samples)


def call(function, arguments, check):
    """`function`, compiled, called with one set of arguments after another; each result is awaited."""
    run_one, compile_ms = compiled(function, *arguments[0])
    found = check(run_one(*arguments[min(1, len(arguments) - 1)]))

    def run(laps):
        for k in range(laps):
            jax.block_until_ready(run_one(*arguments[k % len(arguments)]))

    return Entry(compile_ms, [float(x) for x in found], run)


def forward(task, data):
    """The accelerations of a Lagrangian network as a function of one state, and the arrays of a data file."""
    samples, flat, scaling, _ = arrays(task, data)
    weights = models.layers(flat, [2 * data["n"]] + 2 * [task["width"]] + [1], output_bias=False)
    method = models.published if task["variant"] == "published" else models.linearised
    return partial(method, partial(models.lnn, weights, scaling, False)), samples


def acceleration(task, data):
    function, (q, qd, _, tau) = forward(task, data)
    return call(function, [tuple(x) for x in zip(q, qd, tau)], lambda qdd: qdd)


def inverse_dynamics(task, data):
    (q, qd, qdd, _), flat, scaling, _ = arrays(task, data)
    n = data["n"]
    weights = models.layers(flat, [2 * n] + 2 * [task["width"]] + [n * (n + 1) // 2 + 1], output_bias=True)
    function = partial(models.delan_torque, weights, scaling, 1e-3, True)
    if task["variant"] == "published":
        function = partial(models.published_inverse, partial(models.delan, weights, scaling, 1e-3, True))
    return call(function, [tuple(x) for x in zip(q, qd, qdd)], lambda tau: tau)


def states(task, data):
    function, (q, qd, _, tau) = forward(task, data)
    return call(jax.vmap(function), [(q, qd, tau)], lambda qdd: qdd.reshape(-1)[-4:])


def rollouts(task, data):
    function, (q, qd, _, _) = forward(task, data)
    free = lambda q, qd: function(q, qd, jnp.zeros_like(q))

    def roll(q, qd):
        def step(state, _):
            state = models.rk4(free, data["step"], state)
            return state, state

        return jax.lax.scan(step, (q, qd), length=data["steps"])[1]

    if len(q) == 1:
        return call(roll, [(q[0], qd[0])], lambda path: path[0][-1])
    return call(jax.vmap(roll), [(q, qd)], lambda path: path[0][-1, -1])


def cosine(share):
    return 0.5 * (1 + math.cos(math.pi * share))


def whole_fit(task, data, residual):
    """A fit by the natural gradient, or by Adam on the same loss; writes the weights along it."""
    samples, flat, _, _ = arrays(task, data)
    steps, batch = task["steps"], min(data["batch"], len(samples[0]))
    residuals = lambda flat, chosen: jax.vmap(residual, (None, 0, 0, 0, 0))(flat, *chosen)
    squares = lambda flat, chosen: jnp.mean(residuals(flat, chosen) ** 2)
    # Under Adam absolute errors of accelerations do better.
    absolute = lambda flat, chosen: jnp.mean(jnp.abs(residuals(flat, chosen)))
    loss = absolute if data["relative"] else squares
    zeros = jnp.zeros_like(flat)
    if task["variant"] == "natural":
        rows, state = with_slopes(residual), (flat, zeros)

        def step(state, samples, numbers, rate):
            return natural(rows, state, [x[numbers] for x in samples], rate, DAMPING, LONGEST, True)

    else:
        steps, batch = task["adam_steps"], min(512, len(samples[0]))
        state = (flat, zeros, zeros, jnp.zeros((), flat.dtype))

        def step(state, samples, numbers, rate):
            return adam(loss, rate, clip=1.0)(state, [x[numbers] for x in samples])

    numbers = jnp.arange(batch)
    # A float of the precision of the data, so that nothing is promoted.
    number = lambda x: jnp.array(x, flat.dtype)
    step, compile_ms = compiled(step, state, samples, numbers, number(0.5), donate=(0,))
    check = [float(squares(flat, [x[: data["batch"]] for x in samples]))]

    def run(_):
        fresh = jax.tree.map(jnp.copy, (flat, zeros, zeros, number(0))[: len(state)])
        history, order, spent = [], [], 0.0
        generator = np.random.default_rng(0)
        clock = time.perf_counter()
        for k in range(steps):
            share = k / steps
            if len(order) < batch:
                order = generator.permutation(len(samples[0]))
            numbers, order = order[:batch], order[batch:]
            top = RATE_NATURAL if task["variant"] == "natural" else RATE_ADAM
            fresh, _ = step(fresh, samples, jnp.array(numbers), number(top * cosine(share)))
            if (k + 1) % -(-steps // data["looks"]) == 0 or k + 1 == steps:
                weights = np.array(fresh[0], float).tolist()
                spent += time.perf_counter() - clock
                history.append({"seconds": spent, "parameters": weights})
                clock = time.perf_counter()
        with open(task["history"], "w") as file:
            json.dump(history, file)

    return Entry(compile_ms, check, run)


def letters(task, data):
    _, _, scaling, units = arrays(task, data)
    n = data["n"]
    sizes = [2 * n] + 2 * [task["width"]] + [n * (n + 1) // 2 + 1]

    def residual(flat, q, qd, qdd, tau):
        lagrangian = partial(models.delan, models.layers(flat, sizes, True), scaling, 1e-3, True)
        return units * (models.inverse_dynamics(lagrangian, q, qd, qdd) - tau)

    return whole_fit(task, data, residual)


def pendulum(task, data):
    return whole_fit(task, data, acceleration_residual(task, data, True))


TASKS = {
    "lnn-step": lnn_step,
    "natural-step": natural_step,
    "delan-step": delan_step,
    "acceleration": acceleration,
    "inverse-dynamics": inverse_dynamics,
    "states": states,
    "rollout": rollouts,
    "letters": letters,
    "pendulum": pendulum,
}

if __name__ == "__main__":
    serve(TASKS)
