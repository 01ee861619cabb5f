//! The XML files of a unit: its variables, their units and how they depend on each other, and how it is compiled.

use std::fmt::Write;

use super::{Unit, Version};
use crate::interface::one_line;
use crate::{Call, Drive};

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

/// All variables, in the order of their references, which the generated adapter repeats.
fn variables(unit: &Unit<'_>) -> Vec<Variable> {
    let (joints, inputs) = (&unit.interface.joints, unit.interface.inputs());
    let n = joints.len();
    let (q, qd) = (1 + inputs, 1 + inputs + n);
    let state: Vec<usize> = (q..q + 2 * n).collect();
    let motion: Vec<usize> = (1..q + 2 * n).collect();
    let mut list = vec![Variable {
        name: "time".into(),
        reference: 0,
        unit: "s",
        about: "time".into(),
        role: Role::Time,
        from: vec![],
    }];
    let mut push = |name: String, unit, about: String, role, from: Vec<usize>| {
        let reference = list.len();
        list.push(Variable {
            name,
            reference,
            unit,
            about,
            role,
            from,
        });
    };
    for i in 0..inputs {
        let (unit, about) = match unit.interface.drive {
            Drive::Forces => (
                joints[i].unit.force(),
                format!("force on {}", joints[i].name),
            ),
            Drive::Inputs(_) => (
                "",
                format!("input {} of the actuators, in the unit of the data", i + 1),
            ),
        };
        push(format!("tau[{}]", i + 1), unit, about, Role::Input, vec![]);
    }
    for (k, (name, what)) in [("q", "position"), ("qd", "velocity")]
        .into_iter()
        .enumerate()
    {
        for (i, joint) in joints.iter().enumerate() {
            let role = Role::State {
                start: unit.interface.start[k * n + i],
            };
            let about = format!("{what} of {}", joint.name);
            push(
                format!("{name}[{}]", i + 1),
                joint.unit.rate(k),
                about,
                role,
                vec![q + k * n + i],
            );
        }
    }
    for (i, joint) in joints.iter().enumerate() {
        let role = Role::Rate {
            of: q + i,
            output: false,
        };
        let about = format!("velocity of {}, as the rate of its position", joint.name);
        push(
            format!("der(q[{}])", i + 1),
            joint.unit.rate(1),
            about,
            role,
            vec![qd + i],
        );
    }
    for (i, joint) in joints.iter().enumerate() {
        let role = Role::Rate {
            of: qd + i,
            output: true,
        };
        let about = format!("acceleration of {}", joint.name);
        push(
            format!("qdd[{}]", i + 1),
            joint.unit.rate(2),
            about,
            role,
            motion.clone(),
        );
    }
    // The references of both are kept free where the model lacks them.
    let (energy, next) = (qd + 3 * n, qd + 3 * n + 1);
    let scalars = [
        (Call::Energy, "energy", energy, "J"),
        (Call::DistanceFromData, "distance_from_data", next, "1"),
    ];
    for (call, name, reference, unit_name) in scalars {
        if unit.interface.has(call) {
            list.push(Variable {
                name: name.into(),
                reference,
                unit: unit_name,
                about: call.about().into(),
                role: Role::Output,
                from: state.clone(),
            });
        }
    }
    list
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
pub(super) fn model(unit: &Unit<'_>, compiled: bool) -> String {
    let variables = variables(unit);
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
fn kinds(unit: &Unit<'_>) -> String {
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
pub(super) fn build(unit: &Unit<'_>) -> String {
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
    one_line(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
