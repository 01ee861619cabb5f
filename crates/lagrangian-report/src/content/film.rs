//! Pictures that follow each other, side by side, as plain data.

use serde::{Deserialize, Serialize};

/// Films of equal size that play together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Film {
    /// Height, width and colours (1 or 3) of a picture.
    pub shape: [usize; 3],
    /// The time between two pictures, s.
    pub step: f64,
    /// The names of the films.
    pub names: Vec<String>,
    /// The bytes of their pictures in base64, `[pictures, height, width, colours]` each.
    pub pictures: Vec<String>,
    /// The name of the difference of the first two films; empty to show none.
    pub difference: String,
}
