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
}

impl Modem {
    /// Whether a transmission is under way.
    pub fn is_busy(&self) -> bool {
        self.busy_until.is_some()
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
        let bits = self.profile.bits_on_air(bytes.len()) as f64;
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
    Ok(Modem { outgoing, incoming, profile, pace_bps, busy_until: None })
}
