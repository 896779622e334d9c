//! The operator tunes a vehicle that is under way: the map follows, both maps agree, labels keep their meaning.

use super::{Mission, MissionOptions};
use crate::world::World;
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::directive::SlotState;
use scenecast_protocol::map::{LabelGrid, LayerId};
use scenecast_protocol::map_codec::Stride;
use scenecast_protocol::time::Instant;
use scenecast_surface::SettingsOrder;
use scenecast_vehicle::MapProducer;
use std::time::Duration;

pub(super) fn mission(sets: &[&str]) -> Mission {
    let small = [
        "survey.duration_s=400",
        "camera.width_px=320",
        "camera.height_px=240",
        "scene.refine_words_per_s=20000",
        "operator.script=none",
        "channel.loss=0.2",
    ];
    let config =
        scenecast_config::load(None, &small.iter().chain(sets).map(|s| (*s).to_owned()).collect::<Vec<_>>()).unwrap();
    static REEF: std::sync::OnceLock<World> = std::sync::OnceLock::new();
    let world = REEF.get_or_init(|| World::patches(5, 0.01)).clone();
    Mission::new(config, MissionOptions { world, seed: 3, record: None }).unwrap()
}

impl Mission {
    fn fly_to(&mut self, seconds: f64) {
        self.advance(Instant::from_secs_f64(seconds)).unwrap();
    }

    /// Sends an order and flies until the vehicle has reported it in force.
    fn tune(&mut self, order: &str) {
        let order: SettingsOrder = serde_json::from_str(order).unwrap();
        let (address, now) = (self.address, self.now());
        self.surface_mut().set_settings(address, &order, now).unwrap();
        let give_up = now + Duration::from_secs(120);
        let is_in_force = |m: &Self| {
            let record = &m.surface().record(address).unwrap().orders.settings;
            record.in_force() == Some(record.requested())
        };
        while !is_in_force(self) {
            assert!(self.now() < give_up, "not in force after two minutes");
            self.advance(self.now() + Duration::from_secs(1)).unwrap();
        }
        assert_eq!(self.vehicle().settings(), self.surface().record(address).unwrap().orders.settings.requested());
    }

    /// Ends the survey and drains the link.
    fn drain(&mut self) {
        self.end_survey();
        let give_up = self.now() + Duration::from_secs(3600);
        while !self.is_drained() && self.now() < give_up {
            self.advance(self.now() + Duration::from_secs(1)).unwrap();
        }
        assert!(same(self.vehicle().map(), self.operators()), "the operator's map is the vehicle's");
    }

    fn operators(&self) -> &LabelGrid {
        self.surface().map(self.address).unwrap()
    }

    fn received_version(&self, kind: LayerId) -> u64 {
        self.surface().view(self.address).and_then(|v| v.layer(kind)).map_or(0, |p| p.version())
    }

    fn settings_applied(&self) -> usize {
        let of_settings =
            |a: &&scenecast_vehicle::AppliedSlot| a.id == SlotId::Settings && a.state == SlotState::Applied;
        self.logbook.applied.iter().filter(of_settings).count()
    }
}

fn same(a: &LabelGrid, b: &LabelGrid) -> bool {
    a.explored() == b.explored() && a.iter().all(|(cell, label)| b.get(cell) == label)
}

#[test]
fn maps_agree_after_settings_changed_in_the_mission() {
    let mut mission = mission(&[]);
    mission.fly_to(100.0);
    let (frames, labels) = (mission.logbook.track.len(), mission.mapper.current().labels.unwrap().highest);
    assert!(frames >= 50 && labels > 1 && mission.received_version(LayerId::CONFIDENCE) > 0);
    mission.tune(r#"{"gamma": 0.2, "alpha": 0.5, "frames_per_s": 0.1, "layers": "depth"}"#);
    assert_eq!(mission.mapper.priors(), [0.5, 0.1, 0.2]);
    // Frames that were on their way when the settings changed have arrived.
    mission.fly_to(mission.now().as_secs_f64() + 30.0);
    let (since, frames, confidence) =
        (mission.now(), mission.logbook.track.len(), mission.received_version(LayerId::CONFIDENCE));
    let depth = mission.received_version(LayerId::DEPTH);
    mission.fly_to(since.as_secs_f64() + 100.0);
    assert!((9..=11).contains(&(mission.logbook.track.len() - frames)), "one frame in ten seconds is seen");
    assert_eq!(mission.received_version(LayerId::CONFIDENCE), confidence, "a layer that is not sent costs no bytes");
    assert!(mission.received_version(LayerId::DEPTH) > depth);
    mission.tune(r#"{"frames_per_s": 0, "layers": "", "gamma": 0}"#);
    assert_eq!(mission.mapper.priors(), [0.5, 0.1, 1e-4], "settings that an order does not name stay");
    mission.fly_to(mission.now().as_secs_f64() + 60.0);
    assert!(mission.received_version(LayerId::CONFIDENCE) > confidence);
    mission.drain();
    let sent = mission.vehicle().layers().find(|p| p.id() == LayerId::CONFIDENCE).unwrap().target().clone();
    let received = mission.surface().view(mission.address).unwrap().layer(LayerId::CONFIDENCE).unwrap();
    assert!(same(&sent, received.levels().shown()), "a layer resumes from its last state");
    assert_eq!((mission.mapper.epoch(), mission.settings_applied()), (0, 2), "labels keep their meaning");
    assert!(mission.mapper.current().labels.unwrap().highest >= labels);
}

#[test]
fn the_map_has_as_many_labels_as_were_ordered() {
    let mut mission = mission(&["survey.speed_m_s=1"]);
    mission.fly_to(150.0);
    let shown = |mission: &Mission| {
        let labels: std::collections::BTreeSet<u8> = mission.operators().iter().map(|(_, label)| label).collect();
        labels.len()
    };
    assert!(shown(&mission) > 3, "{} labels", shown(&mission));
    mission.tune(r#"{"labels": 3}"#);
    mission.fly_to(mission.now().as_secs_f64() + 60.0);
    mission.drain();
    assert_eq!(shown(&mission), 3);
    assert_eq!(mission.mapper.epoch(), 0, "labels keep their meaning");
}

#[test]
fn only_coarse_cells_are_sent_until_all_are_requested_again() {
    let mut mission = mission(&["survey.speed_m_s=1"]);
    mission.fly_to(60.0);
    mission.tune(r#"{"cells": "coarse"}"#);
    let known = mission.vehicle().map().clone();
    mission.fly_to(200.0);
    let seen = mission.mapper.current().labels.unwrap().cells.len();
    let sent = mission.vehicle().map();
    assert!(sent.explored() < seen * 2 / 3, "{} of {seen} cells are sent", sent.explored());
    for (cell, label) in mission.mapper.current().labels.unwrap().cells {
        let is_sent = Stride::Four.on_lattice(cell).is_some() || known.get(cell) != 0;
        assert_eq!(sent.get(cell), if is_sent { label } else { 0 }, "{cell:?}");
    }
    mission.drain();
    mission.tune(r#"{"cells": "fine"}"#);
    mission.drain();
    let seen = mission.mapper.current().labels.unwrap().cells;
    assert!(seen.iter().all(|&(cell, label)| mission.operators().get(cell) == label), "after the survey, too");
}

#[test]
fn coarse_cells_need_far_fewer_bits() {
    let bytes = |cells: &str| {
        let mut mission = mission(&["channel.loss=0", "map.layers=[]", cells]);
        mission.fly_to(200.0);
        mission.drain();
        mission.surface().view(mission.address).unwrap().stats().received_by_class
            [&scenecast_protocol::schedule::Class::Map]
    };
    let (fine, coarse) = (bytes("map.cells=fine"), bytes("map.cells=coarse"));
    // A sixteenth of the cells, but each alone: labels four cells apart predict each other less.
    assert!(coarse * 2 < fine, "{coarse} bytes of coarse cells, {fine} of all");
}
