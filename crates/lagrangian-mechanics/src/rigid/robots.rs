//! Example robots, as URDF text; `robots/README.md` has their sources.

/// Names of the robots of [`example`].
pub const EXAMPLES: [&str; 4] = ["two_link_arm", "iiwa7", "ur5", "panda"];

/// The URDF of an example robot: `two_link_arm` (planar, vertical, upright at 0), `iiwa7`, `ur5`, `panda`.
#[must_use]
pub fn example(name: &str) -> Option<&'static str> {
    match name {
        "two_link_arm" => Some(include_str!("robots/two_link_arm.urdf")),
        "iiwa7" => Some(include_str!("robots/iiwa7.urdf")),
        "ur5" => Some(include_str!("robots/ur5.urdf")),
        "panda" => Some(include_str!("robots/panda.urdf")),
        _ => None,
    }
}
