

def acceleration(weights, q, qd, tau=None):
    """qdd under forces tau; without them by default."""
    return _acceleration(weights, q, qd, xp.zeros_like(q) if tau is None else tau)


def rates(weights, q, qd, tau=None):
    """(qd, qdd), joined."""
    return _join(qd, acceleration(weights, q, qd, tau))
