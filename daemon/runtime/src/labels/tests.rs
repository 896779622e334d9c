use super::feed::{Answer, LabelQueue};
use super::*;
use crate::checkpoint::CheckpointFile;
use crate::journal::Folder;
use scenecast_labels::{Ground, Raster};
use scenecast_protocol::time::Instant as MissionTime;
use scenecast_vehicle::LabelChanges;
use std::path::PathBuf;
use std::sync::mpsc::sync_channel;

fn config(sets: &[&str]) -> Config {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    scenecast_config::load(None, &sets).unwrap()
}

const CONFIG: [&str; 2] = ["scene.cell_m=0.5", "labels.source=dir:labels"];

/// The thread with a queue, and its clock at 100 s.
struct Bench {
    dir: PathBuf,
    queue: LabelQueue,
    thread: LabelThread,
}

impl Bench {
    fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("scenecast-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        let file = CheckpointFile::of_labels(Folder::hold(&dir).unwrap());
        let keep = Keep { file, lineage: 7, every_s: 60.0, last_s: None, is_refused: false };
        let (queue, feed) = LabelQueue::new();
        let map = ForeignMap::new(&config(&CONFIG), 3);
        let feeds = Feeds::new(vec![(ForeignSource::Labels, feed)]);
        let clock = Clock::starting_at(MissionTime::from_secs_f64(100.0), 1.0);
        Self { dir, queue, thread: LabelThread::start(map, &[], feeds, keep, clock).unwrap() }
    }

    fn give(&self, item: Item, at: Option<Instant>) -> Answer {
        let (answer, answered) = sync_channel(1);
        let arrived = Arrived { origin: "here".to_owned(), mark: None, at, item: Ok(item), answer: Some(answer) };
        assert!(self.queue.push(arrived));
        answered.recv().unwrap()
    }

    fn place(&self, x_m: f64, t_s: f64) {
        let pose = ImagePose { x_m, y_m: 0.25, depth_m: 5.0, heading_rad: 0.0 };
        self.thread.handle_pose(pose, MissionTime::from_secs_f64(t_s));
    }

    /// The next map; earlier reports on checkpoints are skipped.
    fn map(&mut self) -> MapChanges {
        loop {
            match self.thread.mapped.blocking_recv().unwrap() {
                FromLabels::Mapped(update, _) => return *update,
                FromLabels::Checkpoint { .. } => {}
            }
        }
    }

    fn kept(&self) -> ForeignMap {
        let bytes = std::fs::read(self.dir.join("labels.checkpoint")).unwrap();
        ForeignMap::restore(&config(&CONFIG), &bytes).unwrap().0
    }

    /// Ends the thread and removes its files.
    fn cut(self) {
        self.thread.finish();
        std::fs::remove_dir_all(&self.dir).unwrap();
    }
}

fn image(time: ItemTime) -> Item {
    let classes = Raster { width: 1, height: 1, values: vec![0] };
    Item { time, classes: Vec::new(), content: Content::Image { pose: None, metres_per_pixel: Some(0.1), classes } }
}

fn named(class: u8, name: &str) -> Item {
    let classes = Raster { width: 1, height: 1, values: vec![class] };
    let ground = Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 };
    let entry = ClassEntry::new(class + 1, name, None).unwrap();
    Item { time: ItemTime::Arrival, classes: vec![entry], content: Content::Grid { ground, classes } }
}

#[test]
fn an_image_without_a_pose_is_mapped_where_it_was_taken() {
    let mut bench = Bench::new("own-pose");
    let now = || Some(Instant::now());
    let unknown = bench.give(image(ItemTime::Arrival), now()).unwrap_err().to_string();
    assert!(unknown.contains("does not know its own"), "{unknown}");
    for (x_m, t_s) in [(0.25, 90.0), (20.25, 94.0), (50.25, 98.0), (60.25, 100.0)] {
        bench.place(x_m, t_s);
    }
    let column = |bench: &mut Bench| {
        let LabelChanges { cells, .. } = bench.map().labels.unwrap();
        bench.thread.handle_taken(Instant::now());
        cells.iter().map(|(cell, _)| cell.x).collect::<Vec<_>>()
    };
    bench.give(image(ItemTime::Mission(92.0)), now()).unwrap();
    assert_eq!(column(&mut bench), [20]);
    bench.give(image(ItemTime::Arrival), now()).unwrap();
    assert_eq!(column(&mut bench), [120], "the other cell is there already");
    bench.give(image(ItemTime::Age(0.0)), now()).unwrap();
    let late = [ItemTime::Mission(80.0), ItemTime::Mission(3e4), ItemTime::Age(50.0), ItemTime::Unix(1e9)];
    let late = late.into_iter().map(|time| (time, now()));
    for (late, at) in late.chain([(ItemTime::Arrival, None), (ItemTime::Mission(92.0), None)]) {
        let refused = bench.give(image(late), at).unwrap_err().to_string();
        assert!(refused.contains("does not know its own"), "{refused}");
    }
    bench.cut();
}

#[test]
fn a_name_is_in_the_checkpoint_before_the_surface_has_it() {
    let mut bench = Bench::new("kept-names");
    for (class, name) in [(3, "sand"), (4, "rock")] {
        bench.give(named(class, name), Some(Instant::now())).unwrap();
        let update = bench.map();
        bench.thread.handle_taken(Instant::now());
        assert!(update.classes.iter().any(|entry| entry.name() == name));
        // The power fails here.
        let mut restored = bench.kept();
        assert!(restored.handle_item(&named(class, "mud"), ForeignSource::Labels, None, 0.0).is_err());
    }
    bench.cut();
}

#[test]
fn names_that_the_disk_refuses_do_not_go_up() {
    let mut bench = Bench::new("refused-names");
    let in_the_way = bench.dir.join("labels.checkpoint.part");
    std::fs::create_dir_all(&in_the_way).unwrap();
    bench.give(named(3, "sand"), Some(Instant::now())).unwrap();
    let update = bench.map();
    assert_eq!((update.labels.unwrap().cells.len(), update.classes), (1, Vec::new()));
    std::fs::remove_dir(&in_the_way).unwrap();
    bench.cut();
}

#[test]
fn the_next_map_waits_until_the_last_one_is_handled() {
    let mut bench = Bench::new("one-by-one");
    bench.give(named(1, "sand"), Some(Instant::now())).unwrap();
    assert_eq!(bench.map().classes.len(), 1);
    for class in 2..8 {
        bench.give(named(class, &format!("class {class}")), Some(Instant::now())).unwrap();
    }
    assert!(bench.thread.mapped.try_recv().is_err());
    bench.thread.handle_taken(Instant::now());
    assert_eq!(bench.map().classes.len(), 7, "all that came meanwhile");
    bench.cut();
}

#[test]
fn images_move_the_vehicle_only_if_nothing_else_does() {
    let live = ["camera.source=watch:/tmp", "navigation.source=ros2:/pose"];
    let foreign = |sets: &[&str]| config(&[&["labels.source=dir:/tmp"], sets].concat());
    assert!(move_the_vehicle(&foreign(&[])) && !move_the_vehicle(&config(&[])));
    assert!(!move_the_vehicle(&foreign(&live)));
    assert!(!move_the_vehicle(&foreign(&["autopilot.kind=rehearsal"])));
}

#[test]
fn a_large_map_comes_in_slices_and_refusals_are_known() {
    let mut bench = Bench::new("slices");
    let classes = Raster { width: 300, height: 200, values: vec![4; 60_000] };
    let ground = Ground { west_m: 0.0, south_m: 0.0, cell_m: 0.5 };
    let large = Item { time: ItemTime::Arrival, classes: Vec::new(), content: Content::Grid { ground, classes } };
    bench.give(large, Some(Instant::now())).unwrap();
    let mut slices = Vec::new();
    while slices.iter().sum::<usize>() < 60_000 {
        slices.push(bench.map().labels.unwrap().cells.len());
        bench.thread.handle_taken(Instant::now());
    }
    assert!(slices.len() > 5 && slices.iter().all(|&cells| cells < SLICE + 256), "{slices:?}");
    bench.give(image(ItemTime::Arrival), Some(Instant::now())).unwrap_err();
    let health = bench.thread.health();
    assert_eq!((health.taken, health.refused, health.is_failing, health.is_missing), (1, 1, true, false));
    assert!(health.last_refusal.unwrap().starts_with("here: the pose is missing"));
    bench.cut();
}
