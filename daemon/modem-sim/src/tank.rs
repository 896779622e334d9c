//! The test basin with its modems, their ports, and the schedule of faults.

use super::host::{FromHost, Line, Speed};
use super::links::Links;
use super::orders::Order;
use super::scenario::{Modem, Place, Scenario, Trouble, node};
use super::{Pace, tcp};
use scenecast_core::UserError;
use sim_channel::modem::{Basin, Fault, HostId};
use sim_channel::{Channel, Interferer, NodeId};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::net::SocketAddr;
use std::time::{Duration, SystemTime};
use tokio::net::TcpListener;
use tokio::sync::mpsc;

/// Noise on a line comes in pieces, so that a line without pacing has it for as long.
const NOISE_PIECE: Duration = Duration::from_millis(100);
/// Bytes of noise in a piece, as 19200 baud carry.
const NOISE_BYTES: u16 = 192;

/// Everything that is emulated, and the ways to it.
pub struct Tank {
    basin: Basin,
    modems: Vec<Modem>,
    ports: Vec<Port>,
    plan: BTreeMap<(Duration, u64), Act>,
    planned: u64,
    /// Modems whose supply fails when they next transmit.
    weak: BTreeSet<usize>,
    links: Links,
    pace: Pace,
    to_tank: mpsc::Sender<FromHost>,
}

/// The hosts at one modem.
#[derive(Default)]
struct Port {
    /// The serial line or the TCP listener; `None` while it is unplugged.
    door: Option<Line>,
    clients: BTreeMap<u32, (HostId, Line)>,
    last_client: u32,
    /// The address that a TCP port had first, so that it comes back at the same.
    bound: Option<SocketAddr>,
}

#[derive(Debug, Clone, Copy)]
enum Act {
    Trouble(usize, Trouble),
    Noise(usize, Duration),
    Plug(usize),
}

impl Tank {
    /// The scenario, its ports open and printed.
    pub fn new(
        scenario: Scenario,
        links: Links,
        pace: Pace,
        to_tank: mpsc::Sender<FromHost>,
    ) -> Result<Self, UserError> {
        let Scenario { seed, channel, links: losses, modems, strangers, faults } = scenario;
        let mut basin = Basin::new(Channel::new(channel, seed));
        let unix_s = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
        for (index, modem) in modems.iter().enumerate() {
            basin.add(node(index), modem.make.emulator(unix_s));
            basin.channel().follow_track(node(index), modem.track.clone(), Duration::ZERO);
        }
        for (index, stranger) in (modems.len()..).zip(&strangers) {
            basin.channel().place(node(index), stranger.position);
            basin.add_interferer(Interferer::new(
                node(index),
                stranger.bytes,
                stranger.airtime,
                stranger.mean_gap,
                seed,
            ));
        }
        for (from, to, loss) in losses {
            basin.channel().set_link_loss(from, to, loss);
        }
        let ports = modems.iter().map(|_| Port::default()).collect();
        let (plan, weak) = (BTreeMap::new(), BTreeSet::new());
        let mut tank = Self { basin, modems, ports, plan, planned: 0, weak, links, pace, to_tank };
        for index in 0..tank.modems.len() {
            tank.plug(index)?;
        }
        for (at, index, trouble) in faults {
            tank.plan(at, Act::Trouble(index, trouble));
        }
        Ok(tank)
    }

    pub fn poll_timeout(&self) -> Option<Duration> {
        let planned = self.plan.keys().next().map(|(at, _)| *at);
        [planned, self.basin.poll_timeout()].into_iter().flatten().min()
    }

    /// Runs everything that is due, and sends the output to the hosts.
    pub fn advance(&mut self, now: Duration) -> Result<(), UserError> {
        while let Some(entry) = self.plan.first_entry().filter(|entry| entry.key().0 <= now) {
            let ((at, _), act) = entry.remove_entry();
            self.basin.advance(at);
            self.carry_out(act, at)?;
        }
        self.basin.advance(now);
        self.fail_supplies(now);
        while let Some(NodeId(node)) = self.basin.poll_hang_up() {
            self.hang_up(usize::from(node) - 1);
        }
        self.tell_hosts();
        Ok(())
    }

    fn tell_hosts(&mut self) {
        for (index, port) in self.ports.iter().enumerate() {
            let first = self.basin.poll_bytes_for(node(index), HostId::FIRST);
            if let (Some(door), Place::Pty, false) = (&port.door, self.modems[index].place, first.is_empty()) {
                door.tell(first);
            }
            for (host, line) in port.clients.values() {
                let bytes = self.basin.poll_bytes_for(node(index), *host);
                if !bytes.is_empty() {
                    line.tell(bytes);
                }
            }
        }
    }

    pub fn handle_host(&mut self, from: FromHost, now: Duration) {
        match from {
            FromHost::Bytes { modem, line, bytes } => {
                let client = self.ports[modem].clients.get(&line).map(|(host, _)| *host);
                if let Some(host) = client.or((line == 0).then_some(HostId::FIRST)) {
                    self.basin.handle_bytes_from(node(modem), host, &bytes, now);
                }
            }
            FromHost::Joined { modem, stream } => {
                let port = &mut self.ports[modem];
                if port.door.is_none() {
                    return;
                }
                let host = self.basin.attach(node(modem));
                if host == HostId::FIRST {
                    tracing::warn!("{}: too many clients at once, one is turned away", self.modems[modem].name);
                    return;
                }
                port.last_client += 1;
                let (line, to_tank) = (port.last_client, self.to_tank.clone());
                let speed = speed(&self.modems[modem], self.pace);
                let client = Line::start(|told| tcp::serve(stream, (modem, line), speed, to_tank, told));
                port.clients.insert(line, (host, client));
            }
            FromHost::Left { modem, line } => {
                if let Some((host, _)) = self.ports[modem].clients.remove(&line) {
                    self.basin.detach(node(modem), host);
                }
            }
        }
    }

    /// Something from the person in front of it.
    pub fn handle_order(&mut self, order: Order, now: Duration) {
        let name = match &order {
            Order::Fault(name, _) | Order::Move(name, _) => name,
            Order::Quit => return,
        };
        let Some(index) = self.modems.iter().position(|modem| modem.name == *name) else {
            let names: Vec<_> = self.modems.iter().map(|modem| modem.name.as_str()).collect();
            return eprintln!("there is no modem {name}; it takes one of {}", names.join(", "));
        };
        match order {
            Order::Fault(_, trouble) => self.plan(now, Act::Trouble(index, trouble)),
            Order::Move(_, position) => self.basin.channel().place(node(index), position),
            Order::Quit => {}
        }
    }

    fn plan(&mut self, at: Duration, act: Act) {
        self.planned += 1;
        self.plan.insert((at, self.planned), act);
    }

    fn carry_out(&mut self, act: Act, now: Duration) -> Result<(), UserError> {
        match act {
            Act::Trouble(index, trouble) => {
                tracing::info!("{:.1} s: {}: {trouble:?}", now.as_secs_f64(), self.modems[index].name);
                self.break_down(index, trouble, now);
                Ok(())
            }
            Act::Noise(index, until) => {
                self.basin.inject(node(index), Fault::Garbage(NOISE_BYTES), now);
                if now + NOISE_PIECE < until {
                    self.plan(now + NOISE_PIECE, Act::Noise(index, until));
                }
                Ok(())
            }
            Act::Plug(index) => self.plug(index),
        }
    }

    fn break_down(&mut self, index: usize, trouble: Trouble, now: Duration) {
        let fault = match trouble {
            Trouble::Busy(length) => Fault::Busy(length),
            Trouble::Reboot => Fault::Reboot,
            Trouble::Garbage(length) => return self.plan(now, Act::Noise(index, now + length)),
            Trouble::HalfLine => Fault::HalfLine,
            Trouble::Freeze(length) => Fault::Freeze(length),
            Trouble::WrongAddress(address) => Fault::WrongAddress(address),
            Trouble::BrownOut => {
                self.weak.insert(index);
                return;
            }
            Trouble::BigBuffer => Fault::BigBuffer,
            Trouble::Unplug(length) => {
                self.hang_up(index);
                self.ports[index].door = None;
                self.links.remove(&self.modems[index].name);
                return self.plan(now + length, Act::Plug(index));
            }
        };
        self.basin.inject(node(index), fault, now);
    }

    /// Supplies that were to fail do so where a transmission is on air.
    fn fail_supplies(&mut self, now: Duration) {
        let failing: Vec<_> =
            self.weak.iter().copied().filter(|index| self.basin.channel().is_busy(node(*index), now)).collect();
        for index in failing {
            self.weak.remove(&index);
            self.basin.inject(node(index), Fault::BrownOut, now);
        }
    }

    /// The TCP clients of a modem lose their connections.
    fn hang_up(&mut self, index: usize) {
        for (_, (host, _)) in std::mem::take(&mut self.ports[index].clients) {
            self.basin.detach(node(index), host);
        }
    }

    /// Opens a port and prints where it is.
    fn plug(&mut self, index: usize) -> Result<(), UserError> {
        if self.ports[index].door.is_some() {
            return Ok(());
        }
        match self.modems[index].place {
            Place::Pty => self.plug_pty(index),
            Place::Tcp(address) => self.plug_tcp(index, address),
        }
    }

    fn plug_tcp(&mut self, index: usize, address: SocketAddr) -> Result<(), UserError> {
        let address = self.ports[index].bound.unwrap_or(address);
        let name = &self.modems[index].name;
        let failed = |e| UserError::Failed(format!("modem {name}: tcp:{address}: {e}"));
        let listener = std::net::TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let bound = listener.local_addr().map_err(failed)?;
        let listener = TcpListener::from_std(listener).map_err(failed)?;
        print_line(&format!("{name} {bound}"));
        let to_tank = self.to_tank.clone();
        self.ports[index].bound = Some(bound);
        self.ports[index].door = Some(Line::start(|_| tcp::accept(listener, index, to_tank)));
        Ok(())
    }

    #[cfg(unix)]
    fn plug_pty(&mut self, index: usize) -> Result<(), UserError> {
        let modem = &self.modems[index];
        let pty = super::pty::Pty::open().map_err(|e| UserError::Failed(format!("modem {}: {e}", modem.name)))?;
        let device = pty.device().display();
        match self.links.point(&modem.name, pty.device())? {
            Some(link) => print_line(&format!("{} {device} {}", modem.name, link.display())),
            None => print_line(&format!("{} {device}", modem.name)),
        }
        let (speed, to_tank) = (speed(modem, self.pace), self.to_tank.clone());
        self.ports[index].door = Some(Line::start(|told| pty.serve(index, speed, to_tank, told)));
        Ok(())
    }

    #[cfg(not(unix))]
    fn plug_pty(&mut self, index: usize) -> Result<(), UserError> {
        let name = &self.modems[index].name;
        Err(UserError::Input(format!(
            "modem {name}: there are no pseudo-terminals here: port takes \"tcp:ADDRESS:PORT\""
        )))
    }
}

/// How fast the line of a modem is in the world's time.
fn speed(modem: &Modem, pace: Pace) -> Speed {
    Speed { bytes_per_s: modem.make.line_rate().map(|rate| rate * pace.scale) }
}

/// Nobody may be reading any more; that is no reason to end.
fn print_line(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}
