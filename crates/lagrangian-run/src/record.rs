//! The inputs of a run: its settings, its data, and the settings that were chosen from these.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use lagrangian::settings::difference;
use lagrangian::{score::CandidateResult, train::AutoSetting};
use serde::{Deserialize, Serialize};

use crate::error::{Context, Error, Result};
use crate::hashing_reader::FileHash;

/// The inputs of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    /// The command line, or the call, that began the run.
    pub command: String,
    /// Version of this program.
    pub version: String,
    /// The time at which the run began, UTC.
    pub started: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Operating system and processor family.
    pub platform: String,
    /// Threads that were available.
    pub threads: usize,
    /// All settings, also those left at their defaults.
    pub settings: toml::Table,
    /// The preparation of the data and all settings of the fits, as they followed from the given settings and from the data.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub resolved: toml::Table,
    /// The settings that were not given, and so chosen from the data.
    #[serde(default)]
    pub choices: Vec<AutoSetting>,
    /// The models that were tried, where there were several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tried: Vec<CandidateResult>,
    /// The data files.
    #[serde(default)]
    pub data: Vec<DataFile>,
}

impl RunRecord {
    /// The record of a run that begins now, by this command.
    ///
    /// # Errors
    /// [`Error::Refused`] for settings that TOML cannot represent.
    pub fn now(
        command: String,
        seed: u64,
        settings: &impl Serialize,
        data: Vec<DataFile>,
    ) -> Result<Self> {
        Self::begun(seconds_now(), command, seed, settings, data)
    }

    /// The record of a run that began `begun` seconds after 1970, by this command, for a program in a browser without a clock of its own.
    ///
    /// # Errors
    /// As [`RunRecord::now`].
    pub fn begun(
        seconds: f64,
        command: String,
        seed: u64,
        settings: &impl Serialize,
        data: Vec<DataFile>,
    ) -> Result<Self> {
        Ok(Self {
            command,
            version: env!("CARGO_PKG_VERSION").into(),
            started: utc(seconds),
            seed,
            platform: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            settings: toml::Table::try_from(settings)
                .context("cannot write the settings as TOML", "")?,
            resolved: toml::Table::new(),
            choices: Vec::new(),
            tried: Vec::new(),
            data,
        })
    }
}

impl RunRecord {
    /// The text of the record.
    pub(crate) fn to_toml(&self) -> Result<String> {
        toml::to_string(self).context("cannot write the settings as TOML", "")
    }

    /// Refuses files that differ from those with which the run began, in their order, with a remedy.
    ///
    /// # Errors
    /// [`Error::Refused`], which names the first of them.
    pub fn refuse_changed(&self, now: &[DataFile], remedy: &str) -> Result<()> {
        let mut pairs = now.iter().zip(&self.data);
        let changed = pairs.find(|(now, then)| now.sha256 != then.sha256);
        changed.map_or(Ok(()), |(DataFile { path, .. }, _)| {
            let finding = format!("'{path}' is no longer the file that the run began with");
            Err(Error::new(finding, remedy))
        })
    }

    /// The record `then` of the run that is resumed, whose data and settings must be equal to the present ones.
    ///
    /// # Errors
    /// [`Error::Refused`], which names the changes.
    pub fn resuming(&self, then: Self) -> Result<Self> {
        let restart = "bring the old state back, or restart with `force`";
        if self.data.len() != then.data.len() {
            let (now, then) = (self.data.len(), then.data.len());
            let finding = format!("the run began with {then} files, and there are {now} now");
            return Err(Error::new(finding, restart));
        }
        then.refuse_changed(&self.data, restart)?;
        if then.resolved.is_empty() {
            return Ok(then);
        }
        let json = |table: &toml::Table| {
            serde_json::to_value(table).context("cannot compare the settings", "")
        };
        match difference(&json(&then.resolved)?, &json(&self.resolved)?) {
            None => Ok(then),
            Some(change) => {
                let finding = format!("the run began with other settings: {change}");
                Err(Error::new(finding, restart))
            }
        }
    }
}

/// A data file with its hash.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct DataFile {
    /// The purpose, e.g. `training` or `validation`.
    pub role: String,
    /// The path at the time of the fit.
    pub path: String,
    /// The size, bytes.
    pub bytes: u64,
    /// The SHA-256 of the content.
    pub sha256: String,
}

impl DataFile {
    /// A file with its hash.
    pub fn new(role: &str, path: &Path, hash: FileHash) -> Self {
        Self {
            role: role.into(),
            path: path.display().to_string(),
            bytes: hash.bytes,
            sha256: hash.sha256,
        }
    }
}

/// Time since 1970, s.
pub(crate) fn seconds_now() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0.0, |d| d.as_secs_f64())
}

/// `2026-01-31T12:00:00Z`, from seconds since 1970 (civil-from-days in the proleptic Gregorian calendar).
fn utc(seconds: f64) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "whole seconds")]
    let s = seconds as i64;
    let (days, time) = (s.div_euclid(86_400), s.rem_euclid(86_400));
    // Years begin in March, so that the leap day is the last of its year; eras have 400 years.
    let shifted = days + 719_468;
    let (era, day) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let year = year + era * 400 + i64::from(month > 9);
    let month = (month + 2) % 12 + 1;
    let (hours, minutes, seconds) = (time / 3600, time / 60 % 60, time % 60);
    format!("{year:04}-{month:02}-{day:02}T{hours:02}:{minutes:02}:{seconds:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_right_at_leap_days_and_ends_of_years() {
        assert_eq!(utc(0.0), "1970-01-01T00:00:00Z");
        assert_eq!(utc(951_782_400.0), "2000-02-29T00:00:00Z");
        assert_eq!(utc(1_735_689_599.0), "2024-12-31T23:59:59Z");
    }
}
