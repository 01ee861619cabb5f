//! Conversion of columns to SI units, by the units in their names.

use std::f64::consts::PI;

use super::columns::Columns;
use super::unit::{Stated, Unit};
use super::{Layout, programs};
use lagrangian_motion::{Coordinates, Signal, Topology};
use lagrangian_motion::{Error, Result};

/// Factors of the numbers of a file, and notes on them.
#[derive(Debug, Clone, Default)]
pub(super) struct Scales {
    /// A factor for each number, t first; empty where all are 1.
    pub(super) factors: Vec<f64>,
    pub(super) notes: Vec<String>,
}

impl Layout {
    /// Factor of the values of a column: from the unit in its name, or π/180 for an angle where `degrees` is set.
    pub(super) fn factor(&self, name: &str, signal: Option<Signal>, circle: bool) -> f64 {
        let degrees = self.degrees && circle && signal.is_some_and(Signal::has_the_unit_of_q);
        match Stated::of(name).unit {
            Some(unit) => unit.factor,
            None if degrees => PI / 180.0,
            None => 1.0,
        }
    }
}

impl Scales {
    /// The scales of `columns`; angles of two points may be in any unit.
    ///
    /// # Errors
    /// [`Error::Columns`] for a column that states the unit of another quantity.
    pub(super) fn of(
        columns: &Columns,
        coordinates: &Coordinates,
        headers: &[String],
        layout: &Layout,
    ) -> Result<Self> {
        let mut scales = Self::default();
        scales.add_time(&columns.t, headers, layout)?;
        for (signal, names) in columns.signals.iter() {
            for (i, name) in names
                .iter()
                .enumerate()
                .filter(|(_, name)| !name.is_empty())
            {
                let q = &columns.signals.q[i];
                let is_polar = signal == Signal::Q && layout.polar.iter().any(|p| p.name == *q);
                let unit = layout.units.get(q).map(String::as_str);
                let topology = coordinates.0[i].topology;
                match is_polar || signal == Signal::Q && unit == Some(Stated::of(name).written) {
                    true => scales.factors.push(1.0),
                    false => scales.add(name, signal, topology, layout, unit.is_some())?,
                }
            }
        }
        if scales
            .factors
            .iter()
            .all(|factor| factor.total_cmp(&1.0).is_eq())
        {
            scales.factors.clear();
        }
        Ok(scales)
    }

    fn add_time(&mut self, name: &str, headers: &[String], layout: &Layout) -> Result<()> {
        let program = programs::unit_of_time(headers, name);
        let stated = Stated::of(name);
        if let Some(unit) = stated.unit.filter(|unit| !unit.is_of_time()) {
            return Err(misused(name, stated.written, "time", &unit, "t"));
        }
        match program.and_then(Unit::of).filter(|_| stated.unit.is_none()) {
            Some(unit) => self.push(name, program.unwrap_or_default(), unit),
            None => match Unit::of(name).filter(|unit| unit.is_of_time()) {
                Some(unit) => self.push(name, name, unit),
                None => self.stated(name, layout.factor(name, None, false)),
            },
        }
        Ok(())
    }

    fn add(
        &mut self,
        name: &str,
        signal: Signal,
        topology: Topology,
        layout: &Layout,
        declared: bool,
    ) -> Result<()> {
        let (stated, circle) = (Stated::of(name), topology == Topology::Circle);
        let checked = topology != Topology::Parameter && !declared;
        match stated.unit {
            Some(unit) if checked && !unit.fits(signal) => {
                let what = signal.description().split([';', ',']).next();
                let what = what.unwrap_or_default();
                return Err(misused(name, stated.written, what, &unit, signal.name()));
            }
            Some(unit) if layout.degrees && circle && unit == Unit::RADIAN => {
                self.notes.push(format!(
                    "column '{name}' states {}: `degrees` is not applied to it",
                    stated.written
                ));
            }
            _ => {}
        }
        self.stated(name, layout.factor(name, Some(signal), circle));
        Ok(())
    }

    /// Adds a column with the factor of the unit that its name states.
    fn stated(&mut self, name: &str, factor: f64) {
        let stated = Stated::of(name);
        match stated.unit {
            Some(unit) => return self.push(name, stated.written, unit),
            None if !stated.written.is_empty() => self.notes.push(format!(
                "the unit '{}' of column '{name}' is not known: its values are taken as they are",
                stated.written
            )),
            None => {}
        }
        self.factors.push(factor);
    }

    fn push(&mut self, name: &str, written: &str, unit: Unit) {
        if unit.factor.total_cmp(&1.0).is_ne() {
            let si = unit.si();
            let note = format!("column '{name}' is in {written}: its values are converted to {si}");
            self.notes.push(note);
        }
        self.factors.push(unit.factor);
    }
}

/// The error for a column with a unit that contradicts its use.
fn misused(name: &str, written: &str, what: &str, unit: &Unit, setting: &str) -> Error {
    let of = [Signal::Q, Signal::Qd, Signal::Qdd, Signal::Tau];
    let fits = of.into_iter().find(|signal| unit.fits(*signal));
    let remedy = match fits {
        _ if unit.is_of_time() => "name it with `t`".into(),
        Some(signal) => format!("name it with `{}`", signal.name()),
        None => format!("name another with `{setting}`"),
    };
    Error::Columns {
        finding: format!("column '{name}' is in {written}, which is not a unit of {what}"),
        found: name.into(),
        remedy: format!("{remedy}, or rename it if that is not its unit"),
    }
}
