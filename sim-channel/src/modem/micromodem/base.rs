//! The parts that every service of the modem uses: configuration, calendar clock, the port to the hosts and the transmitter.
//!
//! A service (cycles, flexible data, minipackets, detection) borrows this base for the length of one call. The base never
//! calls a service.

use super::nvram::Nvram;
use super::packet::Packet;
use super::transmitter::{PacketSignal, SentPacket, Transmitter};
use super::{Generation, MicromodemConfig, sentence};
use crate::modem::emulator::board::ModemBoard;
use crate::modem::emulator::{ModemEvent, Transmission};
use crate::random::RandomStream;
use std::time::Duration;

/// Period of the revision sentence `CAREV`.
const REVISION_INTERVAL: Duration = Duration::from_secs(30);

/// Work that the modem has scheduled for later.
#[derive(Debug)]
pub(crate) enum MicromodemTask {
    Sent(Box<SentPacket>),
    Received(Box<(Packet, PacketSignal)>),
    DataTimeout { request: u32 },
    Report(String),
    Reply(Box<Packet>),
    Revision,
    Reboot,
    Init,
    Awake,
}

#[derive(Debug)]
pub(super) struct MicromodemBase {
    pub config: MicromodemConfig,
    pub board: ModemBoard<MicromodemTask>,
    pub nvram: Nvram,
    pub clock: ModemClock,
    pub transmitter: Transmitter,
    awake: bool,
    /// End of the fault `Busy`.
    refuses_until: Duration,
}

impl MicromodemBase {
    pub(super) fn new(config: MicromodemConfig) -> Self {
        const PURPOSE: u64 = 0x3d3;
        let mut board = ModemBoard::new(config.baud, RandomStream::new(config.seed, &[PURPOSE]));
        board.schedule(REVISION_INTERVAL, MicromodemTask::Revision);
        Self {
            board,
            nvram: Nvram::factory(config.address),
            clock: ModemClock::new(config.unix_s),
            transmitter: Transmitter::default(),
            awake: true,
            refuses_until: Duration::ZERO,
            config,
        }
    }

    /// `SRC`; 0 if it is not set or not an address.
    pub(super) fn address(&self) -> u8 {
        u8::try_from(self.nvram.number("SRC")).unwrap_or_default()
    }

    pub(super) fn is_first_generation(&self) -> bool {
        self.config.generation == Generation::One
    }

    pub(super) fn is_awake(&self) -> bool {
        self.awake
    }

    /// The main firmware has started.
    pub(super) fn wake(&mut self, now: Duration) {
        self.awake = true;
        self.report_revision("AUV", now);
    }

    /// Drops all packets and scheduled work; only the revision sentences continue.
    pub(super) fn fall_asleep(&mut self, now: Duration) {
        if self.transmitter.is_busy(now) {
            self.board.emit(ModemEvent::CutShort);
        }
        self.awake = false;
        self.transmitter.clear();
        self.board.restart();
        self.board.schedule(now + REVISION_INTERVAL, MicromodemTask::Revision);
    }

    pub(super) fn refuse_until(&mut self, until: Duration) {
        self.refuses_until = until;
    }

    /// Whether commands that need the transducer are refused.
    pub(super) fn is_busy(&self, now: Duration) -> bool {
        now < self.refuses_until || self.transmitter.is_full()
    }

    /// Sends a sentence to every host; `body` is without `$` and checksum.
    pub(super) fn report(&mut self, body: &str, now: Duration) {
        self.board.write_to_all(sentence::line(body).as_bytes(), now);
    }

    /// `CAERR`: a sentence was not understood, or cannot be carried out.
    pub(super) fn report_error(&mut self, module: &str, number: u8, message: &str, now: Duration) {
        let time = self.clock.hhmmss(now);
        self.report(&format!("CAERR,{time},{module},{number},{message}"), now);
    }

    pub(super) fn report_revision(&mut self, ident: &str, now: Duration) {
        let time = self.clock.hhmmss(now);
        let version = self.config.version.clone();
        self.report(&format!("CAREV,{time},{ident},{version}"), now);
    }

    /// The periodic `CAREV`, if `REV` is set.
    pub(super) fn on_revision_due(&mut self, now: Duration) {
        if self.awake && self.nvram.is_on("REV") {
            self.report_revision("AUV", now);
        }
        self.board.schedule(now + REVISION_INTERVAL, MicromodemTask::Revision);
    }

    /// The next packet, if the transducer is free and the modem awake.
    pub(super) fn begin_transmission(&mut self, now: Duration) -> Option<Transmission> {
        if !self.awake {
            return None;
        }
        let mut out = self.transmitter.begin(now)?;
        out.packet.header_version = u8::from(self.nvram.is_on("psk.packet.mod_hdr_version"));
        if out.reported {
            self.report(&format!("CATXP,{}", out.bytes), now);
        }
        let transmission = Transmission { bytes: out.packet.encode(), airtime: out.airtime };
        self.board.schedule(now + out.airtime, MicromodemTask::Sent(Box::new(SentPacket { out, began: now })));
        Some(transmission)
    }
}

/// Set by `CCTMS` and `CCCLK`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ModemClock {
    /// Time since 1970 at virtual time zero; saturates at 1970.
    epoch: Duration,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct CivilTime {
    pub year: u32,
    pub month: u32,
    pub day: u32,
    pub hour: u32,
    pub minute: u32,
    pub second: u32,
}

const DAY_S: u64 = 86_400;

impl ModemClock {
    pub(super) fn new(unix_s: u64) -> Self {
        Self { epoch: Duration::from_secs(unix_s) }
    }

    /// Makes the clock show `civil` at `now`.
    pub(super) fn set(&mut self, civil: CivilTime, now: Duration) {
        self.epoch = Duration::from_secs(civil.unix_s()).saturating_sub(now);
    }

    fn at(&self, now: Duration) -> (CivilTime, u32) {
        let time = self.epoch.saturating_add(now);
        (CivilTime::of_unix_s(time.as_secs()), time.subsec_micros())
    }

    pub(super) fn hhmmss(&self, now: Duration) -> String {
        let (c, _) = self.at(now);
        format!("{:02}{:02}{:02}", c.hour, c.minute, c.second)
    }

    /// `HHMMSS.ffff`, as in `CACST` without version.
    pub(super) fn hhmmss_fraction(&self, now: Duration) -> String {
        let (_, us) = self.at(now);
        format!("{}.{:04}", self.hhmmss(now), us / 100)
    }

    /// `YYYYMMDDHHMMSS.ffffff`, as in version 6 of `CACST`.
    pub(super) fn compact(&self, now: Duration) -> String {
        let (c, us) = self.at(now);
        format!("{:04}{:02}{:02}{:02}{:02}{:02}.{us:06}", c.year, c.month, c.day, c.hour, c.minute, c.second)
    }

    /// The time as `YYYYMMDD,HHMMSS.ffff`, as in `CAXST`.
    pub(super) fn date_and_time(&self, now: Duration) -> String {
        let (c, _) = self.at(now);
        format!("{:04}{:02}{:02},{}", c.year, c.month, c.day, self.hhmmss_fraction(now))
    }

    /// The time as `YYYY-MM-DDTHH:MM:SSZ`, as in `CATMQ`.
    pub(super) fn iso(&self, now: Duration) -> String {
        let (c, _) = self.at(now);
        format!("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z", c.year, c.month, c.day, c.hour, c.minute, c.second)
    }
}

impl CivilTime {
    /// `None` if there is no such time since 1970.
    pub(super) fn new([year, month, day, hour, minute, second]: [u32; 6]) -> Option<Self> {
        let civil = Self { year, month, day, hour, minute, second };
        let plausible = (1970..=9999).contains(&year) && hour < 24 && minute < 60 && second < 60;
        (plausible && Self::of_unix_s(civil.unix_s()) == civil).then_some(civil)
    }

    /// Reads `YYYY-MM-DDTHH:MM:SSZ`; the `Z` is optional.
    pub(super) fn parse_iso(text: &str) -> Option<Self> {
        let (date, time) = text.trim_end_matches('Z').split_once('T')?;
        let mut parts = date.splitn(3, '-').chain(time.splitn(3, ':'));
        let mut numbers = [0; 6];
        for slot in &mut numbers {
            *slot = parts.next()?.parse().ok()?;
        }
        Self::new(numbers)
    }

    /// Source: the days-from-civil algorithm of H. Hinnant, for years from 1970.
    fn unix_s(&self) -> u64 {
        let (year, month, day) = (u64::from(self.year), u64::from(self.month), u64::from(self.day));
        let shifted = year - u64::from(month <= 2);
        let day_of_year = (153 * ((month + 9) % 12) + 2) / 5 + day.max(1) - 1;
        let days = shifted * 365 + shifted / 4 - shifted / 100 + shifted / 400 + day_of_year - 719_468;
        days * DAY_S + u64::from(self.hour * 3600 + self.minute * 60 + self.second)
    }

    fn of_unix_s(unix_s: u64) -> Self {
        let days = unix_s / DAY_S + 719_468;
        let era_day = days % 146_097;
        let era_year = (era_day - era_day / 1460 + era_day / 36_524 - era_day / 146_096) / 365;
        let day_of_year = era_day - (365 * era_year + era_year / 4 - era_year / 100);
        let shifted_month = (5 * day_of_year + 2) / 153;
        let month = (shifted_month + 2) % 12 + 1;
        let year = era_year + days / 146_097 * 400 + u64::from(month <= 2);
        let of_day = (unix_s % DAY_S) as u32;
        Self {
            year: year as u32,
            month: month as u32,
            day: (day_of_year - (153 * shifted_month + 2) / 5 + 1) as u32,
            hour: of_day / 3600,
            minute: of_day / 60 % 60,
            second: of_day % 60,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_day_of_two_centuries_comes_back() {
        for day in 0..73_000 {
            let unix_s = day * DAY_S + 4321;
            assert_eq!(CivilTime::of_unix_s(unix_s).unix_s(), unix_s);
        }
    }

    #[test]
    fn known_dates_convert_both_ways() {
        let of = CivilTime::of_unix_s;
        assert_eq!(Some(of(0)), CivilTime::new([1970, 1, 1, 0, 0, 0]));
        assert_eq!(Some(of(951_782_400)), CivilTime::new([2000, 2, 29, 0, 0, 0]));
        assert_eq!(Some(of(1_749_250_863)), CivilTime::new([2025, 6, 6, 23, 1, 3]));
    }

    #[test]
    fn clock_runs_on_from_the_time_it_was_set_to() {
        let mut clock = ModemClock::new(0);
        let set = CivilTime::parse_iso("2025-06-06T23:01:03Z").expect("time");
        clock.set(set, Duration::from_secs(100));
        let now = Duration::from_micros(101_000_935);
        assert_eq!(clock.iso(now), "2025-06-06T23:01:04Z");
        assert_eq!(clock.hhmmss(now), "230104");
        assert_eq!(clock.compact(now), "20250606230104.000935");
        assert_eq!(clock.date_and_time(now), "20250606,230104.0009");
    }

    #[test]
    fn impossible_times_are_refused() {
        for text in
            ["2025-02-30T00:00:00Z", "1960-01-01T00:00:00Z", "2025-01-01T24:00:00Z", "2025-01-01", "", "x-y-zTa:b:c"]
        {
            assert_eq!(CivilTime::parse_iso(text), None, "{text}");
        }
    }
}
