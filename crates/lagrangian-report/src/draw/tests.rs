#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod demo;

use std::path::PathBuf;

use lagrangian::{Signals, Trajectory};

use lagrangian::score::{Grade, Judgement};

use super::*;
use crate::{
    Animation, Axis, Command, Figure, Heading, HeatMap, Panel, Report, Role, Series, Table,
};
use demo::{demo, headline, swing};

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
    let names = page.matches("https://").count();
    assert!(names == 1 && page.contains("/*! https://github.com/leeoniya/uPlot"));
    assert!(!page.contains("http://") && !page.contains("@import"));
    // What the library of plots names is never loaded: the policy of the page forbids it.
    assert!(!page.contains(" src=") && !page.contains("url("));
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
        maps: vec![HeatMap {
            id: words(),
            title: words(),
            caption: words(),
            x: Axis::linear(evil, evil).between(0.0, 1.0),
            y: Axis::linear(evil, evil).between(0.0, 1.0),
            columns: 2,
            values: vec![1.0, -0.4],
            limit: 1.0,
        }],
        title: words(),
        subtitle: words(),
        answer: words(),
        headings: vec![Heading {
            text: words(),
            figures: 1,
        }],
        headlines: vec![headline(evil, evil, evil, evil, None)],
        summary: vec![words()],
        animations: vec![Animation {
            id: words(),
            title: words(),
            caption: words(),
            panels: vec![Panel::chain(
                evil,
                Role::Truth,
                &[1.0, 1.0],
                &swing(0.0, 1),
                None,
            )],
            ..Animation::default()
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
            judgements: vec![Some(Judgement {
                grade: Grade::Fair,
                why: words(),
            })],
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
fn sections_are_listed_and_fold_and_the_answer_comes_first() {
    let figure = |k: usize| Figure {
        id: format!("f{k}"),
        series: vec![Series::line("a", Role::Lnn, vec![0.0, 1.0], vec![0.0, 1.0])],
        ..Figure::default()
    };
    let mut report = Report {
        answer: "Good: it is.".into(),
        headlines: vec![headline("Error", "1", "%", "", None)],
        tables: [12, 13].map(table_of).to_vec(),
        ..Report::default()
    };
    report.add_figures("Motion", (0..2).map(figure));
    report.add_figures("Nothing", []);
    report.add_figures("Training", (2..3).map(figure));
    report.figures.push(figure(3));
    let page = html(&report);
    let at = |words: &str| page.find(words).unwrap_or_else(|| panic!("{words}"));
    assert!(at("Good: it is.") < at("class=\"cards\""));
    let links = "<li><a href=\"#section-motion\">Motion</a></li><li><a href=\"#section-training\">Training</a></li>\
                 <li><a href=\"#section-figures\">Figures</a></li><li><a href=\"#section-tables\">Tables</a></li>";
    assert!(at(links) < at("id=\"section-motion\" open"));
    let order = [
        "section-motion\" open",
        "figure-f1",
        "section-training\" open",
        "figure-f2",
        "section-figures\" open",
        "figure-f3",
    ];
    assert!(order.windows(2).all(|pair| at(pair[0]) < at(pair[1])));
    // A table of more than 12 rows is folded.
    assert!(page.contains("<summary>13 rows</summary>") && !page.contains("12 rows"));
    // Of many figures the first section is shown.
    report.add_figures("Many", (4..30).map(figure));
    let page = html(&report);
    assert!(
        page.contains("id=\"section-motion\" open") && page.contains("id=\"section-training\">")
    );
}

fn table_of(rows: usize) -> Table {
    Table::new("t", &["a"], vec![vec!["1".into()]; rows])
}

#[test]
fn missing_and_infinite_values_leave_gaps_and_break_nothing() {
    let report = Report {
        figures: empty_and_broken(),
        ..Report::default()
    };
    let page = html(&report);
    let (drawn, script) = page.split_once("id=\"plots\"").unwrap();
    assert!(!drawn.contains("NaN") && !drawn.contains("inf ") && !script.is_empty());
    assert_eq!(page.matches("There is nothing to draw").count(), 4);
    let live = report.figures.len() - 4;
    assert_eq!(page.matches(" data-plot=").count(), live);
    for figure in &report.figures[..4] {
        let file = svg(figure).unwrap();
        assert!(file.contains("no finite data"), "{}", figure.id);
    }
    for figure in &report.figures {
        let file = svg(figure).unwrap();
        assert!(file.ends_with("</svg>\n") && !file.contains("NaN"));
        png(figure, std::io::sink()).unwrap();
    }
}

#[test]
fn a_page_of_ten_plots_of_ten_thousand_points_stays_below_two_megabytes() {
    let t: Vec<f64> = (0..10_000).map(|k| f64::from(k) * 0.01).collect();
    let noise = |k: usize, seed: usize| ((k * 7919 + seed * 104_729) % 1009) as f64 / 1009.0;
    let line = |seed: usize, name: &str, role: Role| {
        let y = t.iter().enumerate();
        let y = y.map(|(k, t)| (t + seed as f64).sin() + 0.1 * noise(k, seed));
        Series::line(name, role, t.clone(), y.collect())
    };
    let roles = [("a", Role::Truth), ("b", Role::Lnn), ("c", Role::Baseline)];
    let figure = |k: usize| Figure {
        id: format!("f{k}"),
        x: Axis::linear("time", "s"),
        series: (0..3)
            .map(|j| line(3 * k + j, roles[j].0, roles[j].1))
            .collect(),
        ..Figure::default()
    };
    let page = |count: usize| {
        html(&Report {
            figures: (0..count).map(figure).collect(),
            ..Report::default()
        })
    };
    assert!(page(10).len() < 2_000_000, "{} bytes", page(10).len());
    let many = page(40);
    let data = many.split("id=\"plots\">").nth(1).unwrap();
    let data = data.split("</script>").next().unwrap();
    assert!(data.len() < 1_500_000, "{} bytes of data", data.len());
}

#[test]
fn the_reference_is_drawn_on_top_and_a_value_without_neighbours_is_a_dot() {
    let line = |name: &str, role, y| Series::line(name, role, vec![0.0, 1.0], y);
    let figure = Figure {
        series: vec![
            line("reference", Role::Reference, vec![0.0, 1.0]),
            line("truth", Role::Truth, vec![f64::NAN, 1.0]),
            line("model", Role::Lnn, vec![0.0, 1.0]),
        ],
        ..Figure::default()
    };
    let file = svg(&figure).unwrap();
    let [dot, model, reference] =
        ["<circle", "stroke=\"#1D63D1\"", "stroke=\"#1B1F26\""].map(|words| file.find(words));
    assert!(dot.is_some() && dot < model && model < reference, "{file}");
}

#[test]
fn a_curve_that_leaves_its_axis_ends_there() {
    let figure = Figure {
        y: Axis::linear("y", "").between(0.0, 1.0),
        series: vec![Series::line(
            "runs away",
            Role::Baseline,
            (0..10).map(f64::from).collect(),
            (0..10).map(|k| 0.5 * f64::from(k)).collect(),
        )],
        ..Figure::default()
    };
    let file = svg(&figure).unwrap();
    let line = file.split("stroke=\"#CE5D18\"").nth(1).unwrap();
    let points = line.split("points=\"").nth(1).unwrap();
    let points = points.split('"').next().unwrap();
    assert_eq!(points.split_whitespace().count(), 4, "{points}");
}

#[test]
fn a_column_without_a_name_has_no_heading() {
    let table = Table::new("t", &["", "a"], vec![vec!["1".into(), "2".into()]]);
    let page = html(&Report {
        tables: vec![table],
        ..Report::default()
    });
    assert!(page.contains("<tr><td></td><th scope=\"col\">a</th></tr>"));
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
        signals: Signals {
            q: vec![],
            qd: vec![],
            ..swing(0.0, 1).signals
        },
        ..swing(0.0, 1)
    };
    let panel =
        |trajectory: &Trajectory| Panel::chain("p", Role::Baseline, &[1.0, 1.0], trajectory, None);
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
fn a_figure_is_an_svg_and_a_png_of_one_size() {
    let report = demo();
    let file = svg(&report.figures[0]).unwrap();
    std::fs::write(target("report.svg"), &file).unwrap();
    assert!(file.starts_with("<svg width=\"1280\" height=\"840\""));
    assert!(file.contains("Energy error over time"));
    let mut file = Vec::new();
    png(&report.figures[0], &mut file).unwrap();
    std::fs::write(target("report.png"), &file).unwrap();
    assert_eq!(&file[..4], b"\x89PNG");
    let size = [&file[16..20], &file[20..24]].map(|bytes| bytes.to_vec());
    assert_eq!(size, [1280u32, 840].map(|side| side.to_be_bytes().to_vec()));
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
fn a_map_without_cells_or_a_limit_is_not_drawn() {
    let map = |values: Vec<f64>, limit: f64| HeatMap {
        x: Axis::linear("place", "m").between(0.0, 3.0),
        y: Axis::linear("time", "s").between(0.0, 1.0),
        columns: 3,
        values,
        limit,
        ..HeatMap::default()
    };
    let drawn = |map| {
        let page = html(&Report {
            maps: vec![map],
            ..Report::default()
        });
        page.contains("data-plot=")
    };
    assert!(drawn(map(vec![1.0, 1.0, -0.5], 1.0)));
    assert!(!drawn(map(vec![0.0; 3], 0.0)) && !drawn(map(vec![], 1.0)));
}
