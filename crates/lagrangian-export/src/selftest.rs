//! The function that compares a generated file with results of the library.

use std::fmt::Write as _;

use lagrangian::mechanics::Evaluation;
use lagrangian::{Evaluator, Learned, Model as _};
use rand::{RngExt, SeedableRng};

use crate::Error;
use crate::interface::{Call, Interface};
use crate::tables::Tables;

/// Number of states that are compared.
const STATES: usize = 4;

/// The self test, whose numbers become tables.
pub(crate) fn write(
    model: &Learned,
    interface: &Interface,
    tables: &mut Tables,
) -> Result<String, Error> {
    let n = interface.joints.len();
    let states = states(model, n);
    let all = |f: fn(&State) -> &[f64]| states.iter().flat_map(f).copied().collect::<Vec<_>>();
    tables.add("test_q", &all(|s| &s.q));
    tables.add("test_qd", &all(|s| &s.qd));
    tables.add("test_qdd", &all(|s| &s.qdd));
    let name = &interface.name;
    let mut text = format!(
        "/* The number of the test where two lists differ by more than a part of their largest number, else 0. */\n\
         static int differ(int test, const real *x, const real *expected, int count) {{\n\
         \x20 const real tolerance = C(65536) * EPSILON;\n  real largest = C(1e-6);\n\
         \x20 for (int i = 0; i < count; ++i) {{\n\
         \x20   if (FABS(expected[i]) > largest) largest = FABS(expected[i]);\n  }}\n\
         \x20 for (int i = 0; i < count; ++i) {{\n\
         \x20   if (!(FABS(x[i] - expected[i]) <= tolerance * largest)) return test;\n  }}\n  return 0;\n}}\n\n\
         int {name}_selftest(void) {{\n  real x[N * N];\n  for (int s = 0; s < {STATES}; ++s) {{\n\
         \x20   const real *q = test_q + s * N;\n    const real *qd = test_qd + s * N;\n    const real *qdd = test_qdd + s * N;\n"
    );
    let mut test = 0;
    for call in interface.offered() {
        let Some((arguments, count)) = tested(interface, call) else {
            continue;
        };
        test += 1;
        let expected = ask(model, call, &states, count)?;
        let table = format!("test_{}", call.name());
        tables.add(&table, &expected);
        let _ = writeln!(
            text,
            "    if ({name}_{}({arguments}, x) > {name}_OUTSIDE || differ({test}, x, {table} + s * {count}, {count})) return {test};",
            call.name()
        );
    }
    if interface.has(Call::ForwardDynamics) && interface.has(Call::InverseDynamics) {
        test += 1;
        let _ = write!(
            text,
            "    {{\n      real tau[N];\n      real a[N];\n\
             \x20     if ({name}_inverse_dynamics(q, qd, qdd, tau) > {name}_OUTSIDE) return {test};\n\
             \x20     if ({name}_forward_dynamics(q, qd, tau, a) > {name}_OUTSIDE) return {test};\n\
             \x20     if ({name}_inverse_dynamics(q, qd, a, x) > {name}_OUTSIDE || differ({test}, x, tau, N)) return {test};\n    }}\n"
        );
    }
    text += "    (void)q;\n    (void)qd;\n    (void)qdd;\n  }\n  return 0;\n}\n";
    Ok(text)
}

/// The function of a module on arrays that is compared, and its arguments and results at all states as a tuple of Python.
pub(crate) fn arrays(model: &Learned) -> Result<[String; 2], Error> {
    let n = model.coordinates().dof();
    let states = states(model, n);
    let mut evaluator = model.evaluator();
    let (mut call, mut expected) = ("rates", Vec::new());
    for State { q, qd, qdd } in &states {
        let (mut dq, mut dv) = (qd.clone(), vec![0.0; n]);
        let mut outcome = match evaluator.phase_flow() {
            Some(phase) => phase.flow(q, qd, qdd, &mut dq, &mut dv),
            None => evaluator.forward_dynamics(q, qd, qdd, &mut dv),
        };
        if outcome == Evaluation::Unsupported {
            (call, dq) = ("force", Vec::new());
            outcome = evaluator.inverse_dynamics(q, qd, qdd, &mut dv);
        }
        if !outcome.is_finite() {
            return Err(Error::Undefined(call));
        }
        dq.extend(dv);
        expected.push(dq);
    }
    let all = |f: fn(&State) -> &Vec<f64>| states.iter().map(f).collect::<Vec<_>>();
    let (q, v, u) = (all(|s| &s.q), all(|s| &s.qd), all(|s| &s.qdd));
    Ok([call.into(), format!("({q:?}, {v:?}, {u:?}, {expected:?})")])
}

/// The arguments of a function that is compared, and the count of its results.
fn tested(interface: &Interface, call: Call) -> Option<(&'static str, usize)> {
    let n = interface.joints.len();
    match call {
        // Where both exist, each is tested with the result of the other.
        Call::ForwardDynamics if !interface.has(Call::InverseDynamics) => Some(("q, qd, qdd", n)),
        Call::InverseDynamics => Some(("q, qd, qdd", n)),
        Call::MassMatrix => Some(("q, qd", n * n)),
        Call::Bias | Call::Momentum => Some(("q, qd", n)),
        Call::Gravity => Some(("q", n)),
        Call::Energy => Some(("q, qd", 1)),
        _ => None,
    }
}

struct State {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

/// States near those of the data, at which all functions are defined.
fn states(model: &Learned, n: usize) -> Vec<State> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(0);
    let known = model.visited().map(|visited| visited.representatives().0);
    let mut one = |k: usize| {
        let mut random = || {
            (0..n)
                .map(|_| rng.random_range(-1.0..1.0))
                .collect::<Vec<f64>>()
        };
        let qdd = random();
        match known {
            Some(states) => {
                let count = states.len() / (2 * n);
                let state = &states[k * count / STATES * 2 * n..][..2 * n];
                let (q, qd) = state.split_at(n);
                State {
                    q: q.to_vec(),
                    qd: qd.to_vec(),
                    qdd,
                }
            }
            None => State {
                q: random(),
                qd: random(),
                qdd,
            },
        }
    };
    (0..STATES).map(&mut one).collect()
}

/// A state of the data, q and then q̇; without data the zero of all coordinates.
pub(crate) fn start(model: &Learned) -> Vec<f64> {
    let n = model.coordinates().dof();
    let known = model.visited().map(|visited| visited.representatives().0);
    match known.and_then(|states| states.get(..2 * n)) {
        Some(state) => state.to_vec(),
        None => vec![0.0; 2 * n],
    }
}

/// The results of the library.
fn ask(model: &Learned, call: Call, states: &[State], count: usize) -> Result<Vec<f64>, Error> {
    let mut evaluator = model.evaluator();
    let mut all = Vec::new();
    for state in states {
        let mut x = vec![0.0; count];
        let outcome = say(&mut *evaluator, call, state, &mut x);
        if !outcome.is_finite() {
            return Err(Error::Undefined(call.name()));
        }
        all.extend(x);
    }
    Ok(all)
}

fn say(
    evaluator: &mut dyn Evaluator,
    call: Call,
    State { q, qd, qdd }: &State,
    x: &mut [f64],
) -> Evaluation {
    match call {
        Call::InverseDynamics => evaluator.inverse_dynamics(q, qd, qdd, x),
        Call::ForwardDynamics => evaluator.forward_dynamics(q, qd, qdd, x),
        Call::MassMatrix => evaluator.mass_matrix(q, qd, x),
        Call::Bias => evaluator.bias(q, qd, x),
        Call::Momentum => evaluator.momentum(q, qd, x),
        Call::Gravity => evaluator.bias(q, &vec![0.0; qd.len()], x),
        Call::Energy => evaluator.energy(q, qd, x),
        _ => Evaluation::Unsupported,
    }
}
