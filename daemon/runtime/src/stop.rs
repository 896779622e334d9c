//! What the system asks of a process: to end, to read its configuration again (SIGHUP), to keep its files to its user.

use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::directive::Budget;
#[cfg(unix)]
use tokio::signal::unix::{Signal, SignalKind, signal};

/// Catches Ctrl-C and SIGTERM from its creation on, so that none is lost while the process does other work.
pub struct Stop {
    /// For a process that ends when its terminal is lost, too.
    #[cfg(unix)]
    hang_up: Option<Signal>,
    #[cfg(unix)]
    interrupt: Signal,
    #[cfg(unix)]
    terminate: Signal,
    #[cfg(not(unix))]
    interrupt: tokio::signal::windows::CtrlC,
}

impl Stop {
    #[cfg(unix)]
    pub fn new() -> Result<Self, UserError> {
        let error = |e| UserError::Failed(format!("the signals to end: {e}"));
        Ok(Self {
            hang_up: None,
            interrupt: signal(SignalKind::interrupt()).map_err(error)?,
            terminate: signal(SignalKind::terminate()).map_err(error)?,
        })
    }

    /// The same, and SIGHUP: for a process that belongs to its terminal.
    #[cfg(unix)]
    pub fn or_hang_up() -> Result<Self, UserError> {
        Ok(Self { hang_up: Some(hang_ups()?), ..Self::new()? })
    }

    #[cfg(not(unix))]
    pub fn or_hang_up() -> Result<Self, UserError> {
        Self::new()
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
            _ = hang_up(self.hang_up.as_mut()) => {}
        }
        #[cfg(not(unix))]
        let _ = self.interrupt.recv().await;
    }
}

#[cfg(unix)]
fn hang_ups() -> Result<Signal, UserError> {
    signal(SignalKind::hangup()).map_err(|e| UserError::Failed(format!("SIGHUP: {e}")))
}

#[cfg(unix)]
async fn hang_up(signals: Option<&mut Signal>) {
    if let Some(signals) = signals
        && signals.recv().await.is_some()
    {
        return;
    }
    std::future::pending().await
}

/// Holds SIGHUP back, which would end the process, until this thread has made a [`Reload`]. Threads begun until then never get it.
pub(super) fn hold_hang_up() {
    #[cfg(unix)]
    {
        // A valid set is always taken.
        let _ = nix::sys::signal::SigSet::from(nix::sys::signal::Signal::SIGHUP).thread_block();
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
    /// The fingerprints of the present and the next key in the key file, as they were at the start.
    keys: Option<(u32, Option<u32>)>,
    #[cfg(unix)]
    hang_ups: Signal,
}

impl Reload {
    #[cfg(unix)]
    pub(super) fn new(load: Load, config: &Config) -> Result<Self, UserError> {
        let hang_ups = hang_ups()?;
        let _ = nix::sys::signal::SigSet::from(nix::sys::signal::Signal::SIGHUP).thread_unblock();
        Ok(Self { load, keys: fingerprints(config).unwrap_or_default(), hang_ups })
    }

    #[cfg(not(unix))]
    pub(super) fn new(load: Load, config: &Config) -> Result<Self, UserError> {
        Ok(Self { load, keys: fingerprints(config).unwrap_or_default() })
    }

    /// Waits for a SIGHUP and returns the new configuration; a file that cannot be read is logged and ignored.
    pub(super) async fn next(&mut self) -> Config {
        loop {
            #[cfg(unix)]
            hang_up(Some(&mut self.hang_ups)).await;
            #[cfg(not(unix))]
            std::future::pending::<()>().await;
            match (self.load)() {
                Ok(config) => {
                    match fingerprints(&config) {
                        Ok(keys) if keys == self.keys => {}
                        Ok(_) => tracing::warn!(
                            "SIGHUP: link.key_file has other keys than at the start; a restart takes them"
                        ),
                        Err(error) => tracing::error!("SIGHUP: {error}; a restart would fail"),
                    }
                    return config;
                }
                Err(error) => tracing::error!("{error}; no setting is changed"),
            }
        }
    }
}

fn fingerprints(config: &Config) -> Result<Option<(u32, Option<u32>)>, UserError> {
    // A pipe gives its key once.
    let Some(path) = config.link.key_file.as_ref().filter(|path| path.is_file()) else { return Ok(None) };
    let (file, _) = scenecast_config::read_key(path)?;
    Ok(Some((file.key.fingerprint(), file.next.as_ref().map(|next| next.fingerprint()))))
}

/// Makes new files and folders readable for the user of this process only.
pub fn keep_private() {
    #[cfg(unix)]
    {
        use nix::sys::stat::{Mode, umask};
        umask(Mode::S_IRWXG | Mode::S_IRWXO);
    }
}
