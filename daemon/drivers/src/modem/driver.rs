//! The trait of every modem driver: bytes in, bytes out, no IO; and the driver and the port of the configured modem.

use super::micromodem::{Micromodem, MicromodemConfig};
use super::paced::Paced;
use super::s2c::{BURST_FRAME_BYTES, S2c, S2cConfig};
use super::station::AddressBook;
use bytes::Bytes;
use scenecast_config::{Config, ModemKind};
use scenecast_core::{MicromodemRate, ModemAddress, UsblLine, UserError};
use scenecast_protocol::link::Cycle;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;

/// Names a transmission from [`Driver::send`] to its end.
pub type Token = u64;

/// How urgent a transmission is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Urgent: never queued behind bulk in the modem.
    Command,
    /// Acknowledgements: a later one replaces an earlier one that was not sent.
    Service,
    /// The rest, in the order in which it was given.
    Bulk,
}

/// Whom a transmission is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Destination {
    Modem(ModemAddress),
    Everybody,
}

/// Why a transmission is not taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It is larger than the modem carries.
    #[error("a frame of {bytes} bytes is larger than the modem's {most}")]
    TooLong { bytes: usize, most: usize },
    #[error("a frame without bytes")]
    Empty,
    /// The modem cannot reach this destination.
    #[error("{0:?} is no address that this modem can send to: {1}")]
    NoSuchAddress(Destination, &'static str),
    /// The modem is not there, or not yet set up.
    #[error("the modem is not ready")]
    NotReady,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Reception {
    /// The sender; `None` where the modem does not report it.
    pub src: Option<ModemAddress>,
    pub bytes: Bytes,
    /// Signal quality in the modem's unit; higher is better.
    pub quality: Option<i32>,
    /// Slant range to the sender, metres.
    pub range_m: Option<f64>,
}

/// An event of a driver.
///
/// Each accepted token gets one of `Sent` (if it is not acknowledged), `Delivered`, `Failed` and `Unknown`.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The modem is set up: it takes transmissions.
    Ready,
    /// The modem took the transmission.
    Accepted(Token),
    /// The modem refuses for now; the driver tries again.
    Busy(Token),
    /// It has left the transducer.
    Sent(Token),
    /// The other modem has it.
    Delivered(Token),
    /// It did not get there.
    Failed(Token),
    Unknown(Token),
    Received(Reception),
    /// A position of another modem.
    Usbl(UsblLine),
    /// The modem asks for at most so many frames of a cycle ([`scenecast_protocol::mac::Access::Polled`]).
    Poll(u32),
    /// Bits on air of the modem's own repeats.
    Repeated(u64),
    /// The modem or its port was lost, with all that it held. [`Self::Ready`] follows when it is back.
    Reset,
    /// Something that a person must change, in his words: a wrong address, a setting that is not taken.
    Refused(String),
}

/// A driver: a state machine between the link and the bytes of a port.
///
/// The host handles all events before it polls output: the link's frames answer the modem's requests.
pub trait Driver: Send {
    /// How the medium is shared, and units of transmission.
    fn profile(&self) -> ModemProfile;

    fn is_ready(&self) -> bool;

    fn send(&mut self, dst: Destination, bytes: Vec<u8>, class: Class, now: Instant) -> Result<Token, Refusal>;

    /// Whether a cycle may begin; only modems that poll have any.
    fn may_begin_cycle(&self, _now: Instant) -> bool {
        false
    }

    /// Has the modem begin a cycle between these two.
    fn begin_cycle(&mut self, _from: ModemAddress, _to: Destination, _cycle: Cycle, _now: Instant) {}

    fn handle_open(&mut self, now: Instant);

    /// The port was closed, or failed.
    fn handle_closed(&mut self, now: Instant);

    fn handle_bytes(&mut self, bytes: &[u8], now: Instant);

    fn handle_timeout(&mut self, now: Instant);

    /// When [`Self::handle_timeout`] has something to do.
    fn poll_timeout(&self) -> Option<Instant>;

    /// Bytes for the port; to be asked until there are none, after everything else.
    fn poll_output(&mut self, now: Instant) -> Option<Vec<u8>>;

    fn poll_event(&mut self) -> Option<Event>;

    /// Whether the port has been silent for so long that it should be opened again.
    fn wants_reopening(&self, _now: Instant) -> bool {
        false
    }
}

/// Bytes of a frame that `most` allows.
pub(super) fn check_length(bytes: usize, most: usize) -> Result<(), Refusal> {
    match bytes {
        0 => Err(Refusal::Empty),
        _ if bytes > most => Err(Refusal::TooLong { bytes, most }),
        _ => Ok(()),
    }
}

/// Bytes of bulk that may be in an S2C modem: about a train on its way and another one that waits.
const POOL_BYTES: usize = 16_384;
/// Frames of the surface in an S2C modem at most: later frames are written when the modem has room.
const SURFACE_POOL_FRAMES: u32 = 1;

pub fn address_book(config: &Config) -> AddressBook {
    AddressBook { surface: config.modem.surface_address }
}

/// The driver of an end's modem, its port still closed; `profile` is for kinds that do not have one of their own.
///
/// # Errors
/// An end whose modem can have no address.
pub fn driver(config: &Config, end: Address, profile: ModemProfile) -> Result<Box<dyn Driver>, UserError> {
    let super::Destination::Modem(address) = address_book(config).modem_of(end) else {
        return Err(UserError::Failed("everybody has no modem".to_owned()));
    };
    let m = &config.modem;
    Ok(match m.kind {
        ModemKind::S2c => Box::new(S2c::new(s2c_config(m, address, end))),
        ModemKind::Micromodem => {
            let baud = is_serial(m).then_some(m.baud);
            Box::new(Micromodem::new(MicromodemConfig { address, rate: MicromodemRate::of(m.rate), baud }))
        }
        ModemKind::Udp => Box::new(Paced::datagrams(profile, m.bit_rate)),
        ModemKind::Transparent => {
            // A serial byte takes ten bits. In a rehearsal that is faster than the world so is the cable.
            let cable_bps = if is_serial(m) { f64::from(m.baud) * 0.8 } else { f64::MAX };
            Box::new(Paced::stream(profile, m.bit_rate.min(cable_bps)))
        }
        ModemKind::Tcp => Box::new(Paced::stream(profile, m.bit_rate)),
    })
}

fn s2c_config(m: &scenecast_config::Modem, address: ModemAddress, end: Address) -> S2cConfig {
    let is_surface = end == Address::SURFACE;
    let pool = (POOL_BYTES / BURST_FRAME_BYTES) as u32;
    S2cConfig {
        address,
        mode: m.s2c_mode,
        source_level: m.source_level,
        highest_address: m.highest_address,
        cluster: m.cluster,
        packet_ms: m.packet_ms,
        ethernet: !is_serial(m),
        baud: is_serial(m).then_some(m.baud),
        burst_bps: m.bit_rate,
        pool_frames: if is_surface { SURFACE_POOL_FRAMES } else { pool },
    }
}

fn is_serial(m: &scenecast_config::Modem) -> bool {
    m.device.is_some()
}

/// The modem of an end's process.
pub fn modem_of_process(config: &Config, end: Address) -> Result<ModemProfile, UserError> {
    let mut profile = scenecast_config::modem_profile(config, config.modem.bit_rate);
    if config.modem.kind == ModemKind::Transparent {
        profile.overhead_bits += super::PIPE_FRAMING_BITS;
    }
    Ok(driver(config, end, profile)?.profile())
}
