//! One end's modem without IO: a driver, the addresses of the mission, and the account of bits on air.

use super::driver::{Class, Destination, Driver, Event, Token};
use super::framing;
use bytes::Bytes;
use scenecast_core::{ModemAddress, UsblLine};
use scenecast_protocol::link::{Cycle, Transmit, TransmitKind};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::collections::{BTreeSet, VecDeque};

/// Which modem belongs to whom: a vehicle's has the vehicle's number, the surface's its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AddressBook {
    /// Address of the surface's modem.
    pub surface: ModemAddress,
}

impl AddressBook {
    /// The modem of an end.
    pub fn modem_of(&self, end: Address) -> Destination {
        match end {
            Address::SURFACE => Destination::Modem(self.surface),
            Address::EVERYBODY => Destination::Everybody,
            vehicle => Destination::Modem(vehicle.number()),
        }
    }

    /// The end of a modem.
    pub fn end_of(&self, modem: ModemAddress) -> Option<Address> {
        if modem == self.surface { Some(Address::SURFACE) } else { Address::vehicle(modem) }
    }
}

/// An event of the modem for its end.
#[derive(Debug, Clone, PartialEq)]
pub enum ModemEvent {
    /// A transmission has left the modem, or never will.
    Sent,
    Received(Bytes),
    /// The modem asks for so many frames.
    Poll(u32),
    /// The modem itself put so many bits on air.
    Repeated(u64),
    /// Where the head has found another end.
    Fix(Address, UsblLine),
    Ready,
    Lost,
    /// Something that a person must change.
    Refused(String),
}

/// A driver with its account.
pub struct Station {
    driver: Box<dyn Driver>,
    profile: ModemProfile,
    book: AddressBook,
    /// Transmissions that the link counts as in the modem.
    open: BTreeSet<Token>,
    events: VecDeque<ModemEvent>,
    audit: Audit,
    repeated_bits: u64,
}

impl std::fmt::Debug for Station {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Station").field("profile", &self.profile).field("open", &self.open).finish_non_exhaustive()
    }
}

impl Station {
    /// A station that audits bits on air in the windows of `audit`.
    pub fn new(driver: Box<dyn Driver>, book: AddressBook, audit: Audit) -> Self {
        let profile = driver.profile();
        Self { driver, profile, book, open: BTreeSet::new(), events: VecDeque::new(), audit, repeated_bits: 0 }
    }

    /// The modem's profile for the link.
    pub fn profile(&self) -> &ModemProfile {
        &self.profile
    }

    /// Bits on air of the modem's own repeats.
    pub fn repeated_bits(&self) -> u64 {
        self.repeated_bits
    }

    /// The audit of the link's bits on air.
    pub fn audit(&self) -> &Audit {
        &self.audit
    }

    /// Whether the link may be polled for a frame. Frames queued for an absent modem would grow stale.
    pub fn takes_frames(&self) -> bool {
        let alone = self.profile.access != scenecast_protocol::mac::Access::Shared;
        self.driver.is_ready() && (alone || self.open.is_empty())
    }

    /// Whether the link may be asked for a cycle.
    pub fn takes_cycles(&self, now: Instant) -> bool {
        self.driver.may_begin_cycle(now)
    }

    pub fn begin_cycle(&mut self, cycle: Cycle, now: Instant) {
        let Destination::Modem(from) = self.book.modem_of(cycle.from) else { return };
        self.driver.begin_cycle(from, self.book.modem_of(cycle.to), cycle, now);
        self.collect();
    }

    /// Puts a frame of the link on air.
    ///
    /// # Errors
    /// The driver's reason; the frame then counts as sent, and the link repairs the loss.
    pub fn send(&mut self, transmit: Transmit, now: Instant) -> Result<(), super::Refusal> {
        let bits = self.profile.bits_on_air(transmit.bytes.len());
        let (dst, class) = (self.book.modem_of(transmit.to), class_of(&transmit));
        let sent = self.driver.send(dst, transmit.bytes, class, now);
        match sent {
            Ok(token) => {
                self.audit.record(bits, now);
                self.open.insert(token);
                self.collect();
                Ok(())
            }
            Err(refusal) => {
                self.events.push_back(ModemEvent::Sent);
                Err(refusal)
            }
        }
    }

    pub fn handle_open(&mut self, now: Instant) {
        self.driver.handle_open(now);
        self.collect();
    }

    pub fn handle_closed(&mut self, now: Instant) {
        self.driver.handle_closed(now);
        self.collect();
    }

    /// Bytes came over the port.
    pub fn handle_bytes(&mut self, bytes: &[u8], now: Instant) {
        self.driver.handle_bytes(bytes, now);
        self.collect();
    }

    pub fn handle_timeout(&mut self, now: Instant) {
        self.driver.handle_timeout(now);
        self.collect();
    }

    /// When [`Self::handle_timeout`] has something to do.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.driver.poll_timeout()
    }

    /// Bytes for the port: after all events were handled and the link was asked for frames.
    pub fn poll_output(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.driver.poll_output(now)
    }

    /// Whether the port should be opened again.
    pub fn wants_reopening(&self, now: Instant) -> bool {
        self.driver.wants_reopening(now)
    }

    /// The next event for the end.
    pub fn poll_event(&mut self) -> Option<ModemEvent> {
        self.events.pop_front()
    }

    fn collect(&mut self) {
        while let Some(event) = self.driver.poll_event() {
            let told = match event {
                Event::Sent(t) | Event::Delivered(t) | Event::Failed(t) | Event::Unknown(t) => {
                    self.open.remove(&t).then_some(ModemEvent::Sent)
                }
                Event::Received(heard) => Some(ModemEvent::Received(heard.bytes)),
                Event::Poll(frames) => Some(ModemEvent::Poll(frames)),
                Event::Repeated(bits) => {
                    self.repeated_bits += bits;
                    Some(ModemEvent::Repeated(bits))
                }
                Event::Usbl(line) => self.book.end_of(line.remote).map(|end| ModemEvent::Fix(end, line)),
                Event::Ready => Some(ModemEvent::Ready),
                Event::Reset => Some(ModemEvent::Lost),
                Event::Refused(what) => Some(ModemEvent::Refused(what)),
                Event::Accepted(_) | Event::Busy(_) => None,
            };
            self.events.extend(told);
        }
    }
}

/// The class of a frame at the modem: directives first, acknowledgements beside them.
fn class_of(transmit: &Transmit) -> Class {
    match (transmit.to, transmit.kind) {
        (Address::SURFACE, _) => Class::Bulk,
        (_, TransmitKind::Grant) => Class::Service,
        _ => Class::Command,
    }
}

/// Bits of framing that a byte pipe puts on air with each frame: delimiters and stuffing.
pub const PIPE_FRAMING_BITS: u64 = 8 * framing::OVERHEAD_BYTES;
