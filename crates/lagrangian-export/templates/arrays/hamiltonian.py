

def rates(weights, q, p, tau=None):
    """(dq/dt, dp/dt), joined."""
    velocity, slope = _slopes(weights, q, p)
    return _join(velocity, _exerted(weights, velocity, xp.zeros_like(q) if tau is None else tau) - slope)
