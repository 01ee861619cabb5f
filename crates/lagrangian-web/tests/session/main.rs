//! The requests of the page, served natively: it shows exactly the results of the library.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod asking;
mod hostile;
mod report;

use lagrangian::{Learned, Model, SavedModel};
use lagrangian_web::Session;
use lagrangian_web::exports::reply;
use serde_json::{Value, json};

use asking::{advance, ask, file, give, refused};

fn pendulum() -> Value {
    json!({ "name": "pendulum", "parameters": { "length": 1.0 } })
}

/// Ten motions of a pendulum, as recorded by the page, and a fit of `steps` steps.
fn started(steps: usize) -> Session {
    let mut session = Session::default();
    let recorded = json!({ "ask": "experiment", "of": pendulum(), "motions": 10, "duration": 4, "interval": 0.02 });
    assert_eq!(ask(&mut session, &recorded)["samples"], 2010);
    let fit = json!({ "ask": "start", "fit": { "family": "lnn", "settings": { "width": 16 }, "steps": steps } });
    assert!(ask(&mut session, &fit)["samples"].as_u64().unwrap() > 1000);
    session
}

#[test]
fn a_fit_in_slices_is_the_same_to_the_bit_as_a_fit_at_once() {
    let (mut sliced, mut whole) = (started(12), started(12));
    assert_eq!(advance(&mut sliced, 0.0), 12);
    advance(&mut whole, 1000.0);
    let (sliced, whole) = (file(&mut sliced, "save"), file(&mut whole, "save"));
    assert_eq!(sliced, whole);
    let model = Learned::load(&SavedModel::from_bytes(&whole).unwrap()).unwrap();
    assert!(model.coordinates().is_circle(0));
}

#[test]
fn the_page_and_this_machine_learn_the_same_pendulum() {
    let kept: Value =
        serde_json::from_str(include_str!("../../../../tests/browser/lab/native.json")).unwrap();
    let mut session = started(60);
    advance(&mut session, 1000.0);
    let test = json!({ "ask": "energy", "of": pendulum(), "starts": 10, "duration": 100, "reference": 19.6, "seed": 1 });
    let (own, kept) = (
        ask(&mut session, &test)["mean"].as_f64(),
        kept["percent"].as_f64(),
    );
    let ratio = own.unwrap() / kept.unwrap();
    assert!(
        (0.8..1.25).contains(&ratio),
        "{own:?} where {kept:?} was kept"
    );
}

#[test]
fn a_table_with_decimal_commas_and_degrees_becomes_radians() {
    let mut session = Session::default();
    let row =
        |k: u32| format!("{};{}\n", f64::from(k) / 50.0, 90.0 - f64::from(k)).replace('.', ",");
    let table: String = (0..100).map(row).collect();
    let table = format!("mass A\nt;angle\n{table}");
    let inspect = json!({ "ask": "inspect", "name": "swing.csv" });
    let seen = give(&mut session, &inspect, table.as_bytes()).unwrap();
    assert_eq!(seen["notes"].as_array().unwrap().len(), 2);
    assert_eq!(seen["coordinates"], json!(["angle"]));
    let read =
        json!({ "ask": "read", "t": "t", "q": ["angle"], "angles": ["angle"], "degrees": true });
    let summary = ask(&mut session, &read);
    assert!((summary["q"][0].as_f64().unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!(summary["samples"], 100);
}

#[test]
fn files_that_join_become_the_motions_of_one_data_set() {
    let mut session = Session::default();
    let table = |shift: u32| {
        let row = |k: u32| format!("{},{}\n", f64::from(k) / 50.0, f64::from(k + shift));
        "t,q1\n".to_string() + &(0..30).map(row).collect::<String>()
    };
    let inspect =
        |name: &str, joins: bool| json!({ "ask": "inspect", "name": name, "joins": joins });
    let read = json!({ "ask": "read", "t": "t", "q": ["q1"] });
    for (name, joins) in [("a.csv", false), ("b.csv", true), ("c.csv", true)] {
        give(&mut session, &inspect(name, joins), table(7).as_bytes()).unwrap();
    }
    let summary = ask(&mut session, &read);
    assert_eq!(
        (&summary["recordings"], &summary["samples"]),
        (&json!(3), &json!(90))
    );
    give(
        &mut session,
        &inspect("other.csv", true),
        b"t,x\n0,1\n1,2\n",
    )
    .unwrap();
    assert!(refused(&mut session, &read).contains("q1"));
    give(&mut session, &inspect("d.csv", false), table(0).as_bytes()).unwrap();
    assert_eq!(ask(&mut session, &read)["recordings"], json!(1));
}

#[test]
fn every_wrong_request_is_an_answer_that_says_what_to_do() {
    let mut session = Session::default();
    let state =
        json!({ "ask": "simulate", "by": { "system": "pendulum" }, "q0": [1.0], "qd0": [0.0] });
    let with = |changes: Value| {
        let mut request = state.clone();
        let own = request.as_object_mut().unwrap();
        own.insert("duration".into(), json!(1.0));
        own.extend(changes.as_object().unwrap().clone());
        request
    };
    for (request, remedy) in [
        (json!({ "ask": "fly" }), "load the page again"),
        (
            with(json!({ "by": { "system": "pendlum" } })),
            "choose one of",
        ),
        (with(json!({ "q0": [1.0, 2.0] })), "give"),
        (with(json!({ "duration": 1e300 })), "shorter"),
        (with(json!({ "interval": 0.0 })), "shorter"),
        (with(json!({ "by": "fitted" })), "start one first"),
        (with(json!({ "by": "loaded" })), "drop the file"),
        (json!({ "ask": "check" }), "drop a file"),
        (
            json!({ "ask": "advance", "milliseconds": 1 }),
            "start one first",
        ),
        (
            json!({ "ask": "start", "fit": { "family": "lnn" } }),
            "drop a file",
        ),
        (
            json!({ "ask": "states", "of": pendulum(), "samples": 1_000_000_000 }),
            "fewer",
        ),
        (
            json!({ "ask": "experiment", "of": pendulum(), "motions": 1000, "duration": 1e6, "interval": 1e-6 }),
            "fewer",
        ),
    ] {
        let message = refused(&mut session, &request);
        assert!(message.contains(remedy), "{request}: {message}");
    }
    let wide =
        json!({ "ask": "start", "fit": { "family": "lnn", "settings": { "width": 100_000 } } });
    assert!(refused(&mut started(1), &wide).contains("narrower"));
    for bytes in [&b"\0\0\0\0\0\0\0\0"[..], b"", &[255; 64]] {
        assert!(give(&mut session, &json!({ "ask": "load" }), bytes).is_err());
    }
}

#[test]
fn a_message_that_is_cut_off_is_an_answer_too() {
    let mut session = Session::default();
    for message in [
        &[][..],
        &[1, 0, 0],
        &[255, 255, 255, 255, b'{'],
        &[1, 0, 0, 0, 0xff],
    ] {
        let answer = reply(&mut session, message);
        assert!(String::from_utf8_lossy(&answer).contains(r#"{"error":"#));
    }
}

#[test]
fn files_of_other_programs_have_the_columns_that_the_command_reads() {
    use lagrangian::{Format, Layout, Signals};
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../lagrangian-recordings/tests/exports"
    );
    for (file, t, q) in [
        ("tracker_one_mass.csv", "t", "x"),
        ("tracker_two_masses.txt", "t", "mass B: x"),
        (
            "phyphox_decimal_comma.csv",
            "Time (s)",
            "Tilt up/down (deg)",
        ),
        ("spreadsheet_utf16.txt", "Zeit (s)", "Winkel (°)"),
        ("spreadsheet_latin1.csv", "Zeit (s)", "Winkel (°)"),
        ("logger_pro.txt", "Time (ms)", "Position (cm)"),
        ("labview.lvm", "X_Value (s)", "Angle (deg)"),
        ("ur_rtde.csv", "timestamp", "actual_q_0"),
    ] {
        let bytes = std::fs::read(format!("{folder}/{file}")).unwrap();
        let mut session = Session::default();
        let inspect = json!({ "ask": "inspect", "name": file });
        let seen = give(&mut session, &inspect, &bytes).unwrap();
        assert_eq!(seen["time"], t, "{file}");
        assert!(seen["headers"].as_array().unwrap().contains(&json!(q)));
        let summary = ask(&mut session, &json!({ "ask": "read", "t": t, "q": [q] }));
        let layout = Layout {
            t: Some(t.into()),
            columns: Signals {
                q: vec![q.into()],
                ..Signals::default()
            },
            ..Layout::default()
        };
        let own = Format::Csv.read(std::io::Cursor::new(bytes), "file", &layout);
        let own = own.unwrap().recordings.remove(0);
        assert_eq!(summary["q"], json!(own.q), "{file}");
        assert_eq!(summary["t"], json!(own.t), "{file}");
    }
}
