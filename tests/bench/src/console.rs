//! Open consoles: what ten of them cost the surface, and how soon they have a map that came in.

use crate::process::{Process, free_port};
use crate::program::ProgramArgument;
use clap::Args;
use scenecast_core::UserError;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const CONSOLES: usize = 10;
/// Time for which the surface is measured without and with the consoles.
const WINDOW: Duration = Duration::from_secs(28);
/// Longest wait for a first map.
const MAP_TIMEOUT: Duration = Duration::from_secs(120);
/// Limits: the consoles' part of a core, and the median time to the whole map in seconds.
const LIMITS: (f64, f64) = (0.1, 0.2);

/// What ten open consoles cost the surface, and how soon they have a map that came in.
///
/// Two processes fly a recorded mission at the pace of the world. The output has the processor time of the surface without
/// and with the consoles, and the time from the arrival of a change until a console has the whole map. Exit code 1 if the
/// consoles take 10 % of a core, or half of the maps come later than 200 ms.
#[derive(Debug, Args)]
#[command(after_help = "Example: scenecast-bench console")]
pub(crate) struct ConsoleBench {
    #[command(flatten)]
    program: ProgramArgument,
}

impl ConsoleBench {
    pub(crate) fn run(self) -> Result<(), UserError> {
        let program = self.program.path()?;
        let dir = std::env::temp_dir().join(format!("scenecast-consoles-{}", std::process::id()));
        std::fs::create_dir_all(&dir).map_err(|e| UserError::file(&dir, e))?;
        let figures = Mission { program, dir: dir.clone() }.measure()?;
        let _ = std::fs::remove_dir_all(&dir);
        figures.print();
        match figures.is_within_limits() {
            true => Ok(()),
            false => Err(UserError::Failed("a limit was exceeded".to_owned())),
        }
    }
}

/// The program, and the folder for its files.
struct Mission {
    program: PathBuf,
    dir: PathBuf,
}

impl Mission {
    fn measure(&self) -> Result<Figures, UserError> {
        let recording = self.record()?;
        let (page, link) = (free_port()?, format!("127.0.0.1:{}", free_port()?));
        let surface =
            self.start("asv", &[format!("console.listen=127.0.0.1:{page}"), format!("modem.listen={link}")])?;
        let source = format!("camera.source=frames:{}", recording.display());
        let _vehicle = self.start("auv", &[format!("modem.connect={link}"), source])?;
        wait_for_map(page)?;
        let alone = share_of_a_core(&surface);
        let ends = Instant::now() + WINDOW + Duration::from_secs(4);
        std::thread::scope(|scope| {
            let consoles: Vec<_> = (0..CONSOLES).map(|_| scope.spawn(move || console(page, ends))).collect();
            std::thread::sleep(Duration::from_secs(1));
            let with = share_of_a_core(&surface);
            let mut late_s = Vec::new();
            for console in consoles {
                let found = console.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
                late_s.extend(found.map_err(|e| UserError::Failed(format!("a console: {e}")))?);
            }
            late_s.sort_by(f64::total_cmp);
            Ok(Figures { alone, with, late_s })
        })
    }

    /// Records a simulated mission; the folder of its frames.
    fn record(&self) -> Result<PathBuf, UserError> {
        let recording = self.dir.join("recording");
        let mut sim = Command::new(&self.program);
        sim.args(["sim", "--duration", "240", "--record"]).arg(&recording).arg("--out").arg(self.dir.join("run"));
        let output = sim.output().map_err(|e| UserError::file(&self.program, e))?;
        let failed = || UserError::Failed(format!("scenecast sim: {}", String::from_utf8_lossy(&output.stderr).trim()));
        output.status.success().then_some(recording).ok_or_else(failed)
    }

    /// Starts an end with its default configuration and these settings.
    fn start(&self, role: &str, sets: &[String]) -> Result<Process, UserError> {
        let config = self.dir.join(format!("{role}.toml"));
        let text = Command::new(&self.program).args(["config", "--role", role]).output();
        let text = text.map_err(|e| UserError::file(&self.program, e))?.stdout;
        std::fs::write(&config, text).map_err(|e| UserError::file(&config, e))?;
        let state = format!("runtime.state_dir=\"{}\"", self.dir.join(role).display());
        let mut end = Command::new(&self.program);
        end.arg(role).arg("--config").arg(config).args(["--set", &state]);
        end.args(sets.iter().flat_map(|set| ["--set", set]));
        Process::start(end.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()))
    }
}

struct Figures {
    /// Parts of a core that the surface takes, without and with the consoles.
    alone: f64,
    with: f64,
    /// Time from the arrival of a change to the whole map, in order, seconds.
    late_s: Vec<f64>,
}

impl Figures {
    /// The time that a `share` of the maps do not exceed, seconds; NaN if no map was fetched.
    fn late_s(&self, share: f64) -> f64 {
        let last = self.late_s.len().max(1) - 1;
        self.late_s.get((last as f64 * share) as usize).copied().unwrap_or(f64::NAN)
    }

    fn is_within_limits(&self) -> bool {
        let (cores, late_s) = LIMITS;
        self.with - self.alone < cores && self.late_s(0.5) <= late_s
    }

    fn print(&self) {
        let (alone, with) = (100.0 * self.alone, 100.0 * self.with);
        println!("surface alone: {alone:.1} % of a core; with {CONSOLES} consoles: {with:.1} %");
        let [median, p95, worst] = [0.5, 0.95, 1.0].map(|share| 1e3 * self.late_s(share));
        println!(
            "{} maps fetched; from arrival to the whole map: median {median:.0} ms, 95th percentile {p95:.0} ms, worst \
             {worst:.0} ms",
            self.late_s.len()
        );
    }
}

fn share_of_a_core(process: &Process) -> f64 {
    let used_s = || process.cpu_s().unwrap_or(0.0);
    let (before, began) = (used_s(), Instant::now());
    std::thread::sleep(WINDOW);
    (used_s() - before) / began.elapsed().as_secs_f64()
}

fn wait_for_map(page: u16) -> Result<(), UserError> {
    let until = Instant::now() + MAP_TIMEOUT;
    let explored = || state(page).and_then(|state| state["vehicles"][0]["map"]["explored_cells"].as_u64());
    while explored().is_none_or(|cells| cells == 0) {
        if Instant::now() > until {
            return Err(UserError::Failed(format!("no map within {MAP_TIMEOUT:?}")));
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    Ok(())
}

/// The state that the page shows; `None` while nobody answers.
fn state(page: u16) -> Option<Value> {
    let mut answer = String::new();
    request(page, "/api/v2/state", "").ok()?.read_to_string(&mut answer).ok()?;
    serde_json::from_str(answer.split_once("\r\n\r\n")?.1).ok()
}

/// Listens until `ends` and fetches each map as the page does; how late each was, seconds.
fn console(page: u16, ends: Instant) -> std::io::Result<Vec<f64>> {
    let mut events = BufReader::new(request(page, "/api/v2/events", "Accept-Encoding: gzip\r\n")?);
    // The mission's clock against ours: no state comes before it was made, so the quickest one tells best.
    let (origin, mut clock) = (Instant::now(), f64::INFINITY);
    let (mut updated, mut late_s, mut first) = (0.0, Vec::new(), true);
    let mut line = String::new();
    while Instant::now() < ends && events.read_line(&mut line)? > 0 {
        if let Some(data) = line.strip_prefix("data: ").filter(|data| data.starts_with("{\"now_s\"")) {
            let state: Value = serde_json::from_str(data)?;
            clock = clock.min(origin.elapsed().as_secs_f64() - state["now_s"].as_f64().unwrap_or(f64::NEG_INFINITY));
            updated = state["vehicles"][0]["map"]["updated_s"].as_f64().unwrap_or(0.0);
        } else if line.starts_with("event: map") {
            let mut map = Vec::new();
            request(page, "/api/v2/vehicles/1/map/tiles", "Accept-Encoding: gzip\r\n")?.read_to_end(&mut map)?;
            // The map that was there before the console has no arrival to be late from.
            if !std::mem::take(&mut first) {
                late_s.push(origin.elapsed().as_secs_f64() - clock - updated);
            }
        }
        line.clear();
    }
    Ok(late_s)
}

fn request(page: u16, path: &str, headers: &str) -> std::io::Result<TcpStream> {
    let mut stream = TcpStream::connect(("127.0.0.1", page))?;
    // HTTP/1.0: no lengths of chunks between the events.
    let head = format!("GET {path} HTTP/1.0\r\nHost: 127.0.0.1:{page}\r\n{headers}\r\n");
    stream.write_all(head.as_bytes())?;
    Ok(stream)
}
