//! What this process has taken of the machine.

/// Seconds of CPU time of all threads so far, those that have ended too, and the most bytes that were resident at a time.
#[cfg(unix)]
fn usage() -> (f64, u64) {
    use nix::sys::resource::{UsageWho, getrusage};
    use nix::sys::time::TimeValLike;
    let Ok(usage) = getrusage(UsageWho::RUSAGE_SELF) else { return (0.0, 0) };
    let microseconds = usage.user_time().num_microseconds() + usage.system_time().num_microseconds();
    // Kilobytes, but for Apple's systems.
    let unit = if cfg!(target_vendor = "apple") { 1 } else { 1024 };
    (microseconds as f64 * 1e-6, usage.max_rss().max(0) as u64 * unit)
}

#[cfg(not(unix))]
fn usage() -> (f64, u64) {
    (0.0, 0)
}

/// Seconds of CPU time of all threads so far.
pub(super) fn cpu_seconds() -> f64 {
    usage().0
}

/// Most memory that was resident at a time, bytes.
pub(super) fn peak_rss_bytes() -> u64 {
    usage().1
}
