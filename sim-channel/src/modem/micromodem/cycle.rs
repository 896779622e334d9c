//! `CCCYC`, `CADRQ`, `CCTXD`: a cycle init and the frames that the modem requests from its host; `CACYC`, `CARXD`, `CAACK`: what
//! it receives.

use super::base::{MicromodemBase, MicromodemTask};
use super::packet::{FSK_MINI, Packet, PacketKind, PacketRate};
use super::sentence::{NmeaSentence, from_hex, to_hex};
use super::transducer;
use super::transmitter::{PacketSignal, QueuedPacket};
use std::time::Duration;

/// A packet that the host is filling.
#[derive(Clone, Debug)]
struct OpenCycle {
    packet: Packet,
    rate: PacketRate,
    requested_frames: u8,
    /// Number of the open data request.
    request: u32,
    /// The acknowledgement flag in `CADRQ`.
    ack_wanted: bool,
}

#[derive(Debug, Default)]
pub(super) struct CycleService {
    cycle: Option<OpenCycle>,
    /// Counts data requests, so that an old timer has no effect; continues over restarts.
    requests: u32,
}

impl CycleService {
    /// Drops the packet that is being filled.
    pub(super) fn abandon(&mut self) {
        self.cycle = None;
    }

    /// The host orders a cycle: `$CCCYC,<cmd>,<src>,<dst>,<rate>,<ack>,<nframes>`.
    pub(super) fn on_command(&mut self, base: &mut MicromodemBase, sentence: &NmeaSentence, now: Duration) {
        let fields = (sentence.number(1), sentence.number(2), sentence.number(3), sentence.number::<u8>(4));
        let (Some(src), Some(dst), Some(rate), Some(ack)) = fields else {
            return base.report_error("NMEA", 1, "CCCYC: wrong field", now);
        };
        let frames: u8 = sentence.number(5).unwrap_or(1);
        let Some(rate) = PacketRate::of(rate).filter(|rate| (1..=rate.max_frames).contains(&frames) && ack <= 1) else {
            return base.report_error("NMEA", 1, "CCCYC: out of range", now);
        };
        base.report(&sentence.echo(), now);
        let mut init = Packet::new(PacketKind::CycleInit, src, dst);
        (init.rate, init.ack, init.frame_count) = (rate.number, ack == 1, frames);
        let ours = src == base.address();
        if ours {
            self.open(&init);
        }
        if ours && !rate.is_fsk() {
            self.request_data(base, now);
        } else {
            base.transmitter.push(QueuedPacket {
                packet: init,
                airtime: FSK_MINI,
                bytes: 0,
                packet_type: 2,
                expected: frames,
                reported: true,
                then_request_data: ours,
            });
        }
    }

    /// A cycle init has been received: a minipacket before FSK data, or a request to send.
    pub(super) fn on_init(&mut self, base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
        report_cycle(base, packet, packet.ack, now);
        transducer::report_reception(base, packet, signal, 2, now);
        if packet.src == base.address() {
            self.open(packet);
            self.request_data(base, now);
        }
    }

    /// Begins to fill the packet that a cycle init, of this host or received, requests from this modem.
    fn open(&mut self, init: &Packet) {
        let Some(rate) = PacketRate::of(init.rate) else { return };
        let mut packet = Packet::new(PacketKind::Data, init.src, init.dst);
        packet.rate = init.rate;
        let requested_frames = init.frame_count.clamp(1, rate.max_frames);
        self.cycle = Some(OpenCycle { packet, rate, requested_frames, request: 0, ack_wanted: init.ack });
    }

    /// Requests the next frame from the host: `$CADRQ,<HHMMSS>,<src>,<dst>,<ack>,<max bytes>,<frame>`.
    pub(super) fn request_data(&mut self, base: &mut MicromodemBase, now: Duration) {
        self.requests += 1;
        let time = base.clock.hhmmss(now);
        let Some(cycle) = &mut self.cycle else { return };
        cycle.request = self.requests;
        let (src, dst, ack) = (cycle.packet.src, cycle.packet.dst, u8::from(cycle.ack_wanted));
        let (bytes, frame) = (cycle.rate.frame_bytes, cycle.packet.frames.len() + 1);
        base.report(&format!("CADRQ,{time},{src},{dst},{ack},{bytes},{frame}"), now);
        let timeout = Duration::from_secs(u64::from(base.nvram.number("DTO").max(1)));
        base.board.schedule(now + timeout, MicromodemTask::DataTimeout { request: self.requests });
    }

    /// `$CCTXD,<src>,<dst>,<ack>,<hex>`, or `$CCTXA` with text.
    pub(super) fn on_data(&mut self, base: &mut MicromodemBase, sentence: &NmeaSentence, ascii: bool, now: Duration) {
        let data = if ascii { Some(sentence.text(3).as_bytes().to_vec()) } else { from_hex(sentence.text(3)) };
        let route = (sentence.number::<u8>(0), sentence.number::<u8>(1), sentence.number::<u8>(2));
        let ((Some(src), Some(dst), Some(ack @ 0..=1)), Some(data)) = (route, data) else {
            return base.report_error("NMEA", 1, "CCTXD: wrong field", now);
        };
        let room = self.cycle.as_ref().map_or(256, |cycle| cycle.rate.frame_bytes);
        if data.len() > room {
            return base.report_error("NMEA", 1, "CCTXD: frame too long", now);
        }
        let name = if ascii { "CATXA" } else { "CATXD" };
        base.report(&format!("{name},{src},{dst},{ack},{}", data.len()), now);
        let Some(cycle) = &mut self.cycle else { return };
        if data.is_empty() {
            return self.close(base);
        }
        cycle.packet.ack |= ack == 1;
        cycle.packet.ascii |= ascii;
        cycle.packet.frames.push(Some(data));
        if cycle.packet.frames.len() < usize::from(cycle.requested_frames) {
            self.request_data(base, now);
        } else {
            self.close(base);
        }
    }

    /// The host did not deliver in time: the packet leaves with the frames that it has.
    pub(super) fn on_data_timeout(&mut self, base: &mut MicromodemBase, request: u32, now: Duration) {
        let Some(cycle) = self.cycle.as_ref().filter(|cycle| cycle.request == request) else { return };
        let (time, frame) = (base.clock.hhmmss(now), cycle.packet.frames.len() + 1);
        base.report(&format!("CAERR,{time},DATA_TIMEOUT,{frame}"), now);
        self.close(base);
    }

    /// Transmits the frames collected, if there are any.
    fn close(&mut self, base: &mut MicromodemBase) {
        let Some(OpenCycle { mut packet, rate, requested_frames, .. }) = self.cycle.take() else { return };
        let frames = packet.frames.len() as u8;
        if frames == 0 {
            return;
        }
        packet.frame_count = frames;
        base.transmitter.push(QueuedPacket {
            airtime: rate.airtime(frames),
            bytes: packet.frames.len() * rate.frame_bytes,
            packet_type: rate.packet_type(),
            expected: requested_frames,
            reported: true,
            then_request_data: false,
            packet,
        });
    }
}

/// From a packet's content to the reply that the modem sends by itself.
pub(super) const TURN_AROUND: Duration = Duration::from_millis(300);

/// Reports a cycle init that was received: `$CACYC,0,<src>,<dst>,<rate>,<ack>,<nframes>`.
pub(super) fn report_cycle(base: &mut MicromodemBase, packet: &Packet, ack: bool, now: Duration) {
    let Packet { src, dst, rate, frame_count, .. } = packet;
    base.report(&format!("CACYC,0,{src},{dst},{rate},{},{frame_count}", u8::from(ack)), now);
}

/// PSK packets carry their own cycle init, which has no acknowledgement flag; FSK packets had theirs before.
pub(super) fn on_data_packet(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    if packet.rate > 0 {
        report_cycle(base, packet, false, now);
    }
    let mut good = Vec::new();
    for (number, frame) in (1u8..).zip(&packet.frames) {
        match frame {
            Some(bytes) => {
                good.push(number);
                report_frame(base, packet, number, bytes, now);
            }
            None => base.report("CAMSG,BAD_CRC,0", now),
        }
    }
    transducer::report_reception(base, packet, signal, if packet.rate == 0 { 1 } else { 3 }, now);
    let own = base.address();
    if packet.ack && own != 0 && packet.dst == own && !good.is_empty() {
        let mut ack = Packet::new(PacketKind::Ack, own, packet.src);
        ack.rate = packet.rate;
        ack.frames.push(Some(good));
        base.board.schedule(now + TURN_AROUND, MicromodemTask::Reply(Box::new(ack)));
    }
}

/// `$CARXD,<src>,<dst>,<ack>,<frame>,<hex>`, or `$CARXA` with text.
fn report_frame(base: &mut MicromodemBase, packet: &Packet, number: u8, bytes: &[u8], now: Duration) {
    let (src, dst, ack) = (packet.src, packet.dst, u8::from(packet.ack));
    let sentence = if packet.ascii {
        format!("CARXA,{src},{dst},{ack},{number},{}", String::from_utf8_lossy(bytes))
    } else {
        format!("CARXD,{src},{dst},{ack},{number},{}", to_hex(bytes))
    };
    base.report(&sentence, now);
}

/// One `$CAACK,<src>,<dst>,<frame>,1` for each frame.
pub(super) fn on_ack(base: &mut MicromodemBase, packet: &Packet, signal: &PacketSignal, now: Duration) {
    for number in packet.frames.iter().flatten().flatten() {
        base.report(&format!("CAACK,{},{},{number},1", packet.src, packet.dst), now);
    }
    transducer::report_reception(base, packet, signal, if packet.rate == 0 { 2 } else { 4 }, now);
}
