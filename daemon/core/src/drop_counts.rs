//! Counters of dropped frames, by the name of the reason.

use scenecast_protocol::link::{DropReason, LinkStats};
use std::collections::BTreeMap;

/// Received bytes that were dropped, by the name of the reason.
pub fn dropped(stats: &LinkStats) -> BTreeMap<&'static str, u64> {
    stats.dropped.iter().map(|(&reason, &n)| (reason_name(reason), n)).collect()
}

/// The name of a reason, in reports and records.
pub fn reason_name(reason: DropReason) -> &'static str {
    match reason {
        DropReason::Truncated => "truncated",
        DropReason::Version => "version",
        DropReason::NotForUs => "not_for_us",
        DropReason::Checksum => "checksum",
        DropReason::Malformed => "malformed",
        DropReason::Undecodable => "undecodable",
        DropReason::OldSession => "old_session",
        DropReason::Duplicate => "duplicate",
        DropReason::Late => "late",
        DropReason::NoBase => "base_missing",
        DropReason::UnknownSender => "unknown_sender",
        DropReason::Unauthenticated => "unauthenticated",
        DropReason::Keyed => "key_missing",
    }
}
