//! The medium between the two hosts: a bare channel, or emulated modems in one.

use crate::frames_log::FramesLog;
use crate::modem_rig::{ModemRig, SURFACE, VEHICLE};
use scenecast_config::{Config, ModemKind};
use scenecast_core::UserError;
use scenecast_drivers::modem::Station;
use scenecast_host::{SurfaceHost, VehicleHost, channel_station};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;
use sim_channel::{Channel, ChannelConfig, LossModel, NodeId, NodePosition, ReceptionOutcome};
use std::collections::VecDeque;
use std::time::Duration;

const NODES: [NodeId; 2] = [NodeId(1), NodeId(0)];

/// Kinds `tcp` and `udp` are no modems: there the channel is bare, and an output of a host is a frame.
enum Medium {
    Channel(Channel),
    Modems(ModemRig),
}

/// Carries bytes between the hosts, and logs the frames.
pub(crate) struct Carrier {
    medium: Medium,
    pub(crate) log: FramesLog,
    /// Transmissions of each end that the log does not know yet.
    unlogged: [VecDeque<u64>; 2],
}

impl Carrier {
    /// The medium that the configuration names, and the stations of vehicle and surface.
    pub(super) fn new(config: &Config, seed: u64, now: Instant) -> Result<(Self, [Station; 2]), UserError> {
        let channel = Channel::new(channel_config(config), seed);
        let (medium, stations) = match config.modem.kind {
            ModemKind::Tcp | ModemKind::Udp => {
                let profile = scenecast_config::modem_profile(config, config.channel.bit_rate);
                let window = Duration::from_secs_f64(config.link.budget_window_s);
                (Medium::Channel(channel), [(); 2].map(|()| channel_station(profile, window, now)))
            }
            ModemKind::S2c | ModemKind::Micromodem | ModemKind::Transparent => {
                let (rig, stations) = ModemRig::new(config, channel, seed, now)?;
                (Medium::Modems(rig), stations)
            }
        };
        let carrier = Self { medium, log: FramesLog::default(), unlogged: Default::default() };
        Ok((carrier, stations))
    }

    /// Puts an end somewhere.
    pub(super) fn place(&mut self, end: usize, position: NodePosition) {
        match &mut self.medium {
            Medium::Channel(channel) => channel.place(NODES[end], position),
            Medium::Modems(rig) => rig.place(end, position),
        }
    }

    /// Slant range between the ends, metres.
    pub(super) fn range_m(&mut self) -> f64 {
        let range_m = match &mut self.medium {
            Medium::Channel(channel) => channel.range_m(NODES[SURFACE], NODES[VEHICLE]),
            Medium::Modems(rig) => rig.range_m(),
        };
        range_m.unwrap_or(0.0)
    }

    pub(super) fn poll_timeout(&self) -> Option<Instant> {
        match &self.medium {
            Medium::Channel(channel) => channel.poll_timeout().map(Instant::from),
            Medium::Modems(rig) => rig.poll_timeout(),
        }
    }

    /// Lets time pass in medium and hosts, and gives the hosts what arrives.
    pub(super) fn deliver(&mut self, vehicle: &mut VehicleHost, surface: &mut SurfaceHost, now: Instant) {
        match &mut self.medium {
            Medium::Channel(channel) => {
                vehicle.handle_timeout(now);
                surface.handle_timeout(now);
                while let Some(arrival) = channel.poll_arrival(now.into()) {
                    self.log.handle_fate(&arrival);
                    let ReceptionOutcome::Delivered { bytes, .. } = &arrival.outcome else { continue };
                    if arrival.to == NODES[VEHICLE] {
                        vehicle.link_mut().handle_bytes(bytes, now);
                    } else {
                        surface.link_mut().handle_bytes(bytes, now);
                    }
                }
            }
            Medium::Modems(rig) => {
                rig.handle_timeout(now);
                rig.read(VEHICLE, vehicle.link_mut(), now);
                rig.read(SURFACE, surface.link_mut(), now);
            }
        }
    }

    /// Takes what the hosts have for their ports. A host reports each of its frames in an event afterwards, which
    /// [`Self::log_sent`] waits for.
    pub(super) fn collect(&mut self, vehicle: &mut VehicleHost, surface: &mut SurfaceHost, now: Instant) {
        self.write(VEHICLE, *vehicle.link().profile(), || vehicle.poll_output(now), now);
        self.write(SURFACE, *surface.link().profile(), || surface.poll_output(now), now);
    }

    fn write(
        &mut self,
        end: usize,
        profile: ModemProfile,
        mut poll_output: impl FnMut() -> Option<Vec<u8>>,
        now: Instant,
    ) {
        while let Some(bytes) = poll_output() {
            match &mut self.medium {
                Medium::Channel(channel) => {
                    let airtime = profile.airtime(bytes.len());
                    let transmission = channel.transmit(NODES[end], bytes, airtime, now.into());
                    self.unlogged[end].push_back(transmission);
                }
                Medium::Modems(rig) => rig.write(end, &bytes),
            }
        }
        if let Medium::Modems(rig) = &mut self.medium {
            rig.flush(end, now);
        }
    }

    /// An end has handed a frame to its modem or to the channel.
    pub(super) fn log_sent(&mut self, end: usize, bytes: usize, kind: &'static str, now: Instant) {
        match self.unlogged[end].pop_front() {
            Some(transmission) => {
                self.log.handle_sent(transmission, end == VEHICLE, bytes, kind, now.as_secs_f64());
            }
            None => self.log.sent[end] += 1,
        }
    }
}

fn channel_config(config: &Config) -> ChannelConfig {
    let c = &config.channel;
    ChannelConfig {
        sound_speed_m_s: c.sound_speed_m_s,
        half_duplex: c.half_duplex,
        loss: if c.loss > 0.0 { LossModel::Independent { probability: c.loss } } else { LossModel::None },
        corruption: c.corruption,
        duplication: c.duplication,
        reordering: c.reordering,
        reorder_delay: Duration::from_secs(5),
        ..ChannelConfig::default()
    }
}
