//! Our side of `cargo xtask race`: it is told by lines of JSON what to do, and says how long it took.

mod accuracy;
mod calls;
#[path = "../../../lagrangian/benches/meter/data.rs"]
mod data;
mod log;
#[path = "../../../lagrangian/benches/meter/peak.rs"]
mod peak;
mod protocol;
mod training;

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use peak::fma_peak;
use protocol::{Request, Talk, Task};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn main() -> ExitCode {
    if !std::env::args().any(|a| a == "--race") {
        println!("this is our side of a race: run `cargo xtask race`");
        return ExitCode::SUCCESS;
    }
    let talk = Talk::new();
    while let Some(request) = talk.request() {
        if let Request::Task(task) = request
            && let Err(e) = run(&task, &talk)
        {
            talk.error(&e.to_string());
        }
    }
    ExitCode::SUCCESS
}

fn run(task: &Task, talk: &Talk) -> Outcome {
    match task.name.as_str() {
        "lnn-step" => training::lnn_step(task, talk),
        "delan-step" => training::delan_step(task, talk),
        "peak" => {
            let peaks = [fma_peak::<f32>(0.1), fma_peak::<f64>(0.1)];
            talk.serve(peaks.map(|x| 1e-9 * x).to_vec(), || {});
            Ok(())
        }
        "natural-step" => training::natural_step(task, talk),
        "acceleration" => calls::acceleration(task, talk),
        "inverse-dynamics" => calls::inverse_dynamics(task, talk),
        "states" => calls::states(task, talk),
        "rollout" => calls::rollouts(task, talk),
        "rows" => log::rows(task, talk),
        "letters" => accuracy::letters(task, talk),
        "pendulum" => accuracy::pendulum(task, talk),
        "judge-letters" => accuracy::judge_letters(task, talk),
        "judge-pendulum" => accuracy::judge_pendulum(task, talk),
        other => Err(format!("there is no task '{other}'").into()),
    }
}

/// Writes what the peers begin with.
fn write(path: &Path, object: &serde_json::Value) -> Outcome {
    fs::write(path, serde_json::to_vec(object)?)
        .map_err(|e| format!("{}: {e}", path.display()).into())
}
