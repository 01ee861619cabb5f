//! The report of a fit in the page is the page of a run, made by the code of the command.

use std::io::Cursor;
use std::path::Path;

use lagrangian::{FitSpec, Format, Layout, RolloutOptions};
use lagrangian_report::Command;
use lagrangian_run::{
    Data, ExistingRun, Figures, Frontend, PreparedFit, REPORT, RunFolder, RunRecord, RunTarget,
    Tensorboard,
};
use lagrangian_web::Session;
use serde_json::json;

use crate::asking::{advance, ask, file, give, refused};

/// A table of a double pendulum that swings.
fn table() -> Vec<u8> {
    let mut session = Session::default();
    let of = json!({ "name": "double-pendulum" });
    let recorded = json!({ "ask": "experiment", "of": of, "motions": 8, "duration": 2, "interval": 0.02, "seed": 7 });
    ask(&mut session, &recorded);
    file(&mut session, "data")
}

/// The page of a fit of `steps` steps to the table.
fn report(steps: usize) -> String {
    let mut session = Session::default();
    let inspect = json!({ "ask": "inspect", "name": "my swing.csv" });
    give(&mut session, &inspect, &table()).unwrap();
    let read = json!({
        "ask": "read", "t": "t", "q": ["q1", "q2"], "qd": ["qd1", "qd2"], "angles": ["q1", "q2"], "trajectory": "trajectory",
    });
    ask(&mut session, &read);
    let start = json!({
        "ask": "start", "fit": { "family": "lnn", "settings": { "width": 8 }, "steps": steps }, "started": 1_735_689_600_000_u64,
    });
    ask(&mut session, &start);
    advance(&mut session, 1000.0);
    ask(&mut session, &json!({ "ask": "score" }));
    String::from_utf8(file(&mut session, "report")).unwrap()
}

struct Words;

impl Frontend for Words {
    fn words(&self, text: &str) -> String {
        text.replace('`', "")
    }

    fn commands(&self, _: &Path, _: &RunRecord) -> Vec<Command> {
        Vec::new()
    }
}

/// The page in a run folder after the same fit.
fn of_a_folder(steps: usize) -> String {
    let layout = Layout {
        angles: vec!["q1".into(), "q2".into()],
        trajectory: Some("trajectory".into()),
        ..Layout::default()
    };
    let readings = Format::Csv.read(Cursor::new(table()), "my swing", &layout);
    let data = Data {
        training: readings.unwrap().recordings,
        layout: layout.to_toml().unwrap(),
        ..Data::default()
    };
    let settings = json!({ "width": 8 });
    let spec = FitSpec {
        family: Some("lnn".into()),
        settings: settings.as_object().unwrap().clone(),
        steps: Some(steps),
        ..FitSpec::default()
    };
    let place = tempfile::tempdir().unwrap();
    let folder = RunFolder::open(place.path(), ExistingRun::Refuse).unwrap();
    let place = RunTarget {
        folder: &folder,
        frontend: &Words,
        command: String::new(),
        settings: json!({}),
        tensorboard: Tensorboard::Omitted,
        figures: Figures::Omitted,
    };
    let kept = PreparedFit::new(spec, data)
        .unwrap()
        .fit(Some(&place), &mut ());
    let fitted = kept.unwrap().ended(None);
    let options = RolloutOptions::for_comparison();
    fitted.assessed(Some(&place), &options).unwrap();
    std::fs::read_to_string(folder.file(REPORT)).unwrap()
}

/// All texts between these words of a page.
fn between<'a>(page: &'a str, begin: &str, end: &str) -> Vec<&'a str> {
    let parts = page.split(begin).skip(1);
    parts.map(|part| part.split(end).next().unwrap()).collect()
}

#[test]
fn the_report_of_a_fit_is_the_page_of_a_run_of_the_same_fit() {
    let (own, kept) = (report(12), of_a_folder(12));
    for (begin, end, least) in [
        ("<h3>", "</h3>", 12),
        ("<span class=\"value\">", "</li>", 4),
        ("<p class=\"caption\">", "</p>", 12),
    ] {
        let (own, kept) = (between(&own, begin, end), between(&kept, begin, end));
        assert!(own.len() >= least, "{begin} {own:?}");
        assert_eq!(own, kept);
    }
    assert!(own.contains("Energy at rest, learned") && own.contains("id=\"plots\""));
}

#[test]
fn the_report_says_what_it_was_made_of() {
    let page = report(2);
    let hash = lagrangian_run::FileHash::of(&table()).sha256;
    assert!(page.contains(&format!("my swing.csv (SHA-256 {}…)", &hash[..12])));
    assert!(page.contains("2025-01-01 00:00 UTC"));
    assert!(page.contains("lagrangian score &#39;my swing.safetensors&#39; other.csv"));
    for setting in ["width", "angles", "steps"] {
        assert!(page.contains(&format!(">{setting}<")), "{setting}");
    }
}

#[test]
fn a_report_of_nothing_says_what_to_do_first() {
    let mut session = Session::default();
    let asked = json!({ "ask": "report" });
    assert!(refused(&mut session, &asked).contains("start one first"));
    let states = json!({ "ask": "states", "of": { "name": "pendulum" }, "samples": 500 });
    ask(&mut session, &states);
    ask(
        &mut session,
        &json!({ "ask": "start", "fit": { "family": "lnn", "settings": { "width": 8 }, "steps": 1 } }),
    );
    assert!(refused(&mut session, &asked).contains("fit recordings"));
}
