/// all_finite
/* Whether all numbers are finite. */
static int all_finite(const real *x, int count) {
  for (int i = 0; i < count; ++i) {
    if (!isfinite(x[i])) return 0;
  }
  return 1;
}

/// within_turn
/* x less whole turns, from 0 to 2 pi. */
static real within_turn(real x) {
  const real turn = C(6.283185307179586);
  const real rest = FMOD(x, turn);
  return rest < C(0) ? rest + turn : rest;
}

/// exponential
/* exp(x) for x up to 700, without branches, so that compilers can compute several at once. */
static real exponential(real x) {
#ifdef NAME_FLOAT
  return expf(x);
#else
  const double y = x < -708.0 ? -708.0 : x;
  const double shift = 6755399441055744.0;
  const double shifted = y * 1.4426950408889634 + shift;
  const double n = shifted - shift;
  const double r = (y - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10;
  double sum = 1.6059043836821613e-10;
  sum = sum * r + 2.08767569878681e-09;
  sum = sum * r + 2.505210838544172e-08;
  sum = sum * r + 2.755731922398589e-07;
  sum = sum * r + 2.7557319223985893e-06;
  sum = sum * r + 2.48015873015873e-05;
  sum = sum * r + 0.0001984126984126984;
  sum = sum * r + 0.001388888888888889;
  sum = sum * r + 0.008333333333333333;
  sum = sum * r + 0.041666666666666664;
  sum = sum * r + 0.16666666666666666;
  sum = sum * r + 0.5;
  sum = sum * r + 1.0;
  sum = sum * r + 1.0;
  uint64_t bits;
  double power;
  memcpy(&bits, &shifted, sizeof bits);
  bits = (bits + 1023u) << 52;
  memcpy(&power, &bits, sizeof power);
  return sum * power;
#endif
}

/// log_one_plus
/* log(1 + x) for x from 0 to 1, as 2 artanh(x / (2 + x)). */
static real log_one_plus(real x) {
#ifdef NAME_FLOAT
  return log1pf(x);
#else
  const double s = x / (2.0 + x);
  const double square = s * s;
  double sum = 0.02857142857142857;
  sum = sum * square + 0.030303030303030304;
  sum = sum * square + 0.03225806451612903;
  sum = sum * square + 0.034482758620689655;
  sum = sum * square + 0.037037037037037035;
  sum = sum * square + 0.04;
  sum = sum * square + 0.043478260869565216;
  sum = sum * square + 0.047619047619047616;
  sum = sum * square + 0.05263157894736842;
  sum = sum * square + 0.058823529411764705;
  sum = sum * square + 0.06666666666666667;
  sum = sum * square + 0.07692307692307693;
  sum = sum * square + 0.09090909090909091;
  sum = sum * square + 0.1111111111111111;
  sum = sum * square + 0.14285714285714285;
  sum = sum * square + 0.2;
  sum = sum * square + 0.3333333333333333;
  sum = sum * square + 1.0;
  return 2.0 * s * sum;
#endif
}

/// multiply
/* y = W x, W row by row; eight sums, so that they can be computed at once. */
static void multiply(const real *w, const real *x, real *y, int rows, int columns) {
  const real *row = w;
  for (int i = 0; i < rows; ++i, row += columns) {
    real sum[8] = {0};
    int j = 0;
    for (; j + 8 <= columns; j += 8) {
      for (int l = 0; l < 8; ++l) sum[l] += row[j + l] * x[j + l];
    }
    for (; j < columns; ++j) sum[0] += row[j] * x[j];
    y[i] = ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
  }
}

/// multiply_transposed
/* y = (transpose of W) x, W row by row; four rows at once. */
static void multiply_transposed(const real *w, const real *restrict x, real *restrict y, int rows, int columns) {
  const real *row = w;
  for (int j = 0; j < columns; ++j) y[j] = C(0);
  for (; rows >= 4; rows -= 4, x += 4) {
    const real *b = row + columns;
    const real *c = b + columns;
    const real *d = c + columns;
    for (int j = 0; j < columns; ++j) y[j] += (row[j] * x[0] + b[j] * x[1]) + (c[j] * x[2] + d[j] * x[3]);
    row = d + columns;
  }
  for (; rows > 0; --rows, ++x) {
    for (int j = 0; j < columns; ++j) y[j] += row[j] * x[0];
    row += columns;
  }
}

/// factorise
/* Factors the symmetric matrix a in place: by Cholesky (1), else by LU with its rows exchanged (2); 0 where it is singular. */
static int factorise(real *a, int *rows) {
  const real tolerance = C(16) * EPSILON * C(N);
  real copy[N * N];
  real scale[N];
  int definite = 1;
  for (int i = 0; i < N * N; ++i) copy[i] = a[i];
  for (int j = 0; j < N && definite; ++j) {
    real pivot = a[j * N + j];
    for (int k = 0; k < j; ++k) pivot -= a[j * N + k] * a[j * N + k];
    if (!(pivot > tolerance * FABS(copy[j * N + j]))) {
      definite = 0;
      break;
    }
    const real root = SQRT(pivot);
    a[j * N + j] = root;
    for (int i = j + 1; i < N; ++i) {
      real sum = copy[i * N + j];
      for (int k = 0; k < j; ++k) sum -= a[i * N + k] * a[j * N + k];
      a[i * N + j] = sum / root;
    }
  }
  if (definite) return 1;
  for (int i = 0; i < N; ++i) {
    rows[i] = i;
    scale[i] = C(0);
    for (int k = 0; k < N; ++k) {
      a[i * N + k] = copy[i * N + k];
      if (FABS(copy[i * N + k]) > scale[i]) scale[i] = FABS(copy[i * N + k]);
    }
  }
  for (int j = 0; j < N; ++j) {
    int best = j;
    real largest = C(-1);
    for (int i = j; i < N; ++i) {
      const real relative = scale[i] > C(0) ? FABS(a[i * N + j]) / scale[i] : C(0);
      if (relative > largest) {
        largest = relative;
        best = i;
      }
    }
    if (!(largest > tolerance)) return 0;
    if (best != j) {
      const int row = rows[j];
      const real size = scale[j];
      rows[j] = rows[best];
      rows[best] = row;
      scale[j] = scale[best];
      scale[best] = size;
      for (int k = 0; k < N; ++k) {
        const real number = a[j * N + k];
        a[j * N + k] = a[best * N + k];
        a[best * N + k] = number;
      }
    }
    for (int i = j + 1; i < N; ++i) {
      const real factor = a[i * N + j] / a[j * N + j];
      a[i * N + j] = factor;
      for (int k = j + 1; k < N; ++k) a[i * N + k] -= factor * a[j * N + k];
    }
  }
  return 2;
}

/// substitute
/* Solves for column `at` of the matrix b, which has `columns` of them, in place. */
static void substitute(const real *a, const int *rows, int kind, real *b, int at, int columns) {
  real x[N];
  for (int i = 0; i < N; ++i) {
    real sum = b[(kind == 2 ? rows[i] : i) * columns + at];
    for (int k = 0; k < i; ++k) sum -= a[i * N + k] * x[k];
    x[i] = kind == 2 ? sum : sum / a[i * N + i];
  }
  for (int i = N - 1; i >= 0; --i) {
    real sum = x[i];
    for (int k = i + 1; k < N; ++k) sum -= (kind == 2 ? a[i * N + k] : a[k * N + i]) * x[k];
    x[i] = sum / a[i * N + i];
  }
  for (int i = 0; i < N; ++i) b[i * columns + at] = x[i];
}

/// distance
/* How far a state is from those of the data, 1 at the border; with `most` = 1 it stops where it is known to be within. */
static real distance(const real *q, const real *qd, real most) {
  real at[2 * N];
  real sines[N];
  real cosines[N];
  real beyond = C(0);
  real nearest = C(-1);
  for (int i = 0; i < 2 * N; ++i) {
    real x = i < N ? q[i] : qd[i - N];
    at[i] = x;
    if (axis_scale[i] <= C(0)) continue;
    if (i < N && axis_is_circle[i]) {
      const real pi = C(3.141592653589793);
      const real middle = C(0.5) * (axis_low[i] + axis_high[i]);
      sines[i] = SIN(x);
      cosines[i] = COS(x);
      x = middle + within_turn(x - middle + pi) - pi;
    }
    real excess = axis_low[i] - x > x - axis_high[i] ? axis_low[i] - x : x - axis_high[i];
    excess = excess / axis_margin[i];
    if (excess > beyond) beyond = excess;
  }
  for (int k = 0; k < REPRESENTATIVES; ++k) {
    real squares = C(0);
    for (int i = 0; i < 2 * N; ++i) {
      if (axis_scale[i] <= C(0)) continue;
      real square;
      if (i < N && axis_is_circle[i]) {
        const real s = sines[i] - representative_sines[k * N + i];
        const real c = cosines[i] - representative_cosines[k * N + i];
        square = s * s + c * c;
      } else {
        const real d = at[i] - representatives[k * 2 * N + i];
        square = d * d;
      }
      squares += square / (axis_scale[i] * axis_scale[i]);
    }
    if (nearest < C(0) || squares < nearest) nearest = squares;
    if (beyond <= most && nearest <= most * most * RADIUS * RADIUS) break;
  }
  nearest = SQRT(nearest) / RADIUS;
  return nearest > beyond ? nearest : beyond;
}

/// state_status
/* The status of a state before anything is computed of it. */
static int state_status(const real *q, const real *qd) {
  if (!all_finite(q, N) || !all_finite(qd, N)) return NAME_NOT_FINITE;
  OUTSIDE_CHECK
  return NAME_OK;
}
