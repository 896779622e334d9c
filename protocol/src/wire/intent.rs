//! The purpose of an adaptive survey's plan.

use super::status::StatusError;
use crate::bytes::Reader;
use crate::map::MAX_LABEL;

/// The purpose of the plan that a pose has.
///
/// ```text
/// byte  bits  field   range
///  0    8     kind    0 unseen floor, 1 curiosity, 2 label, 3 destination, 4 weighted area,
///                     5 label that was seen before
///  1    8     number  of the label, 1..254, after kinds 2 and 5; of the area, 1..4, after kind 4
/// ```
///
/// Source: vehicle, among the [`super::PoseDetails`], while it surveys by an adaptive planner or goes to a destination.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Intent {
    /// Floor that the camera has not seen yet.
    Unseen,
    /// Cells that the scene model finds unusual.
    Curiosity,
    /// More of a label, where it is seen or expected.
    Label(u8),
    /// Another look at a label, where it was seen before.
    LabelAgain(u8),
    /// The place to which the operator has ordered the vehicle.
    Destination,
    /// The weighted area with this number, from 1.
    Area(u8),
}

impl Intent {
    /// The bytes on the wire.
    pub fn encode(self) -> Vec<u8> {
        match self {
            Self::Unseen => vec![0],
            Self::Curiosity => vec![1],
            Self::Label(label) => vec![2, label],
            Self::Destination => vec![3],
            Self::Area(number) => vec![4, number],
            Self::LabelAgain(label) => vec![5, label],
        }
    }

    /// Reads an intent; the rest stays in `r`.
    pub(super) fn read(r: &mut Reader<'_>) -> Result<Self, StatusError> {
        let kind = r.u8()?;
        let mut number = |most: u8| Some(r.u8()?).filter(|n| (1..=most).contains(n)).ok_or(StatusError::BadField);
        match kind {
            0 => Ok(Self::Unseen),
            1 => Ok(Self::Curiosity),
            2 => number(MAX_LABEL).map(Self::Label),
            3 => Ok(Self::Destination),
            4 => number(4).map(Self::Area),
            5 => number(MAX_LABEL).map(Self::LabelAgain),
            _ => Err(StatusError::BadField),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_an_intent() {
        for (intent, bytes) in [
            (Intent::Unseen, &[0][..]),
            (Intent::Curiosity, &[1]),
            (Intent::Label(1), &[2, 1]),
            (Intent::Label(254), &[2, 254]),
            (Intent::Destination, &[3]),
            (Intent::Area(4), &[4, 4]),
            (Intent::LabelAgain(7), &[5, 7]),
        ] {
            assert_eq!(intent.encode(), bytes);
            let mut r = Reader::new(bytes);
            assert_eq!((Intent::read(&mut r), r.rest()), (Ok(intent), &[][..]));
        }
        for bytes in [&[][..], &[2], &[4], &[5], &[6], &[5, 0], &[5, 255], &[4, 0], &[4, 5], &[2, 0], &[2, 255]] {
            assert!(Intent::read(&mut Reader::new(bytes)).is_err(), "{bytes:?}");
        }
    }
}
