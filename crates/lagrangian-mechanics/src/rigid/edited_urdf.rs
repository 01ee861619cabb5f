//! A robot written back into the URDF text that it was read from.
//!
//! Only `inertial` of the moving links and `dynamics` of the joints are edited. A body is all that moves with a joint:
//! a link, and all links fixed to it or locked. The fixed links keep their inertia, and the moving link has the rest of the
//! body; where that rest is not a possible body, the fixed links keep the largest part 1/2, 1/4, … that leaves one.

use roxmltree::Node;

use super::bodies::RigidBodies;
use super::consistent::is_consistent;
use super::spatial::{Frame, Inertia};
use super::text_edits::{Element, TextEdits};
use super::tree::{Place, checked};
use super::urdf::{Description, Inertial, child, children, document, unusable};
use crate::forces::Dissipation;
use lagrangian_motion::Result;

/// Number of halvings of the part that fixed links keep, before they are left without inertia.
const HALVINGS: i32 = 30;

impl RigidBodies {
    /// The URDF `text` of this robot with its inertial parameters and, where `friction` is given, viscous and Coulomb friction
    /// (`damping`, `friction`); everything else stays byte for byte.
    ///
    /// Read again, the text gives this robot except for what URDF cannot store: inertias of rotors, constant torques, springs, the speed
    /// over which Coulomb friction changes its sign, and Stribeck friction. Fixed links keep their inertia where the
    /// remainder for the moving link is a possible body, otherwise a part of it.
    ///
    /// # Errors
    /// [`lagrangian_motion::Error::Robot`] where the text is not URDF, is that of a robot with other kinematics, or a body cannot exist.
    ///
    /// ```
    /// use lagrangian_mechanics::rigid::{self, RigidBodies};
    ///
    /// let text = rigid::example("two_link_arm").unwrap_or_default();
    /// let arm = RigidBodies::from_urdf(text)?.with_payload("hand", 0.5, [0.0; 3])?;
    /// let edited = RigidBodies::from_urdf(&arm.edit_urdf(text, None)?)?;
    /// let pairs = edited.inertial_parameters().into_iter().zip(arm.inertial_parameters());
    /// assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-12));
    /// # Ok::<(), lagrangian_motion::Error>(())
    /// ```
    pub fn edit_urdf(&self, text: &str, friction: Option<&Dissipation>) -> Result<String> {
        let description = Description::read(text)?;
        let described = Self::of_description(description.clone(), self.joints())?;
        self.require_kinematics(&described)?;
        let document = document(text)?;
        let mut edits = TextEdits::of(text);
        for (body, own) in self.tree().bodies.iter().enumerate() {
            if own.inertia == described.tree().bodies[body].inertia {
                continue;
            }
            for link in self.links(body, &description)? {
                let node = named(document.root_element(), "link", &link.name);
                node.into_iter()
                    .for_each(|node| link.write(&mut edits, node));
            }
        }
        for (i, joint) in self.joints().iter().enumerate() {
            let node = named(document.root_element(), "joint", joint);
            if let (Some(node), Some(friction)) = (node, friction) {
                let values = [friction.viscous.get(i), friction.coulomb.get(i)];
                write_friction(&mut edits, node, values);
            }
        }
        Ok(edits.apply())
    }

    /// Returns an error for the text of another robot.
    fn require_kinematics(&self, other: &Self) -> Result<()> {
        let (own, other) = (self.tree(), other.tree());
        let mut pairs = own.bodies.iter().zip(&other.bodies);
        let same = own.places.len() == other.places.len()
            && pairs.all(|(a, b)| a.parent == b.parent && a.turns == b.turns && a.frame == b.frame);
        match same {
            true => Ok(()),
            false => Err(unusable(
                "the text has other kinematics than the robot that was identified",
                "give the text that the robot was read from",
            )),
        }
    }

    /// Inertias of the links of a body, which add up to the body's.
    fn links(&self, body: usize, description: &Description) -> Result<Vec<LinkInertia>> {
        let mut places = self.tree().places.iter().filter(|p| p.body == Some(body));
        let Some(moving) = places.next() else {
            return Ok(Vec::new());
        };
        let fixed = places.map(|place| Fixed::of(place, description));
        let fixed: Vec<Fixed> = fixed.filter_map(Result::transpose).collect::<Result<_>>()?;
        let sum = |sum: Inertia, fixed: &Fixed| sum.plus(&fixed.inertia);
        let carried = fixed.iter().fold(Inertia::default(), sum);
        let whole = self.tree().bodies[body].inertia;
        let rest = |part: f64| whole.plus(&carried.scaled(-part));
        let parts = (0..HALVINGS).map(|k| 0.5_f64.powi(k)).chain([0.0]);
        let mut parts = parts.filter(|part| is_consistent(&rest(*part).parameters()));
        let Some(part) = parts.next() else {
            let finding = format!("what moves with link '{}' is no body", moving.link);
            return Err(unusable(
                finding,
                "identify it as bodies of positive density",
            ));
        };
        let own = LinkInertia::moving(moving, &rest(part));
        let fixed = fixed.into_iter().filter(|_| part < 1.0);
        Ok(std::iter::once(own)
            .chain(fixed.map(|fixed| fixed.scaled(part)))
            .collect())
    }

    /// The link that moves with a body, and the links that are fixed to it.
    pub(crate) fn links_of(&self, body: usize) -> Vec<&Place> {
        let places = self.tree().places.iter();
        places.filter(|place| place.body == Some(body)).collect()
    }
}

/// Inertia in the frame of the link that carries it.
pub(crate) fn in_link(inertia: &Inertia, place: &Frame) -> Inertia {
    inertia.seen_from_parent(&place.inverse())
}

/// A link that is fixed to another, as it was described.
struct Fixed {
    name: String,
    inertial: Inertial,
    /// Inertia in the frame of the body.
    inertia: Inertia,
}

impl Fixed {
    /// `None` for a link without inertia.
    fn of(place: &Place, description: &Description) -> Result<Option<Self>> {
        let link = description.links.iter().find(|l| l.name == place.link);
        let inertial = link.and_then(|link| link.inertial);
        let fixed = |inertial: Inertial| -> Result<Self> {
            let inertia = checked(&inertial, &place.link)?.seen_from_parent(&place.frame);
            let name = place.link.clone();
            Ok(Self {
                name,
                inertial,
                inertia,
            })
        };
        inertial.filter(|i| i.mass > 0.0).map(fixed).transpose()
    }

    fn scaled(self, part: f64) -> LinkInertia {
        let Inertial { mass, inertia, .. } = self.inertial;
        LinkInertia {
            name: self.name,
            mass: part * mass,
            inertia: inertia.map(|x| part * x),
            centre: None,
        }
    }
}

/// The values that are written for a link.
struct LinkInertia {
    name: String,
    mass: f64,
    /// Inertia about the centre of mass.
    inertia: [f64; 6],
    /// Centre of mass, if it changes too; the inertia is then in the axes of the link.
    centre: Option<[f64; 3]>,
}

impl LinkInertia {
    fn moving(place: &Place, inertia: &Inertia) -> Self {
        let own = in_link(inertia, &place.frame);
        Self {
            name: place.link.clone(),
            mass: own.mass,
            inertia: own.about_own_centre(),
            centre: Some(own.centre()),
        }
    }

    fn write(&self, edits: &mut TextEdits<'_>, link: Node<'_, '_>) {
        let mass = vec![("value", number(self.mass))];
        let keys = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
        let inertia = keys.into_iter().zip(self.inertia.map(number)).collect();
        let origin = |centre: [f64; 3]| {
            let xyz = centre.map(number).join(" ");
            vec![("xyz", xyz), ("rpy", "0 0 0".into())]
        };
        let centre = self.centre.map(|centre| ("origin", origin(centre)));
        let parts = centre
            .into_iter()
            .chain([("mass", mass), ("inertia", inertia)]);
        match child(link, "inertial") {
            Some(inertial) => {
                parts.for_each(|(tag, attributes)| write_element(edits, inertial, tag, attributes))
            }
            None => {
                let children = parts.map(|(tag, attributes)| Element::new(tag, attributes));
                let inertial = Element {
                    children: children.collect(),
                    ..Element::new("inertial", Vec::new())
                };
                edits.insert(link, &inertial);
            }
        }
    }
}

/// Writes an element, or updates the existing one, which keeps its other attributes and equal numbers.
fn write_element(
    edits: &mut TextEdits<'_>,
    parent: Node<'_, '_>,
    tag: &'static str,
    attributes: Vec<(&'static str, String)>,
) {
    let Some(node) = child(parent, tag) else {
        return edits.insert(parent, &Element::new(tag, attributes));
    };
    for (key, value) in attributes {
        let old = node.attribute(key);
        let absent = if key == "rpy" { "0 0 0" } else { "" };
        if numbers(old.unwrap_or(absent)) != numbers(&value) {
            edits.set(node, key, &value);
        }
    }
}

/// Words of the text that are numbers.
fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().flat_map(str::parse).collect()
}

fn write_friction(edits: &mut TextEdits<'_>, joint: Node<'_, '_>, values: [Option<&f64>; 2]) {
    let named = ["damping", "friction"].into_iter().zip(values);
    let attributes = named.filter_map(|(key, value)| Some((key, number(*value?))));
    write_element(edits, joint, "dynamics", attributes.collect());
}

/// The element of this tag and name.
fn named<'a, 'b>(robot: Node<'a, 'b>, tag: &'static str, name: &str) -> Option<Node<'a, 'b>> {
    children(robot, tag).find(|node| node.attribute("name") == Some(name))
}

/// A number that is read back to the bit.
fn number(x: f64) -> String {
    match x.abs() {
        size if size == 0.0 || (1e-5..1e9).contains(&size) => format!("{x}"),
        _ => format!("{x:e}"),
    }
}
