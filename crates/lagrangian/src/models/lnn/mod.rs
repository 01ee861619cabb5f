//! Lagrangian neural networks: any L(q, q̇), free or convex in q̇.

mod curvature;
mod expression;
pub(crate) mod family;
pub(crate) mod learner;
mod one;
pub(crate) mod points;

use num_dual::DualNum;
use serde::{Deserialize, Serialize};

use crate::models::network::{Network, NetworkShape, Parts, check_coordinates, check_layers};
use crate::models::passes::Passes;
use lagrangian_mechanics::expression::{Expressed, Moving};
use lagrangian_mechanics::lagrangian::scaled::{Features, Scaling};
use lagrangian_mechanics::lagrangian::seen::{SpeedChart, VelocityFeature, VelocityTransform};
use lagrangian_mechanics::lagrangian::{Curvature, Jet, Jets, Lagrangian};
use lagrangian_motion::{Coordinates, Error, Result};
use nets::simd::Real;
use nets::{Activation, Build, Net, Pass, Weighted};

/// The class of functions of the velocity that a network represents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// Any function (Cranmer et al. 2020).
    #[default]
    Free,
    /// Convex in q̇, so that M ≻ 0 and the Legendre transform exists: a partially input-convex network
    /// (Amos, Xu, Kolter 2017, arXiv 1609.07152) plus A(q)·q̇ − V(q).
    Convex,
}

/// The shape of a Lagrangian network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LnnConfig {
    /// The class of functions of the velocity.
    pub form: Form,
    /// The number of units of a hidden layer, a multiple of 16 in the convex form.
    pub width: usize,
    /// The number of hidden layers.
    pub layers: usize,
    /// The activation; in the convex form that of the part of q, while the part of q̇ uses softplus.
    pub activation: Activation,
    /// κ of the term ½ κ ‖u‖² beside the network, where u is q̇/s or the feature in its place.
    pub kinetic: f64,
    /// Whether the output reads 16 units eˣ, for mass matrices that span decades.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub exponential: bool,
    /// A speed c that no coordinate reaches, in units of q̇: the network then reads artanh(q̇/c) in place of q̇/s
    /// (theory.md, equation 108). In the free form only: a function that is convex in one is not convex in the other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_limit: Option<f64>,
    /// The velocity feature below that limit: artanh(q̇/c) or arcsin(q̇/c).
    #[serde(skip_serializing_if = "SpeedChart::is_default")]
    pub speed_chart: SpeedChart,
}

impl Default for LnnConfig {
    fn default() -> Self {
        Self {
            form: Form::default(),
            width: 64,
            layers: 2,
            activation: Activation::default(),
            kinetic: 1.0,
            exponential: false,
            speed_limit: None,
            speed_chart: SpeedChart::default(),
        }
    }
}

/// The number of exponential units.
const EXPONENTIAL: usize = 16;
/// The width of a convex network is a multiple of this number of units.
const UNITS: usize = 16;

impl LnnConfig {
    /// Checks width, depth and κ.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first that is outside its domain.
    pub fn validate(&self) -> Result<()> {
        check_layers(self.width, self.layers)?;
        let refuse =
            |name, value: &dyn ToString, must| Err(Error::argument(name, value.to_string(), must));
        if self.form == Form::Convex && !self.width.is_multiple_of(UNITS) {
            return refuse("width", &self.width, "a multiple of 16 in the convex form");
        }
        if !(self.kinetic.is_finite() && self.kinetic >= 0.0) {
            return refuse("kinetic", &self.kinetic, "finite and not negative");
        }
        match self.speed_limit {
            Some(c) if !(c.is_finite() && c > 0.0) => {
                refuse("speed limit", &c, "finite and positive")
            }
            Some(c) if self.form == Form::Convex => {
                let must = "omitted in the convex form, or take the free one (`form` free)";
                refuse("speed limit", &c, must)
            }
            None if self.speed_chart != SpeedChart::default() => {
                let must = "omitted without a limit of speed, or give one (`speed_limit`)";
                refuse("speed chart", &format!("{:?}", self.speed_chart), must)
            }
            _ => Ok(()),
        }
    }

    /// The layers for so many features of the coordinates and so many velocities.
    pub(crate) fn net(&self, features: usize, n: usize) -> Net {
        match self.form {
            Form::Free => self.free(features + n),
            Form::Convex => self.convex(features, n),
        }
    }

    fn free(&self, inputs: usize) -> Net {
        let mut build = Build::new(inputs, 0);
        let top = build.stack(self.layers, self.width, self.activation);
        let mut output = vec![top];
        if self.exponential {
            output.push(build.dense(EXPONENTIAL, &[top], Some(Activation::Exp)));
        }
        build.linear(1, &output);
        build.finish()
    }

    /// A trunk of q alone gates three kinds of units: quadratic and softplus ones, which only non-negative
    /// weights read (their sum is convex in q̇), and linear ones (A(q)·q̇). The trunk adds −V(q) (theory.md,
    /// equation 21).
    fn convex(&self, features: usize, n: usize) -> Net {
        use Weighted::{Any, NonNegative};
        let mut build = Build::new(features, n);
        let trunk = build.stack(self.layers, self.width, self.activation);
        let quadratic = build.gate(16, trunk, Some(Activation::Square));
        let softplus = Some(Activation::Softplus);
        let width = self.width.next_multiple_of(16) / 2 / 16 * 16 + 16;
        let bent = build.gate(width, trunk, softplus);
        let linear = build.gate(16, trunk, None);
        let second = build.dense(self.width, &[NonNegative(bent), Any(trunk)], softplus);
        let convex = [quadratic, bent, second].map(NonNegative);
        let mut output = [&convex[..], &[Any(linear), Any(trunk)]].concat();
        if self.exponential {
            let sources = [&convex[..], &[Any(trunk)]].concat();
            let exponential = build.dense(EXPONENTIAL, &sources, Some(Activation::Exp));
            output.push(NonNegative(exponential));
        }
        build.linear(1, &output);
        build.finish()
    }
}

/// A Lagrangian network: L(q, q̇) = E [ N(x(q), q̇ / s) + ½ κ ‖q̇ / s‖² ] (theory.md, equation 22).
///
/// Angles enter as cos and sin. The network is in double precision.
pub type Lnn = Network<LnnShape>;

/// The shape of an [`Lnn`], without its weights.
#[derive(Debug, Clone)]
pub struct LnnShape {
    pub(crate) coordinates: Coordinates,
    pub(crate) config: LnnConfig,
    pub(crate) scaling: Scaling,
    pub(crate) net: Net,
    /// The features of the velocities.
    pub(crate) seen: VelocityTransform,
    /// 1 / s of each coordinate and velocity, since a division costs as much as all other operations on one of them.
    pub(crate) inverse: [Vec<f64>; 2],
}

impl Lnn {
    /// L over any scalar: the slow, plain evaluation that the kernels are tested against. `q`, `qd` are `[n]`.
    pub fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (shape, scaling) = (&self.shape, &self.shape.scaling);
        let mut x = scaling.evaluate(&shape.coordinates, q);
        let seen = qd.iter().zip(&scaling.qd_scale);
        let (v, kinetic): (Vec<D>, Vec<D>) = seen
            .map(|(&v, &s)| shape.seen.evaluate((s, scaling.energy), v))
            .unzip();
        let kinetic = kinetic.into_iter().sum::<D>() * shape.config.kinetic;
        if shape.config.form == Form::Free {
            x.extend(&v);
        }
        (shape.net.evaluate(&self.parameters, &x, &v)[0] + kinetic) * scaling.energy
    }
}

impl Lagrangian for Lnn {
    fn coordinates(&self) -> &Coordinates {
        &self.shape.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(LnnJets {
            lnn: self,
            one: one::One::new(&self.shape),
            passes: Passes::default(),
            second: None,
        })
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        Some(Expressed::of(self.expression(at.q, at.qd), at))
    }
}

impl NetworkShape for LnnShape {
    type Config = LnnConfig;
    type Scaling = Scaling;

    fn new(coordinates: Coordinates, config: LnnConfig, scaling: Scaling) -> Result<Self> {
        config.validate()?;
        scaling.validate(coordinates.dof())?;
        check_coordinates(&coordinates)?;
        let net = config.net(scaling.features(&coordinates), coordinates.dof());
        let seen = VelocityTransform::of_velocity(config.speed_limit, config.speed_chart);
        Ok(Self {
            inverse: [
                (0..coordinates.dof())
                    .map(|i| scaling.divisor(i).recip())
                    .collect(),
                scaling.qd_scale.iter().map(|s| s.recip()).collect(),
            ],
            coordinates,
            config,
            scaling,
            net,
            seen,
        })
    }

    fn parts(&self) -> Parts<'_, LnnConfig, Scaling> {
        Parts {
            coordinates: &self.coordinates,
            config: &self.config,
            scaling: &self.scaling,
            net: &self.net,
        }
    }

    fn check(&self, parameters: &[f64]) -> Result<()> {
        match self.net.negative(parameters) {
            None => Ok(()),
            Some(index) => Err(Error::argument(
                "weight of the convex form",
                format!("{} at index {index}", parameters[index]),
                "0 or above, or L is not convex in q̇: repeat the fit, or use the free form",
            )),
        }
    }
}

impl LnnShape {
    /// Writes state (q, q̇) as sample `s`: the value, ′ = the motion (q̇, `qdd`), and i = the velocity directions.
    pub(crate) fn write<T: Real>(
        &self,
        pass: &mut Pass<T>,
        s: usize,
        q: &[f64],
        qd: &[f64],
        qdd: Option<&[f64]>,
    ) {
        self.write_along(pass, s, (q, qd), qd, qdd);
    }

    /// Writes state (q, q̇) as sample `s` with ′ = `along` in q, whatever the second argument of the function is.
    pub(crate) fn write_along<T: Real>(
        &self,
        pass: &mut Pass<T>,
        s: usize,
        (q, qd): (&[f64], &[f64]),
        along: &[f64],
        qdd: Option<&[f64]>,
    ) {
        let n = self.dof();
        let mut at = 0;
        for i in 0..n {
            let features = self.features(i, q[i]);
            for k in 0..features.count {
                pass.set_feature(0, s, at, T::of(features.values[k]));
                pass.set_feature(1, s, at, T::of(features.slopes[k] * along[i]));
                for d in 0..n {
                    pass.set_feature(2 + d, s, at, T::default());
                }
                at += 1;
            }
        }
        for i in 0..n {
            let seen = self.velocity(i, qd[i]);
            let prime = qdd.map_or(0.0, |qdd| qdd[i] * seen.slope);
            self.set_velocity(pass, 0, s, at, i, T::of(seen.value));
            self.set_velocity(pass, 1, s, at, i, T::of(prime));
            for d in 0..n {
                let one = if d == i { seen.slope } else { 0.0 };
                self.set_velocity(pass, 2 + d, s, at, i, T::of(one));
            }
        }
    }

    /// As [`LnnShape::write`], but with a tangent ′ that is zero, so that mixed components are first derivatives.
    pub(crate) fn write_still<T: Real>(&self, pass: &mut Pass<T>, s: usize, q: &[f64], qd: &[f64]) {
        self.write(pass, s, q, qd, None);
        for at in 0..self.scaling.features(&self.coordinates) {
            pass.set_feature(1, s, at, T::default());
        }
    }

    /// Writes the mixed component of direction `d` of sample `s` along the velocities `qd`: `weight`.
    pub(crate) fn write_mixed_velocity<T: Real>(
        &self,
        pass: &mut Pass<T>,
        (d, s): (usize, usize),
        qd: &[f64],
        weight: impl Fn(usize) -> f64,
    ) {
        let first = self.scaling.features(&self.coordinates);
        for (i, &qd) in qd.iter().enumerate() {
            let x = T::of(weight(i) * self.velocity(i, qd).slope);
            match self.config.form {
                Form::Free => pass.set_mixed_feature(d, s, first + i, x),
                Form::Convex => pass.set_mixed_velocity(d, s, i, x),
            }
        }
    }

    /// The feature of velocity `i`.
    #[inline]
    pub(crate) fn velocity(&self, i: usize, v: f64) -> VelocityFeature {
        match self.seen {
            VelocityTransform::Scaled => VelocityFeature::scaled(self.inverse[1][i], v),
            seen => seen.feature((self.scaling.qd_scale[i], self.scaling.energy), v),
        }
    }

    fn set_velocity<T: Real>(
        &self,
        pass: &mut Pass<T>,
        c: usize,
        s: usize,
        first: usize,
        i: usize,
        x: T,
    ) {
        match self.config.form {
            Form::Free => pass.set_feature(c, s, first + i, x),
            Form::Convex => pass.set_velocity(c, s, i, x),
        }
    }

    /// Writes the mixed component of direction `d` of sample `s`: −`weight` along the coordinates, so that the
    /// output's mixed component is Σ weight (d/dt ∂L/∂q̇ − ∂L/∂q) at acceleration `qdd` (theory.md, equations 12,
    /// 16 and 108).
    pub(crate) fn write_mixed<T: Real>(
        &self,
        pass: &mut Pass<T>,
        (d, s): (usize, usize),
        (qd, qdd): (&[f64], &[f64]),
        weight: &[f64],
    ) {
        let at = self.write_mixed_positions(pass, (d, s), weight);
        if !self.seen.bends() {
            return;
        }
        for i in 0..self.dof() {
            let bend = self.velocity(i, qd[i]).curvature * qdd[i] * weight[i];
            pass.set_mixed_feature(d, s, at + i, T::of(bend));
        }
    }

    /// The part of the mixed component along the coordinates alone; returns the number of the first velocity feature.
    pub(crate) fn write_mixed_positions<T: Real>(
        &self,
        pass: &mut Pass<T>,
        (d, s): (usize, usize),
        weight: &[f64],
    ) -> usize {
        let mut at = 0;
        for (i, weight) in weight[..self.dof()].iter().enumerate() {
            let features = self.recall(pass, (s, at), i);
            for slope in &features.slopes[..features.count] {
                pass.set_mixed_feature(d, s, at, T::of(-slope * weight));
                at += 1;
            }
        }
        at
    }

    /// The features of coordinate `i` of sample `s`, of which the first is number `at`.
    fn recall<T: Real>(&self, pass: &Pass<T>, (s, at): (usize, usize), i: usize) -> Features {
        let value = |k| pass.feature(0, s, at + k).f64();
        match self.scaling.is_circle(&self.coordinates, i) {
            true => Features::circle(value(0), value(1)),
            false => Features::line(value(0), self.inverse[0][i]),
        }
    }

    /// The features of coordinate `i` at `q`.
    fn features(&self, i: usize, q: f64) -> Features {
        if self.scaling.is_circle(&self.coordinates, i) {
            let (sin, cos) = q.sin_cos();
            return Features::circle(cos, sin);
        }
        let inverse = self.inverse[0][i];
        Features::line((q - self.scaling.q_center[i]) * inverse, inverse)
    }

    /// Writes ∂S/∂(q, q̇) of sample `s` `[n, 2n]`, for the n scalars of a linearised pass whose sensitivities were
    /// carried to the features (theory.md, equation 95); `qd` are those of all samples.
    pub(crate) fn slopes<T: Real>(&self, pass: &Pass<T>, s: usize, qd: &[f64], slopes: &mut [f64]) {
        let n = self.dof();
        let first = self.scaling.features(&self.coordinates);
        for (i, row) in slopes.chunks_exact_mut(2 * n).enumerate() {
            let mut at = 0;
            for j in 0..n {
                let features = self.recall(pass, (s, at), j);
                (row[j], row[n + j]) = (0.0, 0.0);
                for k in 0..features.count {
                    let value = pass.feature_sensitivity(0, s, at).f64();
                    let along = pass.feature_sensitivity(2 + i, s, at).f64();
                    let mixed = pass.mixed_feature_sensitivity(i, s, at).f64();
                    let curvature = features.curvature(k);
                    row[j] += mixed * features.slopes[k] + along * curvature * qd[s * n + j];
                    if i == j {
                        row[j] -= value * curvature;
                    }
                    row[n + j] += along * features.slopes[k];
                    at += 1;
                }
                let velocity = match self.config.form {
                    Form::Free => pass.mixed_feature_sensitivity(i, s, first + j),
                    Form::Convex => pass.mixed_velocity_sensitivity(&self.net, i, s, j),
                };
                row[n + j] += velocity.f64() / self.scaling.qd_scale[j];
            }
        }
    }

    /// Reads sample `s` of a pass that has been forward and back into row `row` of `jet`; `qdd` is the acceleration with which
    /// it was written.
    pub(crate) fn read<T: Real>(
        &self,
        pass: &Pass<T>,
        (s, row): (usize, usize),
        (qd, qdd): (&[f64], Option<&[f64]>),
        jet: &mut Jet,
    ) {
        let n = self.dof();
        let (scaling, kinetic) = (&self.scaling, self.config.kinetic);
        let e = scaling.energy;
        let mut at = 0;
        for i in 0..n {
            let features = self.recall(pass, (s, at), i);
            let mut force = 0.0;
            for k in 0..features.count {
                force += pass.feature_gradient(s, at).f64() * features.slopes[k];
                at += 1;
            }
            jet.dl_dq[row * n + i] = e * force;
        }
        let mut quadratic = 0.0;
        for (i, &qd) in qd.iter().enumerate() {
            let seen = self.velocity(i, qd);
            quadratic += kinetic * seen.kinetic[0];
            let slope = match self.config.form {
                Form::Free => pass.feature_gradient(s, at + i).f64(),
                Form::Convex => pass.velocity_gradient(s, i).f64(),
            };
            // The network's second derivatives are those along straight features.
            let bend = slope * seen.curvature;
            let drift = pass.second_derivative(s, i, None, n).f64();
            jet.momentum[row * n + i] = e * (slope * seen.slope + kinetic * seen.kinetic[1]);
            jet.momentum_drift[row * n + i] = e * (drift + qdd.map_or(0.0, |qdd| bend * qdd[i]));
            for j in 0..n {
                let own = kinetic * seen.kinetic[2] + bend;
                let diagonal = if i == j { own } else { 0.0 };
                let m = pass.second_derivative(s, i, Some(j), n).f64() + diagonal;
                jet.mass_matrix[(row * n + i) * n + j] = e * m;
            }
        }
        jet.lagrangian[row] = e * (pass.output(&self.net, 0, s, 0).f64() + quadratic);
    }
}

struct LnnJets<'a> {
    lnn: &'a Lnn,
    /// The evaluation of one state, where the layers are a chain.
    one: Option<one::One>,
    passes: Passes,
    /// A pass with the directions of the coordinates beside those of the velocities.
    second: Option<Pass<f64>>,
}

impl Jets for LnnJets<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        let shape = &self.lnn.shape;
        let n = shape.dof();
        let m = q.len() / n;
        jet.resize(m, n);
        if let (1, Some(one)) = (m, &mut self.one) {
            one.jet(self.lnn, (q, qd), jet);
            return;
        }
        let lnn = self.lnn;
        self.passes.each((&shape.net, n), m, |pass, states| {
            for s in 0..pass.samples() {
                let row = states.of(s) * n;
                shape.write(pass, s, &q[row..][..n], &qd[row..][..n], None);
            }
            pass.forward_for_reverse(&shape.net, &lnn.packed, n, 1);
            pass.reverse(&shape.net, &lnn.packed, n);
            for s in 0..states.count {
                let row = states.of(s);
                shape.read(pass, (s, row), (&qd[row * n..][..n], None), jet);
            }
        });
    }

    fn curvature(&mut self, q: &[f64], qd: &[f64], curvature: &mut Curvature) {
        curvature::curvature(self.lnn, &mut self.second, (q, qd), curvature);
    }
}
