//! What a program says of data, stage by stage: reading, the check, the fit.

use anyhow::Result;
use lagrangian::check::{Item, check, check_validation};
use lagrangian::rigid::RobotConfig;
use lagrangian::score::{Assessment, Grade, Reason};
use lagrangian::{
    CheckOptions, CheckReport, Dataset, EstimateOptions, FitConfig, Observer, RolloutOptions,
    Verdict, score,
};
use lagrangian::{FitSpec, fit::select};

use super::case::Case;

/// What the stages before a fit say.
pub(super) enum Checked {
    /// The files, or the description, are refused.
    Refused(String),
    /// The check has these items.
    Report(CheckReport),
}

/// Reads and checks a case, with its validation.
pub(super) fn checked(case: &Case) -> Checked {
    let training = match case.recordings(&case.logs) {
        Ok(recordings) => recordings,
        Err(error) => return Checked::Refused(error.to_string()),
    };
    let mut report = check(&training, &CheckOptions::default());
    if let Ok(validation) = case.recordings(&case.validation) {
        report
            .items
            .extend(check_validation(&training, &validation).items);
    }
    Checked::Report(report)
}

impl Checked {
    fn items(&self) -> &[Item] {
        match self {
            Self::Refused(_) => &[],
            Self::Report(report) => &report.items,
        }
    }

    /// The gravest item that the good data do not have as grave.
    pub(super) fn news(&self, good: &Self) -> Option<&Item> {
        let weight = |item: &Item| (item.verdict, item.doubtful);
        let before = |name: &str| {
            let own = good.items().iter().filter(|i| i.name == name);
            own.map(weight).max().unwrap_or((Verdict::Pass, false))
        };
        let new = self.items().iter().filter(|i| weight(i) > before(i.name));
        new.reduce(|a, b| if weight(b) > weight(a) { b } else { a })
    }
}

/// What a fit says.
pub(super) enum Fitted {
    Refused(String),
    Graded(Assessment),
}

impl Fitted {
    /// It in a word.
    pub(super) fn word(&self) -> &'static str {
        match self {
            Self::Refused(_) => "refused",
            Self::Graded(assessment) => match assessment.verdict {
                Grade::Good => "good",
                Grade::Fair => "fair",
                Grade::Poor => "poor",
            },
        }
    }

    /// The gravest reason that the good data do not have as grave; a remedy tells reasons apart.
    pub(super) fn news(&self, good: &Self) -> Option<String> {
        let found = match self {
            Self::Refused(error) => return Some(error.clone()),
            Self::Graded(assessment) => assessment.reasons.iter(),
        };
        let before = match good {
            Self::Refused(_) => &[],
            Self::Graded(assessment) => &assessment.reasons[..],
        };
        let is_known = |r: &Reason| {
            let mut same = before.iter().filter(|b| b.remedy == r.remedy);
            same.any(|b| b.grade >= r.grade)
        };
        let mut new = found.filter(|r| !is_known(r));
        new.next().map(|r| r.finding.clone())
    }
}

/// Fits a case as the command does when it is told nothing.
pub(super) fn fitted(
    case: &Case,
    checked: &Checked,
    seconds: f64,
    observer: &mut dyn Observer,
) -> Fitted {
    let Checked::Report(report) = checked else {
        return Fitted::Refused("the files are refused".into());
    };
    match fit(case, report, seconds, observer) {
        Ok(assessment) => Fitted::Graded(assessment),
        Err(error) => Fitted::Refused(error.to_string()),
    }
}

fn fit(
    case: &Case,
    report: &CheckReport,
    seconds: f64,
    observer: &mut dyn Observer,
) -> Result<Assessment> {
    let recordings = case.recordings(&case.logs)?;
    let coordinates = recordings[0].coordinates.clone();
    let noisy = |i: &&Item| i.name == "acceleration" && i.verdict == Verdict::Warn;
    let found = report.items.iter().find(noisy);
    let options = EstimateOptions {
        low_pass: found.and_then(|i| i.values.get("low_pass_hz").copied()),
        momenta: false,
        ..EstimateOptions::default()
    };
    let mut estimates = Vec::new();
    let mut motions = |logs| -> Result<Vec<_>> {
        let mut all = Vec::new();
        for recording in case.recordings(logs)? {
            let (motion, own) = recording.into_trajectory(&options)?;
            estimates.extend(own);
            all.push(motion);
        }
        Ok(all)
    };
    let (train, validation) = (motions(&case.logs)?, motions(&case.validation)?);
    let dataset = Dataset::new(coordinates, &train, &validation)?;
    let mut request = FitSpec {
        seconds: Some(seconds),
        ..FitSpec::default()
    };
    if let Some((text, joints)) = &case.urdf {
        let robot = RobotConfig::new(text, joints.clone())?;
        request
            .settings
            .insert("robot".into(), serde_json::to_value(robot)?);
    }
    let candidates = FitConfig::candidates(&dataset, &estimates, &request)?;
    let selection = select(&dataset, candidates, None, observer)?;
    let options = RolloutOptions {
        rtol: 1e-6,
        atol: 1e-6,
        ..RolloutOptions::default()
    };
    let scored = score(&selection.fit.model, &validation, &options)?;
    Ok(Assessment::new(&selection.fit.model, &validation, &scored)
        .of_selected(&selection.tried)
        .of_checked(report))
}
