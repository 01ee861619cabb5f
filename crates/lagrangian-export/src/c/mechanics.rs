//! The functions of a model with a Lagrangian.

use std::fmt::Write as _;

use lagrangian::expression::{Mechanics, input};

use super::{Check, Writer, unread};
use crate::block::Output;
use crate::interface::Call;

/// Accelerations under given forces, and the factors of M.
const SOLVE: &str = include_str!("../../templates/solve.c");
/// The body of a step of the classical Runge–Kutta method.
const STEP: &str = include_str!("../../templates/step.c");

impl Writer<'_> {
    pub(super) fn mechanics(&mut self, of: &Mechanics) {
        let graph = &of.graph;
        let rest = graph.constant(&vec![0.0; graph.length(of.bias)]);
        let (bias, qd) = (graph.value(of.bias), graph.input(input::QD, rest.len()));
        let gravity = bias.with_input(qd, rest).id();
        let array = Output::array;
        for (call, check, output) in [
            (
                Call::InverseDynamics,
                Check::With("qdd"),
                array(of.needed, "tau"),
            ),
            (Call::Bias, Check::State, array(of.bias, "c")),
            (Call::Gravity, Check::Position, array(gravity, "g")),
            (Call::Friction, Check::State, array(of.friction, "d")),
            (Call::Momentum, Check::State, array(of.momentum, "p")),
            (Call::Energy, Check::State, Output::number(of.energy, "e")),
        ] {
            self.simple(call, graph, check, &[output], &[], "");
        }
        let mass = [Output::column(of.mass, "m")];
        let call = Call::MassMatrix;
        self.simple(call, graph, Check::State, &[], &mass, &held(of));
        let names = ["dtau_dq", "dtau_dqd", "dtau_dqdd"];
        let pairs = of.needed_along.into_iter().zip(names);
        let each: Vec<_> = pairs.map(|(id, name)| Output::column(id, name)).collect();
        let (call, check) = (Call::InverseDynamicsDerivatives, Check::With("qdd"));
        self.simple(call, graph, check, &[], &each, "");
        let solved = self.solve(of);
        let body = "  for (int i = 0; i < N; ++i) qdd[i] = a[i];\n  return status;\n";
        self.function(Call::ForwardDynamics, &(solved.clone() + body));
        self.forward_derivatives(of, &solved);
        self.step();
    }

    /// The function that solves for accelerations; returns the call that other functions begin with.
    fn solve(&mut self, of: &Mechanics) -> String {
        let name = &self.interface.name;
        let block = self.block(
            &of.graph,
            &[Output::array(of.bias, "c"), Output::array(of.exerted, "f")],
            &[Output::column(of.mass, "m")],
        );
        let block = unread(&block, &["q", "qd", "tau"]) + &block + &held(of);
        let code = SOLVE.replace("NAME", name).replace("  BLOCK\n", &block);
        self.functions += &(code + "\n");
        format!(
            "{}  real m[N * N];\n  int rows[N] = {{0}};\n  int kind = 0;\n  real a[N];\n\
             \x20 const int outcome = solve(q, qd, tau, m, rows, &kind, a);\n\
             \x20 if (outcome != {name}_OK) return outcome;\n",
            self.checks(Check::With("tau"))
        )
    }

    fn forward_derivatives(&mut self, of: &Mechanics, solved: &str) {
        let [by_q, by_qd] = of.forces_along;
        let [friction, inputs] = of.exerted_along;
        let block = self.block(
            &of.graph,
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
    }

    /// A step of the classical Runge–Kutta method.
    pub(super) fn step(&mut self) {
        let body = STEP.replace("NAME", &self.interface.name)
            + &self.finite(Call::Step.results())
            + "  return status;\n";
        self.function(Call::Step, &body);
    }
}

/// The ones on the diagonal of M for fixed joints.
fn held(of: &Mechanics) -> String {
    let one = |i: &usize| format!("  m[{i} * N + {i}] = C(1);\n");
    of.held.iter().map(one).collect()
}
