//! `[[modem]]`: its make, its port and its place.

use super::reader::Reader;
use super::seconds;
use super::water::{MAX_DISTANCE_M, MAX_S};
use scenecast_core::UserError;
use sim_channel::modem::Emulator;
use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::modem::s2c::{Interpreter, S2c, S2cConfig};
use sim_channel::modem::transparent::{Transparent, TransparentConfig};
use sim_channel::usbl::UsblConfig;
use sim_channel::{NodePosition, Track};
use std::net::SocketAddr;
use std::time::Duration;

#[derive(Debug)]
pub struct Modem {
    /// For people, and the name of its symbolic link.
    pub name: String,
    pub make: Make,
    /// How its host reaches it.
    pub place: Place,
    /// Where it is, and goes.
    pub track: Track,
    /// Its place in the file, a byte.
    pub(super) at: usize,
}

/// The kind of a modem and its settings.
#[derive(Debug, Clone)]
pub enum Make {
    S2c(S2cConfig),
    Micromodem(MicromodemConfig),
    Transparent(TransparentConfig),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    Pty,
    /// A TCP port; port 0 for any that is free.
    Tcp(SocketAddr),
}

impl Place {
    /// Whether two modems cannot both have it.
    pub fn is_fixed(&self) -> bool {
        matches!(self, Self::Tcp(address) if address.port() != 0)
    }
}

impl Make {
    /// The emulator, with the wall clock at the start for those that have a calendar.
    pub fn emulator(&self, unix_s: u64) -> Box<dyn Emulator> {
        match self.clone() {
            Self::S2c(config) => Box::new(S2c::new(config)),
            Self::Micromodem(config) => Box::new(Micromodem::new(MicromodemConfig { unix_s, ..config })),
            Self::Transparent(config) => Box::new(Transparent::new(config)),
        }
    }

    /// Bytes a second over the line; `None` for one without pacing.
    pub fn line_rate(&self) -> Option<f64> {
        let baud = match self {
            Self::S2c(config) => config.baud,
            Self::Micromodem(config) => config.baud,
            Self::Transparent(config) => config.baud,
        };
        baud.map(|baud| f64::from(baud) / 10.0)
    }
}

pub(super) fn read(table: Reader<'_>, seed: u64) -> Result<Modem, UserError> {
    const NAME: &str = "a name of letters, digits, - and _";
    let name = table.text("name")?.ok_or_else(|| table.missing("name", NAME))?;
    if !name.bytes().all(|byte| byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'_')) {
        return Err(table.wrong("name", NAME));
    }
    type Read = fn(&Reader<'_>, Option<u32>) -> Result<Make, UserError>;
    let kinds: [(&str, Read); 3] = [("s2c", s2c), ("micromodem", micromodem), ("transparent", transparent)];
    let kind =
        table.choice("kind", &kinds)?.ok_or_else(|| table.missing("kind", "one of s2c, micromodem, transparent"))?;
    let place = read_place(&table)?;
    let usual = if place == Place::Pty { Some(19_200) } else { None };
    let baud = match table.whole("baud", 0..=10_000_000, "bit/s, 0 for no pacing")? {
        Some(baud) => u32::try_from(baud).ok().filter(|baud| *baud > 0),
        None => usual,
    };
    let mut make = kind(&table, baud)?;
    seed_with(&mut make, seed, &name);
    let track = read_track(&table)?;
    let at = table.start();
    table.finish()?;
    Ok(Modem { name, make, place, track, at })
}

/// Each modem has noise of its own.
fn seed_with(make: &mut Make, seed: u64, name: &str) {
    let own = name.bytes().fold(seed, |mixed, byte| mixed.wrapping_mul(31).wrapping_add(u64::from(byte)));
    match make {
        Make::S2c(config) => config.seed = own,
        Make::Micromodem(config) => config.seed = own,
        Make::Transparent(config) => config.seed = own,
    }
}

fn read_place(table: &Reader<'_>) -> Result<Place, UserError> {
    const TAKES: &str = "\"pty\" or \"tcp:ADDRESS:PORT\", as in \"tcp:127.0.0.1:9200\"";
    match table.text("port")?.as_deref() {
        None | Some("pty") => Ok(Place::Pty),
        Some(text) => {
            let address = text.strip_prefix("tcp:").and_then(|address| address.parse().ok());
            address.map(Place::Tcp).ok_or_else(|| table.wrong("port", TAKES))
        }
    }
}

fn read_track(table: &Reader<'_>) -> Result<Track, UserError> {
    const TAKES: &str = "rows [time in s, metres east, metres north, metres down], times growing";
    let range = -MAX_DISTANCE_M..=MAX_S;
    let place = |[x, y, z]: [f64; 3]| NodePosition::new(x, y, z);
    let position = table.numbers::<3>("position_m", -MAX_DISTANCE_M..=MAX_DISTANCE_M, "m")?;
    let Some(rows) = table.rows::<4>("track", range, TAKES)? else {
        return Ok(Track::new(vec![(Duration::ZERO, position.map_or_else(NodePosition::default, place))]));
    };
    if position.is_some() {
        return Err(table.wrong("position_m", "nothing beside a track"));
    }
    let grows = rows.windows(2).all(|pair| matches!(pair, [a, b] if a[0] < b[0]));
    if !grows || rows.iter().any(|row| row[0] < 0.0) {
        return Err(table.wrong("track", TAKES));
    }
    Ok(Track::new(rows.into_iter().map(|[t, x, y, z]| (seconds(t), place([x, y, z]))).collect()))
}

fn address(table: &Reader<'_>, least: u64, most: u64) -> Result<u8, UserError> {
    let given = table.whole("address", least..=most, "")?;
    given
        .map(|address| address as u8)
        .ok_or_else(|| table.missing("address", format!("a whole number from {least} to {most}")))
}

fn s2c(table: &Reader<'_>, baud: Option<u32>) -> Result<Make, UserError> {
    let mut config = S2cConfig { baud, ..S2cConfig::new(address(table, 1, 254)?) };
    let interpreters = [("NET", Interpreter::Net), ("AT", Interpreter::At)];
    config.interpreter = table.choice("interpreter", &interpreters)?.unwrap_or(config.interpreter);
    config.remote = table.whole("remote", 0..=254, "")?.map_or(config.remote, |remote| remote as u8);
    config.bit_rate = table.whole("bit_rate", 100..=100_000, "bit/s")?.map_or(config.bit_rate, |rate| rate as u32);
    config.needs_control = table.flag("needs_control")?.unwrap_or(config.needs_control);
    config.boot_ms = table.number("boot_s", 0.0..=600.0, "s")?.map_or(config.boot_ms, |s| (s * 1000.0) as u32);
    if let Some(head) = table.table("usbl")? {
        config.angles_only = head.flag("angles_only")?.unwrap_or(false);
        config.usbl = Some(usbl(&head)?);
        head.finish()?;
    }
    Ok(Make::S2c(config))
}

fn usbl(table: &Reader<'_>) -> Result<UsblConfig, UserError> {
    let usual = UsblConfig::default();
    let latency = table.number("latency_s", 0.0..=60.0, "s")?;
    Ok(UsblConfig {
        range_std_m: table.number("range_std_m", 0.0..=1000.0, "m")?.unwrap_or(usual.range_std_m),
        angle_std_rad: table
            .number("angle_std_degrees", 0.0..=90.0, "degrees")?
            .map_or(usual.angle_std_rad, f64::to_radians),
        outlier_probability: table.number("outlier_probability", 0.0..=1.0, "")?.unwrap_or(usual.outlier_probability),
        range_only_probability: table
            .number("range_only_probability", 0.0..=1.0, "")?
            .unwrap_or(usual.range_only_probability),
        latency: latency.map_or(usual.latency, seconds),
    })
}

fn micromodem(table: &Reader<'_>, baud: Option<u32>) -> Result<Make, UserError> {
    let address = address(table, 0, 127)?;
    let usual = match table.whole("generation", 1..=2, "")? {
        Some(1) => MicromodemConfig::first_generation(address),
        _ => MicromodemConfig::new(address),
    };
    let version = table.text("version")?.unwrap_or(usual.version);
    let parts: Vec<_> = version.split('.').collect();
    if !(3..=4).contains(&parts.len()) || !parts.iter().all(|part| part.parse::<u32>().is_ok()) {
        return Err(table.wrong("version", "three or four whole numbers with dots between, as in \"2.0.27087\""));
    }
    Ok(Make::Micromodem(MicromodemConfig { baud, version, ..usual }))
}

fn transparent(table: &Reader<'_>, baud: Option<u32>) -> Result<Make, UserError> {
    let usual = TransparentConfig::default();
    let whole = |key, range, unit, usual: usize| {
        Ok::<_, UserError>(table.whole(key, range, unit)?.map_or(usual, |n| n as usize))
    };
    let time = |key, usual| Ok::<_, UserError>(table.number(key, 0.0..=10.0, "s")?.map_or(usual, seconds));
    Ok(Make::Transparent(TransparentConfig {
        baud,
        bit_rate: whole("bit_rate", 10..=1_000_000, "bit/s", usual.bit_rate as usize)? as u32,
        preamble: time("preamble_s", usual.preamble)?,
        packet_bytes: whole("packet_bytes", 1..=4096, "bytes", usual.packet_bytes)?,
        gap: time("gap_s", usual.gap)?,
        buffer_bytes: whole("buffer_bytes", 1..=1 << 24, "bytes", usual.buffer_bytes)?,
        eats_escape: table.flag("eats_escape")?.unwrap_or(usual.eats_escape),
        seed: 0,
    }))
}
