//! The medium between the ends of a link: a bare channel, or emulated modems in one.

use crate::frames_log::FramesLog;
use crate::modem_rig::{ModemRig, SURFACE, VEHICLE};
use scenecast_config::{Config, ModemKind};
use scenecast_core::UserError;
use scenecast_drivers::modem::Station;
use scenecast_files::RecordedLink;
use scenecast_host::{FrameEvent, LinkEnd, LinkHost, channel_station};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;
use sim_channel::loss::Replayed;
use sim_channel::{Channel, ChannelConfig, LossModel, NodeId, NodePosition, ReceptionOutcome};
use std::collections::VecDeque;
use std::path::Path;
use std::time::Duration;

const NODES: [NodeId; 2] = [NodeId(1), NodeId(0)];

/// A bare channel for the kinds `tcp` and `udp`, in which an output of a host is a frame.
enum Medium {
    Channel(Channel, ModemProfile),
    Modems(ModemRig),
}

/// Carries bytes between the hosts, and logs the frames.
pub(crate) struct Carrier {
    medium: Medium,
    pub(crate) log: FramesLog,
    /// Transmissions of each end that are not in the log yet.
    unlogged: [VecDeque<u64>; 2],
    /// Time that each end has computed for frames in a bare channel.
    pub(crate) computed: [Duration; 2],
}

impl Carrier {
    /// The configured medium, and the stations of vehicle and surface.
    pub(crate) fn new(config: &Config, seed: u64, now: Instant) -> Result<(Self, [Station; 2]), UserError> {
        let mut channel = Channel::new(channel_config(config), seed);
        if let Some(folder) = &config.channel.replay {
            replay(&mut channel, folder)?;
        }
        let (medium, stations) = match config.modem.kind {
            ModemKind::Tcp | ModemKind::Udp => {
                let profile = scenecast_config::modem_profile(config, config.channel.bit_rate);
                let window = Duration::from_secs_f64(config.link.budget_window_s);
                (Medium::Channel(channel, profile), [(); 2].map(|()| channel_station(profile, window, now)))
            }
            ModemKind::S2c | ModemKind::Micromodem | ModemKind::Transparent => {
                let (rig, stations) = ModemRig::new(config, channel, seed, now)?;
                (Medium::Modems(rig), stations)
            }
        };
        let (log, unlogged, computed) = (FramesLog::default(), Default::default(), [Duration::ZERO; 2]);
        let carrier = Self { medium, log, unlogged, computed };
        Ok((carrier, stations))
    }

    pub(crate) fn place(&mut self, end: usize, position: NodePosition) {
        match &mut self.medium {
            Medium::Channel(channel, _) => channel.place(NODES[end], position),
            Medium::Modems(rig) => rig.place(end, position),
        }
    }

    /// Slant range between the ends, metres.
    pub(crate) fn range_m(&mut self) -> f64 {
        let range_m = match &mut self.medium {
            Medium::Channel(channel, _) => channel.range_m(NODES[SURFACE], NODES[VEHICLE]),
            Medium::Modems(rig) => rig.range_m(),
        };
        range_m.unwrap_or(0.0)
    }

    pub(crate) fn poll_timeout(&self) -> Option<Instant> {
        match &self.medium {
            Medium::Channel(channel, _) => channel.poll_timeout().map(Instant::from),
            Medium::Modems(rig) => rig.poll_timeout(),
        }
    }

    /// Lets time pass in medium and hosts, and gives the hosts the arriving bytes.
    pub(crate) fn deliver<V: LinkEnd, S: LinkEnd>(
        &mut self,
        vehicle: &mut LinkHost<V>,
        surface: &mut LinkHost<S>,
        now: Instant,
    ) {
        match &mut self.medium {
            Medium::Channel(channel, _) => {
                vehicle.handle_timeout(now);
                surface.handle_timeout(now);
                while let Some(arrival) = channel.poll_arrival(now.into()) {
                    self.log.handle_fate(&arrival);
                    let ReceptionOutcome::Delivered { bytes, .. } = &arrival.outcome else { continue };
                    if arrival.to == NODES[VEHICLE] {
                        timed(&mut self.computed[VEHICLE], || vehicle.handle_bytes(bytes, now));
                    } else {
                        timed(&mut self.computed[SURFACE], || surface.handle_bytes(bytes, now));
                    }
                }
            }
            Medium::Modems(rig) => {
                rig.handle_timeout(now);
                rig.read(VEHICLE, vehicle, now);
                rig.read(SURFACE, surface, now);
            }
        }
    }

    /// Takes a host's output for its port. A host reports each of its frames in a later event, for
    /// which the method [`Self::log_event`] waits.
    pub(crate) fn write(&mut self, end: usize, mut poll_output: impl FnMut() -> Option<Vec<u8>>, now: Instant) {
        while let Some(bytes) = timed(&mut self.computed[end], &mut poll_output) {
            match &mut self.medium {
                Medium::Channel(channel, profile) => {
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

    /// Logs that an end has given a frame to its modem or to the channel.
    pub(crate) fn log_event(&mut self, end: usize, event: &FrameEvent, now: Instant) {
        let FrameEvent::Sent { frame, kind, .. } = event else { return };
        match self.unlogged[end].pop_front() {
            Some(transmission) => {
                self.log.handle_sent(transmission, end == VEHICLE, frame.len(), kind.name(), now.as_secs_f64());
            }
            None => self.log.sent[end] += 1,
        }
    }
}

/// Adds the time of a computation to `spent`.
fn timed<T>(spent: &mut Duration, compute: impl FnOnce() -> T) -> T {
    let began = std::time::Instant::now();
    let result = compute();
    *spent += began.elapsed();
    result
}

/// Loses the frames of a recorded link again.
fn replay(channel: &mut Channel, folder: &Path) -> Result<(), UserError> {
    let link = RecordedLink::read(folder)?;
    for (from, to, frames) in [(VEHICLE, SURFACE, link.up), (SURFACE, VEHICLE, link.down)] {
        let recorded = frames.iter().map(|frame| (Duration::from_secs_f64(frame.arrives_s), frame.delivered));
        if let Some(losses) = Replayed::new(recorded) {
            channel.set_link_loss(NODES[from], NODES[to], losses.into());
        }
    }
    Ok(())
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
