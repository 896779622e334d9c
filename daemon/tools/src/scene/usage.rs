//! The time and memory of the process.

/// Seconds of CPU time of all threads so far, ended ones included, and the peak of resident memory in bytes.
#[cfg(unix)]
fn usage() -> (f64, u64) {
    use nix::sys::resource::{UsageWho, getrusage};
    use nix::sys::time::TimeValLike;
    let Ok(usage) = getrusage(UsageWho::RUSAGE_SELF) else { return (0.0, 0) };
    let microseconds = usage.user_time().num_microseconds() + usage.system_time().num_microseconds();
    // The unit is a kilobyte, except on Apple's systems, where it is a byte.
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

/// Peak of resident memory, bytes.
pub(super) fn peak_rss_bytes() -> u64 {
    // On Linux the usage includes the peak of the process that started this one.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    peak_in(&status).unwrap_or_else(|| usage().1)
}

/// The peak in the text of `/proc/PID/status`.
fn peak_in(status: &str) -> Option<u64> {
    let kilobytes = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?.trim().strip_suffix(" kB")?;
    Some(kilobytes.parse::<u64>().ok()? * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_read_from_the_status_and_cpu_time_grows() {
        assert_eq!(peak_in("Name:\tx\nVmHWM:\t    1234 kB\nVmRSS:\t 9 kB\n"), Some(1234 * 1024));
        assert_eq!(peak_in("Name:\tx\n"), None);
        let before = cpu_seconds();
        let sum: u64 = (0..20_000_000u64).map(|i| i ^ (i >> 3)).sum();
        assert!(sum > 0 && cpu_seconds() >= before);
    }
}
