//! The patterns that all worlds share. A world turns and shifts them, so none of their places looks alike twice.

use super::texture::{Pieces, Strands, Texture, maze};
use std::sync::OnceLock;

pub(super) struct Patterns {
    /// Broken coral: sticks and chunks on each other.
    pub rubble: Texture,
    /// Lumps of reef rock, each with its own colour.
    pub rock: Texture,
    /// Grains, shell grit and small fragments.
    pub grit: Texture,
    /// The branchlets of a bushy coral from above.
    pub fingers: Texture,
    /// The blades of a dense meadow from above.
    pub canopy: Texture,
    /// The ridges of a brain coral.
    pub maze: Texture,
}

/// The patterns; the first call paints them.
pub(super) fn patterns() -> &'static Patterns {
    static PATTERNS: OnceLock<Patterns> = OnceLock::new();
    PATTERNS.get_or_init(Patterns::paint)
}

impl Patterns {
    fn paint() -> Self {
        let rubble = Pieces {
            side: 1024,
            texel_m: 0.009,
            radius_m: [0.011, 0.085],
            aspect: 4.5,
            rise: 0.75,
            contrast: 0.42,
            cover: 3.0,
            key: 0x10,
        };
        let rock = Pieces {
            radius_m: [0.018, 0.24],
            aspect: 1.7,
            rise: 0.62,
            contrast: 0.34,
            cover: 3.0,
            key: 0x11,
            ..rubble
        };
        let grit = Pieces {
            side: 512,
            radius_m: [0.006, 0.026],
            aspect: 2.2,
            contrast: 0.42,
            cover: 3.0,
            key: 0x12,
            ..rubble
        };
        let fingers = Strands {
            side: 512,
            texel_m: 0.007,
            length_m: [0.025, 0.085],
            half_width_m: [0.008, 0.015],
            curl: 0.6,
            spread: 3.2,
            rise_m: 0.05,
            cover: 5.0,
            key: 0x13,
        };
        let canopy = Strands {
            length_m: [0.12, 0.60],
            half_width_m: [0.004, 0.014],
            curl: 1.2,
            spread: 0.9,
            rise_m: 0.10,
            cover: 7.0,
            key: 0x14,
            ..fingers
        };
        Self {
            rubble: rubble.paint(),
            rock: rock.paint(),
            grit: grit.paint(),
            fingers: fingers.paint(),
            canopy: canopy.paint(),
            maze: maze(256, 0.008, 0x15),
        }
    }
}
