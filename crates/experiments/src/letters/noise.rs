//! Noisy torques: the error against the clean ones. Letters held back, as noisy as the rest, choose the damping and the
//! step at which each fit is at its best.

use anyhow::Result;
use lagrangian::Dataset;
use lagrangian::analytic::normal;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::contestants::CONTESTANTS;
use super::data::Letters;
use super::{begin, config, mse};
use crate::families::{self, MakeFamily};
use crate::harness::{Contestant, Lab};

/// Deviations of the noise, as parts of the torques' own.
pub(super) const LEVELS: [f64; 2] = [0.01, 0.05];
/// Last dampings λ among which the validation chooses.
pub(super) const CANDIDATES: [f64; 3] = [1e-5, 1e-4, 1e-3];
/// Letters held back to choose by.
const HELD: usize = 3;

pub(super) fn measure(lab: &mut Lab, letters: &Letters, seconds: f64) -> Result<()> {
    for who in &CONTESTANTS {
        for level in LEVELS {
            for seed in lab.seeds() {
                one(lab, letters, who, (level, seconds), seed)?;
            }
        }
    }
    Ok(())
}

fn one(
    lab: &mut Lab,
    letters: &Letters,
    who: &Contestant<MakeFamily>,
    (level, seconds): (f64, f64),
    seed: u64,
) -> Result<()> {
    let own = letters.torque_variance();
    let variances: Vec<f64> = own.iter().map(|v| level * level * v).collect();
    let data = noisy(letters, &variances, seed)?;
    let candidates: Vec<Option<f64>> = match families::is_rigid(who.config) {
        true => vec![None],
        false => CANDIDATES.map(Some).to_vec(),
    };
    let mut best: Option<(f64, f64, Option<f64>)> = None;
    for damping in candidates {
        let part = format_args!(", noise {level}, seed {seed}");
        begin(lab, who, part, seconds)?;
        let mut settings = config(who.config, seconds, seed);
        if let Some(damping_last) = damping {
            settings.optimizer = families::natural(damping_last);
        }
        let fitted = lab.fit(&data, &settings)?;
        if best.is_none_or(|(least, ..)| fitted.best < least) {
            best = Some((fitted.best, mse(&fitted.model, &letters.test), damping));
        }
    }
    let (_, clean, damping) = best.unwrap_or((f64::NAN, f64::NAN, None));
    let relative = clean / variances.iter().sum::<f64>();
    lab.row(&format!("noise {} %", 100.0 * level), who)
        .add("error_over_noise_variance", relative)
        .detail("damping", damping);
    Ok(())
}

/// All training letters with noise on their torques, some of them held back.
fn noisy(letters: &Letters, variances: &[f64], seed: u64) -> Result<Dataset> {
    let sigma: Vec<f64> = variances.iter().map(|v| v.sqrt()).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut motions = letters.chosen(usize::MAX, seed);
    for motion in &mut motions {
        for (x, sigma) in motion.tau.iter_mut().zip(sigma.iter().cycle()) {
            *x += sigma * normal(&mut rng);
        }
    }
    let held = motions.split_off(motions.len().saturating_sub(HELD).max(1));
    Ok(Dataset::new(letters.coordinates.clone(), &motions, &held)?)
}
