//! Motions as moving pictures, in a page of their own.

use lagrangian::{Signals, Trajectory};
use lagrangian_report::{Animation, Panel, Report, Role, draw};
use lagrangian_run::{Links, MOST_LINKS, as_chain};
use pyo3::prelude::*;

use crate::error::{invalid, of_json};
use crate::recording::recordings;

/// The largest number of motions that are shown side by side.
const MOST: usize = 6;
const ROLES: [Role; 3] = [Role::Truth, Role::Lnn, Role::Baseline];

/// The page in which motions of chains of links move side by side; `links` is the reference of the angles.
#[pyfunction]
pub(crate) fn animation(
    py: Python<'_>,
    motions: &Bound<'_, PyAny>,
    links: &str,
    lengths: Option<Vec<f64>>,
) -> PyResult<String> {
    let recordings = recordings(motions)?;
    let links = match links {
        "absolute" => Links::Absolute,
        "relative" => Links::Relative,
        "horizontal" => Links::Horizontal,
        _ => {
            let message =
                format!("links is {links:?}: it must be 'absolute', 'relative' or 'horizontal'");
            return Err(invalid(py, message));
        }
    };
    let Some(first) = recordings.first().filter(|_| recordings.len() <= MOST) else {
        let message = format!("{} motions are given: give 1 … {MOST}", recordings.len());
        return Err(invalid(py, message));
    };
    let n = first.dof();
    let lengths = lengths.unwrap_or_else(|| vec![1.0; n]);
    let usable = |length: &f64| length.is_finite() && *length > 0.0;
    if lengths.len() != n || !lengths.iter().all(usable) {
        let message = format!("lengths must be {n} positive numbers, one for each link");
        return Err(invalid(py, message));
    }
    let mut panels = Vec::new();
    for (k, recording) in recordings.into_iter().enumerate() {
        let angles = (0..recording.dof()).all(|i| recording.coordinates.is_circle(i));
        if recording.dof() != n || !angles || n > MOST_LINKS {
            let message = format!(
                "'{}' is not a motion of a chain: all coordinates must be angles, {n} as in the first, and at most {MOST_LINKS}",
                recording.name
            );
            return Err(invalid(py, message));
        }
        let role = ROLES.get(k).copied().unwrap_or(Role::Other(k as u8));
        let signals = Signals {
            q: recording.signals.q,
            ..Signals::default()
        };
        let chain = as_chain(
            &Trajectory::new(&recording.name, recording.t, signals),
            links,
        );
        panels.push(Panel::chain(&chain.name, role, &lengths, &chain, None));
    }
    let report = Report {
        animations: vec![Animation {
            id: "motion".into(),
            panels,
            ..Animation::default()
        }],
        ..Report::default()
    };
    Ok(draw::html(&report))
}

/// The page of a report in JSON.
#[pyfunction]
pub(crate) fn page(report: &str) -> PyResult<String> {
    Ok(draw::html(&of_json(serde_json::from_str::<Report>(
        report,
    ))?))
}
