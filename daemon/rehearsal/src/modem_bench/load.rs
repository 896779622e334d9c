//! Throughput of drivers and emulated modems under load of opaque bytes, and the capacity of an emulated S2C modem.

use crate::link_bench::{OpaqueReplica, OpaqueSource, Summary};
use crate::modem_rig::{ModemRig, SURFACE, VEHICLE};
use crate::virtual_time::VirtualTime;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_drivers::modem::Station;
use scenecast_drivers::modem::s2c::{Line, LineParser};
use scenecast_host::{FrameEvent, LinkHost};
use scenecast_protocol::directive::{Slot, SlotId, SlotState, Utility};
use scenecast_protocol::link::{
    PeerView, SlotInboxState, SurfaceConfig, SurfaceLink, VehicleConfig, VehicleEvent, VehicleLink,
};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, MissionId, VehicleStatus};
use sim_channel::modem::s2c::{S2c, S2cConfig};
use sim_channel::modem::{Basin, Emulator, Fault};
use sim_channel::{Channel, ChannelConfig, LossModel, NodeId, NodePosition, RandomStream};
use std::collections::BTreeMap;
use std::time::Duration;

/// Bytes that wait at the vehicle under load: more than its modem can hold.
const LOAD: usize = 25_000;
/// Time after which a directive counts as lost.
const GIVE_UP_TIMEOUT: Duration = Duration::from_secs(600);

/// Properties of the modems and of the channel between them.
#[derive(Debug, Clone)]
pub struct ModemSetting {
    pub config: Config,
    pub range_m: f64,
    /// Share of frames that the channel loses in each direction.
    pub loss: f64,
}

impl ModemSetting {
    pub(super) fn channel(&self) -> ChannelConfig {
        let loss = LossModel::Independent { probability: self.loss };
        ChannelConfig { loss: if self.loss > 0.0 { loss } else { LossModel::None }, ..ChannelConfig::default() }
    }
}

/// A vehicle's and a surface's link at their modems.
pub struct ModemBench {
    pub now: Instant,
    /// The modems and the channel between them.
    pub rig: ModemRig,
    /// The vehicle's link at its modem.
    pub vehicle: LinkHost<VehicleLink<OpaqueSource>>,
    /// The surface's link at its modem.
    pub surface: LinkHost<SurfaceLink<OpaqueReplica>>,
    /// Bytes that always wait at the vehicle; `None` without load.
    pub load: Option<usize>,
    /// Times at which each slot was applied.
    pub applied: BTreeMap<(SlotId, u16), Vec<Instant>>,
    /// Time at which each end last received a frame.
    pub last_received: [Instant; 2],
    /// The end at which faults are injected.
    pub faulty_end: usize,
    /// Refusals of the modems that a person must act on.
    pub refusals: Vec<String>,
    address: Address,
    budget_bits: f64,
}

impl ModemBench {
    /// Ends before their handshake, at emulated modems.
    pub fn new(setting: &ModemSetting, seed: u64) -> Result<Self, UserError> {
        let now = Instant::from_secs_f64(1.0);
        let rig = ModemRig::new(&setting.config, Channel::new(setting.channel(), seed), seed, now)?;
        Self::at(setting, rig, seed, now)
    }

    /// Ends before their handshake at the given modems.
    pub fn with_modems(setting: &ModemSetting, modems: [Box<dyn Emulator>; 2], seed: u64) -> Result<Self, UserError> {
        let now = Instant::from_secs_f64(1.0);
        let rig = ModemRig::with_modems(&setting.config, Channel::new(setting.channel(), seed), modems, now)?;
        Self::at(setting, rig, seed, now)
    }

    fn at(
        setting: &ModemSetting,
        (mut rig, [at_vehicle, at_surface]): (ModemRig, [Station; 2]),
        seed: u64,
        now: Instant,
    ) -> Result<Self, UserError> {
        let config = &setting.config;
        rig.place(VEHICLE, NodePosition::new(0.0, 0.0, 10.0));
        rig.place(SURFACE, NodePosition::new(setting.range_m, 0.0, 10.0));
        let address = scenecast_config::vehicle_address(config)?;
        let (mission, window) = (MissionId(7), Duration::from_secs_f64(config.link.budget_window_s));
        let vehicle = VehicleConfig {
            budget_window: window,
            ..VehicleConfig::new(address, mission, *at_vehicle.profile(), config.link.budget_bps)
        };
        let surface = SurfaceConfig {
            budget_window: window,
            vehicles: vec![address],
            ..SurfaceConfig::new(mission, *at_surface.profile(), config.link.budget_bps)
        };
        let source = OpaqueSource::default();
        Ok(Self {
            now,
            vehicle: LinkHost::new(
                VehicleLink::with_source(vehicle, source, seed ^ 0xA, SlotInboxState::default(), now),
                at_vehicle,
            ),
            surface: LinkHost::new(SurfaceLink::new(surface, seed ^ 0xB, now), at_surface),
            rig,
            load: None,
            applied: BTreeMap::new(),
            last_received: [now; 2],
            faulty_end: VEHICLE,
            refusals: Vec::new(),
            address,
            budget_bits: f64::from(config.link.budget_bps) * config.link.budget_window_s,
        })
    }

    /// Ends under load after their handshake.
    pub fn under_load(setting: &ModemSetting, seed: u64) -> Result<Self, UserError> {
        let mut bench = Self::new(setting, seed)?;
        bench.load = Some(LOAD);
        bench.run(Duration::from_secs(180));
        Ok(bench)
    }

    /// The surface's view of the vehicle.
    pub fn view(&self) -> Option<PeerView<'_, OpaqueReplica>> {
        self.surface.end().vehicle(self.address)
    }

    fn note(&mut self, end: usize, event: FrameEvent) {
        match event {
            FrameEvent::Received { .. } => self.last_received[end] = self.now,
            FrameEvent::ModemRefused { reason, .. } => self.refusals.push(reason),
            _ => {}
        }
    }

    /// Useful bit/s at the replica over `time`.
    pub fn measure_flow(&mut self, time: Duration) -> f64 {
        let useful = |bench: &Self| bench.view().map_or(0.0, |v| v.replica().useful_bytes());
        let before = useful(self);
        self.run(time);
        (useful(self) - before) * 8.0 / time.as_secs_f64()
    }

    /// Issues directives at random times; returns the times from issue to application, seconds.
    pub fn measure_directives(&mut self, count: usize, seed: u64) -> Summary {
        let mut rng = RandomStream::new(seed, &[7]);
        let mut latencies = Vec::new();
        for _ in 0..count {
            self.run(Duration::from_secs_f64(5.0 + rng.uniform() * 30.0));
            let issued = self.now;
            let Some(version) = self.issue() else { continue };
            self.run_until(issued + GIVE_UP_TIMEOUT, |d| d.applied.contains_key(&(SlotId::Utility, version)));
            latencies.push(self.now.since(issued).as_secs_f64());
        }
        Summary::of(latencies)
    }

    /// Issues a directive and returns its version.
    pub fn issue(&mut self) -> Option<u16> {
        let weights = [(1, 50), (2, -20), (3, 100), (7, 5)].into_iter().collect();
        let slot = Slot::Utility(Utility { weights, ..Utility::default() });
        self.surface.end_mut().issue(self.address, slot, self.now).ok()
    }

    /// Injects a fault into a modem.
    pub fn inject(&mut self, end: usize, fault: Fault) {
        self.rig.inject(end, fault, self.now);
    }

    /// Unplugs a cable, or plugs it in again.
    pub fn plug(&mut self, end: usize, plugged: bool) {
        match end {
            VEHICLE => self.rig.plug(end, &mut self.vehicle, plugged, self.now),
            _ => self.rig.plug(end, &mut self.surface, plugged, self.now),
        }
    }

    /// Ratio of the vehicle's bits in the fullest window to the budget.
    pub fn budget_use(&mut self) -> f64 {
        self.vehicle.audit().worst_window_bits() as f64 / self.budget_bits
    }
}

impl VirtualTime for ModemBench {
    fn now(&self) -> Instant {
        self.now
    }

    fn set_now(&mut self, now: Instant) {
        self.now = now;
    }

    fn next_event(&self) -> Instant {
        let hosts = [self.vehicle.poll_timeout(self.now), self.surface.poll_timeout(self.now)];
        hosts.into_iter().chain([self.rig.poll_timeout()]).flatten().min().unwrap_or(self.now + Duration::from_secs(1))
    }

    fn handle_events(&mut self) {
        self.rig.handle_timeout(self.now);
        self.rig.read(VEHICLE, &mut self.vehicle, self.now);
        self.rig.read(SURFACE, &mut self.surface, self.now);
    }

    fn pump(&mut self) {
        while let Some(event) = self.vehicle.poll_event() {
            self.note(VEHICLE, event);
        }
        while let Some(event) = self.surface.poll_event() {
            self.note(SURFACE, event);
        }
        let vehicle = self.vehicle.end_mut();
        while let Some(event) = vehicle.poll_event() {
            if let VehicleEvent::Slot { id, version, .. } = event {
                vehicle.decide(id, SlotState::Applied, self.now);
                vehicle.handle_persisted();
                self.applied.entry((id, version)).or_default().push(self.now);
            }
        }
        while self.surface.end_mut().poll_event().is_some() {}
        vehicle.set_status(VehicleStatus::default());
        if let Some(bytes) = self.load {
            vehicle.source_mut().fill(bytes);
        }
        while let Some(bytes) = self.surface.poll_output(self.now) {
            self.rig.write(SURFACE, &bytes);
        }
        while let Some(bytes) = self.vehicle.poll_output(self.now) {
            self.rig.write(VEHICLE, &bytes);
        }
        for end in [VEHICLE, SURFACE] {
            self.rig.flush(end, self.now);
        }
    }
}

const FROM: NodeId = NodeId(1);
const TO: NodeId = NodeId(2);
const RECORD: usize = 1000;
/// Time between two attempts while the pool is full.
const RETRY_INTERVAL: Duration = Duration::from_millis(500);

/// Payload that the other host receives over `time` after the connection is up, bit/s.
pub fn push(setting: &ModemSetting, seed: u64, time: Duration) -> f64 {
    const WARM_UP: Duration = Duration::from_secs(60);
    let mut basin = Basin::new(Channel::new(setting.channel(), seed));
    for (node, x) in [(FROM, 0.0), (TO, setting.range_m)] {
        basin.channel().place(node, NodePosition::new(x, 0.0, 10.0));
        let baud = Some(setting.config.modem.baud);
        basin.add(node, Box::new(S2c::new(S2cConfig { baud, seed, ..S2cConfig::new(node.0) })));
    }
    let command = [format!("AT*SEND,{RECORD},{},", TO.0).into_bytes(), vec![b'x'; RECORD], b"\r".to_vec()].concat();
    let (mut replies, mut arrivals) = (LineParser::default(), LineParser::default());
    let (mut now, mut next) = (Duration::ZERO, Some(Duration::ZERO));
    let mut carried = 0usize;
    while now < WARM_UP + time {
        now = basin.poll_timeout().into_iter().chain(next).min().unwrap_or(now + RETRY_INTERVAL).max(now);
        basin.advance(now);
        replies.push(&basin.poll_host_bytes(FROM));
        while let Some(line) = replies.next_line() {
            match line {
                Line::Reply(_, text) if text == "OK" => next = Some(now),
                Line::Reply(..) => next = Some(now + RETRY_INTERVAL),
                _ => {}
            }
        }
        arrivals.push(&basin.poll_host_bytes(TO));
        while let Some(line) = arrivals.next_line() {
            let is_data = matches!(line, Line::Notice(_));
            carried += if is_data && now >= WARM_UP { RECORD } else { 0 };
        }
        if next.is_some_and(|at| at <= now) {
            next = None;
            basin.handle_host_bytes(FROM, &command, now);
        }
    }
    carried as f64 * 8.0 / time.as_secs_f64()
}
