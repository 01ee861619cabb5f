"""The tasks of the race in JAX on the CPU."""

from functools import partial

import jax

jax.config.update("jax_enable_x64", True)  # float32 stays float32 where it is asked for

import jax.numpy as jnp
import jax_models as models
from contest import Entry, milliseconds, serve

RATE, BETA1, BETA2, EPSILON = 1e-3, 0.9, 0.999, 1e-8


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


def adam(loss):
    """One step of Adam on `loss(weights, samples)`; the state is (weights, first, second, step)."""

    def step(state, samples):
        weights, first, second, k = state
        value, gradient = jax.value_and_grad(loss)(weights, samples)
        k = k + 1
        correct1, correct2 = 1 - BETA1**k, 1 - BETA2**k
        first = jax.tree.map(lambda m, g: BETA1 * m + (1 - BETA1) * g, first, gradient)
        second = jax.tree.map(lambda v, g: BETA2 * v + (1 - BETA2) * g * g, second, gradient)
        move = lambda w, m, v: w - RATE * (m / correct1) / (jnp.sqrt(v / correct2) + EPSILON)
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


def natural_step(task, data):
    """phi <- mu phi + Jᵀ (J Jᵀ + lambda N)⁻¹ (r - mu J phi), theta <- theta - eta phi (theory.md, equation 19)."""
    samples, flat, scaling, units = arrays(task, data)
    n = data["n"]
    sizes = [2 * n] + 2 * [task["width"]] + [1]
    rate, momentum, damping_first = 0.5, 0.9, 1e-3
    lagrangian = lambda flat: partial(models.lnn, models.layers(flat, sizes, False), scaling, False)

    def residual(flat, q, qd, qdd, tau):
        return units * (models.linearised(lagrangian(flat), q, qd, tau) - qdd)

    def rows(flat, q, qd, qdd, tau):
        return residual(flat, q, qd, qdd, tau), jax.jacrev(residual)(flat, q, qd, qdd, tau)

    def frozen(flat, q, qd, qdd, tau):
        # dr = -w M⁻¹ d(M qdd + c) at the acceleration of the model, which spares the derivative of the solve.
        mass = jax.hessian(lagrangian(flat), 1)(q, qd)
        found = models.linearised(lagrangian(flat), q, qd, tau)
        slopes = jax.jacrev(lambda flat: models.inverse_dynamics(lagrangian(flat), q, qd, found))(flat)
        return units * (found - qdd), -units[:, None] * models.solve(mass, slopes)

    def step(state, samples):
        flat, phi = state
        r, j = jax.vmap(frozen if task["variant"] == "frozen" else rows, (None, 0, 0, 0, 0))(flat, *samples)
        r, j = r.reshape(-1), j.reshape(r.size, -1)
        # As ours: less damping near the solution.
        damping = damping_first * jnp.sqrt(jnp.minimum(jnp.mean(jnp.abs(r)), 1.0))
        gram = j @ j.T + damping * r.size * jnp.eye(r.size, dtype=r.dtype)
        factor = jax.scipy.linalg.cho_factor(gram, lower=True)
        phi = momentum * phi + j.T @ jax.scipy.linalg.cho_solve(factor, r - momentum * (j @ phi))
        return (flat - rate * phi, phi), jnp.mean(r * r)

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


def wave(task, data):
    (q, qd, _, tau), flat, _, _ = arrays(task, data)
    weights = models.layers(flat, [6] + 2 * [data["density"]] + [1], output_bias=False)
    lagrangian = partial(models.field, weights)
    function = models.published if task["variant"] == "published" else models.linearised
    return call(partial(function, lagrangian), [(q[0], qd[0], tau[0])], lambda qdd: qdd[:4])


TASKS = {
    "lnn-step": lnn_step,
    "natural-step": natural_step,
    "delan-step": delan_step,
    "acceleration": acceleration,
    "inverse-dynamics": inverse_dynamics,
    "states": states,
    "rollout": rollouts,
    "wave": wave,
}

if __name__ == "__main__":
    serve(TASKS)
