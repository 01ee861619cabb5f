//! The signals of a motion, listed once: all code that stores, reads or writes them uses this table.

use std::ops::Range;

use serde::{Deserialize, Serialize};

/// One value for each signal of a motion.
///
/// `Signals` without parameter holds the values of a whole motion, row-major `[rows, n]`, in SI units, where n is the number of
/// degrees of freedom; an unknown signal is empty. `Signals<&[f64]>` is one row of it, and
/// `Signals<Vec<String>>` the names of its columns in a file.
///
/// ```
/// use lagrangian_motion::{Signal, Signals};
/// let swing = Signals { q: vec![0.1, 0.2], qd: vec![1.0, 1.1], ..Signals::default() };
/// assert_eq!(swing.row(1, 1).qd, [1.1]);
/// assert!(swing.known().map(|(signal, _)| signal).eq([Signal::Q, Signal::Qd]));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Signals<T = Vec<f64>> {
    /// Generalised coordinates q; angles are unwrapped.
    pub q: T,
    /// Generalised velocities q̇.
    pub qd: T,
    /// Generalised accelerations q̈.
    pub qdd: T,
    /// Generalised forces τ, non-conservative and applied; a motion with unknown forces is free.
    pub tau: T,
    /// Momenta p = ∂L/∂q̇.
    pub p: T,
    /// Goals of position controllers, in the unit of q.
    pub goal: T,
    /// Gains kₚ of position controllers, in the unit of the controller.
    pub kp: T,
    /// Gains kᵈ of position controllers, in the unit of the controller.
    pub kd: T,
    /// Supply voltages of motors, V.
    pub supply: T,
    /// Whether motors are on: 0 where they are off.
    pub enabled: T,
    /// Rates of the momenta ṗ; files do not contain them.
    #[serde(skip)]
    pub pd: T,
}

/// The name of one of [`Signals`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signal {
    /// Generalised coordinates q.
    Q,
    /// Generalised velocities q̇.
    Qd,
    /// Generalised accelerations q̈.
    Qdd,
    /// Momenta p.
    P,
    /// Generalised forces τ.
    Tau,
    /// Rates of the momenta ṗ.
    Pd,
    /// Goals of position controllers.
    Goal,
    /// Gains kₚ of position controllers.
    Kp,
    /// Gains kᵈ of position controllers.
    Kd,
    /// Supply voltages of motors.
    Supply,
    /// Whether motors are on.
    Enabled,
}

impl Signal {
    /// All signals.
    pub const ALL: [Self; 11] = [
        Self::Q,
        Self::Qd,
        Self::Qdd,
        Self::P,
        Self::Tau,
        Self::Pd,
        Self::Goal,
        Self::Kp,
        Self::Kd,
        Self::Supply,
        Self::Enabled,
    ];

    /// The command signals of a drive, for motions with unknown forces.
    pub const OF_DRIVES: [Self; 5] = [Self::Goal, Self::Kp, Self::Kd, Self::Supply, Self::Enabled];

    /// Whether it is a command signal of a drive, which no sensor measures.
    #[must_use]
    pub fn is_of_drive(self) -> bool {
        Self::OF_DRIVES.contains(&self)
    }

    /// The signals in files, in the order of their columns.
    pub const IN_FILES: [Self; 10] = [
        Self::Q,
        Self::Qd,
        Self::Qdd,
        Self::P,
        Self::Tau,
        Self::Goal,
        Self::Kp,
        Self::Kd,
        Self::Supply,
        Self::Enabled,
    ];

    /// The prefix of its columns: `qd` of `qd1 … qdn`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Q => "q",
            Self::Qd => "qd",
            Self::Qdd => "qdd",
            Self::P => "p",
            Self::Tau => "tau",
            Self::Pd => "pd",
            Self::Goal => "goal",
            Self::Kp => "kp",
            Self::Kd => "kd",
            Self::Supply => "supply",
            Self::Enabled => "enabled",
        }
    }

    /// Whether its unit is that of q, or that of q over a time: values of an angle may be in degrees.
    pub fn has_the_unit_of_q(self) -> bool {
        self.order().is_some() || self == Self::Goal
    }

    /// Contents of its columns, in a few words.
    #[must_use]
    pub fn description(self) -> &'static str {
        match self {
            Self::Q => "coordinates q",
            Self::Qd => "velocities q̇; estimated from q if there are none",
            Self::Qdd => "accelerations q̈; estimated if there are none",
            Self::P => "momenta p = ∂L/∂q̇, in SI units, where they are known",
            Self::Tau => "forces and torques τ; none means a free motion",
            Self::Pd => "rates of the momenta ṗ; estimated where momenta are known",
            Self::Goal => "goals of position controllers, for logs without torque",
            Self::Kp => {
                "gains of position controllers; also a number, or a pattern such as 'kp{}' of the file's name"
            }
            Self::Kd => "damping gains of position controllers; also a number or a pattern",
            Self::Supply => "supply voltages of motors, V; also a number or a pattern",
            Self::Enabled => "whether motors are on: they are off where it is 0",
        }
    }

    /// Order of its derivative of the coordinate; `None` for momenta, forces and commands.
    #[must_use]
    pub fn order(self) -> Option<i32> {
        match self {
            Self::Q => Some(0),
            Self::Qd => Some(1),
            Self::Qdd => Some(2),
            _ => None,
        }
    }
}

impl<T> Signals<T> {
    /// The value of one signal.
    #[must_use]
    pub fn get(&self, signal: Signal) -> &T {
        self.as_ref().in_order()[signal as usize]
    }

    /// A mutable reference to the value of one signal.
    pub fn get_mut(&mut self, signal: Signal) -> &mut T {
        match signal {
            Signal::Q => &mut self.q,
            Signal::Qd => &mut self.qd,
            Signal::Qdd => &mut self.qdd,
            Signal::P => &mut self.p,
            Signal::Tau => &mut self.tau,
            Signal::Pd => &mut self.pd,
            Signal::Goal => &mut self.goal,
            Signal::Kp => &mut self.kp,
            Signal::Kd => &mut self.kd,
            Signal::Supply => &mut self.supply,
            Signal::Enabled => &mut self.enabled,
        }
    }

    /// All signals with their values.
    pub fn iter(&self) -> impl Iterator<Item = (Signal, &T)> {
        self.as_ref().into_iter()
    }

    /// All signals with mutable references to their values.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (Signal, &mut T)> {
        let Self {
            q,
            qd,
            qdd,
            tau,
            p,
            pd,
            goal,
            kp,
            kd,
            supply,
            enabled,
        } = self;
        let values = [q, qd, qdd, p, tau, pd, goal, kp, kd, supply, enabled];
        Signal::ALL.into_iter().zip(values)
    }

    /// The results of `f` for each signal.
    #[must_use]
    pub fn map<U>(self, mut f: impl FnMut(Signal, T) -> U) -> Signals<U> {
        Signals {
            q: f(Signal::Q, self.q),
            qd: f(Signal::Qd, self.qd),
            qdd: f(Signal::Qdd, self.qdd),
            p: f(Signal::P, self.p),
            tau: f(Signal::Tau, self.tau),
            pd: f(Signal::Pd, self.pd),
            goal: f(Signal::Goal, self.goal),
            kp: f(Signal::Kp, self.kp),
            kd: f(Signal::Kd, self.kd),
            supply: f(Signal::Supply, self.supply),
            enabled: f(Signal::Enabled, self.enabled),
        }
    }

    /// References to all values.
    #[must_use]
    pub fn as_ref(&self) -> Signals<&T> {
        Signals {
            q: &self.q,
            qd: &self.qd,
            qdd: &self.qdd,
            p: &self.p,
            tau: &self.tau,
            pd: &self.pd,
            goal: &self.goal,
            kp: &self.kp,
            kd: &self.kd,
            supply: &self.supply,
            enabled: &self.enabled,
        }
    }

    /// The values in the order of [`Signal::ALL`].
    fn in_order(self) -> [T; 11] {
        [
            self.q,
            self.qd,
            self.qdd,
            self.p,
            self.tau,
            self.pd,
            self.goal,
            self.kp,
            self.kd,
            self.supply,
            self.enabled,
        ]
    }
}

impl<T> IntoIterator for Signals<T> {
    type Item = (Signal, T);
    type IntoIter = std::iter::Zip<std::array::IntoIter<Signal, 11>, std::array::IntoIter<T, 11>>;

    fn into_iter(self) -> Self::IntoIter {
        Signal::ALL.into_iter().zip(self.in_order())
    }
}

impl<X> Signals<Vec<X>> {
    /// Fills empty signals from `other`.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let mut others = other.into_iter();
        self.map(|_, own| match others.next() {
            Some((_, other)) if own.is_empty() => other,
            _ => own,
        })
    }
}

impl Signals {
    /// The known signals with their values.
    pub fn known(&self) -> impl Iterator<Item = (Signal, &[f64])> {
        let values = self.iter().map(|(signal, x)| (signal, x.as_slice()));
        values.filter(|(_, x)| !x.is_empty())
    }

    /// Values of one signal, if it is known.
    #[must_use]
    pub fn values(&self, signal: Signal) -> Option<&[f64]> {
        Some(self.get(signal).as_slice()).filter(|x| !x.is_empty())
    }

    /// Row `k` of a motion of `n` degrees of freedom; unknown signals are empty.
    ///
    /// ```
    /// # use lagrangian_motion::Signals;
    /// let plane = Signals { q: vec![1.0, 2.0, 3.0, 4.0], ..Signals::default() };
    /// assert_eq!(plane.row(2, 1).q, [3.0, 4.0]);
    /// assert!(plane.row(2, 1).tau.is_empty());
    /// ```
    #[must_use]
    pub fn row(&self, n: usize, k: usize) -> Signals<&[f64]> {
        self.as_ref()
            .map(|_, x| x.get(k * n..(k + 1) * n).unwrap_or_default())
    }

    /// The rows of a range within the motion, of `n` degrees of freedom.
    #[must_use]
    pub fn rows(&self, n: usize, range: &Range<usize>) -> Self {
        let rows = range.start * n..range.end * n;
        self.as_ref()
            .map(|_, x| x.get(rows.clone()).unwrap_or_default().to_vec())
    }

    /// Keeps these rows, ascending, and drops the others.
    pub fn keep(&mut self, n: usize, rows: &[usize]) {
        for (_, values) in self.iter_mut().filter(|(_, x)| !x.is_empty()) {
            for (to, from) in rows.iter().enumerate() {
                values.copy_within(from * n..(from + 1) * n, to * n);
            }
            values.truncate(rows.len() * n);
        }
    }
}
