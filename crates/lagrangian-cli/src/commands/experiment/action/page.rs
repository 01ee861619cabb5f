//! The table and the page of the action.

use anyhow::Result;
use experiments::action::{Judged, SIZES, directions};
use lagrangian_analysis::action::{DiscreteAction, Path, Verdict, family};
use lagrangian_report::{
    Axis, Figure, Headline, Report, Role, Series, Table, VariedPath, varied_paths,
};

use super::{Found, Paths, Run};
use crate::commands::experiment::spread::{cell, median, scientific};

const HEADER: [&str; 11] = [
    "system, time",
    "Lagrangian",
    "kind",
    "Morse index",
    "first conjugate at, s",
    "S",
    "error of S, grid",
    "slope of S(ε)",
    "missing force",
    "distance of the paths",
    "error of S(ε) − S(0)",
];

pub(super) fn summary(found: &[Found]) -> Table {
    let mut rows = Vec::new();
    for one in found {
        for long in [false, true] {
            rows.push(truth_row(one, long));
            rows.push(learned_row(one, long));
        }
    }
    Table {
        caption: "Stationary paths with the ends of a true motion. S of a learned Lagrangian is in its own gauge and not \
                  comparable; S(ε) − S(0) is, over the scale α of the mass matrices along the path, and its error is of all varied paths \
                  together (root mean square, relative). Slope: |dS/dε| at 0 times 0.2 over the change at ε = ±0.2. \
                  Distance: of the nodes of the two paths, largest. Learned: median (least … largest) of the seeds."
            .into(),
        header: HEADER.map(str::to_string).to_vec(),
        rows,
    }
}

fn chosen(paths: &Paths, long: bool) -> &Judged {
    if long { &paths.long } else { &paths.short }
}

fn title(found: &Found, long: bool) -> String {
    let seconds = if long {
        found.case.long
    } else {
        found.case.short
    };
    format!("{}, {seconds} s", found.case.system)
}

fn kind(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Minimum => "minimum",
        Verdict::Saddle => "saddle",
        Verdict::Conjugate => "ends conjugate",
        Verdict::Irregular => "M not definite",
    }
}

/// Where it is there at all: the first conjugate point lies within the long path alone.
fn conjugate(paths: &Paths, long: bool) -> Option<f64> {
    paths.conjugate.filter(|_| long)
}

fn truth_row(found: &Found, long: bool) -> Vec<String> {
    let judged = chosen(&found.truth, long);
    let path = &judged.stationary;
    vec![
        title(found, long),
        "true".into(),
        kind(path.verdict).into(),
        path.second_variation.morse_index.to_string(),
        conjugate(&found.truth, long).map_or("–".into(), |t| format!("{t:.4}")),
        format!("{:.6}", path.action),
        scientific(path.action_error),
        scientific(judged.slope),
        scientific(path.residual),
        "–".into(),
        "–".into(),
    ]
}

fn learned_row(found: &Found, long: bool) -> Vec<String> {
    let of = |f: &dyn Fn(&Judged, &Run) -> f64| -> String {
        let values: Vec<f64> = found.runs().map(|r| f(chosen(&r.paths, long), r)).collect();
        cell(&values)
    };
    let words = |f: &dyn Fn(&Judged) -> String| -> String {
        let mut all: Vec<String> = found.runs().map(|r| f(chosen(&r.paths, long))).collect();
        all.dedup();
        all.join("; ")
    };
    let lost = found.learned.len() - found.runs().count();
    let name = match lost {
        0 => "learned".to_string(),
        lost => format!("learned, {lost} without a path"),
    };
    let times: Vec<f64> = found
        .runs()
        .filter_map(|r| conjugate(&r.paths, long))
        .collect();
    let compared = |r: &Run| if long { r.long } else { r.short };
    vec![
        title(found, long),
        name,
        words(&|j| kind(j.stationary.verdict).into()),
        words(&|j| j.stationary.second_variation.morse_index.to_string()),
        match times.is_empty() {
            true => "–".into(),
            false => format!("{:.4}", median(&times)),
        },
        of(&|j, _| j.stationary.action),
        of(&|j, _| j.stationary.action_error),
        of(&|j, _| j.slope),
        of(&|j, _| j.stationary.residual),
        of(&|_, r| compared(r).path_distance),
        of(&|_, r| compared(r).action_error),
    ]
}

pub(super) fn report(found: &[Found]) -> Result<Report> {
    let mut figures = Vec::new();
    let mut headlines = Vec::new();
    for one in found {
        headlines.extend(headline(one));
        figures.extend(of_case(one)?);
    }
    Ok(Report {
        title: "The action itself".into(),
        subtitle: "Hamilton's principle, measured: among all paths with the same ends in the same time, a motion is one \
                   whose action is stationary"
            .into(),
        headlines,
        summary: vec![
            "Stationary is not least: behind the first conjugate point a motion is a saddle, and some paths near it have \
             less action. The least eigenvalue of the second variation says where."
                .into(),
            "A learned Lagrangian knows its action up to a factor, a constant and a total derivative, which no path with \
             fixed ends can see; with the factor of its mass matrices taken off, its varied paths lie on the true curves."
                .into(),
        ],
        figures,
        ..Report::default()
    })
}

fn headline(found: &Found) -> Option<Headline> {
    let truth = found.truth.conjugate?;
    let learned: Vec<f64> = found.runs().filter_map(|r| r.paths.conjugate).collect();
    Some(Headline {
        label: format!("First conjugate point, {}", found.case.system),
        value: match learned.is_empty() {
            true => "–".into(),
            false => format!("{:.4}", median(&learned)),
        },
        unit: "s".into(),
        note: format!("learned; true {truth:.4} s"),
        role: Some(Role::Lnn),
    })
}

fn of_case(found: &Found) -> Result<Vec<Figure>> {
    let system = found.case.system()?;
    let coordinates = system.coordinates();
    let path = &found.truth.short.stationary.path;
    let eta = &directions(path)[0];
    let few: Vec<f64> = SIZES.into_iter().step_by(4).collect();
    let varied = VariedPath {
        t: &path.times(),
        q: &path.q,
        eta,
        epsilon: &few,
    };
    let mut neighbours = varied_paths(coordinates, 0, &varied);
    neighbours.id = format!("paths-{}", found.case.system);
    neighbours.title = format!("Varied paths, {}", found.case.system);
    if let Some(run) = found.runs().next() {
        let learned = &run.paths.short.stationary.path;
        let q = learned.q.iter().step_by(learned.dof).copied().collect();
        neighbours
            .series
            .push(Series::line("learned", Role::Lnn, learned.times(), q));
    }
    Ok(vec![
        neighbours,
        families(found, false),
        saddle(found, system.lagrangian()),
        order(found, system.lagrangian()),
        eigenvalues(found),
    ])
}

/// S(ε) − S(0) of all families, true and learned; that of the least curved variation where the path is a saddle.
fn families(found: &Found, long: bool) -> Figure {
    let judged = chosen(&found.truth, long);
    let mut series = Vec::new();
    for (k, one) in judged.families.iter().enumerate() {
        let name = if k == 0 { "true" } else { "" };
        series.push(Series::line(
            name,
            Role::Truth,
            one.epsilon.clone(),
            one.change.clone(),
        ));
    }
    if let Some(run) = found.runs().next() {
        let scale = if long {
            run.long.scale
        } else {
            run.short.scale
        };
        for (k, one) in chosen(&run.paths, long).families.iter().enumerate() {
            let name = if k == 0 { "learned, over α" } else { "" };
            let scaled = one.change.iter().map(|s| s / scale).collect();
            series.push(Series::line(name, Role::Lnn, one.epsilon.clone(), scaled));
        }
    }
    let (id, caption) = match long {
        false => (
            "minimum",
            "One curve for each variation, one and two half waves of each coordinate: flat at ε = 0, and upwards along all.",
        ),
        true => (
            "saddle",
            "Behind the conjugate point: still flat at ε = 0, but downwards along one variation at least.",
        ),
    };
    Figure {
        id: format!("{id}-{}", found.case.system),
        title: format!("Action of varied paths, {}", title(found, long)),
        caption: caption.into(),
        x: Axis::linear("size of the variation ε", ""),
        y: Axis::linear("S(ε) − S(0)", "J·s"),
        series,
    }
}

/// The families of the long path, and that of its least curved variation.
fn saddle(found: &Found, lagrangian: &dyn lagrangian::Lagrangian) -> Figure {
    let stationary = &found.truth.long.stationary;
    let mode = &stationary.second_variation.mode;
    let along = family(
        &mut DiscreteAction::new(lagrangian),
        &stationary.path,
        mode,
        &SIZES,
    );
    let mut figure = families(found, true);
    let name = "least curved variation";
    figure.series.push(Series::line(
        name,
        Role::Other(0),
        along.epsilon,
        along.change,
    ));
    figure
}

/// |S(ε) − S(0)| over ε in logarithms, along the stationary path and along the straight one.
fn order(found: &Found, lagrangian: &dyn lagrangian::Lagrangian) -> Figure {
    let path = &found.truth.short.stationary.path;
    let last = path.segments();
    let straight = |k: usize, i: usize| {
        let (a, b) = (path.node(0)[i], path.node(last)[i]);
        a + (b - a) * k as f64 / last as f64
    };
    let q = (0..=last).flat_map(|k| (0..path.dof).map(move |i| straight(k, i)));
    let straight = Path {
        q: q.collect(),
        ..*path
    };
    let epsilon: Vec<f64> = (-14..=-1)
        .map(|k| 10.0_f64.powf(0.5 * f64::from(k)))
        .collect();
    let eta = &directions(path)[0];
    let mut action = DiscreteAction::new(lagrangian);
    let mut line = |name: &str, role: Role, path: &Path| {
        let change = family(&mut action, path, eta, &epsilon).change;
        let change = change.iter().map(|s| s.abs()).collect();
        Series::line(name, role, epsilon.clone(), change)
    };
    let series = vec![
        line("from the stationary path: order 2", Role::Truth, path),
        line("from the straight path: order 1", Role::Other(0), &straight),
    ];
    Figure {
        id: format!("order-{}", found.case.system),
        title: format!("How fast the action changes, {}", title(found, false)),
        caption: "Along the motion the action changes by the square of the variation, down to rounding; along any other \
                  path in proportion to it."
            .into(),
        x: Axis::log("size of the variation ε", ""),
        y: Axis::log("|S(ε) − S(0)|", "J·s"),
        series,
    }
}

/// The least eigenvalue of the second variation as the end moves along the path.
fn eigenvalues(found: &Found) -> Figure {
    let unzip = |judged: &Judged, scale: f64| -> (Vec<f64>, Vec<f64>) {
        judged
            .eigenvalues
            .iter()
            .map(|(t, x)| (*t, x / scale))
            .unzip()
    };
    let (t, x) = unzip(&found.truth.long, 1.0);
    let shown = x.first().map_or(1.0, |x| x.abs());
    let lowest = x.iter().copied().fold(0.0, f64::min);
    let mut series = vec![Series::line("true", Role::Truth, t, x)];
    if let Some(run) = found.runs().next() {
        let (t, x) = unzip(&run.paths.long, run.long.scale);
        series.push(Series::line("learned, over α", Role::Lnn, t, x));
    }
    Figure {
        id: format!("conjugate-{}", found.case.system),
        title: format!("Where the minimum ends, {}", found.case.system),
        caption: "Least eigenvalue of the second variation over the time of the end: the path is a minimum while it is \
                  above 0; it passes 0 at the first conjugate point."
            .into(),
        x: Axis::linear("time of the end", "s"),
        y: Axis::linear("least eigenvalue", "").between(1.2 * lowest, 0.3 * shown),
        series,
    }
}
