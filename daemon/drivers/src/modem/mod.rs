//! Modems: drivers without IO, and the account of bits on air.
//!
//! | module | is |
//! |---|---|
//! | [`Driver`] | the trait of every driver: bytes in, bytes out |
//! | [`s2c`], [`micromodem`], [`paced`] | the drivers; `paced` is for pipes, TCP and UDP |
//! | [`framing`] | frames in a stream of bytes |
//! | [`PortListener`] | what is wrong at a port whose modem does not get ready |
//! | [`Station`] | a driver as the link sees it, shared by rehearsals and processes |

mod driver;
pub mod framing;
mod listener;
pub mod micromodem;
pub mod paced;
pub mod s2c;
mod station;

pub use driver::{Class, Destination, Driver, Event, Reception, Refusal, Token};
pub use listener::{PortFinding, PortListener, Speaker};
use micromodem::{Micromodem, MicromodemConfig};
use paced::Paced;
use s2c::{BURST_FRAME_BYTES, S2c, S2cConfig};
use scenecast_config::{Config, ModemKind};
use scenecast_core::{MicromodemRate, ModemAddress, UserError};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::wire::Address;
pub use station::{AddressBook, ModemEvent, PIPE_FRAMING_BITS, Station};

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
    let Destination::Modem(address) = address_book(config).modem_of(end) else {
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
        profile.overhead_bits += PIPE_FRAMING_BITS;
    }
    Ok(driver(config, end, profile)?.profile())
}
