//! A planar chain of straight rigid links: the Lagrangian that robotics identifies by least squares.

use num_dual::DualNum;
use serde::{Deserialize, Serialize};

use lagrangian_mechanics::analytic::{ClosedForm, DualJets};
use lagrangian_mechanics::expression::{Expressed, Moving};
use lagrangian_mechanics::lagrangian::{Jets, Lagrangian};
use lagrangian_motion::{Coordinates, Error, Result};

/// The reference of the angles of a chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Angles {
    /// A fixed direction: θᵢ = qᵢ.
    Absolute,
    /// The link before, as for the encoder of a joint: θᵢ = Σ_{j≤i} qⱼ.
    #[default]
    Relative,
}

/// A planar chain of straight links, linear in its base parameters π:
///
/// L = Σ_{i≤j} aᵢⱼ θ̇ᵢ θ̇ⱼ cos(θᵢ − θⱼ) + ½ Σᵢ rᵢ q̇ᵢ² + Σᵢ (cᵢ cos θᵢ + sᵢ sin θᵢ) − Σᵢ oᵢ qᵢ.
///
/// | symbol | meaning | unit |
/// |---|---|---|
/// | aᵢᵢ, aᵢⱼ | half the inertia about the joint, with all links beyond; coupling of two links | kg·m² |
/// | rᵢ | inertia of a rotor that turns with the joint angle (relative angles, i ≥ 2; otherwise it is part of aᵢᵢ) | kg·m² |
/// | cᵢ, sᵢ | gravity, for any direction in which the angles are 0 | J |
/// | oᵢ | a constant torque: friction of one sign, or the offset of a torque sensor | N·m |
///
/// The parameters are those that motions and torques can distinguish; masses and lengths are not among them
/// (Gautier, Khalil, IEEE Trans. Robotics and Automation 6, 1990).
#[derive(Debug, Clone, PartialEq)]
pub struct RigidChain {
    coordinates: Coordinates,
    angles: Angles,
    parameters: Vec<f64>,
}

/// The largest number of links, that of a robot arm.
const MOST: usize = 7;

impl RigidChain {
    /// A chain with the base parameters π in the order of [`RigidChain::names`].
    ///
    /// # Errors
    /// [`Error::Argument`] where the coordinates are not 1 to 7 angles; [`Error::Shape`] for another number of
    /// parameters; [`Error::NotFinite`].
    pub fn new(coordinates: Coordinates, angles: Angles, parameters: Vec<f64>) -> Result<Self> {
        let expected = Self::names(&coordinates, angles)?.len();
        Error::check_shape(
            "base parameters",
            parameters.len(),
            expected,
            "give them in the order of their names",
        )?;
        Error::check_finite("base parameters", &parameters)?;
        Ok(Self {
            coordinates,
            angles,
            parameters,
        })
    }

    /// Names of the base parameters in their order: `inertia_1_1`, `inertia_1_2` …, `rotor_2` …, `gravity_cos_1` …,
    /// `gravity_sin_1` …, `offset_1` ….
    ///
    /// # Errors
    /// [`Error::Argument`] where the coordinates are not 1 to 7 angles.
    pub fn names(coordinates: &Coordinates, angles: Angles) -> Result<Vec<String>> {
        let n = coordinates.dof();
        if !(1..=MOST).contains(&n) || !(0..n).all(|i| coordinates.is_circle(i)) {
            let angles = (0..n).filter(|&i| coordinates.is_circle(i)).count();
            return Err(Error::argument(
                "rigid chain",
                format!("{n} coordinates, {angles} of them angles"),
                "1 to 7 angles: declare them with `angles`, or fit a network (`family` lnn)",
            ));
        }
        let pairs = (1..=n).flat_map(|i| (i..=n).map(move |j| format!("inertia_{i}_{j}")));
        let rotors = (2..=n)
            .filter(|_| angles == Angles::Relative)
            .map(|i| format!("rotor_{i}"));
        let each = ["gravity_cos", "gravity_sin", "offset"]
            .into_iter()
            .flat_map(|kind| (1..=n).map(move |i| format!("{kind}_{i}")));
        Ok(pairs.chain(rotors).chain(each).collect())
    }

    /// π, in the order of [`RigidChain::names`].
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The reference of the angles.
    #[must_use]
    pub fn angles(&self) -> Angles {
        self.angles
    }

    /// θᵢ from qᵢ, or θ̇ᵢ from q̇ᵢ.
    fn absolute<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D]) -> [D; MOST] {
        let mut sum = D::from(0.0);
        std::array::from_fn(|i| match (q.get(i), self.angles) {
            (Some(&q), Angles::Absolute) => q,
            (Some(&q), Angles::Relative) => {
                sum += q;
                sum
            }
            (None, _) => sum,
        })
    }
}

impl ClosedForm for RigidChain {
    fn value<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let n = q.len();
        let (theta, thetad) = (self.absolute(q), self.absolute(qd));
        let mut l = D::from(0.0);
        let mut parameters = self.parameters.iter();
        // A column of a regressor has one parameter that is not 0: the others cost nothing.
        let mut add = |term: &dyn Fn() -> D| match parameters.next() {
            Some(&pi) if pi != 0.0 => l += term() * pi,
            _ => (),
        };
        for i in 0..n {
            add(&|| thetad[i] * thetad[i]);
            for j in i + 1..n {
                add(&|| thetad[i] * thetad[j] * (theta[i] - theta[j]).cos());
            }
        }
        if self.angles == Angles::Relative {
            (1..n).for_each(|i| add(&|| qd[i] * qd[i] * 0.5));
        }
        (0..n).for_each(|i| add(&|| theta[i].cos()));
        (0..n).for_each(|i| add(&|| theta[i].sin()));
        (0..n).for_each(|i| add(&|| -q[i]));
        l
    }
}

impl Lagrangian for RigidChain {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(DualJets::new(self, self.coordinates.dof()))
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        Some(Expressed::of(self.expression(at.q, at.qd), at))
    }
}
