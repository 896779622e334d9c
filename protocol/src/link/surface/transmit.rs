//! When the surface transmits, and to whom; also where a cycle of the modem is the grant, as with the cycle-init of a WHOI
//! Micromodem.

use super::fleet::Discovery;
use super::peer::{Ready, TurnPlan};
use super::{SurfaceEvent, SurfaceLink};
use crate::directive::SlotId;
use crate::link::handshake::FramePurpose;
use crate::link::{Transmit, Wakeup};
use crate::mac::{Access, ModemProfile};
use crate::map::StateReplica;
use crate::time::Instant;
use crate::wire::Address;
use std::time::Duration;

/// Probability that a turn of the surface may be lost with all its copies.
const TURN_LOSS_RISK: f64 = 0.04;

impl<R: StateReplica> SurfaceLink<R> {
    /// The next frame, if there is one and the budget allows it. The host calls this after every event and at
    /// [`Self::poll_timeout`] until it returns `None`.
    #[must_use]
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        self.events.extend(
            self.fleet.withdraw_late_orders(now).map(|vehicle| SurfaceEvent::SlotDecided(vehicle, SlotId::Constraints)),
        );
        match self.config.modem.access {
            Access::Shared => self.poll_shared(now),
            Access::Polled => self.poll_polled(now),
            access => self.poll_pool(access.pool_frames().unwrap_or(0), now),
        }
    }

    /// When [`Self::poll_transmit`] may next have a frame, unless the link waits for the modem.
    #[must_use]
    pub fn poll_timeout(&self, now: Instant) -> Option<(Instant, Wakeup)> {
        let next = match self.config.modem.access {
            access if access.is_free() => self.fleet.next_without_turn(),
            _ if !self.in_modem.is_empty() => None,
            Access::Polled if self.has_cycle() => self.cycle_gives_up_at(),
            _ => {
                self.discovery.listens_until(now).or_else(|| self.fleet.next_turn(self.discovery.next_wakeup(now), now))
            }
        };
        next.map(|at| (at, Wakeup::Grant))
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

    /// Writes the next turn for the vehicle that is due; returns whether there is one.
    fn begin_turn(&mut self, now: Instant) -> bool {
        // A discovery call goes first: vehicles that always have a backlog would never leave time for it.
        if self.begin_call(now) {
            return true;
        }
        let Some(planned) = self.plan_turn(now) else { return false };
        self.write_turn(&planned, now);
        true
    }

    /// Plans the next turn for the vehicle that is due, which begins with it.
    fn plan_turn(&mut self, now: Instant) -> Option<PlannedTurn> {
        let vehicle = self.fleet.choose(now)?;
        let active = self.fleet.active();
        let is_plentiful = self.budget.is_plentiful(now);
        let (peer, modem) = (self.fleet.get_mut(vehicle)?, self.config.modem);
        let purpose = peer.turn_purpose();
        let copies = if is_plentiful { peer.stats().outgoing.loss.copies(TURN_LOSS_RISK, 6) } else { 1 };
        let mut plan = peer.plan_turn(&modem, purpose, copies, &self.shares, now);
        let affordable = self.budget.affordable(plan.iter().map(|slots| (peer.bits(slots, &modem, purpose), now)));
        if affordable == 0 {
            let bits = plan.first().map_or(0, |slots| peer.bits(slots, &modem, purpose));
            peer.master.postpone(self.budget.earliest(bits, now));
            return None;
        }
        plan.truncate(affordable);
        let grant = peer.master.grant(&modem, active);
        peer.master.begin(grant, now);
        self.fleet.set_current(vehicle);
        Some(PlannedTurn { vehicle, plan, purpose, grant })
    }

    fn write_turn(&mut self, planned: &PlannedTurn, now: Instant) {
        let PlannedTurn { vehicle, plan, purpose, grant } = planned;
        if let Some(peer) = self.fleet.get_mut(*vehicle) {
            self.turn = peer.write_turn(plan, &self.config.modem, Some(*grant), *purpose, now).into();
        }
    }

    /// Queues a discovery call if one is due.
    fn begin_call(&mut self, now: Instant) -> bool {
        if self.fleet.is_medium_taken(now) || !self.discovery.is_due(now) || !self.fleet.has_room() {
            return false;
        }
        let modem: ModemProfile = self.config.modem;
        let authenticity = self.config.authenticity.as_ref();
        let bytes = Discovery::bytes(authenticity.is_some());
        let allowed = self.budget.earliest(modem.bits_on_air(bytes), now);
        if allowed > now {
            self.discovery.postpone(allowed);
            return false;
        }
        let transmit = self.discovery.write(self.config.mission, &modem, authenticity, now);
        self.turn.push_back(Ready { transmit, number: None });
        true
    }

    /// The next frame for a modem that does half duplex by itself: one goes out whenever there is a reason
    /// and its pool has room.
    fn poll_pool(&mut self, pool_frames: u32, now: Instant) -> Option<Transmit> {
        if self.in_modem.len() >= pool_frames as usize {
            return None;
        }
        let vehicle = self.fleet.choose_without_turn(now)?;
        let peer = self.fleet.get_mut(vehicle)?;
        let ready = peer.write_without_turn(&self.config.modem, &self.shares, &self.budget, now)?;
        Some(self.send(ready, false, now))
    }
}

/// A turn that is not yet written.
#[derive(Debug)]
struct PlannedTurn {
    vehicle: Address,
    /// The slots of each frame.
    plan: TurnPlan,
    purpose: FramePurpose,
    /// The turn byte.
    grant: u8,
}

/// The modem must request the frames of our cycle within this time.
const GIVE_UP: Duration = Duration::from_secs(30);

/// A cycle that the modem is to begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// The end that sends in this cycle.
    pub from: Address,
    /// The end that receives in this cycle.
    pub to: Address,
    /// The most frames that the modem should request.
    pub frames: u32,
}

/// The progress between the surface's own cycle and the vehicle's.
#[derive(Debug, Default)]
pub(super) struct Cycles {
    /// A cycle that the host must still begin.
    wanted: Option<Cycle>,
    /// Frames that the modem has requested and not received yet.
    polled: u32,
    /// The turn of our cycle, which is written when the modem requests its frames: one with a number that never goes out would
    /// count as lost.
    planned: Option<PlannedTurn>,
    /// The vehicle whose cycle follows ours.
    answer_of: Option<Address>,
    /// When our last cycle was due to begin.
    began: Instant,
}

impl Cycles {
    pub(super) fn handle_turn_sent(&mut self) {
        if let Some(from) = self.answer_of.take() {
            self.wanted = Some(Cycle { from, to: Address::SURFACE, frames: u32::from(u8::MAX) });
        }
    }
}

impl<R: StateReplica> SurfaceLink<R> {
    /// The cycle to begin next, if it is time for one ([`crate::mac::Access::Polled`]).
    #[must_use]
    pub fn poll_cycle(&mut self, now: Instant) -> Option<Cycle> {
        if self.config.modem.access != Access::Polled {
            return None;
        }
        if let Some(cycle) = self.cycle.wanted.take() {
            return Some(cycle);
        }
        if self.has_cycle() && self.in_modem.is_empty() && now.since(self.cycle.began) >= GIVE_UP {
            self.give_up_cycle(now);
        }
        if !self.in_modem.is_empty() || self.has_cycle() {
            return None;
        }
        let (to, frames) = if self.begin_call(now) {
            (Address::EVERYBODY, self.turn.len())
        } else {
            let planned = self.plan_turn(now)?;
            let of = (planned.vehicle, planned.plan.len());
            self.cycle.planned = Some(planned);
            of
        };
        self.cycle.began = now;
        self.cycle.answer_of = to.is_vehicle().then_some(to);
        Some(Cycle { from: Address::SURFACE, to, frames: frames as u32 })
    }

    /// Whether the modem has yet to request frames of a cycle of ours.
    fn has_cycle(&self) -> bool {
        !self.turn.is_empty() || self.cycle.planned.is_some()
    }

    /// Gives up a cycle of which the modem has requested no frame.
    fn give_up_cycle(&mut self, now: Instant) {
        self.turn.clear();
        (self.cycle.planned, self.cycle.polled, self.cycle.answer_of) = (None, 0, None);
        if let Some(peer) = self.fleet.current_mut() {
            peer.master.postpone(now);
        }
    }

    /// When a cycle is given up that the modem has not begun.
    pub(super) fn cycle_gives_up_at(&self) -> Option<Instant> {
        self.has_cycle().then(|| self.cycle.began + GIVE_UP)
    }

    /// The modem has restarted and is ready again: what it held is lost. A modem that is polled begins its cycles again itself.
    pub fn handle_modem_restart(&mut self, now: Instant) {
        if self.config.modem.access != Access::Polled
            && let Some(peer) = self.fleet.current_mut()
        {
            peer.master.handle_modem_restart(&self.config.modem, now);
        }
    }

    /// The modem requests `frames` frames of the surface's own cycle.
    pub fn handle_poll(&mut self, frames: u32) {
        self.cycle.polled = frames;
    }

    pub(super) fn poll_polled(&mut self, now: Instant) -> Option<Transmit> {
        self.cycle.polled = self.cycle.polled.checked_sub(1)?;
        if let Some(mut planned) = self.cycle.planned.take() {
            let peer = self.fleet.get_mut(planned.vehicle)?;
            // Frames may have come in since it was planned.
            planned.purpose = peer.possible(planned.purpose);
            // What does not fit into the cycle is in the next one, as it is current by then.
            planned.plan.truncate(self.cycle.polled as usize + 1);
            let bits = |slots| (peer.bits(slots, &self.config.modem, planned.purpose), now);
            let affordable = self.budget.affordable(planned.plan.iter().map(|slots| bits(slots)));
            planned.plan.truncate(affordable);
            self.write_turn(&planned, now);
        }
        let ready = self.turn.pop_front()?;
        let last = self.turn.is_empty();
        if last {
            self.cycle.polled = 0;
        }
        Some(self.send(ready, last, now))
    }
}
