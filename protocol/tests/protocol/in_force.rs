//! The surface knows which content is in force at the vehicle, whatever either end has forgotten.

use crate::pair::{CALM, LinkedEnds, LossyChannel, Setup, auv, hold, patchy, utility};
use proptest::prelude::*;
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::{
    Budget, Change, Fence, Limits, OrderStatus, Polygon, REPORTED_SLOTS, Settings, ShortDecimal, Slot, SlotId, Utility,
};
use scenecast_protocol::link::{InForce, SurfaceEvent};
use scenecast_protocol::mac::Access;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::{BackgroundOrder, Class, Shares};
use std::time::Duration;

const CHANNEL: LossyChannel = LossyChannel { loss: 0.1, propagation: Duration::from_millis(300), ..CALM };

fn fence(edge: i32) -> Slot {
    let corners = [(-edge, -edge), (edge, -edge), (edge, edge), (-edge, edge)];
    let square = Polygon(corners.map(|(x, y)| DecimetrePoint::new(x, y)).into());
    Slot::Fence(Fence { fence: Some(square), ..Fence::default() })
}

/// One of the orders that a surface gives; some lift what is in force.
fn order(pick: u8) -> Slot {
    let figure = Change::To(ShortDecimal::new(0.01 * (f64::from(pick) + 1.0)).unwrap());
    match pick % 9 {
        0 => utility(pick as i8 % 100),
        1 => Slot::Limits(Limits { time_s: Some(1 + u32::from(pick)), ..Limits::default() }),
        2 => fence(100 + i32::from(pick)),
        3 => Slot::Settings(Settings { alpha: figure, ..Settings::default() }),
        4 => Slot::Settings(Settings { beta: figure, alpha: Change::Configured, ..Settings::default() }),
        5 => Slot::Fence(Fence::default()),
        6 => Slot::Limits(Limits::default()),
        7 => hold(pick.is_multiple_of(2)),
        _ => Slot::Budget(Budget {
            bits_per_s: 1000,
            shares: Shares([pick % 20, 10, 10, 20, 0]),
            background: BackgroundOrder::default(),
        }),
    }
}

fn shown(pair: &LinkedEnds, id: SlotId) -> InForce<'_> {
    pair.surface.vehicle(auv()).unwrap().in_force(id)
}

fn is_known(pair: &LinkedEnds) -> bool {
    REPORTED_SLOTS.into_iter().all(|id| match (pair.vehicle.in_force(id), shown(pair, id)) {
        (Some(content), InForce::Known(known)) => known == content,
        (None, InForce::None) => true,
        _ => false,
    })
}

/// Whether each content that the surface shows as known is in force.
fn is_true(pair: &LinkedEnds) -> bool {
    REPORTED_SLOTS.into_iter().all(|id| match (pair.vehicle.in_force(id), shown(pair, id)) {
        (content, InForce::Known(known)) => content == Some(known),
        (content, InForce::None) => content.is_none(),
        _ => true,
    })
}

/// What the surface shows and what is in force, for each slot.
fn held(pair: &LinkedEnds) -> Vec<String> {
    REPORTED_SLOTS.map(|id| format!("{:?}, {:?}", shown(pair, id), pair.vehicle.in_force(id))).into()
}

/// Whether the surface shows no content for a slot only if none is in force, or an order of it is not decided yet.
fn assert_none_is_true(pair: &LinkedEnds) {
    let view = pair.surface.vehicle(auv()).unwrap();
    for id in REPORTED_SLOTS.into_iter().filter(|&id| view.in_force(id) == InForce::None) {
        let waits = OrderStatus::is_pending;
        let is_ordered = view.slots().any(|s| s.id == id && waits(s.status));
        assert!(pair.vehicle.in_force(id).is_none() || is_ordered, "{id:?}: {:?}", pair.vehicle.in_force(id));
    }
}

fn run(pair: &mut LinkedEnds, seconds: u64) {
    for _ in 0..seconds * 2 {
        pair.run(pair.now + Duration::from_millis(500), false);
        assert_none_is_true(pair);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(crate::cases(40) as u32))]

    #[test]
    fn all_that_is_in_force_is_known_after_quiet(
        seed: u64,
        (loss, duplication, reordering, corruption) in (0.0..0.8f64, 0.0..0.2f64, 0.0..0.2f64, 0.0..0.2f64),
        (access, frame_bytes, is_keyed) in (0u8..3, 0usize..3, any::<bool>()),
        steps in proptest::collection::vec((0u8..6, any::<u8>(), any::<u8>()), 1..8),
    ) {
        let access = [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled][usize::from(access)];
        let frame_bytes = [32, 64, 256][frame_bytes];
        let setup = Setup { access, ..Setup::new(frame_bytes, 1000, Codec::Png) };
        let setup = if is_keyed && frame_bytes > 32 { setup.keyed(true, true) } else { setup };
        let channel = LossyChannel { loss, duplication, reordering, corruption, ..CHANNEL };
        let mut pair = LinkedEnds::new(seed, setup, channel);
        // Content of an earlier mission, too large for a small frame.
        let weights = (1..=60).map(|label| (label, 50)).collect();
        pair.put_in_force(Slot::Utility(Utility { weights, ..Utility::default() }));
        for (what, first, second) in steps {
            for pick in [first, second] {
                // The smallest frames have no room for some orders.
                let _ = pair.surface.issue(auv(), order(pick), pair.now);
            }
            run(&mut pair, 10 + u64::from(first % 60));
            match what {
                0 => pair.restart_vehicle(&patchy(2, 0)),
                1 | 2 => pair.restart_surface(),
                // The surface remembers a content that may be in force no more.
                3 => {
                    pair.restart_surface();
                    pair.surface.restore_in_force(auv(), [order(first), order(second)]);
                }
                _ => {}
            }
        }
        quiet(&mut pair);
        prop_assert!(is_known(&pair), "{:?}", held(&pair));
        // A hello that took long may begin another run, in which nothing is known until it is reported again.
        run(&mut pair, 60);
        prop_assert!(is_true(&pair), "nothing else is shown: {:?}", held(&pair));
        quiet(&mut pair);
        prop_assert!(is_known(&pair), "it stays known: {:?}", held(&pair));
    }
}

/// Runs until all is known, or for hours.
fn quiet(pair: &mut LinkedEnds) {
    for _ in 0..200 {
        run(pair, 250);
        if is_known(pair) {
            break;
        }
    }
}

/// Runs until all is known; returns the events of the surface.
fn learn(pair: &mut LinkedEnds, seconds: u64) -> Vec<SurfaceEvent> {
    let until = pair.now + Duration::from_secs(seconds);
    while pair.now < until && !is_known(pair) {
        pair.run(pair.now + Duration::from_millis(200), false);
    }
    std::mem::take(&mut pair.surface_events)
}

#[test]
fn a_surface_without_memory_learns_what_is_in_force() {
    for access in [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::Polled, Access::FullDuplex] {
        let setup = Setup { access, ..Setup::new(64, 2000, Codec::Png) };
        let mut pair = LinkedEnds::new(8, setup, CHANNEL);
        assert_eq!(shown(&pair, SlotId::Fence), InForce::NotReported);
        learn(&mut pair, 120);
        assert_eq!(shown(&pair, SlotId::Fence), InForce::None, "{access:?}");
        pair.surface.issue(auv(), fence(300), pair.now).unwrap();
        pair.run(pair.now + Duration::from_secs(60), false);
        assert_eq!(shown(&pair, SlotId::Fence), InForce::Known(&fence(300)), "its own order");
        pair.restart_surface();
        let events = learn(&mut pair, 120);
        assert_eq!(shown(&pair, SlotId::Fence), InForce::Known(&fence(300)), "{access:?}");
        assert!(events.contains(&SurfaceEvent::InForceLearned(auv(), SlotId::Fence)), "{events:?}");
        assert_eq!(pair.surface.vehicle(auv()).unwrap().slots().count(), 0, "an answer is no order");
        assert_eq!(shown(&pair, SlotId::Fix), InForce::NotReported);
    }
}

#[test]
fn a_report_confirms_remembered_content_and_hides_a_wrong_one() {
    for (remembered, is_right) in [(fence(300), true), (fence(200), false)] {
        let mut pair = LinkedEnds::new(9, Setup::new(64, 2000, Codec::Png), CHANNEL);
        pair.put_in_force(fence(300));
        pair.surface.restore_in_force(auv(), [remembered]);
        let events = learn(&mut pair, 120);
        assert_eq!(shown(&pair, SlotId::Fence), InForce::Known(&fence(300)));
        let is_learned = events.contains(&SurfaceEvent::InForceLearned(auv(), SlotId::Fence));
        assert_eq!(is_learned, !is_right, "{events:?}");
    }
}

#[test]
fn an_answer_of_many_frames_arrives_over_losses() {
    let channel = LossyChannel { loss: 0.5, reordering: 0.1, ..CHANNEL };
    let mut pair = LinkedEnds::new(3, Setup::new(32, 2000, Codec::Png), channel);
    let weights = (1..=200).map(|label| (label, 50)).collect();
    let large = Slot::Utility(Utility { weights, ..Utility::default() });
    pair.put_in_force(large.clone());
    learn(&mut pair, 2000);
    assert_eq!(shown(&pair, SlotId::Utility), InForce::Known(&large));
}

#[test]
fn inquiries_pause_while_no_answer_comes() {
    let mut pair = LinkedEnds::new(4, Setup::new(64, 2000, Codec::Png), LossyChannel { loss: 0.0, ..CHANNEL });
    learn(&mut pair, 60);
    pair.put_in_force(fence(200));
    let spent = |pair: &LinkedEnds| {
        let stats = pair.surface.vehicle(auv()).unwrap().stats();
        stats.bytes_by_class.get(&Class::Directive).copied().unwrap_or(0)
    };
    let before = spent(&pair);
    while shown(&pair, SlotId::Fence) != InForce::Unknown {
        pair.run(pair.now + Duration::from_millis(100), false);
    }
    pair.mute[0] = true;
    pair.run(pair.now + Duration::from_secs(3600), false);
    assert!((30..=600).contains(&(spent(&pair) - before)), "{} bytes", spent(&pair) - before);
    pair.mute[0] = false;
    learn(&mut pair, 400);
    assert_eq!(shown(&pair, SlotId::Fence), InForce::Known(&fence(200)));
}
