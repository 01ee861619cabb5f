//! The results of tracking as text and as a page.

use lagrangian::Coordinates;
use lagrangian::rigid::RigidBodies;
use lagrangian::score::{Judgement, TrackingErrors};
use lagrangian::trajectory::Coordinate;
use lagrangian_control::{LoopOutcome, Quantiles, Reference};
use lagrangian_report::draw::short;
use lagrangian_report::{
    Animation, Figure, Headline, Motion, Report, Role, Table, followed_motion, tracking_error,
};

use lagrangian_run::robot_in_motion;

use super::AtSpeed;
use super::run::Run;

/// The results of tracking.
pub(super) struct TrackingReport<'a> {
    /// The robot that moves, in words.
    pub(super) plant: String,
    pub(super) coordinates: &'a Coordinates,
    pub(super) reference: &'a Reference,
    pub(super) rate: f64,
    pub(super) runs: &'a [Run],
    /// The runs at all speeds, the first of which are `runs`.
    pub(super) speeds: &'a [AtSpeed],
}

/// A figure of each joint: its name, and its values in a run.
type Signal = (&'static str, fn(&Run) -> &[f64]);

const SIGNALS: [Signal; 3] = [
    ("RMSE", |run| &run.followed.following.rmse),
    ("largest error", |run| &run.followed.following.largest),
    ("at the limit", |run| &run.followed.following.at_limit),
];

fn latency(run: &Run) -> Quantiles {
    run.followed.driven.latency.quantiles()
}

fn role(run: &Run) -> Role {
    match run.key {
        "perfect" => Role::Truth,
        "model" => Role::Lnn,
        _ => Role::Other(0),
    }
}

/// A motion along the reference, and its error.
fn follower(run: &Run) -> (Motion<'_>, &[f64]) {
    let followed = &run.followed;
    let motion = Motion::new(run.name, role(run), &followed.driven.trajectory);
    (motion, &followed.error)
}

impl TrackingReport<'_> {
    fn names(&self) -> impl Iterator<Item = &str> {
        self.coordinates.0.iter().map(|c| c.name.as_str())
    }

    fn run(&self, key: &str) -> Option<&Run> {
        self.runs.iter().find(|run| run.key == key)
    }

    /// The part of the possible gain that the model reaches, for each joint; `None` without a true model or without this one.
    pub(super) fn judgements(&self) -> Option<Vec<Judgement>> {
        let (model, feedback) = (self.run("model")?, self.run("feedback")?);
        let truth = self.run("perfect")?;
        let judgement = |i: usize| {
            let rmse = |run: &Run| match run.followed.driven.outcome {
                LoopOutcome::Diverged { .. } => f64::NAN,
                _ => run.judged.rmse[i],
            };
            let errors = TrackingErrors {
                model: rmse(model),
                feedback: rmse(feedback),
                truth: rmse(truth),
                at_limit: model.judged.at_limit[i],
            };
            errors.judgement()
        };
        Some((0..self.coordinates.dof()).map(judgement).collect())
    }

    /// The joint with the largest error, with the verdict on it.
    fn answer(&self) -> String {
        let judgements = self.judgements();
        let cost = |i: &usize| judgements.as_ref().map(|all| all[*i].grade);
        let worst = (0..self.coordinates.dof()).max_by_key(cost).unwrap_or(0);
        let Coordinate { name, unit, .. } = &self.coordinates.0[worst];
        let error = |run: &Run| {
            let rmse = short(run.judged.rmse[worst]);
            format!(
                "{} with {}",
                [rmse.as_str(), unit].join(" ").trim_end(),
                run.name
            )
        };
        let errors = self.runs.iter().map(error).collect::<Vec<_>>().join(", ");
        let when = if self.is_learned() {
            ", in the last fifth of the motion"
        } else {
            ""
        };
        let errors = format!("the RMSE of {name} is {errors}{when}");
        match &judgements {
            Some(all) => {
                let Judgement { grade, why } = &all[worst];
                Judgement::new(*grade, format!("{errors}; {why}")).sentence()
            }
            None => format!("No verdict, as the robot is {}: {errors}.", self.plant),
        }
    }

    /// The error of each joint with this model, with its verdict.
    fn headlines(&self) -> Vec<Headline> {
        let Some(model) = self.run("model") else {
            return Vec::new();
        };
        let judgements = self.judgements();
        let with = match self.is_learned() {
            true => format!("with {}, in the last fifth", model.name),
            false => format!("with {}", model.name),
        };
        let headline = |i: usize| {
            let Coordinate { name, unit, .. } = &self.coordinates.0[i];
            let value = short(model.judged.rmse[i]);
            Headline {
                role: Some(Role::Lnn),
                judgement: judgements.as_ref().map(|all| all[i].clone()),
                ..Headline::new(&format!("RMSE of {name}"), value, unit, &with)
            }
        };
        (0..self.coordinates.dof()).map(headline).collect()
    }

    pub(super) fn figures(&self) -> Vec<Figure> {
        // The first run is the selected one: it is drawn on top.
        let followers: Vec<_> = self.runs.iter().rev().map(follower).collect();
        let motions: Vec<Motion> = followers.iter().map(|(motion, _)| *motion).collect();
        let reference = self.reference.samples();
        let both = |i| {
            [
                followed_motion(self.coordinates, i, reference, &motions),
                tracking_error(self.coordinates, i, &followers),
            ]
        };
        (0..self.coordinates.dof()).flat_map(both).collect()
    }

    /// This robot along the reference, and as each driver moves it.
    pub(super) fn film(&self, robot: &RigidBodies) -> Option<Animation> {
        let reference = Motion::new("reference", Role::Truth, self.reference.samples());
        let driven = self.runs.iter().map(|run| follower(run).0);
        let motions: Vec<Motion> = std::iter::once(reference).chain(driven).collect();
        robot_in_motion(robot, "The robot", &motions)
    }

    fn errors(&self) -> Table {
        let row = |run: &Run, (name, values): Signal| {
            let cells = values(run).iter().map(|&x| short(x));
            [name.to_string(), run.name.to_string()]
                .into_iter()
                .chain(cells)
                .collect()
        };
        let rows = SIGNALS
            .iter()
            .flat_map(|&signal| self.runs.iter().map(move |run| row(run, signal)));
        let header: Vec<&str> = ["", "with"].into_iter().chain(self.names()).collect();
        Table::new(
            "Tracking errors in the units of the coordinates, and the part of the ticks at the torque limit.",
            &header,
            rows.collect(),
        )
    }

    /// Whether a model was learned during the motion.
    fn is_learned(&self) -> bool {
        self.run("model")
            .is_some_and(|run| run.followed.record.is_some())
    }

    /// The errors over all joints in each part of the motion.
    fn over_time(&self) -> Table {
        let row = |run: &Run| {
            let cells = run.parts().into_iter().map(short);
            std::iter::once(run.name.to_string()).chain(cells).collect()
        };
        Table::new(
            "Root mean square of the error over all joints in each fifth of the motion.",
            &["with", "1", "2", "3", "4", "5"],
            self.runs.iter().map(row).collect(),
        )
    }

    fn times(&self) -> Table {
        let row = |run: &Run| {
            let Quantiles { p50, p99, max, .. } = latency(run);
            let cells = [p50, p99, max].map(|x| short(1e6 * x));
            std::iter::once(run.name.to_string()).chain(cells).collect()
        };
        Table::new(
            "Time of a call of the controller, µs.",
            &["with", "p50", "p99", "max"],
            self.runs.iter().map(row).collect(),
        )
    }

    /// The errors over all joints at each speed, and over those of the true model where there is one.
    fn by_speed(&self) -> Table {
        let row = |at: &AtSpeed, run: &Run| {
            let truth = at.runs.iter().find(|run| run.key == "perfect");
            let ratio = truth.map(|truth| short(run.overall() / truth.overall()));
            let cells = [
                short(at.speed),
                run.name.into(),
                short(run.real_time),
                short(run.overall()),
            ];
            cells.into_iter().chain(ratio).collect()
        };
        let rows = self.speeds.iter();
        let rows = rows.flat_map(|at| at.runs.iter().map(move |run| row(at, run)));
        let header = ["speed", "with", "real time", "RMSE", "over the true model"];
        let shown = header.len() - usize::from(self.run("perfect").is_none());
        Table::new(
            "Root mean square of the error over all joints, in the units of the coordinates, and seconds of motion in a second of simulation.",
            &header[..shown],
            rows.collect(),
        )
    }

    /// The answer, the verdicts on the joints, the errors and the times.
    pub(super) fn facts(&self) -> Report {
        let over_time = self.is_learned().then(|| self.over_time());
        let tables = [self.errors(), self.by_speed(), self.times()];
        let tables = over_time.into_iter().chain(tables).collect();
        Report {
            title: "Tracking of a reference".into(),
            subtitle: format!(
                "'{}', {} s at {} Hz; the robot is {}",
                self.reference.samples().name,
                short(self.reference.end() - self.reference.start()),
                self.rate,
                self.plant
            ),
            answer: self.answer(),
            headlines: self.headlines(),
            tables,
            ..Report::default()
        }
    }
}
