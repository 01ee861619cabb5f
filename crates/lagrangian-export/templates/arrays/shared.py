

def _check(weights, n, **given):
    if weights.shape != (_WEIGHTS,):
        raise ValueError(f"weights have the shape {tuple(weights.shape)}: give ({_WEIGHTS},)")
    for name, x in given.items():
        if x.shape[-1:] != (n,):
            raise ValueError(f"{name} has the shape {tuple(x.shape)}: give ({n},) or (..., {n})")


def _join(*parts):
    axes = xp.broadcast_shapes(*(x.shape[:-1] for x in parts))
    return xp.concatenate([xp.broadcast_to(x, (*axes, x.shape[-1])) for x in parts], -1)


def _shaped(x, *given):
    """x for each of the states that were given."""
    return xp.broadcast_to(x, (*xp.broadcast_shapes(*(a.shape[:-1] for a in given)), x.shape[-1]))


def project(weights):
    """The nearest weights that such a model can have."""
    parts, at = [], 0
    for first, end, least, largest in _BOUNDS:
        parts += [weights[at:first], xp.clip(weights[first:end], least, largest)]
        at = end
    return xp.concatenate([*parts, weights[at:]])
