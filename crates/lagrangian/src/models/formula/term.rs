//! Terms of a Lagrangian in closed form: a product of powers of lines, of one harmonic of the angles, and of velocities.

use num_dual::DualNum;
use serde::{Deserialize, Serialize};

use lagrangian_mechanics::expression::Value;
use lagrangian_motion::Coordinates;

/// A term Πᵢ qᵢ^pᵢ · cos(k·q) or sin(k·q) · the product of up to two velocities.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// The exponent p of each coordinate, `[n]`; empty for none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub powers: Vec<i8>,
    /// The multiple k of each coordinate in the harmonic, `[n]`; empty for none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub turns: Vec<i8>,
    /// Whether the harmonic is a sine; else it is a cosine.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub sine: bool,
    /// The coordinates whose velocities are multiplied, at most two, in increasing order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub speeds: Vec<usize>,
    /// Whether it is a term of the dissipation function (Rayleigh 1873) while a law is sought, so that a damper between two coordinates
    /// is found as any term is; a formula has it among its friction.
    #[serde(skip)]
    pub(super) damps: bool,
}

/// The largest number of coordinates.
pub(crate) const MOST_COORDINATES: usize = 8;

/// A number for each coordinate, and zeros: states are many and terms small, so that nothing is allocated for one.
pub(crate) type Row<D> = [D; MOST_COORDINATES];

/// The part of a term that depends on q alone, with its slopes.
#[derive(Debug, Clone)]
pub(super) struct Position<D> {
    pub(super) value: D,
    /// ∂/∂q, `[n]`, and zeros.
    pub(super) slope: Row<D>,
}

impl Term {
    /// Whether it is a part of the kinetic energy: a product of two velocities.
    #[must_use]
    pub fn is_kinetic(&self) -> bool {
        self.speeds.len() == 2 && !self.damps
    }

    /// The dampers between these coordinates: each a term q̇ᵢ q̇ⱼ of the dissipation function.
    pub(super) fn dampers(coordinates: &Coordinates) -> impl Iterator<Item = Self> {
        let moving = || (0..coordinates.dof()).filter(|i| !coordinates.is_parameter(*i));
        let pairs =
            moving().flat_map(move |a| moving().filter(move |b| a < *b).map(move |b| vec![a, b]));
        pairs.map(|speeds| Self {
            speeds,
            damps: true,
            ..Self::default()
        })
    }

    /// Whether it couples two velocities, whatever the place.
    pub(crate) fn couples_alone(&self) -> bool {
        let still = |all: &[i8]| all.iter().all(|k| *k == 0);
        let two = matches!(*self.speeds, [a, b] if a != b);
        two && !self.damps && still(&self.powers) && still(&self.turns)
    }

    /// Whether a linear system of lines has it: at most two coordinates or velocities are multiplied.
    pub(super) fn is_linear(&self) -> bool {
        let powers: i8 = self.powers.iter().map(|k| k.abs()).sum();
        let positive = self.powers.iter().all(|k| *k >= 0);
        let harmonic = self.sine || self.turns.iter().any(|k| *k != 0);
        positive && !harmonic && powers as usize + self.speeds.len() <= 2
    }

    /// Whether its value changes with coordinate `i`.
    pub(crate) fn depends_on(&self, i: usize) -> bool {
        let uses = |all: &[i8]| all.get(i).is_some_and(|k| *k != 0);
        uses(&self.powers) || uses(&self.turns)
    }

    /// Whether its value changes with each of the coordinates.
    pub(super) fn places(&self) -> Vec<bool> {
        let count = self.powers.len().max(self.turns.len());
        (0..count).map(|i| self.depends_on(i)).collect()
    }

    /// Whether coordinate `i` or its velocity has a part in it.
    pub(super) fn uses(&self, i: usize) -> bool {
        self.depends_on(i) || self.speeds.contains(&i)
    }

    /// How much there is to write: exponents and multiples, then whether they are of several coordinates, and velocities.
    pub(crate) fn complexity(&self) -> f64 {
        let mut sum = if self.sine { 0.05 } else { 0.0 };
        for k in self.powers.iter().chain(&self.turns).filter(|k| **k != 0) {
            // A negative exponent stands for a quotient.
            sum += f64::from(k.unsigned_abs()) + if *k < 0 { 0.15 } else { 0.1 };
        }
        sum + match *self.speeds {
            [] => 0.3,
            [_] => 0.9,
            [a, b] if a == b => 0.5,
            _ if self.damps => 1.5,
            // A coupling alone is rare, and of a linear system another Lagrangian has it.
            _ if sum == 0.0 => 3.0,
            _ => 0.8,
        }
    }

    /// Whether it belongs to these coordinates: as many, nothing of which a parameter moves. A line may be an angle that nobody declared, and an
    /// angle one that does not repeat after a turn.
    pub(super) fn suits(&self, coordinates: &Coordinates) -> bool {
        let n = coordinates.dof();
        let sized = |all: &[i8]| all.is_empty() || all.len() == n;
        let small = |all: &[i8]| all.iter().all(|k| k.unsigned_abs() <= MOST);
        let moves = |i: &usize| *i < n && !coordinates.is_parameter(*i);
        n <= MOST_COORDINATES
            && sized(&self.powers)
            && sized(&self.turns)
            && small(&self.powers)
            && small(&self.turns)
            && self.speeds.len() <= 2
            && self.speeds.is_sorted()
            && self.speeds.iter().all(moves)
    }

    /// The part that depends on q, over any scalar.
    pub(super) fn position<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D]) -> Position<D> {
        let one = D::from(1.0);
        let power = |less: Option<usize>| {
            let mut product = one;
            for (i, p) in self.powers.iter().enumerate() {
                let own = i32::from(*p) - i32::from(less == Some(i));
                if own != 0 {
                    product *= q[i].powi(own);
                }
            }
            product
        };
        let [wave, bent] = match self.turns.is_empty() {
            true => [one, D::from(0.0)],
            false => {
                let turned = self.turns.iter().zip(q);
                let phase: D = turned.map(|(k, q)| *q * f64::from(*k)).sum();
                let (sin, cos) = phase.sin_cos();
                if self.sine { [sin, cos] } else { [cos, -sin] }
            }
        };
        let whole = power(None);
        let mut slope = [D::from(0.0); MOST_COORDINATES];
        for (i, p) in self.powers.iter().enumerate().filter(|(_, p)| **p != 0) {
            slope[i] += power(Some(i)) * wave * f64::from(*p);
        }
        for (i, k) in self.turns.iter().enumerate().filter(|(_, k)| **k != 0) {
            slope[i] += whole * bent * f64::from(*k);
        }
        Position {
            value: whole * wave,
            slope,
        }
    }

    /// The part that depends on q.
    pub(crate) fn place(&self, q: &[f64]) -> f64 {
        self.position(q).value
    }

    /// The product of its velocities, over any scalar.
    pub(super) fn speed<D: DualNum<Primitive = f64> + Copy>(&self, qd: &[D]) -> D {
        let each = self.speeds.iter().map(|i| qd[*i]);
        each.fold(D::from(1.0), |product, v| product * v)
    }

    /// ∂/∂q̇ᵢ of the product of its velocities.
    pub(super) fn by_speed<D: DualNum<Primitive = f64> + Copy>(&self, qd: &[D], i: usize) -> D {
        match *self.speeds {
            [a] if a == i => D::from(1.0),
            [a, b] => {
                let own = |of: usize, other: usize| match of == i {
                    true => qd[other],
                    false => D::from(0.0),
                };
                own(a, b) + own(b, a)
            }
            _ => D::from(0.0),
        }
    }

    /// ∂²/∂q̇ᵢ∂q̇ⱼ of the product of its velocities.
    pub(crate) fn by_speeds(&self, i: usize, j: usize) -> f64 {
        match *self.speeds {
            [a, b] if !self.damps => {
                f64::from(u8::from((a, b) == (i, j)) + u8::from((b, a) == (i, j)))
            }
            _ => 0.0,
        }
    }

    /// The left side d/dt ∂/∂q̇ᵢ − ∂/∂qᵢ of the Euler–Lagrange equation of this term, or the friction ∂/∂q̇ᵢ of one that damps, `[n]` and
    /// zeros, over any scalar.
    pub(crate) fn balance<D: DualNum<Primitive = f64> + Copy>(
        &self,
        (q, qd): (&[D], &[D]),
        qdd: &[D],
    ) -> Row<D> {
        self.balance_at(&self.position(q), qd, qdd)
    }

    /// The same where the part that depends on q is known.
    pub(super) fn balance_at<D: DualNum<Primitive = f64> + Copy>(
        &self,
        position: &Position<D>,
        qd: &[D],
        qdd: &[D],
    ) -> Row<D> {
        if self.damps {
            let each = |i| self.by_speed(qd, i);
            return std::array::from_fn(|i| if i < qd.len() { each(i) } else { D::from(0.0) });
        }
        let &Position { value, slope } = position;
        let speed = self.speed(qd);
        let along: D = slope.iter().zip(qd).map(|(g, v)| *g * *v).sum();
        let mut balance = [D::from(0.0); MOST_COORDINATES];
        for (own, slope) in balance.iter_mut().zip(&slope).take(qd.len()) {
            *own = -(speed * *slope);
        }
        match *self.speeds {
            [] => (),
            [a] => balance[a] += along,
            [a, b, ..] => {
                balance[a] += value * qdd[b] + along * qd[b];
                balance[b] += value * qdd[a] + along * qd[a];
            }
        }
        balance
    }

    /// It as an expression of (q, q̇).
    pub(super) fn expression<'g>(&self, q: &[Value<'g>], qd: &[Value<'g>]) -> Value<'g> {
        let graph = q[0].graph();
        let mut product = graph.number(1.0);
        let mut below = graph.number(1.0);
        for (p, q) in self.powers.iter().zip(q) {
            for _ in 0..p.unsigned_abs() {
                let side = if *p > 0 { &mut product } else { &mut below };
                *side = *side * *q;
            }
        }
        if !self.turns.is_empty() {
            let turned = self.turns.iter().zip(q);
            let phase = turned.fold(graph.number(0.0), |sum, (k, q)| {
                sum + graph.number(f64::from(*k)) * *q
            });
            product = product * if self.sine { phase.sin() } else { phase.cos() };
        }
        let moving = self.speeds.iter().map(|i| qd[*i]);
        moving.fold(product / below, |product, v| product * v)
    }
}

/// The largest exponent and multiple.
const MOST: u8 = 12;

/// How a formula is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Style {
    /// As plain text, such as `q1'^2 cos(q1 - q2)`.
    Text,
    /// For LaTeX, such as `\dot{q}_{1}^{2} \cos(q_{1} - q_{2})`.
    Latex,
}

impl Term {
    /// It as a product of factors; empty for the constant 1.
    pub(super) fn written(&self, coordinates: &Coordinates, style: Style) -> String {
        let name = |i: usize| style.name(&coordinates.0[i].name);
        let mut factors = Vec::new();
        for (i, p) in self.powers.iter().enumerate().filter(|(_, p)| **p != 0) {
            factors.push(style.power(name(i), i32::from(*p)));
        }
        match *self.speeds {
            [a, b] if a == b => factors.push(style.power(style.rate(&name(a)), 2)),
            ref speeds => factors.extend(speeds.iter().map(|i| style.rate(&name(*i)))),
        }
        if self.turns.iter().any(|k| *k != 0) {
            let turned = self.turns.iter().enumerate().filter(|(_, k)| **k != 0);
            let mut phase = String::new();
            for (i, k) in turned {
                let sign = match (phase.is_empty(), *k < 0) {
                    (true, false) => "",
                    (true, true) => "-",
                    (false, false) => " + ",
                    (false, true) => " - ",
                };
                let times = match (k.unsigned_abs(), style) {
                    (1, _) => String::new(),
                    (k, Style::Text) => format!("{k} "),
                    (k, Style::Latex) => format!("{k}\\,"),
                };
                phase.push_str(&format!("{sign}{times}{}", name(i)));
            }
            let wave = if self.sine { "sin" } else { "cos" };
            factors.push(match style {
                Style::Text => format!("{wave}({phase})"),
                Style::Latex => format!("\\{wave}({phase})"),
            });
        }
        factors.join(if style == Style::Text { " " } else { "\\," })
    }
}

/// Greek letters that LaTeX knows by these names.
const GREEK: [&str; 13] = [
    "alpha", "beta", "gamma", "delta", "epsilon", "theta", "phi", "psi", "chi", "omega", "rho",
    "xi", "eta",
];

impl Style {
    /// A name such as `q1`, `theta_2` or `hip`.
    pub(crate) fn name(self, name: &str) -> String {
        if self == Self::Text {
            return name.into();
        }
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let index = &name[stem.len()..];
        let stem = stem.trim_end_matches('_');
        let letter = match stem {
            known if GREEK.contains(&known) => format!("\\{known}"),
            one if one.chars().count() == 1 => one.into(),
            word => format!("\\mathrm{{{}}}", word.replace('_', "\\_")),
        };
        match index {
            "" => letter,
            index => format!("{letter}_{{{index}}}"),
        }
    }

    /// The rate of change of a name.
    pub(crate) fn rate(self, name: &str) -> String {
        match self {
            Self::Text => format!("{name}'"),
            Self::Latex => format!("\\dot{{{name}}}"),
        }
    }

    pub(crate) fn power(self, base: String, exponent: i32) -> String {
        match (self, exponent) {
            (_, 1) => base,
            (Self::Text, e) => format!("{base}^{e}"),
            (Self::Latex, e) => format!("{base}^{{{e}}}"),
        }
    }
}
