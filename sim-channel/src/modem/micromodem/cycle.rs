//! `CCCYC`, `CADRQ`, `CCTXD`: a cycle init, and the frames that the host is asked for.

use super::packet::{Kind, Packet};
use super::rates::{FSK_MINI, Rate};
use super::sentence::{Sentence, from_hex};
use super::transmit::Outgoing;
use super::{Event, Micromodem};
use crate::Duration;

/// A packet that is being filled by the host.
#[derive(Clone, Debug)]
pub(super) struct Cycle {
    pub packet: Packet,
    pub rate: Rate,
    /// Frames asked for.
    pub wanted: u8,
    /// The request that is open.
    pub request: u32,
    /// What `CADRQ` says of acknowledgement.
    pub ack_wanted: bool,
}

impl Micromodem {
    /// `$CCCYC,<cmd>,<src>,<dst>,<rate>,<ack>,<nframes>`
    pub(super) fn on_cycle_command(&mut self, sentence: &Sentence, now: Duration) {
        let fields = (sentence.number(1), sentence.number(2), sentence.number(3), sentence.number::<u8>(4));
        let (Some(src), Some(dst), Some(rate), Some(ack)) = fields else {
            return self.complain("NMEA", 1, "CCCYC: wrong field", now);
        };
        let frames: u8 = sentence.number(5).unwrap_or(1);
        let Some(rate) = Rate::of(rate).filter(|rate| (1..=rate.max_frames).contains(&frames) && ack <= 1) else {
            return self.complain("NMEA", 1, "CCCYC: out of range", now);
        };
        self.tell(&sentence.echo(), now);
        let mut init = Packet::new(Kind::CycleInit, src, dst);
        (init.rate, init.ack, init.frames_told) = (rate.number, ack == 1, frames);
        let ours = src == self.address();
        if ours {
            self.open_cycle(&init, now);
        }
        if ours && !rate.is_fsk() {
            self.ask_for_data(now);
        } else {
            self.air.queue.push_back(Outgoing {
                packet: init,
                airtime: FSK_MINI,
                bytes: 0,
                packet_type: 2,
                expected: frames,
                told: true,
                then_ask: ours,
            });
        }
    }

    /// Begins to fill the packet that a cycle init, of this host or heard, asks this modem for.
    pub(super) fn open_cycle(&mut self, init: &Packet, _now: Duration) {
        let Some(rate) = Rate::of(init.rate) else { return };
        let mut packet = Packet::new(Kind::Data, init.src, init.dst);
        packet.rate = init.rate;
        let wanted = init.frames_told.clamp(1, rate.max_frames);
        self.cycle = Some(Cycle { packet, rate, wanted, request: 0, ack_wanted: init.ack });
    }

    /// `$CADRQ,<HHMMSS>,<src>,<dst>,<ack>,<max bytes>,<frame>`
    pub(super) fn ask_for_data(&mut self, now: Duration) {
        self.requests += 1;
        let time = self.clock.hhmmss(now);
        let Some(cycle) = &mut self.cycle else { return };
        cycle.request = self.requests;
        let (src, dst, ack) = (cycle.packet.src, cycle.packet.dst, u8::from(cycle.ack_wanted));
        let request =
            format!("CADRQ,{time},{src},{dst},{ack},{},{}", cycle.rate.frame_bytes, cycle.packet.frames.len() + 1);
        self.tell(&request, now);
        let patience = Duration::from_secs(u64::from(self.nvram.number("DTO").max(1)));
        self.board.plan(now + patience, Event::DataTimeout { request: self.requests });
    }

    /// `$CCTXD,<src>,<dst>,<ack>,<hex>`, or `$CCTXA` with text.
    pub(super) fn on_data(&mut self, sentence: &Sentence, ascii: bool, now: Duration) {
        let data = if ascii { Some(sentence.text(3).as_bytes().to_vec()) } else { from_hex(sentence.text(3)) };
        let route = (sentence.number::<u8>(0), sentence.number::<u8>(1), sentence.number::<u8>(2));
        let ((Some(src), Some(dst), Some(ack @ 0..=1)), Some(data)) = (route, data) else {
            return self.complain("NMEA", 1, "CCTXD: wrong field", now);
        };
        let room = self.cycle.as_ref().map_or(256, |cycle| cycle.rate.frame_bytes);
        if data.len() > room {
            return self.complain("NMEA", 1, "CCTXD: frame too long", now);
        }
        let name = if ascii { "CATXA" } else { "CATXD" };
        self.tell(&format!("{name},{src},{dst},{ack},{}", data.len()), now);
        let Some(cycle) = &mut self.cycle else { return };
        if data.is_empty() {
            return self.close_cycle();
        }
        cycle.packet.ack |= ack == 1;
        cycle.packet.ascii |= ascii;
        cycle.packet.frames.push(Some(data));
        if cycle.packet.frames.len() < usize::from(cycle.wanted) {
            self.ask_for_data(now);
        } else {
            self.close_cycle();
        }
    }

    /// The host did not answer a request: what there is goes out.
    pub(super) fn on_data_timeout(&mut self, request: u32, now: Duration) {
        let Some(cycle) = self.cycle.as_ref().filter(|cycle| cycle.request == request) else { return };
        let (time, frame) = (self.clock.hhmmss(now), cycle.packet.frames.len() + 1);
        self.tell(&format!("CAERR,{time},DATA_TIMEOUT,{frame}"), now);
        self.close_cycle();
    }

    /// Transmits the frames collected, if there are any.
    fn close_cycle(&mut self) {
        let Some(Cycle { mut packet, rate, wanted, .. }) = self.cycle.take() else { return };
        let frames = packet.frames.len() as u8;
        if frames == 0 {
            return;
        }
        packet.frames_told = frames;
        self.air.queue.push_back(Outgoing {
            airtime: rate.airtime(frames),
            bytes: packet.frames.len() * rate.frame_bytes,
            packet_type: rate.packet_type(),
            expected: wanted,
            told: true,
            then_ask: false,
            packet,
        });
    }
}
