

def _parts(weights, q, qd):
    """M and c."""
    each = _vector(weights, [[float(i == j) for j in range(_N)] for i in range(_N)])
    m, c = _inertia(weights, q[..., None, :], qd[..., None, :], each)
    return (m + each * _vector(weights, _HELD) if any(_HELD) else m), c[..., 0, :]


def mass_matrix(weights, q, qd):
    """M = d2L/dqd2."""
    return _parts(weights, q, qd)[0]


def bias(weights, q, qd):
    """c of M qdd + c = tau less friction."""
    return _parts(weights, q, qd)[1]


def acceleration(weights, q, qd, tau=None):
    """qdd under forces tau; without them by default."""
    m, c = _parts(weights, q, qd)
    f = _exerted(weights, qd, xp.zeros_like(q) if tau is None else tau) - c
    return f / m[..., 0] if _N == 1 else xp.linalg.solve(m, f[..., None])[..., 0]


def rates(weights, q, qd, tau=None):
    """(qd, qdd), joined."""
    return _join(qd, acceleration(weights, q, qd, tau))
