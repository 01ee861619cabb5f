//! Systems of which it is known whether a Lagrangian exists, and what their recordings say.

mod laws;
mod systems;

use anyhow::Result;
use lagrangian_analysis::existence::{Survey, SurveyConfig, survey};
use lagrangian_report::{Axis, Role};

use crate::harness::{Experiment, Lab, contestant, less, more, neither};
use systems::{SYSTEMS, System, noisy};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "is-lagrangian",
    about: "does any Lagrangian exist? eleven systems of which it is known",
    run,
    title: "Is it Lagrangian?",
    text: &[
        "Three kinds of evidence: a Lagrangian, one with friction, and a plain network are fitted alike, and a restriction \
         that costs nothing on held-out recordings holds; the conditions of Helmholtz ask the plain network's field for a \
         multiplier that makes it a Lagrangian's; and motions that come back must neither draw together nor spread. Below, \
         each system without noise, first seed.",
    ],
    quantities: &[
        more("right", "right verdict", ""),
        neither("confidence", "confidence", ""),
        less("lagrangian", "Lagrangian", ""),
        less("with_friction", "with friction", ""),
        less("any_force", "any force", ""),
        neither("asymmetry", "Helmholtz", ""),
        neither("asymmetry_chance", "its chance", ""),
        neither("coupled_damping", "damping off the diagonal", ""),
        neither("coupled_chance", "its chance", ""),
        neither("divergence", "divergence", "1/s"),
        neither("divergence_error", "its error", "1/s"),
    ],
    about_quantities: "Relative errors of held-out accelerations of the three fits; what the best multiplier of the \
                       Helmholtz conditions leaves, and what errors of learning can make of it; for the driven body, the \
                       damping that couples coordinates; the mean divergence of motions that come back. No published \
                       values are known: the conditions are those of Helmholtz (1887), Darboux (1894) and Douglas (1941).",
    ..Experiment::EMPTY
};

/// Recordings of each system.
const RECORDINGS: usize = 24;
/// Noise of the accelerations, as parts of their root mean squares.
const NOISES: [f64; 2] = [0.0, 0.01];
fn run(lab: &mut Lab) -> Result<()> {
    let (quick, all) = (lab.quick(), SYSTEMS.iter());
    let systems: Vec<&System> = all.filter(|system| system.is_quick() || !quick).collect();
    let noises: &[f64] = if lab.quick() { &NOISES[..1] } else { &NOISES };
    lab.plan(systems.len() * noises.len() * lab.seeds().len());
    let (mut right, mut of) = (0, 0);
    for &noise in noises {
        for (place, system) in systems.iter().enumerate() {
            let coordinates = system.coordinates()?;
            for seed in lab.seeds() {
                lab.begin(format!("{}, noise {noise}, seed {seed}", system.name))?;
                let recordings = noisy(system.recordings(RECORDINGS, seed)?, noise, seed);
                let config = SurveyConfig {
                    budget: lab.budget(300, 80),
                    seed,
                };
                let survey = survey(&coordinates, &recordings, &config, &mut lab.progress)?;
                lab.progress.check()?;
                right += usize::from(survey.verdict.existence == system.truth);
                of += 1;
                record(lab, system, noise, &survey);
                draw(lab, place, noise, &survey);
                if noise == 0.0 && seed == lab.args.seed {
                    let verdict = &survey.verdict;
                    let reasons = verdict.reasons.join(" ");
                    let (place, existence) = (place + 1, verdict.existence);
                    let text = format!("{place} {}: {existence}. {reasons}", system.name);
                    lab.results.text.push(text);
                }
            }
        }
    }
    lab.results.others.insert("right".into(), right.into());
    lab.results.others.insert("of".into(), of.into());
    lab.setting("Right verdicts", format!("{right} of {of}"));
    Ok(())
}

fn record(lab: &mut Lab, system: &System, noise: f64, survey: &Survey) {
    let who = contestant(system.name, system.name, Role::Lnn, ());
    let truth = system.truth;
    let right = survey.verdict.existence == truth;
    let asymmetry = survey.asymmetry;
    let damping = survey.damping;
    let divergence = survey.divergence;
    lab.row(&format!("noise_{noise}"), &who)
        .add("right", f64::from(u8::from(right)))
        .add("confidence", survey.verdict.confidence)
        .add("lagrangian", survey.conservative.relative)
        .add("with_friction", survey.friction.relative)
        .add("any_force", survey.unrestricted.relative)
        .add("asymmetry", asymmetry.map(|a| a.median))
        .add("asymmetry_chance", asymmetry.map(|a| a.chance))
        .add("coupled_damping", damping.map(|d| d.coupled))
        .add("coupled_chance", damping.map(|d| d.chance))
        .add("divergence", divergence.map(|d| d.rate))
        .add("divergence_error", divergence.map(|d| d.error))
        .detail("truth", truth)
        .detail("survey", survey);
}

/// A dash for each seed of each system: errors of the three fits, Helmholtz' conditions, divergence.
fn draw(lab: &mut Lab, place: usize, noise: f64, survey: &Survey) {
    let (asymmetry, divergence) = (survey.asymmetry, survey.divergence);
    let fits = [&survey.conservative, &survey.friction, &survey.unrestricted];
    let [lagrangian, friction, any] = fits.map(|fit| Some(fit.relative));
    let errors = vec![
        ("Lagrangian", Role::Lnn, lagrangian),
        ("with friction", Role::Other(0), friction),
        ("any force", Role::Baseline, any),
    ];
    let (learned, chance) = (asymmetry.map(|a| a.median), asymmetry.map(|a| a.chance));
    let asymmetries = vec![
        ("learned field", Role::Lnn, learned),
        ("errors of learning", Role::Baseline, chance),
    ];
    let mean = divergence.map(|d| d.rate.abs());
    let divergences = vec![
        ("|mean|", Role::Lnn, mean),
        ("error", Role::Baseline, divergence.map(|d| d.error)),
    ];
    let title = "What the best multiplier leaves of the Helmholtz conditions";
    let panels = [
        ("errors", "Errors of the three fits", "error of q̈", errors),
        ("helmholtz", title, "asymmetry, part of Φ", asymmetries),
        (
            "divergence",
            "Mean divergence of motions that come back",
            "|mean divergence|, 1/s",
            divergences,
        ),
    ];
    for (id, title, y, values) in panels {
        let caption = "A dot for each seed over the number of the system in the table. Where a Lagrangian exists it \
                           costs nothing, leaves no more than errors of learning do, and keeps the divergence at 0.";
        let plot = lab
            .plot(format!("{id}-{noise}"), format!("{title}, noise {noise}"))
            .caption(caption)
            .x(Axis::linear("system", ""))
            .y(Axis::log(y, ""));
        for (k, (name, role, value)) in values.into_iter().enumerate() {
            if let Some(value) = value {
                let x = (place + 1) as f64 + 0.15 * (k as f64 - 1.0);
                plot.dot(name, role, x, value);
            }
        }
    }
}
