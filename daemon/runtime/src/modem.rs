//! The port of a process's modem, and the log of its events.

use crate::port::{FromPort, Port};
use scenecast_config::Config;
use scenecast_core::{PortAddress, UserError};
use scenecast_host::{FrameEvent, LinkEnd, LinkHost};
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Minimum time between two reopenings of the port because of a silent modem.
const REOPEN_INTERVAL: Duration = Duration::from_secs(10);

/// The port to the modem, with the time of its last reopening.
#[derive(Debug)]
pub(super) struct ModemPort {
    port: Port,
    reopened: Instant,
}

impl ModemPort {
    /// Opens the port that the configuration names.
    pub(super) async fn open(config: &Config, now: Instant) -> Result<Self, UserError> {
        let place = scenecast_config::modem_port(config)?;
        let port = Port::open_judged("modem", place.clone()).await.map_err(|e| not_there(&place, &e))?;
        Ok(Self { port, reopened: now })
    }

    /// The next report of the port. Cancel-safe.
    pub(super) async fn next(&mut self) -> FromPort {
        self.port.next().await
    }

    /// Hands a host the report of the port.
    pub(super) fn handle<E: LinkEnd>(&self, report: FromPort, link: &mut LinkHost<E>, now: Instant) {
        match report {
            FromPort::Open => link.handle_open(now),
            FromPort::Closed => link.handle_closed(now),
            FromPort::Bytes(bytes) => link.handle_bytes(&bytes, now),
            FromPort::Datagram(bytes, sender) => self.port.judge(sender, link.handle_datagram(&bytes, now)),
        }
    }

    /// Refused bytes are dropped: the port is dead, the driver detects it, and by then the bytes are stale.
    pub(super) fn write(&self, bytes: Vec<u8>) {
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
}

/// Logs events of frames and modem.
///
/// # Errors
/// A modem that refuses a setting before it ever worked ends the run, while the person who started it is still there.
pub(super) fn log(event: &FrameEvent) -> Result<(), UserError> {
    match event {
        FrameEvent::ModemReady => tracing::info!("modem: ready"),
        FrameEvent::ModemLost => tracing::warn!("modem: lost; it is set up again when it answers"),
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

fn not_there(place: &PortAddress, e: &std::io::Error) -> UserError {
    UserError::Input(match place {
        PortAddress::Serial(device, _) => format!("modem.device: {device}: {e}"),
        PortAddress::Listen(address) => format!("modem.listen: cannot listen on {address}: {e}"),
        PortAddress::Connect(address) => format!("modem.connect: {address}: {e}"),
        PortAddress::Datagrams(..) => format!("modem.listen, modem.connect: {e}"),
        PortAddress::File(path) => format!("{}: {e}", path.display()),
    })
}
