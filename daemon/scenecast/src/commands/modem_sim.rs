//! `scenecast modem-sim`

use clap::Args;
use scenecast_core::UserError;
use scenecast_modem_sim::{Options, run};
use std::path::PathBuf;

/// Emulate modems in one channel, each on a serial device or a TCP port of its own.
///
/// Prints one line for each modem: its name, its device or TCP address, and its link. It reads commands from the
/// standard input, such as "fault auv reboot" or "move auv 500 0 20"; "help" lists them. Ctrl-C ends it.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: scenecast modem-sim --scenario config/scenarios/modems-s2c-1km.toml --link-dir /tmp/modems, then open /tmp/modems/auv at 19200 baud"
)]
pub(super) struct ModemSim {
    /// Scenario: modems, channel and faults (docs/reference/modem-scenarios.md)
    #[arg(long, value_name = "FILE")]
    scenario: PathBuf,
    /// Folder for symbolic links NAME to the devices; they remain when devices are replaced
    #[arg(long, value_name = "DIR")]
    link_dir: Option<PathBuf>,
    /// Speed of the emulation relative to real time; set runtime.time_scale of both ends to the same value
    #[arg(long, value_name = "X", default_value_t = 1.0, allow_negative_numbers = true)]
    time_scale: f64,
    /// Seed of all random numbers [default: the scenario's]
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
}

impl ModemSim {
    pub(super) fn run(self) -> Result<(), UserError> {
        if !(0.01..=1000.0).contains(&self.time_scale) {
            return Err(UserError::Input(format!(
                "--time-scale {} is not allowed; allowed: 0.01 to 1000",
                self.time_scale
            )));
        }
        let Self { scenario, link_dir, time_scale, seed } = self;
        run(Options { scenario, link_dir, time_scale, seed })
    }
}
