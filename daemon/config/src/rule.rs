//! The bounds of a key.

/// The bounds of a key; each type uses those that concern it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    /// The least and the greatest number.
    pub range: (f64, f64),
    /// Unit of the numbers; empty without one.
    pub unit: &'static str,
    /// Kinds of port, as in `serial:DEVICE:BAUD`.
    pub ports: &'static [&'static str],
}

/// No bounds besides those of the type.
pub(crate) const ANY: Rule = Rule { range: (f64::MIN, f64::MAX), unit: "", ports: &[] };

/// Numbers from `low` to `high`.
pub(crate) const fn range(low: f64, high: f64, unit: &'static str) -> Rule {
    Rule { range: (low, high), unit, ..ANY }
}

pub(crate) const fn ports(kinds: &'static [&'static str]) -> Rule {
    Rule { ports: kinds, ..ANY }
}
