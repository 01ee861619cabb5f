#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::PI;
use std::path::PathBuf;

use lagrangian::report::{
    Animation, Axis, Command, Curve, Figure, Headline, Motion, Pairs, Panel, Report, Role, Series,
    Table, energy_error_over_time, loss_curves, parity, phase_portrait, trajectories,
};
use lagrangian::{Coordinates, Trajectory};

use super::*;

/// Something that swings like a double pendulum, 100 s at 100 Hz; `drift` makes it wrong more and more.
fn swing(drift: f64, seconds: usize) -> Trajectory {
    let t: Vec<f64> = (0..=100 * seconds).map(|k| k as f64 * 0.01).collect();
    let angle = |t: f64| {
        let wrong = drift * t * t;
        let first = 1.9 * (2.1 * t + wrong).sin() + 0.5 * (5.3 * t).sin();
        let second = 2.2 * (2.1 * t + 0.4 - wrong).sin() - 1.1 * (5.3 * t + wrong).sin()
            + 0.9 * t * (drift > 0.0) as u8 as f64;
        [first, second]
    };
    let q = t.iter().flat_map(|t| angle(*t)).collect();
    let rate = |t: f64| {
        let (ahead, behind) = (angle(t + 1e-4), angle(t - 1e-4));
        [0, 1].map(|i| (ahead[i] - behind[i]) / 2e-4)
    };
    let qd = t.iter().flat_map(|t| rate(*t)).collect();
    Trajectory {
        name: "swing".into(),
        t,
        q,
        qd,
        qdd: None,
        tau: None,
    }
}

fn energy_error(t: &[f64], level: f64, growth: f64) -> Vec<f64> {
    t.iter()
        .map(|t| level * (0.2 + (3.0 * t).sin().powi(2)) * (1.0 + growth * t) * t.min(0.5))
        .collect()
}

fn demo() -> Report {
    let (truth, lnn, network) = (swing(0.0, 100), swing(2e-5, 100), swing(4e-3, 72));
    let motions = [
        Motion {
            name: "Truth",
            role: Role::Truth,
            trajectory: &truth,
        },
        Motion {
            name: "Lagrangian network",
            role: Role::Lnn,
            trajectory: &lnn,
        },
        Motion {
            name: "Plain network",
            role: Role::Baseline,
            trajectory: &network,
        },
    ];
    let coordinates = Coordinates::angles(2);
    let errors = [
        energy_error(&truth.t, 1e-13, 0.1),
        energy_error(&lnn.t, 4e-6, 0.002),
        energy_error(&network.t, 2e-3, 0.6),
    ];
    let panel = |k: usize| {
        let motion = &motions[k];
        Panel::new(
            motion.name,
            motion.role,
            &[1.0, 1.0],
            motion.trajectory,
            Some(errors[k].clone()),
        )
    };
    Report {
        title: "A double pendulum and what two networks made of it".into(),
        subtitle: "100 000 samples, one minute of training each, 40 starts of 100 s".into(),
        headlines: vec![
            headline("Energy error, Lagrangian", "0.0004", "%", "mean of 40 starts at 100 s", Some(Role::Lnn)),
            headline("Energy error, plain network", "11.3", "%", "same data, size and optimiser", Some(Role::Baseline)),
            headline("Valid prediction", "14.2", "Lyapunov times", "plain network 6.1, truth restarted 27.9", Some(Role::Lnn)),
            headline("Whole run", "151", "s", "2 cores", None),
        ],
        summary: vec![
            "The learned Lagrangian keeps the energy for 100 s; the plain network, trained on the same data, loses it \
             within the first swings."
                .into(),
        ],
        animations: vec![Animation {
            id: "pendulum".into(),
            title: "The same start, three times".into(),
            caption: "The pale pendulum behind a prediction is the truth. Chaos parts them in the end; the energy \
                      tells who still obeys mechanics."
                .into(),
            panels: (0..3).map(panel).collect(),
        }],
        figures: demo_figures(&motions, &errors, &coordinates),
        tables: vec![demo_table()],
        settings: [("model", "lnn, convex in q̇"), ("layers", "2 × 64"), ("optimizer", "natural gradient"), ("seed", "0")]
            .map(|(name, value)| (name.to_owned(), value.to_owned()))
            .to_vec(),
        commands: vec![
            Command { makes: "This page".into(), line: "lagrangian demo --out demo".into() },
            Command {
                makes: "The same for your own data".into(),
                line: "lagrangian fit train/*.csv --q theta1,theta2 --qd w1,w2 --angle theta1,theta2 --out run".into(),
            },
        ],
    }
}

fn headline(label: &str, value: &str, unit: &str, note: &str, role: Option<Role>) -> Headline {
    let [label, value, unit, note] = [label, value, unit, note].map(str::to_owned);
    Headline {
        label,
        value,
        unit,
        note,
        role,
    }
}

fn demo_figures(motions: &[Motion], errors: &[Vec<f64>], coordinates: &Coordinates) -> Vec<Figure> {
    let curve = |k: usize| Curve {
        name: motions[k].name,
        role: motions[k].role,
        x: &motions[k].trajectory.t,
        y: &errors[k],
    };
    let mut energy = energy_error_over_time(&[curve(0), curve(1), curve(2)]);
    let t: Vec<f64> = (0..200).map(|k| f64::from(k) * 0.5).collect();
    let runs: Vec<Vec<f64>> = (1..40)
        .map(|run| energy_error(&t, 3e-4 * f64::from(run), 0.01))
        .collect();
    energy
        .series
        .push(Series::spread("40 starts", Role::Other(0), t, &runs));
    let step: Vec<f64> = (0..400).map(f64::from).collect();
    let loss = |level: f64, bumps: f64| {
        step.iter()
            .map(|k| level * (-k / 40.0).exp() + 1e-7 * (1.0 + bumps * (k * 1.7).sin().abs()))
            .collect::<Vec<_>>()
    };
    let (train, validation, network) = (loss(1.0, 3.0), loss(1.2, 4.0), loss(40.0, 9.0));
    let named = |name, role, y| Curve {
        name,
        role,
        x: &step,
        y,
    };
    let losses = loss_curves(
        "step",
        "",
        &[
            named("Lagrangian, training", Role::Lnn, &train),
            named("Lagrangian, validation", Role::Other(1), &validation),
            named("Plain network, training", Role::Baseline, &network),
        ],
    );
    let accelerations: Vec<f64> = (0..4000)
        .map(|k| 30.0 * (f64::from(k) * 0.731).sin().powi(3))
        .collect();
    let off = |size: f64| -> Vec<f64> {
        accelerations
            .iter()
            .enumerate()
            .map(|(k, a)| a + size * (k as f64 * 1.37).sin() * (1.0 + a.abs()))
            .collect()
    };
    let (close, far) = (off(0.002), off(0.08));
    let pairs = [
        Pairs {
            name: "Plain network",
            role: Role::Baseline,
            truth: &accelerations,
            predicted: &far,
        },
        Pairs {
            name: "Lagrangian network",
            role: Role::Lnn,
            truth: &accelerations,
            predicted: &close,
        },
    ];
    vec![
        energy,
        trajectories(coordinates, 0, motions),
        trajectories(coordinates, 1, motions),
        phase_portrait(coordinates, 0, motions),
        phase_portrait(coordinates, 1, motions),
        parity("acceleration", "rad/s²", &pairs),
        losses,
    ]
}

fn demo_table() -> Table {
    let row = |cells: [&str; 5]| cells.map(str::to_owned).to_vec();
    Table {
        caption: "Figures".into(),
        header: row([
            "model",
            "energy error, mean (%)",
            "median (%)",
            "worst of 40 (%)",
            "valid time (Lyapunov)",
        ]),
        rows: vec![
            row(["Lagrangian network", "0.00041", "0.00022", "0.0019", "14.2"]),
            row(["Plain network", "11.3", "8.71", "41.0", "6.1"]),
            row([
                "Truth, restarted 1e-12 away",
                "1.2e-11",
                "9e-12",
                "4e-11",
                "27.9",
            ]),
        ],
    }
}

fn target(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../target")
        .join(name)
}

fn empty_and_broken() -> Vec<Figure> {
    let figure = |id: &str, y: Axis, series: Vec<Series>| Figure {
        id: id.into(),
        y,
        series,
        ..Figure::default()
    };
    let bad = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        0.0,
        -1.0,
        f64::MAX,
        f64::MIN_POSITIVE,
    ];
    let x: Vec<f64> = (0..bad.len()).map(|k| k as f64).collect();
    let mixed = || Series::line("mixed", Role::Lnn, x.clone(), bad.to_vec());
    let mut band = Series::spread("band", Role::Truth, x.clone(), &[bad.to_vec()]);
    band.y_low.truncate(2);
    vec![
        figure("none", Axis::linear("y", ""), vec![]),
        figure(
            "empty",
            Axis::log("y", ""),
            vec![Series::line("empty", Role::Lnn, vec![], vec![])],
        ),
        figure(
            "nan",
            Axis::linear("y", ""),
            vec![Series::points(
                "nan",
                Role::Lnn,
                vec![0.0; 3],
                vec![f64::NAN; 3],
            )],
        ),
        figure(
            "zeros",
            Axis::log("y", ""),
            vec![Series::line("zeros", Role::Lnn, x.clone(), vec![0.0; 7])],
        ),
        figure("mixed", Axis::linear("y", ""), vec![mixed()]),
        figure("mixed-log", Axis::log("y", ""), vec![mixed(), band]),
        figure(
            "one",
            Axis::linear("y", ""),
            vec![Series::points("one", Role::Other(9), vec![1.0], vec![2.0])],
        ),
        figure(
            "odd-range",
            Axis::linear("y", "").between(f64::NAN, 1.0),
            vec![mixed()],
        ),
        figure(
            "unequal",
            Axis::linear("y", ""),
            vec![Series::line(
                "u",
                Role::Truth,
                vec![1.0, 2.0, 3.0],
                vec![1.0],
            )],
        ),
    ]
}

#[test]
fn the_page_of_a_whole_run_needs_no_network_and_stays_below_two_megabytes() {
    let report = demo();
    let page = html(&report);
    std::fs::create_dir_all(target("")).unwrap();
    std::fs::write(target("report.html"), &page).unwrap();
    assert!(!page.contains("http://") && !page.contains("https://") && !page.contains("@import"));
    assert!(!page.contains("src=") && !page.contains("url("));
    assert!(page.len() < 2_000_000, "{} bytes", page.len());
    for figure in &report.figures {
        assert!(
            page.contains(&format!("id=\"figure-{}\"", figure.id)),
            "{}",
            figure.id
        );
    }
    assert!(page.contains("0.0004") && page.contains("lagrangian demo --out demo"));
}

#[test]
fn every_text_of_a_report_is_escaped() {
    let evil = "<script>alert('&\"')</script>";
    let words = || evil.to_owned();
    let report = Report {
        title: words(),
        subtitle: words(),
        headlines: vec![headline(evil, evil, evil, evil, None)],
        summary: vec![words()],
        animations: vec![Animation {
            id: words(),
            title: words(),
            caption: words(),
            panels: vec![Panel::new(
                evil,
                Role::Truth,
                &[1.0, 1.0],
                &swing(0.0, 1),
                None,
            )],
        }],
        figures: vec![Figure {
            id: words(),
            title: words(),
            caption: words(),
            x: Axis::linear(evil, evil),
            y: Axis::log(evil, evil),
            series: vec![Series::line(
                evil,
                Role::Lnn,
                vec![1.0, 2.0],
                vec![1.0, 2.0],
            )],
        }],
        tables: vec![Table {
            caption: words(),
            header: vec![words()],
            rows: vec![vec![words()]],
        }],
        settings: vec![(words(), words())],
        commands: vec![Command {
            makes: words(),
            line: words(),
        }],
    };
    let page = html(&report);
    assert!(!page.contains("<script>alert") && !page.contains("alert('"));
    assert!(!svg(&report.figures[0]).unwrap().contains("<script"));
}

#[test]
fn missing_and_infinite_values_leave_gaps_and_break_nothing() {
    let report = Report {
        figures: empty_and_broken(),
        ..Report::default()
    };
    let page = html(&report);
    assert!(!page.contains("NaN") && !page.contains("inf "));
    assert_eq!(
        page.matches("no finite data").count(),
        4 * 2 + 1,
        "four empty figures, the first in three sizes"
    );
    for figure in &report.figures {
        svg(figure).unwrap();
        png(figure, 400, 300, std::io::sink()).unwrap();
    }
}

#[test]
fn an_empty_report_is_a_page() {
    assert!(html(&Report::default()).contains("</html>"));
}

#[test]
fn a_motion_that_ended_at_once_or_lost_its_angles_is_still_played() {
    let mut lost = swing(0.0, 1);
    lost.q[51] = f64::NAN;
    let nothing = Trajectory {
        t: vec![],
        q: vec![],
        qd: vec![],
        ..swing(0.0, 1)
    };
    let panel =
        |trajectory: &Trajectory| Panel::new("p", Role::Baseline, &[1.0, 1.0], trajectory, None);
    let animation = Animation {
        panels: vec![panel(&lost), panel(&nothing)],
        ..Animation::default()
    };
    gif(&animation, std::io::sink()).unwrap();
    assert!(
        html(&Report {
            animations: vec![animation],
            ..Report::default()
        })
        .contains("null")
    );
    assert!(gif(&Animation::default(), std::io::sink()).is_err());
}

#[test]
fn an_svg_file_stands_alone_and_knows_light_and_dark() {
    let report = demo();
    let file = svg(&report.figures[0]).unwrap();
    std::fs::write(target("report.svg"), &file).unwrap();
    assert!(file.starts_with("<svg xmlns=") && file.contains("prefers-color-scheme:dark"));
    assert!(file.contains("Energy error over time") && file.contains("var(--lnn)"));
}

#[test]
fn a_png_has_the_size_that_was_asked_for_and_a_tiny_one_is_refused() {
    let report = demo();
    let mut file = Vec::new();
    png(&report.figures[0], 1280, 840, &mut file).unwrap();
    std::fs::write(target("report.png"), &file).unwrap();
    assert_eq!(&file[..4], b"\x89PNG");
    assert_eq!(
        (file[16..20].to_vec(), file[20..24].to_vec()),
        (
            1280u32.to_be_bytes().to_vec(),
            840u32.to_be_bytes().to_vec()
        )
    );
    assert!(png(&report.figures[0], 10, 10, std::io::sink()).is_err());
    assert!(png(&report.figures[0], 1 << 30, 1 << 30, std::io::sink()).is_err());
}

#[test]
fn a_gif_of_the_pendulums_loops_and_stays_small() {
    let mut file = Vec::new();
    gif(&demo().animations[0], &mut file).unwrap();
    std::fs::write(target("report.gif"), &file).unwrap();
    assert_eq!(&file[..6], b"GIF89a");
    assert!(file.len() < 6_000_000, "{} bytes", file.len());
}

#[test]
fn a_full_circle_is_drawn_round() {
    let turn: Vec<f64> = (0..=100).map(|k| f64::from(k) * 0.02 * PI).collect();
    let circle = Series::line(
        "circle",
        Role::Lnn,
        turn.iter().map(|a| a.cos()).collect(),
        turn.iter().map(|a| a.sin()).collect(),
    );
    let file = svg(&Figure {
        series: vec![circle],
        ..Figure::default()
    })
    .unwrap();
    let path = file.split("<path class=\"l lnn\"").last().unwrap();
    assert!(
        path.matches('l').count() > 40,
        "a circle that is simplified keeps its corners below a quarter px"
    );
}
