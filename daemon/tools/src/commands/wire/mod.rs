//! `scenecast wire`

mod capture;
mod fields;
mod line;

use capture::{Capture, CaptureError, Captured};
use clap::{Args, Subcommand};
use line::FrameLine;
use scenecast_config::{read_key, read_regular};
use scenecast_core::{Takes, UserError, errln};
use scenecast_files::{RecordedFrames, is_record};
use scenecast_protocol::MissionId;
use scenecast_protocol::seal::HeldKey;
use scenecast_protocol::wire::Listener;
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

/// The largest input: an hour of a fast modem has about a megabyte.
const MAX_INPUT_BYTES: u64 = 1 << 26;

/// Show what frames on the wire say.
#[derive(Debug, Subcommand)]
pub enum Wire {
    Decode(Decode),
}

/// Print the frames of a capture, of a record or of a text, a line each.
///
/// A capture (pcap, pcapng) has them in UDP datagrams, or as packets of the link type User 0; a record of a mission has those that its
/// end has sent and received; a text has the hexadecimal digits of a
/// frame in each line. With --mission the CRC of each frame is checked, with --key its tag; a CRC proves no sender. The hellos of both
/// ends must be among the frames. --json has all bytes, too.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Decode {
    /// Capture, record (a file or its folder) or text; - reads the standard input
    #[arg(value_name = "FILE")]
    input: PathBuf,
    /// Mission, mission.id of the configuration: decimal, or hexadecimal after 0x
    #[arg(long, value_name = "ID", value_parser = mission)]
    mission: Option<MissionId>,
    /// Key file of the mission or of the vehicle
    #[arg(long, value_name = "FILE", requires = "mission")]
    key: Option<PathBuf>,
    /// Take datagrams from or to this UDP port alone [default: of all ports]
    #[arg(long, value_name = "PORT", value_parser = clap::value_parser!(u16).range(1..))]
    port: Option<u16>,
    /// Print a JSON object for each frame
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "Example: scenecast wire decode frames.pcap --mission 0x5CE70001\n         \
                        echo 8c0fc0de000001000805aecd | scenecast wire decode -";

fn mission(text: &str) -> Result<MissionId, Takes> {
    let parsed = match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    parsed.map(MissionId).map_err(|_| Takes("allowed: 0 to 4294967295, or 0x0 to 0xFFFFFFFF"))
}

impl Wire {
    pub fn run(self) -> Result<(), UserError> {
        match self {
            Self::Decode(decode) => decode.run(),
        }
    }
}

impl Decode {
    fn run(self) -> Result<(), UserError> {
        let Capture { frames, fault } = self.read()?;
        let mut listener = match self.mission {
            Some(mission) => Some(Listener::new(mission, self.keys()?)),
            None => None,
        };
        let began_s = frames.iter().find_map(|frame| frame.time_s).unwrap_or(0.0);
        let mut out = io::stdout().lock();
        for (number, frame) in (1..).zip(&frames) {
            let time_s = frame.time_s.map(|time_s| time_s - began_s);
            let line = FrameLine::of(number, time_s, frame, listener.as_mut());
            let written = if self.json { writeln!(out, "{}", line.to_json()) } else { writeln!(out, "{line}") };
            match written {
                Ok(()) => {}
                // The reader has seen enough.
                Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(()),
                Err(error) => return Err(UserError::Failed(format!("standard output: {error}"))),
            }
        }
        fault.map_or(Ok(()), |fault| Err(UserError::file(&self.input, fault)))
    }

    fn read(&self) -> Result<Capture, UserError> {
        if self.input != Path::new("-") && is_record(&self.input) {
            let RecordedFrames { frames, damage } = RecordedFrames::read(&self.input)?;
            let captured = |(nanos, bytes)| Captured { time_s: Some(nanos as f64 / 1e9), bytes, is_cut: false };
            let frames = frames.into_iter().map(captured).collect();
            return Ok(Capture { frames, fault: damage.map(CaptureError::Record) });
        }
        Ok(capture::frames(&read_input(&self.input)?, self.port))
    }

    fn keys(&self) -> Result<Vec<HeldKey>, UserError> {
        let Some(path) = &self.key else { return Ok(Vec::new()) };
        let (file, warning) = read_key(path)?;
        if let Some(warning) = warning {
            errln!("scenecast: {warning}");
        }
        Ok([file.key].into_iter().chain(file.next.map(HeldKey::Mission)).collect())
    }
}

fn read_input(path: &Path) -> Result<Vec<u8>, UserError> {
    if path != Path::new("-") {
        return read_regular(path, MAX_INPUT_BYTES);
    }
    let mut bytes = Vec::new();
    let read = io::stdin().lock().take(MAX_INPUT_BYTES + 1).read_to_end(&mut bytes);
    read.map_err(|e| UserError::Failed(format!("standard input: {e}")))?;
    if bytes.len() as u64 > MAX_INPUT_BYTES {
        return Err(UserError::Input(format!("standard input: more than {} MB", MAX_INPUT_BYTES >> 20)));
    }
    Ok(bytes)
}
