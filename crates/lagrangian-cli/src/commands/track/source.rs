//! What the controller drives with.

use std::path::Path;

use anyhow::Result;
use lagrangian::{Coordinates, FitSpec};
use lagrangian_control::online::{OnlineConfig, OnlineLearner};

use crate::failure::{Context, mistake};
use crate::fitted::{self, Fitted};
use crate::robot;
use crate::track_args::{ControllerName, TrackArgs};

/// What the controller drives with: a saved model, or one that is learned during the motion.
pub(super) enum Source {
    Saved(Box<Fitted>),
    Online(Box<OnlineConfig>),
}

impl Source {
    pub(super) fn of(args: &TrackArgs) -> Result<Self> {
        let own = &args.learning;
        let settings = &own.settings.0.values;
        let Some(family) = &own.online else {
            if let Some(name) = settings.keys().next() {
                return Err(mistake(
                    format!(
                        "--{} is a setting of a model that is learned",
                        name.replace('_', "-")
                    ),
                    "name its family as --online, or omit the setting: a saved model has its own",
                ));
            }
            if own.urdf.is_some() {
                return Err(mistake(
                    "--urdf describes a robot whose bodies are learned",
                    "add --online rigid, or name the robot that moves as --robot",
                ));
            }
            let path = args.model.as_deref().unwrap_or(Path::new(""));
            return Ok(Self::Saved(Box::new(fitted::fitted(path)?)));
        };
        if args.control.controller != ControllerName::FeedForward {
            return Err(mistake(
                "a model that is learned online acts by feed-forward",
                "omit --controller",
            ));
        }
        let described = own
            .urdf
            .as_deref()
            .map(|path| robot::open(path, &args.truth.joints));
        let request = FitSpec {
            family: Some(family.clone()),
            settings: settings.clone(),
            urdf: described.transpose()?.map(|robot| robot.text),
            joints: args.truth.joints.clone(),
            ..FitSpec::default()
        };
        let online = OnlineConfig::chosen(&request, args.control.seed);
        Ok(Self::Online(Box::new(online.context(
            format!("cannot learn '{family}' online"),
            "`lagrangian fit --help` has the settings of each family",
        )?)))
    }

    /// Refuses a family that learns nothing online for a robot of these coordinates.
    pub(super) fn check(&self, coordinates: &Coordinates) -> Result<()> {
        let Self::Online(online) = self else {
            return Ok(());
        };
        let own = OnlineConfig::clone(online);
        OnlineLearner::new(coordinates.clone(), own).context(
            format!("cannot learn '{}' online", online.family.name()),
            "`lagrangian fit --help` has the families and their settings",
        )?;
        Ok(())
    }

    pub(super) fn saved(&self) -> Option<&Fitted> {
        match self {
            Self::Saved(fitted) => Some(fitted),
            Self::Online(_) => None,
        }
    }
}
