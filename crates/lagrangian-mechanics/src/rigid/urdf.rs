//! The part of a URDF description that dynamics needs: links with their inertia, joints with their place and axis.
//!
//! Meshes, colours, transmissions and the sections of simulators are ignored.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use roxmltree::{Document, Node, ParsingOptions};

use super::plausible;
use super::spatial::{Frame, Vec3};
use lagrangian_motion::error::{brief, shortened};
use lagrangian_motion::{Error, Result, is_hidden, shown};

/// Maximum length of a description, bytes.
const MAX_TEXT: usize = 8 << 20;
/// Maximum number of XML nodes of a description.
const MAX_NODES: u32 = 200_000;
/// Maximum nesting depth of XML elements; URDF needs five.
const MAX_DEPTH: usize = 64;
/// Maximum number of attributes of an element, which a parser compares with one another; URDF needs six.
const MAX_ATTRIBUTES: usize = 256;

/// Kind of motion of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis, between limits.
    Revolute,
    /// Turns about its axis without end.
    Continuous,
    /// Slides along its axis.
    Prismatic,
    /// Does not move.
    Fixed,
    /// Moves in all six directions.
    Floating,
    /// Slides in a plane.
    Planar,
}

impl JointKind {
    const NAMES: [(&'static str, Self); 6] = [
        ("revolute", Self::Revolute),
        ("continuous", Self::Continuous),
        ("prismatic", Self::Prismatic),
        ("fixed", Self::Fixed),
        ("floating", Self::Floating),
        ("planar", Self::Planar),
    ];

    /// Name in URDF.
    #[must_use]
    pub fn name(self) -> &'static str {
        let own = Self::NAMES.into_iter().find(|(_, kind)| *kind == self);
        own.map_or("", |(name, _)| name)
    }
}

/// Mass and inertia of a link, in the form of URDF.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inertial {
    pub(crate) xyz: Vec3,
    pub(crate) rpy: Vec3,
    pub(crate) mass: f64,
    /// xx, xy, xz, yy, yz, zz about the centre of mass.
    pub(crate) inertia: [f64; 6],
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Link {
    pub(crate) name: String,
    pub(crate) inertial: Option<Inertial>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Joint {
    pub(crate) name: String,
    pub(crate) kind: JointKind,
    pub(crate) xyz: Vec3,
    pub(crate) rpy: Vec3,
    pub(crate) axis: Vec3,
    /// Indices of links.
    pub(crate) parent: usize,
    pub(crate) child: usize,
    /// Joint that this one follows.
    pub(crate) mimic: Option<String>,
    /// Viscous and Coulomb friction.
    pub(crate) damping: f64,
    pub(crate) friction: f64,
}

impl Joint {
    pub(crate) fn frame(&self) -> Frame {
        Frame::new(self.xyz, self.rpy)
    }
}

/// A robot in the form of URDF: links and joints, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Description {
    pub(crate) name: String,
    pub(crate) links: Vec<Link>,
    pub(crate) joints: Vec<Joint>,
}

pub(crate) fn unusable(finding: impl Into<String>, remedy: &'static str) -> Error {
    Error::Robot {
        finding: brief(&finding.into()),
        remedy,
    }
}

impl Description {
    /// Reads URDF.
    ///
    /// # Errors
    /// [`Error::Robot`] for text that is not URDF, names that are missing or doubled, and values that are not numbers.
    pub(crate) fn read(text: &str) -> Result<Self> {
        let document = document(text)?;
        let robot = document.root_element();
        let links: Vec<Link> = children(robot, "link").map(link).collect::<Result<_>>()?;
        let mut index = HashMap::new();
        for (i, link) in links.iter().enumerate() {
            if index.insert(link.name.as_str(), i).is_some() {
                return Err(doubled("link", &link.name));
            }
        }
        let joints = children(robot, "joint").map(|node| joint(node, &index));
        let joints: Vec<Joint> = joints.collect::<Result<_>>()?;
        let mut names = HashSet::new();
        if let Some(joint) = joints.iter().find(|joint| !names.insert(&joint.name)) {
            return Err(doubled("joint", &joint.name));
        }
        Ok(Self {
            name: shown(robot.attribute("name").unwrap_or("robot")),
            joints,
            links,
        })
    }

    /// URDF of the parsed description: equal descriptions give equal text, and numbers keep every bit.
    pub(crate) fn text(&self) -> String {
        let mut out = format!("<robot name=\"{}\">\n", escaped(&self.name));
        for link in &self.links {
            let name = escaped(&link.name);
            let Some(i) = &link.inertial else {
                // Writing to a String cannot fail.
                let _ = writeln!(out, "  <link name=\"{name}\"/>");
                continue;
            };
            let [xx, xy, xz, yy, yz, zz] = i.inertia;
            let _ = writeln!(
                out,
                "  <link name=\"{name}\">\n    <inertial>\n      <origin xyz=\"{}\" rpy=\"{}\"/>\n      <mass value=\"{}\"/>\n      \
                 <inertia ixx=\"{xx}\" ixy=\"{xy}\" ixz=\"{xz}\" iyy=\"{yy}\" iyz=\"{yz}\" izz=\"{zz}\"/>\n    </inertial>\n  </link>",
                list(i.xyz),
                list(i.rpy),
                i.mass,
            );
        }
        for joint in &self.joints {
            let _ = writeln!(
                out,
                "  <joint name=\"{}\" type=\"{}\">\n    <origin xyz=\"{}\" rpy=\"{}\"/>\n    <parent link=\"{}\"/>\n    \
                 <child link=\"{}\"/>\n    <axis xyz=\"{}\"/>",
                escaped(&joint.name),
                joint.kind.name(),
                list(joint.xyz),
                list(joint.rpy),
                escaped(&self.links[joint.parent].name),
                escaped(&self.links[joint.child].name),
                list(joint.axis),
            );
            if let Some(other) = &joint.mimic {
                let _ = writeln!(out, "    <mimic joint=\"{}\"/>", escaped(other));
            }
            if joint.damping != 0.0 || joint.friction != 0.0 {
                let (damping, friction) = (joint.damping, joint.friction);
                let _ = writeln!(
                    out,
                    "    <dynamics damping=\"{damping}\" friction=\"{friction}\"/>"
                );
            }
            out.push_str("  </joint>\n");
        }
        out.push_str("</robot>\n");
        out
    }
}

/// The XML of a URDF text.
///
/// # Errors
/// [`Error::Robot`] for text that is too long, nests too deep, is not XML, or is not a `robot`.
pub(super) fn document(text: &str) -> Result<Document<'_>> {
    if text.len() > MAX_TEXT {
        let finding = format!("{} bytes of text, where {MAX_TEXT} is the most", text.len());
        return Err(unusable(
            finding,
            "give the URDF alone, meshes stay in files of their own",
        ));
    }
    check_depth(text)?;
    check_attributes(text)?;
    let options = ParsingOptions {
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|e| {
        if text.contains("<xacro:") {
            return unexpanded("<xacro:…>");
        }
        unusable(
            format!("not XML: {e}"),
            "give a URDF file (expand xacro first)",
        )
    })?;
    let robot = document.root_element();
    let is_macro = |node: &Node<'_, '_>| {
        let namespace = node.tag_name().namespace();
        node.is_element() && namespace.is_some_and(|name| name.contains("xacro"))
    };
    if let Some(node) = robot.descendants().find(is_macro) {
        let name = node.tag_name().name();
        return Err(unexpanded(&format!("<xacro:{}>", shortened(name))));
    }
    let is_plain = robot.tag_name().namespace() == robot.default_namespace();
    if robot.tag_name().name() != "robot" || !is_plain {
        let tag = &text[robot.range().start + 1..];
        let tag = tag.split(|c: char| c.is_whitespace() || c == '>').next();
        let finding = format!(
            "the outermost element is <{}>, not <robot>",
            tag.unwrap_or_default()
        );
        return Err(unusable(
            finding,
            "give a URDF file; SDF and MJCF are other formats",
        ));
    }
    Ok(document)
}

fn unexpanded(element: &str) -> Error {
    unusable(
        format!("it contains {element}, a macro that is not URDF yet"),
        "expand it first: `xacro robot.urdf.xacro > robot.urdf`",
    )
}

/// Returns an error for an element with more attributes than any of URDF. Counts equals signs between `<` and `>`, even in values.
fn check_attributes(text: &str) -> Result<()> {
    let mut count = 0_usize;
    for byte in text.bytes() {
        match byte {
            b'<' | b'>' => count = 0,
            b'=' => count += 1,
            _ => (),
        }
        if count > MAX_ATTRIBUTES {
            let finding = format!("an element has more than {MAX_ATTRIBUTES} attributes");
            return Err(unusable(
                finding,
                "give a URDF file: its elements have six at most",
            ));
        }
    }
    Ok(())
}

/// Returns an error for text that nests deeper than any URDF, before it is parsed. Counts tags, and so may be wrong about
/// comments, but never by as much as the limit allows.
fn check_depth(text: &str) -> Result<()> {
    let (mut depth, mut deepest) = (0_usize, 0);
    let bytes = text.as_bytes();
    for (i, pair) in bytes.windows(2).enumerate() {
        match pair {
            b"</" => depth = depth.saturating_sub(1),
            b"/>" if i > 0 => depth = depth.saturating_sub(1),
            [b'<', next] if next.is_ascii_alphabetic() || *next == b'_' => depth += 1,
            _ => (),
        }
        deepest = deepest.max(depth);
    }
    if deepest <= MAX_DEPTH {
        return Ok(());
    }
    let finding = format!("elements nest {deepest} deep");
    Err(unusable(
        finding,
        "give a URDF file: its elements nest five deep",
    ))
}

fn doubled(kind: &str, name: &str) -> Error {
    unusable(
        format!("there are two {kind}s named '{name}'"),
        "give every link and every joint a name of its own",
    )
}

pub(super) fn children<'a, 'b>(
    node: Node<'a, 'b>,
    tag: &'static str,
) -> impl Iterator<Item = Node<'a, 'b>> {
    // An element of another namespace belongs to another language.
    let (own, namespace) = (node, node.tag_name().namespace());
    own.children().filter(move |n| {
        let name = n.tag_name();
        name.name() == tag && name.namespace() == namespace
    })
}

pub(super) fn child<'a, 'b>(node: Node<'a, 'b>, tag: &'static str) -> Option<Node<'a, 'b>> {
    children(node, tag).next()
}

fn name(node: Node<'_, '_>) -> Result<String> {
    match node.attribute("name") {
        Some(name) if name.contains(is_hidden) => Err(unusable(
            format!("the name '{name}' has characters that cannot be seen"),
            "rename it with letters, digits and underscores",
        )),
        Some(name) if !name.is_empty() => Ok(name.into()),
        _ => Err(unusable(
            format!("a <{}> has no name", node.tag_name().name()),
            "name every link and every joint",
        )),
    }
}

fn link(node: Node<'_, '_>) -> Result<Link> {
    let name = name(node)?;
    let of = format!("link '{name}'");
    let inertial = child(node, "inertial").map(|node| inertial(node, &of));
    Ok(Link {
        inertial: inertial.transpose()?,
        name,
    })
}

fn inertial(node: Node<'_, '_>, of: &str) -> Result<Inertial> {
    let Some(mass) = child(node, "mass") else {
        let finding = format!("{of} has an <inertial> without <mass>");
        return Err(unusable(finding, "state its mass"));
    };
    let [mass] = numbers(mass, "value", of)?;
    let mut inertia = [0.0; 6];
    let keys = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
    for (value, key) in inertia.iter_mut().zip(keys) {
        [*value] = optional(child(node, "inertia"), key, of)?;
    }
    let inertial = Inertial {
        xyz: optional(child(node, "origin"), "xyz", of)?,
        rpy: optional(child(node, "origin"), "rpy", of)?,
        mass,
        inertia,
    };
    plausible::inertial(&inertial, of)?;
    Ok(inertial)
}

fn joint(node: Node<'_, '_>, links: &HashMap<&str, usize>) -> Result<Joint> {
    let name = name(node)?;
    let of = format!("joint '{name}'");
    let kind = node.attribute("type").unwrap_or("");
    let Some((_, kind)) = JointKind::NAMES
        .into_iter()
        .find(|(known, _)| *known == kind)
    else {
        return Err(unusable(
            format!("{of} is of type '{kind}'"),
            "use revolute, continuous, prismatic or fixed joints",
        ));
    };
    let end = |tag: &'static str| -> Result<usize> {
        let name = child(node, tag)
            .and_then(|n| n.attribute("link"))
            .unwrap_or("");
        let found = links.get(name).copied();
        found.ok_or_else(|| {
            unusable(
                format!("the {tag} of {of} is '{name}', which is not a link of the file"),
                "name a link of the file",
            )
        })
    };
    let axis = match child(node, "axis") {
        Some(axis) => numbers(axis, "xyz", &of)?,
        None => [1.0, 0.0, 0.0],
    };
    let [damping] = optional(child(node, "dynamics"), "damping", &of)?;
    let [friction] = optional(child(node, "dynamics"), "friction", &of)?;
    plausible::friction(damping, friction, &of)?;
    let limit = |key| optional_number(child(node, "limit"), key, &of);
    plausible::limits(kind, limit("lower")?, limit("upper")?, &of)?;
    let xyz = optional(child(node, "origin"), "xyz", &of)?;
    let rpy = optional(child(node, "origin"), "rpy", &of)?;
    plausible::place(xyz, rpy, &of)?;
    Ok(Joint {
        kind,
        xyz,
        rpy,
        axis,
        parent: end("parent")?,
        child: end("child")?,
        mimic: child(node, "mimic").map(|m| m.attribute("joint").unwrap_or("").into()),
        damping,
        friction,
        name,
    })
}

/// The numbers of an attribute; 0 if the attribute or its element is absent.
fn optional<const N: usize>(node: Option<Node<'_, '_>>, key: &str, of: &str) -> Result<[f64; N]> {
    match node.filter(|n| n.has_attribute(key)) {
        Some(node) => numbers(node, key, of),
        None => Ok([0.0; N]),
    }
}

/// The number of an attribute, if the attribute and its element are present.
pub(super) fn optional_number(
    node: Option<Node<'_, '_>>,
    key: &str,
    of: &str,
) -> Result<Option<f64>> {
    let present = node.filter(|node| node.has_attribute(key));
    let number = present.map(|node| numbers::<1>(node, key, of));
    Ok(number.transpose()?.map(|[x]| x))
}

/// The `N` numbers of an attribute.
fn numbers<const N: usize>(node: Node<'_, '_>, key: &str, of: &str) -> Result<[f64; N]> {
    let text = node.attribute(key).unwrap_or("");
    let number = |text: &str| match text.parse::<f64>() {
        Ok(x) if x.is_finite() && x.abs() < 1e12 => Ok(x),
        _ => Err(unusable(
            format!("{of}: {key} is '{}'", shortened(text)),
            "write a finite number in SI units (expand xacro first)",
        )),
    };
    let numbers = text.split_whitespace().map(number);
    <[f64; N]>::try_from(numbers.collect::<Result<Vec<_>>>()?).map_err(|_| {
        let finding = format!("{of}: {key} is '{}'", shortened(text));
        match N {
            1 => unusable(finding, "write one finite number in SI units"),
            _ => unusable(
                finding,
                "write three numbers in SI units, separated by spaces",
            ),
        }
    })
}

pub(super) fn list(x: Vec3) -> String {
    format!("{} {} {}", x[0], x[1], x[2])
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\r' | '\t' => out.push_str(&format!("&#{};", u32::from(c))),
            _ => out.push(c),
        }
    }
    out
}
