//! A surface that calls for vehicles that it does not know.

use scenecast_core::Area;
use scenecast_core::tuning_table::TuningTable;
use scenecast_host::{SurfaceHost, VehicleHost, VehicleHostEvent, channel_station};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_vehicle::Durable;
use std::time::Duration;

#[test]
fn a_vehicle_that_answers_a_discovery_call_gets_a_record() {
    let load = |sets: &[&str]| {
        scenecast_config::load(None, &sets.iter().map(|s| (*s).to_owned()).collect::<Vec<_>>()).unwrap()
    };
    let modem = scenecast_config::modem_profile(&load(&[]), 10_000.0);
    let area = Area { west: 0.0, south: 0.0, east: 20.0, north: 20.0 };
    let far = load(&["vehicle.address=3"]);
    let vehicle = scenecast_vehicle::assemble(&far, None, modem, area, Durable::default(), 7, Instant::ZERO).unwrap();
    let surface = scenecast_surface::assemble(
        &load(&["link.discovery_period_s=60"]),
        None,
        TuningTable::shipped(),
        modem,
        8,
        Instant::ZERO,
    )
    .unwrap();
    let third = Address::vehicle(3).unwrap();
    let station = || channel_station(modem, Duration::from_secs(10), Instant::ZERO);
    let mut vehicle = VehicleHost::new(vehicle, station(), None);
    let mut surface = SurfaceHost::new(surface, station(), None);
    let mut under_way: Vec<(Instant, bool, Vec<u8>)> = Vec::new();
    for tick in 0..6000 {
        let now = Instant::ZERO + Duration::from_millis(100) * tick;
        vehicle.handle_timeout(now);
        surface.handle_timeout(now);
        for (_, up, bytes) in under_way.extract_if(.., |(at, ..)| *at <= now) {
            match up {
                true => surface.link_mut().handle_bytes(&bytes, now),
                false => vehicle.link_mut().handle_bytes(&bytes, now),
            }
        }
        while let Some(event) = vehicle.poll_event() {
            if event == VehicleHostEvent::Persist {
                vehicle.handle_persisted();
            }
        }
        while surface.poll_event().is_some() {}
        for (up, sent) in [(true, vehicle.poll_output(now)), (false, surface.poll_output(now))] {
            under_way.extend(sent.map(|bytes| (now + modem.airtime(bytes.len()), up, bytes)));
        }
    }
    let surface = surface.surface();
    assert_eq!(surface.record(third).unwrap().name, "vehicle 3");
    assert!(surface.view(third).unwrap().status().is_some());
    assert!(surface.view(Address::vehicle(1).unwrap()).unwrap().last_received().is_none());
}

#[test]
fn a_surface_speaks_with_all_configured_vehicles_by_their_names() {
    let sets = ["link.vehicles=[4, 1]", "vehicle.name=nereus"].map(str::to_owned);
    let config = scenecast_config::load(None, &sets).unwrap();
    let surface = scenecast_surface::assemble(
        &config,
        None,
        TuningTable::shipped(),
        scenecast_config::modem_profile(&config, 10_000.0),
        8,
        Instant::ZERO,
    )
    .unwrap();
    let names: Vec<(u8, &str)> = surface.vehicles().map(|(a, record)| (a.number(), record.name.as_str())).collect();
    assert_eq!(names, [(1, "nereus"), (4, "vehicle 4")]);
}
