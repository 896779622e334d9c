//! Old names of keys.

use toml::Value;

/// A key that has another name now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct OldKey {
    pub old: &'static str,
    pub new: &'static str,
}

const fn renamed(old: &'static str, new: &'static str) -> OldKey {
    OldKey { old, new }
}

/// Every renamed key. A name is never used again with another meaning.
pub(crate) const OLD_KEYS: [OldKey; 9] = [
    renamed("link.spend", "link.background"),
    renamed("link.call_every_s", "link.discovery_period_s"),
    renamed("map.settle_s", "map.debounce_s"),
    renamed("map.planes", "map.layers"),
    renamed("map.plane_shares", "map.layer_shares"),
    renamed("autopilot.silence_s", "autopilot.timeout_s"),
    renamed("position.usbl_turn_deg", "position.usbl_rotation_deg"),
    renamed("position.most_sigma_m", "position.max_sigma_m"),
    renamed("labels.band_share", "bands.share"),
];

impl OldKey {
    /// The renamed key with this old name.
    pub fn find(name: &str) -> Option<Self> {
        OLD_KEYS.into_iter().find(|key| key.old == name)
    }
}

/// Keys that once took a list of numbers, with the member of each position.
const OLD_LISTS: [(&str, &[&str]); 2] = [
    ("link.shares", &["directive", "status", "fix", "map", "exemplar"]),
    ("map.layer_shares", &["confidence", "depth", "curiosity"]),
];

/// The inline table of a list of numbers by position, the old form of the key of this name.
///
/// `None` if the key has no old form, or if it is no list of as many whole numbers.
pub(crate) fn as_table(list: &[Value], key: &str) -> Option<String> {
    let (_, members) = OLD_LISTS.into_iter().find(|(name, _)| *name == key)?;
    let numbers: Vec<i64> = list.iter().map(Value::as_integer).collect::<Option<_>>()?;
    let pairs: Vec<String> = members.iter().zip(&numbers).map(|(name, number)| format!("{name} = {number}")).collect();
    (numbers.len() == members.len()).then(|| format!("{{ {} }}", pairs.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Key;

    #[test]
    fn an_old_name_is_no_key_and_its_new_one_is() {
        for OldKey { old, new } in OLD_KEYS {
            assert!(Key::find(old).is_none() && Key::find(new).is_some(), "{old}");
        }
    }
}
