//! One item: its time, the names of classes in it and its content.

use crate::raster::Raster;
use scenecast_protocol::map::{ClassEntry, Decimal};

/// An item of labels or of a band.
#[derive(Debug, Clone, PartialEq)]
pub struct Item {
    pub time: ItemTime,
    /// Names and colours of classes.
    pub classes: Vec<ClassEntry>,
    pub content: Content,
}

/// When the picture of an item was taken.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ItemTime {
    /// At the time of its arrival.
    #[default]
    Arrival,
    /// At this mission time, in seconds.
    Mission(f64),
    /// At this time, in seconds since 1970 (UTC).
    Unix(f64),
    /// This many seconds before its arrival.
    Age(f64),
}

/// The content of an item.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// Names and colours of classes, and no map.
    Classes,
    /// A segmented image of a camera that looks down: pixel value = class, 255 = unknown.
    Image {
        /// `None`: the vehicle's own pose at the item's time.
        pose: Option<ImagePose>,
        /// Size of a pixel on the sea floor, metres; `None`: that of the camera.
        metres_per_pixel: Option<f64>,
        classes: Raster,
    },
    /// A grid that states the class of each of its cells; 255 makes a cell unknown.
    Grid { ground: Ground, classes: Raster },
    /// A grid of levels of a quantity.
    Band { band: Band, ground: Ground, levels: Raster },
    /// A grid of a quantity in its unit; not a number where it is not known.
    Quantities { band: QuantityBand, ground: Ground, quantities: Raster<f32> },
}

/// The pose of the camera in the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePose {
    /// Metres to the east and to the north of the origin.
    pub x_m: f64,
    pub y_m: f64,
    /// Depth of the camera below the surface of the water, metres.
    pub depth_m: f64,
    /// Heading of the top of the image, radians clockwise from north.
    pub heading_rad: f64,
}

/// The place of a grid in the map frame. Its rows go from north to south, as those of an image do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ground {
    /// The south-west corner of the grid: metres to the east and to the north of the origin.
    pub west_m: f64,
    pub south_m: f64,
    /// Edge of a cell of the grid, metres.
    pub cell_m: f64,
}

/// The meaning of the values of a band: `offset + scale * value`.
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    pub name: String,
    pub unit: String,
    pub scale: Decimal,
    pub offset: Decimal,
    /// The value of cells without a quantity.
    pub no_data: u8,
}

/// A band whose quantities become levels on the vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantityBand {
    pub name: String,
    pub unit: String,
    /// `None`: the scale is chosen from the first quantities.
    pub scale: Option<BandScale>,
}

/// The levels of a band: level n stands for `low + (n - 1) * step`, n from 1 to 254.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandScale {
    pub low: f64,
    pub step: Decimal,
}

impl BandScale {
    /// Steps between the lowest and the highest level.
    const STEPS: f64 = 253.0;

    /// Levels from `low` to `high`, or a little above it; `None` unless both are at most 1e9 and differ enough.
    pub fn between(low: f64, high: f64) -> Option<Self> {
        let step = (high - low) / Self::STEPS;
        let is_in_range = low.abs() <= 1e9 && high.abs() <= 1e9 && step >= 1e-9;
        is_in_range.then(|| Self { low: Decimal::nearest(low).value(), step: Decimal::nearest(step) })
    }

    /// Levels for quantities like these: half as wide again as their range, in a round step. `None` if none is finite.
    pub fn around(quantities: &[f32]) -> Option<Self> {
        let finite = || quantities.iter().filter(|q| q.is_finite() && q.abs() <= 5e8).map(|&q| f64::from(q));
        let (low, high) = (finite().reduce(f64::min)?, finite().reduce(f64::max)?);
        let span = (high - low).max(low.abs().max(high.abs()) * 1e-3).max(1e-3);
        let step = round_up(span * 1.5 / Self::STEPS);
        let below = (Self::STEPS * step - (high - low)) / 2.0;
        // A quantity that is never negative does not become so.
        let first = if low >= 0.0 { (low - below).max(0.0) } else { low - below };
        Some(Self { low: Decimal::nearest((first / step).floor() * step).value(), step: Decimal::nearest(step) })
    }
}

/// The next number of 1, 2 and 5 times a power of ten.
fn round_up(value: f64) -> f64 {
    let power = 10f64.powf(value.log10().floor());
    [1.0, 2.0, 5.0]
        .into_iter()
        .map(|digit| digit * power)
        .find(|round| *round >= value * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chosen_scale_holds_the_quantities_with_room_on_both_sides() {
        for quantities in [&[-31.5, f32::NAN, -12.25][..], &[0.0, 100.0], &[7.0], &[f32::NAN, 0.0], &[1e-4, 3e8]] {
            let BandScale { low, step } = BandScale::around(quantities).unwrap();
            let high = low + BandScale::STEPS * step.value();
            let known = quantities.iter().filter(|q| !q.is_nan()).map(|&q| f64::from(q));
            assert!(known.clone().all(|q| low <= q && q <= high), "{quantities:?}: {low} to {high}");
            assert!(low >= 0.0 || known.clone().any(|q| q < 0.0));
        }
        assert_eq!(BandScale::around(&[f32::NAN, f32::INFINITY]), None);
        let costs = BandScale::around(&[0.0, 100.0]).unwrap();
        assert_eq!((costs.low, costs.step.value()), (0.0, 1.0));
        assert_eq!(BandScale::between(-40.0, 10.6).map(|scale| scale.step), Some(Decimal::new(2, -1)));
        assert_eq!((BandScale::between(1.0, 1.0), BandScale::between(f64::NAN, 1.0)), (None, None));
    }
}
