//! Both ends as processes of this machine.

use scenecast_core::UserError;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Mission seconds for each second of the clock.
pub(super) const TIME_SCALE: f64 = 20.0;

/// One of the two ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    Vehicle,
    Surface,
}

/// The signal that ends a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// SIGKILL, as when its power fails.
    Kill,
    /// SIGTERM, as when systemd stops it.
    Terminate,
}

/// The disk that a process has from its start to its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Disk {
    Sound,
    /// It takes no bytes, though files can be made.
    Full,
    /// No file can be written, made or removed.
    ReadOnly,
}

impl Disk {
    /// The command of a shell that runs its arguments with this disk; `None` if it needs none. The superuser writes
    /// read-only files too, unless he drops that capability.
    fn command(self) -> Option<&'static str> {
        match self {
            Self::Sound => None,
            Self::Full => Some("trap '' XFSZ; ulimit -f 0; exec \"$0\" \"$@\""),
            Self::ReadOnly => {
                Some("[ $(id -u) = 0 ] || exec \"$0\" \"$@\"; exec setpriv --bounding-set -dac_override \"$0\" \"$@\"")
            }
        }
    }
}

/// Further sections of the configurations, TOML.
#[derive(Debug, Clone, Default)]
pub(super) struct MoreSettings {
    pub(super) vehicle: String,
    pub(super) surface: String,
}

/// The folder, the ports and the processes of a run.
pub(super) struct Ends {
    program: PathBuf,
    dir: PathBuf,
    page: u16,
    vehicle: Option<Child>,
    surface: Option<Child>,
}

impl Ends {
    /// Prepares both ends in an empty folder, with free ports for the link and the page; the vehicle plays the frames of
    /// `recording`.
    pub(super) fn new(
        program: &Path,
        dir: &Path,
        recording: &Path,
        ports: [u16; 2],
        more: &MoreSettings,
    ) -> io::Result<Self> {
        if dir.exists() {
            fs::remove_dir_all(dir)?;
        }
        fs::create_dir_all(dir)?;
        let [modem, page] = ports;
        let runtime = |name: &str| {
            let state = toml_text(&dir.join(name));
            format!("[runtime]\ntime_scale = {TIME_SCALE}\nstate_dir = {state}\n[modem]\n")
        };
        let surface =
            format!("{}listen = \"127.0.0.1:{modem}\"\n[console]\nlisten = \"127.0.0.1:{page}\"\n", runtime("surface"));
        let frames = format!("frames:{}", recording.display());
        let vehicle = format!(
            "{}connect = \"127.0.0.1:{modem}\"\n[camera]\nsource = {}\n[scene]\ncheckpoint_s = 2\n",
            runtime("vehicle"),
            toml_text(Path::new(&frames))
        );
        fs::write(dir.join("surface.toml"), surface + &more.surface)?;
        fs::write(dir.join("vehicle.toml"), vehicle + &more.vehicle)?;
        Ok(Self { program: program.to_owned(), dir: dir.to_owned(), page, vehicle: None, surface: None })
    }

    pub(super) fn page(&self) -> u16 {
        self.page
    }

    /// The folder of an end's state.
    pub(super) fn state_dir(&self, end: End) -> PathBuf {
        self.dir.join(name(end))
    }

    /// The log of an end, over all its restarts.
    pub(super) fn log(&self, end: End) -> io::Result<String> {
        fs::read_to_string(self.dir.join(format!("{}.log", name(end))))
    }

    /// Starts an end, which has `disk` until it is stopped.
    pub(super) fn start(&mut self, end: End, disk: Disk) -> io::Result<()> {
        let command = match end {
            End::Vehicle => "auv",
            End::Surface => "asv",
        };
        if disk == Disk::ReadOnly {
            self.set_writable(end, false)?;
        }
        let config = self.dir.join(format!("{}.toml", name(end)));
        let mut process = match disk.command() {
            None => Command::new(&self.program),
            Some(shell_command) => {
                let mut shell = Command::new("sh");
                shell.args(["-c", shell_command]).arg(&self.program);
                shell
            }
        };
        process.arg(command).arg("--config").arg(config).stdin(Stdio::null()).stdout(Stdio::null());
        // A full disk would hold for the log too.
        process.stderr(if disk == Disk::Full { Stdio::null() } else { self.open_log(end)?.into() });
        let child = process.env("RUST_LOG", "info").spawn()?;
        *self.child(end) = Some(child);
        Ok(())
    }

    fn set_writable(&self, end: End, is_writable: bool) -> io::Result<()> {
        let mode = if is_writable { "u+w" } else { "a-w" };
        let changed = Command::new("chmod").args(["-R", mode]).arg(self.state_dir(end)).status()?;
        changed.success().then_some(()).ok_or_else(|| io::Error::other("chmod has failed"))
    }

    fn open_log(&self, end: End) -> io::Result<File> {
        OpenOptions::new().create(true).append(true).open(self.dir.join(format!("{}.log", name(end))))
    }

    /// Ends a process and waits for it.
    pub(super) fn stop(&mut self, end: End, how: Stop) -> io::Result<()> {
        let Some(mut child) = self.child(end).take() else { return Ok(()) };
        match how {
            Stop::Kill => child.kill()?,
            Stop::Terminate => drop(Command::new("kill").arg("-TERM").arg(child.id().to_string()).status()?),
        }
        child.wait()?;
        self.set_writable(end, true)
    }

    /// Makes the surface forget everything, for a comparison with a surface without a past.
    pub(super) fn forget_surface(&self) -> io::Result<()> {
        fs::remove_dir_all(self.state_dir(End::Surface))
    }

    fn child(&mut self, end: End) -> &mut Option<Child> {
        match end {
            End::Vehicle => &mut self.vehicle,
            End::Surface => &mut self.surface,
        }
    }
}

impl Drop for Ends {
    fn drop(&mut self) {
        for end in [End::Vehicle, End::Surface] {
            // It has ended already, or ends with this program.
            let _ = self.stop(end, Stop::Kill);
        }
    }
}

fn name(end: End) -> &'static str {
    match end {
        End::Vehicle => "vehicle",
        End::Surface => "surface",
    }
}

fn toml_text(path: &Path) -> String {
    format!("{:?}", path.display().to_string())
}

impl From<End> for &'static str {
    fn from(end: End) -> Self {
        name(end)
    }
}

/// The error for a person.
pub(super) fn failed(what: &str) -> impl Fn(io::Error) -> UserError + '_ {
    move |e| UserError::Failed(format!("{what}: {e}"))
}
