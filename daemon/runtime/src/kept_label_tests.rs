//! The meaning of a label, through power cuts at any step of the disk and of the host.

use super::checkpoint::CheckpointFile;
use super::durable::{FirstStart, Keeper, StartedRun};
use super::journal::disk::{Disk, DiskRng, DiskStep};
use scene_model::publish::LabelBook;
use scene_model::topics::{FlatCell, TopicId};
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_host::{VehicleHost, VehicleHostEvent, channel_station};
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use scenecast_vehicle::MapChanges;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::Duration;

const FRAMES: u32 = 40;
/// Frames from one checkpoint to the next.
const CHECKPOINT_INTERVAL: u32 = 7;

/// A scene model with only births and deaths of topics.
#[derive(Serialize, Deserialize)]
struct TopicScene {
    lineage: u64,
    book: LabelBook,
    topics: Vec<TopicId>,
    /// The true identity of each topic, also after its death; no run uses a number again.
    meanings: BTreeMap<TopicId, u64>,
    next_topic: u32,
}

impl TopicScene {
    fn new(epoch: u8, lineage: u64) -> Self {
        Self {
            lineage,
            book: LabelBook::new(epoch).with_min_cells(1),
            topics: Vec::new(),
            meanings: BTreeMap::new(),
            next_topic: 0,
        }
    }

    /// A topic is born and, one time in three, another one dies; returns the map.
    fn see(&mut self, rng: &mut DiskRng, born: &mut u64) -> MapChanges {
        if self.topics.len() < 4 {
            *born += 1;
            self.topics.push(TopicId(self.next_topic));
            self.meanings.insert(TopicId(self.next_topic), *born);
            self.next_topic += 1;
        }
        if self.topics.len() > 1 && rng.below(3) == 0 {
            self.topics.remove(rng.below(self.topics.len()));
        }
        let cell = |(x, &topic): (usize, &TopicId)| FlatCell {
            x: x as i32,
            y: 0,
            z: 0,
            topic,
            words: 50,
            confidence: 1.0,
            perplexity: 1.0,
        };
        let flat: Vec<FlatCell> = self.topics.iter().enumerate().map(cell).collect();
        let published = self.book.publish(&flat);
        let cells = published.iter().map(|c| (Cell::new(c.x, c.y), c.label)).collect();
        MapChanges::of_labels(self.book.epoch(), self.book.labels().count() as u8, cells)
    }

    fn meaning(&self, label: u8) -> Option<u64> {
        self.meanings.get(&self.book.topic_of(label)?).copied()
    }
}

struct LabelTrial {
    config: Config,
    disk: Disk,
    rng: DiskRng,
    born: u64,
    /// The meaning of each label of each epoch when it was published.
    published: BTreeMap<(u8, u8), u64>,
    epochs: Vec<u8>,
}

impl LabelTrial {
    fn new(seed: u64) -> Self {
        let config = scenecast_config::load(None, &[]).unwrap();
        let (published, epochs) = (BTreeMap::new(), Vec::new());
        Self { config, disk: Disk::default(), rng: DiskRng::new(seed), born: 0, published, epochs }
    }

    /// One run of the vehicle; `None` if the power was cut.
    fn run(&mut self) -> Option<()> {
        let mut file = CheckpointFile::new(self.disk.clone());
        let kept: Option<TopicScene> = file.read().ok()?.and_then(|bytes| postcard::from_bytes(&bytes).ok());
        let claim = kept.as_ref().map(|scene| (scene.lineage, scene.book.epoch()));
        let lineage = self.rng.below(1 << 30) as u64;
        let StartedRun { mut keeper, durable, is_stored, .. } =
            Keeper::begin_run(self.disk.clone(), lineage, claim, &FirstStart::default());
        if !is_stored {
            return None;
        }
        let mut scene = match kept.filter(|scene| scene.lineage == durable.lineage) {
            Some(mut scene) if scene.book.epoch() == durable.epoch => {
                scene.book.resume(durable.labels);
                scene
            }
            Some(mut scene) => {
                scene.book.begin_epoch(durable.epoch);
                scene
            }
            None => TopicScene::new(durable.epoch, durable.lineage),
        };
        self.epochs.push(durable.epoch);
        let area = Area { west: 0.0, south: 0.0, east: 20.0, north: 20.0 };
        let profile = scenecast_drivers::modem::modem_of_process(
            &self.config,
            scenecast_config::vehicle_address(&self.config).unwrap(),
        )
        .unwrap();
        let vehicle =
            scenecast_vehicle::assemble(&self.config, None, profile, area, durable, 1, Instant::ZERO).unwrap();
        let station = channel_station(profile, Duration::from_secs(10), Instant::ZERO);
        let mut host = VehicleHost::new(vehicle, station, None);
        for frame in 1..=FRAMES {
            self.disk.step(DiskStep::Host).ok()?;
            let changes = scene.see(&mut self.rng, &mut self.born);
            // The model's thread keeps a checkpoint before or after the link's thread receives the map of the frame.
            let first = self.rng.below(2) == 0;
            if first && frame % CHECKPOINT_INTERVAL == 0 {
                file.keep(&postcard::to_allocvec(&scene).unwrap()).ok()?;
            }
            self.publish(&mut host, &mut keeper, &changes, &scene)?;
            if !first && frame % CHECKPOINT_INTERVAL == 0 {
                file.keep(&postcard::to_allocvec(&scene).unwrap()).ok()?;
            }
        }
        Some(())
    }

    /// The link's thread takes a map and acts on the host's events; then frames may go out.
    fn publish(
        &mut self,
        host: &mut VehicleHost,
        keeper: &mut Keeper<Disk>,
        changes: &MapChanges,
        scene: &TopicScene,
    ) -> Option<()> {
        host.handle_changes(changes, Instant::ZERO);
        while let Some(event) = host.poll_event() {
            if event == VehicleHostEvent::Persist {
                keeper.save(host.vehicle().durable()).then_some(())?;
                host.handle_persisted();
            }
        }
        self.disk.step(DiskStep::Host).ok()?;
        let epoch = host.vehicle().durable().epoch;
        for (_, label) in host.vehicle().map().iter() {
            let meaning = scene.meaning(label).unwrap();
            let first = *self.published.entry((epoch, label)).or_insert(meaning);
            assert_eq!(first, meaning, "label {label} of epoch {epoch} changed its meaning");
        }
        Some(())
    }

    fn power_cut(&mut self) {
        self.disk.power_cut(DiskRng::new(self.rng.below(1 << 30) as u64));
    }
}

#[test]
fn a_label_keeps_its_meaning_at_any_power_cut() {
    let mut whole = LabelTrial::new(1);
    whole.run().unwrap();
    let steps = whole.disk.steps().len();
    for (cut, seed) in (0..steps).flat_map(|cut| (1..4).map(move |seed| (cut, seed))) {
        let mut trial = LabelTrial::new(seed);
        for after in [cut, steps / 3 + seed as usize, cut / 2] {
            trial.disk.cut_after(after);
            if trial.run().is_none() {
                trial.power_cut();
            }
        }
        trial.disk.cut_after(usize::MAX / 2);
        trial.run().unwrap();
    }
}

#[test]
fn labels_continue_with_a_checkpoint_and_begin_again_without() {
    let mut trial = LabelTrial::new(5);
    trial.run().unwrap();
    trial.run().unwrap();
    trial.disk.put("scene.checkpoint", b"torn");
    trial.run().unwrap();
    assert_eq!(trial.epochs, [0, 0, 1]);
}

#[test]
fn a_checkpoint_of_another_mission_is_not_resumed() {
    let mut trial = LabelTrial::new(6);
    trial.run().unwrap();
    let checkpoint = CheckpointFile::new(trial.disk.clone()).read().unwrap().unwrap();
    trial.disk = Disk::default();
    trial.disk.put("scene.checkpoint", &checkpoint);
    trial.published.clear();
    let before = trial.born;
    trial.run().unwrap();
    assert!(trial.published[&(0, 1)] > before, "a topic of the earlier mission");
}
