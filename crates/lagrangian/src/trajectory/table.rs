//! Columns of numbers that are no trajectory, such as the parts of a torque.

/// Named columns over the samples of some trajectories; [`super::Format::write_table`] writes them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Names and numbers of samples of the trajectories, one after another.
    pub trajectories: Vec<(String, usize)>,
    /// Names and values, each of as many values as there are samples.
    pub columns: Vec<(String, Vec<f64>)>,
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use std::io::Cursor;

    use super::*;
    use crate::Error;
    use crate::trajectory::{Format, Layout};

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
