//! The bounds that measurements of distances are checked against.

use crate::MAX_PIXELS;

/// A measurement of distances that cannot be used, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DepthError {
    #[error(
        "the depth image has the encoding {0:?}; allowed are 16UC1, mono16 (units of a millimetre) and 32FC1 (metres)"
    )]
    Encoding(String),
    #[error("there are {width} x {height} distances; allowed are 1 to {MAX_PIXELS}")]
    Size { width: u32, height: u32 },
    #[error("{held} bytes are too few for {height} rows of {step} bytes")]
    Short { held: usize, height: u32, step: u32 },
    #[error("a row of {step} bytes is too short for {width} {of}")]
    Step { step: u32, width: u32, of: &'static str },
    #[error("the cloud has no field {0} of the type float32 within its points")]
    Field(&'static str),
    #[error("the fields x, y and z of the cloud overlap")]
    Overlap,
}

/// Checks the bounds of `height` rows of `step` bytes, of which the last may end with its last element.
pub(crate) fn check_rows(
    (width, height): (u32, u32),
    step: u32,
    row_bytes: u64,
    held: usize,
    of: &'static str,
) -> Result<(), DepthError> {
    let count = u64::from(width) * u64::from(height);
    if count == 0 || count > u64::from(MAX_PIXELS) {
        return Err(DepthError::Size { width, height });
    }
    if height > 1 && u64::from(step) < row_bytes {
        return Err(DepthError::Step { step, width, of });
    }
    if (held as u64) < (u64::from(height) - 1) * u64::from(step) + row_bytes {
        return Err(DepthError::Short { held, height, step });
    }
    Ok(())
}
