//! A vocabulary as bytes: measures learnt from a set of images before a mission, frozen.

use crate::envelope::{Envelope, EnvelopeError};
use crate::words::Measures;

const ENVELOPE: Envelope = Envelope { magic: *b"SCNVOCAB", version: 1 };
/// Most words of one kind in a cell.
const MOST_PER_CELL: u32 = 1024;

/// Why bytes are no vocabulary to measure words against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VocabularyError {
    /// Not a vocabulary, of another version, or damaged.
    #[error("not a vocabulary to go by: {0}")]
    Envelope(#[from] EnvelopeError),
    /// The checksum is right but the content cannot be.
    #[error("the vocabulary's content is inconsistent: {0}")]
    Inconsistent(&'static str),
}

/// The vocabulary as bytes, for [`load`].
pub fn save(measures: &Measures) -> Vec<u8> {
    let content = (measures.config().vocabulary_size(), measures);
    ENVELOPE.seal(&postcard::to_allocvec(&content).unwrap_or_default())
}

/// The measures that [`save`] kept; words mean in every run what they meant in training.
pub fn load(bytes: &[u8]) -> Result<Measures, VocabularyError> {
    let content = ENVELOPE.open(bytes)?;
    let (size, measures): (u32, Measures) =
        postcard::from_bytes(content).map_err(|_| VocabularyError::Inconsistent("fields do not parse"))?;
    let config = measures.config();
    if size != config.vocabulary_size() {
        return Err(VocabularyError::Inconsistent("this program has another number of words"));
    }
    let kinds = [config.colour, config.context, config.spread, config.texture, config.binary];
    if kinds.iter().any(|&words| words > MOST_PER_CELL) {
        return Err(VocabularyError::Inconsistent("more than 1024 words of a kind in a cell"));
    }
    Ok(measures)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::words::{WordConfig, WordExtractor};
    use image::{Rgb, RgbImage};

    fn image() -> RgbImage {
        RgbImage::from_fn(90, 70, |x, y| Rgb([(x * 5) as u8, (y * 3) as u8, (x * y) as u8]))
    }

    fn trained() -> Measures {
        WordExtractor::train(&WordConfig::default(), || std::iter::once((image(), 20.0)))
    }

    #[test]
    fn a_vocabulary_gives_the_same_words_after_it_was_kept() {
        let loaded = load(&save(&trained())).unwrap();
        let words = |measures| WordExtractor::from_measures(measures).extract(&image(), 20.0);
        assert_eq!(words(loaded), words(trained()));
    }

    #[test]
    fn what_is_no_vocabulary_is_refused() {
        assert_eq!(load(b"hello").unwrap_err(), EnvelopeError::Foreign.into());
        let greedy = WordConfig { colour: 5000, ..WordConfig::default() };
        let measures = WordExtractor::new(&greedy).measures();
        assert!(matches!(load(&save(&measures)), Err(VocabularyError::Inconsistent(_))));
    }

    #[test]
    fn content_under_a_right_checksum_never_panics() {
        let sealed = save(&trained());
        let content = ENVELOPE.open(&sealed).unwrap();
        for at in 0..content.len() {
            let mut other = content.to_vec();
            other[at] ^= 0x55;
            if let Ok(measures) = load(&ENVELOPE.seal(&other)) {
                WordExtractor::from_measures(measures).extract(&RgbImage::new(24, 24), 12.0);
            }
        }
    }
}
