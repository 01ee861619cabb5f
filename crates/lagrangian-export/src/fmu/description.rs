//! The XML files of a unit: its variables, their units and how they depend on each other, and how it is compiled.

use std::fmt::Write;

use super::{Fmu, Version};
use crate::{Call, Drive, Interface};

/// A variable of the unit.
struct Variable {
    name: String,
    reference: usize,
    /// Empty where it is not known.
    unit: &'static str,
    about: String,
    role: Role,
    /// The references of the variables that it is computed from.
    from: Vec<usize>,
}

/// What a variable is to a simulation.
enum Role {
    Time,
    Input,
    State {
        start: f64,
    },
    /// The rate of the state of this reference, as an output or not.
    Rate {
        of: usize,
        output: bool,
    },
    Output,
}

impl Variable {
    fn is_output(&self) -> bool {
        matches!(
            self.role,
            Role::State { .. } | Role::Rate { output: true, .. } | Role::Output
        )
    }

    fn is_rate(&self) -> bool {
        matches!(self.role, Role::Rate { .. })
    }

    /// Whether it is computed when a simulation begins.
    fn is_initially_unknown(&self) -> bool {
        self.is_rate() || matches!(self.role, Role::Output)
    }

    /// Causality, variability and how it begins.
    fn kind(&self) -> &'static str {
        match self.role {
            Role::Time => r#"causality="independent" variability="continuous""#,
            Role::Input => r#"causality="input" variability="continuous""#,
            Role::State { .. } => r#"causality="output" variability="continuous" initial="exact""#,
            Role::Rate { output: false, .. } => {
                r#"causality="local" variability="continuous" initial="calculated""#
            }
            Role::Rate { .. } | Role::Output => {
                r#"causality="output" variability="continuous" initial="calculated""#
            }
        }
    }

    fn start(&self) -> Option<f64> {
        match self.role {
            Role::Input => Some(0.0),
            Role::State { start } => Some(start),
            _ => None,
        }
    }

    /// Unit, first value and the state that it is the rate of, which the two versions number differently.
    fn details(&self, number: impl Fn(usize) -> usize) -> String {
        let mut text = match self.unit {
            "" => String::new(),
            unit => format!("unit=\"{unit}\""),
        };
        if let Some(start) = self.start() {
            let _ = write!(text, " start=\"{start:?}\"");
        }
        if let Role::Rate { of, .. } = self.role {
            let _ = write!(text, " derivative=\"{}\"", number(of));
        }
        text
    }
}

/// The variables of a unit while they are listed. The generated adapter repeats the order of their references.
struct List<'a> {
    interface: &'a Interface,
    variables: Vec<Variable>,
}

impl List<'_> {
    /// Adds a variable at the next reference.
    fn push(
        &mut self,
        name: String,
        unit: &'static str,
        about: String,
        role: Role,
        from: Vec<usize>,
    ) {
        let reference = self.variables.len();
        self.variables.push(Variable {
            name,
            reference,
            unit,
            about,
            role,
            from,
        });
    }

    /// The reference of the first position.
    fn q(&self) -> usize {
        1 + self.interface.inputs()
    }

    /// The reference of the first velocity.
    fn qd(&self) -> usize {
        self.q() + self.interface.joints.len()
    }

    fn inputs(&mut self) {
        for i in 0..self.interface.inputs() {
            let joint = &self.interface.joints[i];
            let (unit, about) = match self.interface.drive {
                Drive::Forces => (joint.unit.force(), format!("force on {}", joint.name)),
                Drive::Inputs(_) => (
                    "",
                    format!("input {} of the actuators, in the unit of the data", i + 1),
                ),
            };
            self.push(format!("tau[{}]", i + 1), unit, about, Role::Input, vec![]);
        }
    }

    fn states(&mut self) {
        for (k, (name, what)) in [("q", "position"), ("qd", "velocity")]
            .into_iter()
            .enumerate()
        {
            for (i, joint) in self.interface.joints.iter().enumerate() {
                let start = self.interface.start[k * self.interface.joints.len() + i];
                let itself = vec![self.variables.len()];
                let about = format!("{what} of {}", joint.name);
                let name = format!("{name}[{}]", i + 1);
                self.push(
                    name,
                    joint.unit.rate(k),
                    about,
                    Role::State { start },
                    itself,
                );
            }
        }
    }

    fn rates(&mut self) {
        let (q, qd) = (self.q(), self.qd());
        for (i, joint) in self.interface.joints.iter().enumerate() {
            let role = Role::Rate {
                of: q + i,
                output: false,
            };
            let about = format!("velocity of {}, as the rate of its position", joint.name);
            self.push(
                format!("der(q[{}])", i + 1),
                joint.unit.rate(1),
                about,
                role,
                vec![qd + i],
            );
        }
        let motion: Vec<usize> = (1..qd + self.interface.joints.len()).collect();
        for (i, joint) in self.interface.joints.iter().enumerate() {
            let role = Role::Rate {
                of: qd + i,
                output: true,
            };
            let about = format!("acceleration of {}", joint.name);
            self.push(
                format!("qdd[{}]", i + 1),
                joint.unit.rate(2),
                about,
                role,
                motion.clone(),
            );
        }
    }

    /// Energy and distance. Their references are kept free where the model lacks them.
    fn scalars(&mut self) {
        let (q, n) = (self.q(), self.interface.joints.len());
        let scalars = [
            (Call::Energy, "energy", "J"),
            (Call::DistanceFromData, "distance_from_data", "1"),
        ];
        for (k, (call, name, unit)) in scalars.into_iter().enumerate() {
            if self.interface.has(call) {
                self.variables.push(Variable {
                    name: name.into(),
                    reference: q + 4 * n + k,
                    unit,
                    about: call.about().into(),
                    role: Role::Output,
                    from: (q..q + 2 * n).collect(),
                });
            }
        }
    }
}

/// All variables.
fn variables(interface: &Interface) -> Vec<Variable> {
    let mut list = List {
        interface,
        variables: vec![],
    };
    list.push("time".into(), "s", "time".into(), Role::Time, vec![]);
    list.inputs();
    list.states();
    list.rates();
    list.scalars();
    list.variables
}

/// The units that variables have, by exponents of the base units.
const UNITS: &[(&str, &str)] = &[
    ("s", r#"s="1""#),
    ("rad", r#"rad="1""#),
    ("rad/s", r#"rad="1" s="-1""#),
    ("rad/s2", r#"rad="1" s="-2""#),
    ("m", r#"m="1""#),
    ("m/s", r#"m="1" s="-1""#),
    ("m/s2", r#"m="1" s="-2""#),
    ("N", r#"kg="1" m="1" s="-2""#),
    ("N.m", r#"kg="1" m="2" s="-2""#),
    ("J", r#"kg="1" m="2" s="-2""#),
    ("1", ""),
];

/// `modelDescription.xml`.
pub(super) fn model(unit: &Fmu<'_>, compiled: bool) -> String {
    let variables = variables(unit.interface);
    let interface = unit.interface;
    let (version, token) = match unit.version {
        Version::Two => ("2.0", "guid"),
        Version::Three => ("3.0", "instantiationToken"),
    };
    let about = match compiled {
        true => interface.description.clone(),
        false => format!(
            "{} (sources only: the importer compiles them)",
            interface.description
        ),
    };
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"{version}\" modelName=\"{name}\" {token}=\"{}\" description=\"{}\" version=\"{}\" \
         generationTool=\"lagrangian {}\" variableNamingConvention=\"structured\"{}>\n",
        unit.token(),
        escaped(&about),
        escaped(&interface.hash),
        escaped(&interface.version),
        if unit.version == Version::Two {
            " numberOfEventIndicators=\"0\""
        } else {
            ""
        },
        name = interface.name,
    );
    text += &kinds(unit);
    text += "  <UnitDefinitions>\n";
    for (name, base) in UNITS
        .iter()
        .filter(|(name, _)| variables.iter().any(|v| v.unit == *name))
    {
        let _ = writeln!(text, "    <Unit name=\"{name}\"><BaseUnit {base}/></Unit>");
    }
    text += "  </UnitDefinitions>\n  <LogCategories>\n    <Category name=\"logStatusWarning\"/>\n    <Category \
             name=\"logStatusError\"/>\n  </LogCategories>\n  <DefaultExperiment startTime=\"0\" stopTime=\"10\" stepSize=\"0.01\"/>\n";
    text += "  <ModelVariables>\n";
    for variable in &variables {
        text += &line(unit.version, variable);
    }
    text += "  </ModelVariables>\n";
    text += &structure(unit.version, &variables);
    text + "</fmiModelDescription>\n"
}

/// What the unit can do.
fn kinds(unit: &Fmu<'_>) -> String {
    let slopes = unit.interface.has(Call::ForwardDynamicsDerivatives);
    let state = if unit.version == Version::Two {
        "FMUstate"
    } else {
        "FMUState"
    };
    let common = format!(
        "modelIdentifier=\"{}\" canGetAndSet{state}=\"true\" canSerialize{state}=\"true\"",
        unit.interface.name
    );
    let step = "canHandleVariableCommunicationStepSize=\"true\"";
    match unit.version {
        Version::Two => {
            let files: String = unit
                .compiled_names()
                .map(|name| format!("      <File name=\"{}\"/>\n", escaped(&name)))
                .collect();
            let files = format!("    <SourceFiles>\n{files}    </SourceFiles>\n");
            format!(
                "  <ModelExchange {common} providesDirectionalDerivative=\"{slopes}\">\n{files}  </ModelExchange>\n  \
                 <CoSimulation {common} providesDirectionalDerivative=\"{slopes}\" {step}>\n{files}  </CoSimulation>\n"
            )
        }
        Version::Three => format!(
            "  <ModelExchange {common} providesDirectionalDerivatives=\"{slopes}\"/>\n  \
             <CoSimulation {common} providesDirectionalDerivatives=\"{slopes}\" {step}/>\n"
        ),
    }
}

/// A variable as an element of XML.
fn line(version: Version, variable: &Variable) -> String {
    let Variable {
        name,
        reference,
        about,
        ..
    } = variable;
    let (kind, about) = (variable.kind(), escaped(about));
    match version {
        // FMI 2.0 numbers variables by their place, from 1. All states stand at their reference plus one.
        Version::Two => format!(
            "    <ScalarVariable name=\"{name}\" valueReference=\"{reference}\" description=\"{about}\" {kind}><Real {}/>\
             </ScalarVariable>\n",
            variable.details(|of| of + 1)
        ),
        Version::Three => format!(
            "    <Float64 name=\"{name}\" valueReference=\"{reference}\" description=\"{about}\" {kind} {}/>\n",
            variable.details(|of| of)
        ),
    }
}

/// Which variables are outputs, rates and unknown at first, and what they depend on.
fn structure(version: Version, variables: &[Variable]) -> String {
    let element = |tag: &str, place: usize, variable: &Variable| {
        let (key, number, shift) = match version {
            Version::Two => ("index", place + 1, 1),
            Version::Three => ("valueReference", variable.reference, 0),
        };
        let from: Vec<String> = variable
            .from
            .iter()
            .map(|k| (k + shift).to_string())
            .collect();
        format!(
            "    <{tag} {key}=\"{number}\" dependencies=\"{}\"/>\n",
            from.join(" ")
        )
    };
    let group = |section: &str, tag: &str, belongs: fn(&Variable) -> bool| {
        let lines = variables.iter().enumerate().filter(|(_, v)| belongs(v));
        let lines: String = lines.map(|(k, v)| element(tag, k, v)).collect();
        match version {
            Version::Two => format!("    <{section}>\n{lines}    </{section}>\n"),
            Version::Three => lines,
        }
    };
    let tags = match version {
        Version::Two => ["Unknown"; 3],
        Version::Three => ["Output", "ContinuousStateDerivative", "InitialUnknown"],
    };
    [
        "  <ModelStructure>\n".into(),
        group("Outputs", tags[0], Variable::is_output),
        group("Derivatives", tags[1], Variable::is_rate),
        group("InitialUnknowns", tags[2], Variable::is_initially_unknown),
        "  </ModelStructure>\n".into(),
    ]
    .concat()
}

/// `buildDescription.xml` of FMI 3.0.
pub(super) fn build(unit: &Fmu<'_>) -> String {
    let files: String = unit
        .compiled_names()
        .map(|name| format!("      <SourceFile name=\"{}\"/>\n", escaped(&name)))
        .collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiBuildDescription fmiVersion=\"3.0\">\n  <BuildConfiguration \
         modelIdentifier=\"{}\">\n    <SourceFileSet language=\"C99\">\n{files}    </SourceFileSet>\n  </BuildConfiguration>\n\
         </fmiBuildDescription>\n",
        unit.interface.name
    )
}

/// Text as the value of an attribute.
fn escaped(text: &str) -> String {
    lagrangian::shown(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
