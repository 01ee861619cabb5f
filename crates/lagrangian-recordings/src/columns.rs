//! Resolution of the columns of a [`Layout`] among the headers of a file.

use serde::{Deserialize, Serialize};

use super::polar::{Place, Points};
use super::si::Scales;
use super::unit::Stated;
use super::{Layout, Polar, Sampling, programs};
use lagrangian_motion::error::{brief, shortened};
use lagrangian_motion::{Coordinate, Coordinates, Signal, Signals, Topology};
use lagrangian_motion::{Error, Result, shown};

/// Names of the columns that were used.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Columns {
    /// Column that separates trajectories.
    pub trajectory: Option<String>,
    /// Column of time.
    pub t: String,
    /// Columns of each signal, `[n]`, or empty; an empty name marks a coordinate without a column: a parameter does not
    /// move, and no force acts on the coordinate.
    pub signals: Signals<Vec<String>>,
    /// Columns of the file that were not used.
    pub ignored: Vec<String>,
    /// The first change of the joints that a bag names.
    pub renamed: Option<Renamed>,
}

/// The first message of a bag that names other joints than the first messages did.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Renamed {
    /// The number of the message; the first of its topic is 1.
    pub message: usize,
    /// Joints that are used, but missing from the message.
    pub missing: Vec<String>,
    /// Joints of the message that are not used.
    pub instead: Vec<String>,
    /// Number of messages that are omitted because they lack a joint that is used …
    pub omitted: usize,
    /// … and the number of all messages in the topic.
    pub messages: usize,
}

/// The columns of one file: names, positions, and the coordinates that they declare.
#[derive(Debug, Clone)]
pub(super) struct Resolved {
    pub(super) columns: Columns,
    pub(super) coordinates: Coordinates,
    /// Position of the trajectory column.
    pub(super) trajectory: Option<usize>,
    /// Positions of t and of the signals, in their order.
    pub(super) numbers: Vec<usize>,
    /// Factors of the numbers, t first; empty where all are 1.
    pub(super) factors: Vec<f64>,
    /// Seconds between rows, for a file without a column of time.
    pub(super) interval: Option<f64>,
    /// Coordinates that are angles of two points, whose columns follow those of the signals.
    pub(super) points: Vec<Points>,
    /// Decisions about the columns, in sentences.
    pub(super) notes: Vec<String>,
    pub(super) every: usize,
    pub(super) sample: Option<Sampling>,
}

impl Resolved {
    /// Positions of all columns that are read, that of the trajectory last.
    #[cfg_attr(
        target_family = "wasm",
        expect(dead_code, reason = "serves formats that a browser does not read")
    )]
    pub(super) fn used(&self) -> impl Iterator<Item = usize> {
        self.numbers.iter().copied().chain(self.trajectory)
    }

    /// The names of the number columns, in the order of `numbers`.
    pub(super) fn names(&self) -> impl Iterator<Item = &String> {
        let signals = self.columns.signals.iter().flat_map(|(_, names)| names);
        let given = signals.filter(|name| !name.is_empty());
        std::iter::once(&self.columns.t).chain(given)
    }
}

/// Finds the columns of `layout` among `headers`.
///
/// # Errors
/// [`Error::Columns`] if one is missing, doubled, or a signal has another number of columns than q.
pub(super) fn resolve(headers: &[String], layout: &Layout) -> Result<Resolved> {
    let finder = Finder::new(headers);
    let layout = &finder.as_headed(layout.clone());
    let mut notes = Vec::new();
    let t = layout.t.clone().unwrap_or_else(|| finder.time(&mut notes));
    let interval = layout.interval().filter(|_| !finder.has(&t));
    // Where rows are counted, another column takes the place of the column of time.
    let time = interval.map_or_else(|| finder.position(&t, "t"), |_| Ok(usize::MAX));
    let mut numbers = vec![time?];
    let default = || finder.has("trajectory").then(|| "trajectory".to_owned());
    let trajectory = layout.trajectory.clone().or_else(default);
    let at = |name: &String| finder.position(name, "trajectory");
    let trajectory_at = trajectory.as_ref().map(at).transpose()?;
    let signals = finder.signals(layout)?;
    let mut points = Vec::new();
    for (signal, names) in signals.iter() {
        for name in names.iter().filter(|name| !name.is_empty()) {
            let polar = layout.polar.iter().find(|polar| polar.name == *name);
            match polar.filter(|_| signal == Signal::Q) {
                Some(polar) => points.push((numbers.len(), polar)),
                None => numbers.push(finder.position(name, signal.name())?),
            }
        }
    }
    finder.each_used_once(&numbers)?;
    let points = finder.points(&points, &mut numbers)?;
    if let Some(seconds) = interval {
        numbers[0] = numbers[1];
        notes.push(format!("time is counted: the rows are {seconds} s apart"));
    }
    let is_used = |i: &usize| numbers.contains(i) || trajectory_at == Some(*i);
    let ignored = (0..headers.len()).filter(|i| !is_used(i));
    let ignored = ignored.map(|i| shown(&headers[i])).collect();
    let estimated = signals.qd.is_empty() || signals.qdd.is_empty();
    let coordinates = declare(&signals.q, layout, &finder)?;
    let columns = Columns {
        trajectory,
        t,
        signals,
        ignored,
        renamed: None,
    };
    let scales = Scales::of(&columns, &coordinates, headers, layout)?;
    notes.extend(scales.notes);
    Ok(Resolved {
        coordinates,
        columns,
        trajectory: trajectory_at,
        numbers,
        factors: scales.factors,
        interval,
        points,
        notes,
        every: layout.every.max(1),
        sample: layout
            .sample
            .map(|s| if estimated { s.for_estimates() } else { s }),
    })
}

/// The coordinates with the names `q`, as the layout declares them.
fn declare(q: &[String], layout: &Layout, finder: &Finder<'_>) -> Result<Coordinates> {
    let own = q.join(", ");
    let is_unknown = |name: &&String| *name != "all" && !q.contains(name);
    if let Some(name) = layout.angles.iter().find(is_unknown) {
        let finding =
            format!("'{name}' is declared as an angle but is not one of the coordinates {own}");
        return Err(finder.error(finding, "name coordinates with `angles`"));
    }
    if let Some(name) = layout.units.keys().find(|name| !q.contains(name)) {
        let finding = format!("'{name}' has a unit but is not one of the coordinates {own}");
        return Err(finder.error(finding, "name coordinates with `units`"));
    }
    if layout.degrees && layout.angles.is_empty() {
        let finding = "degrees are declared but no coordinate is an angle";
        return Err(finder.error(finding, "say which are with `angles`, q1,q2 or all"));
    }
    let is_angle = |name: &String| {
        let polar = layout.polar.iter().any(|polar| polar.name == *name);
        polar || layout.angles.iter().any(|a| a == name || a == "all")
    };
    let bare: Vec<&str> = q.iter().map(|name| Stated::without_unit(name)).collect();
    let is_alone = |own: &&str| bare.iter().filter(|bare| *bare == own).count() == 1;
    let coordinate = |name: &String| {
        let stated = Stated::of(name).unit.map(|unit| unit.si());
        let topology = match (layout.parameters.contains(name), is_angle(name)) {
            (true, _) => Topology::Parameter,
            (false, true) => Topology::Circle,
            (false, false) => Topology::Line,
        };
        let unit = match topology {
            Topology::Circle => "rad".into(),
            _ => layout
                .units
                .get(name)
                .cloned()
                .or(stated)
                .unwrap_or_default(),
        };
        let own = Some(Stated::without_unit(name)).filter(is_alone);
        Coordinate {
            name: shown(own.unwrap_or(name)),
            unit,
            topology,
        }
    };
    Ok(Coordinates(q.iter().map(coordinate).collect()))
}

struct Finder<'a> {
    headers: &'a [String],
    /// The same without their units.
    bare: Vec<&'a str>,
}

impl<'a> Finder<'a> {
    fn new(headers: &'a [String]) -> Self {
        let bare = headers.iter().map(|header| Stated::without_unit(header));
        Self {
            headers,
            bare: bare.collect(),
        }
    }

    fn has(&self, name: &str) -> bool {
        self.headers.iter().any(|h| h == name)
    }

    /// A layout whose names are those of the file, with their units.
    fn as_headed(&self, mut layout: Layout) -> Layout {
        let own = |name: String| self.named(&name).unwrap_or(name);
        let all = |names: Vec<String>| names.into_iter().map(own).collect();
        layout.columns = layout.columns.map(|_, names| all(names));
        layout.actuated = all(layout.actuated);
        layout.angles = all(layout.angles);
        layout.parameters = all(layout.parameters);
        layout.t = layout.t.map(own);
        layout.trajectory = layout.trajectory.map(own);
        let units = layout.units.into_iter();
        layout.units = units.map(|(name, unit)| (own(name), unit)).collect();
        layout
    }

    /// The column of time when none is named: `t`, else the only one that looks like time and states its unit.
    fn time(&self, notes: &mut Vec<String>) -> String {
        let sure = programs::sure_time(self.headers).filter(|_| !self.has("t"));
        if let Some(name) = &sure {
            notes.push(format!("time is taken from column '{name}'"));
        }
        sure.unwrap_or_else(|| "t".into())
    }

    /// Indices of the points of angles, whose columns are added to `numbers`: x at the index of the angle, the others at the end.
    fn points(&self, angles: &[(usize, &Polar)], numbers: &mut Vec<usize>) -> Result<Vec<Points>> {
        for (k, (place, polar)) in angles.iter().enumerate() {
            numbers.insert(place + k, self.position(&polar.point[0], "polar")?);
        }
        let mut points = Vec::new();
        for (at, polar) in angles
            .iter()
            .enumerate()
            .map(|(k, (at, polar))| (at + k, polar))
        {
            let columns = polar.point.iter().chain(&polar.about);
            let columns = columns.filter(|name| name.parse::<f64>().is_err());
            let units: Vec<Stated<'_>> = columns.map(|name| Stated::of(name)).collect();
            let written: Vec<&str> = units.iter().map(|unit| unit.written).collect();
            let same = written.windows(2).all(|pair| pair[0] == pair[1]);
            if !same
                || !units
                    .iter()
                    .all(|stated| stated.unit.is_none_or(|u| u.si() == "m"))
            {
                let finding = format!("the columns of '{polar}' are in {}", written.join(", "));
                let remedy = "an angle needs x and y of both points in the same unit of length: rename or convert them";
                return Err(self.error(finding, remedy));
            }
            let mut place = |name: &String| -> Result<usize> {
                numbers.push(self.position(name, "polar")?);
                Ok(numbers.len() - 1)
            };
            let y = place(&polar.point[1])?;
            let mut about = [Place::Number(0.0); 2];
            for (own, name) in about.iter_mut().zip(&polar.about) {
                *own = match name.parse::<f64>() {
                    Ok(x) if x.is_finite() && !self.has(name) => Place::Number(x),
                    _ => Place::At(place(name)?),
                };
            }
            points.push(Points { at, y, about });
        }
        Ok(points)
    }

    fn error(&self, finding: impl Into<String>, remedy: impl Into<String>) -> Error {
        const SHOWN: usize = 40;
        const LETTERS: usize = 800;
        let all = self.headers.len();
        let mut letters = 0;
        let shown = self.headers.iter().take(SHOWN).map(|name| shortened(name));
        let shown = shown.take_while(|name| {
            letters += name.chars().count();
            letters < LETTERS
        });
        let shown: Vec<String> = shown.collect();
        let mut found = shown.join(", ");
        if all > shown.len() {
            found += &format!(", … {all} in all");
        }
        Error::Columns {
            finding: brief(&finding.into()),
            found,
            remedy: remedy.into(),
        }
    }

    /// A remedy, with the columns that look like the required ones.
    fn advised(&self, remedy: impl Into<String>) -> String {
        const LONGEST: usize = 800;
        let advice = programs::advice(self.headers).map(|advice| format!("; {advice}"));
        let advice = advice.filter(|advice| advice.len() < LONGEST);
        remedy.into() + &advice.unwrap_or_default()
    }

    fn position(&self, name: &str, setting: &str) -> Result<usize> {
        let mut at = (0..self.headers.len()).filter(|&i| self.headers[i] == name);
        let (finding, remedy) = match (at.next(), at.next()) {
            (Some(i), None) => return Ok(i),
            (None, _) => (
                format!("no column '{name}'"),
                self.advised(format!("name the right one with `{setting}`")),
            ),
            (Some(_), Some(_)) => (
                format!("there are two columns '{name}'"),
                format!("rename one of them, or name another with `{setting}`"),
            ),
        };
        Err(self.error(finding, remedy))
    }

    /// The columns of each signal, each by its own rule.
    fn signals(&self, layout: &Layout) -> Result<Signals<Vec<String>>> {
        let named = &layout.columns;
        let q = self.with_parameters(self.coordinates(layout)?, layout)?;
        let moving = q.iter().map(|name| !layout.parameters.contains(name));
        let moving: Vec<bool> = moving.collect();
        let mut signals = Signals {
            qd: self.rates(&named.qd, "qd", &moving)?,
            qdd: self.rates(&named.qdd, "qdd", &moving)?,
            p: self.momenta(&named.p, &moving)?,
            tau: self.forces(layout, &q)?,
            q,
            ..Signals::default()
        };
        for signal in Signal::OF_DRIVES {
            let columns = self.commands(layout, signal, signals.q.len())?;
            *signals.get_mut(signal) = columns;
        }
        if signals.goal.is_empty() {
            self.refuse_drives_without_goals(layout, &signals)?;
        }
        if signals.tau.is_empty() {
            self.refuse_forces_of_unknown_units()?;
        }
        Ok(signals)
    }

    /// Refuses a column with the name of a force, `tau1`, and a unit that is none of ours: without it a driven motion would pass for a free
    /// one.
    fn refuse_forces_of_unknown_units(&self) -> Result<()> {
        let is_unknown = |header: &&String| {
            let own = Stated::of(header);
            let number = own.bare.strip_prefix(Signal::Tau.name());
            let is_number = |k: &str| !k.is_empty() && k.bytes().all(|b| b.is_ascii_digit());
            number.is_some_and(is_number) && !own.written.is_empty() && own.unit.is_none()
        };
        let Some(name) = self.headers.iter().find(is_unknown) else {
            return Ok(());
        };
        let finding = format!("the unit of the force '{}' is not known", shown(name));
        let remedy =
            "name the column with `tau`, for its numbers as they are, or give N, mN, N·m, Nmm, A …";
        Err(self.error(finding, remedy))
    }

    /// The columns of drive commands: as many as coordinates, or one for all of them. By default only goals are searched,
    /// and their gains and supply if goals are found.
    fn commands(&self, layout: &Layout, signal: Signal, n: usize) -> Result<Vec<String>> {
        let (named, name) = (layout.columns.get(signal), signal.name());
        let goals = !layout.columns.goal.is_empty() || self.numbered("goal").len() == n;
        if named.is_empty() && (!goals || layout.drive.constant(signal).is_some()) {
            return Ok(Vec::new());
        }
        let mut found = self.named_or_numbered(named, name);
        if signal != Signal::Goal && found.len() == 1 {
            found.resize(n, String::new());
        }
        self.one_each(found, named.is_empty(), name, n)
    }

    fn refuse_drives_without_goals(
        &self,
        layout: &Layout,
        signals: &Signals<Vec<String>>,
    ) -> Result<()> {
        let is_given = |signal: &&Signal| {
            !signals.get(**signal).is_empty() || layout.drive.constant(**signal).is_some()
        };
        let Some(signal) = Signal::OF_DRIVES.iter().find(is_given) else {
            return match layout.drive.si {
                true => Err(self.error(
                    "gains are in SI units, but there are no goals",
                    "name the columns of the goals with `goal`",
                )),
                false => Ok(()),
            };
        };
        let finding = format!("`{}` is given, but there are no goals", signal.name());
        Err(self.error(finding, "name the columns of the goals with `goal`"))
    }

    fn coordinates(&self, layout: &Layout) -> Result<Vec<String>> {
        let mut named = layout.columns.q.clone();
        let angles = layout.polar.iter().map(|polar| polar.name.clone());
        let angles: Vec<String> = angles.filter(|name| !named.contains(name)).collect();
        named.extend(angles);
        if !named.is_empty() {
            return Ok(named);
        }
        let q = self.numbered("q");
        if q.is_empty() {
            let remedy = "name the columns of the coordinates with `q`, such as theta1,theta2";
            return Err(self.error("no column 'q1'", self.advised(remedy)));
        }
        self.unbroken("q", q.len(), q.len())?;
        Ok(q)
    }

    /// The coordinates, and after them the parameters that are not among them.
    fn with_parameters(&self, mut q: Vec<String>, layout: &Layout) -> Result<Vec<String>> {
        for (k, name) in layout.parameters.iter().enumerate() {
            if layout.parameters[..k].contains(name) {
                let finding = format!("'{name}' is named twice as a parameter");
                return Err(self.error(finding, "name it once with `parameters`"));
            }
            if layout.angles.contains(name) {
                let finding = format!("'{name}' is declared as an angle and as a parameter");
                let remedy =
                    "a parameter is a number on a line: omit it from `angles` or from `parameters`";
                return Err(self.error(finding, remedy));
            }
            if !q.contains(name) {
                self.position(name, "parameters")?;
                q.push(name.clone());
            }
        }
        if q.iter().all(|name| layout.parameters.contains(name)) {
            let finding = format!("all coordinates are parameters ({})", q.join(", "));
            return Err(self.error(finding, "name the coordinates that move with `q`"));
        }
        Ok(q)
    }

    /// The columns of a signal: one for each coordinate, or for each that moves; the others have an empty name.
    fn rates(&self, named: &[String], prefix: &str, moving: &[bool]) -> Result<Vec<String>> {
        let found = self.named_or_numbered(named, prefix);
        if found.len() == moving.iter().filter(|m| **m).count() {
            let mut found = found.into_iter();
            let own = |m: &bool| m.then(|| found.next()).flatten().unwrap_or_default();
            return Ok(moving.iter().map(own).collect());
        }
        self.one_each(found, named.is_empty(), prefix, moving.len())
    }

    fn named_or_numbered(&self, named: &[String], prefix: &str) -> Vec<String> {
        match named.is_empty() {
            true => self.numbered(prefix),
            false => named.to_vec(),
        }
    }

    /// Refuses columns of a signal that are not one for each of `n` coordinates.
    fn one_each(
        &self,
        found: Vec<String>,
        by_default: bool,
        prefix: &str,
        n: usize,
    ) -> Result<Vec<String>> {
        let (count, names) = (found.len(), found.join(", "));
        if by_default {
            self.unbroken(prefix, count, n)?;
        }
        if count == 0 || count == n {
            return Ok(found);
        }
        let finding = format!("{count} columns for {prefix} ({names}) but {n} for q");
        let remedy =
            format!("name one for each coordinate with `{prefix}`, or the coordinates with `q`");
        Err(self.error(finding, remedy))
    }

    /// The columns of the momenta; by default only if there is one for each coordinate, since `p` may be a pressure.
    fn momenta(&self, named: &[String], moving: &[bool]) -> Result<Vec<String>> {
        let count = moving.iter().filter(|m| **m).count();
        let found = self.numbered("p").len();
        if named.is_empty() && found != moving.len() && found != count {
            return Ok(Vec::new());
        }
        self.rates(named, "p", moving)
    }

    /// The column of the force on each coordinate: as many as `q`, or fewer that name the coordinates they act on.
    fn forces(&self, layout: &Layout, q: &[String]) -> Result<Vec<String>> {
        let (n, by_default) = (q.len(), layout.columns.tau.is_empty());
        let standard = |i: usize| Some((i, self.named(&format!("tau{}", i + 1))?));
        let (numbered, standard): (Vec<usize>, Vec<String>) = (0..n).filter_map(standard).unzip();
        let found = match by_default {
            true => standard,
            false => layout.columns.tau.clone(),
        };
        if layout.actuated.is_empty() && (found.is_empty() || found.len() == n) {
            let more = by_default && !found.is_empty() && self.numbered("tau").len() > n;
            let found = if more { self.numbered("tau") } else { found };
            return self.one_each(found, by_default, "tau", n);
        }
        let at = if !layout.actuated.is_empty() {
            self.declared_as_actuated(&found, layout, q)?
        } else if by_default {
            numbered
        } else {
            self.named_like(&found, q)?
        };
        let mut tau = vec![String::new(); n];
        for (i, column) in at.into_iter().zip(found) {
            if !tau[i].is_empty() {
                let finding = format!("'{}' and '{column}' both act on '{}'", tau[i], q[i]);
                return Err(self.error(finding, "name each coordinate once with `actuated`"));
            }
            tau[i] = column;
        }
        Ok(tau)
    }

    fn declared_as_actuated(
        &self,
        found: &[String],
        layout: &Layout,
        q: &[String],
    ) -> Result<Vec<usize>> {
        let names = &layout.actuated;
        if found.len() != names.len() {
            let finding = format!(
                "{} columns for tau ({}) but {} actuated coordinates ({})",
                found.len(),
                found.join(", "),
                names.len(),
                names.join(", ")
            );
            let remedy = "name one column with `tau` for each coordinate of `actuated`";
            return Err(self.error(finding, remedy));
        }
        let position = |name: &String| {
            q.iter().position(|own| own == name).ok_or_else(|| {
                let q = q.join(", ");
                let finding = format!(
                    "'{name}' is declared as actuated but is not one of the coordinates {q}"
                );
                self.error(finding, "name coordinates with `actuated`")
            })
        };
        names.iter().map(position).collect()
    }

    /// Coordinates whose names or numbers appear in the names of the columns: `elbow_torque` of `elbow`, `u2` of `q2`.
    fn named_like(&self, found: &[String], q: &[String]) -> Result<Vec<usize>> {
        let number = |name: &str| -> Option<usize> {
            let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
            name[letters.len()..].parse().ok()
        };
        let like = |column: &String| {
            let words = column.split(|c: char| !c.is_alphanumeric());
            let same_word = |i: &usize| words.clone().any(|word| word == q[*i]);
            let same_number = |i: &usize| number(&q[*i]).is_some_and(|k| number(column) == Some(k));
            let by_word: Vec<usize> = (0..q.len()).filter(same_word).collect();
            let by_number: Vec<usize> = (0..q.len()).filter(same_number).collect();
            match (&by_word[..], &by_number[..]) {
                (&[i], _) | (&[], &[i]) => Some(i),
                _ => None,
            }
        };
        found.iter().map(like).collect::<Option<_>>().ok_or_else(|| {
            let (count, names, n) = (found.len(), found.join(", "), q.len());
            let finding = format!("{count} columns for tau ({names}) but {n} for q");
            let remedy = "name one for each coordinate with `tau`, or say with `actuated` which coordinates they act on: the forces on the others are then 0";
            self.error(finding, remedy)
        })
    }

    /// The column of this name, else the only one of this name with a unit after it, such as `q1 [deg]`.
    fn named(&self, name: &str) -> Option<String> {
        if self.has(name) {
            return Some(name.into());
        }
        let mut with_unit = (0..self.bare.len()).filter(|i| self.bare[*i] == name);
        let only = with_unit.next().filter(|_| with_unit.next().is_none());
        only.map(|i| self.headers[i].clone())
    }

    /// The consecutive columns `q1, q2, …`.
    fn numbered(&self, prefix: &str) -> Vec<String> {
        let names = (1..).map_while(|i| self.named(&format!("{prefix}{i}")));
        names.collect()
    }

    /// Refuses q1, q3 without q2, and qd2 without qd1.
    fn unbroken(&self, prefix: &str, found: usize, n: usize) -> Result<()> {
        let number = |bare: &str| -> Option<usize> {
            let digits = bare.strip_prefix(prefix)?;
            let is_number = digits.bytes().all(|b| b.is_ascii_digit());
            is_number.then(|| digits.parse().ok()).flatten()
        };
        let is_beyond = |bare: &str| number(bare).is_some_and(|i| i > found);
        let Some(beyond) = self.bare.iter().copied().position(is_beyond) else {
            return Ok(());
        };
        let beyond = &self.headers[beyond];
        let missing = found + 1;
        let finding = format!("column '{beyond}' is there but '{prefix}{missing}' is not");
        let count = if n > 0 {
            format!("{n} ")
        } else {
            String::new()
        };
        Err(self.error(
            finding,
            format!("name the {count}columns to use with `{prefix}`"),
        ))
    }

    fn each_used_once(&self, numbers: &[usize]) -> Result<()> {
        let is_repeated = |k: &usize| numbers[..*k].contains(&numbers[*k]);
        let Some(k) = (0..numbers.len()).find(is_repeated) else {
            return Ok(());
        };
        let finding = format!(
            "column '{}' is used for two signals",
            self.headers[numbers[k]]
        );
        Err(self.error(
            finding,
            "correct `t`, `q`, `qd`, `qdd`, `p`, `tau` or those of the drives",
        ))
    }
}
