//! Noisy torques: the error against the clean ones. Letters held back, as noisy as the rest, choose the damping and the
//! step at which each fit is at its best.

use anyhow::Result;
use lagrangian::Trajectory;
use lagrangian::dataset::Dataset;
use lagrangian::experiment::letters::{Letters, error};
use lagrangian::train::{NaturalConfig, Optimizer, fit};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde_json::{Value, json};

use super::contestants::{CONTESTANTS, Contestant};
use super::{Course, Plan, config};

/// Last dampings λ among which the validation chooses.
pub(super) const CANDIDATES: [f64; 3] = [1e-5, 1e-4, 1e-3];

/// Letters held back to choose by.
const HELD: usize = 3;

/// What one family makes of one level of noise.
pub(super) struct Noisy {
    pub(super) contestant: &'static Contestant,
    /// Deviation of the noise, as a part of the torques' own.
    pub(super) level: f64,
    /// Mean squared error against the clean torque over the variance of the noise, `[seeds]`.
    pub(super) ratio: Vec<f64>,
    /// The damping that was chosen, `[seeds]`; none where nothing is to be chosen.
    pub(super) damping: Vec<Option<f64>>,
}

/// All families at all levels.
pub(super) struct Noise(pub(super) Vec<Noisy>);

pub(super) fn measure(letters: &Letters, plan: &Plan, course: &mut Course) -> Result<Noise> {
    let mut all = Vec::new();
    for contestant in CONTESTANTS {
        for &level in &plan.noise {
            let (mut ratio, mut damping) = (Vec::new(), Vec::new());
            for &seed in &plan.seeds {
                let (r, d) = one(letters, contestant, (level, seed), plan, course)?;
                ratio.push(r);
                damping.push(d);
            }
            all.push(Noisy {
                contestant,
                level,
                ratio,
                damping,
            });
        }
    }
    Ok(Noise(all))
}

fn one(
    letters: &Letters,
    contestant: &Contestant,
    (level, seed): (f64, u64),
    plan: &Plan,
    course: &mut Course,
) -> Result<(f64, Option<f64>)> {
    let variances: Vec<f64> = letters
        .torque_variance()
        .iter()
        .map(|v| level * level * v)
        .collect();
    let data = noisy(letters, &variances, seed)?;
    let candidates: Vec<Option<f64>> = match contestant.is_trained() {
        true => CANDIDATES.map(Some).to_vec(),
        false => vec![None],
    };
    let mut best: Option<(f64, f64, Option<f64>)> = None;
    for damping in candidates {
        let part = format!("{}, noise {level}, seed {seed}", contestant.name);
        course.begin(part, damping.map_or(0.0, |_| plan.short))?;
        let mut settings = config(contestant, plan.short, seed);
        if let Some(damping_last) = damping {
            settings.optimizer = Optimizer::Natural(NaturalConfig {
                damping_last,
                ..NaturalConfig::default()
            });
        }
        let fitted = fit(&data, &settings, None, course)?;
        course.check()?;
        let clean = error(&fitted.model, &letters.test).map_or(f64::NAN, |e| e.mse);
        if best.is_none_or(|(least, ..)| fitted.best < least) {
            best = Some((fitted.best, clean, damping));
        }
    }
    let (_, clean, damping) = best.unwrap_or((f64::NAN, f64::NAN, None));
    Ok((clean / variances.iter().sum::<f64>(), damping))
}

/// All training letters with noise on their torques, some of them held back.
fn noisy(letters: &Letters, variances: &[f64], seed: u64) -> Result<Dataset> {
    let sigma: Vec<f64> = variances.iter().map(|v| v.sqrt()).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut motions = letters.chosen(usize::MAX, seed);
    motions
        .iter_mut()
        .for_each(|motion: &mut Trajectory| motion.add_force_noise(&sigma, &mut rng));
    let held = motions.split_off(motions.len().saturating_sub(HELD).max(1));
    Ok(Dataset::new(letters.coordinates.clone(), &motions, &held)?)
}

impl Noise {
    pub(super) fn json(&self) -> Value {
        let mut figures = json!({});
        for one in &self.0 {
            let level = format!("{} %", 100.0 * one.level);
            figures[level][one.contestant.key] = json!({
                "error_over_noise_variance": one.ratio,
                "damping": one.damping,
            });
        }
        figures
    }
}
