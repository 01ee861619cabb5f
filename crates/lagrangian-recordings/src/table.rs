//! Columns of numbers: the parts of a torque, or motions under other names and in other units.

use super::Layout;
use lagrangian_motion::{Coordinates, Signal, Trajectory};

/// Named columns over the samples of some trajectories; [`super::Format::write_table`] writes them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Names and numbers of samples of the trajectories, one after another.
    pub trajectories: Vec<(String, usize)>,
    /// Names and values, each of as many values as there are samples.
    pub columns: Vec<(String, Vec<f64>)>,
}

impl Table {
    /// Motions in the columns and units of `layout`, as [`Layout::of_motions`] declares them: under its names for
    /// their signals and the default ones for others, with angles in degrees where it says so. The motions must have the same
    /// signals.
    #[must_use]
    pub fn of_motions(motions: &[Trajectory], coordinates: &Coordinates, layout: &Layout) -> Self {
        let n = coordinates.dof();
        let name = layout.time_column();
        let by = layout.factor(&name, None, false);
        let time = motions.iter().flat_map(|m| &m.t).map(|t| t / by);
        let mut columns = vec![(name, time.collect())];
        for signal in known(motions) {
            let names = layout.names_of(signal, coordinates);
            for (i, name) in names.into_iter().enumerate() {
                let by = layout.factor(&name, Some(signal), coordinates.is_circle(i));
                let own = motions
                    .iter()
                    .flat_map(|m| m.get(signal).iter().skip(i).step_by(n));
                columns.push((name, own.map(|x| x / by).collect()));
            }
        }
        Self {
            trajectories: motions.iter().map(|m| (m.name.clone(), m.len())).collect(),
            columns,
        }
    }
}

/// The signals that files can hold and that the first of these motions has.
fn known(motions: &[Trajectory]) -> Vec<Signal> {
    let is_known = |signal: &Signal| motions.first().is_some_and(|m| !m.get(*signal).is_empty());
    Signal::IN_FILES.into_iter().filter(is_known).collect()
}

impl Layout {
    /// Whether files with the default names and units have this layout.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        let named = self.columns.iter().any(|(_, names)| !names.is_empty());
        !named && !self.degrees && self.t.as_ref().is_none_or(|t| t == "t")
    }

    /// The layout of a table that [`Table::of_motions`] made with this one.
    #[must_use]
    pub fn of_motions(&self, motions: &[Trajectory], coordinates: &Coordinates) -> Self {
        let mut layout = Self {
            t: Some(self.time_column()),
            ..Self::default()
        };
        for signal in known(motions) {
            *layout.columns.get_mut(signal) = self.names_of(signal, coordinates);
        }
        for coordinate in &coordinates.0 {
            layout.add_coordinate(coordinate.name.clone(), coordinate);
        }
        layout.degrees = self.degrees && !layout.angles.is_empty();
        layout
    }

    /// The column of time.
    #[must_use]
    pub fn time_column(&self) -> String {
        let named = self.t.clone().filter(|_| self.interval().is_none());
        named.unwrap_or_else(|| "t".into())
    }

    /// The columns of a signal, one for each coordinate: those of q bear the names of the coordinates.
    #[must_use]
    pub fn names_of(&self, signal: Signal, coordinates: &Coordinates) -> Vec<String> {
        let (n, named) = (coordinates.dof(), self.columns.get(signal));
        if signal == Signal::Q {
            return coordinates.0.iter().map(|c| c.name.clone()).collect();
        }
        match named.len() == n && named.iter().all(|name| !name.is_empty()) {
            true => named.clone(),
            false => (1..=n).map(|i| format!("{}{i}", signal.name())).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use std::io::Cursor;

    use super::*;
    use crate::Format;
    use lagrangian_motion::Error;
    use lagrangian_motion::{Coordinate, Signals, Topology};

    #[test]
    fn every_format_reads_back_the_columns_that_were_written() {
        let table = Table {
            trajectories: vec![("a".into(), 2), ("b, c".into(), 1)],
            columns: vec![
                ("t".into(), vec![0.0, 0.1, 0.0]),
                ("q1".into(), vec![1.0, -2.5e-9, 1.0 / 3.0]),
            ],
        };
        for (format, extension) in Format::ALL {
            let mut file = Cursor::new(Vec::new());
            match format.write_table(&mut file, &table) {
                Err(Error::Format { .. }) => continue,
                written => written.unwrap(),
            }
            file.set_position(0);
            let back = format
                .read(file, "x", &Layout::default())
                .unwrap()
                .recordings;
            let names: Vec<&str> = back.iter().map(|r| r.name.as_str()).collect();
            assert_eq!(names, ["a", "b, c"], "{extension}");
            assert_eq!(back[0].q, [1.0, -2.5e-9], "{extension}");
            assert_eq!(back[1].q, [1.0 / 3.0], "{extension}");
        }
    }

    #[test]
    fn motions_come_back_from_the_names_and_units_of_other_data() {
        let coordinates = Coordinates(vec![
            Coordinate::new("theta", "rad", Topology::Circle),
            Coordinate::new("x", "m", Topology::Line),
        ]);
        let signals = Signals {
            q: vec![0.5, 2.0, 0.6, 3.0],
            qd: vec![0.1, 10.0, 0.2, 20.0],
            ..Signals::default()
        };
        let motion = Trajectory::new("swing", vec![0.0, 0.1], signals);
        let layout = Layout {
            t: Some("time".into()),
            columns: Signals {
                qd: vec!["omega".into(), "v".into()],
                ..Signals::default()
            },
            degrees: true,
            ..Layout::default()
        };
        let motions = [motion];
        let table = Table::of_motions(&motions, &coordinates, &layout);
        let names: Vec<&str> = table
            .columns
            .iter()
            .map(|(name, _)| name.as_str())
            .collect();
        assert_eq!(names, ["time", "theta", "x", "omega", "v"]);
        assert!((table.columns[1].1[0] - 0.5_f64.to_degrees()).abs() < 1e-12);
        assert_eq!(table.columns[4].1, [10.0, 20.0]);
        let mut file = Cursor::new(Vec::new());
        Format::Csv.write_table(&mut file, &table).unwrap();
        file.set_position(0);
        let text = layout.of_motions(&motions, &coordinates).to_toml().unwrap();
        let back = Format::Csv
            .read(file, "swing", &Layout::from_toml(&text).unwrap())
            .unwrap();
        assert_eq!(back.recordings[0].coordinates, coordinates);
        let pairs = back.recordings[0].q.iter().zip(&motions[0].q);
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn columns_of_different_lengths_are_refused() {
        let table = Table {
            trajectories: vec![("a".into(), 2)],
            columns: vec![("t".into(), vec![0.0])],
        };
        assert!(
            Format::Csv
                .write_table(Cursor::new(Vec::new()), &table)
                .is_err()
        );
    }
}
