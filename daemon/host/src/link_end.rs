//! The interface of a link's end toward its modem.

use scenecast_core::UsblLine;
use scenecast_protocol::link::{Cycle, DropReason, LinkStats, SurfaceLink, Transmit, VehicleLink};
use scenecast_protocol::map::{StateReplica, StateSource};
use scenecast_protocol::schedule::Class;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_vehicle::Vehicle;
use std::collections::BTreeMap;

/// The frames that an end has received so far, and what they carried.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FrameCounts {
    /// Numbered frames that verified and were new.
    pub accepted: u64,
    /// Frames that were dropped, by reason.
    pub dropped: BTreeMap<DropReason, u64>,
    /// Bytes of accepted frames, by class; a vehicle does not count them.
    bytes: BTreeMap<Class, u64>,
}

impl FrameCounts {
    /// Frames that a surface can attribute to none of its vehicles.
    fn of_unknown(count: u64) -> Self {
        Self { dropped: BTreeMap::from([(DropReason::UnknownSender, count)]), ..Self::default() }
    }

    /// What the frame carries that was received between those counts and these: bytes by class, headers not included.
    pub(crate) fn contents_since(&self, before: &Self) -> BTreeMap<Class, u64> {
        let bytes = self.bytes.iter().filter(|(class, _)| **class != Class::Overhead);
        let before = |class| before.bytes.get(class).copied().unwrap_or_default();
        let grown = bytes.map(|(class, bytes)| (*class, bytes.saturating_sub(before(class))));
        grown.filter(|(_, bytes)| *bytes > 0).collect()
    }

    fn add(mut self, stats: &LinkStats) -> Self {
        self.accepted += stats.frames_received;
        stats.dropped.iter().for_each(|(&reason, count)| *self.dropped.entry(reason).or_default() += count);
        stats.received_by_class.iter().for_each(|(&class, bytes)| *self.bytes.entry(class).or_default() += bytes);
        self
    }
}

/// An end of the link: a role, or the bare link of a role.
pub trait LinkEnd {
    /// The budget: bits a second that this end may put on air.
    fn budget_bps(&self) -> u32;

    /// Takes the bytes of a received frame.
    fn handle_frame(&mut self, bytes: &[u8], now: Instant);

    /// The frames that were given to [`Self::handle_frame`] so far, by their result.
    fn frame_counts(&self) -> FrameCounts;

    /// The modem has sent a transmission, or dropped it.
    fn handle_transmit_outcome(&mut self, now: Instant);

    /// The modem requests at most this many frames.
    fn handle_poll(&mut self, frames: u32);

    /// The modem repeated this many bits by itself.
    fn handle_repeated(&mut self, bits: u64, now: Instant);

    /// The modem has restarted, what it held is lost, and it is ready again.
    fn handle_modem_restart(&mut self, _now: Instant) {}

    /// The modem's USBL head measured the position of another end.
    fn handle_range(&mut self, _end: Address, _line: &UsblLine, _now: Instant) {}

    /// The cycle that the modem is to begin next; only the surface begins cycles.
    fn poll_cycle(&mut self, _now: Instant) -> Option<Cycle> {
        None
    }

    /// The next frame to put on air.
    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit>;

    /// The time at which [`Self::poll_transmit`] should be called again.
    fn poll_timeout(&self, now: Instant) -> Option<Instant>;
}

/// Forwards the methods that every end has under the same name.
macro_rules! forward {
    () => {
        fn budget_bps(&self) -> u32 {
            self.budget_bps()
        }

        fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
            self.handle_frame(bytes, now);
        }

        fn handle_transmit_outcome(&mut self, now: Instant) {
            self.handle_transmit_outcome(now);
        }

        fn handle_poll(&mut self, frames: u32) {
            self.handle_poll(frames);
        }

        fn handle_repeated(&mut self, bits: u64, now: Instant) {
            self.handle_repeated(bits, now);
        }

        fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
            self.poll_transmit(now)
        }
    };
}

impl LinkEnd for Vehicle {
    forward!();

    fn frame_counts(&self) -> FrameCounts {
        FrameCounts::default().add(self.stats())
    }

    fn poll_timeout(&self, _now: Instant) -> Option<Instant> {
        self.poll_timeout().map(|(at, _)| at)
    }
}

impl<S: StateSource> LinkEnd for VehicleLink<S> {
    forward!();

    fn frame_counts(&self) -> FrameCounts {
        FrameCounts::default().add(self.stats())
    }

    fn poll_timeout(&self, _now: Instant) -> Option<Instant> {
        self.poll_timeout().map(|(at, _)| at)
    }
}

impl<R: StateReplica> LinkEnd for SurfaceLink<R> {
    forward!();

    fn frame_counts(&self) -> FrameCounts {
        let unknown = FrameCounts::of_unknown(self.unknown_senders());
        let views = self.vehicles().filter_map(|address| self.vehicle(address));
        views.fold(unknown, |counts, view| counts.add(view.stats()))
    }

    fn handle_modem_restart(&mut self, now: Instant) {
        self.handle_modem_restart(now);
    }

    fn poll_cycle(&mut self, now: Instant) -> Option<Cycle> {
        self.poll_cycle(now)
    }

    fn poll_timeout(&self, now: Instant) -> Option<Instant> {
        self.poll_timeout(now).map(|(at, _)| at)
    }
}

#[cfg(feature = "surface")]
impl LinkEnd for scenecast_surface::Surface {
    forward!();

    fn frame_counts(&self) -> FrameCounts {
        let unknown = FrameCounts::of_unknown(self.unknown_senders());
        let views = self.vehicles().filter_map(|(address, _)| self.view(address));
        views.fold(unknown, |counts, view| counts.add(view.stats()))
    }

    fn handle_range(&mut self, end: Address, line: &UsblLine, now: Instant) {
        self.handle_range(end, line, now);
    }

    fn handle_modem_restart(&mut self, now: Instant) {
        self.handle_modem_restart(now);
    }

    fn poll_cycle(&mut self, now: Instant) -> Option<Cycle> {
        self.poll_cycle(now)
    }

    fn poll_timeout(&self, now: Instant) -> Option<Instant> {
        self.poll_timeout(now).map(|(at, _)| at)
    }
}
