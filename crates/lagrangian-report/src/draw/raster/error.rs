//! Errors of drawing.

/// A picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A bitmap has a size that cannot be drawn.
    #[error("a picture of {width} × {height} pixels: choose 200 × 150 to 10 000 × 10 000")]
    Size {
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
    /// An animation has no panels, or more than fit side by side.
    #[error("an animation of {0} panels: a GIF takes 1 to 8")]
    Panels(usize),
    /// The renderer of bitmaps refused the drawing.
    #[error("the picture cannot be rendered: {0}")]
    Renderer(String),
    /// The picture cannot be written.
    #[error("the picture cannot be written")]
    Write(#[from] std::io::Error),
}

/// The outcome of drawing.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    pub(super) fn renderer(error: impl std::fmt::Display) -> Self {
        Self::Renderer(error.to_string())
    }
}

impl From<gif::EncodingError> for Error {
    fn from(error: gif::EncodingError) -> Self {
        match error {
            gif::EncodingError::Io(error) => Self::Write(error),
            other => Self::renderer(other),
        }
    }
}
