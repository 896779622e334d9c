//! Whose turn it is: the surface grants it.

use super::SurfaceLink;
use super::turn::Ready;
use crate::link::{Transmit, Wakeup};
use crate::mac::{Access, ModemProfile};
use crate::map::StateReplica;
use crate::time::Instant;
use crate::wire::Address;

/// Probability that a turn of the surface may be lost with all its copies.
const RISK: f64 = 0.04;

impl<R: StateReplica> SurfaceLink<R> {
    /// The next frame of the surface, if it has one and the budget allows it.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        match self.config.modem.access {
            Access::Shared => self.poll_shared(now),
            Access::ModemOwned { pool_frames } => self.poll_pool(pool_frames, now),
            Access::Polled => self.poll_polled(now),
        }
    }

    /// When [`Self::poll_transmit`] next may have a frame by itself.
    pub fn poll_timeout(&self, now: Instant) -> Option<(Instant, Wakeup)> {
        let next = match self.config.modem.access {
            Access::ModemOwned { .. } => self.next_of_pool(),
            _ if !self.in_modem.is_empty() => None,
            Access::Polled if !self.turn.is_empty() => self.gives_up_at(),
            _ => self.next_turn(now),
        };
        next.map(|at| (at, Wakeup::Grant))
    }

    fn next_turn(&self, now: Instant) -> Option<Instant> {
        if let Some(until) = self.discovery.listens_until(now) {
            return Some(until);
        }
        let busy = self.current.and_then(|a| self.peers.get(&a)).filter(|p| p.master.is_engaged());
        if let Some(peer) = busy {
            return peer.master.next_wakeup(false);
        }
        let alone = self.peers.len() == 1;
        let due = |p: &super::peer::Peer<R>| {
            p.master.next_wakeup(p.outbox.has_backlog()).map(|at| if alone { at } else { at.max(p.master.retry_at()) })
        };
        self.peers.values().filter_map(due).chain(self.discovery.next_wakeup(now)).min()
    }

    fn poll_shared(&mut self, now: Instant) -> Option<Transmit> {
        if !self.in_modem.is_empty() || self.discovery.listens_until(now).is_some() {
            return None;
        }
        if self.turn.is_empty() && !self.begin_turn(now) {
            return None;
        }
        let ready = self.turn.pop_front()?;
        let last = self.turn.is_empty() && ready.transmit.to != Address::EVERYBODY;
        Some(self.send(ready, last, now))
    }

    /// Writes the next turn, to whom it is due; says whether there is one.
    pub(super) fn begin_turn(&mut self, now: Instant) -> bool {
        // A call goes first: vehicles that always have more to say would never let it come up.
        if self.call(now) {
            return true;
        }
        let Some(vehicle) = self.choose(now) else { return false };
        let active = self.peers.values().filter(|p| p.master.unanswered() < 3).count();
        let plentiful = self.budget.is_plentiful(now);
        let Some(peer) = self.peers.get_mut(&vehicle) else { return false };
        let modem = self.config.modem;
        let hello = says_hello(peer.master.unanswered()) || peer.pair.is_full();
        let copies = if plentiful { peer.pair.stats.loss_out.copies(RISK, 6) } else { 1 };
        let mut plan = peer.plan_turn(&modem, hello, copies, &self.shares, now);
        let affordable = self.budget.affordable(plan.iter().map(|slots| (peer.bits(slots, &modem), now)));
        if affordable == 0 {
            let bits = plan.first().map_or(0, |slots| peer.bits(slots, &modem));
            peer.master.postpone(self.budget.earliest(bits, now));
            return false;
        }
        plan.truncate(affordable);
        let grant = peer.master.grant(&modem, active);
        let turn = peer.write_turn(&plan, &modem, Some(grant), hello, now);
        peer.master.begin(grant, now);
        self.current = Some(vehicle);
        self.turn = turn.into();
        true
    }

    /// Calls for unknown vehicles, if it is time.
    fn call(&mut self, now: Instant) -> bool {
        let engaged = self.current.and_then(|a| self.peers.get(&a)).filter(|p| p.master.is_engaged());
        let taken = engaged.is_some_and(|p| !p.master.may_speak(false, now));
        if taken || !self.discovery.is_due(now) || self.peers.len() >= 14 {
            return false;
        }
        let modem: ModemProfile = self.config.modem;
        let authenticity = self.config.authenticity.clone();
        let bytes = super::discovery::Discovery::bytes(authenticity.is_some());
        let allowed = self.budget.earliest(modem.bits_on_air(bytes), now);
        if allowed > now {
            self.discovery.postpone(allowed);
            return false;
        }
        let transmit = self.discovery.write(self.config.mission, &modem, authenticity.as_ref(), &mut self.random, now);
        self.turn.push_back(Ready { transmit, number: None });
        true
    }

    /// The vehicle to speak with next: of those that are due, the one that waited longest.
    fn choose(&self, now: Instant) -> Option<Address> {
        let engaged = self.current.and_then(|a| self.peers.get(&a)).filter(|p| p.master.is_engaged());
        if engaged.is_some_and(|p| !p.master.may_speak(false, now)) {
            return None;
        }
        let alone = self.peers.len() == 1;
        self.peers
            .values()
            .filter(|p| p.master.may_speak(p.outbox.has_backlog(), now) && (alone || now >= p.master.retry_at()))
            .min_by_key(|p| (p.master.begun(), p.pair.peer()))
            .map(|p| p.pair.peer())
    }
}

/// A vehicle that does not answer may have restarted and not know us: every second grant is a hello, and after a while every
/// one, so that the numbers of unheard frames do not run out.
fn says_hello(unanswered: u32) -> bool {
    unanswered >= 2 && (unanswered.is_multiple_of(2) || unanswered >= 16)
}
