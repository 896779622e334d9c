//! SIGHUP: the configuration is read again.

use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::directive::Budget;
#[cfg(unix)]
use tokio::signal::unix::{Signal, SignalKind, signal};

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
