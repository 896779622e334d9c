//! `scenecast modem-sim`: emulated modems on devices and TCP ports, joined by an emulated water, at the pace of the world
//! or faster.
//!
//! One task owns the [`Basin`](sim_channel::modem::Basin) and sleeps until the next thing is due there or a port has
//! bytes; a task at each port moves them.

mod host;
mod links;
mod orders;
#[cfg(unix)]
mod pty;
mod scenario;
mod tank;
mod tcp;

pub use scenario::Scenario;

use host::FromHost;
use links::Links;
use orders::Order;
use scenecast_core::UserError;
use scenecast_runtime::Stop;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use tank::Tank;
use tokio::sync::mpsc;

/// The options of the command.
#[derive(Debug)]
pub struct Options {
    pub scenario: PathBuf,
    /// Folder for symbolic links to devices.
    pub link_dir: Option<PathBuf>,
    /// Seconds of the emulation a second.
    pub time_scale: f64,
    /// Instead of the scenario's seed.
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
        let (to_tank, from_hosts) = mpsc::channel(256);
        let mut tank = Tank::new(scenario, links, pace, to_tank)?;
        tokio::select! {
            result = serve(&mut tank, from_hosts, pace) => result,
            () = stop.asked() => Ok(()),
        }
    })
}

/// The emulation's time against the world's.
#[derive(Debug, Clone, Copy)]
struct Pace {
    began: Instant,
    scale: f64,
}

impl Pace {
    fn now(&self) -> Duration {
        self.began.elapsed().mul_f64(self.scale)
    }

    /// When the world's clock shows a time of the emulation; one that is very far is cut to a day.
    fn wall(&self, at: Duration) -> tokio::time::Instant {
        const DAY: f64 = 86_400.0;
        let ahead = at.saturating_sub(self.now()).as_secs_f64() / self.scale;
        tokio::time::Instant::now() + Duration::from_secs_f64(ahead.min(DAY))
    }
}

async fn serve(tank: &mut Tank, mut from_hosts: mpsc::Receiver<FromHost>, pace: Pace) -> Result<(), UserError> {
    let mut orders = orders::listen();
    loop {
        let due = tank.poll_timeout().map(|at| pace.wall(at));
        let sleep = async {
            match due {
                Some(due) => tokio::time::sleep_until(due).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            () = sleep => {}
            Some(from) = from_hosts.recv() => {
                tank.handle_host(from, pace.now());
                while let Ok(from) = from_hosts.try_recv() {
                    tank.handle_host(from, pace.now());
                }
            }
            Some(order) = orders.recv() => match order {
                Order::Quit => return Ok(()),
                order => tank.handle_order(order, pace.now()),
            },
        }
        tank.advance(pace.now())?;
    }
}
