

def _load():
    from pathlib import Path

    import numpy as np

    return xp.asarray(np.load(Path(__file__).with_name("MODEL_weights.npy")))


weights = _load()
_TESTS = "TESTS"


def selftest():
    """Raises an error unless the functions give the numbers of the library that wrote them."""
    q, v, u, expected = (_vector(weights, x) for x in _TESTS)
    found = CALL(weights, q, v, u)
    error = float(abs(found - expected).max() / abs(expected).max())
    if not error <= 65536 * xp.finfo(weights.dtype).eps:
        raise AssertionError(f"CALL differs from that of the library by {error:.1e}")
