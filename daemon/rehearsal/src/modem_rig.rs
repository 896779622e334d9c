//! Emulated modems in one simulated channel, in virtual time, and the ports between them and the ends' hosts.

use scenecast_config::{Config, ModemKind};
use scenecast_core::UserError;
use scenecast_drivers::modem::{Station, modem_of_process};
use scenecast_host::{LinkEnd, LinkHost, modem_station};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::modem::s2c::{S2c, S2cConfig};
use sim_channel::modem::transparent::{Transparent, TransparentConfig};
use sim_channel::modem::{Basin, Emulator, Fault};
use sim_channel::usbl::UsblConfig;
use sim_channel::{Channel, NodeId, NodePosition};

/// The ends of the link, as indices.
pub const VEHICLE: usize = 0;
/// See [`VEHICLE`].
pub const SURFACE: usize = 1;

/// The cable from an end's host to its modem.
struct Cable {
    node: NodeId,
    /// Bytes on their way to a modem that takes no more now.
    written: Vec<u8>,
    plugged: bool,
}

/// Two modems, their cables, and the channel between the modems.
pub struct ModemRig {
    basin: Basin,
    cables: [Cable; 2],
}

impl ModemRig {
    /// Modems of the configured kind in `channel`, and a station for each end, whose port is open at `now`. Place the nodes
    /// before a host is asked for output.
    ///
    /// # Errors
    /// A kind that has no emulator.
    pub fn new(config: &Config, channel: Channel, seed: u64, now: Instant) -> Result<(Self, [Station; 2]), UserError> {
        let vehicle = scenecast_config::vehicle_address(config)?.number();
        let surface = config.modem.surface_address;
        let modems = [emulator(config, vehicle, false, seed)?, emulator(config, surface, true, seed)?];
        Self::with_modems(config, channel, modems, now)
    }

    /// The same with these modems, the vehicle's first.
    pub fn with_modems(
        config: &Config,
        channel: Channel,
        modems: [Box<dyn Emulator>; 2],
        now: Instant,
    ) -> Result<(Self, [Station; 2]), UserError> {
        let mut config = config.clone();
        // Emulated ports are serial ones.
        config.modem.device = Some("emulated".into());
        let vehicle = scenecast_config::vehicle_address(&config)?;
        let mut basin = Basin::new(channel);
        basin.advance(now.into());
        let numbers = [vehicle.number(), config.modem.surface_address];
        for (number, modem) in numbers.into_iter().zip(modems) {
            basin.add(NodeId(number), modem);
        }
        let cables = numbers.map(|number| Cable { node: NodeId(number), written: Vec::new(), plugged: true });
        let mut stations = [station(&config, vehicle)?, station(&config, Address::SURFACE)?];
        stations.iter_mut().for_each(|station| station.handle_open(now));
        Ok((Self { basin, cables }, stations))
    }

    /// Puts an end's modem somewhere.
    pub fn place(&mut self, end: usize, position: NodePosition) {
        let node = self.cables[end].node;
        self.basin.channel().place(node, position);
    }

    /// Slant distance of the modems, metres.
    pub fn range_m(&mut self) -> Option<f64> {
        let [a, b] = [self.cables[0].node, self.cables[1].node];
        self.basin.channel().range_m(a, b)
    }

    /// The channel, to change its conditions.
    pub fn channel(&mut self) -> &mut Channel {
        self.basin.channel()
    }

    /// Breaks something of an end's modem.
    pub fn inject(&mut self, end: usize, fault: Fault, now: Instant) {
        let node = self.cables[end].node;
        self.basin.inject(node, fault, now.into());
    }

    /// Pulls an end's cable, or puts it back.
    pub fn plug<E: LinkEnd>(&mut self, end: usize, host: &mut LinkHost<E>, plugged: bool, now: Instant) {
        let cable = &mut self.cables[end];
        if std::mem::replace(&mut cable.plugged, plugged) == plugged {
            return;
        }
        cable.written.clear();
        match plugged {
            true => host.handle_open(now),
            false => host.handle_closed(now),
        }
    }

    /// The next moment at which something happens in the channel or in a modem.
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.basin.poll_timeout().map(Instant::from)
    }

    /// Lets time pass in the channel and in the modems.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.basin.advance(now.into());
        while self.basin.poll_hang_up().is_some() {
            // A serial line stays open.
        }
    }

    /// Gives an end's host the bytes of its modem, and lets time pass in its driver.
    pub fn read<E: LinkEnd>(&mut self, end: usize, host: &mut LinkHost<E>, now: Instant) {
        let cable = &mut self.cables[end];
        let bytes = self.basin.poll_host_bytes(cable.node);
        if !bytes.is_empty() && cable.plugged {
            host.handle_bytes(&bytes, now);
        }
        host.handle_timeout(now);
        if cable.plugged && host.wants_reopening(now) {
            host.handle_closed(now);
            host.handle_open(now);
        }
    }

    /// Puts a host's bytes on an end's cable; [`Self::flush`] hands them to the modem.
    pub fn write(&mut self, end: usize, bytes: &[u8]) {
        let cable = &mut self.cables[end];
        if cable.plugged {
            cable.written.extend(bytes);
        }
    }

    /// Hands an end's modem as many of the bytes on its cable as it takes.
    pub fn flush(&mut self, end: usize, now: Instant) {
        let cable = &mut self.cables[end];
        let room = self.basin.host_room(cable.node).min(cable.written.len());
        if room > 0 {
            let bytes: Vec<u8> = cable.written.drain(..room).collect();
            self.basin.handle_host_bytes(cable.node, &bytes, now.into());
        }
    }
}

/// An end's station, its port still closed.
fn station(config: &Config, end: Address) -> Result<Station, UserError> {
    modem_station(config, end, modem_of_process(config, end)?)
}

/// The modem of an end; the surface's has a head.
fn emulator(config: &Config, address: u8, head: bool, seed: u64) -> Result<Box<dyn Emulator>, UserError> {
    let seed = seed ^ u64::from(address);
    let baud = Some(config.modem.baud);
    Ok(match config.modem.kind {
        ModemKind::S2c => {
            let usbl = head.then(UsblConfig::default);
            Box::new(S2c::new(S2cConfig { baud, usbl, seed, ..S2cConfig::new(address) }))
        }
        ModemKind::Micromodem => {
            Box::new(Micromodem::new(MicromodemConfig { baud, seed, ..MicromodemConfig::new(address) }))
        }
        ModemKind::Transparent => {
            let bit_rate = config.modem.bit_rate as u32;
            Box::new(Transparent::new(TransparentConfig { baud, bit_rate, seed, ..TransparentConfig::default() }))
        }
        kind @ (ModemKind::Tcp | ModemKind::Udp) => {
            return Err(UserError::Input(format!("modem.kind = \"{kind}\" has no emulator")));
        }
    })
}
