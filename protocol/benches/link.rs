//! Speed of the two ends on one core, without a channel: each frame is received when its airtime is over.
//!
//! `cargo bench -p scenecast-protocol --bench link`

use divan::Bencher;
use divan::counter::ItemsCount;
use scenecast_protocol::link::{SlotInboxState, SurfaceConfig, SurfaceLink, VehicleConfig, VehicleLink};
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::map::{StateReplica, StateSource};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, MissionId, VehicleStatus};
use std::collections::BTreeMap;
use std::time::Duration;

const FRAMES: u64 = 2000;

fn main() {
    divan::main();
}

/// Frames sent and received by both ends together, under load.
#[divan::bench(args = [64, 256, 1000])]
fn frames(bencher: Bencher<'_, '_>, frame_bytes: usize) {
    let mut wire = Wire::new(frame_bytes);
    wire.run(Duration::from_secs(300));
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        let until = wire.frames + FRAMES;
        wire.run_while(|w| w.frames < until);
    });
}

/// An hour of virtual time at 10 kbit/s with a map that always has more to send.
#[divan::bench(args = [64, 256, 1000], sample_count = 5)]
fn saturated_hour(bencher: Bencher<'_, '_>, frame_bytes: usize) {
    bencher.with_inputs(|| Wire::new(frame_bytes)).bench_local_values(|mut wire| wire.run(Duration::from_secs(3600)));
}

/// A state that always has content and takes almost no time.
#[derive(Debug, Default)]
struct Endless;

impl StateSource for Endless {
    type Carried = ();

    fn next_chunk(&mut self, room: usize, _now: Instant) -> Option<(Vec<u8>, ())> {
        (room > 0).then(|| (vec![0x5A; room], ()))
    }

    fn handle_fate(&mut self, _carried: (), _delivered: bool, _now: Instant) {}

    fn handle_peer_restart(&mut self, _now: Instant) {}

    fn backlog_bytes(&self) -> usize {
        20_000
    }

    fn is_converged(&self) -> bool {
        false
    }

    fn digest(&self) -> u16 {
        0
    }
}

impl StateReplica for Endless {
    fn apply(&mut self, _number: u64, _chunk: &[u8], _now: Instant) -> bool {
        true
    }

    fn advance_base(&mut self, _horizon: u64) {}

    fn base_digest(&self) -> u16 {
        0
    }

    fn version(&self) -> u64 {
        0
    }

    fn take(&mut self) -> Self {
        Self
    }
}

/// Two ends separated only by airtime.
struct Wire {
    now: Instant,
    modem: ModemProfile,
    vehicle: VehicleLink<Endless>,
    surface: SurfaceLink<Endless>,
    /// Frames on air by their end, and whether the surface sent them.
    on_air: BTreeMap<(Instant, bool), Vec<u8>>,
    frames: u64,
}

impl Wire {
    fn new(frame_bytes: usize) -> Self {
        let now = Instant::ZERO;
        let modem = ModemProfile {
            frame_bytes,
            bit_rate_bps: 10_000.0,
            overhead_bits: 0,
            turn_around: Duration::from_millis(200),
            access: Access::Shared,
        };
        let address = Address::vehicle(1).expect("a vehicle's number");
        let (mission, budget_bps) = (MissionId(7), 10_000);
        let vehicle = VehicleConfig::new(address, mission, modem, budget_bps);
        let surface = SurfaceConfig { vehicles: vec![address], ..SurfaceConfig::new(mission, modem, budget_bps) };
        let mut vehicle = VehicleLink::with_source(vehicle, Endless, 1, SlotInboxState::default(), now);
        vehicle.set_status(VehicleStatus::default());
        let surface = SurfaceLink::new(surface, 2, now);
        Self { now, modem, vehicle, surface, on_air: BTreeMap::new(), frames: 0 }
    }

    fn run(&mut self, duration: Duration) {
        let until = self.now + duration;
        self.run_while(|w| w.now < until);
    }

    fn run_while(&mut self, go_on: impl Fn(&Self) -> bool) {
        while go_on(self) {
            while self.surface.poll_event().is_some() {}
            while self.vehicle.poll_event().is_some() {}
            let said = [self.surface.poll_transmit(self.now), self.vehicle.poll_transmit(self.now)];
            for (transmit, by_surface) in said.into_iter().zip([true, false]) {
                let Some(transmit) = transmit else { continue };
                self.frames += 1;
                self.on_air.insert((self.now + self.modem.airtime(transmit.bytes.len()), by_surface), transmit.bytes);
            }
            self.now = self.next_event();
            self.handle_frames();
        }
    }

    fn next_event(&self) -> Instant {
        let timers = self.vehicle.poll_timeout().into_iter().chain(self.surface.poll_timeout(self.now));
        let timers = timers.map(|(at, _)| at).filter(|&at| at > self.now);
        let end = self.on_air.keys().next().map(|&(at, _)| at);
        timers.chain(end).min().unwrap_or(self.now + Duration::from_millis(200))
    }

    fn handle_frames(&mut self) {
        while let Some(entry) = self.on_air.first_entry().filter(|e| e.key().0 <= self.now) {
            let ((_, by_surface), bytes) = entry.remove_entry();
            if by_surface {
                self.surface.handle_transmit_outcome(self.now);
                self.vehicle.handle_frame(&bytes, self.now);
            } else {
                self.vehicle.handle_transmit_outcome(self.now);
                self.surface.handle_frame(&bytes, self.now);
            }
        }
    }
}
