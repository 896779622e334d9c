//! The CPU time of frames over the reef, and the process's memory: `cargo bench -p scenecast-worlds --bench reef`.
#![allow(clippy::disallowed_methods, missing_docs, unreachable_pub)]

#[path = "../../../scene-model/benches/cpu/mod.rs"]
mod cpu;

use cpu::cpu_seconds;
use scenecast_worlds::{Reef, ReefCamera, View};

fn main() {
    for seed in 1..=3 {
        let start = cpu_seconds();
        let mut camera = ReefCamera::new(Reef::new(seed), 0.01);
        let [west, south, east, north] = Reef::SURVEY_M;
        let mut view = View {
            x_m: west,
            y_m: south + 2.0,
            heading_rad: std::f64::consts::FRAC_PI_2,
            altitude_m: 4.0,
            width_px: 640,
            height_px: 480,
            moment: 0,
        };
        camera.frame(&view);
        let first = cpu_seconds() - start;
        // Legs 4 m apart, a frame each metre: 0.5 m/s and a frame every two seconds.
        let mut times = Vec::new();
        while view.y_m < north {
            let step = if view.heading_rad > 0.0 { 1.0 } else { -1.0 };
            view.x_m += step;
            if view.x_m < west || view.x_m > east {
                view.heading_rad = -view.heading_rad;
                view.y_m += 4.0;
            }
            view.moment += 1;
            let start = cpu_seconds();
            camera.frame(&view);
            times.push(1e3 * (cpu_seconds() - start));
        }
        let start = cpu_seconds();
        camera.frame(&view);
        let known = 1e3 * (cpu_seconds() - start);
        times.sort_by(f64::total_cmp);
        let mean = times.iter().sum::<f64>() / times.len() as f64;
        let p95 = times[times.len() * 95 / 100];
        let start = cpu_seconds();
        let mut sum = 0u64;
        for row in 0..100 {
            for column in 0..120 {
                let (x, y) = (west + f64::from(column) * 0.25, south + f64::from(row) * 0.25);
                sum += u64::from(camera.reef().class_of_square(x, y, 0.25));
            }
        }
        let classes = cpu_seconds() - start;
        println!(
            "seed {seed}: first frame {:.0} ms, then {} frames of 640 x 480: mean {mean:.1} ms, p95 {p95:.1} ms, max {:.1} ms, {known:.1} ms over a known floor; \
             classes of 12 000 cells {classes:.2} s (sum {sum})",
            1e3 * first,
            times.len(),
            times.last().copied().unwrap_or(0.0)
        );
    }
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find(|line| line.starts_with("VmHWM"));
    println!("memory: {}", peak.map_or("unknown", |line| line.trim_start_matches("VmHWM:").trim()));
}
