//! What this process has taken of the machine.

use nix::sys::resource::{UsageWho, getrusage};
use nix::sys::time::TimeValLike;

/// Seconds of CPU time of all threads so far, those that have ended too.
pub(super) fn cpu_seconds() -> f64 {
    let spent = getrusage(UsageWho::RUSAGE_SELF);
    spent.map_or(0.0, |u| (u.user_time().num_microseconds() + u.system_time().num_microseconds()) as f64 * 1e-6)
}

/// Most memory that was resident at a time, bytes.
pub(crate) fn peak_rss_bytes() -> u64 {
    let kilobytes = getrusage(UsageWho::RUSAGE_SELF).map_or(0, |usage| usage.max_rss());
    kilobytes.max(0) as u64 * 1024
}
