//! `scenecast modem-sim`: emulated modems on devices and TCP ports, joined by one simulated channel, in real time
//! or faster.
//!
//! One task owns the [`Basin`](sim_channel::modem::Basin) and sleeps until its next event is due or a port has
//! bytes; a task at each port moves them.

mod commands;
mod emulation;
mod line;
mod links;
#[cfg(unix)]
mod pty;
mod scenario;
mod tcp;

pub use scenario::Scenario;

use commands::EmulatorCommand;
use emulation::Emulation;
use line::FromHost;
use links::Links;
use scenecast_core::UserError;
use scenecast_runtime::Stop;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

#[derive(Debug)]
pub struct Options {
    pub scenario: PathBuf,
    /// Folder for symbolic links to devices.
    pub link_dir: Option<PathBuf>,
    /// Emulated seconds per second of wall time.
    pub time_scale: f64,
    /// Seed that replaces the scenario's.
    pub seed: Option<u64>,
}

/// Emulates until it is interrupted.
pub fn run(options: Options) -> Result<(), UserError> {
    let mut scenario = Scenario::load(&options.scenario)?;
    scenario.seed = options.seed.unwrap_or(scenario.seed);
    let links = Links::new(options.link_dir.as_deref())?;
    let pace = Pace { began: Instant::now(), scale: options.time_scale };
    scenecast_runtime::block_on(async move {
        let mut stop = Stop::new()?;
        let (to_emulation, from_hosts) = mpsc::channel(256);
        let mut emulation = Emulation::new(scenario, links, pace, to_emulation)?;
        tokio::select! {
            result = serve(&mut emulation, from_hosts, pace) => result,
            () = stop.asked() => Ok(()),
        }
    })
}

/// Converts between emulated time and wall time.
#[derive(Debug, Clone, Copy)]
struct Pace {
    began: Instant,
    scale: f64,
}

impl Pace {
    fn now(&self) -> Duration {
        self.began.elapsed().mul_f64(self.scale)
    }

    /// The wall time of an emulated time, at most one day ahead.
    fn wall(&self, at: Duration) -> tokio::time::Instant {
        const DAY: f64 = 86_400.0;
        let ahead = at.saturating_sub(self.now()).as_secs_f64() / self.scale;
        tokio::time::Instant::now() + Duration::from_secs_f64(ahead.min(DAY))
    }
}

async fn serve(
    emulation: &mut Emulation,
    mut from_hosts: mpsc::Receiver<FromHost>,
    pace: Pace,
) -> Result<(), UserError> {
    let mut commands = commands::listen();
    loop {
        let due = emulation.poll_timeout().map(|at| pace.wall(at));
        let sleep = async {
            match due {
                Some(due) => tokio::time::sleep_until(due).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            () = sleep => {}
            Some(from) = from_hosts.recv() => {
                emulation.handle_host(from, pace.now());
                while let Ok(from) = from_hosts.try_recv() {
                    emulation.handle_host(from, pace.now());
                }
            }
            Some(command) = commands.recv() => match command {
                EmulatorCommand::Quit => return Ok(()),
                command => emulation.handle_command(command, pace.now()),
            },
        }
        emulation.advance(pace.now())?;
    }
}
