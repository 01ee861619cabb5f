//! The files that pages name and that a reader has: how each of them is made for the tests.

/// A file, folder or pattern that a command names, and the shell commands that make it in an empty folder.
pub(super) struct Fixture {
    /// The word as it is printed; one that ends in `/` stands for all words that begin with it.
    pub(super) name: &'static str,
    /// What the command must contain as well; empty for any command.
    pub(super) with: &'static str,
    pub(super) recipe: &'static str,
}

const fn fixture(name: &'static str, with: &'static str, recipe: &'static str) -> Fixture {
    Fixture { name, with, recipe }
}

/// The recipe of a file of motions of the double pendulum, without forces.
macro_rules! swings {
    ($file:literal) => {
        concat!(
            "lagrangian simulate double-pendulum --trajectories 12 --duration 3 --out ",
            $file
        )
    };
}

/// The recipe of a log of the arm of two joints, with torques and friction.
macro_rules! arm {
    ($file:literal) => {
        concat!(
            "lagrangian simulate --urdf two_link_arm --drive 8 --friction 0.3 --duration 20 --out ",
            $file
        )
    };
}

/// The recipe of a run folder, of these data and with these flags.
macro_rules! run {
    ($data:expr, $flags:literal, $folder:literal) => {
        concat!(
            $data,
            "\nlagrangian fit data.csv --seconds 1 --quiet --out ",
            $folder,
            " ",
            $flags,
            " || test -f ",
            $folder,
            "/model.safetensors"
        )
    };
}

/// The recipe of a description of the arm of two joints.
macro_rules! description {
    ($file:literal) => {
        concat!(
            "cp $REPO/crates/lagrangian-mechanics/src/rigid/robots/two_link_arm.urdf ",
            $file
        )
    };
}

/// The recipe of logs of one column of angles, with names of their own.
macro_rules! named {
    ($($file:literal),*) => {
        concat!("lagrangian simulate pendulum --drive 1 --duration 20 --out log.csv\n",
            $("sed '1s/qdd1/alpha/; 1s/qd1/omega/; 1s/q1/theta/; 1s/tau1/torque/' log.csv > ", $file, "\n",)* "rm log.*")
    };
}

/// The fixtures; the first that fits is taken.
pub(super) static FIXTURES: &[Fixture] = &[
    fixture("motion.csv", "--p p1", "lagrangian simulate double-pendulum --momenta --trajectories 8 --duration 3 --out motion.csv"),
    fixture("motion.csv", "", swings!("motion.csv")),
    fixture("test.csv", "track ", arm!("test.csv")),
    fixture("test.csv", "", concat!(swings!("test.csv"), " --seed 1")),
    fixture("test1.csv", "", concat!(swings!("test1.csv"), " --seed 1")),
    fixture("test2.csv", "", concat!(swings!("test2.csv"), " --seed 2")),
    fixture("other.csv", "", arm!("other.csv")),
    fixture("other-log.csv", "", arm!("other-log.csv")),
    fixture("log.csv", "", arm!("log.csv")),
    fixture("robot-log.csv", "", arm!("robot-log.csv")),
    fixture("monday.csv", "", arm!("monday.csv")),
    fixture("tuesday.csv", "", arm!("tuesday.csv")),
    fixture("log1.csv", "--q theta --qd omega", named!("log1.csv", "log2.csv")),
    fixture("log1.csv", "--time time", "lagrangian simulate pendulum --drive 1 --duration 10 --out m.csv
for k in 1 2; do sed '1s/^t,/time,/; 1s/q1/theta/; 1s/tau1/torque/' m.csv > log$k.csv; done; rm m.*"),
    fixture("log*.csv", "--q theta", named!("log1.csv", "log2.csv")),
    fixture("log*.csv", "", concat!(arm!("log1.csv"), "; ", arm!("log2.csv"), " --seed 1")),
    fixture("train.csv", "", swings!("train.csv")),
    fixture("train.npz", "", swings!("train.npz")),
    fixture("held-out.npz", "", "lagrangian simulate double-pendulum --trajectories 4 --duration 3 --seed 1 --out held-out.npz"),
    fixture("noisy.csv", "", "lagrangian simulate double-pendulum --trajectories 8 --duration 4 --noise 0.01 --out noisy.csv"),
    fixture("video.csv", "", "lagrangian simulate double-pendulum --trajectories 8 --duration 4 --out m.csv
cut -d, -f1-4 m.csv > video.csv; cp m.toml video.toml; rm m.*"),
    fixture("points.csv", "", "lagrangian simulate double-pendulum --trajectories 8 --duration 3 --noise 0.001 --out m.csv
awk -F, 'NR == 1 {print \"trajectory,t,x1,y1,x2,y2\"} NR > 1 {x = sin($3); y = -cos($3); print $1 \",\" $2 \",\" x \",\" y \",\" x + sin($4) \",\" y - cos($4)}' OFMT=%.9g CONVFMT=%.9g m.csv > points.csv; rm m.*"),
    fixture("chain.csv", "", "awk 'BEGIN {srand(1); n = 12; printf \"trajectory,t\"; for (i = 1; i <= n; i++) printf \",q%d\", i; print \"\"
for (m = 0; m < 6; m++) {for (i = 0; i < n; i++) {q[i] = rand() - 0.5; v[i] = rand() - 0.5}
for (k = 0; k < 150; k++) {printf \"%d,%.9g\", m, 0.02 * k; for (i = 0; i < n; i++) printf \",%.9g\", q[i]; print \"\"
for (s = 0; s < 10; s++) {for (i = 0; i < n; i++) q[i] += 0.001 * v[i]; for (i = 0; i < n; i++) {r = q[(i + 1) % n] - q[i]; f[i] = r + r * r * r}
for (i = 0; i < n; i++) {v[i] += 0.002 * (f[i] - f[(i + n - 1) % n]); q[i] += 0.001 * v[i]}}}}}' > chain.csv"),
    fixture("planet.csv", "", "lagrangian simulate kepler --trajectories 4 --duration 10 --out m.csv
sed '1s/,q1,q2,/,x,y,/' m.csv > planet.csv; printf '[columns]\\nq = [\"x\", \"y\"]\\nqd = [\"qd1\", \"qd2\"]\\n' > planet.toml; rm m.*"),
    fixture("letter.csv", "iiwa7", "lagrangian simulate --urdf iiwa7 --friction 10 --duration 1 --out letter.csv"),
    fixture("letter.csv", "", "lagrangian simulate two-link-arm --friction 1 --duration 2 --out letter.csv"),
    fixture("robot.urdf", "", description!("robot.urdf")),
    fixture("robot.xml", "", "python -c 'import mujoco; from lagrangian import plant; mujoco.mj_saveLastXML(\"robot.xml\", plant.compiled(\"two_link_arm\"))'"),
    fixture("arm.urdf", "", description!("arm.urdf")),
    fixture("bag.db3", "", concat!(arm!("log.csv"), "\npython $REPO/python/tests/bags.py log.csv bag.db3; rm log.*")),
    fixture("bag1.mcap", "", concat!(arm!("log.csv"), "\nfor k in 1 2; do python $REPO/python/tests/bags.py log.csv bag$k.mcap; done; rm log.*")),
    fixture("bag_folder", "", concat!(arm!("log.csv"), "\nmkdir bag_folder; printf '%s\\n' rosbag2_bagfile_information: '  relative_file_paths:' '    - bag_0.db3' > bag_folder/metadata.yaml; python $REPO/python/tests/bags.py log.csv bag_folder/bag_0.db3; rm log.*")),
    fixture("plan.toml", "", "sed 's/^steps = .*/steps = 20/' $REPO/examples/sweep/plan.toml > plan.toml
lagrangian simulate double-pendulum --trajectories 6 --duration 3 --out motion.csv"),
    fixture("crates/", "", "mkdir -p crates/lagrangian-recordings/tests; cp -r $REPO/crates/lagrangian-recordings/tests/exports crates/lagrangian-recordings/tests"),
    fixture("examples/", "", "cp -r $REPO/examples .; rm -f examples/sweep/motion.*; sed -i 's/^steps = .*/steps = 20/' examples/sweep/plan.toml"),
    fixture("logs/", "", "mkdir logs; cp $DATA/servo_real/*.csv logs"),
    fixture("run", "export", run!(arm!("data.csv"), "--model delan", "run")),
    fixture("swings.csv", "", swings!("swings.csv")),
    fixture("robot.npz", "", arm!("robot.npz")),
    fixture("run/", "formula ", run!(swings!("data.csv"), "--model formula", "run")),
    fixture("run", "--resume", concat!(swings!("motion.csv"), "
LAGRANGIAN_QUICK= timeout -s INT 4 lagrangian fit motion.csv --width 16 --seconds 8 --out run --quiet || test -f run/run.toml")),
    fixture("run/", "iiwa7", run!("lagrangian simulate --urdf iiwa7 --drive 5 --friction 10 --duration 4 --step 0.002 --out data.csv", "--model rigid --urdf iiwa7", "run")),
    fixture("run/", "letter.csv", run!(arm!("data.csv"), "--model delan --width 16", "run")),
    fixture("run/", "planet.csv", run!("lagrangian simulate kepler --trajectories 6 --duration 5 --out m.csv
sed '1s/,q1,q2,/,x,y,/' m.csv > data.csv; rm m.*", "--q x,y --qd qd1,qd2 --width 16", "run")),
    fixture("run/", "log.csv", run!(arm!("data.csv"), "--model delan --width 16", "run")),
    fixture("run/", "", run!(swings!("data.csv"), "--width 16", "run")),
    fixture("run", "", run!(swings!("data.csv"), "--width 16", "run")),
    fixture("run1", "", run!(swings!("data.csv"), "--width 16", "run1")),
    fixture("run1/", "", run!(swings!("data.csv"), "--width 16", "run1")),
    fixture("run2", "", run!(swings!("data.csv"), "--width 16", "run2")),
    fixture("run3", "", run!(swings!("data.csv"), "--width 16", "run3")),
    fixture("other-run", "", run!(swings!("data.csv"), "--width 16", "other-run")),
    fixture("other.safetensors", "", concat!(run!(swings!("data.csv"), "--width 16", "other"), "\nmv other/model.safetensors other.safetensors; rm -r other")),
    fixture("ur10/", "", run!(arm!("data.csv"), "--model chain", "ur10")),
    fixture("lagrangian-demo", "", "lagrangian demo --quiet"),
];

/// The fixture of a word of a command.
pub(super) fn of(word: &str, command: &str) -> Option<&'static Fixture> {
    FIXTURES.iter().find(|own| {
        let names = own.name == word || (own.name.ends_with('/') && word.starts_with(own.name));
        names && command.contains(own.with)
    })
}

/// Begins the code in Python of each page: names that the page has from its reader, and short fits.
pub(super) const PYTHON: &str = r#"
import json
import warnings
import numpy as np
import lagrangian as lg
from lagrangian._estimators import Estimator
warnings.simplefilter("ignore")
_whole = Estimator._spec
def _short(self):
    spec = json.loads(_whole(self))
    return json.dumps({**spec, "steps": None, "seconds": min(spec["seconds"] or 1.0, 1.0)})
Estimator._spec = _short
q, qd, qdd, tau = np.array([0.3, -0.2]), np.array([0.1, 0.4]), np.array([1.0, -1.0]), np.array([0.5, 0.2])
q_d, qd_d, qdd_d, kp, kd = q + 0.01, qd, qdd, 5.0, 0.5
"#;
