//! From the files that the user names to recordings.

use std::collections::BTreeSet;
use std::mem::take;
use std::path::{Path, PathBuf};

use anyhow::Result;
use lagrangian::check::CHECKED;
use lagrangian::trajectory::{Sampling, Signal, stops, thin};
use lagrangian::{
    CheckOptions, CheckReport, Estimate, EstimateOptions, Layout, PrepareOptions, Recording,
    Trajectory, prepared,
};
use lagrangian_run::{
    FileHash, ReadFile, Source, delayed, files_of, is_bag, layout_beside, read_file, text,
};

use crate::cli::{DataArgs, EstimateArgs};
use crate::column_args::flag_name;
use crate::failure::{Context, mistake, with_flags};
use crate::fitted;

/// The content of some files.
pub(crate) struct Files {
    /// All recordings, in the order of the files.
    pub(crate) recordings: Vec<Recording>,
    /// The files, each with its hash.
    pub(crate) hashes: Vec<(PathBuf, FileHash)>,
    /// The parts of each file that were read.
    pub(crate) sources: Vec<Source>,
}

impl EstimateArgs {
    /// The options in the form of the library, without the rates of momenta.
    pub(crate) fn options(&self) -> EstimateOptions {
        self.prepare().estimates()
    }

    /// The preparation of the recordings of a fit.
    pub(crate) fn prepare(&self) -> PrepareOptions {
        PrepareOptions {
            smooth: self.smooth,
            low_pass: self.low_pass,
            ..PrepareOptions::default()
        }
    }
}

impl DataArgs {
    /// The delays of the forces, s.
    pub(crate) fn delays(&self) -> Vec<f64> {
        self.delay.iter().map(|ms| 1e-3 * ms).collect()
    }

    fn layout(&self) -> Result<Layout> {
        let file = self.file.clone();
        let mut columns = file.columns.0;
        let polar = file.polar.iter().map(|text| text.parse());
        let polar = polar
            .collect::<lagrangian::Result<_>>()
            .context("cannot use --polar", "give it as theta=x,y@x0,y0")?;
        let of_drives = Signal::OF_DRIVES.map(|signal| (signal, take(columns.get_mut(signal))));
        let mut layout = Layout {
            trajectory: file.trajectory,
            topic: file.topic,
            t: file.time,
            columns,
            actuated: self.actuated.clone(),
            angles: file.angle,
            polar,
            parameters: self.parameters.clone(),
            degrees: file.degrees,
            every: file.every.map_or(0, |n| n as usize),
            ..Layout::default()
        };
        layout.drive.si = file.si_gains;
        for (signal, words) in of_drives.into_iter().filter(|(_, words)| !words.is_empty()) {
            let shown = format!("cannot use --{}", flag_name(signal));
            let hint =
                "give columns; of --goal-kp, --goal-kd and --supply also a number or a pattern";
            layout.declare(signal, words).context(shown, hint)?;
        }
        Ok(layout)
    }

    /// The files that are read for recordings of these names: bags, data and layouts.
    pub(crate) fn inputs(&self, named: &[PathBuf]) -> Result<Vec<PathBuf>> {
        let mut files = files_of(named)?;
        let layouts = files.iter().filter_map(|path| self.layout_file(path));
        let layouts: Vec<PathBuf> = layouts.collect();
        files.extend(layouts);
        Ok(files)
    }

    /// The layout file of a data file, if it exists.
    pub(crate) fn layout_file(&self, path: &Path) -> Option<PathBuf> {
        let given = self.file.layout.clone();
        given.or_else(|| layout_beside(path))
    }

    /// The layout of a file, or of motions without a file.
    pub(crate) fn layout_of(&self, path: Option<&Path>) -> Result<Layout> {
        match path {
            Some(path) => self.layout_for(path),
            None => Ok(self.layout()?.or(self.fitted.clone().unwrap_or_default())),
        }
    }

    /// The flags, completed from the file beside the data.
    pub(crate) fn layout_for(&self, path: &Path) -> Result<Layout> {
        let fitted = self.fitted.clone().unwrap_or_default();
        let Some(chosen) = self.layout_file(path) else {
            return Ok(self.layout()?.or(fitted));
        };
        let shown = format!("cannot read the layout '{}'", chosen.display());
        let text = text(&chosen).context(&shown, "check --layout, or omit it")?;
        let from_file = Layout::from_toml(&text)
            .context(shown, "see `lagrangian fit --help` for what it may say, or rename it if it is not about the data")?;
        Ok(self.layout()?.or(from_file).or(fitted))
    }
}

/// Reads all recordings of all files, in their order; notes for the user go to standard error.
pub(crate) fn read(files: &[PathBuf], args: &DataArgs) -> Result<Vec<Recording>> {
    Ok(read_sample(files, args, None)?.recordings)
}

/// Reads at most the rows that `sampling` allows, with the hashes of the files.
pub(crate) fn read_sample(
    files: &[PathBuf],
    args: &DataArgs,
    sampling: Option<Sampling>,
) -> Result<Files> {
    let files = files_of(files)?;
    refuse_needless_topic(&files, args)?;
    let (mut recordings, mut hashes, mut sources) = (Vec::new(), Vec::new(), Vec::new());
    for path in &files {
        let read = read_one(path, args, sampling)?;
        hashes.push((path.clone(), read.hash));
        sources.push(read.source);
        recordings.extend(read.recordings);
        if let Some(sampling) = &sampling {
            thin(&mut recordings, sampling);
        }
    }
    let kept: usize = recordings.iter().map(Recording::len).sum();
    let rows: usize = sources.iter().map(|source| source.rows).sum();
    if kept < rows {
        note!(
            "note: {kept} of {rows} rows are used, a sample of short stretches (--rows N for another number, --rows all for all of them)"
        );
    }
    let shifted = |recording: Recording| recording.delayed(&args.fitted_delay);
    let recordings = match args.fitted_delay.is_empty() {
        true => delayed(recordings, &args.delays())?,
        false => {
            let shifted: lagrangian::Result<_> = recordings.into_iter().map(shifted).collect();
            shifted.context(
                "cannot shift the forces as those of the fit",
                "give --delay",
            )?
        }
    };
    let Some(first) = recordings.first() else {
        return Err(mistake(
            "there is no recording in the files",
            "give files with at least two rows",
        ));
    };
    let differs = |r: &&Recording| r.coordinates != first.coordinates;
    let Some(other) = recordings.iter().find(differs) else {
        return Ok(Files {
            recordings,
            hashes,
            sources,
        });
    };
    Err(mistake(
        format!(
            "'{}' and '{}' have different coordinates",
            first.name, other.name
        ),
        "name the same columns with --q and the same angles with --angle, or use the files separately",
    ))
}

fn read_one(path: &Path, args: &DataArgs, sample: Option<Sampling>) -> Result<ReadFile> {
    let layout = Layout {
        sample,
        ..args.layout_for(path)?
    };
    let advice =
        "run `lagrangian check --help` for the columns of a file and the flags that name them";
    let read = read_file(path, &layout, advice);
    if read.is_err() {
        refuse_other_dof(path, args, sample)?;
    }
    let mut file = read?;
    for note in &file.notes {
        note!("note: '{}': {}", path.display(), with_flags(note));
    }
    for note in &mut file.source.notes {
        *note = with_flags(note);
    }
    Ok(file)
}

/// Refuses a file with another number of coordinates than the model: the settings of the fit do not apply to it.
fn refuse_other_dof(path: &Path, args: &DataArgs, sample: Option<Sampling>) -> Result<()> {
    let Some(model) = &args.model else {
        return Ok(());
    };
    let alone = DataArgs {
        fitted: None,
        ..args.clone()
    };
    let layout = Layout {
        sample,
        ..alone.layout_for(path)?
    };
    // OK to ignore an error: the file cannot be read for another reason, which is reported.
    read_file(path, &layout, "").map_or(Ok(()), |file| fitted::require_dof(&file.recordings, model))
}

/// Refuses --topic without a file that has topics.
fn refuse_needless_topic(files: &[PathBuf], args: &DataArgs) -> Result<()> {
    match args.file.topic {
        Some(_) if !files.iter().any(|path| is_bag(path)) => Err(mistake(
            "--topic chooses a topic of a bag, and no file is one",
            "omit --topic, or give a .db3 or .mcap file",
        )),
        _ => Ok(()),
    }
}

/// Checks recordings; remedies name the flags.
pub(crate) fn check(recordings: &[Recording], options: &CheckOptions) -> CheckReport {
    let mut report = lagrangian::check(recordings, options);
    with_remedies(&mut report);
    report
}

/// Names the flags in the remedies of a check, and adds a remark where it does not cover all trajectories.
pub(crate) fn with_remedies(report: &mut CheckReport) {
    if let Some(item) = report.items.iter().find(|item| item.name == CHECKED) {
        note!("note: {}", item.finding);
    }
    let items = report.items.iter_mut();
    let remedies = items.filter_map(|item| item.remedy.as_mut());
    remedies.for_each(|remedy| *remedy = with_flags(remedy));
}

/// Makes trajectories of recordings; reports estimated signals on standard error.
pub(crate) fn trajectories(
    recordings: Vec<Recording>,
    options: &EstimateOptions,
) -> Result<(Vec<Trajectory>, Vec<Estimate>)> {
    let (trajectories, estimates) = estimated(recordings, options)?;
    if options.low_pass.is_none() {
        note_estimates(&estimates);
    }
    Ok((trajectories, estimates))
}

/// Makes trajectories of recordings, with the methods by which their signals were estimated.
pub(crate) fn estimated(
    recordings: Vec<Recording>,
    options: &EstimateOptions,
) -> Result<(Vec<Trajectory>, Vec<Estimate>)> {
    for stop in stops(&recordings) {
        note!("note: {stop}: the samples there are left out");
    }
    Ok(prepared::estimated(recordings, options).context(
        "cannot use the data",
        "`lagrangian check` shows what is wrong with them",
    )?)
}

/// Reports estimated signals on standard error.
pub(crate) fn note_estimates(estimates: &[Estimate]) {
    for signal in ["qd", "qdd", "pd"] {
        let own = estimates.iter().filter(|e| e.signal == signal);
        if let Some(longest) = own.map(|e| e.seconds).reduce(f64::max) {
            let other = match signal {
                "qd" => "; a fit with --loss positions uses none",
                _ => "",
            };
            note!("note: {signal} was estimated over windows of at most {longest:.3} s{other}");
        }
    }
}

/// The signals that were estimated, each once.
pub(crate) fn estimated_signals(estimates: &[Estimate]) -> BTreeSet<&'static str> {
    estimates.iter().map(|e| e.signal).collect()
}
