//! The state of a worker of the page, and its answers.

use lagrangian::check::{Item, check};
use lagrangian::dataset::{random_starts, random_states};
use lagrangian::rollout::{EnergyTest, energy_test, free, rollout_many, times};
use lagrangian::trajectory::Visited;
use lagrangian::{
    CheckOptions, CheckReport, Dataset, FitSpec, Learned, Model, Recording, RolloutOptions,
    SavedModel, Verdict,
};
use serde::Serialize;

use crate::error::{Error, Result, bounded, bounded_file};
use crate::fitting::Fitting;
use crate::limits;
use crate::motion::options;
use crate::recordings::{self, Columns, Given, Summary, UploadedFile, csv};
use crate::request::{By, EnergyAsked, Request, States};
use crate::speed;
use crate::system::{self, Axis, Named, axes};

/// A message to or from the page.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Message {
    /// Its JSON.
    pub text: String,
    /// The bytes of a file, if it has one.
    pub bytes: Vec<u8>,
}

impl Message {
    /// A message without a file.
    #[must_use]
    pub fn text(text: &str) -> Self {
        Self {
            text: text.into(),
            bytes: Vec::new(),
        }
    }

    fn json(answer: &impl Serialize) -> Result<Self> {
        Ok(Self {
            text: serde_json::to_string(answer)?,
            bytes: Vec::new(),
        })
    }

    fn file(bytes: Vec<u8>) -> Self {
        Self {
            text: "null".into(),
            bytes,
        }
    }
}

/// The state of a worker between two requests: files, data, a fit, a model.
#[derive(Debug, Default)]
pub struct Session {
    dropped: Vec<UploadedFile>,
    data: Option<Data>,
    fitting: Option<Fitting>,
    loaded: Option<Learned>,
}

/// The data of a fit.
#[derive(Debug)]
enum Data {
    /// Recordings.
    Recordings(Box<Given>),
    /// Random states with their accelerations.
    States(Box<Dataset>),
}

/// The answer of a check.
#[derive(Debug, Serialize)]
struct Checked {
    verdict: Verdict,
    items: Vec<Item>,
}

/// Description of a loaded model.
#[derive(Debug, Serialize)]
struct Loaded {
    family: &'static str,
    what: &'static str,
    mechanical: bool,
    /// Whether no force was recorded, so that its energies are determined up to one factor.
    free: bool,
    coordinates: Vec<Axis>,
}

impl Session {
    /// Serves a request.
    ///
    /// # Errors
    /// [`Error`], whose message ends with the remedy; the session is unchanged.
    pub fn answer(&mut self, message: &Message) -> Result<Message> {
        match serde_json::from_str(&message.text)? {
            Request::Systems => Message::json(&system::all()?),
            Request::Simulate(asked) => {
                let energy = asked.energy_of.as_ref().map(Named::build).transpose()?;
                let energy = energy.as_deref().map(|model| model as &dyn Model);
                let motion = self.with(&asked.by, |model| asked.of(model, energy))?;
                Message::json(&motion)
            }
            Request::Experiment(asked) => self.take(Given::recorded(asked.record()?), Vec::new()),
            Request::States(asked) => self.states(&asked),
            Request::Inspect { name, joins } => self.inspect(name, joins, &message.bytes),
            Request::Read(columns) => self.read(columns),
            Request::Check => Message::json(&self.checked()?),
            Request::Data => Ok(Message::file(csv(self.recordings()?)?)),
            Request::Start { fit, started } => self.start(*fit, started),
            Request::Advance { milliseconds } => {
                Message::json(&self.fitting_mut()?.advance(milliseconds)?)
            }
            Request::Finish => {
                self.fitting_mut()?.finish();
                Message::json(&())
            }
            Request::Score => Message::json(&self.fitting_mut()?.score()?),
            Request::Report => Ok(Message::file(self.fitting_mut()?.report()?)),
            Request::Energy(asked) => Message::json(&self.energy(&asked)?),
            Request::Potential(asked) => {
                Message::json(&self.with(&asked.by, |model| Ok(asked.of(model)))?)
            }
            Request::Action(asked) => {
                Message::json(&self.with(&asked.by, |model| Ok(asked.of(model)))?)
            }
            Request::Save => Ok(Message::file(self.fitting()?.save()?)),
            Request::Load => self.load(&message.bytes),
            Request::Speed => Message::json(&speed::measured()?),
        }
    }

    fn take(&mut self, given: Given, notes: Vec<String>) -> Result<Message> {
        let summary = Summary::of(&given.data.training, notes)?;
        self.data = Some(Data::Recordings(Box::new(given)));
        Message::json(&summary)
    }

    fn states(&mut self, asked: &States) -> Result<Message> {
        let remedy = "take fewer states";
        bounded(
            "the number of states",
            asked.samples as f64,
            limits::SAMPLES as f64,
            remedy,
        )?;
        let system = asked.of.build()?;
        let held_back = asked.samples.div_ceil(10).min(2000);
        let dataset = random_states(&*system, asked.samples, held_back, asked.seed)?;
        self.data = Some(Data::States(Box::new(dataset)));
        Message::json(&asked.samples)
    }

    fn inspect(&mut self, name: String, joins: bool, bytes: &[u8]) -> Result<Message> {
        let before: usize = match joins {
            true => self.dropped.iter().map(UploadedFile::size).sum(),
            false => 0,
        };
        let remedy =
            "take a part of them, or use the command `lagrangian`, which has no such bound";
        bounded_file(before + bytes.len(), remedy)?;
        let dropped = UploadedFile::new(name, bytes)?;
        if !joins {
            self.dropped.clear();
        }
        let answer = Message::json(&dropped.inspected());
        self.dropped.push(dropped);
        answer
    }

    fn read(&mut self, columns: Columns) -> Result<Message> {
        if self.dropped.is_empty() {
            return Err(Error::Missing {
                what: "file",
                remedy: "drop one on the page",
            });
        }
        let (given, notes) = recordings::read(&self.dropped, columns)?;
        self.take(given, notes)
    }

    fn recordings(&self) -> Result<&[Recording]> {
        match &self.data {
            Some(Data::Recordings(given)) => Ok(&given.data.training),
            _ => Err(NO_DATA),
        }
    }

    fn checked(&self) -> Result<Checked> {
        let report: CheckReport = check(self.recordings()?, &CheckOptions::default());
        Ok(Checked {
            verdict: report.verdict(),
            items: report.items,
        })
    }

    fn start(&mut self, spec: FitSpec, started: f64) -> Result<Message> {
        let fitting = match &self.data {
            None => return Err(NO_DATA),
            Some(Data::Recordings(given)) => {
                Fitting::of_recordings((**given).clone(), spec, started)?
            }
            Some(Data::States(dataset)) => Fitting::of_states((**dataset).clone(), spec)?,
        };
        let answer = Message::json(&fitting.begun());
        self.fitting = Some(fitting);
        answer
    }

    fn fitting(&self) -> Result<&Fitting> {
        self.fitting.as_ref().ok_or(NO_FIT)
    }

    fn fitting_mut(&mut self) -> Result<&mut Fitting> {
        self.fitting.as_mut().ok_or(NO_FIT)
    }

    /// Calls a function with the requested system or model.
    fn with<T>(&self, by: &By, then: impl FnOnce(&dyn Model) -> Result<T>) -> Result<T> {
        match by {
            By::System(name) => then(&*Named::from(&**name).build()?),
            By::Known(named) => then(&*named.build()?),
            By::Fitted => then(self.fitting()?.model()?),
            By::Loaded => then(self.loaded.as_ref().ok_or(Error::Missing {
                what: "model",
                remedy: "drop the file of one on the page",
            })?),
        }
    }

    fn energy(&self, asked: &EnergyAsked) -> Result<EnergyTest> {
        let remedy = "take fewer starts";
        bounded(
            "the number of starts",
            asked.starts as f64,
            limits::STARTS as f64,
            remedy,
        )?;
        let system = asked.of.build()?;
        let starts = random_starts(&*system, asked.starts, asked.seed);
        // Only the ends of the motions count.
        let times = times(asked.duration, asked.duration)?;
        let options: RolloutOptions = options();
        let model = self.fitting()?.model()?;
        let rollouts = rollout_many(model, &starts, &times, &free, &options)?;
        Ok(energy_test(&*system, &rollouts, asked.reference))
    }

    fn load(&mut self, bytes: &[u8]) -> Result<Message> {
        let remedy = "take a smaller model, or the command `lagrangian`";
        bounded_file(bytes.len(), remedy)?;
        let model = Learned::load(&SavedModel::from_bytes(bytes)?)?;
        let description = model.description();
        let answer = Message::json(&Loaded {
            family: model.family(),
            what: description.what,
            mechanical: description.mechanical,
            free: model.visited().is_some_and(Visited::is_free),
            coordinates: axes(model.coordinates()),
        });
        self.loaded = Some(model);
        answer
    }
}

const NO_DATA: Error = Error::Missing {
    what: "data",
    remedy: "record a motion, or drop a file on the page",
};

const NO_FIT: Error = Error::Missing {
    what: "fit",
    remedy: "start one first",
};
