//! Detection of packets: `CARXP` at the beginning, a timeout if the packet is never decoded.

use super::base::{MicromodemBase, MicromodemTask};
use super::packet::{Packet, PacketKind};
use super::signal::PacketSignal;
use super::statistics;
use crate::channel::{Arrival, LossReason, Onset, ReceptionOutcome};
use std::collections::BTreeSet;
use std::time::Duration;

/// Demodulation and decoding after the end of a packet.
const DECODING_TIME: Duration = Duration::from_millis(200);

#[derive(Debug, Default)]
pub(super) struct Detector {
    /// Transmissions whose detection has been reported.
    detected: BTreeSet<u64>,
}

impl Detector {
    pub(super) fn clear(&mut self) {
        self.detected.clear();
    }

    /// The beginning of a packet.
    pub(super) fn on_onset(&mut self, base: &mut MicromodemBase, onset: &Onset, now: Duration) {
        let packet = Packet::decode(&onset.bytes);
        if base.is_awake() && packet.as_ref().is_none_or(|packet| notices(base, packet)) {
            self.report(base, onset.transmission, packet.is_none_or(|packet| packet.is_psk()), now);
        }
    }

    /// The end of a packet, which is handed over after its decoding time.
    pub(super) fn on_arrival(&mut self, base: &mut MicromodemBase, arrival: &Arrival, now: Duration) {
        if base.is_awake() {
            self.on_end(base, arrival, now);
            self.detected.remove(&arrival.transmission);
        }
    }

    fn on_end(&mut self, base: &mut MicromodemBase, arrival: &Arrival, now: Duration) {
        let signal = PacketSignal::of(arrival);
        let packet = match &arrival.outcome {
            ReceptionOutcome::Delivered { bytes, .. } => Packet::decode(bytes),
            ReceptionOutcome::Lost { reason: LossReason::Noise | LossReason::Collision, .. } => None,
            ReceptionOutcome::Lost { .. } => return,
        };
        match packet {
            None => {
                self.report(base, arrival.transmission, true, now);
                statistics::report_timeout(base, &signal, now);
            }
            Some(packet) if notices(base, &packet) => {
                self.report(base, arrival.transmission, packet.is_psk(), now);
                base.board.schedule(now + DECODING_TIME, MicromodemTask::Received(Box::new((packet, signal))));
            }
            Some(_) => {}
        }
    }

    /// `CARXP`, once for each transmission.
    fn report(&mut self, base: &mut MicromodemBase, transmission: u64, psk: bool, now: Duration) {
        if self.detected.insert(transmission) && base.nvram.is_on("RXP") {
            base.report(&format!("CARXP,{}", u8::from(psk)), now);
        }
    }
}

/// PSK packets of another header version and pings of others pass unnoticed.
fn notices(base: &MicromodemBase, packet: &Packet) -> bool {
    let header_version = u8::from(base.nvram.is_on("psk.packet.mod_hdr_version"));
    let foreign = packet.is_psk() && packet.header_version != header_version;
    let private = matches!(packet.kind, PacketKind::Ping | PacketKind::PingReply) && packet.dst != base.address();
    !foreign && !private
}
