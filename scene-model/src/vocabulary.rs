//! A vocabulary file: the [`Measures`] that turn features into words, as bytes.
//!
//! Measures that were learnt from images of a similar site before the mission give words the same meaning in every
//! mission. A [`Discriminant`] that was learnt from annotated images adds words of its own.
//!
//! The content of a file's envelope, in postcard: the number of words, the measures, and the discriminant or none.
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
use crate::words::{Discriminant, Measures};

const ENVELOPE: Envelope = Envelope { magic: *b"SCNVOCAB", version: 2 };
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
    let content = (measures.config().vocabulary_size(), measures, measures.discriminant());
    ENVELOPE.seal(&postcard::to_allocvec(&content).unwrap_or_default())
}

/// Returns the measures of bytes that [`save`] returned. Other content is refused and never panics.
pub fn load(bytes: &[u8]) -> Result<Measures, VocabularyError> {
    let (size, measures, discriminant): (u32, Measures, Option<Discriminant>) =
        postcard::from_bytes(ENVELOPE.open(bytes)?)
            .map_err(|_| VocabularyError::Inconsistent("fields do not parse"))?;
    let config = measures.config();
    if size != config.vocabulary_size() {
        return Err(VocabularyError::Inconsistent("this program has another number of words"));
    }
    let kinds = [config.colour, config.context, config.spread, config.texture, config.binary];
    if kinds.iter().any(|&words| words > MAX_WORDS_PER_CELL) {
        return Err(VocabularyError::Inconsistent("more than 1024 words of a kind in a cell"));
    }
    let on_one_grid = config.colour > 0 && config.context > 0 && config.spread == config.context;
    if discriminant.is_some() && !(on_one_grid && config.texture == config.context) {
        return Err(VocabularyError::Inconsistent(
            "a discriminant needs as many spread and texture words as context words",
        ));
    }
    Ok(measures.with_discriminant(discriminant))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::words::{FEATURES, Word, WordConfig, WordExtractor};
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

    fn discriminant() -> Discriminant {
        let direction = |measure: usize| std::array::from_fn::<f32, FEATURES, _>(|i| f32::from(u8::from(i == measure)));
        let prototypes: Vec<Vec<f32>> = (0..20).map(|i| vec![(i % 5) as f32 - 2.0, (i / 5) as f32 - 1.5]).collect();
        Discriminant::new(&[direction(3), direction(10)], &prototypes).unwrap()
    }

    fn words(measures: Measures) -> Vec<Word> {
        WordExtractor::from_measures(measures).extract(&image(), 20.0)
    }

    #[test]
    fn loaded_vocabulary_gives_the_same_words() {
        assert_eq!(words(load(&save(&trained())).unwrap()), words(trained()));
        let annotated = trained().with_discriminant(Some(discriminant()));
        let loaded = load(&save(&annotated)).unwrap();
        assert_eq!(loaded.vocabulary_size(), WordConfig::default().vocabulary_size() + 20);
        assert_eq!(words(loaded), words(annotated));
    }

    #[test]
    fn a_discriminant_adds_words_and_changes_none() {
        let plain = words(trained());
        let annotated = words(trained().with_discriminant(Some(discriminant())));
        assert_eq!(annotated[..plain.len()], plain);
        let added = &annotated[plain.len()..];
        let ids = WordConfig::default().vocabulary_size()..WordConfig::default().vocabulary_size() + 20;
        assert!(added.iter().all(|word| ids.contains(&word.id)));
        // Nine for each cell of 20 pixels.
        assert_eq!(added.len(), 14 * 11);
    }

    #[test]
    fn a_vocabulary_of_another_version_is_refused() {
        let sealed = save(&trained());
        let content = ENVELOPE.open(&sealed).unwrap();
        for found in [1, 3] {
            let other = Envelope { version: found, ..ENVELOPE }.seal(content);
            assert_eq!(load(&other).unwrap_err(), EnvelopeError::Version { found, wanted: 2 }.into());
        }
    }

    #[test]
    fn a_discriminant_without_its_measures_is_refused() {
        let config = WordConfig { spread: 4, ..WordConfig::default() };
        let measures = WordExtractor::new(&config).measures().with_discriminant(Some(discriminant()));
        assert!(load(&save(&measures)).unwrap_err().to_string().contains("as many spread and texture words"));
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
        let sealed = save(&trained().with_discriminant(Some(discriminant())));
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
