//! The transducer: detection and measurements of received packets, and the statistics `CACST` and `CAXST` of those and of sent ones.

use super::base::{MicromodemBase, MicromodemTask};
use super::packet::{Packet, PacketKind};
use super::transmitter::{PacketSignal, QueuedPacket, SentPacket};
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
                report_timeout(base, &signal, now);
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

/// The field with the version of the layout, which a Micromodem 1 does not have.
fn version(base: &MicromodemBase) -> &'static str {
    if base.is_first_generation() { "" } else { "6," }
}

fn arrival_time(base: &MicromodemBase, at: Duration) -> String {
    if base.is_first_generation() { base.clock.hhmmss_fraction(at) } else { base.clock.compact(at) }
}

/// `CACST`: the last report of every reception.
pub(super) fn report_reception(
    base: &mut MicromodemBase,
    packet: &Packet,
    signal: &PacketSignal,
    packet_type: u8,
    now: Duration,
) {
    if !base.nvram.is_on("CST") {
        return;
    }
    let (version, arrived) = (version(base), arrival_time(base, signal.began));
    let Packet { src, dst, rate, .. } = packet;
    let bad = packet.frames.iter().filter(|frame| frame.is_none()).count();
    let frames = if packet.kind == PacketKind::CycleInit { 0 } else { packet.frames.len() };
    let psk_error = u8::from(bad > 0);
    let snr = signal.snr_db;
    let detector = "06,32767,45,0102,0123,07,00,00,00,00";
    let route = format!("{rate},{src:03},{dst:03},{psk_error},{packet_type},{frames},{bad}");
    let quality = format!("150,{snr:.1},{:.2},{:.2},{:.2},-01,0.00,51", snr / 2.0, snr / 2.0, -snr / 2.0);
    let (carrier, bandwidth) = (base.nvram.number("FC0"), base.nvram.number("BW0"));
    base.report(&format!("CACST,{version}0,{arrived},{detector},{route},{quality},{carrier},{bandwidth}"), now);
}

/// A packet was detected and never decoded; its `CACST` is short.
pub(super) fn report_timeout(base: &mut MicromodemBase, signal: &PacketSignal, now: Duration) {
    base.report("CAMSG,PACKET_TIMEOUT,0", now);
    if base.nvram.is_on("CST") {
        let (version, arrived) = (version(base), arrival_time(base, signal.began));
        base.report(&format!("CACST,{version}2,{arrived}"), now);
    }
}

/// `CATXF` and `CAXST`, version 6; without the version on a Micromodem 1.
pub(super) fn report_transmission(base: &mut MicromodemBase, sent: &SentPacket, now: Duration) {
    const CLOCK_MODE: u8 = 6;
    const GOOD: u8 = 0;
    const PROBE: u32 = 200;
    let QueuedPacket { packet, bytes, packet_type, expected, reported, .. } = &sent.out;
    if !reported {
        return;
    }
    base.report(&format!("CATXF,{bytes}"), now);
    if !base.nvram.is_on("XST") {
        return;
    }
    let (version, when) = (version(base), base.clock.date_and_time(sent.began));
    let (bandwidth, carrier) = (base.nvram.number("BW0"), base.nvram.number("FC0"));
    let modulation = format!("{CLOCK_MODE},{GOOD},{PROBE},{bandwidth},{carrier}");
    let route = format!("{},{},{},{}", packet.rate, packet.src, packet.dst, u8::from(packet.ack));
    let frames = packet.frames.len();
    base.report(&format!("CAXST,{version}{when},{modulation},{route},{expected},{frames},{packet_type},{bytes}"), now);
}
