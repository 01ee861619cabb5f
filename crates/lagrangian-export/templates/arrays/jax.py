import math

import jax.numpy as xp
from jax.nn import sigmoid as _logistic
from jax.nn import softplus as _softplus
from jax.scipy.special import erfc as _erfc


def _vector(weights, numbers):
    return xp.asarray(numbers, weights.dtype)
