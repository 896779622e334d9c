//! A host of your own: each end runs in a thread with the system's clock and a modem of which the crate knows only the
//! profile. Here a modem is a pair of queues; a real one would be a serial port.
//!
//! `cargo run -p scenecast-protocol --example own_modem`

// The crate reads no clock; this host does.
#![allow(clippy::disallowed_methods)]

use scenecast_protocol::link::{SlotInboxState, SurfaceConfig, SurfaceEvent, SurfaceLink, VehicleConfig, VehicleLink};
use scenecast_protocol::mac::{Access, MasterConfig, ModemProfile};
use scenecast_protocol::map::Cell;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, CellEdge, MissionId};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;

/// A fast cable instead of the sea, so that the example takes less than a second.
const MODEM: ModemProfile = ModemProfile {
    frame_bytes: 256,
    bit_rate_bps: 1e7,
    overhead_bits: 0,
    turn_around: Duration::ZERO,
    access: Access::Shared,
};
const MISSION: MissionId = MissionId(9);
const BUDGET_BPS: u32 = 5_000_000;
const WINDOW: Duration = Duration::from_secs(1);
/// The cells of the map, a hundred a row.
const CELLS: i32 = 10_000;
/// The longest wait of a host without a timer.
const MAX_WAIT: Duration = Duration::from_millis(50);

/// A modem with two calls: one transmits a frame, the other waits for a received one.
struct QueueModem {
    out: Sender<Vec<u8>>,
    input: Receiver<Vec<u8>>,
}

impl QueueModem {
    /// A send blocks until the frame has left, and fails when the peer is gone.
    fn transmit(&self, frame: Vec<u8>) -> bool {
        self.out.send(frame).is_ok()
    }

    fn receive(&self, wait: Duration) -> Result<Vec<u8>, RecvTimeoutError> {
        self.input.recv_timeout(wait)
    }
}

/// The host's clock: microseconds since its start. The ends need not agree on it.
struct Clock(std::time::Instant);

impl Clock {
    fn now(&self) -> Instant {
        Instant::from(self.0.elapsed())
    }
}

/// Public because `tests/protocol/examples.rs` includes this file and runs it as a test.
pub fn main() {
    let vehicle = Address::vehicle(3).expect("1 to 14");
    let ((to_vehicle, from_surface), (to_surface, from_vehicle)) = (channel(), channel());
    let below = thread::spawn(move || run_vehicle(vehicle, &QueueModem { out: to_surface, input: from_surface }));
    let shown = run_surface(vehicle, &QueueModem { out: to_vehicle, input: from_vehicle });
    let sent = below.join().expect("the vehicle's thread");
    println!("the vehicle has sent {sent} frames; the surface shows {shown} cells");
    assert_eq!(shown, CELLS as usize);
}

/// Labels without a pattern, so that the map takes many frames.
fn label(cell: i32) -> u8 {
    (cell.wrapping_mul(40_503) >> 7) as u8 % 20 + 1
}

/// The vehicle's host: it runs until the surface has the map.
fn run_vehicle(address: Address, modem: &QueueModem) -> u64 {
    let clock = Clock(std::time::Instant::now());
    let config = VehicleConfig {
        address,
        mission: MISSION,
        cell_edge: CellEdge::default(),
        origin: None,
        modem: MODEM,
        budget_bps: BUDGET_BPS,
        budget_window: WINDOW,
        shares: Shares::default(),
        status_period: Duration::from_secs(5),
        authenticity: None,
    };
    // A host at sea takes the seed from the operating system, and the state of the slots from its journal.
    let mut link = VehicleLink::new(config, Codec::Auto, 1, SlotInboxState::default(), clock.now());
    link.set_map((0..CELLS).map(|i| (Cell::new(i % 100, i / 100), label(i))), clock.now());
    while !link.is_converged() {
        while link.poll_event().is_some() {}
        while let Some(frame) = link.poll_transmit(clock.now()) {
            if !modem.transmit(frame.bytes) {
                return link.stats().frames_sent;
            }
            link.handle_transmit_outcome(clock.now());
        }
        let wait = link.poll_timeout().map_or(MAX_WAIT, |(at, _)| at.since(clock.now()).min(MAX_WAIT));
        match modem.receive(wait) {
            Ok(bytes) => link.handle_frame(&bytes, clock.now()),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    link.stats().frames_sent
}

/// The surface's host: it runs until the vehicle hangs up, and returns the number of cells that it shows.
fn run_surface(vehicle: Address, modem: &QueueModem) -> usize {
    let clock = Clock(std::time::Instant::now());
    let config = SurfaceConfig {
        name: Default::default(),
        abort_lifetime: None,
        mission: MISSION,
        cell_edge: CellEdge::default(),
        origin: None,
        modem: MODEM,
        budget_bps: BUDGET_BPS,
        budget_window: WINDOW,
        shares: Shares::default(),
        master: MasterConfig {
            max_propagation: Duration::from_millis(20),
            max_idle: Duration::from_millis(100),
            ..MasterConfig::default()
        },
        vehicles: vec![vehicle],
        discovery_period: None,
        authenticity: None,
    };
    let mut link: SurfaceLink = SurfaceLink::new(config, 2, clock.now());
    let shown = |link: &SurfaceLink| link.vehicle(vehicle).map_or(0, |view| view.replica().shown().explored());
    let mut last = 0;
    'host: loop {
        while let Some(event) = link.poll_event() {
            if event == SurfaceEvent::MapChanged(vehicle) && shown(&link) != last {
                last = shown(&link);
                println!("{:7.3} s  the surface shows {last} cells", clock.now().as_secs_f64());
            }
        }
        while let Some(frame) = link.poll_transmit(clock.now()) {
            if !modem.transmit(frame.bytes) {
                break 'host;
            }
            link.handle_transmit_outcome(clock.now());
        }
        let now = clock.now();
        let wait = link.poll_timeout(now).map_or(MAX_WAIT, |(at, _)| at.since(now).min(MAX_WAIT));
        match modem.receive(wait) {
            Ok(bytes) => link.handle_frame(&bytes, clock.now()),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    shown(&link)
}
