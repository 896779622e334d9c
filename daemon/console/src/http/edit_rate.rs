//! How fast a principal may edit names, notes, markers and drafts.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// Edits of a principal in a second in the long run, and at once.
const PER_SECOND: f64 = 10.0;
const AT_ONCE: f64 = 100.0;

/// A token bucket (RFC 2215) for each principal, shared by all requests. Principals are those of the token file.
#[derive(Debug, Clone, Default)]
pub(super) struct EditRate(Arc<Mutex<BTreeMap<String, Bucket>>>);

#[derive(Debug)]
struct Bucket {
    edits: f64,
    at: Instant,
}

impl EditRate {
    /// Takes one edit of a principal; whether there was one left.
    pub(super) fn take(&self, principal: &str, now: Instant) -> bool {
        let mut buckets = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let bucket = buckets.entry(principal.to_owned()).or_insert(Bucket { edits: AT_ONCE, at: now });
        let since_s = now.saturating_duration_since(bucket.at).as_secs_f64();
        *bucket = Bucket { edits: (bucket.edits + PER_SECOND * since_s).min(AT_ONCE), at: now };
        let is_left = bucket.edits >= 1.0;
        bucket.edits -= f64::from(u8::from(is_left));
        is_left
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn only_a_principal_that_edits_too_fast_waits() {
        let (rate, now) = (EditRate::default(), Instant::now());
        let taken = |at| (0..1000).filter(|_| rate.take("ann", at)).count();
        assert_eq!(taken(now), 100);
        assert!(rate.take("bob", now));
        assert_eq!(taken(now + Duration::from_secs(2)), 20);
        assert_eq!(taken(now + Duration::from_secs(3600)), 100);
    }
}
