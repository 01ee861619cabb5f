//! Names that other programs give to columns: suggestions for a user whose file has them.

use super::unit::{Stated, is_time};
use lagrangian_motion::Signal;

/// A program that is recognised by the columns of its files.
struct Program {
    name: &'static str,
    /// The column of time, and its unit.
    time: (&'static str, &'static str),
    /// Columns of q, q̇, q̈ and τ; `*` represents the number of a joint, or before a `/` its path.
    signals: [&'static str; 4],
    /// The column that separates motions.
    trajectory: &'static str,
}

const fn program(
    name: &'static str,
    time: (&'static str, &'static str),
    signals: [&'static str; 4],
    trajectory: &'static str,
) -> Program {
    Program {
        name,
        time,
        signals,
        trajectory,
    }
}

const SIGNALS: [Signal; 4] = [Signal::Q, Signal::Qd, Signal::Qdd, Signal::Tau];
const FRANKA: [&str; 4] = ["q[*]", "dq[*]", "", "tau_J[*]"];
const FRANKA_NEWER: [&str; 4] = ["state.q[*]", "state.dq[*]", "", "state.tau_J[*]"];
const RTDE: [&str; 4] = ["actual_q_*", "actual_qd_*", "", "actual_current_*"];
const MUJOCO: [&str; 4] = ["qpos*", "qvel*", "qacc*", "qfrc_actuator*"];
const LEROBOT: [&str; 4] = ["observation.state*", "", "", ""];
const TOPICS: [&str; 4] = ["*/position", "*/velocity", "", "*/effort"];

/// Sources: libfranka, `logToCSV` (time is `toMSec()`); Universal Robots, guide to the real-time data exchange; `MuJoCo`, `mjData`;
/// `LeRobotDataset`, version 2; `PlotJuggler`, its exporter of CSV.
const PROGRAMS: [Program; 6] = [
    program("libfranka", ("duration", "ms"), FRANKA, ""),
    program("libfranka", ("time", "ms"), FRANKA_NEWER, ""),
    program("Universal Robots", ("timestamp", "s"), RTDE, ""),
    program("MuJoCo", ("time", "s"), MUJOCO, "episode"),
    program("LeRobot", ("timestamp", "s"), LEROBOT, "episode_index"),
    program("PlotJuggler", ("__time", "s"), TOPICS, ""),
];

impl Program {
    /// The program that wrote these columns.
    fn of(headers: &[String]) -> Option<&'static Self> {
        PROGRAMS.iter().find(|program| {
            let time = headers.iter().any(|header| header == program.time.0);
            time && !like(headers, program.signals[0]).is_empty()
        })
    }
}

/// The columns that match a pattern.
fn like(headers: &[String], pattern: &str) -> Vec<String> {
    let (before, after) = pattern.split_once('*').unwrap_or((pattern, ""));
    let own = |header: &&String| {
        let middle = header
            .strip_prefix(before)
            .and_then(|rest| rest.strip_suffix(after));
        middle.is_some_and(|middle| match before {
            "" => !middle.is_empty(),
            _ => middle.bytes().all(|byte| byte.is_ascii_digit()),
        })
    };
    headers.iter().filter(own).cloned().collect()
}

/// The unit of a column of time that does not state it, if the program that wrote it is known.
pub(super) fn unit_of_time(headers: &[String], time: &str) -> Option<&'static str> {
    let program = Program::of(headers).filter(|program| program.time.0 == time)?;
    Some(program.time.1).filter(|unit| *unit != "s")
}

/// The settings that would name these columns, in backticks; `None` for unknown columns.
pub(super) fn advice(headers: &[String]) -> Option<String> {
    let setting = |name: &str, columns: &[String]| match columns {
        [] => String::new(),
        _ => format!(" `{name}` '{}'", columns.join(",")),
    };
    if let Some(program) = Program::of(headers) {
        let mut text = format!("these are columns of {}: try", program.name);
        text += &setting("t", &[program.time.0.to_owned()]);
        let signals = SIGNALS.into_iter().zip(program.signals);
        for (signal, pattern) in signals.filter(|(_, pattern)| !pattern.is_empty()) {
            text += &setting(signal.name(), &like(headers, pattern));
        }
        let episodes = headers
            .iter()
            .filter(|header| *header == program.trajectory);
        text += &setting("trajectory", &episodes.cloned().collect::<Vec<_>>());
        return Some(text + ", and `angles` 'all' where the joints turn");
    }
    let Some(time) = time(headers) else {
        return Some("where there is no column of time, `t` takes the seconds between rows".into());
    };
    let q = coordinates(headers);
    let angles: Vec<String> = q.iter().filter(|name| is_angle(name)).cloned().collect();
    let of = |is: fn(&str) -> bool, most: usize| -> Vec<String> {
        let own = headers.iter().filter(|header| is(header)).cloned();
        Some(own.collect::<Vec<_>>())
            .filter(|own| own.len() <= most)
            .unwrap_or_default()
    };
    let mut forces = of(is_force, q.len());
    // A name alone tells of as many as there are coordinates.
    if forces.len() != q.len() {
        forces.retain(|name| Stated::of(name).unit.is_some());
    }
    // Currents beside charges are their rates.
    if q.iter().any(|name| Stated::of(name).written == "C") {
        forces.retain(|name| Stated::of(name).written != "A");
    }
    let mut named = setting("t", &[time]) + &setting("q", &q) + &setting("angles", &angles);
    named += &setting("tau", &forces);
    named += &setting("trajectory", &of(is_run, 1));
    if !forces.is_empty() && forces.len() < q.len() {
        named += ", and in `actuated` the coordinates that the forces act on";
    }
    (!q.is_empty()).then(|| format!("perhaps{named}"))
}

/// Parts of names of forces.
const FORCES: [&str; 4] = ["tau", "torque", "effort", "force"];

fn is_force(header: &str) -> bool {
    let name = bare(header);
    let mut parts = name.split(|c: char| !c.is_alphabetic());
    match Stated::of(header).unit {
        Some(unit) => unit.is_of_force(),
        None => parts.any(|part| FORCES.contains(&part)),
    }
}

fn is_run(header: &str) -> bool {
    let name = bare(header);
    // What states a unit is measured.
    if Stated::of(header).unit.is_some() {
        return false;
    }
    let counted = ["_no", "_nr", "_id", " no", " nr", "_number"];
    let own = counted.iter().find_map(|end| name.strip_suffix(end));
    RUNS.contains(&own.unwrap_or(&name))
}

/// Names of columns that separate motions.
const RUNS: [&str; 14] = [
    "run",
    "take",
    "shot",
    "trial",
    "episode",
    "experiment",
    "motion",
    "test",
    "clip",
    "drop",
    "throw",
    "swing",
    "repetition",
    "series",
];

/// Prefixes of columns that are not coordinates: rates, forces, and columns that separate motions.
const OTHERS: [&str; 8] = ["qd", "tau", "trajectory", "v", "a_", "dq", "step", "frame"];

/// The name of a column without its unit and its prefix, in lower case.
fn bare(header: &str) -> String {
    let name = Stated::of(header).bare;
    let own = name.rsplit_once(": ").map_or(name, |(_, own)| own);
    let own = own.split(['(', '[']).next().unwrap_or_default();
    own.trim().to_lowercase()
}

/// The column that looks like time.
#[must_use]
pub fn time(headers: &[String]) -> Option<String> {
    let own = |header: &&String| is_time(&bare(header));
    headers.iter().find(own).cloned()
}

/// The only column that looks like time, where it states its unit.
pub(super) fn sure_time(headers: &[String]) -> Option<String> {
    let states = |header: &&String| {
        let unit = Stated::of(header).unit;
        *header == "__time" || unit.is_some_and(|unit| unit.is_of_time())
    };
    let mut all = headers.iter().filter(|header| is_time(&bare(header)));
    let only = all.next().filter(|_| all.next().is_none());
    only.filter(states).cloned()
}

/// How the names of angles begin.
const ANGLES: [&str; 11] = [
    "theta", "θ", "angle", "phi", "φ", "psi", "ψ", "winkel", "roll", "pitch", "yaw",
];

/// The columns that look like coordinates: `q1 …`, else those that state a unit of position, else angles, else x and y, else the first after
/// time with those that differ from it by a number. A column that states the unit of another quantity is excluded.
#[must_use]
pub fn coordinates(headers: &[String]) -> Vec<String> {
    let time = time(headers);
    let is_position = |header: &&String| {
        let stated = Stated::of(header);
        let other = stated.unit.is_some_and(|unit| !unit.is_of_position());
        let rate = stated.unit.is_none() && stated.written.to_lowercase().contains("hz");
        let name = bare(header);
        let known = OTHERS.iter().any(|other| name.starts_with(other));
        let known = known || is_run(header) || is_force(header);
        Some(*header) != time.as_ref() && !other && !rate && !known
    };
    let rest: Vec<&String> = headers.iter().filter(is_position).collect();
    let of = |begins: &[&str]| -> Vec<String> {
        let own = |h: &&&String| begins.iter().any(|begin| bare(h).starts_with(begin));
        rest.iter().filter(own).map(|h| (*h).clone()).collect()
    };
    let measured = rest.iter().filter(|h| Stated::of(h).unit.is_some());
    let measured = measured.map(|h| (*h).clone()).collect();
    let sets = [of(&["q"]), measured, of(&ANGLES), of(&["x", "y", "z"])];
    let found = sets.into_iter().find(|found| !found.is_empty());
    // Channels of one instrument differ by their numbers.
    let letters = |header: &str| header.replace(|c: char| c.is_ascii_digit(), "");
    let alike = |h: &&&String| letters(h) == letters(rest[0]);
    found.unwrap_or_else(|| rest.iter().filter(alike).map(|h| (*h).clone()).collect())
}

/// Whether the name of a column denotes an angle.
fn is_angle(header: &str) -> bool {
    let unit = Stated::of(header).unit;
    unit.is_some_and(|unit| unit.is_of_position() && unit.si() == "rad")
        || ANGLES.iter().any(|begin| bare(header).starts_with(begin))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_known_by_their_names_where_they_state_no_unit() {
        let each = |what: &str| [1, 2].map(|joint| format!("joint{joint}_{what}"));
        let headers = [
            vec!["time".into()],
            each("pos").into(),
            each("tau_cmd").into(),
        ]
        .concat();
        assert_eq!(
            advice(&headers).as_deref(),
            Some(
                "perhaps `t` 'time' `q` 'joint1_pos,joint2_pos' `tau` 'joint1_tau_cmd,joint2_tau_cmd'"
            )
        );
    }

    #[test]
    fn the_three_angles_of_a_body_are_coordinates() {
        let names = ["t", "theta", "phi", "psi"].map(String::from);
        assert_eq!(coordinates(&names), ["theta", "phi", "psi"]);
    }

    #[test]
    fn all_columns_of_a_machine_are_named() {
        let names = |list: &[&str]| list.iter().map(|own| (*own).to_owned()).collect::<Vec<_>>();
        let furuta = names(&["run", "t [s]", "arm [deg]", "rope (m)", "I [mA]", "note"]);
        let text = advice(&furuta).unwrap_or_default();
        let wanted = "perhaps `t` 't [s]' `q` 'arm [deg],rope (m)' `angles` 'arm [deg]' `tau` 'I [mA]' `trajectory` 'run', and in `actuated`";
        assert!(text.starts_with(wanted), "{text}");
        let channels = names(&["time_s", "CH1_mC", "CH2_mC", "torque", "test_no"]);
        assert_eq!(
            advice(&channels).unwrap_or_default(),
            "perhaps `t` 'time_s' `q` 'CH1_mC,CH2_mC' `trajectory` 'test_no'"
        );
        let joints = names(&["t", "swing_deg", "elbow_deg"]);
        assert!(
            advice(&joints)
                .unwrap_or_default()
                .contains("`q` 'swing_deg,elbow_deg'")
        );
        assert_eq!(sure_time(&names(&["time", "T_s", "q1"])), None);
        let alone = names(&["t", "x", "trial"]);
        assert_eq!(
            advice(&alone).unwrap_or_default(),
            "perhaps `t` 't' `q` 'x' `trajectory` 'trial'"
        );
    }

    #[test]
    fn a_column_whose_unit_is_a_rate_is_no_coordinate() {
        let names = |list: [&str; 3]| list.map(String::from);
        let gyroscope = names(["Time (s)", "Gyroscope x (rad/s)", "Absolute (rad/s)"]);
        assert!(coordinates(&gyroscope).is_empty());
        for unit in ["m/s^2", "°/s", "deg / s", "rad s^-1", "m·s⁻¹", "rpm"] {
            let rate = format!("angle rate [{unit}]");
            let headers = names(["t [s]", &rate, "angle (rad)"]);
            assert_eq!(coordinates(&headers), ["angle (rad)"], "{unit}");
        }
    }
}
