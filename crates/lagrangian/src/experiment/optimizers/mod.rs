//! Which optimiser reaches which error in which time: recipes of training on two tasks, all by the same clock.
//!
//! | symbol | meaning |
//! |---|---|
//! | λ | damping of the natural gradient |
//! | μ | momentum |
//! | η | rate, falling to 0 by a cosine |
//! | share | of the budget, 0…1; all schedules follow it |

mod descent;
mod engine;
mod kfac;
mod matrix;
mod recipe;
mod soap;
mod task;

pub use descent::{LOOKS, Limit, Look, Run, descend};
pub use recipe::{Batch, Damping, Group, Method, RECIPES, Recipe};
pub use task::Task;
