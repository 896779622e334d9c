//! Orders under a mission key: the vehicle applies those of the surface, refuses one that it cannot obey, and drops the
//! frames of a station that does not hold the key.
//!
//! `cargo run -p scenecast-protocol --example authentic_orders`

use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{
    Constraints, Fence, OrderStatus, Polygon, RefusalReason, Slot, SlotId, SlotProgress, SlotState, Utility,
};
use scenecast_protocol::link::{
    Authenticity, DropReason, SlotInboxState, SurfaceConfig, SurfaceEvent, SurfaceLink, VehicleConfig, VehicleEvent,
    VehicleLink,
};
use scenecast_protocol::mac::{Access, MasterConfig, ModemProfile};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::seal::{HeldKey, MissionKey};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, CellEdge, MissionId, VehicleStatus};
use std::time::Duration;

const MODEM: ModemProfile = ModemProfile {
    frame_bytes: 128,
    bit_rate_bps: 1000.0,
    overhead_bits: 0,
    turn_around: Duration::from_millis(300),
    access: Access::Shared,
};

/// Public because `tests/protocol/examples.rs` includes this file and runs it as a test.
pub fn main() {
    // At sea the key comes from `scenecast key new`, and both ends read it from a file.
    let key = HeldKey::Mission(MissionKey::from_bytes(*b"sixteen secret b"));
    println!("fingerprint of the key: {:08x}\n", key.fingerprint());
    let mut sea = Sea::new(Some(Authenticity::new(key, true, true)));
    let vehicle = sea.address;

    sea.issue(Slot::Constraints(Constraints { hold: true, abort: false }));
    let weights = [(3, 80), (5, -20)].into_iter().collect();
    sea.issue(Slot::Utility(Utility { epoch: 0, exploration: 20, curiosity: 0, weights }));
    let outline = |points: [(i32, i32); 4]| Polygon(points.map(|(x, y)| DecimetrePoint::new(x * 10, y * 10)).into());
    sea.issue(Slot::Fence(Fence {
        fence: Some(outline([(500, 500), (600, 500), (600, 600), (500, 600)])),
        ..Fence::default()
    }));
    sea.run(Duration::from_secs(60));

    println!("\nA station that knows the mission number, but not the key, opens a handshake to order an abort:");
    let mut intruder: SurfaceLink = SurfaceLink::new(surface_config(vehicle, None), 99, sea.now);
    let abort = Slot::Constraints(Constraints { hold: false, abort: true });
    intruder.issue(vehicle, abort, sea.now).expect("it fits a frame");
    while let Some(frame) = intruder.poll_transmit(sea.now) {
        intruder.handle_transmit_outcome(sea.now);
        sea.vehicle.handle_frame(&frame.bytes, sea.now);
    }
    let dropped = sea.vehicle.stats().dropped[&DropReason::Unauthenticated];
    println!("  the vehicle drops its frames as unauthenticated: {dropped}");

    let view = sea.surface.vehicle(vehicle).expect("a known vehicle");
    let is_refused = |slot: &&SlotProgress| matches!(slot.status, OrderStatus::Refused(_));
    let refused: Vec<SlotId> = view.slots().filter(is_refused).map(|slot| slot.id).collect();
    assert_eq!(refused, [SlotId::Fence]);
    assert!(dropped > 0);
}

/// Two ends at one place: a frame arrives when its transmission ends.
struct Sea {
    now: Instant,
    address: Address,
    vehicle: VehicleLink,
    surface: SurfaceLink,
    status: VehicleStatus,
}

impl Sea {
    fn new(authenticity: Option<Authenticity>) -> Self {
        let (now, address) = (Instant::ZERO, Address::vehicle(1).expect("1 to 14"));
        let config = VehicleConfig {
            address,
            mission: MissionId(77),
            cell_edge: CellEdge::default(),
            origin: None,
            modem: MODEM,
            budget_bps: 500,
            budget_window: Duration::from_secs(10),
            shares: Shares::default(),
            status_period: Duration::from_secs(20),
            authenticity: authenticity.clone(),
        };
        Self {
            now,
            address,
            vehicle: VehicleLink::new(config, Codec::Auto, 5, SlotInboxState::default(), now),
            surface: SurfaceLink::new(surface_config(address, authenticity), 6, now),
            status: VehicleStatus { labels: 9, ..VehicleStatus::default() },
        }
    }

    fn issue(&mut self, slot: Slot) {
        let name = slot.id().name();
        let version = self.surface.issue(self.address, slot, self.now).expect("it fits a frame");
        println!("{:5.1} s  surface: {name}, version {version}, is queued", self.now.as_secs_f64());
    }

    fn run(&mut self, length: Duration) {
        let end = self.now + length;
        while self.now < end {
            self.handle_events();
            self.vehicle.set_status(self.status.clone());
            if let Some(frame) = self.surface.poll_transmit(self.now) {
                self.now = self.now + MODEM.airtime(frame.bytes.len());
                self.surface.handle_transmit_outcome(self.now);
                self.vehicle.handle_frame(&frame.bytes, self.now);
            } else if let Some(frame) = self.vehicle.poll_transmit(self.now) {
                self.now = self.now + MODEM.airtime(frame.bytes.len());
                self.vehicle.handle_transmit_outcome(self.now);
                self.surface.handle_frame(&frame.bytes, self.now);
            } else {
                let timers = [self.vehicle.poll_timeout(), self.surface.poll_timeout(self.now)];
                let next = timers.into_iter().flatten().map(|(at, _)| at).filter(|at| *at > self.now).min();
                self.now = next.unwrap_or(self.now + Duration::from_millis(200));
            }
        }
    }

    fn handle_events(&mut self) {
        while let Some(event) = self.vehicle.poll_event() {
            let VehicleEvent::Slot { id, content, .. } = event else { continue };
            let state = decision(content.as_ref());
            println!("{:5.1} s  vehicle: {} is {state:?}", self.now.as_secs_f64(), id.name());
            self.vehicle.decide(id, state, self.now);
            // A host at sea writes `persistent_state` to disk here; only then is the order acknowledged.
            self.vehicle.handle_persisted();
        }
        while let Some(event) = self.surface.poll_event() {
            if let SurfaceEvent::SlotDecided(_, id) = event {
                println!("{:5.1} s  surface: the decision on {} is known", self.now.as_secs_f64(), id.name());
            }
        }
    }
}

/// The vehicle's decision: it is at the origin, and refuses a fence that leaves it outside.
fn decision(slot: Option<&Slot>) -> SlotState {
    match slot {
        None => SlotState::Refused(RefusalReason::Malformed),
        Some(Slot::Fence(fence)) if fence.check().is_err() => SlotState::Refused(RefusalReason::Contradiction),
        Some(Slot::Fence(fence)) if !fence.allows(DecimetrePoint::new(0, 0)) => {
            SlotState::Refused(RefusalReason::Outside)
        }
        Some(Slot::Utility(utility)) if !utility.is_in_range() => SlotState::Refused(RefusalReason::OutOfRange),
        Some(_) => SlotState::Applied,
    }
}

fn surface_config(vehicle: Address, authenticity: Option<Authenticity>) -> SurfaceConfig {
    SurfaceConfig {
        name: Default::default(),
        abort_lifetime: None,
        mission: MissionId(77),
        cell_edge: CellEdge::default(),
        origin: None,
        modem: MODEM,
        budget_bps: 500,
        budget_window: Duration::from_secs(10),
        shares: Shares::default(),
        master: MasterConfig::default(),
        vehicles: vec![vehicle],
        discovery_period: None,
        authenticity,
    }
}
