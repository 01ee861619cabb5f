//! The page of the comparison.

use lagrangian::experiment::hamiltonian::{PhaseTest, Task};
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::super::spread::scientific;
use super::{CONTESTANTS, Found};

pub(super) fn report(found: &[Found], coordinates: Table) -> Report {
    let headline = |found: &Found| Headline {
        label: format!("Energy error, {}", found.task.name()),
        value: scientific(found.energy(0)),
        unit: "J²".into(),
        note: format!(
            "published {}; plain network {}",
            scientific(found.task.protocol().published[1]),
            scientific(found.energy(2))
        ),
        role: Some(Role::Lnn),
    };
    Report {
        title: "Hamiltonian networks".into(),
        subtitle:
            "Fitted to (q̇, ṗ) of (q, p); the plain network has the same inputs, size and optimiser"
                .into(),
        headlines: found.iter().map(headline).collect(),
        summary: protocols(found),
        figures: found
            .iter()
            .flat_map(|found| [motion(found), energy(found)])
            .collect(),
        tables: vec![coordinates],
        ..Report::default()
    }
}

fn protocols(found: &[Found]) -> Vec<String> {
    let line = |found: &Found| {
        let p = found.task.protocol();
        format!(
            "{}: {} motions of {} s, {} samples each, noise of {} on q and p, exact rates; tests of {} s from {} starts.",
            found.task.name(),
            p.trajectories,
            p.seconds,
            p.samples,
            p.noise,
            p.test_seconds,
            p.starts
        )
    };
    found.iter().map(line).collect()
}

/// The first test of the first seed: the true motion, and those of the contestants.
fn first(found: &Found) -> Vec<(&'static str, Role, &PhaseTest)> {
    let tests = CONTESTANTS.iter().zip(&found.runs);
    let first = tests.filter_map(|(contestant, runs)| {
        let test = runs.first()?.tests.first()?;
        Some((contestant.name, contestant.role, test))
    });
    first.collect()
}

/// The energy along the first test.
fn energy(found: &Found) -> Figure {
    let tests = first(found);
    let truth = tests.first().map(|(_, _, test)| {
        Series::line(
            "true motion",
            Role::Truth,
            test.truth.t.clone(),
            test.energies[0].clone(),
        )
    });
    let models = tests.iter().map(|(name, role, test)| {
        Series::line(name, *role, test.found.t.clone(), test.energies[1].clone())
    });
    Figure {
        id: format!("energy-{}", found.task.key()),
        title: format!("True energy along the motion, {}", found.task.name()),
        caption: "From the first start of the first seed; the true motion keeps its energy.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear("energy", "J"),
        series: models.chain(truth).collect(),
    }
}

/// The phase portrait of one coordinate, or the path of the first body.
fn motion(found: &Found) -> Figure {
    let bodies = matches!(found.task, Task::TwoBodies | Task::ThreeBodies);
    let tests = first(found);
    let curve = |motion: &lagrangian::Trajectory| {
        let n = motion.dof().max(1);
        let column = |x: &[f64], i: usize| x.iter().skip(i).step_by(n).copied().collect::<Vec<_>>();
        let p = motion.p.as_slice();
        match bodies {
            true => (column(&motion.q, 0), column(&motion.q, 1)),
            false => (column(&motion.q, 0), column(p, 0)),
        }
    };
    let truth = tests.first().map(|(_, _, test)| {
        let (x, y) = curve(&test.truth);
        Series::line("true motion", Role::Truth, x, y)
    });
    let models = tests.iter().map(|(name, role, test)| {
        let (x, y) = curve(&test.found);
        Series::line(name, *role, x, y)
    });
    let (x, y, what) = match bodies {
        true => (
            Axis::linear("x", "m"),
            Axis::linear("y", "m"),
            "Path of the first body",
        ),
        false => (
            Axis::linear(
                "q",
                if found.task == Task::Pendulum {
                    "rad"
                } else {
                    "m"
                },
            ),
            Axis::linear("p", ""),
            "Phase portrait",
        ),
    };
    Figure {
        id: format!("motion-{}", found.task.key()),
        title: format!("{what}, {}", found.task.name()),
        caption: "From the first start of the first seed.".into(),
        x,
        y,
        series: models.chain(truth).collect(),
    }
}
