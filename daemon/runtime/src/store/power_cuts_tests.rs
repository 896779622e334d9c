//! A surface whose power is cut at any step of its disk, with a vehicle that runs on.

use super::SurfaceStore;
use crate::journal::disk::{Disk, DiskRng, DiskStep};
use proptest::prelude::*;
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_core::tuning_table::TuningTable;
use scenecast_host::{SurfaceHost, VehicleHost, VehicleHostEvent, channel_station};
use scenecast_protocol::directive::{OrderStatus, SlotId};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::record::{EventKind, EventTime, StoredLabel};
use scenecast_surface::{FenceOrder, Surface};
use scenecast_vehicle::{Durable, MapChanges};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

const TICK: Duration = Duration::from_millis(100);
const PROPAGATION: Duration = Duration::from_millis(200);
const WINDOW: Duration = Duration::from_secs(10);
/// Maximum number of ticks until all orders are decided.
const MAX_TICKS: u32 = 6000;
const MISSION: u32 = 7;
/// The tick at which another vehicle takes the place of the first, with the same address.
const VEHICLE_RESTART: u32 = 220;

struct Trial {
    config: Config,
    surface: SurfaceHost,
    store: SurfaceStore<Disk>,
    vehicle: VehicleHost,
    epoch: u8,
    disk: Disk,
    rng: DiskRng,
    /// Power cuts to come, each by the steps since the last start.
    cuts: Vec<usize>,
    ticks: u32,
    serial: u32,
    on_air: BTreeMap<(Instant, u32), (bool, Vec<u8>)>,
    /// The states that the disk may hold: the last one that was made durable, and those that were being written since.
    possible: Vec<Vec<EventKind>>,
    /// Cells that a page has shown, by epoch.
    shown: BTreeMap<u8, usize>,
    acted: BTreeSet<(SlotId, u16)>,
    /// Orders that were not confirmed yet, by the tick at which they were first given.
    wishes: VecDeque<u32>,
    starts: u32,
}

fn profile(config: &Config) -> ModemProfile {
    scenecast_config::modem_profile(config, config.modem.bit_rate)
}

fn vehicle(config: &Config, durable: Durable, now: Instant) -> VehicleHost {
    let area = Area { west: 0.0, south: 0.0, east: 20.0, north: 20.0 };
    let seed = u64::from(durable.epoch) + 3;
    let vehicle = scenecast_vehicle::assemble(config, None, profile(config), area, durable, seed, now).unwrap();
    VehicleHost::new(vehicle, channel_station(profile(config), WINDOW, now), None)
}

fn surface(config: &Config, seed: u64, now: Instant) -> SurfaceHost {
    let table = TuningTable::shipped();
    let surface = scenecast_surface::assemble(config, None, table, profile(config), seed, now).unwrap();
    SurfaceHost::new(surface, channel_station(profile(config), WINDOW, now), None)
}

impl Trial {
    fn new(seed: u64, mut cuts: Vec<usize>) -> Self {
        let sets = ["link.max_idle_s=4", "link.status_period_s=4", "link.max_range_m=300"].map(str::to_owned);
        let config = scenecast_config::load(None, &sets).unwrap();
        let disk = Disk::default();
        cuts.reverse();
        let mut trial = Self {
            surface: surface(&config, seed, Instant::ZERO),
            store: SurfaceStore::load(Ok(disk.clone()), MISSION).unwrap(),
            vehicle: vehicle(&config, Durable { epoch: 1, ..Durable::default() }, Instant::ZERO),
            epoch: 1,
            config,
            disk,
            rng: DiskRng::new(seed),
            cuts,
            ticks: 0,
            serial: 0,
            on_air: BTreeMap::new(),
            possible: vec![Vec::new()],
            shown: BTreeMap::new(),
            acted: BTreeSet::new(),
            wishes: VecDeque::new(),
            starts: 0,
        };
        trial.arm();
        trial.begin();
        trial
    }

    fn now(&self) -> Instant {
        Instant::ZERO + TICK * self.ticks
    }

    fn time(&self) -> EventTime {
        let micros = self.now().as_micros();
        EventTime { mission_us: micros, unix_ms: 1_000_000 + micros / 1000 }
    }

    fn auv(&self) -> Address {
        scenecast_config::vehicle_address(&self.config).unwrap()
    }

    fn run(&mut self) {
        while self.ticks < 420 || !self.is_converged() {
            assert!(self.ticks < MAX_TICKS, "it never converges: {:?}", self.orders());
            self.tick();
        }
    }

    fn orders(&self) -> Vec<(SlotId, u16, OrderStatus)> {
        let slots = self.surface.surface().view(self.auv()).unwrap().slots();
        slots.map(|s| (s.id, s.version, s.status)).collect()
    }

    fn is_converged(&self) -> bool {
        self.orders().iter().all(|&(_, _, status)| !status.is_pending())
            && self.surface.surface().record(self.auv()).unwrap().earlier_map().is_none()
    }

    fn tick(&mut self) {
        self.ticks += 1;
        let now = self.now();
        self.operate();
        self.surface.handle_timeout(now);
        while let Some(due) = self.on_air.first_entry().filter(|e| e.key().0 <= now) {
            let (at_vehicle, bytes) = due.remove();
            match at_vehicle {
                true => self.vehicle.link_mut().handle_bytes(&bytes, now),
                false => self.surface.link_mut().handle_bytes(&bytes, now),
            }
        }
        self.run_vehicle();
        while self.surface.poll_event().is_some() {}
        if self.ticks.is_multiple_of(5) {
            self.commit(None);
        }
        while let Some(bytes) = self.surface.poll_output(now) {
            self.transmit(bytes, true);
        }
    }

    /// The operator gives an order again that was not confirmed, because the power was cut.
    fn operate(&mut self) {
        if [30, 60, 90, 120, 130, 140, 250].contains(&self.ticks) {
            self.wishes.push_back(self.ticks);
        }
        if self.ticks == VEHICLE_RESTART {
            // Its labels have new meanings.
            self.epoch += 1;
            let durable = self.vehicle.vehicle().durable().clone();
            self.vehicle = vehicle(&self.config, Durable { epoch: self.epoch, labels: 0, ..durable }, self.now());
            self.acted.clear();
        }
        if let Some(&wish) = self.wishes.front() {
            let starts = self.starts;
            self.order(wish);
            self.commit(Some("ann"));
            if starts == self.starts {
                self.wishes.pop_front();
            }
        }
    }

    fn order(&mut self, wish: u32) {
        let (auv, now) = (self.auv(), self.now());
        let surface = self.surface.surface_mut();
        let square = Some(vec![[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0], [-50.0, 50.0]]);
        match wish {
            30 => drop(surface.set_hold(auv, true, now).unwrap()),
            60 => drop(surface.set_fence(auv, &FenceOrder { fence: square, ..FenceOrder::default() }, now).unwrap()),
            90 => drop(surface.set_utility(auv, &BTreeMap::new(), (0.5, 0.0), now).unwrap()),
            120 => surface.set_budget(9000, None, None, now).unwrap(),
            130 => surface.record_mut(auv).unwrap().annotations.add_note("ann", "a wreck", now).unwrap(),
            140 => {
                let sand = StoredLabel { name: Some("sand".into()), ..StoredLabel::default() };
                surface.record_mut(auv).unwrap().set_label(1, sand).unwrap();
            }
            _ => drop(surface.set_hold(auv, false, now).unwrap()),
        }
    }

    fn run_vehicle(&mut self) {
        let now = self.now();
        self.vehicle.handle_timeout(now);
        if self.ticks.is_multiple_of(20) {
            let many = if self.epoch == 1 { (self.ticks / 5).min(40) } else { (self.ticks - VEHICLE_RESTART).min(60) };
            let cells = (0..many as i32).map(|i| (Cell::new(i % 8, i / 8), self.epoch)).collect();
            self.vehicle.handle_changes(&MapChanges::of_labels(self.epoch, 9, cells), now);
        }
        self.vehicle.steer(now);
        while let Some(event) = self.vehicle.poll_event() {
            match event {
                VehicleHostEvent::Persist => self.vehicle.handle_persisted(),
                VehicleHostEvent::Applied(applied) => {
                    assert!(self.acted.insert((applied.id, applied.version)), "applied twice: {applied:?}");
                }
                _ => {}
            }
        }
        while let Some(bytes) = self.vehicle.poll_output(now) {
            self.transmit(bytes, false);
        }
    }

    fn transmit(&mut self, bytes: Vec<u8>, at_vehicle: bool) {
        let end = self.now() + profile(&self.config).airtime(bytes.len());
        self.serial += 1;
        self.on_air.insert((end + PROPAGATION, self.serial), (at_vehicle, bytes));
    }

    /// Makes the state durable, as before each reply, transmission and page. Then the page has shown it.
    fn commit(&mut self, by: Option<&str>) {
        let time = self.time();
        self.store.commit(self.surface.surface_mut(), by, time);
        self.note_possible();
        if self.disk.is_off() {
            return self.restart();
        }
        let surface = self.surface.surface();
        let epoch = surface.record(self.auv()).map_or(0, |record| record.epoch);
        let cells = surface.map(self.auv()).map_or(0, |map| map.explored());
        let most = self.shown.entry(epoch).or_default();
        *most = cells.max(*most);
    }

    fn note_possible(&mut self) {
        let state = self.store.memory().to_events();
        if !self.disk.is_off() {
            self.possible.clear();
        }
        self.possible.push(state);
    }

    fn arm(&mut self) {
        if let Some(steps) = self.cuts.pop() {
            self.disk.cut_after(steps);
        }
    }

    fn begin(&mut self) {
        let time = self.time();
        self.store.begin(self.surface.surface_mut(), 1, MISSION, time);
        self.note_possible();
        if self.disk.is_off() {
            self.restart();
        }
    }

    /// The power comes back, and the surface's program starts again.
    fn restart(&mut self) {
        self.starts += 1;
        self.disk.power_cut(DiskRng::new(self.rng.below(1 << 30) as u64));
        let store = SurfaceStore::load(Ok(self.disk.clone()), MISSION).unwrap();
        let found = store.memory().to_events();
        assert!(self.possible.contains(&found), "a state that never was: {found:?}");
        self.possible = vec![found];
        self.store = store;
        self.surface = surface(&self.config, 100 + u64::from(self.starts), self.now());
        self.arm();
        self.begin();
    }
}

fn labels_in_view(surface: &Surface, vehicle: Address) -> BTreeSet<u8> {
    surface.map(vehicle).unwrap().iter().map(|(_, label)| label).collect()
}

#[test]
fn a_power_cut_at_any_step_loses_nothing_that_was_shown() {
    let mut whole = Trial::new(1, Vec::new());
    whole.run();
    assert_eq!(labels_in_view(whole.surface.surface(), whole.auv()), [2].into());
    let steps = whole.disk.steps();
    assert!(steps.iter().filter(|step| **step == DiskStep::Sync).count() > 20, "{} steps", steps.len());
    for cut in 0..steps.len() {
        let mut trial = Trial::new(cut as u64, vec![cut]);
        trial.run();
        let surface = trial.surface.surface();
        let record = surface.record(trial.auv()).unwrap();
        assert!(!record.annotations.notes.is_empty(), "the note, cut before step {cut}");
        assert!(record.orders.fence.in_force.is_some() && surface.budget_bps() == 9000, "cut before step {cut}");
        let archived: Vec<u64> = trial.store.archives().filter(|map| map.id.epoch == 1).map(|map| map.cells).collect();
        let shown = trial.shown[&1] as u64;
        assert!(archived.iter().any(|&cells| cells >= shown), "{archived:?} of {shown} cells, cut before step {cut}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn any_power_cuts_leave_a_state_that_was_durable(
        seed: u64, cuts in proptest::collection::vec(0usize..120, 1..8),
    ) {
        Trial::new(seed, cuts).run();
    }
}

#[test]
fn pending_orders_keep_their_versions_across_a_restart() {
    let mut trial = Trial::new(3, Vec::new());
    while trial.ticks < 92 {
        trial.tick();
    }
    let before = trial.orders();
    assert!(before.iter().any(|order| !matches!(order.2, OrderStatus::Applied)), "{before:?}");
    let series = trial.store.memory().began().unwrap().series;
    trial.restart();
    let versions = |orders: &[(SlotId, u16, OrderStatus)]| orders.iter().map(|o| (o.0, o.1)).collect::<Vec<_>>();
    assert_eq!((versions(&trial.orders()), trial.store.memory().began().unwrap().series), (versions(&before), series));
    let (auv, now) = (trial.auv(), trial.now());
    let next = trial.surface.surface_mut().set_hold(auv, true, now).unwrap();
    assert!(next > 2, "version {next} may have been used by an order whose record was lost");
    trial.run();
}
