/* q'' under the inputs tau, and the factors of M. */
static int solve(const real *q, const real *qd, const real *tau, real *m, int *rows, int *kind, real *qdd) {
  real c[N];
  real f[N];
  BLOCK
  for (int i = 0; i < N; ++i) qdd[i] = f[i] - c[i];
  if (!all_finite(m, N * N) || !all_finite(qdd, N)) return NAME_NOT_FINITE;
  *kind = factorise(m, rows);
  if (*kind == 0) return NAME_SINGULAR;
  substitute(m, rows, *kind, qdd, 0, 1);
  return all_finite(qdd, N) ? NAME_OK : NAME_NOT_FINITE;
}
