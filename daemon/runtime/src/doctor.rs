//! Looks at the port of a modem that does not get ready, and says what to do.

use crate::clock::Clock;
use crate::modem::{advice, not_there};
use crate::port::{FromPort, Opened, Port, open};
use scenecast_config::{Config, ModemKind};
use scenecast_core::{PortAddress, SerialLine, UserError, outln};
use scenecast_drivers::modem::{Driver, Event, PortFinding, PortListener, Speaker, driver, modem_of_process};
use scenecast_protocol::wire::Address;
use std::io;
use std::time::Duration;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::time::{Instant, timeout, timeout_at};

/// Time in which a modem gets ready, or something else is heard.
const LISTEN_TIME: Duration = Duration::from_secs(10);
/// Time for an answer at each speed.
const ANSWER_TIME: Duration = Duration::from_millis(1500);
/// Speeds of serial lines that modems are delivered with, the most frequent first.
const BAUDS: [u32; 6] = [19_200, 9600, 115_200, 38_400, 57_600, 4800];
/// What an S2C modem answers without a change: its state.
const S2C_QUESTION: &[u8] = b"+++AT?S\r\n";
/// What a Micromodem answers without a change: its address.
const MICROMODEM_QUESTION: &[u8] = b"$CCCFQ,SRC*3A\r\n";

/// What was heard from a modem.
enum Heard {
    Ready,
    /// It refuses a setting: what a person must change.
    Refused(String),
    Wrong(PortFinding),
    /// The port was closed at the end.
    Closed,
}

/// Looks at the port of an end's modem; a line for each step, and an error that says what to do.
///
/// # Errors
/// The port cannot be opened, or no modem of the configured kind gets ready there.
pub fn check_modem(config: &Config, end: Address) -> Result<(), UserError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    runtime.map_err(|e| UserError::Failed(format!("threads: {e}")))?.block_on(check(config, end))
}

async fn check(config: &Config, end: Address) -> Result<(), UserError> {
    let place = scenecast_config::modem_port(config)?;
    outln!("port: {place}; modem.kind = \"{}\"", config.modem.kind);
    drop(open(&place).await.map_err(|e| not_there(&place, &e))?);
    outln!("it opens; listening for up to {} s", LISTEN_TIME.as_secs());
    let mut driver = driver(config, end, modem_of_process(config, end)?)?;
    let mut port = Port::open_judged("modem", place.clone()).await.map_err(|e| not_there(&place, &e))?;
    let (heard, bytes, frames) = listen(&mut port, config.modem.kind, driver.as_mut()).await;
    // The other speeds are asked by opening the device again.
    port.close().await;
    outln!("{bytes} bytes came in, and {frames} frames");
    match heard {
        Heard::Ready if config.modem.kind.is_pipe() && frames == 0 => {
            outln!(
                "a modem of this kind answers nothing: whether the other end is heard, the page and `scenecast ctl status` say"
            );
            Ok(())
        }
        Heard::Ready => {
            outln!("the modem is ready");
            Ok(())
        }
        Heard::Refused(reason) => Err(UserError::Failed(format!("the modem answers, but {reason}"))),
        Heard::Closed => Err(UserError::Failed(match &place {
            PortAddress::Listen(_) => format!("{place}: nobody has connected"),
            _ => format!("{place}: it was closed again: another program may have it, or no modem is there"),
        })),
        Heard::Wrong(finding) => Err(UserError::Failed(match (&place, &finding) {
            (
                PortAddress::Serial(device, line),
                PortFinding::Silent | PortFinding::NoText | PortFinding::UnknownText(_),
            ) => other_speed(device, *line, config.modem.kind)
                .await
                .unwrap_or_else(|| format!("{}; no modem answers at other speeds either", advice(&finding, &place))),
            _ => advice(&finding, &place),
        })),
    }
}

/// Runs the driver at the port until the modem is ready, something is wrong, or the time is over. Returns the bytes and the frames that
/// came in, too.
async fn listen(port: &mut Port, kind: ModemKind, driver: &mut dyn Driver) -> (Heard, usize, usize) {
    let (clock, mut listener, mut bytes, mut frames) = (Clock::new(1.0), PortListener::new(kind), 0, 0);
    let (end, mut is_open) = (Instant::now() + LISTEN_TIME, false);
    loop {
        let now = clock.now();
        driver.handle_timeout(now);
        while let Some(event) = driver.poll_event() {
            match event {
                // A pipe is ready at once, and is listened to for what comes in.
                Event::Ready if !kind.is_pipe() => return (Heard::Ready, bytes, frames),
                Event::Refused(reason) => return (Heard::Refused(reason), bytes, frames),
                Event::Received(_) => frames += 1,
                _ => {}
            }
        }
        while let Some(out) = driver.poll_output(now) {
            listener.handle_written(&out);
            port.write(out);
        }
        if let Some(finding) = listener.poll(frames > 0, now) {
            return (Heard::Wrong(finding), bytes, frames);
        }
        let wake = [driver.poll_timeout(), listener.poll_timeout()].into_iter().flatten().min();
        let wake = wake.map_or(end, |at| end.min(Instant::now() + at.since(now)));
        match timeout_at(wake, port.next()).await {
            Ok(FromPort::Open) => {
                is_open = true;
                listener.handle_open(clock.now());
                driver.handle_open(clock.now());
            }
            Ok(FromPort::Closed) => {
                is_open = false;
                listener.handle_closed();
                driver.handle_closed(clock.now());
            }
            Ok(FromPort::Bytes(data) | FromPort::Datagram(data, _)) => {
                bytes += data.len();
                listener.handle_bytes(&data);
                driver.handle_bytes(&data, clock.now());
            }
            Err(_) if Instant::now() < end => {}
            Err(_) if !is_open => return (Heard::Closed, bytes, frames),
            Err(_) if kind.is_pipe() && (frames > 0 || bytes == 0) => return (Heard::Ready, bytes, frames),
            Err(_) => return (Heard::Wrong(listener.finding()), bytes, frames),
        }
    }
}

/// Asks at the other usual speeds; the modem that answers, in a line for people.
async fn other_speed(device: &str, configured: SerialLine, kind: ModemKind) -> Option<String> {
    for baud in BAUDS.into_iter().filter(|baud| *baud != configured.baud) {
        outln!("asking at {baud} bit/s");
        let place = PortAddress::Serial(device.to_owned(), SerialLine { baud, ..configured });
        let speaker = match ask(&place, kind).await {
            Ok(Some(speaker)) => speaker,
            Ok(None) => continue,
            Err(e) => {
                outln!("{place}: {e}");
                continue;
            }
        };
        let (make, kind) = match speaker {
            Speaker::S2c => ("an EvoLogics S2C modem", "s2c"),
            Speaker::Micromodem => ("a WHOI Micromodem", "micromodem"),
            Speaker::Gnss | Speaker::Login => return Some(advice(&PortFinding::Speaks(speaker), &place)),
        };
        return Some(format!("{make} answers at {baud} bit/s: set modem.kind = \"{kind}\" and modem.baud = {baud}"));
    }
    None
}

/// Who answers the question of the configured make at a speed.
async fn ask(place: &PortAddress, kind: ModemKind) -> io::Result<Option<Speaker>> {
    let Opened::Serial(mut stream) = open(place).await? else { return Ok(None) };
    let mut listener = PortListener::new(kind);
    listener.handle_open(Clock::new(1.0).now());
    let question = match kind {
        ModemKind::S2c => S2C_QUESTION,
        ModemKind::Micromodem | ModemKind::Transparent | ModemKind::Tcp | ModemKind::Udp => MICROMODEM_QUESTION,
    };
    listener.handle_written(question);
    stream.write_all(question).await?;
    let (end, mut buffer) = (Instant::now() + ANSWER_TIME, [0; 256]);
    while listener.speaker().is_none() {
        match timeout(end.saturating_duration_since(Instant::now()), stream.read(&mut buffer)).await {
            Ok(Ok(n)) if n > 0 => listener.handle_bytes(buffer.get(..n).unwrap_or_default()),
            _ => break,
        }
    }
    Ok(listener.speaker())
}
