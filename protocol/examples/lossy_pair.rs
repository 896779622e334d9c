//! Both ends of a link in virtual time: a vehicle's map reaches the surface over a channel that loses three frames in
//! ten.
//!
//! `cargo run -p scenecast-protocol --example lossy_pair`

use scenecast_protocol::link::{SlotInboxState, SurfaceConfig, SurfaceLink, Transmit, VehicleConfig, VehicleLink};
use scenecast_protocol::mac::{Access, MasterConfig, ModemProfile};
use scenecast_protocol::map::Cell;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, CellEdge, MissionId};
use std::time::Duration;

const LOSS_PERCENT: u64 = 30;
const PROPAGATION: Duration = Duration::from_millis(700);
const MODEM: ModemProfile = ModemProfile {
    frame_bytes: 64,
    bit_rate_bps: 800.0,
    overhead_bits: 0,
    turn_around: Duration::from_millis(200),
    access: Access::Shared,
};

/// Public because `tests/protocol/examples.rs` includes this file and runs it as a test.
pub fn main() {
    let address = Address::vehicle(1).expect("1 to 14");
    let mut channel = Channel { on_air: Vec::new(), random: 2026, sent: 0, lost: 0 };
    let mut now = Instant::ZERO;
    let mut vehicle = VehicleLink::new(vehicle_config(address), Codec::Auto, 11, SlotInboxState::default(), now);
    let mut surface: SurfaceLink = SurfaceLink::new(surface_config(address), 22, now);
    vehicle.set_map((0..128 * 128).map(|i| (Cell::new(i % 128, i / 128), label(i % 128, i / 128))), now);
    println!("A map of {} cells over a link that loses {LOSS_PERCENT} % of its frames\n", vehicle.map().explored());

    let mut reported = 0;
    while !vehicle.is_converged() {
        // Each end takes the frames that have reached it.
        for (at_vehicle, bytes) in channel.arrivals(now) {
            match at_vehicle {
                true => vehicle.handle_frame(&bytes, now),
                false => surface.handle_frame(&bytes, now),
            }
        }
        while vehicle.poll_event().is_some() {}
        while surface.poll_event().is_some() {}
        // The modem of an end transmits one frame at a time.
        if let Some(frame) = surface.poll_transmit(now) {
            now = channel.transmit(&frame, true, now);
            surface.handle_transmit_outcome(now);
        } else if let Some(frame) = vehicle.poll_transmit(now) {
            now = channel.transmit(&frame, false, now);
            vehicle.handle_transmit_outcome(now);
        } else {
            // Time jumps to the next arrival or timer.
            let timers = [vehicle.poll_timeout(), surface.poll_timeout(now)].into_iter().flatten().map(|(at, _)| at);
            let next = timers.chain(channel.on_air.iter().map(|(at, ..)| *at)).filter(|at| *at > now).min();
            now = next.unwrap_or(now + Duration::from_millis(200));
        }
        let view = surface.vehicle(address).expect("a known vehicle");
        let shown = view.replica().shown().explored();
        if shown >= reported + 2000 {
            println!("{:7.1} s  the surface shows {shown} cells", now.as_secs_f64());
            reported = shown;
        }
    }
    let view = surface.vehicle(address).expect("a known vehicle");
    assert_eq!(view.replica().shown(), vehicle.map());
    println!("{:7.1} s  both maps are equal and acknowledged", now.as_secs_f64());
    println!("\n{} frames sent, {} of them lost", channel.sent, channel.lost);
}

/// Patches of five labels with a frayed edge.
fn label(x: i32, y: i32) -> u8 {
    let fray = f64::from((x * 31 + y * 57) % 7) * 0.03;
    let (x, y) = (f64::from(x), f64::from(y));
    (((x * 0.13).sin() + (y * 0.17).cos() + 2.0 + fray) * 1.2) as u8 + 1
}

/// A channel that delays each frame and loses some.
struct Channel {
    /// The time of arrival, whether at the vehicle, and the frame.
    on_air: Vec<(Instant, bool, Vec<u8>)>,
    random: u64,
    sent: u32,
    lost: u32,
}

impl Channel {
    /// Transmits a frame; returns when it has left the modem.
    fn transmit(&mut self, frame: &Transmit, to_vehicle: bool, now: Instant) -> Instant {
        let end = now + MODEM.airtime(frame.bytes.len());
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.sent += 1;
        if (self.random >> 33) % 100 < LOSS_PERCENT {
            self.lost += 1;
        } else {
            self.on_air.push((end + PROPAGATION, to_vehicle, frame.bytes.clone()));
        }
        end
    }

    fn arrivals(&mut self, now: Instant) -> Vec<(bool, Vec<u8>)> {
        let due = self.on_air.extract_if(.., |(at, ..)| *at <= now);
        due.map(|(_, at_vehicle, bytes)| (at_vehicle, bytes)).collect()
    }
}

fn vehicle_config(address: Address) -> VehicleConfig {
    VehicleConfig {
        address,
        mission: MissionId(0x5CE7),
        cell_edge: CellEdge::default(),
        origin: None,
        modem: MODEM,
        budget_bps: 400,
        budget_window: Duration::from_secs(10),
        shares: Shares::default(),
        status_period: Duration::from_secs(30),
        authenticity: None,
    }
}

fn surface_config(address: Address) -> SurfaceConfig {
    SurfaceConfig {
        name: Default::default(),
        abort_lifetime: None,
        mission: MissionId(0x5CE7),
        cell_edge: CellEdge::default(),
        origin: None,
        modem: MODEM,
        budget_bps: 400,
        budget_window: Duration::from_secs(10),
        shares: Shares::default(),
        master: MasterConfig::default(),
        vehicles: vec![address],
        discovery_period: None,
        authenticity: None,
    }
}
