//! The processes of a link: two emulated modems, a vehicle and a surface, and the frames that their records have.

use super::{FaultyEnd, LinkKind, NO_FAULT, PlannedFault, Recovery, plan, until_next};
use crate::process::{Process, free_port};
use scenecast_core::UserError;
use scenecast_files::{mission_records, read_record};
use scenecast_messages::scenecast_msgs::Frame;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, Command, Stdio};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Time after the last fault.
const REST: Duration = Duration::from_secs(30);
/// Time that the emulator needs to make its devices.
const DEVICES: Duration = Duration::from_secs(2);

/// How long a run takes.
pub(super) fn length(seed: u64) -> Duration {
    DEVICES + plan(seed).last().map_or(Duration::ZERO, |fault| fault.at + fault.length) + REST
}

/// Has all faults in a drawn order, and tells when data flowed again after each. The run's files are in `dir`.
pub(super) fn run(
    program: &Path,
    dir: &Path,
    recording: &Path,
    (kind, number, seed): (LinkKind, u32, u64),
) -> Result<Vec<Recovery>, UserError> {
    let fault = |e| UserError::file(dir, e);
    if dir.exists() {
        fs::remove_dir_all(dir).map_err(fault)?;
    }
    fs::create_dir_all(dir).map_err(fault)?;
    let mut link = Link::start(program, dir, recording, kind, seed)?;
    let (faults, began) = (plan(seed), SystemTime::now());
    let mut ends: Vec<(f64, f64)> = Vec::new();
    for PlannedFault { name, end, at, length } in &faults {
        std::thread::sleep((began + *at).duration_since(SystemTime::now()).unwrap_or_default());
        let (seconds, begin_s) = (length.as_secs(), unix_s());
        let seconds = if seconds > 0 { format!(" {seconds}") } else { String::new() };
        if *name != NO_FAULT {
            writeln!(link.commands, "fault {} {name}{seconds}", end.name()).map_err(fault)?;
        }
        ends.push((begin_s, begin_s + length.as_secs_f64()));
    }
    std::thread::sleep(REST);
    link.stop();
    let (ship, vehicle) = (heard(&dir.join("asv"), true)?, heard(&dir.join("auv"), false)?);
    let recovery = |n: usize, fault: &PlannedFault| {
        let until_s = ends.get(n + 1).map_or(f64::INFINITY, |next| next.0);
        let [ship_s, vehicle_s] = [&ship, &vehicle].map(|times| until_next(ends[n].1, times, until_s));
        Recovery { kind, run: number, fault: fault.name.to_owned(), end: fault.end, ship_s, vehicle_s }
    };
    Ok(faults.iter().enumerate().map(|(n, fault)| recovery(n, fault)).collect())
}

fn unix_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

/// The times at which an end had a frame of the other one that it could use, or one with data.
fn heard(state: &Path, with_data: bool) -> Result<Vec<f64>, UserError> {
    let mut times = Vec::new();
    for record in mission_records(&state.join("records"))? {
        read_record(&record, |message| {
            let frame = message.decode::<Frame>().filter(|frame| frame.direction == Frame::RECEIVED);
            let stamp = frame.filter(|frame| !with_data || !frame.contents.is_empty()).map(|frame| frame.header.stamp);
            times.extend(stamp.map(|stamp| f64::from(stamp.sec) + 1e-9 * f64::from(stamp.nanosec)));
        })?;
    }
    times.sort_by(f64::total_cmp);
    Ok(times)
}

struct Link {
    commands: ChildStdin,
    /// The vehicle and the surface, which end before the modems.
    ends: [Process; 2],
    _modems: Process,
}

impl Link {
    fn start(program: &Path, dir: &Path, recording: &Path, kind: LinkKind, seed: u64) -> Result<Self, UserError> {
        let (make, baud, mode) = kind.set_up();
        let scenario = dir.join("modems.toml");
        fs::write(&scenario, scenario_of(make, baud, seed)).map_err(|e| UserError::file(&scenario, e))?;
        let devices = dir.join("devices");
        let mut modems = command(program, dir, "modem-sim")?;
        modems.arg("--scenario").arg(&scenario).arg("--link-dir").arg(&devices).stdin(Stdio::piped());
        let mut modems = Process::start(&mut modems)?;
        let commands = modems.take_input().ok_or_else(|| UserError::Failed("the modems take no commands".into()))?;
        std::thread::sleep(DEVICES);
        let both = [format!("modem.kind={make}"), format!("modem.baud={baud}"), mode.to_owned()];
        let start = |role: &str, device: &str, own: &[String]| {
            let mut end = command(program, dir, role)?;
            let keys = [
                format!("modem.device={}", devices.join(device).display()),
                format!("runtime.state_dir={}", dir.join(role).display()),
            ];
            // All that is not set is as by default.
            let file = dir.join(format!("{role}.toml"));
            fs::write(&file, "").map_err(|e| UserError::file(&file, e))?;
            end.arg("--config").arg(file);
            for key in both.iter().chain(&keys).chain(own) {
                end.arg("--set").arg(key);
            }
            Process::start(&mut end)
        };
        let page = format!("console.listen=127.0.0.1:{}", free_port()?);
        let surface = start("asv", FaultyEnd::Ship.name(), &[page])?;
        let frames = format!("camera.source=frames:{}", recording.display());
        let vehicle = start("auv", FaultyEnd::Auv.name(), &[frames, "survey.start=free".into()])?;
        Ok(Self { commands, ends: [vehicle, surface], _modems: modems })
    }

    fn stop(&mut self) {
        self.ends.iter_mut().for_each(Process::interrupt);
    }
}

/// A command of the program that writes its log into the run's folder.
fn command(program: &Path, dir: &Path, name: &str) -> Result<Command, UserError> {
    let path: PathBuf = dir.join(format!("{name}.log"));
    let log = || File::options().create(true).append(true).open(&path).map_err(|e| UserError::file(&path, e));
    let mut command = Command::new(program);
    command.args(["--progress", "none", name]).stdin(Stdio::null()).stdout(log()?).stderr(log()?);
    Ok(command)
}

/// Two modems a kilometre apart, which lose a frame in fifty.
fn scenario_of(make: &str, baud: u32, seed: u64) -> String {
    let address = |n: u32| if make == "transparent" { String::new() } else { format!("address = {n}\n") };
    let modem =
        |name: &str, own: String| format!("[[modem]]\nname = \"{name}\"\nkind = \"{make}\"\nbaud = {baud}\n{own}");
    let place = "position_m = [1000.0, 0.0, 20.0]\n";
    format!(
        "seed = {seed}\n[channel]\nloss = {{ model = \"independent\", probability = 0.02 }}\n{}{}",
        modem("ship", address(10)),
        modem("auv", address(1) + place)
    )
}
