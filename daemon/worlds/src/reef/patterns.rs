//! The patterns that all worlds share. A world turns and shifts them, so none of their places looks alike twice.

use super::relief::{Relief, cups, with_crevices};
use super::texture::{Pieces, Strands, Texture, maze};
use std::sync::OnceLock;

pub(super) struct Patterns {
    /// Sand with dents, small mounds and grit.
    pub sand: Texture,
    /// Broken coral: sticks and chunks on each other.
    pub rubble: Texture,
    /// Lumps of reef rock with creases and holes.
    pub rock: Texture,
    /// Turf and small fragments that roughen stone.
    pub grit: Texture,
    /// The knobs of a bushy coral from above.
    pub knobs: Texture,
    /// The cups of a massive coral.
    pub cups: Texture,
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

const SAND: Relief = Relief {
    side: 1024,
    texel_m: 0.009,
    octaves: &[[0.62, 0.030], [0.27, 0.013], [0.13, 0.0045], [0.062, 0.0022], [0.033, 0.0020]],
    fold: 0.15,
    warp_m: 0.07,
    hole_m: 0.003,
    key: 0x20,
};

const ROCK: Relief = Relief {
    octaves: &[[0.66, 0.22], [0.31, 0.10], [0.15, 0.040], [0.075, 0.016], [0.038, 0.009]],
    fold: 0.85,
    warp_m: 0.10,
    hole_m: 0.050,
    key: 0x21,
    ..SAND
};

const RUBBLE: Pieces = Pieces {
    side: 1024,
    texel_m: 0.009,
    radius_m: [0.014, 0.075],
    aspect: 3.2,
    rise: 0.75,
    contrast: 0.25,
    cover: 3.0,
    key: 0x10,
};

const CANOPY: Strands = Strands {
    side: 512,
    texel_m: 0.007,
    length_m: [0.20, 0.65],
    half_width_m: [0.004, 0.009],
    curl: 1.0,
    spread: 0.9,
    rise_m: 0.06,
    cover: 6.0,
    key: 0x14,
};

impl Patterns {
    fn paint() -> Self {
        let grit = Pieces { side: 512, radius_m: [0.008, 0.040], aspect: 1.8, contrast: 0.20, key: 0x12, ..RUBBLE };
        let knobs = Pieces {
            side: 512,
            radius_m: [0.016, 0.036],
            aspect: 1.5,
            rise: 1.5,
            contrast: 0.14,
            cover: 1.5,
            key: 0x13,
            ..RUBBLE
        };
        Self {
            sand: with_crevices(SAND.paint(), 0.5),
            rubble: with_crevices(RUBBLE.paint(), 1.2),
            rock: with_crevices(ROCK.paint(), 1.0),
            grit: with_crevices(grit.paint(), 0.8),
            knobs: with_crevices(knobs.paint(), 1.0),
            cups: with_crevices(cups(512, 0.009, 0.085, 0x16), 0.8),
            canopy: with_crevices(CANOPY.paint(), 0.3),
            maze: maze(256, 0.008, 0x15),
        }
    }
}
