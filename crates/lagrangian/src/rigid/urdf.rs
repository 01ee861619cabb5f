//! The part of a URDF description that dynamics needs: links with their inertia, joints with their place and axis.
//!
//! Meshes, colours, transmissions and the sections of simulators are ignored.

use std::collections::HashMap;
use std::fmt::Write;

use roxmltree::{Document, Node, ParsingOptions};

use super::spatial::{Frame, Vec3};
use crate::{Error, Result};

/// The longest description that is read, bytes.
const MAX_TEXT: usize = 8 << 20;
/// The most XML nodes of a description.
const MAX_NODES: u32 = 200_000;
/// The deepest nesting of XML elements: URDF needs five.
const MAX_DEPTH: usize = 64;

/// How a joint moves.
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

    /// Its name in URDF.
    #[must_use]
    pub fn name(self) -> &'static str {
        let own = Self::NAMES.into_iter().find(|(_, kind)| *kind == self);
        own.map_or("", |(name, _)| name)
    }
}

/// Mass and inertia of a link, as URDF gives them.
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
    /// The joint that this one follows.
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

/// A robot as its URDF describes it: links and joints, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Description {
    pub(crate) name: String,
    pub(crate) links: Vec<Link>,
    pub(crate) joints: Vec<Joint>,
}

pub(crate) fn unusable(finding: impl Into<String>, remedy: &'static str) -> Error {
    Error::Robot {
        finding: finding.into(),
        remedy,
    }
}

impl Description {
    /// Reads URDF.
    ///
    /// # Errors
    /// [`Error::Robot`] for text that is not URDF, names that are missing or doubled, and values that are not numbers.
    pub(crate) fn read(text: &str) -> Result<Self> {
        if text.len() > MAX_TEXT {
            let finding = format!("{} bytes of text, where {MAX_TEXT} is the most", text.len());
            return Err(unusable(
                finding,
                "give the URDF alone, meshes stay in files of their own",
            ));
        }
        check_depth(text)?;
        let options = ParsingOptions {
            nodes_limit: MAX_NODES,
            ..ParsingOptions::default()
        };
        let document = Document::parse_with_options(text, options).map_err(|e| {
            unusable(
                format!("not XML: {e}"),
                "give a URDF file (expand xacro first)",
            )
        })?;
        let robot = document.root_element();
        if robot.tag_name().name() != "robot" {
            let finding = format!(
                "the outermost element is <{}>, not <robot>",
                robot.tag_name().name()
            );
            return Err(unusable(
                finding,
                "give a URDF file; SDF and MJCF are other formats",
            ));
        }
        let links: Vec<Link> = children(robot, "link").map(link).collect::<Result<_>>()?;
        let mut index = HashMap::new();
        for (i, link) in links.iter().enumerate() {
            if index.insert(link.name.as_str(), i).is_some() {
                return Err(doubled("link", &link.name));
            }
        }
        let mut joints = Vec::new();
        let mut names = HashMap::new();
        for node in children(robot, "joint") {
            let joint = joint(node, &index)?;
            if names.insert(joint.name.clone(), ()).is_some() {
                return Err(doubled("joint", &joint.name));
            }
            joints.push(joint);
        }
        Ok(Self {
            name: robot.attribute("name").unwrap_or("robot").into(),
            joints,
            links,
        })
    }

    /// URDF of what was read and no more: equal descriptions give equal text, and numbers keep every bit.
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

/// Refuses text that nests deeper than any URDF before a parser follows it. Counts tags, so that it may be wrong about
/// comments, never by as much as the limit allows.
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

fn children<'a, 'b>(node: Node<'a, 'b>, tag: &'static str) -> impl Iterator<Item = Node<'a, 'b>> {
    node.children().filter(move |n| n.tag_name().name() == tag)
}

fn child<'a, 'b>(node: Node<'a, 'b>, tag: &'static str) -> Option<Node<'a, 'b>> {
    children(node, tag).next()
}

fn name(node: Node<'_, '_>) -> Result<String> {
    match node.attribute("name") {
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
    let inertial = match child(node, "inertial") {
        None => None,
        Some(inertial) => {
            let (xyz, rpy) = origin(inertial, &of)?;
            let mass = match child(inertial, "mass") {
                Some(mass) => number(mass, "value", &of)?,
                None => {
                    return Err(unusable(
                        format!("{of} has an <inertial> without <mass>"),
                        "state its mass",
                    ));
                }
            };
            let second = child(inertial, "inertia");
            let mut inertia = [0.0; 6];
            for (value, key) in inertia
                .iter_mut()
                .zip(["ixx", "ixy", "ixz", "iyy", "iyz", "izz"])
            {
                *value = match second {
                    Some(node) if node.has_attribute(key) => number(node, key, &of)?,
                    _ => 0.0,
                };
            }
            Some(Inertial {
                xyz,
                rpy,
                mass,
                inertia,
            })
        }
    };
    Ok(Link { name, inertial })
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
    let (xyz, rpy) = origin(node, &of)?;
    let axis = match child(node, "axis") {
        Some(axis) => vector(axis, "xyz", &of)?,
        None => [1.0, 0.0, 0.0],
    };
    let coefficient = |key: &str| match child(node, "dynamics") {
        Some(dynamics) if dynamics.has_attribute(key) => number(dynamics, key, &of),
        _ => Ok(0.0),
    };
    Ok(Joint {
        kind,
        xyz,
        rpy,
        axis,
        parent: end("parent")?,
        child: end("child")?,
        mimic: child(node, "mimic").map(|m| m.attribute("joint").unwrap_or("").into()),
        damping: coefficient("damping")?,
        friction: coefficient("friction")?,
        name,
    })
}

/// `xyz` and `rpy` of the node's `origin`; 0 where they are absent.
fn origin(node: Node<'_, '_>, of: &str) -> Result<(Vec3, Vec3)> {
    let Some(origin) = child(node, "origin") else {
        return Ok(([0.0; 3], [0.0; 3]));
    };
    let vector = |key| match origin.has_attribute(key) {
        true => vector(origin, key, of),
        false => Ok([0.0; 3]),
    };
    Ok((vector("xyz")?, vector("rpy")?))
}

fn vector(node: Node<'_, '_>, key: &str, of: &str) -> Result<Vec3> {
    let text = node.attribute(key).unwrap_or("");
    let numbers: Vec<f64> = text
        .split_whitespace()
        .map(|t| value(t, key, of))
        .collect::<Result<_>>()?;
    <[f64; 3]>::try_from(numbers).map_err(|_| {
        let finding = format!("{of}: {key}=\"{}\" is not three numbers", shortened(text));
        unusable(finding, "give x, y and z, separated by spaces")
    })
}

fn number(node: Node<'_, '_>, key: &str, of: &str) -> Result<f64> {
    value(node.attribute(key).unwrap_or(""), key, of)
}

fn value(text: &str, key: &str, of: &str) -> Result<f64> {
    match text.trim().parse::<f64>() {
        Ok(x) if x.is_finite() && x.abs() < 1e12 => Ok(x),
        _ => Err(unusable(
            format!("{of}: {key} is '{}'", shortened(text)),
            "write a finite number in SI units (expand xacro first)",
        )),
    }
}

fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

fn list(x: Vec3) -> String {
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
