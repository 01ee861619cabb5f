//! The terms of a formula from recorded motions, and their coefficients (ADR 0143).
//!
//! | file | content |
//! |---|---|
//! | `library.rs` | the terms that may be |
//! | `rows.rs` | Hamilton's principle as rows, which need no acceleration |
//! | `smooth.rs` | states of noisy recordings whose noise is known |
//! | `eliminate.rs` | ever fewer terms, by the smallest ratio of residual to noise |
//! | `cyclic.rs` | coordinates whose momenta the motions keep |
//! | `refine.rs` | coefficients by rollouts, their standard errors |

mod cyclic;
mod eliminate;
mod library;
mod refine;
mod rows;
mod smooth;

use nets::Instant;
use serde::{Deserialize, Serialize};

pub(crate) use cyclic::{Drift, contradiction, drifts};
pub(crate) use refine::{errors, scores};
pub(crate) use rows::{STRIDE, Stretch, WINDOW, Weight, noise_sizes, positions, stretches};

use super::{FormulaConfig, Term};
use crate::dataset::Dataset;
use crate::models::family::Solution;
use crate::train::{Observer, TrainingTask};
use eliminate::{Candidate, Inertia, Limits};
use lagrangian_motion::statistics::{size, sort_by_number};
use lagrangian_motion::{Error, Result};
use refine::{Refined, Start};
use rows::Rows;

/// A misfit of rows up to this multiple of the least is as good.
const NEARLY: f64 = 2.0;
/// Formulas of more coefficients are not refined.
const MOST_TERMS: usize = 24;
/// … and of more than these no term is added or left out.
const MANY: usize = 14;
/// A misfit of rollouts with which no other start is tried.
const GOOD: f64 = 1.15;
/// The time after which nothing more is tried, s.
const LONGEST: f64 = 30.0;
/// Rounds of refinement, each with other terms.
const ROUNDS: usize = 4;
/// A coefficient below so many standard errors is left out …
const SIGNIFICANT: f64 = 3.5;
/// … and a term beyond so many is added.
const MISSING: f64 = 4.5;
/// Of a law each coefficient is at least so many standard errors, and each series of terms ends so abruptly.
const CERTAIN: f64 = 20.0;
const ABRUPT: f64 = 40.0;
/// The largest misfit of a law beside chance, and chance in standard errors.
const FITS: f64 = 1.06;
const CHANCE: f64 = 4.5;

/// What a formula is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LawVerdict {
    /// The data are explained to their noise, and each term is needed: the law, as far as these data tell.
    Law,
    /// The data are explained to their noise, or nearly, by an expansion: more terms would be better with better data.
    Expansion,
    /// No formula of such terms explains the data.
    None,
}

impl LawVerdict {
    /// Its name.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Law => "law",
            Self::Expansion => "expansion",
            Self::None => "none",
        }
    }

    /// What it means.
    pub(super) fn meaning(self) -> &'static str {
        match self {
            Self::Law => {
                "the law, as far as these data tell: it explains them to their noise, and each of its terms is needed"
            }
            Self::Expansion => {
                "an expansion and not the law: it explains the data nearly to their noise, but its series of terms does not end, or other \
                 terms would do as well"
            }
            Self::None => {
                "no law: a sum of harmonics, powers and friction does not explain these data to their noise"
            }
        }
    }
}

/// Finds the terms, where the configuration has none, and their coefficients.
pub(super) fn find(
    dataset: &Dataset,
    config: &FormulaConfig,
    task: &TrainingTask,
    observer: &mut dyn Observer,
) -> Result<Solution> {
    let terms = match config.terms.is_empty() {
        true => library::library(dataset),
        false => config.terms.clone(),
    };
    let (rows, noise) = Rows::of(dataset, &terms);
    let mut tell = |share: f64| !observer.stage("finding terms", share).is_break();
    let path = paths(dataset, &terms, &rows, &mut tell);
    let data = dataset.train.spread(300);
    let starts: Vec<(f64, Start)> = path
        .iter()
        .map(|own| {
            (
                own.misfit.max(own.held).max(1.0),
                Start::of(own, &terms, dataset),
            )
        })
        .filter(|(_, start)| {
            start.len() <= MOST_TERMS && start.is_definite(&data, &dataset.coordinates)
        })
        .collect();
    let search = Search {
        dataset,
        terms: &terms,
        given: (&noise, task),
        clock: Instant::now(),
    };
    let mut best: Option<(Start, Refined, bool)> = None;
    for start in promising(&starts) {
        let own = search.refined(start.clone(), observer)?;
        if best
            .as_ref()
            .is_none_or(|best| own.1.misfit < best.1.misfit)
        {
            best = Some(own);
        }
        if best.as_ref().is_some_and(|best| best.1.misfit < GOOD) || search.is_late() {
            break;
        }
    }
    let (start, refined, complete) = best.ok_or_else(nothing)?;
    let judged = search.judged((&start, &refined), complete)?;
    refined.solution(dataset, &start, task, judged)
}

/// Ever fewer terms that explain the rows, the most first.
fn paths(
    dataset: &Dataset,
    terms: &[Term],
    rows: &Rows,
    tell: &mut dyn FnMut(f64) -> bool,
) -> Vec<Candidate> {
    let (n, force) = (dataset.coordinates.dof(), rows.values().saturating_sub(1));
    let mut active: Vec<usize> = (0..force).collect();
    let keep: Vec<usize> = dataset.forced.then_some(force).into_iter().collect();
    active.extend(&keep);
    let frictions = (0..rows::KINDS * n).map(|k| 1.0 + 0.7 * (k / n) as f64);
    let complexity = terms.iter().map(Term::complexity).chain(frictions);
    let inertia = |i: usize| {
        let all = 0..terms.len();
        all.filter(|k| terms[*k].speeds == [i, i]).collect()
    };
    let limits = Limits {
        keep,
        one_of: (0..n).map(inertia).collect(),
        complexity: complexity.collect(),
        inertia: inertia_of(terms, dataset, rows.values()),
    };
    // Of a linear motion other Lagrangians couple what the simplest one does not.
    let couples = |k: &usize| terms.get(*k).is_some_and(Term::couples_alone);
    let apart: Vec<usize> = active.iter().copied().filter(|k| !couples(k)).collect();
    let mut path = eliminate::path(rows, apart, &limits, tell);
    if n > 1 {
        path.extend(eliminate::path(rows, active, &limits, tell));
        sort_by_number(&mut path, |own| -(own.values.len() as f64));
    }
    path
}

/// The starts from which a formula is refined: the fewest terms that explain rows nearly as well as any, then those after which a term
/// less is the greatest loss.
fn promising(starts: &[(f64, Start)]) -> Vec<&Start> {
    let least = starts.iter().map(|own| own.0).fold(f64::INFINITY, f64::min);
    let Some(first) = starts.iter().rposition(|own| own.0 <= NEARLY * least) else {
        return Vec::new();
    };
    let loss = |k: usize| starts.get(k + 1).map_or(1.0, |next| next.0 / starts[k].0);
    let mut order: Vec<usize> = (0..starts.len()).collect();
    sort_by_number(&mut order, |k| -loss(*k));
    order.retain(|k| *k != first);
    let all = [first].into_iter().chain(order.into_iter().take(1));
    all.map(|k| &starts[k].1).collect()
}

/// What a search is about.
struct Search<'a> {
    dataset: &'a Dataset,
    terms: &'a [Term],
    given: (&'a [f64], &'a TrainingTask),
    clock: Instant,
}

impl Search<'_> {
    /// The formula near a start: terms whose coefficients are nothing go, and those that are missing come; and whether it is known that
    /// none is missing.
    fn refined(
        &self,
        mut start: Start,
        observer: &mut dyn Observer,
    ) -> Result<(Start, Refined, bool)> {
        let mut refined = refine::refine(self.dataset, &start, self.given, observer)?;
        let rounds = if start.len() > MANY { 1 } else { ROUNDS };
        for _ in 0..rounds {
            let ended = observer.stage("looking for other terms", 0.5).is_break();
            if ended || self.is_late() {
                break;
            }
            let mut next = start.clone();
            if !next.without(&refined, SIGNIFICANT) {
                if !(EXACT..HOPELESS).contains(&refined.misfit) || next.len() >= MOST_TERMS {
                    break;
                }
                let missing = self.missing(&start, &refined)?;
                let least = missing
                    .first()
                    .map_or(MISSING, |(_, z)| MISSING.max(0.3 * z));
                let more = missing.iter().take(3).filter(|(_, z)| *z > least);
                let more: Vec<usize> = more.map(|(value, _)| *value).collect();
                if more.is_empty() {
                    return Ok((start, refined, true));
                }
                more.into_iter()
                    .for_each(|value| next.add(value, self.terms));
            }
            let own = refine::refine(self.dataset, &next, self.given, observer)?;
            if !own.misfit.is_finite() {
                break;
            }
            (start, refined) = (next, own);
        }
        Ok((start, refined, false))
    }

    /// Whether a law would have been found by now.
    fn is_late(&self) -> bool {
        self.clock.elapsed().as_secs_f64() > LONGEST
    }

    fn missing(&self, start: &Start, refined: &Refined) -> Result<Vec<(usize, f64)>> {
        refine::missing(self.dataset, (start, refined), self.terms, self.given)
    }

    /// What the formula is, and its misfit of held-out motions.
    fn judged(
        &self,
        (start, refined): (&Start, &Refined),
        complete: bool,
    ) -> Result<(LawVerdict, f64)> {
        let definite =
            start.is_definite(&self.dataset.train.spread(300), &self.dataset.coordinates);
        let [held, worst] = refine::held_out(self.dataset, (start, refined), self.given)?;
        let samples = (self.dataset.train.len() * self.dataset.train.n) as f64;
        let fits = refined.misfit <= FITS + CHANCE * (2.0 / samples).sqrt();
        if !(fits && definite && held <= GOOD) {
            let useful = definite && refined.misfit.max(held) <= NEARLY;
            let verdict = if useful {
                LawVerdict::Expansion
            } else {
                LawVerdict::None
            };
            return Ok((verdict, held));
        }
        let certain = refined.certainty(start) >= CERTAIN && refined.abruptness(start) >= ABRUPT;
        let complete = complete
            || refined.misfit < EXACT
            || self
                .missing(start, refined)?
                .first()
                .is_none_or(|(_, z)| *z <= MISSING);
        let law = certain && complete && worst <= CHANCE + 1.0;
        let verdict = if law {
            LawVerdict::Law
        } else {
            LawVerdict::Expansion
        };
        Ok((verdict, held))
    }
}

/// Misfits that need no more terms, and those that none mends.
const EXACT: f64 = 0.01;
const HOPELESS: f64 = 100.0;

/// The inertia of terms at these states, among so many values.
fn inertia_of(terms: &[Term], dataset: &Dataset, values: usize) -> Inertia {
    let data = dataset.train.spread(60);
    let n = data.n;
    let speeds = size(&data.qd, n);
    let of = |value: usize| match terms.get(value).filter(|term| term.is_kinetic()) {
        None => Vec::new(),
        Some(term) => (0..data.len())
            .flat_map(|s| {
                let place = term.place(data.row(s).q);
                let entry = |at: usize| {
                    let (i, j) = (at / n, at % n);
                    place * term.by_speeds(i, j) * speeds[i] * speeds[j]
                };
                (0..n * n).map(entry).collect::<Vec<_>>()
            })
            .collect(),
    };
    Inertia {
        coordinates: dataset.coordinates.clone(),
        of: (0..values).map(of).collect(),
    }
}

fn nothing() -> Error {
    Error::setting(
        "no formula was found: no sum of harmonics, powers and friction with a definite mass matrix explains these motions",
        "fit a network (`family` delan or lnn), or record wider motions",
    )
}
