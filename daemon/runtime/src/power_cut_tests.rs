//! A vehicle whose power is cut at any step, and a surface that sends orders to it.

use super::durable::{FirstStart, Keeper, StartedRun};
use super::journal::disk::{Disk, DiskRng, DiskStep};
use proptest::prelude::*;
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_core::tuning_table::TuningTable;
use scenecast_host::{SurfaceHost, VehicleHost, VehicleHostEvent, channel_station};
use scenecast_protocol::coordinates::WorldPoint;
use scenecast_protocol::directive::{Fix, SlotId};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_vehicle::{Durable, MapChanges};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

const TICK: Duration = Duration::from_millis(100);
const PROPAGATION: Duration = Duration::from_millis(200);
/// Maximum number of ticks until all orders are decided, for any sequence of cuts.
const MAX_TICKS: u32 = 9000;
const LABELS: u8 = 200;
const WINDOW: Duration = Duration::from_secs(10);

/// A frame on its way through the channel.
pub(super) struct Arrival {
    at_vehicle: bool,
    bytes: Vec<u8>,
}

/// The vehicle's computer while it has power.
pub(super) struct Onboard {
    keeper: Keeper<Disk>,
    pub(super) host: VehicleHost,
    /// The last state that the disk took.
    pub(super) saved: Durable,
    /// Whether the disk took the present state.
    pub(super) is_stored: bool,
    /// Epoch of the label ids that the scene model gives.
    book_epoch: u8,
}

/// The power is cut, which ends the vehicle's program.
#[derive(Debug)]
struct PowerCut;

pub(super) struct PowerCutTrial {
    config: Config,
    pub(super) surface: SurfaceHost,
    pub(super) onboard: Onboard,
    pub(super) disk: Disk,
    rng: DiskRng,
    /// Power cuts to come, each by the steps since the last start.
    cuts: Vec<usize>,
    /// Percent of frames that are lost.
    loss: usize,
    pub(super) ticks: u32,
    on_air: BTreeMap<(Instant, u32), Arrival>,
    serial: u32,
    starts: u32,
    /// Slots that the vehicle has acted on.
    acted: BTreeSet<(SlotId, u16)>,
    /// Epochs that the surface received, and the start of the vehicle in which each was first sent.
    published_epochs: BTreeMap<u8, u32>,
    /// Whether the test gives the orders and damages the disk, so that an order or an epoch may come again.
    pub(super) is_damaged: bool,
}

impl PowerCutTrial {
    pub(super) fn new(seed: u64, loss: usize, mut cuts: Vec<usize>) -> Self {
        let sets = ["link.max_idle_s=4", "link.status_period_s=4", "link.max_range_m=300"].map(str::to_owned);
        let config = scenecast_config::load(None, &sets).unwrap();
        let disk = Disk::default();
        let mut rng = DiskRng::new(seed);
        let surface =
            scenecast_surface::assemble(&config, None, TuningTable::shipped(), profile(&config), seed, Instant::ZERO)
                .unwrap();
        let station = channel_station(profile(&config), WINDOW, Instant::ZERO);
        let surface = SurfaceHost::new(surface, station, None);
        cuts.reverse();
        let onboard = start(&config, &disk, &mut rng, &mut cuts, 0, Instant::ZERO);
        let (on_air, acted, published_epochs) = (BTreeMap::new(), BTreeSet::new(), BTreeMap::new());
        Self {
            is_damaged: false,
            config,
            surface,
            onboard,
            disk,
            rng,
            cuts,
            loss,
            ticks: 0,
            on_air,
            serial: 0,
            starts: 0,
            acted,
            published_epochs,
        }
    }

    pub(super) fn now(&self) -> Instant {
        Instant::ZERO + TICK * self.ticks
    }

    pub(super) fn auv(&self) -> Address {
        scenecast_config::vehicle_address(&self.config).unwrap()
    }

    /// Runs until every order has been applied or refused.
    fn run(&mut self) {
        while self.ticks < 250 || !self.is_converged() {
            assert!(self.ticks < MAX_TICKS, "it never converges");
            self.tick();
        }
        let last = [(SlotId::Constraints, 2), (SlotId::Budget, 2), (SlotId::Fix, 1), (SlotId::Utility, 1)];
        for slot in self.surface.surface().view(self.auv()).unwrap().slots() {
            assert!(last.contains(&(slot.id, slot.version)), "{slot:?}");
        }
        assert!(!self.onboard.saved.hold, "the last version is in force");
        assert_eq!(self.onboard.saved.budget.bits_per_s, Some(9000));
    }

    fn is_converged(&self) -> bool {
        let mut slots = self.surface.surface().view(self.auv()).unwrap().slots();
        slots.all(|s| !s.status.is_pending())
    }

    pub(super) fn tick(&mut self) {
        self.ticks += 1;
        if !self.is_damaged {
            self.operate();
        }
        self.surface.handle_timeout(self.now());
        let now = self.now();
        while let Some(due) = self.on_air.first_entry().filter(|e| e.key().0 <= now) {
            let Arrival { at_vehicle, bytes } = due.remove();
            match at_vehicle {
                true => self.run_vehicle(Some(&bytes)),
                false => {
                    let now = self.now();
                    self.surface.link_mut().handle_bytes(&bytes, now);
                }
            }
        }
        self.run_vehicle(None);
        while self.surface.poll_event().is_some() {}
        while let Some(bytes) = self.surface.poll_output(now) {
            self.transmit(bytes, false);
        }
        let shown: BTreeSet<u8> =
            self.surface.surface().map(self.auv()).unwrap().iter().map(|(_, label)| label).collect();
        assert!(shown.len() <= 1, "labels of several epochs on one map: {shown:?}");
    }

    fn operate(&mut self) {
        let (auv, now) = (self.auv(), self.now());
        let surface = self.surface.surface_mut();
        match self.ticks {
            30 => {
                surface.set_hold(auv, true, now).unwrap();
                surface.set_budget(5000, None, None, now).unwrap();
            }
            60 => drop(
                surface
                    .send_fix(auv, Fix { position: WorldPoint::new(1.0, 1.0), sigma_m: 1.0, age_s: 0.1 }, now)
                    .unwrap(),
            ),
            90 => drop(surface.set_hold(auv, false, now).unwrap()),
            120 => drop(surface.set_utility(auv, &BTreeMap::new(), (0.5, 0.0), now).unwrap()),
            150 => surface.set_budget(9000, None, None, now).unwrap(),
            _ => {}
        }
    }

    /// The vehicle's host, for a tick or a frame that came in; starts again when it has ended.
    fn run_vehicle(&mut self, frame: Option<&[u8]>) {
        match self.try_vehicle(frame) {
            Ok(None) => {}
            Ok(Some(bytes)) => self.transmit(bytes, true),
            Err(PowerCut) => self.restart(),
        }
    }

    fn try_vehicle(&mut self, frame: Option<&[u8]>) -> Result<Option<Vec<u8>>, PowerCut> {
        let now = self.now();
        self.onboard.host.handle_timeout(now);
        if let Some(bytes) = frame {
            self.host_step()?;
            self.onboard.host.link_mut().handle_bytes(bytes, now);
        }
        if self.ticks.is_multiple_of(50) {
            self.host_step()?;
            self.see();
        }
        self.onboard.host.steer(now);
        while let Some(event) = self.onboard.host.poll_event() {
            if !matches!(event, VehicleHostEvent::Frame(_)) {
                self.host_step()?;
                self.carry_out(event)?;
            }
        }
        let Some(bytes) = self.onboard.host.poll_output(now) else { return Ok(None) };
        self.host_step()?;
        if self.onboard.is_stored && !self.is_damaged {
            assert_eq!(&self.onboard.saved, self.onboard.host.vehicle().durable(), "sent before it was safe");
            let published_in = *self.published_epochs.entry(self.onboard.saved.epoch).or_insert(self.starts);
            assert_eq!(published_in, self.starts, "an epoch comes twice");
        }
        Ok(Some(bytes))
    }

    fn carry_out(&mut self, event: VehicleHostEvent) -> Result<(), PowerCut> {
        let now = self.now();
        let Onboard { keeper, host, saved, is_stored, .. } = &mut self.onboard;
        if event == VehicleHostEvent::Persist {
            *is_stored = keeper.save(host.vehicle().durable());
            if *is_stored {
                *saved = host.vehicle().durable().clone();
                host.handle_persisted();
            } else if self.disk.is_off() {
                return Err(PowerCut);
            } else {
                host.handle_persist_failed(now);
            }
            return Ok(());
        }
        if !*is_stored || self.is_damaged {
            return Ok(());
        }
        assert_eq!(saved, host.vehicle().durable(), "done before it was safe: {event:?}");
        if let VehicleHostEvent::Applied(applied) = event {
            assert!(self.acted.insert((applied.id, applied.version)), "applied twice: {applied:?}");
        }
        Ok(())
    }

    /// The scene model has a map, in which every label is that of its epoch; its ids run out once a run.
    fn see(&mut self) {
        let onboard = &mut self.onboard;
        if self.ticks == 200 {
            onboard.book_epoch += 1;
        }
        let label = onboard.book_epoch % LABELS + 1;
        let cells = (0..40).map(|i| (Cell::new(i % 8, i / 8), label)).collect();
        let changes = MapChanges::of_labels(onboard.book_epoch, LABELS, cells);
        onboard.host.handle_changes(&changes, Instant::ZERO + TICK * self.ticks);
    }

    fn host_step(&self) -> Result<(), PowerCut> {
        self.disk.step(DiskStep::Host).map_err(|_| PowerCut)
    }

    /// The power is cut, and the vehicle's program starts again.
    pub(super) fn restart(&mut self) {
        let (before, now) = (self.onboard.saved.epoch, self.now());
        self.starts += 1;
        self.onboard = start(&self.config, &self.disk, &mut self.rng, &mut self.cuts, self.starts, now);
        assert!(self.is_damaged || self.onboard.saved.epoch > before, "the epoch goes back or stays");
    }

    fn transmit(&mut self, bytes: Vec<u8>, by_vehicle: bool) {
        let end = self.now() + profile(&self.config).airtime(bytes.len());
        if self.rng.below(100) >= self.loss {
            self.serial += 1;
            self.on_air.insert((end + PROPAGATION, self.serial), Arrival { at_vehicle: !by_vehicle, bytes });
        }
    }
}

fn profile(config: &Config) -> ModemProfile {
    scenecast_config::modem_profile(config, config.modem.bit_rate)
}

/// Starts the vehicle's program until it starts without a power cut.
fn start(config: &Config, disk: &Disk, rng: &mut DiskRng, cuts: &mut Vec<usize>, starts: u32, now: Instant) -> Onboard {
    loop {
        if disk.is_off() || starts > 0 {
            disk.power_cut(DiskRng::new(rng.below(1 << 30) as u64));
        }
        if let Some(steps) = cuts.pop() {
            disk.cut_after(steps);
        }
        let StartedRun { keeper, durable, is_stored, .. } =
            Keeper::begin_run(disk.clone(), u64::from(starts), None, &FirstStart { is_free: true, fence: None });
        if disk.is_off() {
            continue;
        }
        let area = Area { west: 0.0, south: 0.0, east: 20.0, north: 20.0 };
        let profile = profile(config);
        let seed = rng.below(1 << 30) as u64;
        let mut vehicle = scenecast_vehicle::assemble(config, None, profile, area, durable.clone(), seed, now).unwrap();
        if !is_stored {
            vehicle.assume_start_refused(now);
        }
        let host = VehicleHost::new(vehicle, channel_station(profile, WINDOW, now), None);
        let book_epoch = durable.epoch;
        return Onboard { keeper, host, saved: durable, is_stored, book_epoch };
    }
}

#[test]
fn a_power_cut_applies_nothing_twice_and_keeps_label_meanings() {
    let mut whole = PowerCutTrial::new(1, 0, Vec::new());
    whole.run();
    assert_eq!(whole.acted.len(), 6, "every version comes through");
    let steps = whole.disk.steps();
    assert!(steps.iter().filter(|s| **s == DiskStep::Sync).count() > 6);
    for cut in 0..steps.len() {
        for seed in 1..4 {
            PowerCutTrial::new(seed, 0, vec![cut]).run();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    #[test]
    fn power_cuts_and_losses_apply_nothing_twice(
        seed: u64, loss in 0usize..40, cuts in proptest::collection::vec(0usize..80, 1..8),
    ) {
        PowerCutTrial::new(seed, loss, cuts).run();
    }
}
