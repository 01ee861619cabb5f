//! The recipes that are compared: how the weights are improved, on how many samples, and which schedules.

use crate::train::{AdamConfig, NaturalConfig, Precision};

/// How the damping λ of the natural gradient goes; every rule is then multiplied by √(mean |r|) of the batch, at most 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Damping {
    /// λ = first (last / first)^(share^power): the power is 1 for a geometric fall, smaller to fall faster.
    Falls {
        /// At the start.
        first: f64,
        /// At the end.
        last: f64,
        /// Of the share of the budget.
        power: f64,
    },
    /// λ is multiplied by `factor` < 1 where the loss of the batch fell by more than ¾ of what the quadratic model
    /// foresaw, and divided by it where it fell by less than ¼ (Levenberg, Marquardt).
    Adaptive {
        /// Of one step.
        factor: f64,
    },
    /// λ = `factor` · mean r² of the last batch, at most ⅒ (Fan, Yuan 2005, Computing 74).
    Loss {
        /// λ over the loss.
        factor: f64,
    },
}

impl Damping {
    /// That of `fit`.
    pub(super) const DEFAULT: Self = Self::Falls {
        first: 1e-1,
        last: 1e-7,
        power: 1.0,
    };

    const fn to(last: f64) -> Self {
        Self::Falls {
            first: 1e-1,
            last,
            power: 1.0,
        }
    }

    const fn shaped(power: f64) -> Self {
        Self::Falls {
            first: 1e-1,
            last: 1e-7,
            power,
        }
    }
}

/// How the weights are improved.
#[derive(Debug, Clone, PartialEq)]
pub enum Method {
    /// The natural gradient in the space of samples.
    Natural {
        /// Of λ.
        damping: Damping,
        /// μ.
        momentum: f64,
        /// Largest η.
        rate: f64,
    },
    /// Adam, with a cosine schedule.
    Adam {
        /// Largest η.
        rate: f64,
        /// Numbers of the kernels.
        precision: Precision,
    },
    /// Adam in f32 for a share of the budget, then the natural gradient with its own schedule.
    Polished {
        /// Of the first part.
        share: f64,
    },
}

impl Method {
    /// The natural gradient with this damping.
    const fn damped(damping: Damping) -> Self {
        Self::Natural {
            damping,
            momentum: 0.9,
            rate: 0.5,
        }
    }

    const fn momentum(momentum: f64) -> Self {
        Self::Natural {
            damping: Damping::DEFAULT,
            momentum,
            rate: 0.5,
        }
    }

    const fn rate(rate: f64) -> Self {
        Self::Natural {
            damping: Damping::DEFAULT,
            momentum: 0.9,
            rate,
        }
    }

    const fn adam(rate: f64, precision: Precision) -> Self {
        Self::Adam { rate, precision }
    }
}

/// Samples of a step, growing geometrically with the share of the budget.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Batch {
    /// At the start.
    pub first: usize,
    /// At the end.
    pub last: usize,
}

impl Batch {
    const fn fixed(samples: usize) -> Self {
        Self {
            first: samples,
            last: samples,
        }
    }

    /// Samples at this share of the budget: whole blocks of 16, so that none is filled with padding.
    pub(super) fn at(self, share: f64) -> usize {
        if self.first == self.last {
            return self.first;
        }
        let growth = self.last as f64 / self.first as f64;
        let samples = (self.first as f64 * growth.powf(share)) as usize;
        samples
            .next_multiple_of(16)
            .clamp(self.first.min(self.last), self.last.max(self.first))
    }
}

/// One line of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Its name on the command line.
    pub key: &'static str,
    /// What differs from the default, in words.
    pub name: &'static str,
    /// What it is compared with.
    pub group: Group,
    /// How.
    pub method: Method,
    /// Samples.
    pub batch: Batch,
}

/// What a recipe varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Nothing.
    Default,
    /// Where the damping begins and ends.
    Damping,
    /// The rule that it follows.
    Rule,
    /// Momentum.
    Momentum,
    /// The rate.
    Rate,
    /// The batch.
    Batch,
    /// The method itself.
    Method,
}

impl Group {
    /// All, in the order of the table.
    pub const ALL: [Self; 7] = [
        Self::Default,
        Self::Damping,
        Self::Rule,
        Self::Momentum,
        Self::Rate,
        Self::Batch,
        Self::Method,
    ];

    /// In a word.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Damping => "damping",
            Self::Rule => "rule of the damping",
            Self::Momentum => "momentum",
            Self::Rate => "rate",
            Self::Batch => "batch",
            Self::Method => "method",
        }
    }
}

const fn recipe(
    group: Group,
    (key, name): (&'static str, &'static str),
    method: Method,
    batch: Batch,
) -> Recipe {
    Recipe {
        key,
        name,
        group,
        method,
        batch,
    }
}

const USUAL: Batch = Batch::fixed(256);

/// All recipes; the first is what `fit` does by default.
#[rustfmt::skip]
pub const RECIPES: &[Recipe] = &[
    recipe(Group::Default, ("default", "natural gradient, as fit has it"), Method::damped(Damping::DEFAULT), USUAL),
    recipe(Group::Damping, ("damping-to-1e-5", "λ falls to 1e-5"), Method::damped(Damping::to(1e-5)), USUAL),
    recipe(Group::Damping, ("damping-to-1e-9", "λ falls to 1e-9"), Method::damped(Damping::to(1e-9)), USUAL),
    recipe(Group::Damping, ("damping-to-1e-11", "λ falls to 1e-11"), Method::damped(Damping::to(1e-11)), USUAL),
    recipe(
        Group::Damping,
        ("damping-from-1", "λ falls from 1"),
        Method::damped(Damping::Falls { first: 1.0, last: 1e-7, power: 1.0 }),
        USUAL,
    ),
    recipe(
        Group::Damping,
        ("damping-from-1e-3", "λ falls from 1e-3"),
        Method::damped(Damping::Falls { first: 1e-3, last: 1e-7, power: 1.0 }),
        USUAL,
    ),
    recipe(Group::Rule, ("damping-fast", "λ falls faster at first (power ½)"), Method::damped(Damping::shaped(0.5)), USUAL),
    recipe(Group::Rule, ("damping-slow", "λ falls slower at first (power 2)"), Method::damped(Damping::shaped(2.0)), USUAL),
    recipe(
        Group::Rule,
        ("adaptive", "λ by the gain ratio, × 0.8 or 1.25"),
        Method::damped(Damping::Adaptive { factor: 0.8 }),
        USUAL,
    ),
    recipe(
        Group::Rule,
        ("adaptive-quick", "λ by the gain ratio, × 0.5 or 2"),
        Method::damped(Damping::Adaptive { factor: 0.5 }),
        USUAL,
    ),
    recipe(Group::Rule, ("damping-loss", "λ = loss, at most 0.1"), Method::damped(Damping::Loss { factor: 1.0 }), USUAL),
    recipe(Group::Rule, ("damping-loss-10", "λ = loss / 10, at most 0.1"), Method::damped(Damping::Loss { factor: 0.1 }), USUAL),
    recipe(Group::Momentum, ("momentum-0", "no momentum"), Method::momentum(0.0), USUAL),
    recipe(Group::Momentum, ("momentum-0.5", "μ = 0.5"), Method::momentum(0.5), USUAL),
    recipe(Group::Momentum, ("momentum-0.8", "μ = 0.8"), Method::momentum(0.8), USUAL),
    recipe(Group::Momentum, ("momentum-0.95", "μ = 0.95"), Method::momentum(0.95), USUAL),
    recipe(Group::Momentum, ("momentum-0.99", "μ = 0.99"), Method::momentum(0.99), USUAL),
    recipe(Group::Rate, ("rate-0.25", "η from 0.25"), Method::rate(0.25), USUAL),
    recipe(Group::Rate, ("rate-1", "η from 1"), Method::rate(1.0), USUAL),
    recipe(Group::Batch, ("batch-32", "32 samples"), Method::damped(Damping::DEFAULT), Batch::fixed(32)),
    recipe(Group::Batch, ("batch-64", "64 samples"), Method::damped(Damping::DEFAULT), Batch::fixed(64)),
    recipe(Group::Batch, ("batch-128", "128 samples"), Method::damped(Damping::DEFAULT), Batch::fixed(128)),
    recipe(Group::Batch, ("batch-512", "512 samples"), Method::damped(Damping::DEFAULT), Batch::fixed(512)),
    recipe(Group::Batch, ("batch-1024", "1024 samples"), Method::damped(Damping::DEFAULT), Batch::fixed(1024)),
    recipe(Group::Batch, ("batch-32-256", "32 samples growing to 256"), Method::damped(Damping::DEFAULT), Batch { first: 32, last: 256 }),
    recipe(Group::Batch, ("batch-64-512", "64 samples growing to 512"), Method::damped(Damping::DEFAULT), Batch { first: 64, last: 512 }),
    recipe(Group::Batch, ("batch-128-512", "128 samples growing to 512"), Method::damped(Damping::DEFAULT), Batch { first: 128, last: 512 }),
    recipe(Group::Method, ("adam", "Adam, f64, 512 samples, η from 3e-3"), Method::adam(3e-3, Precision::F64), Batch::fixed(512)),
    recipe(Group::Method, ("adam-64", "Adam, f64, 64 samples, η from 3e-3"), Method::adam(3e-3, Precision::F64), Batch::fixed(64)),
    recipe(Group::Method, ("adam-f32", "Adam, f32, 512 samples, η from 3e-3"), Method::adam(3e-3, Precision::F32), Batch::fixed(512)),
    recipe(Group::Method, ("polished-0.1", "Adam in f32 for 10 %, then natural in f64"), Method::Polished { share: 0.1 }, USUAL),
    recipe(Group::Method, ("polished-0.3", "Adam in f32 for 30 %, then natural in f64"), Method::Polished { share: 0.3 }, USUAL),
];

pub(super) fn natural(rate: f64, momentum: f64) -> NaturalConfig {
    NaturalConfig {
        rate,
        momentum,
        ..NaturalConfig::default()
    }
}

pub(super) fn adam(rate: f64) -> AdamConfig {
    AdamConfig {
        rate,
        ..AdamConfig::default()
    }
}
