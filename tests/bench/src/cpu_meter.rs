//! CPU time of a thread, and the memory of the process.

use std::time::{Duration, Instant};

/// The system counts CPU time in steps of some milliseconds. A shorter time is that of the clock, which is never less.
const MIN_CPU_TIME: Duration = Duration::from_millis(20);

/// Measures the CPU time of the calling thread; where the system does not report it, the time of the clock.
pub(crate) struct CpuMeter {
    cpu: Option<Duration>,
    clock: Instant,
}

impl CpuMeter {
    pub(crate) fn start() -> Self {
        Self { cpu: thread_cpu(), clock: Instant::now() }
    }

    pub(crate) fn ms(&self) -> f64 {
        let elapsed = self.clock.elapsed();
        let cpu = thread_cpu().zip(self.cpu).map(|(now, start)| now.saturating_sub(start));
        1000.0 * cpu.filter(|_| elapsed > MIN_CPU_TIME).unwrap_or(elapsed).as_secs_f64()
    }
}

fn thread_cpu() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}

/// Bytes of memory that the process occupies.
pub(crate) fn resident_bytes() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.split_whitespace().next()?.parse::<u64>().ok().map(|kilobytes| 1024 * kilobytes)
}
