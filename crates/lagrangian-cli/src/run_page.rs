//! The page of a run: loss, predictions of a motion kept for validation, parity, settings.

use anyhow::Result;
use lagrangian::dynamics::Model;
use lagrangian::report::{
    Command, Curve, Figure, Headline, Motion, Pairs, Report, Role, loss_curves, parity,
    phase_portrait, trajectories,
};
use lagrangian::rollout::RolloutOptions;
use lagrangian::score::{Score, predict, score};
use lagrangian::train::Learned;
use lagrangian::{Coordinates, Trajectory};

use crate::motion;
use crate::run_folder::{Metric, RunRecord};

/// Dots of a parity figure, at most.
const DOTS: usize = 2000;

/// What a page is made of.
pub(crate) struct Run<'a> {
    /// Its `run.toml`.
    pub(crate) record: &'a RunRecord,
    /// Its metrics.
    pub(crate) metrics: &'a [Metric],
    /// Its model.
    pub(crate) model: &'a Learned,
    /// Motions that the model is judged by; those of the training where there are no others.
    pub(crate) judged: &'a [Trajectory],
}

impl Run<'_> {
    /// The page as plain data.
    pub(crate) fn report(&self) -> Result<Report> {
        let options = motion::for_comparison();
        let score = score(self.model, self.judged, &options)?;
        let mut figures = vec![self.loss()];
        if let Some(truth) = self.judged.first() {
            figures.extend(self.motion(truth, &options)?);
        }
        figures.extend(self.parities());
        Ok(Report {
            title: format!("A {} model learned from recordings", self.family()),
            subtitle: format!("{} · version {}", self.record.started, self.record.version),
            headlines: self.headlines(&score),
            figures,
            settings: settings(self.record),
            commands: vec![Command {
                makes: "This run".into(),
                line: self.record.command.clone(),
            }],
            ..Report::default()
        })
    }

    fn family(&self) -> &'static str {
        match self.model {
            Learned::Lnn(_) => "Lagrangian",
            Learned::Rigid(_) => "rigid-body",
            _ => "plain",
        }
    }

    fn role(&self) -> Role {
        match self.model {
            Learned::Lnn(_) => Role::Lnn,
            _ => Role::Baseline,
        }
    }

    fn headlines(&self, score: &Score) -> Vec<Headline> {
        let role = Some(self.role());
        let mut headlines = Vec::new();
        for (label, error) in [
            ("Error of accelerations", &score.acceleration),
            ("Error of torques", &score.torque),
        ] {
            let Some(error) = error else { continue };
            let worst = error.nmse.iter().copied().fold(0.0, f64::max);
            let value = format!("{:.2e}", 100.0 * worst);
            let note = "of the variance, worst coordinate".into();
            headlines.push(Headline {
                label: label.into(),
                value,
                unit: "%".into(),
                note,
                role,
            });
        }
        if let Some(first) = score.rollouts.first() {
            let bound = if first.exceeded { "" } else { "≥ " };
            headlines.push(Headline {
                label: "Motion followed for".into(),
                value: format!("{bound}{:.2}", first.valid_seconds),
                unit: "s".into(),
                note: format!("of {:.2} s, from its first state alone", first.duration),
                role,
            });
        }
        headlines
    }

    fn loss(&self) -> Figure {
        let column = |name: &str| -> (Vec<f64>, Vec<f64>) {
            self.metrics
                .iter()
                .filter_map(|m| Some((m.step as f64, *m.figures.get(name)?)))
                .unzip()
        };
        let (train, validation) = (column("loss/train"), column("loss/validation"));
        let curve = |name, role, (x, y): &(Vec<f64>, Vec<f64>)| (name, role, x.clone(), y.clone());
        let curves = [
            curve("training", Role::Other(0), &train),
            curve("validation", self.role(), &validation),
        ];
        let curves: Vec<Curve<'_>> = curves
            .iter()
            .map(|(name, role, x, y)| Curve {
                name,
                role: *role,
                x,
                y,
            })
            .collect();
        loss_curves("step", "", &curves)
    }

    fn motion(&self, truth: &Trajectory, options: &RolloutOptions) -> Result<Vec<Figure>> {
        let coordinates = self.model.coordinates();
        let n = coordinates.dof();
        let predicted = predict(self.model, truth, options)?;
        let motions = [
            Motion {
                name: "recorded",
                role: Role::Truth,
                trajectory: truth,
            },
            Motion {
                name: "predicted",
                role: self.role(),
                trajectory: &predicted.trajectory,
            },
        ];
        let figures = (0..n).flat_map(|i| {
            [
                trajectories(coordinates, i, &motions),
                phase_portrait(coordinates, i, &motions),
            ]
        });
        Ok(figures.collect())
    }

    /// Accelerations, predicted over recorded, for each coordinate.
    fn parities(&self) -> Vec<Figure> {
        let coordinates = self.model.coordinates();
        let n = coordinates.dof();
        let (mut truth, mut predicted) = (Vec::new(), Vec::new());
        for trajectory in self.judged {
            let Some(qdd) = &trajectory.qdd else { continue };
            let free = vec![0.0; qdd.len()];
            let tau = trajectory.tau.as_ref().unwrap_or(&free);
            let mut own = vec![0.0; qdd.len()];
            self.model
                .evaluator()
                .forward_dynamics(&trajectory.q, &trajectory.qd, tau, &mut own);
            truth.extend_from_slice(qdd);
            predicted.extend(own);
        }
        let every = (truth.len() / n.max(1)).div_ceil(DOTS).max(1);
        let column = |signal: &[f64], i: usize| -> Vec<f64> {
            signal
                .chunks_exact(n)
                .step_by(every)
                .map(|row| row[i])
                .collect()
        };
        let figure = |i| self.parity(coordinates, i, &column(&truth, i), &column(&predicted, i));
        (0..n).filter(|_| !truth.is_empty()).map(figure).collect()
    }

    fn parity(
        &self,
        coordinates: &Coordinates,
        i: usize,
        truth: &[f64],
        predicted: &[f64],
    ) -> Figure {
        let coordinate = &coordinates.0[i];
        let pairs = Pairs {
            name: "model",
            role: self.role(),
            truth,
            predicted,
        };
        parity(
            &format!("acceleration of {}", coordinate.name),
            &format!("{}/s²", coordinate.unit),
            &[pairs],
        )
    }
}

fn settings(record: &RunRecord) -> Vec<(String, String)> {
    let mut rows = vec![("seed".to_string(), record.seed.to_string())];
    for (group, value) in &record.settings {
        match value {
            toml::Value::Table(table) => {
                rows.extend(
                    table
                        .iter()
                        .map(|(name, value)| (format!("{group}.{name}"), value.to_string())),
                );
            }
            value => rows.push((group.clone(), value.to_string())),
        }
    }
    rows.extend(record.data.iter().map(|file| {
        (
            format!("{} data", file.role),
            format!("{} (SHA-256 {})", file.path, file.sha256),
        )
    }));
    rows
}
