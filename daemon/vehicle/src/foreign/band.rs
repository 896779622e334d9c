//! Bands: quantities of another program, as layers of the map.

use super::ground::{ChangingGrid, GroundRaster, check_room};
use scenecast_config::{BandRange, Config};
use scenecast_labels::{Band, BandScale, Ground, QuantityBand, Raster, Refusal};
use scenecast_protocol::map::{
    BUILT_IN_LAYERS, Cell, Decimal, LabelGrid, LayerDescriptor, LayerId, MAX_LABEL, Palette, Quantity, Spread, Steps,
    UNEXPLORED, UpperEnd,
};
use std::collections::BTreeMap;

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
    fn new(descriptor: LayerDescriptor) -> Self {
        Self { descriptor, levels: ChangingGrid::default(), erased: LabelGrid::default() }
    }

    /// Takes the levels of cells, as of [`levels`].
    fn take(&mut self, levels: &[(Cell, u8)]) {
        for &(cell, level) in levels {
            let before = self.levels.set(cell, level);
            if level == UNEXPLORED && before != UNEXPLORED || self.erased.get(cell) != UNEXPLORED {
                self.erased.set(cell, u8::from(level == UNEXPLORED));
            }
        }
    }
}

/// The bands of a map, by name.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BandMaps {
    /// The configured share of a band, percent.
    share: u8,
    /// Scales of bands that state none.
    scales: BTreeMap<String, BandScale>,
    maps: BTreeMap<String, BandMap>,
}

impl BandMaps {
    pub(super) fn new(config: &Config) -> Self {
        let scales = config.bands.ranges.iter().filter_map(scale).collect();
        Self { share: config.bands.share, scales, maps: BTreeMap::new() }
    }

    /// The bands in the order of their names.
    pub(super) fn iter(&self) -> impl Iterator<Item = &BandMap> {
        self.maps.values()
    }

    /// Puts a band back as it was.
    pub(super) fn restore(&mut self, map: BandMap) {
        self.maps.insert(map.descriptor.name.clone().into_owned(), map);
    }

    /// Takes the levels of a band in a map with cells of `cell_m`, at most `most` of them with a level.
    ///
    /// # Errors
    /// The band has another scale than before, or the map has no room for it.
    pub(super) fn take_band(
        &mut self,
        band: &Band,
        ground: Ground,
        values: &Raster,
        cell_m: f64,
        most: usize,
    ) -> Result<(), Refusal> {
        let layer = descriptor(band, self.next_share());
        self.check_layer(&layer)?;
        let levels = levels(band, ground, values, cell_m)?;
        self.take_levels(layer, &levels, most)
    }

    /// As [`Self::take_band`], of quantities.
    ///
    /// # Errors
    /// As [`Self::take_band`].
    pub(super) fn take_quantities(
        &mut self,
        band: &QuantityBand,
        ground: Ground,
        map: &Raster<f32>,
        cell_m: f64,
        most: usize,
    ) -> Result<(), Refusal> {
        let known = self.maps.get(&band.name).map(|map| &map.descriptor);
        // A program may publish a layer before it has measured any of it.
        if known.is_none() && !map.values.iter().any(|quantity| quantity.is_finite()) {
            return Ok(());
        }
        let configured = self.scales.get(&band.name).copied();
        let layer = quantity_layer(band, map, known, configured, self.next_share())?;
        self.check_layer(&layer)?;
        let levels = levels_of(&layer, ground, map, cell_m)?;
        self.take_levels(layer, &levels, most)
    }

    /// The share of a new band: the configured one, or what the others have left.
    fn next_share(&self) -> u8 {
        let used: u32 = self.maps.values().map(|map| u32::from(map.descriptor.share)).sum();
        self.share.min(100u32.saturating_sub(used) as u8)
    }

    /// Refuses a layer of another scale than before, and one beyond those of a map.
    fn check_layer(&self, layer: &LayerDescriptor) -> Result<(), Refusal> {
        let name = layer.name.to_string();
        let Some(BandMap { descriptor: known, .. }) = self.maps.get(&name) else {
            // The built-in layers have their own indexes.
            let more = self.maps.keys().filter(|name| !is_built_in(name)).count();
            let is_full = !is_built_in(&name) && more + BUILT_IN_LAYERS.len() >= LayerId::COUNT;
            return if is_full { Err(Refusal::TooManyBands(name)) } else { Ok(()) };
        };
        let is_same = LayerDescriptor { share: known.share, ..layer.clone() } == *known;
        if is_same { Ok(()) } else { Err(Refusal::OtherBand(name)) }
    }

    fn take_levels(&mut self, layer: LayerDescriptor, levels: &[(Cell, u8)], most: usize) -> Result<(), Refusal> {
        let name = layer.name.to_string();
        let more = levels.iter().filter(|(_, level)| *level != UNEXPLORED).map(|&(cell, _)| cell);
        match self.maps.get(&name) {
            Some(map) => check_room(map.levels.grid(), &map.erased, more, most)?,
            None => check_room(&LabelGrid::default(), &LabelGrid::default(), more, most)?,
        }
        self.maps.entry(name).or_insert_with(|| BandMap::new(layer)).take(levels);
        Ok(())
    }

    pub(super) fn has_changes(&self) -> bool {
        self.maps.values().any(|band| band.levels.has_changes())
    }

    /// Gives away about `most` changed cells of each band; a band without any is there too.
    pub(super) fn take_changes(&mut self, most: usize) -> Vec<(LayerDescriptor, Vec<(Cell, u8)>)> {
        self.maps.values_mut().map(|band| (band.descriptor.clone(), band.levels.take(most))).collect()
    }
}

fn scale(range: &BandRange) -> Option<(String, BandScale)> {
    Some((range.band.clone(), BandScale::between(range.low, range.high)?))
}

/// The level that a grid of a band gives to each cell; [`UNEXPLORED`] where its quantity is not known.
fn levels(band: &Band, ground: Ground, raster: &Raster, cell_m: f64) -> Result<Vec<(Cell, u8)>, Refusal> {
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
fn levels_of(
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
fn descriptor(band: &Band, share: u8) -> LayerDescriptor {
    let lowest = band.offset.value() + band.scale.value() * f64::from(lowest(band));
    layer((&band.name, &band.unit), lowest, band.scale, share)
}

/// The layer of a band of quantities; `known` is the one that it has already, `configured`
/// the scale for a band that states none.
///
/// # Errors
/// It has another scale already, or none can be chosen.
fn quantity_layer(
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
fn is_built_in(name: &str) -> bool {
    BUILT_IN_LAYERS.iter().any(|layer| layer.descriptor.name == name)
}
