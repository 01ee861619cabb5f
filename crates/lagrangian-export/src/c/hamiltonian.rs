//! The functions of a model with the state (q, p): momenta by Newton's method, as in the library.

use std::fmt::Write as _;

use lagrangian::expression::Hamiltonian;

use super::{Check, Writer, unread};
use crate::block::Output;
use crate::interface::Call;

/// p with dH/dp = q', and the other quantities that the motion needs, in arrays of the caller.
const MOMENTA: &str = include_str!("../../templates/hamiltonian.c");

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
        self.functions += &(MOMENTA.replace("NAME", &name) + "\n");
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
