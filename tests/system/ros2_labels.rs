//! Labels and bands of another program in ROS 2, which Cyclone DDS publishes: the operator has them.

use scenecast_tests::{Process, dds_domain, free_port, http, python, scratch, wait_until, workspace};
use serde_json::Value;
use std::path::Path;
use std::process::Command;

/// A surface with its page, and a vehicle with these settings.
struct Ends {
    page: u16,
    _processes: [Process; 2],
}

impl Ends {
    fn start(dir: &Path, domain: u8, sets: &[String]) -> Self {
        let (page, link) = (free_port(), free_port());
        let empty = dir.join("empty.toml");
        std::fs::write(&empty, "").unwrap();
        let state = |who: &str| format!("runtime.state_dir={}", dir.join(who).display());
        let cell = "scene.cell_m=0.5".to_owned();
        let fast = ["link.budget_bps=200000", "modem.bit_rate=200000"].map(str::to_owned);
        let surface = [
            state("asv"),
            format!("modem.listen=127.0.0.1:{link}"),
            format!("console.listen=127.0.0.1:{page}"),
            cell.clone(),
        ];
        let mut vehicle = vec![
            state("auv"),
            format!("modem.connect=127.0.0.1:{link}"),
            "survey.area_m=[-20, -20, 60, 60]".to_owned(),
            cell,
            format!("ros2.domain={domain}"),
            "ros2.networks=[\"127.0.0.1\"]".to_owned(),
        ];
        vehicle.extend(sets.iter().cloned());
        let start = |command: &str, sets: &[String]| {
            let config = [command, "--config", empty.to_str().unwrap()];
            let sets = sets.iter().chain(&fast).flat_map(|set| ["--set", set]);
            Process::start(&config.into_iter().chain(sets).collect::<Vec<_>>())
        };
        Self { page, _processes: [start("asv", &surface), start("auv", &vehicle)] }
    }

    /// The lines of the operator's map: metres east and north, the label, and the band of a name if it is known.
    fn cells(&self, band: &str) -> Vec<(f64, f64, u8, Option<f64>)> {
        let found = http(self.page, "GET", "/api/v2/vehicles/1/map.csv", "", "");
        let Some((200, csv)) = found else { return Vec::new() };
        let text = String::from_utf8(csv).unwrap();
        let head: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
        let column = head.iter().position(|name| name.starts_with(band));
        let cell = |line: &str| {
            let fields: Vec<&str> = line.split(',').collect();
            let number = |at: usize| fields.get(at).and_then(|field| field.parse::<f64>().ok());
            Some((number(0)?, number(1)?, number(2)? as u8, column.and_then(number)))
        };
        text.lines().skip(1).filter_map(cell).collect()
    }
}

/// What a script of ours prints.
fn publish(python: &str, arguments: &[&str]) -> Value {
    let output = Command::new(python).arg(workspace().join("tests/ros2_labels.py")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn grids_and_layers_of_cyclone_dds_reach_the_operator() {
    let Some(python) = python("cyclonedds.domain") else { return };
    let (dir, domain) = (scratch("ros2-grids"), dds_domain());
    let names = dir.join("classes.json");
    std::fs::write(&names, r##"{"kind":"classes","classes":[{"class":77,"name":"kelp","colour":"#104020"}]}"##)
        .unwrap();
    let ends = Ends::start(
        &dir,
        domain,
        &[
            "labels.source=ros2:/labels".to_owned(),
            format!("labels.classes={}", names.display()),
            "bands.source=ros2:/layers".to_owned(),
            "bands.ranges=[\"elevation=-40..10.6\"]".to_owned(),
            "ros2.enabled=true".to_owned(),
        ],
    );
    let said = publish(&python, &["grids", &domain.to_string()]);
    assert!(said["message"].as_str().unwrap().contains("turned by 60"), "{said}");
    assert_eq!(
        (&said["values"]["refused"], &said["values"]["taken"]),
        (&Value::from("2"), &Value::from("3")),
        "{said}"
    );
    let expected = |x: i32, y: i32| match (x, y) {
        (5, 0) => Some(78),
        _ if x == y => None,
        _ => Some((x / 4 + y / 3 * 10 + 1) as u8),
    };
    let all = (0..30).flat_map(|y| (0..40).map(move |x| (x, y)));
    let mut wanted: Vec<(i32, i32, u8)> = all.filter_map(|(x, y)| Some((x, y, expected(x, y)?))).collect();
    wanted.sort_unstable();
    wait_until("the operator has the grid and the layer", || {
        let cells = ends.cells("elevation");
        let place = |metres: f64, corner: f64| ((metres - corner) / 0.5).floor() as i32;
        let mut found: Vec<_> = cells.iter().map(|c| (place(c.0, -2.0), place(c.1, 4.0), c.2)).collect();
        found.sort_unstable();
        let is_band = |c: &(f64, f64, u8, Option<f64>)| {
            c.3.is_some_and(|metres| (metres - (-30.0 + f64::from(place(c.0, -2.0)))).abs() < 0.11)
        };
        found == wanted && cells.iter().all(is_band)
    });
    let (_, labels) = http(ends.page, "GET", "/api/v2/state", "", "").unwrap();
    assert!(String::from_utf8_lossy(&labels).contains("kelp"), "the name of the class is with the operator");
}

#[test]
fn a_segmented_image_of_ros_is_mapped_where_it_was_taken() {
    let Some(python) = python("cyclonedds.domain") else { return };
    let (dir, domain) = (scratch("ros2-segmentation"), dds_domain());
    let ends = Ends::start(
        &dir,
        domain,
        &[
            "labels.source=ros2:/segmentation#Image".to_owned(),
            "labels.metres_per_pixel=0.25".to_owned(),
            "navigation.source=ros2:/odometry".to_owned(),
        ],
    );
    let taken = publish(&python, &["images", &domain.to_string()]);
    let east_m = taken["east_m"].as_f64().unwrap();
    wait_until("the operator has the image", || ends.cells("none").len() >= 16);
    let cells = ends.cells("none");
    let (x_m, y_m) = cells.iter().fold((0.0, 0.0), |(x_m, y_m), cell| (x_m + cell.0, y_m + cell.1));
    let (x_m, y_m) = (x_m / cells.len() as f64, y_m / cells.len() as f64);
    println!("taken at {east_m:.2} m, mapped around {x_m:.2} m");
    assert!((x_m - east_m).abs() < 0.3 && (y_m - 5.0).abs() < 0.3, "{cells:?}");
    assert!(cells.iter().all(|c| c.2 == 5));
}
