//! The part of the vehicle's state that its host stores, with the keys that the surface has given.

use crate::{LabelChanges, LastPlace};
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{Areas, Budget, Limits, Series, Utility};
use scenecast_protocol::link::{Authenticity, SlotInboxState, VehicleConfig};
use scenecast_protocol::schedule::{BackgroundOrder, Shares};
use scenecast_protocol::seal::{HeldKey, VehicleKey};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// The state that survives a restart of the vehicle, so that no order is applied twice and no label changes its meaning.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Durable {
    pub inbox: SlotInboxState,
    /// Epoch of the labels in use.
    pub epoch: u8,
    /// The highest label of the epoch that may have been sent.
    pub labels: u8,
    /// Random number of the mission, which its checkpoints carry too.
    pub lineage: u64,
    pub utility: KeptUtility,
    /// Whether the operator has ordered the vehicle to hold.
    pub hold: bool,
    /// Whether the operator has ordered the vehicle to abort.
    pub abort: bool,
    pub budget: KeptBudget,
    /// Settings in force as on the wire. Empty: all as configured.
    pub settings: Vec<u8>,
    pub limits: KeptLimits,
    /// Fence in force as on the wire. Empty: none.
    pub fence: Vec<u8>,
    /// Position at the last fix that was used.
    pub place: Option<LastPlace>,
    /// The orders that this state knows nothing of, because an earlier state was lost.
    pub lost: LostOrders,
    pub goals: KeptGoals,
    /// The keys that the surface has given.
    pub keys: KeptKeys,
}

impl Durable {
    /// Claims the labels of a map; returns whether it has others than were claimed so far.
    pub(super) fn claim(&mut self, map: &LabelChanges) -> bool {
        let is_more = map.epoch != self.epoch || map.highest > self.labels;
        if is_more {
            (self.epoch, self.labels) = (map.epoch, map.highest);
        }
        is_more
    }
}

// The fields of these parts follow each other in the stored bytes as if they stood in `Durable` itself.

/// The utility that the vehicle plans by.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct KeptUtility {
    /// Epoch, exploration, curiosity, weights; in hundredths.
    pub order: Option<(u8, i8, i8, BTreeMap<u8, i8>)>,
    /// The highest label when it was applied.
    pub weighed: u8,
}

impl KeptUtility {
    pub(super) fn keep(&mut self, utility: &Utility, labels: u8) {
        let Utility { epoch, exploration, curiosity, weights } = utility.clone();
        *self = Self { order: Some((epoch, exploration, curiosity, weights)), weighed: labels };
    }

    pub(super) fn order(&self) -> Option<Utility> {
        let (epoch, exploration, curiosity, weights) = self.order.clone()?;
        Some(Utility { epoch, exploration, curiosity, weights })
    }
}

/// The budget of the link in force, where it differs from the configuration.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct KeptBudget {
    /// Bits on air a second, over the budget's window.
    pub bits_per_s: Option<u32>,
    /// Least shares of the classes in percent.
    pub shares: Option<[u8; 5]>,
    /// Order of the background streams as on the wire.
    pub background: Option<Vec<u8>>,
}

impl KeptBudget {
    pub(super) fn keep(&mut self, budget: &Budget) {
        self.bits_per_s = Some(budget.bits_per_s);
        self.shares = Some(budget.shares.0);
        self.background = Some(budget.background.to_bytes());
    }

    /// Puts rate and shares in the place of the configured ones.
    pub(crate) fn configure(&self, link: &mut VehicleConfig) {
        link.budget_bps = self.bits_per_s.unwrap_or(link.budget_bps);
        link.shares = self.shares.map_or(link.shares, Shares);
    }

    pub(crate) fn background(&self) -> Option<BackgroundOrder> {
        self.background.as_deref().and_then(BackgroundOrder::from_bytes)
    }
}

/// The limits in force, and their use.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct KeptLimits {
    /// The limits as on the wire. Empty: none.
    pub order: Vec<u8>,
    /// Metres and seconds of the limits that are used up, at most 50 m and 60 s behind the truth.
    pub used: (u32, u32),
    /// The breach that the operator has not answered yet: the reason's number on the wire, or 0.
    pub breach: u8,
}

impl KeptLimits {
    /// Keeps limits that begin to count now.
    pub(super) fn keep(&mut self, limits: &Limits) {
        (self.order, self.used) = (limits.to_bytes(), (0, 0));
    }

    pub(super) fn order(&self) -> Option<Limits> {
        Limits::from_bytes(&self.order)
    }

    /// Metres and seconds that are used up.
    pub(super) fn used(&self) -> (f64, f64) {
        (f64::from(self.used.0), f64::from(self.used.1))
    }
}

/// The places of the map that the operator has chosen.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct KeptGoals {
    /// Destination in force in the world frame: decimetres east and north.
    pub destination: Option<(i32, i32)>,
    /// Weighted areas in force as on the wire. Empty: none.
    pub areas: Vec<u8>,
}

impl KeptGoals {
    /// The destination in force, in the world frame.
    pub(super) fn destination(&self) -> Option<DecimetrePoint> {
        self.destination.map(|(east_dm, north_dm)| DecimetrePoint::new(east_dm, north_dm))
    }

    pub(super) fn keep_destination(&mut self, place: Option<DecimetrePoint>) {
        self.destination = place.map(|place| (place.east_dm, place.north_dm));
    }

    /// The weighted areas in force; `None` if there are none.
    pub(super) fn areas(&self) -> Option<Areas> {
        Areas::from_bytes(&self.areas).filter(|areas| areas.check().is_ok())
    }

    pub(super) fn keep_areas(&mut self, areas: &Areas) {
        self.areas = if areas.0.is_empty() { Vec::new() } else { areas.to_bytes() };
    }
}

/// The series of orders of which the vehicle no longer knows which versions it has applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LostOrders {
    /// No series: every decision is known.
    #[default]
    None,
    /// The series in which the surface speaks, which is not known yet.
    Present,
    Of(Series),
}

impl LostOrders {
    /// Whether an order of `series` may have been applied before. The first series that is received counts as the one
    /// in which orders were lost; another one ends the loss.
    pub(super) fn may_contain(&mut self, series: Option<Series>) -> bool {
        match (*self, series) {
            (Self::None, _) => false,
            (Self::Present, Some(series)) => {
                *self = Self::Of(series);
                true
            }
            (Self::Of(lost), Some(series)) if lost != series => {
                *self = Self::None;
                false
            }
            _ => true,
        }
    }
}

/// The keys that the surface has given the vehicle, each the text of a key file. Another key file ends them.
#[derive(Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct KeptKeys {
    /// The fingerprint of the key file under which they were given.
    file: u32,
    /// The present one, if it is not that of the key file.
    present: Option<String>,
    /// The next one, until the surface has proven that it uses it.
    next: Option<String>,
}

impl KeptKeys {
    /// What the vehicle authenticates by, from what its key file says.
    pub(crate) fn begin(&mut self, of_file: Authenticity) -> Authenticity {
        let file = of_file.key.fingerprint();
        if self.file != file {
            if self.present.is_some() || self.next.is_some() {
                tracing::info!("link.key_file is another one: the key that the surface has given is forgotten");
            }
            *self = Self { file, ..Self::default() };
        }
        let present = parse(self.present.as_ref()).map(|key| Arc::new(HeldKey::Vehicle(key)));
        let next = self.next().map(|key| Arc::new(HeldKey::Vehicle(key)));
        Authenticity { key: present.unwrap_or(of_file.key), next, ..of_file }
    }

    pub(super) fn next(&self) -> Option<VehicleKey> {
        parse(self.next.as_ref())
    }

    pub(super) fn keep(&mut self, next: &VehicleKey) {
        self.next = Some(next.to_text().to_string());
    }

    /// The next key is the present one from now on.
    pub(super) fn change(&mut self) {
        self.present = self.next.take().or(self.present.take());
    }
}

impl fmt::Debug for KeptKeys {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let fingerprint = |text: &Option<String>| parse(text.as_ref()).map(|key| format!("{:08x}", key.mission));
        write!(f, "KeptKeys({:08x}, {:?}, {:?})", self.file, fingerprint(&self.present), fingerprint(&self.next))
    }
}

fn parse(text: Option<&String>) -> Option<VehicleKey> {
    match HeldKey::parse(text?) {
        Ok(HeldKey::Vehicle(key)) => Some(key),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::seal::MissionKey;

    fn key(byte: u8) -> VehicleKey {
        VehicleKey::derive(&MissionKey::from_bytes([byte; 16]), 1)
    }

    fn of_file(byte: u8) -> Authenticity {
        Authenticity::new(HeldKey::Vehicle(key(byte)), true, false)
    }

    #[test]
    fn a_given_key_counts_until_the_key_file_changes() {
        let mut kept = KeptKeys::default();
        assert_eq!(kept.begin(of_file(1)).key.fingerprint(), key(1).mission);
        kept.keep(&key(2));
        let both = kept.begin(of_file(1));
        assert_eq!(both.key.fingerprint(), key(1).mission);
        assert_eq!(both.next.map(|next| next.fingerprint()), Some(key(2).mission));
        kept.change();
        let one = kept.begin(of_file(1));
        assert_eq!(one.key.fingerprint(), key(2).mission);
        assert!(one.next.is_none());
        let other = kept.begin(of_file(3));
        assert_eq!(other.key.fingerprint(), key(3).mission);
        assert_eq!(kept, KeptKeys { file: key(3).mission, ..KeptKeys::default() });
    }

    #[test]
    fn debug_output_reveals_no_key() {
        let mut kept = KeptKeys::default();
        kept.keep(&key(2));
        let said = format!("{kept:?}");
        assert_eq!(said, format!("KeptKeys(00000000, None, Some(\"{:08x}\"))", key(2).mission));
    }
}
