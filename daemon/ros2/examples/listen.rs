//! Listens to images, and prints their rate and the cost of receiving them.
//!
//! `cargo run --release -p scenecast-ros2 --example listen -- DOMAIN /camera/image_raw SECONDS [NETWORK]`

use scenecast_config::Ros2;
use scenecast_ros2::{RosNode, topic};
use std::time::{Duration, Instant};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [domain, name, seconds, networks @ ..] = arguments.as_slice() else {
        return Err("usage: listen DOMAIN TOPIC SECONDS [NETWORK]".into());
    };
    let networks = networks.iter().map(|network| network.parse()).collect::<Result<_, _>>()?;
    let node = RosNode::start(&Ros2 { domain: domain.parse()?, networks, ..Ros2::default() }, "listen")?;
    let images = node.subscribe_images(&topic(name)?)?;
    let end = Instant::now() + Duration::from_secs(seconds.parse()?);
    let mut first = None;
    while images.wait(end.saturating_duration_since(Instant::now())) {
        let Some(image) = images.take_newest() else { continue };
        first.get_or_insert_with(|| (Instant::now(), cpu_s()));
        let image = image.message;
        println!(
            "{} x {} {}, {} of {} dropped",
            image.width,
            image.height,
            image.encoding,
            images.dropped(),
            images.received()
        );
    }
    if let Some((since, before)) = first {
        let cores = (cpu_s() - before) / since.elapsed().as_secs_f64();
        println!("{} images, {cores:.3} cores, {:?}", images.received(), node.peers());
    }
    Ok(())
}

/// Processor time of this process, seconds; 0 where the system has no /proc.
fn cpu_s() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    // Fields 14 and 15 of proc(5), in hundredths of a second.
    fields.iter().skip(11).take(2).filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}
