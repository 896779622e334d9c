//! Packets heard: `CARXP`, `CACYC`, `CARXD`, `CAACK`, `CACST`.

use super::packet::{Kind, Packet};
use super::rates::{FSK_MINI, PSK_MINI};
use super::sentence::to_hex;
use super::transmit::Outgoing;
use super::{Event, Generation, Micromodem};
use crate::{Arrival, Duration, LossReason, Onset, Outcome};

/// Demodulation and decoding after the end of a packet.
const DECODING: Duration = Duration::from_millis(200);
/// From a packet's content to the answer the modem gives by itself.
pub(super) const TURN_ROUND: Duration = Duration::from_millis(300);

/// How a packet was heard.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signal {
    pub began: Duration,
    /// One way.
    pub travel: Duration,
    /// Input signal to noise ratio, dB; a figure that falls with range.
    pub snr_db: f64,
}

impl Signal {
    fn of(arrival: &Arrival) -> Self {
        let began = arrival.at.saturating_sub(arrival.airtime);
        let snr_db = (40.0 - 10.0 * (arrival.range_m.max(10.0) / 10.0).log10()).max(0.0);
        Self { began, travel: began.saturating_sub(arrival.sent_at), snr_db }
    }
}

impl Micromodem {
    /// The beginning of a packet.
    pub(super) fn hear_beginning(&mut self, onset: &Onset, now: Duration) {
        let packet = Packet::decode(&onset.bytes);
        if self.awake && packet.as_ref().is_none_or(|packet| self.notices(packet)) {
            self.tell_detection(onset.transmission, packet.is_none_or(|packet| packet.is_psk()), now);
        }
    }

    /// PSK packets of another header version and pings of others go by unnoticed.
    fn notices(&self, packet: &Packet) -> bool {
        let header_version = u8::from(self.nvram.is_on("psk.packet.mod_hdr_version"));
        let foreign = packet.is_psk() && packet.header_version != header_version;
        let private = matches!(packet.kind, Kind::Ping | Kind::PingReply) && packet.dst != self.address();
        !foreign && !private
    }

    pub(super) fn hear(&mut self, arrival: &Arrival, now: Duration) {
        if self.awake {
            self.hear_end(arrival, now);
            self.detected.remove(&arrival.transmission);
        }
    }

    fn hear_end(&mut self, arrival: &Arrival, now: Duration) {
        let signal = Signal::of(arrival);
        let packet = match &arrival.outcome {
            Outcome::Delivered { bytes, .. } => Packet::decode(bytes),
            Outcome::Lost { reason: LossReason::Noise | LossReason::Collision, .. } => None,
            Outcome::Lost { .. } => return,
        };
        match packet {
            None => self.tell_timeout(arrival.transmission, &signal, now),
            Some(packet) if self.notices(&packet) => {
                self.tell_detection(arrival.transmission, packet.is_psk(), now);
                self.board.plan(now + DECODING, Event::Received(Box::new((packet, signal))));
            }
            Some(_) => {}
        }
    }

    /// `CARXP`, once for a transmission.
    fn tell_detection(&mut self, transmission: u64, psk: bool, now: Duration) {
        if self.detected.insert(transmission) && self.nvram.is_on("RXP") {
            self.tell(&format!("CARXP,{}", u8::from(psk)), now);
        }
    }

    /// A packet was detected and never understood; its statistics line is short.
    fn tell_timeout(&mut self, transmission: u64, signal: &Signal, now: Duration) {
        self.tell_detection(transmission, true, now);
        self.tell("CAMSG,PACKET_TIMEOUT,0", now);
        if self.nvram.is_on("CST") {
            let (version, arrived) = (self.statistics_version(), self.arrival_time(signal.began));
            self.tell(&format!("CACST,{version}2,{arrived}"), now);
        }
    }

    pub(super) fn on_received(&mut self, packet: &Packet, signal: &Signal, now: Duration) {
        match packet.kind {
            Kind::CycleInit => self.on_cycle_init(packet, signal, now),
            Kind::Data => self.on_data_packet(packet, signal, now),
            Kind::Ack => self.on_ack(packet, signal, now),
            Kind::Flexible => self.on_flexible(packet, signal, now),
            Kind::Ping => self.on_ping(packet, signal, now),
            Kind::PingReply => self.on_ping_reply(packet, signal, now),
            Kind::User => self.on_user(packet, signal, now),
        }
    }

    /// A minipacket before FSK data, or a request to send.
    fn on_cycle_init(&mut self, packet: &Packet, signal: &Signal, now: Duration) {
        self.tell_cycle(packet, packet.ack, packet.frames_told, now);
        self.tell_statistics(packet, signal, 2, now);
        if packet.src == self.address() {
            self.open_cycle(packet, now);
            self.ask_for_data(now);
        }
    }

    /// `$CACYC,0,<src>,<dst>,<rate>,<ack>,<nframes>`
    fn tell_cycle(&mut self, packet: &Packet, ack: bool, frames: u8, now: Duration) {
        let Packet { src, dst, rate, .. } = packet;
        self.tell(&format!("CACYC,0,{src},{dst},{rate},{},{frames}", u8::from(ack)), now);
    }

    /// PSK packets carry their own cycle init, which says nothing of acknowledgement; FSK packets had theirs before.
    fn on_data_packet(&mut self, packet: &Packet, signal: &Signal, now: Duration) {
        if packet.rate > 0 {
            self.tell_cycle(packet, false, packet.frames_told, now);
        }
        let mut good = Vec::new();
        for (number, frame) in (1u8..).zip(&packet.frames) {
            match frame {
                Some(bytes) => {
                    good.push(number);
                    self.tell_frame(packet, number, bytes, now);
                }
                None => self.tell("CAMSG,BAD_CRC,0", now),
            }
        }
        self.tell_statistics(packet, signal, if packet.rate == 0 { 1 } else { 3 }, now);
        let own = self.address();
        if packet.ack && own != 0 && packet.dst == own && !good.is_empty() {
            let mut ack = Packet::new(Kind::Ack, own, packet.src);
            ack.rate = packet.rate;
            ack.frames.push(Some(good));
            self.board.plan(now + TURN_ROUND, Event::Reply(Box::new(ack)));
        }
    }

    /// `$CARXD,<src>,<dst>,<ack>,<frame>,<hex>`
    fn tell_frame(&mut self, packet: &Packet, number: u8, bytes: &[u8], now: Duration) {
        let (src, dst, ack) = (packet.src, packet.dst, u8::from(packet.ack));
        let sentence = if packet.ascii {
            format!("CARXA,{src},{dst},{ack},{number},{}", String::from_utf8_lossy(bytes))
        } else {
            format!("CARXD,{src},{dst},{ack},{number},{}", to_hex(bytes))
        };
        self.tell(&sentence, now);
    }

    /// One `$CAACK,<src>,<dst>,<frame>,1` for each frame.
    fn on_ack(&mut self, packet: &Packet, signal: &Signal, now: Duration) {
        for number in packet.frames.iter().flatten().flatten() {
            self.tell(&format!("CAACK,{},{},{number},1", packet.src, packet.dst), now);
        }
        self.tell_statistics(packet, signal, if packet.rate == 0 { 2 } else { 4 }, now);
    }

    /// Something the modem sends without being told to by its host.
    pub(super) fn send_quietly(&mut self, packet: Packet) {
        let airtime = if packet.kind == Kind::Ack && packet.rate > 0 { PSK_MINI } else { FSK_MINI };
        let packet_type = if packet.is_psk() { 4 } else { 2 };
        let bytes = packet.bytes();
        self.air.queue.push_back(Outgoing {
            packet,
            airtime,
            bytes,
            packet_type,
            expected: 0,
            told: false,
            then_ask: false,
        });
    }

    /// The field that tells the layout of statistics, which a Micromodem 1 does not have.
    pub(super) fn statistics_version(&self) -> &'static str {
        if self.config.generation == Generation::One { "" } else { "6," }
    }

    fn arrival_time(&self, at: Duration) -> String {
        match self.config.generation {
            Generation::One => self.clock.hhmmss_fraction(at),
            Generation::Two => self.clock.compact(at),
        }
    }

    /// `CACST`: every reception has one, and it comes last.
    pub(super) fn tell_statistics(&mut self, packet: &Packet, signal: &Signal, packet_type: u8, now: Duration) {
        if !self.nvram.is_on("CST") {
            return;
        }
        let (version, arrived) = (self.statistics_version(), self.arrival_time(signal.began));
        let Packet { src, dst, rate, .. } = packet;
        let bad = packet.frames.iter().filter(|frame| frame.is_none()).count();
        let frames = if packet.kind == Kind::CycleInit { 0 } else { packet.frames.len() };
        let psk_error = u8::from(bad > 0);
        let snr = signal.snr_db;
        let detector = "06,32767,45,0102,0123,07,00,00,00,00";
        let quality = format!("150,{snr:.1},{:.2},{:.2},{:.2},-01,0.00,51", snr / 2.0, snr / 2.0, -snr / 2.0);
        let (carrier, bandwidth) = (self.nvram.number("FC0"), self.nvram.number("BW0"));
        self.tell(
            &format!(
                "CACST,{version}0,{arrived},{detector},{rate},{src:03},{dst:03},{psk_error},{packet_type},{frames},{bad},{quality},{carrier},{bandwidth}"
            ),
            now,
        );
    }
}
