//! `lagrangian action`: the paths between two ends along which the action is stationary.

use std::path::PathBuf;

use anyhow::Result;
use lagrangian::mechanics::Lagrangian;
use lagrangian::score::{Judgement, outside};
use lagrangian::text::counted;
use lagrangian::{Coordinates, Model};
use lagrangian_analysis::action::{
    Boundary, DiscreteAction, PathKind, Search, SearchOptions, StationaryPath, stationary_paths,
};
use lagrangian_report::{
    Figure, Headline, Report, Role, Series, Table, VariedPath, action_of_families, varied_paths,
};
use serde_json::json;

use super::OutputMode;
use crate::failure::{Context, FAILED, SUCCESS};
use crate::law_args::ActionArgs;
use crate::output::Motions;
use crate::task::{Size, Task};
use crate::text;

/// Sizes of the variations that are drawn.
const SIZES: [f64; 9] = [-0.4, -0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4];

pub(super) fn run(args: &ActionArgs, mode: OutputMode) -> Result<u8> {
    args.output
        .check_motions(&[PathBuf::from(&args.subject.subject)])?;
    let paths = (args.steps as f64) * (args.guesses as f64);
    let task = Task::start("action", mode.quiet, Size::default().with_samples(paths))?;
    let subject = args.subject.open()?;
    let physics = subject.physics()?;
    if physics.applied.dissipation.is_some() {
        note!("note: the model has friction, which has no action: the paths are those without it");
    }
    let (lagrangian, coordinates) = (physics.lagrangian, physics.lagrangian.coordinates());
    let ends = ends(args, coordinates)?;
    let options = SearchOptions {
        segments: args.steps,
        guesses: args.guesses,
        seed: args.seed,
    };
    let search = stationary_paths(lagrangian, &ends, &options)
        .context("cannot look for a path", "correct --steps or --guesses")?;
    drop(task);
    let found = Found {
        judgements: judgements(physics.model, &search),
        search,
        unit: subject.unit_of_action(),
    };
    let facts = found.facts(args);
    write(args, lagrangian, &found, &facts)?;
    let search = &found.search;
    let failure = search.failure();
    let figures = json!({
        "command": "action",
        "answer": facts.answer,
        "unit": found.unit,
        "subject": args.subject.subject,
        "from": ends.from,
        "to": ends.to,
        "time": ends.duration,
        "steps": args.steps,
        "out": args.output.file.out,
        "plot": args.output.plot,
        "paths": search.paths,
        "judgements": found.judgements,
        "tried": search.tried,
        "led_nowhere": search.failures.len(),
        "failure": failure,
        "reason": failure.map(|f| f.to_string()),
    });
    mode.print(&figures, || text::of(&facts))?;
    if let Some(failure) = failure {
        note!("no path: {failure}");
        return Ok(FAILED);
    }
    Ok(SUCCESS)
}

fn ends(args: &ActionArgs, coordinates: &Coordinates) -> Result<Boundary> {
    let ends = Boundary::new(coordinates, &args.from, &args.to, args.time).context(
        "cannot connect these ends",
        "give --from and --to one value per coordinate, in the order of the model",
    )?;
    match args.turns.is_empty() {
        true => Ok(ends),
        false => Ok(ends.winding(coordinates, &args.turns).context(
            "cannot turn so",
            "give --turns one whole number per coordinate, 0 for those that are not angles",
        )?),
    }
}

/// The paths that were found, and the reliability of each.
struct Found {
    search: Search,
    judgements: Vec<Judgement>,
    /// The unit of the action.
    unit: &'static str,
}

/// Writes the requested files, where a path was found.
fn write(
    args: &ActionArgs,
    lagrangian: &dyn Lagrangian,
    found: &Found,
    facts: &Report,
) -> Result<()> {
    let search = &found.search;
    let Some(first) = search.paths.first() else {
        return Ok(());
    };
    let file = &args.output.file;
    if let Some(path) = &file.out {
        let numbered = (1..).zip(&search.paths);
        let motions: Vec<_> = numbered
            .map(|(k, p)| p.trajectory(&format!("{k}")))
            .collect();
        Motions::new(&motions, lagrangian.coordinates()).write(path, file.existing())?;
    }
    args.output.draw(|| Report {
        figures: figures(lagrangian, first, found.unit),
        ..facts.clone()
    })
}

/// The path with its neighbours, a figure for each coordinate, and the action of these.
fn figures(lagrangian: &dyn Lagrangian, found: &StationaryPath, unit: &str) -> Vec<Figure> {
    let (path, coordinates) = (&found.path, lagrangian.coordinates());
    let sine = |i: usize| path.sine(i, 1);
    let drawn = |i: usize| {
        let path = VariedPath {
            t: &path.times(),
            q: &path.q,
            eta: &sine(i),
            epsilon: &SIZES,
        };
        varied_paths(coordinates, i, &path)
    };
    let mut all: Vec<Figure> = (0..path.dof).map(drawn).collect();
    let mut action = DiscreteAction::new(lagrangian);
    let mut family = |name: &str, role, eta: &[f64]| {
        let changes = action.changes(path, eta, &SIZES);
        Series::line(name, role, SIZES.to_vec(), changes)
    };
    let mut families = Vec::new();
    for i in 0..path.dof {
        let name = format!("half wave of {}", coordinates.0[i].name);
        families.push(family(&name, Role::Other(i as u8), &sine(i)));
    }
    families.push(family(
        "least curved",
        Role::Truth,
        &found.second_variation.mode,
    ));
    all.push(action_of_families(families, unit));
    all
}

impl Found {
    /// The path of least action, and its reliability.
    fn answer(&self) -> String {
        let Some((path, Judgement { grade, why })) =
            self.search.paths.iter().zip(&self.judgements).next()
        else {
            return "No path of stationary action was found.".into();
        };
        let action = format!("{:.6} {}", path.action, self.unit);
        let found = format!(
            "the path of least action that was found has S = {}, {}",
            action.trim_end(),
            kind(path)
        );
        let why = [found.as_str(), why]
            .into_iter()
            .filter(|part| !part.is_empty());
        Judgement::new(*grade, why.collect::<Vec<_>>().join("; ")).sentence()
    }

    fn facts(&self, args: &ActionArgs) -> Report {
        let first = self.search.paths.iter().zip(&self.judgements).take(1);
        let headline = |(path, judgement): (&StationaryPath, &Judgement)| Headline {
            judgement: Some(judgement.clone()),
            ..Headline::new(
                "Least action found",
                format!("{:.6}", path.action),
                self.unit,
                kind(path),
            )
        };
        Report {
            answer: self.answer(),
            headlines: first.map(headline).collect(),
            title: format!("Paths of stationary action, {}", args.subject.subject),
            subtitle: format!(
                "In {} s between two ends, {}",
                args.time,
                counted(args.steps, "step")
            ),
            summary: vec![format!(
                "{} from {}",
                counted(self.search.paths.len(), "stationary path"),
                counted(self.search.tried, "first path")
            )],
            tables: vec![self.table()],
            ..Report::default()
        }
    }

    fn table(&self) -> Table {
        let list = |x: &[f64]| {
            x.iter()
                .map(|x| format!("{x:.5}"))
                .collect::<Vec<_>>()
                .join(", ")
        };
        let row = |(k, path): (usize, &StationaryPath)| {
            vec![
                (k + 1).to_string(),
                format!("{:.8}", path.action),
                format!("{:.0e}", path.action_error),
                kind(path).into(),
                path.second_variation.morse_index.to_string(),
                list(&path.second_variation.conjugate_times),
                list(&path.velocities[0]),
                list(&path.velocities[1]),
            ]
        };
        let action = ["S", self.unit].join(", ");
        let mut header = vec![
            "path",
            action.trim_end_matches(", "),
            "error",
            "kind",
            "Morse index",
        ];
        header.extend(["conjugate at, s", "first velocity", "last velocity"]);
        Table::new(
            "Stationary paths that were found, that of least action first; there may be more.",
            &header,
            self.search.paths.iter().enumerate().map(row).collect(),
        )
        .with_judgements(self.judgements.iter().cloned().map(Some).collect())
    }
}

fn kind(path: &StationaryPath) -> &'static str {
    match path.kind {
        PathKind::Minimum => "minimum",
        PathKind::Saddle => "saddle",
        PathKind::Conjugate => "ends conjugate",
        PathKind::Irregular => "no minimum: M is not positive definite",
    }
}

/// The reliability of each path.
fn judgements(model: &dyn Model, search: &Search) -> Vec<Judgement> {
    let judgement =
        |path: &StationaryPath| path.judgement(outside(model, &[path.trajectory("")]).as_ref());
    search.paths.iter().map(judgement).collect()
}
