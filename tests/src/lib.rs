//! Harness of the whole-system tests.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// The `scenecast` command, built like the tests themselves.
pub fn scenecast() -> Command {
    static BINARY: OnceLock<PathBuf> = OnceLock::new();
    Command::new(BINARY.get_or_init(build))
}

fn build() -> PathBuf {
    let test = std::env::current_exe().expect("a test has a path");
    let profile = test.parent().and_then(Path::parent).expect("target/PROFILE/deps/TEST");
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--package", "scenecast", "--bin", "scenecast", "--quiet"]);
    if profile.ends_with("release") {
        cargo.arg("--release");
    }
    cargo.current_dir(workspace()).env("CARGO_TARGET_DIR", profile.parent().expect("target"));
    assert!(cargo.status().expect("cargo runs").success(), "scenecast does not build");
    profile.join("scenecast")
}

/// The project's folder.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("tests/ has a parent").to_owned()
}

/// The shared test material, if this machine has it; says in the output if not.
pub fn shared_data() -> Option<PathBuf> {
    let dir = workspace().join("../shared/data");
    if !dir.is_dir() {
        println!("skipped: ../shared/data is not on this machine");
        return None;
    }
    Some(dir)
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

/// A process that ends with the test.
pub struct Process(Child);

impl Process {
    /// Starts `scenecast`.
    pub fn start(arguments: &[&str]) -> Self {
        let child = scenecast().args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        Self(child.expect("scenecast starts"))
    }

    /// Kills it as a power cut would.
    pub fn kill(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }

    /// Asks it to read its configuration again.
    pub fn hang_up(&self) {
        let sent = Command::new("kill").args(["-HUP", &self.0.id().to_string()]).status();
        assert!(sent.is_ok_and(|s| s.success()), "the process can be signalled");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Waits for processes until `done`; fails after `limit`.
pub fn wait_until(what: &str, limit: Duration, mut done: impl FnMut() -> bool) {
    let began = Instant::now();
    while !done() {
        assert!(began.elapsed() < limit, "{what}: not within {limit:?}");
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// A port of this machine that nobody listens on.
pub fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    listener.local_addr().expect("it has an address").port()
}

/// One HTTP request; status and body, `None` while nobody answers.
pub fn http(port: u16, method: &str, path: &str, headers: &str, body: &str) -> Option<(u16, Vec<u8>)> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    stream.set_read_timeout(Some(Duration::from_secs(10))).ok()?;
    let length = body.len();
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: close\r\nContent-Length: {length}\r\n"
    );
    stream.write_all(format!("{head}{headers}\r\n{body}").as_bytes()).ok()?;
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).ok()?;
    let split = answer.windows(4).position(|w| w == b"\r\n\r\n")?;
    let status = std::str::from_utf8(answer.get(9..12)?).ok()?.parse().ok()?;
    Some((status, answer.split_off(split + 4)))
}
