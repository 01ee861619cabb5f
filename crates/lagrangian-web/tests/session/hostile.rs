//! Malicious and faulty files: each has an answer, and the session continues.

use std::fs;
use std::path::Path;

use lagrangian_web::Session;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::asking::{ask, give};

/// The longest message.
const LONGEST: usize = 3000;

/// A file of tests/browser/lab/hostile.json, which the page also receives in Chromium: a text or bytes, and rows that are repeated.
#[derive(Deserialize)]
struct Hostile {
    name: String,
    #[serde(default)]
    text: String,
    #[serde(default)]
    hex: String,
    #[serde(default)]
    row: String,
    #[serde(default)]
    repeat: usize,
}

impl Hostile {
    fn bytes(&self) -> Vec<u8> {
        let digits = self.hex.as_bytes().chunks(2);
        let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16);
        let mut bytes: Vec<u8> = digits.map(|pair| byte(pair).unwrap()).collect();
        bytes.extend(self.text.bytes());
        for k in 0..self.repeat {
            bytes.extend(self.row.replace("{k}", &k.to_string()).bytes());
        }
        bytes
    }
}

/// The answer to a request, or the few lines of its refusal.
fn answered(session: &mut Session, request: Value, bytes: &[u8]) -> Result<Value, String> {
    let answer = give(session, &request, bytes);
    if let Err(message) = &answer {
        let length = message.chars().count();
        assert!((20..LONGEST).contains(&length), "{request}: {message}");
    }
    answer
}

/// Processes a table as far as the page would: to the report of a fit.
fn as_table(session: &mut Session, name: &str, bytes: &[u8]) -> Result<(), String> {
    let inspect = json!({ "ask": "inspect", "name": name });
    let seen = answered(session, inspect, bytes)?;
    let time = seen["time"].as_str().unwrap_or("t");
    let motions = seen["headers"].as_array().unwrap();
    let motions = motions.iter().find(|header| *header == "trajectory");
    let read = json!({ "ask": "read", "t": time, "q": seen["coordinates"], "trajectory": motions });
    answered(session, read, &[])?;
    answered(session, json!({ "ask": "check" }), &[])?;
    let start = json!({ "ask": "start", "fit": { "family": "lnn", "settings": { "width": 16 }, "steps": 2 } });
    answered(session, start, &[])?;
    let advance = json!({ "ask": "advance", "milliseconds": 1000 });
    while answered(session, advance.clone(), &[])?["done"] == json!(false) {}
    for what in ["score", "report", "save"] {
        answered(session, json!({ "ask": what }), &[])?;
    }
    Ok(())
}

/// Simulates a model, if the file is one.
fn as_model(session: &mut Session, bytes: &[u8]) -> Result<(), String> {
    let loaded = answered(session, json!({ "ask": "load" }), bytes)?;
    let still = vec![0.1; loaded["coordinates"].as_array().unwrap().len()];
    let simulate = json!({
        "ask": "simulate", "by": "loaded", "q0": still, "qd0": still, "duration": 1.0, "interval": 0.02,
    });
    answered(session, simulate, &[]).map(drop)
}

fn is_model(name: &str) -> bool {
    name.ends_with(".safetensors")
}

fn taken(session: &mut Session, name: &str, bytes: &[u8]) -> Result<(), String> {
    match is_model(name) {
        true => as_model(session, bytes),
        false => as_table(session, name, bytes),
    }
}

/// Asserts that the session still serves requests.
fn assert_serves(session: &mut Session) {
    let asked = json!({ "ask": "simulate", "by": { "system": "pendulum" }, "q0": [1.0], "qd0": [0.0], "duration": 1.0 });
    assert!(ask(session, &asked)["t"].as_array().unwrap().len() > 10);
}

#[test]
fn every_hostile_file_is_refused_with_a_remedy_or_used() {
    let all = include_str!("../../../../tests/browser/lab/hostile.json");
    let all: Vec<Hostile> = serde_json::from_str(all).unwrap();
    let mut session = Session::default();
    for own in &all {
        let answer = taken(&mut session, &own.name, &own.bytes());
        // Only the names of the columns are unusual.
        let fine = [
            "a comma in a quoted name.csv",
            "a script.csv",
            "another script.csv",
        ];
        assert_eq!(
            answer.is_ok(),
            fine.contains(&&*own.name),
            "{}: {answer:?}",
            own.name
        );
        assert_serves(&mut session);
    }
}

#[test]
fn files_of_every_kind_whole_cut_off_and_damaged_are_answered() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
    let mut session = Session::default();
    let mut used = 0;
    for kind in fs::read_dir(corpus).unwrap() {
        for file in fs::read_dir(kind.unwrap().path()).unwrap() {
            let path = file.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap();
            let whole = fs::read(&path).unwrap();
            used += usize::from(taken(&mut session, name, &whole).is_ok());
            for k in 1..8 {
                let at = k * whole.len() / 8;
                let _ = taken(&mut session, name, &whole[..at]);
                let mut damaged = whole.clone();
                damaged[at] ^= 0x55;
                let _ = taken(&mut session, name, &damaged);
            }
            // The file is used as the other kind of file.
            let _ = as_table(&mut session, name, &whole);
            let _ = as_model(&mut session, &whole);
            assert_serves(&mut session);
        }
    }
    assert!(used >= 6, "{used} whole files were used");
}

#[test]
fn forces_that_are_no_numbers_are_named_with_their_motion() {
    let mut session = Session::default();
    let of = json!({ "name": "pendulum" });
    let recorded =
        json!({ "ask": "experiment", "of": of, "motions": 5, "duration": 2, "interval": 0.02 });
    ask(&mut session, &recorded);
    let table = crate::asking::file(&mut session, "data");
    let table = String::from_utf8(table).unwrap();
    for (from, cell, motion) in [(0, "1e308", "'1'"), (0, "nan", "'1'"), (250, "inf", "'3'")] {
        let row = |(k, line): (usize, &str)| match k {
            0 => format!("{line},tau1\n"),
            _ if k > from => format!("{line},{cell}\n"),
            _ => format!("{line},0.1\n"),
        };
        let bad: String = table.lines().enumerate().map(row).collect();
        let inspect = json!({ "ask": "inspect", "name": "forces.csv" });
        give(&mut session, &inspect, bad.as_bytes()).unwrap();
        let read = json!({ "ask": "read", "t": "t", "q": ["q1"], "tau": ["tau1"], "angles": ["q1"], "trajectory": "trajectory" });
        ask(&mut session, &read);
        assert_eq!(
            ask(&mut session, &json!({ "ask": "check" }))["verdict"],
            "fail"
        );
        let start = json!({ "ask": "start", "fit": { "family": "lnn", "steps": 1 } });
        let message = give(&mut session, &start, &[]).unwrap_err();
        assert!(message.contains(motion), "{cell}: {message}");
    }
}
