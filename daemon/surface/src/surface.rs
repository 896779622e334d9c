//! The surface's role: the link and the operator's data in one state machine without IO.

use super::command::{Command, CommandAction, CommandChange, CommandRefusal, OrderKind};
use super::log::{LogKind, MissionLog, Watch};
use super::position::{Relay, UsblSighting};
use super::refusal::OrderRefusal;
use super::reported_orders;
use super::vehicle_record::VehicleRecord;
use scenecast_config::RestoreOrders;
use scenecast_core::tuning_table::{Fit, NoRow, TuningTable};
use scenecast_core::{Giver, Principal, UsblLine};
use scenecast_protocol::directive::{Budget, OrderStatus, Slot, SlotId};
use scenecast_protocol::exemplar::{Exemplar, ExemplarView, FloorView};
use scenecast_protocol::link::{Cycle, Mismatch, PeerView, SurfaceEvent, SurfaceLink, Transmit, Wakeup};
use scenecast_protocol::map::LayerSet;
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, Placement, UtcHours, VehicleStatus};
use std::collections::{BTreeMap, VecDeque};

/// News of the surface for its host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SurfaceOutput {
    /// The operator's map of a vehicle has changed.
    MapChanged(Address),
    /// A vehicle has answered a discovery call for the first time.
    VehicleFound(Address),
    /// An exemplar of a label has arrived.
    ExemplarHere(Address, u8),
    /// A slot was applied or refused.
    SlotDecided(Address, SlotId),
    /// The copy of a vehicle's last run is kept apart ([`PeerView::ended_run`]), because a new run begins.
    RunEnded(Address),
    /// A vehicle uses the next key from now on.
    KeyChanged(Address),
    /// A setting of a vehicle does not fit.
    Mismatch(Address, Mismatch),
    /// Command was requested, handed over, taken or released.
    CommandChanged(CommandChange),
    /// Any other fact on the operator's page has changed.
    Changed(Address),
}

pub struct Surface {
    pub(super) link: SurfaceLink,
    pub(super) records: BTreeMap<Address, VehicleRecord>,
    pub(super) outputs: VecDeque<SurfaceOutput>,
    background: BackgroundOrder,
    /// The localisation relay, if the surface has a GPS.
    relay: Option<Relay>,
    tuning: TuningTable,
    pub(super) command: Command,
    pub(super) log: MissionLog,
    /// What the log has about each vehicle.
    pub(super) watches: BTreeMap<Address, Watch>,
    restore: RestoreOrders,
}

impl Surface {
    /// A surface for these vehicles, by address and name.
    pub fn new(link: SurfaceLink, vehicles: impl IntoIterator<Item = (Address, String)>) -> Self {
        let records = vehicles.into_iter().map(|(address, name)| (address, VehicleRecord::new(name))).collect();
        let (tuning, background) = (TuningTable::default(), BackgroundOrder::default());
        let (command, log, watches) = (Command::default(), MissionLog::default(), BTreeMap::new());
        let (outputs, relay, restore) = (VecDeque::new(), None, RestoreOrders::Ask);
        Self { link, records, outputs, background, relay, tuning, command, log, watches, restore }
    }

    /// Sets the tuning table, which predicts the bit rate of settings of the scene model.
    #[must_use]
    pub fn with_tuning_table(self, tuning: TuningTable) -> Self {
        Self { tuning, ..self }
    }

    /// Sets what happens when a vehicle has lost its orders.
    pub fn set_restore(&mut self, restore: RestoreOrders) {
        self.restore = restore;
    }

    /// Sets the principals that command can be handed over to. Nobody has it.
    pub fn set_principals(&mut self, principals: impl IntoIterator<Item = Principal>) {
        self.command = Command::new(principals);
    }

    pub fn command(&self) -> &Command {
        &self.command
    }

    /// An order that its giver was allowed to give was accepted.
    pub fn handle_accepted(&mut self, by: &Giver, kind: OrderKind, now: Instant) {
        let change = self.command.handle_order(by, kind, now);
        change.iter().for_each(|change| self.log_command(change));
        self.outputs.extend(change.map(SurfaceOutput::CommandChanged));
    }

    /// Requests command, hands it over, takes it or gives it up.
    pub fn change_command(&mut self, by: &Giver, action: &CommandAction, now: Instant) -> Result<(), CommandRefusal> {
        let change = self.command.handle_action(by, action, now)?;
        change.iter().for_each(|change| self.log_command(change));
        self.outputs.extend(change.map(SurfaceOutput::CommandChanged));
        Ok(())
    }

    /// The name of a vehicle that the configuration does not name.
    pub fn name_of(vehicle: Address) -> String {
        format!("vehicle {}", vehicle.number())
    }

    pub fn vehicles(&self) -> impl Iterator<Item = (Address, &VehicleRecord)> {
        self.records.iter().map(|(&a, d)| (a, d))
    }

    pub fn record(&self, vehicle: Address) -> Option<&VehicleRecord> {
        self.records.get(&vehicle)
    }

    pub fn record_mut(&mut self, vehicle: Address) -> Option<&mut VehicleRecord> {
        self.records.get_mut(&vehicle)
    }

    pub fn view(&self, vehicle: Address) -> Option<PeerView<'_>> {
        self.link.vehicle(vehicle)
    }

    /// The last status of a vehicle and when its pose came in, perhaps before the start of the surface.
    pub fn status(&self, vehicle: Address) -> Option<&(VehicleStatus, Instant)> {
        self.records.get(&vehicle)?.status(&self.link.vehicle(vehicle)?)
    }

    /// The budget of the surface, bit/s.
    pub fn budget_bps(&self) -> u32 {
        self.link.budget_bps()
    }

    /// The least shares of the classes in the surface's own frames.
    pub fn shares(&self) -> Shares {
        self.link.shares()
    }

    /// Frames of unknown vehicles, and frames that could not be read.
    pub fn unknown_senders(&self) -> u64 {
        self.link.unknown_senders()
    }

    /// Sets the clock of this computer, with which those of the vehicles are compared.
    pub fn set_clock(&mut self, clock: UtcHours) {
        self.link.set_clock(clock);
    }

    /// Counts the whole budget window as spent, because an earlier run may have transmitted until `now`.
    pub fn assume_budget_spent(&mut self, now: Instant) {
        self.link.assume_budget_spent(now);
    }

    pub fn poll_output(&mut self) -> Option<SurfaceOutput> {
        self.outputs.pop_front()
    }

    /// The share of the map in the budget of a vehicle, bit/s. Without a report of the vehicle, the budget
    /// is that of the surface.
    pub fn map_bits_per_s(&self, vehicle: Address) -> f64 {
        let [_, _, _, map, _] = self.link.shares().0;
        let said = self.link.vehicle(vehicle).and_then(|v| v.status().map(|(status, _)| status.budget_bps));
        f64::from(said.unwrap_or(self.link.budget_bps())) * f64::from(map) / 100.0
    }

    /// The most detailed settings of the scene model whose map needs at most `bits_per_s`,
    /// for cells of `cell_m` metres.
    pub fn fit(&self, cell_m: f64, bits_per_s: f64) -> Result<Fit, NoRow> {
        self.tuning.fit(cell_m, bits_per_s)
    }

    /// The built-in layers and those that vehicles have announced, by the index of the first vehicle with such a layer.
    pub fn layers(&self) -> LayerSet {
        let mut all = LayerSet::default();
        let views = self.link.vehicles().filter_map(|vehicle| self.link.vehicle(vehicle));
        for (id, layer) in views.flat_map(|view| view.layers().iter()) {
            if all.id(&layer.name).is_none() {
                all.insert(id, layer.clone());
            }
        }
        all
    }

    /// The order of the background streams of the vehicles, as configured or as last sent.
    pub fn background(&self) -> BackgroundOrder {
        self.background
    }

    /// Sets the order of the background streams for the next budget that does not have its own.
    pub fn set_background(&mut self, background: BackgroundOrder) {
        self.background = background;
    }

    /// Changes the budget of the surface and of every vehicle, and with it the least shares of the classes and the
    /// order of the background streams, if they are given.
    pub fn set_budget(
        &mut self,
        bits_per_s: u32,
        shares: Option<Shares>,
        background: Option<BackgroundOrder>,
        now: Instant,
    ) -> Result<(), OrderRefusal> {
        if !(10..=10_000_000).contains(&bits_per_s) {
            return Err(OrderRefusal::Budget(bits_per_s));
        }
        let shares = shares.unwrap_or(self.link.shares());
        if !shares.is_sound() {
            return Err(OrderRefusal::Shares(shares.0.iter().map(|&s| u32::from(s)).sum()));
        }
        let vehicles: Vec<Address> = self.records.keys().copied().collect();
        let background = background.unwrap_or(self.background);
        let slot = Slot::Budget(Budget { bits_per_s, shares, background });
        vehicles.into_iter().try_for_each(|v| self.issue(v, slot.clone(), now).map(drop))?;
        self.link.set_budget(bits_per_s, now);
        self.link.set_shares(shares);
        self.background = background;
        Ok(())
    }

    pub fn set_relay(&mut self, relay: Relay) {
        self.relay = Some(relay);
    }

    /// The localisation relay, if the surface has a GPS.
    pub fn relay(&self) -> Option<&Relay> {
        self.relay.as_ref()
    }

    /// The connection to the GPS was opened. Returns the bytes to send to the receiver.
    pub fn handle_gps_open(&mut self) -> &'static [u8] {
        self.relay.as_mut().map_or(b"", |relay| relay.handle_gps_open())
    }

    pub fn handle_gps(&mut self, bytes: &[u8], now: Instant) {
        let Some(relay) = &mut self.relay else { return };
        relay.handle_gps(bytes, now);
        if let Some(note) = relay.poll_gps_note() {
            self.log_fault(&note, now);
        }
    }

    /// Logs a fault of the surface's own equipment.
    pub fn log_fault(&mut self, text: &str, now: Instant) {
        self.log.add(None, LogKind::Fault, None, text, now);
    }

    /// Takes bytes of a separate compass.
    pub fn handle_compass(&mut self, bytes: &[u8], now: Instant) {
        self.relay.iter_mut().for_each(|relay| relay.handle_compass(bytes, now));
    }

    /// Takes a USBL measurement of a vehicle, and sends the vehicle a fix if that gives one.
    pub fn handle_usbl(&mut self, vehicle: Address, sighting: &UsblSighting, now: Instant) {
        let Some(relay) = &mut self.relay else { return };
        if let Ok(Some(fix)) = relay.handle_usbl(vehicle, sighting, now) {
            // A vehicle that is unknown to the link has no slot for it.
            let _ = self.send_fix(vehicle, fix, now);
        }
    }

    /// The reported position of a vehicle in the world frame: metres east and north.
    pub fn vehicle_in_world(&self, vehicle: Address) -> Option<(f64, f64)> {
        let (status, _) = self.link.vehicle(vehicle)?.status()?;
        Some(Placement::map_to_world(status.placement, status.position).xy())
    }

    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        self.link.handle_frame(bytes, now);
        while let Some(event) = self.link.poll_event() {
            if let Some(output) = self.handle_event(event, now) {
                self.outputs.push_back(output);
            }
        }
        let link = &self.link;
        let speaks = |vehicle| link.vehicle(vehicle).and_then(|v| v.last_received()) == Some(now);
        let speakers: Vec<Address> = self.records.keys().copied().filter(|&vehicle| speaks(vehicle)).collect();
        for vehicle in &speakers {
            self.records.get_mut(vehicle).into_iter().for_each(|record| record.pauses.handle_frame(now));
        }
        self.log_received(&speakers, now);
        self.count_gains(now);
    }

    /// Keeps the number of cells of each label, for the gains of the last minutes.
    fn count_gains(&mut self, now: Instant) {
        let due: Vec<Address> = self.vehicles().filter(|(_, r)| r.labels.gains.is_due(now)).map(|(a, _)| a).collect();
        for vehicle in due {
            let Some(cells) = self.labels(vehicle) else { continue };
            if self.records.get(&vehicle).is_none_or(|record| record.earlier_map().is_none()) {
                self.log_labels(vehicle, cells.keys().copied(), now);
            }
            self.log_correction(vehicle, now);
            if let Some(record) = self.records.get_mut(&vehicle).filter(|_| !cells.is_empty()) {
                record.labels.gains.handle_cells(cells, now);
            }
        }
    }

    fn handle_event(&mut self, event: SurfaceEvent, now: Instant) -> Option<SurfaceOutput> {
        match event {
            SurfaceEvent::VehicleFound(vehicle) => {
                self.records.entry(vehicle).or_insert_with(|| VehicleRecord::new(Self::name_of(vehicle)));
                Some(SurfaceOutput::VehicleFound(vehicle))
            }
            SurfaceEvent::MapChanged(vehicle) => Some(SurfaceOutput::MapChanged(vehicle)),
            SurfaceEvent::LabelNamed(vehicle) | SurfaceEvent::LabelsJoined(vehicle) => self.follow_labels(vehicle),
            SurfaceEvent::VehicleRestarted(vehicle) => {
                self.records.get_mut(&vehicle).into_iter().for_each(VehicleRecord::begin_run);
                // The first frame of all is told as such.
                if self.watches.get(&vehicle).is_some_and(Watch::has_received) {
                    self.log_fact(vehicle, LogKind::Contact, "the vehicle begins another run", now);
                }
                self.request_again(vehicle, now);
                Some(SurfaceOutput::MapChanged(vehicle))
            }
            SurfaceEvent::Rivalry(vehicle) => {
                self.log_rivalry(vehicle, now);
                Some(SurfaceOutput::Changed(vehicle))
            }
            SurfaceEvent::OrdersLost(vehicle) => {
                self.log_fact(vehicle, LogKind::Answer, "the vehicle has no record of its orders any more", now);
                if self.restore == RestoreOrders::Auto {
                    let _ = self.restore_lost(vehicle, now);
                }
                Some(SurfaceOutput::Changed(vehicle))
            }
            SurfaceEvent::KeyChanged(vehicle) => {
                self.log_fact(vehicle, LogKind::Contact, "the vehicle uses the next key from now on", now);
                Some(SurfaceOutput::KeyChanged(vehicle))
            }
            SurfaceEvent::RunEnded(vehicle) => Some(SurfaceOutput::RunEnded(vehicle)),
            SurfaceEvent::Mismatch(vehicle, mismatch) => {
                self.log_fact(vehicle, LogKind::Fault, &mismatch.to_string(), now);
                Some(SurfaceOutput::Mismatch(vehicle, mismatch))
            }
            SurfaceEvent::SlotDecided(vehicle, slot) => {
                let decided = self.link.vehicle(vehicle)?.slots().find(|s| s.id == slot)?;
                let (status, version) = (decided.status, decided.version);
                let record = self.records.get_mut(&vehicle)?;
                if slot == SlotId::Settings {
                    record.orders.settings.handle_decision(status);
                }
                if status == OrderStatus::Applied {
                    record.orders.handle_applied(slot, version);
                }
                self.handle_decision(vehicle, slot, now);
                self.log_decision(vehicle, slot, now);
                Some(SurfaceOutput::SlotDecided(vehicle, slot))
            }
            SurfaceEvent::Status(vehicle) => {
                let &(ref status, at) = self.link.vehicle(vehicle)?.status()?;
                self.records.get_mut(&vehicle)?.handle_status(status, at);
                self.relay.iter_mut().for_each(|relay| relay.handle_depth(vehicle, status.depth_m, now));
                self.log_mode(vehicle, now);
                self.log_faults(vehicle, now);
                self.follow_labels(vehicle);
                self.follow_in_force(vehicle)
            }
            SurfaceEvent::InForceLearned(vehicle, _) => self.follow_in_force(vehicle),
            SurfaceEvent::ObjectProgress { vehicle, head, held, total } => {
                self.records.get_mut(&vehicle)?.handle_progress(head.as_deref(), held, total, now);
                Some(SurfaceOutput::Changed(vehicle))
            }
            SurfaceEvent::Object(vehicle, bytes) => {
                let clock = self.link.vehicle(vehicle).and_then(|view| view.clock());
                let taken = |view: &ExemplarView| clock.and_then(|clock| view.taken(clock, now));
                let record = self.records.get_mut(&vehicle)?;
                if let Some(floor) = FloorView::decode(&bytes) {
                    let is_new = record.floor.handle(&floor, taken(&floor.view), now);
                    return is_new.then_some(SurfaceOutput::Changed(vehicle));
                }
                let exemplar = Exemplar::decode(&bytes)?;
                let is_new = record.handle_exemplar(&exemplar, taken(&exemplar.view), now);
                if is_new {
                    let text = match exemplar.bytes.is_empty() {
                        true => format!("no image of label {} yet", exemplar.label),
                        false => format!("image of label {}", exemplar.label),
                    };
                    self.log_fact(vehicle, LogKind::Image, &text, now);
                }
                is_new.then_some(SurfaceOutput::ExemplarHere(vehicle, exemplar.label))
            }
        }
    }

    /// Labels of the present epoch have the names that the vehicle gives them, until the operator gives them others.
    /// Takes names and tree of the labels, once the status has told their epoch.
    fn follow_labels(&mut self, vehicle: Address) -> Option<SurfaceOutput> {
        let view = self.link.vehicle(vehicle).filter(|view| view.status().is_some())?;
        let record = self.records.get_mut(&vehicle)?;
        record.handle_names(view.classes());
        record.labels.tree = view.tree().cloned().or_else(|| record.labels.tree.take());
        Some(SurfaceOutput::Changed(vehicle))
    }

    fn follow_in_force(&mut self, vehicle: Address) -> Option<SurfaceOutput> {
        reported_orders::follow(self.records.get_mut(&vehicle)?, &self.link.vehicle(vehicle)?);
        Some(SurfaceOutput::Changed(vehicle))
    }

    /// The last frame of [`Self::poll_transmit`] has left the modem.
    pub fn handle_transmit_outcome(&mut self, now: Instant) {
        self.link.handle_transmit_outcome(now);
    }

    /// The modem has restarted, what it held is lost, and it is ready again.
    pub fn handle_modem_restart(&mut self, now: Instant) {
        self.link.handle_modem_restart(now);
    }

    /// The modem requests a number of frames.
    pub fn handle_poll(&mut self, frames: u32) {
        self.link.handle_poll(frames);
    }

    /// The next cycle for a polled modem to begin.
    pub fn poll_cycle(&mut self, now: Instant) -> Option<Cycle> {
        self.link.poll_cycle(now)
    }

    /// The modem itself transmitted a number of bits, which count against the budget.
    pub fn handle_repeated(&mut self, bits: u64, now: Instant) {
        self.link.handle_repeated(bits, now);
    }

    /// The modem has measured the range or the direction of a vehicle.
    pub fn handle_range(&mut self, vehicle: Address, line: &UsblLine, now: Instant) {
        if let Some(record) = self.records.get_mut(&vehicle) {
            record.found = Some((*line, now));
            self.outputs.push_back(SurfaceOutput::Changed(vehicle));
        }
        if let (Some(range_m), Some((bearing_rad, elevation_rad))) = (line.range_m, line.direction_rad) {
            let (accuracy_m, age_s) = (line.accuracy, line.age_s);
            self.handle_usbl(vehicle, &UsblSighting { range_m, bearing_rad, elevation_rad, accuracy_m, age_s }, now);
        }
    }

    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        self.log_silences(now);
        self.link.poll_transmit(now)
    }

    /// When to call [`Self::poll_transmit`] again, and why.
    pub fn poll_timeout(&self, now: Instant) -> Option<(Instant, Wakeup)> {
        self.link.poll_timeout(now)
    }
}
