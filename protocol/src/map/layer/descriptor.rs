//! The description of a layer: all that a reader needs to show its levels, with decimal numbers exactly as they are written.

use crate::map::{MAX_LABEL, TextPart, UNEXPLORED};
use std::borrow::Cow;
use std::ops::Range;

/// A layer of the map: one quantity a cell, in few levels. Level 0 is "not known" in every layer, because the coder of maps
/// takes it for a cell that nobody has seen.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +---+---+---+-+-+---------------+---------------+---------------+
/// |spr|end|qty|D|0| palette       | levels        | share         |
/// +---+---+---+-+-+---------------+---------------+---------------+
/// | scale                                                         |
/// +---------------------------------------------------------------+
/// | offset                                                        |
/// +-------+-------+-----------------------------------------------+
/// | n - 1 | u     | name, n bytes; unit, u bytes                  |
/// +-------+-------+-----------------------------------------------+
/// ```
/// * spr: [`Spread`], end: [`UpperEnd`], qty: [`Quantity`], each by its place; D: 1 = steps double; palette: [`Palette`].
/// * levels: 1 to 254; share: 0 to 100 percent; scale and offset: [`Decimal`], scale above 0.
/// * n: 1 to 16, u: 0 to 8.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayerDescriptor {
    /// Its name, the same wherever it is configured, requested or shown: 1 to 16 of `a` to `z`, `0` to `9` and `_`.
    pub name: Cow<'static, str>,
    /// Unit of the quantity for people, at most 8 bytes; empty if it has none.
    pub unit: Cow<'static, str>,
    /// How a reader may use the quantity.
    pub quantity: Quantity,
    /// Width of level 1, in units; above 0.
    pub scale: Decimal,
    /// Where level 1 begins, in units.
    pub offset: Decimal,
    /// How wide the other levels are.
    pub steps: Steps,
    /// The highest level, 1 to 254.
    pub levels: u8,
    /// Where the highest level ends.
    pub upper_end: UpperEnd,
    /// Least part of the map's share of the traffic while labels wait too, percent; 0: the layer is a background stream.
    pub share: u8,
    /// The colours in which levels are shown.
    pub palette: Palette,
    /// Between which levels the colours are spread.
    pub spread: Spread,
}

/// How a reader may use the quantity of a layer beyond showing it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// It is shown as it is.
    Plain,
    /// Metres of the sea floor below the surface of the water: the third coordinate of the map.
    Depth,
}

/// How wide the levels of a layer are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Steps {
    /// All as wide as level 1.
    Equal,
    /// Level 2 as wide as level 1, and each further one twice as wide as the one before, so that level n ends at
    /// `2^(n - 1)` scales above the offset.
    Doubling,
}

/// Where the highest level of a layer ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UpperEnd {
    /// Its upper bound is off the scale, and so is all above.
    Exclusive,
    /// Its upper bound belongs to it; all above is off the scale.
    Inclusive,
    /// All above belongs to it.
    Unbounded,
}

/// Colours of the levels, from the lowest to the highest; a viewer has the values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Palette {
    /// Blue to yellow, of even lightness, also for the colour-blind (Nuñez, Anderton, Renslow 2018).
    Cividis,
    /// Black over red to yellow (matplotlib).
    Inferno,
}

/// Between which levels a viewer spreads the colours of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// From level 1 to the highest of the scale.
    Scale,
    /// From the lowest to the highest that the map has.
    Present,
    /// The same without the lowest and the highest fiftieth of the cells, so that a few odd cells do not dim the others.
    Common,
}

impl Palette {
    /// Every palette, in wire order.
    pub const ALL: [Self; 2] = [Self::Cividis, Self::Inferno];

    /// The name of this value in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cividis => "cividis",
            Self::Inferno => "inferno",
        }
    }
}

impl Spread {
    /// Every spread, in wire order.
    pub const ALL: [Self; 3] = [Self::Scale, Self::Present, Self::Common];

    /// The name of this value in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scale => "scale",
            Self::Present => "present",
            Self::Common => "common",
        }
    }
}

impl UpperEnd {
    const ALL: [Self; 3] = [Self::Exclusive, Self::Inclusive, Self::Unbounded];
}

impl Quantity {
    const ALL: [Self; 2] = [Self::Plain, Self::Depth];
}

impl LayerDescriptor {
    /// Most bytes of a name.
    pub const MAX_NAME: usize = 16;
    /// Most bytes of a unit.
    pub const MAX_UNIT: usize = 8;
    /// Most bytes of a descriptor.
    pub const MAX_BYTES: usize = Self::HEAD + Self::MAX_NAME + Self::MAX_UNIT;
    const HEAD: usize = 13;
    /// A quantity has to leave its level by this share of the level's width before it has another one.
    const HYSTERESIS: f64 = 0.2;

    /// Whether both ends can use it: name, unit, scale, levels and share within their ranges.
    pub fn is_sound(&self) -> bool {
        let is_word = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'_';
        let is_named = (1..=Self::MAX_NAME).contains(&self.name.len()) && self.name.bytes().all(is_word);
        let has_unit = self.unit.len() <= Self::MAX_UNIT && !self.unit.chars().any(char::is_control);
        let has_scale = self.scale.value() > 0.0 && (1..=MAX_LABEL).contains(&self.levels);
        is_named && has_unit && has_scale && self.share <= 100
    }

    /// The bounds of a level in units, the upper one exclusive but for [`UpperEnd`]; `None` if it means "not known".
    pub fn bounds(&self, level: u8) -> Option<(f64, f64)> {
        let below = level.checked_sub(1).filter(|_| level <= self.levels)?;
        let (begin, width) = self.steps.begin_and_width(below);
        let (scale, offset) = (self.scale.value(), self.offset.value());
        let low = begin * scale + offset;
        Some((low, low + width * scale))
    }

    /// The middle of a level in units; `None` if it means "not known".
    pub fn middle(&self, level: u8) -> Option<f64> {
        self.bounds(level).map(|(low, high)| (low + high) / 2.0)
    }

    /// The level of a quantity for a cell that has been of level `held`; 0 if it lies off the scale.
    pub fn level(&self, quantity: f64, held: u8) -> u8 {
        if self.kept_by(held).is_some_and(|range| range.contains(&quantity)) {
            return held;
        }
        let steps = (quantity - self.offset.value()) / self.scale.value();
        let end = self.steps.begin_and_width(self.levels).0;
        let is_on_scale = match self.upper_end {
            UpperEnd::Exclusive => (0.0..end).contains(&steps),
            UpperEnd::Inclusive => (0.0..=end).contains(&steps),
            UpperEnd::Unbounded => steps >= 0.0,
        };
        if is_on_scale { self.steps.below(steps, self.levels.saturating_sub(1)) + 1 } else { UNEXPLORED }
    }

    /// The quantities with which a cell of this level keeps it; `None` if the level means "not known".
    pub fn kept_by(&self, level: u8) -> Option<Range<f64>> {
        let (low, high) = self.bounds(level)?;
        let width = self.steps.begin_and_width(level - 1).1 * self.scale.value();
        let margin = width * Self::HYSTERESIS;
        Some(low - margin..high + margin)
    }

    /// Fingerprint of all of it ([`TextPart::digest_of`]).
    pub fn digest(&self) -> u16 {
        TextPart::digest_of(&self.to_bytes())
    }

    /// The bytes of a sound descriptor.
    pub fn to_bytes(&self) -> Vec<u8> {
        let doubles = u8::from(self.steps == Steps::Doubling);
        let flags = (self.spread as u8) << 6 | (self.upper_end as u8) << 4 | (self.quantity as u8) << 2 | doubles << 1;
        let mut out = vec![flags, self.palette as u8, self.levels, self.share];
        out.extend(self.scale.encode());
        out.extend(self.offset.encode());
        out.push((self.name.len().saturating_sub(1) << 4 | self.unit.len()) as u8);
        out.extend(self.name.bytes().chain(self.unit.bytes()));
        out
    }

    /// Reads [`Self::to_bytes`]; `None` if they make no sound descriptor.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (head, texts) = bytes.split_first_chunk::<{ Self::HEAD }>()?;
        let &[flags, palette, levels, share, a, b, c, d, e, f, g, h, lengths] = head;
        let (name, unit) = texts.split_at_checked(usize::from(lengths >> 4) + 1)?;
        let text = |bytes: &[u8]| Some(Cow::Owned(std::str::from_utf8(bytes).ok()?.to_owned()));
        let descriptor = Self {
            name: text(name)?,
            unit: text(unit).filter(|unit| unit.len() == usize::from(lengths & 15))?,
            quantity: *Quantity::ALL.get(usize::from(flags >> 2 & 3))?,
            scale: Decimal::decode([a, b, c, d])?,
            offset: Decimal::decode([e, f, g, h])?,
            steps: if flags & 2 != 0 { Steps::Doubling } else { Steps::Equal },
            levels,
            upper_end: *UpperEnd::ALL.get(usize::from(flags >> 4 & 3))?,
            share,
            palette: *Palette::ALL.get(usize::from(palette))?,
            spread: *Spread::ALL.get(usize::from(flags >> 6))?,
        };
        (flags & 1 == 0 && descriptor.is_sound()).then_some(descriptor)
    }
}

impl Steps {
    /// Where the level after `below` others begins, and its width, in scales above the offset.
    fn begin_and_width(self, below: u8) -> (f64, f64) {
        match (self, below) {
            (Self::Equal, _) => (f64::from(below), 1.0),
            (Self::Doubling, 0) => (0.0, 1.0),
            (Self::Doubling, _) => {
                let begin = 2f64.powi(i32::from(below) - 1);
                (begin, begin)
            }
        }
    }

    /// How many levels, `most` at most, lie below the one that holds `steps` scales above the offset.
    fn below(self, steps: f64, most: u8) -> u8 {
        match self {
            Self::Equal => steps.min(f64::from(most)) as u8,
            Self::Doubling => (0..most).take_while(|&below| self.begin_and_width(below + 1).0 <= steps).count() as u8,
        }
    }
}

/// `digits` times ten to the power of `exponent`: a step of 0.1 stays 0.1 at both ends.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +-----------------------------------------------+---------------+
/// | digits, two's complement                      | exponent, too |
/// +-----------------------------------------------+---------------+
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decimal {
    digits: i32,
    exponent: i8,
}

impl Decimal {
    /// The number 0, with exponent 0.
    pub const ZERO: Self = Self { digits: 0, exponent: 0 };
    /// The length on the wire: 24 bits of digits, 8 of exponent.
    pub const BYTES: usize = 4;
    /// The exponent lies within this of 0.
    const MAX_EXPONENT: i8 = 9;
    /// 24 bits with the sign.
    const MAX_DIGITS: i32 = (1 << 23) - 1;

    /// The number whose `digits` (at most 8 388 607 either way) are followed by `exponent` zeros, or have so many decimals
    /// if it is negative (at most nine either way). Out of these ranges the nearest is taken.
    pub const fn new(digits: i32, exponent: i8) -> Self {
        let digits = if digits > Self::MAX_DIGITS { Self::MAX_DIGITS } else { digits };
        let digits = if digits < -Self::MAX_DIGITS - 1 { -Self::MAX_DIGITS - 1 } else { digits };
        let exponent = if exponent > Self::MAX_EXPONENT { Self::MAX_EXPONENT } else { exponent };
        let exponent = if exponent < -Self::MAX_EXPONENT { -Self::MAX_EXPONENT } else { exponent };
        Self { digits, exponent }
    }

    /// The nearest number to `value` with up to six significant digits, as people write them.
    pub fn nearest(value: f64) -> Self {
        const DIGITS: i32 = 6;
        if value == 0.0 || !value.is_finite() {
            return Self::ZERO;
        }
        let exponent = (value.abs().log10().floor() as i32 + 1 - DIGITS).max(-i32::from(Self::MAX_EXPONENT));
        let (mut digits, mut exponent) = ((value / 10f64.powi(exponent)).round() as i32, exponent);
        while digits != 0 && digits % 10 == 0 {
            (digits, exponent) = (digits / 10, exponent + 1);
        }
        // A number without decimals needs no exponent.
        while (1..=3).contains(&exponent) && digits.abs() <= Self::MAX_DIGITS / 10 {
            (digits, exponent) = (digits * 10, exponent - 1);
        }
        Self::new(digits, exponent as i8)
    }

    /// As a binary number, the nearest one where the exponent is at most 0.
    pub fn value(self) -> f64 {
        let power = 10f64.powi(i32::from(self.exponent.abs()));
        if self.exponent < 0 { f64::from(self.digits) / power } else { f64::from(self.digits) * power }
    }

    pub(super) fn encode(self) -> [u8; Self::BYTES] {
        let [_, a, b, c] = self.digits.to_be_bytes();
        [a, b, c, self.exponent as u8]
    }

    pub(super) fn decode([a, b, c, exponent]: [u8; Self::BYTES]) -> Option<Self> {
        let (digits, exponent) = (i32::from_be_bytes([a, b, c, 0]) >> 8, exponent as i8);
        (exponent.unsigned_abs() <= Self::MAX_EXPONENT as u8).then_some(Self { digits, exponent })
    }
}

#[cfg(test)]
mod tests {
    use super::super::set::{CONFIDENCE, CURIOSITY};
    use super::*;
    use proptest::prelude::*;

    /// Steps of half a metre from 12 m on.
    fn depth() -> LayerDescriptor {
        LayerDescriptor { offset: Decimal::new(120, -1), ..LayerDescriptor::depth_around(0.0, 0.5) }
    }

    fn ages() -> LayerDescriptor {
        LayerDescriptor { steps: Steps::Doubling, scale: Decimal::new(2, 0), levels: 5, ..CURIOSITY }
    }

    #[test]
    fn built_in_levels_are_quarters_metres_and_bits() {
        let levels = |layer: LayerDescriptor, quantities: &[f64]| -> Vec<u8> {
            quantities.iter().map(|&quantity| layer.level(quantity, 0)).collect()
        };
        assert_eq!(levels(CONFIDENCE, &[0.0, 0.24, 0.25, 0.74, 0.75, 1.0]), [1, 1, 2, 3, 4, 4]);
        assert_eq!(levels(CONFIDENCE, &[-0.1, 1.1, f64::NAN]), [0, 0, 0]);
        assert_eq!(levels(depth(), &[12.0, 12.49, 12.5, 138.99]), [1, 1, 2, 254]);
        assert_eq!(levels(depth(), &[11.9, 139.0, f64::INFINITY]), [0, 0, 0]);
        assert_eq!(levels(CURIOSITY, &[0.0, 0.99, 1.0, 6.5, 15.9, 16.0, 40.0]), [1, 1, 2, 7, 16, 16, 16]);
        assert_eq!(levels(CURIOSITY, &[-0.1, f64::NAN]), [0, 0]);
        assert_eq!((depth().bounds(2), CURIOSITY.bounds(7)), (Some((12.5, 13.0)), Some((6.0, 7.0))));
        assert_eq!((depth().bounds(0), depth().bounds(255), CONFIDENCE.bounds(5)), (None, None, None));
    }

    #[test]
    fn doubling_levels_end_at_powers_of_two() {
        let levels = [0.0, 1.99, 2.0, 3.9, 4.0, 8.0, 15.9, 16.0, 31.9, 32.0, f64::INFINITY].map(|q| ages().level(q, 0));
        assert_eq!(levels, [1, 1, 2, 2, 3, 4, 4, 5, 5, 5, 5]);
        assert_eq!(
            [1, 2, 3, 5].map(|level| ages().bounds(level).unwrap()),
            [(0.0, 2.0), (2.0, 4.0), (4.0, 8.0), (16.0, 32.0)]
        );
        assert_eq!([4.3, 4.4, 3.5].map(|q| ages().level(q, 2)), [2, 3, 2], "a fifth of the width of the level");
        let closed = LayerDescriptor { upper_end: UpperEnd::Exclusive, ..ages() };
        assert_eq!([31.9, 32.0, 1e300].map(|q| closed.level(q, 0)), [5, 0, 0]);
    }

    #[test]
    fn depths_are_centred_or_begin_at_the_surface() {
        let scale = |middle_m, step_m| {
            let layer = LayerDescriptor::depth_around(middle_m, step_m);
            (layer.offset.value(), layer.scale.value())
        };
        assert_eq!(scale(1000.0, 0.5), (936.5, 0.5));
        assert_eq!(scale(20.0, 0.5), (0.0, 0.5));
        assert_eq!(scale(11_000.0, 0.1), (10_987.3, 0.1));
    }

    #[test]
    fn a_quantity_at_the_edge_of_a_level_does_not_flicker() {
        let mut level = 0;
        let mut changes = 0;
        for i in 0..100 {
            let next = CONFIDENCE.level(if i % 2 == 0 { 0.73 } else { 0.77 }, level);
            changes += u32::from(next != level);
            level = next;
        }
        assert_eq!((changes, level), (1, 3));
        assert_eq!(CONFIDENCE.level(0.81, level), 4);
        assert_eq!([6.9, 7.1, 7.25].map(|bits| CURIOSITY.level(bits, 7)), [7, 7, 8]);
    }

    #[test]
    fn golden_bytes_of_a_descriptor() {
        let bytes = b"\x44\x00\xFE\x00\x00\x00\x05\xFF\x00\x00\x78\xFF\x41depthm";
        assert_eq!(depth().to_bytes(), bytes);
        assert_eq!(LayerDescriptor::from_bytes(bytes), Some(depth()));
        assert_eq!(depth().digest(), TextPart::digest_of(bytes));
    }

    #[test]
    fn descriptors_that_no_layer_has_are_refused() {
        let named = |name: &'static str| LayerDescriptor { name: Cow::Borrowed(name), ..depth() };
        assert!(named("a_layer_of_16_by").is_sound());
        for bad in [named(""), named("a_layer_of_17_byt"), named("Depth"), named("de pth")] {
            assert!(!bad.is_sound(), "{bad:?}");
        }
        assert!(!LayerDescriptor { levels: 0, ..depth() }.is_sound());
        assert!(!LayerDescriptor { levels: 255, ..depth() }.is_sound());
        assert!(!LayerDescriptor { scale: Decimal::ZERO, ..depth() }.is_sound());
        assert!(!LayerDescriptor { share: 101, ..depth() }.is_sound());
        assert!(!LayerDescriptor { unit: Cow::Borrowed("furlongs!"), ..depth() }.is_sound());
        let bytes = depth().to_bytes();
        for (at, value) in [(0, 0xC4), (0, 0x74), (0, 0x48), (0, 0x45), (1, 2), (2, 0), (3, 101), (7, 10), (12, 0x42)] {
            let mut bad = bytes.clone();
            bad[at] = value;
            assert_eq!(LayerDescriptor::from_bytes(&bad), None, "{value:02X} at {at}");
        }
        assert_eq!(LayerDescriptor::from_bytes(&bytes[..bytes.len() - 1]), None);
    }

    proptest! {
        #[test]
        fn a_level_holds_the_quantity_or_nearly(quantity in 0.0f64..200.0, held in 0u8..=255) {
            let depth = depth();
            let level = depth.level(quantity, held);
            if let Some((low, high)) = depth.bounds(level) {
                prop_assert!((low - 0.11..high + 0.11).contains(&quantity));
            } else {
                prop_assert!(!(12.0..139.0).contains(&quantity));
            }
        }

        #[test]
        fn any_bytes_are_a_descriptor_or_are_refused(mut bytes in proptest::collection::vec(any::<u8>(), 13..40)) {
            bytes[0] &= 0b0001_0110;
            bytes[1] &= 1;
            bytes[3] /= 3;
            (bytes[7], bytes[11]) = (bytes[7] & 7, bytes[11] & 7);
            bytes[12] = (bytes.len() as u8 - 13) << 4 | bytes[12] & 1;
            bytes.iter_mut().skip(13).for_each(|c| *c = *c % 26 + b'a');
            if let Some(descriptor) = LayerDescriptor::from_bytes(&bytes) {
                prop_assert_eq!(&descriptor.to_bytes(), &bytes);
                prop_assert!(bytes.len() <= LayerDescriptor::MAX_BYTES);
            }
        }
    }

    #[test]
    fn golden_bytes_and_values_of_decimals() {
        assert_eq!((Decimal::new(5, -1).encode(), Decimal::new(5, -1).value()), ([0, 0, 5, 0xFF], 0.5));
        assert_eq!((Decimal::new(-3, 2).encode(), Decimal::new(-3, 2).value()), ([0xFF, 0xFF, 0xFD, 2], -300.0));
        assert_eq!(Decimal::new(i32::MIN, 100), Decimal::new(-8_388_608, 9));
        assert_eq!(Decimal::decode([0, 0, 1, 10]), None);
    }

    #[test]
    fn a_typed_number_becomes_the_decimal_that_was_written() {
        for (value, digits, exponent) in [(0.5, 5, -1), (-80.0, -80, 0), (0.0, 0, 0), (1e9, 1, 9), (0.001_25, 125, -5)]
        {
            assert_eq!(Decimal::nearest(value), Decimal::new(digits, exponent), "{value}");
        }
        assert_eq!(Decimal::nearest(1.0 / 3.0), Decimal::new(333_333, -6));
        assert_eq!([f64::NAN, f64::INFINITY].map(Decimal::nearest), [Decimal::ZERO; 2]);
        assert!((Decimal::nearest(-1e-9).value() + 1e-9).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn a_decimal_reads_back(bytes: [u8; 4]) {
            if let Some(decimal) = Decimal::decode(bytes) {
                prop_assert_eq!(decimal.encode(), bytes);
                prop_assert!(decimal.value().is_finite());
                prop_assert_eq!(Decimal::new(decimal.digits, decimal.exponent), decimal);
            }
        }
    }
}
