//! A vocabulary file: the [`Measures`] that turn features into words, as bytes.
//!
//! Measures that were learnt from images of a similar site before the mission give words the same meaning in every
//! mission.
//!
//! ```
//! use image::{Rgb, RgbImage};
//! use scene_model::vocabulary;
//! use scene_model::words::{WordConfig, WordExtractor};
//!
//! let site = RgbImage::from_fn(120, 90, |x, y| Rgb([(x * 2) as u8, (y * 2) as u8, 90]));
//! let mut extractor = WordExtractor::new(&WordConfig::default());
//! extractor.learn_tones(&site);
//! extractor.learn_statistics(&site, 30.0);
//! extractor.freeze();
//! let file = vocabulary::save(&extractor.measures());
//!
//! let mut on_board = WordExtractor::from_measures(vocabulary::load(&file)?);
//! assert_eq!(on_board.extract(&site, 30.0), extractor.extract(&site, 30.0));
//! # Ok::<(), vocabulary::VocabularyError>(())
//! ```

use crate::envelope::{Envelope, EnvelopeError};
use crate::words::Measures;

const ENVELOPE: Envelope = Envelope { magic: *b"SCNVOCAB", version: 1 };
/// The maximum number of words of one kind in a cell.
const MAX_WORDS_PER_CELL: u32 = 1024;

/// The bytes are not a vocabulary that this version can use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum VocabularyError {
    /// The bytes are not a vocabulary, are of another version, or are damaged.
    #[error("not a usable vocabulary: {0}")]
    Envelope(#[from] EnvelopeError),
    /// The checksum is right, but the content contradicts itself or this version; the text names where.
    #[error("the vocabulary's content is inconsistent: {0}")]
    Inconsistent(&'static str),
}

/// Returns the measures as bytes, for [`load`].
#[must_use]
pub fn save(measures: &Measures) -> Vec<u8> {
    let content = (measures.config().vocabulary_size(), measures);
    ENVELOPE.seal(&postcard::to_allocvec(&content).unwrap_or_default())
}

/// Returns the measures of bytes that [`save`] returned. Other content is refused and never panics.
pub fn load(bytes: &[u8]) -> Result<Measures, VocabularyError> {
    let content = ENVELOPE.open(bytes)?;
    let (size, measures): (u32, Measures) =
        postcard::from_bytes(content).map_err(|_| VocabularyError::Inconsistent("fields do not parse"))?;
    let config = measures.config();
    if size != config.vocabulary_size() {
        return Err(VocabularyError::Inconsistent("this program has another number of words"));
    }
    let kinds = [config.colour, config.context, config.spread, config.texture, config.binary];
    if kinds.iter().any(|&words| words > MAX_WORDS_PER_CELL) {
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
        let mut extractor = WordExtractor::new(&WordConfig::default());
        extractor.learn_tones(&image());
        extractor.learn_statistics(&image(), 20.0);
        extractor.freeze();
        extractor.measures()
    }

    #[test]
    fn loaded_vocabulary_gives_the_same_words() {
        let loaded = load(&save(&trained())).unwrap();
        let words = |measures| WordExtractor::from_measures(measures).extract(&image(), 20.0);
        assert_eq!(words(loaded), words(trained()));
    }

    #[test]
    fn other_bytes_are_refused() {
        assert_eq!(load(b"hello").unwrap_err(), EnvelopeError::Foreign.into());
        let greedy = WordConfig { colour: 5000, ..WordConfig::default() };
        let measures = WordExtractor::new(&greedy).measures();
        assert!(matches!(load(&save(&measures)), Err(VocabularyError::Inconsistent(_))));
    }

    #[test]
    fn content_with_a_right_checksum_never_panics() {
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
