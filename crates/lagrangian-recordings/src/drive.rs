//! Properties of position-controlled drives that are not columns of a file: gains and voltages given as numbers, or in the
//! name of the file.

use super::Recording;
use lagrangian_motion::{Error, Result};
use lagrangian_motion::{Signal, Signals};

/// A constant value for a whole recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Constant {
    /// A number.
    Number(f64),
    /// The number at the braces of a pattern such as `kp{}` in the name of the file, or else of the trajectory.
    InName(String),
}

/// Properties of drives that are not columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DriveLayout {
    /// Gains kₚ and kᵈ and supply voltages, V, each of all joints.
    constants: Signals<Option<Constant>>,
    /// Whether gains are in N·m/rad and N·m·s/rad: then τ = kₚ (goal − q) − kᵈ q̇, and the recording gets torques like any other.
    pub si: bool,
}

/// The signals that may be constant.
const CONSTANT: [Signal; 3] = [Signal::Kp, Signal::Kd, Signal::Supply];

impl Constant {
    /// The number or pattern that a text represents; `None` for the name of a column.
    #[must_use]
    pub fn of_text(text: &str) -> Option<Self> {
        if text.contains("{}") {
            return Some(Self::InName(text.into()));
        }
        text.parse().ok().map(Self::Number)
    }

    fn value(&self, names: [&str; 2]) -> Result<f64> {
        let pattern = match self {
            Self::Number(x) => return Ok(*x),
            Self::InName(pattern) => pattern,
        };
        let found = names.iter().find_map(|name| at_braces(pattern, name));
        found.ok_or_else(|| {
            let [file, _] = names;
            Error::setting(
                format!(
                    "the name '{file}' has no number where the pattern '{pattern}' has its braces"
                ),
                "correct the pattern, or give a number or a column",
            )
        })
    }
}

/// The number at the braces of `pattern` somewhere in `name`.
fn at_braces(pattern: &str, name: &str) -> Option<f64> {
    let (before, after) = pattern.split_once("{}")?;
    let places = name.match_indices(before).map(|(at, _)| at + before.len());
    places
        .filter_map(|at| number_before(&name[at..], after))
        .next()
}

/// The number at the beginning of `text`, up to `after`.
fn number_before(text: &str, after: &str) -> Option<f64> {
    let digits = |c: char| c.is_ascii_digit() || c == '.';
    let end = text.find(|c: char| !digits(c)).unwrap_or(text.len());
    let number = text[..end].trim_end_matches('.');
    let rest = &text[number.len()..];
    number.parse().ok().filter(|_| rest.starts_with(after))
}

impl DriveLayout {
    /// The constant of a signal; `None` if it has columns or is unknown.
    #[must_use]
    pub fn constant(&self, signal: Signal) -> Option<&Constant> {
        self.constants.get(signal).as_ref()
    }

    pub(super) fn set(&mut self, signal: Signal, constant: Constant) -> Result<()> {
        if !CONSTANT.contains(&signal) {
            let text = format!("`{}` is read from columns: name them", signal.name());
            return Err(Error::Layout(text));
        }
        *self.constants.get_mut(signal) = Some(constant);
        Ok(())
    }

    /// Fills from `beside` the values that neither a constant nor columns give here.
    pub(super) fn or(self, mut beside: Self, own: &Signals<Vec<String>>) -> Self {
        Self {
            constants: self.constants.map(|signal, mine| {
                let other = beside.constants.get_mut(signal).take();
                mine.or(other.filter(|_| own.get(signal).is_empty()))
            }),
            si: self.si || beside.si,
        }
    }

    /// Completes the properties of the drives of a file: constants become columns of equal values, one column for all joints becomes
    /// one for each, and gains in SI units become torques.
    pub(super) fn complete(&self, file: &str, recording: &mut Recording) -> Result<()> {
        if recording.goal.is_empty() {
            return Ok(());
        }
        let values = recording.goal.len();
        for signal in CONSTANT {
            if let Some(constant) = self.constant(signal) {
                let value = constant.value([file, &recording.name])?;
                check(signal, value)?;
                *recording.get_mut(signal) = vec![value; values];
            }
        }
        for signal in Signal::OF_DRIVES {
            recording.spread(signal);
            recording.check_commands(signal)?;
        }
        if self.si {
            recording.torques_from_gains()?;
        }
        Ok(())
    }
}

fn check(signal: Signal, value: f64) -> Result<()> {
    let (least, must) = match signal {
        Signal::Kd => (-f64::MIN_POSITIVE, "a number that is not negative"),
        _ => (0.0, "a positive number"),
    };
    match value > least && value.is_finite() {
        true => Ok(()),
        false => Err(Error::argument(signal.name(), value, must)),
    }
}

impl Recording {
    /// Copies the one column of a signal to all joints.
    fn spread(&mut self, signal: Signal) {
        let n = self.dof();
        let names = self.columns.signals.get(signal);
        let one = names.iter().filter(|name| !name.is_empty()).count() == 1;
        if n > 1 && one {
            for row in self.signals.get_mut(signal).chunks_exact_mut(n) {
                row.fill(row[0]);
            }
        }
    }

    /// Refuses gains and voltages below 0; values that are not finite are refused with all other signals.
    fn check_commands(&self, signal: Signal) -> Result<()> {
        let negative = self.get(signal).iter().find(|x| **x < 0.0);
        let negative = negative.filter(|_| CONSTANT.contains(&signal));
        negative.map_or(Ok(()), |x| check(signal, *x))
    }

    /// τ = kₚ (goal − q) − kᵈ q̇ in place of the goals; 0 where the motor is off.
    fn torques_from_gains(&mut self) -> Result<()> {
        if self.kp.is_empty() {
            let problem = "gains are in SI units, but there is no `kp`";
            return Err(Error::setting(
                problem,
                "give it as a number, a column or a pattern",
            ));
        }
        if self.kd.iter().any(|x| *x != 0.0) && self.qd.is_empty() {
            let problem = "`kd` needs velocities, and there are none";
            return Err(Error::setting(problem, "name their columns with `qd`"));
        }
        let at = |x: &[f64], k: usize, other: f64| x.get(k).copied().unwrap_or(other);
        let torque = |k: usize| {
            let error = self.goal[k] - self.q[k];
            let torque = self.kp[k] * error - at(&self.kd, k, 0.0) * at(&self.qd, k, 0.0);
            let is_off = at(&self.enabled, k, 1.0) == 0.0;
            if is_off { 0.0 } else { torque }
        };
        self.tau = (0..self.goal.len()).map(torque).collect();
        for signal in Signal::OF_DRIVES {
            self.signals.get_mut(signal).clear();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use std::io::Cursor;

    use super::*;
    use crate::{Format, Layout};

    fn read(drive: &str, name: &str) -> Result<Recording> {
        let layout = Layout::from_toml(&format!("[drive]\n{drive}"))?;
        let rows = "0,0.1,0,0.5,1\n1,0.2,2,0.5,1\n2,0.3,2,0.5,0\n";
        let file = Cursor::new(format!("t,q1,qd1,goal,load\n{rows}"));
        Ok(Format::Csv.read(file, name, &layout)?.recordings.remove(0))
    }

    #[test]
    fn a_pattern_finds_the_number_at_its_braces() {
        let cases = [
            ("kp{}", "lift_and_drop_kp400", Some(400.0)),
            ("kp{}_", "kp_kp12.5_x", Some(12.5)),
            ("kp{}", "kpx", None),
            ("{}V", "run3 7.4V", Some(7.4)),
            ("kp{}", "kp7.csv", Some(7.0)),
        ];
        for (pattern, name, expected) in cases {
            assert_eq!(at_braces(pattern, name), expected, "{pattern} {name}");
        }
    }

    #[test]
    fn numbers_and_patterns_become_columns() {
        let drive = "goal = 'goal'\nkp = 'kp{}'\nsupply = 7.4\nenabled = ['load']";
        let recording = read(drive, "log_kp30").unwrap();
        assert_eq!(recording.kp, [30.0; 3]);
        assert_eq!(recording.supply, [7.4; 3]);
        assert_eq!(recording.enabled, [1.0, 1.0, 0.0]);
        assert!(recording.kd.is_empty() && recording.tau.is_empty());
    }

    #[test]
    fn gains_in_si_units_become_torques() {
        let drive = "goal = 'goal'\nkp = 10\nkd = 0.5\nenabled = 'load'\nsi = true";
        let recording = read(drive, "log").unwrap();
        let errors = recording.tau.iter().zip([4.0, 2.0, 0.0]);
        assert!(
            errors
                .map(|(x, y): (&f64, f64)| (x - y).abs())
                .all(|e| e < 1e-12)
        );
        assert!(recording.goal.is_empty() && recording.kp.is_empty());
    }

    #[test]
    fn what_is_known_of_drives_survives_writing() {
        let text = "[drive]\ngoal = 'goal'\nkp = 'kp{}'\nkd = 0.5\nenabled = 'load'\nsi = true";
        let layout = Layout::from_toml(text).unwrap();
        let again = Layout::from_toml(&layout.to_toml().unwrap()).unwrap();
        assert_eq!(again, layout);
    }

    #[test]
    fn what_no_drive_can_be_told_is_refused() {
        let cases = [
            "goal = 'nowhere'",
            "goal = 3",
            "goal = 'goal'\nkp = 'gain{}'",
            "goal = 'goal'\nkp = 0",
            "goal = 'goal'\nkp = -2.0",
            "goal = 'goal'\nkd = -2.0",
            "goal = 'goal'\nsupply = nan",
            "goal = 'goal'\ncurrent = 'x'",
            "goal = 'goal'\nsi = true",
            "kp = 3",
        ];
        for case in cases {
            assert!(read(case, "log").is_err(), "{case}");
        }
    }
}
