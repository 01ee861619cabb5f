//! Pages whose every value is known, for the tests in a browser. Usage: `pages FOLDER`.

use std::f64::consts::TAU;
use std::path::Path;
use std::{env, fs, io};

use lagrangian_report::{
    Along, Animation, Axis, Command, Figure, Headline, HeatMap, Panel, Report, Role, Series, Shape,
    Stage, Sweep, Table, draw, energy_error_over_time, loss_curves, parity,
};

fn main() -> io::Result<()> {
    let folder = env::args().nth(1).unwrap_or_else(|| "pages".into());
    let folder = Path::new(&folder);
    fs::create_dir_all(folder)?;
    fs::write(folder.join("known.html"), draw::html(&known()))?;
    fs::write(folder.join("large.html"), draw::html(&large()))?;
    fs::write(folder.join("hostile.html"), draw::html(&hostile()))
}

/// Every kind of figure.
fn known() -> Report {
    let kinds = [
        band(),
        energy_errors(),
        ellipse(),
        cloud(),
        shaded(),
        categories(),
        nothing(),
    ];
    let mut report = Report {
        title: "Known values".into(),
        subtitle: "sines, falls, an ellipse".into(),
        answer: "Good: it explains 99.90 % of the variance of the torques; least: q2, 87 %.".into(),
        summary: vec!["Every value of this page is known.".into()],
        headlines: vec![Headline::new(
            "Largest value",
            "1.00".into(),
            "rad",
            "of a sine",
        )],
        animations: vec![pendulum(), robot()],
        maps: vec![map()],
        ..Report::default()
    };
    report.add_figures("Motion", [sine("position", 1.0), sine("velocity", 2.0)]);
    report.add_figures("Kinds of figures", kinds);
    report.add_figures("Forces", (1..=6).map(torque));
    report.add_figures("Training", [losses()]);
    let rows = |count: u32| (1..=count).map(|k| vec![k.to_string(), (k * k).to_string()]);
    report.tables = [("A table.", 3), ("A long table.", 14)]
        .map(|(caption, count)| Table::new(caption, &["", "b"], rows(count).collect()))
        .to_vec();
    report.settings = vec![("samples".into(), "1001".into())];
    report.commands = vec![Command::new("This page", "cargo run --example pages")];
    report
}

/// A pendulum of one link, for 4 s.
fn pendulum() -> Animation {
    let t = clock(401, 0.01);
    let panel = |(name, role), drift: f64| Panel {
        name: String::from(name),
        role,
        shape: Shape::Chain { lengths: vec![1.0] },
        values: t.iter().map(|t| (3.0 * t).cos() + drift * t).collect(),
        energy_error: Some(t.iter().map(|t| 1e-9 + drift * t).collect()),
        t: t.clone(),
    };
    let [truth, lnn, _] = roles();
    Animation {
        id: "motion".into(),
        title: "A pendulum".into(),
        caption: "The pale one is the truth.".into(),
        panels: vec![panel(truth, 0.0), panel(lnn, 0.01)],
        ..Animation::default()
    }
}

/// A robot with two tips that turns about its base, for 4 s.
fn robot() -> Animation {
    let t = clock(401, 0.01);
    let panel = |(name, role), late: f64| Panel {
        name: String::from(name),
        role,
        shape: Shape::Points {
            joined: vec![0, 0, 1, 1],
            stage: Stage {
                middle: [1.0, 1.0],
                radius: 2.5,
            },
        },
        values: t.iter().flat_map(|t| turned(t - late)).collect(),
        energy_error: None,
        t: t.clone(),
    };
    let [truth, _, plain] = roles();
    Animation {
        id: "robot".into(),
        title: "A robot".into(),
        caption: "Its base stands away from the middle; the pale one is the truth.".into(),
        panels: vec![panel(truth, 0.0), panel(plain, 0.5)],
        ..Animation::default()
    }
}

/// The base at (1, 1), the joint at distance 1 from it in the direction t, and its tips at angles of ±0.5 from the joint.
fn turned(t: f64) -> Vec<f64> {
    let joint = [1.0 + t.cos(), 1.0 + t.sin()];
    let tip = |angle: f64| [joint[0] + angle.cos(), joint[1] + angle.sin()];
    [[1.0, 1.0], joint, tip(t - 0.5), tip(t + 0.5)].concat()
}

/// Ten plots with ten thousand points a curve.
fn large() -> Report {
    let figure = |k: usize| Figure {
        id: format!("large-{k}"),
        title: format!("Signal {k}"),
        caption: "Three curves of 10 000 samples.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear("value", "N"),
        series: roles()
            .into_iter()
            .enumerate()
            .map(|(j, (name, role))| {
                let phase = (3 * k + j) as f64;
                let x = clock(10_000, 0.01);
                let y = x
                    .iter()
                    .map(|t| (0.7 * t + phase).sin() + 0.3 * (9.0 * t * phase).sin());
                Series::line(name, role, x.clone(), y.collect())
            })
            .collect(),
    };
    Report {
        title: "Ten large plots".into(),
        figures: (0..10).map(figure).collect(),
        ..Report::default()
    }
}

/// Values that cannot be placed, and names that are not valid.
fn hostile() -> Report {
    let evil = "</script><img src=x onerror=alert(1)>";
    let odd = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        0.0,
        -1.0,
        f64::MAX,
        f64::MIN_POSITIVE,
        3.0,
    ];
    let x = || clock(odd.len(), 1.0);
    let line = |x: Vec<f64>, y: &[f64]| Series::line(evil, Role::Lnn, x, y.to_vec());
    let mut band = Series::spread("band", Role::Truth, x(), &[odd.to_vec()]);
    band.y_low.truncate(2);
    let all: Vec<Vec<Series>> = vec![
        vec![line(x(), &odd), band],
        vec![line(odd.to_vec(), &odd)],
        vec![Series::points(evil, Role::Other(9), odd.to_vec(), x())],
        vec![line(vec![1.0], &[2.0])],
        vec![line(vec![0.0, 1.0, 2.0], &[1.0])],
        vec![line(vec![5.0; 4], &[7.0; 4])],
        vec![line(
            clock(5, 1e-300),
            &[1e-308, 2e-308, 0.0, 1e300, -1e300],
        )],
        vec![line(clock(3, 1.0), &[1e15, 1e15 + 1.0, 1e15 + 2.0])],
    ];
    let axes = [Axis::linear(evil, evil), Axis::log(evil, evil)];
    let figures = axes.iter().flat_map(|y| {
        all.iter().enumerate().map(|(k, series)| Figure {
            id: format!("odd-{k}"),
            title: evil.into(),
            caption: evil.into(),
            x: Axis::linear(evil, ""),
            y: y.clone(),
            series: series.clone(),
        })
    });
    Report {
        title: evil.into(),
        figures: figures.collect(),
        ..Report::default()
    }
}

fn roles() -> [(&'static str, Role); 3] {
    [
        ("Truth", Role::Truth),
        ("Lagrangian network", Role::Lnn),
        ("Plain network", Role::Baseline),
    ]
}

fn clock(samples: usize, step: f64) -> Vec<f64> {
    (0..samples).map(|k| k as f64 * step).collect()
}

/// sin t, and two predictions that diverge from it, at 100 Hz for 10 s.
fn sine(quantity: &str, size: f64) -> Figure {
    let predicted = |(name, role), drift: f64| {
        let t = clock(1001, 0.01);
        let y = t.iter().map(|t| size * t.sin() + drift * t).collect();
        Series::line(name, role, t, y)
    };
    let [truth, lnn, plain] = roles();
    Figure {
        id: quantity.replace(' ', "-"),
        title: format!("{quantity} over time"),
        caption: "The whole motion. Predicted from the first state alone; where the motion is chaotic, any prediction parts from it in the end.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear(quantity, "rad"),
        series: vec![predicted(truth, 0.0), predicted(lnn, 0.01), predicted(plain, 0.05)],
    }
}

fn losses() -> Figure {
    let steps = clock(200, 10.0);
    let fall = |rate: f64| steps.iter().map(|k| (-rate * k).exp()).collect();
    loss_curves(
        "step",
        "",
        vec![
            Series::line("Lagrangian, training", Role::Lnn, steps.clone(), fall(0.01)),
            Series::line(
                "Lagrangian, validation",
                Role::Other(1),
                steps.clone(),
                fall(0.008),
            ),
        ],
    )
}

fn energy_errors() -> Figure {
    let t = clock(2001, 0.05);
    let error = |rate: f64| t.iter().map(|t| rate * t).collect();
    energy_error_over_time(vec![
        Series::line("Lagrangian network", Role::Lnn, t.clone(), error(1e-7)),
        Series::line("Plain network", Role::Baseline, t.clone(), error(1e-3)),
    ])
}

fn ellipse() -> Figure {
    let turn = clock(401, TAU / 400.0);
    let x = turn.iter().map(|a| 2.0 * a.cos()).collect();
    let y = turn.iter().map(|a| a.sin()).collect();
    Figure {
        id: "phase".into(),
        title: "Phase portrait".into(),
        caption: "Velocity over position.".into(),
        x: Axis::linear("angle", "rad"),
        y: Axis::linear("velocity", "rad/s"),
        series: vec![Series::line("Truth", Role::Truth, x, y)],
    }
}

fn cloud() -> Figure {
    let x: Vec<f64> = (0..400).map(|k| f64::from((k * 37) % 400) * 0.01).collect();
    let y = x.iter().map(|x| x + 0.05 * (40.0 * x).sin()).collect();
    let points = Series::points("Lagrangian network", Role::Lnn, x, y);
    parity("torque", "N·m", vec![points])
}

fn band() -> Figure {
    let t = clock(301, 0.02);
    let runs: Vec<Vec<f64>> = [0.9, 1.0, 1.1]
        .map(|size| t.iter().map(|t| size * t.cos()).collect())
        .to_vec();
    Figure {
        id: "band".into(),
        title: "A band".into(),
        caption: String::new(),
        x: Axis::linear("time", "s"),
        y: Axis::linear("force", "N"),
        series: vec![Series::range("predicted", Role::Lnn, t, &runs)],
    }
}

/// An inertia between ranges that no data cover, with ends between ticks.
fn shaded() -> Figure {
    let at: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.04 - 2.0).collect();
    let own = Along {
        learned: at.iter().map(|x| 2.0 + 1.9 * x.cos()).collect(),
        ..Along::default()
    };
    let sweep = Sweep {
        at,
        data: (-1.0, 1.2),
        quantities: vec![own],
    };
    let axes = [
        Axis::linear("angle", "rad"),
        Axis::linear("inertia", "kg·m²"),
    ];
    sweep.figure(
        "shaded",
        "Inertia along the angle".into(),
        String::new(),
        axes,
    )
}

fn categories() -> Figure {
    let names = ["pendulum", "cart-pole", "arm"].map(String::from).to_vec();
    Figure {
        id: "categories".into(),
        title: "Errors of three systems".into(),
        caption: "One dot a seed.".into(),
        x: Axis::of_names("system", names),
        y: Axis::log("error", "%"),
        series: vec![Series::points(
            "error",
            Role::Other(2),
            vec![0.0, 0.0, 1.0, 1.0, 2.0],
            vec![0.1, 0.2, 3.0, 4.0, 50.0],
        )],
    }
}

fn nothing() -> Figure {
    Figure {
        id: "nothing".into(),
        title: "Nothing".into(),
        caption: "No value is positive.".into(),
        x: Axis::log("step", ""),
        y: Axis::log("error", "%"),
        series: vec![Series::line("none", Role::Lnn, vec![0.0], vec![1.0])],
    }
}

/// Seven parts and the measured torque, at 200 Hz.
fn torque(joint: i32) -> Figure {
    let t = clock(800, 0.005);
    let part = |k: f64| {
        t.iter()
            .map(|t| (k * t + f64::from(joint)).sin() / k)
            .collect()
    };
    let names = ["inertial", "Coriolis", "gravity", "friction", "spring"];
    let mut series: Vec<Series> = (0u8..)
        .zip(names)
        .map(|(k, name)| Series::line(name, Role::Other(k), t.clone(), part(f64::from(k) + 1.0)))
        .collect();
    series.extend([
        Series::line("measured", Role::Truth, t.clone(), part(0.8)),
        Series::line("predicted", Role::Lnn, t.clone(), part(0.81)),
        Series::line("reference", Role::Reference, t.clone(), part(0.79)),
    ]);
    Figure {
        id: format!("torque-{joint}"),
        title: format!("Force on joint {joint}"),
        caption: "The parts add up to the prediction; inertial is the force of the acceleration."
            .into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear("force", "N·m"),
        series,
    }
}

/// Cells of column / 10 − row / 5.
fn map() -> HeatMap {
    let value = |row: u32, column: u32| f64::from(column) / 10.0 - f64::from(row) / 5.0;
    HeatMap {
        id: "field".into(),
        title: "A field over space and time".into(),
        caption: "One ink a sign.".into(),
        x: Axis::linear("place", "m").between(0.0, 2.0),
        y: Axis::linear("time", "s").between(0.0, 1.0),
        columns: 20,
        values: (0..10)
            .flat_map(|row| (0..20).map(move |column| value(row, column)))
            .collect(),
        limit: 2.0,
    }
}
