//! The recordings, and a run of every command on them and on the models of [`super::fits::named`].

use std::fs;
use std::path::Path;

use super::line::Line;

/// Recordings of small systems.
const RECORDINGS: &[&str] = &[
    "simulate pendulum --trajectories 4 --duration 2 --step 0.02 --seed 1 --out pendulum.csv",
    "simulate double-pendulum --trajectories 4 --duration 2 --step 0.02 --seed 2 --out double.csv",
    "simulate double-pendulum --trajectories 3 --duration 2 --step 0.02 --seed 3 --out unseen.csv",
    "simulate double-pendulum --trajectories 4 --duration 2 --step 0.02 --seed 2 --momenta --out canonical.csv",
    "simulate double-pendulum --trajectories 4 --duration 4 --step 0.01 --seed 4 --noise 0.001 --out noisy.csv",
    "simulate two-link-arm --drive 3 --friction 0.3 --trajectories 4 --duration 2 --step 0.02 --seed 5 --momenta --out arm.csv",
    "simulate two-link-arm --drive 3 --friction 0.3 --trajectories 4 --duration 4 --step 0.01 --seed 6 --noise 0.0005 --out log.csv",
    "simulate two-link-arm --starts test --duration 2 --step 0.02 --seed 7 --out reference.csv",
    "simulate --urdf two_link_arm --drive 4 --friction 0.2 --trajectories 4 --duration 2 --step 0.02 --seed 8 --out robot.csv",
    "simulate --urdf ur5 --joints elbow_joint,shoulder_lift_joint --duration 1 --seed 9 --out ur5.csv",
    "simulate --urdf iiwa7 --starts test --duration 1 --seed 9 --out iiwa.csv",
    "simulate relativistic-particle --trajectories 4 --duration 2 --step 0.02 --seed 10 --out fast.csv",
    "simulate mass-spring --set stiffness=1 --duration 4 --step 0.05 --seed 11 --out spring1.csv",
    "simulate mass-spring --set stiffness=2 --duration 4 --step 0.05 --seed 11 --out spring2.csv",
    "simulate mass-spring --set stiffness=3 --duration 4 --step 0.05 --seed 11 --out spring3.csv",
    "simulate cart-pole --drive 2 --trajectories 3 --duration 2 --step 0.02 --seed 12 --out cart.csv",
    "simulate double-pendulum --q0 1,0.5 --qd0 0,0 --duration 3 --method rk4 --out rk4.csv",
    "simulate double-pendulum --q0 1,0.5 --qd0 0,0 --duration 3 --method dopri5 --tolerance 1e-6 --out dopri5.csv",
    "simulate double-pendulum --q0 1,0.5 --qd0 0,0 --duration 3 --method implicit-midpoint --out implicit.csv",
    "simulate double-pendulum --q0 1,0.5 --qd0 0,0 --duration 3 --method variational-midpoint --out variational.csv",
    "simulate double-pendulum --q0 1,0.5 --qd0 0,0 --duration 3 --method variational-trapezoidal --out trapezoidal.csv",
    "simulate mass-spring --q0 1 --qd0 0 --duration 3 --method stormer-verlet --out verlet.csv",
];

/// Parts of recordings, made without the command: positions alone, and springs with their stiffness in a column.
pub(super) fn derive_recordings(folder: &Path) -> Result<(), String> {
    derive(folder, "double", "positions", |cells, _| {
        cells[..4].join(",")
    })?;
    for stiffness in ["1", "2", "3"] {
        let (from, to) = (format!("spring{stiffness}"), format!("stiff{stiffness}"));
        derive(folder, &from, &to, |cells, row| {
            let last = if row == 0 { "k" } else { stiffness };
            format!("{},{last}", cells.join(","))
        })?;
    }
    Ok(())
}

/// Writes a recording with other columns, from the cells of a row and its index, and with the same angles.
fn derive(
    folder: &Path,
    from: &str,
    to: &str,
    columns: impl Fn(&[&str], usize) -> String,
) -> Result<(), String> {
    let fail = |e: std::io::Error| format!("{from}.csv: {e}");
    let file = |name: &str, ending: &str| folder.join(name).with_extension(ending);
    let text = fs::read_to_string(file(from, "csv")).map_err(fail)?;
    let rows = text.lines().enumerate().map(|(row, line)| {
        let cells: Vec<&str> = line.split(',').collect();
        columns(&cells, row) + "\n"
    });
    fs::write(file(to, "csv"), rows.collect::<String>()).map_err(fail)?;
    fs::copy(file(from, "toml"), file(to, "toml")).map_err(fail)?;
    Ok(())
}

/// Commands that need no model, on one thread and on two.
const WITHOUT_MODEL: &[&str] = &[
    "simulate list",
    "check pendulum.csv",
    "check double.csv",
    "check positions.csv",
    "check noisy.csv",
    "check arm.csv",
    "check arm.csv log.csv",
    "check log.csv --low-pass 5",
    "check cart.csv",
    "check stiff1.csv stiff2.csv stiff3.csv --parameters k",
    "check double.csv --lagrangian --seconds 1e-9",
    "check pendulum.csv --lagrangian --seconds 1e-9",
    "check arm.csv --lagrangian --seconds 1e-9",
    "demo --seconds 1e-9 --samples 400 --starts 2 --out demo",
    "conserved kepler --points q1:q2",
    "conserved double-pendulum --duration 2",
    "conserved furuta-pendulum --duration 2",
    "conserved charged-particle --points q1:q2 --duration 2",
    "conserved cart-pole cart.csv",
    "action pendulum --from 0.2 --to 1.5 --time 0.7 --out path.csv",
    "action pendulum --from 0 --to 0.5 --turns 1 --time 1.2",
    "action double-pendulum --from 0.6,-0.3 --to 1,0.4 --time 0.5 --guesses 4 --steps 60",
    "action mass-spring --from 1 --to 0.3 --time 4",
    "action mass-spring --from 1 --to 0.3 --time 3.141592653589793",
];

/// Commands on the models by their folders.
const WITH_MODEL: &[(&[&str], &[&str])] = &[
    (
        &[
            "lnn",
            "convex",
            "hnn",
            "hnn-mass",
            "mlp",
            "ode",
            "ode-first",
            "vin",
            "free-delan",
        ],
        &[
            "score {}/model.safetensors unseen.csv",
            "rollout {}/model.safetensors --follow unseen.csv",
            "rollout {}/model.safetensors --q0 0.3,0.2 --qd0 0,0 --duration 2 --out rolled-{}.csv",
            "torque {}/model.safetensors unseen.csv --out torque-{}.csv",
            "conserved {}/model.safetensors unseen.csv --rollouts 2",
            "action {}/model.safetensors --from 0.2,0.1 --to 0.4,0.3 --time 0.3 --steps 40 --guesses 4",
            "report {}",
        ],
    ),
    (
        &[
            "delan",
            "forces",
            "rigid",
            "robot",
            "nominal",
            "nominal-delan",
        ],
        &[
            "score {}/model.safetensors {recording}.csv",
            "rollout {}/model.safetensors --follow {recording}.csv",
            "torque {}/model.safetensors {recording}.csv --out torque-{}.csv",
            "conserved {}/model.safetensors {recording}.csv --rollouts 2",
            "track {}/model.safetensors --reference reference.csv --robot two-link-arm --out tracked-{}.csv",
            "report {}",
        ],
    ),
];

/// Further runs of commands that take a model.
const FURTHER: &[&str] = &[
    "torque lnn/model.safetensors noisy.csv --smooth",
    "score delan/model.safetensors log.csv --low-pass 10",
    "score delan/model.safetensors log.csv --delay 10",
    "torque delan/model.safetensors log.csv --low-pass 10 --delay 10",
    "rollout lnn/model.safetensors --q0 0.3,0.2 --qd0 0,0 --duration 2 --method rk4",
    "rollout lnn/model.safetensors --q0 0.3,0.2 --qd0 0,0 --duration 2 --method dopri5",
    "rollout lnn/model.safetensors --q0 0.3,0.2 --qd0 0,0 --duration 2 --method implicit-midpoint",
    "rollout lnn/model.safetensors --q0 0.3,0.2 --qd0 0,0 --duration 2 --method variational-midpoint",
    "rollout lnn/model.safetensors --q0 0.3,0.2 --qd0 0,0 --duration 2 --method variational-trapezoidal",
    "rollout vin/model.safetensors --q0 0.3,0.2 --qd0 0,0 --duration 2 --method stormer-verlet",
    "rollout hnn/model.safetensors --q0 0.3,0.2 --qd0 0,0 --duration 2 --method stormer-verlet",
    "rollout springs/model.safetensors --q0 1,1.5 --qd0 0,0 --duration 2",
    "score springs/model.safetensors stiff1.csv --parameters k",
    "torque fast/model.safetensors fast.csv",
    "torque noisy/model.safetensors noisy.csv --smooth",
    "track delan/model.safetensors --reference reference.csv",
    "track delan/model.safetensors --reference reference.csv --robot two-link-arm --controller pd",
    "track delan/model.safetensors --reference reference.csv --robot two-link-arm --controller computed-torque --kp 40 --kd 8",
    "track delan/model.safetensors --reference reference.csv --robot two-link-arm --payload 0.5 --limit 30 --seed 3",
    "track delan/model.safetensors --reference reference.csv --robot two-link-arm --noise 1e-5,2e-3 --delay 2 --quantisation 1e-4",
    "track robot/model.safetensors --reference reference.csv --robot two_link_arm --payload 0.5",
    "track robot/model.safetensors --reference reference.csv --robot two-link-arm --rate 200",
];

/// The recordings, made on one thread.
pub(super) fn recordings() -> Vec<Line> {
    RECORDINGS.iter().map(|text| Line::new(*text)).collect()
}

/// A run of every command.
pub(super) fn all() -> Vec<Line> {
    let mut texts: Vec<String> = WITHOUT_MODEL.iter().map(|text| (*text).into()).collect();
    for (models, commands) in WITH_MODEL {
        for model in *models {
            let recording = if model.starts_with("robot") || model.starts_with("nominal") {
                "robot"
            } else {
                "arm"
            };
            texts.extend(commands.iter().map(|command| {
                let command = command.replace("{recording}", recording);
                command.replace("{}", model)
            }));
        }
    }
    texts.extend(FURTHER.iter().map(|text| (*text).into()));
    texts.into_iter().map(Line::on_either).collect()
}
