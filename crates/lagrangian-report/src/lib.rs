//! What a run found, and how it is drawn.
//!
//! [`Report`] holds what a page says as plain data: headline numbers, figures, heat maps, animations, tables, settings
//! and the commands that make it again. [`draw`] makes a page of one file, an SVG, a PNG or a GIF of it.

mod content;
pub mod draw;

pub use content::*;
