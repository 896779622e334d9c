//! A script against the vehicle's end.

use super::link::{FuzzEnd, Grow, Pile, Setup, Surface, Vehicle, layers, run};
use super::peer::vehicle;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{RefusalReason, SlotId, SlotState};
use scenecast_protocol::link::{Transmit, VehicleEvent};
use scenecast_protocol::map::{Cell, LayerId};
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, PlannedPath, VehicleStatus};

/// No received bytes harm a vehicle. The first byte is the setup, the others are the script.
pub fn vehicle_link(data: &[u8]) {
    vehicle_events(data);
}

/// As [`vehicle_link`]; returns the number of events.
pub fn vehicle_events(data: &[u8]) -> usize {
    let Some((&choice, script)) = data.split_first() else { return 0 };
    let (setup, begin) = (Setup::new(choice), Instant::from_secs_f64(1000.0));
    let peer = setup.peer(Address::SURFACE, vehicle());
    let mut vehicle = setup.vehicle(Pile::default(), begin);
    layers().into_iter().for_each(|layer| assert!(vehicle.add_layer(layer)));
    (0..3).for_each(|what| vehicle.act(what, 30, begin));
    let surface: Surface<Pile> = setup.surface(begin);
    run(setup, vehicle, surface, peer, script)
}

impl<S: Grow> FuzzEnd for Vehicle<S> {
    fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        self.handle_frame(bytes, now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        self.poll_transmit(now)
    }

    fn handle_transmit_outcome(&mut self, now: Instant) {
        self.handle_transmit_outcome(now);
    }

    fn poll(&mut self, frames: u32, _: Instant) {
        self.handle_poll(frames);
    }

    fn wakeup(&self, _: Instant) -> Option<Instant> {
        self.poll_timeout().map(|(at, _)| at)
    }

    fn drain(&mut self, now: Instant) -> usize {
        let mut count = 0;
        while let Some(event) = self.poll_event() {
            count += usize::from(!matches!(event, VehicleEvent::Mismatch(_)));
            if let VehicleEvent::Slot { id, content, .. } = event {
                let refused = SlotState::Refused(RefusalReason::Malformed);
                self.decide(id, content.map_or(refused, |_| SlotState::Applied), now);
                self.handle_persisted();
            }
        }
        count
    }

    fn act(&mut self, what: u8, with: u8, now: Instant) {
        match what % 7 {
            0 => self.source_mut().grow(with, now),
            1 => drop(self.push_object(vec![with; 40 + usize::from(with) * 20])),
            2 => {
                let points = (1..=with % 11).map(|i| MapPoint::new(f64::from(i), f64::from(i ^ with))).collect();
                let path = PlannedPath { points, continues: with > 127 };
                let waypoint = (with > 9).then_some(MapPoint::default());
                self.set_status(VehicleStatus { labels: with, waypoint, path, ..VehicleStatus::default() });
            }
            3 => self.decide(SlotId::ALL[usize::from(with % 6)], SlotState::Refused(RefusalReason::TooOld), now),
            4 => self.renew(now),
            6 => {
                let cells = (0..i32::from(with)).map(|i| (Cell::new(i % 9, i / 9), f64::from(i * 7 % 100) / 100.0));
                self.set_layer(LayerId::CONFIDENCE, cells.clone(), now);
                self.set_layer(LayerId::CURIOSITY, cells.clone().map(|(cell, x)| (cell, 20.0 * x)), now);
                self.set_layer(LayerId::DEPTH, cells.map(|(cell, x)| (cell, 20.0 + 5.0 * x)), now);
            }
            _ => self.set_shares(Shares([with % 20; 5])),
        }
    }
}
