//! A survey over a channel that loses frames, and objects of which symbols are lost.

use super::files::{assert_capture, assert_file};
use crate::examples::vectors::{GridVector, HeardFrame, Hex, ObjectVector, Objects, PartVector, Sequence, take_map};
use crate::pair::{CALM, LinkedEnds, LossyChannel, Setup, patchy};
use scenecast_protocol::map::Replica;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::object::{ObjectReceiver, ObjectSender, Part, Received, SymbolRun};
use scenecast_protocol::wire::Listener;
use std::time::Duration;

#[test]
fn the_sequence_of_the_vectors_is_that_of_a_survey() {
    let setup = Setup::new(64, 2000, Codec::Context);
    let mission = setup.mission;
    let mut pair = LinkedEnds::new(4, setup, LossyChannel { loss: 0.25, ..CALM });
    for phase in 0..3 {
        pair.vehicle.set_map(patchy(14, phase).iter(), pair.now);
        pair.run(pair.now + Duration::from_secs(20), false);
    }
    pair.run(pair.now + Duration::from_secs(60), true);
    let (mut listener, mut replica) = (Listener::new(mission, Vec::new()), Replica::default());
    let frames: Vec<HeardFrame> = std::mem::take(&mut pair.sent)
        .into_iter()
        .map(|(bytes, lost)| {
            let heard = if lost { None } else { listener.hear(&bytes).expect("a frame").frame };
            let digests = heard.and_then(|frame| take_map(&mut replica, &frame));
            HeardFrame { bytes: Hex(bytes), lost, digests }
        })
        .collect();
    assert_eq!((replica.shown(), pair.shown()), (pair.vehicle.map(), pair.vehicle.map()));
    assert!(frames.iter().filter(|frame| frame.lost).count() > 5);
    assert_capture("sequence.pcap", frames.iter().filter(|frame| !frame.lost).map(|frame| frame.bytes.0.as_slice()));
    let mission = format!("{:08x}", mission.0);
    assert_file("sequence.json", &Sequence { mission, frames, map: GridVector::of(pair.vehicle.map()) });
}

#[test]
fn objects_are_those_of_the_vectors() {
    let text = |bytes: usize| (0..bytes).map(|i| (i * i % 251) as u8).collect::<Vec<u8>>();
    let objects = vec![
        object("without losses", text(100), |_| false),
        object("every third part is lost", text(700), |part| part % 3 == 1),
        object("the first five parts are lost", text(2000), |part| part < 5),
    ];
    let is_repair = |part: &PartVector| {
        let part = Part::decode(&part.payload.0).expect("own part");
        usize::from(part.first) >= part.layout.sources()
    };
    assert!(objects[1].parts.iter().any(|part| !part.lost && is_repair(part)), "a repair symbol arrives");
    assert_file("objects.json", &Objects { objects });
}

/// Sends an object in parts of at most 48 bytes over a channel that is expected to lose a third of them. The sender learns the fates
/// once nothing is left to send.
fn object(name: &str, bytes: Vec<u8>, is_lost: impl Fn(usize) -> bool) -> ObjectVector {
    let (mut sender, mut receiver) = (ObjectSender::default(), ObjectReceiver::default());
    sender.set_loss(1.0 / 3.0);
    sender.push(bytes.clone()).expect("an object");
    let (mut parts, mut in_flight) = (Vec::<PartVector>::new(), Vec::<(_, SymbolRun, bool)>::new());
    while !sender.is_empty() {
        let Some((id, run, payload)) = sender.next_part(48) else {
            for (id, run, lost) in in_flight.drain(..) {
                sender.handle_fate(id, &run, !lost);
            }
            continue;
        };
        sender.mark_in_flight(id, &run);
        let lost = is_lost(parts.len());
        let received = (!lost).then(|| receiver.handle_part(&Part::decode(&payload).expect("own part")));
        let whole = matches!(&received, Some(Received::Complete(_, object)) if *object == bytes);
        parts.push(PartVector { payload: Hex(payload), lost, whole });
        in_flight.push((id, run, lost));
    }
    assert!(parts.iter().any(|part| part.whole), "{name}");
    ObjectVector { name: name.to_owned(), bytes: Hex(bytes), parts }
}
