//! The opaque source and its replica under losses.

use super::opaque::{CELLS, OpaqueReplica, OpaqueSource};
use scenecast_protocol::map::{StateReplica, StateSource};
use scenecast_protocol::time::Instant;

const NOW: Instant = Instant::ZERO;

/// Transfers chunks until none waits; every third is lost.
fn pass(source: &mut OpaqueSource, replica: &mut OpaqueReplica, number: &mut u64) {
    while let Some((chunk, carried)) = source.next_chunk(100, NOW) {
        *number += 1;
        let delivered = !number.is_multiple_of(3);
        assert!(!delivered || replica.apply(*number, &chunk, NOW));
        source.handle_fate(carried, delivered, NOW);
        replica.advance_base(*number);
        assert_eq!(source.digest(), replica.base_digest());
    }
}

#[test]
fn the_replica_is_equal_once_every_byte_got_through() {
    let (mut source, mut replica, mut number) = (OpaqueSource::default(), OpaqueReplica::default(), 0);
    for bytes in [1, 5000, 70_000, 99] {
        source.fill(bytes.min(CELLS));
        pass(&mut source, &mut replica, &mut number);
        assert_eq!(source.target(), replica.shown());
        assert!(source.is_converged());
    }
}

#[test]
fn a_chunk_fills_its_room_while_bytes_wait() {
    let mut source = OpaqueSource::default();
    source.fill(300);
    let (first, carried) = source.next_chunk(100, NOW).unwrap();
    source.handle_fate(carried, false, NOW);
    let (again, _) = source.next_chunk(50, NOW).unwrap();
    let (rest, _) = source.next_chunk(100, NOW).unwrap();
    assert_eq!([first.len(), again.len(), rest.len()], [100, 50, 100]);
}

#[test]
fn reverted_changes_are_not_sent() {
    let (mut source, mut replica, mut number) = (OpaqueSource::default(), OpaqueReplica::default(), 0);
    source.fill(5000);
    source.take_back(7);
    assert_eq!(replica.missing(source.target()), 7);
    pass(&mut source, &mut replica, &mut number);
    assert_eq!(source.target(), replica.shown());
}

#[test]
fn a_source_fills_only_bytes_that_are_not_in_flight() {
    let mut source = OpaqueSource::default();
    source.fill(2 * CELLS);
    assert_eq!(source.waiting, CELLS);
    let mut carried = Vec::new();
    while let Some((_, runs)) = source.next_chunk(1000, NOW) {
        carried.push(runs);
    }
    source.fill(CELLS);
    assert_eq!((source.waiting, source.flying), (0, CELLS));
    source.handle_fate(carried.remove(0), true, NOW);
    source.fill(CELLS);
    assert_eq!((source.waiting, source.flying), (996, CELLS - 996));
}

#[test]
fn only_changed_bytes_are_useful() {
    let (mut source, mut replica) = (OpaqueSource::default(), OpaqueReplica::default());
    source.fill(96);
    let (chunk, _) = source.next_chunk(100, NOW).unwrap();
    assert!(replica.apply(1, &chunk, NOW) && replica.apply(2, &chunk, NOW));
    assert_eq!(replica.useful_bytes(), 100.0);
}
