//! A script against the surface's end.

use super::link::{FuzzEnd, Pile, Setup, Surface, run};
use super::peer::vehicle;
use scenecast_protocol::coordinates::WorldPoint;
use scenecast_protocol::directive::{Constraints, Fix, Slot, Utility};
use scenecast_protocol::link::{SurfaceEvent, Transmit};
use scenecast_protocol::map::StateReplica;
use scenecast_protocol::schedule::Shares;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;

/// No received bytes harm a surface. The first byte is the setup, the others are the script.
pub fn surface_link(data: &[u8]) {
    surface_events(data);
}

/// As [`surface_link`]; returns the number of events.
pub fn surface_events(data: &[u8]) -> usize {
    let Some((&choice, script)) = data.split_first() else { return 0 };
    let (setup, begin) = (Setup::new(choice), Instant::from_secs_f64(1000.0));
    let peer = setup.peer(vehicle(), Address::SURFACE);
    // A pile sends no content before it grows, so all that the surface receives of a map is from the script.
    let surface: Surface = setup.surface(begin);
    let mut partner = setup.vehicle(Pile::default(), begin);
    (1..3).for_each(|what| partner.act(what, 3, begin));
    run(setup, surface, partner, peer, script)
}

impl<R: StateReplica> FuzzEnd for Surface<R> {
    fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        self.handle_frame(bytes, now);
    }

    fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        self.poll_transmit(now)
    }

    fn handle_transmit_outcome(&mut self, now: Instant) {
        self.handle_transmit_outcome(now);
    }

    fn poll(&mut self, frames: u32, now: Instant) {
        if self.poll_cycle(now).is_some_and(|cycle| cycle.from == Address::SURFACE) {
            self.handle_poll(frames);
        }
    }

    fn wakeup(&self, now: Instant) -> Option<Instant> {
        self.poll_timeout(now).map(|(at, _)| at)
    }

    fn drain(&mut self, _: Instant) -> usize {
        // A mismatch may be reported for a frame that changes nothing.
        let events = std::iter::from_fn(|| self.poll_event());
        events.filter(|event| !matches!(event, SurfaceEvent::Mismatch(..))).count()
    }

    fn act(&mut self, what: u8, with: u8, now: Instant) {
        let weights = (1..=with % 8).map(|label| (label, with as i8 / 2)).collect();
        let slot = match what % 4 {
            0 => Slot::Utility(Utility { weights, ..Utility::default() }),
            1 => Slot::Constraints(Constraints { hold: with & 1 != 0, abort: with & 2 != 0 }),
            2 => Slot::Fix(Fix { position: WorldPoint::new(f64::from(with), 0.0), ..Fix::default() }),
            _ => return self.set_shares(Shares([with % 20; 5])),
        };
        let _ = self.issue(vehicle(), slot, now);
    }
}
