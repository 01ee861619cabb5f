//! Tables and figures of the tracking experiment.

use experiments::tracking::{Condition, WINDOW};
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::{Found, name, typical};
use crate::commands::experiment::spread::{cell, median, scientific};

fn role(condition: Condition) -> Role {
    match condition {
        Condition::Pd => Role::Other(0),
        Condition::Plain => Role::Baseline,
        Condition::Learned => Role::Lnn,
        Condition::Perfect => Role::Truth,
        Condition::PerfectLoaded => Role::Other(1),
    }
}

/// What was asked first.
pub(super) fn summary(found: &[Found]) -> Table {
    let row = |found: &Found, condition: Condition| {
        let loaded = condition == Condition::PerfectLoaded;
        let dash = |cell: String, shown: bool| if shown { cell } else { "–".into() };
        let recovered = found.recoveries(condition);
        let learned = matches!(condition, Condition::Plain | Condition::Learned);
        let p99: Vec<f64> = found
            .of(condition)
            .iter()
            .map(|run| 1e6 * run.latency.p99)
            .collect();
        vec![
            found.arm.name.to_string(),
            name(condition).to_string(),
            dash(cell(&found.before(condition)), !loaded),
            dash(cell(&found.ratios(condition)), !loaded),
            dash(seconds(&recovered), learned),
            cell(&p99),
        ]
    };
    Table {
        caption: "Tracking error of the last two letters before the payload, rad, root mean square over all joints, median \
                  (least … largest) over the seeds; over that of the true model; and seconds of motion from the payload \
                  until the error stays within 20 % of before."
            .into(),
        header: ["arm", "feed-forward", "error", "over true", "recovery, s", "p99 of a tick, µs"]
            .map(str::to_string)
            .to_vec(),
        rows: found
            .iter()
            .flat_map(|found| Condition::ALL.map(|condition| row(found, condition)))
            .collect(),
    }
}

fn seconds(recovered: &[f64]) -> String {
    let missed = recovered.iter().filter(|s| s.is_nan()).count();
    match missed {
        0 => cell(recovered),
        _ if missed == recovered.len() => "not within the letter".into(),
        _ => format!("{}, {missed} not", cell(recovered)),
    }
}

fn errors(found: &Found) -> Figure {
    let series = |condition: Condition| {
        let y = typical(found.of(condition));
        let x = (1..=y.len()).map(|k| k as f64).collect();
        Series::line(name(condition), role(condition), x, y)
    };
    let shown = [
        Condition::Pd,
        Condition::Plain,
        Condition::Learned,
        Condition::Perfect,
    ];
    let letters: Vec<&str> = found.writing.letters.iter().map(|l| l.0.as_str()).collect();
    Figure {
        id: format!("errors-{}", found.arm.name.replace(' ', "-")),
        title: format!("Error of each letter, {}", found.arm.name),
        caption: format!(
            "Median over the seeds. The letters are {}; with the last one comes a payload of {} kg, which the true model \
             does not know.",
            letters.join(", "),
            found.arm.payload
        ),
        x: Axis::linear("letter", ""),
        y: Axis::log("tracking error", "rad"),
        series: shown.map(series).to_vec(),
    }
}

fn after(found: &Found) -> Figure {
    let series = |condition: Condition| {
        let runs = found.of(condition);
        let x = runs
            .first()
            .map(|run| run.after.0.clone())
            .unwrap_or_default();
        let y: Vec<Vec<f64>> = runs.iter().map(|run| run.after.1.clone()).collect();
        Series::spread(name(condition), role(condition), x, &y)
    };
    let shown = [
        Condition::Plain,
        Condition::Perfect,
        Condition::PerfectLoaded,
        Condition::Learned,
    ];
    Figure {
        id: format!("payload-{}", found.arm.name.replace(' ', "-")),
        title: format!("After the payload, {}", found.arm.name),
        caption: format!(
            "Errors in windows of {WINDOW} s from the instant that {} kg come into the hand. The true model does not \
             learn of it; the one that knows the payload shows what can be reached.",
            found.arm.payload
        ),
        x: Axis::linear("time since the payload", "s"),
        y: Axis::log("tracking error", "rad"),
        series: shown.map(series).to_vec(),
    }
}

/// The path of the last letter before the payload, first joint against second.
fn path(found: &Found) -> Option<Figure> {
    let k = found.writing.letters.len().checked_sub(2)?;
    let (letter, from, to) = &found.writing.letters[k];
    let path = |motion: &lagrangian::Trajectory| {
        let n = motion.dof();
        let inside = motion.t.iter().enumerate();
        let inside = inside.filter(|(_, t)| (*from..*to).contains(*t));
        inside
            .map(|(k, _)| (motion.q[k * n], motion.q[k * n + 1]))
            .unzip()
    };
    let wanted: (Vec<f64>, Vec<f64>) = path(found.writing.reference.samples());
    let mut series = vec![Series::line("reference", Role::Truth, wanted.0, wanted.1)];
    for condition in [Condition::Pd, Condition::Learned] {
        let (x, y) = path(&found.of(condition).first()?.motion);
        series.push(Series::line(name(condition), role(condition), x, y));
    }
    Some(Figure {
        id: format!("path-{}", found.arm.name.replace(' ', "-")),
        title: format!("The letter {letter}, {}", found.arm.name),
        caption:
            "Second joint over first: the reference, feedback alone, and with the learned model."
                .into(),
        x: Axis::linear("first joint", "rad"),
        y: Axis::linear("second joint", "rad"),
        series,
    })
}

fn latency(found: &Found) -> Option<Figure> {
    let live = found.live.as_ref()?;
    let (x, y) = live
        .histogram
        .iter()
        .map(|&(seconds, ticks)| (1e6 * seconds, ticks as f64))
        .unzip();
    Some(Figure {
        id: format!("latency-{}", found.arm.name.replace(' ', "-")),
        title: format!("Time of a tick while a thread learns, {}", found.arm.name),
        caption: format!(
            "Controller alone, {} ticks at 500 Hz in real time: median {} µs, 99 % below {} µs, longest {} µs.",
            live.latency.ticks,
            scientific(1e6 * live.latency.p50),
            scientific(1e6 * live.latency.p99),
            scientific(1e6 * live.latency.max)
        ),
        x: Axis::log("time", "µs"),
        y: Axis::log("ticks", ""),
        series: vec![Series::points("ticks", Role::Lnn, x, y)],
    })
}

pub(super) fn report(found: &[Found], seeds: usize) -> Report {
    let headline = |found: &Found| {
        let learned = median(&found.before(Condition::Learned));
        Headline {
            label: format!("Error, {}", found.arm.name),
            value: scientific(1e3 * learned),
            unit: "mrad".into(),
            note: format!(
                "learned online; {} × the true model's, feedback alone {} mrad",
                scientific(median(&found.ratios(Condition::Learned))),
                scientific(1e3 * median(&found.before(Condition::Pd)))
            ),
            role: Some(Role::Lnn),
        }
    };
    let figures = |found: &Found| {
        let own = [
            Some(errors(found)),
            Some(after(found)),
            path(found),
            latency(found),
        ];
        own.into_iter().flatten().collect::<Vec<_>>()
    };
    Report {
        title: "Tracking: an arm that learns its model while it writes".into(),
        subtitle: format!("500 Hz, low-gain feedback with feed-forward, {seeds} seeds"),
        headlines: found.iter().map(headline).collect(),
        summary: vec![
            "The model begins with random weights. Samples come from the loop itself: positions of 20-bit encoders, \
             velocities with noise of 2e-3 rad/s, torques as they were asked for; drives add noise of 0.2 % of their \
             largest torque (0.03 % with seven joints). Learning runs in lock step with the motion, so that every figure can be repeated."
                .into(),
            "The error of the true model is what this noise and the ticks of the loop leave.".into(),
        ],
        figures: found.iter().flat_map(figures).collect(),
        ..Report::default()
    }
}
