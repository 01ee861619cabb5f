//! The real logs, whole and in pieces.

use std::io::Cursor;

use anyhow::Result;
use lagrangian::{Format, Layout, Recording};

use super::Subject;
use crate::harness::Lab;
use crate::harness::failure::Context;

/// The logs of one machine, and what is known of their columns.
struct Machine {
    folder: &'static str,
    logs: &'static [&'static str],
    layout: &'static str,
}

const ANGLES: &str = "angle = 'all'";

const MACHINES: [Machine; 7] = [
    Machine {
        folder: "characters",
        logs: &["characters"],
        layout: ANGLES,
    },
    Machine {
        folder: "pendulum_real",
        logs: &[
            "ddp",
            "direct_collocation",
            "energy_shaping",
            "swingup_failure",
            "system_identification",
        ],
        layout: ANGLES,
    },
    Machine {
        folder: "double_pendulum_real",
        logs: &[
            "trajectory_00",
            "trajectory_01",
            "trajectory_02",
            "trajectory_03",
            "trajectory_04",
            "trajectory_05",
            "trajectory_12",
            "trajectory_13",
        ],
        layout: ANGLES,
    },
    Machine {
        folder: "ur10_real",
        logs: &["ur10"],
        layout: "",
    },
    Machine {
        folder: "panda_real",
        logs: &["panda"],
        layout: "",
    },
    Machine {
        folder: "emps_real",
        logs: &["emps_train", "emps_test"],
        layout: "units = { q1 = 'm' }",
    },
    Machine {
        folder: "servo_real",
        logs: &[
            "lift_and_drop_kp100",
            "lift_and_drop_kp200",
            "lift_and_drop_kp400",
            "lift_and_drop_kp800",
            "sin_sin_kp100",
            "sin_sin_kp200",
            "sin_sin_kp400",
            "sin_sin_kp800",
            "sin_time_square_kp100",
            "sin_time_square_kp200",
            "sin_time_square_kp400",
            "sin_time_square_kp800",
            "up_and_down_kp100",
            "up_and_down_kp200",
            "up_and_down_kp400",
            "up_and_down_kp800",
        ],
        layout: "[drive]\ngoal = 'goal'\nkp = 'kp{}'\nenabled = 'load'",
    },
];

/// The largest number of pieces that are checked together.
const GROUP: usize = 8;
/// Lengths of pieces, s; each recording is checked whole as well.
const LENGTHS: [f64; 3] = [5.0, 10.0, 20.0];

/// All real logs; with `--quick` those of two machines in pieces of one length.
pub(super) fn subjects(lab: &Lab) -> Result<Vec<Subject>> {
    let (machines, lengths) = match lab.quick() {
        true => (&MACHINES[1..3], &LENGTHS[1..2]),
        false => (&MACHINES[..], &LENGTHS[..]),
    };
    let mut subjects = Vec::new();
    for machine in machines {
        let recordings = machine.read(lab)?;
        for &seconds in lengths {
            let pieces = recordings.iter().flat_map(|r| pieces(r, seconds));
            let pieces: Vec<Recording> = pieces.collect();
            let groups = pieces
                .chunks(GROUP)
                .filter(|group| group.len() >= GROUP / 2);
            subjects.extend(
                groups.map(|group| {
                    machine.subject(&format!("groups of {seconds} s"), group.to_vec())
                }),
            );
            subjects.extend(
                pieces
                    .into_iter()
                    .map(|r| machine.subject(&format!("{seconds} s"), vec![r])),
            );
        }
        let single = recordings.iter().filter(|_| recordings.len() > 1);
        subjects.extend(single.map(|r| machine.subject("whole", vec![r.clone()])));
        subjects.push(machine.subject("all together", recordings));
    }
    Ok(subjects)
}

impl Machine {
    fn read(&self, lab: &Lab) -> Result<Vec<Recording>> {
        let mut all = Vec::new();
        for name in self.logs {
            let file = lab.data(&format!("{}/{name}.csv", self.folder))?;
            let shown = format!("cannot read '{name}.csv'");
            let hint = "give the reference data with --data";
            let layout = Layout::from_toml(self.layout).context(&shown, hint)?;
            let read = Format::Csv.read(Cursor::new(file), name, &layout);
            all.extend(read.context(shown, hint)?.recordings);
        }
        Ok(all)
    }

    fn subject(&self, length: &str, recordings: Vec<Recording>) -> Subject {
        let name = match &recordings[..] {
            [one] => format!("{}/{}", self.folder, one.name),
            _ => self.folder.to_string(),
        };
        Subject {
            group: format!("{}, {length}", self.folder),
            log: name,
            length: length.into(),
            recordings,
        }
    }
}

/// The pieces of this length, one after another; what is left at the end is omitted.
fn pieces(recording: &Recording, seconds: f64) -> Vec<Recording> {
    let (t, n) = (&recording.t, recording.dof());
    let (Some(begin), Some(end)) = (t.first(), t.last()) else {
        return Vec::new();
    };
    // A log of 9.9998 s counts as one of 10 s.
    let count = ((end - begin) / seconds + 0.01).floor() as usize;
    let row = |k: usize| t.partition_point(|t| *t < begin + k as f64 * seconds);
    let piece = |k: usize| {
        let rows = row(k)..row(k + 1);
        let mut piece = recording.clone();
        piece.name = format!("{}, {} s", recording.name, k as f64 * seconds);
        piece.t = t[rows.clone()].to_vec();
        for (_, values) in piece.signals.iter_mut().filter(|(_, v)| !v.is_empty()) {
            *values = values[rows.start * n..rows.end * n].to_vec();
        }
        piece.sampled = None;
        piece
    };
    (0..count).map(piece).collect()
}
