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
use crate::train::{Budget, Observer, TrainingTask};
use eliminate::{Candidate, Inertia, Limits};
use lagrangian_motion::statistics::{column, deviation, mean, size, sort_by_number};
use lagrangian_motion::{Error, Result};
use refine::{HeldOut, Refined, Start, part_of};
use rows::{Noise, Rows};

/// A misfit of rows up to this multiple of the least is as good.
const NEARLY: f64 = 2.0;
/// A misfit of rows of which rollouts may still say that it is none.
const LIKELY: f64 = 4.0;
/// Formulas of more coefficients are not refined.
const MOST_TERMS: usize = 24;
/// … and of more than these no term is added or left out.
const MANY: usize = 14;
/// The most values of the law of one coordinate, and of one that needs no second opinion: a series of more explains many another law.
const FEW: usize = 6;
/// The simplest terms, for each coordinate, from which a second way begins.
const SIMPLE: usize = 8;
/// Starts that are tried because a term less is a great loss.
const KNEES: usize = 1;
/// A misfit of rollouts with which no other start is tried.
const GOOD: f64 = 1.15;
/// The time after which nothing more is tried, s, and sooner where a fit is to be shorter.
const LONGEST: f64 = 30.0;
/// … and after which no other reading of the coordinates is looked at, or searched.
const READ: f64 = 6.0;
const NEXT: f64 = 20.0;
/// A coordinate is far from 0 where its middle is so many times its deviation.
const FAR: f64 = 1.0;
/// Rounds of refinement, each with other terms.
const ROUNDS: usize = 4;
/// A coefficient below so many standard errors is left out …
const SIGNIFICANT: f64 = 3.5;
/// … and a term beyond so many is added, of no more than this number at once.
const MISSING: f64 = 4.5;
const AT_ONCE: usize = 3;
/// Of a law each coefficient is at least so many standard errors, and each series of terms ends so abruptly …
const CERTAIN: f64 = 20.0;
const ABRUPT: f64 = 40.0;
/// … and each of another formula so many.
const TOLD: f64 = 2.0;
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
                "no law: no sum of harmonics, powers and friction that was tried explains these data to their noise"
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
    let given = !config.origins.is_empty();
    let shifted = given.then(|| dataset.measured_from(&config.origins));
    let own = shifted.as_ref().unwrap_or(dataset);
    let mut best = searched(own, config, task, observer)?;
    let mut origins = config.origins.clone();
    let is_law = |own: &Option<Found>| own.as_ref().is_some_and(Found::is_law);
    // The page in a browser has no room for more.
    let more = !cfg!(target_family = "wasm") && config.terms.is_empty() && !is_law(&best);
    let middle = if more { middle(dataset) } else { None };
    if let Some(middle) = middle {
        // Powers of a coordinate far from 0 are much alike.
        let shifted = dataset.measured_from(&middle);
        let centred = searched(&shifted, config, task, observer)?;
        let spread = column(&dataset.train.q, dataset.coordinates.dof(), deviation);
        let rest = centred.as_ref();
        let rest = rest.and_then(|own| own.start.rest(&own.refined, &spread));
        let is_better = |own: &Found| best.as_ref().is_none_or(|best| own.order(best).is_lt());
        if centred.as_ref().is_some_and(is_better) {
            (best, origins) = (centred, middle.clone());
        }
        // … and those from where it rests are the fewest.
        if let Some(rest) = rest.filter(|own| own.iter().any(|x| *x != 0.0)) {
            let from: Vec<f64> = middle.iter().zip(rest).map(|(a, b)| a + b).collect();
            let at_rest = searched(&dataset.measured_from(&from), config, task, observer)?;
            let is_better = |own: &Found| {
                let fewer = |best: &Found| own.is_law() && own.start.len() < best.start.len();
                (best.as_ref()).is_none_or(|best| fewer(best) || own.order(best).is_lt())
            };
            if at_rest.as_ref().is_some_and(is_better) {
                (best, origins) = (at_rest, from);
            }
        }
    }
    let Found {
        start,
        refined,
        judged,
    } = best.ok_or_else(nothing)?;
    refined.solution(dataset, &start, task, judged, &origins)
}

/// The middle of each coordinate where all are lines, and one stays far from 0.
fn middle(dataset: &Dataset) -> Option<Vec<f64>> {
    let coordinates = &dataset.coordinates;
    let n = coordinates.dof();
    let is_plain = |i: usize| !coordinates.is_circle(i) && !coordinates.is_parameter(i);
    let [middle, spread] = [mean, deviation].map(|of| column(&dataset.train.q, n, of));
    let far = (0..n).any(|i| middle[i].abs() > FAR * spread[i]);
    (far && (0..n).all(is_plain)).then_some(middle)
}

/// What is found with these positions.
fn searched(
    dataset: &Dataset,
    config: &FormulaConfig,
    task: &TrainingTask,
    observer: &mut dyn Observer,
) -> Result<Option<Found>> {
    let clock = Instant::now();
    let readings = match config.terms.is_empty() {
        true => readings(dataset, &clock, observer),
        false => {
            let mut terms = config.terms.clone();
            terms.extend(Term::dampers(&dataset.coordinates));
            vec![Reading::of(dataset, terms)]
        }
    };
    let mut best: Option<Found> = None;
    for reading in &readings {
        let own = Found::of(dataset, reading, task, observer)?;
        best = best.into_iter().chain(own).min_by(Found::order);
        let is_law = best.as_ref().is_some_and(Found::is_law);
        if is_law || clock.elapsed().as_secs_f64() > NEXT.min(seconds_of(task)) {
            break;
        }
    }
    Ok(best)
}

/// The seconds that a fit may take.
fn seconds_of(task: &TrainingTask) -> f64 {
    match task.budget {
        Budget::Seconds(seconds) => seconds,
        Budget::Steps(_) => f64::INFINITY,
    }
}

/// The terms of one reading of the coordinates, and their rows.
struct Reading {
    terms: Vec<Term>,
    rows: Vec<Rows>,
    noise: Noise,
}

impl Reading {
    fn of(dataset: &Dataset, terms: Vec<Term>) -> Self {
        let (mut rows, noise) = Rows::of(dataset, &terms);
        for own in &mut rows {
            eliminate::settle_forces(&mut own.rows, dataset.coordinates.dof());
        }
        Self { terms, rows, noise }
    }

    fn candidates<'a>(&'a self, dataset: &'a Dataset) -> Candidates<'a> {
        Candidates {
            dataset,
            terms: &self.terms,
            rows: &self.rows,
        }
    }
}

/// The readings of the coordinates that explain rows about as well as any, those that do it best by the number of values that they need; the
/// coordinates as they were declared where none explains them.
fn readings(dataset: &Dataset, clock: &Instant, observer: &mut dyn Observer) -> Vec<Reading> {
    let all: Vec<usize> = (0..dataset.coordinates.dof()).collect();
    let readings = library::readings(&dataset.coordinates, &dataset.train).into_iter();
    let mut tell = |share: f64| !observer.stage("finding terms", share).is_break();
    let mut found: Vec<(f64, usize, Reading)> = Vec::new();
    let single = readings.len() == 1;
    for own in readings {
        let reading = Reading::of(dataset, library::library(dataset, &own));
        if single {
            return vec![reading];
        }
        let candidates = reading.candidates(dataset);
        let path = reading
            .rows
            .last()
            .map(|own| candidates.paths(own, &all, &mut tell));
        let path = path.unwrap_or_default();
        let first = candidates.promising(&all, &path).into_iter().next();
        let own = first.map(|own| (own.misfit.max(own.held), own.values.len()));
        let (misfit, needs) = own.unwrap_or((f64::INFINITY, 0));
        found.push((misfit, needs, reading));
        if clock.elapsed().as_secs_f64() > READ {
            break;
        }
    }
    let least = found.iter().map(|own| own.0).fold(f64::INFINITY, f64::min);
    match least < POOR {
        true => found.retain(|own| own.0 <= LIKELY * least.max(1.0)),
        false => found.truncate(1),
    }
    let worse = |misfit: f64| misfit > NEARLY * least.max(1.0);
    found.sort_by_key(|own| (worse(own.0), own.1));
    found.into_iter().map(|own| own.2).collect()
}

/// A formula, and what it is.
struct Found {
    start: Start,
    refined: Refined,
    judged: (LawVerdict, f64),
}

impl Found {
    /// The formula of a reading; `None` where none explains anything.
    fn of(
        dataset: &Dataset,
        reading: &Reading,
        task: &TrainingTask,
        observer: &mut dyn Observer,
    ) -> Result<Option<Self>> {
        let candidates = reading.candidates(dataset);
        let search = Search {
            dataset,
            terms: &reading.terms,
            given: (&reading.noise, task),
            clock: Instant::now(),
        };
        let mut best: Option<(Start, Refined, bool)> = None;
        let good = GOOD.max(search.by_chance());
        // Of what explains the motions, what the motions determine: another choice of terms may be uncertain.
        let uncertain = |(start, refined, _): &(Start, Refined, bool)| {
            let explains = refined.misfit < good;
            (
                !explains,
                !(explains && refined.certainty(start) >= CERTAIN),
            )
        };
        let is_found = |best: &Option<(Start, Refined, bool)>| {
            best.as_ref()
                .is_some_and(|own| uncertain(own) == (false, false))
        };
        for starts in [Candidates::apart, Candidates::together] {
            let mut tell = |share: f64| !observer.stage("finding terms", share).is_break();
            for start in starts(&candidates, &mut tell) {
                let own = search.lean(search.refined(start, observer)?, observer)?;
                let is_better = |best: &(Start, Refined, bool)| {
                    let order = uncertain(&own).cmp(&uncertain(best));
                    order.then(own.1.misfit.total_cmp(&best.1.misfit)).is_lt()
                };
                if best.as_ref().is_none_or(is_better) {
                    best = Some(own);
                }
                if is_found(&best) || search.is_over() {
                    break;
                }
            }
            if is_found(&best) {
                break;
            }
        }
        // Coefficients of what explains nothing are numbers without a meaning.
        let explains = best.filter(|own| own.1.misfit < HOPELESS);
        explains.map_or(Ok(None), |own| Self::judged(&search, own))
    }

    /// A formula and what it is; `None` where its coefficients are no better known than nothing.
    fn judged(
        search: &Search<'_>,
        (mut start, refined, complete): (Start, Refined, bool),
    ) -> Result<Option<Self>> {
        start.take_friction(&refined, SIGNIFICANT);
        let judged = search.judged((&start, &refined), complete)?;
        let is_told = judged.0 == LawVerdict::Law || refined.certainty(&start) >= TOLD;
        Ok(is_told.then_some(Self {
            start,
            refined,
            judged,
        }))
    }

    fn is_law(&self) -> bool {
        self.judged.0 == LawVerdict::Law
    }

    /// A law before an expansion, and the smaller misfit.
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let rank = |own: &Self| own.judged.0 as u8;
        let misfit = self.refined.misfit.total_cmp(&other.refined.misfit);
        rank(self).cmp(&rank(other)).then(misfit)
    }
}

/// Terms that may explain rows.
struct Candidates<'a> {
    dataset: &'a Dataset,
    terms: &'a [Term],
    /// … in one or more precisions, the finest first.
    rows: &'a [Rows],
}

impl Candidates<'_> {
    /// The starts of all coordinates together: the first of each precision, the fewest terms first, then the others.
    fn together(&self, tell: &mut dyn FnMut(f64) -> bool) -> Vec<Start> {
        let all: Vec<usize> = (0..self.dataset.coordinates.dof()).collect();
        let mut found: Vec<(usize, Candidate)> = Vec::new();
        for rows in self.rows {
            let path = self.paths(rows, &all, tell);
            let own = self.promising(&all, &path).into_iter().enumerate();
            found.extend(own.map(|(rank, own)| (rank, own.clone())));
            if found.first().is_some_and(|own| own.1.values.len() <= FEW) {
                break;
            }
        }
        found.sort_by_key(|(rank, own)| (*rank, own.values.len()));
        let start =
            |(_, own): &(_, Candidate)| Start::of(&[(own, all.clone())], self.terms, self.dataset);
        found.iter().map(start).collect()
    }

    /// The starts where some coordinates move as if there were no others: of each of these by itself, and of the others together.
    fn apart(&self, tell: &mut dyn FnMut(f64) -> bool) -> Vec<Start> {
        let groups = self.groups(tell);
        let each = groups.iter().map(|(own, path)| self.promising(own, path));
        let each: Vec<Vec<&Candidate>> = each.collect();
        let start = |k: usize| {
            let own = each.iter().zip(&groups).map(|(found, (group, _))| {
                let found = found.get(k).or(found.last());
                found.map(|own| (*own, group.clone()))
            });
            let own: Vec<(&Candidate, Vec<usize>)> = own.collect::<Option<_>>()?;
            (!own.is_empty()).then(|| Start::of(&own, self.terms, self.dataset))
        };
        let most = each.iter().map(Vec::len).max().unwrap_or(0);
        (0..most).filter_map(start).collect()
    }

    /// The coordinates that rows explain without the others, each by itself, and then all others together; none where these are not
    /// explained, or there is no such coordinate.
    fn groups(&self, tell: &mut dyn FnMut(f64) -> bool) -> Vec<(Vec<usize>, Vec<Candidate>)> {
        let coordinates = &self.dataset.coordinates;
        let moving = (0..coordinates.dof()).filter(|i| !coordinates.is_parameter(*i));
        let moving: Vec<usize> = moving.collect();
        let (mut all, mut rest) = (Vec::new(), Vec::new());
        let Some(rows) = self.rows.last().filter(|_| moving.len() > 1) else {
            return all;
        };
        for i in moving {
            let path = self.paths(rows, &[i], tell);
            let explains =
                |own: &Candidate| own.values.len() <= FEW && own.misfit.max(own.held) <= NEARLY;
            match path.iter().any(explains) {
                true => all.push((vec![i], path)),
                false => rest.push(i),
            }
        }
        if !(all.is_empty() || rest.is_empty()) {
            let path = self.paths(rows, &rest, tell);
            // A pole moves by itself on a cart that nobody pushes, but the cart does not.
            if !path.iter().any(|own| own.misfit <= LIKELY) {
                return Vec::new();
            }
            all.push((rest, path));
        }
        all
    }

    /// Ever fewer terms that explain the rows of these coordinates without the others, the most first.
    fn paths(
        &self,
        rows: &Rows,
        group: &[usize],
        tell: &mut dyn FnMut(f64) -> bool,
    ) -> Vec<Candidate> {
        let Self { dataset, terms, .. } = self;
        let n = dataset.coordinates.dof();
        let (count, force) = (terms.len(), rows.values().saturating_sub(1));
        let others =
            (0..n).filter(|i| !(group.contains(i) || dataset.coordinates.is_parameter(*i)));
        let others: Vec<usize> = others.collect();
        let is_within = |k: &usize| !others.iter().any(|i| terms[*k].uses(*i));
        let mut active: Vec<usize> = (0..count).filter(is_within).collect();
        active.extend((count..force).filter(|k| group.contains(&((k - count) % n))));
        let driven = dataset.driven();
        let is_driven = group.iter().any(|i| driven[*i]);
        let keep: Vec<usize> = is_driven.then_some(force).into_iter().collect();
        active.extend(&keep);
        let limits = self.limits(rows, group, keep);
        let own = rows.rows.iter().filter(|row| group.contains(&row.of));
        // Of a linear motion other Lagrangians couple what the simplest one does not.
        let couples = |k: &usize| terms.get(*k).is_some_and(Term::couples_alone);
        let apart: Vec<usize> = active.iter().copied().filter(|k| !couples(k)).collect();
        let mut simple: Vec<usize> = apart.iter().copied().filter(|k| *k < force).collect();
        sort_by_number(&mut simple, |k| limits.complexity[*k]);
        simple.truncate(SIMPLE * group.len());
        simple.extend(&limits.keep);
        simple.sort_unstable();
        let mut down = |active| eliminate::path(own.clone().collect(), active, &limits, tell);
        let damps = |k: &usize| terms.get(*k).is_some_and(|own| own.damps);
        let mut path = down(apart);
        if group.len() > 1 {
            if !is_driven {
                path.extend(down(active.iter().copied().filter(|k| !damps(k)).collect()));
            }
            // Springs and dampers between coordinates, which many terms hide whose motions are alike.
            let linear = |k: &usize| terms.get(*k).is_none_or(Term::is_linear);
            let linear: Vec<usize> = active.iter().copied().filter(linear).collect();
            path.extend(down(active));
            path.extend(down(linear));
        }
        // Where motions are short or alike many terms explain them, and the way down loses the law.
        path.extend(down(simple));
        // Of as many terms the best, so that the loss by one term less is that of one way.
        // Where a field turns free motions, dampers and other masses do the same.
        let last = |own: &Candidate| match own.values.iter().any(damps) {
            true => NEARLY,
            false => 1.0,
        };
        sort_by_number(&mut path, |own| last(own) * own.misfit.max(own.held));
        sort_by_number(&mut path, |own| -(own.values.len() as f64));
        path.dedup_by_key(|own| own.values.len());
        path
    }

    /// What a way down keeps, of these values and of one inertia for each coordinate, and what it takes for simple.
    fn limits(&self, rows: &Rows, group: &[usize], keep: Vec<usize>) -> Limits {
        let Self { dataset, terms, .. } = self;
        let n = dataset.coordinates.dof();
        let frictions = (0..rows::KINDS * n).map(|k| 1.0 + 0.7 * (k / n) as f64);
        let complexity = terms.iter().map(Term::complexity).chain(frictions);
        let inertia = |i: &usize| {
            let all = 0..terms.len();
            all.filter(|k| terms[*k].speeds == [*i, *i]).collect()
        };
        Limits {
            keep,
            one_of: group.iter().map(inertia).collect(),
            complexity: complexity.collect(),
            inertia: inertia_of(terms, dataset, (group, rows.values())),
        }
    }

    /// Of a path what is worth a refinement: the fewest terms that explain rows nearly as well as any, unless these are many, then those
    /// after which a term less is the greatest loss.
    fn promising<'c>(&self, group: &[usize], path: &'c [Candidate]) -> Vec<&'c Candidate> {
        let Self { dataset, terms, .. } = self;
        let data = dataset.train.spread(300);
        let suits = |own: &&Candidate| {
            let start = Start::of(&[(*own, group.to_vec())], terms, dataset);
            start.len() <= MOST_TERMS && start.is_definite(&data, &dataset.coordinates)
        };
        let all: Vec<&Candidate> = path.iter().filter(suits).collect();
        let misfit = |k: usize| all[k].misfit.max(all[k].held).max(1.0);
        let least = (0..all.len()).map(misfit).fold(f64::INFINITY, f64::min);
        let Some(first) = (0..all.len()).rfind(|k| misfit(*k) <= NEARLY * least) else {
            return Vec::new();
        };
        let loss = |k: usize| match k + 1 < all.len() {
            true => misfit(k + 1) / misfit(k),
            false => 1.0,
        };
        let mut order: Vec<usize> = (0..all.len()).filter(|k| *k != first).collect();
        sort_by_number(&mut order, |k| -loss(*k));
        order.truncate(KNEES);
        let few = all[first].values.len() <= MANY;
        order.insert(if few { 0 } else { order.len() }, first);
        order.into_iter().map(|k| all[k]).collect()
    }
}

/// What a search is about.
struct Search<'a> {
    dataset: &'a Dataset,
    terms: &'a [Term],
    given: (&'a Noise, &'a TrainingTask),
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
        for round in 0..=rounds {
            if observer.stage("looking for other terms", 0.5).is_break() {
                break;
            }
            let mut next = start.clone();
            // What is nothing goes, however late it is.
            if !next.without(&refined, SIGNIFICANT) {
                if self.is_over() {
                    break;
                }
                let most = if self.is_after(SOON) { POOR } else { HOPELESS };
                let full = round == rounds || next.len() >= MOST_TERMS;
                if !(EXACT..most).contains(&refined.misfit) || full {
                    break;
                }
                let missing = self.missing(&start, &refined)?;
                let least = missing
                    .first()
                    .map_or(MISSING, |(_, z)| MISSING.max(0.3 * z));
                let more = missing.iter().filter(|(_, z)| *z > least);
                let more = self.unlike(more.map(|(value, _)| *value));
                if more.is_empty() {
                    return Ok((start, refined, true));
                }
                more.into_iter()
                    .for_each(|value| next.add(value, self.terms));
            }
            if next.has_no_term() {
                refined.misfit = f64::INFINITY;
                break;
            }
            let own = refine::refine(self.dataset, &next, self.given, observer)?;
            if !own.misfit.is_finite() {
                break;
            }
            (start, refined) = (next, own);
        }
        Ok((start, refined, false))
    }

    /// Whether nothing more is tried.
    fn is_over(&self) -> bool {
        self.is_after(LONGEST.min(seconds_of(self.given.1)))
    }

    /// Whether a law would have been found by now, with so many seconds for it.
    fn is_after(&self, seconds: f64) -> bool {
        self.clock.elapsed().as_secs_f64() > seconds
    }

    /// The largest misfit of a law, of which the noise is not known for certain.
    fn by_chance(&self) -> f64 {
        let samples = (self.dataset.train.len() * self.dataset.train.n) as f64;
        FITS + CHANCE * ((2.0 + rows::OF_NOISE) / samples).sqrt()
    }

    /// A formula of exact motions without the terms that are too uncertain for a law, where it is exact without them.
    fn lean(
        &self,
        (mut start, refined, complete): (Start, Refined, bool),
        observer: &mut dyn Observer,
    ) -> Result<(Start, Refined, bool)> {
        let whole = (start.clone(), refined, complete);
        if whole.1.misfit >= NOTHING || !start.without(&whole.1, CERTAIN) || start.has_no_term() {
            return Ok(whole);
        }
        let refined = refine::refine(self.dataset, &start, self.given, observer)?;
        Ok(match refined.misfit < NOTHING {
            true => (start, refined, true),
            false => whole,
        })
    }

    /// The first of these values, of the frictions of a coordinate only one: they explain the same.
    fn unlike(&self, values: impl Iterator<Item = usize>) -> Vec<usize> {
        let n = self.dataset.coordinates.dof();
        let rubs = |value: usize| value.checked_sub(self.terms.len()).map(|at| at % n);
        let mut first: Vec<usize> = Vec::new();
        for value in values {
            let is_new = |own: &usize| rubs(value).is_none() || rubs(*own) != rubs(value);
            if first.len() < AT_ONCE && first.iter().all(is_new) {
                first.push(value);
            }
        }
        first
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
        let HeldOut {
            misfit: held,
            excess: [whole, worst],
        } = refine::held_out(self.dataset, (start, refined), self.given)?;
        let fits = refined.misfit <= self.by_chance();
        if !(fits && definite && (held <= GOOD || whole <= CHANCE)) {
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
        let white = refined.memory.abs() <= CHANCE;
        let law = certain && complete && white && worst <= CHANCE + 1.0;
        let verdict = if law {
            LawVerdict::Law
        } else {
            LawVerdict::Expansion
        };
        Ok((verdict, held))
    }
}

/// The misfit below which what is left of the motions is far less than any noise.
const NOTHING: f64 = 0.1;
/// Misfits that need no more terms, and those that none mends: at first, and after so many seconds.
const EXACT: f64 = 0.01;
const HOPELESS: f64 = 1e5;
const POOR: f64 = 100.0;
const SOON: f64 = 10.0;

/// The inertia that so many values, terms among them, give these coordinates.
fn inertia_of(terms: &[Term], dataset: &Dataset, (group, values): (&[usize], usize)) -> Inertia {
    let data = dataset.train.spread(60);
    let (m, speeds) = (group.len(), size(&data.qd, data.n));
    let of = |value: usize| match terms.get(value).filter(|term| term.is_kinetic()) {
        None => Vec::new(),
        Some(term) => (0..data.len())
            .flat_map(|s| {
                let place = term.place(data.row(s).q);
                let entry = |at: usize| {
                    let (i, j) = (group[at / m], group[at % m]);
                    place * term.by_speeds(i, j) * speeds[i] * speeds[j]
                };
                (0..m * m).map(entry).collect::<Vec<_>>()
            })
            .collect(),
    };
    Inertia {
        coordinates: part_of(&dataset.coordinates, group),
        of: (0..values).map(of).collect(),
    }
}

fn nothing() -> Error {
    Error::setting(
        "no formula was found: no sum of harmonics, powers and friction with a definite mass matrix that was tried explains these motions",
        "fit a network (`family` delan or lnn), or record wider motions",
    )
}
