//! Cameras of 10, 12 or 14 bits, whose levels come in 16.

/// The bits that the levels of 16-bit images have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BitDepth {
    /// White is 2^n - 1.
    Fixed(u8),
    /// The least number of bits, from 8, that holds the levels of all images so far. It never shrinks, so that the images of a
    /// mission are alike once the brightest was seen.
    Auto(u8),
}

impl Default for BitDepth {
    fn default() -> Self {
        Self::Fixed(16)
    }
}

impl BitDepth {
    /// The bits of the setting `camera.bits`, where 0 stands for the automatic choice.
    pub fn of_setting(bits: u8) -> Self {
        if bits == 0 { Self::Auto(8) } else { Self::Fixed(bits.clamp(8, 16)) }
    }

    /// Looks at the levels of an image before they are scaled.
    pub(crate) fn learn(&mut self, levels: impl Iterator<Item = u16>) {
        if let Self::Auto(bits) = self {
            let highest = levels.max().unwrap_or_default();
            *bits = (*bits).max((16 - highest.leading_zeros()) as u8);
        }
    }

    /// A level in 8 bits, the nearest of 256; levels above white are white.
    pub(crate) fn scaled(self, level: u16) -> u8 {
        let (Self::Fixed(bits) | Self::Auto(bits)) = self;
        let white = (1_u32 << bits) - 1;
        ((u32::from(level).min(white) * 255 + white / 2) / white) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_scaled_to_their_white() {
        let fixed = |bits, level| BitDepth::of_setting(bits).scaled(level);
        assert_eq!(
            [fixed(12, 4095), fixed(12, 2048), fixed(12, 9999), fixed(10, 512), fixed(8, 77)],
            [255, 128, 255, 128, 77]
        );
        for level in 0..=u16::MAX {
            assert_eq!(u32::from(fixed(16, level)), (u32::from(level) + 128) / 257, "{level}");
        }
    }

    #[test]
    fn the_automatic_choice_only_grows() {
        let mut bits = BitDepth::of_setting(0);
        let mut after = |highest: u16| {
            bits.learn([3, highest].into_iter());
            bits
        };
        assert_eq!([after(0), after(700), after(90), after(4000)], [8, 10, 10, 12].map(BitDepth::Auto));
    }
}
