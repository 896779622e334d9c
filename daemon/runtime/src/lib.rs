//! The tokio shells around the hosts: they move bytes, read the clock and write files.

mod camera;
mod checkpoint;
mod clock;
mod doctor;
#[cfg(feature = "surface")]
mod dry_runs;
mod durable;
mod equipment;
#[cfg(feature = "surface")]
mod instruments;
mod journal;
mod labels;
#[cfg(feature = "surface")]
mod map_files;
mod mapping;
mod modem;
mod pilot;
mod port;
#[cfg(all(test, feature = "surface"))]
mod power_cut_tests;
pub mod record;
#[cfg(all(test, feature = "surface"))]
mod refusing_disk_tests;
mod restore;
mod ros2;
mod stop;
#[cfg(feature = "surface")]
mod store;
#[cfg(feature = "surface")]
mod surface_process;
mod vehicle_process;

#[cfg(feature = "surface")]
pub use crate::dry_runs::DryRuns;
#[cfg(feature = "surface")]
pub use crate::surface_process::{host_name, run_surface};
pub use crate::vehicle_process::run_vehicle;
pub use clock::Clock;
pub use doctor::check_modem;
pub use pilot::SimulatedAutopilot;
pub use stop::{Load, Stop, keep_private};

use scenecast_core::UserError;
use std::pin::Pin;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Maximum wait for other threads at the end.
const SHUTDOWN_TIMEOUT: std::time::Duration = std::time::Duration::from_secs(1);

/// Random bits of the operating system, from which session numbers and nonces are drawn.
///
/// # Panics
///
/// The system has no random numbers: without them an old run could be replayed.
#[must_use]
pub fn random_bits() -> u64 {
    let mut bits = [0; 8];
    getrandom::fill(&mut bits).expect("the operating system gives random numbers");
    u64::from_le_bytes(bits)
}

/// The log without `RUST_LOG`. RustDDS and Zenoh report each socket and each match of theirs, and `ros2-client` as an error that an
/// endpoint has no peer.
const LOG_LEVELS: &str = "info,ros2_client=off,rustdds=error,zenoh=warn";

/// Runs a future to its end, with log lines on the standard error output as `RUST_LOG` asks.
pub fn block_on<T>(future: impl Future<Output = Result<T, UserError>>) -> Result<T, UserError> {
    let filter = tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| LOG_LEVELS.into());
    // A second command in the same process (as in tests) keeps the first one's log.
    // A log on a full disk must not end the process: a failed write would be reported on the same stream, and panic.
    let log = tracing_subscriber::fmt::layer().with_writer(std::io::stderr).log_internal_errors(false);
    let _ = tracing_subscriber::registry().with(filter).with(log).with(record::LogLines).try_init();
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime.map_err(UserError::failed)?;
    // Of a boxed future the runtime has one copy of the code, of another one several.
    let future: Pin<Box<dyn Future<Output = _>>> = Box::pin(future);
    let result = runtime.block_on(future);
    // A pending name lookup would delay the end for the whole timeout of the resolver.
    runtime.shutdown_timeout(SHUTDOWN_TIMEOUT);
    result
}

#[cfg(test)]
mod fuzz_corpus_tests;
#[cfg(test)]
mod kept_label_tests;
