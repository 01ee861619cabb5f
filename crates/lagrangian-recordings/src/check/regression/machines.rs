//! Detection of a foreign machine: a regression over all recordings must predict each as well as one over it alone.

use rayon::prelude::*;

use super::Filtered;
use super::least_squares::{Part, jackknife};
use super::terms::FrictionCoupling;

/// Smallest number of stretches of a recording that is compared.
const FEWEST: usize = 4;
/// Recordings agree where the pooled model leaves at most this many times the residual of the own model of each.
const AGREE: f64 = 2.0;

/// A recording that its own model explains better than the model of all recordings.
#[derive(Debug, Clone, Copy)]
pub(in crate::check) struct ForeignRecording {
    /// Index among the recordings that were compared.
    pub(in crate::check) recording: usize,
    /// Ratio of the squared errors of its forces, pooled model over its own; geometric mean over stretches and joints.
    pub(in crate::check) times: f64,
    /// Standard error of the logarithm of that ratio.
    pub(in crate::check) error: f64,
    /// Part of the variance of all forces that the pooled model leaves unexplained in its forces, mean over the joints.
    pub(in crate::check) left: f64,
    /// Whether one model serves all other recordings, of which there are several: a rough model of a machine that it cannot express
    /// still fits each recording alone.
    pub(in crate::check) others_agree: bool,
}

/// Comparison of each recording with the pooled model; recordings with too few stretches are omitted.
pub(super) fn strangers(filtered: &Filtered<'_>) -> Vec<ForeignRecording> {
    let Some(stretches) = filtered.signals(0.0, &[0.0]) else {
        return Vec::new();
    };
    let n = stretches.speeds.len();
    let of_joint = |i: usize| stretches.parts(i, 1, FrictionCoupling::Neighbours);
    let joints: Vec<Vec<Part>> = (0..n).into_par_iter().map(of_joint).collect();
    let joints: Vec<Vec<&Part>> = joints.iter().map(|parts| parts.iter().collect()).collect();
    let owners: Vec<usize> = stretches.signals.iter().map(|s| s.source).collect();
    let count = |r: usize| owners.iter().filter(|o| **o == r).count();
    let able: Vec<usize> = (0..filtered.recordings)
        .filter(|r| count(*r) >= FEWEST)
        .collect();
    if able.len() < 2 {
        return Vec::new();
    }
    let all = compared(&joints, &owners, &able);
    let with_others = |s: ForeignRecording| {
        let others: Vec<usize> = able.iter().copied().filter(|r| *r != s.recording).collect();
        let strange = s.times > AGREE && others.len() > 1;
        let others = if strange {
            without(&joints, &owners, s.recording, &others)
        } else {
            Vec::new()
        };
        ForeignRecording {
            others_agree: !others.is_empty() && others.iter().all(|o| o.times < AGREE),
            ..s
        }
    };
    all.into_iter().map(with_others).collect()
}

/// Comparison of each of these recordings with all.
fn compared(joints: &[Vec<&Part>], owners: &[usize], able: &[usize]) -> Vec<ForeignRecording> {
    let own = able.into_par_iter();
    own.filter_map(|r| stranger(joints, owners, *r)).collect()
}

/// Comparison of each of these recordings with all but one.
fn without(
    joints: &[Vec<&Part>],
    owners: &[usize],
    left: usize,
    able: &[usize],
) -> Vec<ForeignRecording> {
    let kept = |parts: &Vec<&'_ Part>| -> Vec<usize> {
        (0..parts.len()).filter(|s| owners[*s] != left).collect()
    };
    let of_joint = |parts: &Vec<_>| kept(parts).into_iter().map(|s| parts[s]).collect();
    let joints: Vec<Vec<&Part>> = joints.iter().map(of_joint).collect();
    let owners: Vec<usize> = owners.iter().copied().filter(|o| *o != left).collect();
    compared(&joints, &owners, able)
}

/// Comparison on the stretches of recording `r`: the pooled model against the model of its other stretches.
fn stranger(joints: &[Vec<&Part>], owners: &[usize], r: usize) -> Option<ForeignRecording> {
    let stretches: Vec<usize> = (0..owners.len()).filter(|s| owners[*s] == r).collect();
    let mut ratios = vec![0.0; stretches.len()];
    let (mut compared, mut left) = (0.0, 0.0);
    for parts in joints {
        let mut all = Part::sum(parts.iter().copied())?;
        if all.variance() <= 0.0 {
            continue; // a joint without a force
        }
        let here: Vec<&Part> = stretches.iter().map(|s| parts[*s]).collect();
        let mut own = Part::sum(here.iter().copied())?;
        compared += 1.0;
        let (pooled, alone) = (all.errors(&here)?, own.errors(&here)?);
        for (ratio, (error, own)) in ratios.iter_mut().zip(pooled.iter().zip(&alone)) {
            *ratio += error.ln() - own.ln();
        }
        left += pooled.iter().sum::<f64>() / own.rows() * all.rows() / all.variance();
    }
    ratios.iter_mut().for_each(|ratio| *ratio /= compared);
    let mean = |left: usize| {
        let others = ratios.iter().enumerate().filter(|(k, _)| *k != left);
        others.map(|(_, x)| x).sum::<f64>() / (ratios.len() - 1) as f64
    };
    let whole = ratios.iter().sum::<f64>() / ratios.len() as f64;
    Some(ForeignRecording {
        recording: r,
        times: whole.exp(),
        error: jackknife((0..ratios.len()).map(mean)),
        left: left / compared,
        others_agree: false,
    })
    .filter(|s| s.times.is_finite() && s.error.is_finite())
}
