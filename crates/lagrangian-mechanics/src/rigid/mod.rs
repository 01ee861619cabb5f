//! Rigid bodies in a tree on a fixed base, from URDF: the exact Lagrangian of a robot arm.
//!
//! ```
//! use lagrangian_mechanics::Quantities;
//! use lagrangian_mechanics::rigid::{self, RigidBodies};
//! use lagrangian_mechanics::rollout::{free, times};
//! use lagrangian_mechanics::{RolloutOptions, rollout};
//!
//! let arm = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap_or_default())?;
//! let loaded = arm.clone().with_payload("link_7", 1.5, [0.0, 0.0, 0.1])?;
//!
//! // Held out sideways, its shoulder feels 1.5 kg more.
//! let (q, rest) = ([0.0, 1.57, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 7]);
//! let (empty, full) = (Quantities::gravity(&arm, &q)?, Quantities::gravity(&loaded, &q)?);
//! assert!(full[1].abs() > empty[1].abs() + 10.0);
//!
//! // It is a model like any other.
//! let motion = rollout(&arm, &q, &rest, &times(0.1, 0.01)?, &free, &RolloutOptions::default())?;
//! assert!(motion.outcome.is_finished());
//! # Ok::<(), lagrangian_motion::Error>(())
//! ```

mod bodies;
pub mod changes;
pub mod consistent;
mod dynamics;
pub(crate) mod edited_urdf;
mod excitation;
mod expression;
pub mod joint_sums;
mod limits;
mod load;
mod load_sums;
pub mod placement;
mod plausible;
pub mod regressor;
mod robot_config;
mod robots;
pub mod screws;
mod skeleton;
pub mod spatial;
mod starts;
mod text_edits;
mod tree;
mod urdf;

pub use bodies::{GRAVITY, RigidBodies};
pub use changes::{Changes, PartChange, Quantity};
pub use dynamics::RigidDynamics;
pub use excitation::{Excitation, ExcitationConfig, SearchProgress, excite, excite_joints};
pub use limits::JointLimits;
pub use load::{LinkLoad, LoadParameters, is_body};
pub use load_sums::{LoadPrior, LoadSums};
pub use robot_config::RobotConfig;
pub use robot_config::RobotShape;
pub use robots::{EXAMPLES, example};
pub use skeleton::Skeleton;
pub use tree::MAX_JOINTS;
pub use urdf::JointKind;
