//! Vehicles with live cameras, as processes: the same images and poses give the same map, whatever brings them.

use image::RgbImage;
use scenecast_files::{RecordedFrame, Recording};
use scenecast_rehearsal::{Mission, MissionOptions, World};
use scenecast_tests::{
    Process, RELIEF_CAMERA, dds_domain, free_port, python, recorded, run_script, scratch, state, wait_until,
    write_relief,
};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A dive whose vehicle and surface run as processes.
struct Dive {
    dir: PathBuf,
    frames: Vec<RecordedFrame>,
    map: PathBuf,
    /// Port of the surface's page.
    page: u16,
    processes: [Process; 2],
}

impl Dive {
    /// Starts a surface, and a vehicle with the camera `source` and the poses of the recording in a file.
    fn start(name: &str, source: &dyn Fn(&Path) -> String) -> Self {
        Self::with_settings(name, &|dir| {
            vec![
                format!("camera.source={}", source(dir)),
                format!("navigation.source=tum:{}", dir.join("poses.txt").display()),
            ]
        })
    }

    /// Starts a surface, and a vehicle with these settings.
    fn with_settings(name: &str, sets: &dyn Fn(&Path) -> Vec<String>) -> Self {
        let dir = scratch(name);
        let frames = Recording::open(&recorded().0, None, 0.01).unwrap().frames;
        let poses = dir.join("poses.txt");
        std::fs::write(&poses, tum_lines(&frames)).unwrap();
        let (port, page) = (free_port(), free_port());
        let state = |who: &str| format!("runtime.state_dir={}", dir.join(who).display());
        let console = format!("console.listen=127.0.0.1:{page}");
        let surface = [state("asv"), format!("modem.listen=127.0.0.1:{port}"), console];
        let mut vehicle = vec![
            state("auv"),
            format!("modem.connect=127.0.0.1:{port}"),
            "survey.area_m=[-10, -10, 60, 60]".to_owned(),
        ];
        vehicle.extend(sets(&dir));
        let empty = dir.join("empty.toml");
        std::fs::write(&empty, "").unwrap();
        let start = |command: &str, sets: &[String]| {
            let config = [command, "--config", empty.to_str().unwrap()];
            let sets = sets.iter().flat_map(|set| ["--set", set]);
            let log = dir.join(format!("{command}.log"));
            Process::start_logged(&config.into_iter().chain(sets).collect::<Vec<_>>(), &log)
        };
        let processes = [start("asv", &surface), start("auv", &vehicle)];
        Self { map: dir.join("asv/operator-map-1.png"), dir, frames, page, processes }
    }

    fn log(&self) -> String {
        std::fs::read_to_string(self.dir.join("auv.log")).unwrap_or_default()
    }

    /// Writes images into the camera's folder at the vehicle's pace, from the first one on: a busy machine drops none.
    fn write_at_its_pace(&self, first: usize, frames: &[RecordedFrame]) {
        wait_until("the vehicle looks at the folder", || self.log().contains("camera: open"));
        for (index, frame) in (first..).zip(frames) {
            self.write_after(index, frame);
        }
    }

    /// Writes an image once those before it are with the scene model.
    fn write_after(&self, before: usize, frame: &RecordedFrame) {
        wait_until("the images before are mapped", || self.log().matches(MAPPED).count() >= before);
        self.write_slowly(frame);
    }

    /// Writes an image into the camera's folder as a slow program does: the file stays half written for a moment.
    fn write_slowly(&self, frame: &RecordedFrame) {
        let bytes = std::fs::read(frame.image.file().unwrap()).unwrap();
        let path = self.dir.join(format!("camera/{:.9}.png", frame.t_s));
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        std::thread::sleep(PACE / 2);
        std::fs::write(&path, &bytes).unwrap();
        std::thread::sleep(PACE / 2);
    }

    /// The faults of the vehicle that the page shows.
    fn faults(&self) -> Option<Vec<String>> {
        let status = state(self.page)?["vehicles"][0]["status"].clone();
        let texts = status["faults"].as_array()?.iter().filter_map(|fault| fault["text"].as_str());
        Some(texts.map(str::to_owned).collect())
    }

    fn assert_map_of_the_rehearsal(&self) {
        self.assert_map(&recorded().1);
    }

    /// Ends the vehicle and reads its log.
    fn log_of_vehicle(&mut self) -> String {
        assert_eq!(self.processes[1].interrupt(), Some(0));
        self.log()
    }

    fn assert_map(&self, expected: &[u8]) {
        wait_until("the map equals the one of the rehearsal", || {
            std::fs::read(&self.map).is_ok_and(|png| png == expected)
        });
    }
}

/// Poses of a camera that looks down, in the format of the TUM benchmark.
fn tum_lines(frames: &[RecordedFrame]) -> String {
    frames.iter().fold(String::new(), |mut text, frame| {
        let half = frame.heading_rad / 2.0;
        let (x, y) = (half.cos(), -half.sin());
        let _ = writeln!(text, "{:.9} {} {} {} {x} {y} 0 0", frame.t_s, frame.x_m, frame.y_m, -frame.depth_m);
        text
    })
}

/// A PPM that says when it was taken.
fn stamped_ppm(image: &RgbImage, t_s: f64) -> Vec<u8> {
    let (width, height) = image.dimensions();
    [format!("P6\n# stamp={t_s:.9}\n{width} {height}\n255\n").as_bytes(), image.as_raw()].concat()
}

/// Shortest time between two images.
const PACE: Duration = Duration::from_millis(250);

/// What the log of a vehicle says of each image that it maps.
const MAPPED: &str = "goes to the scene model";

#[test]
fn images_written_to_a_folder_give_the_map_of_the_recording() {
    let dive = Dive::start("watch", &|dir| {
        let camera = dir.join("camera");
        std::fs::create_dir_all(&camera).unwrap();
        format!("watch:{}", camera.display())
    });
    dive.write_at_its_pace(0, &dive.frames);
    dive.assert_map_of_the_rehearsal();
}

#[test]
fn a_camera_that_stalls_is_reported_and_the_map_is_the_same() {
    // SCENECAST_STALL_S=30 is the long run.
    let stall_s = std::env::var("SCENECAST_STALL_S").map_or(6.0, |text| text.parse().unwrap());
    let dive = Dive::with_settings("stall", &|dir| {
        let camera = dir.join("camera");
        std::fs::create_dir_all(&camera).unwrap();
        let poses = format!("navigation.source=tum:{}", dir.join("poses.txt").display());
        vec![format!("camera.source=watch:{}", camera.display()), poses, "camera.timeout_s=2".to_owned()]
    });
    let (before, _) = dive.frames.split_at(dive.frames.len() / 2);
    dive.write_at_its_pace(0, before);
    let began = Instant::now();
    let is_silent = || dive.faults().map(|faults| faults.iter().any(|fault| fault == "no image comes in"));
    wait_until("the page shows that no image comes in", || is_silent() == Some(true));
    std::thread::sleep(Duration::from_secs_f64(stall_s).saturating_sub(began.elapsed()));
    let resumed = Instant::now();
    let (mut index, mut is_over) = (before.len(), false);
    while !is_over {
        let frame = dive.frames.get(index).expect("the page shows images again before the last one");
        dive.write_after(index, frame);
        index += 1;
        let limit = Instant::now() + Duration::from_secs(1);
        while !is_over && Instant::now() < limit {
            is_over = is_silent() == Some(false);
            std::thread::sleep(PACE / 10);
        }
    }
    let shown_s = resumed.elapsed().as_secs_f64();
    println!("a stall of {stall_s} s; the page showed images again after {shown_s:.1} s");
    dive.write_at_its_pace(index, &dive.frames[index..]);
    dive.assert_map_of_the_rehearsal();
}

#[test]
fn images_of_a_command_give_the_map_of_the_recording() {
    let dive = Dive::with_settings("command", &|dir| {
        let frames = Recording::open(&recorded().0, None, 0.01).unwrap().frames;
        for (index, frame) in frames.iter().enumerate() {
            let path = dir.join(format!("{index:03}.ppm"));
            std::fs::write(path, stamped_ppm(&frame.image.read().unwrap(), frame.t_s)).unwrap();
        }
        // The command ends once and is started again where it was; each image is written once, at the vehicle's pace.
        let script = "cd DIR && for f in *.ppm; do cat $f; rm $f; sleep PACE; \
            until [ $((1$(basename $f .ppm) - 1000)) -lt $(grep -c 'MAPPED' auv.log) ]; do sleep PACE; done; \
            case $f in 010*) exit 1;; esac; done; sleep 600";
        let script = script.replace("DIR", &dir.display().to_string()).replace("MAPPED", MAPPED);
        let script = script.replace("PACE", &PACE.as_secs_f64().to_string());
        // A command that waits for a busy machine is not started again.
        let mut sets = vec![format!("camera.source=command:{script}"), "camera.timeout_s=300".to_owned()];
        sets.push(format!("navigation.source=tum:{}", dir.join("poses.txt").display()));
        sets
    });
    dive.assert_map_of_the_rehearsal();
}

fn assert_topics_give_the_map(name: &str, domain: u8, (topic, poses): (&str, &str), publishers: &[&[&str]]) {
    let Some(python) = python("cyclonedds.domain, PIL") else { return };
    let dive = Dive::with_settings(name, &|_| {
        vec![
            format!("camera.source=ros2:{topic}"),
            "camera.calibration=none".to_owned(),
            format!("navigation.source={poses}"),
            format!("ros2.domain={domain}"),
            "ros2.networks=[\"127.0.0.1\"]".to_owned(),
        ]
    });
    let folder = recorded().0.display().to_string();
    let domain = domain.to_string();
    for options in publishers {
        let log = dive.dir.join("auv.log").display().to_string();
        let arguments = [&[folder.as_str(), "--domain", &domain, "--log", &log], *options].concat();
        run_script(&python, "tests/ros2_camera.py", &arguments);
    }
    dive.assert_map_of_the_rehearsal();
}

/// Raw images, and their odometry.
const TOPICS: (&str, &str) = ("/camera/image_raw", "ros2:/odometry");

#[test]
fn topics_of_cyclone_dds_give_the_map_of_the_recording() {
    assert_topics_give_the_map("ros2", dds_domain(), TOPICS, &[&[]]);
}

#[test]
fn transforms_of_ros_give_the_map_of_the_recording() {
    let topics = ("/camera/image_raw", "tf:world#base_link");
    assert_topics_give_the_map("ros2-transforms", dds_domain(), topics, &[&["--transforms"]]);
}

#[test]
fn wrong_images_and_publisher_restarts_do_not_change_the_map() {
    let runs: [&[&str]; 2] = [&["--faulty", "--rows", ":15", "--rest", "0"], &["--faulty", "--rows", "15:"]];
    assert_topics_give_the_map("ros2-faults", dds_domain(), TOPICS, &runs);
}

#[test]
fn compressed_cyclone_dds_topics_give_the_map_of_the_recording() {
    assert_topics_give_the_map(
        "ros2-compressed",
        dds_domain(),
        ("/camera/image_raw/compressed", TOPICS.1),
        &[&["--compressed"]],
    );
}

/// Settings of a camera that sees the made-up relief.
const RELIEF: [&str; 3] = ["registration.enabled=false", "survey.altitude_m=4", "scene.cell_m=0.25"];

/// A vehicle that sees the relief by topics of Cyclone DDS, and the map that `sim` makes of the same sequence; `None` without
/// Python.
fn relief_by_dds(name: &str, domain: u8, depth: &str, options: &[&str]) -> Option<(Dive, Vec<u8>)> {
    let python = python("cyclonedds.domain, PIL")?;
    let folder = scratch(&format!("{name}-rgbd"));
    write_relief(&folder);
    let matrix = RELIEF_CAMERA.map(|number| number.to_string()).join(",");
    let tum = [format!("camera.source=tum:{}", folder.display()), format!("camera.matrix=[{matrix}]")];
    let sets = RELIEF.iter().chain(&["operator.script=none", "survey.duration_s=90"]).map(|set| (*set).to_owned());
    let config = scenecast_config::load(None, &sets.chain(tum).collect::<Vec<_>>()).unwrap();
    let mission = MissionOptions { world: World::patches(2, 0.01), seed: 1, record: None };
    let mut mission = Mission::new(config, mission).unwrap();
    mission.run(Duration::from_secs(3600), &mut |_| Ok(())).unwrap();
    let expected = scenecast_core::label_picture::encode(mission.vehicle().map()).unwrap();
    let dive = Dive::with_settings(name, &|_| {
        let sets = RELIEF.iter().map(|set| (*set).to_owned());
        let topics = ["camera.source=ros2:/camera/image_raw", depth, "navigation.source=ros2:/odometry"];
        let topics = topics.iter().chain(&["ros2.networks=[\"127.0.0.1\"]"]).map(|set| (*set).to_owned());
        sets.chain(topics).chain([format!("ros2.domain={domain}")]).collect()
    });
    let (folder, domain) = (folder.display().to_string(), domain.to_string());
    let log = dive.dir.join("auv.log").display().to_string();
    let arguments = [&[folder.as_str(), "--domain", &domain, "--matrix", &matrix, "--log", &log], options].concat();
    run_script(&python, "tests/ros2_rgbd.py", &arguments);
    Some((dive, expected))
}

#[test]
fn depth_and_calibration_by_dds_give_the_map_of_the_rehearsal() {
    let Some((mut dive, expected)) = relief_by_dds("ros2-depth", dds_domain(), "camera.depth=ros2:/camera/depth", &[])
    else {
        return;
    };
    dive.assert_map(&expected);
    let log = dive.log_of_vehicle();
    assert!(log.contains("18 images mapped, 0 dropped") && !log.contains("no depth"), "{log}");
}

#[test]
fn images_without_a_cloud_are_counted_and_mapped_flat() {
    let options = ["--cloud", "--without", "3,7"];
    let Some((mut dive, expected)) =
        relief_by_dds("ros2-cloud", dds_domain(), "camera.depth=cloud:/camera/points", &options)
    else {
        return;
    };
    let cells = |png: &[u8]| scenecast_core::label_picture::decode(png, 0, 0).map_or(0, |map| map.explored());
    wait_until("the map has as many cells as the one of the rehearsal", || {
        std::fs::read(&dive.map).is_ok_and(|png| cells(&png) > cells(&expected) * 19 / 20)
    });
    let log = dive.log_of_vehicle();
    assert!(log.contains("18 images mapped, 0 dropped; beside these: no depth at its time 2"), "{log}");
}

/// A bag of the recording, which rosbags writes; `None` without Python.
fn bag(name: &str, options: &[&str]) -> Option<String> {
    let python = python("rosbags.rosbag2, PIL")?;
    let bag = scratch(name).join("bag").display().to_string();
    let folder = recorded().0.display().to_string();
    run_script(&python, "tests/python/write_bag.py", &[&[folder.as_str(), &bag], options].concat());
    Some(bag)
}

#[test]
fn a_bag_of_ros_gives_the_map_of_the_recording_at_sea() {
    let Some(bag) = bag("bag", &[]) else { return };
    let sets = vec![format!("camera.source=bag:{bag}"), "runtime.time_scale=20".to_owned()];
    Dive::with_settings("bag-dive", &|_| sets.clone()).assert_map_of_the_rehearsal();
}

#[test]
fn a_bag_of_compressed_images_gives_the_map_in_rehearsal() {
    let Some(bag) = bag("bag-compressed", &["--compressed"]) else { return };
    let sets = ["operator.script=none", "survey.duration_s=90", &format!("camera.source=bag:{bag}")];
    let config = scenecast_config::load(None, &sets.map(str::to_owned)).unwrap();
    let options = MissionOptions { world: World::patches(2, 0.01), seed: 1, record: None };
    let mut mission = Mission::new(config, options).unwrap();
    mission.run(Duration::from_secs(3600), &mut |_| Ok(())).unwrap();
    let map = scenecast_core::label_picture::encode(mission.vehicle().map()).unwrap();
    assert!(map == recorded().1, "the maps differ");
}
