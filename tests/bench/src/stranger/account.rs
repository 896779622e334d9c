//! The kinds of attack, and how an end judges a frame.

use scenecast_protocol::link::{DropReason, LinkStats};
use serde::Serialize;
use std::collections::BTreeMap;

/// The kinds of frames that the stranger transmits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum AttackKind {
    /// Random bytes of any length.
    Noise,
    /// An overheard frame with a few bits changed.
    Flipped,
    /// An unchanged frame of the present runs.
    Replayed,
    /// An unchanged frame of an earlier run or dive.
    Earlier,
    /// An unchanged frame whose content no end has taken: the channel has lost it or is slower, or it was refused.
    Relayed,
    /// An overheard frame, cut or changed, with a good CRC.
    Malformed,
    /// A random tag below an overheard header.
    Tagged,
    /// A hello with a good CRC, of the present run or of an invented one.
    Hello,
    /// A discovery call with a good CRC.
    Call,
    /// An order with a good CRC.
    Order,
    /// Chunks of random bytes with a good CRC.
    Undecodable,
    /// A map chunk that decodes.
    Map,
    /// A pose or a report that decodes.
    Report,
    /// An acknowledgement statement or a base out of the ordinary.
    Acknowledgement,
}

impl AttackKind {
    pub const ALL: [Self; 14] = [
        Self::Noise,
        Self::Flipped,
        Self::Replayed,
        Self::Earlier,
        Self::Relayed,
        Self::Malformed,
        Self::Tagged,
        Self::Hello,
        Self::Call,
        Self::Order,
        Self::Undecodable,
        Self::Map,
        Self::Report,
        Self::Acknowledgement,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Flipped => "flipped",
            Self::Replayed => "replayed",
            Self::Earlier => "earlier",
            Self::Relayed => "relayed",
            Self::Malformed => "malformed",
            Self::Tagged => "tagged",
            Self::Hello => "hello",
            Self::Call => "call",
            Self::Order => "order",
            Self::Undecodable => "undecodable",
            Self::Map => "map",
            Self::Report => "report",
            Self::Acknowledgement => "acknowledgement",
        }
    }
}

/// The counters of an end that a frame can change.
#[derive(Debug, Default)]
pub(super) struct LinkCounters {
    received: u64,
    dropped: BTreeMap<DropReason, u64>,
}

impl LinkCounters {
    pub(super) fn of(stats: &LinkStats) -> Self {
        Self { received: stats.frames_received, dropped: stats.dropped.clone() }
    }
}

/// How an end has judged a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LinkJudgement {
    Accepted,
    Refused(DropReason),
}

impl LinkJudgement {
    /// The judgement of the frame between two readings of the counters.
    pub(super) fn between(before: &LinkCounters, after: &LinkCounters) -> Self {
        let counted = |reason| before.dropped.get(&reason).copied().unwrap_or_default();
        let reason =
            after.dropped.iter().find(|&(&reason, &count)| count != counted(reason)).map(|(&reason, _)| reason);
        match reason {
            // A frame may be accepted although one of its chunks is skipped.
            Some(reason) if after.received == before.received => Self::Refused(reason),
            _ => Self::Accepted,
        }
    }

    /// Whether the end has the content of the frame. A duplicate has brought it before.
    pub(super) fn is_kept(self) -> bool {
        matches!(self, Self::Accepted | Self::Refused(DropReason::Duplicate))
    }

    /// Whether the frame failed its CRC, its tag or its decoder. Other refused frames passed them, but come late, twice, or
    /// from a run that has ended.
    pub(super) fn is_invalid(self) -> bool {
        use DropReason::{
            Checksum, Keyed, Malformed, NotForUs, Truncated, Unauthenticated, Undecodable, UnknownSender, Version,
        };
        let Self::Refused(reason) = self else { return false };
        match reason {
            Truncated | Version | NotForUs | Checksum | Malformed | Undecodable | UnknownSender | Unauthenticated
            | Keyed => true,
            DropReason::OldSession | DropReason::Duplicate | DropReason::Late | DropReason::NoBase => false,
        }
    }

    pub fn name(self) -> String {
        match self {
            Self::Accepted => "accepted".to_owned(),
            Self::Refused(reason) => snake_case(&format!("{reason:?}")),
        }
    }
}

fn snake_case(name: &str) -> String {
    let mut text = String::new();
    for (at, letter) in name.char_indices() {
        if letter.is_uppercase() && at > 0 {
            text.push('_');
        }
        text.push(letter.to_ascii_lowercase());
    }
    text
}

/// The number of frames by their judgement.
pub(super) type Judged = BTreeMap<LinkJudgement, u64>;
