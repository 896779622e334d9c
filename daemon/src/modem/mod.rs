//! Ways to a modem.
//!
//! `tcp`: frames over a TCP link, each with its length; `transparent`: a byte pipe on a serial device, framed by
//! [`framing`]. Both keep the pace of the modem on air, so that the host knows when a transmission has ended.

pub mod framing;
mod pipe;
mod tcp;
mod transparent;

use crate::config::Config;
use crate::problem::Problem;
use crate::runtime::Clock;
use bytes::Bytes;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::schedule::Audit;
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::time::Instant;

/// What a modem tells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ModemEvent {
    /// The transmission has ended; the next one may begin.
    Sent,
    /// Bytes were heard.
    Received(Bytes),
}

/// A modem: takes one transmission at a time, and gives what it hears.
#[derive(Debug)]
pub struct Modem {
    outgoing: mpsc::Sender<Bytes>,
    incoming: mpsc::Receiver<Bytes>,
    profile: ModemProfile,
    /// The slowest of the ways to the water: bits a second.
    pace_bps: f64,
    busy_until: Option<Instant>,
    /// What went on air, counted at the door, and what the configuration allows in a window.
    audit: Audit,
    window_bits: f64,
}

impl Modem {
    /// Whether a transmission is under way.
    pub fn is_busy(&self) -> bool {
        self.busy_until.is_some()
    }

    /// The budget has changed.
    pub fn set_budget(&mut self, bits_per_s: u32) {
        self.window_bits = self.window_bits.max(f64::from(bits_per_s) * self.window_s());
    }

    fn window_s(&self) -> f64 {
        self.audit.window().as_secs_f64()
    }

    /// Writes what went on air to the log.
    pub fn log_audit(&self) {
        let a = &self.audit;
        let (frames, bits, worst) = (a.transmissions(), a.total_bits(), a.worst_window_bps());
        tracing::info!("{frames} transmissions, {bits} bits on air, {worst:.0} bit/s in the worst window");
    }

    /// Puts a frame on air. A frame that the modem cannot take is lost like one on the way, and the link repairs it.
    pub fn send(&mut self, bytes: Vec<u8>, clock: Clock) -> Result<(), Problem> {
        if bytes.len() > self.profile.frame_bytes {
            return Err(Problem::Failed(format!(
                "a frame of {} bytes is larger than the modem's {}",
                bytes.len(),
                self.profile.frame_bytes
            )));
        }
        let bits_on_air = self.profile.bits_on_air(bytes.len());
        self.audit.record(bits_on_air, clock.now());
        if self.audit.worst_window_bits() as f64 > self.window_bits + self.audit.largest_bits() as f64 {
            tracing::error!(
                "the bit budget was exceeded: {:.0} bit/s in the worst window",
                self.audit.worst_window_bps()
            );
        }
        let bits = bits_on_air as f64;
        self.busy_until = Some(clock.wall(clock.now() + Duration::from_secs_f64(bits / self.pace_bps)));
        if self.outgoing.try_send(bytes.into()).is_err() {
            tracing::warn!("the modem is not connected: a frame is lost");
        }
        Ok(())
    }

    /// The next thing that happens; safe to abandon and to ask again.
    pub async fn next(&mut self) -> ModemEvent {
        let ended = async {
            match self.busy_until {
                Some(at) => tokio::time::sleep_until(at).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            () = ended => {
                self.busy_until = None;
                ModemEvent::Sent
            }
            Some(bytes) = self.incoming.recv() => ModemEvent::Received(bytes),
        }
    }
}

/// Opens the modem that the configuration names.
pub async fn open(config: &Config, profile: ModemProfile) -> Result<Modem, Problem> {
    let (outgoing, to_modem) = mpsc::channel(4);
    let (from_modem, incoming) = mpsc::channel(64);
    let m = &config.modem;
    let mut pace_bps = m.bit_rate;
    match m.kind.as_str() {
        "transparent" => {
            if m.device.is_empty() {
                return Err(Problem::Input("modem.device: a transparent modem needs its serial device".to_owned()));
            }
            // A serial byte takes ten bits; the time scale of a rehearsal speeds up the water, not the cable.
            pace_bps = pace_bps.min(f64::from(m.baud) * 0.8 / config.runtime.time_scale);
            transparent::open(m.device.clone(), m.baud, profile.frame_bytes, to_modem, from_modem)?;
        }
        _ => tcp::open(&m.listen, &m.connect, profile.frame_bytes, to_modem, from_modem).await?,
    }
    let audit = Audit::new(Duration::from_secs_f64(config.link.budget_window_s));
    let window_bits = f64::from(config.link.budget_bps) * config.link.budget_window_s;
    Ok(Modem { outgoing, incoming, profile, pace_bps, busy_until: None, audit, window_bits })
}
