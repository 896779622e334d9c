//! A vehicle with a live camera, by ROS 2: images that reach the scene model, processor time, memory.

use crate::process::{Process, free_port};
use crate::program::ProgramArgument;
use clap::Args;
use scenecast_config::Ros2;
use scenecast_core::{Takes, UserError};
use scenecast_messages::geometry_msgs::{Point, Pose, Quaternion};
use scenecast_messages::nav_msgs::Odometry;
use scenecast_messages::sensor_msgs::Image;
use scenecast_messages::std_msgs::Header;
use scenecast_rehearsal::{View, World};
use scenecast_ros2::{Publisher, Qos, RosNode, topic};
use std::f64::consts::PI;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Columns and rows of an image.
const SIZE_PX: (u32, u32) = (1360, 1024);

/// Size of a pixel on the sea floor, metres.
const METRES_PER_PIXEL: f64 = 0.004;

/// Speed of the camera, metres a second.
const SPEED_M_S: f64 = 0.5;

/// Length of a leg and distance between two, metres.
const LEGS_M: (f64, f64) = (20.0, 2.5);

/// Longest wait for a peer or a map.
const TIMEOUT: Duration = Duration::from_secs(60);

/// A vehicle and a surface as processes, with images and odometry by ROS 2 over the loopback network without multicast.
///
/// The bench publishes images of 1360 x 1024 pixels of a drawn reef, with odometry, in real time; --peer starts another program
/// that publishes /camera/image_raw and /odometry in the domain of the environment variable ROS_DOMAIN_ID. `mapped` counts the
/// images that reached the scene model, `cores` is the processor time of the vehicle's process over the time of the run:
/// DDS, registration, scene model and link. `late map` is the time from the start of a subscriber at the surface to the map that
/// was published before. Exit code 1 if images were lost, or a limit was exceeded.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench live --images 200")]
pub(crate) struct LiveBench {
    /// Print JSON instead of lines
    #[arg(long)]
    json: bool,
    /// Number of images
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    images: u32,
    /// Images a second
    #[arg(long, value_name = "HZ", default_value_t = 2.0, value_parser = rate)]
    rate: f64,
    /// Shell command of a program that publishes in place of the bench, and ends by itself
    #[arg(long, value_name = "COMMAND")]
    peer: Option<String>,
    #[command(flatten)]
    program: ProgramArgument,
}

fn rate(text: &str) -> Result<f64, Takes> {
    let rate = text.parse::<f64>().ok().filter(|rate| (0.1..=30.0).contains(rate));
    rate.ok_or(Takes("it takes 0.1 to 30 images a second"))
}

#[derive(Debug)]
struct Figures {
    images: u32,
    mapped: u64,
    dropped: u64,
    vehicle_cores: Option<f64>,
    vehicle_mb: Option<f64>,
    late_map_s: Option<f64>,
}

/// Limits of a vehicle's computer.
const LIMITS: (f64, f64, f64) = (1.0, 400.0, 2.0);

impl LiveBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let dir = std::env::temp_dir().join(format!("scenecast-live-{}", std::process::id()));
        std::fs::create_dir_all(&dir).map_err(|e| UserError::file(&dir, e))?;
        let figures = self.measure(&dir)?;
        let _ = std::fs::remove_dir_all(&dir);
        if self.json {
            println!("{}", figures.json());
        } else {
            figures.print();
        }
        match figures.is_within_limits() {
            true => Ok(()),
            false => Err(UserError::Failed("images were lost or a limit was exceeded".to_owned())),
        }
    }

    fn measure(&self, dir: &Path) -> Result<Figures, UserError> {
        let (program, link) = (self.program.path()?, format!("127.0.0.1:{}", free_port()?));
        let start = |role, domain, sets: &[&str]| start(&program, dir, role, domain, sets);
        let domain = (1 + std::process::id() % 95) as u8;
        let settings = Ros2 { domain, networks: vec![[127, 0, 0, 1].into()], ..Ros2::default() };
        let _surface = start("asv", domain, &[&format!("modem.listen={link}")])?;
        let mut vehicle = start(
            "auv",
            domain,
            &[
                &format!("modem.connect={link}"),
                "camera.source=ros2:/camera/image_raw",
                "camera.calibration=none",
                "navigation.source=ros2:/odometry",
                &format!("camera.metres_per_pixel={METRES_PER_PIXEL}"),
                "survey.area_m=[0, 0, 120, 80]",
            ],
        )?;
        let began = Instant::now();
        let cpu_before = vehicle.cpu_s();
        match &self.peer {
            Some(command) => run_peer(command, domain)?,
            None => self.publish(&RosNode::start(&settings, "scenecast_bench")?)?,
        }
        std::thread::sleep(Duration::from_secs(3));
        let cores = vehicle.cpu_s().zip(cpu_before).map(|(now, before)| (now - before) / began.elapsed().as_secs_f64());
        let (memory, late_map_s) = (vehicle.peak_memory_mb(), late_map(&settings)?);
        vehicle.interrupt();
        let (mapped, dropped) = tally(&dir.join("auv.log"))?;
        Ok(Figures { images: self.images, mapped, dropped, vehicle_cores: cores, vehicle_mb: memory, late_map_s })
    }

    fn publish(&self, node: &RosNode) -> Result<(), UserError> {
        let images: Publisher<Image> = node.publisher(&topic("/camera/image_raw")?, Qos::Sensor(5))?;
        let poses: Publisher<Odometry> = node.publisher(&topic("/odometry")?, Qos::Sensor(50))?;
        let until = Instant::now() + TIMEOUT;
        while images.subscribers() == 0 || poses.subscribers() == 0 {
            if Instant::now() > until {
                return Err(UserError::Failed("the vehicle does not subscribe".to_owned()));
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let mut world = World::reef(1, METRES_PER_PIXEL);
        let began = Instant::now();
        for number in 0..self.images {
            let t_s = f64::from(number) / self.rate;
            let (view, header) = (view(t_s, number), header(t_s));
            let data = world.view(&view).into_raw();
            let (width, height) = SIZE_PX;
            let wait = Duration::from_secs_f64(t_s).saturating_sub(began.elapsed());
            std::thread::sleep(wait);
            let image = Image {
                header: header.clone(),
                width,
                height,
                encoding: "rgb8".to_owned(),
                step: 3 * width,
                data,
                ..Image::default()
            };
            images.publish(image);
            poses.publish(odometry(&view, header));
        }
        Ok(())
    }
}

/// The camera's view after `t_s` seconds: legs to the north and to the south.
fn view(t_s: f64, number: u32) -> View {
    let (length_m, apart_m) = LEGS_M;
    let metres = t_s * SPEED_M_S;
    let (leg, along) = ((metres / length_m).floor(), metres % length_m);
    let is_north = leg % 2.0 == 0.0;
    let (width_px, height_px) = SIZE_PX;
    View {
        x_m: 10.0 + apart_m * leg,
        y_m: 20.0 + if is_north { along } else { length_m - along },
        heading_rad: if is_north { 0.0 } else { PI },
        altitude_m: 4.0,
        width_px,
        height_px,
        moment: number.into(),
    }
}

fn header(t_s: f64) -> Header {
    // Any time but zero, which stands for an unknown time.
    let nanos = (t_s * 1e9).round() as i64 + 1_000_000_000_000;
    let mut header = Header::default();
    header.stamp.sec = (nanos / 1_000_000_000) as i32;
    header.stamp.nanosec = (nanos % 1_000_000_000) as u32;
    header
}

fn odometry(view: &View, header: Header) -> Odometry {
    let yaw = PI / 2.0 - view.heading_rad;
    let orientation = Quaternion { z: (yaw / 2.0).sin(), w: (yaw / 2.0).cos(), ..Quaternion::default() };
    let mut odometry = Odometry { header, ..Odometry::default() };
    odometry.pose.pose = Pose { position: Point { x: view.x_m, y: view.y_m, z: -16.0 }, orientation };
    odometry
}

fn run_peer(command: &str, domain: u8) -> Result<(), UserError> {
    let status = Command::new("sh").arg("-c").arg(command).env("ROS_DOMAIN_ID", domain.to_string()).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(UserError::Failed(format!("--peer ended with {status}"))),
        Err(error) => Err(UserError::Failed(format!("--peer: {error}"))),
    }
}

/// Starts an end with an empty configuration and these settings; its messages go to a file.
fn start(program: &Path, dir: &Path, command: &str, domain: u8, sets: &[&str]) -> Result<Process, UserError> {
    let failed = |e: std::io::Error| UserError::Failed(format!("scenecast {command} does not start: {e}"));
    let config = dir.join("empty.toml");
    std::fs::write(&config, "").map_err(failed)?;
    let log = File::create(dir.join(format!("{command}.log"))).map_err(failed)?;
    let common = [
        format!("runtime.state_dir={}", dir.join(command).display()),
        "ros2.enabled=true".to_owned(),
        format!("ros2.domain={domain}"),
        "ros2.networks=[\"127.0.0.1\"]".to_owned(),
        format!("scene.cell_m={}", 25.0 * METRES_PER_PIXEL),
    ];
    let console = (command == "asv").then(|| "console.listen=".to_owned());
    let sets = common.into_iter().chain(console).chain(sets.iter().map(|set| (*set).to_owned()));
    let mut process = Command::new(program);
    process.arg(command).arg("--config").arg(config).args(sets.flat_map(|set| ["--set".to_owned(), set]));
    Process::start(process.stdin(Stdio::null()).stdout(Stdio::null()).stderr(log))
}

/// Seconds until a new subscriber has the operator's map; `None` if it does not come.
fn late_map(settings: &Ros2) -> Result<Option<f64>, UserError> {
    let began = Instant::now();
    let node = RosNode::start(settings, "scenecast_viewer")?;
    let inbox = node.subscribe_label_map(&topic("/scenecast/auv_1/map")?)?;
    Ok(inbox.wait(TIMEOUT).then(|| began.elapsed().as_secs_f64()))
}

/// The numbers of mapped and of dropped images in the vehicle's last line about its camera.
fn tally(log: &Path) -> Result<(u64, u64), UserError> {
    let text = std::fs::read_to_string(log).map_err(|e| UserError::file(log, e))?;
    let line = text.lines().rev().find(|line| line.contains(" images mapped, "));
    let words: Vec<&str> = line.unwrap_or_default().split_whitespace().collect();
    let before = |what: &str| words.iter().position(|word| word.starts_with(what))?.checked_sub(1);
    let number = |at: Option<usize>| at.and_then(|at| words.get(at)?.parse::<u64>().ok());
    let mapped = before("images").and_then(|at| number(Some(at)));
    mapped.zip(number(before("dropped"))).ok_or_else(|| UserError::file(log, "it has no line about the camera"))
}

impl Figures {
    fn is_within_limits(&self) -> bool {
        let (cores, megabytes, late_s) = LIMITS;
        self.mapped == u64::from(self.images)
            && self.vehicle_cores.is_none_or(|used| used < cores)
            && self.vehicle_mb.is_none_or(|held| held < megabytes)
            && self.late_map_s.is_some_and(|s| s < late_s)
    }

    fn json(&self) -> serde_json::Value {
        let Self { images, mapped, dropped, vehicle_cores, vehicle_mb, late_map_s } = self;
        serde_json::json!({
            "images": images, "mapped": mapped, "dropped": dropped,
            "vehicle_cores": vehicle_cores, "vehicle_mb": vehicle_mb, "late_map_s": late_map_s,
        })
    }

    fn print(&self) {
        let or_unknown = |value: Option<f64>, unit: &str| match value {
            Some(value) => format!("{value:.2} {unit}"),
            None => "unknown".to_owned(),
        };
        let (cores, megabytes, late_s) = LIMITS;
        println!("images   {} of {} mapped, {} dropped", self.mapped, self.images, self.dropped);
        println!(
            "vehicle  {} (limit {cores}), {} (limit {megabytes})",
            or_unknown(self.vehicle_cores, "cores"),
            or_unknown(self.vehicle_mb, "MB")
        );
        println!("late map {} (limit {late_s})", or_unknown(self.late_map_s, "s"));
    }
}
