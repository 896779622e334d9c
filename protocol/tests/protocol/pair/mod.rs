//! Two ends in virtual time with an unreliable channel between them.

mod setup;
mod wiretap;

pub(crate) use setup::{CALM, LossyChannel, Setup};
pub(crate) use wiretap::Wiretap;

use scenecast_protocol::directive::{Constraints, Slot, SlotId, SlotState, Utility};
use scenecast_protocol::link::{
    Authenticity, SlotInboxState, SurfaceConfig, SurfaceEvent, SurfaceLink, VehicleConfig, VehicleEvent, VehicleLink,
};
use scenecast_protocol::mac::Access;
use scenecast_protocol::map::{Cell, LabelGrid, LayerDescriptor, LayerId, LayerSet, LayerSource};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::seal::HeldKey;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, VehicleStatus};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

pub(crate) struct LinkedEnds {
    pub(crate) now: Instant,
    /// Whether the frames of the surface (0) or of the vehicle (1) are all lost.
    pub(crate) mute: [bool; 2],
    pub(crate) vehicle: VehicleLink,
    pub(crate) surface: SurfaceLink,
    pub(crate) channel: LossyChannel,
    pub(crate) audits: [Audit; 2],
    /// Slots applied at the vehicle. A run of the surface has one series, so versions must not repeat.
    pub(crate) applied: Vec<Slot>,
    /// The settings in which the vehicle found the surface to differ.
    pub(crate) vehicle_events: Vec<VehicleEvent>,
    /// The first events of the surface since they were last taken.
    pub(crate) surface_events: Vec<SurfaceEvent>,
    /// The status of the vehicle.
    pub(crate) status: VehicleStatus,
    setup: Setup,
    random: u64,
    on_air: BTreeMap<(Instant, u64), PairEvent>,
    /// The frames in each modem, and whether it is transmitting.
    modems: [(VecDeque<Vec<u8>>, bool); 2],
    /// The last transmissions of both ends.
    pub(crate) overheard: VecDeque<Vec<u8>>,
    /// The first frames that were sent by either end, and whether each was lost.
    pub(crate) sent: Vec<(Vec<u8>, bool)>,
    pub(crate) wiretap: Wiretap,
    /// What the vehicle authenticates by, also after a restart.
    pub(crate) vehicle_keys: Option<Authenticity>,
    serial: u64,
    durable: SlotInboxState,
    /// The content in force that survives a restart of the vehicle.
    in_force: BTreeMap<SlotId, Slot>,
    /// The last quantities of the layers.
    quantities: Vec<(LayerId, Vec<(Cell, f64)>)>,
}

enum PairEvent {
    Sent { by_vehicle: bool },
    Arrives { at_vehicle: bool, bytes: Vec<u8> },
    Poll { of_vehicle: bool, frames: u32 },
}

pub(crate) fn auv() -> Address {
    Address::vehicle(1).unwrap()
}

impl LinkedEnds {
    pub(crate) fn new(seed: u64, setup: Setup, channel: LossyChannel) -> Self {
        let now = Instant::from_secs_f64(1000.0);
        let window = Duration::from_secs(10);
        Self {
            now,
            mute: [false; 2],
            vehicle: vehicle_of(&setup, seed ^ 0xA5A5, SlotInboxState::default(), now),
            surface: surface_of(&setup, seed, now),
            channel,
            audits: [Audit::new(window), Audit::new(window)],
            applied: Vec::new(),
            vehicle_events: Vec::new(),
            surface_events: Vec::new(),
            status: VehicleStatus { labels: 3, ..VehicleStatus::default() },
            random: seed ^ 0xABCD,
            on_air: BTreeMap::new(),
            modems: Default::default(),
            overheard: VecDeque::new(),
            sent: Vec::new(),
            wiretap: Wiretap::default(),
            vehicle_keys: setup.authenticity.clone(),
            serial: 0,
            durable: SlotInboxState::default(),
            in_force: BTreeMap::new(),
            quantities: Vec::new(),
            setup,
        }
    }

    pub(crate) fn draw(&mut self) -> f64 {
        self.random = self.random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.random >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn restart_vehicle(&mut self, map: &LabelGrid) {
        let seed = (self.draw() * 1e15) as u64;
        let setup = Setup { authenticity: self.vehicle_keys.clone(), ..self.setup.clone() };
        self.vehicle = vehicle_of(&setup, seed, self.durable.clone(), self.now);
        self.vehicle.assume_budget_spent(self.now);
        let in_force: Vec<Slot> = self.in_force.values().cloned().collect();
        in_force.into_iter().for_each(|slot| self.put_in_force(slot));
        self.vehicle.set_map(map.iter(), self.now);
        self.send_layers();
        self.forget_modem(true);
    }

    /// Sets confidences and depths of a `side` x `side` map that differ with `phase`.
    pub(crate) fn set_layers(&mut self, side: i32, phase: u64) {
        let cells = |of: fn(f64, f64, f64) -> f64| {
            let cell = |i: i32| Cell::new(i % side - side / 2, i / side - 3);
            let quantity = |at: Cell| (at, of(f64::from(at.x), f64::from(at.y), phase as f64));
            (0..side * side).map(cell).map(quantity).collect::<Vec<_>>()
        };
        self.quantities = vec![
            (LayerId::CONFIDENCE, cells(|x, y, p| ((x * 0.7 + y * 1.3 + p).sin() + 1.0) / 2.0)),
            (LayerId::DEPTH, cells(|x, y, p| 20.0 + (x * 0.11 + p).sin() * 4.0 + y * 0.2)),
        ];
        self.send_layers();
    }

    fn send_layers(&mut self) {
        for (id, cells) in &self.quantities {
            self.vehicle.set_layer(*id, cells.iter().copied(), self.now);
        }
    }

    /// What the surface authenticates by from its next restart on.
    pub(crate) fn set_surface_keys(&mut self, keys: Option<Authenticity>) {
        self.setup.authenticity = keys;
    }

    pub(crate) fn restart_surface(&mut self) {
        let seed = (self.draw() * 1e15) as u64;
        self.surface = surface_of(&self.setup, seed, self.now);
        self.surface.assume_budget_spent(self.now);
        self.forget_modem(false);
    }

    /// Has the vehicle obey a slot, as its host does.
    pub(crate) fn put_in_force(&mut self, slot: Slot) {
        let slot = match (slot, self.in_force.get(&SlotId::Settings)) {
            (Slot::Settings(order), Some(Slot::Settings(before))) => Slot::Settings(before.then(&order)),
            (slot, _) => slot,
        };
        if let Slot::Budget(budget) = &slot {
            self.vehicle.set_budget(budget.bits_per_s, self.now);
            self.vehicle.set_shares(budget.shares);
            self.vehicle.set_background(budget.background);
        }
        self.vehicle.set_in_force(slot.id(), Some(slot.clone()), self.now);
        self.in_force.insert(slot.id(), slot);
    }

    fn forget_modem(&mut self, of_vehicle: bool) {
        self.modems[usize::from(of_vehicle)] = (VecDeque::new(), false);
        self.on_air.retain(|_, e| !matches!(e, PairEvent::Sent { by_vehicle } if *by_vehicle == of_vehicle));
    }

    pub(crate) fn shown(&self) -> &LabelGrid {
        self.surface.vehicle(auv()).unwrap().replica().shown()
    }

    pub(crate) fn is_converged(&self) -> bool {
        self.shown() == self.vehicle.map() && self.layers_agree() && self.names_agree() && self.vehicle.is_converged()
    }

    fn names_agree(&self) -> bool {
        let view = self.surface.vehicle(auv()).unwrap();
        view.classes().iter().eq(self.vehicle.classes().entries())
    }

    fn layers_agree(&self) -> bool {
        let view = self.surface.vehicle(auv()).unwrap();
        self.vehicle.layers().all(|layer| match view.layer(layer.id()) {
            Some(replica) => replica.levels().shown() == layer.target(),
            None => layer.target().is_empty(),
        })
    }

    /// The length of the `Debug` output of both ends, as a measure of their memory.
    pub(crate) fn size(&self) -> usize {
        format!("{:?}{:?}", self.vehicle, self.surface).len()
    }

    /// Runs until `until`, or until both maps agree if `stop_when_converged`.
    pub(crate) fn run(&mut self, until: Instant, stop_when_converged: bool) {
        loop {
            self.pump();
            if stop_when_converged && self.is_converged() {
                return;
            }
            let timers = [self.vehicle.poll_timeout(), self.surface.poll_timeout(self.now)];
            let timer = timers.into_iter().flatten().map(|(at, _)| at).filter(|&at| at > self.now).min();
            let event = self.on_air.first_key_value().map(|((at, _), _)| *at);
            // A timer that has passed without a frame waits for the next event, or a while.
            let next = timer.into_iter().chain(event).min().unwrap_or(self.now + Duration::from_millis(200));
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

    fn handle(&mut self, event: PairEvent) {
        match event {
            PairEvent::Sent { by_vehicle } => {
                self.modems[usize::from(by_vehicle)].1 = false;
                match by_vehicle {
                    true => self.vehicle.handle_transmit_outcome(self.now),
                    false => self.surface.handle_transmit_outcome(self.now),
                }
            }
            PairEvent::Arrives { at_vehicle: true, bytes } => self.vehicle.handle_frame(&bytes, self.now),
            PairEvent::Arrives { at_vehicle: false, bytes } => self.surface.handle_frame(&bytes, self.now),
            PairEvent::Poll { of_vehicle: true, frames } => self.vehicle.handle_poll(frames),
            PairEvent::Poll { of_vehicle: false, frames } => self.surface.handle_poll(frames),
        }
    }

    fn pump(&mut self) {
        while let Some(event) = self.vehicle.poll_event() {
            if matches!(event, VehicleEvent::Mismatch(_)) {
                self.vehicle_events.push(event.clone());
            }
            match (&event, self.vehicle_keys.as_mut()) {
                (VehicleEvent::SurfaceMet, _) => self.durable = self.vehicle.persistent_state().clone(),
                (VehicleEvent::NextKey(key), Some(keys)) => {
                    keys.next = Some(Arc::new(HeldKey::Vehicle(key.clone())));
                    self.vehicle.keep_next_key(key);
                }
                (VehicleEvent::KeyChanged, Some(keys)) => keys.key = keys.next.take().expect("the next key was kept"),
                _ => {}
            }
            if let VehicleEvent::Slot { id, content: Some(slot), .. } = event {
                self.applied.push(slot.clone());
                self.put_in_force(slot);
                self.vehicle.decide(id, SlotState::Applied, self.now);
                self.durable = self.vehicle.persistent_state().clone();
                self.vehicle.handle_persisted();
            }
        }
        while let Some(event) = self.surface.poll_event() {
            if self.surface_events.len() < 1000 {
                self.surface_events.push(event);
            }
        }
        self.vehicle.set_status(self.status.clone());
        self.begin_cycle();
        while let Some(t) = self.vehicle.poll_transmit(self.now) {
            self.modems[1].0.push_back(t.bytes);
        }
        while let Some(t) = self.surface.poll_transmit(self.now) {
            self.modems[0].0.push_back(t.bytes);
        }
        for by_vehicle in [false, true] {
            let modem = &mut self.modems[usize::from(by_vehicle)];
            if !modem.1
                && let Some(bytes) = modem.0.pop_front()
            {
                modem.1 = true;
                self.transmit(bytes, by_vehicle);
            }
        }
    }

    /// The modem's own cycle: an initiation packet that may be lost, then requests for the sender's frames.
    fn begin_cycle(&mut self) {
        if self.setup.access != Access::Polled {
            return;
        }
        let Some(cycle) = self.surface.poll_cycle(self.now) else { return };
        let of_vehicle = cycle.from == auv();
        // On a channel that damages bits, the surface's own modem sometimes fails to begin too.
        let chance = if of_vehicle { self.channel.loss } else { self.channel.corruption / 2.0 };
        let is_received = self.draw() >= chance && !(of_vehicle && self.mute[0]);
        let delay = if of_vehicle { self.channel.propagation } else { Duration::ZERO };
        if is_received {
            let at = self.now + delay + Duration::from_millis(300);
            self.schedule(at, PairEvent::Poll { of_vehicle, frames: cycle.frames.min(self.setup.cycle_frames) });
        }
    }

    fn transmit(&mut self, bytes: Vec<u8>, by_vehicle: bool) {
        let modem = self.setup.modem();
        assert!(bytes.len() <= modem.frame_bytes);
        self.audits[usize::from(by_vehicle)].record(modem.bits_on_air(bytes.len()), self.now);
        let end = self.now + modem.airtime(bytes.len());
        self.schedule(end, PairEvent::Sent { by_vehicle });
        let copies = 1 + u32::from(self.draw() < self.channel.duplication);
        for _ in 0..copies {
            let lost = self.draw() < self.channel.loss || self.mute[usize::from(by_vehicle)];
            if self.sent.len() < 1000 {
                self.sent.push((bytes.clone(), lost));
            }
            if lost {
                continue;
            }
            let bytes = self.damaged(bytes.clone());
            let late = if self.draw() < self.channel.reordering { self.draw() * 20.0 } else { 0.0 };
            let at = end + self.channel.propagation + Duration::from_secs_f64(late);
            self.schedule(at, PairEvent::Arrives { at_vehicle: !by_vehicle, bytes });
        }
        self.wiretap.hear(&bytes);
        self.overheard.push_front(bytes);
        self.overheard.truncate(400);
        if self.draw() < self.channel.talker {
            self.talk(end);
        }
    }

    fn damaged(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        if self.draw() < self.channel.corruption {
            let bit = (self.draw() * bytes.len() as f64 * 8.0) as usize;
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        bytes
    }

    /// A third party transmits noise, or an overheard frame, changed or unchanged.
    fn talk(&mut self, at: Instant) {
        let pick = (self.draw() * self.overheard.len() as f64) as usize;
        let mut bytes = self.overheard[pick].clone();
        match (self.draw() * 3.0) as u32 {
            0 => bytes.iter_mut().for_each(|b| *b = b.wrapping_mul(31).wrapping_add(7)),
            1 => {
                let at = (self.draw() * bytes.len() as f64) as usize;
                bytes[at] = bytes[at].wrapping_add(1);
            }
            _ => {}
        }
        let at_vehicle = self.draw() < 0.5;
        self.schedule(at, PairEvent::Arrives { at_vehicle, bytes });
    }

    fn schedule(&mut self, at: Instant, event: PairEvent) {
        self.serial += 1;
        self.on_air.insert((at, self.serial), event);
    }
}

pub(crate) fn vehicle_of(setup: &Setup, seed: u64, durable: SlotInboxState, now: Instant) -> VehicleLink {
    let config = VehicleConfig {
        authenticity: setup.authenticity.clone(),
        origin: setup.origin,
        ..VehicleConfig::new(auv(), setup.mission, setup.modem(), setup.budget_bps)
    };
    let mut link = VehicleLink::new(config, setup.codec, seed, durable, now);
    link.source_mut().set_debounce(setup.debounce);
    for (id, share) in [LayerId::CONFIDENCE, LayerId::DEPTH].into_iter().zip(setup.layers.into_iter().flatten()) {
        assert!(link.add_layer(layer(id, share, setup.codec, setup.debounce)));
    }
    link
}

/// A built-in layer; depths about 20 m.
pub(crate) fn layer(id: LayerId, share: u8, codec: Codec, debounce: Duration) -> LayerSource {
    let descriptor = match id {
        LayerId::DEPTH => LayerDescriptor::depth_around(20.0, 0.5),
        _ => LayerSet::default().get(id).unwrap().clone(),
    };
    LayerSource::new(id, LayerDescriptor { share, ..descriptor }, codec, debounce)
}

pub(crate) fn surface_of(setup: &Setup, seed: u64, now: Instant) -> SurfaceLink {
    let config = SurfaceConfig {
        vehicles: vec![auv()],
        discovery_period: setup.discovery,
        authenticity: setup.authenticity.clone(),
        origin: setup.origin,
        ..SurfaceConfig::new(setup.mission, setup.modem(), setup.budget_bps)
    };
    SurfaceLink::new(config, seed, now)
}

/// Neither end has exceeded its budget in a window of 10 s by more than a frame.
pub(crate) fn assert_budget(pair: &LinkedEnds, budget_bps: u32) {
    for audit in &pair.audits {
        let limit = u64::from(budget_bps) * 10 + audit.largest_bits();
        assert!(audit.worst_window_bits() <= limit, "{} bits in a window, limit {limit}", audit.worst_window_bits());
    }
}

/// Labels without any order, so that there is always more to send than the channel carries.
pub(crate) fn speckled(side: i32, phase: u64) -> Vec<(Cell, u8)> {
    let mut state = phase;
    let mut label = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 60) as u8 + 1
    };
    (0..side * side).map(|i| (Cell::new(i % side, i / side), label())).collect()
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
    Slot::Constraints(Constraints { hold, abort: false })
}
