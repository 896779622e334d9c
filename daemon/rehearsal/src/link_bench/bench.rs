//! Vehicles and a surface that share one half-duplex acoustic channel in virtual time.

use super::opaque::{OpaqueReplica, OpaqueSource};
use super::tally::Tally;
use crate::virtual_time::VirtualTime;
use scenecast_host::{FrameEvent, LinkEnd, LinkHost, channel_station};
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::directive::SlotState;
use scenecast_protocol::link::{
    PeerView, SlotInboxState, SurfaceConfig, SurfaceEvent, SurfaceLink, VehicleConfig, VehicleEvent, VehicleLink,
};
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, Envelope, MissionId, VehicleStatus};
use sim_channel::{Channel, ChannelConfig, LossModel, NodeId, NodePosition, RandomStream, ReceptionOutcome};
use std::collections::BTreeMap;
use std::time::Duration;

const SURFACE: NodeId = NodeId(0);
/// Bit rate of the channel, bit/s.
pub const BIT_RATE_BPS: u32 = 10_000;
pub const WINDOW: Duration = Duration::from_secs(10);
/// Speed of sound of every row, m/s.
const SOUND_SPEED_M_S: f64 = 1500.0;

/// Properties of the ends and of the channel between them.
#[derive(Debug, Clone)]
pub struct LinkSetting {
    /// Slant range of every vehicle, metres.
    pub range_m: f64,
    /// Maximum length of a frame, bytes.
    pub frame_bytes: usize,
    /// Pattern of losses in each direction.
    pub loss: LossModel,
    pub vehicles: u8,
    /// Period of discovery calls if all vehicles are unknown at the start.
    pub discovery_period: Option<Duration>,
    /// Bit budget of each end, bit/s.
    pub budget_bps: u32,
}

impl LinkSetting {
    /// One known vehicle, and a budget that does not bind.
    pub fn new(range_m: f64, frame_bytes: usize, loss: LossModel) -> Self {
        Self { range_m, frame_bytes, loss, vehicles: 1, discovery_period: None, budget_bps: BIT_RATE_BPS }
    }

    /// The modem of every end.
    pub fn modem(&self) -> ModemProfile {
        ModemProfile {
            frame_bytes: self.frame_bytes,
            bit_rate_bps: f64::from(BIT_RATE_BPS),
            overhead_bits: 0,
            turn_around: Duration::from_millis(200),
            access: Access::Shared,
        }
    }

    pub fn round_trip(&self) -> Duration {
        Duration::from_secs_f64(2.0 * self.range_m / SOUND_SPEED_M_S)
    }
}

/// A vehicle and its measurements.
#[derive(Debug)]
pub struct BenchVehicle {
    pub address: Address,
    /// The vehicle's end of the link at its modem.
    pub host: LinkHost<VehicleLink<OpaqueSource>>,
    /// Bytes that always wait while the vehicle is under load.
    pub load: Option<usize>,
    /// Time at which a slot was last applied, by slot and version.
    pub applied: BTreeMap<(SlotId, u16), Instant>,
}

/// The ends and the channel between them.
pub struct LinkBench {
    pub now: Instant,
    /// The surface's end of the link at its modem.
    pub surface: LinkHost<SurfaceLink<OpaqueReplica>>,
    /// The vehicles, in the order of their addresses.
    pub vehicles: Vec<BenchVehicle>,
    /// Account of airtime and frames.
    pub tally: Tally,
    /// Number of granted turns and their total time.
    pub grants: (u64, Duration),
    setting: LinkSetting,
    modem: ModemProfile,
    channel: Channel,
    /// Time at which each end last received a frame addressed to it.
    last_received: BTreeMap<NodeId, Instant>,
}

/// The vehicle of every row that has only one.
pub fn auv() -> Address {
    address(1)
}

/// Address of the vehicle with an index.
fn address(number: u8) -> Address {
    Address::vehicle(number).unwrap_or(Address::EVERYBODY)
}

impl LinkBench {
    /// Ends before their handshake; all random numbers are drawn from `seed`.
    pub fn new(setting: &LinkSetting, seed: u64) -> Self {
        let now = Instant::from_secs_f64(1000.0);
        let config = ChannelConfig {
            sound_speed_m_s: SOUND_SPEED_M_S,
            half_duplex: true,
            loss: setting.loss.clone(),
            ..ChannelConfig::default()
        };
        let mut channel = Channel::new(config, seed);
        channel.place(SURFACE, NodePosition::default());
        let mut rng = RandomStream::new(seed, &[1]);
        let mut draw = || (rng.uniform() * 2f64.powi(53)) as u64;
        let mut vehicles = Vec::new();
        for number in 1..=setting.vehicles {
            let angle = f64::from(number) / f64::from(setting.vehicles) * std::f64::consts::TAU;
            let place = NodePosition::new(angle.cos() * setting.range_m, angle.sin() * setting.range_m, 0.0);
            channel.place(NodeId(number), place);
            vehicles.push(BenchVehicle::new(setting, address(number), draw(), now));
        }
        Self {
            now,
            surface: surface(setting, draw(), now),
            vehicles,
            tally: Tally::default(),
            grants: (0, Duration::ZERO),
            setting: setting.clone(),
            modem: setting.modem(),
            channel,
            last_received: BTreeMap::new(),
        }
    }

    /// The setting of the bench.
    pub fn setting(&self) -> &LinkSetting {
        &self.setting
    }

    pub fn vehicle(&mut self) -> &mut BenchVehicle {
        &mut self.vehicles[0]
    }

    /// The surface's view of the only vehicle.
    pub fn view(&self) -> Option<PeerView<'_, OpaqueReplica>> {
        self.surface.end().vehicle(auv())
    }

    fn note_grant(&mut self, bytes: &[u8]) {
        let header = Envelope::decode(bytes, |_| true).map(|e| e.header);
        if let Some(quarters) = header.ok().filter(|h| h.to.is_vehicle() && h.remaining == 0).and_then(|h| h.turn) {
            self.grants.0 += 1;
            self.grants.1 += Duration::from_millis(250) * u32::from(quarters);
        }
    }

    fn transmit(&mut self, from: NodeId, bytes: Vec<u8>, kind: &'static str) {
        assert!(bytes.len() <= self.modem.frame_bytes, "a frame larger than the modem takes");
        let airtime = self.modem.airtime(bytes.len());
        let busy_until = self.last_received.get(&from).map(|&at| at + self.modem.turn_around);
        self.tally.early_frames += u64::from(busy_until.is_some_and(|at| self.now < at));
        let who = if from == SURFACE { "surface" } else { "vehicle" };
        *self.tally.airtime.entry((who, kind)).or_default() += airtime;
        self.channel.transmit(from, bytes, airtime, self.now.into());
    }
}

impl VirtualTime for LinkBench {
    fn now(&self) -> Instant {
        self.now
    }

    fn set_now(&mut self, now: Instant) {
        self.now = now;
    }

    /// The time of the next event, a bounded time ahead.
    fn next_event(&self) -> Instant {
        let hosts = self.vehicles.iter().filter_map(|v| v.host.poll_timeout(self.now));
        let arrival = self.channel.poll_timeout().map(Instant::from);
        let all = hosts.chain(self.surface.poll_timeout(self.now)).chain(arrival);
        all.min().unwrap_or(self.now + Duration::from_millis(200))
    }

    fn handle_events(&mut self) {
        self.surface.handle_timeout(self.now);
        self.vehicles.iter_mut().for_each(|v| v.host.handle_timeout(self.now));
        while let Some(arrival) = self.channel.poll_arrival(self.now.into()) {
            match arrival.to {
                SURFACE => self.tally.up.count(&arrival.outcome),
                _ if arrival.from == SURFACE => self.tally.down.count(&arrival.outcome),
                _ => {}
            }
            let ReceptionOutcome::Delivered { bytes, .. } = arrival.outcome else { continue };
            if Envelope::decode(&bytes, |to| to.number() == arrival.to.0 || to == Address::EVERYBODY).is_ok() {
                self.last_received.insert(arrival.to, self.now);
            }
            match arrival.to {
                SURFACE => self.surface.handle_bytes(&bytes, self.now),
                NodeId(number) => self.vehicles[usize::from(number) - 1].host.handle_bytes(&bytes, self.now),
            }
        }
    }

    fn pump(&mut self) {
        while let Some(event) = self.surface.end_mut().poll_event() {
            if let SurfaceEvent::VehicleRestarted(_) = event {
                self.tally.restarts += 1;
            }
        }
        while let Some((bytes, kind)) = poll_frame(&mut self.surface, self.now) {
            self.note_grant(&bytes);
            self.transmit(SURFACE, bytes, kind);
        }
        for i in 0..self.vehicles.len() {
            self.vehicles[i].handle_news(self.now);
            while let Some((bytes, kind)) = poll_frame(&mut self.vehicles[i].host, self.now) {
                let node = NodeId(self.vehicles[i].address.number());
                self.transmit(node, bytes, kind);
            }
        }
    }
}

/// The next frame of a host on a bare channel, and its kind.
fn poll_frame<E: LinkEnd>(host: &mut LinkHost<E>, now: Instant) -> Option<(Vec<u8>, &'static str)> {
    let bytes = host.poll_output(now)?;
    let mut kind = "";
    while let Some(event) = host.poll_event() {
        if let FrameEvent::Sent { kind: of_frame, .. } = event {
            kind = of_frame.name();
        }
    }
    Some((bytes, kind))
}

impl BenchVehicle {
    /// A vehicle before its handshake.
    pub(super) fn new(setting: &LinkSetting, address: Address, seed: u64, now: Instant) -> Self {
        let config = VehicleConfig {
            budget_window: WINDOW,
            ..VehicleConfig::new(address, MissionId(7), setting.modem(), setting.budget_bps)
        };
        let link = VehicleLink::with_source(config, OpaqueSource::default(), seed, SlotInboxState::default(), now);
        let host = LinkHost::new(link, channel_station(setting.modem(), WINDOW, now));
        Self { address, host, load: None, applied: BTreeMap::new() }
    }

    /// Applies received slots, and fills the source while the vehicle is under load.
    pub(super) fn handle_news(&mut self, now: Instant) {
        let link = self.host.end_mut();
        while let Some(event) = link.poll_event() {
            if let VehicleEvent::Slot { id, version, .. } = event {
                link.decide(id, SlotState::Applied, now);
                link.handle_persisted();
                self.applied.insert((id, version), now);
            }
        }
        link.set_status(VehicleStatus::default());
        if let Some(bytes) = self.load {
            link.source_mut().fill(bytes);
        }
    }
}

/// The surface of a setting at its modem.
pub(super) fn surface(setting: &LinkSetting, seed: u64, now: Instant) -> LinkHost<SurfaceLink<OpaqueReplica>> {
    let link = SurfaceLink::new(surface_config(setting), seed, now);
    LinkHost::new(link, channel_station(setting.modem(), WINDOW, now))
}

fn surface_config(setting: &LinkSetting) -> SurfaceConfig {
    let known = if setting.discovery_period.is_none() { setting.vehicles } else { 0 };
    SurfaceConfig {
        budget_window: WINDOW,
        vehicles: (1..=known).map(address).collect(),
        discovery_period: setting.discovery_period,
        ..SurfaceConfig::new(MissionId(7), setting.modem(), setting.budget_bps)
    }
}
