#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use super::*;
use crate::experiment::existence::{System, noisy};
use crate::lagrangian::LnnConfig;
use crate::train::Budget;

#[test]
#[ignore = "calibration"]
fn calibration() {
    let env = |name: &str, default: f64| {
        std::env::var(name)
            .ok()
            .and_then(|x| x.parse().ok())
            .unwrap_or(default)
    };
    let only = std::env::var("ONLY").unwrap_or_default();
    for system in System::ALL {
        if !only.is_empty() && !only.split(',').any(|o| o == system.name()) {
            continue;
        }
        for seed in 0..env("SEEDS", 1.0) as u64 {
            let recordings = system.recordings(24, seed).unwrap();
            let recordings = noisy(recordings, env("NOISE", 0.0), seed + 100);
            let config = SurveyConfig {
                seed,
                budget: Budget::Steps(env("STEPS", 200.0) as usize),
                batch: env("BATCH", 128.0) as usize,
                network: LnnConfig {
                    width: env("WIDTH", 32.0) as usize,
                    ..Default::default()
                },
            };
            let clock = std::time::Instant::now();
            let s = survey(
                &system.coordinates().unwrap(),
                &recordings,
                &config,
                &mut (),
            )
            .unwrap();
            println!(
                "{:24} {seed} {:5.1}s {:?} {:.3} (truth {:?}) c {:.1e} f {:.1e} u {:.1e} hidden {:?} rec {}",
                system.name(),
                clock.elapsed().as_secs_f64(),
                s.verdict.existence,
                s.verdict.confidence,
                system.truth(),
                s.conservative.relative,
                s.friction.relative,
                s.unrestricted.relative,
                s.hidden,
                s.recordings
            );
            if let Some(a) = &s.asymmetry {
                println!(
                    "      asym {:.2e} chance {:.2e} regular {:.2} of {}",
                    a.median, a.chance, a.regularity, a.motions
                );
            }
            if let Some(a) = &s.damping {
                println!(
                    "      damping {:.2e} coupled {:.2e} chance {:.2e} mean {:?}",
                    a.whole, a.coupled, a.chance, a.mean
                );
            }
            if let Some(c) = &s.contraction {
                println!(
                    "      div {:.2e} ± {:.1e} chance {:.1e} of {}",
                    c.found.rate, c.found.error, c.chance, c.found.motions
                );
            }
        }
    }
}
