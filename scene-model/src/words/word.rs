//! The visual word.

/// A visual word and its position in the frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// The word's number, below [`WordExtractor::vocabulary_size`](super::WordExtractor::vocabulary_size).
    pub id: u32,
    /// Distance from the left edge of the frame, pixels.
    pub u: f32,
    /// Distance from the top edge of the frame, pixels.
    pub v: f32,
}
