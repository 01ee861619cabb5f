//! What an experiment works with: settings, progress, fits, and the grid that it fills.

use std::fs;
use std::path::PathBuf;

use anyhow::Result;
use lagrangian::{Budget, Dataset, Fit, FitConfig, Learned, Observer, Provenance};
use lagrangian_report::Table;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::args::Args;
use super::failure::{Context, mistake};
use super::folder::Folder;
use super::history::{History, fit_with_history};
use super::page::as_text;
use super::progress::Progress;
use super::results::{Contestant, Plot, Results, Row};

/// One run of an experiment.
pub(crate) struct Lab<'a> {
    pub(crate) args: &'a Args,
    /// Where models go; figures and page are written at the end.
    pub(crate) folder: &'a Folder,
    pub(crate) progress: Progress,
    pub(crate) results: Results,
}

impl Lab<'_> {
    /// Whether it is only to be seen that everything works.
    pub(crate) fn quick(&self) -> bool {
        self.args.quick
    }

    /// The seeds, one run each.
    pub(crate) fn seeds(&self) -> Vec<u64> {
        self.args.seeds()
    }

    /// The seconds that were asked for, else so many steps, or `few` for a quick run.
    pub(crate) fn budget(&self, steps: usize, few: usize) -> Budget {
        let steps = Budget::Steps(if self.quick() { few } else { steps });
        self.args.seconds.map_or(steps, Budget::Seconds)
    }

    /// Declares the weight of all parts together.
    pub(crate) fn plan(&mut self, total: usize) {
        self.progress.plan(total as f64);
    }

    /// Begins a part of weight 1.
    pub(crate) fn begin(&mut self, part: impl Into<String>) -> Result<()> {
        self.begin_weighted(part, 1.0)
    }

    /// Begins a part of this weight.
    pub(crate) fn begin_weighted(&mut self, part: impl Into<String>, weight: f64) -> Result<()> {
        self.progress.begin(part.into(), weight)
    }

    /// Fits, unless the user has interrupted.
    pub(crate) fn fit(&mut self, data: &Dataset, config: &FitConfig) -> Result<Fit> {
        self.watched(|observer| lagrangian::fit(data, config, None, observer))
    }

    /// Does something that tells an observer how far it is.
    pub(crate) fn watched<T>(
        &mut self,
        work: impl FnOnce(&mut dyn Observer) -> lagrangian::Result<T>,
    ) -> Result<T> {
        let done = work(&mut self.progress)?;
        self.progress.check()?;
        Ok(done)
    }

    /// Fits, and measures the best model at each validation after the fit is over.
    pub(crate) fn fit_with_history(
        &mut self,
        data: &Dataset,
        config: &FitConfig,
        measure: &dyn Fn(&Learned) -> f64,
    ) -> Result<(Fit, History)> {
        let fit = fit_with_history(data, config, &mut self.progress, measure)?;
        self.progress.check()?;
        Ok(fit)
    }

    /// Saves a model beside the figures.
    pub(crate) fn save(&self, name: &str, model: &Learned, seed: u64) -> Result<()> {
        let bytes = model.save(Provenance::of_seed(seed))?.to_bytes()?;
        self.folder
            .write(&format!("{name}-{seed}.safetensors"), &bytes)
    }

    /// Writes a file beside the figures.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.folder.write(name, bytes)
    }

    /// The record of which this holds in a file of one to a line; where there is none it is measured and appended, so that a run that was
    /// cut goes on.
    pub(crate) fn remembered<R: Serialize + DeserializeOwned>(
        &mut self,
        file: &str,
        is: impl Fn(&R) -> bool,
        measure: impl FnOnce(&mut Self) -> Result<R>,
    ) -> Result<R> {
        let kept = self.folder.read(file);
        let mut known = kept
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        if let Some(record) = known.find(is) {
            return Ok(record);
        }
        let record = measure(self)?;
        let line = serde_json::to_string(&record)?;
        self.write(file, (kept + &line + "\n").as_bytes())?;
        Ok(record)
    }

    /// Writes the table of all cases to `cases.txt`, and shows it below the summary.
    pub(crate) fn list(&mut self, table: Table) -> Result<()> {
        self.write("cases.txt", as_text(&table).as_bytes())?;
        self.results.tables.push(table);
        Ok(())
    }

    /// The row of a contestant in a group.
    pub(crate) fn row<C>(&mut self, group: &str, who: &Contestant<C>) -> &mut Row {
        self.results.row(group, who.key, who.name, who.role)
    }

    /// The row of a variant of a contestant: `key` and `name` are appended to its own.
    pub(crate) fn variant<C>(
        &mut self,
        group: &str,
        who: &Contestant<C>,
        [key, name]: [&str; 2],
    ) -> &mut Row {
        let (key, name) = (
            format!("{} {key}", who.key),
            format!("{}, {name}", who.name),
        );
        self.results.row(group, &key, &name, who.role)
    }

    /// The figure with this id.
    pub(crate) fn plot(&mut self, id: impl Into<String>, title: impl Into<String>) -> &mut Plot {
        self.results.plot(id, title)
    }

    /// A figure of a group: its id ends with the key of the group, its title with the name.
    pub(crate) fn plot_of(&mut self, [key, name]: [&str; 2], what: &str, title: &str) -> &mut Plot {
        let id = format!("{what}-{}", key.replace(' ', "-"));
        self.plot(id, format!("{title}, {name}"))
    }

    /// Notes why a contestant cannot express a system, before it is fitted.
    pub(crate) fn cannot<C>(
        &mut self,
        group: &str,
        who: &Contestant<C>,
        reasons: Vec<&'static str>,
    ) {
        for reason in &reasons {
            self.progress
                .note(&format!("{} cannot express {group}: {reason}", who.name));
        }
        self.row(group, who).cannot = reasons;
    }

    /// Names a setting on the page.
    pub(crate) fn setting(&mut self, name: &str, value: impl Into<String>) {
        self.results.settings.push((name.into(), value.into()));
    }

    /// A file of the reference data.
    pub(crate) fn data(&self, name: &str) -> Result<Vec<u8>> {
        let variable = std::env::var_os("LAGRANGIAN_DATA").map(PathBuf::from);
        let usual = ["shared/data", "../shared/data"].map(PathBuf::from);
        let folders: Vec<PathBuf> = match &self.args.data {
            Some(folder) => vec![folder.clone()],
            None => variable.into_iter().chain(usual).collect(),
        };
        let mut paths = folders.iter().map(|folder| folder.join(name));
        let Some(path) = paths.find(|path| path.exists()) else {
            let tried = folders
                .iter()
                .map(|folder| format!("'{}'", folder.join(name).display()));
            return Err(mistake(
                format!("there is no {}", tried.collect::<Vec<_>>().join(" or ")),
                "give the folder of the reference data with --data, or in the variable LAGRANGIAN_DATA",
            ));
        };
        fs::read(&path).context(
            format!("cannot read '{}'", path.display()),
            "check that the file may be read",
        )
    }
}
