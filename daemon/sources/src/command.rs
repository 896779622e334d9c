//! A program that writes images to its standard output.

use crate::ArrivalClock;
use crate::live::{Reading, SensorKind, SensorSource, SourceError, SourceImage};
use scenecast_sensors::{CameraFault, ImageStream, Stamp};
use std::collections::VecDeque;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Size of the buffer of one read, bytes.
const PIECE: usize = 256 << 10;

/// Pieces that wait to be cut into images.
const MAX_PIECES: usize = 64;

/// Length of the last line of the program's messages that is kept, bytes.
const MAX_LINE: usize = 300;

/// Time that a program has to end by itself.
const GRACE: Duration = Duration::from_secs(1);

/// Images that a shell command writes to its standard output, one after the other: MJPEG, PNG, PPM or PGM.
pub struct CommandSource {
    command: String,
    clock: ArrivalClock,
    running: Option<Running>,
    ready: VecDeque<SourceImage>,
}

/// A piece of the output and its time of arrival.
type Piece = (Stamp, Vec<u8>);

struct Running {
    child: Child,
    pieces: Receiver<Piece>,
    stream: ImageStream,
    /// When the image began that is not complete yet.
    begun: Option<Stamp>,
    /// The thread that reads the program's messages.
    messages: Option<JoinHandle<()>>,
    /// The last line that the program wrote to its standard error.
    last_line: Arc<Mutex<String>>,
    /// Bytes between images, and images without an end, that are already reported.
    skipped: u64,
    cut_off: u64,
}

impl CommandSource {
    pub fn new(command: &str, clock: ArrivalClock) -> Self {
        Self { command: command.to_owned(), clock, running: None, ready: VecDeque::new() }
    }

    /// A camera of the system, whose images ffmpeg passes on as they are or encodes as JPEG.
    pub fn of_device(device: &Path, clock: ArrivalClock) -> Self {
        let quoted = device.to_string_lossy().replace('\'', "'\\''");
        let input = "exec ffmpeg -nostdin -loglevel error -f v4l2 -fflags nobuffer -i";
        Self::new(&format!("{input} '{quoted}' -c:v mjpeg -q:v 3 -f image2pipe -"), clock)
    }

    fn spawn(&self) -> std::io::Result<Running> {
        let mut command = Command::new("sh");
        command.arg("-c").arg(&self.command);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // A group of its own, so that the programs that the shell starts are ended with it.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn()?;
        let (sender, pieces) = sync_channel(MAX_PIECES);
        let last_line = Arc::new(Mutex::new(String::new()));
        if let Some(output) = child.stdout.take() {
            let clock = self.clock;
            let read = move || read_pieces(output, clock, &sender);
            std::thread::Builder::new().name("camera output".to_owned()).spawn(read)?;
        }
        let messages = child.stderr.take().map(|messages| {
            let last_line = last_line.clone();
            let read = move || keep_last_line(messages, &last_line);
            std::thread::Builder::new().name("camera messages".to_owned()).spawn(read)
        });
        let messages = messages.transpose()?;
        Ok(Running {
            child,
            pieces,
            stream: ImageStream::default(),
            begun: None,
            messages,
            last_line,
            skipped: 0,
            cut_off: 0,
        })
    }
}

/// Passes the output on until it ends or nobody wants it.
fn read_pieces(mut output: impl Read, clock: ArrivalClock, pieces: &SyncSender<Piece>) {
    let mut buffer = vec![0; PIECE];
    while let Ok(length @ 1..) = output.read(&mut buffer) {
        if pieces.send((clock.now(), buffer[..length].to_vec())).is_err() {
            return;
        }
    }
}

fn keep_last_line(mut messages: impl Read, last_line: &Mutex<String>) {
    let (mut buffer, mut line) = ([0; 4096], Vec::new());
    while let Ok(length @ 1..) = messages.read(&mut buffer) {
        for &byte in &buffer[..length] {
            // Programs redraw their line of progress with a carriage return.
            if byte != b'\n' && byte != b'\r' {
                if line.len() < MAX_LINE {
                    line.push(byte);
                }
            } else if !line.is_empty() {
                let text = String::from_utf8_lossy(&line).trim().to_owned();
                *last_line.lock().unwrap_or_else(PoisonError::into_inner) = text;
                line.clear();
            }
        }
    }
}

impl Running {
    /// Why the program's output has ended.
    fn end(&mut self) -> SourceError {
        let until = Instant::now() + GRACE;
        let mut status = self.child.try_wait();
        let is_read = |running: &Self| running.messages.as_ref().is_none_or(JoinHandle::is_finished);
        while (matches!(status, Ok(None)) || !is_read(self)) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(10));
            status = self.child.try_wait();
        }
        let how = match status {
            Ok(Some(status)) => format!("the command ended with {status}"),
            Ok(None) => "the command has closed its output".to_owned(),
            Err(error) => format!("the command is lost: {error}"),
        };
        let line = self.last_line.lock().unwrap_or_else(PoisonError::into_inner);
        SourceError(if line.is_empty() { how } else { format!("{how}: {line}") })
    }

    /// Ends the program and all that it has started.
    fn stop(&mut self) {
        self.signal(Signal::Terminate);
        let until = Instant::now() + GRACE;
        while Instant::now() < until && matches!(self.child.try_wait(), Ok(None)) {
            std::thread::sleep(Duration::from_millis(10));
        }
        self.signal(Signal::Kill);
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    #[cfg(unix)]
    fn signal(&self, signal: Signal) {
        use nix::sys::signal::{Signal as Number, killpg};
        let number = match signal {
            Signal::Terminate => Number::SIGTERM,
            Signal::Kill => Number::SIGKILL,
        };
        if let Ok(group) = i32::try_from(self.child.id()) {
            let _ = killpg(nix::unistd::Pid::from_raw(group), number);
        }
    }

    #[cfg(not(unix))]
    fn signal(&self, _: Signal) {}
}

#[derive(Debug, Clone, Copy)]
enum Signal {
    Terminate,
    Kill,
}

impl SensorSource for CommandSource {
    fn kind(&self) -> SensorKind {
        SensorKind::Camera
    }

    fn open(&mut self) -> Result<(), SourceError> {
        self.close();
        let running = self.spawn().map_err(|e| SourceError(format!("the command does not start: {e}")))?;
        self.running = Some(running);
        Ok(())
    }

    fn next(
        &mut self,
        timeout: Duration,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Result<Option<Reading>, SourceError> {
        let until = Instant::now() + timeout;
        let Some(running) = &mut self.running else { return Err(SourceError("the command is not open".to_owned())) };
        loop {
            if let Some(image) = self.ready.pop_front() {
                return Ok(Some(Reading::Image(image)));
            }
            match running.pieces.recv_timeout(until.saturating_duration_since(Instant::now())) {
                Ok((arrival, bytes)) => {
                    running.stream.handle_bytes(&bytes);
                    let mut began = running.begun.take().unwrap_or(arrival);
                    while let Some(image) = running.stream.poll_image() {
                        self.ready.push_back(SourceImage::compressed(None, began, image));
                        began = arrival;
                    }
                    running.begun = running.stream.is_within_image().then_some(began);
                    let cut_off = running.stream.cut_off();
                    for _ in std::mem::replace(&mut running.cut_off, cut_off)..cut_off {
                        running.skipped = running.stream.skipped();
                        fault(CameraFault::CutOff, "another image began before the end of this one".to_owned());
                    }
                    let skipped = running.stream.skipped();
                    if skipped > running.skipped && self.ready.is_empty() {
                        let bytes = skipped - running.skipped;
                        running.skipped = skipped;
                        fault(CameraFault::Unreadable, format!("{bytes} bytes of the output belong to no image"));
                    }
                }
                Err(RecvTimeoutError::Timeout) => return Ok(None),
                Err(RecvTimeoutError::Disconnected) => {
                    if running.stream.is_within_image() {
                        fault(CameraFault::CutOff, "the output ended within an image".to_owned());
                    }
                    return Err(running.end());
                }
            }
        }
    }

    fn is_reopened_after_stall(&self) -> bool {
        true
    }

    fn close(&mut self) {
        if let Some(mut running) = self.running.take() {
            running.stop();
        }
    }
}

impl Drop for CommandSource {
    fn drop(&mut self) {
        self.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Picture;

    const LONG: Duration = Duration::from_secs(30);

    fn opened(command: &str) -> CommandSource {
        let mut source = CommandSource::new(command, ArrivalClock::start());
        source.open().unwrap();
        source
    }

    /// The images of a command until it ends, the faults, and the end.
    fn all(command: &str) -> (Vec<SourceImage>, Vec<CameraFault>, String) {
        let (mut source, mut images, mut faults) = (opened(command), Vec::new(), Vec::new());
        loop {
            match source.next(LONG, &mut |fault, _| faults.push(fault)) {
                Ok(Some(Reading::Image(image))) => images.push(image),
                Ok(_) => {}
                Err(error) => return (images, faults, error.to_string()),
            }
        }
    }

    #[test]
    fn images_are_read_until_the_command_ends() {
        let command = "printf 'P6 1 1 255\\nabc'; printf 'P6\\n# stamp=12.5\\n1 1 255\\ndef'; echo no lens >&2; exit 3";
        let (images, faults, end) = all(command);
        assert_eq!(images[0].picture, Picture::Compressed(b"P6 1 1 255\nabc".to_vec()));
        assert_eq!(images.iter().map(|image| image.stamp).collect::<Vec<_>>(), [None, Stamp::parse("12.5")]);
        assert_eq!(faults, []);
        assert_eq!(end, "the command ended with exit status: 3: no lens");
    }

    #[test]
    fn an_image_that_is_cut_off_is_counted() {
        let (images, faults, end) = all("printf 'P6 1 1 255\\nab'");
        assert_eq!((images.len(), faults), (0, vec![CameraFault::CutOff]));
        assert_eq!(end, "the command ended with exit status: 0");
    }

    #[test]
    fn a_half_jpeg_before_another_image_is_counted() {
        let (half, whole) = (r"\377\330\377\332\0\2abc", r"\377\330\377\332\0\2abc\377\331");
        let (images, faults, _) = all(&format!("printf '{half}{whole}{half}{half}{whole}'"));
        assert_eq!((images.len(), faults), (2, vec![CameraFault::CutOff; 3]));
    }

    #[test]
    fn programs_that_the_shell_started_end_with_the_source() {
        let mut source = opened("sleep 600 & echo $! >&2; wait");
        let last_line = source.running.as_ref().unwrap().last_line.clone();
        let pid = loop {
            if let Ok(pid) = last_line.lock().unwrap().parse::<i32>() {
                break nix::unistd::Pid::from_raw(pid);
            }
            std::thread::yield_now();
        };
        assert_eq!(source.next(Duration::ZERO, &mut |_, _| ()).unwrap(), None);
        source.close();
        let is_gone = || match std::fs::read_to_string(format!("/proc/{pid}/stat")) {
            // A process that nobody has waited for yet is a zombie.
            Ok(stat) => stat.rsplit(')').next().is_some_and(|rest| rest.trim_start().starts_with('Z')),
            Err(_) => true,
        };
        let until = Instant::now() + LONG;
        while !is_gone() && Instant::now() < until {
            std::thread::yield_now();
        }
        assert!(is_gone());
    }
}
