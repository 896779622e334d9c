//! Both ends' drivers at emulated modems in one simulated water, in virtual time.

use scenecast_config::{Config, ModemKind};
use scenecast_core::UserError;
use scenecast_drivers::modem;
use scenecast_drivers::modem::{ModemEvent, Station};
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::modem::s2c::{S2c, S2cConfig};
use sim_channel::modem::transparent::{Transparent, TransparentConfig};
use sim_channel::modem::{Basin, Emulator, Fault};
use sim_channel::usbl::UsblConfig;
use sim_channel::{Channel, NodeId, NodePosition};
use std::time::Duration;

/// The ends of the link, as indices.
pub const VEHICLE: usize = 0;
/// See [`VEHICLE`].
pub const SURFACE: usize = 1;

/// One end's port.
struct Berth {
    station: Station,
    node: NodeId,
    /// Bytes on their way to a modem that takes no more now.
    written: Vec<u8>,
    plugged: bool,
}

/// Two stations, their modems, and the water between these.
pub struct Docked {
    basin: Basin,
    berths: [Berth; 2],
}

impl Docked {
    /// Modems of the configured kind in `channel`, both ports open at `now`; place the nodes before anybody speaks.
    ///
    /// # Errors
    /// A kind that is no modem.
    pub fn new(config: &Config, channel: Channel, seed: u64, now: Instant) -> Result<Self, UserError> {
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
    ) -> Result<Self, UserError> {
        let mut config = config.clone();
        // Emulated ports are serial ones.
        config.modem.device = Some("emulated".into());
        let vehicle = scenecast_config::vehicle_address(&config)?;
        let mut basin = Basin::new(channel);
        basin.advance(now.into());
        let [of_vehicle, of_surface] = modems;
        let berths = [
            berth(&config, vehicle, of_vehicle, &mut basin)?,
            berth(&config, Address::SURFACE, of_surface, &mut basin)?,
        ];
        let mut docked = Self { basin, berths };
        docked.berths.iter_mut().for_each(|berth| berth.station.handle_open(now));
        Ok(docked)
    }

    /// Puts an end's modem somewhere.
    pub fn place(&mut self, end: usize, position: NodePosition) {
        let node = self.berths[end].node;
        self.basin.channel().place(node, position);
    }

    /// Slant distance of the modems, metres.
    pub fn range_m(&mut self) -> Option<f64> {
        let [a, b] = [self.berths[0].node, self.berths[1].node];
        self.basin.channel().range_m(a, b)
    }

    /// The water, to change its conditions.
    pub fn channel(&mut self) -> &mut Channel {
        self.basin.channel()
    }

    /// An end's modem as its link sees it.
    pub fn station(&mut self, end: usize) -> &mut Station {
        &mut self.berths[end].station
    }

    /// Breaks something of an end's modem.
    pub fn inject(&mut self, end: usize, fault: Fault, now: Instant) {
        let node = self.berths[end].node;
        self.basin.inject(node, fault, now.into());
    }

    /// Pulls an end's cable, or puts it back.
    pub fn plug(&mut self, end: usize, plugged: bool, now: Instant) {
        let berth = &mut self.berths[end];
        if std::mem::replace(&mut berth.plugged, plugged) == plugged {
            return;
        }
        berth.written.clear();
        match plugged {
            true => berth.station.handle_open(now),
            false => berth.station.handle_closed(now),
        }
    }

    /// The next moment at which something happens.
    pub fn poll_timeout(&self) -> Option<Instant> {
        let stations = self.berths.iter().filter_map(|b| b.station.poll_timeout());
        self.basin.poll_timeout().map(Instant::from).into_iter().chain(stations).min()
    }

    /// Lets time pass in the water, in the modems and in the drivers.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.basin.advance(now.into());
        while self.basin.poll_hang_up().is_some() {
            // A serial line stays open.
        }
        for berth in &mut self.berths {
            let bytes = self.basin.poll_host_bytes(berth.node);
            if !bytes.is_empty() && berth.plugged {
                berth.station.handle_bytes(&bytes, now);
            }
            berth.station.handle_timeout(now);
            if berth.plugged && berth.station.wants_reopening(now) {
                berth.station.handle_closed(now);
                berth.station.handle_open(now);
            }
        }
    }

    /// The next thing that an end's modem tells.
    pub fn poll_event(&mut self, end: usize) -> Option<ModemEvent> {
        self.berths[end].station.poll_event()
    }

    /// Gives the modems what the drivers have for them, after the links had their say.
    pub fn write(&mut self, now: Instant) {
        for berth in &mut self.berths {
            while let Some(bytes) = berth.station.poll_output(now) {
                if berth.plugged {
                    berth.written.extend(bytes);
                }
            }
            let room = self.basin.host_room(berth.node).min(berth.written.len());
            if room > 0 {
                let bytes: Vec<u8> = berth.written.drain(..room).collect();
                self.basin.handle_host_bytes(berth.node, &bytes, now.into());
            }
        }
    }
}

/// An end's station, and its modem in the water.
fn berth(config: &Config, end: Address, modem: Box<dyn Emulator>, basin: &mut Basin) -> Result<Berth, UserError> {
    let number = if end == Address::SURFACE { config.modem.surface_address } else { end.number() };
    let driver = modem::driver(config, end, scenecast_drivers::modem::modem_of_process(config, end)?)?;
    let audit = Audit::new(Duration::from_secs_f64(config.link.budget_window_s));
    let station = Station::new(driver, modem::address_book(config), audit);
    basin.add(NodeId(number), modem);
    Ok(Berth { station, node: NodeId(number), written: Vec::new(), plugged: true })
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
