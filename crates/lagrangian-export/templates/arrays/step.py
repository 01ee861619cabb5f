

def step(weights, q, v, tau=None, *, h):
    """(q, v), joined, after a step of the classical Runge-Kutta method over the time h, s, under held forces."""
    x, n = _join(q, v), q.shape[-1]

    def at(x):
        return rates(weights, x[..., :n], x[..., n:], tau)

    a = at(x)
    b = at(x + 0.5 * h * a)
    c = at(x + 0.5 * h * b)
    return x + h / 6 * (a + 2 * b + 2 * c + at(x + h * c))
