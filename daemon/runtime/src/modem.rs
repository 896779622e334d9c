//! A modem of a process: a station at a port.

use crate::Clock;
use crate::port::{FromPort, Port};
use scenecast_config::Config;
use scenecast_core::PortAddress;
use scenecast_core::UserError;
use scenecast_drivers::modem::{ModemEvent, Station, address_book, driver};
use scenecast_protocol::link::{Cycle, Transmit};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use std::time::Duration;

/// A modem of a process: a station at a port.
#[derive(Debug)]
pub struct Modem {
    station: Station,
    port: Port,
    clock: Clock,
    /// What the configuration allows in a window, bits.
    window_bits: f64,
    /// Whether the budget was found exceeded.
    exceeded: bool,
    was_ready: bool,
    reopened: Instant,
}

impl Modem {
    /// Whether the link may be asked for a frame.
    pub fn takes_frames(&self) -> bool {
        self.station.takes_frames()
    }

    /// Whether the link may be asked for a cycle.
    pub fn takes_cycles(&self) -> bool {
        self.station.takes_cycles(self.clock.now())
    }

    /// Begins a cycle of the modem.
    pub fn begin_cycle(&mut self, cycle: Cycle) {
        self.station.begin_cycle(cycle, self.clock.now());
    }

    /// The budget has changed.
    pub fn set_budget(&mut self, bits_per_s: u32) {
        let window_s = self.station.audit().window().as_secs_f64();
        self.window_bits = self.window_bits.max(f64::from(bits_per_s) * window_s);
    }

    /// Writes what went on air to the log.
    pub fn log_audit(&self) {
        let a = self.station.audit();
        let (frames, bits, worst) = (a.transmissions(), a.total_bits(), a.worst_window_bps());
        let repeated = self.station.repeated_bits();
        tracing::info!("{frames} transmissions, {bits} bits on air, {worst:.0} bit/s in the worst window");
        if repeated > 0 {
            tracing::info!("{repeated} bits more were repeats of the modem, and charged to the budget");
        }
    }

    /// Puts a frame on air. What the modem refuses is told, and the link repairs it as if it were lost.
    pub fn send(&mut self, transmit: Transmit) {
        if let Err(refusal) = self.station.send(transmit, self.clock.now()) {
            tracing::error!("modem: a frame is not sent: {refusal}");
        }
        let audit = self.station.audit();
        let exceeded = audit.worst_window_bits() as f64 > self.window_bits + audit.largest_bits() as f64;
        if exceeded && !std::mem::replace(&mut self.exceeded, true) {
            tracing::error!("the bit budget was exceeded: {:.0} bit/s in the worst window", audit.worst_window_bps());
        }
    }

    /// The next thing that happens; safe to abandon and to ask again.
    pub async fn next(&mut self) -> Result<ModemEvent, UserError> {
        loop {
            if let Some(event) = self.station.poll_event() {
                self.note(&event)?;
                return Ok(event);
            }
            self.write();
            let wake = self.station.poll_timeout();
            let timeout = async {
                match wake {
                    Some(at) => tokio::time::sleep_until(self.clock.wall(at)).await,
                    None => std::future::pending().await,
                }
            };
            tokio::select! {
                () = timeout => self.station.handle_timeout(self.clock.now()),
                told = self.port.next() => self.handle_port(told),
            }
        }
    }

    fn handle_port(&mut self, told: FromPort) {
        let now = self.clock.now();
        match told {
            FromPort::Open => self.station.handle_open(now),
            FromPort::Closed => self.station.handle_closed(now),
            FromPort::Bytes(bytes) => self.station.handle_bytes(&bytes, now),
        }
    }

    /// Writes what the driver has for the port, once the link has had its say.
    fn write(&mut self) {
        let now = self.clock.now();
        if self.station.wants_reopening(now) && now.since(self.reopened) > Duration::from_secs(10) {
            self.reopened = now;
            self.port.reopen();
        }
        // A port that takes nothing is a dead one: the driver notices, and what it has to say is stale by then.
        while let Some(bytes) = self.station.poll_output(now) {
            if !self.port.write(bytes) {
                tracing::debug!("modem: the port takes no more");
            }
        }
    }

    /// Says what a person should know. A modem that refuses before it ever worked ends the run: somebody is still there.
    fn note(&mut self, event: &ModemEvent) -> Result<(), UserError> {
        match event {
            ModemEvent::Ready => {
                self.was_ready = true;
                tracing::info!("modem: ready");
            }
            ModemEvent::Lost => tracing::warn!("modem: lost; it is set up again when it answers"),
            ModemEvent::Refused(what) if !self.was_ready => return Err(UserError::Failed(format!("modem: {what}"))),
            ModemEvent::Refused(what) => tracing::error!("modem: {what}"),
            _ => {}
        }
        Ok(())
    }
}

/// Opens the modem that the configuration names, for this end.
pub async fn open(config: &Config, end: Address, profile: ModemProfile, clock: Clock) -> Result<Modem, UserError> {
    let driver = driver(config, end, profile)?;
    let audit = Audit::new(Duration::from_secs_f64(config.link.budget_window_s));
    let window_bits = f64::from(config.link.budget_bps) * config.link.budget_window_s;
    let place = scenecast_config::modem_port(config)?;
    let port = Port::open("modem", place.clone()).await.map_err(|e| not_there(&place, &e))?;
    Ok(Modem {
        station: Station::new(driver, address_book(config), audit),
        port,
        clock,
        window_bits,
        exceeded: false,
        was_ready: false,
        reopened: clock.now(),
    })
}

fn not_there(place: &PortAddress, e: &std::io::Error) -> UserError {
    UserError::Input(match place {
        PortAddress::Serial(device, _) => format!("modem.device: {device}: {e}"),
        PortAddress::Listen(address) => format!("modem.listen: cannot listen on {address}: {e}"),
        PortAddress::Connect(address) => format!("modem.connect: {address}: {e}"),
        PortAddress::Datagrams(..) => format!("modem.listen, modem.connect: {e}"),
        PortAddress::File(path) => format!("{}: {e}", path.display()),
    })
}
