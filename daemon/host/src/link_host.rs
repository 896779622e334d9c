//! An end of the link and its modem.

use crate::{FrameCounts, LinkEnd};
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_drivers::modem::paced::Paced;
use scenecast_drivers::modem::{AddressBook, ModemEvent, Refusal, Station, address_book, driver};
use scenecast_protocol::link::DropReason;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::schedule::{Audit, Class};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Events of frames and of the modem, for meters, logs and records. The link needs no reaction to them.
#[derive(Debug, Clone, PartialEq)]
pub enum FrameEvent {
    /// A frame was given to the modem.
    Sent {
        frame: Vec<u8>,
        /// Kind of the frame, as the link names it.
        kind: scenecast_protocol::link::TransmitKind,
        /// Bytes of what it carries, headers not included; empty for a copy of an earlier frame.
        contents: BTreeMap<Class, u64>,
    },
    /// The modem refused the last frame. The link repairs it like a lost one.
    NotSent(Refusal),
    /// A frame was received and given to the link.
    Received {
        /// The bytes as they came from the modem, header and integrity check or tag included.
        frame: Vec<u8>,
        /// Bytes of what an accepted frame carries, headers not included; empty at a vehicle, which does not count them.
        contents: BTreeMap<Class, u64>,
        outcome: FrameOutcome,
        /// Why it was dropped, if it was.
        reason: Option<DropReason>,
    },
    /// The bits on air exceed the budget of a window for the first time.
    OverBudget {
        /// Mean bit rate of the fullest window, bit/s.
        max_window_bps: f64,
    },
    /// The modem is set up and takes frames.
    ModemReady,
    /// The modem no longer answers; [`Self::ModemReady`] follows when it is set up again.
    ModemLost,
    /// The modem refuses a setting that a person must change; the reason is a line for that person.
    ModemRefused {
        reason: String,
        /// Whether the modem has worked before.
        was_ready: bool,
    },
}

/// What became of a received frame. It shows whether its sender is the other end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FrameOutcome {
    /// It is no frame, or one that the link drops.
    Dropped,
    /// The link has read it. It may be the replay of a frame that begins a conversation.
    Opened,
    /// A numbered frame that verified and was new: with a key, only the other end can have written it.
    Accepted,
}

impl FrameOutcome {
    /// Of one frame, by the counts before and after it; and why it was dropped, if it was.
    fn between(before: &FrameCounts, after: &FrameCounts) -> (Self, Option<DropReason>) {
        let mut dropped = after.dropped.iter();
        let dropped = dropped.find(|(reason, count)| before.dropped.get(reason).is_none_or(|before| before < count));
        match dropped {
            _ if after.accepted > before.accepted => (Self::Accepted, None),
            None => (Self::Opened, None),
            Some((&reason, _)) => (Self::Dropped, Some(reason)),
        }
    }
}

/// An end of the link at its modem: the only caller of a link's `poll_transmit`.
#[derive(Debug)]
pub struct LinkHost<E> {
    end: E,
    station: Station,
    budget: BudgetWatch,
    was_ready: bool,
    events: VecDeque<FrameEvent>,
}

impl<E: LinkEnd> LinkHost<E> {
    /// Joins an end with its modem; the station's audit counts the bits on air.
    pub fn new(end: E, station: Station) -> Self {
        Self { end, station, budget: BudgetWatch::default(), was_ready: false, events: VecDeque::new() }
    }

    pub fn end(&self) -> &E {
        &self.end
    }

    /// The role or link, for orders and measurements.
    pub fn end_mut(&mut self) -> &mut E {
        &mut self.end
    }

    /// The properties of the modem that the link assumes.
    pub fn profile(&self) -> &ModemProfile {
        self.station.profile()
    }

    /// The account of the bits on air.
    pub fn audit(&self) -> &Audit {
        self.station.audit()
    }

    /// Bits that the modem repeated by itself, charged to the budget beside those of [`Self::audit`].
    pub fn repeated_bits(&self) -> u64 {
        self.station.repeated_bits()
    }

    /// The modem's port was opened.
    pub fn handle_open(&mut self, now: Instant) {
        self.station.handle_open(now);
        self.deliver(now);
    }

    /// The modem's port was closed, or failed.
    pub fn handle_closed(&mut self, now: Instant) {
        self.station.handle_closed(now);
        self.deliver(now);
    }

    /// Takes bytes of the modem's port, in pieces of any size.
    pub fn handle_bytes(&mut self, bytes: &[u8], now: Instant) {
        self.station.handle_bytes(bytes, now);
        self.deliver(now);
    }

    /// Takes a datagram, which is a frame of its own, and returns the judgement of the link.
    pub fn handle_datagram(&mut self, bytes: &[u8], now: Instant) -> FrameOutcome {
        let events = self.events.len();
        self.handle_bytes(bytes, now);
        let outcomes = self.events.iter().skip(events).filter_map(|event| match event {
            FrameEvent::Received { outcome, .. } => Some(*outcome),
            _ => None,
        });
        outcomes.max().unwrap_or(FrameOutcome::Dropped)
    }

    /// Lets time pass in the modem's driver.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.station.handle_timeout(now);
        self.deliver(now);
    }

    /// The time at which output should be polled again or [`Self::handle_timeout`] is due. A time of the link in the
    /// past is left out: it led to no frame, so the link waits for another event.
    pub fn poll_timeout(&self, now: Instant) -> Option<Instant> {
        let link = self.end.poll_timeout(now).filter(|&at| at > now);
        link.into_iter().chain(self.station.poll_timeout()).min()
    }

    /// Whether the silent modem's port should be closed and opened again.
    pub fn wants_reopening(&self, now: Instant) -> bool {
        self.station.wants_reopening(now)
    }

    /// Polls the link for cycles and frames while the modem accepts them, then returns the next
    /// bytes for the modem's port.
    pub fn poll_output(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.fill(now);
        self.poll_modem_output(now)
    }

    /// The next bytes of the driver alone, while the link must not transmit.
    pub(crate) fn poll_modem_output(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.station.poll_output(now)
    }

    /// The next event of frames and modem.
    pub fn poll_event(&mut self) -> Option<FrameEvent> {
        self.events.pop_front()
    }

    fn fill(&mut self, now: Instant) {
        self.budget.allow(self.end.budget_bps(), self.station.audit());
        if self.station.takes_cycles(now)
            && let Some(cycle) = self.end.poll_cycle(now)
        {
            self.station.begin_cycle(cycle, now);
        }
        while self.station.takes_frames()
            && let Some(mut transmit) = self.end.poll_transmit(now)
        {
            let (frame, contents) = (transmit.bytes.clone(), std::mem::take(&mut transmit.contents));
            self.events.push_back(FrameEvent::Sent { frame, kind: transmit.kind, contents });
            if let Err(refusal) = self.station.send(transmit, now) {
                self.events.push_back(FrameEvent::NotSent(refusal));
            }
            self.events.extend(self.budget.check(self.station.audit()));
            self.deliver(now);
        }
    }

    /// Gives all reports of the modem to the link.
    fn deliver(&mut self, now: Instant) {
        while let Some(event) = self.station.poll_event() {
            match event {
                ModemEvent::Sent => self.end.handle_transmit_outcome(now),
                ModemEvent::Received(frame) => {
                    let before = self.end.frame_counts();
                    self.end.handle_frame(&frame, now);
                    let after = self.end.frame_counts();
                    let (outcome, reason) = FrameOutcome::between(&before, &after);
                    let (frame, contents) = (frame.to_vec(), after.contents_since(&before));
                    self.events.push_back(FrameEvent::Received { frame, contents, outcome, reason });
                }
                ModemEvent::Poll(frames) => self.end.handle_poll(frames),
                ModemEvent::Repeated(bits) => self.end.handle_repeated(bits, now),
                ModemEvent::Fix(end, line) => self.end.handle_range(end, &line, now),
                ModemEvent::Ready => {
                    if std::mem::replace(&mut self.was_ready, true) {
                        self.end.handle_modem_restart(now);
                    }
                    self.events.push_back(FrameEvent::ModemReady);
                }
                ModemEvent::Lost => self.events.push_back(FrameEvent::ModemLost),
                ModemEvent::Refused(reason) => {
                    self.events.push_back(FrameEvent::ModemRefused { reason, was_ready: self.was_ready });
                }
            }
        }
    }
}

/// Reports once that the bits on air exceed the budget.
#[derive(Debug, Default)]
struct BudgetWatch {
    /// The largest budget so far, bits per window.
    window_bits: f64,
    is_exceeded: bool,
}

impl BudgetWatch {
    fn allow(&mut self, bits_per_s: u32, audit: &Audit) {
        self.window_bits = self.window_bits.max(f64::from(bits_per_s) * audit.window().as_secs_f64());
    }

    fn check(&mut self, audit: &Audit) -> Option<FrameEvent> {
        let is_exceeded = audit.worst_window_bits() as f64 > self.window_bits + audit.largest_bits() as f64;
        let is_news = is_exceeded && !std::mem::replace(&mut self.is_exceeded, true);
        is_news.then(|| FrameEvent::OverBudget { max_window_bps: audit.worst_window_bps() })
    }
}

/// The station of the modem that the configuration names, its port still closed.
///
/// # Errors
/// An end whose modem can have no address.
pub fn modem_station(config: &Config, end: Address, profile: ModemProfile) -> Result<Station, UserError> {
    let audit = Audit::new(Duration::from_secs_f64(config.link.budget_window_s));
    Ok(Station::new(driver(config, end, profile)?, address_book(config), audit))
}

/// A station without a modem, for a simulated channel. Its port is open. Each output is one frame, which
/// stays on air for [`ModemProfile::airtime`].
pub fn channel_station(profile: ModemProfile, window: Duration, now: Instant) -> Station {
    let driver = Paced::datagrams(profile, profile.bit_rate_bps);
    let mut station = Station::new(Box::new(driver), AddressBook { surface: 0 }, Audit::new(window));
    station.handle_open(now);
    station
}

#[cfg(all(test, feature = "surface"))]
mod tests {
    use super::*;
    use scenecast_core::Area;
    use scenecast_core::tuning_table::TuningTable;
    use scenecast_protocol::link::Authenticity;
    use scenecast_protocol::seal::{HeldKey, MissionKey};
    use scenecast_surface::Surface;
    use scenecast_vehicle::{Durable, Vehicle};

    fn key() -> Option<Authenticity> {
        Some(Authenticity::new(HeldKey::Mission(MissionKey::from_bytes([7; 16])), true, false))
    }

    fn surface(authenticity: Option<Authenticity>, seed: u64) -> LinkHost<Surface> {
        let config = scenecast_config::load(None, &[]).unwrap();
        let modem = scenecast_config::modem_profile(&config, 10_000.0);
        let table = TuningTable::shipped();
        let end = scenecast_surface::assemble(&config, authenticity, table, modem, seed, Instant::ZERO).unwrap();
        LinkHost::new(end, channel_station(modem, Duration::from_secs(10), Instant::ZERO))
    }

    fn vehicle() -> LinkHost<Vehicle> {
        let config = scenecast_config::load(None, &[]).unwrap();
        let modem = scenecast_config::modem_profile(&config, 10_000.0);
        let area = Area { west: 0.0, south: 0.0, east: 20.0, north: 20.0 };
        let durable = Durable::default();
        let end = scenecast_vehicle::assemble(&config, key(), modem, area, durable, 3, Instant::ZERO).unwrap();
        LinkHost::new(end, channel_station(modem, Duration::from_secs(10), Instant::ZERO))
    }

    /// The frames of the surface up to the first that the vehicle accepts, with the outcome of each.
    fn exchange(surface: &mut LinkHost<Surface>, vehicle: &mut LinkHost<Vehicle>) -> Vec<(Vec<u8>, FrameOutcome)> {
        let mut sent = Vec::new();
        for tick in 0..600 {
            let now = Instant::ZERO + Duration::from_millis(100) * tick;
            surface.handle_timeout(now);
            vehicle.handle_timeout(now);
            while let Some(bytes) = surface.poll_output(now) {
                let outcome = vehicle.handle_datagram(&bytes, now);
                sent.push((bytes, outcome));
                if outcome == FrameOutcome::Accepted {
                    return sent;
                }
            }
            while let Some(bytes) = vehicle.poll_output(now) {
                assert!(surface.handle_datagram(&bytes, now) > FrameOutcome::Dropped);
            }
            while surface.poll_event().is_some() || vehicle.poll_event().is_some() {}
        }
        sent
    }

    #[test]
    fn only_a_new_frame_of_the_other_end_is_accepted() {
        let (mut own, mut vehicle) = (surface(key(), 4), vehicle());
        let sent = exchange(&mut own, &mut vehicle);
        let outcomes: Vec<FrameOutcome> = sent.iter().map(|(_, outcome)| *outcome).collect();
        let ((hello, _), (last, _)) = (sent.first().unwrap(), sent.last().unwrap());
        assert_eq!((outcomes[0], outcomes.last()), (FrameOutcome::Opened, Some(&FrameOutcome::Accepted)));
        let now = Instant::ZERO + Duration::from_secs(90);
        assert_eq!(vehicle.handle_datagram(last, now), FrameOutcome::Dropped, "a replay of a numbered frame");
        assert!(vehicle.handle_datagram(hello, now) < FrameOutcome::Accepted, "a replay of a hello");
        let call = surface(None, 5).poll_output(now).unwrap();
        assert_eq!(vehicle.handle_datagram(&call, now), FrameOutcome::Dropped, "without the key");
        assert_eq!(vehicle.handle_datagram(b"junk", now), FrameOutcome::Dropped);
        assert_eq!(vehicle.handle_datagram(&[], now), FrameOutcome::Dropped);
        assert_eq!(vehicle.handle_datagram(&[0; 2048], now), FrameOutcome::Dropped, "longer than any frame");
    }
}
