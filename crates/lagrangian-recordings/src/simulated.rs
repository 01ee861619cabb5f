//! Facts about motions beside their columns: the system that generated them, and the reference of the angles of its links.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The known system that generated the motions of a file, so that a learned model can be compared with it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Simulated {
    /// The name of the system, as in `analytic::systems`, or of the robot.
    pub name: String,
    /// Viscous friction on every coordinate, N·m·s/rad or N·s/m.
    #[serde(default)]
    pub friction: f64,
    /// The parameters that differ from the table of systems.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, f64>,
    /// For a robot: the part of its URDF that dynamics needs, as in `RigidBodies::urdf`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub urdf: Option<String>,
    /// For a robot: the joints that moved, in the order of the coordinates.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
}

impl Simulated {
    /// The reference of the angles of the links; `None` for a system that is not a chain of links.
    #[must_use]
    pub fn links(&self) -> Option<Links> {
        if self.urdf.is_some() {
            return None;
        }
        match self.name.as_str() {
            "pendulum" | "double-pendulum" | "n-link-pendulum" => Some(Links::Absolute),
            "two-link-arm" => Some(Links::Horizontal),
            _ => None,
        }
    }
}

/// Reference of the angles of the links of a chain.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Links {
    /// Relative to hanging down.
    #[default]
    Absolute,
    /// Relative to the previous link; the first relative to hanging down.
    Relative,
    /// Relative to the previous link; the first relative to the horizontal.
    Horizontal,
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::Layout;

    #[test]
    fn a_layout_keeps_the_system_and_the_links() {
        let system = Simulated {
            name: "two-link-arm".into(),
            friction: 0.3,
            parameters: [("length1".to_string(), 0.5)].into(),
            ..Simulated::default()
        };
        assert_eq!(system.links(), Some(Links::Horizontal));
        let layout = Layout {
            system: Some(system),
            links: Some(Links::Relative),
            ..Layout::default()
        };
        let read = Layout::from_toml(&layout.to_toml().unwrap()).unwrap();
        assert_eq!(read, layout);
        assert_eq!(Layout::default().or(read), layout);
        let robot = Simulated {
            name: "pendulum".into(),
            urdf: Some("<robot name=\"pendulum\">\n</robot>\n".into()),
            joints: vec!["shoulder".into()],
            ..Simulated::default()
        };
        // A robot of that name measures its angles by its joints.
        assert_eq!(robot.links(), None);
        let layout = Layout {
            system: Some(robot),
            ..Layout::default()
        };
        let read = Layout::from_toml(&layout.to_toml().unwrap()).unwrap();
        assert_eq!(read, layout);
        assert!(Layout::from_toml("links = \"sideways\"").is_err());
    }
}
