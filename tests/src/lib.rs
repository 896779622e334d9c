//! Harness of the whole-system tests.

pub mod pages;
mod recorded;
mod relief;

pub use recorded::recorded;
pub use relief::{RELIEF_CAMERA, is_on_block, relief_depth_m, write_relief};

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// The `scenecast` command that was built with this test or bench.
///
/// # Panics
///
/// If there is none beside the test. Cargo builds it for the tests of the package `scenecast`.
pub fn scenecast() -> Command {
    let test = std::env::current_exe().expect("a test has a path");
    let profile = test.parent().and_then(Path::parent).expect("target/PROFILE/deps/TEST");
    let program = profile.join("scenecast");
    assert!(program.exists(), "{} is missing: cargo build -p scenecast", program.display());
    Command::new(program)
}

pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ has a parent").to_owned()
}

/// Whether `.ci/full` runs the tests: all cases, and the limits of time that hold on a quiet machine only.
pub fn is_full() -> bool {
    std::env::var_os("SCENECAST_FULL").is_some()
}

/// The shared test material, if this machine has it; otherwise the test is skipped.
pub fn shared_data() -> Option<PathBuf> {
    let dir = workspace().join("../shared/data");
    if dir.is_dir() {
        return Some(dir);
    }
    skip(&format!("{} is not on this machine", dir.display()));
    None
}

/// Says on the terminal that a test is skipped, which `.ci/run` takes for a failure.
pub fn skip(why: &str) {
    let line = format!("SKIPPED: {why}\n");
    assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "{line}");
    // The harness hides the captured output of a test that passes.
    let _ = std::io::stderr().write_all(line.as_bytes());
}

/// Without a record in the present folder.
pub const UNRECORDED: [&str; 2] = ["--set", "record.enabled=false"];

/// Settings of a sea floor and of images that cost a machine a quarter of the usual ones.
pub const LIGHT: [&str; 6] =
    ["--set", "world.kind=patches", "--set", "camera.width_px=320", "--set", "camera.height_px=240"];

/// A demo at a speed, with more arguments, that leaves no record. Its sea floor and its images cost a machine a quarter of the usual ones.
pub fn demo(port: u16, speed: u32, more: &[&str]) -> Process {
    let (port, speed) = (port.to_string(), speed.to_string());
    Process::start(&[&["demo", "--port", &port, "--speed", &speed][..], &UNRECORDED, &LIGHT, more].concat())
}

/// Runs a command to its end.
pub fn run(arguments: &[&str]) -> Output {
    scenecast().args(arguments).output().expect("scenecast runs")
}

/// Runs a command that must end with exit code 2 and one clear line that holds every word.
pub fn assert_refused(arguments: &[&str], words: &[&str]) {
    let output = run(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.trim().lines().count(), 1, "{said}");
    for word in words {
        assert!(said.contains(word), "{word:?} is missing in: {said}");
    }
    assert!(!said.contains("panicked"));
}

/// A new folder for a test, emptied if it was there.
pub fn scratch(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("scenecast-{}-{name}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    std::fs::create_dir_all(&dir).expect("the temporary folder can be written");
    dir
}

/// A process that ends with the test. If the test fails, the end of its log is printed.
pub struct Process(Child, Option<PathBuf>);

impl Process {
    pub fn start(arguments: &[&str]) -> Self {
        let child = scenecast().args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        Self(child.expect("scenecast starts"), None)
    }

    /// Starts it with its log in a file, which has a line for each image that goes to the scene model.
    pub fn start_logged(arguments: &[&str], log: &Path) -> Self {
        let file = std::fs::File::create(log).expect("the log can be written");
        let levels = "info,ros2_client=off,rustdds=error,zenoh=warn,scenecast_runtime::camera=debug";
        let mut process = scenecast();
        let child = process.env("RUST_LOG", levels).args(arguments).stdout(Stdio::null()).stderr(file).spawn();
        Self(child.expect("scenecast starts"), Some(log.to_owned()))
    }

    /// Kills it as a power cut would.
    pub fn kill(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }

    /// Memory that it holds, bytes; `None` where the system does not tell.
    pub fn memory_bytes(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.0.id())).ok()?;
        let resident = status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
        let kilobytes: u64 = resident.trim().trim_end_matches("kB").trim().parse().ok()?;
        Some(kilobytes * 1024)
    }

    /// Asks it to read its configuration again.
    pub fn hang_up(&self) {
        signal(&self.0, "HUP");
    }

    /// Interrupts it as a person would; its exit code.
    pub fn interrupt(&mut self) -> Option<i32> {
        end(&mut self.0, "INT")
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        const LINES: usize = 20;
        if let Some(log) = self.1.as_ref().filter(|_| std::thread::panicking()) {
            let text = std::fs::read_to_string(log).unwrap_or_default();
            let lines: Vec<_> = text.lines().collect();
            eprintln!("{} ends with:\n{}", log.display(), lines[lines.len().saturating_sub(LINES)..].join("\n"));
            eprintln!("it {}", if matches!(self.0.try_wait(), Ok(None)) { "was running" } else { "had ended" });
        }
        self.kill();
    }
}

/// Sends a signal to a process and waits until it has ended; its exit code.
pub fn end(child: &mut Child, name: &str) -> Option<i32> {
    signal(child, name);
    let mut status = None;
    wait_until(&format!("the process ends at SIG{name}"), || {
        status = child.try_wait().expect("a child can be waited for");
        status.is_some()
    });
    status.and_then(|s| s.code())
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
    assert!(sent.is_ok_and(|s| s.success()), "the process can be signalled");
}

/// After this time a condition counts as never met. It is no limit of a process: beside 24 busy loops each takes 12 times as long.
pub const GIVEN_UP: Duration = Duration::from_secs(300);

/// Waits for processes until `done`.
pub fn wait_until(what: &str, mut done: impl FnMut() -> bool) {
    let began = Instant::now();
    while !done() {
        assert!(began.elapsed() < GIVEN_UP, "{what}: not within {GIVEN_UP:?}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// A domain of DDS that no other test of this process has. Domains above 100 have ports that the system gives to clients.
pub fn dds_domain() -> u8 {
    static TAKEN: AtomicU32 = AtomicU32::new(0);
    let number = std::process::id() * 31 + TAKEN.fetch_add(1, Ordering::Relaxed);
    (1 + number % 99) as u8
}

/// A port of this machine that nobody listens on, and that no other test of this process gets. It is none of those that the
/// system gives to clients, which may take one before its server starts.
///
/// # Panics
///
/// If all are taken.
pub fn free_port() -> u16 {
    const PORTS: std::ops::Range<u32> = 20_000..32_000;
    static TAKEN: AtomicU32 = AtomicU32::new(0);
    let first = std::process::id() * 31;
    let next = || PORTS.start + first.wrapping_add(TAKEN.fetch_add(1, Ordering::Relaxed)) % PORTS.len() as u32;
    let is_free = |port: &u16| {
        let address = ("127.0.0.1", *port);
        TcpListener::bind(address).is_ok() && UdpSocket::bind(address).is_ok()
    };
    PORTS.filter_map(|_| u16::try_from(next()).ok()).find(is_free).expect("a port is free")
}

/// One HTTP request; status and body, `None` while nobody answers.
pub fn http(port: u16, method: &str, path: &str, headers: &str, body: &str) -> Option<(u16, Vec<u8>)> {
    let mut answer = exchange(port, method, path, headers, body)?;
    let split = answer.windows(4).position(|w| w == b"\r\n\r\n")?;
    let status = std::str::from_utf8(answer.get(9..12)?).ok()?.parse().ok()?;
    Some((status, answer.split_off(split + 4)))
}

/// One HTTP request; the answer with its head, as text.
pub fn http_whole(port: u16, method: &str, path: &str, headers: &str, body: &str) -> Option<String> {
    exchange(port, method, path, headers, body).map(|answer| String::from_utf8_lossy(&answer).into_owned())
}

fn exchange(port: u16, method: &str, path: &str, headers: &str, body: &str) -> Option<Vec<u8>> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    stream.set_read_timeout(Some(Duration::from_secs(10))).ok()?;
    let length = body.len();
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\nContent-Length: {length}\r\n"
    );
    stream.write_all(format!("{head}{headers}\r\n{body}").as_bytes()).ok()?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).ok()?;
    Some(answer)
}

/// A Python that can import these modules of `tests/python/requirements.txt`: that of `SCENECAST_PYTHON`, or else `python3`. Without
/// it the test is skipped.
pub fn python(modules: &str) -> Option<String> {
    let python = std::env::var("SCENECAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let output = Command::new(&python).args(["-c", &format!("import {modules}")]).output();
    if output.is_ok_and(|o| o.status.success()) {
        return Some(python);
    }
    skip(&format!("{python} cannot import {modules} (tests/python/requirements.txt; SCENECAST_PYTHON names another)"));
    None
}

/// Runs a script to its end, and returns its output; fails with what it said if it fails.
pub fn run_script(program: &str, script: &str, arguments: &[&str]) -> String {
    let mut command = Command::new(program);
    let output = command.arg(workspace().join(script)).args(arguments).output();
    let output = output.unwrap_or_else(|e| panic!("{program}: {e}"));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{script}: {said}{}", String::from_utf8_lossy(&output.stderr));
    said
}

/// The state that a surface on `port` tells, once it does.
pub fn state(port: u16) -> Option<serde_json::Value> {
    let (status, body) = http(port, "GET", "/api/v2/state", "", "")?;
    (status == 200).then(|| serde_json::from_slice(&body).ok()).flatten()
}

/// Whether this machine cannot show the page in a browser; then the test is skipped.
pub fn lacks_browser() -> bool {
    let chromium = std::env::var("CHROMIUM").unwrap_or_else(|_| "/usr/bin/chromium-headless-shell".to_owned());
    let packages = workspace().join("tests/browser/node_modules/playwright-core");
    let missing = match () {
        () if !Path::new(&chromium).exists() => format!("no browser at {chromium}"),
        () if Command::new("node").arg("--version").output().is_err() => "no node".to_owned(),
        () if !packages.exists() => "no packages: run npm ci in tests/browser".to_owned(),
        () => return false,
    };
    skip(&format!("the page in a browser: {missing}"));
    true
}
