//! The port of a process's modem, the log of its events and of what is wrong there, and the warning of a missing key.

use crate::clock::Clock;
use crate::port::{FromPort, Port};
use scenecast_config::{Config, ModemKind};
use scenecast_core::{PortAddress, UserError};
use scenecast_drivers::modem::{PortFinding, PortListener, Speaker};
use scenecast_host::{FrameEvent, LinkEnd, LinkHost};
use scenecast_protocol::time::Instant;
use std::io;
use std::time::Duration;

/// Minimum time between two reopenings of the port because of a silent modem.
const REOPEN_INTERVAL: Duration = Duration::from_secs(10);

/// A connection that lasts for less than this was of no use.
const SHORT: Duration = Duration::from_secs(5);
/// So many of them in a row are told.
const MANY_SHORT: u32 = 3;

/// The port to the modem.
#[derive(Debug)]
pub(super) struct ModemPort {
    port: Port,
    place: PortAddress,
    kind: ModemKind,
    /// When it was opened again last.
    reopened: Instant,
    listener: PortListener,
    /// Devices take their own time, however fast the mission runs.
    clock: Clock,
    /// Since when the port is open, and how many short connections there were in a row.
    opened: Option<Instant>,
    short: u32,
    is_lost: bool,
    /// What people are to be told next.
    note: Option<String>,
}

impl ModemPort {
    /// Opens the port that the configuration names.
    pub(super) async fn open(config: &Config, now: Instant) -> Result<Self, UserError> {
        let place = scenecast_config::modem_port(config)?;
        let port = Port::open_judged("modem", place.clone()).await.map_err(|e| not_there(&place, &e))?;
        let kind = config.modem.kind;
        let (listener, clock) = (PortListener::new(kind), Clock::new(1.0));
        let (opened, short, is_lost, note) = (None, 0, false, None);
        Ok(Self { port, place, kind, reopened: now, listener, clock, opened, short, is_lost, note })
    }

    /// The next report of the port. Cancel-safe.
    pub(super) async fn next(&mut self) -> FromPort {
        self.port.next().await
    }

    /// Hands a host the report of the port.
    pub(super) fn handle<E: LinkEnd>(&mut self, report: FromPort, link: &mut LinkHost<E>, now: Instant) {
        match report {
            FromPort::Open => {
                self.opened = Some(self.clock.now());
                self.listener.handle_open(self.clock.now());
                link.handle_open(now);
            }
            FromPort::Closed => {
                self.handle_closed();
                link.handle_closed(now);
            }
            FromPort::Bytes(bytes) => {
                self.listener.handle_bytes(&bytes);
                link.handle_bytes(&bytes, now);
            }
            FromPort::Datagram(bytes, sender) => {
                self.listener.handle_bytes(&bytes);
                self.port.judge(sender, link.handle_datagram(&bytes, now));
            }
        }
    }

    fn handle_closed(&mut self) {
        self.listener.handle_closed();
        let is_short = self.opened.take().is_some_and(|opened| self.clock.now().since(opened) < SHORT);
        self.short = if is_short { self.short + 1 } else { 0 };
        if self.short == MANY_SHORT {
            let place = &self.place;
            self.tell(format!(
                "{place} is closed again and again as soon as it is open: another program has it, or no modem is there"
            ));
        }
    }

    /// Ends the row of short connections once one lasts, and says so where the row was told.
    fn handle_lasting(&mut self) {
        let lasts = self.opened.is_some_and(|opened| self.clock.now().since(opened) >= SHORT);
        if lasts && std::mem::take(&mut self.short) >= MANY_SHORT {
            tracing::info!("modem: open, and stays so");
            self.note = Some("its port stays open now".to_owned());
        }
    }

    fn tell(&mut self, text: String) {
        tracing::warn!("modem: {text}");
        self.note = Some(text);
    }

    /// Refused bytes are dropped: the port is dead, the driver detects it, and by then the bytes are stale.
    pub(super) fn write(&mut self, bytes: Vec<u8>) {
        self.listener.handle_written(&bytes);
        if !self.port.write(bytes) {
            tracing::debug!("modem: the port takes no more");
        }
    }

    /// Opens the port again if the driver requests it.
    pub(super) fn reopen_if_silent<E: LinkEnd>(&mut self, link: &LinkHost<E>, now: Instant) {
        if link.wants_reopening(now) && now.since(self.reopened) > REOPEN_INTERVAL {
            self.reopened = now;
            self.port.reopen();
        }
    }

    /// Logs events of frames and modem.
    ///
    /// # Errors
    /// A modem that refuses a setting before it ever worked ends the run, while the person who started it is still there.
    pub(super) fn handle_event(&mut self, event: &FrameEvent) -> Result<(), UserError> {
        match event {
            FrameEvent::ModemReady => {
                let (was_told, was_lost) = (self.listener.handle_ready(), std::mem::take(&mut self.is_lost));
                if was_told || was_lost && self.short == 0 {
                    self.note = Some("it is ready now".to_owned());
                }
                match self.short {
                    0 => tracing::info!("modem: ready"),
                    _ => tracing::debug!("modem: ready"),
                }
            }
            // A port that is closed at once is told as that.
            FrameEvent::ModemLost if self.short > 0 => tracing::debug!("modem: lost"),
            FrameEvent::ModemLost => {
                self.is_lost = true;
                self.tell(lost(self.kind).to_owned());
            }
            FrameEvent::ModemRefused { reason, was_ready: false } => {
                return Err(UserError::Failed(format!("modem: {reason}")));
            }
            FrameEvent::ModemRefused { reason, .. } => tracing::error!("modem: {reason}"),
            FrameEvent::NotSent(refusal) => tracing::error!("modem: a frame is not sent: {refusal}"),
            FrameEvent::OverBudget { max_window_bps } => {
                tracing::error!("the bit budget was exceeded: {max_window_bps:.0} bit/s in the fullest window");
            }
            FrameEvent::Sent { .. } | FrameEvent::Received { .. } => {}
        }
        Ok(())
    }

    /// Logs what is wrong at a port whose modem does not get ready.
    pub(super) fn listen<E: LinkEnd>(&mut self, link: &LinkHost<E>) {
        self.handle_lasting();
        if let Some(finding) = self.listener.poll(link.end().frame_counts().accepted > 0, self.clock.now()) {
            self.tell(format!("{}; `scenecast doctor modem` looks closer", advice(&finding, &self.place)));
        }
    }

    /// What the log of the mission is to have about the modem: what is wrong, or that it is no more.
    pub(super) fn poll_note(&mut self) -> Option<String> {
        self.note.take()
    }
}

/// What an end loses with its modem.
fn lost(kind: ModemKind) -> &'static str {
    match kind {
        // No modem is between: the program of the other end is what answers or does not.
        ModemKind::Tcp | ModemKind::Udp => {
            "the connection to the other end's program ended; it continues when that program answers again"
        }
        ModemKind::S2c | ModemKind::Micromodem | ModemKind::Transparent => "lost; it is set up again when it answers",
    }
}

/// What is wrong at a port, and what to do.
pub(super) fn advice(finding: &PortFinding, place: &PortAddress) -> String {
    let is_serial = matches!(place, PortAddress::Serial(..));
    match finding {
        PortFinding::Silent if is_serial => format!(
            "nothing comes in from {place}: the modem may be off, its cable loose or crossed, or its speed another one"
        ),
        PortFinding::Silent => {
            format!("nothing comes in from {place}, although it is connected: is the modem behind it on?")
        }
        PortFinding::NoText if is_serial => {
            format!("what comes in from {place} is no text, so its speed is probably another one (modem.baud)")
        }
        PortFinding::NoText => format!("what comes in from {place} is not what a modem of this kind writes"),
        PortFinding::Speaks(Speaker::S2c) => {
            format!("an EvoLogics S2C modem answers at {place}: set modem.kind = \"s2c\", or connect the other modem")
        }
        PortFinding::Speaks(Speaker::Micromodem) => {
            format!("a WHOI Micromodem speaks at {place}: set modem.kind = \"micromodem\", or connect the other modem")
        }
        PortFinding::Speaks(Speaker::Gnss) => {
            format!("a receiver of satellite positions speaks at {place}: its device and that of the modem are swapped")
        }
        PortFinding::Speaks(Speaker::Login) => {
            format!("a computer at {place} asks for a name and a password: this is its console, not a modem")
        }
        PortFinding::Echo => {
            format!("what is written to {place} comes back: its two data lines are joined, or nothing is behind it")
        }
        PortFinding::UnknownText(line) => format!(
            "what comes in from {place} is text of no modem that scenecast knows, such as \"{}\"",
            line.escape_default()
        ),
        PortFinding::NoFrames(bytes) => format!(
            "{bytes} bytes have come in from {place}, and no frame of this mission is in them: {}is the other end's modem of the same kind, \
             and mission.id the same?",
            if is_serial { "is modem.baud its speed, " } else { "" }
        ),
        PortFinding::NotReady => format!("the modem at {place} answers, and does not get ready"),
    }
}

/// Logs the bits on air at the end of a run.
pub(super) fn log_audit<E: LinkEnd>(link: &LinkHost<E>) {
    let a = link.audit();
    let (frames, bits, worst) = (a.transmissions(), a.total_bits(), a.worst_window_bps());
    let repeated = link.repeated_bits();
    tracing::info!("{frames} transmissions, {bits} bits on air, {worst:.0} bit/s in the fullest window");
    if repeated > 0 {
        tracing::info!("{repeated} bits more were repeats of the modem, and charged to the budget");
    }
}

/// Why a port cannot be opened, and what to do.
pub(super) fn not_there(place: &PortAddress, e: &io::Error) -> UserError {
    UserError::Input(match place {
        PortAddress::Serial(device, _) => format!("modem.device: {device}: {e}{}", remedy(e)),
        PortAddress::Listen(address) => format!("modem.listen: cannot listen on {address}: {e}"),
        PortAddress::Connect(address) => format!("modem.connect: {address}: {e}"),
        PortAddress::Datagrams(..) => format!("modem.listen, modem.connect: {e}"),
        PortAddress::File(path) => format!("{}: {e}", path.display()),
    })
}

/// What to do about a serial device that cannot be opened.
fn remedy(e: &io::Error) -> String {
    let text = e.to_string();
    // The library reports a device that another program has open as missing.
    if ["exclusive lock", "busy"].iter().any(|word| text.contains(word)) {
        return "; another program has it open (`fuser` names it): a second scenecast, ModemManager, gpsd".to_owned();
    }
    match e.kind() {
        io::ErrorKind::NotFound => {
            let found = tokio_serial::available_ports().unwrap_or_default();
            let found: Vec<String> = found.into_iter().map(|port| port.port_name).collect();
            match found.is_empty() {
                true => "; there is no serial device".to_owned(),
                false => format!("; the serial devices here are {}", found.join(", ")),
            }
        }
        io::ErrorKind::PermissionDenied => {
            "; this user must be in the group of the device (often dialout), and log in again".to_owned()
        }
        _ if text.contains("typewriter") => "; it is no serial device".to_owned(),
        _ => String::new(),
    }
}

/// Warns of the risk of running without a key.
pub(super) fn warn_without_key(config: &Config) {
    if config.link.key_file.is_none() {
        tracing::warn!(
            "link.key_file is empty: whoever can transmit to the vehicle can give it orders and forge its map; \
             scenecast key new makes a key, and both ends need the same file"
        );
    }
}

#[cfg(all(test, feature = "surface"))]
mod tests {
    use super::*;
    use scenecast_core::Area;
    use scenecast_core::tuning_table::TuningTable;
    use scenecast_host::channel_station;
    use scenecast_protocol::mac::ModemProfile;
    use scenecast_surface::Surface;
    use scenecast_vehicle::{Durable, Vehicle};
    use tokio::net::UdpSocket;

    #[test]
    fn without_a_modem_the_connection_is_what_is_lost() {
        assert!(lost(ModemKind::Tcp).starts_with("the connection to the other end's program ended"));
        assert_eq!(lost(ModemKind::Transparent), lost(ModemKind::S2c));
    }

    const WINDOW: Duration = Duration::from_secs(10);

    /// An end of the link at its port.
    struct PortedEnd<E> {
        port: ModemPort,
        link: LinkHost<E>,
    }

    impl<E: LinkEnd> PortedEnd<E> {
        async fn new(config: &Config, end: E, modem: ModemProfile) -> Self {
            let port = ModemPort::open(config, Instant::ZERO).await.unwrap();
            let mut new = Self { port, link: LinkHost::new(end, channel_station(modem, WINDOW, Instant::ZERO)) };
            assert_eq!(new.port.next().await, FromPort::Open);
            new.port.handle(FromPort::Open, &mut new.link, Instant::ZERO);
            new
        }

        /// Reads the next datagram, and drops the events that it causes.
        async fn read(&mut self, now: Instant) {
            let report = self.port.next().await;
            self.port.handle(report, &mut self.link, now);
            while self.link.poll_event().is_some() {}
        }

        /// Writes the frames that are due, and returns their number.
        fn write(&mut self, now: Instant) -> usize {
            self.link.handle_timeout(now);
            let mut frames = 0;
            while let Some(bytes) = self.link.poll_output(now) {
                self.port.write(bytes);
                frames += 1;
            }
            while self.link.poll_event().is_some() {}
            frames
        }

        fn accepted(&self) -> u64 {
            self.link.end().frame_counts().accepted
        }
    }

    /// Passes frames to and fro for a minute, or until both ends have accepted this many.
    async fn exchange(surface: &mut PortedEnd<Surface>, vehicle: &mut PortedEnd<Vehicle>, began: Instant, enough: u64) {
        for tick in 0..600 {
            let now = began + Duration::from_millis(100) * tick;
            for _ in 0..surface.write(now) {
                vehicle.read(now).await;
            }
            for _ in 0..vehicle.write(now) {
                surface.read(now).await;
            }
            if surface.accepted() >= enough && vehicle.accepted() >= enough {
                return;
            }
        }
    }

    #[tokio::test]
    async fn a_stranger_over_udp_does_not_lock_out_the_surface() {
        let free = UdpSocket::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap();
        let load = |end: &str| {
            let sets = ["modem.kind=udp".to_owned(), format!("modem.{end}={free}"), "link.max_idle_s=4".to_owned()];
            scenecast_config::load(None, &sets).unwrap()
        };
        let (below, above) = (load("listen"), load("connect"));
        let modem = scenecast_config::modem_profile(&below, 10_000.0);
        let (area, start) = (Area { west: 0.0, south: 0.0, east: 20.0, north: 20.0 }, Instant::ZERO);
        let vehicle = scenecast_vehicle::assemble(&below, None, modem, area, Durable::default(), 3, start).unwrap();
        let surface = scenecast_surface::assemble(&above, None, TuningTable::default(), modem, 4, start).unwrap();
        let mut vehicle = PortedEnd::new(&below, vehicle, modem).await;
        let mut surface = PortedEnd::new(&above, surface, modem).await;
        let stranger = UdpSocket::bind("127.0.0.1:0").await.unwrap();
        stranger.send_to(b"first", free).await.unwrap();
        vehicle.read(start).await;
        exchange(&mut surface, &mut vehicle, start, 2).await;
        assert!(surface.accepted() >= 2 && vehicle.accepted() >= 2, "the surface is locked out");
        stranger.send_to(b"second", free).await.unwrap();
        exchange(&mut surface, &mut vehicle, start + Duration::from_secs(100), 6).await;
        assert!(surface.accepted() >= 6 && vehicle.accepted() >= 6);
        let dropped: u64 = vehicle.link.end().frame_counts().dropped.values().sum();
        assert_eq!(dropped, 1, "only the first datagram of the stranger was read");
    }
}
