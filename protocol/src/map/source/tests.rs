use super::*;
use crate::map::{Replica, StateReplica};
use proptest::prelude::*;

fn at(s: f64) -> Instant {
    Instant::from_secs_f64(s)
}

fn square(side: i32, label: impl Fn(i32) -> u8) -> Vec<(Cell, u8)> {
    (0..side * side).map(|i| (Cell::new(i % side - 20, i / side), label(i))).collect()
}

/// A source and a replica with a reliable link between them.
struct TestEnds {
    source: MapSource,
    replica: Replica,
    number: u64,
    sent_cells: usize,
}

impl TestEnds {
    fn new(settle_s: f64) -> Self {
        let mut source = MapSource::new(Codec::Context);
        source.set_debounce(Duration::from_secs_f64(settle_s));
        Self { source, replica: Replica::default(), number: 0, sent_cells: 0 }
    }

    /// Sends one chunk of at most `room` bytes; `fate` is whether it arrives.
    fn send(&mut self, room: usize, fate: bool, now: Instant) -> bool {
        self.source.handle_timeout(now);
        let Some((bytes, carried)) = self.source.next_chunk(room, now) else { return false };
        assert!(bytes.len() <= room);
        self.number += 1;
        self.sent_cells += carried.len();
        if fate {
            assert!(self.replica.apply(self.number, &bytes, now));
            self.replica.advance_base(self.number);
        }
        self.source.handle_fate(carried, fate, now);
        true
    }

    fn send_all(&mut self, now: Instant) {
        while self.send(200, true, now) {}
    }

    fn is_equal(&self) -> bool {
        self.replica.shown() == self.source.target()
    }
}

/// Compares the incremental counts with a full count.
fn check(source: &MapSource) {
    let cells = source.target.iter().chain(source.acked.iter()).map(|(cell, _)| cell);
    let cells: std::collections::BTreeSet<Cell> = cells.collect();
    let differing = cells.iter().filter(|&&cell| source.target.get(cell) != source.acked.get(cell)).count();
    let waits = source.dirty.waiting();
    let waiting = cells.iter().filter(|&&cell| waits(cell)).count();
    let counts = source.dirty.counts();
    assert_eq!((counts.differing, counts.waiting), (differing, waiting));
    assert_eq!(source.next_due().is_some(), counts.held > 0);
    assert_eq!(source.backlog_bytes() > 0, waiting > 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Steps: seconds that pass, labels that change, whether the chunks of the step arrive.
    #[test]
    fn the_replica_converges_once_the_model_is_stable(
        settle_s in prop_oneof![Just(0.0), 0.1f64..20.0],
        steps in proptest::collection::vec((0.0f64..8.0, any::<u64>(), 0u8..3, any::<bool>()), 1..40),
    ) {
        let mut ends = TestEnds::new(settle_s);
        let mut now = 1.0;
        for (passed, labels, sends, fate) in steps {
            now += passed;
            let cells = (0..12).map(|i| (Cell::new(i % 4 - 2, i / 4), (labels >> (5 * i)) as u8 % 4, (labels >> 60) as u8 % 4));
            ends.source.set_confident(cells, at(now));
            for _ in 0..sends {
                ends.send(30, fate, at(now));
            }
            check(&ends.source);
            prop_assert_eq!(ends.source.is_converged(), ends.source.target() == ends.source.acked());
        }
        ends.send_all(at(now + settle_s * 8.0 + 0.1));
        prop_assert!(ends.source.is_converged() && ends.is_equal());
        prop_assert_eq!(ends.replica.base_digest(), ends.source.digest());
    }

    #[test]
    fn no_cell_starves_beside_busy_valuable_ones(
        weights in proptest::collection::vec(0.0f64..1.0, 8), settle_s in 0.0f64..3.0, busy in 1i32..40, seed: u64,
    ) {
        let mut ends = TestEnds::new(settle_s);
        ends.source.set_interest(|label| weights[usize::from(label) % 8]);
        ends.source.set([(Cell::new(500, 500), 9)], at(0.0));
        ends.send_all(at(0.0));
        ends.source.set([(Cell::new(500, 500), 8)], at(10.0));
        let mut step = 10;
        while ends.replica.shown().get(Cell::new(500, 500)) != 8 {
            step += 1;
            let label = |i: i32| ((seed >> (i % 50)) as usize + step) as u8 % 7 + 1;
            let busy = (0..busy).flat_map(|t| (0..9).map(move |i| (Cell::new(t * 20 + i % 3, i / 3), label(t + i))));
            ends.source.set(busy, at(step as f64));
            ends.send(40, true, at(step as f64));
            prop_assert!(step < 2000, "a change waits for half an hour");
        }
    }
}

#[test]
fn only_flips_that_last_are_sent() {
    let mut ends = TestEnds::new(5.0);
    ends.source.set(square(8, |_| 1), at(0.0));
    ends.send_all(at(0.0));
    assert!(ends.is_equal(), "what was never seen goes out at once");
    ends.source.set([(Cell::new(-20, 0), 2), (Cell::new(-19, 0), 2)], at(10.0));
    assert_eq!((ends.source.backlog_bytes(), ends.source.is_quiet(), ends.source.is_converged()), (0, true, false));
    assert_eq!(ends.source.next_due(), Some(at(15.0)));
    ends.source.set([(Cell::new(-20, 0), 1)], at(12.0));
    assert!(!ends.send(200, true, at(14.9)));
    assert_eq!(ends.source.flips_suppressed(), 2);
    assert!(ends.send(200, true, at(15.0)) && ends.is_equal());
    assert_eq!(ends.sent_cells, 65);
    // The model is certain, so the label is sent at once.
    ends.source.set_confident([(Cell::new(-18, 0), 3, MAX_CONFIDENCE)], at(20.0));
    assert!(ends.send(200, true, at(20.0)) && ends.is_equal());
    ends.source.set([(Cell::new(-18, 0), 4)], at(21.0));
    ends.source.set_confident([(Cell::new(-18, 0), 4, MAX_CONFIDENCE)], at(22.0));
    assert!(ends.send(200, true, at(22.0)) && ends.is_equal());
}

#[test]
fn a_cell_that_keeps_flipping_is_sent_sometimes() {
    let mut ends = TestEnds::new(2.0);
    ends.source.set([(Cell::new(0, 0), 1)], at(0.0));
    ends.send_all(at(0.0));
    for step in 0..600 {
        let now = at(1.0 + f64::from(step));
        ends.source.set([(Cell::new(0, 0), 2 + (step % 250) as u8)], now);
        ends.send_all(now);
    }
    assert!((10..40).contains(&ends.sent_cells), "{}", ends.sent_cells);
    assert!(ends.source.flips_suppressed() > 500);
}

#[test]
fn choosing_a_chunk_inspects_changed_tiles_only() {
    let mut source = MapSource::new(Codec::Context);
    source.set(square(1024, |i| (i / 50 % 6) as u8 + 1), at(0.0));
    source.handle_peer_restart(at(0.0));
    source.next_chunk(256, at(1.0));
    let before = source.dirty.looked_at();
    assert!(before <= 1024 * 1024 + 256 * 128);
    let (_, carried) = source.next_chunk(256, at(2.0)).unwrap();
    let tiles: std::collections::BTreeSet<_> = carried.iter().map(|(cell, _)| cell.tile()).collect();
    source.handle_fate(carried, false, at(3.0));
    source.next_chunk(256, at(4.0));
    let most = 256 * (2 + tiles.len() as u64 * 3 + 300);
    assert!(source.dirty.looked_at() - before <= most, "{} cells", source.dirty.looked_at() - before);
}

#[test]
fn labels_held_back_are_sent_once_nothing_else_waits() {
    let mut ends = TestEnds::new(0.0);
    ends.source.set_hold(Hold::Backlog(10));
    ends.source.set(square(20, |_| 3), at(0.0));
    ends.send_all(at(1.0));
    // A backlog of new cells, then a flip of known ones: these wait, although their age would put them first.
    ends.source.set((0..4000).map(|i| (Cell::new(100 + i % 80, i / 80), (i * i % 7) as u8)), at(2.0));
    ends.source.set(square(4, |_| 5), at(3.0));
    assert!(ends.send(60, true, at(5.0)));
    let known = |ends: &TestEnds| ends.replica.shown().get(Cell::new(-20, 0));
    assert_eq!((known(&ends), ends.source.dirty.counts().held), (3, 16));
    while ends.source.dirty.counts().waiting > 0 {
        assert!(ends.send(200, true, at(6.0)));
    }
    assert!(ends.source.backlog_bytes() > 0 && !ends.source.is_quiet());
    ends.send_all(at(6.0));
    assert!(ends.is_equal() && known(&ends) == 5);
}
