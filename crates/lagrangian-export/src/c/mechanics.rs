//! The functions of a model with a Lagrangian.

use std::fmt::Write as _;

use lagrangian::expression::{Mechanics, input};

use super::{Check, Writer, unread};
use crate::block::Output;
use crate::interface::Call;

impl Writer<'_> {
    pub(super) fn mechanics(&mut self, of: &Mechanics) {
        let graph = &of.graph;
        let name = self.interface.name.clone();
        let rest = graph.constant(&vec![0.0; graph.length(of.bias)]);
        let (bias, qd) = (graph.value(of.bias), graph.input(input::QD, rest.len()));
        let gravity = bias.with_input(qd, rest).id();
        for (call, check, output) in [
            (
                Call::InverseDynamics,
                Check::With("qdd"),
                Output::array(of.needed, "tau"),
            ),
            (Call::Bias, Check::State, Output::array(of.bias, "c")),
            (Call::Gravity, Check::Position, Output::array(gravity, "g")),
            (
                Call::Friction,
                Check::State,
                Output::array(of.friction, "d"),
            ),
            (
                Call::Momentum,
                Check::State,
                Output::array(of.momentum, "p"),
            ),
            (Call::Energy, Check::State, Output::number(of.energy, "e")),
        ] {
            self.simple(call, graph, check, &[output], &[], "");
        }
        let held = |matrix: &str| -> String {
            of.held
                .iter()
                .map(|i| format!("  {matrix}[{i} * N + {i}] = C(1);\n"))
                .collect()
        };
        let mass = [Output::column(of.mass, "m")];
        self.simple(
            Call::MassMatrix,
            graph,
            Check::State,
            &[],
            &mass,
            &held("m"),
        );
        let columns = |ids: [usize; 3], names: [&str; 3]| {
            let pairs = ids.into_iter().zip(names);
            pairs
                .map(|(id, name)| Output::column(id, name))
                .collect::<Vec<_>>()
        };
        let each = columns(of.needed_along, ["dtau_dq", "dtau_dqd", "dtau_dqdd"]);
        self.simple(
            Call::InverseDynamicsDerivatives,
            graph,
            Check::With("qdd"),
            &[],
            &each,
            "",
        );

        // M and the forces that move it, for both calls that solve.
        let block = self.block(
            graph,
            &[Output::array(of.bias, "c"), Output::array(of.exerted, "f")],
            &[Output::column(of.mass, "m")],
        );
        let _ = write!(
            self.functions,
            "/* q'' under the inputs tau, and the factors of M. */\n\
             static int solve(const real *q, const real *qd, const real *tau, real *m, int *rows, int *kind, real *qdd) {{\n\
             \x20 real c[N];\n  real f[N];\n{}{block}{}\
             \x20 for (int i = 0; i < N; ++i) qdd[i] = f[i] - c[i];\n\
             \x20 if (!all_finite(m, N * N) || !all_finite(qdd, N)) return {name}_NOT_FINITE;\n\
             \x20 *kind = factorise(m, rows);\n\
             \x20 if (*kind == 0) return {name}_SINGULAR;\n\
             \x20 substitute(m, rows, *kind, qdd, 0, 1);\n\
             \x20 return all_finite(qdd, N) ? {name}_OK : {name}_NOT_FINITE;\n}}\n\n",
            unread(&block, &["q", "qd", "tau"]),
            held("m"),
        );
        let solved = format!(
            "{}  real m[N * N];\n  int rows[N] = {{0}};\n  int kind = 0;\n  real a[N];\n\
             \x20 const int outcome = solve(q, qd, tau, m, rows, &kind, a);\n\
             \x20 if (outcome != {name}_OK) return outcome;\n",
            self.checks(Check::With("tau"))
        );
        let body =
            format!("{solved}  for (int i = 0; i < N; ++i) qdd[i] = a[i];\n  return status;\n");
        self.function(Call::ForwardDynamics, &body);

        let [by_q, by_qd] = of.forces_along;
        let [friction, inputs] = of.exerted_along;
        let block = self.block(
            graph,
            &[],
            &[
                Output::column(by_q, "dqdd_dq"),
                Output::column(by_qd, "dqdd_dqd"),
                Output::column(friction, "by_velocity"),
                Output::column(inputs, "dqdd_dtau"),
            ],
        );
        let _ = write!(
            self.functions,
            "/* How the forces M q'' + c change with q and q', and those of the inputs with q' and tau. */\n\
             static void slopes(const real *q, const real *qd, const real *qdd, const real *tau, real *dqdd_dq, \
             real *dqdd_dqd, real *by_velocity, real *dqdd_dtau) {{\n{}{block}}}\n\n",
            unread(&block, &["q", "qd", "qdd", "tau"])
        );
        let body = format!(
            "{solved}  real by_velocity[N * N];\n\
             \x20 slopes(q, qd, a, tau, dqdd_dq, dqdd_dqd, by_velocity, dqdd_dtau);\n\
             \x20 for (int i = 0; i < N * N; ++i) {{\n\
             \x20   dqdd_dq[i] = -dqdd_dq[i];\n\
             \x20   dqdd_dqd[i] = by_velocity[i] - dqdd_dqd[i];\n  }}\n\
             \x20 for (int k = 0; k < N; ++k) {{\n\
             \x20   substitute(m, rows, kind, dqdd_dq, k, N);\n\
             \x20   substitute(m, rows, kind, dqdd_dqd, k, N);\n\
             \x20   substitute(m, rows, kind, dqdd_dtau, k, N);\n  }}\n{}  return status;\n",
            self.finite(Call::ForwardDynamicsDerivatives.results())
        );
        self.function(Call::ForwardDynamicsDerivatives, &body);
        self.step();
    }

    /// A step of the classical Runge–Kutta method.
    pub(super) fn step(&mut self) {
        let name = &self.interface.name;
        let stage = |k: usize, q: &str, qd: &str| {
            format!(
                "  outcome = {name}_forward_dynamics({q}, {qd}, tau, a{k});\n  if (outcome > {name}_OUTSIDE) return outcome;\n\
                 \x20 if (outcome == {name}_OUTSIDE) status = outcome;\n"
            )
        };
        let moved = |k: usize, part: &str, v: &str| {
            format!(
                "  for (int i = 0; i < N; ++i) {{\n    x[i] = q[i] + {part} * {v}[i];\n    v{}[i] = qd[i] + {part} * a{k}[i];\n  }}\n",
                k + 1
            )
        };
        let body = format!(
            "  real x[N];\n  real v2[N];\n  real v3[N];\n  real v4[N];\n  real a1[N] = {{C(0)}};\n  real a2[N] = {{C(0)}};\n  real a3[N] = {{C(0)}};\n  real a4[N] = {{C(0)}};\n\
             \x20 int status = {name}_OK;\n  int outcome;\n  if (!isfinite(h)) return {name}_NOT_FINITE;\n\
             {}{}{}{}{}{}{}\
             \x20 for (int i = 0; i < N; ++i) {{\n\
             \x20   q_next[i] = q[i] + h / C(6) * (qd[i] + C(2) * (v2[i] + v3[i]) + v4[i]);\n\
             \x20   qd_next[i] = qd[i] + h / C(6) * (a1[i] + C(2) * (a2[i] + a3[i]) + a4[i]);\n  }}\n{}  return status;\n",
            stage(1, "q", "qd"),
            moved(1, "C(0.5) * h", "qd"),
            stage(2, "x", "v2"),
            moved(2, "C(0.5) * h", "v2"),
            stage(3, "x", "v3"),
            moved(3, "h", "v3"),
            stage(4, "x", "v4"),
            self.finite(Call::Step.results()),
        );
        self.function(Call::Step, &body);
    }
}
