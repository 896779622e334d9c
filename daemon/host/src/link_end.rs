//! An end of the link as its modem needs it.

use scenecast_core::UsblLine;
use scenecast_protocol::link::{Cycle, SurfaceLink, Transmit, VehicleLink};
use scenecast_protocol::map::{StateReplica, StateSource};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_vehicle::Vehicle;

/// Either role, or a bare link of either: it takes and gives frames.
pub trait LinkEnd {
    /// Bits a second that it may put on air.
    fn budget_bps(&self) -> u32;

    /// Takes the bytes of a received frame.
    fn handle_frame(&mut self, bytes: &[u8], now: Instant);

    /// A transmission has left the modem, or never will.
    fn handle_transmit_outcome(&mut self, now: Instant);

    /// The modem asks for at most so many frames.
    fn handle_poll(&mut self, frames: u32);

    /// The modem repeated so many bits by itself.
    fn handle_repeated(&mut self, bits: u64, now: Instant);

    /// The modem's USBL head measured the position of another end.
    fn handle_range(&mut self, _end: Address, _line: &UsblLine, _now: Instant) {}

    /// The cycle that the modem is to begin next; only the surface begins cycles.
    fn poll_cycle(&mut self, _now: Instant) -> Option<Cycle> {
        None
    }

    /// The next frame to put on air.
    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit>;

    /// When [`Self::poll_transmit`] should be asked again.
    fn poll_timeout(&self, now: Instant) -> Option<Instant>;
}

/// Methods that every end has under the same names.
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

    fn poll_timeout(&self, _now: Instant) -> Option<Instant> {
        self.poll_timeout().map(|(at, _)| at)
    }
}

impl<S: StateSource> LinkEnd for VehicleLink<S> {
    forward!();

    fn poll_timeout(&self, _now: Instant) -> Option<Instant> {
        self.poll_timeout().map(|(at, _)| at)
    }
}

impl<R: StateReplica> LinkEnd for SurfaceLink<R> {
    forward!();

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

    fn handle_range(&mut self, end: Address, line: &UsblLine, now: Instant) {
        self.handle_range(end, line, now);
    }

    fn poll_cycle(&mut self, now: Instant) -> Option<Cycle> {
        self.poll_cycle(now)
    }

    fn poll_timeout(&self, now: Instant) -> Option<Instant> {
        self.poll_timeout(now).map(|(at, _)| at)
    }
}
