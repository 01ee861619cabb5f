//! Functional mock-up units of FMI 2.0, for co-simulation and for model exchange.
//!
//! A unit is a zip of `modelDescription.xml`, the sources (the model, and one file that is generated here) and, if a compiler
//! made one, a library for this platform. Inputs are `tau[i]`, states `q[i]` and `qd[i]`, outputs the states, the accelerations
//! `qdd[i]`, the energy and the distance from the data if the model provides them. There are no parameters. For
//! co-simulation the forces are constant during a step, which is divided into steps of at most [`LONGEST_STEP`] by the
//! classical Runge–Kutta method. Directional derivatives of the accelerations are exact.
//!
//! Source: Functional Mock-up Interface Specification 2.0.4, Modelica Association. The types of its headers are declared in
//! the generated file, so that no header is needed.

mod archive;
mod description;

use crate::{Call, Error, File, Interface};

pub use archive::archive;

/// The motion of a model, and the functions of FMI for it.
const TEMPLATES: [&str; 2] = [
    include_str!("../templates/fmu.c"),
    include_str!("../templates/fmi2.c"),
];

/// The longest internal step of co-simulation, s.
pub const LONGEST_STEP: f64 = 1e-3;

/// Parts of a unit.
#[derive(Debug, Clone, Copy)]
pub struct Fmu<'a> {
    /// The functions of the model; they must include `forward_dynamics`.
    pub interface: &'a Interface,
    /// The sources of the model, `NAME.c` and `NAME.h`.
    pub sources: &'a [File],
}

impl Fmu<'_> {
    /// The files of the unit without a library. `compiled` tells whether the unit has one; the description mentions its absence.
    ///
    /// # Errors
    /// [`Error::Missing`] without `forward_dynamics`; those of [`Interface::check`].
    pub fn files(&self, compiled: bool) -> Result<Vec<File>, Error> {
        self.interface.check()?;
        if !self.interface.has(Call::ForwardDynamics) {
            return Err(Error::Missing {
                what: "functional mock-up units",
                call: Call::ForwardDynamics.name(),
            });
        }
        let description = File {
            name: "modelDescription.xml".into(),
            text: description::model(self, compiled),
        };
        let own = [File {
            name: self.adapter_name(),
            text: self.adapter(),
        }];
        let sources = self.sources.iter().chain(&own).map(|file| File {
            name: format!("sources/{}", file.name),
            text: file.text.clone(),
        });
        Ok([description].into_iter().chain(sources).collect())
    }

    /// The sources that are compiled, relative to the folder of sources.
    fn compiled_names(&self) -> impl Iterator<Item = String> {
        let model = self.sources.iter().map(|file| file.name.clone());
        let model = model.filter(|name| name.ends_with(".c"));
        model.chain([self.adapter_name()])
    }

    fn adapter_name(&self) -> String {
        format!("{}_fmi2.c", self.interface.name)
    }

    /// The functions of FMI for the model.
    fn adapter(&self) -> String {
        let has = |call| i32::from(self.interface.has(call));
        let start: Vec<String> = self
            .interface
            .start
            .iter()
            .map(|x| format!("{x:?}"))
            .collect();
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
        let text = (text + &TEMPLATES.concat()).replace("MODEL", &self.interface.name);
        format!("/* {} */\n{text}", self.interface.origin())
    }

    /// The identifier that an importer passes back to show that description and sources belong together.
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
