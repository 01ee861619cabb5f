//! The colours of a GIF.

use std::cmp::Reverse;
use std::collections::HashMap;

use resvg::tiny_skia::Pixmap;

/// The palette's transparent entry.
pub(super) const CLEAR: u8 = 255;

type Colour = [u8; 3];

/// The most frequent 255 colours of some pictures, and one for transparency.
pub(super) struct Palette {
    colours: Vec<Colour>,
    /// Cache of the nearest entries of colours.
    nearest: HashMap<Colour, u8>,
}

impl Palette {
    pub(super) fn of(pictures: &[Pixmap]) -> Self {
        let mut counts: HashMap<Colour, usize> = HashMap::new();
        for colour in pictures.iter().flat_map(colours) {
            *counts.entry(colour).or_default() += 1;
        }
        let mut counts: Vec<_> = counts.into_iter().collect();
        counts.sort_by_key(|(colour, count)| (Reverse(*count), *colour));
        let commonest = counts.into_iter().take(usize::from(CLEAR));
        Self {
            colours: commonest.map(|(colour, _)| colour).collect(),
            nearest: HashMap::new(),
        }
    }

    /// The palette as 256 entries of three bytes.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.colours.concat();
        bytes.resize(3 * 256, 0);
        bytes
    }

    /// The index of the entry for every pixel.
    pub(super) fn indices(&mut self, picture: &Pixmap) -> Vec<u8> {
        let Self {
            colours: entries,
            nearest,
        } = self;
        let index = |colour| {
            *nearest
                .entry(colour)
                .or_insert_with(|| nearest_entry(entries, colour))
        };
        colours(picture).map(index).collect()
    }
}

/// The colours of the pixels of an opaque picture.
fn colours(picture: &Pixmap) -> impl Iterator<Item = Colour> {
    picture
        .pixels()
        .iter()
        .map(|pixel| [pixel.red(), pixel.green(), pixel.blue()])
}

fn nearest_entry(entries: &[Colour], colour: Colour) -> u8 {
    let distance = |entry: &Colour| -> i32 {
        let differences = entry
            .iter()
            .zip(colour)
            .map(|(a, b)| i32::from(*a) - i32::from(b));
        differences.map(|d| d * d).sum()
    };
    let nearest = (0..entries.len()).min_by_key(|&k| distance(&entries[k]));
    nearest.unwrap_or(0) as u8
}
