//! The page of a run: the assessment of the model, a motion that it predicts, and its origin.

mod animation;
mod bands;
mod figures;
mod learned;
mod linkage;
mod tables;

use std::path::Path;

pub use animation::{Links, MOST_LINKS, as_chain, robot_in_motion};
pub use bands::coverage_table;
use figures::Followed;
pub use figures::energies;
use lagrangian::score::{
    Assessment, Grade, Judgement, Predictions, Reason, SignalError, predict_all, score_predictions,
};
use lagrangian::text::counted;
use lagrangian::{CheckReport, Learned, Model, Prepared, RolloutOptions, Score, Trajectory};
use lagrangian_report::draw::short;
use lagrangian_report::{Command, Figure, Headline, Report, Role};
pub use tables::score_tables;

use crate::ensemble::SavedEnsemble;
use crate::error::Result;
use crate::metrics::Metric;
use crate::record::RunRecord;

/// The differences between the programs that make runs, in texts for people.
pub trait Frontend: Sync {
    /// A text as it is shown: settings in backticks are written as people give them.
    fn words(&self, text: &str) -> String;

    /// The commands that make the run, its page and predictions of its model again.
    fn commands(&self, folder: &Path, record: &RunRecord) -> Vec<Command>;
}

/// The input of a page.
pub struct Page<'a> {
    /// The frontend that shows it.
    pub frontend: &'a dyn Frontend,
    /// The folder that holds it.
    pub folder: &'a Path,
    /// The record of the run.
    pub record: &'a RunRecord,
    /// The metrics of the run.
    pub metrics: &'a [Metric],
    /// The model of the run.
    pub model: &'a Learned,
    /// The ensemble beside the model, where there is one.
    pub ensemble: Option<&'a SavedEnsemble>,
    /// Motions that the model is evaluated on, and the check of the data.
    pub evaluation: &'a Evaluation,
}

/// Motions that a model is evaluated on.
#[derive(Debug)]
pub struct Evaluation {
    /// The motions.
    pub motions: Vec<Trajectory>,
    /// Whether they were kept from training; otherwise there were no others.
    pub held_out: bool,
    /// The findings of the check of the data.
    pub check: CheckReport,
}

impl From<Prepared> for Evaluation {
    /// The part of the data that is needed after the fit.
    fn from(data: Prepared) -> Self {
        Self {
            motions: data.motions,
            held_out: data.held_out,
            check: data.check,
        }
    }
}

/// The predictions of a model, and their assessment.
#[derive(Debug)]
pub struct Scored {
    predictions: Predictions,
    ensemble: Option<bands::Shown>,
    /// The errors of the predictions.
    pub score: Score,
    /// The reliability of the model.
    pub assessment: Assessment,
}

impl Page<'_> {
    /// The motions of the evaluation, each predicted once.
    ///
    /// # Errors
    /// As [`predict_all`].
    pub fn scored(&self, options: &RolloutOptions) -> Result<Scored> {
        let motions = &self.evaluation.motions;
        let predictions = predict_all(self.model, motions, options)?;
        let score = score_predictions(self.model, motions, &predictions, options)?;
        let assessment = Assessment::of_learned(self.model, motions, &score);
        let mut assessment = assessment
            .of_selected(&self.record.tried)
            .of_checked(&self.evaluation.check);
        for reason in &mut assessment.reasons {
            reason.remedy = self.frontend.words(&reason.remedy);
        }
        let ensemble = self
            .ensemble
            .map(|own| bands::Shown::new(own, self.evaluation, options));
        Ok(Scored {
            ensemble: ensemble.transpose()?,
            assessment,
            predictions,
            score,
        })
    }

    /// The page as plain data. A robot with known joints is drawn as a robot; a chain of angles with the reference of its links that the
    /// data state, unless `links` gives another one.
    #[must_use]
    pub fn report(&self, scored: Scored, links: Option<Links>) -> Report {
        let Scored {
            predictions,
            ensemble,
            score,
            assessment,
        } = scored;
        let mut headlines = self.headlines(&score, &assessment);
        let mut tables = tables::of(self, &score, &assessment);
        let parities = figures::parities(self, &predictions.accelerations);
        let followed = Followed::first(self, predictions.rollouts);
        let learned = learned::shown(self);
        tables.extend(learned.tables);
        let mut banded = Vec::new();
        if let Some(own) = ensemble {
            headlines.extend(own.headline);
            banded = own.figures;
            tables.extend(own.tables);
        }
        tables.retain(|table| !table.rows.is_empty());
        let motions = followed.iter().flat_map(|motion| motion.figures(self));
        let motions: Vec<Figure> = motions.collect();
        let animation = followed.and_then(|motion| animation::of(self, &motion, links));
        let mut report = Report {
            answer: self.answer(&score, &assessment),
            title: format!("{}, learned from recordings", self.model.description().what),
            subtitle: self.subtitle(),
            headlines,
            summary: self.summary(&score, &assessment),
            animations: animation.into_iter().collect(),
            maps: learned.maps,
            tables,
            settings: tables::settings(self.record),
            commands: self.frontend.commands(self.folder, self.record),
            ..Report::default()
        };
        report.add_figures("Predicted motion", motions);
        report.add_figures("Accelerations", parities);
        report.add_figures("What was learned", learned.figures);
        report.add_figures("Ensemble", banded);
        report.add_figures("Training", [figures::loss(self.metrics, self.role())]);
        report
    }

    /// The explained part of the torques, or of the accelerations where no torque is predicted.
    fn answer(&self, score: &Score, assessment: &Assessment) -> String {
        let coordinates = self.model.coordinates();
        let signals = [
            ("torques", &score.torque),
            ("accelerations", &score.acceleration),
        ];
        let mut known = signals
            .iter()
            .filter_map(|(name, error)| Some((name, error.as_ref()?)));
        let of = match self.evaluation.held_out {
            true => "of motions that were held back from training",
            false => "of the training data themselves",
        };
        let why = known.next().map_or(String::new(), |(name, error)| {
            error.judgement(&format!("{name} {of}"), coordinates).why
        });
        let why = [assessment.expectation.clone(), why];
        let why: Vec<String> = why.into_iter().filter(|own| !own.is_empty()).collect();
        Judgement::new(assessment.verdict, why.join("; ")).sentence()
    }

    fn role(&self) -> Role {
        match self.model.description().mechanical {
            true => Role::Lnn,
            false => Role::Baseline,
        }
    }

    fn subtitle(&self) -> String {
        let files = self.record.data.iter().map(|file| file_name(&file.path));
        let files = match files.clone().count() {
            0..=3 => files.collect::<Vec<_>>().join(", "),
            count => format!("{count} files"),
        };
        let training = self.metrics.last().map_or(String::new(), |last| {
            let steps = counted(last.step as usize, "step");
            format!(" · {steps} in {:.0} s", last.seconds)
        });
        // 2026-01-31T12:00:00Z as 2026-01-31 12:00 UTC.
        let RunRecord {
            started, version, ..
        } = self.record;
        let started = match (started.get(..10), started.get(11..16)) {
            (Some(day), Some(time)) => format!("{day} {time} UTC"),
            _ => started.clone(),
        };
        format!("{files}{training} · {started} · version {version}")
    }

    fn headlines(&self, score: &Score, assessment: &Assessment) -> Vec<Headline> {
        let role = Some(self.role());
        let note = match assessment.verdict {
            Grade::Good => "it explains what was recorded",
            Grade::Fair => "it can be used, with the reservations below",
            Grade::Poor => "it must not be used",
        };
        let verdict = Judgement {
            grade: assessment.verdict,
            why: String::new(),
        };
        let word = assessment.verdict.name();
        let mut headlines = vec![Headline {
            judgement: Some(verdict),
            ..Headline::new("Verdict", word.into(), "", note)
        }];
        let joints = &assessment.joints;
        let predictable = |i: usize| joints.get(i).is_none_or(|joint| joint.predictable);
        headlines.extend(self.error("Error of accelerations", &score.acceleration, predictable));
        headlines.extend(self.error("Error of torques", &score.torque, |_| true));
        if let Some(first) = score.rollouts.first() {
            let bound = if first.exceeded { "" } else { "≥ " };
            let value = format!("{bound}{:.2}", first.valid_seconds);
            let note = format!("of {:.2} s, from its first state alone", first.duration);
            headlines.push(Headline {
                role,
                judgement: score.motion_judgement(0),
                ..Headline::new("Motion followed for", value, "s", note)
            });
        }
        let note = match self.evaluation.held_out {
            true => "held back from training",
            false => "of the training itself: none were held back",
        };
        headlines.push(Headline::new(
            "Measured on",
            score.samples.to_string(),
            "samples",
            note,
        ));
        headlines
    }

    /// An error over the coordinates that are known, with its verdict.
    fn error(
        &self,
        label: &str,
        error: &Option<SignalError>,
        is_known: impl Fn(usize) -> bool,
    ) -> Option<Headline> {
        let error = error.as_ref()?;
        let n = error.nmse.len();
        let known: Vec<usize> = (0..n)
            .filter(|&i| is_known(i) && !error.nmse[i].is_nan())
            .collect();
        let left = error.of(&known).unexplained();
        let note = match n {
            1 => "of their variance".into(),
            _ => format!("of the variance, over {} of {n} coordinates", known.len()),
        };
        (!known.is_empty()).then(|| Headline {
            role: Some(self.role()),
            judgement: Some(Judgement::new(Grade::of_error(left), "")),
            ..Headline::new(label, short(100.0 * left), "%", note)
        })
    }

    fn summary(&self, score: &Score, assessment: &Assessment) -> Vec<String> {
        let reasons = assessment.reasons.iter();
        let reason = |r: &Reason| format!("{}: {}; {}.", r.grade.name(), r.finding, r.remedy);
        let written = self.model.written();
        let law = written.map(|own| format!("{} — {}.", own.text, own.meaning));
        let mut summary: Vec<String> = law.into_iter().chain(reasons.map(reason)).collect();
        summary.extend(self.predictions(score));
        summary
    }

    fn predictions(&self, score: &Score) -> Vec<String> {
        let whole = score.rollouts.iter().filter(|r| !r.exceeded).count();
        if !self.model.moves() {
            let none = "A plain network of torques has no forward dynamics: it predicts no motion.";
            return vec![none.into()];
        }
        let mut summary = vec![format!(
            "From its first state alone, the model follows {whole} of {} recorded motions to the end. A motion counts \
             as followed until the error reaches half a standard deviation of its signals.",
            score.rollouts.len()
        )];
        if score.singular > 0 {
            summary.push(self.frontend.words(&format!(
                "At {} states the learned mass matrix is singular: the convex form (`form` convex) has none.",
                score.singular
            )));
        }
        summary
    }
}

/// The last part of a path; the command line of the run holds the whole.
pub(crate) fn file_name(path: &str) -> &str {
    Path::new(path)
        .file_name()
        .and_then(|name| name.to_str())
        .unwrap_or(path)
}
