//! Layers and background streams beside the map, in virtual time.

use crate::pair::{CALM, LinkedEnds, LossyChannel, Setup, assert_budget, auv, layer, patchy, speckled};
use scenecast_protocol::map::{Cell, LayerDescriptor, LayerId, LayerSource, Steps};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::schedule::{BackgroundOrder, BackgroundStream, Class};
use std::time::Duration;

#[test]
fn a_layer_gets_its_share_of_the_bytes_of_the_map() {
    let sent = |layers: [u8; 2]| {
        let setup = Setup { layers: Some(layers), ..Setup::new(256, 4_000, Codec::Png) };
        let mut pair = LinkedEnds::new(1, setup, LossyChannel { loss: 0.0, ..CALM });
        for phase in 0..20 {
            pair.vehicle.set_map(speckled(120, phase), pair.now);
            pair.set_layers(120, phase);
            pair.run(pair.now + Duration::from_secs(10), false);
        }
        assert_budget(&pair, 4_000);
        [Class::Map, Class::Layer(LayerId::CONFIDENCE), Class::Layer(LayerId::DEPTH)]
            .map(|c| *pair.vehicle.stats().bytes_by_class.get(&c).unwrap_or(&0))
    };
    let [labels, confidence, depth] = sent([0, 0]);
    assert!(labels > 50_000 && confidence + depth < 100, "{labels} {confidence} {depth}");
    // Half of the sent bytes is the share of the map.
    let [labels, confidence, depth] = sent([20, 10]);
    let part = |bytes: u64| bytes as f64 / (labels + confidence + depth) as f64;
    assert!((0.08..0.13).contains(&part(confidence)), "{labels} {confidence} {depth}");
    assert!((0.03..0.08).contains(&part(depth)), "{labels} {confidence} {depth}");
}

fn sent(pair: &LinkedEnds, class: Class) -> u64 {
    pair.vehicle.stats().bytes_by_class.get(&class).copied().unwrap_or(0)
}

#[test]
fn spare_capacity_goes_to_the_named_streams_in_order() {
    let setup = Setup { layers: Some([0, 0]), ..Setup::new(256, 4_000, Codec::Context) };
    let mut pair = LinkedEnds::new(3, setup, LossyChannel { loss: 0.1, ..CALM });
    pair.vehicle.set_background(
        BackgroundOrder::new(&[BackgroundStream::Exemplars, BackgroundStream::Layer(LayerId::DEPTH)]).unwrap(),
    );
    pair.vehicle.set_map(speckled(20, 1), pair.now);
    pair.set_layers(100, 1);
    pair.vehicle.push_background_object((0..9_000u32).map(|i| ((i * i) >> 3) as u8).collect());
    for _ in 0..400 {
        pair.run(pair.now + Duration::from_secs(1), false);
        let (object, depth) = (sent(&pair, Class::Exemplar), sent(&pair, Class::Layer(LayerId::DEPTH)));
        // Spare capacity includes ends of frames too short for a part of the object, and waits for verdicts.
        assert!(object >= 9_000 || depth <= object / 16, "{depth} bytes of depth after {object} of the object");
    }
    assert!(sent(&pair, Class::Layer(LayerId::DEPTH)) > 500, "then it is its turn");
    assert_eq!(sent(&pair, Class::Layer(LayerId::CONFIDENCE)) / 100, 0, "but for the digest of an empty layer");
    assert_budget(&pair, 4_000);
}

#[test]
fn curiosity_is_sent_only_where_the_operator_requests_it() {
    let mut pair = LinkedEnds::new(4, Setup::new(256, 4_000, Codec::Context), LossyChannel { loss: 0.2, ..CALM });
    pair.vehicle.add_layer(layer(LayerId::CURIOSITY, 0, Codec::Context, Duration::ZERO));
    pair.vehicle.set_map(patchy(20, 0).iter(), pair.now);
    let bits = (0..400).map(|i| (Cell::new(i % 20, i / 20), f64::from(i % 7) + f64::from(i / 80)));
    pair.vehicle.set_layer(LayerId::CURIOSITY, bits, pair.now);
    pair.run(pair.now + Duration::from_secs(200), true);
    assert!(pair.is_converged(), "no stream waits for it");
    assert_eq!(sent(&pair, Class::Layer(LayerId::CURIOSITY)), 0);
    pair.vehicle.set_background(BackgroundOrder::new(&[BackgroundStream::Layer(LayerId::CURIOSITY)]).unwrap());
    assert!(!pair.is_converged());
    pair.run(pair.now + Duration::from_secs(200), true);
    assert!(pair.is_converged() && sent(&pair, Class::Layer(LayerId::CURIOSITY)) > 50);
    assert_budget(&pair, 4_000);
}

#[test]
fn a_layer_made_under_way_arrives_in_small_frames_over_restarts() {
    let setup = Setup { layers: Some([10, 0]), ..Setup::new(32, 2_000, Codec::Context) };
    let mut pair = LinkedEnds::new(6, setup, LossyChannel { loss: 0.3, reordering: 0.1, ..CALM });
    pair.vehicle.set_map(patchy(8, 0).iter(), pair.now);
    pair.set_layers(8, 1);
    pair.run(pair.now + Duration::from_secs(30), false);
    let id = LayerId::new(15).unwrap();
    let descriptor = LayerDescriptor {
        name: "chlorophyll".into(),
        unit: "mg/m³".into(),
        steps: Steps::Doubling,
        share: 10,
        ..layer(LayerId::CURIOSITY, 0, Codec::Png, Duration::ZERO).descriptor().clone()
    };
    let made = || LayerSource::new(id, descriptor.clone(), Codec::Context, Duration::ZERO);
    assert!(pair.vehicle.add_layer(made()) && !pair.vehicle.add_layer(made()), "an index has one layer");
    pair.vehicle.set_layer(id, (0..64).map(|i| (Cell::new(i % 8, i / 8), f64::from(i))), pair.now);
    for _ in 0..3 {
        pair.run(pair.now + Duration::from_secs(60), false);
        pair.restart_surface();
    }
    pair.run(pair.now + Duration::from_secs(4_000), true);
    assert!(pair.is_converged());
    let view = pair.surface.vehicle(auv()).unwrap();
    assert_eq!((view.layers().id("chlorophyll"), view.layers().get(id)), (Some(id), Some(&descriptor)));
    assert_eq!(view.layer(id).unwrap().levels().shown().explored(), 64);
    assert_eq!(view.stats().resyncs, 0);
}

#[test]
fn a_stream_named_before_finer_cells_is_sent_before_them() {
    let after_a_minute = |order: [BackgroundStream; 2]| {
        let mut pair = LinkedEnds::new(5, Setup::new(256, 4_000, Codec::Context), LossyChannel { loss: 0.1, ..CALM });
        pair.vehicle.set_background(BackgroundOrder::new(&order).unwrap());
        pair.vehicle.source_mut().set_coarse_limit(Some(500));
        pair.vehicle.set_map(speckled(200, 1), pair.now);
        pair.vehicle.push_background_object((0..5_000u32).map(|i| ((i * i) >> 3) as u8).collect());
        pair.run(pair.now + Duration::from_secs(60), false);
        let early = sent(&pair, Class::Exemplar);
        pair.run(pair.now + Duration::from_secs(600), true);
        assert_eq!(pair.shown(), pair.vehicle.map());
        assert_budget(&pair, 4_000);
        early
    };
    assert!(after_a_minute([BackgroundStream::Exemplars, BackgroundStream::Finer]) >= 5_000);
    let at_ends_of_frames = after_a_minute([BackgroundStream::Finer, BackgroundStream::Exemplars]);
    // 117 frames go out in a minute; a cell in them takes a few bytes, which are left at the end of a frame.
    assert!(at_ends_of_frames < 117 * 20, "{at_ends_of_frames}");
}

#[test]
fn a_new_epoch_clears_the_layers_before_new_labels() {
    let setup = Setup { layers: Some([0, 0]), ..Setup::new(256, 10_000, Codec::Context) };
    let mut pair = LinkedEnds::new(2, setup, LossyChannel { loss: 0.2, ..CALM });
    pair.vehicle.set_map(patchy(20, 0).iter(), pair.now);
    pair.set_layers(20, 0);
    pair.run(pair.now + Duration::from_secs(200), true);
    let level = |pair: &LinkedEnds, cell: Cell| {
        let layer = pair.surface.vehicle(auv()).unwrap().layer(LayerId::CONFIDENCE);
        layer.map_or(0, |p| p.levels().shown().get(cell))
    };
    assert!(pair.is_converged() && level(&pair, Cell::new(0, 0)) > 0);
    pair.vehicle.begin_epoch(pair.now);
    pair.vehicle.set_map([(Cell::new(5, 5), 9)], pair.now);
    for _ in 0..600 {
        pair.run(pair.now + Duration::from_millis(100), false);
        if pair.shown().get(Cell::new(5, 5)) == 9 {
            break;
        }
    }
    assert_eq!((pair.shown().get(Cell::new(5, 5)), level(&pair, Cell::new(0, 0))), (9, 0));
}
