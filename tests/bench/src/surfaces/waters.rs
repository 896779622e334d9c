//! Several surfaces and a vehicle in one water, in virtual time.

use super::orders::Orders;
use crate::link_ends::{BUDGET_BPS, EndsSetup, auv, draw_seed};
use scenecast_protocol::directive::{Constraints, OrderStatus, Series, Slot, SlotProgress, SlotState, Withdrawal};
use scenecast_protocol::link::{
    Mismatch, PeerView, SlotInboxState, SurfaceEvent, SurfaceLink, VehicleEvent, VehicleLink,
};
use scenecast_protocol::mac::Access;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::VehicleStatus;
use sim_channel::RandomStream;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

pub(super) const SURFACES: usize = 3;
/// The vehicle is 1 km from every surface.
const PROPAGATION: Duration = Duration::from_millis(667);

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum End {
    Vehicle(usize),
    Surface(usize),
}

enum WaterEvent {
    Sent(End),
    Arrives(End, Vec<u8>),
    /// The modem of an end asks for so many frames of a cycle.
    Polls(End, u32),
}

/// A frame queue, and whether its first frame is on air.
#[derive(Default)]
struct Modem {
    frames: VecDeque<Vec<u8>>,
    is_sending: bool,
}

pub(super) struct Waters {
    pub(super) now: Instant,
    pub(super) setup: EndsSetup,
    pub(super) orders: Orders,
    /// Whether each surface is out of reach.
    pub(super) is_away: [bool; SURFACES],
    /// Whether the computer of each surface is suspended.
    pub(super) is_asleep: [bool; SURFACES],
    pub(super) loss: f64,
    /// Whether a surface, and whether a second vehicle itself, has found two vehicles with one address.
    pub(super) twin_found: bool,
    pub(super) twin_found_itself: bool,
    /// Whether each surface has found that its orders were lost.
    pub(super) lost: [bool; SURFACES],
    pub(super) rng: RandomStream,
    /// The vehicle, then others with its address.
    vehicles: Vec<VehicleLink>,
    durable: SlotInboxState,
    surfaces: Vec<SurfaceLink>,
    modems: BTreeMap<End, Modem>,
    on_air: BTreeMap<(Instant, u64), WaterEvent>,
    serial: u64,
}

/// The first series of each surface, far apart from those of others.
pub(super) fn first_series(surface: usize) -> Series {
    Series::from_random((surface as u64 + 1) << 30)
}

impl Waters {
    pub(super) fn new(seed: u64, setup: EndsSetup) -> Self {
        let now = Instant::from_secs_f64(1000.0);
        let mut rng = RandomStream::new(seed, &[]);
        let vehicle = setup.vehicle(draw_seed(&mut rng), SlotInboxState::default(), now);
        let surface = |number| {
            let mut surface = setup.surface(draw_seed(&mut rng), now);
            surface.restore_series(first_series(number));
            surface
        };
        let surfaces = (0..SURFACES).map(surface).collect();
        Self {
            now,
            setup,
            orders: Orders::default(),
            is_away: [false; SURFACES],
            is_asleep: [false; SURFACES],
            loss: 0.0,
            twin_found: false,
            twin_found_itself: false,
            lost: [false; SURFACES],
            rng,
            vehicles: vec![vehicle],
            durable: SlotInboxState::default(),
            surfaces,
            modems: BTreeMap::new(),
            on_air: BTreeMap::new(),
            serial: 0,
        }
    }

    /// The first surface holds the vehicle, and no other one is in reach.
    pub(super) fn held_by_first(seed: u64, setup: EndsSetup) -> Self {
        let mut waters = Self::new(seed, setup);
        waters.is_away = [false, true, true];
        waters.run(Duration::from_secs(60));
        waters
    }

    pub(super) fn view(&self, surface: usize) -> PeerView<'_> {
        self.surfaces[surface].vehicle(auv()).expect("every surface knows the vehicle")
    }

    pub(super) fn progress(&self, surface: usize) -> Vec<SlotProgress> {
        self.view(surface).slots().cloned().collect()
    }

    pub(super) fn give(&mut self, surface: usize, slot: Slot) {
        let id = slot.id();
        let version = self.surfaces[surface].issue(auv(), slot, self.now).expect("the order fits into a frame");
        self.orders.given(surface, id, version, self.now);
    }

    pub(super) fn hold(&mut self, surface: usize) {
        self.give(surface, Slot::Constraints(Constraints { hold: true, abort: false }));
    }

    pub(super) fn take_over(&mut self, surface: usize) {
        self.surfaces[surface].take_over(auv(), self.now).expect("every surface knows the vehicle");
    }

    /// The operator gives withdrawn orders again; it is as if they were new.
    pub(super) fn confirm(&mut self, surface: usize) {
        for order in self.progress(surface) {
            let OrderStatus::Withdrawn(why) = order.status else { continue };
            let link = &mut self.surfaces[surface];
            let again = match why {
                Withdrawal::Lost => link.restore_lost(auv(), self.now).expect("every surface knows the vehicle"),
                _ => {
                    let version = link.give_again(auv(), order.id, self.now).expect("every surface knows the vehicle");
                    version.map(|_| order.id).into_iter().collect()
                }
            };
            for given in self.progress(surface).iter().filter(|given| again.contains(&given.id)) {
                self.orders.given(surface, given.id, given.version, self.now);
            }
        }
    }

    pub(super) fn restart_surface(&mut self, number: usize) {
        let (series, orders) = (self.view(number).series(), self.progress(number));
        let mut surface = self.setup.surface(draw_seed(&mut self.rng), self.now);
        surface.restore_orders(auv(), series, orders, self.now);
        surface.assume_budget_spent(self.now);
        self.surfaces[number] = surface;
        self.forget_modem(End::Surface(number));
    }

    /// What the vehicle has on disk.
    pub(super) fn durable(&self) -> SlotInboxState {
        self.durable.clone()
    }

    pub(super) fn restart_vehicle(&mut self, keeps_memory: bool) {
        if !keeps_memory {
            self.orders.applied.clear();
        }
        self.restart_vehicle_with(if keeps_memory { self.durable() } else { SlotInboxState::default() });
    }

    pub(super) fn restart_vehicle_with(&mut self, durable: SlotInboxState) {
        self.durable = durable;
        self.vehicles[0] = self.setup.vehicle(draw_seed(&mut self.rng), self.durable.clone(), self.now);
        self.vehicles[0].assume_budget_spent(self.now);
        self.forget_modem(End::Vehicle(0));
    }

    fn forget_modem(&mut self, end: End) {
        self.modems.remove(&end);
        self.on_air.retain(|_, event| !matches!(event, WaterEvent::Sent(by) if *by == end));
    }

    pub(super) fn run(&mut self, time: Duration) {
        let until = self.now + time;
        loop {
            self.pump();
            let awake = self.surfaces.iter().zip(self.is_asleep).filter(|(_, is_asleep)| !is_asleep);
            let of_surfaces = awake.filter_map(|(surface, _)| surface.poll_timeout(self.now));
            let of_vehicles = self.vehicles.iter().filter_map(VehicleLink::poll_timeout);
            let timer = of_surfaces.chain(of_vehicles).map(|(at, _)| at).filter(|&at| at > self.now).min();
            let event = self.on_air.first_key_value().map(|((at, _), _)| *at);
            // A timer that has passed without a frame waits for the next event, or a while.
            let next = timer.into_iter().chain(event).min().unwrap_or(self.now + Duration::from_millis(200));
            self.now = next.clamp(self.now, until);
            if next > until {
                return;
            }
            let later = self.on_air.split_off(&(self.now, u64::MAX));
            for event in std::mem::replace(&mut self.on_air, later).into_values() {
                self.handle(event);
            }
        }
    }

    fn handle(&mut self, event: WaterEvent) {
        match event {
            WaterEvent::Sent(end) => {
                self.modems.entry(end).or_default().is_sending = false;
                match end {
                    End::Vehicle(number) => self.vehicles[number].handle_transmit_outcome(self.now),
                    End::Surface(number) => self.surfaces[number].handle_transmit_outcome(self.now),
                }
            }
            WaterEvent::Arrives(End::Vehicle(number), bytes) => self.vehicles[number].handle_frame(&bytes, self.now),
            WaterEvent::Arrives(End::Surface(number), _) if self.is_asleep[number] => {}
            WaterEvent::Arrives(End::Surface(number), bytes) => self.surfaces[number].handle_frame(&bytes, self.now),
            WaterEvent::Polls(End::Vehicle(number), frames) => self.vehicles[number].handle_poll(frames),
            WaterEvent::Polls(End::Surface(number), frames) => self.surfaces[number].handle_poll(frames),
        }
    }

    fn pump(&mut self) {
        self.apply_orders();
        self.begin_cycles();
        for (number, vehicle) in self.vehicles.iter_mut().enumerate() {
            vehicle.set_status(VehicleStatus { labels: 3, budget_bps: BUDGET_BPS, ..VehicleStatus::default() });
            while let Some(sent) = vehicle.poll_transmit(self.now) {
                self.modems.entry(End::Vehicle(number)).or_default().frames.push_back(sent.bytes);
            }
        }
        for (number, surface) in self.surfaces.iter_mut().enumerate().filter(|(number, _)| !self.is_asleep[*number]) {
            while let Some(event) = surface.poll_event() {
                self.lost[number] |= matches!(event, SurfaceEvent::OrdersLost(_));
                self.twin_found |= matches!(event, SurfaceEvent::Mismatch(_, Mismatch::Twin));
            }
            while let Some(sent) = surface.poll_transmit(self.now) {
                self.modems.entry(End::Surface(number)).or_default().frames.push_back(sent.bytes);
            }
        }
        let mut begun = Vec::new();
        for (&end, modem) in self.modems.iter_mut().filter(|(_, modem)| !modem.is_sending) {
            if let Some(bytes) = modem.frames.pop_front() {
                modem.is_sending = true;
                begun.push((end, bytes));
            }
        }
        begun.into_iter().for_each(|(end, bytes)| self.transmit(end, bytes));
    }

    /// The vehicle applies every order that arrives; the others with its address obey nothing.
    fn apply_orders(&mut self) {
        let vehicle = &mut self.vehicles[0];
        while let Some(event) = vehicle.poll_event() {
            let VehicleEvent::Slot { id, content: Some(slot), version } = event else { continue };
            let series = vehicle.persistent_state().series();
            let is_giver = |&number: &usize| series.is_some_and(|s| first_series(number).is_of_same_surface(s));
            let giver = (0..SURFACES).find(is_giver).expect("an order comes from one of the surfaces");
            self.orders.apply(giver, slot, version, self.now);
            vehicle.decide(id, SlotState::Applied, self.now);
        }
        self.durable = vehicle.persistent_state().clone();
        for vehicle in &mut self.vehicles {
            while let Some(event) = vehicle.poll_event() {
                self.twin_found_itself |= matches!(event, VehicleEvent::Mismatch(Mismatch::OwnAddress));
            }
            vehicle.handle_persisted();
        }
    }

    /// The initiation of a cycle, which may be lost, then the requests of the modem for the sender's frames.
    fn begin_cycles(&mut self) {
        if self.setup.access != Access::Polled {
            return;
        }
        for number in (0..SURFACES).filter(|&number| !self.is_asleep[number]).collect::<Vec<_>>() {
            let Some(cycle) = self.surfaces[number].poll_cycle(self.now) else { continue };
            let frames = cycle.frames.min(8);
            let at = self.now + Duration::from_millis(300);
            if cycle.from != auv() {
                self.schedule(at, WaterEvent::Polls(End::Surface(number), frames));
            } else if !self.is_away[number] {
                for vehicle in 0..self.vehicles.len() {
                    if !self.rng.bernoulli(self.loss) {
                        self.schedule(at + PROPAGATION, WaterEvent::Polls(End::Vehicle(vehicle), frames));
                    }
                }
            }
        }
    }

    fn transmit(&mut self, from: End, bytes: Vec<u8>) {
        let end = self.now + self.setup.modem().airtime(bytes.len());
        self.schedule(end, WaterEvent::Sent(from));
        let receivers: Vec<End> = match from {
            End::Vehicle(sender) => {
                let others = (0..self.vehicles.len()).filter(|&number| number != sender).map(End::Vehicle);
                (0..SURFACES).filter(|&number| !self.is_away[number]).map(End::Surface).chain(others).collect()
            }
            End::Surface(number) if self.is_away[number] => Vec::new(),
            End::Surface(_) => (0..self.vehicles.len()).map(End::Vehicle).collect(),
        };
        for receiver in receivers {
            if !self.rng.bernoulli(self.loss) {
                self.schedule(end + PROPAGATION, WaterEvent::Arrives(receiver, bytes.clone()));
            }
        }
    }

    fn schedule(&mut self, at: Instant, event: WaterEvent) {
        self.serial += 1;
        self.on_air.insert((at, self.serial), event);
    }
}

#[cfg(test)]
impl Waters {
    pub(super) fn status(&self, surface: usize, id: scenecast_protocol::directive::SlotId) -> Option<OrderStatus> {
        self.view(surface).slots().find(|order| order.id == id).map(|order| order.status)
    }

    /// The surface that holds the vehicle, where it is not this one.
    pub(super) fn holder(&self, surface: usize) -> Option<Series> {
        self.view(surface).holder().map(|holder| holder.series)
    }

    /// A second vehicle with the same address appears.
    pub(super) fn add_twin(&mut self) {
        let twin = self.setup.vehicle(draw_seed(&mut self.rng), SlotInboxState::default(), self.now);
        self.vehicles.push(twin);
    }
}
