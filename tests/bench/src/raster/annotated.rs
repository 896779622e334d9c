//! An annotated map as labels of another program, sent once over the radio.

use super::{GIVE_UP, RasterSetting, copy};
use scenecast_core::UserError;
use scenecast_labels::{Content, Ground, Item, ItemTime, MAX_PICTURE_BYTES, Raster};
use scenecast_protocol::map::{MapSource, Replica};
use scenecast_protocol::map_codec::Codec;
use scenecast_rehearsal::{LinkRig, VirtualTime};
use scenecast_vehicle::{ForeignMap, ForeignSource};
use serde::Serialize;
use std::path::Path;
use std::time::Duration;

/// Pixels on each side of an item: a map is given in items of a bounded size, as a program would give it.
const ITEM: u32 = 1000;
/// Cells that the vehicle's end gets at once.
const SLICE: usize = 1 << 13;
/// Time between two comparisons of the copies.
const LOOK: Duration = Duration::from_secs(1);

/// The measurements of one map.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AnnotatedFigures {
    /// Cells that have a class, and the classes that there are.
    pub cells: usize,
    pub classes: usize,
    /// Whether the operator's copy was equal at the end, cell by cell, and when.
    pub is_equal: bool,
    pub seconds: f64,
    /// Bytes on air of the vehicle until then.
    pub bytes: u64,
}

/// Gives an annotated map to the vehicle, a PNG whose pixels are classes, and runs the radio until the operator has it, or for
/// an hour. The class 255 is unknown, and `unknown` too.
///
/// # Errors
/// The map is refused, as an item of another program would be.
pub fn annotated(
    setting: &RasterSetting,
    path: &Path,
    unknown: Option<u8>,
    seed: u64,
) -> Result<AnnotatedFigures, UserError> {
    let bytes = scenecast_config::read_regular(path, MAX_PICTURE_BYTES as u64)?;
    let item = Item::read(br#"{"kind":"grid","west_m":0,"south_m":0,"cell_m":1}"#, &bytes);
    let content = item.map_err(|why| UserError::file(path, why))?.content;
    let Content::Grid { classes, .. } = content else { return Err(UserError::file(path, "not a grid")) };
    let classes = classes.map(|class| if Some(class) == unknown { u8::MAX } else { class });
    send(setting, &classes, seed).map_err(|why| UserError::file(path, why))
}

fn send(setting: &RasterSetting, classes: &Raster, seed: u64) -> Result<AnnotatedFigures, UserError> {
    let sets = ["scene.cell_m=1".to_owned(), "labels.source=dir:.".to_owned()];
    let mut map = ForeignMap::new(&scenecast_config::load(None, &sets)?, 0);
    let mut rig: LinkRig<MapSource, Replica> = setting.rig(MapSource::new(Codec::Auto), seed)?;
    let began = rig.now;
    for item in items(classes) {
        let taken = map.handle_item(&item, ForeignSource::Labels, None, 0.0);
        taken.map_err(UserError::input)?;
    }
    let is_equal = |rig: &LinkRig<MapSource, Replica>, map: &ForeignMap| copy(rig).shown() == map.labels();
    while (map.has_changes() || !is_equal(&rig, &map)) && rig.now.since(began) < GIVE_UP {
        while map.has_changes() {
            let cells = map.take_changes(SLICE).labels.map(|changes| changes.cells).unwrap_or_default();
            rig.vehicle.end_mut().source_mut().set(cells, rig.now);
        }
        rig.run(LOOK);
    }
    let mut present = [false; 256];
    classes.values.iter().for_each(|&class| present[usize::from(class)] = true);
    Ok(AnnotatedFigures {
        cells: map.labels().explored(),
        classes: present[..255].iter().filter(|&&is_there| is_there).count(),
        is_equal: is_equal(&rig, &map),
        seconds: rig.now.since(began).as_secs_f64(),
        bytes: rig.bits_on_air()[0] / 8,
    })
}

/// The map in grids of at most [`ITEM`] x [`ITEM`] pixels, from the north.
fn items(classes: &Raster) -> impl Iterator<Item = Item> + '_ {
    let Raster { width, height, .. } = *classes;
    let steps = |side: u32| (0..side).step_by(ITEM as usize);
    steps(height).flat_map(move |top| steps(width).map(move |left| (left, top))).map(move |(left, top)| {
        let (columns, rows) = (ITEM.min(width - left), ITEM.min(height - top));
        let pixel = |row, column| classes.get(left + column, top + row).unwrap_or(u8::MAX);
        let values = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let values = values.map(|(row, column)| pixel(row, column)).collect();
        let south_m = f64::from(height - top - rows);
        let ground = Ground { west_m: f64::from(left), south_m, cell_m: 1.0 };
        let classes = Raster { width: columns, height: rows, values };
        Item { time: ItemTime::Arrival, classes: Vec::new(), content: Content::Grid { ground, classes } }
    })
}

#[cfg(test)]
mod tests {
    use super::super::Pattern;
    use super::*;
    use scenecast_protocol::mac::Access;

    #[test]
    fn an_annotated_map_arrives_cell_by_cell_in_spite_of_losses() {
        let setting = RasterSetting {
            side: 0,
            change: 0.0,
            pattern: Pattern::Patches,
            bit_rate_bps: 200_000.0,
            loss: 0.2,
            frame_bytes: 1000,
            access: Access::FullDuplex,
            duration: Duration::ZERO,
        };
        let class = |i: u32| match i / 1020 / 60 * 7 + i % 1020 / 90 {
            9 => 255,
            class => (class * 3 % 254) as u8,
        };
        let classes = Raster { width: 1020, height: 300, values: (0..1020 * 300).map(class).collect() };
        let figures = send(&setting, &classes, 2).unwrap();
        assert!(figures.is_equal && figures.seconds < 120.0, "{figures:?}");
        let known = classes.values.iter().filter(|&&class| class != 255).count();
        assert_eq!((figures.cells, items(&classes).count()), (known, 2));
    }
}
