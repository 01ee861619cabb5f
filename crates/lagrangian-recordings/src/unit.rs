//! Units in the names of columns: `Time (ms)`, `Angle [deg]`, `v (cm/s)`, `theta_deg`.

use std::f64::consts::{PI, TAU};

use lagrangian_motion::Signal;

/// The quantity that a unit measures, apart from derivatives by time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Time.
    Time,
    /// A length.
    Length,
    /// An angle.
    Angle,
    /// A force, a torque, or the current of a motor.
    Force,
}

/// A unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    quantity: Quantity,
    /// Number of divisions by a second.
    order: i32,
    /// Its value in SI units.
    pub(super) factor: f64,
    /// The SI unit before division by seconds.
    si: &'static str,
}

use Quantity::{Angle, Force, Length, Time};

/// Units, by their names without powers and blanks.
const UNITS: [(&str, Quantity, f64, &str); 27] = [
    ("s sec secs second seconds", Time, 1.0, "s"),
    ("ms msec millis millisecond milliseconds", Time, 1e-3, "s"),
    ("us usec micros microsecond microseconds", Time, 1e-6, "s"),
    ("ns nsec nanosecond nanoseconds", Time, 1e-9, "s"),
    ("min minute minutes", Time, 60.0, "s"),
    ("m meter meters metre metres", Length, 1.0, "m"),
    ("cm centimeter centimeters centimetre", Length, 1e-2, "m"),
    ("mm millimeter millimeters millimetre", Length, 1e-3, "m"),
    ("um micrometer micrometers", Length, 1e-6, "m"),
    ("km kilometer kilometers", Length, 1e3, "m"),
    ("rad rads radian radians", Angle, 1.0, "rad"),
    ("mrad", Angle, 1e-3, "rad"),
    ("deg degs degree degrees", Angle, PI / 180.0, "rad"),
    ("rev revolution revolutions turn turns", Angle, TAU, "rad"),
    ("N newton newtons", Force, 1.0, "N"),
    ("mN", Force, 1e-3, "N"),
    ("uN", Force, 1e-6, "N"),
    ("kN", Force, 1e3, "N"),
    ("lbf", Force, 4.448_221_615, "N"),
    ("Nm", Force, 1.0, "N·m"),
    ("mNm Nmm", Force, 1e-3, "N·m"),
    ("Ncm cNm", Force, 1e-2, "N·m"),
    ("kNm", Force, 1e3, "N·m"),
    ("uNm", Force, 1e-6, "N·m"),
    ("A amp amps ampere amperes", Force, 1.0, "A"),
    ("mA", Force, 1e-3, "A"),
    ("uA", Force, 1e-6, "A"),
];

/// Other forms of a division by seconds.
const POWERS: [(&str, &str); 6] = [
    ("s⁻¹", "/s"),
    ("s^-1", "/s"),
    ("s-1", "/s"),
    ("s⁻²", "/s2"),
    ("s^-2", "/s2"),
    ("s-2", "/s2"),
];

/// Units at the end of a name without brackets, after `_`.
const ENDINGS: [&str; 10] = [
    "ms", "us", "ns", "deg", "degrees", "rad", "mm", "cm", "rpm", "Nm",
];
/// Those after a name of time alone: elsewhere `_s` is an index.
const OF_TIMES: [&str; 4] = ["s", "sec", "secs", "seconds"];

impl Unit {
    /// The radian.
    pub(super) const RADIAN: Self = Self {
        quantity: Angle,
        order: 0,
        factor: 1.0,
        si: "rad",
    };

    /// The unit that a text denotes.
    pub(super) fn of(text: &str) -> Option<Self> {
        let letters = |c: char| match c {
            'µ' | 'μ' => Some('u'),
            '²' => Some('2'),
            ' ' | '^' | '·' | '*' | '⋅' => None,
            other => Some(other),
        };
        let mut plain = text.replace('°', "deg");
        for (power, below) in POWERS {
            plain = plain.replace(power, below);
        }
        let plain: String = plain.chars().filter_map(letters).collect();
        if plain.eq_ignore_ascii_case("rpm") {
            let per_second = Self::of("rad/s")?;
            let factor = TAU / 60.0;
            return Some(Self {
                factor,
                ..per_second
            });
        }
        let (name, below) = plain.split_once('/').unwrap_or((&plain, ""));
        let order = match below {
            "" if !plain.contains('/') => 0,
            "s" | "sec" | "second" => 1,
            "s2" | "sec2" | "s/s" => 2,
            _ => return None,
        };
        let (_, quantity, factor, si) = UNITS.into_iter().find(|(names, ..)| {
            let same = |own: &str| own == name || own.len() > 2 && own.eq_ignore_ascii_case(name);
            names.split(' ').any(same)
        })?;
        Some(Self {
            quantity,
            order,
            factor,
            si,
        })
    }

    /// The SI unit of its converted values.
    pub(super) fn si(&self) -> String {
        let below = ["", "/s", "/s²"].get(self.order as usize);
        format!("{}{}", self.si, below.unwrap_or(&""))
    }

    /// Whether it can be a unit of time.
    pub(super) fn is_of_time(&self) -> bool {
        self.quantity == Time && self.order == 0
    }

    /// Whether it can be a unit of position.
    pub(super) fn is_of_position(&self) -> bool {
        matches!(self.quantity, Length | Angle) && self.order == 0
    }

    /// Whether it can be a unit of forces.
    pub(super) fn is_of_force(&self) -> bool {
        self.quantity == Force && self.order == 0
    }

    /// Whether it can be a unit of this signal.
    pub(super) fn fits(&self, signal: Signal) -> bool {
        match signal.order() {
            Some(order) => matches!(self.quantity, Length | Angle) && self.order == order,
            None if signal == Signal::Goal => self.is_of_position(),
            None if signal == Signal::Tau => self.is_of_force(),
            None => true,
        }
    }
}

/// Names of columns of time.
const TIMES: [&str; 9] = [
    "t",
    "time",
    "zeit",
    "temps",
    "tiempo",
    "x_value",
    "__time",
    "timestamp",
    "elapsed",
];

/// Whether a name without a unit is one of time.
pub(super) fn is_time(name: &str) -> bool {
    TIMES.iter().any(|own| own.eq_ignore_ascii_case(name))
}

/// The name of a column, split from the unit in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stated<'a> {
    /// The name without its unit.
    pub(super) bare: &'a str,
    /// The unit as written; empty without one.
    pub(super) written: &'a str,
    /// The unit, where it is known.
    pub(super) unit: Option<Unit>,
}

impl<'a> Stated<'a> {
    /// Splits a name from its unit.
    pub(super) fn of(name: &'a str) -> Self {
        let bracket = |open: char, close: char| {
            let (bare, written) = name.strip_suffix(close)?.rsplit_once(open)?;
            // Text in brackets may be an index.
            let is_unit = written.chars().any(|c| c.is_alphabetic() || c == '°');
            is_unit.then_some((bare, written))
        };
        let ending = || {
            let (bare, written) = name.rsplit_once('_')?;
            // T is a period, or a temperature.
            let time = || bare != "T" && is_time(bare) && OF_TIMES.contains(&written);
            (ENDINGS.contains(&written) || time()).then_some((bare, written))
        };
        let found = bracket('(', ')')
            .or_else(|| bracket('[', ']'))
            .or_else(ending);
        let (bare, written) = found.unwrap_or((name, ""));
        Self {
            bare: bare.trim(),
            written: written.trim(),
            unit: Unit::of(written),
        }
    }

    /// A name without its unit, if the unit is known.
    pub(super) fn without_unit(name: &'a str) -> &'a str {
        let stated = Self::of(name);
        match stated.unit.is_some() && !stated.bare.is_empty() {
            true => stated.bare,
            false => name,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn names_state_their_units_in_brackets_and_endings() {
        for (name, bare, si, factor) in [
            ("Time (s)", "Time", "s", 1.0),
            ("Latest: Time (ms)", "Latest: Time", "s", 1e-3),
            ("Angle [deg]", "Angle", "rad", PI / 180.0),
            ("Winkel (°)", "Winkel", "rad", PI / 180.0),
            ("v (cm/s)", "v", "m/s", 1e-2),
            ("ω (rad s⁻¹)", "ω", "rad/s", 1.0),
            ("a (m·s^-2)", "a", "m/s²", 1.0),
            ("Gyroscope x (rad/s)", "Gyroscope x", "rad/s", 1.0),
            ("Acceleration (m/s^2)", "Acceleration", "m/s²", 1.0),
            ("a (mm/s²)", "a", "m/s²", 1e-3),
            ("ω (rpm)", "ω", "rad/s", TAU / 60.0),
            ("torque (N·m)", "torque", "N·m", 1.0),
            ("torque [mNm]", "torque", "N·m", 1e-3),
            ("theta_deg", "theta", "rad", PI / 180.0),
            ("time_us", "time", "s", 1e-6),
        ] {
            let stated = Stated::of(name);
            let unit = stated.unit.unwrap();
            assert_eq!(
                (stated.bare, unit.si().as_str(), unit.factor),
                (bare, si, factor),
                "{name}"
            );
        }
        for name in [
            "q[0]",
            "x",
            "x (px)",
            "angle (smoothed)",
            "actual_q_0",
            "x_s",
        ] {
            assert_eq!(Stated::of(name).unit, None, "{name}");
        }
    }
}
