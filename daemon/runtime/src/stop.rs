//! Requests of a person or the system that the process end.

use scenecast_core::UserError;

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
