"""Four ways from the same samples of a double pendulum to its accelerations: what the page race.md runs.

    python docs/tutorials/contestants.py SECONDS [FILE]     runs those whose packages are installed; FILE gets the figures

Each contestant is a function of the training samples and the seconds that it may train; it returns a function of (q, qd), arrays
``[k, 2]``, that gives accelerations. Compiling is not counted.
"""

import ast
import importlib.metadata
import inspect
import json
import sys
import time
from typing import NamedTuple

import numpy as np

import lagrangian as lg


class Samples(NamedTuple):
    """States and accelerations, arrays ``[m, 2]``, and the motions that they come from."""

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    motions: list


def samples(seed, trajectories):
    """Motions of 5 s at 100 Hz from random states, without noise."""
    motions = lg.simulate("double-pendulum", trajectories=trajectories, duration=5.0, seed=seed)
    return Samples(*(np.concatenate([getattr(m, s) for m in motions]) for s in ("q", "qd", "qdd")), motions)


def with_lagrangian(data, seconds):
    import lagrangian as lg

    model = lg.Lnn(seconds=seconds).fit(data.motions, progress=False)
    return model.forward_dynamics


def with_pysindy(data, seconds):
    import pysindy as ps

    functions = [
        lambda x: 0 * x + 1,
        lambda x: np.sin(x),
        lambda x: np.cos(x),
        lambda x: np.sin(2 * x),
        lambda x: np.cos(2 * x),
    ]
    angle = [ps.CustomLibrary(functions, interaction_only=False) for _ in range(2)]
    library = ps.GeneralizedLibrary(
        [*angle, ps.PolynomialLibrary(degree=2)],
        tensor_array=[[1, 1, 1]],
        inputs_per_library=[[0], [1], [2, 3]],
    )
    model = ps.SINDy(feature_library=library, optimizer=ps.STLSQ(threshold=0.02))
    x, x_dot = np.hstack([data.q, data.qd]), np.hstack([data.qd, data.qdd])
    model.fit(x, t=0.01, x_dot=x_dot)
    return lambda q, qd: np.asarray(model.predict(np.hstack([q, qd])))[:, 2:]


def with_jax(data, seconds):
    import jax
    import jax.numpy as jnp
    import optax

    scale = data.qd.std(0)
    sizes = [6, 128, 128, 1]
    keys = jax.random.split(jax.random.key(0), 3)
    weights = [
        (jax.random.normal(k, (a, b)) / jnp.sqrt(a), jnp.zeros(b)) for k, a, b in zip(keys, sizes, sizes[1:])
    ]

    def lagrangian(weights, q, qd):
        v = qd / scale
        x = jnp.concatenate([jnp.cos(q), jnp.sin(q), v])
        for w, b in weights[:-1]:
            x = jax.nn.softplus(x @ w + b)
        return (x @ weights[-1][0])[0] + 0.5 * v @ v

    def acceleration(weights, q, qd):
        mass = jax.hessian(lagrangian, 2)(weights, q, qd)
        mixed = jax.jacobian(jax.grad(lagrangian, 2), 1)(weights, q, qd)
        return jnp.linalg.solve(mass, jax.grad(lagrangian, 1)(weights, q, qd) - mixed @ qd)

    many = jax.vmap(acceleration, (None, 0, 0))
    unit = 1 / data.qdd.std(0)
    loss = lambda weights, q, qd, qdd: jnp.abs(unit * (many(weights, q, qd) - qdd)).mean()
    optimizer = optax.chain(optax.clip_by_global_norm(1.0), optax.scale_by_adam())

    @jax.jit
    def step(weights, state, rate, batch):
        move, state = optimizer.update(jax.grad(loss)(weights, *batch), state)
        return jax.tree.map(lambda w, m: w - rate * m, weights, move), state

    state = optimizer.init(weights)
    step(weights, state, 0.0, next(batches(data))[1])
    for rate, batch in batches(data, seconds):
        weights, state = jax.block_until_ready(step(weights, state, rate, batch))
    return jax.jit(lambda q, qd: many(weights, q, qd))


def with_torch(data, seconds):
    import torch
    from torch.func import grad, hessian, jacfwd, vmap
    from torch.nn.functional import softplus

    torch.manual_seed(0)
    tensor = lambda x: torch.tensor(x, dtype=torch.float32)
    scale, unit = tensor(data.qd.std(0)), tensor(1 / data.qdd.std(0))
    layers = torch.nn.ModuleList([torch.nn.Linear(6, 128), torch.nn.Linear(128, 128), torch.nn.Linear(128, 1)])

    def lagrangian(q, qd):
        v = qd / scale
        x = torch.cat([torch.cos(q), torch.sin(q), v])
        for layer in layers[:-1]:
            x = softplus(layer(x))
        return layers[-1](x)[0] + 0.5 * v @ v

    def acceleration(q, qd):
        mass, mixed = hessian(lagrangian, 1)(q, qd), jacfwd(grad(lagrangian, 1), 0)(q, qd)
        return torch.linalg.solve(mass, grad(lagrangian, 0)(q, qd) - mixed @ qd)

    many = vmap(acceleration)
    optimizer = torch.optim.Adam(layers.parameters())
    for rate, batch in batches(data, seconds):
        q, qd, qdd = map(tensor, batch)
        optimizer.param_groups[0]["lr"] = rate
        optimizer.zero_grad()
        (unit * (many(q, qd) - qdd)).abs().mean().backward()
        torch.nn.utils.clip_grad_norm_(layers.parameters(), 1.0)
        optimizer.step()
    return lambda q, qd: many(tensor(q), tensor(qd)).detach().numpy()


def with_the_truth(data, seconds):
    import lagrangian as lg

    return lg.system("double-pendulum").forward_dynamics


CONTESTANTS = {
    "lagrangian": with_lagrangian,
    "PySINDy": with_pysindy,
    "JAX": with_jax,
    "PyTorch": with_torch,
    "the true equations": with_the_truth,
}


def batches(data, seconds=np.inf, size=512):
    """Batches of random samples until the time is over, with a learning rate that falls as a cosine of the time."""
    rng = np.random.default_rng(0)
    start = time.monotonic()
    while (passed := (time.monotonic() - start) / seconds) < 1.0:
        rows = rng.integers(len(data.q), size=size)
        yield 1.5e-3 * (1.0 + np.cos(np.pi * passed)), (data.q[rows], data.qd[rows], data.qdd[rows])


def lines(contestant):
    """The lines of its code."""
    function = ast.parse(inspect.getsource(contestant)).body[0]
    return len(ast.unparse(function).split("\n")) - 1


def predicted(acceleration, q, qd, duration, step=0.01):
    """The last states of motions from several starts, by the classical Runge–Kutta method; ``None`` where one leaves all bounds."""
    rate = lambda q, qd: (qd, np.asarray(acceleration(q, qd), dtype=float))
    for _ in range(round(duration / step)):
        k1 = rate(q, qd)
        k2 = rate(q + 0.5 * step * k1[0], qd + 0.5 * step * k1[1])
        k3 = rate(q + 0.5 * step * k2[0], qd + 0.5 * step * k2[1])
        k4 = rate(q + step * k3[0], qd + step * k3[1])
        q, qd = (x + step / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip((q, qd), k1, k2, k3, k4))
        if not np.abs(qd).max() < 1e3:
            return None
    return q, qd


def measure(name, data, held_out, seconds, duration=5.0):
    """What a contestant reaches: errors on samples that it has not seen, and of the true energy of predictions."""
    start, cpu = time.monotonic(), time.process_time()
    acceleration = CONTESTANTS[name](data, seconds)
    took, cpu = time.monotonic() - start, time.process_time() - cpu
    found = np.asarray(acceleration(held_out.q, held_out.qd), dtype=float)
    error = ((found - held_out.qdd) ** 2).mean(0) / held_out.qdd.var(0)
    truth = lg.system("double-pendulum")
    rng = np.random.default_rng(7)
    q0, qd0 = rng.uniform(0, 2 * np.pi, (10, 2)), rng.uniform(0, 0.1, (10, 2))
    end = predicted(acceleration, q0, qd0, duration)
    drift = None
    if end is not None:
        drift = float(np.abs(truth.energy(*end) - truth.energy(q0, qd0)).mean() / 29.4)
    return {
        "acceleration": float(error.mean()),
        "energy": drift,
        "lines": lines(CONTESTANTS[name]),
        "seconds": took,
        "cpu_seconds": cpu,
    }


def race(seconds, trajectories=30, duration=5.0):
    """The figures of all contestants whose packages are installed; the reason, where they are not."""
    data, held_out = samples(seed=0, trajectories=trajectories), samples(seed=1, trajectories=6)
    found = {}
    for name in CONTESTANTS:
        try:
            found[name] = measure(name, data, held_out, seconds, duration)
        except ImportError as error:
            found[name] = {"missing": error.name}
        print(name, found[name], file=sys.stderr, flush=True)
    return found


def main():
    seconds, file = float(sys.argv[1]), sys.argv[2:]
    found = {"seconds": seconds, "contestants": race(seconds), "versions": {}}
    for package in ("pysindy", "jax", "optax", "torch", "numpy"):
        try:
            found["versions"][package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            pass
    text = json.dumps(found, indent=1)
    if file:
        with open(file[0], "w") as out:
            out.write(text + "\n")
    else:
        print(text)


if __name__ == "__main__":
    main()
