//! Two ends on a virtual clock with an unkind pipe between them.

use scenecast_protocol::directive::{Constraints, Slot, Utility};
use scenecast_protocol::link::{SlotInboxState, SurfaceConfig, SurfaceLink, VehicleConfig, VehicleEvent, VehicleLink};
use scenecast_protocol::mac::{MasterConfig, ModemProfile};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, MissionId, SessionId, SlotState, VehicleStatus};
use std::collections::BTreeMap;
use std::time::Duration;

/// What the water does to frames.
#[derive(Debug, Clone)]
pub(crate) struct Water {
    pub(crate) loss: f64,
    pub(crate) duplication: f64,
    pub(crate) reordering: f64,
    pub(crate) corruption: f64,
    pub(crate) propagation: Duration,
}

pub(crate) struct Pair {
    pub(crate) now: Instant,
    /// Whether nothing of the surface (0) or of the vehicle (1) gets through.
    pub(crate) mute: [bool; 2],
    pub(crate) vehicle: VehicleLink,
    pub(crate) surface: SurfaceLink,
    pub(crate) water: Water,
    pub(crate) audits: [Audit; 2],
    /// Slots applied at the vehicle: series is constant a run of the surface, so versions must not repeat.
    pub(crate) applied: Vec<Slot>,
    modem: ModemProfile,
    budget_bps: u32,
    codec: Codec,
    random: u64,
    on_air: BTreeMap<(Instant, u64), Event>,
    serial: u64,
    durable: SlotInboxState,
}

enum Event {
    Sent { by_vehicle: bool },
    Arrives { at_vehicle: bool, bytes: Vec<u8> },
}

pub(crate) fn auv() -> Address {
    Address::vehicle(1).unwrap()
}

impl Pair {
    pub(crate) fn new(seed: u64, frame_bytes: usize, budget_bps: u32, codec: Codec, water: Water) -> Self {
        let modem = ModemProfile {
            frame_bytes,
            bit_rate_bps: 10_000.0,
            overhead_bits: 0,
            turn_around: Duration::from_millis(200),
        };
        let now = Instant::from_secs_f64(1000.0);
        let window = Duration::from_secs(10);
        Self {
            now,
            mute: [false; 2],
            vehicle: vehicle(modem, budget_bps, codec, seed as u16, SlotInboxState::default(), now),
            surface: surface(modem, budget_bps, seed, now),
            water,
            audits: [Audit::new(window), Audit::new(window)],
            applied: Vec::new(),
            modem,
            budget_bps,
            codec,
            random: seed ^ 0xABCD,
            on_air: BTreeMap::new(),
            serial: 0,
            durable: SlotInboxState::default(),
        }
    }

    pub(crate) fn draw(&mut self) -> f64 {
        self.random = self.random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.random >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn restart_vehicle(&mut self, map: &LabelGrid) {
        let session = (self.draw() * 65535.0) as u16;
        self.vehicle = vehicle(self.modem, self.budget_bps, self.codec, session, self.durable.clone(), self.now);
        self.vehicle.set_map(map.iter(), self.now);
        self.on_air.retain(|_, e| !matches!(e, Event::Sent { by_vehicle: true }));
    }

    pub(crate) fn restart_surface(&mut self) {
        let seed = (self.draw() * 1e15) as u64;
        self.surface = surface(self.modem, self.budget_bps, seed, self.now);
        self.on_air.retain(|_, e| !matches!(e, Event::Sent { by_vehicle: false }));
    }

    pub(crate) fn shown(&self) -> &LabelGrid {
        self.surface.vehicle(auv()).unwrap().replica().shown()
    }

    pub(crate) fn is_converged(&self) -> bool {
        self.shown() == self.vehicle.map() && self.vehicle.is_settled()
    }

    /// Runs until `until`, or until both maps agree if that is asked for.
    pub(crate) fn run(&mut self, until: Instant, stop_when_converged: bool) {
        loop {
            self.pump();
            if stop_when_converged && self.is_converged() {
                return;
            }
            let timers = [self.vehicle.poll_timeout(), self.surface.poll_timeout()];
            let timer = timers.into_iter().flatten().map(|(at, _)| at).min();
            let event = self.on_air.first_key_value().map(|((at, _), _)| *at);
            let Some(next) = timer.into_iter().chain(event).min() else { return };
            // A timer that has passed but led to no frame waits for the next event.
            let next = if next <= self.now { event.unwrap_or(self.now + Duration::from_millis(50)) } else { next };
            if next > until {
                self.now = until;
                return;
            }
            self.now = next.max(self.now);
            let later = self.on_air.split_off(&(self.now, u64::MAX));
            for event in std::mem::replace(&mut self.on_air, later).into_values() {
                self.handle(event);
            }
        }
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Sent { by_vehicle: true } => self.vehicle.handle_transmit_outcome(),
            Event::Sent { by_vehicle: false } => self.surface.handle_transmit_outcome(self.now),
            Event::Arrives { at_vehicle: true, bytes } => self.vehicle.handle_frame(&bytes, self.now),
            Event::Arrives { at_vehicle: false, bytes } => self.surface.handle_frame(&bytes, self.now),
        }
    }

    fn pump(&mut self) {
        while let Some(event) = self.vehicle.poll_event() {
            if let VehicleEvent::Slot { id, content: Some(slot), .. } = event {
                self.applied.push(slot);
                self.vehicle.decide(id, SlotState::Applied, self.now);
                self.durable = self.vehicle.persistent_state().clone();
                self.vehicle.handle_persisted();
            }
        }
        while self.surface.poll_event().is_some() {}
        self.vehicle.set_status(VehicleStatus { labels: 3, ..VehicleStatus::default() });
        if let Some(t) = self.vehicle.poll_transmit(self.now) {
            self.transmit(t.bytes, true);
        }
        if let Some(t) = self.surface.poll_transmit(self.now) {
            self.transmit(t.bytes, false);
        }
    }

    fn transmit(&mut self, bytes: Vec<u8>, by_vehicle: bool) {
        assert!(bytes.len() <= self.modem.frame_bytes);
        self.audits[usize::from(by_vehicle)].record(self.modem.bits_on_air(bytes.len()), self.now);
        let end = self.now + self.modem.airtime(bytes.len());
        self.schedule(end, Event::Sent { by_vehicle });
        let copies = 1 + u32::from(self.draw() < self.water.duplication);
        for _ in 0..copies {
            if self.draw() < self.water.loss || self.mute[usize::from(by_vehicle)] {
                continue;
            }
            let mut bytes = bytes.clone();
            if self.draw() < self.water.corruption {
                let bit = (self.draw() * bytes.len() as f64 * 8.0) as usize;
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
            let late = if self.draw() < self.water.reordering { self.draw() * 20.0 } else { 0.0 };
            let at = end + self.water.propagation + Duration::from_secs_f64(late);
            self.schedule(at, Event::Arrives { at_vehicle: !by_vehicle, bytes });
        }
    }

    fn schedule(&mut self, at: Instant, event: Event) {
        self.serial += 1;
        self.on_air.insert((at, self.serial), event);
    }
}

fn vehicle(
    modem: ModemProfile,
    budget_bps: u32,
    codec: Codec,
    session: u16,
    durable: SlotInboxState,
    now: Instant,
) -> VehicleLink {
    let config = VehicleConfig {
        address: auv(),
        mission: MissionId(7),
        modem,
        budget_bps,
        budget_window: Duration::from_secs(10),
        codec,
        replicate_map: true,
        exemplar_share: 0.2,
        status_period: Duration::from_secs(10),
    };
    VehicleLink::new(config, SessionId::from_random(session), durable, now)
}

fn surface(modem: ModemProfile, budget_bps: u32, seed: u64, now: Instant) -> SurfaceLink {
    let config = SurfaceConfig {
        mission: MissionId(7),
        modem,
        budget_bps,
        budget_window: Duration::from_secs(10),
        master: MasterConfig::default(),
        vehicles: vec![auv()],
    };
    SurfaceLink::new(config, seed, now)
}

/// A patchy map of `side` x `side` cells that differs with `phase`.
pub(crate) fn patchy(side: i32, phase: u64) -> LabelGrid {
    let label = |x: i32, y: i32| {
        let (fx, fy, p) = (f64::from(x), f64::from(y), phase as f64);
        (((fx * 0.13 + p).sin() + (fy * 0.17 - p * 0.7).cos() + 2.0) * 1.9) as u8 + 1
    };
    (0..side).flat_map(|y| (0..side).map(move |x| (Cell::new(x - side / 2, y - 3), label(x, y)))).collect()
}

pub(crate) fn utility(weight: i8) -> Slot {
    Slot::Utility(Utility { weights: [(1, weight)].into_iter().collect(), ..Utility::default() })
}

pub(crate) fn hold(hold: bool) -> Slot {
    Slot::Constraints(Constraints { hold })
}
