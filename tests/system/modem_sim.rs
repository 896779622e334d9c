//! `scenecast modem-sim` as somebody sees it who knows nothing of it but a device or a TCP port.

use scenecast_tests::{assert_refused, end, scenecast, scratch, wait_until};
use serialport::TTYPort;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

const SCENARIO: &str = r#"
[[modem]]
name = "ship"
kind = "s2c"
address = 1
port = "tcp:127.0.0.1:0"
[[modem]]
name = "auv"
kind = "s2c"
address = 2
position_m = [300, 0, 10]
"#;

/// A running emulation, twenty times as fast as the world.
struct Emulation {
    child: Child,
    told: BufReader<std::process::ChildStdout>,
    links: PathBuf,
}

impl Emulation {
    fn start(name: &str) -> Self {
        let folder = scratch(name);
        let (file, links) = (folder.join("scenario.toml"), folder.join("links"));
        std::fs::write(&file, SCENARIO).unwrap();
        let mut command = scenecast();
        command.arg("modem-sim").arg("--scenario").arg(&file).arg("--link-dir").arg(&links);
        command.args(["--time-scale", "20"]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let told = BufReader::new(child.stdout.take().unwrap());
        Self { child, told, links }
    }

    /// The words of the next line printed.
    fn line(&mut self) -> Vec<String> {
        let mut line = String::new();
        self.told.read_line(&mut line).unwrap();
        line.split_whitespace().map(str::to_owned).collect()
    }

    fn order(&mut self, line: &str) {
        writeln!(self.child.stdin.as_mut().unwrap(), "{line}").unwrap();
    }

    fn open(&self, name: &str) -> TTYPort {
        let path = self.links.join(name).display().to_string();
        let port = serialport::new(path, 19_200).timeout(Duration::from_millis(50)).open_native().unwrap();
        // Until the emulation has noticed it, it takes the line for one that nobody reads.
        std::thread::sleep(Duration::from_millis(100));
        port
    }
}

impl Drop for Emulation {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads until `end` was told, for five seconds at most.
fn hear(port: &mut impl Read, end: &str) -> String {
    let (mut told, mut buffer, began) = (Vec::new(), [0; 1024], Instant::now());
    while began.elapsed() < Duration::from_secs(5) {
        match port.read(&mut buffer) {
            Ok(0) => break,
            Ok(count) => told.extend_from_slice(&buffer[..count]),
            Err(_) => {}
        }
        if String::from_utf8_lossy(&told).contains(end) {
            break;
        }
    }
    String::from_utf8_lossy(&told).into_owned()
}

fn ask(port: &mut (impl Read + Write), line: &str, answer: &str) {
    port.write_all(line.as_bytes()).unwrap();
    assert_eq!(hear(port, answer), answer, "{line:?}");
}

fn client(address: &str) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
    stream
}

#[test]
fn hosts_at_a_device_and_at_a_tcp_port_hear_each_other() {
    let mut emulation = Emulation::start("modem-sim-hosts");
    let ship = emulation.line();
    let auv = emulation.line();
    assert_eq!((ship[0].as_str(), auv[0].as_str()), ("ship", "auv"));
    assert_eq!(std::fs::read_link(&auv[2]).unwrap(), Path::new(&auv[1]));
    let (mut asker, mut watcher) = (client(&ship[1]), client(&ship[1]));
    let mut vehicle = emulation.open("auv");
    ask(&mut asker, "+++AT?MODE\n", "ERROR WRONG FORMAT\r\n");
    ask(&mut asker, "AT?MODE\n", "NET\r\n");
    ask(&mut vehicle, "AT?MODE\r", "NET\r\n");
    asker.write_all(b"AT*SENDIM,5,2,ack,a\r\nb+\n").unwrap();
    assert_eq!(hear(&mut asker, "DELIVEREDIM,2\r\n"), "OK\r\nDELIVEREDIM,2\r\n");
    assert_eq!(hear(&mut watcher, "DELIVEREDIM,2\r\n"), "DELIVEREDIM,2\r\n", "notifications without others' answers");
    let heard = hear(&mut vehicle, "b+\r\n");
    assert!(heard.starts_with("RECVIM,5,1,2,ack,") && heard.ends_with(",a\r\nb+\r\n"), "{heard}");
    // A client that comes back finds the line as it was, without what was said meanwhile.
    drop(vehicle);
    asker.write_all(b"AT*SENDIM,4,2,ack,lost\n").unwrap();
    assert!(hear(&mut asker, "DELIVEREDIM,2\r\n").contains("DELIVEREDIM"));
    let mut vehicle = emulation.open("auv");
    ask(&mut vehicle, "AT?AL\r", "2\r\n");
    // A reboot closes the TCP connections, and the port is there again.
    asker.write_all(b"ATZ0\n").unwrap();
    let closed = |stream: &mut TcpStream| matches!(stream.read(&mut [0; 64]), Ok(0));
    wait_until("both clients lose their connection", || closed(&mut asker) && closed(&mut watcher));
    wait_until("the modem is back", || {
        let mut again = client(&ship[1]);
        again.write_all(b"AT?AL\n").is_ok() && again.read(&mut [0; 8]).is_ok_and(|count| count > 0)
    });
}

#[test]
fn an_unplugged_device_returns_and_links_end_with_the_run() {
    let mut emulation = Emulation::start("modem-sim-unplug");
    emulation.line();
    emulation.line();
    let mut vehicle = emulation.open("auv");
    ask(&mut vehicle, "AT?AL\r", "2\r\n");
    let link = emulation.links.join("auv");
    emulation.order("fault auv unplug 20");
    wait_until("the link is gone", || link.symlink_metadata().is_err());
    assert!(vehicle.write_all(b"AT?AL\r").and_then(|()| vehicle.read_exact(&mut [0; 3])).is_err());
    assert_eq!(emulation.line()[0], "auv");
    drop(vehicle);
    ask(&mut emulation.open("auv"), "AT?AL\r", "2\r\n");
    assert_eq!(end(&mut emulation.child, "TERM"), Some(0));
    assert!(link.symlink_metadata().is_err());
}

#[test]
fn a_wrong_scenario_is_refused_with_its_line() {
    let file = scratch("modem-sim-wrong").join("wrong.toml");
    std::fs::write(&file, SCENARIO.replace("position_m", "position")).unwrap();
    let path = file.display().to_string();
    assert_refused(&["modem-sim", "--scenario", &path], &["wrong.toml:11", "modem.position", "position_m"]);
    assert_refused(&["modem-sim", "--scenario", &path, "--time-scale", "0"], &["--time-scale 0", "0.01 to 1000"]);
}
