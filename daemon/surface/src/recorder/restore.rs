//! Puts the stored knowledge back into a surface that has just started.

use super::{command, stored};
use crate::Surface;
use crate::exemplar_cache::ExemplarCache;
use crate::floor_views::FloorViews;
use crate::record::{StoredBudget, SurfaceMemory, VehicleMemory};
use crate::track::{RegistrationRecord, Track};
use crate::vehicle_record::VehicleRecord;
use scenecast_protocol::directive::Series;
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, EquipmentFaults, RegistrationReport, VehicleStatus};
use std::collections::VecDeque;

/// Puts everything back but the maps, which the recorder gives to the surface as earlier maps.
pub(super) fn restore(surface: &mut Surface, memory: &SurfaceMemory, configured: &StoredBudget) {
    let now = Instant::from_micros(memory.last.mission_us);
    if let Some(began) = memory.began {
        surface.link.restore_series(Series::from_random(began.series));
    }
    if let Some((budget, _)) = memory.budget.as_ref().filter(|(_, then)| then == configured) {
        surface.link.set_budget(budget.bits_per_s, now);
        surface.link.set_shares(Shares(budget.shares));
        BackgroundOrder::from_bytes(&budget.background).into_iter().for_each(|order| surface.set_background(order));
    }
    surface.restore_log(&memory.log);
    command::restore(surface, memory);
    for (&number, vehicle) in &memory.vehicles {
        let Some(address) = Address::vehicle(number) else { continue };
        let (series, orders) =
            (Series::from_random(vehicle.orders.series), vehicle.orders.sent.iter().filter_map(stored::progress));
        if !surface.link.restore_orders(address, series, orders, now) {
            continue;
        }
        let known = vehicle.orders.in_force.iter().filter_map(|bytes| stored::slot(bytes));
        surface.link.restore_in_force(address, known);
        let record = surface.records.entry(address).or_insert_with(|| VehicleRecord::new(vehicle.name.clone()));
        restore_record(record, vehicle);
    }
}

fn restore_record(record: &mut VehicleRecord, memory: &VehicleMemory) {
    (record.run, record.epoch) = (memory.id.run, memory.id.epoch);
    stored::restore_intent(&memory.orders.intent, record);
    stored::restore_places(&memory.orders.places, record);
    let track = |points: &VecDeque<(u64, f64, f64)>, total| {
        Track::restored(points.iter().map(|&(at, x, y)| (Instant::from_micros(at), x, y)), total)
    };
    record.track = track(&memory.travel.track, memory.travel.track_total);
    let report = memory.travel.registration.as_ref().and_then(|(at, bytes)| {
        Some((RegistrationReport::decode((**bytes).try_into().ok()?), Instant::from_micros(*at)))
    });
    record.registration =
        RegistrationRecord::restored(report, track(&memory.travel.closures, memory.travel.closures_total));
    let last_received = memory.contact.last_received.map(Instant::from_micros);
    let faults = EquipmentFaults::decode(memory.faults);
    let status = memory.contact.status().map(|(status, at)| (VehicleStatus { faults, ..status }, at));
    record.restore_contact(status, last_received, memory.contact.pause());
    record.found = memory.contact.range();
    record.earlier.version_base = memory.map_version.saturating_add(1);
    let mut exemplars = ExemplarCache::default();
    for (&label, images) in &memory.images.exemplars {
        images.iter().for_each(|image| exemplars.restore_image(label, stored::exemplar(image)));
    }
    for (&label, (serial, open)) in &memory.images.requests {
        exemplars.restore_request(label, *serial, open.as_ref().map(|open| stored::open_request(label, open)));
    }
    record.exemplars = exemplars;
    record.floor = FloorViews::of_epoch(memory.id.epoch);
    let mut floor: Vec<_> = memory.images.floor.values().map(stored::exemplar).collect();
    floor.sort_by_key(|view| view.received);
    floor.into_iter().for_each(|view| record.floor.insert(view));
    record.annotations.labels.clone_from(&memory.annotations.labels);
    record.labels.tree = memory.tree();
    record.annotations.notes.clone_from(&memory.annotations.notes);
    record.annotations.markers.clone_from(&memory.annotations.markers);
    record.annotations.draft.clone_from(&memory.annotations.draft);
}
