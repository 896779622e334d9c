//! The transducer: packets that wait for it, detection and measurements of those received, and the statistics `CACST` and `CAXST`
//! of both.

use super::base::{MicromodemBase, MicromodemTask};
use super::packet::{FSK_MINI, PSK_MINI, Packet, PacketKind};
use crate::channel::{Arrival, LossReason, Onset, ReceptionOutcome};
use std::collections::{BTreeSet, VecDeque};
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

const MAX_QUEUED_PACKETS: usize = 8;

#[derive(Clone, Debug)]
pub(crate) struct QueuedPacket {
    pub packet: Packet,
    pub airtime: Duration,
    /// Bytes in `CATXP`: whole frames, however full they are.
    pub bytes: usize,
    /// 1 FSK, 2 FSK mini, 3 PSK, 4 PSK mini, 5 flexible.
    pub packet_type: u8,
    /// Frames that the cycle init requested.
    pub expected: u8,
    /// False for replies that the modem sends by itself: the host gets no report of them.
    pub reported: bool,
    /// Whether the modem requests data from the host after this packet.
    pub then_request_data: bool,
}

impl QueuedPacket {
    /// A minipacket by order of the host.
    pub(super) fn mini(packet: Packet) -> Self {
        let bytes = packet.bytes();
        Self { packet, airtime: FSK_MINI, bytes, packet_type: 2, expected: 0, reported: true, then_request_data: false }
    }

    /// A reply that the modem sends by itself.
    pub(super) fn reply(packet: Packet) -> Self {
        let airtime = if packet.kind == PacketKind::Ack && packet.rate > 0 { PSK_MINI } else { FSK_MINI };
        let packet_type = if packet.is_psk() { 4 } else { 2 };
        Self { airtime, packet_type, reported: false, ..Self::mini(packet) }
    }
}

/// A packet that has left.
#[derive(Clone, Debug)]
pub(crate) struct SentPacket {
    pub out: QueuedPacket,
    pub began: Duration,
}

#[derive(Debug, Default)]
pub(super) struct Transmitter {
    queue: VecDeque<QueuedPacket>,
    busy_until: Duration,
    /// Number of the last packet; continues over restarts.
    last_number: u8,
}

impl Transmitter {
    pub(super) fn push(&mut self, out: QueuedPacket) {
        self.queue.push_back(out);
    }

    pub(super) fn is_full(&self) -> bool {
        self.queue.len() >= MAX_QUEUED_PACKETS
    }

    pub(super) fn is_busy(&self, now: Duration) -> bool {
        now < self.busy_until
    }

    pub(super) fn next_number(&self) -> u8 {
        self.last_number.wrapping_add(1)
    }

    /// Numbers the next packet and occupies the transducer for its airtime; `None` while it is occupied.
    pub(super) fn begin(&mut self, now: Duration) -> Option<QueuedPacket> {
        if self.is_busy(now) {
            return None;
        }
        let mut out = self.queue.pop_front()?;
        self.last_number = self.next_number();
        out.packet.number = self.last_number;
        self.busy_until = now + out.airtime;
        Some(out)
    }

    pub(super) fn clear(&mut self) {
        self.queue.clear();
        self.busy_until = Duration::ZERO;
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketSignal {
    pub began: Duration,
    pub one_way: Duration,
    /// Input signal-to-noise ratio, dB; falls with range.
    pub snr_db: f64,
}

impl PacketSignal {
    pub(super) fn of(arrival: &Arrival) -> Self {
        let began = arrival.at.saturating_sub(arrival.airtime);
        let snr_db = (40.0 - 10.0 * (arrival.range_m.max(10.0) / 10.0).log10()).max(0.0);
        Self { began, one_way: began.saturating_sub(arrival.sent_at), snr_db }
    }
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
