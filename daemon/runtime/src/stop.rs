//! What the system asks of a process: to end, to read its configuration again (SIGHUP), to keep its files to its user.

use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::directive::Budget;
#[cfg(unix)]
use tokio::signal::unix::{Signal, SignalKind, signal};

/// Catches Ctrl-C and SIGTERM from its creation on, so that none is lost while the process does other work.
pub struct Stop {
    #[cfg(unix)]
    interrupt: tokio::signal::unix::Signal,
    #[cfg(unix)]
    terminate: tokio::signal::unix::Signal,
    #[cfg(not(unix))]
    interrupt: tokio::signal::windows::CtrlC,
}

impl Stop {
    #[cfg(unix)]
    pub fn new() -> Result<Self, UserError> {
        use tokio::signal::unix::{SignalKind, signal};
        let error = |e| UserError::Failed(format!("the signals to end: {e}"));
        Ok(Self {
            interrupt: signal(SignalKind::interrupt()).map_err(error)?,
            terminate: signal(SignalKind::terminate()).map_err(error)?,
        })
    }

    #[cfg(not(unix))]
    pub fn new() -> Result<Self, UserError> {
        let interrupt = tokio::signal::windows::ctrl_c();
        Ok(Self { interrupt: interrupt.map_err(|e| UserError::Failed(format!("Ctrl-C: {e}")))? })
    }

    /// Returns when the process is to end. Cancel-safe.
    pub async fn asked(&mut self) {
        #[cfg(unix)]
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
        #[cfg(not(unix))]
        let _ = self.interrupt.recv().await;
    }
}

/// Reads a configuration, the same file and options each time.
pub type Load = Box<dyn Fn() -> Result<Config, UserError>>;

/// The budget, the shares and the background streams of a configuration: what a SIGHUP changes.
pub(super) fn configured_budget(config: &Config) -> Budget {
    let link = &config.link;
    Budget { bits_per_s: link.budget_bps, shares: link.shares, background: link.background }
}

/// Reads the configuration again after each SIGHUP.
pub(super) struct Reload {
    load: Load,
    #[cfg(unix)]
    hang_ups: Signal,
}

impl Reload {
    #[cfg(unix)]
    pub(super) fn new(load: Load) -> Result<Self, UserError> {
        let hang_ups = signal(SignalKind::hangup()).map_err(|e| UserError::Failed(format!("SIGHUP: {e}")))?;
        Ok(Self { load, hang_ups })
    }

    #[cfg(not(unix))]
    pub(super) fn new(load: Load) -> Result<Self, UserError> {
        Ok(Self { load })
    }

    /// Waits for a SIGHUP and returns the new configuration; a file that cannot be read is logged and ignored.
    pub(super) async fn next(&mut self) -> Config {
        loop {
            self.hang_up().await;
            match (self.load)() {
                Ok(config) => return config,
                Err(error) => tracing::error!("{error}; no setting is changed"),
            }
        }
    }

    async fn hang_up(&mut self) {
        #[cfg(unix)]
        if self.hang_ups.recv().await.is_some() {
            return;
        }
        std::future::pending().await
    }
}

/// Makes new files and folders readable for the user of this process only.
pub fn keep_private() {
    #[cfg(unix)]
    {
        use nix::sys::stat::{Mode, umask};
        umask(Mode::S_IRWXG | Mode::S_IRWXO);
    }
}
