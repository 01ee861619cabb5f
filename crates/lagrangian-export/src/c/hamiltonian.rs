//! The functions of a model that moves in (q, p): momenta by Newton's method, as in the library.

use std::fmt::Write as _;

use lagrangian::expression::Hamiltonian;

use super::{Check, Writer, unread};
use crate::block::Output;
use crate::interface::Call;

/// p with dH/dp = q'.
const NEWTON: &str = "\
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

";

/// p, and what the motion needs of it, into arrays of the caller.
const TERMS: &str = "\
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

";

impl Writer<'_> {
    pub(super) fn hamiltonian(&mut self, of: &Hamiltonian) {
        let graph = &of.graph;
        let name = self.interface.name.clone();
        let mut part = |head: &str, arguments: &[&str], once: &[Output], each: &[Output]| {
            let block = self.block(graph, once, each);
            let _ = write!(
                self.functions,
                "static void {head} {{\n{}{block}}}\n\n",
                unread(&block, arguments)
            );
        };
        part(
            "velocity_of(const real *q, const real *p, real *v, real *m)",
            &["q", "p"],
            &[Output::array(of.velocity, "v")],
            &[Output::column(of.inverse_mass, "m")],
        );
        part(
            "slopes_of(const real *q, const real *p, const real *qd, real *slope, real *drift)",
            &["q", "p", "qd"],
            &[
                Output::array(of.slope, "slope"),
                Output::array(of.drift, "drift"),
            ],
            &[],
        );
        part(
            "energy_of(const real *q, const real *p, real *e)",
            &["q", "p"],
            &[Output::number(of.energy, "e")],
            &[],
        );
        part(
            "exerted_by(const real *qd, const real *tau, real *f)",
            &["qd", "tau"],
            &[Output::array(of.exerted, "f")],
            &[],
        );
        part(
            "needed_for(const real *qd, const real *force, real *tau)",
            &["qd", "force"],
            &[Output::array(of.needed, "tau")],
            &[],
        );
        self.functions += &(NEWTON.to_string() + TERMS).replace("NAME", &name);
        let friction = [Output::array(of.friction, "d")];
        self.simple(Call::Friction, graph, Check::State, &friction, &[], "");
        self.hamiltonian_calls(&name);
        self.step();
    }

    fn hamiltonian_calls(&mut self, name: &str) {
        let failed = format!("  if (outcome != {name}_OK) return outcome;\n");
        let mut call = |call: Call, check: Check, body: &str| {
            let body = format!(
                "{}{}{}  return status;\n",
                self.checks(check),
                body.replace("FAILED", &failed).replace("NAME", name),
                self.finite(call.results())
            );
            self.function(call, &body);
        };
        call(
            Call::Momentum,
            Check::State,
            "  if (!momentum_of(q, qd, p)) return NAME_NOT_FINITE;\n",
        );
        call(
            Call::Energy,
            Check::State,
            "  real p[N];\n  if (!momentum_of(q, qd, p)) return NAME_NOT_FINITE;\n  energy_of(q, p, e);\n",
        );
        call(
            Call::MassMatrix,
            Check::State,
            "  real inverse[N * N];\n  real slope[N];\n  real drift[N];\n  int outcome = terms_of(q, qd, inverse, slope, drift);\nFAILED\
             \x20 for (int i = 0; i < N * N; ++i) m[i] = i % (N + 1) == 0 ? C(1) : C(0);\n\
             \x20 outcome = times_mass(inverse, m, N);\nFAILED",
        );
        call(
            Call::Bias,
            Check::State,
            "  const int outcome = bias_of(q, qd, c);\nFAILED",
        );
        call(
            Call::Gravity,
            Check::Position,
            "  const real rest[N] = {0};\n  const int outcome = bias_of(q, rest, g);\nFAILED",
        );
        call(
            Call::InverseDynamics,
            Check::With("qdd"),
            "  real m[N * N];\n  real slope[N];\n  real x[N];\n  int outcome = terms_of(q, qd, m, slope, x);\nFAILED\
             \x20 for (int i = 0; i < N; ++i) x[i] = qdd[i] - x[i];\n  outcome = times_mass(m, x, 1);\nFAILED\
             \x20 for (int i = 0; i < N; ++i) x[i] += slope[i];\n  needed_for(qd, x, tau);\n",
        );
        call(
            Call::ForwardDynamics,
            Check::With("tau"),
            "  real m[N * N];\n  real slope[N];\n  real drift[N];\n  real f[N];\n\
             \x20 const int outcome = terms_of(q, qd, m, slope, drift);\nFAILED  exerted_by(qd, tau, f);\n\
             \x20 for (int i = 0; i < N; ++i) {\n    real sum = drift[i];\n\
             \x20   for (int k = 0; k < N; ++k) sum += m[i * N + k] * (f[k] - slope[k]);\n    qdd[i] = sum;\n  }\n",
        );
    }
}
