//! Short fits: every family with every loss, optimiser, force and setting of a rollout.

use super::line::Line;

/// What all fits share, but for those that say otherwise.
const SHORT: &str = "--steps 12 --width 16";

/// Fits whose models other commands read.
const NAMED: &[&str] = &[
    "fit double.csv --model lnn --form free --steps 60 --width 16 --out lnn",
    "fit double.csv --model lnn --form convex --steps 60 --width 16 --out convex",
    "fit canonical.csv --model hnn --steps 60 --width 16 --out hnn",
    "fit canonical.csv --model hnn --structure mass --steps 60 --width 16 --out hnn-mass",
    "fit double.csv --model mlp --steps 60 --width 16 --out mlp",
    "fit double.csv --model neural-ode --steps 20 --width 16 --out ode",
    "fit double.csv --model neural-ode --order first --steps 20 --width 16 --out ode-first",
    "fit positions.csv --model vin --steps 40 --width 16 --out vin",
    "fit double.csv --model delan --steps 40 --width 16 --out free-delan",
    "fit arm.csv --model delan --dissipation --steps 60 --width 16 --out delan",
    "fit arm.csv --model delan --forces viscous,coulomb,stribeck,offset,rotor,gains --steps 40 --width 16 --out forces",
    "fit arm.csv --model rigid --dissipation --out rigid",
    "fit robot.csv --model rigid --urdf two_link_arm --dissipation --out robot",
    "fit robot.csv --model lnn --nominal two_link_arm --loss torque --steps 40 --width 16 --out nominal",
    "fit robot.csv --model delan --nominal two_link_arm --loss torque --steps 40 --width 16 --out nominal-delan",
    "fit stiff1.csv stiff2.csv stiff3.csv --parameters k --validate-fraction 0.4 --steps 40 --width 16 --out springs",
    "fit fast.csv --model lnn --speed-limit 1 --steps 20 --width 16 --out fast",
    "fit noisy.csv --smooth --steps 20 --width 16 --out noisy",
];

/// A family with its settings.
struct Variant {
    settings: &'static str,
    /// A recording with torques.
    forced: &'static str,
    /// A recording without, for the settings that refuse torques.
    free: &'static str,
}

const fn variant(settings: &'static str) -> Variant {
    Variant {
        settings,
        forced: "arm.csv",
        free: "double.csv",
    }
}

const fn of_robot(settings: &'static str) -> Variant {
    Variant {
        settings,
        forced: "robot.csv",
        free: "robot.csv",
    }
}

const fn canonical(settings: &'static str) -> Variant {
    Variant {
        settings,
        forced: "arm.csv",
        free: "canonical.csv",
    }
}

/// Families that are fitted with every loss and optimiser.
const FAMILIES: &[Variant] = &[
    variant("--model lnn --form free"),
    variant("--model lnn --form convex"),
    variant("--model delan"),
    variant("--model delan --vector-potential"),
    variant("--model vin"),
    canonical("--model hnn"),
    canonical("--model hnn --structure mass"),
    canonical("--model hnn --structure none --momenta velocities"),
    variant("--model mlp"),
    variant("--model neural-ode"),
    variant("--model neural-ode --order first"),
    variant("--model rigid"),
    of_robot("--model rigid --urdf two_link_arm"),
    of_robot("--model lnn --nominal two_link_arm"),
    of_robot("--model delan --nominal two_link_arm"),
];

/// Further settings of families, with the default loss.
const SETTINGS: &[Variant] = &[
    variant("--model lnn"),
    variant("--model lnn --form free --exponential"),
    variant("--model lnn --form convex --exponential"),
    variant("--model lnn --form free --speed-limit 40"),
    variant("--model lnn --form convex --speed-limit 40 --speed-chart arcsin"),
    variant("--model delan --trunks separate"),
    variant("--model delan --trunks separate --vector-potential"),
    variant("--model vin --vector-potential"),
    canonical("--model hnn --momenta velocities"),
    canonical("--model hnn --structure mass --momenta velocities"),
    canonical("--model hnn --masses 1,1"),
    canonical("--model hnn --speed-limit 40"),
    of_robot("--model lnn --form convex --nominal two_link_arm"),
];

/// Every loss; the first is that of the family.
const LOSSES: &[&str] = &[
    "",
    "acceleration",
    "acceleration-l1",
    "torque",
    "torque-l1",
    "torque-acceleration",
    "torque-power",
    "positions",
    "positions-trapezoidal",
    "rollout",
];

const OPTIMIZERS: &[&str] = &["natural", "adam"];

/// Settings of a loss of rollouts.
const ROLLOUTS: &[&str] = &[
    "--horizon 3",
    "--integrator stormer-verlet",
    "--integrator implicit-midpoint",
    "--substeps 2",
    "--observe positions",
    "--starts free",
    "--starts free --integrator implicit-midpoint --observe positions",
    "--growth 0",
    "--warm-start 0.4",
];

/// Families that are fitted to rollouts with every setting.
const ROLLED: &[&str] = &[
    "double.csv --model lnn --form free",
    "arm.csv --model lnn --form convex",
    "arm.csv --model delan",
    "double.csv --model vin",
    "canonical.csv --model hnn",
    "double.csv --model hnn --structure mass --masses 1,1",
    "arm.csv --model mlp",
    "arm.csv --model neural-ode",
    "double.csv --model neural-ode --order first",
];

/// Forces that are learned.
const FORCES: &[&str] = &[
    "--dissipation",
    "--forces viscous,coulomb,stribeck,offset",
    "--forces gains,viscous",
    "--forces input-matrix",
    "--forces rotor",
];

/// Families that are fitted with every force, and how.
const FORCED: &[&str] = &[
    "arm.csv --model lnn --form free --loss torque",
    "arm.csv --model lnn --form convex --loss acceleration",
    "arm.csv --model delan",
    "arm.csv --model delan --loss acceleration",
    "arm.csv --model delan --loss torque-power",
    "arm.csv --model delan --loss rollout --horizon 3",
    "arm.csv --model delan --loss positions",
    "arm.csv --model vin",
    "arm.csv --model hnn",
    "arm.csv --model rigid",
    "robot.csv --model rigid --urdf two_link_arm",
    "robot.csv --model delan --nominal two_link_arm --loss torque",
    "robot.csv --model lnn --nominal two_link_arm --loss acceleration",
];

/// Settings that each need one fit or two.
const FURTHER: &[&str] = &[
    "fit double.csv --activation tanh",
    "fit double.csv --activation gelu --form convex",
    "fit double.csv --activation xtanh --form convex",
    "fit arm.csv --model delan --activation tanh",
    "fit canonical.csv --model hnn --activation xtanh",
    "fit double.csv --layers 1",
    "fit double.csv --layers 3 --form convex",
    "fit arm.csv --model delan --layers 3",
    "fit double.csv --damping loss",
    "fit double.csv --damping adaptive",
    "fit arm.csv --model delan --damping loss",
    "fit arm.csv --model delan --damping adaptive",
    "fit arm.csv --model mlp --damping adaptive",
    "fit canonical.csv --model hnn --damping adaptive",
    "fit positions.csv --model vin --optimizer natural --damping loss",
    "fit double.csv --batch 32",
    "fit double.csv --batch 100 --batch-first 20",
    "fit arm.csv --model delan --batch 100 --batch-first 20",
    "fit double.csv --seed 7",
    "fit arm.csv --model delan --seed 7",
    "fit double.csv --learning-rate 0.1",
    "fit double.csv --optimizer adam --learning-rate 0.01 --weight-decay 0.001",
    "fit double.csv --validate unseen.csv",
    "fit double.csv --validate-fraction 0",
    "fit double.csv --validate-fraction 0.3",
    "fit double.csv --every 2",
    "fit positions.csv",
    "fit positions.csv --loss positions --baseline 2",
    "fit positions.csv --loss rollout",
    "fit positions.csv --model delan --loss positions-trapezoidal",
    "fit positions.csv --model vin --loss positions-trapezoidal --baseline 3",
    "fit positions.csv --model neural-ode --observe positions",
    "fit noisy.csv",
    "fit noisy.csv --smooth --model delan",
    "fit noisy.csv --low-pass 10",
    "fit noisy.csv --loss rollout --starts free --horizon 8",
    "fit noisy.csv --model hnn --momenta velocities",
    "fit log.csv --model delan --low-pass 10 --dissipation",
    "fit log.csv --model delan --smooth --delay 10",
    "fit log.csv --model lnn --low-pass 10 --loss torque --forces offset",
    "fit log.csv --model rigid --low-pass 10 --dissipation",
    "fit log.csv --rows 1000",
    "fit log.csv --rows 1000 --loss rollout --seed 3",
    "fit cart.csv --dissipation",
    "fit cart.csv --model delan --forces input-matrix",
    "fit cart.csv --model delan --actuated q1 --tau tau1",
    "fit fast.csv --speed-limit 1 --speed-chart arcsin",
    "fit fast.csv --form convex --speed-limit 1 --exponential",
    "fit fast.csv --model hnn --speed-limit 1 --masses 1",
    "fit pendulum.csv",
    "fit pendulum.csv --model delan",
    "fit double.csv unseen.csv",
    "fit stiff1.csv stiff2.csv stiff3.csv --parameters k --model delan --validate-fraction 0.4",
    "fit stiff1.csv stiff2.csv stiff3.csv --parameters k --model mlp --validate-fraction 0.4",
    "fit robot.csv --model delan --nominal two_link_arm --forces viscous,rotor --loss torque-acceleration",
];

/// Fits that are run on one thread, on two and on three, and a fit from its last checkpoint.
const THREADED: &[&str] = &[
    "fit double.csv --model lnn --form free",
    "fit double.csv --model lnn --form convex --optimizer adam",
    "fit arm.csv --model delan",
    "fit arm.csv --model delan --optimizer adam --loss torque-power",
    "fit canonical.csv --model hnn --structure mass",
    "fit arm.csv --model neural-ode",
    "fit double.csv --loss rollout",
    "fit positions.csv --model vin",
    "fit arm.csv --model mlp",
];

/// Fits that end by time after one step, whose settings are those of fits by time, and fits of no model.
const ENDINGS: &[&str] = &[
    "fit double.csv --width 16 --seconds 1e-9",
    "fit arm.csv --model delan --width 16 --seconds 1e-9",
    "fit arm.csv --model mlp --optimizer adam --width 16 --seconds 1e-9",
    "fit double.csv --width 16 --steps 80 --patience 1 --learning-rate 2",
    "fit double.csv --width 16 --steps 120 --optimizer adam --learning-rate 1e6",
    "fit --resume --out lnn",
    "fit --resume --out delan",
    "fit --resume --out hnn",
    "fit --resume --out rigid",
];

/// Fits whose models other commands read.
pub(super) fn named() -> Vec<Line> {
    NAMED.iter().map(|text| Line::on_either(*text)).collect()
}

/// All other fits.
pub(super) fn all() -> Vec<Line> {
    let mut lines: Vec<Line> = Vec::new();
    let short = |text: String| Line::on_either(format!("{text} {SHORT}"));
    lines.extend(losses().into_iter().map(short));
    lines.extend(settings().into_iter().map(short));
    lines.extend(
        pairs(ROLLED, "--loss rollout", ROLLOUTS)
            .into_iter()
            .map(short),
    );
    lines.extend(pairs(FORCED, "", FORCES).into_iter().map(short));
    lines.extend(FURTHER.iter().map(|text| short((*text).into())));
    for text in THREADED {
        let line = Line::new(format!("{text} --seed 1 {SHORT}"));
        lines.extend((1..=3).map(|threads| line.clone().on_threads(threads)));
    }
    lines.extend(ENDINGS.iter().map(|text| Line::on_either(*text)));
    lines
}

/// Every family with every loss and optimiser.
fn losses() -> Vec<String> {
    let mut texts = Vec::new();
    for variant in FAMILIES {
        for loss in LOSSES {
            for optimizer in OPTIMIZERS {
                let loss = match *loss {
                    "" => String::new(),
                    name => format!("--loss {name}"),
                };
                let (recording, settings) = (variant.recording(), variant.settings);
                texts.push(format!(
                    "fit {recording} {settings} {loss} --optimizer {optimizer}"
                ));
            }
        }
    }
    texts
}

impl Variant {
    /// A recording with torques, unless the settings refuse them.
    fn recording(&self) -> &'static str {
        if self.settings.contains("velocities") {
            self.free
        } else {
            self.forced
        }
    }
}

/// Further settings of families, on recordings with torques and without.
fn settings() -> Vec<String> {
    let mut texts = Vec::new();
    for Variant {
        settings,
        forced,
        free,
    } in SETTINGS
    {
        texts.push(format!("fit {forced} {settings} --optimizer natural"));
        texts.push(format!("fit {free} {settings} --optimizer adam"));
    }
    texts
}

/// Every fit with every setting, the optimisers in turns.
fn pairs(fits: &[&str], loss: &str, settings: &[&str]) -> Vec<String> {
    let mut texts = Vec::new();
    for (j, fit) in fits.iter().enumerate() {
        for (k, setting) in settings.iter().enumerate() {
            let optimizer = OPTIMIZERS[(j + k) % OPTIMIZERS.len()];
            texts.push(format!(
                "fit {fit} {loss} {setting} --optimizer {optimizer}"
            ));
        }
    }
    texts
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_fit_is_listed_twice() {
        let lines = [named(), all()].concat();
        let keys: BTreeSet<String> = lines.iter().map(Line::key).collect();
        assert_eq!(keys.len(), lines.len());
    }
}
