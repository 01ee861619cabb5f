//! Functions of one number, their derivatives, and activations in terms of functions that every language has.

use nets::Activation;

use super::Value;

/// A function of one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Function {
    /// sin x.
    Sin,
    /// cos x.
    Cos,
    /// tanh x.
    Tanh,
    /// eˣ, of x up to 700.
    Exp,
    /// log(1 + x), of x from 0 to 1.
    LogOnePlus,
    /// √x.
    SquareRoot,
    /// |x|.
    Absolute,
    /// 1 − erf x.
    ComplementaryError,
    /// arcsin x.
    Arcsin,
    /// arsinh x.
    Arsinh,
    /// artanh x.
    Artanh,
    /// x less whole turns, from 0 to 2π.
    WithinTurn,
    /// A derivative of an activation, of order up to three. [`Value::plain`] replaces it.
    Activation(Activation, u8),
}

impl Function {
    /// f(x); `NaN` for an activation, which is evaluated by its replacement.
    #[must_use]
    pub fn evaluate(self, x: f64) -> f64 {
        match self {
            Self::Sin => x.sin(),
            Self::Cos => x.cos(),
            Self::Tanh => x.tanh(),
            Self::Exp => x.exp(),
            Self::LogOnePlus => x.ln_1p(),
            Self::SquareRoot => x.sqrt(),
            Self::Absolute => x.abs(),
            Self::ComplementaryError => erfc(x),
            Self::Arcsin => x.asin(),
            Self::Arsinh => x.asinh(),
            Self::Artanh => x.atanh(),
            Self::WithinTurn => x.rem_euclid(std::f64::consts::TAU),
            Self::Activation(activation, order) => {
                let derivatives = activation.derivatives(x);
                match order {
                    0 => derivatives.value,
                    1 => derivatives.first,
                    2 => derivatives.second,
                    _ => derivatives.third,
                }
            }
        }
    }

    /// f′(x) as an expression.
    ///
    /// # Panics
    /// For an activation that was differentiated three times already.
    pub(super) fn derivative(self, x: Value<'_>) -> Value<'_> {
        let number = |number: f64| x.graph().number(number);
        let (one, own) = (number(1.0), x.map(self));
        match self {
            Self::Sin => x.cos(),
            Self::Cos => -x.sin(),
            Self::Tanh => one - own * own,
            Self::Exp => own,
            Self::LogOnePlus => one / (one + x),
            Self::SquareRoot => number(0.5) / own,
            Self::Absolute => x.choose(one, -one),
            Self::ComplementaryError => {
                number(-std::f64::consts::FRAC_2_SQRT_PI) * (-(x * x)).map(Self::Exp)
            }
            Self::Arcsin => one / ((one - x) * (one + x)).map(Self::SquareRoot),
            Self::Arsinh => one / (one + x * x).map(Self::SquareRoot),
            Self::Artanh => one / ((one - x) * (one + x)),
            Self::WithinTurn => one,
            Self::Activation(activation, order) => {
                assert!(order < 3, "an activation has three derivatives");
                x.map(Self::Activation(activation, order + 1))
            }
        }
    }

    /// Expression of f(x) in functions that are not activations.
    pub(super) fn plain(self, x: Value<'_>) -> Value<'_> {
        let Self::Activation(activation, order) = self else {
            return x.map(self);
        };
        match activation {
            Activation::Softplus if x.graph().keeps_weights() => smooth_softplus(x, order),
            Activation::Softplus => softplus(x, order),
            Activation::Tanh => tanh(x, order),
            Activation::XTanh => x_tanh(x, order),
            Activation::Gelu => gelu(x, order),
            Activation::Square => square(x, order),
            Activation::Exp => exp(x, order),
            other => unreachable!("{other:?} has no expression"),
        }
    }
}

/// log(1 + eˣ) by e = exp(−|x|), which never overflows.
fn softplus(x: Value<'_>, order: u8) -> Value<'_> {
    let number = |number: f64| x.graph().number(number);
    let (zero, one) = (number(0.0), number(1.0));
    let e = (-x.map(Function::Absolute)).map(Function::Exp);
    let r = one / (one + e);
    let logistic = || x.choose(r, e * r);
    match order {
        0 => x.choose(x, zero) + e.map(Function::LogOnePlus),
        1 => logistic(),
        2 => e * r * r,
        _ => e * r * r * (x.choose(-one, one) * (one - e) * r),
    }
}

/// Derivatives of log(1 + eˣ) by itself and the first, for those who differentiate once more: |x| has no derivative at 0.
fn smooth_softplus(x: Value<'_>, order: u8) -> Value<'_> {
    fn logistic(x: Value<'_>) -> Value<'_> {
        x.map(Function::Activation(Activation::Softplus, 1))
    }
    match order {
        0 => x.map(Function::Activation(Activation::Softplus, 0)),
        1 => logistic(x),
        2 => logistic(x) * logistic(-x),
        _ => logistic(x) * logistic(-x) * (logistic(-x) - logistic(x)),
    }
}

fn tanh(x: Value<'_>, order: u8) -> Value<'_> {
    let number = |number: f64| x.graph().number(number);
    let t = x.map(Function::Tanh);
    let slope = number(1.0) - t * t;
    match order {
        0 => t,
        1 => slope,
        2 => number(-2.0) * t * slope,
        _ => number(-2.0) * slope * (slope - number(2.0) * t * t),
    }
}

fn x_tanh(x: Value<'_>, order: u8) -> Value<'_> {
    let number = |number: f64| x.graph().number(number);
    let t = x.map(Function::Tanh);
    let slope = number(1.0) - t * t;
    match order {
        0 => x * t,
        1 => t + x * slope,
        2 => number(2.0) * slope * (number(1.0) - x * t),
        _ => number(-2.0) * slope * (number(3.0) * t + x * (number(1.0) - number(3.0) * t * t)),
    }
}

/// x Φ(x).
fn gelu(x: Value<'_>, order: u8) -> Value<'_> {
    let number = |number: f64| x.graph().number(number);
    let root = std::f64::consts::FRAC_1_SQRT_2;
    let share = number(0.5) * (number(-root) * x).map(Function::ComplementaryError);
    let density =
        number(1.0 / std::f64::consts::TAU.sqrt()) * (number(-0.5) * x * x).map(Function::Exp);
    match order {
        0 => x * share,
        1 => share + x * density,
        2 => density * (number(2.0) - x * x),
        _ => density * x * (x * x - number(4.0)),
    }
}

fn square(x: Value<'_>, order: u8) -> Value<'_> {
    let all = |number: f64| x.graph().constant(&vec![number; x.len()]);
    match order {
        0 => x.graph().number(0.5) * x * x,
        1 => x,
        2 => all(1.0),
        _ => all(0.0),
    }
}

/// Threshold at which the exponential becomes a parabola.
const STEEPEST: f64 = 40.0;

fn exp(x: Value<'_>, order: u8) -> Value<'_> {
    let number = |number: f64| x.graph().number(number);
    let beyond = x - number(STEEPEST);
    let top = number(STEEPEST.exp());
    let below = beyond.choose(number(STEEPEST), x).map(Function::Exp);
    let slope = beyond + number(1.0);
    match order {
        0 => beyond.choose(top * (number(0.5) * beyond * beyond + slope), below),
        1 => beyond.choose(top * slope, below),
        2 => beyond.choose(top, below),
        _ => beyond.choose(number(0.0), below),
    }
}

/// 1 − erf x, from the activation x Φ(x) = ½ x erfc(−x/√2).
fn erfc(x: f64) -> f64 {
    let z = -x * std::f64::consts::SQRT_2;
    match z.abs() < 1e-300 {
        true => 1.0,
        false => 2.0 * Activation::Gelu.derivatives(z).value / z,
    }
}
