//! The recipes that are compared: how the weights are improved, on how many samples, and which schedules.

use crate::train::{AdamConfig, DampingRule, NaturalConfig, Precision};

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
    /// By the quadratic model, see [`DampingRule::Adaptive`].
    Adaptive {
        /// Of one step.
        factor: f64,
    },
    /// λ = `factor` · mean r² of the batch, at most ⅒, see [`DampingRule::Loss`].
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
    /// SOAP: Adam in the eigenbasis of Shampoo's preconditioner.
    Soap {
        /// Largest η.
        rate: f64,
    },
    /// K-FAC, its step scaled by the exact quadratic model of the batch.
    Kfac {
        /// Largest share of that step.
        rate: f64,
        /// λ at the start and at the end; it falls geometrically.
        damping: (f64, f64),
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
    /// A growing batch and the damping.
    Both,
    /// The method itself.
    Method,
}

impl Group {
    /// All, in the order of the table.
    pub const ALL: [Self; 8] = [
        Self::Default,
        Self::Damping,
        Self::Rule,
        Self::Momentum,
        Self::Rate,
        Self::Batch,
        Self::Both,
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
            Self::Both => "growing batch and damping",
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
    recipe(Group::Batch, ("batch-64-256", "64 samples growing to 256"), Method::damped(Damping::DEFAULT), Batch { first: 64, last: 256 }),
    recipe(Group::Batch, ("batch-128-512", "128 samples growing to 512"), Method::damped(Damping::DEFAULT), Batch { first: 128, last: 512 }),
    recipe(
        Group::Both,
        ("growth-fast", "64 samples growing to 512, λ falls faster at first"),
        Method::damped(Damping::shaped(0.5)),
        Batch { first: 64, last: 512 },
    ),
    recipe(
        Group::Both,
        ("growth-loss", "64 samples growing to 512, λ = loss"),
        Method::damped(Damping::Loss { factor: 1.0 }),
        Batch { first: 64, last: 512 },
    ),
    recipe(
        Group::Both,
        ("growth-256-loss", "64 samples growing to 256, λ = loss"),
        Method::damped(Damping::Loss { factor: 1.0 }),
        Batch { first: 64, last: 256 },
    ),
    recipe(
        Group::Both,
        ("batch-128-loss", "128 samples, λ = loss"),
        Method::damped(Damping::Loss { factor: 1.0 }),
        Batch::fixed(128),
    ),
    recipe(
        Group::Both,
        ("growth-256-adaptive", "64 samples growing to 256, λ by the gain ratio"),
        Method::damped(Damping::Adaptive { factor: 0.8 }),
        Batch { first: 64, last: 256 },
    ),
    recipe(
        Group::Both,
        ("growth-adaptive", "64 samples growing to 512, λ by the gain ratio"),
        Method::damped(Damping::Adaptive { factor: 0.8 }),
        Batch { first: 64, last: 512 },
    ),
    recipe(Group::Method, ("adam", "Adam, f64, 512 samples, η from 3e-3"), Method::adam(3e-3, Precision::F64), Batch::fixed(512)),
    recipe(Group::Method, ("adam-64", "Adam, f64, 64 samples, η from 3e-3"), Method::adam(3e-3, Precision::F64), Batch::fixed(64)),
    recipe(Group::Method, ("adam-f32", "Adam, f32, 512 samples, η from 3e-3"), Method::adam(3e-3, Precision::F32), Batch::fixed(512)),
    recipe(Group::Method, ("soap", "SOAP, 256 samples, η from 3e-3"), Method::Soap { rate: 3e-3 }, USUAL),
    recipe(Group::Method, ("kfac", "K-FAC, 256 samples"), Method::Kfac { rate: 0.5, damping: (1e-1, 1e-7) }, USUAL),
    recipe(Group::Method, ("kfac-damped", "K-FAC, 256 samples, λ to 1e-4"), Method::Kfac { rate: 0.5, damping: (1e-1, 1e-4) }, USUAL),
    recipe(Group::Method, ("polished-0.1", "Adam in f32 for 10 %, then natural in f64"), Method::Polished { share: 0.1 }, USUAL),
    recipe(Group::Method, ("polished-0.3", "Adam in f32 for 30 %, then natural in f64"), Method::Polished { share: 0.3 }, USUAL),
];

pub(super) fn natural(damping: Damping, rate: f64, momentum: f64) -> NaturalConfig {
    let (damping_first, damping_last) = match damping {
        Damping::Falls { first, last, .. } => (first, last),
        Damping::Adaptive { .. } => (1e-1, 1e-7),
        // The loss alone.
        Damping::Loss { .. } => (1e-1, 1e-1),
    };
    NaturalConfig {
        rate,
        momentum,
        damping_first,
        damping_last,
        damping_rule: match damping {
            Damping::Falls { .. } => DampingRule::Schedule,
            Damping::Loss { factor } => DampingRule::Loss { factor },
            Damping::Adaptive { factor } => DampingRule::Adaptive { factor },
        },
        ..NaturalConfig::default()
    }
}

pub(super) fn adam(rate: f64) -> AdamConfig {
    AdamConfig {
        rate,
        ..AdamConfig::default()
    }
}
