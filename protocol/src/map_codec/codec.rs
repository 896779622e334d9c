//! The choice of the coder.

use std::fmt;
use std::str::FromStr;

/// How chunks are encoded; every decoder reads all of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Codec {
    /// For each chunk, the smaller result of the two.
    #[default]
    Auto,
    /// An indexed PNG of the changed part without its constant bytes.
    Png,
    /// Binary decisions with mixed contexts and a shipped prior.
    Context,
}

/// A codec name that is not one of `auto`, `png`, `context`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("unknown map codec; expected auto, png or context")]
pub struct UnknownCodecName;

impl FromStr for Codec {
    type Err = UnknownCodecName;

    fn from_str(name: &str) -> Result<Self, UnknownCodecName> {
        match name {
            "auto" => Ok(Self::Auto),
            "png" => Ok(Self::Png),
            "context" => Ok(Self::Context),
            _ => Err(UnknownCodecName),
        }
    }
}

impl fmt::Display for Codec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Png => "png",
            Self::Context => "context",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_as_the_codec_they_name() {
        for codec in [Codec::Auto, Codec::Png, Codec::Context] {
            assert_eq!(codec.to_string().parse(), Ok(codec));
        }
        assert!("zip".parse::<Codec>().is_err());
    }
}
