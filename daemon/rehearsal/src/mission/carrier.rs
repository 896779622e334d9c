//! A mission through drivers and emulated modems instead of bare water.

use super::{Mission, channel_config};
use crate::docked::{Docked, SURFACE, VEHICLE};
use scenecast_config::{Config, ModemKind};
use scenecast_core::UserError;
use scenecast_drivers::modem::ModemEvent;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;
use sim_channel::Channel;

/// The modems, if the configuration names a make; TCP and UDP are no modems: there the water is bare.
pub(super) fn docked(config: &Config, seed: u64, now: Instant) -> Result<Option<Docked>, UserError> {
    match config.modem.kind {
        ModemKind::Tcp | ModemKind::Udp => Ok(None),
        ModemKind::S2c | ModemKind::Micromodem | ModemKind::Transparent => {
            Docked::new(config, Channel::new(channel_config(config), seed), seed, now).map(Some)
        }
    }
}

/// What the links must know: the vehicle's, the surface's.
pub(super) fn profiles(docked: &mut Docked) -> [ModemProfile; 2] {
    [VEHICLE, SURFACE].map(|end| *docked.station(end).profile())
}

impl Mission {
    /// Takes what the modems tell.
    pub(super) fn handle_modems(&mut self) {
        let now = self.now;
        let Some(mut docked) = self.docked.take() else { return };
        docked.handle_timeout(now);
        for end in [VEHICLE, SURFACE] {
            while let Some(event) = docked.poll_event(end) {
                self.handle_modem(end, event, now);
            }
        }
        self.docked = Some(docked);
    }

    fn handle_modem(&mut self, end: usize, event: ModemEvent, now: Instant) {
        let at_vehicle = end == VEHICLE;
        match event {
            ModemEvent::Sent if at_vehicle => self.vehicle.handle_transmit_outcome(now),
            ModemEvent::Sent => self.surface.handle_transmit_outcome(now),
            ModemEvent::Received(bytes) if at_vehicle => self.vehicle.handle_frame(&bytes, now),
            ModemEvent::Received(bytes) => {
                self.heard_bits += self.modem.bits_on_air(bytes.len());
                self.surface.handle_frame(&bytes, now);
            }
            ModemEvent::Poll(frames) if at_vehicle => self.vehicle.handle_poll(frames),
            ModemEvent::Poll(frames) => self.surface.handle_poll(frames),
            ModemEvent::Repeated(bits) if at_vehicle => self.vehicle.handle_repeated(bits, now),
            ModemEvent::Repeated(bits) => self.surface.handle_repeated(bits, now),
            ModemEvent::Fix(vehicle, line) => self.surface.handle_range(vehicle, &line, now),
            ModemEvent::Ready | ModemEvent::Lost | ModemEvent::Refused(_) => {}
        }
    }

    /// Gives the modems what the ends have to say.
    pub(super) fn speak_through_modems(&mut self) {
        let now = self.now;
        let Some(mut docked) = self.docked.take() else { return };
        if docked.station(SURFACE).takes_cycles(now)
            && let Some(cycle) = self.surface.poll_cycle(now)
        {
            docked.station(SURFACE).begin_cycle(cycle, now);
        }
        for end in [VEHICLE, SURFACE] {
            while docked.station(end).takes_frames() {
                let next =
                    if end == VEHICLE { self.vehicle.poll_transmit(now) } else { self.surface.poll_transmit(now) };
                let Some(transmit) = next else { break };
                self.log.sent[end] += 1;
                self.audits[end].record(self.modem.bits_on_air(transmit.bytes.len()), now);
                // What a modem refuses is lost, and the link repairs it.
                let _ = docked.station(end).send(transmit, now);
            }
        }
        docked.write(now);
        self.docked = Some(docked);
    }
}
