//! A stranger who hears every frame and transmits at both ends: noise, replays and forgeries, with and without a key.

mod account;
mod campaign;
mod command;
mod ends;
mod forger;
mod orders;
mod state;
#[path = "../../../../protocol/tests/protocol/pair/wiretap.rs"]
mod wiretap;

pub use account::AttackKind;
pub use campaign::{KindFigures, StrangerFigures, measure_stranger};
pub(crate) use command::StrangerBench;

use crate::link_ends::EndsSetup;
use scenecast_protocol::mac::Access;
use serde::Serialize;

/// The key and the scope of authentication of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Protection {
    /// No key: every frame with a CRC is accepted.
    None,
    /// `authenticate = "down"`: the vehicle's numbered frames have no tag.
    Down,
    /// A key with `authenticate = "all"`.
    All,
}

impl Protection {
    pub const EVERY: [Self; 3] = [Self::None, Self::Down, Self::All];

    pub fn name(self) -> &'static str {
        match self {
            Self::None => "no key",
            Self::Down => "key, authenticate = \"down\"",
            Self::All => "key, authenticate = \"all\"",
        }
    }

    fn setup(self, access: Access) -> EndsSetup {
        let setup = EndsSetup::new(access);
        if self == Self::None { setup } else { setup.keyed(self == Self::All, false) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stranger_breaks_no_promise_with_and_without_a_key() {
        let times = if std::env::var_os("SCENECAST_FULL").is_some() { 5 } else { 1 };
        for protection in Protection::EVERY {
            // The share of refused frames has a bound where every frame has a tag: it takes more frames than the others.
            let frames = if protection == Protection::All { 16_000 } else { 4000 };
            let found = measure_stranger(protection, frames * times, 1, &mut |_| ());
            assert_eq!(found.broken_promises(), Vec::<String>::new(), "{found:#?}");
            assert!(found.bursts as u64 >= 8 * times && found.kinds.len() == AttackKind::ALL.len(), "{found:#?}");
            assert!(found.orders_applied > 2 * times && found.authentic_frames > 200 * times, "{found:#?}");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_attack() {
        let run = |seed| measure_stranger(Protection::None, 300, seed, &mut |_| ());
        assert_eq!(run(4), run(4));
        assert_ne!(run(4), run(5));
    }
}
