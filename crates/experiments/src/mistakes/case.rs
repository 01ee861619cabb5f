//! Logs of a machine in memory, so that one function can spoil one thing of them.

use std::fmt::Write;
use std::io::Cursor;

use lagrangian::rigid::RigidBodies;
use lagrangian::{Format, Layout, Recording, Result};

/// A signal by joint, then by sample; empty where it was not recorded.
pub(crate) type Columns = Vec<Vec<f64>>;

/// One log.
#[derive(Debug, Clone, Default)]
pub(crate) struct Log {
    pub(crate) t: Vec<f64>,
    pub(crate) q: Columns,
    pub(crate) qd: Columns,
    pub(crate) qdd: Columns,
    pub(crate) tau: Columns,
}

/// What is given to a fit.
#[derive(Debug, Clone, Default)]
pub(super) struct Case {
    pub(super) logs: Vec<Log>,
    pub(super) validation: Vec<Log>,
    /// Logs of a machine of the same kind with other lengths.
    pub(super) longer: Vec<Log>,
    /// The description of the robot, and its joints in the order of the columns.
    pub(super) urdf: Option<(String, Vec<String>)>,
    /// Whether the coordinates are declared as angles.
    pub(super) angles: bool,
}

impl Log {
    pub(crate) fn signals(&mut self) -> [&mut Columns; 4] {
        [&mut self.q, &mut self.qd, &mut self.qdd, &mut self.tau]
    }

    /// Applies a function to every column of every signal.
    pub(super) fn each(&mut self, mut change: impl FnMut(&mut Vec<f64>)) {
        for column in self.signals().into_iter().flatten() {
            change(column);
        }
    }

    /// Keeps the rows for which this holds.
    pub(super) fn keep(&mut self, kept: impl Fn(usize) -> bool) {
        let thin = |x: &mut Vec<f64>| {
            let mut row = 0..;
            x.retain(|_| row.next().is_some_and(&kept));
        };
        thin(&mut self.t);
        self.each(thin);
    }

    /// Takes the rows in this order.
    pub(super) fn reorder(&mut self, order: &[usize]) {
        let take = |x: &mut Vec<f64>| *x = order.iter().map(|k| x[*k]).collect();
        take(&mut self.t);
        self.each(take);
    }

    /// The recordings that a program reads from it.
    pub(crate) fn read(&self, name: &str, angles: &[String]) -> Result<Vec<Recording>> {
        let layout = Layout {
            angles: angles.to_vec(),
            ..Layout::default()
        };
        let file = Cursor::new(self.text());
        Ok(Format::Csv.read(file, name, &layout)?.recordings)
    }

    /// The text of a file with these columns.
    pub(super) fn text(&self) -> String {
        let mut text = String::from("t");
        let signals = [
            ("q", &self.q),
            ("qd", &self.qd),
            ("qdd", &self.qdd),
            ("tau", &self.tau),
        ];
        for (name, columns) in signals {
            for joint in 1..=columns.len() {
                // Writing to a string does not fail.
                let _ = write!(text, ",{name}{joint}");
            }
        }
        text.push('\n');
        for (k, t) in self.t.iter().enumerate() {
            let _ = write!(text, "{t}");
            for column in signals.iter().flat_map(|(_, columns)| columns.iter()) {
                let _ = write!(text, ",{}", column[k]);
            }
            text.push('\n');
        }
        text
    }
}

impl Case {
    /// The number of joints.
    pub(super) fn joints(&self) -> usize {
        self.logs.first().map_or(0, |log| log.q.len())
    }

    /// The robot of the description.
    pub(super) fn robot(&self) -> Option<RigidBodies> {
        let (text, joints) = self.urdf.as_ref()?;
        let robot = match joints.is_empty() {
            true => RigidBodies::from_urdf(text),
            false => RigidBodies::with_joints(text, joints),
        };
        robot.ok()
    }

    /// The recordings that a program reads from these logs.
    pub(super) fn recordings(&self, logs: &[Log]) -> Result<Vec<Recording>> {
        let angles = self.angles.then(|| "all".to_string());
        let angles: Vec<String> = angles.into_iter().collect();
        let mut all = Vec::new();
        for (k, log) in logs.iter().enumerate() {
            all.extend(log.read(&format!("log {}", k + 1), &angles)?);
        }
        Ok(all)
    }
}
