//! Writes the files of `corpus/` that a program makes: `cargo run --package fuzz --example corpus`.
//!
//! The others (layouts, settings, text with flaws) were written by hand.
#![allow(clippy::unwrap_used, reason = "it ends where something fails")]

use std::fs;
use std::io::Cursor;
use std::path::Path;

use lagrangian::FitSpec;
use lagrangian::models::FAMILIES;
use lagrangian::rigid;
use lagrangian::train::{DataFacts, Observer, Progress};
use lagrangian::{
    Checkpoint, Coordinates, Dataset, Format, Provenance, Result, Signals, Trajectory, fit,
};
use serde_json::Value;

fn main() {
    for (format, name) in Format::ALL {
        write(
            name,
            &format!("states.{name}"),
            &file(format, &motions(1, 1, 8)),
        );
        write(
            name,
            &format!("several.{name}"),
            &file(format, &motions(2, 2, 5)),
        );
    }
    let array = |shape: &str, values: usize| {
        let head = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
        let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        bytes.extend(format!("{head:<117}\n").into_bytes());
        bytes.extend((0..values).flat_map(|k| (k as f64).sin().to_le_bytes()));
        bytes
    };
    write("npy", "column.npy", &array("(8, 1)", 8));
    write("npy", "columns.npy", &array("(8, 2)", 16));
    write("npy", "flat.npy", &array("(8,)", 8));
    for name in rigid::EXAMPLES {
        write(
            "urdf",
            &format!("{name}.urdf"),
            rigid::example(name).unwrap().as_bytes(),
        );
    }
    models();
}

fn write(target: &str, name: &str, bytes: &[u8]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("corpus")
        .join(target);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(name), bytes).unwrap();
}

fn file(format: Format, motions: &[Trajectory]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    format.write(&mut file, motions).unwrap();
    file.into_inner()
}

/// Motions of `n` coordinates with all signals.
fn motions(count: usize, n: usize, rows: usize) -> Vec<Trajectory> {
    let motion = |m: usize| {
        let t: Vec<f64> = (0..rows).map(|k| 0.1 * k as f64).collect();
        let wave = |phase: f64| -> Vec<f64> {
            let angle = |k: usize| (k / n) as f64 * 0.1 * (1 + k % n) as f64 + phase + m as f64;
            (0..rows * n).map(|k| angle(k).sin()).collect()
        };
        let signals = Signals {
            q: wave(0.0),
            qd: wave(1.5),
            qdd: wave(3.1),
            tau: wave(0.7),
            ..Signals::default()
        };
        Trajectory::new(format!("swing {m}"), t, signals)
    };
    (0..count).map(motion).collect()
}

/// Keeps the first checkpoint.
#[derive(Default)]
struct First(Option<Checkpoint>);

impl Observer for First {
    fn progress(&mut self, _: &Progress) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<()> {
        self.0.get_or_insert_with(|| checkpoint.clone());
        Ok(())
    }
}

/// A small model of each family that can be fitted to a few samples, and a checkpoint.
fn models() {
    let mut fits = toml::Table::new();
    for entry in FAMILIES {
        let mut request = FitSpec::of(entry.name);
        if entry.settings.iter().any(|setting| setting.name == "width") {
            request.settings.insert("width".into(), 3.into());
        }
        request.steps = Some(2);
        let known = DataFacts {
            forced: true,
            ..DataFacts::default()
        };
        let config = request.choose(&known).unwrap().config;
        let settings = without_nulls(serde_json::to_value(&config).unwrap());
        fits.insert(entry.name.into(), toml::Value::try_from(settings).unwrap());
        let motions = motions(2, 1, 40);
        let wide = Dataset::new(Coordinates::angles(1), &motions, &motions).unwrap();
        let fitted = fit(fuzz::dataset(), &config, None, &mut ());
        match fitted.or_else(|_| fit(&wide, &config, None, &mut ())) {
            Ok(fit) => {
                let saved = fit.model.save(Provenance::of_seed(1)).unwrap();
                let name = format!("{}.safetensors", entry.name);
                write("model", &name, &saved.to_bytes().unwrap());
            }
            Err(error) => eprintln!("{}: {error}", entry.name),
        }
    }
    let record = serde_json::json!({ "resolved": { "fit": fits } });
    write(
        "settings",
        "resolved.toml",
        toml::to_string(&record).unwrap().as_bytes(),
    );
    let mut first = First::default();
    fit(fuzz::dataset(), &fuzz::resumed(), None, &mut first).unwrap();
    let bytes = first.0.unwrap().to_bytes().unwrap();
    write("checkpoint", "adam.safetensors", &bytes);
}

/// What TOML can hold.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(entries) => {
            let entries = entries.into_iter().filter(|(_, value)| !value.is_null());
            entries
                .map(|(key, value)| (key, without_nulls(value)))
                .collect()
        }
        value => value,
    }
}
