//! Several surfaces with one key and one vehicle: nothing older replaces something newer, and each order has an end.

use crate::pair::{Setup, auv, surface_of, vehicle_of};
use scenecast_protocol::directive::{
    Constraints, Limits, OrderStatus, Series, Slot, SlotId, SlotProgress, SlotState, Utility, Withdrawal,
};
use scenecast_protocol::link::{Mismatch, SlotInboxState, SurfaceEvent, SurfaceLink, VehicleEvent, VehicleLink};
use scenecast_protocol::mac::Access;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::VehicleStatus;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

const SURFACES: usize = 3;
/// The vehicle is 1 km from every surface.
const PROPAGATION: Duration = Duration::from_millis(667);
/// A hold or an abort this young is obeyed at once, even if a newer order of another surface has arrived before.
const PROMPT: Duration = Duration::from_secs(20);

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum End {
    Vehicle,
    /// A second vehicle with the address of the first.
    Twin,
    Surface(usize),
}

enum WaterEvent {
    Sent(End),
    Arrives(End, Vec<u8>),
}

/// A frame queue, and whether its first frame is on air.
#[derive(Default)]
struct Modem {
    frames: VecDeque<Vec<u8>>,
    is_sending: bool,
}

/// An order that the vehicle has applied.
#[derive(Debug, Clone)]
struct Applied {
    given: Instant,
    slot: Slot,
}

struct Waters {
    now: Instant,
    setup: Setup,
    vehicle: VehicleLink,
    twin: Option<VehicleLink>,
    durable: SlotInboxState,
    surfaces: Vec<SurfaceLink>,
    /// Whether each surface is out of reach.
    is_away: [bool; SURFACES],
    loss: f64,
    random: u64,
    modems: BTreeMap<End, Modem>,
    on_air: BTreeMap<(Instant, u64), WaterEvent>,
    serial: u64,
    /// When the order of a kind with each version was last given, by surface.
    given: BTreeMap<(usize, SlotId, u16), Instant>,
    applied: Vec<Applied>,
    /// Orders that replaced newer ones.
    regressions: Vec<(Applied, Applied)>,
    lost: [bool; SURFACES],
    /// Whether a surface has found two vehicles with one address.
    twin_found: bool,
}

/// The first series of each surface, far apart from those of others.
fn first_series(surface: usize) -> Series {
    Series::from_random((surface as u64 + 1) << 30)
}

impl Waters {
    fn new(seed: u64, access: Access) -> Self {
        let setup = Setup { access, ..Setup::new(64, 10_000, Codec::Context) }.keyed(true, true);
        let now = Instant::from_secs_f64(1000.0);
        let mut waters = Self {
            now,
            vehicle: vehicle_of(&setup, seed ^ 0xA5A5, SlotInboxState::default(), now),
            twin: None,
            durable: SlotInboxState::default(),
            surfaces: Vec::new(),
            is_away: [false; SURFACES],
            loss: 0.0,
            random: seed,
            modems: BTreeMap::new(),
            on_air: BTreeMap::new(),
            serial: 0,
            given: BTreeMap::new(),
            applied: Vec::new(),
            regressions: Vec::new(),
            lost: [false; SURFACES],
            twin_found: false,
            setup,
        };
        for number in 0..SURFACES {
            let seed = waters.draw();
            let mut surface = surface_of(&waters.setup, seed, now);
            surface.restore_series(first_series(number));
            waters.surfaces.push(surface);
        }
        waters
    }

    /// The first surface holds the vehicle, and no other one is in reach.
    fn held_by_first(seed: u64, access: Access) -> Self {
        let mut waters = Self::new(seed, access);
        waters.is_away = [false, true, true];
        waters.run(Duration::from_secs(60));
        waters
    }

    fn draw(&mut self) -> u64 {
        self.random = self.random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        self.random >> 16
    }

    fn chance(&mut self, of: f64) -> bool {
        (self.draw() % 1_000_000) as f64 / 1e6 < of
    }

    fn orders(&self, surface: usize) -> Vec<SlotProgress> {
        self.surfaces[surface].vehicle(auv()).unwrap().slots().cloned().collect()
    }

    fn status(&self, surface: usize, id: SlotId) -> OrderStatus {
        self.orders(surface).into_iter().find(|order| order.id == id).unwrap().status
    }

    fn give(&mut self, surface: usize, slot: Slot) {
        let version = self.surfaces[surface].issue(auv(), slot.clone(), self.now).unwrap();
        self.given.insert((surface, slot.id(), version), self.now);
    }

    /// The operator gives withdrawn orders again; it is as if they were new.
    fn confirm(&mut self, surface: usize) {
        let withdrawn = self.orders(surface).into_iter().filter(|o| matches!(o.status, OrderStatus::Withdrawn(_)));
        for order in withdrawn.collect::<Vec<_>>() {
            if order.status == OrderStatus::Withdrawn(Withdrawal::Lost) {
                for id in self.surfaces[surface].restore_lost(auv(), self.now).unwrap() {
                    let version = self.orders(surface).into_iter().find(|o| o.id == id).unwrap().version;
                    self.given.insert((surface, id, version), self.now);
                }
            } else if let Some(version) = self.surfaces[surface].give_again(auv(), order.id, self.now).unwrap() {
                self.given.insert((surface, order.id, version), self.now);
            }
        }
    }

    fn restart_surface(&mut self, number: usize) {
        let (series, orders) = (self.surfaces[number].vehicle(auv()).unwrap().series(), self.orders(number));
        let seed = self.draw();
        let mut surface = surface_of(&self.setup, seed, self.now);
        surface.restore_orders(auv(), series, orders, self.now);
        surface.assume_budget_spent(self.now);
        self.surfaces[number] = surface;
        self.forget_modem(End::Surface(number));
    }

    fn restart_vehicle(&mut self, keeps_memory: bool) {
        if !keeps_memory {
            self.durable = SlotInboxState::default();
            self.applied.clear();
        }
        let seed = self.draw();
        self.vehicle = vehicle_of(&self.setup, seed, self.durable.clone(), self.now);
        self.vehicle.assume_budget_spent(self.now);
        self.forget_modem(End::Vehicle);
    }

    fn forget_modem(&mut self, end: End) {
        self.modems.remove(&end);
        self.on_air.retain(|_, event| !matches!(event, WaterEvent::Sent(by) if *by == end));
    }

    fn run(&mut self, time: Duration) {
        let until = self.now + time;
        loop {
            self.pump();
            let timers = self.surfaces.iter().map(|surface| surface.poll_timeout(self.now));
            let timers = timers
                .chain([self.vehicle.poll_timeout(), self.twin.as_ref().and_then(VehicleLink::poll_timeout)])
                .flatten()
                .map(|(at, _)| at);
            let timer = timers.filter(|&at| at > self.now).min();
            let event = self.on_air.first_key_value().map(|((at, _), _)| *at);
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
                    End::Vehicle => self.vehicle.handle_transmit_outcome(self.now),
                    End::Twin => self.twin.as_mut().unwrap().handle_transmit_outcome(self.now),
                    End::Surface(number) => self.surfaces[number].handle_transmit_outcome(self.now),
                }
            }
            WaterEvent::Arrives(End::Vehicle, bytes) => self.vehicle.handle_frame(&bytes, self.now),
            WaterEvent::Arrives(End::Twin, bytes) => self.twin.as_mut().unwrap().handle_frame(&bytes, self.now),
            WaterEvent::Arrives(End::Surface(number), bytes) => self.surfaces[number].handle_frame(&bytes, self.now),
        }
    }

    fn pump(&mut self) {
        while let Some(event) = self.vehicle.poll_event() {
            if let VehicleEvent::Slot { id, content: Some(slot), version } = event {
                self.apply(slot, version);
                self.vehicle.decide(id, SlotState::Applied, self.now);
            }
            self.durable = self.vehicle.persistent_state().clone();
            self.vehicle.handle_persisted();
        }
        for (number, surface) in self.surfaces.iter_mut().enumerate() {
            while let Some(event) = surface.poll_event() {
                self.lost[number] |= matches!(event, SurfaceEvent::OrdersLost(_));
                self.twin_found |= matches!(event, SurfaceEvent::Mismatch(_, Mismatch::Twin));
            }
        }
        self.vehicle.set_status(VehicleStatus { labels: 3, budget_bps: 10_000, ..VehicleStatus::default() });
        while let Some(sent) = self.vehicle.poll_transmit(self.now) {
            self.modems.entry(End::Vehicle).or_default().frames.push_back(sent.bytes);
        }
        if let Some(twin) = &mut self.twin {
            while twin.poll_event().is_some() {}
            twin.handle_persisted();
            twin.set_status(VehicleStatus { labels: 3, budget_bps: 10_000, ..VehicleStatus::default() });
            while let Some(sent) = twin.poll_transmit(self.now) {
                self.modems.entry(End::Twin).or_default().frames.push_back(sent.bytes);
            }
        }
        for number in 0..SURFACES {
            while let Some(sent) = self.surfaces[number].poll_transmit(self.now) {
                self.modems.entry(End::Surface(number)).or_default().frames.push_back(sent.bytes);
            }
        }
        let ends: Vec<End> = self.modems.keys().copied().collect();
        for end in ends {
            let modem = self.modems.entry(end).or_default();
            if !modem.is_sending
                && let Some(bytes) = modem.frames.pop_front()
            {
                modem.is_sending = true;
                self.transmit(end, bytes);
            }
        }
    }

    fn transmit(&mut self, from: End, bytes: Vec<u8>) {
        let end = self.now + self.setup.modem().airtime(bytes.len());
        self.schedule(end, WaterEvent::Sent(from));
        let is_heard = |number: usize| !self.is_away[number];
        let receivers: Vec<End> = match from {
            End::Vehicle | End::Twin => (0..SURFACES).filter(|&number| is_heard(number)).map(End::Surface).collect(),
            End::Surface(number) => {
                let vehicles = [Some(End::Vehicle), self.twin.as_ref().map(|_| End::Twin)];
                vehicles.into_iter().flatten().filter(|_| is_heard(number)).collect()
            }
        };
        for receiver in receivers {
            if !self.chance(self.loss) {
                self.schedule(end + PROPAGATION, WaterEvent::Arrives(receiver, bytes.clone()));
            }
        }
    }

    fn schedule(&mut self, at: Instant, event: WaterEvent) {
        self.serial += 1;
        self.on_air.insert((at, self.serial), event);
    }

    fn apply(&mut self, slot: Slot, version: u16) {
        let series = self.vehicle.persistent_state().series().unwrap();
        let giver = (0..SURFACES).find(|&number| first_series(number).is_of_same_surface(series)).unwrap();
        let given = self.given[&(giver, slot.id(), version)];
        let order = Applied { given, slot };
        let of_kind = self.applied.iter().filter(|before| before.slot.id() == order.slot.id());
        if let Some(newer) = of_kind.filter(|before| before.given > given).max_by_key(|before| before.given) {
            let stops = matches!(order.slot, Slot::Constraints(c) if c.stops());
            if !stops || self.now.since(given) > PROMPT + Duration::from_secs(10) {
                self.regressions.push((newer.clone(), order.clone()));
            }
        }
        self.applied.push(order);
    }

    fn holder_name(&self, surface: usize) -> Option<Series> {
        self.surfaces[surface].vehicle(auv()).unwrap().holder().map(|holder| holder.series)
    }
}

fn limits(time_s: u32) -> Slot {
    Slot::Limits(Limits { time_s: Some(time_s), ..Limits::default() })
}

fn constraints(hold: bool, abort: bool) -> Slot {
    Slot::Constraints(Constraints { hold, abort })
}

const ACCESSES: [Access; 3] = [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::FullDuplex];

#[test]
fn a_second_surface_is_refused_by_name_and_takes_the_vehicle_over() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(1, access);
        waters.is_away = [false, false, true];
        waters.run(Duration::from_secs(90));
        assert_eq!(waters.holder_name(1), Some(first_series(0)), "{access:?}");
        let caller = waters.surfaces[0].vehicle(auv()).unwrap().caller(waters.now);
        assert_eq!(caller.map(|caller| caller.series), Some(first_series(1)), "{access:?}");
        waters.give(0, limits(1));
        waters.run(Duration::from_secs(30));
        assert_eq!(waters.status(0, SlotId::Limits), OrderStatus::Applied, "the holder is not disturbed: {access:?}");

        waters.surfaces[1].take_over(auv(), waters.now).unwrap();
        waters.run(Duration::from_secs(60));
        assert_eq!(waters.holder_name(1), None, "{access:?}");
        assert_eq!(waters.holder_name(0), Some(first_series(1)), "{access:?}");
        waters.give(1, limits(2));
        waters.run(Duration::from_secs(30));
        assert_eq!(waters.status(1, SlotId::Limits), OrderStatus::Applied, "{access:?}");

        // The second surface leaves: the first one has the vehicle again, and its order is not applied twice.
        waters.is_away = [false, true, true];
        waters.run(Duration::from_secs(300));
        assert_eq!(waters.holder_name(0), None, "{access:?}");
        assert_eq!(waters.status(0, SlotId::Limits), OrderStatus::Withdrawn(Withdrawal::Superseded), "{access:?}");
        assert_eq!(waters.applied.len(), 2, "{access:?}: {:?}", waters.applied);
    }
}

#[test]
fn a_hold_of_any_surface_is_applied_within_seconds() {
    for access in ACCESSES {
        for seed in 0..20 {
            let mut waters = Waters::held_by_first(seed, access);
            waters.is_away = [false, false, true];
            waters.run(Duration::from_secs(60 + seed));
            assert_eq!(waters.holder_name(1), Some(first_series(0)), "{access:?}");
            waters.give(1, constraints(true, false));
            let given = waters.now;

            while waters.applied.is_empty() {
                waters.run(Duration::from_millis(100));
                assert!(waters.now.since(given) <= Duration::from_secs(8), "{access:?}, {seed}");
            }
        }
    }
}

#[test]
fn an_order_that_another_surface_has_overtaken_is_withdrawn() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(3, access);
        waters.is_away = [true; 3];
        waters.give(0, limits(1));
        waters.run(Duration::from_secs(130));
        waters.is_away = [true, false, true];
        waters.give(1, limits(2));
        waters.run(Duration::from_secs(120));
        assert_eq!(waters.status(1, SlotId::Limits), OrderStatus::Applied, "{access:?}");
        waters.is_away = [false, true, true];
        waters.run(Duration::from_secs(300));
        assert_eq!(waters.status(0, SlotId::Limits), OrderStatus::Withdrawn(Withdrawal::Overtaken), "{access:?}");
        assert_eq!(waters.applied.len(), 1, "{access:?}");
        waters.confirm(0);
        waters.run(Duration::from_secs(60));
        assert_eq!(waters.status(0, SlotId::Limits), OrderStatus::Applied, "{access:?}");
    }
}

#[test]
fn orders_that_a_vehicle_has_lost_are_sent_again_after_a_confirmation() {
    for access in ACCESSES {
        let mut waters = Waters::new(4, access);
        waters.is_away = [false, true, true];
        waters.give(0, limits(1));
        waters.give(0, constraints(false, false));
        waters.run(Duration::from_secs(120));
        assert_eq!(waters.applied.len(), 2, "{access:?}");
        waters.restart_vehicle(false);
        waters.run(Duration::from_secs(200));
        let lost = OrderStatus::Withdrawn(Withdrawal::Lost);
        assert!(waters.lost[0] && waters.status(0, SlotId::Limits) == lost, "{access:?}");
        assert!(waters.applied.is_empty(), "{access:?}: {:?}", waters.applied);
        waters.confirm(0);
        waters.run(Duration::from_secs(120));
        assert_eq!(waters.applied.iter().map(|order| &order.slot).collect::<Vec<_>>(), [&limits(1)], "{access:?}");
        assert_eq!(waters.status(0, SlotId::Constraints), lost, "what lifts a hold is never restored: {access:?}");
        waters.give(0, constraints(false, false));
        waters.run(Duration::from_secs(60));
        assert_eq!(waters.status(0, SlotId::Constraints), OrderStatus::Applied, "{access:?}");
    }
}

/// A random schedule of orders, crashes, losses of memory and hand-overs; then each surface has the vehicle for a while.
fn schedule(seed: u64) -> Waters {
    let access = ACCESSES[seed as usize % ACCESSES.len()];
    let mut waters = Waters::new(seed, access);
    for step in 1..=60 {
        let surface = waters.draw() as usize % SURFACES;
        match waters.draw() % 16 {
            0..3 => waters.give(surface, limits(step)),
            3 => waters.give(surface, Slot::Utility(Utility { curiosity: step as i8, ..Utility::default() })),
            4 => waters.give(surface, constraints(true, false)),
            5 => waters.give(surface, constraints(false, false)),
            6 => waters.give(surface, constraints(false, true)),
            7..10 => waters.is_away[surface] ^= true,
            10 => waters.surfaces[surface].take_over(auv(), waters.now).unwrap(),
            11 => waters.restart_surface(surface),
            12 => waters.restart_vehicle(true),
            13 => {
                let keeps_memory = !waters.chance(0.3);
                waters.restart_vehicle(keeps_memory);
            }
            14 => waters.loss = [0.0, 0.1, 0.3][waters.draw() as usize % 3],
            _ => waters.confirm(surface),
        }
        let pause = [1, 5, 20, 60, 150][waters.draw() as usize % 5];
        waters.run(Duration::from_secs(pause));
    }
    waters.loss = 0.0;
    for surface in 0..SURFACES {
        waters.is_away = [true; SURFACES];
        waters.is_away[surface] = false;
        waters.run(Duration::from_secs(500));
    }
    waters
}

#[test]
fn no_order_replaces_a_newer_one_and_each_has_an_end_in_any_schedule_of_three_surfaces() {
    for seed in 0..200 {
        let waters = schedule(seed);
        assert!(waters.regressions.is_empty(), "seed {seed}: {:?}", waters.regressions);
        for surface in 0..SURFACES {
            let open: Vec<SlotProgress> =
                waters.orders(surface).into_iter().filter(|order| order.status.is_pending()).collect();
            assert!(open.is_empty(), "seed {seed}, surface {surface}: {open:?}");
        }
    }
}

/// Seconds from the arrival of a second vehicle with the same address, `late` after the first, until the surface names it.
fn seconds_until_a_twin_is_named(setup: &Setup, late: Duration) -> Option<u64> {
    let mut waters = Waters::new(1, setup.access);
    waters.setup = setup.clone();
    waters.vehicle = vehicle_of(setup, 77, SlotInboxState::default(), waters.now);
    waters.surfaces[0] = surface_of(setup, 78, waters.now);
    waters.is_away = [false, true, true];
    if !late.is_zero() {
        waters.run(late);
    }
    waters.twin = Some(vehicle_of(setup, 1234, SlotInboxState::default(), waters.now));
    (0..400).find(|_| {
        waters.run(Duration::from_secs(1));
        waters.twin_found && waters.surfaces[0].vehicle(auv()).unwrap().mismatch(waters.now) == Some(Mismatch::Twin)
    })
}

#[test]
fn two_vehicles_with_one_address_are_named() {
    for access in ACCESSES {
        for keyed in [true, false] {
            let setup =
                Setup { access, discovery: Some(Duration::from_secs(60)), ..Setup::new(64, 10_000, Codec::Context) };
            let setup = if keyed { setup.keyed(true, true) } else { setup };
            let named = seconds_until_a_twin_is_named(&setup, Duration::ZERO);
            assert!(named.is_some_and(|seconds| seconds <= 30), "{access:?}, keyed {keyed}: {named:?}");
            // The first one is in contact, and the second one silent until a call. Calls need turns.
            if access == Access::Shared {
                let named = seconds_until_a_twin_is_named(&setup, Duration::from_secs(120));
                assert!(named.is_some_and(|seconds| seconds <= 90), "keyed {keyed}, late: {named:?}");
            }
        }
    }
}

#[test]
fn a_vehicle_that_answers_a_call_after_a_silence_is_not_taken_for_two() {
    let mut waters = Waters::new(5, Access::Shared);
    waters.setup = Setup { discovery: Some(Duration::from_secs(20)), ..waters.setup.clone() };
    waters.surfaces[0] = surface_of(&waters.setup, 78, waters.now);
    for silence in 60..160 {
        waters.is_away = [false, true, true];
        waters.run(Duration::from_secs(silence));
        waters.is_away = [true; SURFACES];
        waters.run(Duration::from_secs(silence));
    }
    assert!(!waters.twin_found);
}

#[test]
fn a_vehicle_that_restarts_again_and_again_is_not_taken_for_two() {
    for access in ACCESSES {
        let mut waters = Waters::held_by_first(3, access);
        waters.loss = 0.2;
        for pause in [1, 3, 40, 12, 7, 90, 2, 25] {
            waters.restart_vehicle(pause % 2 == 1);
            waters.run(Duration::from_secs(pause));
            waters.restart_surface(0);
            waters.run(Duration::from_secs(40 - pause.min(30)));
        }
        assert!(!waters.twin_found, "{access:?}");
    }
}
