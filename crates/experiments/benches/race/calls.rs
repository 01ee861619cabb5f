//! Calls of a model: one state, many states, rollouts. Weights are random.

use std::hint::black_box;

use lagrangian::integrate::Method;
use lagrangian::mechanics::{Mechanical, Scaling};
use lagrangian::models::{Delan, Lnn};
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::{
    Coordinates, DelanConfig, Evaluator, LnnConfig, Model, RolloutOptions, State, rollout,
};
use rayon::prelude::*;
use serde_json::json;

use crate::protocol::{Talk, Task};
use crate::{Outcome, write};

/// States that calls of one state go through in turn.
const TURNS: usize = 64;
/// Step of a rollout, s, and how many there are.
const STEP: f64 = 0.01;
const STEPS: usize = 1000;

/// States and forces, smooth and without structure, `[m, n]` each.
struct States {
    n: usize,
    q: Vec<f64>,
    qd: Vec<f64>,
    tau: Vec<f64>,
}

impl States {
    fn new(n: usize, m: usize) -> Self {
        let column = |f: f64| (0..m * n).map(|k| (k as f64 * f).sin()).collect();
        Self {
            n,
            q: column(0.37),
            qd: column(0.73),
            tau: column(0.11),
        }
    }

    fn of(&self, k: usize) -> [&[f64]; 3] {
        [&self.q, &self.qd, &self.tau].map(|x| &x[k * self.n..][..self.n])
    }

    /// Writes what the peers read.
    fn write(&self, task: &Task, parameters: &[f64]) -> Outcome {
        let object = json!({
            "n": self.n, "q": self.q, "qd": self.qd, "qdd": self.tau, "tau": self.tau,
            "scaling": Scaling::identity(self.n), "weights": vec![1.0; self.n],
            "parameters": parameters, "step": STEP, "steps": STEPS,
        });
        if task.write {
            write(&task.file, &object)
        } else {
            Ok(())
        }
    }
}

fn lnn(task: &Task) -> lagrangian::Result<Lnn> {
    let config = LnnConfig {
        width: task.width,
        ..LnnConfig::default()
    };
    let (coordinates, scaling) = (Coordinates::lines(task.dof), Scaling::identity(task.dof));
    Lnn::random(coordinates, config, scaling, 0)
}

/// Forward dynamics of one state.
pub(crate) fn acceleration(task: &Task, talk: &Talk) -> Outcome {
    let (network, states) = (lnn(task)?, States::new(task.dof, TURNS));
    states.write(task, network.parameters())?;
    let model = Mechanical::conservative(network);
    one(&model, &states, talk, |evaluator, [q, qd, tau], out| {
        let _ = evaluator.forward_dynamics(q, qd, tau, out);
    });
    Ok(())
}

/// Inverse dynamics of one state of a deep Lagrangian network.
pub(crate) fn inverse_dynamics(task: &Task, talk: &Talk) -> Outcome {
    let config = DelanConfig {
        width: task.width,
        ..DelanConfig::default()
    };
    let (coordinates, scaling) = (Coordinates::angles(task.dof), Scaling::identity(task.dof));
    let network = Delan::random(coordinates, config, scaling, 0)?;
    let states = States::new(task.dof, TURNS);
    states.write(task, network.parameters())?;
    let model = Mechanical::conservative(network);
    one(&model, &states, talk, |evaluator, [q, qd, qdd], out| {
        let _ = evaluator.inverse_dynamics(q, qd, qdd, out);
    });
    Ok(())
}

/// Serves calls of one state after another.
fn one(
    model: &dyn Model,
    states: &States,
    talk: &Talk,
    call: impl Fn(&mut dyn Evaluator, [&[f64]; 3], &mut [f64]),
) {
    let (mut evaluator, mut out) = (model.evaluator(), vec![0.0; states.n]);
    call(&mut *evaluator, states.of(1), &mut out);
    let check = out.clone();
    let mut turn = 0;
    talk.serve(check, || {
        call(&mut *evaluator, states.of(turn), black_box(&mut out));
        turn = (turn + 1) % TURNS;
    });
}

/// States that one thread takes at a time.
const CHUNK: usize = 512;

/// Forward dynamics of many states on all threads.
pub(crate) fn states(task: &Task, talk: &Talk) -> Outcome {
    let (network, states) = (lnn(task)?, States::new(task.dof, task.batch));
    states.write(task, network.parameters())?;
    let model = Mechanical::conservative(network);
    let size = CHUNK * task.dof;
    let call = |out: &mut [f64]| {
        let inputs = states.q.par_chunks(size).zip(states.qd.par_chunks(size));
        let inputs = inputs.zip(states.tau.par_chunks(size));
        let both = inputs.zip(out.par_chunks_mut(size));
        both.for_each_init(
            || model.evaluator(),
            |evaluator, (((q, qd), tau), out)| {
                let _ = evaluator.forward_dynamics(q, qd, tau, out);
            },
        );
    };
    let mut out = vec![0.0; states.q.len()];
    call(&mut out);
    let check = out[out.len() - 4..].to_vec();
    talk.serve(check, || call(black_box(&mut out)));
    Ok(())
}

/// Rollouts by RK4 with every step recorded.
pub(crate) fn rollouts(task: &Task, talk: &Talk) -> Outcome {
    let (network, states) = (lnn(task)?, States::new(task.dof, task.batch));
    states.write(task, network.parameters())?;
    let model = Mechanical::conservative(network);
    let options = RolloutOptions {
        method: Method::Rk4,
        step: STEP,
        ..RolloutOptions::default()
    };
    let times = times(STEPS as f64 * STEP, STEP)?;
    let starts: Vec<State> = (0..task.batch)
        .map(|k| states.of(k))
        .map(|[q, qd, _]| State::new(q.to_vec(), qd.to_vec()))
        .collect();
    let run = || match &starts[..] {
        [start] => rollout(&model, &start.q, &start.qd, &times, &free, &options).map(|r| vec![r]),
        _ => rollout_many(&model, &starts, &times, &free, &options),
    };
    let found = run()?;
    let last = found.last().ok_or("no rollout")?;
    let check = last.trajectory.q[last.trajectory.q.len() - task.dof..].to_vec();
    talk.serve(check, || {
        let _ = black_box(run());
    });
    Ok(())
}
