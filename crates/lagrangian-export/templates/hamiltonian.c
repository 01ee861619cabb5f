/* p with dH/dp (q, p) = q', by Newton's method from 0, each step halved until it helps: 0 where there is none. */
static int momentum_of(const real *q, const real *qd, real *p) {
  real trial[N] = {0};
  real step[N] = {0};
  real v[N];
  real m[N * N];
  int rows[N] = {0};
  real best = C(-1);
  real size = C(0);
  real part = C(1);
#ifdef NAME_FLOAT
  const real nearly = C(1e-5);
#else
  const real nearly = C(1e-10);
#endif
  for (int i = 0; i < N; ++i) p[i] = C(0);
  for (int round = 0; round < 300; ++round) {
    real squares = C(0);
    real largest = C(0);
    velocity_of(q, trial, v, m);
    for (int i = 0; i < N; ++i) {
      const real rest = v[i] - qd[i];
      squares += rest * rest;
      if (FABS(v[i]) > largest) largest = FABS(v[i]);
      if (FABS(qd[i]) > largest) largest = FABS(qd[i]);
    }
    const real norm = SQRT(squares);
    if (best < C(0) ? isfinite(norm) != 0 : norm < best) {
      best = norm;
      part = C(1);
      if (largest > size) size = largest;
      for (int i = 0; i < N; ++i) {
        p[i] = trial[i];
        step[i] = v[i] - qd[i];
      }
      if (best <= C(2) * EPSILON * size) return 1;
      if (!all_finite(m, N * N)) break;
      const int kind = factorise(m, rows);
      if (kind == 0) break;
      substitute(m, rows, kind, step, 0, 1);
    } else {
      if (best < C(0)) return 0;
      part = C(0.5) * part;
      if (best <= nearly * size || part < C(1e-9)) break;
    }
    for (int i = 0; i < N; ++i) trial[i] = p[i] - part * step[i];
  }
  return best >= C(0) && best <= nearly * size;
}

/* p, the inverse of M, dH/dq and the part of q'' that comes from the change of q. */
static int terms_of(const real *q, const real *qd, real *m, real *slope, real *drift) {
  real p[N];
  real v[N];
  if (!momentum_of(q, qd, p)) return NAME_NOT_FINITE;
  velocity_of(q, p, v, m);
  slopes_of(q, p, qd, slope, drift);
  if (!all_finite(m, N * N) || !all_finite(slope, N) || !all_finite(drift, N)) return NAME_NOT_FINITE;
  return NAME_OK;
}

/* M x for each of `columns` columns, from the inverse of M. */
static int times_mass(real *m, real *x, int columns) {
  int rows[N] = {0};
  const int kind = factorise(m, rows);
  if (kind == 0) return NAME_SINGULAR;
  for (int k = 0; k < columns; ++k) substitute(m, rows, kind, x, k, columns);
  return NAME_OK;
}

/* c of a state that is finite. */
static int bias_of(const real *q, const real *qd, real *c) {
  real m[N * N];
  real slope[N];
  real x[N];
  int outcome = terms_of(q, qd, m, slope, x);
  if (outcome != NAME_OK) return outcome;
  outcome = times_mass(m, x, 1);
  if (outcome != NAME_OK) return outcome;
  for (int i = 0; i < N; ++i) c[i] = slope[i] - x[i];
  return NAME_OK;
}
