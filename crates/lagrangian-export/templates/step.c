  real x[N];
  real v2[N];
  real v3[N];
  real v4[N];
  real a1[N] = {C(0)};
  real a2[N] = {C(0)};
  real a3[N] = {C(0)};
  real a4[N] = {C(0)};
  int status = NAME_OK;
  int outcome;
  if (!isfinite(h)) return NAME_NOT_FINITE;
  outcome = NAME_forward_dynamics(q, qd, tau, a1);
  if (outcome > NAME_OUTSIDE) return outcome;
  if (outcome == NAME_OUTSIDE) status = outcome;
  for (int i = 0; i < N; ++i) {
    x[i] = q[i] + C(0.5) * h * qd[i];
    v2[i] = qd[i] + C(0.5) * h * a1[i];
  }
  outcome = NAME_forward_dynamics(x, v2, tau, a2);
  if (outcome > NAME_OUTSIDE) return outcome;
  if (outcome == NAME_OUTSIDE) status = outcome;
  for (int i = 0; i < N; ++i) {
    x[i] = q[i] + C(0.5) * h * v2[i];
    v3[i] = qd[i] + C(0.5) * h * a2[i];
  }
  outcome = NAME_forward_dynamics(x, v3, tau, a3);
  if (outcome > NAME_OUTSIDE) return outcome;
  if (outcome == NAME_OUTSIDE) status = outcome;
  for (int i = 0; i < N; ++i) {
    x[i] = q[i] + h * v3[i];
    v4[i] = qd[i] + h * a3[i];
  }
  outcome = NAME_forward_dynamics(x, v4, tau, a4);
  if (outcome > NAME_OUTSIDE) return outcome;
  if (outcome == NAME_OUTSIDE) status = outcome;
  for (int i = 0; i < N; ++i) {
    q_next[i] = q[i] + h / C(6) * (qd[i] + C(2) * (v2[i] + v3[i]) + v4[i]);
    qd_next[i] = qd[i] + h / C(6) * (a1[i] + C(2) * (a2[i] + a3[i]) + a4[i]);
  }
