//! The orders that were given and applied, and the promise that nothing older replaces something newer.

use scenecast_protocol::directive::{Slot, SlotId};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// A hold or an abort this young is obeyed, even if a newer order of another surface has arrived before: it stops the vehicle, after the time
/// that taking it over may need.
const PROMPT: Duration = Duration::from_secs(70);

/// An order that the vehicle has applied.
#[derive(Debug, Clone)]
pub(super) struct Applied {
    pub(super) given: Instant,
    pub(super) slot: Slot,
}

#[derive(Debug, Default)]
pub(super) struct Orders {
    /// When the order of a kind with each version was last given, by surface.
    given: BTreeMap<(usize, SlotId, u16), Instant>,
    pub(super) applied: Vec<Applied>,
    /// Orders that were applied after a newer one of their kind: the newer one, and the older one.
    pub(super) regressions: Vec<[Applied; 2]>,
    /// Orders that were given, and that were applied.
    pub(super) counts: [usize; 2],
}

impl Orders {
    pub(super) fn given(&mut self, surface: usize, id: SlotId, version: u16, now: Instant) {
        self.given.insert((surface, id, version), now);
        self.counts[0] += 1;
    }

    pub(super) fn apply(&mut self, surface: usize, slot: Slot, version: u16, now: Instant) {
        let given = *self.given.get(&(surface, slot.id(), version)).expect("no order is applied that was not given");
        let order = Applied { given, slot };
        let of_kind = self.applied.iter().filter(|before| before.slot.id() == order.slot.id());
        if let Some(newer) = of_kind.filter(|before| before.given > given).max_by_key(|before| before.given) {
            let stops = matches!(order.slot, Slot::Constraints(c) if c.stops());
            if !stops || now.since(given) > PROMPT {
                self.regressions.push([newer.clone(), order.clone()]);
            }
        }
        self.applied.push(order);
        self.counts[1] += 1;
    }
}
