//! The learning curve: torque error over the number of letters to learn from.

use anyhow::Result;
use lagrangian::dataset::Dataset;
use lagrangian::experiment::letters::{Letters, error};
use lagrangian::train::fit;
use serde_json::{Value, json};

use super::contestants::{CONTESTANTS, Contestant};
use super::{Course, Plan, config};

/// Torque MSE for each family, `[seeds][counts]`.
pub(super) struct Curve {
    pub(super) counts: Vec<usize>,
    pub(super) runs: Vec<(&'static Contestant, Vec<Vec<f64>>)>,
}

pub(super) fn measure(letters: &Letters, plan: &Plan, course: &mut Course) -> Result<Curve> {
    let mut all = Vec::new();
    for contestant in CONTESTANTS {
        let mut runs = Vec::new();
        for &seed in &plan.seeds {
            let of = |count: &usize| one(letters, contestant, (*count, seed), plan, course);
            runs.push(plan.counts.iter().map(of).collect::<Result<Vec<f64>>>()?);
        }
        all.push((contestant, runs));
    }
    Ok(Curve {
        counts: plan.counts.clone(),
        runs: all,
    })
}

fn one(
    letters: &Letters,
    contestant: &Contestant,
    (count, seed): (usize, u64),
    plan: &Plan,
    course: &mut Course,
) -> Result<f64> {
    let trained = f64::from(u8::from(contestant.is_trained()));
    let part = format!("{} from {count} letters, seed {seed}", contestant.name);
    course.begin(part, trained * plan.short)?;
    let motions = letters.chosen(count, seed);
    let data = Dataset::new(letters.coordinates.clone(), &motions, &motions)?;
    let model = fit(&data, &config(contestant, plan.short, seed), None, course)?.model;
    course.check()?;
    Ok(error(&model, &letters.test).map_or(f64::NAN, |e| e.mse))
}

impl Curve {
    pub(super) fn json(&self) -> Value {
        let mut figures = json!({ "letters": self.counts });
        for (contestant, runs) in &self.runs {
            figures[contestant.key] = json!(runs);
        }
        figures
    }
}
