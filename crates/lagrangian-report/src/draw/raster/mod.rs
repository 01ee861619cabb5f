//! Bitmaps: figures as PNG and animations as GIF, rendered from the drawings of pages.

mod bitmap;
mod error;
mod gif;
mod palette;
mod pendulum;
mod png;

pub use error::{Error, Result};
pub use gif::gif;
pub use png::png;
