//! Bands: quantities of another program, as layers of the map.

use super::ground::{ChangingGrid, GroundRaster};
use scenecast_labels::{Band, BandScale, Ground, QuantityBand, Raster, Refusal};
use scenecast_protocol::map::{
    BUILT_IN_LAYERS, Cell, Decimal, LabelGrid, LayerDescriptor, MAX_LABEL, Palette, Quantity, Spread, Steps,
    UNEXPLORED, UpperEnd,
};

/// A band in cells of the map.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BandMap {
    pub(super) descriptor: LayerDescriptor,
    /// Level of each cell: the value of the grid, counted from its lowest.
    pub(super) levels: ChangingGrid,
    /// Cells whose quantity was known and is not any more.
    pub(super) erased: LabelGrid,
}

impl BandMap {
    pub(super) fn new(descriptor: LayerDescriptor) -> Self {
        Self { descriptor, levels: ChangingGrid::default(), erased: LabelGrid::default() }
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

/// The level of the mean quantity of each cell; [`UNEXPLORED`] where none is known, or below the lowest level.
pub(super) fn levels_of(
    layer: &LayerDescriptor,
    ground: Ground,
    quantities: &Raster<f32>,
    cell_m: f64,
) -> Result<Vec<(Cell, u8)>, Refusal> {
    let mut levels = Vec::new();
    GroundRaster::new(quantities, ground, cell_m)?.for_each(|cell, values| {
        let known = values.iter().filter(|value| value.is_finite()).map(|&value| f64::from(value));
        let (sum, count) = known.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        levels.push((cell, if count > 0.0 { layer.level(sum / count, UNEXPLORED) } else { UNEXPLORED }));
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
    let lowest = band.offset.value() + band.scale.value() * f64::from(lowest(band));
    layer((&band.name, &band.unit), lowest, band.scale, share)
}

/// The layer of a band of quantities; `known` is the one that it has already, `configured`
/// the scale for a band that states none.
///
/// # Errors
/// It has another scale already, or none can be chosen.
pub(super) fn quantity_layer(
    band: &QuantityBand,
    quantities: &Raster<f32>,
    known: Option<&LayerDescriptor>,
    configured: Option<BandScale>,
    share: u8,
) -> Result<LayerDescriptor, Refusal> {
    let of = |scale: BandScale| layer((&band.name, &band.unit), scale.low, scale.step, share);
    match (known, band.scale.or(configured)) {
        (Some(known), None) if known.unit == band.unit => Ok(known.clone()),
        (Some(_), None) => Err(Refusal::OtherBand(band.name.clone())),
        (_, Some(scale)) => Ok(of(scale)),
        (None, None) => BandScale::around(&quantities.values).map(of).ok_or(Refusal::NoScale(band.name.clone())),
    }
}

/// A layer whose level 1 has `lowest` in its middle.
fn layer((name, unit): (&str, &str), lowest: f64, scale: Decimal, share: u8) -> LayerDescriptor {
    LayerDescriptor {
        name: name.to_owned().into(),
        unit: unit.to_owned().into(),
        quantity: Quantity::Plain,
        scale,
        offset: Decimal::nearest(lowest - 0.5 * scale.value()),
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
