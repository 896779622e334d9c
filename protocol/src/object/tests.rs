//! Sender and receiver together, over a link that loses, repeats and reorders.

use super::{MAX_OBJECT, ObjectId, ObjectReceiver, ObjectSender, Part, Received, SymbolRun};
use proptest::prelude::*;
use std::collections::VecDeque;

/// A xorshift generator (Marsaglia 2003), so that a seed names a case.
struct LossRng(u64);

impl LossRng {
    fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    fn below(&mut self, n: usize) -> usize {
        for shift in [13i32, -7, 17] {
            self.0 ^= if shift > 0 { self.0 << shift } else { self.0 >> -shift };
        }
        (self.0 >> 33) as usize % n
    }

    fn happens(&mut self, share: f64) -> bool {
        (self.below(1 << 20) as f64) < share * f64::from(1 << 20)
    }

    fn object(&mut self, len: usize) -> Vec<u8> {
        (0..len).map(|_| self.below(256) as u8).collect()
    }
}

struct Flying {
    id: ObjectId,
    run: SymbolRun,
    bytes: Vec<u8>,
}

/// Both ends, and frames between them whose fates are reported in order, some time later.
struct LossyLink {
    sender: ObjectSender,
    receiver: ObjectReceiver,
    flying: VecDeque<Flying>,
    chance: LossRng,
    loss: f64,
    sent: usize,
    received: Vec<(ObjectId, Vec<u8>)>,
    delivered: Vec<ObjectId>,
}

impl LossyLink {
    fn new(seed: u64, loss: f64) -> Self {
        Self {
            sender: ObjectSender::default(),
            receiver: ObjectReceiver::default(),
            flying: VecDeque::new(),
            chance: LossRng::new(seed),
            loss,
            sent: 0,
            received: vec![],
            delivered: vec![],
        }
    }

    fn send(&mut self, room: usize) -> bool {
        let Some((id, run, bytes)) = self.sender.next_part(room) else { return false };
        assert!(bytes.len() <= room);
        self.sender.mark_in_flight(id, &run);
        self.sent += bytes.len();
        self.flying.push_back(Flying { id, run, bytes });
        true
    }

    fn receive(&mut self, bytes: &[u8]) {
        if let Received::Complete(id, object) = self.receiver.handle_part(&Part::decode(bytes).unwrap()) {
            self.received.push((id, object));
        }
    }

    /// All frames on their way arrive in some order, some twice, or are lost; then their fates are reported in order.
    fn deliver_all(&mut self) {
        let fates: Vec<bool> = (0..self.flying.len()).map(|_| !self.chance.happens(self.loss)).collect();
        let mut arriving: Vec<usize> = (0..fates.len()).filter(|&i| fates[i]).collect();
        for i in 0..arriving.len() {
            let other = self.chance.below(arriving.len());
            arriving.swap(i, other);
        }
        for i in arriving {
            let bytes = self.flying[i].bytes.clone();
            for _ in 0..=usize::from(self.chance.happens(0.1)) {
                self.receive(&bytes);
            }
        }
        for delivered in fates {
            let Flying { id, run, .. } = self.flying.pop_front().unwrap();
            if self.sender.handle_fate(id, &run, delivered) {
                assert!(self.received.iter().any(|(r, _)| *r == id), "reported complete, but is not");
                self.delivered.push(id);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn objects_arrive_whole_over_any_link(
        seed: u64,
        lens in proptest::collection::vec(1usize..4000, 1..5),
        loss in 0.0..0.9f64,
        assumed_loss in 0.0..0.95f64,
        rooms in (14usize..60, 0usize..1000),
        window in 1usize..60,
    ) {
        let mut link = LossyLink::new(seed, loss);
        link.sender.set_loss(assumed_loss);
        let objects: Vec<_> = lens.iter().map(|&len| link.chance.object(len)).collect();
        let ids: Vec<_> = objects.iter().map(|o| link.sender.push(o.clone()).unwrap()).collect();
        let mut rounds = 0;
        while !link.sender.is_empty() {
            prop_assert!(link.sender.backlog_bytes() > 0, "no part is under way, so content waits");
            for _ in 0..window {
                let room = rooms.0 + link.chance.below(rooms.1 + 1);
                link.send(room);
            }
            link.deliver_all();
            let now = assumed_loss * link.chance.below(3) as f64 / 2.0;
            link.sender.set_loss(now);
            prop_assert_eq!(link.received.len(), link.delivered.len(), "complete at both ends or at neither");
            rounds += 1;
            prop_assert!(rounds < 20_000);
        }
        prop_assert_eq!(link.received.len(), objects.len());
        for (id, object) in &link.received {
            let at = ids.iter().position(|i| i == id).unwrap();
            prop_assert!(objects[at] == *object);
        }
        prop_assert_eq!(link.sender.backlog_bytes(), 0);
    }

    #[test]
    fn any_parts_are_taken_within_bounds(parts in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..80), 0..60)) {
        let mut receiver = ObjectReceiver::default();
        for part in parts.iter().filter_map(|bytes| Part::decode(bytes).ok()) {
            receiver.handle_part(&part);
            receiver.head(part.id, 3);
        }
    }

    #[test]
    fn the_largest_object_arrives_over_the_smallest_frames(seed: u64, loss in 0.0..0.6f64) {
        let mut link = LossyLink::new(seed, loss);
        link.sender.set_loss(loss);
        let object = link.chance.object(MAX_OBJECT);
        link.sender.push(object.clone()).unwrap();
        while !link.sender.is_empty() {
            while link.send(14) {}
            link.deliver_all();
        }
        prop_assert!(link.received.len() == 1 && link.received[0].1 == object);
    }
}

#[test]
fn a_lossless_link_sends_no_repair_symbol() {
    for (len, room) in [(1, 14), (700, 14), (700, 49), (5000, 240), (MAX_OBJECT, 1000)] {
        let mut link = LossyLink::new(1, 0.0);
        let object = link.chance.object(len);
        link.sender.push(object).unwrap();
        while link.send(room) {
            let flying = link.flying.back().unwrap();
            let part = Part::decode(&flying.bytes).unwrap();
            assert!(part.symbols().all(|(symbol, _)| symbol < part.layout.sources()));
        }
        link.deliver_all();
        assert_eq!(link.delivered.len(), 1, "{len} bytes in rooms of {room}");
    }
}

/// The cost of bringing objects over, relative to the bytes on a lossless link.
struct Cost {
    /// The share of objects that are complete after one pass.
    complete: f64,
    one_pass: f64,
    in_all: f64,
}

fn cost(len: usize, room: usize, loss: f64) -> Cost {
    const RUNS: u64 = 300;
    let (mut complete, mut one_pass, mut in_all, mut lossless) = (0, 0, 0, 0);
    for seed in 0..RUNS {
        let mut link = LossyLink::new(seed, loss);
        let object = link.chance.object(len);
        link.sender.push(object.clone()).unwrap();
        while link.send(room) {}
        lossless += std::mem::take(&mut link.sent);
        link.flying.clear();
        link.sender.handle_peer_restart();
        link.sender.set_loss(loss);
        while link.send(room) {}
        one_pass += link.sent;
        link.deliver_all();
        complete += link.received.len();
        while !link.sender.is_empty() {
            while link.send(room) {}
            link.deliver_all();
        }
        in_all += link.sent;
    }
    let [one_pass, in_all] = [one_pass, in_all].map(|bytes| bytes as f64 / lossless as f64);
    Cost { complete: complete as f64 / RUNS as f64, one_pass, in_all }
}

#[test]
fn one_pass_completes_most_objects_at_the_expected_loss() {
    for (len, room) in [(700, 49), (700, 113), (4000, 113), (4000, 240), (MAX_OBJECT, 240), (MAX_OBJECT, 1000)] {
        let Cost { complete, one_pass, in_all } = cost(len, room, 0.3);
        let case =
            format!("{len} bytes, rooms of {room}: {complete:.2} complete after {one_pass:.2}, in all {in_all:.2}");
        assert!(complete > 0.55 && one_pass < 1.6 && in_all < 1.6, "{case}");
    }
}

#[test]
fn late_parts_of_a_complete_object_are_ignored() {
    let mut link = LossyLink::new(3, 0.0);
    link.sender.set_loss(0.5);
    let object = link.chance.object(900);
    link.sender.push(object).unwrap();
    while link.send(100) {}
    let parts: Vec<_> = link.flying.iter().map(|f| f.bytes.clone()).collect();
    link.deliver_all();
    assert_eq!(link.received.len(), 1);
    for part in &parts {
        assert_eq!(link.receiver.handle_part(&Part::decode(part).unwrap()), Received::Nothing);
    }
}

#[test]
fn a_name_that_is_used_again_is_another_object() {
    let mut link = LossyLink::new(4, 0.0);
    for round in 0..5000 {
        let object = link.chance.object(40);
        let id = link.sender.push(object.clone()).unwrap();
        if round % 7 == 0 {
            // Left incomplete at the receiver.
            link.send(30);
            link.deliver_all();
            link.sender.cancel(id);
            continue;
        }
        while link.send(30) {}
        link.deliver_all();
        assert_eq!(link.received.pop(), Some((id, object)));
    }
}

#[test]
fn an_object_is_dropped_before_its_name_is_reused() {
    let mut sender = ObjectSender::default();
    let first = sender.push(vec![1; 50]).unwrap();
    for later in 1..3000 {
        let id = sender.push(vec![2; 50]).unwrap();
        sender.cancel(id);
        assert_eq!(sender.is_empty(), later > 1023, "after {later} others");
        assert!(later > 1023 || id != first);
    }
}

#[test]
fn the_head_is_known_before_the_rest() {
    let mut link = LossyLink::new(5, 0.0);
    let object = link.chance.object(700);
    let id = link.sender.push(object.clone()).unwrap();
    assert_eq!(link.receiver.head(id, 3), None);
    link.send(49);
    link.deliver_all();
    assert_eq!(link.receiver.head(id, 3), Some(&object[..3]));
    assert_eq!(link.receiver.head(id, 600), None);
}

#[test]
fn a_restart_of_the_peer_voids_earlier_fates() {
    let mut link = LossyLink::new(6, 0.0);
    let object = link.chance.object(700);
    link.sender.push(object.clone()).unwrap();
    while link.send(49) {}
    link.receiver.clear();
    link.sender.handle_peer_restart();
    for flying in std::mem::take(&mut link.flying) {
        assert!(!link.sender.handle_fate(flying.id, &flying.run, true));
    }
    while link.send(49) {}
    link.deliver_all();
    assert!(link.received.len() == 1 && link.received[0].1 == object);
}

#[test]
fn a_cancelled_object_is_not_received_again() {
    let mut link = LossyLink::new(7, 0.0);
    let object = link.chance.object(700);
    let id = link.sender.push(object).unwrap();
    link.send(49);
    link.deliver_all();
    link.receiver.cancel(id);
    while link.send(49) {}
    let part = link.flying.pop_back().unwrap().bytes;
    assert_eq!(link.receiver.handle_part(&Part::decode(&part).unwrap()), Received::Nothing);
    assert_eq!(link.receiver.head(id, 3), None);
}

#[test]
fn a_further_object_replaces_the_oldest() {
    let mut sender = ObjectSender::default();
    assert_eq!((sender.push(vec![]), sender.push(vec![0; MAX_OBJECT + 1])), (None, None));
    let ids: Vec<_> = (0..17).map(|_| sender.push(vec![9; 100]).unwrap()).collect();
    assert_eq!(sender.next_part(60).map(|(id, ..)| id), Some(ids[1]));
}

#[test]
fn an_object_whose_check_fails_is_dropped() {
    let mut link = LossyLink::new(8, 0.0);
    link.sender.push(vec![7; 300]).unwrap();
    while link.send(49) {}
    let mut outcomes = vec![];
    for mut flying in std::mem::take(&mut link.flying) {
        flying.bytes[Part::HEADER] ^= 1;
        outcomes.push(link.receiver.handle_part(&Part::decode(&flying.bytes).unwrap()));
    }
    assert_eq!(outcomes.pop(), Some(Received::Nothing));
    assert!(outcomes.iter().all(|o| matches!(o, Received::Progress(..))));
}
