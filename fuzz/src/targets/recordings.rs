//! Files of motions, in each format.

use std::io::{Cursor, Write};

use lagrangian::trajectory::{
    Readings,
    csv::{coordinates, look, time},
};
use lagrangian::{CheckOptions, EstimateOptions, Format, Layout, Signals, Trajectory, check};
use zip::write::SimpleFileOptions;

use crate::{Outcome, refused, text};

/// Comma-separated text.
pub fn csv(bytes: &[u8]) -> Outcome {
    read(Format::Csv, bytes.to_vec(), &Layout::default())
}

/// Tables as other programs write them, by the columns that look like time and coordinates, and an angle of the first two others.
pub fn table(bytes: &[u8]) -> Outcome {
    let headers = look(bytes, 5).map_err(refused)?.headers;
    let rest = headers.iter().skip(1).take(2).map(String::as_str);
    let polar = format!("angle={}", rest.collect::<Vec<_>>().join(","));
    let layout = Layout {
        t: time(&headers).or(Some("0.1".into())),
        columns: Signals {
            q: coordinates(&headers),
            ..Signals::default()
        },
        polar: polar.parse().into_iter().collect(),
        ..Layout::default()
    };
    read(Format::Csv, bytes.to_vec(), &layout)
}

/// An archive of arrays.
pub fn npz(bytes: &[u8]) -> Outcome {
    read(Format::Npz, bytes.to_vec(), &Layout::default())
}

/// One array, in an archive whose checksums hold.
pub fn npy(bytes: &[u8]) -> Outcome {
    read(Format::Npz, archive(bytes), &Layout::default())
}

/// A description of columns, and a file that is read by it.
pub fn layout(bytes: &[u8]) -> Outcome {
    const FILE: &str = "t,time,q1,q2,theta,qd1,qd2,tau1,u,trajectory,goal,kp\n\
        0,0,0.1,0.2,10,1,2,0.5,0.1,a,0.3,20\n\
        0.1,0.1,0.2,0.4,20,1,2,0.5,0.2,a,0.3,20\n\
        0.2,0.2,0.3,0.6,30,1,2,0.5,0.3,a,0.3,20\n\
        0,0,0.1,0.2,10,1,2,0.5,0.1,b,0.3,20\n\
        0.1,0.1,0.2,0.4,20,1,2,0.5,0.2,b,0.3,20\n\
        0.2,0.2,0.3,0.6,30,1,2,0.5,0.3,b,0.3,20\n";
    let layout = Layout::from_toml(text(bytes)?).map_err(refused)?;
    let written = layout.to_toml().map_err(refused)?;
    let again = Layout::from_toml(&written).expect("a layout that was written is read");
    assert_eq!(
        again.to_toml().map_err(refused)?,
        written,
        "a layout comes back the same"
    );
    read(Format::Csv, FILE.into(), &layout)
}

/// Reads a file and uses what it holds.
fn read(format: Format, bytes: Vec<u8>, layout: &Layout) -> Outcome {
    let readings = format.read(Cursor::new(bytes), "file", layout);
    let Readings { recordings, .. } = readings.map_err(refused)?;
    for item in check(&recordings, &CheckOptions::default()).items {
        refused(item.finding);
        item.remedy.map(refused);
    }
    let mut motions = Vec::new();
    for recording in recordings {
        match recording.into_trajectory(&EstimateOptions::default()) {
            Ok((motion, _)) => motions.push(motion),
            Err(error) => drop(refused(error)),
        }
    }
    for motion in &motions {
        let finite = |values: &[f64]| values.iter().all(|x| x.is_finite());
        let signals = motion.signals.iter().all(|(_, values)| finite(values));
        assert!(signals && finite(&motion.t), "a trajectory is finite");
        assert!(motion.t.windows(2).all(|w| w[0] < w[1]), "time increases");
    }
    let same_signals = motions.windows(2).all(|w| signals(&w[0]) == signals(&w[1]));
    if !motions.is_empty() && same_signals {
        [Format::Csv, format]
            .into_iter()
            .for_each(|format| write_and_read(format, &motions));
    }
    Ok(())
}

/// The number of coordinates of a motion, and which signals it has.
fn signals(motion: &Trajectory) -> (usize, Vec<bool>) {
    let known = motion.signals.iter().map(|(_, values)| values.is_empty());
    (motion.dof(), known.collect())
}

/// What was written is read with the same bits.
fn write_and_read(format: Format, motions: &[Trajectory]) {
    let mut file = Cursor::new(Vec::new());
    format
        .write(&mut file, motions)
        .expect("a trajectory is written");
    let layout = Layout::default();
    let readings = format.read(Cursor::new(file.into_inner()), "file", &layout);
    let readings = readings.expect("what was written is read").recordings;
    assert_eq!(readings.len(), motions.len(), "every motion is there");
    for (reading, motion) in readings.iter().zip(motions) {
        let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&reading.t), bits(&motion.t), "t of {format:?}");
        for (signal, values) in motion.signals.iter() {
            let name = signal.name();
            assert_eq!(
                bits(reading.get(signal)),
                bits(values),
                "{name} of {format:?}"
            );
        }
    }
}

/// An archive with the array under test in the place of q, and times for it.
fn archive(q: &[u8]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let stored = SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in [("t.npy", times()), ("q.npy", q.to_vec())] {
        zip.start_file(name, stored).expect("memory takes it");
        zip.write_all(&bytes).expect("memory takes it");
    }
    zip.finish().expect("memory takes it").into_inner()
}

/// Eight times as an array.
fn times() -> Vec<u8> {
    let head = "{'descr': '<f8', 'fortran_order': False, 'shape': (8,), }";
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(format!("{head:<117}\n").into_bytes());
    bytes.extend((0..8).flat_map(|k| (0.1 * f64::from(k)).to_le_bytes()));
    bytes
}
