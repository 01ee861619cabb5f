//! Functional mock-up units of FMI 2.0 and 3.0, for co-simulation and for model exchange.
//!
//! A unit is a zip of `modelDescription.xml`, the sources (the model, and one file that is generated here) and, where a compiler
//! made one, a library for this platform. Inputs are `tau[i]`, states `q[i]` and `qd[i]`, outputs the states, the accelerations
//! `qdd[i]`, the energy and the distance from the data where the model knows them. There are no parameters. For
//! co-simulation the forces are constant during a step, which is divided into steps of at most [`LONGEST_STEP`] by the
//! classical Runge–Kutta method. Directional derivatives of the accelerations are exact.
//!
//! Source: Functional Mock-up Interface Specification 2.0.4 and 3.0.1, Modelica Association. The types of its headers are
//! declared in the generated file, so that no header is needed.

mod archive;
mod description;

use crate::{Call, Error, File, Interface};

pub use archive::{Binary, archive};

const SHARED: &str = include_str!("../templates/fmu.c");
const FMI2: &str = include_str!("../templates/fmi2.c");
const FMI3: &str = include_str!("../templates/fmi3.c");

/// The longest internal step of co-simulation, s.
pub const LONGEST_STEP: f64 = 1e-3;

/// A version of FMI. A unit has one of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

impl Version {
    /// The name of the file that is generated for it, after the prefix.
    fn suffix(self) -> &'static str {
        match self {
            Self::Two => "fmi2",
            Self::Three => "fmi3",
        }
    }

    /// The folder of a unit that holds the library for this platform; none where FMI has no name for the platform.
    #[must_use]
    pub fn platform(self) -> Option<String> {
        let (system, machine) = (std::env::consts::OS, std::env::consts::ARCH);
        let system = if system == "macos" { "darwin" } else { system };
        if !["linux", "darwin", "windows"].contains(&system) {
            return None;
        }
        match (self, machine) {
            (Self::Two, "x86_64") => Some(if system == "windows" {
                "win64".into()
            } else {
                format!("{system}64")
            }),
            // FMI 2.0 has names for processors of Intel alone; importers look here on others too.
            (Self::Two, "aarch64") if system == "darwin" => Some("darwin64".into()),
            (Self::Three, "x86_64" | "aarch64") => Some(format!("{machine}-{system}")),
            _ => None,
        }
    }
}

/// What a unit is made from.
#[derive(Debug, Clone, Copy)]
pub struct Fmu<'a> {
    /// The functions of the model; `forward_dynamics` must be among them.
    pub interface: &'a Interface,
    /// The version of FMI.
    pub version: Version,
    /// The sources of the model, `NAME.c` and `NAME.h`.
    pub sources: &'a [File],
}

impl Fmu<'_> {
    /// The files of the unit without a library. `compiled` says whether there is one beside them; the description names its absence.
    ///
    /// # Errors
    /// [`Error::Missing`] without `forward_dynamics`; those of [`Interface::check`].
    pub fn files(&self, compiled: bool) -> Result<Vec<File>, Error> {
        self.check()?;
        let mut files = vec![File {
            name: "modelDescription.xml".into(),
            text: description::model(self, compiled),
        }];
        if self.version == Version::Three {
            files.push(File {
                name: "sources/buildDescription.xml".into(),
                text: description::build(self),
            });
        }
        let own = [File {
            name: self.adapter_name(),
            text: self.adapter(),
        }];
        files.extend(self.sources.iter().chain(&own).map(|file| File {
            name: format!("sources/{}", file.name),
            text: file.text.clone(),
        }));
        Ok(files)
    }

    fn check(&self) -> Result<(), Error> {
        self.interface.check()?;
        let call = Call::ForwardDynamics;
        if !self.interface.has(call) {
            let what = "functional mock-up units";
            return Err(Error::Missing {
                what,
                call: call.name(),
            });
        }
        Ok(())
    }

    /// The sources that are compiled, relative to the folder of sources.
    fn compiled_names(&self) -> impl Iterator<Item = String> {
        let model = self.sources.iter().map(|file| file.name.clone());
        let model = model.filter(|name| name.ends_with(".c"));
        model.chain([self.adapter_name()])
    }

    fn adapter_name(&self) -> String {
        format!("{}_{}.c", self.interface.name, self.version.suffix())
    }

    /// The functions of FMI around the model.
    fn adapter(&self) -> String {
        let has = |call| i32::from(self.interface.has(call));
        let start: Vec<String> = self
            .interface
            .start
            .iter()
            .map(|x| format!("{x:?}"))
            .collect();
        let own = match self.version {
            Version::Two => FMI2,
            Version::Three => FMI3,
        };
        let text = format!(
            "#define MODEL_TOKEN \"{}\"\n\
             #define MODEL_START {}\n\
             #define MODEL_LONGEST_STEP {LONGEST_STEP:?}\n\
             #define MODEL_HAS_ENERGY {}\n\
             #define MODEL_HAS_DISTANCE {}\n\
             #define MODEL_HAS_SLOPES {}\n\n",
            self.token(),
            start.join(", "),
            has(Call::Energy),
            has(Call::DistanceFromData),
            has(Call::ForwardDynamicsDerivatives),
        );
        let text = (text + SHARED + own).replace("MODEL", &self.interface.name);
        format!("/* {} */\n{text}", self.interface.origin())
    }

    /// What an importer repeats to show that description and sources belong together.
    fn token(&self) -> String {
        let plain = |text: &str| {
            text.chars()
                .filter(char::is_ascii_alphanumeric)
                .collect::<String>()
        };
        let Interface {
            name,
            hash,
            version,
            ..
        } = self.interface;
        format!("{name}-{}-{}", plain(hash), plain(version))
    }
}
