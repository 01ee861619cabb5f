//! The description of a unit in XML: its variables with their units and dependencies, and its sources.

use std::fmt::Write;

use super::Fmu;
use crate::{Call, Drive, Interface};

/// A variable of the unit.
#[derive(Default)]
struct Variable {
    name: String,
    reference: usize,
    /// Empty if unknown.
    unit: &'static str,
    about: String,
    causality: &'static str,
    /// `exact` for states, `calculated` for quantities that follow from them, empty for others.
    initial: &'static str,
    /// The initial value of inputs and states.
    start: Option<f64>,
    /// The reference of the state that it is the derivative of.
    rate_of: Option<usize>,
    /// The references of the variables that it depends on.
    from: Vec<usize>,
}

impl Variable {
    /// The variable as an XML element.
    fn line(&self) -> String {
        let attribute = |name: &str, value: Option<String>| {
            value.map_or(String::new(), |value| format!(" {name}=\"{value}\""))
        };
        let word = |text: &str| Some(text.to_string()).filter(|text| !text.is_empty());
        format!(
            "    <ScalarVariable name=\"{}\" valueReference=\"{}\" description=\"{}\" causality=\"{}\" \
             variability=\"continuous\"{}><Real{}{}{}/></ScalarVariable>\n",
            self.name,
            self.reference,
            escaped(&self.about),
            self.causality,
            attribute("initial", word(self.initial)),
            attribute("unit", word(self.unit)),
            attribute("start", self.start.map(|x| format!("{x:?}"))),
            attribute("derivative", self.rate_of.map(|of| place(of).to_string())),
        )
    }
}

/// The index of a variable in the list, from 1: its reference plus one, except for variables after a scalar that the model lacks,
/// on which no other variable depends.
fn place(reference: usize) -> usize {
    reference + 1
}

/// The time and the inputs.
fn inputs(interface: &Interface) -> Vec<Variable> {
    let mut all = vec![Variable {
        name: "time".into(),
        unit: "s",
        about: "time".into(),
        causality: "independent",
        ..Variable::default()
    }];
    let joints = interface.joints.iter().enumerate();
    all.extend(joints.take(interface.inputs()).map(|(i, joint)| {
        let (unit, about) = match interface.drive {
            Drive::Forces => (joint.unit.force(), format!("force on {}", joint.name)),
            Drive::Inputs(_) => (
                "",
                format!("input {} of the actuators, in the unit of the data", i + 1),
            ),
        };
        Variable {
            name: format!("tau[{}]", i + 1),
            reference: 1 + i,
            unit,
            about,
            causality: "input",
            start: Some(0.0),
            ..Variable::default()
        }
    }));
    all
}

/// All variables. The generated adapter uses the same order of references.
fn variables(interface: &Interface) -> Vec<Variable> {
    let n = interface.joints.len();
    let q = 1 + interface.inputs();
    let qd = q + n;
    let joints = || interface.joints.iter().enumerate();
    let mut all = inputs(interface);
    for (k, (name, what)) in [("q", "position"), ("qd", "velocity")]
        .into_iter()
        .enumerate()
    {
        all.extend(joints().map(|(i, joint)| Variable {
            name: format!("{name}[{}]", i + 1),
            reference: q + k * n + i,
            unit: joint.unit.rate(k),
            about: format!("{what} of {}", joint.name),
            causality: "output",
            initial: "exact",
            start: Some(interface.start[k * n + i]),
            from: vec![q + k * n + i],
            ..Variable::default()
        }));
    }
    all.extend(joints().map(|(i, joint)| Variable {
        name: format!("der(q[{}])", i + 1),
        reference: qd + n + i,
        unit: joint.unit.rate(1),
        about: format!("velocity of {}, as the rate of its position", joint.name),
        causality: "local",
        initial: "calculated",
        rate_of: Some(q + i),
        from: vec![qd + i],
        ..Variable::default()
    }));
    all.extend(joints().map(|(i, joint)| Variable {
        name: format!("qdd[{}]", i + 1),
        reference: qd + 2 * n + i,
        unit: joint.unit.rate(2),
        about: format!("acceleration of {}", joint.name),
        causality: "output",
        initial: "calculated",
        rate_of: Some(qd + i),
        from: (1..qd + n).collect(),
        ..Variable::default()
    }));
    // References stay reserved for scalars that the model lacks.
    let scalars = [(Call::Energy, "J"), (Call::DistanceFromData, "1")];
    let scalars = scalars.into_iter().enumerate();
    let scalars = scalars.filter(|(_, (call, _))| interface.has(*call));
    all.extend(scalars.map(|(k, (call, unit))| Variable {
        name: call.name().into(),
        reference: qd + 3 * n + k,
        unit,
        about: call.about().into(),
        causality: "output",
        initial: "calculated",
        from: (q..q + 2 * n).collect(),
        ..Variable::default()
    }));
    all
}

/// The units of the variables, by exponents of the base units.
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
        text += &variable.line();
    }
    text += "  </ModelVariables>\n";
    text += &structure(&variables);
    text + "</fmiModelDescription>\n"
}

/// The kinds of simulation that the unit supports, its capabilities in each, and the sources to compile.
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

/// Outputs, derivatives and initial unknowns among the variables, and their dependencies.
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
        group("Outputs", |v| v.causality == "output"),
        group("Derivatives", |v| v.rate_of.is_some()),
        group("InitialUnknowns", |v| v.initial == "calculated"),
        "  </ModelStructure>\n".into(),
    ]
    .concat()
}

/// A text as the value of an attribute.
fn escaped(text: &str) -> String {
    lagrangian::text::shown(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
