//! The test basin with its modems, their emulated ports, and the schedule of faults.

use super::commands::EmulatorCommand;
use super::line::{FromHost, PortLine, Speed};
use super::links::Links;
use super::scenario::{EmulatedPort, ModemFault, Scenario, ScenarioModem, node};
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

/// Noise is sent in pieces at this interval, so that it lasts as long on a line without pacing.
const NOISE_INTERVAL: Duration = Duration::from_millis(100);
/// Bytes of noise in a piece: the capacity of a line of 19200 baud in [`NOISE_INTERVAL`].
const NOISE_BYTES: u16 = 192;

/// The emulated basin and the tasks at its ports.
pub struct Emulation {
    basin: Basin,
    modems: Vec<ScenarioModem>,
    ports: Vec<ModemClients>,
    plan: BTreeMap<(Duration, u64), Act>,
    planned: u64,
    /// Modems whose supply fails during their next transmission.
    brown_outs_due: BTreeSet<usize>,
    links: Links,
    pace: Pace,
    to_emulation: mpsc::Sender<FromHost>,
}

/// The clients at one modem.
#[derive(Default)]
struct ModemClients {
    /// The serial line or the TCP listener; `None` while it is unplugged.
    listener: Option<PortLine>,
    clients: BTreeMap<u32, (HostId, PortLine)>,
    last_client: u32,
    /// The first address of a TCP port; the port returns at the same address after it was unplugged.
    bound: Option<SocketAddr>,
}

#[derive(Debug, Clone, Copy)]
enum Act {
    Fault(usize, ModemFault),
    Noise(usize, Duration),
    Plug(usize),
}

impl Emulation {
    /// Opens the ports of a scenario and prints them.
    pub fn new(
        scenario: Scenario,
        links: Links,
        pace: Pace,
        to_emulation: mpsc::Sender<FromHost>,
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
        let ports = modems.iter().map(|_| ModemClients::default()).collect();
        let (plan, brown_outs_due) = (BTreeMap::new(), BTreeSet::new());
        let mut emulation = Self { basin, modems, ports, plan, planned: 0, brown_outs_due, links, pace, to_emulation };
        for index in 0..emulation.modems.len() {
            emulation.plug(index)?;
        }
        for (at, index, fault) in faults {
            emulation.plan(at, Act::Fault(index, fault));
        }
        Ok(emulation)
    }

    pub fn poll_timeout(&self) -> Option<Duration> {
        let planned = self.plan.keys().next().map(|(at, _)| *at);
        [planned, self.basin.poll_timeout()].into_iter().flatten().min()
    }

    /// Runs everything that is due, and sends the output to the clients.
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
        self.send_outputs();
        Ok(())
    }

    fn send_outputs(&mut self) {
        for (index, port) in self.ports.iter().enumerate() {
            let first = self.basin.poll_bytes_for(node(index), HostId::FIRST);
            if let (Some(listener), EmulatedPort::Pty, false) =
                (&port.listener, self.modems[index].port, first.is_empty())
            {
                listener.send(first);
            }
            for (host, line) in port.clients.values() {
                let bytes = self.basin.poll_bytes_for(node(index), *host);
                if !bytes.is_empty() {
                    line.send(bytes);
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
                if port.listener.is_none() {
                    return;
                }
                let host = self.basin.attach(node(modem));
                if host == HostId::FIRST {
                    tracing::warn!("{}: too many clients at once, one is turned away", self.modems[modem].name);
                    return;
                }
                port.last_client += 1;
                let (line, to_emulation) = (port.last_client, self.to_emulation.clone());
                let speed = speed(&self.modems[modem], self.pace);
                let client = PortLine::start(|output| tcp::serve(stream, (modem, line), speed, to_emulation, output));
                port.clients.insert(line, (host, client));
            }
            FromHost::Left { modem, line } => {
                if let Some((host, _)) = self.ports[modem].clients.remove(&line) {
                    self.basin.detach(node(modem), host);
                }
            }
        }
    }

    /// Carries out a line of the standard input; an unknown modem is reported on the standard error output.
    pub fn handle_command(&mut self, command: EmulatorCommand, now: Duration) {
        let name = match &command {
            EmulatorCommand::Fault(name, _) | EmulatorCommand::Move(name, _) => name,
            EmulatorCommand::Quit => return,
        };
        let Some(index) = self.modems.iter().position(|modem| modem.name == *name) else {
            let names: Vec<_> = self.modems.iter().map(|modem| modem.name.as_str()).collect();
            return eprintln!("there is no modem {name}; it takes one of {}", names.join(", "));
        };
        match command {
            EmulatorCommand::Fault(_, fault) => self.plan(now, Act::Fault(index, fault)),
            EmulatorCommand::Move(_, position) => self.basin.channel().place(node(index), position),
            EmulatorCommand::Quit => {}
        }
    }

    fn plan(&mut self, at: Duration, act: Act) {
        self.planned += 1;
        self.plan.insert((at, self.planned), act);
    }

    fn carry_out(&mut self, act: Act, now: Duration) -> Result<(), UserError> {
        match act {
            Act::Fault(index, fault) => {
                tracing::info!("{:.1} s: {}: {fault:?}", now.as_secs_f64(), self.modems[index].name);
                self.apply_fault(index, fault, now);
                Ok(())
            }
            Act::Noise(index, until) => {
                self.basin.inject(node(index), Fault::Garbage(NOISE_BYTES), now);
                if now + NOISE_INTERVAL < until {
                    self.plan(now + NOISE_INTERVAL, Act::Noise(index, until));
                }
                Ok(())
            }
            Act::Plug(index) => self.plug(index),
        }
    }

    fn apply_fault(&mut self, index: usize, fault: ModemFault, now: Duration) {
        let fault = match fault {
            ModemFault::Busy(length) => Fault::Busy(length),
            ModemFault::Reboot => Fault::Reboot,
            ModemFault::Garbage(length) => return self.plan(now, Act::Noise(index, now + length)),
            ModemFault::HalfLine => Fault::HalfLine,
            ModemFault::Freeze(length) => Fault::Freeze(length),
            ModemFault::WrongAddress(address) => Fault::WrongAddress(address),
            ModemFault::BrownOut => {
                self.brown_outs_due.insert(index);
                return;
            }
            ModemFault::BigBuffer => Fault::BigBuffer,
            ModemFault::Unplug(length) => {
                self.hang_up(index);
                self.ports[index].listener = None;
                self.links.remove(&self.modems[index].name);
                return self.plan(now + length, Act::Plug(index));
            }
        };
        self.basin.inject(node(index), fault, now);
    }

    /// A brown-out that is due takes effect once its modem is transmitting.
    fn fail_supplies(&mut self, now: Duration) {
        let failing: Vec<_> = self
            .brown_outs_due
            .iter()
            .copied()
            .filter(|index| self.basin.channel().is_busy(node(*index), now))
            .collect();
        for index in failing {
            self.brown_outs_due.remove(&index);
            self.basin.inject(node(index), Fault::BrownOut, now);
        }
    }

    /// Closes the connections of the TCP clients of a modem.
    fn hang_up(&mut self, index: usize) {
        for (_, (host, _)) in std::mem::take(&mut self.ports[index].clients) {
            self.basin.detach(node(index), host);
        }
    }

    /// Opens a port and prints its device or address.
    fn plug(&mut self, index: usize) -> Result<(), UserError> {
        if self.ports[index].listener.is_some() {
            return Ok(());
        }
        match self.modems[index].port {
            EmulatedPort::Pty => self.plug_pty(index),
            EmulatedPort::Tcp(address) => self.plug_tcp(index, address),
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
        let to_emulation = self.to_emulation.clone();
        self.ports[index].bound = Some(bound);
        self.ports[index].listener = Some(PortLine::start(|_| tcp::accept(listener, index, to_emulation)));
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
        let (speed, to_emulation) = (speed(modem, self.pace), self.to_emulation.clone());
        self.ports[index].listener = Some(PortLine::start(|output| pty.serve(index, speed, to_emulation, output)));
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

/// The pace of a modem's line in wall time.
fn speed(modem: &ScenarioModem, pace: Pace) -> Speed {
    Speed { bytes_per_s: modem.make.line_rate().map(|rate| rate * pace.scale) }
}

/// The reader of the standard output may be gone; the emulation continues.
fn print_line(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}
