//! Results of a run and their drawings.
//!
//! [`Report`] holds the contents of a page as plain data: headline numbers, figures, heat maps, animations, tables, settings
//! and the commands that reproduce it. [`draw`] turns it into a page of one file, an SVG, a PNG or a GIF.

mod content;
pub mod draw;

pub use content::*;
