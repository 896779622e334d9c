//! A vehicle's and a surface's end of the link at a radio that loses frames, in virtual time.

use scenecast_host::{LinkHost, channel_station};
use scenecast_protocol::directive::SlotState;
use scenecast_protocol::link::{
    PeerView, SlotInboxState, SurfaceConfig, SurfaceLink, VehicleConfig, VehicleEvent, VehicleLink,
};
use scenecast_protocol::mac::{MasterConfig, ModemProfile};
use scenecast_protocol::map::{StateReplica, StateSource};
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, CellEdge, MissionId, VehicleStatus};
use scenecast_rehearsal::VirtualTime;
use sim_channel::RandomStream;
use std::collections::BTreeMap;
use std::time::Duration;

/// Indexes of the ends in pairs.
const VEHICLE: usize = 0;
const SURFACE: usize = 1;
/// Propagation and processing of a radio.
const DELAY: Duration = Duration::from_millis(5);
const WINDOW: Duration = Duration::from_secs(10);
const STATUS_PERIOD: Duration = Duration::from_secs(1);

pub(super) fn address() -> Address {
    Address::vehicle(1).unwrap_or(Address::EVERYBODY)
}

pub(super) struct RadioRig<S: StateSource, R: StateReplica> {
    pub(super) now: Instant,
    pub(super) vehicle: LinkHost<VehicleLink<S>>,
    pub(super) surface: LinkHost<SurfaceLink<R>>,
    /// When the vehicle applied each version of the utility.
    pub(super) applied: BTreeMap<u16, Instant>,
    /// Bits on air, and the time that each end has computed.
    pub(super) bits: [u64; 2],
    pub(super) cpu: [Duration; 2],
    modem: ModemProfile,
    loss: f64,
    rng: RandomStream,
    /// Frames on their way by their arrival: receiver and bytes.
    flying: BTreeMap<(Instant, u64), (usize, Vec<u8>)>,
    sent: u64,
    /// When the last status was written that the surface has.
    status_at: Option<Instant>,
}

impl<S: StateSource, R: StateReplica> RadioRig<S, R> {
    pub(super) fn new(modem: ModemProfile, loss: f64, source: S, seed: u64) -> Self {
        let now = Instant::from_secs_f64(1000.0);
        let budget_bps = modem.bit_rate_bps as u32;
        let shares = Shares::default();
        let config = VehicleConfig {
            address: address(),
            mission: MissionId(7),
            cell_edge: CellEdge::default(),
            modem,
            budget_bps,
            budget_window: WINDOW,
            shares,
            status_period: STATUS_PERIOD,
            authenticity: None,
        };
        let vehicle = VehicleLink::with_source(config, source, seed ^ 1, SlotInboxState::default(), now);
        let config = SurfaceConfig {
            mission: MissionId(7),
            cell_edge: CellEdge::default(),
            modem,
            budget_bps,
            budget_window: WINDOW,
            shares,
            master: MasterConfig::default(),
            vehicles: vec![address()],
            discovery_period: None,
            authenticity: None,
        };
        let surface = SurfaceLink::new(config, seed ^ 2, now);
        Self {
            now,
            vehicle: LinkHost::new(vehicle, channel_station(modem, WINDOW, now)),
            surface: LinkHost::new(surface, channel_station(modem, WINDOW, now)),
            applied: BTreeMap::new(),
            bits: [0; 2],
            cpu: [Duration::ZERO; 2],
            modem,
            loss,
            rng: RandomStream::new(seed, &[11]),
            flying: BTreeMap::new(),
            sent: 0,
            status_at: None,
        }
    }

    pub(super) fn view(&self) -> Option<PeerView<'_, R>> {
        self.surface.end().vehicle(address())
    }

    pub(super) fn replica(&self) -> &R {
        // The vehicle is configured, so the surface knows it.
        self.view().map(|view| view.replica()).unwrap_or_else(|| unreachable!())
    }

    /// Age of the operator's status; 0 before the first.
    pub(super) fn status_age_s(&self) -> f64 {
        self.status_at.map_or(0.0, |at| self.now.since(at).as_secs_f64())
    }

    /// Begins to count bits and time of computing.
    pub(super) fn begin_account(&mut self) {
        (self.bits, self.cpu) = ([0; 2], [Duration::ZERO; 2]);
    }

    pub(super) fn run_for(&mut self, time: Duration) {
        VirtualTime::run(self, time);
    }

    fn transmit(&mut self, from: usize, bytes: Vec<u8>) {
        self.bits[from] += self.modem.bits_on_air(bytes.len());
        if self.rng.uniform() < self.loss {
            return;
        }
        self.sent += 1;
        let arrival = self.now + self.modem.airtime(bytes.len()) + DELAY;
        self.flying.insert((arrival, self.sent), (1 - from, bytes));
    }

    fn account(&mut self, end: usize, began: std::time::Instant) {
        self.cpu[end] += began.elapsed();
    }
}

impl<S: StateSource, R: StateReplica> VirtualTime for RadioRig<S, R> {
    fn now(&self) -> Instant {
        self.now
    }

    fn set_now(&mut self, now: Instant) {
        self.now = now;
    }

    fn next_event(&self) -> Instant {
        let hosts = [self.vehicle.poll_timeout(self.now), self.surface.poll_timeout(self.now)];
        let arrival = self.flying.keys().next().map(|(at, _)| *at);
        hosts.into_iter().chain([arrival]).flatten().min().unwrap_or(self.now + Duration::from_millis(200))
    }

    fn handle_events(&mut self) {
        self.vehicle.handle_timeout(self.now);
        self.surface.handle_timeout(self.now);
        while let Some(entry) = self.flying.first_entry().filter(|entry| entry.key().0 <= self.now) {
            let (to, bytes) = entry.remove();
            let began = std::time::Instant::now();
            match to {
                VEHICLE => self.vehicle.handle_bytes(&bytes, self.now),
                _ => self.surface.handle_bytes(&bytes, self.now),
            }
            self.account(to, began);
        }
        let status = self.view().and_then(|view| view.status().map(|(_, at)| *at));
        self.status_at = status.or(self.status_at);
    }

    fn pump(&mut self) {
        while self.surface.end_mut().poll_event().is_some() {}
        loop {
            let began = std::time::Instant::now();
            let frame = self.surface.poll_output(self.now);
            self.account(SURFACE, began);
            while self.surface.poll_event().is_some() {}
            let Some(bytes) = frame else { break };
            self.transmit(SURFACE, bytes);
        }
        let link = self.vehicle.end_mut();
        while let Some(event) = link.poll_event() {
            if let VehicleEvent::Slot { id, version, .. } = event {
                link.decide(id, SlotState::Applied, self.now);
                link.handle_persisted();
                self.applied.insert(version, self.now);
            }
        }
        link.set_status(VehicleStatus::default());
        loop {
            let began = std::time::Instant::now();
            let frame = self.vehicle.poll_output(self.now);
            self.account(VEHICLE, began);
            while self.vehicle.poll_event().is_some() {}
            let Some(bytes) = frame else { break };
            self.transmit(VEHICLE, bytes);
        }
    }
}
