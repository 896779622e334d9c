//! Packets on their way out: `CATXP`, `CATXF`, `CAXST`.

use super::packet::Packet;
use super::{Event, Micromodem};
use crate::Duration;
use crate::modem::Transmission;
use std::collections::VecDeque;

/// A packet that waits for the transducer.
#[derive(Clone, Debug)]
pub(super) struct Outgoing {
    pub packet: Packet,
    pub airtime: Duration,
    /// Bytes that `CATXP` tells: whole frames, however full they are.
    pub bytes: usize,
    /// 1 FSK, 2 FSK mini, 3 PSK, 4 PSK mini, 5 flexible.
    pub packet_type: u8,
    /// Frames asked for by the cycle init.
    pub expected: u8,
    /// Answers that the modem gives by itself are not told to its host.
    pub told: bool,
    /// Begin to ask the host for data when it has been sent.
    pub then_ask: bool,
}

/// A packet that has left.
#[derive(Clone, Debug)]
pub(super) struct Sent {
    pub out: Outgoing,
    pub began: Duration,
}

/// The transducer.
#[derive(Debug, Default)]
pub(super) struct Air {
    pub queue: VecDeque<Outgoing>,
    pub busy_until: Duration,
}

impl Micromodem {
    pub(super) fn begin_transmission(&mut self, now: Duration) -> Option<Transmission> {
        if now < self.air.busy_until || !self.awake {
            return None;
        }
        let mut out = self.air.queue.pop_front()?;
        self.unique = self.unique.wrapping_add(1);
        out.packet.number = self.unique;
        out.packet.header_version = u8::from(self.nvram.is_on("psk.packet.mod_hdr_version"));
        self.air.busy_until = now + out.airtime;
        if out.told {
            self.tell(&format!("CATXP,{}", out.bytes), now);
        }
        let transmission = Transmission { bytes: out.packet.encode(), airtime: out.airtime };
        self.board.plan(self.air.busy_until, Event::Sent(Box::new(Sent { out, began: now })));
        Some(transmission)
    }

    pub(super) fn on_sent(&mut self, sent: &Sent, now: Duration) {
        if sent.out.told {
            self.tell(&format!("CATXF,{}", sent.out.bytes), now);
            if self.nvram.is_on("XST") {
                self.tell_transmit_statistics(sent, now);
            }
        }
        if sent.out.then_ask {
            self.ask_for_data(now);
        }
    }

    /// `CAXST`, version 6; without the version on a Micromodem 1.
    fn tell_transmit_statistics(&mut self, sent: &Sent, now: Duration) {
        const CLOCK_MODE: u8 = 6;
        const GOOD: u8 = 0;
        const PROBE: u32 = 200;
        let Outgoing { packet, bytes, packet_type, expected, .. } = &sent.out;
        let when = self.clock.date_and_time(sent.began);
        let version = self.statistics_version();
        let (bandwidth, carrier) = (self.nvram.number("BW0"), self.nvram.number("FC0"));
        let route = format!("{},{},{},{}", packet.rate, packet.src, packet.dst, u8::from(packet.ack));
        let frames = packet.frames.len();
        self.tell(
            &format!(
                "CAXST,{version}{when},{CLOCK_MODE},{GOOD},{PROBE},{bandwidth},{carrier},{route},{expected},{frames},{packet_type},{bytes}"
            ),
            now,
        );
    }
}
