//! Bands of another program beside the scene model's map: what the link is given of them, and when.

use super::Vehicle;
use crate::{Durable, MapChanges};
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_protocol::directive::{Budget, CellBand, Change, Settings, Slot};
use scenecast_protocol::map::{
    Cell, Decimal, LayerDescriptor, LayerId, LayerSource, Palette, Quantity, Spread, Steps, UpperEnd,
};
use scenecast_protocol::schedule::{BackgroundOrder, BackgroundStream, Shares};
use scenecast_protocol::time::Instant;

const AREA: Area = Area { west: 0.0, south: 0.0, east: 40.0, north: 30.0 };
/// On the lattice of coarse cells, and beside it.
const COARSE: Cell = Cell { x: 4, y: 8 };
const FINE: Cell = Cell { x: 5, y: 8 };

fn vehicle() -> Vehicle {
    let config = Config::default();
    let profile = scenecast_config::modem_profile(&config, config.modem.bit_rate);
    crate::assemble(&config, None, profile, AREA, Durable::default(), 1, Instant::ZERO).unwrap()
}

fn descriptor(share: u8) -> LayerDescriptor {
    LayerDescriptor {
        name: "silt".into(),
        unit: "".into(),
        quantity: Quantity::Plain,
        scale: Decimal::new(1, 0),
        offset: Decimal::new(0, 0),
        steps: Steps::Equal,
        levels: 254,
        upper_end: UpperEnd::Unbounded,
        share,
        palette: Palette::Cividis,
        spread: Spread::Present,
    }
}

fn give(vehicle: &mut Vehicle, levels: &[(Cell, u8)]) {
    give_of(vehicle, 8, levels);
}

/// Gives levels of a band with this share of the link.
fn give_of(vehicle: &mut Vehicle, share: u8, levels: &[(Cell, u8)]) {
    let changes = MapChanges { bands: vec![(descriptor(share), levels.to_vec())], ..MapChanges::default() };
    vehicle.handle_changes(&changes, Instant::ZERO);
}

/// A map of the scene model in an epoch.
fn see(vehicle: &mut Vehicle, epoch: u8, cells: &[(Cell, u8)]) {
    vehicle.handle_changes(&MapChanges::of_labels(epoch, 4, cells.to_vec()), Instant::ZERO);
    vehicle.handle_persisted();
}

fn band(vehicle: &Vehicle) -> &LayerSource {
    vehicle.layers().find(|layer| layer.descriptor().name == "silt").unwrap()
}

/// The level that the link has of a cell of the band.
fn level(vehicle: &Vehicle, cell: Cell) -> u8 {
    band(vehicle).target().get(cell)
}

fn order(vehicle: &mut Vehicle, cells: CellBand) {
    let settings = Settings { cells: Change::To(cells), ..Settings::default() };
    vehicle.apply(Slot::Settings(settings), Instant::ZERO).unwrap();
}

#[test]
fn a_mapped_frame_leaves_bands_as_the_link_has_them() {
    let mut vehicle = vehicle();
    give(&mut vehicle, &[(COARSE, 9), (FINE, 9)]);
    see(&mut vehicle, 0, &[(FINE, 2)]);
    let id: LayerId = band(&vehicle).id();
    // Another level in the link shows whether it is given the band again.
    vehicle.link.set_layer(id, [(FINE, 19.5)], Instant::ZERO);
    let other = level(&vehicle, FINE);
    see(&mut vehicle, 0, &[(FINE, 3)]);
    assert_eq!((other != 9, level(&vehicle, FINE)), (true, other));
    order(&mut vehicle, CellBand::Fine);
    assert_eq!(level(&vehicle, FINE), 9, "a selection has it give all");
}

#[test]
fn a_new_epoch_keeps_the_bands() {
    let mut vehicle = vehicle();
    give(&mut vehicle, &[(COARSE, 9), (FINE, 7)]);
    see(&mut vehicle, 0, &[(FINE, 2)]);
    see(&mut vehicle, 1, &[(FINE, 2)]);
    assert_eq!((level(&vehicle, COARSE), level(&vehicle, FINE)), (9, 7));
}

#[test]
fn known_fine_cells_of_bands_follow_under_coarse_cells() {
    let mut vehicle = vehicle();
    give(&mut vehicle, &[(FINE, 7)]);
    order(&mut vehicle, CellBand::Coarse);
    let unknown = Cell::new(6, 8);
    give(&mut vehicle, &[(COARSE, 3), (FINE, 8), (unknown, 5)]);
    let levels = [COARSE, FINE, unknown].map(|cell| level(&vehicle, cell));
    assert_eq!(levels, [3, 8, 0], "the ground has no label");
    see(&mut vehicle, 0, &[(FINE, 2), (unknown, 2)]);
    give(&mut vehicle, &[(FINE, 0)]);
    assert_eq!(level(&vehicle, FINE), 0, "a cell that is no longer known");
    order(&mut vehicle, CellBand::Fine);
    assert_eq!(level(&vehicle, unknown), 5);
}

#[test]
fn a_band_that_is_sent_again_is_up_to_date() {
    let mut vehicle = vehicle();
    give_of(&mut vehicle, 0, &[]);
    let id = LayerId::new(scenecast_protocol::map::BUILT_IN_LAYERS.len()).unwrap();
    let budget = |vehicle: &mut Vehicle, background| {
        let shares = Shares([10; 5]);
        vehicle.set_budget(Budget { bits_per_s: 100, shares, background }, Instant::ZERO);
    };
    let with_it = BackgroundOrder::new(&[BackgroundStream::Layer(id)]).unwrap();
    budget(&mut vehicle, with_it);
    let gone = Cell::new(7, 8);
    give_of(&mut vehicle, 0, &[(FINE, 7), (gone, 7)]);
    order(&mut vehicle, CellBand::Coarse);
    budget(&mut vehicle, BackgroundOrder::default());
    assert!(vehicle.layers().all(|layer| layer.id() != id));
    give_of(&mut vehicle, 0, &[(FINE, 8), (gone, 0)]);
    budget(&mut vehicle, with_it);
    assert_eq!((level(&vehicle, FINE), level(&vehicle, gone)), (8, 0));
}

#[test]
fn a_level_no_longer_known_reaches_a_layer_that_rests() {
    let mut vehicle = vehicle();
    let depth = |vehicle: &mut Vehicle, level: u8| {
        let layers = [(LayerId::DEPTH, vec![(FINE, level)])].into();
        vehicle.handle_changes(&MapChanges { layers, ..MapChanges::default() }, Instant::ZERO);
    };
    let select = |vehicle: &mut Vehicle, cells: CellBand, layers: &[LayerId]| {
        let layers = Change::To(layers.iter().copied().collect());
        let settings = Settings { cells: Change::To(cells), layers, ..Settings::default() };
        vehicle.apply(Slot::Settings(settings), Instant::ZERO).unwrap();
    };
    select(&mut vehicle, CellBand::Fine, &[LayerId::DEPTH]);
    depth(&mut vehicle, 253);
    select(&mut vehicle, CellBand::Coarse, &[]);
    depth(&mut vehicle, 0);
    select(&mut vehicle, CellBand::Fine, &[LayerId::DEPTH]);
    let sent = vehicle.layers().find(|layer| layer.id() == LayerId::DEPTH).unwrap();
    assert_eq!(sent.target().get(FINE), 0);
}
