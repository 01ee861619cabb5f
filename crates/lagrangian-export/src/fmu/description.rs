//! The description of a unit in XML: its variables, their units and how they depend on each other, and its sources.

use std::fmt::Write;

use super::Fmu;
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

    /// Unit, first value and the state that it is the rate of, by its place in the list.
    fn details(&self) -> String {
        let mut text = match self.unit {
            "" => String::new(),
            unit => format!("unit=\"{unit}\""),
        };
        if let Some(start) = self.start() {
            let _ = write!(text, " start=\"{start:?}\"");
        }
        if let Role::Rate { of, .. } = self.role {
            let _ = write!(text, " derivative=\"{}\"", place(of));
        }
        text
    }
}

/// The place of a variable in the list, from 1. It is one more than its reference, but for those after a scalar that the model lacks, which
/// nothing depends on.
fn place(reference: usize) -> usize {
    reference + 1
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
    let about = match compiled {
        true => interface.description.clone(),
        false => format!(
            "{} (sources only: the importer compiles them)",
            interface.description
        ),
    };
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"2.0\" modelName=\"{}\" guid=\"{}\" description=\"{}\" version=\"{}\" \
         generationTool=\"lagrangian {}\" variableNamingConvention=\"structured\" numberOfEventIndicators=\"0\">\n",
        interface.name,
        unit.token(),
        escaped(&about),
        escaped(&interface.hash),
        escaped(&interface.version),
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
        text += &line(variable);
    }
    text += "  </ModelVariables>\n";
    text += &structure(&variables);
    text + "</fmiModelDescription>\n"
}

/// The kinds of simulation that the unit serves, what it can do in each, and the sources that are compiled.
fn kinds(unit: &Fmu<'_>) -> String {
    let files: String = unit
        .compiled_names()
        .map(|name| format!("      <File name=\"{}\"/>\n", escaped(&name)))
        .collect();
    let kind = |tag: &str, more: &str| {
        format!(
            "  <{tag} modelIdentifier=\"{}\" canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\" \
             providesDirectionalDerivative=\"{}\"{more}>\n    <SourceFiles>\n{files}    </SourceFiles>\n  </{tag}>\n",
            unit.interface.name,
            unit.interface.has(Call::ForwardDynamicsDerivatives),
        )
    };
    kind("ModelExchange", "")
        + &kind(
            "CoSimulation",
            " canHandleVariableCommunicationStepSize=\"true\"",
        )
}

/// A variable as an element of XML.
fn line(variable: &Variable) -> String {
    let Variable {
        name,
        reference,
        about,
        ..
    } = variable;
    format!(
        "    <ScalarVariable name=\"{name}\" valueReference=\"{reference}\" description=\"{}\" {}><Real {}/></ScalarVariable>\n",
        escaped(about),
        variable.kind(),
        variable.details()
    )
}

/// Which variables are outputs, rates and unknown at first, and what they depend on.
fn structure(variables: &[Variable]) -> String {
    let element = |(k, variable): (usize, &Variable)| {
        let from: Vec<String> = variable
            .from
            .iter()
            .map(|&r| place(r).to_string())
            .collect();
        format!(
            "    <Unknown index=\"{}\" dependencies=\"{}\"/>\n",
            k + 1,
            from.join(" ")
        )
    };
    let group = |section: &str, belongs: fn(&Variable) -> bool| {
        let lines = variables.iter().enumerate().filter(|(_, v)| belongs(v));
        let lines: String = lines.map(element).collect();
        format!("    <{section}>\n{lines}    </{section}>\n")
    };
    [
        "  <ModelStructure>\n".into(),
        group("Outputs", Variable::is_output),
        group("Derivatives", Variable::is_rate),
        group("InitialUnknowns", Variable::is_initially_unknown),
        "  </ModelStructure>\n".into(),
    ]
    .concat()
}

/// Text as the value of an attribute.
fn escaped(text: &str) -> String {
    lagrangian::shown(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
