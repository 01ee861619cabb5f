//! Motions between the two languages: `lagrangian.Trajectory` in Python, recordings and trajectories in the library.

use lagrangian::trajectory::{Columns, Coordinate, Signal, Topology};
use lagrangian::{Coordinates, Recording, Signals, Trajectory};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

use crate::arrays::{Rows, array, shown};
use crate::error::invalid;

/// A coordinate in the form of Python: name, unit, and `line`, `circle` or `parameter`.
type Named = (String, String, String);

fn kind(topology: Topology) -> &'static str {
    match topology {
        Topology::Line => "line",
        Topology::Circle => "circle",
        Topology::Parameter => "parameter",
    }
}

/// The coordinates in the form of Python.
pub(crate) fn described(coordinates: &Coordinates) -> Vec<Named> {
    let named = |c: &Coordinate| (c.name.clone(), c.unit.clone(), kind(c.topology).into());
    coordinates.0.iter().map(named).collect()
}

pub(crate) fn coordinates(py: Python<'_>, named: Vec<Named>) -> PyResult<Coordinates> {
    let coordinate = |(name, unit, kind): Named| {
        let topology = match kind.as_str() {
            "line" => Topology::Line,
            "circle" => Topology::Circle,
            "parameter" => Topology::Parameter,
            _ => {
                let message = format!(
                    "coordinate '{name}' is a '{kind}': it must be a line, a circle or a parameter"
                );
                return Err(invalid(py, message));
            }
        };
        Ok(Coordinate::new(name, &unit, topology))
    };
    let all = named.into_iter().map(coordinate);
    Ok(Coordinates(all.collect::<PyResult<_>>()?))
}

/// The recording that a `lagrangian.Trajectory` holds.
pub(crate) fn recording(motion: &Bound<'_, PyAny>) -> PyResult<Recording> {
    let py = motion.py();
    let Ok(parts) = motion.call_method0(intern!(py, "_parts")) else {
        let class = motion.get_type().name()?;
        let message = format!(
            "trajectories holds a {class}: give lagrangian.Trajectory objects, as lagrangian.read returns them"
        );
        return Err(crate::error::raise(py, "InvalidType", message));
    };
    let (name, named, t, given): (String, Vec<Named>, Bound<'_, PyAny>, Bound<'_, PyDict>) =
        parts.extract()?;
    let coordinates = coordinates(py, named)?;
    let n = coordinates.dof();
    let t = Rows::of_any_width(&t, "t")?;
    let rows = t.values().len();
    let (mut signals, mut columns) = (Signals::default(), Signals::<Vec<String>>::default());
    for signal in Signal::IN_FILES {
        let Some(values) = given.get_item(signal.name())? else {
            continue;
        };
        let values = Rows::new(&values, signal.name(), n)?;
        if values.shape() != [rows, n] {
            let message = format!(
                "{} has shape {}: give {}, a row for each of the times and a column for each coordinate",
                signal.name(),
                shown(values.shape()),
                shown(&[rows, n])
            );
            return Err(invalid(py, message));
        }
        *signals.get_mut(signal) = values.values().to_vec();
        let column = |i: usize| format!("{}[:, {i}]", signal.name());
        *columns.get_mut(signal) = (0..n).map(column).collect();
    }
    Ok(Recording {
        name,
        t: t.values().to_vec(),
        signals,
        columns: Columns {
            trajectory: None,
            t: "t".into(),
            signals: columns,
            ignored: Vec::new(),
            renamed: None,
        },
        unwrapped: vec![0; n],
        sampled: None,
        breaks: Vec::new(),
        coordinates,
    })
}

/// The recordings of a list of `lagrangian.Trajectory`.
pub(crate) fn recordings(motions: &Bound<'_, PyAny>) -> PyResult<Vec<Recording>> {
    motions
        .try_iter()?
        .map(|motion| recording(&motion?))
        .collect()
}

/// The parts of a `lagrangian.Trajectory`.
pub(crate) fn parts<'py>(
    py: Python<'py>,
    name: &str,
    coordinates: &Coordinates,
    t: Vec<f64>,
    signals: Signals,
) -> PyResult<Bound<'py, PyDict>> {
    let (rows, n) = (t.len(), coordinates.dof());
    let parts = PyDict::new(py);
    parts.set_item("name", name)?;
    parts.set_item("coordinates", described(coordinates))?;
    parts.set_item("t", array(py, t, &[rows])?)?;
    let mut signals = signals;
    for signal in Signal::IN_FILES {
        let values = std::mem::take(signals.get_mut(signal));
        if !values.is_empty() {
            parts.set_item(signal.name(), array(py, values, &[rows, n])?)?;
        }
    }
    Ok(parts)
}

/// The parts of trajectories.
pub(crate) fn list<'py>(
    py: Python<'py>,
    coordinates: &Coordinates,
    motions: Vec<Trajectory>,
) -> PyResult<Bound<'py, PyList>> {
    let list = PyList::empty(py);
    for motion in motions {
        list.append(parts(
            py,
            &motion.name,
            coordinates,
            motion.t,
            motion.signals,
        )?)?;
    }
    Ok(list)
}
