//! Bands: quantities of another program, as layers of the map.

use super::ground::GroundRaster;
use scenecast_labels::{Band, Ground, Raster, Refusal};
use scenecast_protocol::map::{
    BUILT_IN_LAYERS, Cell, Decimal, LabelGrid, LayerDescriptor, MAX_LABEL, Palette, Quantity, Spread, Steps,
    UNEXPLORED, UpperEnd,
};

/// A band in cells of the map.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BandMap {
    pub(super) descriptor: LayerDescriptor,
    /// Level of each cell: the value of the grid, counted from its lowest.
    pub(super) levels: LabelGrid,
    /// Cells whose quantity was known and is not any more.
    pub(super) erased: LabelGrid,
}

impl BandMap {
    pub(super) fn new(descriptor: LayerDescriptor) -> Self {
        Self { descriptor, levels: LabelGrid::default(), erased: LabelGrid::default() }
    }

    /// Takes the levels of cells, as of [`levels`].
    pub(super) fn take(&mut self, levels: &[(Cell, u8)]) {
        for &(cell, level) in levels {
            let before = self.levels.set(cell, level);
            if level == UNEXPLORED && before != UNEXPLORED || self.erased.get(cell) != UNEXPLORED {
                self.erased.set(cell, u8::from(level == UNEXPLORED));
            }
        }
    }

    /// The quantity of every cell: the middle of its level, or not a number where it is no longer known.
    pub(super) fn quantities(&self) -> Vec<(Cell, f64)> {
        let known = self.levels.iter().filter_map(|(cell, level)| Some((cell, self.descriptor.middle(level)?)));
        known.chain(self.erased.iter().map(|(cell, _)| (cell, f64::NAN))).collect()
    }
}

/// The level that a grid of a band gives to each cell; [`UNEXPLORED`] where its quantity is not known.
pub(super) fn levels(band: &Band, ground: Ground, raster: &Raster, cell_m: f64) -> Result<Vec<(Cell, u8)>, Refusal> {
    let mut levels = Vec::new();
    GroundRaster::new(raster, ground, cell_m)?.for_each(|cell, values| {
        let known = values.iter().filter(|&&value| value != band.no_data).map(|&value| u32::from(value));
        let (sum, count) = known.fold((0, 0), |(sum, count), value| (sum + value, count + 1));
        let level = match count {
            0 => UNEXPLORED,
            // The mean, rounded to the nearest value.
            _ => ((sum + count / 2) / count + 1 - lowest(band)).clamp(1, u32::from(MAX_LABEL)) as u8,
        };
        levels.push((cell, level));
    });
    Ok(levels)
}

/// The lowest value that stands for a quantity.
fn lowest(band: &Band) -> u32 {
    u32::from(band.no_data == 0)
}

/// The layer of a band: each value has a level of its own, whose middle is the quantity. The highest level, 254, also has
/// the values above it.
pub(super) fn descriptor(band: &Band, share: u8) -> LayerDescriptor {
    let scale = band.scale.value();
    let first = band.offset.value() + scale * (f64::from(lowest(band)) - 0.5);
    LayerDescriptor {
        name: band.name.clone().into(),
        unit: band.unit.clone().into(),
        quantity: Quantity::Plain,
        scale: band.scale,
        offset: Decimal::nearest(first),
        steps: Steps::Equal,
        levels: MAX_LABEL,
        upper_end: UpperEnd::Unbounded,
        share,
        palette: Palette::Cividis,
        spread: Spread::Present,
    }
}

/// Whether the map has a layer of its own with this name.
pub(super) fn is_built_in(name: &str) -> bool {
    BUILT_IN_LAYERS.iter().any(|layer| layer.descriptor.name == name)
}
